// The limit of the cable tensions: stalls, motors that yield, and places that are blocked whatever the tension.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
bool ModelContinuation<Model>::is_at_tension_limit() const {
  return highest_held(tensions_) >= problem_.robot().max_tension * (1 - kTensionBand);
}

// Whether a tension exceeds by far what the robot needs to bend: geometry begins to block it, ever more closely.
template <class Model>
bool ModelContinuation<Model>::is_tight() const {
  const Robot& robot = problem_.robot();
  return highest(tensions_) > kTight * robot.rigidity / (robot.offset * robot.max_length);
}

template <class Model>
void ModelContinuation<Model>::keep_last_held(const Iterate& held, const Tensions& kept, std::size_t recorded) {
  last_held_ = held;
  last_held_trace_ = recorded;
  for (int k = 0; Model::kRod && k < kCables; ++k)
    if (kept[k] < HUGE_VAL)
      add_tension(k, kept[k] / problem_.robot().energy_scale(held.command.length), last_held_.active);
  was_exceeded_ = true;
}

// Whether a gap closed from `present_` to `trial_`, before which the tension may have fallen though it rises now.
template <class Model>
bool ModelContinuation<Model>::gap_closed() const {
  const ActiveSet &before = present_.active, &now = trial_.active;
  const auto begin = before.contact.begin(), end = begin + before.count;
  return std::any_of(now.contact.begin(), now.contact.begin() + now.count,
                     [&](int contact) { return std::find(begin, end, contact) == end; });
}

// Whether the tension, which is at its limit, rises at once where the robot is fed or drawn, so that a longer sub-step
// could end behind a peak: the work of the base hides it.
template <class Model>
bool ModelContinuation<Model>::peaks_at_limit(const Command& goal, double remaining) {
  if (!is_at_tension_limit() || goal.length == present_.command.length || moves_obstacles(goal)) return false;
  return try_command(between(present_.command, goal, std::min(1.0, kPeakStep / remaining))) == Move::kOverTension;
}

// Whether cables stall where they are, since those at the limit of their tension tighten at once: among several of a
// rod, a longer sub-step could end behind a peak that is lower than the work of the cables shows.
template <class Model>
bool ModelContinuation<Model>::stalls_at_once(const Command& goal, double remaining) {
  const Command& here = present_.command;
  if (!is_at_tension_limit() || !pulls_cable(goal) || goal.length != here.length || moves_obstacles(goal)) return false;
  if (layout_.cables.size == 1) return true;
  if (!Model::kRod || problem_.keeps_tensions() ||
      try_command(between(here, goal, std::min(1.0, kProbe / remaining))) == Move::kRejected)
    return false;
  const double limit = problem_.robot().max_tension;
  for (int k = 0; k < kCables; ++k) {
    if (tensions_[k] < limit * (1 - kTensionBand) || trial_tensions_[k] < tensions_[k] + kRise * limit) continue;
    over_limit_ = trial_tensions_;
    return true;
  }
  return false;
}

