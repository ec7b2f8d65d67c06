// Whether the robot passed through an obstacle on the straight ways from the last accepted shape to the trial shape.
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"
#include "solve/sweep.hpp"

namespace ccr {

// Bound on the motion of any point relative to any obstacle since the last accepted shape [mm].
template <class Model>
double ModelContinuation<Model>::largest_motion() const {
  double of_points = 0, of_mounts = 0;  // squared
  const std::vector<Position>& points = problem_.points();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Position move = minus(points[k], points_[k]);
    of_points = std::max(of_points, dot(move, move));
  }
  for (std::size_t m = 0; m < trial_.mounts.size(); ++m) {
    const Position move = minus(trial_.mounts[m], mounts_[m]);
    of_mounts = std::max(of_mounts, dot(move, move));
  }
  return std::sqrt(of_points) + std::sqrt(of_mounts) +
         problem_.obstacle_motion(present_.command.scene, trial_.command.scene);
}

template <class Model>
bool ModelContinuation<Model>::passage_is_clear(double moved) const {
  const std::vector<double>& edges = problem_.robot().edges;
  const double longest = *std::max_element(edges.begin(), edges.end());
  for (int j = 0; j < static_cast<int>(problem_.obstacles().size()); ++j) {
    const auto& obstacle = problem_.obstacles()[j];
    if (problem_.out_of_reach(j, moved)) continue;
    if (moved <= harmless_path(obstacle) && moved <= harmless_motion(obstacle, longest)) continue;
    if (!passage_is_clear(j, moved)) return false;
  }
  return true;
}

// Sweeps the points and edges of the robot past one obstacle, in its frame where it is now.
template <class Model>
bool ModelContinuation<Model>::passage_is_clear(int j, double moved) const {
  const Robot& robot = problem_.robot();
  const auto& obstacle = problem_.obstacles()[j];
  const double* gaps = problem_.gaps().data() + j * points_.size();
  const int mount = problem_.mount_of(j);
  const Position now = mount < 0 ? Position{} : trial_.mounts[mount];
  Position before = mount < 0 ? Position{} : mounts_[mount];
  before += problem_.displacement(j, trial_.command.scene, present_.command.scene);
  const double path = harmless_path(obstacle);
  const std::vector<Position>& points = problem_.points();
  const auto from = [&](int k) { return minus(points_[k], before); };
  const auto to = [&](int k) { return minus(points[k], now); };
  for (int line = 0, first = 0; line < static_cast<int>(robot.lines.size()); ++line, first += robot.positions()) {
    const double longest = robot.edges[line];
    const bool edges = moved > harmless_motion(obstacle, longest);
    bool close = false, was_close;  // on a part of its way, this point and the one before
    for (int k = first; k < first + robot.positions(); ++k) {
      was_close = std::exchange(close, false);
      if (std::isfinite(gaps[k])) {
        close = distance_outside(obstacle, gaps[k]) < moved;
      } else if (const double distance = clearance_beyond(obstacle, to(k), moved); distance > 0) {
        // A gap out of reach is not measured. The next points are too close to this one to be within reach.
        if (!was_close) {
          k += static_cast<int>(std::min(distance / longest, static_cast<double>(robot.positions())));
          continue;
        }
      } else {
        close = true;
      }
      if (!obstacle.can_touch(k)) continue;
      if (close && norm(minus(to(k), from(k))) > path && !path_clear(obstacle, from(k), to(k))) return false;
      if (!edges || k == first || !obstacle.can_touch(k - 1) || !(close || was_close)) continue;
      if (!edge_clear<kSpace>(obstacle, {from(k - 1), from(k)}, {to(k - 1), to(k)}, longest / 2)) return false;
    }
  }
  return true;
}

#define CCR_INSTANTIATE(Model)                                      \
  template double ModelContinuation<Model>::largest_motion() const; \
  template bool ModelContinuation<Model>::passage_is_clear(double) const;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
