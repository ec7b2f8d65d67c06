// Whether the equilibrium under another command continues the branch, or lies on another one.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

// Leaves in `trial_` the shape of the free robot; false where it touched an obstacle, or would overlap one, or where
// motors keep their tension.
template <class Model>
bool ModelContinuation<Model>::try_free_shape() {
  if (problem_.keeps_tensions() || problem_.touches_obstacle(trial_.active) || !bend_freely()) return false;
  return problem_.evaluate(trial_) && problem_.violation() <= kFeasibility * problem_.robot().max_length;
}

// Leaves in `trial_` the equilibrium under another command, if it continues the branch from `present_`.
template <class Model>
ModelContinuation<Model>::Move ModelContinuation<Model>::try_command(const Command& command) {
  if (is_interrupted()) return Move::kRejected;
  present_evaluated_ = false;
  trial_ = present_;
  trial_.command = command;
  const double distance = command_distance(present_.command, command);
  if (!try_free_shape()) {
    if (!Model::kRod && largest_displacement(command.cables) <= 0) {
      met_slack_ = true;
      return Move::kRejected;
    }
    extrapolate_trial();
    const NewtonResult found = newton_.solve(trial_, distance <= kPatientStep ? kDampedIterations : 0);
    result_.iterations += found.iterations;
    if (!found.converged) return Move::kRejected;
  }
  const double moved = largest_motion();
  const bool contact = problem_.touches_obstacle(trial_.active) || problem_.touches_obstacle(present_.active);
  if (distance > kMeetingStep && meets_another_side()) return Move::kRejected;
  const double allowed = contact ? std::min(kMoveOffset + kMoveSlope * distance, kMoveLargest) : kMoveLargest;
  if (moved > problem_.robot().max_length * allowed || !passage_is_clear(moved)) return Move::kRejected;
  problem_.reduced_gradient(trial_.active);
  trial_tensions_ = problem_.tensions(trial_.active);
  const double loss = energy_loss(command);
  if (left_branch(command, moved, loss)) return Move::kRejected;
  if (moves_obstacles(command) && pushes(trial_tensions_)) return Move::kPushing;
  const double tension = highest(trial_tensions_), limit = problem_.robot().max_tension;
  const bool pulled = pulls_cable(command) && command.length == present_.command.length && !moves_obstacles(command);
  const bool loading = command.loads != present_.command.loads;  // what the motors cannot hold then, they let out
  const bool rising = pulled || (!loading && !only_releases(command) && tension > highest(tensions_));
  if (rising && tension > limit) return Move::kOverTension;
  // The tension may exceed the limit in between and fall again. Work of the cables beyond that of a linear tension
  // bounds the mean excess over the straight line; the peak is at most twice the mean.
  const double hump = std::max(0.0, -loss) * 2 * problem_.energy_scale() / (distance * problem_.robot().offset);
  const bool peaks = pulled && std::max(highest_held(trial_tensions_), highest_held(tensions_)) + hump > limit;
  return peaks && distance > kPeakStep ? Move::kRejected : Move::kAccepted;
}

// Whether a contact came in whose place the size of the sub-step may have decided: with an obstacle that is narrower
// than the distance of neighbouring points, or with one that has an edge, behind which the point was before.
template <class Model>
bool ModelContinuation<Model>::meets_another_side() const {
  const std::vector<double>& edges = problem_.robot().edges;
  const double spacing = *std::min_element(edges.begin(), edges.end());
  const ActiveSet &before = present_.active, &now = trial_.active;
  const auto begin = before.contact.begin(), end = begin + before.count;
  return std::any_of(now.contact.begin(), now.contact.begin() + now.count, [&](int contact) {
    if (contact >= problem_.contacts() || std::find(begin, end, contact) != end) return false;
    const auto& obstacle = problem_.obstacles()[contact / points_.size()];
    return obstacle.inradius < spacing || (obstacle.min_curvature_radius < spacing && !was_faced(contact));
  });
}

