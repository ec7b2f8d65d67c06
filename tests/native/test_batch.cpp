// Results of a batch are bit-identical to single robots, for any number of threads, batch size and order.
#include <doctest/doctest.h>

#include <cstring>

#include "batch.hpp"
#include "scenes.hpp"

namespace ccr::testing {
namespace {

template <int D>
struct Work {
  explicit Work(Random& random, const RobotNumbers& of, int count) : robot(make_robot<D>(of)), length(of.length) {
    for (int i = 0; i < count; ++i) {
      settings.push_back(random_setting<D>(random, of, kObstacles));
      for (int step = 1; step <= kSteps; ++step)
        wanted.push_back(towards(random, settings.back().obstacles[0].center, step));
    }
  }

  // Commands that pull more with each step, in space towards a point.
  std::array<double, D> towards(Random& random, const Position<D>& point, int step) const {
    const double pull = 1.1 * robot.offset * step / kSteps * random.uniform(0.9, 1.1);
    if constexpr (D == 2) return {pull, length};
    const double away = std::hypot(point[0], point[1]);
    std::array<double, D> command{};
    for (int k = 0; k < D - 1; ++k) command[k] = pull * point[k] / away;
    command[D - 1] = length;
    return command;
  }

  static constexpr int kObstacles = 2, kSteps = 8;

  // Blocks, statuses and iterations after all steps.
  struct Reached {
    std::vector<double> blocks;
    std::vector<int> statuses, iterations;

    bool operator==(const Reached& other) const {
      return blocks.size() == other.blocks.size() && statuses == other.statuses && iterations == other.iterations &&
             std::memcmp(blocks.data(), other.blocks.data(), blocks.size() * sizeof(double)) == 0;
    }
  };

  void follow(Continuation<D>& continuation, int robot, int step, Reached& to) const {
    double* block = to.blocks.data() + static_cast<std::size_t>(robot) * continuation.layout().size;
    const std::array<double, D> command = wanted[static_cast<std::size_t>(robot * kSteps + step)];
    const StepResult result = continuation.follow(block, command.data(), block);
    to.statuses[static_cast<std::size_t>(robot)] = static_cast<int>(result.status);
    to.iterations[static_cast<std::size_t>(robot)] += result.iterations;
  }

  Reached begin() const {
    Reached out;
    for (const Setting<D>& setting : settings)
      out.blocks.insert(out.blocks.end(), setting.rest.begin(), setting.rest.end());
    out.statuses.assign(settings.size(), 0);
    out.iterations.assign(settings.size(), 0);
    return out;
  }

  Reached alone() const {
    Reached out = begin();
    for (int i = 0; i < static_cast<int>(settings.size()); ++i) {
      const auto continuation = make_continuation<D>(robot, kObstacles);
      continuation->set_obstacles(settings[static_cast<std::size_t>(i)].obstacles);
      for (int step = 0; step < kSteps; ++step) follow(*continuation, i, step, out);
    }
    return out;
  }

  // Steps some robots at a time, from the first or from the last.
  Reached together(int threads, int at_a_time, bool backwards) const {
    const int count = static_cast<int>(settings.size());
    Batch<D> batch(robot, count, kObstacles, threads);
    for (int i = 0; i < count; ++i) batch.set_obstacles(i, settings[static_cast<std::size_t>(i)].obstacles);
    Reached out = begin();
    for (int step = 0; step < kSteps; ++step)
      for (int first = 0; first < count; first += at_a_time) {
        std::vector<int> robots;
        for (int k = first; k < std::min(first + at_a_time, count); ++k)
          robots.push_back(backwards ? count - 1 - k : k);
        batch.each(robots, [&](Continuation<D>& continuation, int k) {
          follow(continuation, robots[static_cast<std::size_t>(k)], step, out);
        });
      }
    return out;
  }

  Robot robot;
  double length;
  std::vector<Setting<D>> settings;
  std::vector<std::array<double, D>> wanted;
};

template <int D>
void compare(bool rod) {
  Random random(1);
  RobotNumbers of;
  of.rod = rod;
  const Work<D> work(random, of, 20);
  const auto alone = work.alone();
  int touching = 0;
  const std::size_t force = make_continuation<D>(work.robot, work.kObstacles)->layout().force.offset;
  for (std::size_t i = 0; i < work.settings.size(); ++i)
    touching += alone.blocks[i * work.settings[0].rest.size() + force] != 0;
  CHECK(touching > 3);
  for (const int threads : {1, 2, 4})
    for (const int at_a_time : {7, 20}) {
      CAPTURE(threads);
      CAPTURE(at_a_time);
      CHECK(work.together(threads, at_a_time, at_a_time == 7) == alone);
    }
}

TEST_CASE("a batch is bit-identical to single robots in the plane") {
  compare<2>(false);
  compare<2>(true);
}

TEST_CASE("a batch is bit-identical to single robots in space") { compare<3>(false); }

TEST_CASE("every robot of a call is worked on once") {
  Batch<2> batch(make_robot<2>({}), 100, 0, 4);
  std::vector<int> robots(100), visits(100);
  for (int i = 0; i < 100; ++i) robots[i] = i;
  for (int call = 0; call < 300; ++call) batch.each(robots, [&](Continuation<2>&, int k) { ++visits[k]; });
  for (const int count : visits) CHECK(count == 300);
}

// A step of a robot so finely divided that the continuation asks at every sub-step whether to give up.
TEST_CASE("an interrupted step writes nothing and leaves no trace in the next one") {
  const RobotNumbers of{.segments = 2000, .between = 9};
  const Robot robot = make_robot<2>(of);
  const std::vector<Obstacle<2>> obstacles{circle(robot, 44, 104, 15)};
  const double command[] = {6, of.length};
  const auto follow = [&](Continuation<2>& continuation, std::vector<double>& block) {
    return continuation.follow(block.data(), command, block.data());
  };
  const auto continuation = make_continuation<2>(robot, 1);
  continuation->set_obstacles(obstacles);
  std::vector<double> rest(continuation->layout().size);
  rest[continuation->layout().length.offset] = of.length;
  std::vector<double> whole = rest;
  CHECK_FALSE(follow(*continuation, whole).interrupted);
  for (const int polls : {0, 1, 5}) {
    int left = polls;
    continuation->set_interruption([&] { return left-- == 0; });
    std::vector<double> block = rest;
    CHECK(follow(*continuation, block).interrupted);
    CHECK(left == -1);
    CHECK(block == rest);
    continuation->set_interruption({});
    CHECK_FALSE(follow(*continuation, block).interrupted);
    CHECK(block == whole);
  }
}

TEST_CASE("the calling thread is woken while the others work") {
  Pool pool(2);
  std::atomic<bool> over = false;
  int polls = 0;
  pool.run(
      [&](int thread) {
        while (thread > 0 && !over) pool.beat();
      },
      [&] { over = ++polls >= 3; });
  CHECK(polls >= 3);
}

TEST_CASE("pools can be destroyed, used or unused") {
  for (int round = 0; round < 50; ++round) {
    Pool idle(3), pool(3);
    std::atomic<int> sum = 0;
    pool.run([&](int thread) { sum += thread + 1; });
    CHECK(sum == 10);
  }
}

}  // namespace
}  // namespace ccr::testing
