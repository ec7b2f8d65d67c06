// Signed distances of points from obstacles, negative inside, from geometry alone, independent of the gap laws.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "robots.hpp"

namespace ccr::testing {

template <int D>
double from_line(const Position<D>& point, const Position<D>& start, const Position<D>& end) {
  const Position<D> axis = minus(end, start), offset = minus(point, start);
  const double part = std::clamp(dot(offset, axis) / std::max(dot(axis, axis), 1e-300), 0.0, 1.0);
  Position<D> nearest = start;
  for (int k = 0; k < D; ++k) nearest[k] += part * axis[k];
  return norm(minus(point, nearest));
}

// Distance from a product of convex sets in orthogonal directions, given the excess over each.
template <int N>
double beyond(const std::array<double, N>& excess) {
  double square = 0, deepest = -kInfinity;
  for (const double one : excess) {
    square += std::max(one, 0.0) * std::max(one, 0.0);
    deepest = std::max(deepest, one);
  }
  return deepest > 0 ? std::sqrt(square) : deepest;
}

inline double polygon_distance(const double* p, const Position<2>& point) {
  constexpr int kCorners = (kShapeSize - 1) / 2;
  double nearest = kInfinity;
  bool inside = true;
  for (int k = 0; k < kCorners; ++k) {
    const Position<2> start = position<2>(p + 1 + 2 * k), end = position<2>(p + 1 + 2 * ((k + 1) % kCorners));
    const Position<2> along = minus(end, start), offset = minus(point, start);
    nearest = std::min(nearest, from_line(point, start, end));
    inside = inside && along[0] * offset[1] - along[1] * offset[0] >= 0;
  }
  return (inside ? -nearest : nearest) - p[0];
}

inline double ellipse_distance(const double* p, const Position<2>& point) {
  const Position<2> offset = minus(point, position<2>(p));
  const double along = offset[0] * p[4] + offset[1] * p[5], across = offset[1] * p[4] - offset[0] * p[5];
  const auto distance = [&](double angle) {
    return std::hypot(p[2] * std::cos(angle) - along, p[3] * std::sin(angle) - across);
  };
  constexpr int kParts = 72;
  int best = 0;
  double nearest = distance(0);
  for (int k = 1; k < kParts; ++k)
    if (const double found = distance(2 * std::numbers::pi * k / kParts); found < nearest) {
      nearest = found;
      best = k;
    }
  double low = 2 * std::numbers::pi * (best - 1) / kParts, high = 2 * std::numbers::pi * (best + 1) / kParts;
  for (int i = 0; i < 40; ++i) {
    const double first = low + (high - low) / 3, second = high - (high - low) / 3;
    if (distance(first) < distance(second))
      high = second;
    else
      low = first;
  }
  const bool inside = along * along / (p[2] * p[2]) + across * across / (p[3] * p[3]) < 1;
  return inside ? -distance(low) : distance(low);
}

template <int D>
double wall_distance(const double* p, const Position<D>& point) {
  return dot(position<D>(p), point) - p[D];
}

inline double signed_distance(const Obstacle<2>& obstacle, const Position<2>& point) {
  const double* p = obstacle.parameters.data();
  switch (obstacle.shape) {
    case Shape::kHalfPlane: return wall_distance(p, point);
    case Shape::kEllipse: return ellipse_distance(p, point);
    case Shape::kCapsule: return from_line(point, position<2>(p), position<2>(p + 2)) - p[4];
    case Shape::kPolygon: return polygon_distance(p, point);
    default: return norm(minus(point, position<2>(p))) - p[2];  // a circle, compiled or not
  }
}

inline double signed_distance(const Obstacle<3>& obstacle, const Position<3>& point) {
  const double* p = obstacle.parameters.data();
  const Position<3> offset = minus(point, position<3>(p));
  switch (obstacle.shape) {
    case Shape::kHalfSpace: return wall_distance(p, point);
    case Shape::kSpatialCapsule: return from_line(point, position<3>(p), position<3>(p + 3)) - p[6];
    case Shape::kCylinder: {
      const double along = dot(offset, position<3>(p + 3)), across = norm(cross(offset, position<3>(p + 3)));
      return beyond<2>({across - p[6], std::abs(along) - p[7]}) - p[8];
    }
    case Shape::kBox: {
      std::array<double, 3> excess;
      for (int k = 0; k < 3; ++k) excess[k] = std::abs(dot(offset, position<3>(p + 3 + 3 * k))) - p[12 + k];
      return beyond<3>(excess) - p[15];
    }
    default: return norm(offset) - p[3];  // a sphere
  }
}

}  // namespace ccr::testing
