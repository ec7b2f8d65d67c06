// No step allocates memory: the global operators count allocations.
#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "batch.hpp"
#include "scenes.hpp"
#include "transitions.hpp"

namespace {
std::atomic<long> allocations = 0;
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace ccr::testing {
namespace {

// A robot pulled along a path, its steps counted.
template <int D>
class Pulled {
 public:
  Pulled(const RobotNumbers& of, const std::vector<Obstacle<D>>& obstacles, bool differentiates = false)
      : of_(of),
        differentiates_(differentiates),
        obstacles_(obstacles),
        continuation_(make_continuation<D>(make_robot<D>(of), static_cast<int>(obstacles.size()))) {
    continuation_->set_obstacles(obstacles_);
    rows_.resize((continuation_->layout().cables.size + 1) * (continuation_->slope_row() + 1));
    now_ = to_ = rest_block(*continuation_, of.length);
    rest_ = now_;
  }

  // Pulls to a displacement in equal steps, in space along a direction, and counts.
  void pull(double to, int steps, double second = 0.4) {
    const double from = now_[0];
    for (int k = 1; k <= steps; ++k) {
      std::array<double, D> command;
      command[0] = from + (to - from) * k / steps;
      if (D == 3) command[1] = second * command[0];
      command[D - 1] = of_.length;
      const long before = allocations;
      const StepSlopes slopes{.rows = differentiates_ ? rows_.data() : nullptr, .in_length = true};
      const Status status = continuation_->follow(now_.data(), command.data(), to_.data(), slopes).status;
      allocated += allocations - before;
      ++met[static_cast<int>(status)];
      std::swap(now_, to_);
      touched += now_[continuation_->layout().force.offset] != 0;
    }
  }

  // Resets the counts and returns to rest.
  void begin() {
    now_ = rest_;
    allocated = touched = 0;
    met = {};
  }

  long allocated = 0, touched = 0;
  std::array<int, 5> met{};  // statuses

 private:
  RobotNumbers of_;
  bool differentiates_;
  std::vector<Obstacle<D>> obstacles_;
  std::unique_ptr<Continuation<D>> continuation_;
  std::vector<double> rest_, now_, to_, rows_;
};

// Pulls there and back twice, the first time to warm up; returns the counts of the second.
template <int D>
Pulled<D> twice(const RobotNumbers& of, const std::vector<Obstacle<D>>& obstacles, double to,
                bool differentiates = false) {
  Pulled<D> pulled(of, obstacles, differentiates);
  for (int round = 0; round < 2; ++round) {
    pulled.begin();
    pulled.pull(to, 40);
    pulled.pull(0, 40);
  }
  return pulled;
}

RobotNumbers prototype(bool rod = false) {
  RobotNumbers of;
  of.rod = rod;
  return of;
}

int met(const auto& pulled, Status status) { return pulled.met[static_cast<int>(status)]; }

TEST_CASE("a free robot's steps allocate nothing") {
  for (const bool rod : {false, true}) CHECK(twice<2>(prototype(rod), {}, 8).allocated == 0);
  CHECK(twice<3>(prototype(), {}, 6).allocated == 0);
}

TEST_CASE("steps in contact allocate nothing, stalls included") {
  for (const double spring : {0.0, 0.05}) {
    for (const bool rod : {false, true}) {
      RobotNumbers of = prototype(rod);
      of.max_tension = 5;
      const Robot robot = make_robot<2>(of);
      const auto pulled = twice<2>(of, {circle(robot, 44, 104, 15, spring), circle(robot, 90, 150, 10)}, 14);
      CHECK(pulled.allocated == 0);
      CHECK(pulled.touched > 20);
      if (spring == 0) CHECK(met(pulled, Status::kStalled) > 0);
    }
    const Robot robot = make_robot<3>(prototype());
    const auto pulled = twice<3>(prototype(), {sphere(robot, 40, 18, 104, 15, spring)}, 8);
    CHECK(pulled.allocated == 0);
    CHECK(pulled.touched > 20);
  }
}

TEST_CASE("steps with their slopes allocate nothing") {
  for (const double spring : {0.0, 0.05}) {
    for (const bool rod : {false, true}) {
      const Robot robot = make_robot<2>(prototype(rod));
      const auto pulled = twice<2>(prototype(rod), {circle(robot, 44, 104, 15, spring)}, 12, true);
      CHECK(pulled.allocated == 0);
      CHECK(pulled.touched > 20);
    }
    const Robot robot = make_robot<3>(prototype());
    const auto pulled = twice<3>(prototype(), {sphere(robot, 40, 18, 104, 15, spring)}, 8, true);
    CHECK(pulled.allocated == 0);
    CHECK(pulled.touched > 20);
  }
}

TEST_CASE("steps beside every shape allocate nothing") {
  Random random(1);
  const Robot plane = make_robot<2>(prototype()), space = make_robot<3>(prototype());
  for (int shape = 0; shape < kShapes<2>; ++shape) {
    CAPTURE(shape);
    CHECK(twice<2>(prototype(), {random_obstacle(random, plane, shape, Position<2>{{50, 100}}, 12, 0)}, 6).allocated ==
          0);
  }
  for (int shape = 0; shape < kShapes<3>; ++shape) {
    CAPTURE(shape);
    CHECK(twice<3>(prototype(), {random_obstacle(random, space, shape, Position<3>{{50, 20, 100}}, 12, 0)}, 6)
              .allocated == 0);
  }
}

TEST_CASE("snaps allocate nothing") {
  int snaps = 0;
  long allocated = 0;
  for (const bool rod : {false, true})
    for (double x = 30; x < 60; x += 3) {
      const Robot robot = make_robot<2>(prototype(rod));
      const auto pulled = twice<2>(prototype(rod), {circle(robot, x, 165, 10)}, 14);
      snaps += met(pulled, Status::kSnapped);
      allocated += pulled.allocated;
    }
  CHECK(snaps > 0);
  CHECK(allocated == 0);
}

void check_batch(bool rod, bool differ) {
  const RobotNumbers of = prototype(rod);
  RobotNumbers longer = of;
  longer.length = 190;
  const Robot robot = make_robot<2>(of), other = make_robot<2>(longer);
  constexpr int kCount = 64;
  Batch<2> batch(robot, kCount, 1, 2);
  std::vector<int> robots;
  for (int i = 0; i < kCount; ++i) {
    if (differ && i % 3 == 0) batch.set_robot(i, &other);
    batch.set_obstacles(i, {circle(robot, 44 + 0.1 * i, 104, 15)});
    robots.push_back(i);
  }
  std::vector<double> blocks(kCount * batch.layout().size);
  const auto step = [&](double cable) {
    batch.each(robots, [&](Continuation<2>& continuation, int k) {
      double* block = blocks.data() + k * batch.layout().size;
      const double command[] = {cable, of.length};
      if (cable == 0) block[batch.layout().length.offset] = of.length;
      continuation.follow(block, command, block);
    });
  };
  // Which thread takes which robot is random, so a thread may warm up in a later round: repeat until a round allocates
  // nothing.
  const auto round_allocates = [&] {
    const long before = allocations;
    for (double cable = 0; cable < 5; cable += 0.25) step(cable);
    for (double cable = 5; cable > 1; cable -= 0.25) step(cable);
    return allocations != before;
  };
  int rounds = 1;
  while (rounds <= 50 && round_allocates()) ++rounds;
  CHECK(rounds <= 50);
}

TEST_CASE("a batch's steps allocate nothing") { check_batch(false, false); }

TEST_CASE("a batch's steps allocate nothing where its robots differ") {
  for (const bool rod : {false, true}) check_batch(rod, true);
}

TEST_CASE("steps of environments allocate nothing, estimates and observations included") {
  for (const bool senses : {false, true}) {
    Environments envs({0, 1, 2}, {.senses = senses});
    const Memory rest = envs.memory;
    const std::vector<int> which{0, 1, 2};
    const std::vector<double> pull{0.9, -0.3, 0.8, -0.2, 0.7, -0.1}, release{-0.9, 0.3, -0.8, 0.2, -0.7, 0.1};
    long allocated = 0;
    int touching = 0;
    for (int round = 0; round < 2; ++round) {
      envs.memory.restore(rest);
      const long before = allocations;
      for (int step = 0; step < 24; ++step) {
        envs.step(which, step < 12 ? pull : release);
        touching += envs.readings.force_true[0][0] != 0;
      }
      allocated = allocations - before;
    }
    CHECK(allocated == 0);
    CHECK(touching > 6);
  }
}

}  // namespace
}  // namespace ccr::testing
