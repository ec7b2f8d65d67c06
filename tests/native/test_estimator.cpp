// Estimates of contact forces on blocks made by hand, against formulas written anew.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "random.hpp"
#include "robots.hpp"
#include "transition/estimator.hpp"

namespace ccr::testing {
namespace {

constexpr double kTravel = 8, kStep = 0.02, kLeast = 0.05, kNoise = 0.1;

const Actuation kOneCable{.cables = 1,
                          .commands = 1,
                          .actions = 1,
                          .matrix = {1},
                          .recovery = {},
                          .low = {0},
                          .high = {14},
                          .increment = {1}};

// An estimator of one planar robot with one cable and two obstacles, and blocks of it and of two free robots.
class Estimated {
 public:
  Estimated(bool by_contact, double friction, TipSlopes tip = TipSlopes::kFitted, bool learns = true)
      : robot_(make_robot<2>({.segments = 4})),
        batch_(robot_, 2, 0, 1),
        layout_(make_continuation<2>(robot_, 2)->layout()),
        free_blocks_(2 * batch_.layout().size),
        commands_(4) {
    const BatchArrays<2> free{.batch = &batch_,
                              .blocks = {free_blocks_.data(), batch_.layout().size},
                              .commands = {commands_.data(), 2},
                              .statuses = counts_,
                              .iterations = counts_ + 2,
                              .factorizations = counts_ + 4};
    const EstimatorSettings settings{.actuation = kOneCable,
                                     .learns = learns,
                                     .by_contact = by_contact,
                                     .alike = false,
                                     .pairs = false,
                                     .tip = tip,
                                     .fitted = {0.5, -7, 0.1},
                                     .friction = friction,
                                     .travel_mm = kTravel,
                                     .step_mm = kStep,
                                     .least_slope = kLeast,
                                     .tension_noise = kNoise,
                                     .between = 0};
    estimator.emplace(
        settings, layout_, 1, free,
        EstimatorArrays{
            {&chosen, 1}, {&paper, 1}, {&free_force, 1}, {&lever, 1}, {&products, 1}, {&squares, 1}, {lines_, 2}});
    block.resize(layout_.size);
  }
  Estimated(const Estimated&) = delete;

  const BlockLayout& layout() const { return layout_; }
  double* at(const BlockField& field) { return &block[field.offset]; }
  double* free_at(int row, BlockField BlockLayout::* field) {
    return &free_blocks_[batch_.layout().size * row + (batch_.layout().*field).offset];
  }
  const double* command(int row) const { return &commands_[2 * row]; }

  // Lets two points of a line press on an obstacle with a force, with multipliers as one to two.
  void press(int obstacle, int line, int node, double x, double y) {
    const int positions = layout_.multipliers.shape[2], points = 2 * positions;
    for (int k = 0; k < 2; ++k) {
      at(layout_.multipliers)[points * obstacle + positions * line + node + k] = 0.3 * (k + 1);
      at(layout_.flags)[positions * line + node + k] = 1;
    }
    at(layout_.forces)[2 * obstacle] = x;
    at(layout_.forces)[2 * obstacle + 1] = y;
    at(layout_.force)[0] += x;
    at(layout_.force)[1] += y;
  }

  // Places the nodes of both free robots at random, with their directions.
  void place_free(Random& random) {
    for (int row = 0; row < 2; ++row)
      for (int node = 0; node < layout_.nodes.shape[0]; ++node) {
        const double angle = random.uniform(-1, 1) * (row + 1);
        double *place = free_at(row, &BlockLayout::nodes) + 3 * node,
               *way = free_at(row, &BlockLayout::frames) + 2 * node;
        place[0] = 10 * node + random.uniform(-0.05, 0.05) * row;
        place[1] = 3 * node + random.uniform(-0.05, 0.05) * row;
        place[2] = angle;
        way[0] = std::cos(0.1 * node + kStep * angle);
        way[1] = std::sin(0.1 * node + kStep * angle);
      }
  }

  // How far a point of a line of the companion is from that of the free robot.
  Vec<2> moved(int line, int node) {
    Vec<2> out;
    for (int row = 0; row < 2; ++row)
      for (int d = 0; d < 2; ++d) {
        const double there = free_at(row, &BlockLayout::nodes)[3 * node + d] +
                             lines_[line] * free_at(row, &BlockLayout::frames)[2 * node + d];
        out[d] += row == 0 ? -there : there;
      }
    return out;
  }

  void update(double tension) {
    estimator->update(0, {block.data(), &actuated, &tension, &onset, free_blocks_.data()});
  }

  double actuated = 4, onset = 1.25, chosen = 0, paper = 0, free_force = 0, lever = 0, products = 2, squares = 2;
  std::vector<double> block;
  std::optional<Estimator<2>> estimator;