// `present_` is below the tension limit, `trial_` above: closes in from below by false position (Illinois), aiming into
// the middle of the accepted band, with the cables that `trial_` takes beyond the limit: others may be held at it
// already. False where the branch cannot be followed that far, unless the tension jumps over the limit within the
// smallest sub-step, as it may where other cables of a robot that is held tight become taut.
template <class Model>
bool ModelContinuation<Model>::approach_tension_limit() {
  const double limit = problem_.robot().max_tension, aim = limit * (1 - kTensionBand / 2);
  over_limit_ = trial_tensions_;
  const auto approaching = [&] {
    double tension = highest(over_limit_) > limit ? -HUGE_VAL : highest(tensions_);
    for (int k = 0; k < kCables; ++k)
      if (over_limit_[k] > limit) tension = std::max(tension, tensions_[k]);
    return tension;
  };
  const Command start = present_.command, end = trial_.command;
  const double span = command_distance(start, end);
  // Within which any of the cables that share a load may be taut, as their slack is not resolved: those in one
  // direction slacken by thousandths of what they are let out.
  const double hidden = 1e4 * kFeasibility * problem_.robot().max_length / problem_.robot().offset;
  double low = 0, high = 1;  // fractions of the way
  double excess = highest(trial_tensions_) - aim, shortage = approaching() - aim;
  Move last = Move::kRejected;
  for (int i = 0; i < kStallIterations && approaching() < limit * (1 - kTensionBand); ++i) {
    const double width = high - low;
    if (!(width * span > kCommandResolution)) break;
    const double middle =
        std::clamp(high - width * excess / (excess - shortage), low + 1e-3 * width, high - 1e-3 * width);
    Move move = try_command(between(start, end, middle));
    if (move == Move::kRejected) return width * span <= kSmallestStep;
    // A sub-step may be so small that no cable seems to be pulled in.
    if (highest(trial_tensions_) > limit && highest(tensions_) <= limit) move = Move::kOverTension;
    if (move == Move::kAccepted) {
      accept();
      low = middle;
      shortage = approaching() - aim;
      if (move == last) excess /= 2;
    } else {
      high = middle;
      if (width * span > hidden) over_limit_ = trial_tensions_;
      excess = highest(trial_tensions_) - aim;
      if (move == last) shortage /= 2;
    }
    last = move;
  }
  return true;
}

// Gives up pulling the cables whose tension is at the limit, or else those whose tension jumps over it, or else all
// that are pulled. False where there is one cable.
template <class Model>
bool ModelContinuation<Model>::hold_stalled_cables(Command& wanted) const {
  if (layout_.cables.size == 1) return false;
  const double limit = problem_.robot().max_tension;
  const auto give_up = [&](const Tensions& tensions, double least) {
    bool held = false;
    for (int k = 0; k < kCables; ++k) {
      if (tensions[k] < least || !pulls_in(wanted, k)) continue;
      wanted.cables[k] = present_.command.cables[k];
      held = true;
    }
    return held;
  };
  return give_up(tensions_, limit * (1 - kTensionBand)) || give_up(over_limit_, limit) || give_up(tensions_, -HUGE_VAL);
}

// Lets out, by at least so much, the cables whose motors cannot hold them. False where the command lets them out
// farther.
template <class Model>
bool ModelContinuation<Model>::yield_cables(Command& wanted, double least) const {
  const Robot& robot = problem_.robot();
  bool changed = false;
  for (int k = 0; k < kCables; ++k) {
    const double present = present_.command.cables[k], lowest = Model::kRod ? robot.rod.least_pull : 0.0;
    const double held = std::max(pull(present_.command, k) - least * robot.offset, lowest);
    if (tensions_[k] <= robot.max_tension || held == pull(present_.command, k)) continue;
    if (Model::kRod ? wanted.cables[k] <= held : wanted.cables[k] / present <= held / std::abs(present)) continue;
    wanted.cables[k] = Model::kRod ? held : std::copysign(held, present);
    changed = true;
  }
  return changed;
}

// Leaves cables where their motors hold them again, or lets them out as far as a command does.
template <class Model>
void ModelContinuation<Model>::stop_yielding(const Command& target, Command& wanted) const {
  const Command& here = present_.command;
  for (int k = 0; k < kCables; ++k) {
    if (pull(wanted, k) >= pull(here, k)) continue;
    wanted.cables[k] = pull(target, k) < pull(here, k) ? target.cables[k] : here.cables[k];
  }
}

// Keeps other cables from being pulled in while motors yield.
template <class Model>
void ModelContinuation<Model>::wait_for_motors(Command& goal) const {
  for (int k = 0; k < kCables; ++k)
    if (pull(goal, k) > pull(present_.command, k)) goal.cables[k] = present_.command.cables[k];
}

// Whether a cable that its motor cannot hold has nothing more to let out.
template <class Model>
bool ModelContinuation<Model>::is_unyielding() const {
  for (int k = 0; k < kCables; ++k)
    if (tensions_[k] > problem_.robot().max_tension &&
        pull(present_.command, k) <= (Model::kRod ? problem_.robot().rod.least_pull : 0.0))
      return true;
  return false;
}

