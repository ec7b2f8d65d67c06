#include "model/obstacle.hpp"

#include <algorithm>
#include <cmath>

#include "tolerances.hpp"

// The generated gap laws, inlined here.
#define CASADI_SYMBOL_EXPORT static inline
#include "gap_laws.c"

namespace ccr {

namespace {

// Calls `function` with two laws of the shape, the gap with derivatives and the gap alone, so that the choice is made
// once for many points.
template <class Function>
void with_law(const Obstacle<2>& obstacle, Function function) {
  switch (obstacle.shape) {
    case Shape::kCircle: return function(ccr_circle_gap, ccr_circle_clearance);
    case Shape::kHalfPlane: return function(ccr_half_plane_gap, ccr_half_plane_clearance);
    case Shape::kEllipse: return function(ccr_ellipse_gap, ccr_ellipse_clearance);
    case Shape::kCapsule: return function(ccr_capsule_gap, ccr_capsule_clearance);
    case Shape::kPolygon: return function(ccr_polygon_gap, ccr_polygon_clearance);
    default: return function(obstacle.law, obstacle.law);
  }
}

template <class Function>
void with_law(const Obstacle<3>& obstacle, Function function) {
  switch (obstacle.shape) {
    case Shape::kSphere: return function(ccr_sphere_gap, ccr_sphere_clearance);
    case Shape::kHalfSpace: return function(ccr_half_space_gap, ccr_half_space_clearance);
    case Shape::kSpatialCapsule: return function(ccr_spatial_capsule_gap, ccr_spatial_capsule_clearance);
    case Shape::kCylinder: return function(ccr_cylinder_gap, ccr_cylinder_clearance);
    case Shape::kBox: return function(ccr_box_gap, ccr_box_clearance);
    default: return function(obstacle.law, obstacle.law);
  }
}

template <int D, class Law>
Gap<D> evaluate(Law law, const Obstacle<D>& obstacle, const Position<D>& point) {
  Gap<D> gap;
  const double* in[] = {point.v.data(), obstacle.parameters.data()};
  double* out[] = {&gap.value};
  law(in, out, nullptr, nullptr, 0);
  return gap;
}

}  // namespace

template <int D>
Gap<D> measure_gap(const Obstacle<D>& obstacle, const Position<D>& point) {
  Gap<D> gap;
  with_law(obstacle, [&](auto law, auto) { gap = evaluate(law, obstacle, point); });
  return gap;
}

template <int D>
void measure_gaps(const Obstacle<D>& obstacle, std::span<const Position<D>> points, const Position<D>& moved,
                  double* gaps) {
  with_law(obstacle, [&](auto, auto law) {
    for (std::size_t k = 0; k < points.size(); ++k) gaps[k] = evaluate(law, obstacle, minus(points[k], moved)).value;
  });
}

template <int D>
void measure_gaps(const Obstacle<D>& obstacle, std::span<const Position<D>> points, const Position<D>& moved,
                  std::span<const int> contacts, int first, double* gaps) {
  with_law(obstacle, [&](auto, auto law) {
    for (const int contact : contacts)
      gaps[contact] = evaluate(law, obstacle, minus(points[contact - first], moved)).value;
  });
}

template <int D>
double clearance(const Obstacle<D>& obstacle, std::span<const Position<D>> points) {
  const int count = static_cast<int>(points.size());
  if (obstacle.wall()) {
    Position<D> normal;
    std::copy_n(obstacle.parameters.begin(), D, normal.v.begin());
    return lowest(count, [&](int k) { return dot(normal, points[k]); }) - obstacle.parameters[D];
  }
  const double square = lowest(count, [&](int k) {
    const Position<D> offset = minus(points[k], obstacle.center);
    return dot(offset, offset);
  });
  return std::sqrt(square) - obstacle.radius;
}

#define CCR_INSTANTIATE(D)                                                                                   \
  template void measure_gaps(const Obstacle<D>&, std::span<const Position<D>>, const Position<D>&,           \
                             std::span<const int>, int, double*);                                            \
  template Gap<D> measure_gap(const Obstacle<D>&, const Position<D>&);                                       \
  template void measure_gaps(const Obstacle<D>&, std::span<const Position<D>>, const Position<D>&, double*); \
  template double clearance(const Obstacle<D>&, std::span<const Position<D>>);
CCR_INSTANTIATE(2)
CCR_INSTANTIATE(3)
#undef CCR_INSTANTIATE

}  // namespace ccr
