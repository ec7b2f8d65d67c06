// The two models of a segment and its cable, with their generated laws for all segments of a robot.
#pragma once

namespace ccr {

// The cable is shared equally among the segments (the paper). A segment shears: its coordinate is σ, the sine of the
// shear angle, and its backbone stays straight.
struct UniformCable {
  static constexpr int kState = 3;  // x, y, disk angle
  static constexpr bool kSliding = false;

  struct Bend {
    double angle, slope, curvature, pull_slope;   // θ, θ_σ, θ_σσ, θ_pull
    double forward, sideways;                     // backbone segment from the lower disk's y axis, over its length
    double heading_slope, heading_curvature;      // of its direction
    double cosine, sine;                          // of θ
    double dx, dy;                                // backbone segment in the base frame
  };

  // Fills all but dx and dy of n segments; NaN where the law has no value.
  static void bend(int n, const double* sines, double pull, double length, double offset, Bend* bends);
};

// The cable slides through all disks (Rao 2024). A segment is an arc, its coordinate the angle θ between its disks; what
// the segments take from the cable is summed up in the state, and may not be less than is pulled.
struct SlidingCable {
  static constexpr int kState = 4;  // x, y, disk angle, cable taken
  static constexpr bool kSliding = true;

  struct Bend {
    double angle;                                 // θ
    double forward, sideways;                     // chord from the lower disk's y axis, over the segment's length
    double stretch, stretch_slope;                // c'/c and c''/c of its length
    double cosine, sine;                          // of θ
    double taken, taken_slope, taken_curvature;   // from the cable
    double dx, dy;                                // chord in the base frame
    static constexpr double slope = 1, curvature = 0, heading_slope = -0.5, heading_curvature = 0;
  };

  static void bend(int n, const double* angles, double pull, double length, double offset, Bend* bends);
};

}  // namespace ccr
