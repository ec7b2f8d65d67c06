// Quadratic programs built backwards from their solution: each gap is that of one point from a wall, whose normal sets
// the gradient and whose offset the value. For the rod, the slack of the cable is one more gap, set by the
// displacement.
#include <algorithm>

#include "problems.hpp"
#include "solve/active_set_qp.hpp"

namespace ccr::testing {
namespace {

constexpr double kLargest = 2e-5;  // multiplier of a wall that leaves H positive definite [rad²/mm]
constexpr double kTaut = 0.0125;   // approximate multiplier of the slack
constexpr double kAway = 0.002;    // size of the controls, small for a step within reach of the walls

template <class Model>
struct Wanted {
  static constexpr int kSpace = Model::kSpace;
  using Direction = ccr::Direction<Model>;
  using Slope = typename ContactProblem<Model>::Slope;

  Wanted(Random& random, int walls)
      : of(numbers_of<Model>(8)),
        robot(make_robot(of, {{{0, 0}}})),
        problem(robot, walls),
        at(random_shape<Model>(random, of, 0, kAway)),
        kkt(of.segments, 0),
        step(of.segments, 0),
        normals(walls),
        points(walls),
        gaps(walls + Model::kRod) {
    for (int j = 0; j < walls; ++j) {
      normals[j] = random.template direction<kSpace>();
      points[j] = 1 + (j * 3) % of.segments;
    }
    if (!Model::kRod) return;
    at.active.contact[0] = problem.contacts();
    at.active.multiplier[0] = kTaut;
    at.active.count = 1;
  }

  int walls() const { return static_cast<int>(points.size()); }
  int count() const { return static_cast<int>(gaps.size()); }
  int contact(int gap) const { return gap == walls() ? problem.contacts() : gap * robot.points() + points[gap]; }
  Slope slope(int gap) const { return problem.slope(contact(gap)); }

  // Puts the walls where the gaps have their wanted values.
  void build_walls() {
    REQUIRE(problem.evaluate(at));
    if constexpr (Model::kRod) at.command.cables[0] += problem.gaps()[problem.slack_contact(0)] - gaps.back();
    obstacles.clear();
    for (int j = 0; j < walls(); ++j)
      obstacles.push_back(for_point(
          wall<kSpace>(robot, normals[j], dot(normals[j], problem.points()[points[j]]) - gaps[j]), points[j]));
    problem.set_obstacles(obstacles);
    update_broadphase(problem, at);
    REQUIRE(problem.evaluate(at));
    problem.reduced_gradient(at.active);
    kkt.assemble(problem, at.active, 0);
    REQUIRE(kkt.factor(0));
  }

  Direction respond(const Slope* slope) {
    Direction out(of.segments, 0);
    const typename KktSystem<Model>::Load load{slope, &out};
    kkt.solve(problem, {&load, 1});
    return out;
  }

  // Chooses the multipliers of the solution, which give its step, and gaps that make it optimal: closed under the step
  // where λ > 0, open by `slack` elsewhere.
  void choose(const std::vector<double>& multipliers, double slack) {
    std::fill(gaps.begin(), gaps.end(), 0);
    build_walls();
    step = respond(nullptr);
    std::vector<double> change = multipliers;
    for (int j = 0; j < count(); ++j) change[j] -= this->multipliers(at.active)[j];
    add_responses(change, step);
    for (int j = 0; j < count(); ++j) gaps[j] = (multipliers[j] > 0 ? 0 : slack) - slope(j).along(step);
    build_walls();
  }

  // Starts with some walls active.
  void warm(Random& random) {
    for (int j = 0; j < walls(); ++j)
      if (random.chance(0.4)) {
        at.active.contact[at.active.count] = contact(j);
        at.active.multiplier[at.active.count++] = random.uniform(0, kLargest);
      }
  }

  // Adds Σ λ H⁻¹∇c to a step.
  void add_responses(const std::vector<double>& multipliers, Direction& to) {
    for (int j = 0; j < count(); ++j) {
      const Slope slope = this->slope(j);
      to.add(multipliers[j], respond(&slope));
    }
  }

  // Multipliers of all gaps, from an active set.
  std::vector<double> multipliers(const ActiveSet& active) const {
    std::vector<double> out(gaps.size());
    for (int j = 0; j < active.count; ++j) {
      const int contact = active.contact[j];
      out[contact == problem.contacts() ? walls() : contact / robot.points()] = active.multiplier[j];
    }
    return out;
  }

  double error(const Direction& found) const {
    return apart(flat<Model>(found.controls, found.mounts), flat<Model>(step.controls, step.mounts));
  }
  double size() const { return largest(flat<Model>(step.controls, step.mounts)); }

