#include "model/planar.hpp"

#include <algorithm>
#include <cmath>

#include "tolerances.hpp"

// The generated law of the disks' gap, inlined here.
#define CASADI_SYMBOL_EXPORT static inline
#include "disk_laws.c"

namespace ccr {

namespace {

// For the chord d of a segment and the adjoint p of its upper node: first and second derivative of p·d in the rotation
// of the lower disk, which moves the upper node by (-dy, dx).
template <class Bend, int N>
double turning(const Vec<N>& p, const Bend& bend) {
  return p[1] * bend.dx - p[0] * bend.dy;
}

template <class Bend, int N>
double inward(const Vec<N>& p, const Bend& bend) {
  return -(p[0] * bend.dx + p[1] * bend.dy);
}

}  // namespace

template <class Law>
Planar<Law>::Planar(const Robot& robot)
    : states(robot.segments + 1),
      frames(robot.segments + 1),
      gradient(robot.segments),
      robot_(robot),
      bends_(robot.segments),
      free_bend_(1),
      adjoints_(robot.segments),
      minus_taken_slopes_(kRod ? robot.segments : 0) {}

template <class Law>
bool Planar<Law>::evaluate(const Command<1>& command, const std::vector<Control>& controls) {
  const int n = robot_.segments;
  displacement_ = command.cables[0] / n;
  length_ = command.length / n;
  objective = max_objective_slope = widest = taken_ = 0;
  Law::bend(n, controls[0].v.data(), displacement_, length_, robot_.offset, bends_);
  states[0] = {};
  frames[0] = {{1, 0}};
  for (int i = 0; i < n; ++i) {
    const auto bend = bends_[i];
    const double c = frames[i][0], s = frames[i][1];  // cosine and sine of the lower disk's angle
    const double dx = -length_ * (s * bend.forward + c * bend.sideways);
    const double dy = length_ * (c * bend.forward - s * bend.sideways);
    bends_.set_chord(i, dx, dy);
    frames[i + 1] = {{c * bend.cosine + s * bend.sine, s * bend.cosine - c * bend.sine}};
    State& next = states[i + 1];
    next = states[i];
    next[0] += dx;
    next[1] += dy;
    next[2] -= bend.angle;
    if constexpr (kRod) {
      taken_ += bend.taken;
      minus_taken_slopes_[i][0] = -bend.taken_slope;
    }
    objective += bend.angle * bend.angle;
    max_objective_slope = std::max(max_objective_slope, std::abs(2 * bend.angle * bend.slope));
    widest = std::max(widest, std::abs(bend.angle));
  }
  return std::isfinite(objective) && !(kRod && widest > tolerances::kWidestTurn);
}

template <class Law>
void Planar<Law>::propagate_adjoints(const std::vector<State>& node_forces) {
  State p;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    const auto bend = bends_[i];
    p -= node_forces[i + 1];
    adjoints_[i] = p;
    const double turn = turning(p, bend);
    gradient[i][0] = 2 * bend.angle * bend.slope + turn * bend.heading_slope - p[2] * bend.slope;
    if constexpr (kRod) gradient[i][0] -= inward(p, bend) * bend.stretch;
    p[2] += turn;
  }
  slack_multiplier_ = 0;
}

template <class Cable>
void Planar<Cable>::add_slack(double multiplier) requires(kRod) {
  slack_multiplier_ = multiplier;
  for (int i = 0; i < robot_.segments; ++i) gradient[i][0] += multiplier * minus_taken_slopes_[i][0];
}

