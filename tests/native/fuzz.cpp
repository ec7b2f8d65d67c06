// Random robots, scenes and commands, every step checked: fuzz SEED [SECONDS]. Episode k depends on the seed SEED + k
// alone; the last one is cut short when the time is up. Without a time, runs the one episode of the seed, to reproduce
// a failure.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "scenes.hpp"

// Defined in builds with a sanitizer: sets what is called before it ends the process.
extern "C" void __sanitizer_set_death_callback(void (*)()) __attribute__((weak));

namespace ccr::testing {
namespace {

constexpr int kSteps = 100;           // of an episode
constexpr double kLeastGap = -1e-12;  // over the robot's length; an active gap is at most as large
constexpr double kLimitBand = 1e-9;   // excess of a tension over its limit, as a fraction of it
constexpr int kStatuses = 5;

constexpr double kOptimal = 1e-8;  // stationarity and complementarity, without units

using Clock = std::chrono::steady_clock;

std::uint64_t present = 0;  // seed of the current episode

void report_seed() {
  std::fprintf(stderr, "fuzz: failed in the episode of seed %llu\n", static_cast<unsigned long long>(present));
}

struct Tally {
  long episodes = 0, steps = 0, touching = 0, iterations = 0;
  long statuses[kStatuses] = {};
  std::uint64_t seen[kStatuses] = {};  // seed of the last episode with each status
  int hardest = 0;                     // largest number of factorisations in a step
};

template <int D>
const char* fault(const Robot& robot, const BlockLayout& layout, int status, const std::vector<double>& block) {
  if (status < 0 || status >= kStatuses) return "an unknown status";
  for (const double number : block)
    if (!std::isfinite(number)) return "a number that is not finite";
  if (layout.gaps.size > 0 && block[layout.clearance.offset] < kLeastGap * robot.max_length)
    return "a point in an obstacle";
  for (std::size_t c = 0; c < layout.gaps.size; ++c) {
    if (block[layout.multipliers.offset + c] < 0) return "a negative multiplier";
    if (block[layout.gaps.offset + c] < block[layout.clearance.offset]) return "a gap below the smallest one";
  }
  for (int k = 0; k < D - 1; ++k) {
    const double tension = block[layout.tensions.offset + k];
    if (!(tension <= robot.max_tension * (1 + kLimitBand)) && block[k] != 0) return "a tension beyond its limit";
  }
  return nullptr;
}

const char* fault(const ccr::Optimality& found) {
  if (!(found.gap <= -kLeastGap)) return "an active gap that is open";
  if (!(found.stationarity <= kOptimal)) return "forces that are not in equilibrium";
  if (!(found.complementarity <= kOptimal)) return "a multiplier on an open gap";
  return nullptr;
}

template <int D>
bool run(Random& random, Clock::time_point end, Tally& tally) {
  const RobotNumbers of = random_robot<D>(random);
  const Setting<D> setting = random_setting<D>(random, of, random.integer(1, 6));
  const auto continuation = make_continuation<D>(setting.robot, static_cast<int>(setting.obstacles.size()));
  continuation->set_obstacles(setting.obstacles);
  const BlockLayout& layout = continuation->layout();
  std::vector<double> now = setting.rest, to = now;
  Commands<D> commands(random, of);
  for (int step = 0; step < kSteps && Clock::now() < end; ++step) {
    const std::array<double, D> command = commands.next(now);
    const StepResult result = continuation->follow(now.data(), command.data(), to.data());
    const int status = static_cast<int>(result.status);
    const char* why = fault<D>(setting.robot, layout, status, to);
    const Optimality optimality = continuation->optimality(to.data());
    if (!why) why = fault(optimality);
    if (why) {
      std::fprintf(stderr, "fuzz: %s in step %d (status %d, robot of %.4g mm, %d segments, %s, %zu obstacles)\n", why,
                   step, status, of.length, of.segments,
                   D == 3   ? "space"
                   : of.rod ? "rod"
                            : "paper",
                   setting.obstacles.size());
      std::fprintf(stderr, "fuzz: tension %.12g of its limit, stationarity %.3g, gap %.3g L, complementarity %.3g\n",
                   to[layout.tensions.offset] / of.max_tension, optimality.stationarity, optimality.gap,
                   optimality.complementarity);
      return false;
    }
    ++tally.steps;
    ++tally.statuses[status];
    tally.seen[status] = present;
    tally.iterations += result.iterations;
    tally.hardest = std::max(tally.hardest, result.factorizations);
    tally.touching +=
        std::any_of(&to[layout.force.offset], &to[layout.force.offset] + D, [](double part) { return part != 0; });
    std::swap(now, to);
  }
  return true;
}

bool run_episode(std::uint64_t seed, Clock::time_point end, Tally& tally) {
  present = seed;
  Random random(seed);
  ++tally.episodes;
  return random.chance(0.5) ? run<2>(random, end, tally) : run<3>(random, end, tally);
}

}  // namespace
}  // namespace ccr::testing

int main(int count, char** arguments) {
  using namespace ccr::testing;
  if (count < 2 || count > 3) {
    std::fprintf(stderr, "usage: fuzz SEED [SECONDS]\n");
    return 2;
  }
  if (__sanitizer_set_death_callback) __sanitizer_set_death_callback(report_seed);
  const std::uint64_t seed = std::strtoull(arguments[1], nullptr, 10);
  const bool once = count == 2;
  const auto time =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(once ? 0 : std::atof(arguments[2])));
  const auto end = once ? Clock::time_point::max() : Clock::now() + time;
  Tally tally;
  do {
    if (!run_episode(seed + static_cast<std::uint64_t>(tally.episodes), end, tally)) {
      report_seed();
      return 1;
    }
  } while (!once && Clock::now() < end);
  std::printf(
      "fuzz: %ld episodes, %ld steps, %ld of them in contact, %ld iterations, at most %d factorisations in a step; "
      "statuses",
      tally.episodes, tally.steps, tally.touching, tally.iterations, tally.hardest);
  for (int k = 0; k < kStatuses; ++k) {
    std::printf(" %ld", tally.statuses[k]);
    if (k > 2 && tally.statuses[k] > 0) std::printf(" (seed %llu)", static_cast<unsigned long long>(tally.seen[k]));
  }
  std::printf("\n");
}
