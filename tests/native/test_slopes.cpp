// Slopes of steps in their commands: of a robot that can be worked out by hand, against differences of steps, and where
// there are none.
#include <doctest/doctest.h>

#include "robots.hpp"
#include "solve/continuation.hpp"

namespace ccr::testing {
namespace {

// A robot among obstacles that is moved by steps, and the slopes of the last one.
template <int D>
class Stepped {
 public:
  Stepped(const RobotNumbers& of, std::vector<Obstacle<D>> obstacles, const Robot& robot = {})
      : robot_(robot.segments > 0 ? robot : make_robot<D>(of)),
        obstacles_(std::move(obstacles)),
        continuation_(make_continuation<D>(robot_, static_cast<int>(obstacles_.size()))),
        rows_((layout().cables.size + 1) * width()),
        block(layout().size) {
    continuation_->set_obstacles(obstacles_);
    REQUIRE(continuation_->rest(of.length, block.data()).status == Status::kConverged);
  }

  const BlockLayout& layout() const { return continuation_->layout(); }
  int width() const { return continuation_->slope_row() + 1; }

  StepResult step(const std::vector<double>& command) {
    return continuation_->follow(block.data(), command.data(), block.data(), {.rows = rows_.data(), .in_length = true});
  }

  // Goes to a command in several steps, as a jump might.
  StepResult go(const std::vector<double>& command, int steps = 30) {
    std::vector<double> from(block.begin(), block.begin() + static_cast<std::ptrdiff_t>(command.size()));
    StepResult result;
    for (int k = 1; k <= steps; ++k) {
      std::vector<double> next = from;
      for (std::size_t c = 0; c < from.size(); ++c) next[c] += (command[c] - from[c]) * k / steps;
      result = step(next);
    }
    return result;
  }

  // The numbers of a block that have slopes, in the order of a row, and those at another command nearby.
  std::vector<double> outputs(const std::vector<double>& of) const {
    std::vector<double> out(width(), 0.0);
    auto to = out.begin();
    const auto copy = [&](const BlockField& field) {
      to = std::copy_n(of.begin() + static_cast<std::ptrdiff_t>(field.offset), field.size, to);
    };
    copy(layout().nodes);
    if (D == 3) to += static_cast<std::ptrdiff_t>(layout().nodes.size);  // turns of the disks
    for (const BlockField* field :
         {&layout().multipliers, &layout().tensions, &layout().forces, &layout().displacements})
      copy(*field);
    out.back() = layout().multipliers.size > 0 ? of[layout().clearance.offset] : 0;
    return out;
  }
  std::vector<double> outputs_at(const std::vector<double>& command) const {
    std::vector<double> reached = block;
    REQUIRE(continuation_->follow(block.data(), command.data(), reached.data()).status == Status::kConverged);
    return outputs(reached);
  }

  // Rows of a step in all parameters, and those that the equilibrium has by itself.
  std::vector<double> step_rows(const std::vector<double>& command) {
    std::vector<double> rows(static_cast<std::size_t>(continuation_->parameters()) * width());
    const StepSlopes slopes{.rows = rows.data(), .in_length = true, .in_obstacles = true};
    REQUIRE(continuation_->follow(block.data(), command.data(), block.data(), slopes).differentiated);
    return rows;
  }
  std::vector<double> own_rows() {
    std::vector<double> rows(static_cast<std::size_t>(continuation_->parameters()) * (width() - 1));
    REQUIRE(continuation_->slopes(block.data(), nullptr, true, rows.data()).found);
    return rows;
  }

  // Row of the slopes in a cable, or in the length after them.
  const double* row(std::size_t parameter) const { return rows_.data() + parameter * width(); }
  double field(const BlockField& of, std::size_t k) const { return block[of.offset + k]; }

 private:
  Robot robot_;
  std::vector<Obstacle<D>> obstacles_;
  std::unique_ptr<Continuation<D>> continuation_;
  std::vector<double> rows_;

