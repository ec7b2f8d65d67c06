// Obstacles and the generated laws of their gaps.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "linalg.hpp"

namespace ccr {

using Position = Vec<2>;

enum class Shape { kCircle, kHalfPlane, kEllipse, kCapsule, kPolygon, kCustom };  // in the order of SHAPES

// A compiled gap law: (point, parameters) to a Gap.
using Law = int (*)(const double** in, double** out, int*, double*, int);

inline constexpr int kShapeSize = 17;  // numbers of the largest shape

struct Obstacle {
  Shape shape;
  std::array<double, kShapeSize> parameters;  // as the gap law takes them
  Law law;                               // of a custom shape
  Position center;                       // of a disc that holds it
  double radius;                         // of that disc; infinite for a half-plane
  double fineness;                       // smallest radius of its surface; infinite for a half-plane
  std::vector<unsigned char> touchable;  // (lines, positions): whether a point can touch it
  bool everywhere;                       // whether all of them can
  bool mounted;                          // on a spring; fixed otherwise
  Mat<2, 2> stiffness;                   // of its spring [N/mm]
};

struct Gap {
  double value, x, y, xx, xy, yy;  // and its derivatives in the point
};

Gap measure_gap(const Obstacle& obstacle, const Position& point);

// Gaps of several points to an obstacle that has moved, without their derivatives.
void measure_gaps(const Obstacle& obstacle, std::span<const Position> points, const Position& moved, double* gaps);

// A lower bound of the distance between a point, or the nearest of several, and the obstacle.
double clearance(const Obstacle& obstacle, const Position& point);
double clearance(const Obstacle& obstacle, std::span<const Position> points);

// How much farther than `reach` a point is at least, at most 0 when it is not.
inline double clearance_beyond(const Obstacle& obstacle, const Position& point, double reach) {
  if (obstacle.shape == Shape::kHalfPlane) return clearance(obstacle, point) - reach;
  const double dx = point[0] - obstacle.center[0], dy = point[1] - obstacle.center[1];
  const double square = dx * dx + dy * dy, within = obstacle.radius + reach;
  return square <= within * within ? 0.0 : std::sqrt(square) - within;
}

// Whether the straight path from one point outside to another stays out of the obstacle, but for its very rim.
bool passes(const Obstacle& obstacle, const Position& from, const Position& to);

}  // namespace ccr
