#include "solve/sweep.hpp"

#include <algorithm>
#include <cmath>

#include "tolerances.hpp"

namespace ccr {

using namespace tolerances;

namespace {

template <int D>
Position<D> lerp(const Position<D>& a, const Position<D>& b, double t) {
  Position<D> out = a;
  for (int k = 0; k < D; ++k) out[k] += t * (b[k] - a[k]);
  return out;
}

template <int D>
double distance(const Position<D>& a, const Position<D>& b) {
  return norm(minus(a, b));
}

// The gap of a ball about a point or a line is quadratic in the distance.
template <int D>
bool quadratic(const Obstacle<D>& obstacle) {
  return obstacle.shape == Shape::kCircle || obstacle.shape == Shape::kSphere || obstacle.shape == Shape::kCapsule ||
         obstacle.shape == Shape::kSpatialCapsule;
}

// Distance of a point from a closed polygon.
template <int D>
double nearest(const std::vector<Position<D>>& outline, const Position<D>& point) {
  const int count = static_cast<int>(outline.size());
  const double square = lowest(count, [&](int k) {
    const Position<D>& start = outline[k];
    const Position<D> along = minus(outline[k + 1 < count ? k + 1 : 0], start), offset = minus(point, start);
    const double length = dot(along, along);
    const double share = length > 0 ? std::clamp(dot(offset, along) / length, 0.0, 1.0) : 0.0;
    const Position<D> rest = minus(point, lerp(start, outline[k + 1 < count ? k + 1 : 0], share));
    return dot(rest, rest);
  });
  return std::sqrt(square);
}

// Returns the largest depth along an edge by bisection, or an upper bound that is at most `enough`. The depth is
// 1-Lipschitz, so it is bounded by half the sum of the depths of the ends and the length.
template <int D>
double deepest(const Obstacle<D>& obstacle, const Edge<D>& edge, double at_start, double at_end, double enough,
               int halvings) {
  const double bound = (at_start + at_end + distance(edge.start, edge.end)) / 2;
  if (bound <= enough || halvings == 0) return bound;
  const Position<D> middle = lerp(edge.start, edge.end, 0.5);
  const double at_middle = depth(obstacle, middle);
  const double first = deepest<D>(obstacle, {edge.start, middle}, at_start, at_middle, enough, halvings - 1);
  return std::max(first, deepest<D>(obstacle, {middle, edge.end}, at_middle, at_end, enough, halvings - 1));
}

}  // namespace

template <int D>
double depth(const Obstacle<D>& obstacle, const Position<D>& point) {
  double gap;
  measure_gaps(obstacle, std::span<const Position<D>>(&point, 1), Position<D>{}, &gap);
  if (!obstacle.outline.empty())  // a shape whose gap is not a distance
    return gap > 0 ? 0.0 : nearest(obstacle.outline, point);
  if (!quadratic(obstacle)) return -gap;
  const double radius = obstacle.min_curvature_radius;
  return radius - std::sqrt(std::max(0.0, radius * (radius + 2 * gap)));
}

template <int D>
double distance_outside(const Obstacle<D>& obstacle, double gap) {
  if (!obstacle.outline.empty()) return 0;
  if (!quadratic(obstacle) || std::isinf(gap)) return gap;
  const double radius = obstacle.min_curvature_radius;
  return std::sqrt(std::max(0.0, radius * (radius + 2 * gap))) - radius;
}

// Conservative advancement: strides by the depth that is left, but at least a quarter of the tolerance.
template <int D>
bool path_clear(const Obstacle<D>& obstacle, const Position<D>& from, const Position<D>& to) {
  const double length = distance(from, to), allowed = kSweepDepth * obstacle.inradius;
  double at = 0;
  for (int stride = 0; stride < kSweepStrides; ++stride) {
    const double left = allowed - depth(obstacle, lerp(from, to, at / length));
    if (!(left >= 0)) return false;
    at += std::max(left, allowed / 4);
    if (at >= length) return true;
  }
  return false;
}

template <int D>
bool edge_clear(const Obstacle<D>& obstacle, const Edge<D>& from, const Edge<D>& to, double half) {
  const double motion = std::max(distance(from.start, to.start), distance(from.end, to.end));
  if (motion == 0) return true;
  double at = 0;
  for (int stride = 0; stride < kSweepStrides; ++stride) {
    const double t = at / motion;
    const Edge<D> edge{lerp(from.start, to.start, t), lerp(from.end, to.end, t)};
    const double enough = half - std::min(motion - at, half / 8);
    const double left =
        half - deepest(obstacle, edge, depth(obstacle, edge.start), depth(obstacle, edge.end), enough, kEdgeHalvings);
    if (!(left > 0)) return false;
    at += left;
    if (at >= motion) return true;
  }
  return false;
}

// A path between points outside is nowhere deeper than half its length, and less deep where the surface is round.
template <int D>
double harmless_path(const Obstacle<D>& obstacle) {
  return std::max(kSweepStride * obstacle.min_curvature_radius, 2 * kSweepDepth * obstacle.inradius);
}

// A point of the core is closer than R - h/2 to the centre of a ball inside the obstacle, of the radius of curvature R.
// Edges with their ends outside that ball stay sqrt(R² - h²/4) away from its centre, and on paths of length m
// sqrt(R² - h²/4 - m²/4).
template <int D>
double harmless_motion(const Obstacle<D>& obstacle, double longest) {
  if (obstacle.wall()) return HUGE_VAL;
  return 2 * std::sqrt(longest * std::max(0.0, obstacle.min_curvature_radius - longest / 2));
}

#define CCR_INSTANTIATE(D)                                                              \
  template double depth(const Obstacle<D>&, const Position<D>&);                        \
  template double distance_outside(const Obstacle<D>&, double);                         \
  template bool path_clear(const Obstacle<D>&, const Position<D>&, const Position<D>&); \
  template bool edge_clear(const Obstacle<D>&, const Edge<D>&, const Edge<D>&, double); \
  template double harmless_path(const Obstacle<D>&);                                    \
  template double harmless_motion(const Obstacle<D>&, double);
CCR_INSTANTIATE(2)
CCR_INSTANTIATE(3)
#undef CCR_INSTANTIATE

}  // namespace ccr