  RobotNumbers of;
  Robot robot;
  ContactProblem<Model> problem;
  Iterate<Model> at;
  KktSystem<Model> kkt;
  Direction step;
  std::vector<Vec<kSpace>> normals;
  std::vector<int> points;
  std::vector<double> gaps;
  std::vector<Obstacle<kSpace>> obstacles;
};

// Random multipliers of some walls, and of the rod's slack.
template <class Model>
std::vector<double> choose(Random& random, int walls, double pushing) {
  std::vector<double> out(static_cast<std::size_t>(walls));
  for (double& one : out) one = random.chance(pushing) ? random.uniform(0.1, 1) * kLargest : 0;
  if (Model::kRod) out.push_back(random.uniform(0.99, 1.01) * kTaut);
  return out;
}

template <class Model>
void chosen_sets() {
  Random random(1);
  int pushed = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const int walls = random.integer(1, Model::kSpace == 2 ? 5 : 8);
    Wanted<Model> wanted(random, walls);
    const std::vector<double> multipliers = choose<Model>(random, walls, 0.5);
    if (trial % 3 > 0) wanted.warm(random);
    wanted.choose(multipliers, 0.3);
    ActiveSetQp<Model> qp(wanted.of.segments, 0);
    ActiveSet active = wanted.at.active;
    Direction<Model> step(wanted.of.segments, 0);
    REQUIRE(qp.solve(wanted.problem, wanted.kkt, active, step));
    CHECK(wanted.error(step) <= 1e-8 * wanted.size());
    const std::vector<double> found = wanted.multipliers(active);
    for (int j = 0; j < wanted.count(); ++j) CHECK(std::abs(found[j] - multipliers[j]) <= 1e-7 * kLargest);
    pushed += active.count;
  }
  CHECK(pushed > 100);
}

// Where walls coincide, or more of them meet in a point than it has degrees of freedom, multipliers are not unique but
// the step is.
template <class Model>
void dependent_gaps() {
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    constexpr int kWalls = Model::kSpace + 3;
    Wanted<Model> wanted(random, kWalls);
    wanted.points.assign(kWalls, 5);
    wanted.normals[1] = wanted.normals[0];
    const std::vector<double> multipliers = choose<Model>(random, kWalls, 0.7);
    if (trial % 2) wanted.warm(random);
    wanted.choose(multipliers, random.chance(0.5) ? 0 : 0.2);  // closed without pushing, or open
    ActiveSetQp<Model> qp(wanted.of.segments, 0);
    ActiveSet active = wanted.at.active;
    Direction<Model> step(wanted.of.segments, 0);
    REQUIRE(qp.solve(wanted.problem, wanted.kkt, active, step));
    CHECK(wanted.error(step) <= 1e-7 * wanted.size());
    CHECK(active.count <= Model::kSpace + Model::kRod);
    std::vector<double> found = wanted.multipliers(active);
    CHECK(*std::min_element(found.begin(), found.end()) >= 0);
    Direction<Model> pushed(wanted.of.segments, 0);  // by the difference of the multipliers
    for (int j = 0; j < wanted.count(); ++j) found[j] -= multipliers[j];
    wanted.add_responses(found, pushed);
    CHECK(largest(flat<Model>(pushed.controls, pushed.mounts)) <= 1e-6 * wanted.size());
  }
}

template <class Model>
void no_answer() {
  Random random(3);
  Wanted<Model> wanted(random, 2);
  wanted.points = {5, 5};
  for (int k = 0; k < Model::kSpace; ++k) wanted.normals[1][k] = -wanted.normals[0][k];
  wanted.gaps[0] = wanted.gaps[1] = -0.1;  // a point on the wrong side of two walls that face each other
  wanted.build_walls();
  ActiveSetQp<Model> qp(wanted.of.segments, 0);
  ActiveSet active = wanted.at.active;
  Direction<Model> step(wanted.of.segments, 0);
  CHECK_FALSE(qp.solve(wanted.problem, wanted.kkt, active, step));
}

