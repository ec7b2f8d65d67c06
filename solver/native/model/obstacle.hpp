// Obstacles and the generated laws of their gaps.
#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "math/rotations.hpp"

namespace ccr {

// Those of the plane, those of space, and compiled ones.
enum class Shape {
  kCircle,
  kHalfPlane,
  kEllipse,
  kCapsule,
  kPolygon,
  kSphere,
  kHalfSpace,
  kSpatialCapsule,
  kCylinder,
  kBox,
  kCustom
};

// A compiled gap law: (point, parameters) to a Gap.
using Law = int (*)(const double** in, double** out, int*, double*, int);

inline constexpr int kShapeSize = 17;  // numbers of the largest shape

template <int D>
struct Obstacle {
  Shape shape;
  std::array<double, kShapeSize> parameters;  // as the gap law takes them
  Law law;                                    // of a custom shape
  Position<D> center;                         // of a ball that holds it
  double radius;                              // of that ball; infinite for a wall
  double min_curvature_radius;                // smallest radius of its surface; infinite for a wall
  double inradius;                            // of the largest ball inside it; infinite for a wall
  std::vector<Position<D>> outline;           // points of its surface, where its gap is no distance; else none
  std::vector<unsigned char> touchable;       // (lines, positions): whether a point can touch it
  bool everywhere;                            // whether all of them can
  bool mounted;                               // on a spring; fixed otherwise
  Mat<D, D> spring;                           // of its spring [N/mm]

  bool wall() const { return shape == Shape::kHalfPlane || shape == Shape::kHalfSpace; }
};

// A gap and its derivatives in the point.
template <int D>
struct Gap {
  double value;
  Position<D> slope;
  std::array<double, (D * D + D) / 2> upper;  // of the symmetric second derivative, row by row

  Mat<D, D> curvature(double scale) const {
    Mat<D, D> out;
    for (int r = 0, k = 0; r < D; ++r)
      for (int c = r; c < D; ++c, ++k) out(r, c) = out(c, r) = scale * upper[k];
    return out;
  }
};

template <int D>
Gap<D> measure_gap(const Obstacle<D>& obstacle, const Position<D>& point);

// Gaps of several points to an obstacle that has moved, without their derivatives.
template <int D>
void measure_gaps(const Obstacle<D>& obstacle, std::span<const Position<D>> points, const Position<D>& moved,
                  double* gaps);

// A lower bound of the distance between the nearest of several points and the obstacle.
template <int D>
double clearance(const Obstacle<D>& obstacle, std::span<const Position<D>> points);

// How much farther than `reach` a point is at least, at most 0 when it is not.
template <int D>
double clearance_beyond(const Obstacle<D>& obstacle, const Position<D>& point, double reach) {
  if (obstacle.wall()) return clearance(obstacle, std::span(&point, 1)) - reach;
  const Position<D> offset = minus(point, obstacle.center);
  const double square = dot(offset, offset), within = obstacle.radius + reach;
  return square <= within * within ? 0.0 : std::sqrt(square) - within;
}

}  // namespace ccr
