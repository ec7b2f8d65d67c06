// The points of a robot and their gaps: a broad phase passes over obstacles that are out of reach of a shape.
#include <algorithm>
#include <cmath>
#include <limits>

#include "model/models.hpp"
#include "solve/contact_problem.hpp"

namespace ccr {

// Writes the points of all lines at a node, the first one to `point`.
template <class Model>
void place_node(const Robot& robot, const Position<Model::kSpace>& node, const typename Model::Frame& frame,
                Position<Model::kSpace>* point) {
  const auto at = node;  // copies that no point written may change
  const auto turned = frame;
  for (const Vec<2>& line : robot.lines) {
    Position<Model::kSpace> placed = at;
    placed += Model::lever(turned, line);
    *point = placed;
    point += robot.positions();
  }
}

template <class Model>
void place_points(const Robot& robot, std::span<const Position<Model::kSpace>> nodes,
                  std::span<const typename Model::Frame> frames, std::vector<Position<Model::kSpace>>& points) {
  const int stride = robot.between + 1;
  for (int i = 0; i <= robot.segments; ++i) place_node<Model>(robot, nodes[i], frames[i], points.data() + i * stride);
  if (stride == 1) return;
  auto* point = points.data();
  for (std::size_t line = 0; line < robot.lines.size(); ++line, point += robot.positions())
    for (int i = 0; i < robot.segments; ++i)
      for (int k = 1; k < stride; ++k) {
        const auto &here = point[i * stride], &next = point[(i + 1) * stride];
        const double t = static_cast<double>(k) / stride;
        for (int c = 0; c < Model::kSpace; ++c) point[i * stride + k][c] = here[c] + t * (next[c] - here[c]);
      }
}

template <class Model>
void ContactProblem<Model>::place_all() const {
  if (!all_placed_) place_points<Model>(robot_, nodes_, frames(), points_);
  all_placed_ = true;
}

template <class Model>
void ContactProblem<Model>::update_broadphase(std::span<const Position> nodes, const std::vector<Position>& mounts) {
  std::copy(nodes.begin(), nodes.end(), origin_.begin());
  mount_origin_ = mounts;
  evaluated_ = false;
  for (std::size_t j = 0; j < obstacles_.size(); ++j) {
    clear_[j] = clearance(obstacles_[j], nodes) - reach_;
    if (mount_of_[j] >= 0) clear_[j] -= norm(mounts[mount_of_[j]]);
    if (is_moving()) clear_[j] -= motions_[j];
  }
}

template <class Model>
bool ContactProblem<Model>::out_of_reach(int obstacle, double motion) const {
  const int mount = mount_of_[obstacle];
  if (mount >= 0) motion += norm(minus(displacements_[mount], mount_origin_[mount]));
  return clear_[obstacle] > drift_ + motion;
}

// At a distance from an obstacle, skips the next nodes, which are too close to this one to be within reach.
template <class Model>
void ContactProblem<Model>::measure_gaps() {
  const int n = robot_.segments, stride = robot_.between + 1;
  const int points = robot_.points(), positions = robot_.positions();
  for (const int contact : near_) gaps_[contact] = std::numeric_limits<double>::infinity();
  near_.clear();
  double drift = 0;
  for (int i = 0; i <= n; ++i) {
    const Position motion = minus(nodes_[i], origin_[i]);
    drift = std::max(drift, dot(motion, motion));
  }
  drift_ = std::sqrt(drift);
  for (int j = 0; j < static_cast<int>(obstacles_.size()); ++j) {
    if (out_of_reach(j, 0)) continue;
    const Obstacle& obstacle = obstacles_[j];
    const Position moved = this->displacement(j);
    const int first = j * points;
    const std::size_t others = near_.size();
    for (int i = 0; i <= n; ++i) {
      const double distance = clearance_beyond(obstacle, minus(nodes_[i], moved), reach_);
      if (distance > 0) {
        i += static_cast<int>(std::min(distance / model_.segment_length(), static_cast<double>(n)));
        continue;
      }
      if (stride > 1)
        place_all();
      else
        place_node<Model>(robot_, nodes_[i], frames()[i], &points_[i]);
      for (int start = i * stride; start < points; start += positions)
        for (int k = start; k < start + (i < n ? stride : 1); ++k)
          if (obstacle.can_touch(k)) near_.push_back(first + k);
    }
    ccr::measure_gaps(obstacle, std::span<const Position>(points_), moved, std::span(near_).subspan(others), first,
                      gaps_.data());
  }
}

template <class Model>
void ContactProblem<Model>::measure_slacks_and_disks(const Command& command) requires(Model::kRod) {
  const auto add = [this](int contact, double gap) {
    gaps_[contact] = gap;
    near_.push_back(contact);
  };
  for (int k = 0; k < model_.cables().count(); ++k)
    if (!keeps_tensions_ || !keeps_tension(k)) add(slack_contact(k), model_.cables().slack(k, command.cables[k]));
  const double close = tolerances::kDisksClose * (model_.segment_length() - robot_.disk_thickness) / robot_.disk_radius;
  if (model_.widest <= close) return;
  for (int i = 0; i < robot_.segments; ++i) {
    if (std::abs(model_.bend(i)) <= close) continue;
    const int contact = first_disk_contact() + Model::kDiskSides * i + model_.disk_side(i);
    add(contact, disk_gap(contact).value);
  }
}

template <class Model>
void ContactProblem<Model>::all_gaps(double* gaps) const {
  for (std::size_t j = 0; j < obstacles_.size(); ++j) {
    ccr::measure_gaps(obstacles_[j], std::span<const Position>(points()), displacement(static_cast<int>(j)), gaps);
    for (std::size_t k = 0; k < points_.size() && !obstacles_[j].everywhere; ++k)
      if (!obstacles_[j].touchable[k]) gaps[k] = std::numeric_limits<double>::infinity();
    gaps += points_.size();
  }
}

#define CCR_INSTANTIATE(Model)                                                                                     \
  template void place_points<Model>(const Robot&, std::span<const Position<Model::kSpace>>,                        \
                                    std::span<const Model::Frame>, std::vector<Position<Model::kSpace>>&);         \
  template void ContactProblem<Model>::update_broadphase(std::span<const Position>, const std::vector<Position>&); \
  template bool ContactProblem<Model>::out_of_reach(int, double) const;                                            \
  template void ContactProblem<Model>::measure_gaps();                                                             \
  template void ContactProblem<Model>::place_all() const;                                                          \
  template void ContactProblem<Model>::all_gaps(double*) const;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

template void ContactProblem<PlanarRod>::measure_slacks_and_disks(const Command&);
template void ContactProblem<SpatialRod>::measure_slacks_and_disks(const Command&);

}  // namespace ccr
