// Derivatives of the laws in what parameters of an equilibrium change: the inputs of a segment, and the growth of an
// obstacle. A step does not need them.
#pragma once

#include <array>
#include <vector>

#include "math/linalg.hpp"
#include "model/obstacle.hpp"
#include "model/robot.hpp"
#include "model/segment.hpp"

namespace ccr {

// What a segment does while an input of its law changes: a cable's displacement or the robot's length.
template <class Model>
struct InputSlope {
  typename Model::State upper;  // of its upper state, at fixed control and lower state
  typename Model::State lower;  // of the Lagrangian's slope in its lower state, and
  typename Model::Control own;  // in its control, at fixed force on the upper state
};

// The same of all segments and inputs: of the displacement of each cable of the paper's models, then of the length.
template <class Model>
struct InputSlopes {
  explicit InputSlopes(int segments) { segment.fill(std::vector<InputSlope<Model>>(segments)); }
  std::array<std::vector<InputSlope<Model>>, Model::kInputs> segment;
  Mat<Model::kInputs, Model::kInputs> curvature;  // of the Lagrangian in the inputs, at fixed controls and lower states
  Vec<kMaxCables> slack;                          // slopes of the slacks of a rod's taut cables in the length
};

// Slopes of the law `ccr_segment` in the pull and the length of a segment.
struct PaperInputs {
  double angle[2], slope[2];                          // of θ and of its slope in σ
  double pull_curvature, coupling, length_curvature;  // of θ: second derivatives in both
};
PaperInputs paper_inputs(double sine, double pull, double length, double offset);
// The same in the pull alone.
struct PaperPull {
  double angle, slope, curvature;
};
PaperPull paper_pull(double sine, double pull, double length, double offset);

// Slopes of the law of a segment in space in both pulls and the length; see `ccr_input_contraction`.
struct SpatialInputs {
  Vec<3> chord, turn;     // slopes in the length
  Mat<3, 3> mixed;        // second derivatives of the contraction in control and input, and
  double within[6] = {};  // in the inputs alone, the lower triangle
};
SpatialInputs spatial_inputs(const SegmentInputs& inputs, const double* control, const double* bending,
                             const Vec<3>& force, const Vec<3>& moment);

// Slopes in the length of a number and of its slope in the control of a segment.
template <class Control>
struct LengthSlope {
  double value;
  Control slope;
};
// Of the distance of a cable's holes, times the length, from the values that the laws of an arc share.
LengthSlope<Vec<3>> cable_length_slope(const double* control, const double* hole, const double* shared);
// Of the gap of two disks.
LengthSlope<double> disk_length_slope(double angle);

// Slopes of the gap of a point, and of its slope, while an obstacle grows outwards.
template <int D>
struct GapRate {
  double value;
  Position<D> slope;
};
template <int D>
GapRate<D> growth_slope(const Obstacle<D>& obstacle, const Position<D>& point);

}  // namespace ccr
