#include "branch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccr {

using namespace limits;

namespace {

// How far apart two commands are, in steps of the cable [mm].
double apart(const Command& a, const Command& b) {
  return std::max(std::abs(a.cable - b.cable), std::abs(a.length - b.length) / 2);
}

Command between(const Command& a, const Command& b, double t) {
  return {a.cable + t * (b.cable - a.cable), a.length + t * (b.length - a.length)};
}

}  // namespace

template <class Model>
Branch<Model>::Branch(const Robot& robot, int obstacles)
    : newton_(robot, obstacles),
      nodes_(robot.segments + 1),
      levers_(robot.segments + 1),
      points_(robot.points()) {
  present_.controls.resize(robot.segments);
  trend_.controls.resize(robot.segments);
}

template <class Model>
void Branch<Model>::enter(std::span<const Obstacle> obstacles) {
  newton_.enter(obstacles);
  trend_.mounts.resize(newton_.chain.mounts());
  present_.mounts.resize(newton_.chain.mounts());
  trial_ = present_;
}

template <class Model>
std::size_t Branch<Model>::block_size() const {
  const std::size_t n = present_.controls.size(), contacts = newton_.chain.contacts();
  const std::size_t obstacles = contacts / newton_.chain.points().size();
  return 4 + n + 5 * (n + 1) + 2 * contacts + 4 * obstacles + 7 + newton_.chain.points().size() + n + 2 * obstacles +
         kMaxActive;
}

template <class Model>
void Branch<Model>::load(const double* block) {
  const std::size_t n = present_.controls.size();
  present_.command = {block[0], block[1]};
  tension_ = block[2];
  block += 4;
  for (Control& control : present_.controls) control[0] = *block++;
  for (std::size_t i = 0; i <= n; ++i) nodes_[i] = {{block[3 * i], block[3 * i + 1]}};
  block += 3 * (n + 1);
  for (std::size_t i = 0; i <= n; ++i, block += 2) levers_[i] = {{block[0] - nodes_[i][0], block[1] - nodes_[i][1]}};
  const double* displacements = block + 2 * newton_.chain.contacts();
  const int obstacles = static_cast<int>(newton_.chain.obstacles().size());
  for (int j = 0; j < obstacles; ++j)
    if (const int mount = newton_.chain.mount_of(j); mount >= 0)
      present_.mounts[mount] = {{displacements[2 * j], displacements[2 * j + 1]}};
  mounts_ = present_.mounts;
  newton_.chain.look_around(nodes_, present_.mounts);
  place_points(newton_.chain.robot(), nodes_, levers_, points_);
  ActiveSet& active = present_.active;
  active.count = 0;
  const double* flags = displacements + 4 * obstacles + 7;
  const int points = static_cast<int>(points_.size());
  if (std::find(flags, flags + points, 1.0) != flags + points)
    for (int c = 0; c < newton_.chain.contacts(); ++c)
      if (flags[c % points] != 0 && block[c] > 0 && active.count < kMaxActive) {
        active.contact[active.count] = c;
        active.multiplier[active.count++] = block[c];
      }
  if (Model::kSliding && tension_ > 0 && active.count < kMaxActive) {
    active.contact[active.count] = newton_.chain.contacts();
    active.multiplier[active.count++] = tension_ / newton_.chain.robot().stiffness(present_.command.length);
  }
  settled_ = false;
  touched_ = newton_.chain.touching(active);
  onset_ = displacements[4 * obstacles + 3];
  const double* trend = displacements + 4 * obstacles + 7 + points_.size();
  for (Control& control : trend_.controls) control[0] = *trend++;
  for (int j = 0; j < obstacles; ++j, trend += 2)
    if (const int mount = newton_.chain.mount_of(j); mount >= 0) trend_.mounts[mount] = {{trend[0], trend[1]}};
  std::copy_n(trend, kMaxActive, trend_.multipliers.begin());
}