// The active set at `present_`; where that is empty, the gap that is violated most under a command, with a multiplier
// of one. False where there is none.
template <class Model>
bool ModelContinuation<Model>::find_holding_set(const Command& command, ActiveSet& holding) {
  holding = present_.active;
  if (holding.count > 0) return true;
  present_evaluated_ = false;
  trial_ = present_;
  trial_.command = command;
  if (!problem_.evaluate(trial_)) return false;
  for (const int contact : problem_.near_contacts())
    if (problem_.gaps()[contact] < (holding.count == 0 ? 0.0 : problem_.gaps()[holding.contact[0]])) {
      holding.count = 1;
      holding.contact[0] = contact;
      holding.multiplier[0] = 1;
    }
  return holding.count > 0;
}

// Whether to first order no motion meets a command and all gaps: the multipliers of the holding set balance each other
// without the slope of the energy, Σ λ ∇c = 0, as they do where the tension grows beyond bounds.
template <class Model>
bool ModelContinuation<Model>::is_blocked(const Command& command) {
  const Robot& robot = problem_.robot();
  if (present_.active.count > 0 && !is_tight() && std::isfinite(robot.max_tension) && !moves_obstacles(command) &&
      !(Model::kRod && moves_base(command)))
    return false;
  ActiveSet holding;
  if (!find_holding_set(command, holding)) return false;
  present_evaluated_ = false;
  if (!problem_.evaluate(present_)) return false;
  double pressed = 0, balance = 0;
  for (int j = 0; j < holding.count; ++j)
    pressed = std::max(pressed, holding.multiplier[j] * problem_.lever_arm(holding.contact[j]));
  problem_.reduced_gradient({});
  unloaded_ = problem_.gradient();
  problem_.reduced_gradient(holding);
  for (std::size_t i = 0; i < unloaded_.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k)
      balance = std::max(balance, std::abs(problem_.gradient()[i][k] - unloaded_[i][k]));
  for (std::size_t m = 0; m < present_.mounts.size(); ++m)
    balance =
        std::max(balance, robot.max_length / robot.segments * norm(problem_.mount_load(holding, static_cast<int>(m))));
  return balance <= kBalance * pressed && closes(holding, command);
}

// Whether a command closes gaps, weighted by multipliers, in the shape that is.
template <class Model>
bool ModelContinuation<Model>::closes(const ActiveSet& holding, const Command& command) {
  trial_ = present_;
  trial_.command = between(present_.command, command, kSmallestPart);
  const auto weighted_gaps = [&](const Iterate& at) {
    double sum = 0;
    if (!problem_.evaluate(at)) return sum;
    for (int j = 0; j < holding.count; ++j) sum += holding.multiplier[j] * problem_.gaps()[holding.contact[j]];
    return sum;
  };
  const double before = weighted_gaps(present_);
  return weighted_gaps(trial_) < before;
}

#define CCR_INSTANTIATE(Model)                                                                          \
  template bool ModelContinuation<Model>::is_at_tension_limit() const;                                  \
  template bool ModelContinuation<Model>::is_tight() const;                                             \
  template void ModelContinuation<Model>::keep_last_held(const Iterate&, const Tensions&, std::size_t); \
  template bool ModelContinuation<Model>::gap_closed() const;                                           \
  template bool ModelContinuation<Model>::peaks_at_limit(const Command&, double);                       \
  template bool ModelContinuation<Model>::stalls_at_once(const Command&, double);                       \
  template bool ModelContinuation<Model>::approach_tension_limit();                                     \
  template bool ModelContinuation<Model>::hold_stalled_cables(Command&) const;                          \
  template bool ModelContinuation<Model>::yield_cables(Command&, double) const;                         \
  template void ModelContinuation<Model>::stop_yielding(const Command&, Command&) const;                \
  template void ModelContinuation<Model>::wait_for_motors(Command&) const;                              \
  template bool ModelContinuation<Model>::is_unyielding() const;                                        \
  template bool ModelContinuation<Model>::is_blocked(const Command&);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
