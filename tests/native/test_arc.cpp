// The laws of a segment of the rod in space: its geometry, its derivatives, and that AVX2 gives the same bits.
#include <doctest/doctest.h>

#include <array>
#include <cstring>
#include <span>
#include <vector>

#include "differences.hpp"
#include "model/arc.hpp"
#include "random.hpp"

namespace ccr {

#ifdef CCR_AVX2
#define CCR_DECLARE(REGISTERS)                                                                     \
  namespace REGISTERS {                                                                            \
  void bend_arcs(int, double, const Rows&, Arc*, Rows&);                                           \
  void measure_cables(std::span<const ArcCable>, const Rows&, const Rows&);                        \
  void contract_arcs(int, const Rows&, const Rows&, const Rows&, std::span<const ArcPull>, Rows&); \
  }
CCR_DECLARE(narrow)
CCR_DECLARE(broad)
#endif

namespace testing {
namespace {

// A segment, and what its law says.
struct Segment {
  Segment(const Vec<3>& control, double scale)
      : length(10 * scale), controls(ArcLaw::kControl, 1), shared(ArcLaw::kShared, 1), arcs(Rows::room(1)) {
    controls.put(0, control.v.data(), 3);
    ArcLaw::bend(1, length, controls, arcs.data(), shared);
  }
  const Arc& at() const { return arcs[0]; }

  // Length taken up from a cable, its slope and its Hessian.
  std::array<double, 13> take(const Vec<2>& hole) const {
    std::vector<double> distances(Rows::room(1));
    std::vector<Vec<3>> slopes(Rows::room(1));
    const ArcCable cable{{hole[0], hole[1], norm(hole)}, 1, distances.data(), slopes.data()};
    ArcLaw::measure({&cable, 1}, controls, shared);
    const ArcPull pull{&cable, 1};
    const Mat<3, 3> hessian = contract({}, {}, {&pull, 1});
    std::array<double, 13> out = {length - distances[0]};
    for (int k = 0; k < 3; ++k) out[1 + k] = -slopes[0][k];
    for (int k = 0; k < 9; ++k) out[4 + k] = -hessian[k];
    return out;
  }
  Mat<3, 3> hessian_contraction(const Vec<3>& force, const Vec<3>& moment) const { return contract(force, moment, {}); }

  double length;
  Rows controls, shared;
  std::vector<Arc> arcs;

 private:
  Mat<3, 3> contract(const Vec<3>& force, const Vec<3>& moment, std::span<const ArcPull> pulls) const {
    Rows adjoints(ArcLaw::kAdjoint, 1), hessians(ArcLaw::kHessian, 1);
    adjoints.put(0, force.v.data(), 3);
    adjoints.put(0, moment.v.data(), 3, 3);
    ArcLaw::hessian_contraction(1, controls, shared, adjoints, pulls, hessians);
    Mat<3, 3> out;
    for (int r = 0, entry = 0; r < 3; ++r)
      for (int c = 0; c <= r; ++c, ++entry) out(r, c) = out(c, r) = hessians.at(entry, 0);
    return out;
  }
};

// Rotates a vector by a rotation vector (Rodrigues).
Vec<3> rotated(const Vec<3>& by, const Vec<3>& v) {
  const double angle = norm(by);
  if (angle == 0) return v;
  Vec<3> axis = by;
  for (double& part : axis.v) part /= angle;
  const Vec<3> across = cross(axis, v);
  Vec<3> out;
  for (int k = 0; k < 3; ++k)
    out[k] = v[k] * std::cos(angle) + across[k] * std::sin(angle) + axis[k] * dot(axis, v) * (1 - std::cos(angle));
  return out;
}

std::vector<Vec<3>> rotation_vectors() {
  Random random(3);
  std::vector<Vec<3>> out = {{}, {{1e-7, 0, 0}}, {{0, 0, 0.5}}, {{0, 3.0, 0}}};
  for (int k = 0; k < 20; ++k) out.push_back(random.matrix<3>(k % 2 ? 0.2 : 1.5));
  return out;
}

TEST_CASE("a segment of the rod in space is an arc, and takes the cable by which its holes come closer") {
  for (const double scale : kScales)
    for (const Vec<3>& control : rotation_vectors()) {
      const Segment arc(control, scale);
      const double half = std::hypot(control[0], control[1]) / 2;
      const double chord = arc.length * (half == 0 ? 1 : std::sin(half) / half);
      const Vec<3> tangent = rotated({{control[0] / 2, control[1] / 2, control[2] / 2}}, {{0, 0, chord}});
      CHECK(norm(minus(arc.at().chord, tangent)) <= 1e-13 * arc.length);
      for (const Vec<2>& place : {Vec<2>{{8 * scale, 0}}, Vec<2>{{-3 * scale, 5 * scale}}}) {
        const Vec<3> hole = {{place[0], place[1], 0}};
        const Vec<3> turned = times(arc.at().rotation, hole);
        CHECK(norm(minus(turned, rotated(control, hole))) <= 1e-13 * norm(hole));
        Vec<3> way = turned;
        way += tangent;
        way -= hole;
        CHECK(std::abs(arc.length - norm(way) - arc.take(place)[0]) <= 1e-13 * arc.length);
      }
    }
}

TEST_CASE("the slopes of a segment of the rod in space are those of its shape") {
  const double h = kDifference;
  Random random(4);
  for (const double scale : kScales)
    for (const Vec<3>& control : rotation_vectors()) {
      const Segment arc(control, scale);
      const Vec<2> hole = {{6 * scale, -5 * scale}};
      const Vec<3> force = random.matrix<3>(1 / scale), moment = random.matrix<3>();
      const auto slope = [&](const Segment& there) {
        Vec<3> out = transpose_times(there.at().chord_slope, force);
        out += transpose_times(there.at().turn_slope, moment);
        return out;
      };
      Mat<3, 3> curved;
      for (int k = 0; k < 3; ++k) {
        Vec<3> up = control, down = control;
        up[k] += h;
        down[k] -= h;
        const Segment more(up, scale), less(down, scale);
        const Vec<3> moved = minus(more.at().chord, less.at().chord),
                     around = turn(less.at().rotation, more.at().rotation);
        const Vec<3> steeper = minus(slope(more), slope(less));
        const auto taken = arc.take(hole), taken_more = more.take(hole), taken_less = less.take(hole);
        CHECK(near(taken[1 + k], (taken_more[0] - taken_less[0]) / (2 * h), 10 * scale));
        for (int r = 0; r < 3; ++r) {
          CHECK(near(arc.at().chord_slope(r, k), moved[r] / (2 * h), 10 * scale));
          CHECK(near(arc.at().turn_slope(r, k), around[r] / (2 * h), 1));
          CHECK(near(taken[4 + 3 * r + k], (taken_more[1 + r] - taken_less[1 + r]) / (2 * h), 20 * scale));
          curved(r, k) = steeper[r] / (2 * h);
        }
      }
      const Mat<3, 3> found = arc.hessian_contraction(force, moment);  // the symmetric part
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) CHECK(near(found(r, c), (curved(r, c) + curved(c, r)) / 2, 30));
    }
}

// A robot with random segments, and two cables of which one ends before its tip.
struct Chain {
  explicit Chain(int n)
      : n(n),
        controls(ArcLaw::kControl, n),
        shared(ArcLaw::kShared, n),
        adjoints(ArcLaw::kAdjoint, n),
        hessians(ArcLaw::kHessian, n),
        arcs(Rows::room(n)),
        distances(2 * Rows::room(n)),
        slopes(2 * Rows::room(n)) {
    Random random(n);
    for (int i = 0; i < n; ++i) {
      controls.put(i, random.matrix<3>(1.5).v.data(), 3);
      adjoints.put(i, random.matrix<6>().v.data(), 6);
    }
    const int room = Rows::room(n);
    cables[0] = {{8, 0, 8}, n, distances.data(), slopes.data()};
    cables[1] = {{-3, 4, 5}, (n + 1) / 2, distances.data() + room, slopes.data() + room};
    pulls[0] = {&cables[0], 0.3};
    pulls[1] = {&cables[1], 0.7};
  }

