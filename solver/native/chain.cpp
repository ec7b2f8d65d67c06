#include "chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laws.h"

namespace ccr {

namespace {

struct SegmentLaw {
  double value[4];  // θ, θ_ψ, θ_ψψ, θ_pull
};

SegmentLaw segment_law(double shear, double pull, const Robot& robot) {
  SegmentLaw law;
  const double* in[] = {&shear, &pull, &robot.length, &robot.offset};
  double* out[] = {law.value};
  ccr_segment(in, out, nullptr, nullptr, 0);
  return law;
}

struct GapLaw {
  double value, x, y, xx, xy, yy;
};

GapLaw gap_law(const Obstacle& obstacle, const Position& point) {
  GapLaw law;
  const double* in[] = {point.v.data(), obstacle.parameters.data()};
  double* out[] = {&law.value};
  if (obstacle.shape == Shape::kCircle)
    ccr_circle_gap(in, out, nullptr, nullptr, 0);
  else
    ccr_half_plane_gap(in, out, nullptr, nullptr, 0);
  return law;
}

}  // namespace

Chain::Chain(const Robot& robot, const std::vector<Obstacle>& obstacles)
    : robot_(robot),
      obstacles_(obstacles),
      bends_(robot.segments),
      states_(robot.segments + 1),
      levers_(robot.segments + 1),
      points_(kPoints * (robot.segments + 1)),
      gaps_(obstacles.size() * points_.size()),
      pulls_(robot.segments + 1),
      adjoints_(robot.segments),
      gradient_(robot.segments) {}

bool Chain::evaluate(const std::vector<Control>& shear, double cable) {
  const int n = robot_.segments;
  pull_ = cable / n;
  objective_ = steepest_ = 0;
  states_[0] = {};
  for (int i = 0; i < n; ++i) {
    const double psi = shear[i][0];
    const double reach = (robot_.length - pull_) / robot_.length;
    if (!(std::abs(std::sin(psi)) < reach) || !(std::cos(psi) > 0)) return false;
    const SegmentLaw law = segment_law(psi, pull_, robot_);
    const State& s = states_[i];
    const double heading = s[2] - law.value[0] / 2 + psi;  // from +y
    bends_[i] = {law.value[0], law.value[1], law.value[2], law.value[3],
                 -robot_.length * std::sin(heading), robot_.length * std::cos(heading)};
    states_[i + 1] = {{s[0] + bends_[i].dx, s[1] + bends_[i].dy, s[2] - law.value[0]}};
    objective_ += law.value[0] * law.value[0];
    steepest_ = std::max(steepest_, std::abs(2 * law.value[0] * law.value[1]));
  }
  for (int i = 0; i <= n; ++i) {
    const State& s = states_[i];
    levers_[i] = {{robot_.offset * std::cos(s[2]), robot_.offset * std::sin(s[2])}};
    points_[i] = {{s[0], s[1]}};
    points_[n + 1 + i] = {{s[0] + levers_[i][0], s[1] + levers_[i][1]}};
  }
  measure_gaps();
  return std::isfinite(objective_);
}

void Chain::measure_gaps() {
  const int nodes = robot_.segments + 1;
  Gap* gap = gaps_.data();
  for (const Obstacle& obstacle : obstacles_)
    for (int p = 0; p < kPoints; ++p)
      for (int i = 0; i < nodes; ++i, ++gap) {
        if (!obstacle.touchable[i]) {
          *gap = {std::numeric_limits<double>::infinity(), {}};
          continue;
        }
        const GapLaw law = gap_law(obstacle, points_[p * nodes + i]);
        const double turn = p == kCable ? law.y * levers_[i][0] - law.x * levers_[i][1] : 0.0;
        *gap = {law.value, {{law.x, law.y, turn}}};
      }
}

double Chain::violation() const {
  double worst = 0;
  for (const Gap& gap : gaps_) worst = std::max(worst, -gap.value);
  return worst;
}

void Chain::reduced_gradient(const ActiveSet& active) {
  std::fill(pulls_.begin(), pulls_.end(), State{});
  for (int j = 0; j < active.count; ++j)
    for (int k = 0; k < 3; ++k)
      pulls_[node(active.contact[j])][k] += active.multiplier[j] * gaps_[active.contact[j]].slope[k];
  State p;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    const Bend& bend = bends_[i];
    p -= pulls_[i + 1];
    adjoints_[i] = p;
    // A turn of the segment moves the next node by (-dy, dx).
    const double turn = p[1] * bend.dx - p[0] * bend.dy;
    gradient_[i][0] = 2 * bend.angle * bend.slope + turn * (1 - bend.slope / 2) - p[2] * bend.slope;
    p[2] += turn;
  }
}

void Chain::curvature(const ActiveSet& active, System& system) const {
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    const State& p = adjoints_[i];
    const double turn = p[1] * bend.dx - p[0] * bend.dy;
    const double inward = -(p[0] * bend.dx + p[1] * bend.dy);
    const double heading = 1 - bend.slope / 2;  // of the segment, per shear
    System::Stage& stage = system.stages[i];
    stage.a = {{1, 0, -bend.dy, 0, 1, bend.dx, 0, 0, 1}};
    stage.b = {{-bend.dy * heading, bend.dx * heading, -bend.slope}};
    stage.hxx = {};
    stage.hxx(2, 2) = inward;
    stage.hux = {{0, 0, inward * heading}};
    stage.huu = {{2 * (bend.slope * bend.slope + bend.angle * bend.curvature) + inward * heading * heading -
                  (turn / 2 + p[2]) * bend.curvature}};
  }
  std::fill(system.node_hessian.begin(), system.node_hessian.end(), Mat<3, 3>{});
  for (int j = 0; j < active.count; ++j) {
    const int contact = active.contact[j], i = node(contact);
    const int nodes = robot_.segments + 1;
    const GapLaw law = gap_law(obstacle(contact), points_[point(contact) * nodes + i]);
    const Position lever = point(contact) == kCable ? levers_[i] : Position{};
    const double tx = -lever[1], ty = lever[0];  // point motion per disk turn
    const double mixed_x = law.xx * tx + law.xy * ty, mixed_y = law.xy * tx + law.yy * ty;
    const double turn = tx * mixed_x + ty * mixed_y - law.x * lever[0] - law.y * lever[1];
    const Mat<3, 3> hessian = {{law.xx, law.xy, mixed_x, law.xy, law.yy, mixed_y, mixed_x, mixed_y, turn}};
    for (int k = 0; k < 9; ++k) system.node_hessian[i][k] -= active.multiplier[j] * hessian[k];
  }
}

double Chain::cable_slope() const {
  double slope = 0;
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    const State& p = adjoints_[i];
    const double turn = p[1] * bend.dx - p[0] * bend.dy;
    slope += bend.pull_slope * (2 * bend.angle - turn / 2 - p[2]);
  }
  return slope / robot_.segments;
}

}  // namespace ccr
