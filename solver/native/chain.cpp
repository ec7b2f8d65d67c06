#include "chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccr {

namespace {

// Moment of the adjoint about the lower node: a turn of the segment moves the next node by (-dy, dx).
double moment(const State& adjoint, const Bend& bend) { return adjoint[1] * bend.dx - adjoint[0] * bend.dy; }

}  // namespace

void place_points(const Robot& robot, std::span<const Position> nodes, std::span<const Position> levers,
                  std::vector<Position>& points) {
  const int stride = robot.between + 1;
  Position* point = points.data();
  for (const double line : robot.lines) {
    const double scale = line / robot.offset;
    for (int i = 0; i <= robot.segments; ++i)
      point[i * stride] = {{nodes[i][0] + scale * levers[i][0], nodes[i][1] + scale * levers[i][1]}};
    for (int i = 0; i < robot.segments; ++i)
      for (int k = 1; k < stride; ++k) {
        const Position &here = point[i * stride], &next = point[(i + 1) * stride];
        const double t = static_cast<double>(k) / stride;
        point[i * stride + k] = {{here[0] + t * (next[0] - here[0]), here[1] + t * (next[1] - here[1])}};
      }
    point += robot.positions();
  }
}

Chain::Chain(const Robot& robot, const std::vector<Obstacle>& obstacles)
    : robot_(robot),
      obstacles_(obstacles),
      bends_(robot.segments),
      origin_(robot.segments + 1),
      clear_(obstacles.size()),
      states_(robot.segments + 1),
      nodes_(robot.segments + 1),
      levers_(robot.segments + 1),
      points_(robot.points()),
      gaps_(obstacles.size() * points_.size(), std::numeric_limits<double>::infinity()),
      pulls_(robot.segments + 1),
      adjoints_(robot.segments),
      gradient_(robot.segments) {
  near_.reserve(gaps_.size());
  const int stride = robot.between + 1;
  for (const double line : robot.lines)
    for (int k = 0; k < robot.positions(); ++k)
      sites_.push_back({k / stride, static_cast<double>(k % stride) / stride, line / robot.offset});
  for (const double line : robot.lines) reach_ = std::max(reach_, std::abs(line));
  reach_ += limits::kReach + (robot.between > 0 ? robot.length : 0);
}

void Chain::look_around(std::span<const Position> nodes) {
  std::copy(nodes.begin(), nodes.end(), origin_.begin());
  for (std::size_t j = 0; j < obstacles_.size(); ++j) clear_[j] = clearance(obstacles_[j], nodes) - reach_;
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
  for (int i = 0; i <= n; ++i) nodes_[i] = {{states_[i][0], states_[i][1]}};
  place_points(robot_, nodes_, levers_, points_);
  measure_gaps();
  return true;
}

// Far from an obstacle, so many nodes are passed over as cannot come within reach of it.
void Chain::measure_gaps() {
  const int n = robot_.segments, stride = robot_.between + 1;
  for (const int contact : near_) gaps_[contact] = std::numeric_limits<double>::infinity();
  near_.clear();
  double drift = 0;
  for (int i = 0; i <= n; ++i) {
    const double dx = nodes_[i][0] - origin_[i][0], dy = nodes_[i][1] - origin_[i][1];
    drift = std::max(drift, dx * dx + dy * dy);
  }
  drift_ = std::sqrt(drift);
  for (int j = 0; j < static_cast<int>(obstacles_.size()); ++j) {
    if (far(j, 0)) continue;
    const Obstacle& obstacle = obstacles_[j];
    const int first = j * robot_.points();
    for (int i = 0; i <= n; ++i) {
      const double distance = clearance(obstacle, nodes_[i]) - reach_;
      if (distance > 0) {
        i += static_cast<int>(std::min(distance / robot_.length, static_cast<double>(n)));
        continue;
      }
      for (int start = i * stride; start < robot_.points(); start += robot_.positions())
        for (int k = start; k < start + (i < n ? stride : 1); ++k) {
          if (!obstacle.touchable[k]) continue;
          gaps_[first + k] = measure_gap(obstacle, points_[k]).value;
          near_.push_back(first + k);
        }
    }
  }
}

void Chain::survey(double* gaps) const {
  for (const Obstacle& obstacle : obstacles_) {
    ccr::measure_gaps(obstacle, points_, gaps);
    for (std::size_t k = 0; k < points_.size(); ++k)
      if (!obstacle.touchable[k]) gaps[k] = std::numeric_limits<double>::infinity();
    gaps += points_.size();
  }
}

System::Force Chain::slope(int contact) const {
  const Gap gap = measure_gap(obstacle(contact), point(contact));
  const Site& site = this->site(contact);
  const auto share = [&](double weight, const Position& lever) {
    const double turn = site.lever * (gap.y * lever[0] - gap.x * lever[1]);
    return State{{weight * gap.x, weight * gap.y, weight * turn}};
  };
  const double t = site.fraction;
  if (t == 0) return {site.node, false, share(1, levers_[site.node]), {}};
  return {site.node, true, share(1 - t, levers_[site.node]), share(t, levers_[site.node + 1])};
}

double Chain::violation() const {
  double worst = 0;
  for (const int contact : near_) worst = std::max(worst, -gaps_[contact]);
  return worst;
}

void Chain::reduced_gradient(const ActiveSet& active) {
  std::fill(pulls_.begin(), pulls_.end(), State{});
  for (int j = 0; j < active.count; ++j) {
    const System::Force force = slope(active.contact[j]);
    for (int k = 0; k < 3; ++k) {
      pulls_[force.node][k] += active.multiplier[j] * force.here[k];
      if (force.split) pulls_[force.node + 1][k] += active.multiplier[j] * force.next[k];
    }
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
    const Gap gap = measure_gap(obstacle(contact), point(contact));
    const Site& site = this->site(contact);
    // Its Hessian in the states of the nodes beside it: J_aᵀ C J_b, and the curvature of the turn of each lever.
    const auto motion = [&](double weight, const Position& lever) {
      return Mat<2, 3>{{weight, 0, -weight * site.lever * lever[1], 0, weight, weight * site.lever * lever[0]}};
    };
    const auto turn = [&](double weight, const Position& lever) {
      return weight * site.lever * (gap.x * lever[0] + gap.y * lever[1]);
    };
    const double t = site.fraction, force = -active.multiplier[j];
    const Mat<2, 2> c = {{force * gap.xx, force * gap.xy, force * gap.xy, force * gap.yy}};
    const Mat<2, 3> here = motion(1 - t, levers_[site.node]);
    system.node_hessian[site.node] += transpose_times(here, times(c, here));
    system.node_hessian[site.node](2, 2) -= force * turn(1 - t, levers_[site.node]);
    if (t == 0) continue;
    const Mat<2, 3> next = motion(t, levers_[site.node + 1]);
    system.node_hessian[site.node + 1] += transpose_times(next, times(c, next));
    system.node_hessian[site.node + 1](2, 2) -= force * turn(t, levers_[site.node + 1]);
    system.couple(site.node, transpose_times(here, times(c, next)));
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
