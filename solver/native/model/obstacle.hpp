// Obstacles and the generated laws of their gaps.
#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "math/rotations.hpp"

namespace ccr {

// Shapes of the plane, then of space, then those whose gap law is compiled at run time.
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

// A gap law compiled at run time, from point and parameters to a Gap.
using Law = int (*)(const double** in, double** out, int*, double*, int);

inline constexpr int kShapeSize = 17;  // parameters of the largest shape

template <int D>
struct Obstacle {
  Shape shape;
  std::array<double, kShapeSize> parameters;  // in the order of the gap law
  Law law;                                    // of a custom shape
  Position<D> center;                         // of a ball that contains the obstacle [mm]
  double radius;                              // of that ball; infinite for a wall [mm]
  double min_curvature_radius;                // of the surface; infinite for a wall [mm]
  double inradius;                            // of the largest ball inside; infinite for a wall [mm]
  std::vector<Position<D>> outline;           // points of the surface, if the gap is not a distance [mm]
  std::vector<unsigned char> touchable;       // whether each point of the robot can touch it; may be none if all can
  bool everywhere;                            // whether all points can
  bool mounted;                               // on a spring; otherwise fixed
  Mat<D, D> spring;                           // stiffness of the spring [N/mm]

  bool can_touch(std::size_t point) const { return everywhere || touchable[point]; }
  bool wall() const { return shape == Shape::kHalfPlane || shape == Shape::kHalfSpace; }
};

// Signed distance of a point, scaled to unit gradient on the surface, and its derivatives in the point.
template <int D>
struct Gap {
  double value;
  Position<D> slope;
  std::array<double, (D * D + D) / 2> upper;  // upper triangle of the Hessian, row by row

  Mat<D, D> curvature(double scale) const {
    Mat<D, D> out;
    for (int r = 0, k = 0; r < D; ++r)
      for (int c = r; c < D; ++c, ++k) out(r, c) = out(c, r) = scale * upper[k];
    return out;
  }
};

template <int D>
Gap<D> measure_gap(const Obstacle<D>& obstacle, const Position<D>& point);

// Writes the gaps of several points, without derivatives, to an obstacle displaced by `moved`.
template <int D>
void measure_gaps(const Obstacle<D>& obstacle, std::span<const Position<D>> points, const Position<D>& moved,
                  double* gaps);

// Writes those of some points as gaps[contact], where contact `first` is that of the first of all points.
template <int D>
void measure_gaps(const Obstacle<D>& obstacle, std::span<const Position<D>> points, const Position<D>& moved,
                  std::span<const int> contacts, int first, double* gaps);

// Returns a lower bound on the distance of the nearest point from the obstacle.
template <int D>
double clearance(const Obstacle<D>& obstacle, std::span<const Position<D>> points);

// Returns a lower bound on the distance of a point from the obstacle, less `reach`; at most 0 within reach.
template <int D>
double clearance_beyond(const Obstacle<D>& obstacle, const Position<D>& point, double reach) {
  if (obstacle.wall()) return clearance(obstacle, std::span(&point, 1)) - reach;
  const Position<D> offset = minus(point, obstacle.center);
  const double square = dot(offset, offset), within = obstacle.radius + reach;
  return square <= within * within ? 0.0 : std::sqrt(square) - within;
}

}  // namespace ccr
