#include "solve/newton.hpp"

#include <algorithm>
#include <cmath>

#include "model/models.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
Newton<Model>::Newton(const Robot& robot, int obstacles)
    : chain(robot, obstacles),
      hessian_(robot.segments, 0),
      contacts_(robot.segments, 0),
      step_(robot.segments, 0),
      correction_(step_) {
  trial_.controls.resize(robot.segments);
}

template <class Model>
void Newton<Model>::enter(std::span<const Obstacle<Model::kSpace>> obstacles) {
  chain.enter(obstacles);
  const int segments = chain.robot().segments, mounts = chain.mounts();
  if (step_.mounts.size() == static_cast<std::size_t>(mounts)) return;
  const std::int64_t work = this->work();
  hessian_ = Hessian<Model>(segments, mounts);
  hessian_.factorizations = work;
  contacts_ = Contacts<Model>(segments, mounts);
  step_ = correction_ = Direction<Model>(segments, mounts);
  trial_.mounts.resize(mounts);
}

template <class Model>
bool Newton<Model>::equilibrium(const ActiveSet& active) const {
  double worst = 0;
  for (const auto& g : chain.gradient())
    for (const double slope : g.v) worst = std::max(worst, std::abs(slope));
  const double arm = chain.robot().max_length / chain.robot().segments;
  for (const auto& g : chain.mount_gradient()) worst = std::max(worst, arm * norm(g));
  return worst <= chain.tolerance(active) && on_surface(active, kFeasibility);
}

// Exact curvature where it is positive; else a penalty on the active gaps, which leaves the solution where it is.
template <class Model>
bool Newton<Model>::convex(const ActiveSet& active, int penalties) {
  damping_ = 0;
  double strength = kPenalty;
  for (int attempt = 0; attempt < (active.count > 0 ? penalties : 1); ++attempt, strength *= kPenaltyGrowth) {
    hessian_.shape(chain, active, strength);
    if (hessian_.factor(0)) return true;
  }
  return false;
}

// Else damping, which only shortens the way there; tried from a little less than what was needed last.
template <class Model>
bool Newton<Model>::convexify(const ActiveSet& active, int penalties) {
  return convex(active, penalties) || damp();
}

template <class Model>
bool Newton<Model>::damp() {
  damping_ = std::max(kDamping * hessian_.steepest(), needed_ / (kDampingGrowth * kDampingGrowth));
  for (int attempt = 0; attempt < kDampingTries; ++attempt, damping_ *= kDampingGrowth)
    if (hessian_.factor(damping_)) {
      needed_ = damping_;
      return true;
    }
  return false;
}

template <class Model>
double Newton<Model>::size(const Direction<Model>& step) const {
  double longest = 0;
  for (const auto& d : step.states)
    for (int k = 0; k < Model::kSpace; ++k) longest = std::max(longest, std::abs(d[k]));
  longest /= chain.robot().max_length;
  for (const auto& d : step.mounts) longest = std::max(longest, norm(d) / chain.robot().max_length);
  for (const auto& d : step.controls)
    for (const double part : d.v) longest = std::max(longest, std::abs(part));
  return longest;
}

template <class Model>
double Newton<Model>::merit(double weight) const {
  double violation = 0;
  for (const int contact : chain.near()) violation += std::max(0.0, -chain.gaps()[contact]);
  return chain.energy() + weight * violation;
}

namespace {

template <class Model>
void advance(const Iterate<Model>& from, double scale, const Direction<Model>& step, Iterate<Model>& to) {
  for (std::size_t i = 0; i < from.controls.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) to.controls[i][k] = from.controls[i][k] + scale * step.controls[i][k];
  for (std::size_t m = 0; m < from.mounts.size(); ++m)
    for (int k = 0; k < Model::kSpace; ++k) to.mounts[m][k] = from.mounts[m][k] + scale * step.mounts[m][k];
}

// Multipliers a fraction of the way from one set to another.
void blend(const ActiveSet& from, double scale, ActiveSet& to) {
  if (scale == 1) return;
  for (int j = 0; j < to.count; ++j) {
    double before = 0;
    for (int k = 0; k < from.count; ++k)
      if (from.contact[k] == to.contact[j]) before = from.multiplier[k];
    to.multiplier[j] = before + scale * (to.multiplier[j] - before);
  }
}

}  // namespace

// Length of the step that lowers the l1 merit, with the chain evaluated there as `trial_`; 0 when there is none.
// Close to the solution the curvature of the gaps makes the merit reject good steps: Newton is trusted there.
template <class Model>
double Newton<Model>::search(const Iterate& at, const ActiveSet& target, double& weight) {
  trial_.command = at.command;
  if (size_ <= kDescentCap) {
    advance(at, 1, step_, trial_);
    if (chain.evaluate(trial_)) return 1;
    return 0;
  }
  double slope = 0;  // of the energy along the step
  for (std::size_t i = 0; i < step_.controls.size(); ++i) slope += dot(chain.gradient()[i], step_.controls[i]);
  for (std::size_t m = 0; m < step_.mounts.size(); ++m) slope += dot(chain.mount_gradient()[m], step_.mounts[m]);
  for (int j = 0; j < at.active.count; ++j)
    slope += at.active.multiplier[j] * chain.slope(at.active.contact[j]).along(step_);
  for (int j = 0; j < target.count; ++j) weight = std::max(weight, 2 * target.multiplier[j]);
  const double before = merit(weight);
  const double expected = std::min(slope - (before - chain.energy()), 0.0);
  double scale = std::min(1.0, kNewtonCap / size_);
  for (int backtracks = 0; backtracks <= kBacktracks; ++backtracks, scale /= 2) {
    advance(at, scale, step_, trial_);
    if (chain.evaluate(trial_) && merit(weight) <= before + kArmijo * scale * expected) return scale;
  }
  return 0;
}

