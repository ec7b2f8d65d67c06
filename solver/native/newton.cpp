#include "newton.hpp"

#include <algorithm>
#include <cmath>

namespace ccr {

using namespace limits;

Newton::Newton(const Robot& robot, const std::vector<Obstacle>& obstacles)
    : chain(robot, obstacles),
      system_(robot.segments),
      contacts_(robot.segments),
      step_(robot.segments),
      correction_(robot.segments),
      penalty_(kMaxActive) {
  trial_.shear.resize(robot.segments);
}

bool Newton::equilibrium(const ActiveSet& active) const {
  double worst = 0;
  for (const Control& g : chain.gradient()) worst = std::max(worst, std::abs(g[0]));
  const double free = chain.free_angle();
  return worst <= kStationarity * free * free + kRoundoff * chain.steepest() && on_surface(active, kFeasibility);
}

// Exact curvature where it is positive; else a penalty on the active gaps, which leaves the solution where it is.
bool Newton::convex(const ActiveSet& active, int penalties) {
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
bool Newton::convexify(const ActiveSet& active) {
  if (convex(active, kDescentPenalties)) return true;
  damping_ = kDamping * steepest_curvature();
  for (int attempt = 0; attempt < kDampingTries; ++attempt, damping_ *= kDampingGrowth)
    if (system_.factor(damping_)) return true;
  return false;
}

void Newton::shape_system(const ActiveSet& active, double strength) {
  chain.curvature(active, system_);
  for (int j = 0; j < active.count; ++j) {
    penalty_[j] = 0;
    if (strength == 0) continue;
    const System::Force slope = chain.slope(active.contact[j]);
    const double reach = chain.robot().length * (slope.node + slope.split);
    penalty_[j] = strength / (reach * reach);
    const auto outer = [&](const State& a, const State& b) {
      Mat<3, 3> product;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) product(r, c) = penalty_[j] * a[r] * b[c];
      return product;
    };
    system_.node_hessian[slope.node] += outer(slope.here, slope.here);
    if (!slope.split) continue;
    system_.node_hessian[slope.node + 1] += outer(slope.next, slope.next);
    system_.couple(slope.node, outer(slope.here, slope.next));
  }
}

// The step to the solution of the quadratic model, and the multipliers there.
bool Newton::model_step(ActiveSet& target) {
  return contacts_.solve(chain, system_, chain.gradient().data(), penalty_, target, step_);
}

double Newton::cap(double largest) const {
  double longest = 0;
  for (const Control& d : step_.shear) longest = std::max(longest, std::abs(d[0]));
  return longest > largest ? largest / longest : 1.0;
}

double Newton::merit(double weight) const {
  double violation = 0;
  for (const int contact : chain.near()) violation += std::max(0.0, -chain.gaps()[contact]);
  return chain.objective() + weight * violation;
}

namespace {

void advance(const Iterate& from, double scale, const Direction& step, Iterate& to) {
  for (std::size_t i = 0; i < from.shear.size(); ++i) to.shear[i][0] = from.shear[i][0] + scale * step.shear[i][0];
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
double Newton::search(const Iterate& at, const ActiveSet& target, double& weight) {
  if (cap(kDescentCap) == 1) {
    advance(at, 1, step_, trial_);
    if (chain.evaluate(trial_.shear, at.cable)) return 1;
    return 0;
  }
  double slope = 0;  // of the objective along the step
  for (std::size_t i = 0; i < step_.shear.size(); ++i) slope += chain.gradient()[i][0] * step_.shear[i][0];
  for (int j = 0; j < at.active.count; ++j)
    slope += at.active.multiplier[j] *
             chain.slope(at.active.contact[j]).along(step_.states);
  for (int j = 0; j < target.count; ++j) weight = std::max(weight, 2 * target.multiplier[j]);
  const double before = merit(weight);
  const double expected = std::min(slope - (before - chain.objective()), 0.0);
  double scale = cap(kNewtonCap);
  for (int backtracks = 0; backtracks <= kBacktracks; ++backtracks, scale /= 2) {
    advance(at, scale, step_, trial_);
    if (chain.evaluate(trial_.shear, at.cable) && merit(weight) <= before + kArmijo * scale * expected) return scale;
  }
  return 0;
}

Verdict Newton::solve(Iterate& at) {
  Verdict verdict;
  if (!chain.evaluate(at.shear, at.cable)) return verdict;
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
        if (!chain.evaluate(at.shear, at.cable)) return verdict;
        continue;
      }
      target = at.active;
    }
    if (!convex(at.active, kPenalties) || !model_step(target)) return verdict;

