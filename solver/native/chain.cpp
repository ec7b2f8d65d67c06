#include "chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccr {

namespace {

// A chord d in the base frame seen by the adjoint p of the node it leads to: its moment about the lower node, where a
// turn moves the upper one by (-dy, dx), and -p·d.
template <class Bend, int N>
double moment(const Vec<N>& p, const Bend& bend) {
  return p[1] * bend.dx - p[0] * bend.dy;
}

template <class Bend, int N>
double inward(const Vec<N>& p, const Bend& bend) {
  return -(p[0] * bend.dx + p[1] * bend.dy);
}

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

template <class Model>
Chain<Model>::Chain(const Robot& robot, int obstacles)
    : robot_(robot),
      bends_(robot.segments),
      one_(1),
      origin_(robot.segments + 1),
      clear_(obstacles),
      states_(robot.segments + 1),
      nodes_(robot.segments + 1),
      levers_(robot.segments + 1),
      points_(robot.points()),
      gaps_(obstacles * points_.size() + Model::kSliding, std::numeric_limits<double>::infinity()),
      mount_of_(obstacles, -1),
      pulls_(robot.segments + 1),
      adjoints_(robot.segments),
      gradient_(robot.segments) {
  near_.reserve(gaps_.size());
  const int stride = robot.between + 1;
  for (const double line : robot.lines)
    for (int k = 0; k < robot.positions(); ++k)
      sites_.push_back({k / stride, static_cast<double>(k % stride) / stride, line / robot.offset});
  for (const double line : robot.lines) reach_ = std::max(reach_, std::abs(line));
  reach_ += limits::kReach + (robot.between > 0 ? robot.max_length / robot.segments : 0);
}

template <class Model>
void Chain<Model>::enter(std::span<const Obstacle> obstacles) {
  obstacles_ = obstacles;
  for (const int contact : near_) gaps_[contact] = std::numeric_limits<double>::infinity();
  near_.clear();
  int mounts = 0;
  for (std::size_t j = 0; j < obstacles.size(); ++j) mount_of_[j] = obstacles[j].mounted ? mounts++ : -1;
  springs_.resize(mounts);
  mount_origin_.resize(mounts);
  displacements_.resize(mounts);
  mount_gradient_.resize(mounts);
}

template <class Model>
void Chain<Model>::look_around(std::span<const Position> nodes, const std::vector<Position>& mounts) {
  std::copy(nodes.begin(), nodes.end(), origin_.begin());
  mount_origin_ = mounts;
  for (std::size_t j = 0; j < obstacles_.size(); ++j) {
    clear_[j] = clearance(obstacles_[j], nodes) - reach_;
    if (mount_of_[j] >= 0) clear_[j] -= norm(mounts[mount_of_[j]]);
  }
}

template <class Model>
bool Chain<Model>::far(int obstacle, double motion) const {
  const int mount = mount_of_[obstacle];
  if (mount >= 0) motion += norm(minus(displacements_[mount], mount_origin_[mount]));
  return clear_[obstacle] > drift_ + motion;
}

template <class Model>
bool Chain<Model>::evaluate(const Iterate& at) {
  const Command& command = at.command;
  const int n = robot_.segments;
  pull_ = command.cable / n;
  length_ = command.length / n;
  objective_ = steepest_ = 0;
  Model::bend(n, at.controls[0].v.data(), pull_, length_, robot_.offset, bends_);
  states_[0] = {};
  levers_[0] = {{robot_.offset, 0}};
  const double scale = length_ / robot_.offset;
  double widest = 0;
  for (int i = 0; i < n; ++i) {
    const auto bend = bends_[i];
    const double c = levers_[i][0], s = levers_[i][1];  // of the lower disk, times the offset
    const double dx = -scale * (s * bend.forward + c * bend.sideways);
    const double dy = scale * (c * bend.forward - s * bend.sideways);
    bends_.place(i, dx, dy);
    levers_[i + 1] = {{c * bend.cosine + s * bend.sine, s * bend.cosine - c * bend.sine}};
    State& next = states_[i + 1];
    next = states_[i];
    next[0] += dx;
    next[1] += dy;
    next[2] -= bend.angle;
    if constexpr (Model::kSliding) next[3] += bend.taken;
    objective_ += bend.angle * bend.angle;
    steepest_ = std::max(steepest_, std::abs(2 * bend.angle * bend.slope));
    widest = std::max(widest, std::abs(bend.angle));
  }
  if (!std::isfinite(objective_) || (Model::kSliding && widest > limits::kWidestTurn)) return false;
  load_springs(at.mounts);
  for (int i = 0; i <= n; ++i) nodes_[i] = {{states_[i][0], states_[i][1]}};
  place_points(robot_, nodes_, levers_, points_);
  measure_gaps(Model::kSliding ? states_[n][Model::kState - 1] - command.cable : 0);
  return true;
}

template <class Model>
void Chain<Model>::load_springs(const std::vector<Position>& mounts) {
  displacements_ = mounts;
  energy_ = objective_;
  for (std::size_t j = 0; j < obstacles_.size(); ++j) {
    const int mount = mount_of_[j];
    if (mount < 0) continue;
    for (int k = 0; k < 4; ++k) springs_[mount][k] = obstacles_[j].stiffness[k] / stiffness();
    energy_ += dot(mounts[mount], times(springs_[mount], mounts[mount])) / 2;
  }
}

template <class Model>
Control Chain<Model>::relaxed(const Command& command) {
  const double pull = command.cable / robot_.segments, length = command.length / robot_.segments;
  if (command.cable == relaxed_at_.cable && command.length == relaxed_at_.length) return relaxed_;
  relaxed_at_ = command;
  relaxed_ = {};
  if constexpr (Model::kSliding) relaxed_[0] = pull / robot_.offset;
  for (int i = 0; i <= limits::kRelaxIterations; ++i) {
    Model::bend(1, relaxed_.v.data(), pull, length, robot_.offset, one_);
    if constexpr (!Model::kSliding) {
      break;
    } else {
      const double change = (one_[0].taken - pull) / one_[0].taken_slope;
      relaxed_[0] -= change;
      if (std::abs(change) <= limits::kRelaxed * std::abs(relaxed_[0])) break;
    }
  }
  return relaxed_;
}

template <class Model>
void Chain<Model>::relax(Iterate& at) {
  at.active.count = 0;
  std::fill(at.mounts.begin(), at.mounts.end(), Position{});
  Control control{};
  if constexpr (Model::kSliding)
    if (at.command.cable > 0) {
      control = relaxed(at.command);
      at.active.contact[0] = contacts();
      at.active.multiplier[0] = 2 * control[0] / one_[0].taken_slope;
      at.active.count = 1;
    }
  std::fill(at.controls.begin(), at.controls.end(), control);
}

// Far from an obstacle, so many nodes are passed over as cannot come within reach of it.
template <class Model>
void Chain<Model>::measure_gaps(double slack) {
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
    const Position moved = mount_of_[j] < 0 ? Position{} : displacements_[mount_of_[j]];
    const int first = j * robot_.points();
    for (int i = 0; i <= n; ++i) {
      const double distance = clearance_beyond(obstacle, minus(nodes_[i], moved), reach_);
      if (distance > 0) {
        i += static_cast<int>(std::min(distance / length_, static_cast<double>(n)));
        continue;
      }
      for (int start = i * stride; start < robot_.points(); start += robot_.positions())
        for (int k = start; k < start + (i < n ? stride : 1); ++k) {
          if (!obstacle.touchable[k]) continue;
          gaps_[first + k] = measure_gap(obstacle, minus(points_[k], moved)).value;
          near_.push_back(first + k);
        }
    }
  }
  if constexpr (Model::kSliding) {
    gaps_[contacts()] = slack;
    near_.push_back(contacts());
  }
}

