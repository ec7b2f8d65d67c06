#include "model/spatial_rod.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/disk_gap.hpp"
#include "tolerances.hpp"

namespace ccr {

SpatialRod::SpatialRod(const Robot& robot)
    : states(robot.segments + 1),
      frames(robot.segments + 1),
      gradient(robot.segments),
      robot_(robot),
      controls_(ArcLaw::kControl, robot.segments),
      shared_(ArcLaw::kShared, robot.segments),
      adjoints_(ArcLaw::kAdjoint, robot.segments),
      hessians_(ArcLaw::kHessian, robot.segments),
      arcs_(Rows::room(robot.segments)),
      strain_slopes_(robot.segments),
      chords_(robot.segments),
      wrenches_(robot.segments),
      cables_(robot.rod.cables, robot.segments),
      distances_(robot.rod.cables.size() * Rows::room(robot.segments)) {
  frames[0] = kBaseFrame;
  for (int k = 0; k < cables_.count(); ++k) {
    double* distances = distances_.data() + k * Rows::room(robot.segments);
    arc_cables_.push_back({{}, 0, distances, cables_.minus_slopes(k)});
  }
  pulls_.reserve(arc_cables_.size());
  set_robot(robot);
}

void SpatialRod::set_robot(const Robot& robot) {
  robot_ = robot;
  cables_.set_cables(robot.rod.cables);
  for (int k = 0; k < cables_.count(); ++k) {
    const auto& [hole, end] = cables_[k];
    ArcCable& cable = arc_cables_[k];
    std::copy_n(std::array{hole[0], hole[1], norm(hole)}.begin(), 3, cable.hole);
    cable.end = end;
  }
}

bool SpatialRod::evaluate(const Command& command, const std::vector<Control>& controls) {
  const int n = robot_.segments;
  length_ = command.length / n;
  for (int k = 0; k < kControl; ++k)
    for (int i = 0; i < n; ++i) controls_.row(k)[i] = controls[i][k];
  const bool alike = ArcLaw::bend(n, length_, controls_, arcs_.data(), shared_);
  for (int i = 0; i < n; ++i) chords_[i] = move_up(arcs_[i], states[i], frames[i], states[i + 1], frames[i + 1]);
  add_strain(controls);
  take_up_cables(alike);
  return std::isfinite(objective) && widest <= tolerances::kWidestTurn &&
         (widest <= robot_.rod.bounded_twist || keeps_edges(controls));
}

void SpatialRod::add_strain(const std::vector<Control>& controls) {
  const double *stiffness = robot_.rod.stiffness.data(), *rest = robot_.rod.rest.data();
  double energy = 0, largest = 0, square = 0;
  for (int i = 0; i < robot_.segments; ++i, stiffness += kControl, rest += kControl) {
    for (int k = 0; k < kControl; ++k) {
      const double strain = controls[i][k] - rest[k], twice = 2 * stiffness[k];
      energy += stiffness[k] * strain * strain;
      strain_slopes_[i][k] = twice * strain;
      largest = std::max(largest, twice * std::max(std::abs(strain), std::abs(controls[i][k])));
    }
    square = std::max(square, dot(controls[i], controls[i]));
  }
  objective = energy;
  max_objective_slope = largest;
  widest = std::sqrt(square);
}

// Whether no segment twists so far while it bends that an edge beside it is longer than the longest. In the frame
// halfway, a line at the distance r runs along c + g b r and across g τ r at most.
bool SpatialRod::keeps_edges(const std::vector<Control>& controls) const {
  const auto sinc = [](double half) { return half > 0 ? std::sin(half) / half : 1.0; };
  for (const Control& control : controls) {
    const double twist = std::abs(control[2]);
    if (twist <= robot_.rod.bounded_twist) continue;
    const double bent = std::hypot(control[0], control[1]);
    const double chord = length_ * sinc(bent / 2), spread = sinc(std::hypot(bent, twist) / 2);
    for (std::size_t line = 0; line < robot_.lines.size(); ++line) {
      const double beside = spread * norm(robot_.lines[line]), longest = robot_.edges[line] * (robot_.between + 1);
      if (std::hypot(chord + beside * bent, beside * twist) > longest) return false;
    }
  }
  return true;
}

void SpatialRod::take_up_cables(bool alike) {
  ArcLaw::measure(arc_cables_, controls_, shared_, alike);
  cables_.clear();
  for (int k = 0; k < cables_.count(); ++k) {
    const auto& [hole, end, distances, slopes] = arc_cables_[k];
    double taken = 0;
#pragma GCC unroll 4
    for (int i = 0; i < end; ++i) taken += length_ - distances[i];
    cables_.set_taken(k, taken);
  }
}

void SpatialRod::propagate_adjoints(const std::vector<State>& node_forces) {
  Wrench wrench;
  bool acts = false;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    wrench.subtract(node_forces[i + 1]);
    acts = acts || wrench.acts();
    const Wrench& local = wrenches_[i] = acts ? wrench.in(frames[i]) : Wrench{};
    adjoints_.put(i, local.force.v.data(), 3);
    adjoints_.put(i, local.moment.v.data(), 3, 3);
    gradient[i] = strain_slopes_[i];
    if (!acts) continue;
    gradient[i] += transpose_times(arcs_[i].chord_slope, local.force);
    gradient[i] += transpose_times(arcs_[i].turn_slope, local.moment);
    wrench.moment += cross(chords_[i], wrench.force);
  }
}