template <class Model>
void Branch<Model>::store(double* block) {
  Chain<Model>& chain = newton_.chain;
  const std::size_t n = present_.controls.size();
  *block++ = present_.command.cable;
  *block++ = present_.command.length;
  *block++ = tension_;
  *block++ = chain.objective();
  for (const Control& control : present_.controls) *block++ = control[0];
  for (const auto& state : chain.states()) block = std::copy_n(state.v.begin(), 3, block);
  for (std::size_t i = 0; i <= n; ++i)
    for (int k = 0; k < 2; ++k) *block++ = chain.states()[i][k] + chain.levers()[i][k];
  std::fill_n(block, chain.contacts(), 0.0);
  for (int j = 0; j < present_.active.count; ++j)
    if (present_.active.contact[j] < chain.contacts()) block[present_.active.contact[j]] = present_.active.multiplier[j];
  block += chain.contacts();
  chain.survey(block);
  const double clearance = lowest(chain.contacts(), [&](int c) { return block[c]; });
  block += chain.contacts();
  const int obstacles = static_cast<int>(chain.obstacles().size());
  const auto write = [&](const Position& pair) { block = std::copy(pair.v.begin(), pair.v.end(), block); };
  const auto of_mount = [&](const std::vector<Position>& mounts, int j) {
    return chain.mount_of(j) < 0 ? Position{} : mounts[chain.mount_of(j)];
  };
  for (int j = 0; j < obstacles; ++j) write(of_mount(present_.mounts, j));
  Position total{};
  for (int j = 0; j < obstacles; ++j) {
    const Position force = chain.push(present_.active, j);
    total += force;
    write(force);
  }
  write(total);
  *block++ = clearance;
  *block++ = onset_;
  const Vec<3> slopes = chain.free_slopes(present_.command);
  block = std::copy(slopes.v.begin(), slopes.v.end(), block);
  const std::size_t points = chain.points().size();
  std::fill_n(block, points, 0.0);
  for (int j = 0; j < present_.active.count; ++j)
    if (present_.active.contact[j] < chain.contacts()) block[present_.active.contact[j] % points] = 1;
  block += points;
  for (const Control& control : trend_.controls) *block++ = control[0];
  for (int j = 0; j < obstacles; ++j) write(of_mount(trend_.mounts, j));
  std::fill_n(block, kMaxActive, 0.0);
  const auto begin = present_.active.contact.begin(), end = begin + present_.active.count;
  for (int j = 0; j < present_.active.count; ++j) {
    const auto rank = std::count_if(begin, end, [&](int contact) { return contact < begin[j]; });
    block[rank] = trend_.multipliers[j];
  }
}

template <class Model>
void Branch<Model>::remember() {
  points_ = newton_.chain.points();
  mounts_ = present_.mounts;
  if (!trace) return;
  for (const auto& s : newton_.chain.states()) trace->insert(trace->end(), s.v.begin(), s.v.begin() + 3);
}

template <class Model>
void Branch<Model>::accept() {
  learn();
  std::swap(present_, trial_);
  tension_ = trial_tension_;
  settled_ = true;
  remember();
}

template <class Model>
void Branch<Model>::learn() {
  const ActiveSet &before = present_.active, &now = trial_.active;
  const double pulled = trial_.command.cable - present_.command.cable;
  forget();
  if (pulled == 0 || trial_.command.length != present_.command.length || !newton_.chain.touching(now) ||
      before.count != now.count || !std::equal(now.contact.begin(), now.contact.begin() + now.count, before.contact.begin()))
    return;
  for (std::size_t i = 0; i < trend_.controls.size(); ++i)
    trend_.controls[i][0] = (trial_.controls[i][0] - present_.controls[i][0]) / pulled;
  for (std::size_t m = 0; m < trend_.mounts.size(); ++m)
    for (int k = 0; k < 2; ++k) trend_.mounts[m][k] = (trial_.mounts[m][k] - present_.mounts[m][k]) / pulled;
  for (int j = 0; j < now.count; ++j) trend_.multipliers[j] = (now.multiplier[j] - before.multiplier[j]) / pulled;
}

template <class Model>
void Branch<Model>::forget() {
  std::fill(trend_.controls.begin(), trend_.controls.end(), Control{});
  std::fill(trend_.mounts.begin(), trend_.mounts.end(), Position{});
  trend_.multipliers.fill(0);
}

