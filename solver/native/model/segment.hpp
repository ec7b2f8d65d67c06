// Models of a segment and its cables: their generated laws, evaluated for all segments of a robot at once.
#pragma once

#include <utility>

#include "math/rows.hpp"

namespace ccr {

// Bends of all segments in the plane: the outputs of the law, then the chord in the base frame.
template <class Bend>
class Table : public Rows {
 public:
  static constexpr int kLaws = sizeof(Bend) / sizeof(double) - 2;

  explicit Table(int segments) : Rows(kLaws + 2, segments) {}

  Bend operator[](int i) const {
    return [&]<int... kNumber>(std::integer_sequence<int, kNumber...>) {
      return Bend{at(kNumber, i)...};
    }(std::make_integer_sequence<int, kLaws + 2>{});
  }
  void set_chord(int segment, double dx, double dy) {
    row(kLaws)[segment] = dx;
    row(kLaws + 1)[segment] = dy;
  }
};

// The paper's model: each segment takes an equal share of the cable. Its coordinate is σ, the sine of the shear angle;
// its backbone stays straight.
struct PaperLaw {
  static constexpr bool kRod = false;

  struct Bend {
    double angle, slope, curvature, displacement_slope;  // θ and its derivatives in σ, σσ and the displacement
    double forward, sideways;                 // chord along and across the lower disk's y axis, over its length
    double heading_slope, heading_curvature;  // derivatives of its direction in σ
    double cosine, sine;                      // of θ
    double dx, dy;                            // chord in the base frame
  };

  using Bends = Table<Bend>;

  // Fills all but dx and dy of n segments; NaN where the law is undefined.
  static void bend(int n, const double* sines, double displacement, double length, double offset, Bends& bends);
};

// The rod in the plane (Rao 2024): cables slide through all disks. A segment is an arc, its coordinate the angle θ
// between its disks. What the segments take up from a cable together must not be less than its displacement.
struct RodLaw {
  static constexpr bool kRod = true;

  struct Bend {
    double angle;                                   // θ
    double forward, sideways;                       // chord along and across the lower disk's y axis, over its length
    double stretch, stretch_slope;                  // c'/c and c''/c of the length c of the chord
    double cosine, sine;                            // of θ
    double half_cosine, half_sine;                  // of θ/2
    double short_by, short_slope, short_curvature;  // by how much the chord is shorter than the segment [mm]
    double dx, dy;                                  // chord in the base frame
    static constexpr double slope = 1, curvature = 0, heading_slope = -0.5, heading_curvature = 0;
  };

  using Bends = Table<Bend>;

  // Cable at a distance towards +x that a segment takes up, with its derivatives in the angle.
  struct Taken {
    double value, slope, curvature;
  };
  static Taken taken(const Bend& bend, double distance) {
    return {bend.short_by + 2 * distance * bend.half_sine, bend.short_slope + distance * bend.half_cosine,
            bend.short_curvature - distance * bend.half_sine / 2};
  }

  static void bend(int n, const double* angles, double displacement, double length, double offset, Bends& bends);
};

// Inputs of the law of a segment in space, the same for all segments.
struct SegmentInputs {
  double displacements[2];  // of each cable, the share of a segment [mm]
  double length;            // of the backbone of a segment [mm]
  double holes[4];          // where the pulled cables pass the disk: x, y of each [mm]
};

// The paper's model in space (eq. 13): each segment takes an equal share of both cables. Its controls are two shears
// and the twist; the lengths of the cables determine its bending.
struct SpatialLaw {
  static constexpr int kControl = 3, kBending = 2, kBend = 48, kAdjoint = 6, kHessian = 9;

  // Finds the bendings of n segments and evaluates the law `ccr_bend`; false where a cable cannot have its length.
  static bool bend(int n, const SegmentInputs& inputs, const Rows& controls, Rows& bendings, Rows& bends);

  // Contracts the second derivatives of n segments with their adjoints, by the law `ccr_hessian_contraction`.
  static void hessian_contraction(int n, const SegmentInputs& inputs, const Rows& controls, const Rows& bendings,
                                  const Rows& adjoints, Rows& hessians);
};

}  // namespace ccr
