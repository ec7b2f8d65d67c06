// The gap laws of all shapes: unit slope on the surface, derivatives, and the bounds of the broad phase.
#include <doctest/doctest.h>

#include "scenes.hpp"

namespace ccr::testing {
namespace {

constexpr double kScales[] = {1e-3, 1, 1e3};
constexpr double kSize = 10;  // of the obstacles [scale]

template <int D>
Position<D> beside(Random& random, const Position<D>& center, double distance) {
  Position<D> out = random.direction<D>();
  for (int k = 0; k < D; ++k) out[k] = center[k] + distance * out[k];
  return out;
}

// The point of the surface between a point inside and one outside.
template <int D>
Position<D> on_surface(const Obstacle<D>& obstacle, const Position<D>& inside, const Position<D>& outside) {
  double low = 0, high = 1;
  Position<D> point;
  for (int i = 0; i < 100; ++i) {
    const double part = (low + high) / 2;
    for (int k = 0; k < D; ++k) point[k] = inside[k] + part * (outside[k] - inside[k]);
    (measure_gap(obstacle, point).value < 0 ? low : high) = part;
  }
  return point;
}

// Calls `check` with obstacles of every shape and scale, a point inside, and the size.
template <int D, class Check>
void each_obstacle(std::uint64_t seed, Check check) {
  Random random(seed);
  const Robot robot = make_robot<D>({});
  for (const double scale : kScales)
    for (int shape = 0; shape < kShapes<D>; ++shape)
      for (int trial = 0; trial < 10; ++trial) {
        Position<D> at = random.matrix<D>(50 * scale);
        const double r = kSize * scale * random.uniform(0.5, 2);
        const Obstacle<D> obstacle = random_obstacle(random, robot, shape, at, r, 0);
        if (obstacle.wall())  // the point of a wall is on its surface
          for (int k = 0; k < D; ++k) at[k] -= r * obstacle.parameters[k];
        CAPTURE(scale);
        CAPTURE(shape);
        check(random, obstacle, at, r);
      }
}

template <int D>
void unit_slope() {
  each_obstacle<D>(1, [](Random& random, const Obstacle<D>& obstacle, const Position<D>& at, double r) {
    CHECK(measure_gap(obstacle, at).value < 0);
    for (int k = 0; k < 10; ++k) {
      const Position<D> outside = beside<D>(random, at, 5 * r);
      if (measure_gap(obstacle, outside).value <= 0) continue;
      const Gap<D> gap = measure_gap(obstacle, on_surface(obstacle, at, outside));
      CHECK(std::abs(gap.value) <= 1e-13 * (r + norm(at)));
      CHECK(norm(gap.slope) == doctest::Approx(1).epsilon(1e-9));
      CHECK(dot(gap.slope, minus(outside, at)) > 0);
    }
  });
}

template <int D>
void derivatives() {
  each_obstacle<D>(2, [](Random& random, const Obstacle<D>& obstacle, const Position<D>& at, double r) {
    for (int k = 0; k < 10; ++k) {
      const Position<D> point = beside<D>(random, at, r * random.uniform(1, 4));
      const Gap<D> gap = measure_gap(obstacle, point);
      if (gap.value < 0) continue;  // the derivatives are not used deep inside
      const double h = 1e-6 * r;
      const Mat<D, D> curvature = gap.curvature(1);
      for (int c = 0; c < D; ++c) {
        Position<D> up = point, down = point;
        up[c] += h;
        down[c] -= h;
        const Gap<D> more = measure_gap(obstacle, up), less = measure_gap(obstacle, down);
        CHECK(gap.slope[c] == doctest::Approx((more.value - less.value) / (2 * h)).epsilon(1e-6).scale(1));
        for (int row = 0; row < D; ++row)
          CHECK(curvature(row, c) * r ==
                doctest::Approx((more.slope[row] - less.slope[row]) / (2 * h) * r).epsilon(1e-5).scale(1));
      }
    }
  });
}

template <int D>
void bounds() {
  each_obstacle<D>(3, [](Random& random, const Obstacle<D>& obstacle, const Position<D>& at, double r) {
    std::vector<Position<D>> points, surface;
    for (int k = 0; k < 7; ++k) points.push_back(beside<D>(random, at, r * random.uniform(0, 6)));
    const Position<D> moved = random.matrix<D>(r);
    std::vector<double> gaps(points.size());
    measure_gaps(obstacle, std::span<const Position<D>>(points), moved, gaps.data());
    for (std::size_t k = 0; k < points.size(); ++k)
      CHECK(gaps[k] == doctest::Approx(measure_gap(obstacle, minus(points[k], moved)).value).epsilon(1e-12).scale(r));

    // No point of the surface is nearer than the lower bounds of the broad phase.
    double nearest = kInfinity;
    for (int k = 0; k < 200; ++k) {
      const Position<D> outside = beside<D>(random, at, 20 * r);
      if (measure_gap(obstacle, outside).value <= 0) continue;
      const Position<D> on = on_surface(obstacle, at, outside);
      for (const Position<D>& point : points) nearest = std::min(nearest, norm(minus(point, on)));
      const double beyond = clearance_beyond(obstacle, points[0], r);
      if (beyond > 0) CHECK(norm(minus(points[0], on)) >= r + beyond - 1e-9 * r);
    }
    CHECK(nearest >= clearance(obstacle, std::span<const Position<D>>(points)) - 1e-9 * r);
  });
}

TEST_CASE("gaps have slope one on the surface, outwards") {
  unit_slope<2>();
  unit_slope<3>();
}

TEST_CASE("slopes and curvatures of the gaps are those of their values") {
  derivatives<2>();
  derivatives<3>();
}

TEST_CASE("gaps of displaced obstacles equal those of points moved back; the broad phase is a lower bound") {
  bounds<2>();
  bounds<3>();
}

TEST_CASE("the gap of a wall, and of a polygon, is the distance") {
  const Robot robot = make_robot<2>({});
  CHECK(measure_gap(wall<2>(robot, {{0.6, 0.8}}, 5), {{6, 8}}).value == doctest::Approx(5));
  CHECK(measure_gap(circle(robot, 1, 2, 3), {{1, 8}}).value == doctest::Approx((36.0 - 9) / 6));
  const std::array square{0.5, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0};
  const Obstacle<2> box = make_obstacle<2>(robot, Shape::kPolygon, square);
  CHECK(measure_gap(box, {{3, 0.5}}).value == doctest::Approx(1.5));
  CHECK(measure_gap(box, {{4, 5}}).value == doctest::Approx(4.5));
  CHECK(measure_gap(box, {{0.25, 0}}).value == doctest::Approx(-1.25));
}

}  // namespace
}  // namespace ccr::testing