// From `present_` along the trend.
template <class Model>
void Branch<Model>::predict() {
  const double pulled = trial_.command.cable - present_.command.cable;
  for (std::size_t i = 0; i < trend_.controls.size(); ++i)
    trial_.controls[i][0] = present_.controls[i][0] + pulled * trend_.controls[i][0];
  for (std::size_t m = 0; m < trend_.mounts.size(); ++m)
    for (int k = 0; k < 2; ++k) trial_.mounts[m][k] = present_.mounts[m][k] + pulled * trend_.mounts[m][k];
  trial_.active = present_.active;
  for (int j = 0; j < trial_.active.count; ++j)
    trial_.active.multiplier[j] = std::max(0.0, trial_.active.multiplier[j] + pulled * trend_.multipliers[j]);
}

template <class Model>
void Branch<Model>::settle() {
  if (settled_) return;
  newton_.chain.evaluate(present_);
  newton_.chain.reduced_gradient(present_.active);
  tension_ = newton_.chain.tension(present_.active);
  settled_ = true;
}

// Whether every point came here from the last accepted shape without cutting through an obstacle or jumping.
template <class Model>
bool Branch<Model>::passable(double allowed) const {
  const Chain<Model>& chain = newton_.chain;
  const int points = chain.robot().points();
  double farthest = 0, shift = 0;
  for (int k = 0; k < points; ++k) {
    const Position move = minus(chain.points()[k], points_[k]);
    farthest = std::max(farthest, dot(move, move));
  }
  farthest = std::sqrt(farthest);
  for (std::size_t m = 0; m < trial_.mounts.size(); ++m)
    shift = std::max(shift, norm(minus(trial_.mounts[m], mounts_[m])));
  if (std::max(farthest, shift) > allowed) return false;
  for (std::size_t j = 0; j < chain.obstacles().size(); ++j) {
    const Obstacle& obstacle = chain.obstacles()[j];
    if (farthest + shift <= kSweepStride * obstacle.fineness || chain.far(static_cast<int>(j), farthest)) continue;
    const int mount = chain.mount_of(j);
    const Position before = mount < 0 ? Position{} : mounts_[mount], now = mount < 0 ? Position{} : trial_.mounts[mount];
    for (int k = 0; k < points; ++k)
      if (obstacle.touchable[k] && !passes(obstacle, minus(points_[k], before), minus(chain.points()[k], now)))
        return false;
  }
  return true;
}

template <class Model>
bool Branch<Model>::attempt_free() {
  if (newton_.chain.touching(trial_.active)) return false;
  newton_.chain.relax(trial_);
  return newton_.chain.evaluate(trial_) && newton_.chain.violation() <= kFeasibility;
}

// Leaves in `trial_` the equilibrium under another command, if it continues the branch from `present_`.
template <class Model>
Branch<Model>::Move Branch<Model>::attempt(const Command& command) {
  settled_ = false;
  trial_ = present_;
  trial_.command = command;
  if (!attempt_free()) {
    if (!Model::kSliding && command.cable <= 0) return Move::kRejected;
    predict();
    const Verdict verdict = newton_.solve(trial_);
    iterations += verdict.iterations;
    if (!verdict.converged) return Move::kRejected;
  }
  if (!passable(std::min(kMoveOffset + kMoveSlope * apart(present_.command, command), kMoveLargest)))
    return Move::kRejected;
  newton_.chain.reduced_gradient(trial_.active);
  trial_tension_ = newton_.chain.tension(trial_.active);
  const bool pulled = command.cable > present_.command.cable && command.length == present_.command.length;
  const bool rising = pulled || (!releases(command) && trial_tension_ > tension_);
  return rising && trial_tension_ > newton_.chain.robot().max_tension ? Move::kOverTension : Move::kAccepted;
}

// Whether a command only lets the cable out.
template <class Model>
bool Branch<Model>::releases(const Command& command) const {
  return command.cable < present_.command.cable && command.length == present_.command.length;
}

