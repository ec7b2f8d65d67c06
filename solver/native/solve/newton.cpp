#include "solve/newton.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/models.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
Newton<Model>::Newton(const Robot& robot, int obstacles)
    : problem(robot, obstacles),
      kkt_(robot.segments, 0),
      qp_(robot.segments, 0),
      step_(robot.segments, 0),
      correction_(step_) {
  trial_.controls.resize(robot.segments);
}

template <class Model>
void Newton<Model>::set_obstacles(std::span<const Obstacle<Model::kSpace>> obstacles) {
  problem.set_obstacles(obstacles);
  const int segments = problem.robot().segments, mounts = problem.mounts();
  if (step_.mounts.size() == static_cast<std::size_t>(mounts)) return;
  const std::int64_t work = this->factorizations();
  kkt_ = KktSystem<Model>(segments, mounts);
  kkt_.factorizations = work;
  qp_ = ActiveSetQp<Model>(segments, mounts);
  step_ = correction_ = Direction<Model>(segments, mounts);
  trial_.mounts.resize(mounts);
}

template <class Model>
bool Newton<Model>::is_equilibrium(const ActiveSet& active) const {
  double worst = 0;
  for (const auto& g : problem.gradient())
    for (const double slope : g.v) worst = std::max(worst, std::abs(slope));
  const double arm = problem.robot().max_length / problem.robot().segments;
  for (const auto& g : problem.mount_gradient()) worst = std::max(worst, arm * norm(g));
  return worst <= problem.stationarity_tolerance(active) && gaps_closed(active, kFeasibility);
}

// Where contacts hold a robot of the paper's models far from its free shape, no penalty may be strong enough: a step
// that takes much work counts the inertia instead.
template <class Model>
void Newton<Model>::choose_test() {
  kkt_.counts_inertia = Model::kRod || factorizations() - factorizations_before_ > kPenaltyWork;
}

// Factors the exact Hessian; where that fails, with a growing penalty on the active gaps, which leaves the solution
// unchanged and succeeds if H is positive definite on their tangent space. Where the inertia is counted, no penalty is
// needed: whether H is positive definite there is read off it.
template <class Model>
bool Newton<Model>::factor_penalized(const ActiveSet& active, int penalties) {
  damping_ = 0;
  if (kkt_.counts_inertia) {
    kkt_.assemble(problem, active, 0);
    return kkt_.factor(0);
  }
  double strength = kPenalty;
  for (int attempt = 0; attempt < (active.count > 0 ? penalties : 1); ++attempt, strength *= kPenaltyGrowth) {
    kkt_.assemble(problem, active, strength);
    if (kkt_.factor(0)) return true;
  }
  return false;
}

template <class Model>
bool Newton<Model>::factor_stable(const ActiveSet& active, int penalties) {
  return factor_penalized(active, penalties) && qp_.is_stable(problem, kkt_, active);
}

// Whether an equilibrium to which no step led is stable, as it was before: loads may have grown, or bear on a longer
// robot. Gaps that are closed without being pressed hold it as the active ones do. Where these depend on each other, as
// those of cables that lock a robot between them, no motion that satisfies them to first order leads away, and a
// descent would find none: it counts as held. In space a robot that gives way to a load along it may turn about that
// for nothing, and no place is stable: it stands until it is pulled aside.
template <class Model>
bool Newton<Model>::stands(const ActiveSet& active) {
  if (Model::kSpace == 3 || !problem.has_loads()) return true;
  ActiveSet held = active;
  for (const int contact : problem.near_contacts()) {
    const auto begin = held.contact.begin(), end = begin + held.count;
    const bool closed = problem.gaps()[contact] <= kFeasibility * problem.robot().max_length;
    if (!closed || held.count == kMaxActive || std::find(begin, end, contact) != end) continue;
    held.contact[held.count] = contact;
    held.multiplier[held.count++] = 0;
  }
  const int count = held.count;
  return factor_penalized(held, kPenalties) && (qp_.balance(problem, kkt_, held, step_) || held.count < count);
}

// The same as `factor_stable`, with damping as the last resort: it shortens the step.
template <class Model>
bool Newton<Model>::factor_convexified(const ActiveSet& active, int penalties) {
  return factor_stable(active, penalties) || factor_damped(active);
}

// Factors with growing damping, from a little less than was needed last.
template <class Model>
bool Newton<Model>::factor_damped(const ActiveSet& active) {
  damping_ = std::max(kDamping * kkt_.max_curvature(), needed_damping_ / (kDampingGrowth * kDampingGrowth));
  for (int attempt = 0; attempt < kDampingTries; ++attempt, damping_ *= kDampingGrowth)
    if (kkt_.factor(damping_) && qp_.is_stable(problem, kkt_, active)) {
      needed_damping_ = damping_;
      return true;
    }
  return false;
}

template <class Model>
double Newton<Model>::step_size(const Direction<Model>& step) const {
  double longest = 0;
  for (const auto& d : step.states)
    for (int k = 0; k < Model::kSpace; ++k) longest = std::max(longest, std::abs(d[k]));
  longest /= problem.robot().max_length;
  for (const auto& d : step.mounts) longest = std::max(longest, norm(d) / problem.robot().max_length);
  for (const auto& d : step.controls)
    for (const double part : d.v) longest = std::max(longest, std::abs(part));
  return longest;
}

