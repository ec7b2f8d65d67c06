// A segment of the rod in space is an arc, its controls a rotation vector: its generated laws (solver/spatial/arc.py),
// evaluated for all segments of a robot at once.
#pragma once

#include <span>
#include <vector>

#include "math/linalg.hpp"
#include "math/rows.hpp"

namespace ccr {

// Outputs of the law, in the frame of the lower disk.
struct Arc {
  Vec<3> chord;
  Mat<3, 3> rotation, chord_slope, turn_slope;
};

// A cable through the first segments, and where the distance of its holes in the disks of each is written, with the
// slope in the controls. Both arrays have room for as many segments as Rows.
struct ArcCable {
  double hole[3];  // its two coordinates, and its distance from the backbone [mm]
  int end;         // number of segments
  double* distances;
  Vec<3>* slopes;
};

// A cable whose length enters the Lagrangian with a multiplier.
struct ArcPull {
  const ArcCable* cable;
  double multiplier;
};

struct ArcLaw {
  static constexpr int kControl = 3, kArc = 30, kShared = 11, kCable = 4, kAdjoint = 6, kHessian = 6;

  // Evaluates the law `ccr_spatial_arc` of n segments, and the values that the other laws take. Returns whether all
  // segments have the same controls.
  static bool bend(int n, double length, const Rows& controls, Arc* arcs, Rows& shared);

  // Evaluates the law `ccr_spatial_cable` of each cable, along segments that are `alike` or not.
  static void measure(std::span<const ArcCable> cables, const Rows& controls, const Rows& shared, bool alike = false);

  // Contracts the second derivatives of n segments with their adjoints and the pulls of cables, by the laws
  // `ccr_spatial_arc_hessian` and `ccr_spatial_cable_hessian`. The rows are those of the lower triangle.
  static void hessian_contraction(int n, const Rows& controls, const Rows& shared, const Rows& adjoints,
                                  std::span<const ArcPull> pulls, Rows& hessians);
};

static_assert(sizeof(Arc) == ArcLaw::kArc * sizeof(double));

}  // namespace ccr