template <class Model>
void Chain<Model>::survey(double* gaps) const {
  for (std::size_t j = 0; j < obstacles_.size(); ++j) {
    const Position moved = mount_of_[j] < 0 ? Position{} : displacements_[mount_of_[j]];
    ccr::measure_gaps(obstacles_[j], points_, moved, gaps);
    for (std::size_t k = 0; k < points_.size() && !obstacles_[j].everywhere; ++k)
      if (!obstacles_[j].touchable[k]) gaps[k] = std::numeric_limits<double>::infinity();
    gaps += points_.size();
  }
}

template <class Model>
Position Chain<Model>::point(int contact) const {
  const int mount = this->mount(contact);
  const Position& point = points_[contact % points_.size()];
  return mount < 0 ? point : minus(point, displacements_[mount]);
}

template <class Model>
Gap Chain<Model>::gap(int contact) const {
  return measure_gap(obstacle(contact), point(contact));
}

template <class Model>
Chain<Model>::Slope Chain<Model>::slope(int contact) const {
  if constexpr (Model::kSliding)
    if (contact == contacts()) return {{robot_.segments, false, {{0, 0, 0, 1}}, {}}, -1, {}};
  const Gap gap = this->gap(contact);
  const Position normal = {{gap.x, gap.y}};
  return {force(contact, normal), mount(contact), normal};
}

