#include "model/spatial_rod.hpp"

#include <algorithm>
#include <cmath>

#include "model/disk_gap.hpp"
#include "tolerances.hpp"

namespace ccr {

SpatialRod::SpatialRod(const Robot& robot)
    : states(robot.segments + 1),
      frames(robot.segments + 1),
      gradient(robot.segments),
      robot_(robot),
      controls_(SpatialArcLaw::kControl, robot.segments),
      laws_(SpatialArcLaw::kBend, robot.segments),
      adjoints_(SpatialArcLaw::kAdjoint, robot.segments),
      hessians_(SpatialArcLaw::kHessian, robot.segments),
      cable_hessians_(SpatialArcLaw::kHessian, robot.segments),
      bends_(robot.segments),
      strain_slopes_(robot.segments),
      chords_(robot.segments),
      wrenches_(robot.segments),
      cables_(robot.rod.cables, robot.segments),
      taken_(robot.rod.cables.size(), Rows(SpatialArcLaw::kCable, robot.segments)) {}

bool SpatialRod::evaluate(const Command& command, const std::vector<Control>& controls) {
  const int n = robot_.segments;
  length_ = command.length / n;
  for (int i = 0; i < n; ++i) controls_.put(i, controls[i].v.data(), kControl);
  SpatialArcLaw::bend(n, length_, controls_, laws_);
  objective = max_objective_slope = widest = 0;
  states[0] = {};
  frames[0] = kBaseFrame;
  for (int i = 0; i < n; ++i) {
    laws_.get(i, bends_[i].chord.v.data(), SpatialArcLaw::kBend);
    chords_[i] = move_up(bends_[i], states[i], frames[i], states[i + 1], frames[i + 1]);
    add_strain(i, controls[i]);
  }
  take_up_cables();
  return std::isfinite(objective) && widest <= tolerances::kWidestTurn;
}

void SpatialRod::add_strain(int segment, const Control& control) {
  const double *stiffness = &robot_.rod.stiffness[segment * kControl], *rest = &robot_.rod.rest[segment * kControl];
  for (int k = 0; k < kControl; ++k) {
    const double strain = control[k] - rest[k];
    objective += stiffness[k] * strain * strain;
    strain_slopes_[segment][k] = 2 * stiffness[k] * strain;
    const double largest = 2 * stiffness[k] * std::max(std::abs(control[k]), std::abs(strain));
    max_objective_slope = std::max(max_objective_slope, largest);
  }
  widest = std::max(widest, norm(control));
}

void SpatialRod::take_up_cables() {
  cables_.clear();
  for (int k = 0; k < cables_.count(); ++k) {
    const int end = cables_[k].end;
    SpatialArcLaw::take(end, length_, cables_[k].hole.v.data(), controls_, laws_, taken_[k]);
    const double *value = taken_[k].row(0), *x = taken_[k].row(1), *y = taken_[k].row(2), *z = taken_[k].row(3);
    for (int i = 0; i < end; ++i) cables_.take(k, i, value[i], {{x[i], y[i], z[i]}});
  }
}

void SpatialRod::propagate_adjoints(const std::vector<State>& node_forces) {
  Wrench wrench;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    wrench.subtract(node_forces[i + 1]);
    const Wrench& local = wrenches_[i] = wrench.in(frames[i]);
    adjoints_.put(i, local.force.v.data(), 3);
    adjoints_.put(i, local.moment.v.data(), 3, 3);
    gradient[i] = strain_slopes_[i];
    gradient[i] += transpose_times(bends_[i].chord_slope, local.force);
    gradient[i] += transpose_times(bends_[i].turn_slope, local.moment);
    wrench.moment += cross(chords_[i], wrench.force);
  }
}

void SpatialRod::lagrangian_hessian(System& system) const {
  SpatialArcLaw::hessian_contraction(robot_.segments, controls_, laws_, adjoints_, hessians_);
  for (int i = 0; i < robot_.segments; ++i) {
    System::Stage& stage = system.stages[i];
    assemble_stage(bends_[i], chords_[i], frames[i], wrenches_[i], stage, system.node_hessian[i]);
    hessians_.get(i, stage.huu.v.data(), SpatialArcLaw::kHessian);
    for (int k = 0; k < kControl; ++k) stage.huu(k, k) += 2 * robot_.rod.stiffness[i * kControl + k];
  }
  for (int j = 0; j < cables_.count(); ++j)
    if (const double multiplier = cables_.multipliers()[j]; multiplier != 0) {
      SpatialArcLaw::cable_hessian(cables_[j].end, cables_[j].hole.v.data(), controls_, laws_, cable_hessians_);
      for (int i = 0; i < cables_[j].end; ++i)
        for (int k = 0; k < kControl * kControl; ++k) system.stages[i].huu[k] -= multiplier * cable_hessians_.at(k, i);
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
  const Mat<3, 3>& t = bends_[segment].turn_slope;
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
