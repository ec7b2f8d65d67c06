// Motors of a rod at their limit while others go on: they cannot hold, but keep their tension. The length of the cable
// follows, so that it is let out, or pulled in as far as commanded: 0 <= command - length ⟂ limit - tension >= 0.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

// The highest tension of a cable that is held at a length.
template <class Model>
double ModelContinuation<Model>::highest_held(const Tensions& tensions) const {
  if (!problem_.keeps_tensions()) return highest(tensions);
  double tension = -HUGE_VAL;
  for (int k = 0; k < kCables; ++k)
    if (!problem_.keeps_tension(k)) tension = std::max(tension, tensions[k]);
  return tension;
}

// Where pulling on leads beyond the limit: lets the motors keep their tension that are at the limit then, or else
// raises it to there, or else lets those that jump over it keep what they have, which is raised in the end, or else
// lets all that are at the limit. False where there are none but those that do, or one cable while the base stands.
template <class Model>
bool ModelContinuation<Model>::stop_holding(const Command& wanted) {
  if constexpr (Model::kRod) {
    if (layout_.cables.size == 1 && !moves_base(wanted)) return false;
    evaluate_present();
    if (highest_held(tensions_) > problem_.robot().max_tension) return false;
    if (keep_tensions_at_limit(over_limit_) || raise_to_limit(wanted) || keep_tensions_that_jump()) return true;
    Tensions all;
    all.v.fill(HUGE_VAL);
    return keep_tensions_at_limit(all);
  }
  return false;
}

// Lets those of the motors that hold a length keep their present tension. False where there are none.
template <class Model>
template <class Which>
bool ModelContinuation<Model>::keep_tensions(const Which& which) {
  bool kept = false;
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k) {
    if (problem_.keeps_tension(k) || !which(k)) continue;
    keep_tension(k);
    kept = true;
  }
  if (kept) clear_trend();
  return kept;
}

// Lets motors keep their present tension that jumps over the limit within the smallest sub-step, as where another cable
// becomes taut, or slack that shared the load. False where there are none, or none that have not done so too often.
template <class Model>
bool ModelContinuation<Model>::keep_tensions_that_jump() {
  return keep_tensions([&](int k) { return over_limit_[k] > problem_.robot().max_tension && jumps_[k]++ < kJumps; });
}

// Raises tensions to the limit that motors keep below it. False where there are none, or none that have not been raised
// too often.
template <class Model>
bool ModelContinuation<Model>::raise_kept_tensions(const Command& target) {
  bool raised = false;
  if constexpr (Model::kRod) {
    const double limit = problem_.robot().max_tension, aim = limit * (1 - kTensionBand / 2);
    evaluate_present();
    if (highest_held(tensions_) > limit) return false;
    for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k) {
      if (!problem_.keeps_tension(k) || tensions_[k] >= limit * (1 - kTensionBand) || jumps_[k] > kJumps) continue;
      raise_tension(k, aim, target.cables[k]);
      raised = true;
    }
  }
  return raised;
}

// Lets the motors at the limit keep their tension, among those that some tensions exceed it of.
template <class Model>
bool ModelContinuation<Model>::keep_tensions_at_limit(const Tensions& over) {
  const double limit = problem_.robot().max_tension, least = limit * (1 - kTensionBand);
  return keep_tensions([&](int k) { return !let_out_[k] && over[k] > limit && tensions_[k] >= least; });
}

// Where the tensions of cables that are pulled jump over the limit within the smallest sub-step, as where others become
// taut: raises them to the limit. False where that leads nowhere.
template <class Model>
bool ModelContinuation<Model>::raise_to_limit(const Command& wanted) {
  const double limit = problem_.robot().max_tension, aim = limit * (1 - kTensionBand / 2);
  bool raised = false;
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k) {
    if (problem_.keeps_tension(k) || let_out_[k] || over_limit_[k] <= limit || !pulls_in(wanted, k)) continue;
    raised |= raise_tension(k, aim, wanted.cables[k]);
  }
  return raised;
}

// Raises the tension of one cable, whose length follows, up to an aim, and lets its motor keep it. False where its
// ceiling or the limit of another comes first: it is held there.
template <class Model>
bool ModelContinuation<Model>::raise_tension(int cable, double aim, double ceiling) {
  const double limit = problem_.robot().max_tension;
  keep_tension(cable);
  double rise = aim - tensions_[cable];
  for (int i = 0; i < kStallIterations && tensions_[cable] < aim; ++i) {
    const double tension = std::min(aim, tensions_[cable] + rise);
    problem_.keep_tension(cable, tension);
    const Command here = present_.command;
    const bool follows = try_command(here) == Move::kAccepted && problem_.taken(cable) <= ceiling &&
                         highest_held(trial_tensions_) <= limit;
    if (follows) {
      accept();
      clear_trend();
      rise *= 2;
      continue;
    }
    present_evaluated_ = false;
    problem_.keep_tension(cable, tensions_[cable]);
    rise /= 4;
  }
  const bool raised = tensions_[cable] >= aim;
  if (!raised) hold_length(cable);
  return raised;
}