template <class Model>
Chain<Model>::Force Chain<Model>::force(int contact, const Position& on_point) const {
  const Site& site = this->site(contact);
  const auto share = [&](double weight, const Position& lever) {
    const double turn = site.lever * (on_point[1] * lever[0] - on_point[0] * lever[1]);
    return State{{weight * on_point[0], weight * on_point[1], weight * turn}};
  };
  const double t = site.fraction;
  if (t == 0) return {site.node, false, share(1, levers_[site.node]), {}};
  return {site.node, true, share(1 - t, levers_[site.node]), share(t, levers_[site.node + 1])};
}

template <class Model>
double Chain<Model>::lever_arm(int contact) const {
  if (contact == contacts()) return robot_.offset * robot_.segments;
  const Site& site = this->site(contact);
  return length_ * (site.node + (site.fraction > 0));
}

template <class Model>
bool Chain<Model>::touching(const ActiveSet& active) const {
  return active.count > 1 || (active.count == 1 && active.contact[0] < contacts());
}

template <class Model>
double Chain<Model>::violation() const {
  double worst = 0;
  for (const int contact : near_) worst = std::max(worst, -gaps_[contact]);
  return worst;
}

template <class Model>
double Chain<Model>::tolerance() const {
  const double free = pull_ / robot_.offset;  // angle of a segment that nothing touches
  const double scale = Model::kSliding ? steepest_ : free * free;
  return limits::kStationarity * scale + limits::kRoundoff * steepest_;
}

template <class Model>
void Chain<Model>::reduced_gradient(const ActiveSet& active) {
  std::fill(pulls_.begin(), pulls_.end(), State{});
  for (std::size_t m = 0; m < springs_.size(); ++m) mount_gradient_[m] = times(springs_[m], displacements_[m]);
  for (int j = 0; j < active.count; ++j) {
    const auto& [force, mount, normal] = slope(active.contact[j]);
    if (mount >= 0)
      for (int k = 0; k < 2; ++k) mount_gradient_[mount][k] += active.multiplier[j] * normal[k];
    for (int k = 0; k < Model::kState; ++k) {
      pulls_[force.node][k] += active.multiplier[j] * force.here[k];
      if (force.split) pulls_[force.node + 1][k] += active.multiplier[j] * force.next[k];
    }
  }
  State p;
  for (int i = robot_.segments - 1; i >= 0; --i) {
    const auto bend = bends_[i];
    p -= pulls_[i + 1];
    adjoints_[i] = p;
    const double turn = moment(p, bend);
    gradient_[i][0] = 2 * bend.angle * bend.slope + turn * bend.heading_slope - p[2] * bend.slope;
    if constexpr (Model::kSliding) gradient_[i][0] += p[3] * bend.taken_slope - inward(p, bend) * bend.stretch;
    p[2] += turn;
  }
}

