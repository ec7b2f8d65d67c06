// The gradient and Hessian of a contact problem with fixed and mounted obstacles, against differences and dense
// algebra.
#include "problems.hpp"

namespace ccr::testing {
namespace {

constexpr double kDifference = 1e-6;

template <class Model>
struct Touched {
  static constexpr int kSpace = Model::kSpace;

  // A round obstacle at each of a few random points, the first two on springs.
  explicit Touched(Random& random)
      : of(numbers(random)),
        robot(make_robot<kSpace>(of)),
        problem(robot, kObstacles),
        at(random_shape<Model>(random, of, kSprings, 0.05)) {
    REQUIRE(problem.evaluate({at.command, at.controls, {}, {}}));
    for (int j = 0; j < kObstacles; ++j) {
      point[j] = random.integer(0, 1) * robot.positions() + random.integer(4, robot.positions() - 1);
      Position<kSpace> center = problem.points()[point[j]];
      const Vec<kSpace> way = random.template direction<kSpace>();
      const bool mounted = j < kSprings;
      for (int k = 0; k < kSpace; ++k) center[k] += 6 * way[k] - (mounted ? at.mounts[j][k] : 0);
      obstacles.push_back(make_ball(center, 6, mounted ? random.uniform(0.5, 5) : 0));
      at.active.contact[j] = j * robot.points() + point[j];
      at.active.multiplier[j] = random.decades(-7, -3);
    }
    at.active.count = kObstacles;
    problem.set_obstacles(obstacles);
    update_broadphase(problem, at);
    if constexpr (Model::kRod) {
      at.active.contact[kObstacles] = problem.contacts();
      at.active.multiplier[at.active.count++] = 0.02;
    }
    REQUIRE(problem.evaluate(at));
  }

  static RobotNumbers numbers(Random& random) {
    RobotNumbers of = numbers_of<Model>(random.integer(4, 7));
    of.between = random.integer(0, 2);
    return of;
  }

  Obstacle<kSpace> make_ball(const Position<kSpace>& center, double r, double spring) const {
    if constexpr (kSpace == 2)
      return circle(robot, center[0], center[1], r, spring);
    else
      return sphere(robot, center[0], center[1], center[2], r, spring);
  }

  // J - Σ λ c.
  double lagrangian(const Iterate<Model>& there) {
    REQUIRE(problem.evaluate(there));
    double value = problem.energy();
    for (int j = 0; j < at.active.count; ++j) value -= at.active.multiplier[j] * problem.gaps()[at.active.contact[j]];
    return value;
  }

  // Central differences of a function of the shape, one column for each unknown.
  template <class Function>
  Dense differences(int rows, Function function) {
    const int n = static_cast<int>(unknowns(at));
    Dense out(rows, n);
    for (int k = 0; k < n; ++k) {
      Iterate<Model> there = at;
      move(there, k, kDifference);
      const Column more = function(there);
      move(there, k, -2 * kDifference);
      const Column less = function(there);
      for (int r = 0; r < rows; ++r) out(r, k) = (more[r] - less[r]) / (2 * kDifference);
    }
    return out;
  }

  static constexpr int kObstacles = 4, kSprings = 2;

