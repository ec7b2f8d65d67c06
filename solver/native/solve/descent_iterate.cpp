// The iterates of a feasible descent: its metric, its restorations, and how far it goes along a step.
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/models.hpp"
#include "solve/newton.hpp"

namespace ccr {

using namespace tolerances;

// Factors with so much more damping that H is positive definite.
template <class Model>
bool Newton<Model>::factor_definite() {
  damping_ = std::max(damping_, kDamping * kkt_.max_curvature());
  for (int attempt = 0; attempt < kDampingTries; ++attempt, damping_ *= kDampingGrowth)
    if (kkt_.factor(damping_) && kkt_.negative == 0) {
      needed_damping_ = damping_;
      return true;
    }
  return false;
}

// Factors the metric of `restore`, which is positive definite.
template <class Model>
bool Newton<Model>::factor_metric() {
  double damping = damping_ + kNormDamping * kkt_.max_curvature();
  for (int attempt = 0; attempt < kDampingTries; ++attempt, damping *= kDampingGrowth)
    if (kkt_.factor(damping) && kkt_.negative == 0) return true;
  return false;
}

template <class Model>
bool Newton<Model>::set_metric(const Iterate& at) {
  needed_damping_ = 0;
  stretch_ = kStretch;
  creeping_ = false;
  lowest_ = HUGE_VAL;
  flat_ = fruitless_ = dropped_ = 0;
  exchanged_ = -1;
  iterates_ = 0;
  if (!problem.evaluate(at)) return false;
  problem.reduced_gradient(at.active);
  return factor_convexified(at.active, kDescentPenalties) && factor_metric();
}

template <class Model>
bool Newton<Model>::restore(Iterate& at) {
  if (!problem.evaluate(at)) return false;
  for (int attempt = 0; attempt < kRestorations; ++attempt) {
    if (gaps_closed(at.active, kDescentFeasibility)) return true;
    ActiveSet held = at.active;
    if (!qp_.restore(problem, kkt_, held, correction_)) return false;
    if (!(step_size(correction_) <= kDescentCap)) return false;
    advance(at, 1, correction_, at);
    if (!problem.evaluate(at)) return false;
  }
  return gaps_closed(at.active, kDescentFeasibility);
}

// The contacts of a set whose gap is closed: an open gap carries no multiplier.
template <class Model>
ActiveSet Newton<Model>::closed_contacts(const ActiveSet& active) const {
  ActiveSet kept;
  for (int j = 0; j < active.count; ++j) {
    if (problem.gaps()[active.contact[j]] > kFeasibility * problem.robot().max_length) continue;
    kept.contact[kept.count] = active.contact[j];
    kept.multiplier[kept.count++] = active.multiplier[j];
  }
  return kept;
}

template <class Model>
NewtonResult Newton<Model>::descend_once(Iterate& at, double largest, bool definite) {
  NewtonResult result;
  if (!problem.evaluate(at)) return result;
  choose_test();
  problem.reduced_gradient(at.active);
  const bool stationary = is_equilibrium(at.active);
  result.converged = stationary && factor_stable(at.active, kPenalties);
  if (result.converged || !factor_convexified(at.active, creeping_ ? kPenalties : kDescentPenalties)) return result;
  const bool flat = is_flat(at.active);
  if (fruitless_ > kFruitless) return result;
  if (flat && exchange_dependent(at.active)) {
    problem.reduced_gradient(at.active);
    if (!factor_convexified(at.active, kDescentPenalties)) return result;
  }
  if (stationary || (flat && damping_ > 0)) {
    result.moved = leave_saddle(at, largest);
    if (result.moved || !factor_convexified(at.active, kDescentPenalties)) return result;
  }
  ActiveSet target = at.active;
  if (definite || (!qp_.solve(problem, kkt_, target, step_) &&  // not stable without a gap that it drops
                   !((flat || ++dropped_ > kFlat) && release_lowest(at, target)))) {
    target = at.active;
    if (!kkt_.counts_inertia || !factor_definite() || !qp_.solve(problem, kkt_, target, step_)) return result;
  }
  result.moved = take_step(at, target, largest);
  return result;
}

// Moves `at` along `step_`, shortened until no gap is violated after a restoration and the energy falls.
template <class Model>
bool Newton<Model>::take_step(Iterate& at, const ActiveSet& target, double largest) {
  const double allowed = problem.energy() + rise_of_roundoff(target);
  const double size = step_size(step_), whole = std::min(1.0, largest / size);
  trial_.command = at.command;
  const ActiveSet touching = closed_contacts(target);
  // Where H is not positive definite, the energy keeps falling beyond the end of a damped step.
  const bool stretched = damping_ > 0 && touching.count == target.count;
  const double farthest = stretched ? std::min(stretch_, largest / size) : whole;
  // From side to side of a valley a long descent loses little: once, it goes to where the energy is least by a
  // parabola. The paper's models in the plane stride instead.
  bool may_overshoot = (Model::kRod || Model::kSpace == 3) && ++iterates_ > kLongDescent && stretched;
  const double before = problem.energy(), slope = may_overshoot ? slope_along_step() : 0;
  // The norm of restorations: near a fold the energy hardly resists the motion that ends the branch, so damping is
  // added.
  if (!factor_metric()) return false;
  double scale = farthest, shorter;
  for (int backtracks = 0; backtracks <= kDescentBacktracks; ++backtracks, scale = shorter) {
    shorter = scale / (scale > 2 * whole ? kStretch : 2);
    trial_.active = scale == 1 ? target : touching;  // the whole step closes every gap with a multiplier
    advance(at, scale, step_, trial_);
    if (!restore(trial_)) continue;
    // A step beyond a corner may be restored to where it began.
    if (problem.energy() > allowed || !has_moved(at, kProgress * scale * size)) continue;
    const double curvature = 2 * (problem.energy() - before - scale * slope) / (scale * scale);
    if (may_overshoot && -slope < kOvershot * scale * curvature) {
      may_overshoot = false;
      shorter = std::max(-slope / curvature, shorter);
      continue;
    }
    std::swap(at.controls, trial_.controls);
    std::swap(at.mounts, trial_.mounts);
    at.active = closed_contacts(target);
    // Heavily damped steps are too short far from the end of a descent; near it a stronger penalty instead is harmless.
    creeping_ = !creeping_ && scale * size < kCreep;
    if (stretched) stretch_ = scale == farthest ? kStretch * scale : std::max(kStretch, scale);
    return true;
  }
  return false;
}

#define CCR_INSTANTIATE(Model)                                               \
  template bool Newton<Model>::set_metric(const Iterate&);                   \
  template bool Newton<Model>::factor_metric();                              \
  template bool Newton<Model>::restore(Iterate&);                            \
  template ActiveSet Newton<Model>::closed_contacts(const ActiveSet&) const; \
  template NewtonResult Newton<Model>::descend_once(Iterate&, double, bool);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