    const double scale = search(at, target, weight);
    if (scale == 0) return verdict;
    std::swap(at.shear, trial_.shear);
    blend(at.active, scale, target);
    at.active = target;
    close = cap(kNewtonClose) == 1;
  }
  return verdict;
}

bool Newton::measure(const Iterate& at) {
  if (!chain.evaluate(at.shear, at.cable)) return false;
  chain.reduced_gradient(at.active);
  return convexify(at.active) && system_.factor(damping_ + kMeasureDamping * steepest_curvature());
}

double Newton::steepest_curvature() const {
  double steepest = 0;
  for (const System::Stage& stage : system_.stages) steepest = std::max(steepest, std::abs(stage.huu[0]));
  return steepest;
}

bool Newton::restore(Iterate& at) {
  if (!chain.evaluate(at.shear, at.cable)) return false;
  for (int attempt = 0; attempt < kRestorations; ++attempt) {
    if (on_surface(at.active, kDescentFeasibility)) return true;
    ActiveSet held = at.active;
    std::fill_n(held.multiplier.begin(), held.count, kHeld);
    std::fill(penalty_.begin(), penalty_.end(), 0.0);
    if (!contacts_.solve(chain, system_, nullptr, penalty_, held, correction_)) return false;
    for (const Control& d : correction_.shear)
      if (!(std::abs(d[0]) <= kDescentCap)) return false;
    advance(at, 1, correction_, at);
    if (!chain.evaluate(at.shear, at.cable)) return false;
  }
  return on_surface(at.active, kDescentFeasibility);
}

// Those of a set that touch: an open gap pushes nothing.
ActiveSet Newton::closed(const ActiveSet& active) const {
  ActiveSet kept;
  for (int j = 0; j < active.count; ++j) {
    if (chain.gaps()[active.contact[j]] > kFeasibility) continue;
    kept.contact[kept.count] = active.contact[j];
    kept.multiplier[kept.count++] = active.multiplier[j];
  }
  return kept;
}

// Whether every gap is met and the active ones are closed.
bool Newton::on_surface(const ActiveSet& active, double tolerance) const {
  double farthest = chain.violation();
  for (int j = 0; j < active.count; ++j) farthest = std::max(farthest, chain.gaps()[active.contact[j]]);
  return farthest <= tolerance;
}

Verdict Newton::descend(Iterate& at, bool& moved) {
  Verdict verdict;
  moved = false;
  if (!chain.evaluate(at.shear, at.cable)) return verdict;
  chain.reduced_gradient(at.active);
  verdict.converged = equilibrium(at.active) && convex(at.active, kPenalties);
  if (verdict.converged || !convexify(at.active)) return verdict;
  ActiveSet target = at.active;
  if (!model_step(target)) return verdict;
  const double before = chain.objective();
  double scale = cap(kDescentCap);
  trial_.cable = at.cable;
  const ActiveSet touching = closed(target);
  // Restorations are measured by closeness: near a fold the energy hardly resists the motion that ends the branch.
  if (!system_.factor(damping_ + kMeasureDamping * steepest_curvature())) return verdict;
  for (int backtracks = 0; backtracks <= kDescentBacktracks; ++backtracks, scale /= 2) {
    trial_.active = scale == 1 ? target : touching;  // the whole step closes every gap that is to push
    advance(at, scale, step_, trial_);
    if (!restore(trial_)) continue;
    if (chain.objective() > before + kEnergyRoundoff * before) continue;
    std::swap(at.shear, trial_.shear);
    at.active = closed(target);
    moved = true;
    return verdict;
  }
  return verdict;
}

}  // namespace ccr