  RobotNumbers of;
  Robot robot;
  std::vector<Obstacle<kSpace>> obstacles;
  ContactProblem<Model> problem;
  Iterate<Model> at;
  std::array<int, kObstacles> point;
};

template <class Model>
void slopes() {
  Random random(1);
  for (int trial = 0; trial < 10; ++trial) {
    Touched<Model> touched(random);
    const Column slope = lagrangian_slope(touched.problem, touched.at);
    const Dense found = touched.differences(1, [&](const auto& there) { return Column{touched.lagrangian(there)}; });
    for (std::size_t k = 0; k < slope.size(); ++k) CHECK(std::abs(slope[k] - found(0, static_cast<int>(k))) <= 1e-7);
  }
}

// Gradients of the active gaps by differences, a row each.
template <class Model>
Dense gap_gradients(Touched<Model>& touched) {
  const ActiveSet& active = touched.at.active;
  const Dense gaps = touched.differences(active.count, [&](const auto& there) {
    REQUIRE(touched.problem.evaluate(there));
    Column out;
    for (int j = 0; j < active.count; ++j) out.push_back(touched.problem.gaps()[active.contact[j]]);
    return out;
  });
  lagrangian_slope(touched.problem, touched.at);  // back at the shape
  return gaps;
}

// Solutions of the system, multiplied by a Hessian by differences, must give the right-hand sides back.
template <class Model>
void check_solutions(Touched<Model>& touched, KktSystem<Model>& system, const Dense& hessian, const Dense& gaps) {
  const ActiveSet& active = touched.at.active;
  std::vector<typename ContactProblem<Model>::Slope> gradients;
  std::vector<Direction<Model>> responses(active.count + 1, Direction<Model>(touched.robot.segments, touched.kSprings));
  for (int j = 0; j < active.count; ++j) gradients.push_back(touched.problem.slope(active.contact[j]));
  std::vector<typename KktSystem<Model>::Load> loads = {{nullptr, &responses.back()}};
  for (int j = 0; j < active.count; ++j) loads.push_back({&gradients[j], &responses[j]});
  system.solve(touched.problem, loads);
  const auto check = [&](const Direction<Model>& response, const Column& right) {
    const Column unknowns = flat<Model>(response.controls, response.mounts);
    CHECK(apart(product(hessian, unknowns), right) <= 1e-5 * (largest(right) + largest(unknowns)));
  };
  Column down = lagrangian_slope(touched.problem, touched.at);
  for (double& part : down) part = -part;
  check(responses.back(), down);
  for (int j = 0; j < active.count; ++j) {
    Column row;
    for (int c = 0; c < gaps.columns(); ++c) row.push_back(gaps(j, c));
    check(responses[j], row);
    const Column moved = product(gaps, flat<Model>(responses[j].controls, responses[j].mounts));
    for (int k = 0; k < active.count; ++k)  // motion of the gaps along the response
      CHECK(gradients[k].along(responses[j]) ==
            doctest::Approx(moved[k]).epsilon(1e-5).scale(std::abs(gradients[j].along(responses[j]))));
  }
}

template <class Model>
void kkt_systems() {
  Random random(2);
  int definite = 0;
  for (int trial = 0; trial < 30; ++trial) {
    Touched<Model> touched(random);
    ContactProblem<Model>& problem = touched.problem;
    const int n = static_cast<int>(unknowns(touched.at));
    Dense expected = touched.differences(n, [&](const auto& there) { return lagrangian_slope(problem, there); });
    const Dense gaps = gap_gradients(touched);
    KktSystem<Model> system(touched.robot.segments, touched.kSprings);
    system.assemble(problem, touched.at.active, trial % 2 ? 0 : 10);
    for (int j = 0; j < touched.at.active.count; ++j)
      for (int r = 0; r < n; ++r)
        for (int c = 0; c < n; ++c) expected(r, c) += system.penalty(j) * gaps(j, r) * gaps(j, c);
    Dense symmetric = expected;
    for (int r = 0; r < n; ++r)  // but for the differences
      for (int c = 0; c < n; ++c) symmetric(r, c) = (expected(r, c) + expected(c, r)) / 2;
    Dense factor = symmetric;
    const double pivot = cholesky(factor);
    if (std::abs(pivot) < 1e-6) continue;
    const bool factored = system.factor(0);
    CHECK((factored && system.negative == 0) == (pivot > 0));
    if (Model::kRod) CHECK(system.negative == negative_eigenvalues(symmetric));
    if (pivot < 0) continue;
    ++definite;
    check_solutions(touched, system, expected, gaps);
  }
  CHECK(definite >= 5);
}

TEST_CASE_TEMPLATE("the gradient of the Lagrangian matches differences of its value", Model, PlanarPaper, PlanarRod,
                   SpatialPaper, SpatialRod) {
  slopes<Model>();
}

TEST_CASE_TEMPLATE("the KKT system solves with the Hessian of the Lagrangian, springs and penalties included", Model,
                   PlanarPaper, PlanarRod, SpatialPaper, SpatialRod) {
  kkt_systems<Model>();
}

}  // namespace
}  // namespace ccr::testing
