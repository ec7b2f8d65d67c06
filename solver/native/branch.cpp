#include "branch.hpp"

#include <algorithm>
#include <cmath>

namespace ccr {

using namespace limits;

Branch::Branch(const Robot& robot, const std::vector<Obstacle>& obstacles) : newton_(robot, obstacles) {
  present.shear.resize(robot.segments);
  trial_ = present;
  points_ = newton_.chain.points();
}

double Branch::measure_tension() { return newton_.chain.robot().stiffness * newton_.chain.cable_slope(); }

void Branch::remember() {
  points_ = newton_.chain.points();
  if (!trace) return;
  for (const State& s : newton_.chain.states()) trace->insert(trace->end(), s.v.begin(), s.v.end());
}

void Branch::accept(double new_tension) {
  std::swap(present, trial_);
  tension = new_tension;
  remember();
}

// Leaves the chain evaluated at `present`.
void Branch::settle() {
  newton_.chain.evaluate(present.shear, present.cable);
  newton_.chain.reduced_gradient(present.active);
  tension = measure_tension();
}

// Whether every point came here from the last accepted shape without cutting through a circle or jumping.
bool Branch::passable(double allowed) const {
  const Chain& chain = newton_.chain;
  const int nodes = chain.robot().segments + 1;
  double farthest = 0;
  for (int k = 0; k < kPoints * nodes; ++k) {
    const double dx = chain.points()[k][0] - points_[k][0], dy = chain.points()[k][1] - points_[k][1];
    farthest = std::max(farthest, dx * dx + dy * dy);
  }
  if (farthest > allowed * allowed) return false;
  for (const Obstacle& obstacle : chain.obstacles()) {
    if (obstacle.shape != Shape::kCircle) continue;
    const double core = (1 - kSweepDepth) * obstacle.parameters[2];
    for (int k = 0; k < kPoints * nodes; ++k) {
      if (!obstacle.touchable[k % nodes]) continue;
      const double px = points_[k][0] - obstacle.parameters[0], py = points_[k][1] - obstacle.parameters[1];
      if (px * px + py * py > (core + allowed) * (core + allowed)) continue;
      const double dx = chain.points()[k][0] - points_[k][0], dy = chain.points()[k][1] - points_[k][1];
      const double length = dx * dx + dy * dy;
      const double t = length > 0 ? std::clamp(-(px * dx + py * dy) / length, 0.0, 1.0) : 0.0;
      const double qx = px + t * dx, qy = py + t * dy;
      if (qx * qx + qy * qy < core * core) return false;
    }
  }
  return true;
}

// Without contact the shear vanishes and the shape is known.
bool Branch::attempt_free(double cable) {
  if (trial_.active.count > 0) return false;
  std::fill(trial_.shear.begin(), trial_.shear.end(), Control{});
  return newton_.chain.evaluate(trial_.shear, cable) && newton_.chain.violation() == 0;
}

Branch::Move Branch::attempt(double cable) {
  const double allowed = kMoveOffset + kMoveSlope * std::abs(cable - present.cable);
  trial_ = present;
  trial_.cable = cable;
  if (!attempt_free(cable)) {
    if (cable <= 0) return Move::kRejected;
    trial_.shear = present.shear;
    const Verdict verdict = newton_.solve(trial_);
    iterations += verdict.iterations;
    if (!verdict.converged || !verdict.stable) return Move::kRejected;
  }
  newton_.chain.reduced_gradient(trial_.active);
  if (!passable(allowed)) return Move::kRejected;
  trial_tension_ = measure_tension();
  const bool pulling = cable > present.cable;
  return pulling && trial_tension_ > newton_.chain.robot().max_tension ? Move::kOverTension : Move::kAccepted;
}

// `present` is below the tension limit, `trial_` above: close in on the limit from below (Illinois false position).
bool Branch::stall() {
  const double limit = newton_.chain.robot().max_tension;
  double high = trial_.cable, excess = trial_tension_ - limit, shortage = tension - limit;
  int side = 0;
  for (int i = 0; i < kStallIterations && tension < limit * (1 - kTensionBand); ++i) {
    // Aim a little below the limit, so that the result lands inside the band.
    const double aim = limit * kTensionBand / 2;
    const double width = high - present.cable;
    if (!(width > 1e-12 * high)) break;
    const double cable = high - width * (excess + aim) / (excess - shortage);
    switch (attempt(std::clamp(cable, present.cable + 1e-3 * width, high - 1e-3 * width))) {
      case Move::kRejected:
        return false;
      case Move::kAccepted:
        accept(trial_tension_);
        shortage = tension - limit;
        if (side == -1) excess /= 2;
        side = -1;
        break;
      case Move::kOverTension:
        high = trial_.cable;
        excess = trial_tension_ - limit;
        if (side == 1) shortage /= 2;
        side = 1;
    }
  }
  return true;
}

// The branch ends within the smallest step: descend from its end, feasible and slowly, to where the robot goes.
bool Branch::pass_end(double direction, bool& snapped) {
  const Iterate start = present;
  const double start_tension = tension;
  const std::vector<Position> start_points = points_;
  const std::size_t start_trace = trace ? trace->size() : 0;
  const auto give_up = [&] {
    present = start;
    tension = start_tension;
    points_ = start_points;
    if (trace) trace->resize(start_trace);
    return false;
  };

  trial_ = present;
  trial_.cable += direction;
  bool moved = false;
  if (!newton_.measure(present) || !newton_.restore(trial_) || !passable(kDescentMove)) return give_up();
  std::swap(present, trial_);
  remember();
  for (int i = 0; i < kDescentIterations; ++i) {
    trial_ = present;
    const Verdict verdict = newton_.descend(trial_, moved);
    ++iterations;
    if (verdict.converged) {
      settle();
      if (!verdict.stable) return give_up();
      if (direction > 0 && tension > newton_.chain.robot().max_tension) return give_up();
      double farthest = 0;
      for (std::size_t k = 0; k < points_.size(); ++k)
        farthest = std::max(farthest, std::hypot(points_[k][0] - start_points[k][0], points_[k][1] - start_points[k][1]));
      snapped |= farthest > kMoveOffset;
      return true;
    }
    if (!moved || !passable(kDescentMove)) return give_up();
    std::swap(present, trial_);
    remember();
  }
  return give_up();
}

Status Branch::follow(double target) {
  iterations = 0;
  settle();
  remember();
  const double limit = newton_.chain.robot().max_tension;
  bool snapped = false;
  int ends = 0;
  double step = kLargestStep;
  for (int sub = 0; sub < kSubSteps; ++sub) {
    double goal = target;
    if (present.active.count > 0 && target < kPretension) goal = std::min(present.cable, kPretension);
    const double remaining = goal - present.cable;
    if (remaining == 0) {
      settle();
      return snapped ? Status::kSnapped : Status::kConverged;
    }
    const bool pulling = remaining > 0;
    if (pulling && tension >= limit * (1 - kTensionBand)) {
      settle();
      return Status::kStalled;
    }
    const double size = std::min(step, std::abs(remaining));
    const double cable = size == std::abs(remaining) ? goal : present.cable + std::copysign(size, remaining);
    switch (attempt(cable)) {
      case Move::kAccepted:
        accept(trial_tension_);
        step = std::min(2 * size, kLargestStep);
        continue;
      case Move::kOverTension:
        if (stall()) {
          settle();
          return Status::kStalled;
        }
        step = size / 2;
        continue;
      case Move::kRejected:
        if (size > kSmallestStep) {
          step = size / 2;
          continue;
        }
    }
    if (++ends > kBranchEnds || !pass_end(cable - present.cable, snapped)) {
      settle();
      return Status::kJammed;
    }
    step = 4 * kSmallestStep;
  }
  settle();
  return Status::kJammed;
}

}  // namespace ccr