// `present_` is below the tension limit, `trial_` above: close in from below by false position (Illinois), aiming into
// the middle of the accepted band. False when the branch cannot be followed that far.
template <class Model>
bool Branch<Model>::approach_limit() {
  const double aim = newton_.chain.robot().max_tension * (1 - kTensionBand / 2);
  const Command start = present_.command, end = trial_.command;
  const double span = apart(start, end);
  double low = 0, high = 1, excess = trial_tension_ - aim, shortage = tension_ - aim;  // fractions of the way
  Move last = Move::kRejected;
  for (int i = 0; i < kStallIterations && !at_limit(); ++i) {
    const double width = high - low;
    if (!(width * span > kCommandResolution)) break;
    const double middle = std::clamp(high - width * excess / (excess - shortage), low + 1e-3 * width, high - 1e-3 * width);
    const Move move = attempt(between(start, end, middle));
    if (move == Move::kRejected) return false;
    if (move == Move::kAccepted) {
      accept();
      low = middle;
      shortage = tension_ - aim;
      if (move == last) excess /= 2;
    } else {
      high = middle;
      excess = trial_tension_ - aim;
      if (move == last) shortage /= 2;
    }
    last = move;
  }
  return true;
}

// The quadratic end of a descent, where Newton's method stays close and loses energy.
template <class Model>
bool Branch<Model>::finish() {
  const double energy = newton_.chain.energy();
  trial_ = present_;
  const Verdict verdict = newton_.solve(trial_);
  iterations += verdict.iterations;
  if (!verdict.converged || newton_.chain.energy() > energy || !passable(kDescentMove)) return false;
  std::swap(present_, trial_);
  remember();
  return true;
}

// One iterate of the descent from `present_` to `trial_`, so short that nothing is jumped over. True at an equilibrium.
template <class Model>
bool Branch<Model>::descend(bool& moved) {
  double cap = kDescentCap;
  for (int shortening = 0; shortening < kDescentShortenings; ++shortening, cap /= 4) {
    trial_ = present_;
    ++iterations;
    if (newton_.descend(trial_, cap, moved).converged) return true;
    if (!moved || passable(kDescentMove)) return false;
  }
  moved = false;
  return false;
}

// Leaves in `trial_` the feasible shape closest to `present_` under a command, with the active gaps held closed or not.
template <class Model>
bool Branch<Model>::depart(const Command& command, bool holding) {
  trial_ = present_;
  trial_.command = command;
  if (!holding) trial_.active.count = 0;
  return newton_.restore(trial_) && passable(kDescentMove);
}

// The branch ends within the smallest step: descend from its end, feasible and slowly, to where the robot goes.
template <class Model>
Branch<Model>::End Branch<Model>::pass_end(const Command& command) {
  const Iterate start = present_;
  const bool holding = !releases(command);  // the motor
  const std::vector<Position> start_points = points_, start_mounts = mounts_;
  const std::size_t start_trace = trace ? trace->size() : 0;
  settled_ = false;
  const auto undo = [&](End reason) {
    present_ = start;
    points_ = start_points;
    mounts_ = start_mounts;
    if (trace) trace->resize(start_trace);
    settled_ = false;
    settle();
    return reason;
  };

  bool moved = newton_.measure(present_) && (depart(command, true) || depart(command, false));
  for (int i = 0; i < kDescentIterations && moved; ++i) {
    std::swap(present_, trial_);
    remember();
    const bool finished = i % kFinishEvery == kFinishEvery - 1 && finish();
    if (!finished && !descend(moved)) continue;
    settled_ = false;
    forget();
    settle();
    if (holding && tension_ > newton_.chain.robot().max_tension) return undo(End::kOverTension);
    double farthest = 0;
    for (std::size_t k = 0; k < points_.size(); ++k)
      farthest = std::max(farthest, std::hypot(points_[k][0] - start_points[k][0], points_[k][1] - start_points[k][1]));
    return farthest > kMoveOffset ? End::kSnapped : End::kPassed;
  }
  return undo(End::kBlocked);
}

template <class Model>
bool Branch<Model>::at_limit() const { return tension_ >= newton_.chain.robot().max_tension * (1 - kTensionBand); }

// A robot that touches is not slackened below its pretension where the cable alone gives it its shape.
template <class Model>
double Branch<Model>::goal_cable(double target) const {
  if (Model::kSliding || !newton_.chain.touching(present_.active)) return target;
  return std::max(target, std::min(present_.command.cable, kPretension));
}