template <class Law>
void Planar<Law>::lagrangian_hessian(System& system) const {
  for (int i = 0; i < robot_.segments; ++i) {
    const auto bend = bends_[i];
    const State& p = adjoints_[i];
    const double turn = turning(p, bend), inward = ccr::inward(p, bend), heading = bend.heading_slope;
    typename System::Stage& stage = system.stages[i];
    stage.a = {-bend.dy, bend.dx};
    stage.b[0] = -bend.dy * heading;
    stage.b[1] = bend.dx * heading;
    stage.b[2] = -bend.slope;
    system.node_hessian[i] = {};
    system.node_hessian[i](2, 2) = inward;
    stage.hux = {{0, 0, inward * heading}};
    stage.huu = {{2 * (bend.slope * bend.slope + bend.angle * bend.curvature) + inward * heading * heading +
                  turn * bend.heading_curvature - p[2] * bend.curvature}};
    if constexpr (kRod) {
      stage.b[0] += bend.dx * bend.stretch;
      stage.b[1] += bend.dy * bend.stretch;
      stage.hux[2] += turn * bend.stretch;
      stage.huu[0] +=
          2 * turn * bend.stretch * heading - inward * bend.stretch_slope - slack_multiplier_ * bend.taken_curvature;
    }
  }
  system.node_hessian[robot_.segments] = {};
}

// For the rod the tension is the multiplier of the slack, and this is 0.
template <class Law>
Vec<1> Planar<Law>::displacement_slopes() const {
  Vec<1> slope;
  if constexpr (!kRod)
    for (int i = 0; i < robot_.segments; ++i) {
      const auto bend = bends_[i];
      const State& p = adjoints_[i];
      slope[0] += bend.displacement_slope * (2 * bend.angle - turning(p, bend) / 2 - p[2]);
    }
  slope[0] /= robot_.segments;
  return slope;
}

template <class Law>
DiskGap Planar<Law>::disk_gap(int segment, int side) const requires(kRod) {
  const double angle = side * bends_[segment].angle;
  const double* in[] = {&angle, &length_, &robot_.disk_radius, &robot_.disk_thickness};
  DiskGap gap;
  double* out[] = {&gap.value};
  ccr_disk_gap(in, out, nullptr, nullptr, 0);
  gap.slope *= side;
  return gap;
}

template <class Law>
Planar<Law>::Control Planar<Law>::free_control(const Command<1>& command) {
  if (command == free_command_) return free_control_;
  const double displacement = command.cables[0] / robot_.segments, length = command.length / robot_.segments;
  free_command_ = command;
  free_control_ = {};
  if constexpr (kRod) free_control_[0] = displacement / robot_.offset;
  for (int i = 0; i <= tolerances::kRelaxIterations; ++i) {
    Law::bend(1, free_control_.v.data(), displacement, length, robot_.offset, free_bend_);
    if constexpr (!kRod) {
      break;
    } else {
      const double change = (free_bend_[0].taken - displacement) / free_bend_[0].taken_slope;
      free_control_[0] -= change;
      if (std::abs(change) <= tolerances::kRelaxed * std::abs(free_control_[0])) break;
    }
  }
  return free_control_;
}

// All segments have the same shape, with chords at angles (i + 1/2) θ, which are reached by repeated rotation.
template <class Law>
Vec<3> Planar<Law>::free_slopes(const Command<1>& command) {
  const int n = robot_.segments;
  const double length = command.length / n;
  free_control(command);
  const auto bend = free_bend_[0];
  double turn, stretch = 0;  // derivatives of θ and of the logarithm of the chord
  if constexpr (kRod) {
    turn = 1 / (n * bend.taken_slope);
    stretch = bend.stretch * turn;
  } else {
    turn = bend.displacement_slope / n;
  }
  const double chord = length * std::sqrt(bend.forward * bend.forward + bend.sideways * bend.sideways);
  double cosine = std::cos(bend.angle / 2), sine = std::sin(bend.angle / 2);
  Vec<3> slopes{};
  for (int i = 0; i < n; ++i) {
    const double swing = (i + 0.5) * turn;
    slopes[0] += chord * (stretch * sine + swing * cosine);
    slopes[1] += chord * (stretch * cosine - swing * sine);
    const double next = cosine * bend.cosine - sine * bend.sine;
    sine = sine * bend.cosine + cosine * bend.sine;
    cosine = next;
  }
  slopes[2] = -n * turn;
  return slopes;
}

template class Planar<PaperLaw>;
template class Planar<RodLaw>;

}  // namespace ccr
