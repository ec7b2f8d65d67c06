#include "branch.hpp"

#include <algorithm>
#include <cmath>

namespace ccr {

using namespace limits;

Branch::Branch(const Robot& robot, const std::vector<Obstacle>& obstacles)
    : newton_(robot, obstacles),
      nodes_(robot.segments + 1),
      levers_(robot.segments + 1),
      points_(robot.points()) {
  present_.shear.resize(robot.segments);
  trial_ = present_;
}

std::size_t Branch::block_size() const {
  const std::size_t n = present_.shear.size();
  return 3 + n + 5 * (n + 1) + 2 * newton_.chain.contacts();
}

void Branch::load(const double* block) {
  const std::size_t n = present_.shear.size();
  present_.cable = block[0];
  tension_ = block[1];
  block += 3;
  for (Control& shear : present_.shear) shear[0] = *block++;
  for (std::size_t i = 0; i <= n; ++i) nodes_[i] = {{block[3 * i], block[3 * i + 1]}};
  block += 3 * (n + 1);
  for (std::size_t i = 0; i <= n; ++i, block += 2) levers_[i] = {{block[0] - nodes_[i][0], block[1] - nodes_[i][1]}};
  newton_.chain.look_around(nodes_);
  place_points(newton_.chain.robot(), nodes_, levers_, points_);
  present_.active.count = 0;
  for (int c = 0; c < newton_.chain.contacts(); ++c)
    if (block[c] > 0 && present_.active.count < kMaxActive) {
      present_.active.contact[present_.active.count] = c;
      present_.active.multiplier[present_.active.count++] = block[c];
    }
  settled_ = false;
}

void Branch::store(double* block) const {
  const Chain& chain = newton_.chain;
  const std::size_t n = present_.shear.size();
  *block++ = present_.cable;
  *block++ = tension_;
  *block++ = chain.objective();
  for (const Control& shear : present_.shear) *block++ = shear[0];
  for (const State& state : chain.states()) block = std::copy(state.v.begin(), state.v.end(), block);
  for (std::size_t i = 0; i <= n; ++i)
    for (int k = 0; k < 2; ++k) *block++ = chain.states()[i][k] + chain.levers()[i][k];
  std::fill_n(block, chain.contacts(), 0.0);
  for (int j = 0; j < present_.active.count; ++j) block[present_.active.contact[j]] = present_.active.multiplier[j];
  block += chain.contacts();
  chain.survey(block);
}

double Branch::measure_tension() const { return newton_.chain.robot().stiffness * newton_.chain.cable_slope(); }

void Branch::remember() {
  points_ = newton_.chain.points();
  if (!trace) return;
  for (const State& s : newton_.chain.states()) trace->insert(trace->end(), s.v.begin(), s.v.end());
}

void Branch::accept() {
  std::swap(present_, trial_);
  tension_ = trial_tension_;
  settled_ = true;
  remember();
}

void Branch::settle() {
  if (settled_) return;
  newton_.chain.evaluate(present_.shear, present_.cable);
  newton_.chain.reduced_gradient(present_.active);
  tension_ = measure_tension();
  settled_ = true;
}

// Whether every point came here from the last accepted shape without cutting through an obstacle or jumping.
bool Branch::passable(double allowed) const {
  const Chain& chain = newton_.chain;
  const int points = chain.robot().points();
  double farthest = 0;
  for (int k = 0; k < points; ++k) {
    const double dx = chain.points()[k][0] - points_[k][0], dy = chain.points()[k][1] - points_[k][1];
    farthest = std::max(farthest, dx * dx + dy * dy);
  }
  if (farthest > allowed * allowed) return false;
  farthest = std::sqrt(farthest);
  for (std::size_t j = 0; j < chain.obstacles().size(); ++j) {
    const Obstacle& obstacle = chain.obstacles()[j];
    if (farthest <= kSweepStride * obstacle.fineness || chain.far(static_cast<int>(j), farthest)) continue;
    for (int k = 0; k < points; ++k)
      if (obstacle.touchable[k] && !passes(obstacle, points_[k], chain.points()[k])) return false;
  }
  return true;
}

// Without contact the shear vanishes and the shape is known.
bool Branch::attempt_free(double cable) {
  if (trial_.active.count > 0) return false;
  std::fill(trial_.shear.begin(), trial_.shear.end(), Control{});
  return newton_.chain.evaluate(trial_.shear, cable) && newton_.chain.violation() == 0;
}

// Leaves in `trial_` the equilibrium at another cable displacement, if it continues the branch from `present_`.
Branch::Move Branch::attempt(double cable) {
  settled_ = false;
  trial_ = present_;
  trial_.cable = cable;
  if (!attempt_free(cable)) {
    if (cable <= 0) return Move::kRejected;
    trial_.shear = present_.shear;
    const Verdict verdict = newton_.solve(trial_);
    iterations += verdict.iterations;
    if (!verdict.converged) return Move::kRejected;
  }
  if (!passable(kMoveOffset + kMoveSlope * std::abs(cable - present_.cable))) return Move::kRejected;
  newton_.chain.reduced_gradient(trial_.active);
  trial_tension_ = measure_tension();
  const bool pulling = cable > present_.cable;
  return pulling && trial_tension_ > newton_.chain.robot().max_tension ? Move::kOverTension : Move::kAccepted;
}

// `present_` is below the tension limit, `trial_` above: close in from below by false position (Illinois), aiming into
// the middle of the accepted band. False when the branch cannot be followed that far.
bool Branch::approach_limit() {
  const double aim = newton_.chain.robot().max_tension * (1 - kTensionBand / 2);
  double high = trial_.cable, excess = trial_tension_ - aim, shortage = tension_ - aim;
  Move last = Move::kRejected;
  for (int i = 0; i < kStallIterations && !at_limit(); ++i) {
    const double width = high - present_.cable;
    if (!(width > kCableResolution * high)) break;
    const double cable = high - width * excess / (excess - shortage);
    const Move move = attempt(std::clamp(cable, present_.cable + 1e-3 * width, high - 1e-3 * width));
    if (move == Move::kRejected) return false;
    if (move == Move::kAccepted) {
      accept();
      shortage = tension_ - aim;
      if (move == last) excess /= 2;
    } else {
      high = trial_.cable;
      excess = trial_tension_ - aim;
      if (move == last) shortage /= 2;
    }
    last = move;
  }
  return true;
}

// The quadratic end of a descent, where Newton's method stays close and loses energy.
bool Branch::finish() {
  const double energy = newton_.chain.objective();
  trial_ = present_;
  const Verdict verdict = newton_.solve(trial_);
  iterations += verdict.iterations;
  if (!verdict.converged || newton_.chain.objective() > energy || !passable(kDescentMove)) return false;
  std::swap(present_, trial_);
  remember();
  return true;
}

// The branch ends within the smallest step: descend from its end, feasible and slowly, to where the robot goes.
Branch::End Branch::pass_end(double increment) {
  const Iterate start = present_;
  const std::vector<Position> start_points = points_;
  const std::size_t start_trace = trace ? trace->size() : 0;
  settled_ = false;
  const auto undo = [&](End reason) {
    present_ = start;
    points_ = start_points;
    if (trace) trace->resize(start_trace);
    settled_ = false;
    settle();
    return reason;
  };

  trial_ = present_;
  trial_.cable += increment;
  bool moved = newton_.measure(present_) && newton_.restore(trial_);
  for (int i = 0; i < kDescentIterations && moved && passable(kDescentMove); ++i) {
    std::swap(present_, trial_);
    remember();
    if (i % kFinishEvery != kFinishEvery - 1 || !finish()) {
      trial_ = present_;
      ++iterations;
      if (!newton_.descend(trial_, moved).converged) continue;
    }
    settled_ = false;
    settle();
    if (increment > 0 && tension_ > newton_.chain.robot().max_tension) return undo(End::kOverTension);
    double farthest = 0;
    for (std::size_t k = 0; k < points_.size(); ++k)
      farthest = std::max(farthest, std::hypot(points_[k][0] - start_points[k][0], points_[k][1] - start_points[k][1]));
    return farthest > kMoveOffset ? End::kSnapped : End::kPassed;
  }
  return undo(End::kBlocked);
}

bool Branch::at_limit() const { return tension_ >= newton_.chain.robot().max_tension * (1 - kTensionBand); }

Status Branch::follow(double target) {
  Status reached = Status::kConverged;
  double step = kLargestStep;
  bool refined = false;  // the last attempt was rejected: do not grow again at once
  for (int sub = 0, ends = 0; sub < kSubSteps && ends < kBranchEnds; ++sub) {
    // A touching robot is not slackened below its pretension.
    const double goal = present_.active.count > 0 ? std::max(target, std::min(present_.cable, kPretension)) : target;
    const double remaining = goal - present_.cable;
    if (remaining == 0) {
      // A release may end in a snap to more tension than the motor holds: it yields until it holds again.
      if (tension_ <= newton_.chain.robot().max_tension || present_.cable == 0) return reached;
      target = std::max(present_.cable - kYield, 0.0);
      reached = Status::kStalled;
      continue;
    }
    if (remaining > 0 && at_limit()) return Status::kStalled;
    const double size = std::min(step, std::abs(remaining));
    const double cable = size == std::abs(remaining) ? goal : present_.cable + std::copysign(size, remaining);
    const Move move = attempt(cable);
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
      const End end = pass_end(cable - present_.cable);
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

Status Branch::follow(const double* from, double target, double* to) {
  iterations = 0;
  load(from);
  if (trace) {
    settle();
    remember();
  }
  const Status status = follow(target);
  settle();
  store(to);
  return status;
}

}  // namespace ccr
