#include "model/spatial.hpp"

#include <algorithm>
#include <cmath>

namespace ccr {

Spatial::Spatial(const Robot& robot)
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
      forces_(robot.segments),
      moments_(robot.segments) {}

void Spatial::set_inputs(const Command<2>& command) {
  const double a = robot_.offset;
  const double holes[2][2] = {{a, 0}, {a * std::cos(robot_.angle), a * std::sin(robot_.angle)}};
  for (int k = 0; k < 2; ++k) {
    const double side = command.cables[k] < 0 ? -1 : 1;
    inputs_.displacements[k] = side * command.cables[k] / robot_.segments;
    for (int c = 0; c < 2; ++c) inputs_.holes[2 * k + c] = side * holes[k][c];
  }
  inputs_.length = command.length / robot_.segments;
}

bool Spatial::evaluate(const Command<2>& command, const std::vector<Control>& controls) {
  set_inputs(command);
  const int n = robot_.segments;
  for (int i = 0; i < n; ++i) controls_.put(i, controls[i].v.data(), kControl);
  if (!SpatialLaw::bend(n, inputs_, controls_, bendings_, laws_)) return false;
  objective = max_objective_slope = 0;
  states[0] = {};
  frames[0] = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (int i = 0; i < n; ++i) {
    Bend& bend = bends_[i];
    laws_.get(i, bend.chord.v.data(), SpatialLaw::kBend);
    const Vec<3> chord = chords_[i] = times(frames[i], bend.chord);
    for (int k = 0; k < 3; ++k) states[i + 1][k] = states[i][k] + chord[k];  // turns of the disks are 0 throughout
    frames[i + 1] = times(frames[i], bend.rotation);
    objective += bend.objective;
    for (const double slope : bend.objective_slope.v)
      max_objective_slope = std::max(max_objective_slope, std::abs(slope));
  }
  return std::isfinite(objective);
}

void Spatial::propagate_adjoints(const std::vector<State>& node_forces) {
  Vec<3> force, moment;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    const Bend& bend = bends_[i];
    for (int k = 0; k < 3; ++k) {
      force[k] -= node_forces[i + 1][k];
      moment[k] -= node_forces[i + 1][3 + k];
    }
    forces_[i] = transpose_times(frames[i], force);
    moments_[i] = transpose_times(frames[i], moment);
    adjoints_.put(i, forces_[i].v.data(), 3);
    adjoints_.put(i, moments_[i].v.data(), 3, 3);
    gradient[i] = bend.objective_slope;
    gradient[i] += transpose_times(bend.chord_slope, forces_[i]);
    gradient[i] += transpose_times(bend.turn_slope, moments_[i]);
    moment += cross(chords_[i], force);
  }
}

void Spatial::lagrangian_hessian(System& system) const {
  SpatialLaw::hessian_contraction(robot_.segments, inputs_, controls_, bendings_, adjoints_, hessians_);
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    const Frame& frame = frames[i];
    System::Stage& stage = system.stages[i];
    stage.a.chord = chords_[i];
    const Mat<3, 3> chord_slope = times(frame, bend.chord_slope), turn_slope = times(frame, bend.turn_slope);
    const Vec<3> force = times(frame, forces_[i]), moment = times(frame, moments_[i]);
    const Mat<3, 3> turned = hessian_contraction(stage.a.chord, force);
    system.node_hessian[i] = {};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        stage.b(r, c) = chord_slope(r, c);
        stage.b(3 + r, c) = turn_slope(r, c);
        system.node_hessian[i](3 + r, 3 + c) = turned(r, c);
      }
    stage.hux = {};
    for (int k = 0; k < 3; ++k) {
      const Vec<3> swung = cross({{chord_slope(0, k), chord_slope(1, k), chord_slope(2, k)}}, force);
      const Vec<3> twisted = cross({{turn_slope(0, k), turn_slope(1, k), turn_slope(2, k)}}, moment);
      for (int c = 0; c < 3; ++c) stage.hux(k, 3 + c) = swung[c] + twisted[c] / 2;
    }
    hessians_.get(i, stage.huu.v.data(), SpatialLaw::kHessian);
  }
  system.node_hessian[robot_.segments] = {};
}

Vec<2> Spatial::displacement_slopes() const {
  Vec<2> slopes;
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    slopes += bend.objective_displacement_slope;
    slopes += transpose_times(bend.chord_displacement_slope, forces_[i]);
    slopes += transpose_times(bend.turn_displacement_slope, moments_[i]);
  }
  for (double& slope : slopes.v) slope /= robot_.segments;
  return slopes;
}

double Spatial::free_turn() const {
  return (std::abs(inputs_.displacements[0]) + std::abs(inputs_.displacements[1])) / robot_.offset;
}

// All segments bend by the same angle θ towards t, where h·t is the displacement of each hole h and |t| = 2 sin θ/2:
// the chord of segment i is at the angle (i + 1/2) θ in the plane of t.
Vec<10> Spatial::free_slopes(const Command<2>& command) const {
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