template <class Model>
Status Branch<Model>::follow(const Command& target) {
  Status reached = Status::kConverged;
  Command wanted = target;
  double step = kLargestStep;
  bool refined = false;  // the last attempt was rejected: do not grow again at once
  const int steps = kSubSteps + static_cast<int>(2 * apart(present_.command, target) / kLargestStep);
  for (int sub = 0, ends = 0; sub < steps && ends < kBranchEnds; ++sub) {
    const Command goal = {goal_cable(wanted.cable), wanted.length};
    const double remaining = apart(present_.command, goal);
    if (remaining == 0) {
      // A release may end in a snap to more tension than the motor holds: it yields until it holds again.
      if (tension_ <= newton_.chain.robot().max_tension || present_.command.cable == 0) return reached;
      wanted.cable = std::max(present_.command.cable - kYield, 0.0);
      reached = Status::kStalled;
      continue;
    }
    if (goal.cable > present_.command.cable && goal.length == present_.command.length && at_limit())
      return Status::kStalled;
    const double size = std::min(step, remaining);
    const Command next = size == remaining ? goal : between(present_.command, goal, size / remaining);
    const Move move = attempt(next);
    if (move == Move::kAccepted) {
      accept();
      step = refined ? size : std::min(2 * size, kLargestStep);
      refined = false;
    } else if (move == Move::kOverTension) {
      if (approach_limit()) return Status::kStalled;
      step = size / 2;
    } else if (size > kSmallestStep) {
      step = size / 2;
      refined = true;
    } else {
      const End end = pass_end(next);
      if (end == End::kBlocked) return Status::kJammed;
      if (end == End::kOverTension) return Status::kStalled;
      if (end == End::kSnapped) reached = Status::kSnapped;
      step = 2 * kSmallestStep;
      refined = false;
      ++ends;
    }
  }
  return Status::kJammed;
}

// Tension of the free robot where it first touches, between where the step began and where it is.
template <class Model>
double Branch<Model>::first_tension(const Command& start) {
  const auto clear = [&](double part) {
    trial_.command = between(start, present_.command, part);
    newton_.chain.relax(trial_);
    return newton_.chain.evaluate(trial_) && newton_.chain.violation() <= kFeasibility;
  };
  double low = 0, high = 1;
  if (!clear(high))
    for (int i = 0; i < kOnsetBisections; ++i) {
      const double middle = (low + high) / 2;
      (clear(middle) ? low : high) = middle;
    }
  clear(high);
  newton_.chain.reduced_gradient(trial_.active);
  return newton_.chain.tension(trial_.active);
}

template <class Model>
Status Branch<Model>::follow(const double* from, const Command& target, double* to) {
  iterations = 0;
  load(from);
  const Command start = present_.command;
  if (trace) {
    settle();
    remember();
  }
  const Status status = follow(target);
  if (!newton_.chain.touching(present_.active)) {
    onset_ = 0;
  } else if (!touched_) {
    onset_ = first_tension(start);
    settled_ = false;
  }
  settle();
  store(to);
  return status;
}

template <class Model>
bool Branch<Model>::reaches(double force, double increment, double limit, double length) {
  std::vector<double> rest(block_size());
  rest[1] = length;
  follow(rest.data(), {0, length}, rest.data());
  if (newton_.chain.violation() > 0) return false;
  load(rest.data());
  const int obstacles = static_cast<int>(newton_.chain.obstacles().size());
  for (int i = 1; i * increment < limit; ++i) {
    if (follow({i * increment, length}) != Status::kConverged) return false;
    settle();
    Position total{};
    for (int j = 0; j < obstacles; ++j) total += newton_.chain.push(present_.active, j);
    if (newton_.chain.touching(present_.active) && norm(total) >= force) return true;
  }
  return false;
}

template class Branch<UniformCable>;
template class Branch<SlidingCable>;

std::unique_ptr<Follower> make_follower(bool sliding, const Robot& robot, int obstacles) {
  if (sliding) return std::make_unique<Branch<SlidingCable>>(robot, obstacles);
  return std::make_unique<Branch<UniformCable>>(robot, obstacles);
}

}  // namespace ccr
