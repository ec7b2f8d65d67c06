// The segment laws: their geometry, their derivatives, and that AVX2 gives the same bits.
#include <doctest/doctest.h>

#include <array>
#include <cstring>
#include <numbers>

#include "differences.hpp"
#include "math/rotations.hpp"
#include "model/segment.hpp"
#include "random.hpp"

namespace ccr {

#ifdef CCR_AVX2
#define CCR_DECLARE(REGISTERS)                                                                       \
  namespace REGISTERS {                                                                              \
  void bend(int, const double*, double, double, double, PaperLaw::Bends&);                           \
  void bend(int, const double*, double, RodLaw::Bends&);                                             \
  bool bend(int, const SegmentInputs&, const Rows&, Rows&, Rows&);                                   \
  void hessian_contraction(int, const SegmentInputs&, const Rows&, const Rows&, const Rows&, Rows&); \
  }
CCR_DECLARE(baseline)
CCR_DECLARE(avx2)
#endif

namespace testing {
namespace {

PaperLaw::Bend paper(double sine, double pull, double scale) {
  PaperLaw::Bends bends(1);
  PaperLaw::bend(1, &sine, pull * scale, 10 * scale, 8 * scale, bends);
  return bends[0];
}

RodLaw::Bend rod(double angle, double scale) {
  RodLaw::Bends bends(1);
  RodLaw::bend(1, &angle, 0, 10 * scale, 8 * scale, bends);
  return bends[0];
}

// Length of the cable between the holes of two disks, from position and angle of the upper one.
double cable_length(double forward, double sideways, double cosine, double sine, double scale) {
  const double x = -10 * sideways + 8 * cosine - 8, y = 10 * forward - 8 * sine;
  return scale * std::hypot(x, y);
}

double heading(const PaperLaw::Bend& bend) { return std::atan2(bend.sideways, bend.forward); }
double chord(const RodLaw::Bend& bend) { return std::hypot(bend.forward, bend.sideways); }

TEST_CASE("a segment of the paper's robot is as long as its cables say") {
  for (const double scale : kScales)
    for (const double pull : {0.0, 0.05, 0.4, 0.78})
      for (const double sine : {-0.6, -0.1, 0.0, 0.3, 0.7}) {
        const auto bend = paper(sine, pull, scale);
        CHECK(std::hypot(bend.forward, bend.sideways) == doctest::Approx(1).epsilon(1e-14));
        CHECK(bend.cosine == doctest::Approx(std::cos(bend.angle)).epsilon(1e-14));
        CHECK(bend.sine == doctest::Approx(std::sin(bend.angle)).epsilon(1e-14));
        CHECK(heading(bend) == doctest::Approx(std::asin(sine) - bend.angle / 2).epsilon(1e-13));
        CHECK(cable_length(bend.forward, bend.sideways, bend.cosine, bend.sine, scale) ==
              doctest::Approx((10 - pull) * scale).epsilon(1e-14));
      }
}

TEST_CASE("the slopes of the paper's segment are those of its shape") {
  for (const double scale : kScales)
    for (const double pull : {0.0, 0.05, 0.4, 0.78})
      for (const double sine : {-0.6, -0.1, 0.0, 0.3, 0.7}) {
        CAPTURE(scale);
        CAPTURE(pull);
        CAPTURE(sine);
        const double h = kDifference;
        const auto at = paper(sine, pull, scale), more = paper(sine + h, pull, scale),
                   less = paper(sine - h, pull, scale);
        CHECK(near(at.slope, (more.angle - less.angle) / (2 * h), 1));
        CHECK(near(at.curvature, (more.slope - less.slope) / (2 * h), 1));
        CHECK(near(at.heading_slope, (heading(more) - heading(less)) / (2 * h), 1));
        CHECK(near(at.heading_curvature, (more.heading_slope - less.heading_slope) / (2 * h), 10));
        const auto pulled = paper(sine, pull + h, scale), eased = paper(sine, pull - h, scale);
        CHECK(near(at.displacement_slope * scale, (pulled.angle - eased.angle) / (2 * h), 1));
      }
}

TEST_CASE("a segment that shears beyond its cable has no shape") { CHECK(std::isnan(paper(0.99, 0.9, 1).angle)); }

TEST_CASE("a segment of the rod is an arc, and takes the cable by which its holes come closer") {
  for (const double scale : kScales)
    for (const double angle : {-2.5, -0.4, 0.0, 1e-5, 0.1, 1.1}) {  // until the disks meet
      const auto bend = rod(angle, scale);
      CHECK(bend.cosine == doctest::Approx(std::cos(angle)).epsilon(1e-13));
      CHECK(bend.sine == doctest::Approx(std::sin(angle)).epsilon(1e-13));
      CHECK(chord(bend) == doctest::Approx(angle == 0 ? 1 : std::sin(angle / 2) / (angle / 2)).epsilon(1e-13));
      CHECK(bend.forward * std::sin(angle / 2) == doctest::Approx(-bend.sideways * std::cos(angle / 2)).epsilon(1e-13));
      const double left = cable_length(bend.forward, bend.sideways, bend.cosine, bend.sine, scale);
      CHECK(std::abs(10 * scale - RodLaw::taken(bend, 8 * scale).value - left) <= 1e-13 * scale);
    }
}

TEST_CASE("the slopes of a rod's segment are those of its shape") {
  for (const double scale : kScales)
    for (const double angle : {-2.5, -0.4, 0.0, 1e-5, 0.1, 1.0, 3.0}) {
      CAPTURE(angle);
      const double h = kDifference;
      const auto at = rod(angle, scale), more = rod(angle + h, scale), less = rod(angle - h, scale);
      CHECK(near(at.stretch * chord(at), (chord(more) - chord(less)) / (2 * h), 1));
      CHECK(near(at.stretch_slope * chord(at), (more.stretch * chord(more) - less.stretch * chord(less)) / (2 * h), 1));
      for (const double distance : {8.0, -3.0}) {  // of a cable on either side
        const auto taken = [&](const auto& bend) { return RodLaw::taken(bend, distance * scale); };
        CHECK(near(taken(at).slope, (taken(more).value - taken(less).value) / (2 * h), 10 * scale));
        CHECK(near(taken(at).curvature, (taken(more).slope - taken(less).slope) / (2 * h), 10 * scale));
      }
    }
}

// A segment in space, and what its law says.
struct InSpace {
  Vec<3> chord;
  Mat<3, 3> rotation;
  double objective;
  Vec<3> objective_slope;
  Mat<3, 3> chord_slope, turn_slope;
  Vec<2> objective_displacement_slope;
  Mat<3, 2> chord_displacement_slope, turn_displacement_slope;
};
static_assert(sizeof(InSpace) == SpatialLaw::kBend * sizeof(double));

SegmentInputs segment_inputs(const Vec<2>& displacements, double angle, double scale) {
  return {{displacements[0] * scale, displacements[1] * scale},
          10 * scale,
          {8 * scale, 0, 8 * scale * std::cos(angle), 8 * scale * std::sin(angle)}};
}

struct Space {
  explicit Space(int n)
      : controls(SpatialLaw::kControl, n), bendings(SpatialLaw::kBending, n), bends(SpatialLaw::kBend, n) {}

