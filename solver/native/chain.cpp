#include "chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace ccr {

namespace {

// Moment of the adjoint about the lower node: a turn of the segment moves the next node by (-dy, dx).
double moment(const State& adjoint, const Bend& bend) { return adjoint[1] * bend.dx - adjoint[0] * bend.dy; }

}  // namespace

Chain::Chain(const Robot& robot, const std::vector<Obstacle>& obstacles)
    : robot_(robot),
      obstacles_(obstacles),
      bends_(robot.segments),
      states_(robot.segments + 1),
      levers_(robot.segments + 1),
      points_(kPoints * (robot.segments + 1)),
      gaps_(obstacles.size() * points_.size(), std::numeric_limits<double>::infinity()),
      pulls_(robot.segments + 1),
      adjoints_(robot.segments),
      gradient_(robot.segments) {
  near_.reserve(gaps_.size());
  for (int c = 0; c < contacts(); ++c) {
    const int points = kPoints * (robot.segments + 1);
    sites_.push_back({c / points, c % points, c % (robot.segments + 1)});
  }
}

bool Chain::evaluate(const std::vector<Control>& shear, double cable) {
  const int n = robot_.segments;
  pull_ = cable / n;
  objective_ = steepest_ = 0;
  bend_segments(n, shear[0].v.data(), pull_, robot_.length, robot_.offset, bends_.data());
  states_[0] = {};
  levers_[0] = {{robot_.offset, 0}};
  const double scale = robot_.length / robot_.offset;
  for (int i = 0; i < n; ++i) {
    Bend& bend = bends_[i];
    const double c = levers_[i][0], s = levers_[i][1];  // of the lower disk, times the offset
    bend.dx = -scale * (s * bend.forward + c * bend.sideways);
    bend.dy = scale * (c * bend.forward - s * bend.sideways);
    levers_[i + 1] = {{c * bend.cosine + s * bend.sine, s * bend.cosine - c * bend.sine}};
    states_[i + 1] = {{states_[i][0] + bend.dx, states_[i][1] + bend.dy, states_[i][2] - bend.angle}};
    objective_ += bend.angle * bend.angle;
    steepest_ = std::max(steepest_, std::abs(2 * bend.angle * bend.slope));
  }
  if (!std::isfinite(objective_)) return false;
  for (int i = 0; i <= n; ++i) {
    points_[i] = {{states_[i][0], states_[i][1]}};
    points_[n + 1 + i] = {{states_[i][0] + levers_[i][0], states_[i][1] + levers_[i][1]}};
  }
  measure_gaps();
  return true;
}

// Far from an obstacle, so many nodes are passed over as cannot come within reach of it.
void Chain::measure_gaps() {
  const int nodes = robot_.segments + 1;
  for (const int contact : near_) gaps_[contact] = std::numeric_limits<double>::infinity();
  near_.clear();
  for (std::size_t j = 0; j < obstacles_.size(); ++j)
    for (int i = 0; i < nodes; ++i) {
      const double distance = clearance(obstacles_[j], points_[i]) - robot_.offset - limits::kReach;
      if (distance > 0) {
        i += static_cast<int>(std::min(distance / robot_.length, static_cast<double>(nodes)));
        continue;
      }
      if (!obstacles_[j].touchable[i]) continue;
      for (int point = 0; point < kPoints; ++point) {
        const int contact = (static_cast<int>(j) * kPoints + point) * nodes + i;
        gaps_[contact] = ccr::measure_gap(obstacles_[j], this->point(contact)).value;
        near_.push_back(contact);
      }
    }
}

void Chain::survey(double* gaps) const {
  const std::size_t nodes = robot_.segments + 1;
  for (const Obstacle& obstacle : obstacles_) {
    ccr::measure_gaps(obstacle, points_, gaps);
    for (std::size_t k = 0; k < points_.size(); ++k)
      if (!obstacle.touchable[k % nodes]) gaps[k] = std::numeric_limits<double>::infinity();
    gaps += points_.size();
  }
}

State Chain::slope(int contact) const {
  const Gap law = ccr::measure_gap(obstacle(contact), point(contact));
  const Position lever = this->lever(contact);
  return {{law.x, law.y, law.y * lever[0] - law.x * lever[1]}};
}

double Chain::violation() const {
  double worst = 0;
  for (const int contact : near_) worst = std::max(worst, -gaps_[contact]);
  return worst;
}

void Chain::reduced_gradient(const ActiveSet& active) {
  std::fill(pulls_.begin(), pulls_.end(), State{});
  for (int j = 0; j < active.count; ++j) {
    const State force = slope(active.contact[j]);
    for (int k = 0; k < 3; ++k) pulls_[node(active.contact[j])][k] += active.multiplier[j] * force[k];
  }
  State p;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    const Bend& bend = bends_[i];
    p -= pulls_[i + 1];
    adjoints_[i] = p;
    const double turn = moment(p, bend);
    gradient_[i][0] = 2 * bend.angle * bend.slope + turn * bend.heading_slope - p[2] * bend.slope;
    p[2] += turn;
  }
}

void Chain::curvature(const ActiveSet& active, System& system) const {
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    const State& p = adjoints_[i];
    const double turn = moment(p, bend);
    const double inward = -(p[0] * bend.dx + p[1] * bend.dy);
    const double heading = bend.heading_slope;
    System::Stage& stage = system.stages[i];
    stage.a = {-bend.dy, bend.dx};
    stage.b = {{-bend.dy * heading, bend.dx * heading, -bend.slope}};
    system.node_hessian[i] = {};
    system.node_hessian[i](2, 2) = inward;
    stage.hux = {{0, 0, inward * heading}};
    stage.huu = {{2 * (bend.slope * bend.slope + bend.angle * bend.curvature) + inward * heading * heading +
                  turn * bend.heading_curvature - p[2] * bend.curvature}};
  }
  system.node_hessian[robot_.segments] = {};
  for (int j = 0; j < active.count; ++j) {
    const int contact = active.contact[j];
    const Gap law = ccr::measure_gap(obstacle(contact), point(contact));
    const Position lever = this->lever(contact);
    const double tx = -lever[1], ty = lever[0];  // point motion per disk turn
    const double mixed_x = law.xx * tx + law.xy * ty, mixed_y = law.xy * tx + law.yy * ty;
    const double turn = tx * mixed_x + ty * mixed_y - law.x * lever[0] - law.y * lever[1];
    const Mat<3, 3> hessian = {{law.xx, law.xy, mixed_x, law.xy, law.yy, mixed_y, mixed_x, mixed_y, turn}};
    for (int k = 0; k < 9; ++k) system.node_hessian[node(contact)][k] -= active.multiplier[j] * hessian[k];
  }
}

double Chain::cable_slope() const {
  double slope = 0;
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    const State& p = adjoints_[i];
    const double turn = moment(p, bend);
    slope += bend.pull_slope * (2 * bend.angle - turn / 2 - p[2]);
  }
  return slope / robot_.segments;
}

}  // namespace ccr
