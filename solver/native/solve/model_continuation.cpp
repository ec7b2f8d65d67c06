// An equilibrium followed along its branch, by sub-steps that are halved until each continues it.
#include "solve/model_continuation.hpp"

#include <algorithm>
#include <cmath>

#include "model/models.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
struct ModelContinuation<Model>::Pursuit {
  Command target;            // the command
  Command wanted = target;   // the command, less what stalled cables do not meet
  Command resumed = target;  // where stalled cables were last pulled again
  bool was_resumed = false;  // whether they were
  double step = kLargestStep;
  double yielding = kYield;  // least displacement of the next yield [a]
  bool holds = false;        // whether obstacles have pressed the cable to its limit, which is not pulled meanwhile
  bool refined = false;      // whether the last sub-step was rejected: the next one must not grow at once
  double finest = kSmallestStep;  // sub-step before the branch counts as ended
  int crept = 0;                  // descents from the finest sub-steps, since one as large as kSmallestStep succeeded
  bool snapped = false;           // whether the robot has
  Status reached = Status::kConverged;
  bool over = false;  // with `reached`
};

namespace {

// Leaves in `one` a segment of a robot that bends evenly.
void take_segment(const Robot& robot, Robot& one) {
  one = robot;
  one.max_length /= robot.segments;
  one.segments = 1;
  one.lines.assign(1, {});
  for (Cable& cable : one.rod.cables) cable.end = 1;
}

Robot one_segment(const Robot& robot) {
  Robot one;
  take_segment(robot, one);
  return one;
}

}  // namespace

template <class Model>
ModelContinuation<Model>::ModelContinuation(const Robot& robot, int obstacles)
    : layout_(make_block_layout<Model>({.segments = robot.segments,
                                        .cables = Model::kRod ? static_cast<int>(robot.rod.cables.size()) : kCables,
                                        .lines = static_cast<int>(robot.lines.size()),
                                        .positions = robot.positions(),
                                        .obstacles = obstacles})),
      newton_(robot, obstacles),
      bends_evenly_(robot.bends_evenly()),
      one_(one_segment(robot)),
      segment_(one_, 0),
      nodes_(robot.segments + 1),
      frames_(robot.segments + 1),
      points_(robot.points()) {
  even_.controls.resize(1);
  present_.controls.resize(robot.segments);
  trend_.controls.resize(robot.segments);
}

template <class Model>
void ModelContinuation<Model>::set_robot(const Robot& robot) {
  problem_.set_robot(robot);
  bends_evenly_ = robot.bends_evenly();
  if (!bends_evenly_) return;
  take_segment(robot, one_);
  segment_.problem.set_robot(one_);
}

template <class Model>
void ModelContinuation<Model>::set_obstacles(std::span<const Obstacle<kSpace>> obstacles) {
  newton_.set_obstacles(obstacles);
  trend_.mounts.resize(problem_.mounts());
  present_.mounts.resize(problem_.mounts());
  trial_ = present_;
}

// Makes `trial_`, at which the problem is evaluated, the present equilibrium.
template <class Model>
void ModelContinuation<Model>::accept() {
  update_trend();
  const double limit = problem_.robot().max_tension;
  if (highest(tensions_) <= limit && highest(trial_tensions_) > limit)
    keep_last_held(present_, problem_.kept_tensions(), recorded());
  if (problem_.keeps_tensions()) follow_lengths(trial_.command);
  keep_before_contact(trial_);
  std::swap(present_, trial_);
  tensions_ = trial_tensions_;
  energy_ = problem_.energy();
  present_evaluated_ = true;
  record_shape();
}

template <class Model>
void ModelContinuation<Model>::evaluate_present() {
  if (present_evaluated_) return;
  problem_.evaluate(present_);
  problem_.reduced_gradient(present_.active);
  tensions_ = problem_.tensions(present_.active);
  energy_ = problem_.energy();
  present_evaluated_ = true;
}

template <class Model>
Status ModelContinuation<Model>::pursue(const Command& target) {
  Pursuit pursuit{.target = target};
  const Status status = pursue(pursuit);
  hold_lengths(target);
  if (status == Status::kBlocked && pass_with_limit(target)) return Status::kSnapped;
  if (!is_met(target, status)) return status;
  result_.reason = Reason::kNone;
  return pursuit.snapped ? Status::kSnapped : Status::kConverged;  // what stalled on the way was pulled in after all
}