// The highest tension that a motor keeps, beyond which the rounding of a multiplier must not lead.
template <class Model>
double ModelContinuation<Model>::below_limit() const {
  constexpr double kRounding = 1e-15;
  return problem_.robot().max_tension * (1 - kRounding);
}

// Lets a motor keep its tension at `present_`, to which the cable is then a load.
template <class Model>
void ModelContinuation<Model>::keep_tension(int cable) {
  if constexpr (Model::kRod) {
    problem_.keep_tension(cable, std::min(tensions_[cable], below_limit()));
    ActiveSet& active = present_.active;
    for (int j = 0; j < active.count; ++j)
      if (active.contact[j] == problem_.slack_contact(cable)) active.drop(j--);
    present_evaluated_ = false;
    evaluate_present();
  }
}

// Lets a motor that keeps its tension hold its cable at the length of `present_` instead.
template <class Model>
void ModelContinuation<Model>::hold_length(int cable) {
  if constexpr (Model::kRod) {
    evaluate_present();
    add_tension(cable, problem_.kept_multiplier(cable), present_.active);
    problem_.keep_tension(cable, HUGE_VAL);
    present_evaluated_ = false;
    evaluate_present();
    clear_trend();
  }
}

// Lets all motors hold their cables again, which are at a command where they have followed to it within rounding.
template <class Model>
void ModelContinuation<Model>::hold_lengths(const Command& target) {
  for (int k = 0; problem_.keeps_tensions(); ++k) {
    if (!problem_.keeps_tension(k)) continue;
    double& length = present_.command.cables[k];
    if (std::abs(length - target.cables[k]) <= follow_tolerance()) length = target.cables[k];
    hold_length(k);
  }
}

// How closely the length that a cable follows is known [mm]: another one through the same holes, which is held, closes
// its gap within this.
template <class Model>
double ModelContinuation<Model>::follow_tolerance() const {
  return kFeasibility * problem_.robot().max_length;
}

// Adds a cable whose motor keeps its tension to an active set: first, as those of a block are.
template <class Model>
void ModelContinuation<Model>::add_tension(int cable, double multiplier, ActiveSet& active) const {
  active.count = std::min(active.count + 1, kMaxActive);
  std::copy_backward(active.contact.begin(), active.contact.begin() + active.count - 1,
                     active.contact.begin() + active.count);
  std::copy_backward(active.multiplier.begin(), active.multiplier.begin() + active.count - 1,
                     active.multiplier.begin() + active.count);
  active.contact[0] = problem_.slack_contact(cable);
  active.multiplier[0] = multiplier;
}

// Writes the lengths to which cables have followed the shape at which the problem is evaluated.
template <class Model>
void ModelContinuation<Model>::follow_lengths(Command& command) const {
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
    if (problem_.keeps_tension(k)) command.cables[k] = problem_.taken(k);
}

// Leaves cables out of a goal whose motors keep their tension, unless it lets them out by more than rounding.
template <class Model>
void ModelContinuation<Model>::leave_kept(Command& goal) const {
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k) {
    const double present = present_.command.cables[k];
    if (problem_.keeps_tension(k) && goal.cables[k] >= present - follow_tolerance()) goal.cables[k] = present;
  }
}

// How far cables may be pulled in part of the way to a goal.
template <class Model>
ModelContinuation<Model>::Command ModelContinuation<Model>::ceiling(const Command& wanted, const Command& goal,
                                                                    double part) const {
  Command highest = between(present_.command, goal, part);
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
    if (wanted.cables[k] >= present_.command.cables[k]) highest.cables[k] = wanted.cables[k];
  return highest;
}

// A cable that has followed the shape at which the problem is evaluated farther than its motor lets it out; -1 where
// there is none.
template <class Model>
int ModelContinuation<Model>::unwound_cable() const {
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
    if (problem_.keeps_tension(k) && problem_.taken(k) < problem_.robot().rod.least_pull - follow_tolerance()) return k;
  return -1;
}

// A cable that has followed the shape at which the problem is evaluated farther in than to a ceiling; -1 where there is
// none.
template <class Model>
int ModelContinuation<Model>::cable_beyond(const Command& ceiling) const {
  int beyond = -1;
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
    if (problem_.keeps_tension(k) && problem_.taken(k) > ceiling.cables[k] + follow_tolerance()) beyond = k;
  return beyond;
}

// Whether the tension of a cable in `trial_` exceeds the limit that is none of some.
template <class Model>
bool ModelContinuation<Model>::exceeds_limit_beside(const std::array<int, kMaxCables>& some, int count) const {
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
    if (trial_tensions_[k] > problem_.robot().max_tension && std::count(some.begin(), some.begin() + count, k) == 0)
      return true;
  return false;
}

