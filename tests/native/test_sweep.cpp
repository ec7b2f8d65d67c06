// The sweep against brute force: many moments of a path, many points of an edge, and independent distances.
#include <doctest/doctest.h>

#include "distance.hpp"
#include "scenes.hpp"
#include "solve/sweep.hpp"
#include "tolerances.hpp"

namespace ccr::testing {
namespace {

constexpr double kScales[] = {1e-3, 1, 1e3};
constexpr int kMoments = 40, kParts = 24, kPathParts = 160;

template <int D>
Position<D> between(const Position<D>& a, const Position<D>& b, double part) {
  Position<D> out;
  for (int k = 0; k < D; ++k) out[k] = a[k] + part * (b[k] - a[k]);
  return out;
}

template <int D>
Position<D> beside(Random& random, const Position<D>& origin, double distance) {
  return between(
      origin,
      [&] {
        Position<D> out = random.direction<D>();
        out += origin;
        return out;
      }(),
      distance);
}

// How far the chords of an outline lie inside it.
template <int D>
double sagitta(const Obstacle<D>& obstacle) {
  double longest = 0;
  const std::size_t count = obstacle.outline.size();
  for (std::size_t k = 0; k < count; ++k)
    longest = std::max(longest, norm(minus(obstacle.outline[(k + 1) % count], obstacle.outline[k])));
  return 1.01 * longest * longest / (8 * obstacle.min_curvature_radius);
}

// How deep the deepest of some points on a line is, at least as deep as known already. As a distance changes no faster
// than a point moves, points that cannot be deeper than the deepest so far are skipped.
template <int D>
double deepest_on_line(const Obstacle<D>& obstacle, const Position<D>& from, const Position<D>& to, int parts,
                       double deepest = -kInfinity) {
  const double spacing = norm(minus(to, from)) / parts;
  for (int k = 0; k <= parts;) {
    const double distance = signed_distance(obstacle, between(from, to, static_cast<double>(k) / parts));
    deepest = std::max(deepest, -distance);
    k += static_cast<int>(std::clamp(spacing > 0 ? (distance + deepest) / spacing : parts, 1.0, parts + 1.0));
  }
  return deepest;
}

template <int D>
double deepest_of_path(const Obstacle<D>& obstacle, const Position<D>& from, const Position<D>& to) {
  return deepest_on_line(obstacle, from, to, kPathParts);
}

template <int D>
double deepest_of_sweep(const Obstacle<D>& obstacle, const Edge<D>& from, const Edge<D>& to) {
  double deepest = -kInfinity;
  for (int k = 0; k <= kMoments; ++k) {
    const double moment = static_cast<double>(k) / kMoments;
    const Position<D> start = between(from.start, to.start, moment), end = between(from.end, to.end, moment);
    deepest = deepest_on_line(obstacle, start, end, kParts, deepest);
  }
  return deepest;
}

// Calls `check` with obstacles of every shape and scale, a point on or in each, and the size.
template <int D, class Check>
void each_obstacle(std::uint64_t seed, int trials, Check check) {
  Random random(seed);
  const Robot robot = make_robot<D>({});
  for (const double scale : kScales)
    for (int shape = 0; shape < kShapes<D>; ++shape)
      for (int trial = 0; trial < trials; ++trial) {
        const Position<D> at = random.matrix<D>(50 * scale);
        const double r = 10 * scale * random.uniform(0.5, 2);
        CAPTURE(scale);
        CAPTURE(shape);
        check(random, random_obstacle(random, robot, shape, at, r, 0), at, r);
      }
}

// A random point outside an obstacle and near it.
template <int D>
Position<D> outside(Random& random, const Obstacle<D>& obstacle, const Position<D>& at, double r) {
  for (;;) {
    const Position<D> point = beside(random, at, r * random.uniform(0.5, 3));
    const double distance = signed_distance(obstacle, point);
    if (distance >= 0 && distance < r) return point;
  }
}

// Another point outside, within a distance of this one.
template <int D>
Position<D> close_to(Random& random, const Obstacle<D>& obstacle, const Position<D>& point, double farthest) {
  for (;;) {
    const Position<D> other = beside(random, point, farthest * std::sqrt(random.uniform(0, 1)));
    if (signed_distance(obstacle, other) >= 0) return other;
  }
}

template <int D>
void depths() {
  each_obstacle<D>(1, 10, [](Random& random, const Obstacle<D>& obstacle, const Position<D>& at, double r) {
    for (int k = 0; k < 20; ++k) {
      const Position<D> point = beside(random, at, r * random.uniform(0, 3));
      const double deep = -signed_distance(obstacle, point), found = depth(obstacle, point);
      CHECK(found >= deep - sagitta(obstacle) - 1e-9 * r);
      if (deep < 0) CHECK(found <= 1e-9 * r);
      if (deep > 0) CHECK(found <= 1.1 * deep + 0.2 * r * !obstacle.outline.empty() + 1e-9 * r);
    }
  });
}

template <int D>
void paths() {
  int clear = 0, barred = 0;
  each_obstacle<D>(2, 10, [&](Random& random, const Obstacle<D>& obstacle, const Position<D>& at, double r) {
    if (obstacle.wall()) return;
    const double allowed = tolerances::kSweepDepth * obstacle.inradius;
    for (int k = 0; k < 20; ++k) {
      const Position<D> from = outside(random, obstacle, at, r);
      const Position<D> to = k % 3 == 0 ? close_to(random, obstacle, from, 2 * r) : outside(random, obstacle, at, r);
      const double deepest = deepest_of_path(obstacle, from, to);
      if (deepest > 1.125 * allowed + sagitta(obstacle))
        CHECK_FALSE(path_clear(obstacle, from, to));  // strides are at least a quarter of it
      if (deepest < 0.7 * allowed && obstacle.outline.empty()) CHECK(path_clear(obstacle, from, to));
      ++(deepest > 1.125 * allowed ? barred : clear);
      const Position<D> next = close_to(random, obstacle, from, harmless_path(obstacle));
      CHECK(deepest_of_path(obstacle, from, next) <= allowed);
    }
  });
  CHECK(clear > 500);
  CHECK(barred > 500);
}

template <int D>
void edges() {
  int clear = 0, barred = 0;
  each_obstacle<D>(3, 9, [&](Random& random, const Obstacle<D>& obstacle, const Position<D>& at, double r) {
    if (obstacle.wall()) return;
    for (int k = 0; k < 12; ++k) {
      const double longest = 2 * obstacle.inradius * random.uniform(0.2, 0.95), half = longest / 2;
      const auto edge = [&](const Position<D>& start) {
        return Edge<D>{start, close_to(random, obstacle, start, longest)};
      };
      const Edge<D> from = edge(outside(random, obstacle, at, r));
      const Edge<D> to = edge(k % 2 ? close_to(random, obstacle, from.start, r) : outside(random, obstacle, at, r));
      const double deepest = deepest_of_sweep(obstacle, from, to);
      if (deepest > half * (1 + 1e-9) + sagitta(obstacle)) CHECK_FALSE(edge_clear(obstacle, from, to, half));
      if (deepest < 0.8 * half && obstacle.outline.empty()) CHECK(edge_clear(obstacle, from, to, half));
      ++(deepest > half ? barred : clear);

      const double harmless = harmless_motion(obstacle, longest);
      if (!(harmless > 0)) continue;
      const Edge<D> next{close_to(random, obstacle, from.start, harmless),
                         close_to(random, obstacle, from.end, harmless)};
      if (norm(minus(next.end, next.start)) <= longest)
        CHECK(deepest_of_sweep(obstacle, from, next) <= half * (1 + 1e-9));
    }
  });
  CHECK(clear > 200);
  CHECK(barred > 100);
}

TEST_CASE("a depth is an upper bound, up to the chords of an outline, and at most 0 outside") {
  depths<2>();
  depths<3>();
}

TEST_CASE("the path of a point is no deeper than allowed") {
  paths<2>();
  paths<3>();
}

TEST_CASE("an edge does not sweep over a core") {
  edges<2>();
  edges<3>();
}

TEST_CASE("sharp corners are checked as well as round ones") {
  const Robot robot = make_robot<2>({});
  for (const double edge : {1e-1, 1e-3, 1e-6, 1e-9, 1e-12}) {
    const std::array numbers{edge,  -10.0, -10.0, 10.0, -10.0, 10.0, 10.0,  -10.0, 10.0,
                             -10.0, 10.0,  -10.0, 10.0, -10.0, 10.0, -10.0, 10.0};
    const Obstacle<2> square = make_obstacle<2>(robot, Shape::kPolygon, numbers);
    CHECK_FALSE(path_clear<2>(square, {{-20, 0}}, {{20, 0}}));
    CHECK(path_clear<2>(square, {{-20, 12}}, {{20, 12}}));
    CHECK_FALSE(edge_clear<2>(square, {{{-20, -5}}, {{-20, 5}}}, {{{20, -5}}, {{20, 5}}}, 5));
    CHECK(edge_clear<2>(square, {{{-20, 11}}, {{-20, 16}}}, {{{20, 11}}, {{20, 16}}}, 5));
  }
}

}  // namespace
}  // namespace ccr::testing