template <class Model>
double Newton<Model>::merit(double weight) const {
  double violation = 0;
  for (const int contact : problem.near_contacts()) violation += std::max(0.0, -problem.gaps()[contact]);
  return problem.energy() + weight * violation;
}

namespace {

// Interpolates multipliers from one active set to another, at a fraction of the step.
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

// Returns the length of step that lowers the l1 merit sufficiently (Armijo), with the problem evaluated there as
// `trial_`; 0 where there is none. Small steps are taken whole: near the solution the curvature of the gaps makes the
// merit reject good steps (Maratos effect).
template <class Model>
double Newton<Model>::line_search(const Iterate& at, const ActiveSet& target, double& weight) {
  trial_.command = at.command;
  if (step_size_ <= kDescentCap) {
    advance(at, 1, step_, trial_);
    if (problem.evaluate(trial_)) return 1;
    return 0;
  }
  double slope = slope_along_step();  // of the energy
  for (int j = 0; j < at.active.count; ++j)
    slope += at.active.multiplier[j] * problem.slope(at.active.contact[j]).along(step_);
  for (int j = 0; j < target.count; ++j) weight = std::max(weight, 2 * target.multiplier[j]);
  const double before = merit(weight);
  const double expected = std::min(slope - (before - problem.energy()), 0.0);
  double scale = std::min(1.0, kNewtonCap / step_size_);
  for (int backtracks = 0; backtracks <= kBacktracks; ++backtracks, scale /= 2) {
    advance(at, scale, step_, trial_);
    if (problem.evaluate(trial_) && merit(weight) <= before + kArmijo * scale * expected) return scale;
  }
  return 0;
}

template <class Model>
NewtonResult Newton<Model>::solve(Iterate& at, int damped) {
  // A factorisation of the rod in space costs as much as several corrections: it serves while these shrink fast.
  constexpr bool kReuses = Model::kRod && Model::kSpace == 3;
  NewtonResult result;
  if (!problem.evaluate(at)) return result;
  choose_test();
  double weight = 0;
  bool close = false, stable = true;  // whether the last H was positive definite on their tangent space
  needed_damping_ = 0;
  for (; result.iterations <= kNewtonIterations; ++result.iterations) {
    problem.reduced_gradient(at.active);
    if (is_equilibrium(at.active)) {
      const bool took_steps = result.iterations > 0;
      result.converged = took_steps ? stable || factor_stable(at.active, kPenalties) : stands(at.active);
      return result;
    }
    ActiveSet target = at.active;
    if (close) {  // the last factorisation serves again
      close = false;
      if (qp_.correct(problem, kkt_, target, step_)) {
        advance(at, 1, step_, at);
        at.active = target;
        if (!problem.evaluate(at)) return result;
        if constexpr (kReuses) {
          const double last = std::exchange(step_size_, step_size(step_));
          close = step_size_ <= kCorrectionRate * last;
        }
        continue;
      }
      target = at.active;
    }
    stable = factor_penalized(at.active, kPenalties) && qp_.solve(problem, kkt_, target, step_);
    if (!stable) {
      target = at.active;
      if (result.iterations >= damped || !factor_damped(target) || !qp_.solve(problem, kkt_, target, step_))
        return result;
    }

    step_size_ = step_size(step_);
    const double scale = line_search(at, target, weight);
    if (scale == 0) return result;
    std::swap(at.controls, trial_.controls);
    std::swap(at.mounts, trial_.mounts);
    blend(at.active, scale, target);
    at.active = target;
    close = step_size_ <= (kReuses ? kReuseClose : kNewtonClose);
  }
  return result;
}

template <class Model>
bool Newton<Model>::settle(Iterate& at) {
  choose_test();
  for (int iteration = 0; problem.evaluate(at); ++iteration) {
    problem.reduced_gradient(at.active);
    if (!factor_penalized(at.active, kPenalties)) return false;
    ActiveSet others = at.active;
    const bool stable = qp_.balance(problem, kkt_, others, step_);
    if (!stable || iteration == kSettling || is_equilibrium(at.active)) return stable && is_equilibrium(at.active);
    advance(at, 1, step_, at);
    for (int j = 0; j < others.count; ++j)
      for (int k = 0; k < at.active.count; ++k)
        if (at.active.contact[k] == others.contact[j]) at.active.multiplier[k] = std::max(0.0, others.multiplier[j]);
  }
  return false;
}

// Whether no gap is violated and the active ones are closed.
template <class Model>
bool Newton<Model>::gaps_closed(const ActiveSet& active, double tolerance) const {
  double farthest = problem.violation();
  for (int j = 0; j < active.count; ++j) farthest = std::max(farthest, problem.gaps()[active.contact[j]]);
  return farthest <= tolerance * problem.robot().max_length;
}

// Slope of the Lagrangian along `step_`, where its gradient was taken last.
template <class Model>
double Newton<Model>::slope_along_step() const {
  double slope = 0;
  for (std::size_t i = 0; i < step_.controls.size(); ++i) slope += dot(problem.gradient()[i], step_.controls[i]);
  for (std::size_t m = 0; m < step_.mounts.size(); ++m) slope += dot(problem.mount_gradient()[m], step_.mounts[m]);
  return slope;
}

#define CCR_INSTANTIATE(Model) template class Newton<Model>;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
