#include "model/planar.hpp"

#include <algorithm>
#include <cmath>

#include "model/disk_gap.hpp"
#include "tolerances.hpp"

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
      cables_(robot.rod.cables, robot.segments) {
  set_robot(robot);
}

template <class Law>
void Planar<Law>::set_robot(const Robot& robot) {
  robot_ = robot;
  free_command_ = {{{-1}}, 0};
  if constexpr (kRod) cables_.set_cables(robot.rod.cables);
  const Rod& rod = robot.rod;
  has_free_form_ = !kRod || (robot.bends_evenly() && rod.cables.size() == 1 && rod.stiffness[0] == 1 &&
                             rod.rest[0] == 0 && rod.cables[0].hole[0] == robot.offset);
}

template <class Law>
bool Planar<Law>::evaluate(const Command& command, const std::vector<Control>& controls) {
  const int n = robot_.segments;
  displacement_ = command.cables[0] / n;
  length_ = command.length / n;
  objective = max_objective_slope = widest = 0;
  if constexpr (kRod) cables_.clear();
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
      for (int k = 0; k < cables_.count(); ++k)
        if (cables_.spans(k, i)) {
          const auto taken = Law::taken(bend, cables_[k].hole[0]);
          cables_.take(k, i, taken.value, {{taken.slope}});
        }
      const double stiffness = robot_.rod.stiffness[i], strain = bend.angle - robot_.rod.rest[i];
      objective += stiffness * strain * strain;
      const double largest = 2 * stiffness * std::max(std::abs(bend.angle), std::abs(strain));
      max_objective_slope = std::max(max_objective_slope, largest);
    } else {
      objective += bend.angle * bend.angle;
      max_objective_slope = std::max(max_objective_slope, std::abs(2 * bend.angle * bend.slope));
    }
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
    double slope = 2 * bend.angle * bend.slope;
    if constexpr (kRod) slope = 2 * robot_.rod.stiffness[i] * (bend.angle - robot_.rod.rest[i]);
    gradient[i][0] = slope + turn * bend.heading_slope - p[2] * bend.slope;
    if constexpr (kRod) gradient[i][0] -= inward(p, bend) * bend.stretch;
    p[2] += turn;
  }
}

template <class Law>
double Planar<Law>::slack_curvature(int segment) const {
  double curvature = 0;
  if constexpr (kRod)
    for (int k = 0; k < cables_.count(); ++k)
      if (cables_.spans(k, segment))
        curvature += cables_.multipliers()[k] * Law::taken(bends_[segment], cables_[k].hole[0]).curvature;
  return curvature;
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
    double curvature = 2 * (bend.slope * bend.slope + bend.angle * bend.curvature);
    if constexpr (kRod) curvature = 2 * robot_.rod.stiffness[i];
    stage.huu = {{curvature + inward * heading * heading + turn * bend.heading_curvature - p[2] * bend.curvature}};
    if constexpr (kRod) {
      stage.b[0] += bend.dx * bend.stretch;
      stage.b[1] += bend.dy * bend.stretch;
      stage.hux[2] += turn * bend.stretch;
      stage.huu[0] += 2 * turn * bend.stretch * heading - inward * bend.stretch_slope - slack_curvature(i);
    }
  }
  system.node_hessian[robot_.segments] = {};
}

// For the rod the tensions are the multipliers of the slacks, and this is 0.
template <class Law>
Vec<Planar<Law>::kCables> Planar<Law>::displacement_slopes() const {
  Vec<kCables> slope;
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
  const double sign = side == 0 ? 1 : -1, angle = sign * bends_[segment].angle;
  DiskGap gap = measure_disk_gap(angle, length_, robot_.disk_radius, robot_.disk_thickness);
  gap.slope *= sign;
  return gap;
}

template <class Law>
Planar<Law>::Control Planar<Law>::free_control(const Command& command) {
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
      const auto taken = Law::taken(free_bend_[0], robot_.offset);
      const double change = (taken.value - displacement) / taken.slope;
      free_control_[0] -= change;
      if (std::abs(change) <= tolerances::kRelaxed * std::abs(free_control_[0])) break;
    }
  }
  return free_control_;
}

template <class Law>
double Planar<Law>::free_slack_multiplier() const requires(kRod) {
  return 2 * free_control_[0] / Law::taken(free_bend_[0], robot_.offset).slope;
}

// All segments have the same shape, with chords at angles (i + 1/2) θ, which are reached by repeated rotation.
template <class Law>
Vec<3> Planar<Law>::free_slopes(const Command& command) {
  if (!has_free_form_) return {};
  const int n = robot_.segments;
  const double length = command.length / n;
  free_control(command);
  const auto bend = free_bend_[0];
  double turn, stretch = 0;  // derivatives of θ and of the logarithm of the chord
  if constexpr (kRod) {
    turn = 1 / (n * Law::taken(bend, robot_.offset).slope);
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
