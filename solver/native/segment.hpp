// The two models of a segment and its cable, with their generated laws for all segments of a robot.
#pragma once

#include <vector>

namespace ccr {

// Bends of all segments, kept number by number so that the laws can write them several segments at a time: what the laws
// give, then the chord in the base frame.
template <class Bend>
class Table {
 public:
  static constexpr int kLaws = 10;

  explicit Table(int segments)
      : stride_((segments + kPadding - 1) / kPadding * kPadding), values_((kLaws + 2) * stride_) {}

  Bend operator[](int i) const {
    return {at(0, i), at(1, i), at(2, i), at(3, i), at(4, i), at(5, i),
            at(6, i), at(7, i), at(8, i), at(9, i), at(10, i), at(11, i)};
  }
  double* row(int number) { return values_.data() + number * stride_; }
  void place(int segment, double dx, double dy) {
    row(kLaws)[segment] = dx;
    row(kLaws + 1)[segment] = dy;
  }

 private:
  static constexpr int kPadding = 4;  // at least the width of the lanes

  double at(int number, int segment) const { return values_[number * stride_ + segment]; }

  int stride_;
  std::vector<double> values_;
};

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

  using Bends = Table<Bend>;

  // Fills all but dx and dy of n segments; NaN where the law has no value.
  static void bend(int n, const double* sines, double pull, double length, double offset, Bends& bends);
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

  using Bends = Table<Bend>;

  static void bend(int n, const double* angles, double pull, double length, double offset, Bends& bends);
};

}  // namespace ccr