// Tries a command among motors that keep their tension, none of which pulls its cable farther in than to a ceiling:
// what would go beyond is held there. A motor that has no more to let out holds its cable, whatever the tension then.
template <class Model>
ModelContinuation<Model>::Move ModelContinuation<Model>::try_below(const Command& ceiling, Command command) {
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
    if (problem_.keeps_tension(k)) command.cables[k] = present_.command.cables[k];
  std::array<int, kMaxCables> stopped;
  int count = 0;
  for (Move move = try_command(command);; move = try_command(command)) {
    const bool shortest = command_distance(present_.command, command) <= kSmallestStep;
    if (const int unwound = move == Move::kAccepted ? unwound_cable() : -1; unwound >= 0) {
      if (shortest) {
        hold_length(unwound);
        let_out_[unwound] = true;
        continue;
      }
      move = Move::kRejected;
    }
    const int beyond = move == Move::kAccepted ? cable_beyond(ceiling) : -1;
    if (move == Move::kAccepted && beyond < 0) return move;
    if (move != Move::kAccepted) {
      // Those that were stopped keep their tension in a shorter sub-step, or on the way to where they snap: they cannot
      // be held there.
      const bool jumps = move == Move::kOverTension && shortest && exceeds_limit_beside(stopped, count);
      for (int j = 0; j < count && !jumps; ++j) keep_tension(stopped[j]);
      return count > 0 && !jumps ? Move::kRejected : move;
    }
    stopped[count++] = beyond;
    hold_length(beyond);
    command.cables[beyond] = ceiling.cables[beyond];
  }
}

// Whether a command is met after all, at which the pursuit of it ended with a status, or so close to it that one more
// sub-step meets it: several cables meet it to within the feasibility of their slack.
template <class Model>
bool ModelContinuation<Model>::is_met(const Command& target, Status status) {
  if (status < Status::kStalled || result_.interrupted) return false;
  const Robot& robot = problem_.robot();
  const bool several = Model::kRod && layout_.cables.size > 1;
  if (several && status == Status::kStalled && !(present_.command == target) &&
      command_distance(present_.command, target) <= kSmallestStep && try_command(target) == Move::kAccepted) {
    accept();
    clear_trend();
  }
  evaluate_present();
  const double hidden = several ? follow_tolerance() / robot.offset : 0.0;
  return command_distance(present_.command, target) <= std::max(hidden, kCommandResolution) &&
         highest(tensions_) <= robot.max_tension;
}

// Where cables that no limit stops lock a robot that touches nothing, to first order: takes it to the command past
// their balance, with motors of growing strength that let their cables follow meanwhile. False where it is not reached
// before geometry blocks the robot.
template <class Model>
bool ModelContinuation<Model>::pass_with_limit(const Command& target) {
  const Robot& robot = problem_.robot();
  if (!Model::kRod || layout_.cables.size == 1 || std::isfinite(robot.max_tension)) return false;
  if (problem_.touches_obstacle(present_.active) || moves_obstacles(target)) return false;
  const double unit = robot.rigidity / (robot.offset * robot.max_length);
  locked_ = present_;
  bool reached = false;
  for (double limit = kFirstLimit * unit; !reached && limit < kTight * unit && !work_is_spent(); limit *= 2) {
    evaluate_present();
    if (highest(tensions_) > limit) continue;
    problem_.limit_tensions(limit);
    pursue(target);
    reached = command_distance(present_.command, target) <= kCommandResolution;
  }
  problem_.limit_tensions(HUGE_VAL);
  if (!reached) present_ = locked_;
  present_evaluated_ = false;
  evaluate_present();
  if (!reached) record_shape();
  return reached;
}

#define CCR_INSTANTIATE(Model)                                                                                         \
  template double ModelContinuation<Model>::highest_held(const Tensions&) const;                                       \
  template bool ModelContinuation<Model>::stop_holding(const Command&);                                                \
  template bool ModelContinuation<Model>::raise_kept_tensions(const Command&);                                         \
  template void ModelContinuation<Model>::hold_length(int);                                                            \
  template bool ModelContinuation<Model>::is_met(const Command&, Status);                                              \
  template bool ModelContinuation<Model>::pass_with_limit(const Command&);                                             \
  template double ModelContinuation<Model>::follow_tolerance() const;                                                  \
  template double ModelContinuation<Model>::below_limit() const;                                                       \
  template void ModelContinuation<Model>::hold_lengths(const Command&);                                                \
  template void ModelContinuation<Model>::add_tension(int, double, ActiveSet&) const;                                  \
  template void ModelContinuation<Model>::follow_lengths(Command&) const;                                              \
  template void ModelContinuation<Model>::leave_kept(Command&) const;                                                  \
  template int ModelContinuation<Model>::unwound_cable() const;                                                        \
  template int ModelContinuation<Model>::cable_beyond(const Command&) const;                                           \
  template ModelContinuation<Model>::Command ModelContinuation<Model>::ceiling(const Command&, const Command&, double) \
      const;                                                                                                           \
  template ModelContinuation<Model>::Move ModelContinuation<Model>::try_below(const Command&, Command);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
