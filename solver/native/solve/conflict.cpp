// Cables that pull against each other, as opposing ones do on a robot that bends evenly: Σ ν ∇c = 0 with ν >= 0 over
// taut cables and closed gaps. To first order no motion shortens these cables, and their tensions can rise together.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

// Follows the branch from `present_` to its end short of a command where gaps conflict, and raises the tensions of the
// cables among them to the limit. Without a limit, or where there are no cables among them, the robot is blocked unless
// it buckles.
template <class Model>
ModelContinuation<Model>::Conflict ModelContinuation<Model>::meet_conflict(const Command& command) {
  for (int i = 0; Model::kRod && i < kMaxCables; ++i) {  // each closes a gap, which may let others conflict
    const ActiveSet conflict = newton_.conflict();
    if (conflict.count == 0) break;
    evaluate_present();
    const int open = widest_gap(conflict);
    if (problem_.gaps()[open] <= kFeasibility * problem_.robot().max_length) {
      if (!holds_cables(conflict) || std::isinf(problem_.robot().max_tension)) return Conflict::kBlocked;
      return raise_tensions(conflict) ? Conflict::kTight : Conflict::kNone;
    }
    if (std::isinf(problem_.gaps()[open]) || !close_gap(command, open)) break;  // one out of reach here is not measured
    trial_ = present_;
    trial_.command = command;
    present_evaluated_ = false;
    if (newton_.solve(trial_, 0).converged) break;
  }
  return Conflict::kNone;
}

// The gap that is open widest among those that conflict: that which was to close last may be closed already.
template <class Model>
int ModelContinuation<Model>::widest_gap(const ActiveSet& conflict) const {
  int widest = conflict.contact[conflict.count - 1];
  for (int j = 0; j < conflict.count; ++j)
    if (conflict.multiplier[j] > 0 && problem_.gaps()[conflict.contact[j]] > problem_.gaps()[widest])
      widest = conflict.contact[j];
  return widest;
}

// Whether cables are among conflicting gaps.
template <class Model>
bool ModelContinuation<Model>::holds_cables(const ActiveSet& conflict) const {
  for (int j = 0; j < conflict.count; ++j)
    if (problem_.is_slack(conflict.contact[j]) && conflict.multiplier[j] > 0) return true;
  return false;
}

// Follows the branch towards a command, which is beyond its end, to where a gap closes, by the secant method.
template <class Model>
bool ModelContinuation<Model>::close_gap(const Command& command, int contact) {
  const Command start = present_.command;
  const double span = command_distance(start, command);
  double low = 0, high = 1, gap = problem_.gaps()[contact], slope = -gap;
  for (int i = 0; i < kStallIterations && (high - low) * span > kCommandResolution; ++i) {
    const double width = high - low, part = std::clamp(low - gap / slope, low + 1e-3 * width, high - 1e-3 * width);
    if (try_command(between(start, command, part)) == Move::kAccepted) {
      accept();
      const double now = problem_.gaps()[contact];
      slope = (now - gap) / (part - low);
      low = part;
      gap = now;
      if (gap <= kFeasibility * problem_.robot().max_length) return true;
      if (!(slope < 0)) return false;
    } else {
      high = part;
      slope = -gap / ((high - low) / 2);
    }
  }
  return false;
}

// Raises the tensions of cables that pull against each other at `present_` until the first is at the limit.
template <class Model>
bool ModelContinuation<Model>::raise_tensions(const ActiveSet& conflict) {
  const double aim = problem_.robot().max_tension * (1 - kTensionBand / 2) / problem_.energy_scale();
  trial_ = present_;
  ActiveSet& raised = trial_.active;
  const auto place = [&raised](int contact) {
    return std::find(raised.contact.begin(), raised.contact.begin() + raised.count, contact) - raised.contact.begin();
  };
  for (int j = 0; j < conflict.count; ++j) {
    if (conflict.multiplier[j] == 0 || place(conflict.contact[j]) < raised.count) continue;
    if (raised.count == kMaxActive) return false;
    raised.contact[raised.count] = conflict.contact[j];
    raised.multiplier[raised.count++] = 0;
  }
  double rise = HUGE_VAL;
  for (int j = 0; j < conflict.count; ++j)
    if (problem_.is_slack(conflict.contact[j]) && conflict.multiplier[j] > 0)
      rise = std::min(rise, (aim - raised.multiplier[place(conflict.contact[j])]) / conflict.multiplier[j]);
  for (int j = 0; j < conflict.count; ++j)
    if (conflict.multiplier[j] > 0)
      raised.multiplier[place(conflict.contact[j])] += std::max(0.0, rise) * conflict.multiplier[j];
  present_evaluated_ = false;
  if (!newton_.settle(trial_)) {
    evaluate_present();
    return false;
  }
  trial_tensions_ = problem_.tensions(raised);
  accept();
  clear_trend();
  return true;
}

#define CCR_INSTANTIATE(Model)                                                                         \
  template ModelContinuation<Model>::Conflict ModelContinuation<Model>::meet_conflict(const Command&); \
  template bool ModelContinuation<Model>::holds_cables(const ActiveSet&) const;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
