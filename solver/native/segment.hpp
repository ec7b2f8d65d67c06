// The generated law of a segment, for all segments of a robot.
#pragma once

namespace ccr {

struct Bend {
  double angle, slope, curvature, pull_slope;        // θ, θ_σ, θ_σσ, θ_pull
  double forward, sideways;                          // cos ζ, sin ζ of the backbone segment from the lower disk's y axis
  double heading_slope, heading_curvature;           // ζ_σ, ζ_σσ
  double cosine, sine;                               // of θ
  double dx, dy;                                     // backbone segment in the base frame
};

// Fills all but dx and dy of n segments from the sines of their shear angles; NaN where the law has no value.
void bend_segments(int n, const double* shear_sines, double pull, double length, double offset, Bend* bends);

}  // namespace ccr
