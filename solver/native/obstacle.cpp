#include "obstacle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "limits.hpp"

// The generated laws of the gaps, inlined here.
#define CASADI_SYMBOL_EXPORT static inline
#include "gap_laws.c"

namespace ccr {

namespace {

// Calls `function` with the law of the obstacle's shape, so that it is chosen once for many points.
template <class Function>
void with_law(const Obstacle& obstacle, Function function) {
  switch (obstacle.shape) {
    case Shape::kCircle: return function(ccr_circle_gap);
    case Shape::kHalfPlane: return function(ccr_half_plane_gap);
    case Shape::kEllipse: return function(ccr_ellipse_gap);
    case Shape::kCapsule: return function(ccr_capsule_gap);
    case Shape::kPolygon: return function(ccr_polygon_gap);
    case Shape::kCustom: return function(obstacle.law);
  }
}

template <class Law>
Gap evaluate(Law law, const Obstacle& obstacle, const Position& point) {
  Gap gap;
  const double* in[] = {point.v.data(), obstacle.parameters.data()};
  double* out[] = {&gap.value};
  law(in, out, nullptr, nullptr, 0);
  return gap;
}

}  // namespace

Gap measure_gap(const Obstacle& obstacle, const Position& point) {
  Gap gap;
  with_law(obstacle, [&](auto law) { gap = evaluate(law, obstacle, point); });
  return gap;
}

void measure_gaps(const Obstacle& obstacle, std::span<const Position> points, const Position& moved, double* gaps) {
  with_law(obstacle, [&](auto law) {
    for (std::size_t k = 0; k < points.size(); ++k) gaps[k] = evaluate(law, obstacle, minus(points[k], moved)).value;
  });
}

double clearance(const Obstacle& obstacle, const Position& point) {
  return clearance(obstacle, std::span(&point, 1));
}

double clearance(const Obstacle& obstacle, std::span<const Position> points) {
  const int count = static_cast<int>(points.size());
  if (obstacle.shape == Shape::kHalfPlane) {
    const Position normal = {{obstacle.parameters[0], obstacle.parameters[1]}};
    return lowest(count, [&](int k) { return dot(normal, points[k]); }) - obstacle.parameters[2];
  }
  const double square = lowest(count, [&](int k) {
    const Position offset = minus(points[k], obstacle.center);
    return dot(offset, offset);
  });
  return std::sqrt(square) - obstacle.radius;
}

bool passes(const Obstacle& obstacle, const Position& from, const Position& to) {
  const double dx = to[0] - from[0], dy = to[1] - from[1];
  const double length = std::sqrt(dx * dx + dy * dy);
  if (length <= limits::kSweepStride * obstacle.fineness || clearance(obstacle, from) > length) return true;
  const int pieces = static_cast<int>(std::ceil(length / (limits::kSweepStride * obstacle.fineness)));
  for (int k = 1; k < pieces; ++k) {
    const double t = static_cast<double>(k) / pieces;
    const Position between = {{from[0] + t * dx, from[1] + t * dy}};
    if (measure_gap(obstacle, between).value < -limits::kSweepDepth * obstacle.fineness) return false;
  }
  return true;
}

}  // namespace ccr
