#include "model/law_slopes.hpp"

#include <cmath>

// The generated laws, inlined here.
#define CASADI_SYMBOL_EXPORT static inline
#include "slope_laws.c"

namespace ccr {

PaperInputs paper_inputs(double sine, double pull, double length, double offset) {
  PaperInputs slopes;
  const double* in[] = {&sine, &pull, &length, &offset};
  double* out[] = {slopes.angle};
  ccr_segment_inputs(in, out, nullptr, nullptr, 0);
  return slopes;
}

PaperPull paper_pull(double sine, double pull, double length, double offset) {
  PaperPull slopes;
  const double* in[] = {&sine, &pull, &length, &offset};
  double* out[] = {&slopes.angle};
  ccr_segment_pull(in, out, nullptr, nullptr, 0);
  return slopes;
}

SpatialInputs spatial_inputs(const SegmentInputs& inputs, const double* control, const double* bending,
                             const Vec<3>& force, const Vec<3>& moment) {
  SpatialInputs slopes;
  const double* in[] = {control,      bending,        inputs.displacements, &inputs.length,
                        inputs.holes, force.v.data(), moment.v.data()};
  double* out[] = {slopes.chord.v.data()};
  ccr_input_contraction(in, out, nullptr, nullptr, 0);
  return slopes;
}

LengthSlope<Vec<3>> cable_length_slope(const double* control, const double* hole, const double* shared) {
  LengthSlope<Vec<3>> slopes;
  const double* in[] = {control, hole, shared};
  double* out[] = {&slopes.value};
  ccr_spatial_cable_length(in, out, nullptr, nullptr, 0);
  return slopes;
}

LengthSlope<double> disk_length_slope(double angle) {
  LengthSlope<double> slopes;
  const double* in[] = {&angle};
  double* out[] = {&slopes.value};
  ccr_disk_gap_length(in, out, nullptr, nullptr, 0);
  return slopes;
}

namespace {

using Growth = int (*)(const double** in, double** out, int*, double*, int);

// The law of a shape's growth; null where the gap of every point falls by as much as the shape grows.
Growth growth_law(Shape shape) {
  switch (shape) {
    case Shape::kCircle: return ccr_circle_growth;
    case Shape::kEllipse: return ccr_ellipse_growth;
    case Shape::kCapsule: return ccr_capsule_growth;
    case Shape::kSphere: return ccr_sphere_growth;
    case Shape::kSpatialCapsule: return ccr_spatial_capsule_growth;
    default: return nullptr;
  }
}

}  // namespace

template <int D>
GapRate<D> growth_slope(const Obstacle<D>& obstacle, const Position<D>& point) {
  GapRate<D> slopes{-1, {}};
  if (const Growth law = growth_law(obstacle.shape)) {
    const double* in[] = {point.v.data(), obstacle.parameters.data()};
    double* out[] = {&slopes.value};
    law(in, out, nullptr, nullptr, 0);
  }
  return slopes;
}

template GapRate<2> growth_slope(const Obstacle<2>&, const Position<2>&);
template GapRate<3> growth_slope(const Obstacle<3>&, const Position<3>&);

}  // namespace ccr