template <class Model>
Status ModelContinuation<Model>::pursue(Pursuit& pursuit) {
  newton_.begin_step();
  over_limit_ = {}, let_out_ = {}, jumps_ = {};
  met_slack_ = false;
  const double limit = problem_.robot().max_tension;
  for (int sub = 0; sub < kSubSteps && !work_is_spent(); ++sub) {
    // A release may lead to more tension than a motor holds: it yields until it holds again.
    if (highest(tensions_) > limit) {
      if (yield_cables(pursuit.wanted, pursuit.yielding)) {
        pursuit.reached = std::max(pursuit.reached, Status::kStalled);
        clear_trend();
        pursuit.yielding *= 2;
      } else if (is_unyielding()) {
        return Status::kStalled;
      }
    } else if (pursuit.yielding > kYield) {
      stop_yielding(pursuit.target, pursuit.wanted);
      pursuit.yielding = kYield;
    }
    Command goal = raise_to_pretension(pursuit.wanted);
    if (moves_obstacles(goal)) share_motion(goal, pursuit.holds);
    if (highest(tensions_) > limit) wait_for_motors(goal);
    if (problem_.keeps_tensions()) leave_kept(goal);
    const double remaining = command_distance(present_.command, goal);
    if (remaining == 0 && (raise_kept_tensions(pursuit.target) || resume(pursuit))) continue;
    if (remaining == 0 || !advance(pursuit, goal, remaining)) return pursuit.reached;
  }
  result_.reason = Reason::kWork;
  return Status::kGaveUp;
}

// Pulls stalled cables again, as others that moved on may have let them; false where that has just been tried.
template <class Model>
bool ModelContinuation<Model>::resume(Pursuit& pursuit) {
  const Command& here = present_.command;
  if (pursuit.wanted == pursuit.target || pursuit.reached != Status::kStalled) return false;
  if (pursuit.was_resumed && command_distance(here, pursuit.resumed) <= kSmallestStep) return false;
  pursuit.wanted = pursuit.target;
  pursuit.resumed = here;
  pursuit.was_resumed = true;
  let_out_ = {};
  return true;
}

// One sub-step towards a command at a distance; false at the end of the pursuit.
template <class Model>
bool ModelContinuation<Model>::advance(Pursuit& pursuit, const Command& goal, double remaining) {
  double& step = pursuit.step;
  if (step > kPeakStep && !pursuit.refined && peaks_at_limit(goal, remaining)) step = kPeakStep;
  bool stalled = stalls_at_once(goal, remaining);
  const double size = step >= remaining - kCommandResolution ? remaining : step;  // leaves no rest to round off
  const Command next = size == remaining ? goal : between(present_.command, goal, size / remaining);
  Move move = Move::kOverTension;
  const bool had_met = met_slack_;
  if (!stalled)
    move = problem_.keeps_tensions() ? try_below(ceiling(pursuit.wanted, goal, size / remaining), next)
                                     : try_command(next);
  if (met_slack_ && !had_met) return true;  // to be pulled first
  if (move == Move::kPushing) return give_way(pursuit, next, size, true);
  if (move == Move::kOverTension && moves_obstacles(next)) {
    if (layout_.cables.size == 1) return give_way(pursuit, next, size, false);
    move = Move::kAccepted;  // what the motors cannot hold then, they let out
  }
  if (move == Move::kAccepted) {
    accept();
    step = pursuit.refined ? size : std::min(2 * size, kLargestStep);
    pursuit.refined = false;
    if (size >= kSmallestStep) {
      pursuit.finest = kSmallestStep;
      pursuit.crept = 0;
    }
  } else if (move == Move::kOverTension) {
    const bool may_fall = !stalled && size > kSmallestStep && is_at_tension_limit() && gap_closed();
    stalled = stalled || (!may_fall && approach_tension_limit());
    step = may_fall ? std::min(size / 2, kPeakStep) : size / 2;
  } else if (size > pursuit.finest || (size > kTightStep && is_tight() && !is_blocked(next))) {
    step = size / 2;
    pursuit.refined = true;
  } else if (const Conflict conflict = meet_conflict(next); conflict == Conflict::kTight) {
    stalled = true;
    over_limit_ = {};
  } else {
    // Cables that no limit stops buckle the robot, farther than roundoff in its energy hides. Nor does a descent from
    // the finest sub-steps leave a branch that ends within roundoff: after some, it goes farther.
    const bool buckles = conflict == Conflict::kBlocked && size < kPatientStep;
    const double least = buckles ? kPatientStep : pursuit.crept >= kCreeps ? kSmallestStep : 0.0;
    const double part = std::min(1.0, least / remaining);
    const End end = descend_from_end(least > size ? between(present_.command, goal, part) : next,
                                     ceiling(pursuit.wanted, goal, size / remaining));
    pursuit.crept += size <= kTightStep;
    if (end == End::kStuck) {
      const bool stopped = conflict == Conflict::kBlocked || is_blocked(next);
      return refine(pursuit, size, stopped || (moves_obstacles(next) && result_.reason == Reason::kStuck));
    }
    stalled = end == End::kOverTension;
    if (problem_.keeps_tensions()) pursuit.reached = std::max(pursuit.reached, Status::kStalled);
    pursuit.snapped = pursuit.snapped || end == End::kSnapped;
    if (end == End::kSnapped) pursuit.reached = std::max(pursuit.reached, Status::kSnapped);
    step = 2 * (pursuit.finest < kSmallestStep ? size : kSmallestStep);
    pursuit.refined = false;
  }
  if (!stalled) return true;
  pursuit.reached = std::max(pursuit.reached, Status::kStalled);
  if (stop_holding(pursuit.wanted)) return true;
  if (!hold_stalled_cables(pursuit.wanted) && !raise_kept_tensions(pursuit.target) && !resume(pursuit)) return false;
  clear_trend();
  return true;
}

