// Where a robot begins: at rest under its loads, and where it first touched an obstacle.
#include <algorithm>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
StepResult ModelContinuation<Model>::rest(double length, double* to) {
  const Robot& robot = problem_.robot();
  result_ = {};
  factorizations_before_ = newton_.factorizations();
  was_exceeded_ = began_in_contact_ = present_evaluated_ = false;
  present_.command = {{}, length, problem_.has_loads() ? 0.0 : 1.0};
  present_.active.count = 0;
  for (int i = 0; i < robot.segments; ++i)
    for (int k = 0; k < Model::kControl; ++k)
      present_.controls[i][k] = Model::kRod ? robot.rod.rest[i * Model::kControl + k] : 0.0;
  std::fill(present_.mounts.begin(), present_.mounts.end(), Position{});
  clear_trend();
  evaluate_present();
  for (int k = 0; Model::kRod && k < static_cast<int>(layout_.cables.size); ++k)
    present_.command.cables[k] = std::min(0.0, problem_.taken(k));
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    std::copy_n(problem_.states()[i].v.begin(), kSpace, nodes_[i].v.begin());
  problem_.update_broadphase(nodes_, present_.mounts);
  problem_.evaluate(present_);
  points_ = problem_.points();
  mounts_ = present_.mounts;
  result_.status = problem_.violation() > 0 ? Status::kGaveUp : pursue({present_.command.cables, length});
  finish(present_.command, to);
  if (present_.command.loads < 1) result_.status = Status::kGaveUp;  // no equilibrium under all loads
  return result_;
}

// Whether no cable is too short for the shape of a segment without loads, which is left in `one`. Cables all around a
// robot that are let out just so far have dependent slopes there, with which Newton's method finds no step.
template <class Model>
bool ModelContinuation<Model>::rests_at(Iterate& one) {
  if (!Model::kRod || layout_.cables.size == 1) return false;
  Control& control = one.controls[0];
  std::copy_n(one_.rod.rest.begin(), Model::kControl, control.v.begin());
  if (control.v == Control{}.v && highest(one.command.cables) > 0) return false;  // a straight one takes up nothing
  return segment_.problem.evaluate(one) && segment_.problem.violation() <= kFeasibility * one_.max_length;
}

// Leaves in `one` the shape of a segment of the robot that nothing touches, as Newton's method finds it from `trial_`.
template <class Model>
bool ModelContinuation<Model>::bend_segment(Iterate& one) {
  one.controls[0] = trial_.controls[0];
  for (int j = 0; j < trial_.active.count; ++j)
    if (const int contact = trial_.active.contact[j]; problem_.is_slack(contact)) {
      one.active.contact[one.active.count] = contact - problem_.contacts();
      one.active.multiplier[one.active.count++] = trial_.active.multiplier[j];
    }
  if (!segment_.solve(one, 0).converged || !segment_.is_definite(one.active)) return false;
  const int cables = static_cast<int>(layout_.cables.size);
  const auto begin = one.active.contact.begin(), end = begin + one.active.count;
  return std::none_of(begin, end, [&](int contact) { return contact >= cables; });  // its disks do not meet
}

// Leaves in `trial_` the shape of the robot that nothing touches, where it bends alike in all segments: in closed form,
// or as that of one segment. False where it does not, or would not stay so.
template <class Model>
bool ModelContinuation<Model>::bend_freely() {
  if (problem_.has_free_form()) {
    problem_.set_free_shape(trial_);
    return true;
  }
  if (!bends_evenly_) return false;
  const int n = problem_.robot().segments, cables = static_cast<int>(layout_.cables.size);
  Iterate& one = even_;
  for (int k = 0; k < cables; ++k) one.command.cables[k] = trial_.command.cables[k] / n;
  one.command.length = trial_.command.length / n;
  one.active.count = 0;
  if (!rests_at(one) && !bend_segment(one)) return false;
  std::fill(trial_.controls.begin(), trial_.controls.end(), one.controls[0]);
  std::fill(trial_.mounts.begin(), trial_.mounts.end(), Position{});
  trial_.active = one.active;
  for (int j = 0; j < one.active.count; ++j) trial_.active.contact[j] += problem_.contacts();
  return true;
}

// Before the robot first touches: keeps its last shape, from which the onset of the contact is found.
template <class Model>
void ModelContinuation<Model>::keep_before_contact(const Iterate& next) {
  if (bends_evenly_ || problem_.touches_obstacle(present_.active)) return;
  if (!problem_.touches_obstacle(next.active)) return;
  before_contact_ = present_;
  at_contact_ = next.command;
}

// Leaves in `trial_` the robot under a command part of the way to where it touches; false where it touches.
template <class Model>
bool ModelContinuation<Model>::is_clear_at(const Command& start, double part) {
  if (bends_evenly_) {
    trial_.command = between(start, present_.command, part);
    return bend_freely() && problem_.evaluate(trial_) &&
           problem_.violation() <= kFeasibility * problem_.robot().max_length;
  }
  trial_ = before_contact_;
  trial_.command = between(before_contact_.command, at_contact_, part);
  if (newton_.solve(trial_, 0).converged && !problem_.touches_obstacle(trial_.active)) return true;
  trial_ = before_contact_;
  problem_.evaluate(trial_);
  return false;
}

// Tensions of the free robot where it first touches, each with the sign of its displacement. The place is found by
// bisection; of a robot that bends evenly, whose gaps are known on both sides, by false position (Illinois).
template <class Model>
ModelContinuation<Model>::Tensions ModelContinuation<Model>::first_tensions(const Command& start) {
  const auto clear = [&](int part) { return is_clear_at(start, static_cast<double>(part) / kOnsetParts); };
  const auto nearest = [&] {  // gap of any obstacle where that was asked last
    double gap = HUGE_VAL;
    for (const int contact : problem_.near_contacts())
      if (contact < problem_.contacts()) gap = std::min(gap, problem_.gaps()[contact]);
    return gap;
  };
  int low = 0, high = kOnsetParts, last = 0;
  const bool touches = !clear(high);
  double above = HUGE_VAL, below = nearest();  // gaps there
  while (touches && high - low > 1) {
    const bool known = bends_evenly_ && above > 0 && above < HUGE_VAL && below < 0;
    const double share = known ? above / (above - below) : 0.5;
    const int middle = std::clamp(low + static_cast<int>((high - low) * share), low + 1, high - 1);
    const int side = clear(middle) ? 1 : -1;
    (side > 0 ? low : high) = middle;
    (side > 0 ? above : below) = nearest();
    if (side == last) (side > 0 ? below : above) /= 2;
    last = side;
  }
  clear(bends_evenly_ ? high : low);
  problem_.reduced_gradient(trial_.active);
  Tensions tensions = problem_.tensions(trial_.active);
  if (!Model::kRod)
    for (int k = 0; k < kCables; ++k)
      if (trial_.command.cables[k] < 0) tensions[k] = -tensions[k];
  return tensions;
}

#define CCR_INSTANTIATE(Model)                                                 \
  template StepResult ModelContinuation<Model>::rest(double, double*);         \
  template bool ModelContinuation<Model>::bend_freely();                       \
  template void ModelContinuation<Model>::keep_before_contact(const Iterate&); \
  template ModelContinuation<Model>::Tensions ModelContinuation<Model>::first_tensions(const Command&);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