  int n;
  Rows controls, shared, adjoints, hessians;
  std::vector<Arc> arcs;
  std::vector<double> distances;
  std::vector<Vec<3>> slopes;
  ArcCable cables[2];
  ArcPull pulls[2];
};

bool same_bytes(const void* a, const void* b, std::size_t bytes) { return std::memcmp(a, b, bytes) == 0; }

TEST_CASE("a robot that bends evenly is that of its segments each by itself") {
  const Vec<3> control = {{0.3, -0.2, 0.1}};
  const Segment one(control, 1);
  for (const int n : {1, 2, 5, 18}) {
    Chain all(n), each(n);
    for (Chain* chain : {&all, &each}) {
      for (int i = 0; i < n; ++i) chain->controls.put(i, control.v.data(), 3);
      CHECK(ArcLaw::bend(n, one.length, chain->controls, chain->arcs.data(), chain->shared) == (n > 1));
      ArcLaw::measure(chain->cables, chain->controls, chain->shared, chain == &all);
    }
    for (int i = 0; i < n; ++i) CHECK(same_bytes(&all.arcs[i], &one.at(), sizeof(Arc)));
    for (int k = 0; k < ArcLaw::kShared; ++k) CHECK(all.shared.at(k, n - 1) == one.shared.at(k, 0));
    CHECK(same_bytes(all.slopes.data(), each.slopes.data(), all.slopes.size() * sizeof(Vec<3>)));
    for (const int k : {0, 1})
      CHECK(same_bytes(all.cables[k].distances, each.cables[k].distances, all.cables[k].end * sizeof(double)));
  }
}

#ifdef CCR_AVX2

TEST_CASE("AVX2 gives the same bits for the rod in space" * doctest::skip(!__builtin_cpu_supports("avx2"))) {
  for (int n = 1; n < 40; ++n) {
    Chain two(n), four(n);
    narrow::bend_arcs(n, 10, two.controls, two.arcs.data(), two.shared);
    broad::bend_arcs(n, 10, four.controls, four.arcs.data(), four.shared);
    CHECK(same_bytes(two.arcs.data(), four.arcs.data(), n * sizeof(Arc)));
    narrow::measure_cables(two.cables, two.controls, two.shared);
    broad::measure_cables(four.cables, four.controls, four.shared);
    CHECK(same_bytes(two.slopes.data(), four.slopes.data(), two.slopes.size() * sizeof(Vec<3>)));
    for (int k = 0; k < 2; ++k)
      CHECK(same_bytes(two.cables[k].distances, four.cables[k].distances, two.cables[k].end * sizeof(double)));
    narrow::contract_arcs(n, two.controls, two.shared, two.adjoints, two.pulls, two.hessians);
    broad::contract_arcs(n, four.controls, four.shared, four.adjoints, four.pulls, four.hessians);
    CHECK(same_bits(two.hessians, four.hessians, ArcLaw::kHessian, n));
  }
}

#endif

}  // namespace
}  // namespace testing
}  // namespace ccr
