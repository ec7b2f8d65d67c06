#include "newton.hpp"

#include <algorithm>
#include <cmath>

namespace ccr {

using namespace limits;

template <class Model>
Newton<Model>::Newton(const Robot& robot, const std::vector<Obstacle>& obstacles)
    : chain(robot, obstacles),
      system_(robot.segments),
      contacts_(robot.segments),
      step_(robot.segments),
      correction_(robot.segments),
      penalty_(kMaxActive) {
  trial_.controls.resize(robot.segments);
}

template <class Model>
bool Newton<Model>::equilibrium(const ActiveSet& active) const {
  double worst = 0;
  for (const Control& g : chain.gradient()) worst = std::max(worst, std::abs(g[0]));
  return worst <= chain.tolerance() && on_surface(active, kFeasibility);
}

// Exact curvature where it is positive; else a penalty on the active gaps, which leaves the solution where it is.
template <class Model>
bool Newton<Model>::convex(const ActiveSet& active, int penalties) {
  damping_ = 0;
  shape_system(active, 0);
  if (system_.factor(0)) return true;
  double strength = kPenalty * steepest_curvature();
  for (int attempt = 0; active.count > 0 && attempt < penalties; ++attempt, strength *= kPenaltyGrowth) {
    shape_system(active, strength);
    if (system_.factor(0)) return true;
  }
  return false;
}

// Else damping, which only shortens the way there.
template <class Model>
bool Newton<Model>::convexify(const ActiveSet& active) {
  if (convex(active, kDescentPenalties)) return true;
  damping_ = kDamping * steepest_curvature();
  for (int attempt = 0; attempt < kDampingTries; ++attempt, damping_ *= kDampingGrowth)
    if (system_.factor(damping_)) return true;
  return false;
}

template <class Model>
void Newton<Model>::shape_system(const ActiveSet& active, double strength) {
  chain.curvature(active, system_);
  for (int j = 0; j < active.count; ++j) {
    penalty_[j] = 0;
    if (strength == 0) continue;
    const typename System<Model>::Force slope = chain.slope(active.contact[j]);
    const double arm = chain.lever_arm(active.contact[j]);
    penalty_[j] = strength / (arm * arm);
    const auto outer = [&](const State<Model>& a, const State<Model>& b) {
      Mat<Model::kState, Model::kState> product;
      for (int r = 0; r < Model::kState; ++r)
        for (int c = 0; c < Model::kState; ++c) product(r, c) = penalty_[j] * a[r] * b[c];
      return product;
    };
    system_.node_hessian[slope.node] += outer(slope.here, slope.here);
    if (!slope.split) continue;
    system_.node_hessian[slope.node + 1] += outer(slope.next, slope.next);
    system_.couple(slope.node, outer(slope.here, slope.next));
  }
}

// The step to the solution of the quadratic model, and the multipliers there.
template <class Model>
bool Newton<Model>::model_step(ActiveSet& target) {
  return contacts_.solve(chain, system_, chain.gradient().data(), penalty_, target, step_);
}

template <class Model>
double Newton<Model>::cap(double largest, const Direction<Model>& step) const {
  double longest = 0;
  for (const State<Model>& d : step.states) longest = std::max({longest, std::abs(d[0]), std::abs(d[1])});
  longest /= chain.robot().max_length;
  for (const Control& d : step.controls) longest = std::max(longest, std::abs(d[0]));
  return longest > largest ? largest / longest : 1.0;
}

template <class Model>
double Newton<Model>::merit(double weight) const {
  double violation = 0;
  for (const int contact : chain.near()) violation += std::max(0.0, -chain.gaps()[contact]);
  return chain.objective() + weight * violation;
}

namespace {

template <class Model>
void advance(const Iterate& from, double scale, const Direction<Model>& step, Iterate& to) {
  for (std::size_t i = 0; i < from.controls.size(); ++i) to.controls[i][0] = from.controls[i][0] + scale * step.controls[i][0];
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
  if (cap(kDescentCap, step_) == 1) {
    advance(at, 1, step_, trial_);
    if (chain.evaluate(trial_.controls, at.command)) return 1;
    return 0;
  }
  double slope = 0;  // of the objective along the step
  for (std::size_t i = 0; i < step_.controls.size(); ++i) slope += chain.gradient()[i][0] * step_.controls[i][0];
  for (int j = 0; j < at.active.count; ++j)
    slope += at.active.multiplier[j] *
             chain.slope(at.active.contact[j]).along(step_.states);
  for (int j = 0; j < target.count; ++j) weight = std::max(weight, 2 * target.multiplier[j]);
  const double before = merit(weight);
  const double expected = std::min(slope - (before - chain.objective()), 0.0);
  double scale = cap(kNewtonCap, step_);
  for (int backtracks = 0; backtracks <= kBacktracks; ++backtracks, scale /= 2) {
    advance(at, scale, step_, trial_);
    if (chain.evaluate(trial_.controls, at.command) && merit(weight) <= before + kArmijo * scale * expected) return scale;
  }
  return 0;
}

template <class Model>
Verdict Newton<Model>::solve(Iterate& at) {
  Verdict verdict;
  if (!chain.evaluate(at.controls, at.command)) return verdict;
  double weight = 0;
  bool close = false;
  for (; verdict.iterations <= kNewtonIterations; ++verdict.iterations) {
    chain.reduced_gradient(at.active);
    if (equilibrium(at.active)) {
      verdict.converged = true;
      return verdict;
    }
    ActiveSet target = at.active;
    if (close) {  // the last curvature still serves
      close = false;
      if (contacts_.correct(chain, system_, chain.gradient().data(), penalty_, target, step_)) {
        advance(at, 1, step_, at);
        at.active = target;
        if (!chain.evaluate(at.controls, at.command)) return verdict;
        continue;
      }
      target = at.active;
    }
    if (!convex(at.active, kPenalties) || !model_step(target)) return verdict;

    const double scale = search(at, target, weight);
    if (scale == 0) return verdict;
    std::swap(at.controls, trial_.controls);
    blend(at.active, scale, target);
    at.active = target;
    close = cap(kNewtonClose, step_) == 1;
  }
  return verdict;
}

template <class Model>
bool Newton<Model>::measure(const Iterate& at) {
  if (!chain.evaluate(at.controls, at.command)) return false;
  chain.reduced_gradient(at.active);
  return convexify(at.active) && system_.factor(damping_ + kMeasureDamping * steepest_curvature());
}

template <class Model>
double Newton<Model>::steepest_curvature() const {
  double steepest = 0;
  for (const typename System<Model>::Stage& stage : system_.stages) steepest = std::max(steepest, std::abs(stage.huu[0]));
  return steepest;
}

template <class Model>
bool Newton<Model>::restore(Iterate& at) {
  if (!chain.evaluate(at.controls, at.command)) return false;
  for (int attempt = 0; attempt < kRestorations; ++attempt) {
    if (on_surface(at.active, kDescentFeasibility)) return true;
    ActiveSet held = at.active;
    std::fill_n(held.multiplier.begin(), held.count, kHeld);
    std::fill(penalty_.begin(), penalty_.end(), 0.0);
    if (!contacts_.solve(chain, system_, nullptr, penalty_, held, correction_)) return false;
    if (!(cap(kDescentCap, correction_) == 1)) return false;
    advance(at, 1, correction_, at);
    if (!chain.evaluate(at.controls, at.command)) return false;
  }
  return on_surface(at.active, kDescentFeasibility);
}

// Those of a set that touch: an open gap pushes nothing.
template <class Model>
ActiveSet Newton<Model>::closed(const ActiveSet& active) const {
  ActiveSet kept;
  for (int j = 0; j < active.count; ++j) {
    if (chain.gaps()[active.contact[j]] > kFeasibility) continue;
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
  return farthest <= tolerance;
}

template <class Model>
Verdict Newton<Model>::descend(Iterate& at, double largest, bool& moved) {
  Verdict verdict;
  moved = false;
  if (!chain.evaluate(at.controls, at.command)) return verdict;
  chain.reduced_gradient(at.active);
  verdict.converged = equilibrium(at.active) && convex(at.active, kPenalties);
  if (verdict.converged || !convexify(at.active)) return verdict;
  ActiveSet target = at.active;
  if (!model_step(target)) return verdict;
  const double before = chain.objective();
  double scale = cap(largest, step_);
  trial_.command = at.command;
  const ActiveSet touching = closed(target);
  // Restorations are measured by closeness: near a fold the energy hardly resists the motion that ends the branch.
  if (!system_.factor(damping_ + kMeasureDamping * steepest_curvature())) return verdict;
  for (int backtracks = 0; backtracks <= kDescentBacktracks; ++backtracks, scale /= 2) {
    trial_.active = scale == 1 ? target : touching;  // the whole step closes every gap that is to push
    advance(at, scale, step_, trial_);
    if (!restore(trial_)) continue;
    if (chain.objective() > before + kEnergyRoundoff * before) continue;
    std::swap(at.controls, trial_.controls);
    at.active = closed(target);
    moved = true;
    return verdict;
  }
  return verdict;
}

template class Newton<UniformCable>;
template class Newton<SlidingCable>;

}  // namespace ccr