template <class Model>
Verdict Newton<Model>::solve(Iterate& at, int damped) {
  Verdict verdict;
  if (!chain.evaluate(at)) return verdict;
  double weight = 0;
  bool close = false, stable = true;  // the last curvature along the active gaps
  needed_ = 0;
  for (; verdict.iterations <= kNewtonIterations; ++verdict.iterations) {
    chain.reduced_gradient(at.active);
    if (equilibrium(at.active)) {
      verdict.converged = stable || convex(at.active, kPenalties);
      return verdict;
    }
    ActiveSet target = at.active;
    if (close) {  // the last curvature still serves
      close = false;
      if (contacts_.correct(chain, hessian_, target, step_)) {
        advance(at, 1, step_, at);
        at.active = target;
        if (!chain.evaluate(at)) return verdict;
        continue;
      }
      target = at.active;
    }
    stable = convex(at.active, kPenalties);
    if (!stable && (verdict.iterations >= damped || !damp())) return verdict;
    if (!contacts_.solve(chain, hessian_, target, step_)) return verdict;

    size_ = size(step_);
    const double scale = search(at, target, weight);
    if (scale == 0) return verdict;
    std::swap(at.controls, trial_.controls);
    std::swap(at.mounts, trial_.mounts);
    blend(at.active, scale, target);
    at.active = target;
    close = size_ <= kNewtonClose;
  }
  return verdict;
}

template <class Model>
bool Newton<Model>::measure(const Iterate& at) {
  needed_ = 0;
  stretch_ = kStretch;
  creeping_ = false;
  if (!chain.evaluate(at)) return false;
  chain.reduced_gradient(at.active);
  return convexify(at.active, kDescentPenalties) && hessian_.factor(damping_ + kMeasureDamping * hessian_.steepest());
}

template <class Model>
bool Newton<Model>::restore(Iterate& at) {
  if (!chain.evaluate(at)) return false;
  for (int attempt = 0; attempt < kRestorations; ++attempt) {
    if (on_surface(at.active, kDescentFeasibility)) return true;
    ActiveSet held = at.active;
    if (!contacts_.restore(chain, hessian_, held, correction_)) return false;
    if (!(size(correction_) <= kDescentCap)) return false;
    advance(at, 1, correction_, at);
    if (!chain.evaluate(at)) return false;
  }
  return on_surface(at.active, kDescentFeasibility);
}

// Those of a set that touch: an open gap pushes nothing.
template <class Model>
ActiveSet Newton<Model>::closed(const ActiveSet& active) const {
  ActiveSet kept;
  for (int j = 0; j < active.count; ++j) {
    if (chain.gaps()[active.contact[j]] > kFeasibility * chain.robot().max_length) continue;
    kept.contact[kept.count] = active.contact[j];
    kept.multiplier[kept.count++] = active.multiplier[j];
  }
  return kept;
}

// Whether every gap is met and the active ones are closed.
template <class Model>
bool Newton<Model>::on_surface(const ActiveSet& active, double tolerance) const {
  double farthest = chain.violation();
  for (int j = 0; j < active.count; ++j) farthest = std::max(farthest, chain.gaps()[active.contact[j]]);
  return farthest <= tolerance * chain.robot().max_length;
}

template <class Model>
Verdict Newton<Model>::descend(Iterate& at, double largest, bool& moved) {
  Verdict verdict;
  moved = false;
  if (!chain.evaluate(at)) return verdict;
  chain.reduced_gradient(at.active);
  verdict.converged = equilibrium(at.active) && convex(at.active, kPenalties);
  if (verdict.converged || !convexify(at.active, creeping_ ? kPenalties : kDescentPenalties)) return verdict;
  ActiveSet target = at.active;
  if (!contacts_.solve(chain, hessian_, target, step_)) return verdict;
  // Energy may rise by what it costs to close gaps that are open by as little as is not told from closed.
  const double before = chain.energy();
  double allowed = before + kEnergyRoundoff * before;
  for (int j = 0; j < target.count; ++j) allowed += 2 * kDescentFeasibility * chain.robot().max_length * target.multiplier[j];
  const double whole = std::min(1.0, largest / size(step_));
  trial_.command = at.command;
  const ActiveSet touching = closed(target);
  // Where the curvature is negative the energy sinks farther along a damped step than that goes.
  const bool stretched = damping_ > 0 && touching.count == target.count;
  const double farthest = stretched ? std::min(stretch_, largest / size(step_)) : whole;
  double scale = farthest;
  // Restorations are measured by closeness: near a fold the energy hardly resists the motion that ends the branch.
  if (!hessian_.factor(damping_ + kMeasureDamping * hessian_.steepest())) return verdict;
  for (int backtracks = 0; backtracks <= kDescentBacktracks; ++backtracks, scale /= scale > 2 * whole ? kStretch : 2) {
    trial_.active = scale == 1 ? target : touching;  // the whole step closes every gap that is to push
    advance(at, scale, step_, trial_);
    if (!restore(trial_)) continue;
    if (chain.energy() > allowed) continue;
    std::swap(at.controls, trial_.controls);
    std::swap(at.mounts, trial_.mounts);
    at.active = closed(target);
    moved = true;
    // Far from where it leads a heavily damped step is too short, near there a penalty that closes gaps costs nothing.
    creeping_ = !creeping_ && scale * size(step_) < kCreep;
    if (stretched) stretch_ = scale == farthest ? kStretch * scale : std::max(kStretch, scale);
    return verdict;
  }
  return verdict;
}

#define CCR_INSTANTIATE(Model) template class Newton<Model>;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