// One sub-step in which obstacles press so much that the motor has to let the cable out, or that the cable would have
// to push; false where they cannot go on.
template <class Model>
bool ModelContinuation<Model>::give_way(Pursuit& pursuit, const Command& next, double size, bool pushing) {
  pursuit.holds = !pushing;
  if (!pushing && pay_out(next)) {
    pursuit.step = pursuit.refined ? size : std::min(2 * size, kLargestStep);
    pursuit.refined = false;
  } else {
    pursuit.step = size / 2;
    pursuit.refined = true;
    if (size <= kSmallestStep) pursuit.reached = Status::kBlocked;
  }
  return pursuit.reached != Status::kBlocked;
}

// A branch that ends within a sub-step from where no descent leads on may go on in finer ones, as where neighbouring
// contacts wedge the robot and its tension rises steeply. False where it is blocked, folds over, or goes on in none:
// where it has risen beyond what any motion needs, the robot is blocked.
template <class Model>
bool ModelContinuation<Model>::refine(Pursuit& pursuit, double size, bool blocked) {
  if (blocked || result_.reason != Reason::kStuck || std::min(pursuit.finest, size) <= kTightStep) {
    const bool seized = result_.reason == Reason::kStuck && std::isinf(problem_.robot().max_tension) && is_tight();
    pursuit.reached = blocked || seized ? Status::kBlocked : Status::kGaveUp;
    return false;
  }
  pursuit.finest = std::max(pursuit.finest * kRefining, kTightStep);
  pursuit.step = size / 2;
  pursuit.refined = true;
  result_.reason = Reason::kNone;
  return true;
}

template <class Model>
StepResult ModelContinuation<Model>::follow(const double* from, const double* target, double* to,
                                            const StepSlopes& slopes) {
  result_ = {};
  factorizations_before_ = newton_.factorizations();
  was_exceeded_ = false;
  read_block(from);
  const Command start = present_.command;
  const std::size_t cables = layout_.cables.size;
  Command wanted{};
  std::copy_n(target, cables, wanted.cables.v.begin());
  wanted.length = target[cables];
  if (shapes_) {
    evaluate_present();
    record_shape();
  }
  result_.status = pursue(wanted);
  finish(start, to);
  if (result_.status == Status::kGaveUp && !std::isfinite(problem_.objective())) {
    result_.scene = start.scene;
    if (to != from) std::copy_n(from, layout_.size, to);
  }
  if (slopes.rows) result_.differentiated = differentiate_step(start, wanted, to, slopes);
  return result_;
}

// Writes the equilibrium that a step from a command has reached; nothing where it was interrupted, or no robot can have
// its coordinates.
template <class Model>
StepResult ModelContinuation<Model>::finish(const Command& start, double* to) {
  if (result_.interrupted) return result_;
  if (was_exceeded_ && highest(tensions_) > problem_.robot().max_tension) {  // the step ended amid a yield
    present_ = last_held_;
    present_evaluated_ = false;
    evaluate_present();
    if (shapes_) shapes_->resize(last_held_trace_);
    record_shape();
  }
  if (!problem_.touches_obstacle(present_.active)) {
    onset_ = {};
  } else if (!began_in_contact_) {
    onset_ = first_tensions(start);
    present_evaluated_ = false;
  }
  evaluate_present();
  result_.factorizations = static_cast<int>(newton_.factorizations() - factorizations_before_);
  result_.scene = present_.command.scene;
  if (std::isfinite(problem_.objective()))
    write_block(to);
  else
    result_.status = Status::kGaveUp;
  return result_;
}

template <class Model>
StepResult ModelContinuation<Model>::trace(const double* from, const double* target, double* to,
                                           std::vector<double>& shapes) {
  shapes_ = &shapes;
  const StepResult result = follow(from, target, to, {});
  shapes_ = nullptr;
  return result;
}

#define CCR_INSTANTIATE(Model)                                                                                    \
  template ModelContinuation<Model>::ModelContinuation(const Robot&, int);                                        \
  template Status ModelContinuation<Model>::pursue(const Command&);                                               \
  template StepResult ModelContinuation<Model>::follow(const double*, const double*, double*, const StepSlopes&); \
  template void ModelContinuation<Model>::evaluate_present();                                                     \
  template StepResult ModelContinuation<Model>::finish(const Command&, double*);                                  \
  template void ModelContinuation<Model>::accept();
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

template <>
std::unique_ptr<Continuation<2>> make_continuation(const Robot& robot, int obstacles) {
  if (robot.model == ModelKind::kPlanarRod) return std::make_unique<ModelContinuation<PlanarRod>>(robot, obstacles);
  return std::make_unique<ModelContinuation<PlanarPaper>>(robot, obstacles);
}

template <>
std::unique_ptr<Continuation<3>> make_continuation(const Robot& robot, int obstacles) {
  if (robot.model == ModelKind::kSpatialRod) return std::make_unique<ModelContinuation<SpatialRod>>(robot, obstacles);
  return std::make_unique<ModelContinuation<SpatialPaper>>(robot, obstacles);
}

}  // namespace ccr