// The smallest step in the norm of H that closes the held gaps.
template <class Model>
void restorations() {
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    Wanted<Model> wanted(random, 3);
    for (double& gap : wanted.gaps) gap = random.uniform(-0.1, 0.1);
    wanted.gaps[2] = 2;  // not held, and open
    wanted.build_walls();
    ActiveSet active = wanted.at.active;
    for (int j = 0; j < 2; ++j) active.contact[active.count++] = wanted.contact(j);
    const int held = active.count;
    ActiveSetQp<Model> qp(wanted.of.segments, 0);
    Direction<Model> step(wanted.of.segments, 0);
    REQUIRE(qp.restore(wanted.problem, wanted.kkt, active, step));
    // It is a combination of the responses to the held gaps, found by as many equations.
    Dense gram(held, held);
    Column shortfall(static_cast<std::size_t>(held));
    std::vector<typename Wanted<Model>::Slope> slopes;
    for (int j = 0; j < held; ++j) {
      slopes.push_back(wanted.problem.slope(active.contact[j]));
      shortfall[j] = -wanted.problem.gaps()[active.contact[j]];
      CHECK(std::abs(shortfall[j] - slopes[j].along(step)) <= 1e-11);
    }
    for (int c = 0; c < held; ++c) {
      const Direction<Model> response = wanted.respond(&slopes[c]);
      for (int r = 0; r < held; ++r) gram(r, c) = slopes[r].along(response);
    }
    REQUIRE(cholesky(gram) > 1e-9);
    const Column parts = solve_cholesky(gram, shortfall);
    wanted.step.clear();
    for (int j = 0; j < held; ++j) wanted.step.add(parts[j], wanted.respond(&slopes[j]));
    CHECK(wanted.error(step) <= 1e-6 * wanted.size());
  }
}

// A gap that is not held, violated by more than a restoration leaves, though by less than an equilibrium may.
template <class Model>
void nearly_closed() {
  Random random(5);
  Wanted<Model> wanted(random, 1);
  const double left = tolerances::kDescentFeasibility * wanted.robot.max_length;
  wanted.gaps[0] = -4 * left;
  wanted.build_walls();
  ActiveSetQp<Model> qp(wanted.of.segments, 0);
  ActiveSet active = wanted.at.active;
  Direction<Model> step(wanted.of.segments, 0);
  REQUIRE(qp.restore(wanted.problem, wanted.kkt, active, step));
  CHECK(wanted.problem.gaps()[wanted.contact(0)] + wanted.slope(0).along(step) >= -left);
}

// A closed gap of a point whose wall lies between two others of the same point: the forces of one of these and it
// balance the same as those of both.
template <class Model>
void exchanges() {
  Random random(6);
  Wanted<Model> wanted(random, 3);
  wanted.points = {5, 5, 5};
  Vec<Model::kSpace>* normals = wanted.normals.data();
  for (int k = 0; k < Model::kSpace; ++k) normals[2][k] = 0.6 * normals[0][k] + 0.8 * normals[1][k];
  const double length = norm(normals[2]);
  for (double& part : normals[2].v) part /= length;
  for (const double open : {0.0, 1e-9}) {
    std::fill(wanted.gaps.begin(), wanted.gaps.end(), 0);
    wanted.gaps[2] = open * wanted.robot.max_length;
    wanted.build_walls();
    ActiveSet active = wanted.at.active;
    for (int j = 0; j < 2; ++j) {
      active.contact[active.count] = wanted.contact(j);
      active.multiplier[active.count++] = (1 + j) * kLargest;
    }
    const std::vector<double> before = wanted.multipliers(active);
    ActiveSetQp<Model> qp(wanted.of.segments, 0);
    const int expected = open == 0 ? wanted.contact(2) : -1;
    REQUIRE(qp.exchange_dependent(wanted.problem, wanted.kkt, -1, active) == expected);
    const std::vector<double> after = wanted.multipliers(active);
    CHECK(std::all_of(after.begin(), after.end(), [](double multiplier) { return multiplier >= 0; }));
    CHECK((after[0] == 0) == (open == 0));  // the first vanishes at 1 / 0.6, the second at 2 / 0.8
    Direction<Model> pushed(wanted.of.segments, 0);
    std::vector<double> change = after;
    for (int j = 0; j < wanted.count(); ++j) change[j] -= before[j];
    wanted.add_responses(change, pushed);
    wanted.step.clear();
    wanted.add_responses(before, wanted.step);
    CHECK(largest(flat<Model>(pushed.controls, pushed.mounts)) <= 1e-10 * wanted.size());
  }
}

#define CCR_MODELS PlanarPaper, PlanarRod, SpatialPaper, SpatialRod

TEST_CASE_TEMPLATE("the active set and multipliers are those that were chosen", Model, CCR_MODELS) {
  chosen_sets<Model>();
}
TEST_CASE_TEMPLATE("linearly dependent gaps leave the step unchanged", Model, CCR_MODELS) { dependent_gaps<Model>(); }
TEST_CASE_TEMPLATE("an infeasible program is given up", Model, CCR_MODELS) { no_answer<Model>(); }
TEST_CASE_TEMPLATE("a restoration is the smallest step that closes the gaps", Model, CCR_MODELS) {
  restorations<Model>();
}
TEST_CASE_TEMPLATE("a restoration closes every gap as far as it has to", Model, CCR_MODELS) { nearly_closed<Model>(); }
TEST_CASE_TEMPLATE("a dependent gap takes the place of an active one", Model, CCR_MODELS) { exchanges<Model>(); }

}  // namespace
}  // namespace ccr::testing
