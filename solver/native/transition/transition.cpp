#include <algorithm>
#include <utility>

#include "transition/reading.inc"

namespace ccr {

namespace {

constexpr double kTiny = 1e-300;  // keeps quotients defined where nothing touches

}  // namespace

template <int D>
Transition<D>::Transition(BatchArrays<D> robots, BatchArrays<D> model, const Actuation& actuation,
                          const Sensors& sensors, const Estimator<D>& estimator, ObserverSettings observer,
                          TaskSettings task, EpisodeArrays episodes, ReadingArrays readings, SlopeArrays slopes)
    : robots_(robots),
      model_(model),
      layout_(robots.layout()),
      actuation_(actuation),
      sensors_(sensors),
      estimator_(estimator),
      observer_(std::move(observer), sensors_, task.vector, task.estimated),
      task_(std::move(task)),
      episodes_(episodes),
      readings_(readings),
      slopes_(slopes),
      before_(static_cast<std::size_t>(robots.batch->count()) * actuation.cables),
      commanded_(static_cast<std::size_t>(robots.batch->count()) * actuation.actions),
      rows_(robots.batch->threads(), std::vector<double>(observer_.size())) {
  if (!differentiates()) return;
  robot_slopes_ = robots.make_slopes(actuation.inserts());
  if (senses()) model_slopes_ = model.make_slopes(actuation.inserts());
  if (estimator.free().batch) free_slopes_ = estimator.free().make_slopes(actuation.inserts());
}

template <int D>
double Transition<D>::displacement(const double* block, int cable) const {
  return estimator_.signed_tension(block, cable, block[layout_.cables.offset + cable]);
}

// Notes where the cables are before a motion, and that no slopes of it are known.
template <int D>
void Transition<D>::mark(int robot) {
  const double* cables = robots_.blocks[robot] + layout_.cables.offset;
  std::copy_n(cables, actuation_.cables, before_.data() + actuation_.cables * robot);
  if (!differentiates()) return;
  robot_slopes_.kind(robot) = SlopeTable::Kind::kUnknown;
  if (senses()) model_slopes_.kind(robot) = SlopeTable::Kind::kUnknown;
  for (int k = 0; free_slopes_ && k <= estimator_.companions(); ++k)
    free_slopes_.kind(estimator_.free_row(robot) + k) = SlopeTable::Kind::kUnknown;
}

// Moves the motors by an action, and commands what the play between them and the robot lets through.
template <int D>
void Transition<D>::command(int robot, const double* action) {
  double *actuated = episodes_.actuated[robot], *taken = episodes_.actions[robot];
  for (int k = 0; k < actuation_.actions; ++k) {
    taken[k] = bounded(action[k], -1.0, 1.0);
    const double increment = taken[k] * actuation_.increment[k], before = actuated[k], motor = encoders(robot)[k];
    actuated[k] = senses() ? sensors_.apply_backlash(actuation_, robot, k, before, increment)
                           : actuation_.bounded(k, before + increment);
    if (!differentiates()) continue;
    const double inside = encoders(robot)[k] == motor + increment ? 1.0 : 0.0;
    slopes_.motor_per_motor[robot][k] = inside;
    slopes_.motor_per_action[robot][k] = taken[k] == action[k] ? inside * actuation_.increment[k] : 0.0;
    slopes_.follows[robot][k] =
        senses() && sensors_.play(actuation_, robot, k) > 0 && actuated[k] == before ? 0.0 : 1.0;
    slopes_.effort[robot][k] = taken[k] == action[k] ? 2 * taken[k] / actuation_.actions : 0.0;
  }
  actuation_.write_command(actuated, robots_.commands[robot]);
  std::copy_n(actuated, actuation_.actions, commanded_.data() + actuation_.actions * robot);
  ++*episodes_.time[robot];
}

// Notes where the robot has got to, and commands the model to what the encoders read.
template <int D>
void Transition<D>::reach(int robot) {
  const double* block = robots_.blocks[robot];
  double* actuated = episodes_.actuated[robot];
  actuation_.reached(actuated, block + layout_.cables.offset, block[layout_.length.offset], actuated);
  if (!senses()) return;
  for (int c = 0; c < actuation_.cables; ++c) {
    const double now = displacement(block, c), cable = block[layout_.cables.offset + c];
    const double before = before_[actuation_.cables * robot + c];
    sensors_.note_motion(robot, c, now == cable ? before : -before, now);
  }
  actuation_.write_command(sensors_.motor[robot], model_.commands[robot]);
}

// Reads the tensions, and notes those of robots whose model nothing touches.
template <int D>
void Transition<D>::sense(int robot) {
  const double *block = robots_.blocks[robot], *known = model_.blocks[robot];
  double *tensions = episodes_.tensions[robot], *onsets = episodes_.onsets[robot];
  const std::int64_t time = *episodes_.time[robot];
  const bool touching = senses() && estimator_.touches(known);
  for (int c = 0; c < actuation_.cables; ++c) {
    const double nominal = block[layout_.tensions.offset + c];
    tensions[c] = senses() ? sensors_.tension(robot, time, c, nominal) : nominal;
    if (!senses())
      onsets[c] = known[layout_.onset.offset + c];
    else if (!touching)
      onsets[c] = estimator_.signed_tension(known, c, tensions[c]);
  }
}

template <int D>
void Transition<D>::estimate(int robot) {
  estimator_.update(robot, {model_.blocks[robot], encoders(robot), episodes_.tensions[robot], episodes_.onsets[robot],
                            estimator_.free_block(robot)});
}

// Magnitude of the set-point some steps ahead.
template <int D>
double Transition<D>::desired(int robot, int ahead) const {
  const double largest = *episodes_.desired[robot];
  if (!episodes_.profile) return largest;
  const std::int64_t at = std::min<std::int64_t>(*episodes_.time[robot] + ahead, task_.profile_steps - 1);
  return largest * episodes_.profile[robot][at];
}

// Keeps what is read of a robot.
template <int D>
void Transition<D>::keep(int robot) {
  const auto found = read(robot, robots_.blocks[robot], static_cast<const double*>(model_.blocks[robot]),
                          estimator_.chosen(robot), estimator_.paper(robot));
  std::copy_n(found.force_true, D, readings_.force_true[robot]);
  std::copy_n(found.force_est, D, readings_.force_est[robot]);
  std::copy_n(found.force_paper, D, readings_.force_paper[robot]);
  std::copy_n(found.regulated, D, readings_.regulated[robot]);
  std::copy_n(found.goal, task_.vector ? D : 1, readings_.goal[robot]);
  *readings_.force[robot] = found.force;
  *readings_.desired[robot] = found.desired;
  *readings_.error[robot] = found.error;
  *readings_.cost[robot] = found.cost;
  const double* block = robots_.blocks[robot];
  double* to = std::copy_n(block + layout_.cables.offset, actuation_.cables, readings_.actuators[robot]);
  to = std::copy_n(block + layout_.tensions.offset, actuation_.cables, to);
  if (actuation_.inserts()) *to = block[layout_.length.offset];
}

template <int D>
double Transition<D>::effort(int robot) const {
  const double* action = episodes_.actions[robot];
  double squares = action[0] * action[0];
  for (int k = 1; k < actuation_.actions; ++k) squares += action[k] * action[k];
  return squares / actuation_.actions;
}

template <int D>
void Transition<D>::reward(int robot) {
  double *terms = readings_.terms[robot], sum = 0;
  const double clearance = robots_.blocks[robot][layout_.clearance.offset] / task_.length_mm;
  const double inputs[kRewardInputs] = {*readings_.force[robot], *readings_.desired[robot], *readings_.error[robot],
                                        clearance, effort(robot)};
  reward_terms(task_.weights.data(), inputs, terms);
  for (int k = 0; k < kTerms; ++k) sum += terms[k];
  *readings_.reward[robot] = sum;
}

template <int D>
void Transition<D>::write_ahead(int robot, double* to) const {
  const auto& steps = observer_.settings().ahead;
  for (std::size_t k = 0; episodes_.profile && k < steps.size(); ++k) to[k] = desired(robot, steps[k]);
}

template <int D>
void Transition<D>::observe(int thread, int robot) {
  const double *block = robots_.blocks[robot], *known = model_.blocks[robot];
  double ahead[kMostAhead], *row = rows_[thread].data();
  write_ahead(robot, ahead);
  const auto found = read(robot, block, known, estimator_.chosen(robot), estimator_.paper(robot));
  observer_.write(robot, block,
                  shown(robot, known, found, encoders(robot), static_cast<const double*>(episodes_.tensions[robot]),
                        estimator_.free_forces(robot), estimator_.levers(robot), ahead),
                  row);
  for (std::size_t j = 0; differentiates() && j < observer_.size(); ++j)
    slopes_.present[robot][j] =
        static_cast<float>(bounded(row[j], observer_.settings().low[j], observer_.settings().high[j]));
  observer_.finish(robot, time(robot), row, readings_.observation[robot]);
}

template <int D>
bool Transition<D>::moves(int thread, int robot, Stage stage) {
  if (stage == Stage::kMove) return robots_.follow(thread, robot, robot_slopes_);
  if (stage == Stage::kMoveModel) return !senses() || model_.follow(thread, robot, model_slopes_);
  return !estimator_.moves_free(model_.blocks[robot]) || estimator_.move(thread, robot, free_slopes_);
}

template <int D>
bool Transition<D>::run(int thread, int robot, const double* action, Stage stage) {
  switch (stage) {
    case Stage::kMark: return mark(robot), true;
    case Stage::kCommand: return command(robot, action), true;
    case Stage::kReach: return reach(robot), true;
    case Stage::kSense:
      sense(robot);
      estimator_.prepare(robot, model_.blocks[robot], encoders(robot));
      return true;
    case Stage::kEstimate: return estimate(robot), true;
    case Stage::kRead: return keep(robot), true;
    case Stage::kReward: return reward(robot), true;
    case Stage::kObserve: return observe(thread, robot), true;
    case Stage::kDerive: return derive(thread, robot, true), true;
    case Stage::kDeriveHere: return derive(thread, robot, false), true;
    default: return moves(thread, robot, stage);
  }
}

template <int D>
bool Transition<D>::run(int thread, int robot, const double* action, Stage first, Stage last) {
  for (int stage = static_cast<int>(first); stage <= static_cast<int>(last); ++stage)
    if (!run(thread, robot, action, static_cast<Stage>(stage))) return false;
  return true;
}

template class Transition<2>;
template class Transition<3>;

}  // namespace ccr
