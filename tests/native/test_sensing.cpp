// Motors, cables and sensors against models of them that are written anew.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include "random.hpp"
#include "transition/sensors.hpp"

namespace ccr::testing {
namespace {

std::vector<double> random_numbers(Random& random, int count, double low, double high) {
  std::vector<double> out(count);
  for (double& number : out) number = random.uniform(low, high);
  return out;
}

// Four cables that two commands pull, and a base that inserts the robot.
Actuation random_actuation(Random& random, bool recovers) {
  return {.cables = recovers ? 4 : 2,
          .commands = 2,
          .actions = 3,
          .matrix = random_numbers(random, recovers ? 8 : 4, 0.5, 1.5),
          .recovery = recovers ? random_numbers(random, 8, -1, 1) : std::vector<double>{},
          .low = {-4, 0, 100},
          .high = {4, 5, 180},
          .increment = {0.5, 0.5, 2}};
}

TEST_CASE("commands displace cables by the matrix, and tensions work on commands by its transpose") {
  Random random(1);
  for (int round = 0; round < 50; ++round) {
    const Actuation actuation = random_actuation(random, true);
    const auto actuated = random_numbers(random, 3, -2, 2), tensions = random_numbers(random, 4, 0, 3);
    double command[5], power[2] = {0, 0};
    actuation.write_command(actuated.data(), command);
    CHECK(actuation.inserts());
    CHECK(command[4] == actuated[2]);
    for (int c = 0; c < 4; ++c) {
      const double expected = actuation.matrix[2 * c] * actuated[0] + actuation.matrix[2 * c + 1] * actuated[1];
      CHECK(command[c] == doctest::Approx(expected).epsilon(1e-14));
      CHECK(actuation.cable(actuated.data(), c) == command[c]);
      power[0] += tensions[c] * command[c];
    }
    for (int k = 0; k < 2; ++k) power[1] += actuation.work(tensions.data(), k) * actuated[k];
    CHECK(power[1] == doctest::Approx(power[0]).epsilon(1e-12));

    Dual<2> numbers[3], reached[5];
    for (int k = 0; k < 3; ++k) numbers[k] = actuated[k];
    for (int k = 0; k < 2; ++k) numbers[k].slopes[k] = 1;
    actuation.write_command(numbers, reached);
    for (int c = 0; c < 4; ++c) {
      CHECK(reached[c].value == command[c]);
      for (int k = 0; k < 2; ++k) CHECK(reached[c].slopes[k] == actuation.matrix[2 * c + k]);
    }
  }
}

TEST_CASE("a cable of its own command tells where this has got to") {
  const Actuation actuation{.cables = 2,
                            .commands = 2,
                            .actions = 2,
                            .matrix = {2, 0, 0, -0.5},
                            .recovery = {},
                            .low = {-1, -1},
                            .high = {1, 1},
                            .increment = {1, 1}};
  const double commanded[] = {0.75, -0.5}, cables[] = {1.25, 0.25}, beyond[] = {4, 4};
  double to[] = {7, 7};
  actuation.reached(commanded, cables, 150, to);
  CHECK_FALSE(actuation.inserts());
  CHECK(to[0] == 0.625);
  CHECK(to[1] == -0.5);
  actuation.reached(commanded, beyond, 150, to);
  CHECK(to[0] == 1);
  CHECK(to[1] == -1);
}

TEST_CASE("what a pulled cable stops short by is recovered, within bounds; a released one tells nothing") {
  Random random(2);
  int pulled = 0, clipped = 0;
  for (int round = 0; round < 200; ++round) {
    const Actuation actuation = random_actuation(random, true);
    std::vector<double> at = random_numbers(random, 3, -4, 5), cables(4), expected(at);
    for (int c = 0; c < 4; ++c) {
      const double wanted = actuation.matrix[2 * c] * at[0] + actuation.matrix[2 * c + 1] * at[1];
      const double missing = random.chance(0.5) ? random.uniform(-0.5, 2) : 0;
      cables[c] = wanted - missing;
      if (wanted <= 0 || missing <= 0) continue;
      for (int k = 0; k < 2; ++k) expected[k] -= missing * actuation.recovery[4 * k + c];
      ++pulled;
    }
    expected[2] = random.uniform(90, 190);
    double to[3];
    actuation.reached(at.data(), cables.data(), expected[2], to);
    actuation.reached(at.data(), cables.data(), expected[2], at.data());
    for (int k = 0; k < 3; ++k) {
      const double inside = std::clamp(expected[k], actuation.low[k], actuation.high[k]);
      clipped += inside != expected[k];
      CHECK(to[k] == doctest::Approx(inside).epsilon(1e-12));
      CHECK(at[k] == to[k]);
    }
  }
  CHECK(pulled > 100);
  CHECK(clipped > 20);
}

// Sensors of two robots with two cables and three nodes, in the plane, with what they read from.
struct Sensed {
  static constexpr int kRobots = 2, kCables = 2, kNodes = 3, kSpace = 2, kPose = 3, kColumns = 4;
  static constexpr int kNoise = kCables + kSpace + (kNodes - 1) * kPose;  // numbers of a step