template <class Model>
void Chain<Model>::curvature(const ActiveSet& active, System& system) const {
  for (int i = 0; i < robot_.segments; ++i) {
    const auto bend = bends_[i];
    const State& p = adjoints_[i];
    const double turn = moment(p, bend), inward = ccr::inward(p, bend), heading = bend.heading_slope;
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
    if constexpr (Model::kSliding) {
      stage.b[0] += bend.dx * bend.stretch;
      stage.b[1] += bend.dy * bend.stretch;
      stage.b[3] = bend.taken_slope;
      stage.hux[2] += turn * bend.stretch;
      stage.huu[0] += p[3] * bend.taken_curvature + 2 * turn * bend.stretch * heading - inward * bend.stretch_slope;
    }
  }
  system.node_hessian[robot_.segments] = {};
  for (int j = 0; j < active.count; ++j) {
    const int contact = active.contact[j];
    if (contact == contacts()) continue;  // linear in the state
    const Gap gap = this->gap(contact);
    const Site& site = this->site(contact);
    // Its Hessian in the states of the nodes beside it: J_aᵀ C J_b, and the curvature of the turn of each lever.
    const auto motion = [&](double weight, const Position& lever) {
      Mat<2, Model::kState> slope;
      slope(0, 0) = slope(1, 1) = weight;
      slope(0, 2) = -weight * site.lever * lever[1];
      slope(1, 2) = weight * site.lever * lever[0];
      return slope;
    };
    const auto turn = [&](double weight, const Position& lever) {
      return weight * site.lever * (gap.x * lever[0] + gap.y * lever[1]);
    };
    const double t = site.fraction, force = -active.multiplier[j];
    const Mat<2, 2> c = {{force * gap.xx, force * gap.xy, force * gap.xy, force * gap.yy}};
    const auto here = motion(1 - t, levers_[site.node]);
    system.node_hessian[site.node] += transpose_times(here, times(c, here));
    system.node_hessian[site.node](2, 2) -= force * turn(1 - t, levers_[site.node]);
    if (t == 0) continue;
    const auto next = motion(t, levers_[site.node + 1]);
    system.node_hessian[site.node + 1] += transpose_times(next, times(c, next));
    system.node_hessian[site.node + 1](2, 2) -= force * turn(t, levers_[site.node + 1]);
    system.couple(site.node, transpose_times(here, times(c, next)));
  }
}

template <class Model>
double Chain<Model>::tension(const ActiveSet& active) const {
  double slope = 0;  // of the energy in the cable displacement, over the stiffness
  if constexpr (Model::kSliding) {
    for (int j = 0; j < active.count; ++j)
      if (active.contact[j] == contacts()) slope = active.multiplier[j];
    return stiffness() * slope;
  } else {
    for (int i = 0; i < robot_.segments; ++i) {
      const auto bend = bends_[i];
      const State& p = adjoints_[i];
      slope += bend.pull_slope * (2 * bend.angle - moment(p, bend) / 2 - p[2]);
    }
    return stiffness() * (slope / robot_.segments);
  }
}

template <class Model>
Position Chain<Model>::push(const ActiveSet& active, int obstacle) const {
  Position force{};
  for (int j = 0; j < active.count; ++j) {
    if (active.contact[j] == contacts() || active.contact[j] / static_cast<int>(points_.size()) != obstacle) continue;
    const Gap gap = this->gap(active.contact[j]);
    force[0] += stiffness() * active.multiplier[j] * gap.x;
    force[1] += stiffness() * active.multiplier[j] * gap.y;
  }
  return force;
}

// All segments have the same shape: the sums over their directions (i + 1/2) θ are taken by turning one of them on.
template <class Model>
Vec<3> Chain<Model>::free_slopes(const Command& command) {
  const int n = robot_.segments;
  const double length = command.length / n;
  relaxed(command);
  const auto bend = one_[0];
  double turn, stretch = 0;  // slopes of the angle and of the logarithm of the chord
  if constexpr (Model::kSliding) {
    turn = 1 / (n * bend.taken_slope);
    stretch = bend.stretch * turn;
  } else {
    turn = bend.pull_slope / n;
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

template class Chain<UniformCable>;
template class Chain<SlidingCable>;

}  // namespace ccr
