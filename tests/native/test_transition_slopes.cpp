// Slopes of what is read after a step, against central differences of the step itself.
#include <doctest/doctest.h>

#include <cmath>

#include "transitions.hpp"

namespace ccr::testing {
namespace {

constexpr int kActions = Environments::kActions, kCount = 3;
constexpr double kStep = 2e-4;   // of an action, and of a coordinate [mm]
constexpr double kError = 2e-5;  // of a slope, relative to it or to one; about seven times the largest that is met

// What is differentiated, one kind after the other: forces, reward, and where sensing is not ideal the observation.
struct Readings {
  static Readings of(const Environments& envs, int k, bool senses) {
    Readings out;
    for (const RowsOf<double>* rows : {&envs.readings.force_true, &envs.readings.force_est, &envs.readings.regulated})
      for (int d = 0; d < 2; ++d) out.numbers.push_back((*rows)[k][d]);
    out.numbers.push_back(envs.readings.reward[k][0]);
    for (std::size_t j = 0; senses && j < envs.observer.source.size(); ++j) out.numbers.push_back(envs.row(k)[j]);
    const BlockField& flags = envs.layout().flags;
    for (const BatchArrays<2>* robots : {&envs.robots, &envs.model})
      out.flags.insert(out.flags.end(), robots->blocks[k] + flags.offset,
                       robots->blocks[k] + flags.offset + flags.size);
    const double force = envs.readings.force[k][0], desired = envs.readings.desired[k][0];
    for (const double kink : {1.0, 2.0}) out.flags.push_back(force > kink * desired);
    if (senses) out.flags.push_back(envs.sensors.moved_in[k][0]);
    return out;
  }
  static constexpr int kReward = 6, kObservation = 7;

  std::vector<double> numbers;
  std::vector<double> flags;  // what must be alike for a difference to tell a slope
};

// Slopes of the same in an input of the step.
std::vector<double> slopes_of(const Environments& envs, int k, int input, bool senses) {
  std::vector<double> out;
  for (const RowsOf<double>* rows : {&envs.slopes.force_true, &envs.slopes.force_est, &envs.slopes.regulated})
    for (int d = 0; d < 2; ++d) out.push_back((*rows)[k][2 * input + d]);
  out.push_back(envs.slopes.reward[k][input]);
  const std::size_t columns = envs.observer.source.size();
  for (std::size_t j = 0; senses && j < columns; ++j) out.push_back(envs.slopes.observation[k][columns * input + j]);
  return out;
}

// A step of three environments, taken again and again.
class Step {
 public:
  Step(EnvironmentOptions options, std::uint64_t seed) : envs_({0, 1, 3}, options), random_(seed), options_(options) {}

  void advance(int step) {
    for (double& part : action_) part = random_.uniform(-0.6, 0.6);
    for (int k = 0; k < kCount && step < 9; ++k) action_[kActions * k] = 0.9;
    for (int k = 0; k < kCount && step < 4; ++k) action_[kActions * k + 1] = -0.5;
    const Memory before = envs_.memory;
    envs_.step({0, 1, 2}, action_);
    const Memory after = envs_.memory;
    for (int k = 0; k < kCount; ++k) {
      if (!envs_.slopes.found[k][0]) continue;
      for (int part = 0; part < kActions; ++part) check(k, part, before, after);
    }
    envs_.memory.restore(after);
  }

  int touching = 0, free = 0, within_play = 0, differing = 0;

 private:
  bool senses() const { return options_.senses; }
  double* motor(int k) { return senses() ? envs_.sensors.motor[k] : envs_.episodes.actuated[k]; }

  Readings end(int k, const Memory& before, const std::vector<double>& action, double* moved, double by) {
    envs_.memory.restore(before);
    if (moved) *moved += by;
    envs_.step({k}, {action[kActions * k], action[kActions * k + 1]});
    return Readings::of(envs_, k, senses());
  }

  // Compares slopes with the difference of a step whose action, or a number before it, is moved.
  void compare(int k, int part, const Memory& before, double* moved, const std::vector<double>& slopes) {
    std::vector<double> up = action_, down = action_;
    if (!moved) up[kActions * k + part] += kStep;
    if (!moved) down[kActions * k + part] -= kStep;
    const Readings high = end(k, before, up, moved, kStep), low = end(k, before, down, moved, -kStep);
    if (high.flags != low.flags) return static_cast<void>(++differing);
    (high.numbers[0] == 0 && high.numbers[1] == 0 ? free : touching) += 1;
    for (std::size_t j = 0; j < slopes.size(); ++j) {
      double expected = (high.numbers[j] - low.numbers[j]) / (2 * kStep);
      if (j >= Readings::kObservation && std::abs(high.numbers[j]) > envs_.observer.high[0]) expected = 0;
      const double error = std::abs(slopes[j] - expected) / std::max(1.0, std::abs(expected));
      CAPTURE(k);
      CAPTURE(part);
      CAPTURE(j);
      CAPTURE(expected);
      CAPTURE(slopes[j]);
      CHECK(error < kError);
    }
  }

  void check(int k, int part, const Memory& before, const Memory& after) {
    envs_.memory.restore(after);
    const auto commanded = slopes_of(envs_, k, part, senses());
    const auto encoded = senses() ? slopes_of(envs_, k, kActions + part, true) : std::vector<double>(commanded.size());
    const double per_action = envs_.slopes.motor_per_action[k][part], effort = envs_.slopes.effort[k][part];
    const double per_motor = envs_.slopes.motor_per_motor[k][part], follows = envs_.slopes.follows[k][part];
    within_play += follows == 0;
    std::vector<double> in_action, in_motor, in_coordinate;
    for (std::size_t j = 0; j < commanded.size(); ++j) {
      const double both = encoded[j] + follows * commanded[j];
      in_action.push_back(per_action * both + (j == Readings::kReward ? effort : 0.0));
      in_motor.push_back(per_motor * both);
      in_coordinate.push_back((1 - follows) * commanded[j]);
    }
    compare(k, part, before, nullptr, in_action);
    compare(k, part, before, &motor(k)[part], in_motor);
    if (senses()) compare(k, part, before, &envs_.episodes.actuated[k][part], in_coordinate);
  }

  Environments envs_;
  Random random_;
  EnvironmentOptions options_;
  std::vector<double> action_ = std::vector<double>(kActions * kCount);
};

void check_steps(EnvironmentOptions options) {
  options.differentiates = true;
  options.resolves = false;
  Step step(options, 1);
  for (int k = 0; k < 20; ++k) step.advance(k);
  CHECK(step.touching > 100);
  CHECK(step.free > 50);
  CHECK(step.differing < 30);
  if (options.senses) CHECK(step.within_play > 3);
}

TEST_CASE("slopes of a step with sensors are those of its differences, of the estimate too") { check_steps({}); }

TEST_CASE("slopes of a step with sensors that regulates the true force are those of its differences") {
  check_steps({.estimated = false});
}

TEST_CASE("slopes of a step with ideal sensing are those of its differences") {
  for (const bool estimated : {false, true}) check_steps({.senses = false, .estimated = estimated});
}

}  // namespace
}  // namespace ccr::testing