void SpatialRod::lagrangian_hessian(System& system) const {
  pulls_.clear();
  for (int j = 0; j < cables_.count(); ++j)
    if (const double multiplier = cables_.multipliers()[j]; multiplier != 0)
      pulls_.push_back({&arc_cables_[j], multiplier});
  ArcLaw::hessian_contraction(robot_.segments, controls_, shared_, adjoints_, pulls_, hessians_);
  for (int i = 0; i < robot_.segments; ++i) {
    System::Stage& stage = system.stages[i];
    assemble_stage(arcs_[i], chords_[i], frames[i], wrenches_[i], stage, system.node_hessian[i]);
    for (int r = 0, entry = 0; r < kControl; ++r) {
      for (int c = 0; c <= r; ++c, ++entry) stage.huu(r, c) = stage.huu(c, r) = hessians_.at(entry, i);
      stage.huu(r, r) += 2 * robot_.rod.stiffness[i * kControl + r];
    }
  }
  system.node_hessian[robot_.segments] = {};
}

DiskGap SpatialRod::disk_gap(int segment, int) const {
  return measure_disk_gap(bend(segment), length_, robot_.disk_radius, robot_.disk_thickness);
}

SpatialRod::Control SpatialRod::disk_slope(int segment, const DiskGap& gap) const {
  const double across = gap.slope / bend(segment);
  return {{across * controls_.at(0, segment), across * controls_.at(1, segment), 0}};
}

// The gap depends on the rotation between both disks, so a moment on one is opposed by that on the other. The slope in
// the control is turn_slopeᵀ times the moment, in the lower disk's frame.
Vec<3> SpatialRod::disk_moment(int segment, const DiskGap& gap) const {
  const Vec<3> slope = disk_slope(segment, gap);
  const Mat<3, 3>& t = arcs_[segment].turn_slope;
  const auto column = [&](int c) { return Vec<3>{{t(0, c), t(1, c), t(2, c)}}; };
  const Vec<3> yz = cross(column(1), column(2)), zx = cross(column(2), column(0)), xy = cross(column(0), column(1));
  const double determinant = dot(column(0), yz);
  Vec<3> moment;
  for (int k = 0; k < 3; ++k) moment[k] = (yz[k] * slope[0] + zx[k] * slope[1] + xy[k] * slope[2]) / determinant;
  return times(frames[segment], moment);
}

Mat<3, 3> SpatialRod::disk_curvature(int segment, const DiskGap& gap) const {
  const double bent = bend(segment), across = gap.slope / bent;
  Mat<3, 3> curvature;
  for (int r = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c) {
      const double along = controls_.at(r, segment) * controls_.at(c, segment) / (bent * bent);
      curvature(r, c) = gap.curvature * along + across * ((r == c) - along);
    }
  return curvature;
}

}  // namespace ccr