// Whether a point that touches now was before the side of the obstacle that it touches, and not before another one,
// round an edge.
template <class Model>
bool ModelContinuation<Model>::was_faced(int contact) const {
  const int j = contact / static_cast<int>(points_.size()), mount = problem_.mount_of(j);
  Position place = minus(points_[contact % points_.size()], mount < 0 ? Position{} : mounts_[mount]);
  place = minus(place, problem_.displacement(j, trial_.command.scene, present_.command.scene));
  const Position faced = measure_gap(problem_.obstacles()[j], place).slope, now = problem_.gap(contact).slope;
  return dot(faced, now) >= kFacing * norm(faced) * norm(now);
}

// Work of the cables from `present_` to `trial_`, at tensions that change linearly, less the gain in energy [rad²].
template <class Model>
double ModelContinuation<Model>::energy_loss(const Command& command) const {
  double work = 0;
  for (int k = 0; k < kCables; ++k) {
    const double pulled = pull(command, k) - pull(present_.command, k);
    work += (tensions_[k] + trial_tensions_[k]) / 2 * pulled;
  }
  return work / problem_.energy_scale() - (problem_.energy() - energy_);
}

// Whether the robot came to `trial_` by a jump, and not along its branch: its motion is off the trend, energy was lost,
// and the way back does not return to `present_`.
template <class Model>
bool ModelContinuation<Model>::left_branch(const Command& command, double moved, double loss) {
  if (moved <= kStill * problem_.robot().max_length) return false;
  // A free robot that bends evenly has but one branch, and one that is held tight has no room to jump.
  if ((bends_evenly_ && !problem_.touches_obstacle(present_.active)) || is_tight()) return false;
  if (has_trend_ && follows_trend()) return false;
  if (command.length == present_.command.length && command.loads == present_.command.loads &&
      !moves_obstacles(command)) {
    double unevenness = 0;  // work that a tension which does not change linearly may add or take
    for (int k = 0; k < kCables; ++k)
      unevenness += std::abs(pull(command, k) - pull(present_.command, k)) *
                    (kUnevenChange * std::abs(trial_tensions_[k] - tensions_[k]) +
                     kUnevenTension * std::max(tensions_[k], trial_tensions_[k]));
    if (std::abs(loss) * problem_.energy_scale() <= unevenness) return false;
  }
  return !way_back_returns();
}

// Whether the controls of `trial_` are close to what the trend predicts, compared with its motion.
template <class Model>
bool ModelContinuation<Model>::follows_trend() const {
  double turned = 0, missed = 0;
  for (std::size_t i = 0; i < predicted_.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) {
      turned = std::max(turned, std::abs(predicted_[i][k] - present_.controls[i][k]));
      missed = std::max(missed, std::abs(trial_.controls[i][k] - predicted_[i][k]));
    }
  return missed <= kOffTrend * turned;
}

// Whether Newton's method from `trial_` under the present command finds `present_`. Leaves the problem evaluated at
// `trial_`.
template <class Model>
bool ModelContinuation<Model>::way_back_returns() {
  back_ = trial_;
  back_.command = present_.command;
  const NewtonResult found = newton_.solve(back_, 0);
  result_.iterations += found.iterations;
  double apart = found.converged ? 0 : HUGE_VAL, moved = 0;
  for (std::size_t i = 0; i < back_.controls.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) {
      apart = std::max(apart, std::abs(back_.controls[i][k] - present_.controls[i][k]));
      moved = std::max(moved, std::abs(trial_.controls[i][k] - present_.controls[i][k]));
    }
  problem_.evaluate(trial_);
  problem_.reduced_gradient(trial_.active);
  return apart <= kReturned * moved;
}

#define CCR_INSTANTIATE(Model) \
  template ModelContinuation<Model>::Move ModelContinuation<Model>::try_command(const Command&);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
