// Random robots, scenes and commands, every step looked at: fuzz SEED SECONDS. Episode k has the seed SEED + k and depends
// on nothing else, so that `fuzz K 0` shows the one that failed again.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstdint>

#include "scenes.hpp"

// Of the sanitizers, where there are any: what to do before one ends the process.
extern "C" void __sanitizer_set_death_callback(void (*)()) __attribute__((weak));

namespace ccr::testing {
namespace {

constexpr int kSteps = 100;            // of an episode
constexpr double kLeastGap = -1e-12;   // over the length of the robot
constexpr double kLimitBand = 1e-9;    // by which a tension may be above its limit, as a fraction
constexpr int kStatuses = 5;

std::uint64_t present = 0;  // seed of the episode under way

void tell() { std::fprintf(stderr, "fuzz: failed in the episode of seed %llu\n", static_cast<unsigned long long>(present)); }

struct Tally {
  long episodes = 0, steps = 0, touching = 0, iterations = 0;
  long statuses[kStatuses] = {};
};

template <int D>
const char* fault(const Robot& robot, const View<D>& view, int status, const std::vector<double>& block) {
  if (status < 0 || status >= kStatuses) return "a status that there is not";
  for (const double number : block)
    if (!std::isfinite(number)) return "a number that is not finite";
  if (view.contacts > 0 && block[view.clearance] < kLeastGap * robot.max_length) return "a point in an obstacle";
  for (std::size_t c = 0; c < view.contacts; ++c) {
    if (block[view.multipliers + c] < 0) return "a contact that pulls";
    if (block[view.gaps + c] < block[view.clearance]) return "a gap below the smallest one";
  }
  for (int k = 0; k < D - 1; ++k) {
    const double tension = block[view.tensions + k];
    if (!(tension <= robot.max_tension * (1 + kLimitBand)) && block[k] != 0) return "a tension beyond its limit";
  }
  return nullptr;
}

template <int D>
bool run(Random& random, Tally& tally) {
  const RobotNumbers of = random_robot<D>(random);
  const Setting<D> setting = random_setting<D>(random, of, random.integer(1, 6));
  const auto follower = make_follower<D>(setting.robot, static_cast<int>(setting.obstacles.size()));
  follower->enter(setting.obstacles);
  const View<D> view(setting.robot, setting.obstacles.size());
  std::vector<double> now = setting.rest, to = now;
  Commands<D> commands(random, of);
  for (int step = 0; step < kSteps; ++step) {
    const std::array<double, D> command = commands.next(now);
    const int status = static_cast<int>(follower->follow(now.data(), command.data(), to.data()));
    if (const char* why = fault<D>(setting.robot, view, status, to)) {
      std::fprintf(stderr, "fuzz: %s in step %d (status %d, robot of %.4g mm, %d segments, %s%zu obstacles)\n", why, step,
                   status, of.length, of.segments, D == 3 ? "space, " : of.sliding ? "sliding, " : "uniform, ",
                   setting.obstacles.size());
      if (view.contacts > 0)
        std::fprintf(stderr, "fuzz: clearance %.3g L, tension %.12g of its limit\n", to[view.clearance] / of.length,
                     to[view.tensions] / of.max_tension);
      return false;
    }
    ++tally.steps;
    ++tally.statuses[status];
    tally.iterations += follower->iterations;
    for (int k = 0; k < D; ++k)
      if (to[view.force + static_cast<std::size_t>(k)] != 0) {
        ++tally.touching;
        break;
      }
    std::swap(now, to);
  }
  return true;
}

bool run_episode(std::uint64_t seed, Tally& tally) {
  present = seed;
  Random random(seed);
  ++tally.episodes;
  return random.chance(0.5) ? run<2>(random, tally) : run<3>(random, tally);
}

}  // namespace
}  // namespace ccr::testing

int main(int count, char** arguments) {
  using namespace ccr::testing;
  if (count != 3) {
    std::fprintf(stderr, "usage: fuzz SEED SECONDS\n");
    return 2;
  }
  if (__sanitizer_set_death_callback) __sanitizer_set_death_callback(tell);
  const std::uint64_t seed = std::strtoull(arguments[1], nullptr, 10);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(arguments[2]));
  Tally tally;
  do {
    if (!run_episode(seed + static_cast<std::uint64_t>(tally.episodes), tally)) {
      tell();
      return 1;
    }
  } while (std::chrono::steady_clock::now() < end);
  std::printf("fuzz: %ld episodes, %ld steps, %ld of them in contact, %ld iterations; statuses", tally.episodes, tally.steps,
              tally.touching, tally.iterations);
  for (const long number : tally.statuses) std::printf(" %ld", number);
  std::printf("\n");
}
