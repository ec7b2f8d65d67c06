// Robots and obstacles for the tests, the fuzz and the benchmarks' replay. Their fields are filled in here only, as
// kernel_robot and solver/common/kernel_input.py do for Python.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "model/obstacle.hpp"
#include "model/robot.hpp"
#include "solve/sweep.hpp"

namespace ccr::testing {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kQuarterTurn = 1.5707963267948966;

// The numbers that describe a robot, by default the paper's prototype.
struct RobotNumbers {
  bool rod = false;
  int segments = 18;
  double length = 180, offset = 8, rigidity = 5000, max_tension = 15;
  double angle = kQuarterTurn;       // between the cables, in the paper's model of space
  std::vector<double> cables = {0};  // angles of a rod's
  int between = 0;
};

// Longest distance of neighbouring nodes of a line: of the rod beside an arc whose disks meet, of the paper's model by
// about as much as the disks of a segment can turn.
inline double longest_edge(const RobotNumbers& of, const Vec<2>& line) {
  const double segment = of.length / of.segments, widest = segment / of.offset;
  if (!of.rod) return segment + norm(line) * 0.4;
  double longest = 0;
  for (int k = 1; k <= 64; ++k) {
    const double angle = widest * k / 64;
    longest = std::max(longest, 2 * (segment / angle + norm(line)) * std::sin(angle / 2));
  }
  return longest;
}

// An even rod with cables to its tip.
inline Rod make_rod(const RobotNumbers& of) {
  const std::size_t numbers = 3 * static_cast<std::size_t>(of.segments);  // in the plane a third of them serves
  Rod rod{
      .cables = {}, .stiffness = std::vector<double>(numbers, 1), .rest = std::vector<double>(numbers, 0), .loads = {}};
  for (const double angle : of.cables)
    rod.cables.push_back({{{of.offset * std::cos(angle), of.offset * std::sin(angle)}}, of.segments});
  rod.least_pull = of.cables.size() == 1 ? 0 : -kInfinity;
  return rod;
}

// A robot with these lines of points that can touch, each a position on the disks.
inline Robot make_robot(const RobotNumbers& of, std::vector<Vec<2>> lines) {
  std::vector<double> edges;
  for (const Vec<2>& line : lines) edges.push_back(longest_edge(of, line) / (of.between + 1));
  return {.model = of.rod ? ModelKind::kPlanarRod : ModelKind::kPlanarPaper,
          .segments = of.segments,
          .offset = of.offset,
          .angle = of.angle,
          .rigidity = of.rigidity,
          .max_tension = of.max_tension,
          .max_length = of.length,
          .disk_radius = of.offset,
          .disk_thickness = 0,
          .lines = std::move(lines),
          .edges = std::move(edges),
          .between = of.between,
          .rod = of.rod ? make_rod(of) : Rod{}};
}

// Lines on backbone and cable in the plane; in space on the backbone and through the holes of the cables, in the
// paper's model of both and opposite them.
template <int D>
Robot make_robot(const RobotNumbers& of) {
  const double a = of.offset, x = a * std::cos(of.angle), y = a * std::sin(of.angle);
  if (D == 2) return make_robot(of, {{{0, 0}}, {{a, 0}}});
  std::vector<Vec<2>> lines{{{0, 0}}, {{a, 0}}, {{x, y}}, {{-a, 0}}, {{-x, -y}}};
  if (of.rod) {
    lines.resize(1);
    for (const double angle : of.cables) lines.push_back({{a * std::cos(angle), a * std::sin(angle)}});
  }
  Robot robot = make_robot(of, std::move(lines));
  robot.model = of.rod ? ModelKind::kSpatialRod : ModelKind::kSpatialPaper;
  for (std::size_t k = 2; k < robot.rod.stiffness.size(); k += 3) robot.rod.stiffness[k] = 0.77;  // GJ over EI
  return robot;
}

template <int D>
Position<D> position(const double* numbers) {
  Position<D> out;
  std::copy_n(numbers, D, out.v.begin());
  return out;
}

template <int D>
Position<D> middle(const Position<D>& a, const Position<D>& b) {
  Position<D> out;
  for (int k = 0; k < D; ++k) out[k] = (a[k] + b[k]) / 2;
  return out;
}

// A ball that contains a shape, and the smallest radius of curvature of its surface.
template <int D>
struct Extent {
  Position<D> center;
  double radius, min_curvature_radius;
};

template <int D>
Extent<D> wall_extent(const double* p) {
  Position<D> on_surface = position<D>(p);
  for (double& part : on_surface.v) part *= p[D];
  return {on_surface, kInfinity, kInfinity};
}

template <int D>
Extent<D> capsule_extent(const double* p) {
  const Position<D> start = position<D>(p), end = position<D>(p + D);
  return {middle(start, end), norm(minus(end, start)) / 2 + p[2 * D], p[2 * D]};
}

inline Extent<2> polygon_extent(const double* p) {
  constexpr int kCorners = (kShapeSize - 1) / 2;
  Position<2> center;
  for (int k = 0; k < kCorners; ++k)
    for (int c = 0; c < 2; ++c) center[c] += p[1 + 2 * k + c] / kCorners;
  double farthest = 0;
  for (int k = 0; k < kCorners; ++k) farthest = std::max(farthest, norm(minus(position<2>(p + 1 + 2 * k), center)));
  return {center, farthest + p[0], p[0]};
}

inline Extent<2> extent_of(Shape shape, const double* p, Position<2>) {
  switch (shape) {
    case Shape::kCircle: return {position<2>(p), p[2], p[2]};
    case Shape::kHalfPlane: return wall_extent<2>(p);
    case Shape::kCapsule: return capsule_extent<2>(p);
    case Shape::kPolygon: return polygon_extent(p);
    default: {  // an ellipse
      const double large = std::max(p[2], p[3]), small = std::min(p[2], p[3]);
      return {position<2>(p), large, small * small / large};
    }
  }
}

inline Extent<3> extent_of(Shape shape, const double* p, Position<3>) {
  switch (shape) {
    case Shape::kSphere: return {position<3>(p), p[3], p[3]};
    case Shape::kHalfSpace: return wall_extent<3>(p);
    case Shape::kSpatialCapsule: return capsule_extent<3>(p);
    case Shape::kCylinder: return {position<3>(p), std::hypot(p[6] + p[8], p[7] + p[8]), p[8]};
    default: return {position<3>(p), std::hypot(p[12] + p[15], p[13] + p[15], p[14] + p[15]), p[15]};  // a box
  }
}

// Points of an ellipse, whose gap is not a distance.
inline std::vector<Position<2>> ellipse_outline(const double* p) {
  std::vector<Position<2>> outline;
  for (int k = 0; k < 96; ++k) {
    const double along = p[2] * std::cos(k * kQuarterTurn / 24), across = p[3] * std::sin(k * kQuarterTurn / 24);
    outline.push_back({{p[0] + along * p[4] - across * p[5], p[1] + along * p[5] + across * p[4]}});
  }
  return outline;
}

// An obstacle that all points of a robot can touch, from the parameters of its gap law. Mounted where the stiffness
// `spring` is positive [N/mm].
template <int D>
Obstacle<D> make_obstacle(const Robot& robot, Shape shape, std::span<const double> parameters, double spring = 0) {
  const Extent<D> extent = extent_of(shape, parameters.data(), Position<D>{});
  Obstacle<D> obstacle{};
  obstacle.shape = shape;
  std::copy(parameters.begin(), parameters.end(), obstacle.parameters.begin());
  obstacle.center = extent.center;
  obstacle.radius = extent.radius;
  obstacle.min_curvature_radius = extent.min_curvature_radius;
  if constexpr (D == 2)
    if (shape == Shape::kEllipse) obstacle.outline = ellipse_outline(parameters.data());
  obstacle.inradius = obstacle.wall() ? kInfinity : depth(obstacle, obstacle.center);
  obstacle.touchable.assign(robot.points(), 1);
  obstacle.everywhere = true;
  obstacle.mounted = spring > 0;
  for (int k = 0; k < D; ++k) obstacle.spring(k, k) = spring;
  return obstacle;
}

// The same obstacle for one point of the robot only.
template <int D>
Obstacle<D> for_point(Obstacle<D> obstacle, int point) {
  std::fill(obstacle.touchable.begin(), obstacle.touchable.end(), static_cast<unsigned char>(0));
  obstacle.touchable[point] = 1;
  obstacle.everywhere = false;
  return obstacle;
}

inline Obstacle<2> circle(const Robot& robot, double x, double y, double r, double spring = 0) {
  return make_obstacle<2>(robot, Shape::kCircle, std::array{x, y, r}, spring);
}

inline Obstacle<3> sphere(const Robot& robot, double x, double y, double z, double r, double spring = 0) {
  return make_obstacle<3>(robot, Shape::kSphere, std::array{x, y, z, r}, spring);
}

// A half-plane or half-space with an outward unit normal and an offset.
template <int D>
Obstacle<D> wall(const Robot& robot, const Position<D>& normal, double offset, double spring = 0) {
  std::array<double, D + 1> parameters;
  std::copy(normal.v.begin(), normal.v.end(), parameters.begin());
  parameters[D] = offset;
  return make_obstacle<D>(robot, D == 2 ? Shape::kHalfPlane : Shape::kHalfSpace, parameters, spring);
}

}  // namespace ccr::testing