 public:
  std::vector<double> block;
};

// By central differences, extrapolated once; turns are compared in Python.
template <int D>
void check_differences(const Stepped<D>& stepped, const std::vector<double>& command, double touching) {
  constexpr double kStep = 0.02;
  const std::size_t turns = stepped.layout().nodes.size, nodes = turns;
  for (std::size_t parameter = 0; parameter < command.size(); ++parameter) {
    CAPTURE(parameter);
    std::vector<double> near[4];
    const double parts[] = {-2, -1, 1, 2};
    for (int k = 0; k < 4; ++k) {
      std::vector<double> moved = command;
      moved[parameter] += parts[k] * kStep;
      near[k] = stepped.outputs_at(moved);
    }
    const double* row = stepped.row(parameter);
    double largest = 0, force = 0;
    std::vector<double> difference(near[0].size());
    for (std::size_t k = 0; k < difference.size(); ++k) {
      difference[k] = (8 * (near[2][k] - near[1][k]) - (near[3][k] - near[0][k])) / (12 * kStep);
      largest = std::max(largest, std::abs(difference[k]));
    }
    for (std::size_t k = 0; k < difference.size(); ++k) {
      if (D == 3 && k >= nodes && k < nodes + turns) continue;
      CAPTURE(k);
      CHECK(std::abs(row[k] - difference[k]) <= 2e-7 * largest);
      if (k > nodes) force = std::max(force, std::abs(row[k]));
    }
    CHECK(largest > 0.1);
    CHECK(force > touching);
  }
}

// A segment of an even rod under one cable: an arc of length l and angle θ, whose holes at a distance a towards its
// centre are 2 (l/θ - a) sin θ/2 apart. What that is shorter than l, with its derivatives.
struct Taken {
  double value, slope, curvature;
};

Taken taken(double angle, double length, double offset) {
  const double s = std::sin(angle / 2), c = std::cos(angle / 2), l = length, q = angle;
  return {l - 2 * (l / q - offset) * s, 2 * l * s / (q * q) - (l / q - offset) * c,
          2 * l * (c / 2 / (q * q) - 2 * s / (q * q * q)) + l / (q * q) * c + (l / q - offset) * s / 2};
}

TEST_CASE("slopes of a free rod are those of its arcs") {
  RobotNumbers of;
  of.rod = true;
  of.segments = 6;
  of.length = 60;
  Stepped<2> stepped(of, {});
  const double cable = 4, l = of.length / of.segments, n = of.segments;
  REQUIRE(stepped.go({cable, of.length}).differentiated);
  double low = 1e-3, high = 1;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (n * taken(middle, l, of.offset).value < cable ? low : high) = middle;
  }
  const double angle = low, stiffness = of.rigidity / (2 * l);  // energy of a segment over θ²
  const Taken at = taken(angle, l, of.offset);
  const double turn = 1 / (n * at.slope);  // dθ/dc
  CHECK(stepped.field(stepped.layout().tensions, 0) == doctest::Approx(2 * stiffness * angle / at.slope));
  const double* row = stepped.row(0);
  const double chord = 2 * l / angle * std::sin(angle / 2),
               growth = l / angle * std::cos(angle / 2) - chord / angle;  // of the chord in θ
  double x = 0, y = 0;
  for (int i = 0; i < of.segments; ++i) {
    const double way = (i + 0.5) * angle;
    x += turn * (growth * std::sin(way) + chord * (i + 0.5) * std::cos(way));
    y += turn * (growth * std::cos(way) - chord * (i + 0.5) * std::sin(way));
    CHECK(row[3 * (i + 1)] == doctest::Approx(x).epsilon(1e-9));
    CHECK(row[3 * (i + 1) + 1] == doctest::Approx(y).epsilon(1e-9));
    CHECK(row[3 * (i + 1) + 2] == doctest::Approx(-(i + 1) * turn).epsilon(1e-9));
  }
  const double of_tension = 2 * stiffness * (at.slope - angle * at.curvature) / (at.slope * at.slope) * turn;
  CHECK(row[3 * (of.segments + 1)] == doctest::Approx(of_tension).epsilon(1e-9));
  CHECK(row[stepped.width() - 1] == 0);  // no obstacle, no clearance
}

TEST_CASE("slopes of steps in the plane are differences, with and without contact") {
  for (const bool rod : {false, true}) {
    CAPTURE(rod);
    RobotNumbers of;
    of.rod = rod;
    const Robot robot = make_robot<2>(of);
    for (const double spring : {0.0, 1.0}) {
      CAPTURE(spring);
      Stepped<2> touching(of, {circle(robot, 44, 104, 15, spring), circle(robot, 110, 60, 10)});
      const std::vector<double> command = {7, of.length};
      REQUIRE(touching.go(command).differentiated);
      REQUIRE(touching.field(touching.layout().force, 0) != 0);
      check_differences(touching, command, 1e-3);
    }
    Stepped<2> clear(of, {circle(robot, 80, 104, 15), circle(robot, 110, 60, 10)});
    const std::vector<double> command = {4, of.length};
    REQUIRE(clear.go(command).differentiated);
    REQUIRE(clear.field(clear.layout().force, 0) == 0);
    CHECK(clear.row(0)[clear.width() - 1] < -1);  // the gap closes
    check_differences(clear, command, 1e-3);
  }
}

TEST_CASE("slopes of steps in space are differences, with and without contact") {
  for (const bool rod : {false, true}) {
    CAPTURE(rod);
    RobotNumbers of;
    of.rod = rod;
    if (rod) of.cables = {0, kQuarterTurn};
    const Robot robot = make_robot<3>(of);
    const std::vector<double> pulled =
        rod ? std::vector<double>{7, 3, of.length} : std::vector<double>{6, 2.4, of.length};
    for (const double spring : {0.0, 1.0}) {
      CAPTURE(spring);
      Stepped<3> touching(of, {sphere(robot, 40, 18, 104, 15, spring)});
      REQUIRE(touching.go(pulled).differentiated);
      REQUIRE(touching.field(touching.layout().force, 0) != 0);
      check_differences(touching, pulled, 0);
    }
    Stepped<3> clear(of, {sphere(robot, 90, 60, 60, 15)});
    REQUIRE(clear.go(pulled).differentiated);
    REQUIRE(clear.field(clear.layout().force, 0) == 0);
    check_differences(clear, pulled, 0);
  }
}

TEST_CASE("slopes of a step in all parameters are those of its equilibrium") {
  for (const bool rod : {false, true}) {
    CAPTURE(rod);
    RobotNumbers of;
    of.rod = rod;
    const Robot robot = make_robot<2>(of);
    for (const double x : {44.0, 80.0}) {  // in contact, and clear
      Stepped<2> stepped(of, {circle(robot, x, 104, 15), circle(robot, 150, 60, 10, 0.5)});
      stepped.go({6, of.length});
      const std::vector<double> rows = stepped.step_rows({6.5, of.length}), own = stepped.own_rows();
      REQUIRE((stepped.field(stepped.layout().force, 0) != 0) == (x == 44.0));
      const int width = stepped.width(), count = static_cast<int>(rows.size()) / width;
      for (int row = 0; row < count; ++row)
        for (int k = 0; k + 1 < width; ++k)
          CHECK(rows[row * width + k] == doctest::Approx(own[row * (width - 1) + k]).epsilon(1e-9));
      // The gap (d² - r²) / 2r of a circle changes with the distance d of its centre, and with r; nothing else moves.
      const double gap = stepped.field(stepped.layout().clearance, 0);
      const auto clearance = [&](int motion) { return rows[(2 + motion) * width + width - 1]; };
      if (x == 44.0) continue;
      CHECK(std::hypot(clearance(0), clearance(1)) == doctest::Approx(std::sqrt(1 + 2 * gap / 15)));
      CHECK(clearance(2) == doctest::Approx(0));
      CHECK(clearance(3) == doctest::Approx(-1 - gap / 15));
      CHECK(clearance(4) == 0);
    }
  }
}

TEST_CASE("a step that stalls has no slopes") {
  RobotNumbers of;
  of.max_tension = 5;
  const Robot robot = make_robot<2>(of);
  Stepped<2> stepped(of, {circle(robot, 44, 104, 15)});
  CHECK(stepped.step({1, of.length}).differentiated);
  const StepResult stalled = stepped.go({14, of.length});
  CHECK(stalled.status == Status::kStalled);
  CHECK_FALSE(stalled.differentiated);
}

TEST_CASE("a cable at its least displacement counts as pulled") {
  for (const bool rod : {false, true}) {
    CAPTURE(rod);
    RobotNumbers of;
    of.rod = rod;
    Stepped<2> stepped(of, {});
    REQUIRE(stepped.step({1, of.length}).differentiated);
    REQUIRE(stepped.step({0, of.length}).differentiated);
    CHECK(stepped.row(0)[3 * of.segments + 2] == doctest::Approx(-1 / of.offset).epsilon(1e-9));
    const int pose = 3 * (of.segments + 1);
    // EI/L over a² in both: the rod's arcs and the paper's links take up aθ of their cables to first order.
    CHECK(stepped.row(0)[pose] == doctest::Approx(of.rigidity / (of.length * of.offset * of.offset)).epsilon(1e-9));
  }
}

// Two points of a planar rod on a wall: the motion of the last step decides whether a contact that just touches is
// kept.
TEST_CASE("slopes at a contact that only just touches are those of the side that the cable moves to") {
  RobotNumbers of;
  of.rod = true;
  const Robot robot = make_robot<2>(of);
  const std::vector<Obstacle<2>> obstacles = {circle(robot, 44, 104, 15)};
  Stepped<2> stepped(of, obstacles);
  double free = 3, touching = 6;
  for (int k = 0; k < 60; ++k) {
    const double middle = (free + touching) / 2;
    Stepped<2> there(of, obstacles);
    there.go({middle, of.length});
    (there.field(there.layout().force, 0) == 0 ? free : touching) = middle;
  }
  REQUIRE(stepped.go({touching, of.length}).differentiated);
  const std::vector<double> pulled(stepped.row(0), stepped.row(0) + stepped.width());
  const auto forward = [&](double sign) {
    constexpr double kStep = 1e-3;
    const auto here = stepped.outputs(stepped.block), one = stepped.outputs_at({touching + sign * kStep, of.length}),
               two = stepped.outputs_at({touching + 2 * sign * kStep, of.length});
    std::vector<double> slope(here.size());
    for (std::size_t k = 0; k < slope.size(); ++k) slope[k] = sign * (4 * one[k] - two[k] - 3 * here[k]) / (2 * kStep);
    return slope;
  };
  const auto check = [&](const std::vector<double>& slopes, double sign) {
    const std::vector<double> expected = forward(sign);
    for (std::size_t k = 0; k + 1 < slopes.size(); ++k) CHECK(slopes[k] == doctest::Approx(expected[k]).epsilon(1e-4));
  };
  check(pulled, 1);
  REQUIRE(stepped.step({touching + 0.3, of.length}).differentiated);
  REQUIRE(stepped.step({touching, of.length}).differentiated);
  const std::vector<double> released(stepped.row(0), stepped.row(0) + stepped.width());
  check(released, -1);
  const int force = stepped.width() - 1 - 2 * 2;  // before force and displacement of the obstacle
  CHECK(std::abs(pulled[force]) > 1e-3);
  CHECK(std::abs(released[force]) < 1e-9);
}

}  // namespace
}  // namespace ccr::testing
