// Saddles: a descent comes to rest where the slope vanishes, though the robot is not stable there and would go on.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/newton.hpp"

namespace ccr {

using namespace tolerances;

// Energy that closing gaps which are open within the tolerance may cost, λ times the gap, and roundoff.
template <class Model>
double Newton<Model>::rise_of_roundoff(const ActiveSet& active) const {
  double rise = kEnergyRoundoff * std::abs(problem.energy());
  for (int j = 0; j < active.count; ++j)
    rise += 2 * kDescentFeasibility * problem.robot().max_length * active.multiplier[j];
  return rise;
}

// Whether any control or mount of `trial_` is at least so far from those of another iterate.
template <class Model>
bool Newton<Model>::has_moved(const Iterate& from, double least) const {
  double farthest = 0;
  for (std::size_t i = 0; i < from.controls.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k)
      farthest = std::max(farthest, std::abs(trial_.controls[i][k] - from.controls[i][k]));
  for (std::size_t m = 0; m < from.mounts.size(); ++m)
    for (int k = 0; k < Model::kSpace; ++k)
      farthest = std::max(farthest, std::abs(trial_.mounts[m][k] - from.mounts[m][k]) / problem.robot().max_length);
  return farthest >= least;
}

// Whether the energy of this descent, at the iterate at which the problem is evaluated, has not fallen for a while.
template <class Model>
bool Newton<Model>::is_flat(const ActiveSet& active) {
  if (problem.energy() < lowest_ - rise_of_roundoff(active)) {
    lowest_ = problem.energy();
    flat_ = fruitless_ = 0;
  } else {
    ++flat_;
    ++fruitless_;
  }
  return flat_ >= kFlat;
}

// Leaves in `step_` the direction of least curvature on the tangent space of some gaps.
template <class Model>
bool Newton<Model>::find_softest(const ActiveSet& held) {
  for (std::size_t i = 0; i < correction_.controls.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) correction_.controls[i][k] = 1.0 / (1 + i + k);
  return qp_.find_softest(problem, kkt_, held, correction_, step_);
}

template <class Model>
bool Newton<Model>::bend_softly(Iterate& at, const ActiveSet& held, double size) {
  if (!problem.evaluate(at) || !find_softest(held)) return false;
  advance(at, size / step_size(step_), step_, at);
  return true;
}

// Moves a stationary shape that is not stable to one of less energy, in the direction of least curvature; false where
// none is found.
template <class Model>
bool Newton<Model>::leave_saddle(Iterate& at, double largest) {
  flat_ = 0;
  if (!kkt_.counts_inertia) return false;
  needed_damping_ = 0;
  if (factor_stable(at.active, kDescentPenalties) || !factor_damped(at.active)) return false;
  if (!find_softest(at.active) || !factor_metric()) return false;
  const double lower = problem.energy() - rise_of_roundoff(at.active);
  double scale = largest / step_size(step_);
  trial_.command = at.command;
  for (int attempt = 0; attempt < 2 * kSaddleTries; ++attempt, scale *= attempt % 2 ? -1 : -0.25) {
    trial_.active = at.active;
    advance(at, scale, step_, trial_);
    if (!restore(trial_) || problem.energy() >= lower) continue;
    std::swap(at.controls, trial_.controls);
    std::swap(at.mounts, trial_.mounts);
    at.active = closed_contacts(at.active);
    stretch_ = kStretch;
    return true;
  }
  return false;
}

// Solves for the step without the active gap that is pressed least, with only the damping that its absence needs; where
// that gap stays closed nevertheless, iterate after iterate, for the step along it.
template <class Model>
bool Newton<Model>::release_lowest(const Iterate& at, ActiveSet& target) {
  target = at.active;
  if (target.count == 0) return false;
  const auto begin = target.multiplier.begin();
  const int lowest = static_cast<int>(std::min_element(begin, begin + target.count) - begin);
  const int contact = target.contact[lowest];
  target.drop(lowest);
  problem.reduced_gradient(target);
  needed_damping_ = 0;
  const bool solved = factor_convexified(target, kDescentPenalties) && qp_.solve(problem, kkt_, target, step_);
  const auto end = target.contact.begin() + target.count;
  if (solved && (dropped_ <= kPatience || std::find(target.contact.begin(), end, contact) == end)) return true;
  problem.reduced_gradient(at.active);
  return solved && slide_along(at.active, target);
}

// Lets the next closed gap take the place of an active one that it depends on; false where there is none.
template <class Model>
bool Newton<Model>::exchange_dependent(ActiveSet& active) {
  const int contact = qp_.exchange_dependent(problem, kkt_, exchanged_, active);
  if (contact < 0) return false;
  exchanged_ = contact;
  flat_ = 0;
  return true;
}

// Solves for the step that keeps active gaps as they are, and drops those that would pull the robot at its end.
template <class Model>
bool Newton<Model>::slide_along(const ActiveSet& active, ActiveSet& target) {
  target = active;
  needed_damping_ = 0;
  if (!factor_convexified(target, kDescentPenalties) || !qp_.balance(problem, kkt_, target, step_)) return false;
  for (int j = target.count - 1; j >= 0; --j)
    if (target.multiplier[j] <= 0) target.drop(j);
  return true;
}

#define CCR_INSTANTIATE(Model)                                                  \
  template double Newton<Model>::rise_of_roundoff(const ActiveSet&) const;      \
  template bool Newton<Model>::has_moved(const Iterate&, double) const;         \
  template bool Newton<Model>::is_flat(const ActiveSet&);                       \
  template bool Newton<Model>::find_softest(const ActiveSet&);                  \
  template bool Newton<Model>::bend_softly(Iterate&, const ActiveSet&, double); \
  template bool Newton<Model>::leave_saddle(Iterate&, double);                  \
  template bool Newton<Model>::release_lowest(const Iterate&, ActiveSet&);      \
  template bool Newton<Model>::exchange_dependent(ActiveSet&);                  \
  template bool Newton<Model>::slide_along(const ActiveSet&, ActiveSet&);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