  bool bend(int n, const SegmentInputs& inputs) { return SpatialLaw::bend(n, inputs, controls, bendings, bends); }
  InSpace at(int segment) const {
    InSpace out;
    bends.get(segment, out.chord.v.data(), SpatialLaw::kBend);
    return out;
  }

  Rows controls, bendings, bends;
};

InSpace in_space(const Vec<3>& control, const SegmentInputs& inputs) {
  Space space(1);
  space.controls.put(0, control.v.data(), 3);
  REQUIRE(space.bend(1, inputs));
  return space.at(0);
}

Mat<3, 3> hessian_contraction(const Vec<3>& control, const SegmentInputs& inputs, const Vec<3>& force,
                              const Vec<3>& moment) {
  Space space(1);
  space.controls.put(0, control.v.data(), 3);
  REQUIRE(space.bend(1, inputs));
  Rows adjoints(SpatialLaw::kAdjoint, 1), hessians(SpatialLaw::kHessian, 1);
  adjoints.put(0, force.v.data(), 3);
  adjoints.put(0, moment.v.data(), 3, 3);
  SpatialLaw::hessian_contraction(1, inputs, space.controls, space.bendings, adjoints, hessians);
  Mat<3, 3> out;
  hessians.get(0, out.v.data(), SpatialLaw::kHessian);
  return out;
}

// Gradient, in the control, of the objective and of the work of a force on the chord and a moment on the rotation.
Vec<3> slope(const InSpace& bend, const Vec<3>& force, const Vec<3>& moment) {
  Vec<3> out = bend.objective_slope;
  out += transpose_times(bend.chord_slope, force);
  out += transpose_times(bend.turn_slope, moment);
  return out;
}

struct Case {
  Vec<3> control;
  Vec<2> displacements;
  double angle, scale;
};

std::vector<Case> cases() {
  Random random(1);
  std::vector<Case> out;
  for (const double scale : kScales)
    for (int k = 0; k < 20; ++k)
      out.push_back({random.matrix<3>(0.15),
                     {{random.uniform(0, 0.6), random.uniform(0, 0.6)}},
                     random.uniform(0.3, 0.7) * std::numbers::pi,
                     scale});
  return out;
}

TEST_CASE("a segment in space is as long as its cables say") {
  for (const Case& c : cases()) {
    const SegmentInputs inputs = segment_inputs(c.displacements, c.angle, c.scale);
    const InSpace bend = in_space(c.control, inputs);
    CHECK(norm(bend.chord) == doctest::Approx(inputs.length).epsilon(1e-14));
    for (int k = 0; k < 2; ++k) {
      const Vec<3> hole = {{inputs.holes[2 * k], inputs.holes[2 * k + 1], 0}};
      Vec<3> way = times(bend.rotation, hole);
      way += bend.chord;
      way -= hole;
      CHECK(norm(way) == doctest::Approx(inputs.length - inputs.displacements[k]).epsilon(1e-13));
    }
  }
}

TEST_CASE("the slopes of a segment in space are those of its shape") {
  const double h = kDifference;
  for (const Case& c : cases()) {
    const SegmentInputs inputs = segment_inputs(c.displacements, c.angle, c.scale);
    const InSpace at = in_space(c.control, inputs);
    const auto compare = [&](const InSpace& more, const InSpace& less, double step, double objective,
                             const Vec<3>& chord, const Vec<3>& turned, double unit) {
      CHECK(near(objective * unit, (more.objective - less.objective) / step * unit, 1));
      const Vec<3> moved = minus(more.chord, less.chord), around = turn(less.rotation, more.rotation);
      for (int k = 0; k < 3; ++k) {
        CHECK(near(chord[k] * unit, moved[k] / step * unit, 10 * c.scale));
        CHECK(near(turned[k] * unit, around[k] / step * unit, 1));
      }
    };
    const auto column = [](const auto& matrix, int k) { return Vec<3>{{matrix(0, k), matrix(1, k), matrix(2, k)}}; };
    for (int k = 0; k < 3; ++k) {
      Vec<3> up = c.control, down = c.control;
      up[k] += h;
      down[k] -= h;
      compare(in_space(up, inputs), in_space(down, inputs), 2 * h, at.objective_slope[k], column(at.chord_slope, k),
              column(at.turn_slope, k), 1);
    }
    for (int k = 0; k < 2; ++k) {
      Vec<2> up = c.displacements, down = c.displacements;
      up[k] += h;
      down[k] -= h;
      compare(in_space(c.control, segment_inputs(up, c.angle, c.scale)),
              in_space(c.control, segment_inputs(down, c.angle, c.scale)), 2 * h * c.scale,
              at.objective_displacement_slope[k], column(at.chord_displacement_slope, k),
              column(at.turn_displacement_slope, k), c.scale);
    }
  }
}

TEST_CASE("the contracted Hessian of a segment in space matches differences of its gradient") {
  Random random(2);
  const double h = kDifference;
  for (const Case& c : cases()) {
    const SegmentInputs inputs = segment_inputs(c.displacements, c.angle, c.scale);
    const Vec<3> force = random.matrix<3>(1 / c.scale), moment = random.matrix<3>();
    const Mat<3, 3> curved = hessian_contraction(c.control, inputs, force, moment);
    Mat<3, 3> found;
    for (int k = 0; k < 3; ++k) {
      Vec<3> up = c.control, down = c.control;
      up[k] += h;
      down[k] -= h;
      const Vec<3> more = slope(in_space(up, inputs), force, moment),
                   less = slope(in_space(down, inputs), force, moment);
      for (int r = 0; r < 3; ++r) {  // the second derivative of a rotation is symmetrised
        found(r, k) += (more[r] - less[r]) / (4 * h);
        found(k, r) += (more[r] - less[r]) / (4 * h);
      }
    }
    for (int k = 0; k < 9; ++k) CHECK(near(curved[k], found[k], 100));
  }
}

TEST_CASE("cables that cannot have their lengths are refused") {
  Space space(3);
  const double sheared[] = {2, 0, 0};
  space.controls.put(1, sheared, 3);
  CHECK_FALSE(space.bend(3, segment_inputs({{0.1, 0.1}}, 1.5, 1)));
}

#ifdef CCR_AVX2

TEST_CASE("AVX2 gives the same bits" * doctest::skip(!__builtin_cpu_supports("avx2"))) {
  Random random(3);
  for (int n = 1; n < 40; ++n) {
    std::vector<double> coordinates(static_cast<std::size_t>(n));
    for (double& one : coordinates) one = random.uniform(-1, 1);  // some out of range of the law
    const double pull = random.uniform(0, 0.8);
    PaperLaw::Bends one(n), four(n);
    baseline::bend(n, coordinates.data(), pull, 10, 8, one);
    avx2::bend(n, coordinates.data(), pull, 10, 8, four);
    CHECK(same_bits(one, four, PaperLaw::Bends::kLaws, n));

    for (double& angle : coordinates) angle *= 3;
    RodLaw::Bends arc(n), arcs(n);
    baseline::bend(n, coordinates.data(), 10, arc);
    avx2::bend(n, coordinates.data(), 10, arcs);
    CHECK(same_bits(arc, arcs, RodLaw::Bends::kLaws, n));

    const SegmentInputs inputs = segment_inputs({{random.uniform(0, 0.6), random.uniform(0, 0.6)}}, 1.3, 1);
    Space narrow(n), broad(n);
    Rows adjoints(SpatialLaw::kAdjoint, n), narrow_hessians(SpatialLaw::kHessian, n),
        broad_hessians(SpatialLaw::kHessian, n);
    for (int i = 0; i < n; ++i) {
      narrow.controls.put(i, random.matrix<3>(0.15).v.data(), 3);
      adjoints.put(i, random.matrix<6>().v.data(), 6);
    }
    broad.controls = narrow.controls;
    CHECK(baseline::bend(n, inputs, narrow.controls, narrow.bendings, narrow.bends));
    CHECK(avx2::bend(n, inputs, broad.controls, broad.bendings, broad.bends));
    CHECK(same_bits(narrow.bendings, broad.bendings, SpatialLaw::kBending, n));
    CHECK(same_bits(narrow.bends, broad.bends, SpatialLaw::kBend, n));
    baseline::hessian_contraction(n, inputs, narrow.controls, narrow.bendings, adjoints, narrow_hessians);
    avx2::hessian_contraction(n, inputs, broad.controls, broad.bendings, adjoints, broad_hessians);
    CHECK(same_bits(narrow_hessians, broad_hessians, SpatialLaw::kHessian, n));
  }
}

#endif

}  // namespace
}  // namespace testing
}  // namespace ccr