 private:
  Robot robot_;
  Batch<2> batch_;
  BlockLayout layout_;
  std::vector<double> free_blocks_, commands_;
  std::int64_t counts_[6] = {};
  double lines_[2] = {0, 8};  // backbone and cable
};

TEST_CASE("the estimate by eq. 11 does the virtual work of the load since contact began") {
  Estimated robot(false, 0.2);
  robot.press(1, 0, 2, -0.3, 0.4);
  robot.update(2.5);
  const double x = -0.3 - 0.2 * 0.4, y = 0.4 + 0.2 * -0.3, work = x * 0.5 + y * -7;
  CHECK(robot.paper == doctest::Approx(kTravel * (2.5 - 1.25) * 0.1 / work).epsilon(1e-12));
  CHECK(robot.paper < 0);  // the force of this block would pull at the robot
  CHECK(robot.chosen == robot.paper);
}

TEST_CASE("the estimate by eq. 11 takes the slopes of the tip from the block where it is told to") {
  Estimated robot(false, 0, TipSlopes::kBlock);
  robot.press(0, 0, 1, 0.1, 0.5);
  std::copy_n(std::array{0.25, -5.0, 0.125}.data(), 3, robot.at(robot.layout().tip_slopes));
  robot.update(2.5);
  CHECK(robot.estimator->takes_tip_slopes());
  CHECK(robot.paper == doctest::Approx(kTravel * 1.25 * 0.125 / (0.1 * 0.25 - 0.5 * 5)).epsilon(1e-12));
}

// Compares both estimates that need the free robots with what their contacts and tips do.
void check_works(Random& random, bool against) {
  Estimated robot(true, 0.3, TipSlopes::kDifferences);
  const double forces[2][2] = {{random.uniform(-1, 1), random.uniform(-1, 1)},
                               {random.uniform(-1, 1), random.uniform(-1, 1)}};
  const int nodes[] = {random.integer(1, 3), random.integer(1, 3)};
  robot.place_free(random);
  for (int j = 0; j < 2; ++j) robot.press(j, j, nodes[j], forces[j][0], forces[j][1]);
  robot.products = random.uniform(1, 3);
  *robot.free_at(0, &BlockLayout::tensions) = 0.75;
  const double step = -kStep;  // the companion of a pulled robot is pulled less
  double work = 0, size = 0, tip_work = 0, total[2] = {0, 0};
  for (int j = 0; j < 2; ++j) {
    for (int k = 0; k < 2; ++k)
      for (int d = 0; d < 2; ++d) work -= (k + 1) / 3.0 * forces[j][d] * robot.moved(j, nodes[j] + k)[d] / step;
    size += std::hypot(forces[j][0], forces[j][1]);
    for (int d = 0; d < 2; ++d) total[d] += forces[j][d];
  }
  const double tip[] = {total[0] - 0.3 * total[1], total[1] + 0.3 * total[0]};
  for (int d = 0; d < 2; ++d) tip_work -= tip[d] * robot.moved(0, 4)[d] / step;
  const double ratio = robot.products / robot.squares, lacks = against ? -0.5 : 0.5;
  const double tension = ratio * 0.75 + std::copysign(lacks, against ? -work : work);
  robot.update(tension);
  const double least = kLeast * size;
  CHECK(robot.free_force == doctest::Approx(0.75));
  CHECK(robot.lever == doctest::Approx(work / size).epsilon(1e-9));
  const double product = work * (tension - ratio * 0.75), load = tip_work * (tension - robot.onset);
  CHECK(robot.chosen == doctest::Approx(std::max(product, 0.0) / std::max(work * work, least * least)).epsilon(1e-9));
  const double floor = kLeast * std::hypot(total[0], total[1]);
  CHECK(robot.paper ==
        doctest::Approx(std::max(load, 0.0) / std::max(tip_work * tip_work, floor * floor)).epsilon(1e-9));
}

TEST_CASE("the estimate by contact does the work of what the tension lacks at the points that touch") {
  Random random(1);
  for (int k = 0; k < 40; ++k) check_works(random, k % 2 == 1);
}

TEST_CASE("companions are pulled less, of a robot at rest more") {
  Estimated robot(true, 0);
  robot.press(0, 0, 2, 0, 1);
  *robot.at(robot.layout().length) = 180;
  for (const double actuated : {4.0, 0.0}) {
    robot.estimator->prepare(0, robot.block.data(), &actuated);
    CHECK(robot.command(0)[0] == actuated);
    CHECK(robot.command(1)[0] == doctest::Approx(actuated > 0 ? actuated - kStep : kStep).epsilon(1e-14));
  }
}

TEST_CASE("the rigidity is learnt from a robot that nothing touches, which is its own free robot") {
  Estimated robot(true, 0);
  *robot.at(robot.layout().tensions) = 0.5;
  *robot.at(robot.layout().nodes) = 3;
  robot.estimator->prepare(0, robot.block.data(), &robot.actuated);
  for (int row = 0; row < 2; ++row) {
    CHECK(*robot.free_at(row, &BlockLayout::tensions) == 0.5);
    CHECK(*robot.free_at(row, &BlockLayout::nodes) == 3);
    CHECK(*robot.free_at(row, &BlockLayout::clearance) == kInfinity);
  }
  for (int k = 1; k <= 3; ++k) {
    robot.update(0.75);
    CHECK(robot.products == doctest::Approx(2 + k * 0.75 * 0.5 / (kNoise * kNoise)).epsilon(1e-12));
    CHECK(robot.squares == doctest::Approx(2 + k * 0.25 / (kNoise * kNoise)).epsilon(1e-12));
  }
  CHECK(robot.chosen == 0);
  CHECK(robot.paper == 0);
  CHECK(robot.lever == 0);
  CHECK(robot.free_force == 0.5);

  Estimated known(true, 0, TipSlopes::kFitted, false);
  *known.at(known.layout().tensions) = 0.5;
  known.update(0.75);
  CHECK(known.products == 2);
  CHECK(known.squares == 2);
}

}  // namespace
}  // namespace ccr::testing
