#include "model/spatial_paper.hpp"

#include <algorithm>
#include <cmath>

namespace ccr {

SpatialPaper::SpatialPaper(const Robot& robot)
    : states(robot.segments + 1),
      frames(robot.segments + 1),
      gradient(robot.segments),
      robot_(robot),
      controls_(SpatialLaw::kControl, robot.segments),
      bendings_(SpatialLaw::kBending, robot.segments),
      laws_(SpatialLaw::kBend, robot.segments),
      adjoints_(SpatialLaw::kAdjoint, robot.segments),
      hessians_(SpatialLaw::kHessian, robot.segments),
      bends_(robot.segments),
      chords_(robot.segments),
      wrenches_(robot.segments) {}

void SpatialPaper::set_inputs(const Command& command) {
  const double a = robot_.offset;
  const double holes[2][2] = {{a, 0}, {a * std::cos(robot_.angle), a * std::sin(robot_.angle)}};
  for (int k = 0; k < 2; ++k) {
    const double side = command.cables[k] < 0 ? -1 : 1;
    inputs_.displacements[k] = side * command.cables[k] / robot_.segments;
    for (int c = 0; c < 2; ++c) inputs_.holes[2 * k + c] = side * holes[k][c];
  }
  inputs_.length = command.length / robot_.segments;
}

bool SpatialPaper::evaluate(const Command& command, const std::vector<Control>& controls) {
  set_inputs(command);
  const int n = robot_.segments;
  for (int i = 0; i < n; ++i) controls_.put(i, controls[i].v.data(), kControl);
  if (!SpatialLaw::bend(n, inputs_, controls_, bendings_, laws_)) return false;
  objective = max_objective_slope = 0;
  states[0] = {};
  frames[0] = kBaseFrame;
  for (int i = 0; i < n; ++i) {
    Bend& bend = bends_[i];
    laws_.get(i, bend.chord.v.data(), SpatialLaw::kBend);
    chords_[i] = move_up(bend, states[i], frames[i], states[i + 1], frames[i + 1]);
    objective += bend.objective;
    for (const double slope : bend.objective_slope.v)
      max_objective_slope = std::max(max_objective_slope, std::abs(slope));
  }
  return std::isfinite(objective);
}

void SpatialPaper::propagate_adjoints(const std::vector<State>& node_forces) {
  Wrench wrench;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    const Bend& bend = bends_[i];
    wrench.subtract(node_forces[i + 1]);
    const Wrench& local = wrenches_[i] = wrench.in(frames[i]);
    adjoints_.put(i, local.force.v.data(), 3);
    adjoints_.put(i, local.moment.v.data(), 3, 3);
    gradient[i] = bend.objective_slope;
    gradient[i] += transpose_times(bend.chord_slope, local.force);
    gradient[i] += transpose_times(bend.turn_slope, local.moment);
    wrench.moment += cross(chords_[i], wrench.force);
  }
}

void SpatialPaper::lagrangian_hessian(System& system) const {
  SpatialLaw::hessian_contraction(robot_.segments, inputs_, controls_, bendings_, adjoints_, hessians_);
  for (int i = 0; i < robot_.segments; ++i) {
    System::Stage& stage = system.stages[i];
    assemble_stage(bends_[i], chords_[i], frames[i], wrenches_[i], stage, system.node_hessian[i]);
    hessians_.get(i, stage.huu.v.data(), SpatialLaw::kHessian);
  }
  system.node_hessian[robot_.segments] = {};
}

Vec<2> SpatialPaper::displacement_slopes() const {
  Vec<2> slopes;
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    slopes += bend.objective_displacement_slope;
    slopes += transpose_times(bend.chord_displacement_slope, wrenches_[i].force);
    slopes += transpose_times(bend.turn_displacement_slope, wrenches_[i].moment);
  }
  for (double& slope : slopes.v) slope /= robot_.segments;
  return slopes;
}

double SpatialPaper::free_turn() const {
  return (std::abs(inputs_.displacements[0]) + std::abs(inputs_.displacements[1])) / robot_.offset;
}

// All segments bend by the same angle θ towards t, where h·t is the displacement of each hole h and |t| = 2 sin θ/2:
// the chord of segment i is at the angle (i + 1/2) θ in the plane of t.
Vec<10> SpatialPaper::free_slopes(const Command& command) const {
  const int n = robot_.segments;
  const double a = robot_.offset, length = command.length / n, cosine = std::cos(robot_.angle),
               sine = std::sin(robot_.angle);
  // Derivatives of t in each displacement, the same for all segments.
  const double slopes[2][2] = {{1 / (n * a), -cosine / (n * a * sine)}, {0, 1 / (n * a * sine)}};
  Vec<2> towards;
  for (int k = 0; k < 2; ++k)
    for (int c = 0; c < 2; ++c) towards[c] += command.cables[k] * slopes[k][c];
  const double size = norm(towards), angle = 2 * std::asin(size / 2), rate = 1 / std::sqrt(1 - size * size / 4);
  const double x = size > 0 ? towards[0] / size : 1, y = size > 0 ? towards[1] / size : 0;
  double reach = 0, out = 0, fall = 0;  // reach of the tip in the plane of t; derivatives in θ of reach and height
  for (int i = 0; i < n; ++i) {
    const double middle = (i + 0.5) * angle;
    reach += length * std::sin(middle);
    out += length * (i + 0.5) * std::cos(middle);
    fall -= length * (i + 0.5) * std::sin(middle);
  }
  const double sideways = size > 0 ? reach / size : out, swept = size > 0 ? n * angle / size : n;
  Vec<10> tip;
  for (int k = 0; k < 2; ++k) {
    const double along = slopes[k][0] * x + slopes[k][1] * y, across = slopes[k][1] * x - slopes[k][0] * y;
    const double turn = n * rate * along,
                 swing = swept * across;  // rotation of the tip in the plane of t, and of that plane
    tip[5 * k] = out * rate * along * x - sideways * across * y;
    tip[5 * k + 1] = out * rate * along * y + sideways * across * x;
    tip[5 * k + 2] = fall * rate * along;
    const double turn_x = turn * x - swing * y, turn_y = turn * y + swing * x;
    tip[5 * k + 3] = turn_x;
    tip[5 * k + 4] = turn_x * cosine + turn_y * sine;
  }
  return tip;
}

}  // namespace ccr
