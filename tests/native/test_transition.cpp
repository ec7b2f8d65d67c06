// Steps of whole environments: what is read of them, independence of each other and of threads, and slopes against
// central differences of their own steps.
#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <numeric>

#include "transitions.hpp"

namespace ccr::testing {
namespace {

constexpr int kActions = Environments::kActions, kSteps = 14;

// Actions that insert less and pull the cable to its contact, later in and out.
std::array<double, kActions> action_of(int number, int step) {
  Random random(1000 * static_cast<std::uint64_t>(number) + step);
  if (step < 8) return {random.uniform(0.7, 1.1), random.uniform(-0.5, -0.1)};
  return {random.uniform(-0.9, 0.9), random.uniform(-0.6, 0.6)};
}

std::vector<double> actions_of(const Environments& envs, const std::vector<int>& which, int step) {
  std::vector<double> out;
  for (const int k : which) {
    const auto action = action_of(envs.number(k), step);
    out.insert(out.end(), action.begin(), action.end());
  }
  return out;
}

std::vector<int> range(int count) {
  std::vector<int> out(count);
  std::iota(out.begin(), out.end(), 0);
  return out;
}

bool touches(const Environments& envs, int k) {
  const double* force = envs.robots.blocks[k] + envs.layout().force.offset;
  return force[0] != 0 || force[1] != 0;
}

TEST_CASE("environments do not depend on others, on their order, nor on the number of threads") {
  constexpr int kCount = 20;
  for (const EnvironmentOptions base :
       {EnvironmentOptions{}, EnvironmentOptions{.senses = false}, EnvironmentOptions{.differentiates = true}}) {
    std::vector<std::unique_ptr<Environments>> alone;
    int touching = 0;
    for (int number = 0; number < kCount; ++number) {
      Environments& one = *alone.emplace_back(std::make_unique<Environments>(std::vector{number}, base));
      for (int step = 0; step < kSteps; ++step) one.step({0}, actions_of(one, {0}, step));
      touching += touches(one, 0);
    }
    CHECK(touching > kCount / 2);
    for (const int threads : {1, 2, 3})
      for (const bool backwards : {false, true}) {
        std::vector<int> numbers = range(kCount);
        if (backwards) std::reverse(numbers.begin(), numbers.end());
        EnvironmentOptions options = base;
        options.threads = threads;
        Environments envs(numbers, options);
        const int at_a_time = backwards && threads == 1 ? 3 : kCount;
        for (int step = 0; step < kSteps; ++step)
          for (int first = 0; first < kCount; first += at_a_time) {
            std::vector<int> which = range(std::min(at_a_time, kCount - first));
            for (int& k : which) k = (7 * (k + first)) % kCount;
            envs.step(which, actions_of(envs, which, step));
          }
        CAPTURE(threads);
        CAPTURE(backwards);
        for (int k = 0; k < kCount; ++k) CHECK(envs.memory.same(k, alone[envs.number(k)]->memory, 0));
      }
  }
}

TEST_CASE("a step is that of the environments that are in the call") {
  Environments envs({0, 1, 2}, {});
  for (int step = 0; step < 6; ++step) envs.step({0, 1, 2}, actions_of(envs, {0, 1, 2}, step));
  const Memory before = envs.memory;
  envs.step({1}, {0.5, -0.5});
  CHECK(envs.memory.same(0, before, 0));
  CHECK_FALSE(envs.memory.same(1, before, 1));
  CHECK(envs.memory.same(2, before, 2));
  envs.memory.restore(before);
  envs.step({2, 0}, {0.5, -0.5, 0.25, 0.25});
  CHECK(envs.memory.same(1, before, 1));
  CHECK_FALSE(envs.memory.same(0, before, 0));
}

// Checks the readings of an environment with formulas written anew.
void check_readings(const Environments& envs, int k, bool estimated, int step) {
  const auto of = [k](const RowsOf<double>& rows) { return rows[k][0]; };
  const BlockLayout& layout = envs.layout();
  const double *block = envs.robots.blocks[k], *known = envs.model.blocks[k];
  const double ratio = envs.sensors.number(k, Sensors::kRigidity), desired = envs.episodes.desired[k][0];
  double size = 0, regulated[2];
  for (int d = 0; d < 2; ++d) {
    const double actual = ratio * block[layout.force.offset + d];
    const double estimate = of(envs.estimates.chosen) * known[layout.force.offset + d];
    CHECK(envs.readings.force_true[k][d] == actual);
    CHECK(envs.readings.force_est[k][d] == estimate);
    CHECK(envs.readings.force_paper[k][d] == of(envs.estimates.paper) * known[layout.force.offset + d]);
    size += actual * actual;
    regulated[d] = envs.readings.regulated[k][d];
    CHECK(regulated[d] == (estimated ? estimate : actual));
  }
  const double force = std::sqrt(regulated[0] * regulated[0] + regulated[1] * regulated[1]);
  CHECK(of(envs.readings.force) == doctest::Approx(force).epsilon(1e-12));
  CHECK(of(envs.readings.error) == doctest::Approx(std::abs(force - desired) / desired).epsilon(1e-12));
  CHECK(of(envs.readings.cost) == doctest::Approx(std::max(std::sqrt(size) - Environments::kLimit, 0.0)));
  const double* terms = envs.readings.terms[k];
  CHECK(of(envs.readings.reward) == doctest::Approx(std::accumulate(terms, terms + kTerms, 0.0)).epsilon(1e-12));
  const auto action = action_of(envs.number(k), step);
  double effort = 0;
  for (const double part : action) effort += std::min(part * part, 1.0) / kActions;
  CHECK(terms[4] == doctest::Approx(-0.01 * effort).epsilon(1e-12));
  CHECK(envs.times[k][0] == step + 1);
}

// Checks some entries of the observation, which come late if they are delayed.
void check_observation(const Environments& envs, int k, const std::vector<std::vector<double>>& rows) {
  const ObserverSettings& columns = envs.observer;
  const double* row = envs.row(k);
  const double tip = envs.robots.blocks[k][envs.layout().nodes.offset + columns.nodes.size - 3];
  const int steps = static_cast<int>(rows.size()), at = columns.nodes.size - 3;
  CHECK(std::abs(row[at] * Environments::kLength - tip) < 0.03);  // of the errors of a camera
  CHECK(row[at] * Environments::kLength != tip);
  CHECK(row[columns.encoders[0].first] == envs.sensors.motor[k][0] * (1 / Environments::kOffset));
  CHECK(row[columns.desired_force.first] == envs.episodes.desired[k][0] / Environments::kForce);
  CHECK(row[columns.tension.first] == envs.episodes.tensions[k][0] / columns.tension_n);
  const int late = static_cast<int>(envs.sensors.number(k, Sensors::kLatency));
  for (std::size_t j = 0; j < columns.source.size(); ++j) {
    const double shown = columns.delayed[j] ? rows[std::max(steps - 1 - late, 0)][j] : row[j];
    CHECK(envs.readings.observation[k][j] == static_cast<float>(std::clamp(shown, columns.low[j], columns.high[j])));
  }
}

TEST_CASE("readings and observations are those of the formulas") {
  for (const bool estimated : {false, true}) {
    Environments envs({0, 1, 2, 3}, {.estimated = estimated});
    std::vector<std::vector<double>> rows[4];
    int touching = 0, costly = 0;
    const auto keep = [&](int k) { rows[k].emplace_back(envs.row(k), envs.row(k) + envs.observer.source.size()); };
    for (int k = 0; k < 4; ++k) keep(k);
    for (int step = 0; step < 24; ++step) {
      envs.step(range(4), actions_of(envs, range(4), step));
      for (int k = 0; k < 4; ++k) {
        keep(k);
        check_readings(envs, k, estimated, step);
        check_observation(envs, k, rows[k]);
        touching += touches(envs, k);
        costly += envs.readings.cost[k][0] > 0;
      }
    }
    CHECK(touching > 20);
    CHECK(touching < 90);
    CHECK(costly > 10);
  }
}

}  // namespace
}  // namespace ccr::testing