  explicit Sensed(int table_size = 1) : table(table_size) {
    numbers.resize(kRobots * Sensors::kNumbers);
    for (int robot = 0; robot < kRobots; ++robot) number(robot, Sensors::kRigidity) = 1;
    sensors = {.numbers = {numbers.data(), Sensors::kNumbers},
               .tension_zero = {zero.data(), kCables},
               .force_bias = {bias.data(), kSpace},
               .pose_noise = {pose_noise.data(), kPose},
               .pose_error = {pose_error.data(), kPose * kNodes},
               .motor = {motor.data(), kCables + 1},
               .moved_in = {moved_in, kCables},
               .history = {history.data(), Sensors::kHistory * kColumns},
               .starting = {starting, 1},
               .table = table.data(),
               .table_size = table_size,
               .cables = kCables,
               .space = kSpace,
               .nodes = kNodes,
               .turns = 1};
  }
  Sensed(const Sensed&) = delete;

  double& number(int robot, Sensors::Number which) { return numbers[Sensors::kNumbers * robot + which]; }

  std::vector<double> numbers,
      zero = std::vector<double>(kRobots * kCables), bias = std::vector<double>(kRobots * kSpace),
      pose_noise = std::vector<double>(kRobots * kPose), pose_error = std::vector<double>(kRobots * kPose * kNodes),
      motor = std::vector<double>(kRobots * (kCables + 1)),
      history = std::vector<double>(kRobots * Sensors::kHistory * kColumns), table;
  bool moved_in[kRobots * kCables] = {}, starting[kRobots] = {true, true};
  Sensors sensors;
};

const Actuation kPulled{.cables = 2,
                        .commands = 2,
                        .actions = 3,
                        .matrix = {1, 0, 0, 1},
                        .recovery = {},
                        .low = {0, 0, 100},
                        .high = {2, 2, 180},
                        .increment = {0.1, 0.1, 1}};

TEST_CASE("a cable rests until the play is taken up, and its motor stops at the bounds") {
  Sensed sensed;
  sensed.number(1, Sensors::kBacklash) = 0.4;
  double &motor = sensed.motor[3], actuated = motor = 1;
  const auto move = [&](double by) { return actuated = sensed.sensors.apply_backlash(kPulled, 1, 0, actuated, by); };
  for (int k = 0; k < 2; ++k) CHECK(move(0.0625) == 1);  // half of the play on either side
  CHECK(move(0.125) == doctest::Approx(1.05).epsilon(1e-12));
  for (int k = 0; k < 6; ++k) CHECK(move(-0.0625) == doctest::Approx(1.05).epsilon(1e-12));  // all of it
  CHECK(move(-0.125) == doctest::Approx(0.95).epsilon(1e-12));
  for (int k = 0; k < 5; ++k) move(0.7);
  CHECK(motor == 2);
  CHECK(actuated == doctest::Approx(1.8).epsilon(1e-12));
  for (int k = 0; k < 5; ++k) move(-0.7);
  CHECK(motor == 0);
  CHECK(actuated == doctest::Approx(0.2).epsilon(1e-12));
  CHECK(sensed.sensors.apply_backlash(kPulled, 1, 0, -3, 0) >= 0);
}

TEST_CASE("the play of random motions is that of an operator that pushes and pulls") {
  Random random(3);
  Sensed sensed;
  sensed.number(0, Sensors::kBacklash) = 0.3;
  double cable = 1, motor = sensed.motor[1] = 1, actuated = 1;
  double length = 150, inserted = sensed.motor[2] = 150;
  for (int k = 0; k < 500; ++k) {
    const double by = random.uniform(-0.25, 0.25);
    motor = std::clamp(motor + by, 0.0, 2.0);
    if (motor - cable > 0.15) cable = motor - 0.15;
    if (cable - motor > 0.15) cable = motor + 0.15;
    cable = std::clamp(cable, 0.0, 2.0);
    actuated = sensed.sensors.apply_backlash(kPulled, 0, 1, actuated, by);
    CHECK(actuated == doctest::Approx(cable).epsilon(1e-12));
    CHECK(sensed.motor[1] == motor);
    inserted = std::clamp(inserted + 100 * by, 100.0, 180.0);
    length = sensed.sensors.apply_backlash(kPulled, 0, 2, length, 100 * by);
    CHECK(length == inserted);  // without play
  }
}

TEST_CASE("which way a cable last moved is kept while it stands") {
  Sensed sensed;
  const auto moves = [&](double before, double after) {
    sensed.sensors.note_motion(1, 1, before, after);
    return sensed.moved_in[3];
  };
  CHECK(moves(1, 1.1));
  CHECK(moves(1.1, 1.1));
  CHECK(moves(1.1, 1.1 * (1 - 1e-14)));
  CHECK_FALSE(moves(1.1, 1.0));
  CHECK_FALSE(moves(1.0, 1.0 + 1e-14));
  CHECK_FALSE(moves(0, 0));
  CHECK(moves(-1, -0.9));
  for (int other = 0; other < 3; ++other) CHECK_FALSE(sensed.moved_in[other]);
}

TEST_CASE("friction along the robot adds to the tension of a pulled cable and takes from that of a released one") {
  Sensed sensed;
  sensed.number(1, Sensors::kLoss) = 0.2;
  sensed.number(1, Sensors::kRigidity) = 1.5;
  sensed.zero[3] = 0.125;
  sensed.moved_in[3] = true;
  CHECK(sensed.sensors.tension(1, 4, 1, 2.0) == doctest::Approx(3 / 0.8 + 0.125).epsilon(1e-14));
  sensed.moved_in[3] = false;
  CHECK(sensed.sensors.tension(1, 4, 1, 2.0) == doctest::Approx(3 * 0.8 + 0.125).epsilon(1e-14));
  CHECK(sensed.sensors.tension(0, 4, 1, 2.0) == 2);
  Dual<2> nominal(2.0);
  nominal.slopes = {1, -3};
  const Dual<2> read = sensed.sensors.tension(1, 4, 1, nominal);
  CHECK(read.value == sensed.sensors.tension(1, 4, 1, 2.0));
  CHECK(read.slopes[0] == doctest::Approx(1.5 * 0.8).epsilon(1e-14));
  CHECK(read.slopes[1] == doctest::Approx(-4.5 * 0.8).epsilon(1e-14));
}

TEST_CASE("a force is read in steps of the resolution, after its bias") {
  Random random(4);
  Sensed sensed;
  sensed.number(0, Sensors::kResolution) = 0.25;
  sensed.bias[1] = 0.0625;
  sensed.bias[3] = -0.5;
  for (int k = 0; k < 200; ++k) {
    Dual<2> force(random.uniform(-2, 2));
    force.slopes = {2, 5};
    const Dual<2> read = sensed.sensors.force(0, k, 1, force);
    CHECK(read.value == sensed.sensors.force(0, k, 1, force.value));
    CHECK(std::abs(read.value - (force.value + 0.0625)) <= 0.125 * (1 + 1e-12));
    CHECK(std::abs(read.value / 0.25 - std::round(read.value / 0.25)) < 1e-12);
    CHECK(read.slopes == force.slopes);
    CHECK(sensed.sensors.force(1, k, 1, force.value) == force.value - 0.5);
  }
}

TEST_CASE("white noise goes through its table and wraps at the end, whatever the order of the calls") {
  constexpr int kSize = 7, kStart = 5, kSteps = 6;
  Sensed sensed(kSize);
  for (int k = 0; k < kSize; ++k) sensed.table[k] = 0.5 + k;
  sensed.number(1, Sensors::kStart) = kStart;
  std::vector<double> walked;
  int at = kStart;
  for (int k = 0; k < kSteps * Sensed::kNoise; ++k) {
    walked.push_back(sensed.table[at]);
    at = at + 1 == kSize ? 0 : at + 1;
  }
  for (int k = kSteps * Sensed::kNoise - 1; k >= 0; --k) {
    const int mixed = static_cast<int>((17L * k) % (kSteps * Sensed::kNoise));
    for (const int each : {k, mixed})
      CHECK(sensed.sensors.white(1, each / Sensed::kNoise, each % Sensed::kNoise) == walked[each]);
  }
  const std::int64_t late = 1'000'000'000'000;
  CHECK(sensed.sensors.white(1, late, 3) == sensed.table[(kStart + late % kSize * Sensed::kNoise + 3) % kSize]);
}

TEST_CASE("every sensor of a step has noise of its own, those of the base's pose none") {
  Sensed sensed(2 * Sensed::kNoise);
  for (std::size_t k = 0; k < sensed.table.size(); ++k) sensed.table[k] = 1 + static_cast<double>(k);
  sensed.number(0, Sensors::kTensionNoise) = sensed.number(0, Sensors::kForceNoise) = 1;
  std::fill(sensed.pose_noise.begin(), sensed.pose_noise.end(), 1.0);
  for (int k = 0; k < Sensed::kPose * Sensed::kNodes; ++k) sensed.pose_error[k] = 100 * k;
  std::set<double> seen;
  for (int step = 0; step < 2; ++step) {
    for (int c = 0; c < Sensed::kCables; ++c) seen.insert(sensed.sensors.tension(0, step, c, 0.0));
    for (int d = 0; d < Sensed::kSpace; ++d) seen.insert(sensed.sensors.force(0, step, d, 0.0));
    for (int node = 0; node < Sensed::kNodes; ++node)
      for (int k = 0; k < Sensed::kPose; ++k) {
        const double bias = 100 * (Sensed::kPose * node + k), noise = sensed.sensors.pose(0, step, node, k) - bias;
        if (node == 0)
          CHECK(noise == 0);
        else
          seen.insert(noise);
      }
  }
  CHECK(seen == std::set<double>(sensed.table.begin(), sensed.table.end()));
}

TEST_CASE("what comes late is that of earlier steps, at the beginning of an episode that of its first") {
  const std::uint8_t delayed[Sensed::kColumns] = {1, 0, 1, 0};
  for (int late = 0; late < Sensors::kHistory; ++late) {
    Sensed sensed;
    sensed.number(0, Sensors::kLatency) = late;
    sensed.number(1, Sensors::kLatency) = Sensors::kHistory - 1 - late;
    for (int episode = 0; episode < 2; ++episode) {
      for (bool& start : sensed.starting) start = true;
      for (int step = 0; step < 20 - 3 * episode; ++step)
        for (int robot = 0; robot < 2; ++robot) {
          const auto shown = [&](int when, int column) { return 1000.0 * episode + 100 * robot + when + 0.1 * column; };
          double row[Sensed::kColumns];
          for (int j = 0; j < Sensed::kColumns; ++j) row[j] = shown(step, j);
          sensed.sensors.apply_latency(robot, step, delayed, row, Sensed::kColumns);
          const int behind = robot == 0 ? late : Sensors::kHistory - 1 - late, earlier = std::max(step - behind, 0);
          for (int j = 0; j < Sensed::kColumns; ++j) CHECK(row[j] == shown(delayed[j] ? earlier : step, j));
        }
    }
  }
}

}  // namespace
}  // namespace ccr::testing
