// The calls of the module solver._kernel on a batch: many robots, each in its own scene.
#pragma once

#include <nanobind/nanobind.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "batch.hpp"
#include "kernel_input.hpp"

namespace ccr::binding {

// Lets the interpreter handle signals now and then during a long call without its lock; true once one raised an error.
class Interruption {
 public:
  bool operator()() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(50)) return false;
    last_ = now;
    nb::gil_scoped_acquire held;
    return raised_ = PyErr_CheckSignals() != 0;
  }
  bool raised() const { return raised_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  bool raised_ = false;
};

template <int D>
void require_index(const Batch<D>& batch, int robot) {
  require(robot >= 0 && robot < batch.count(), "robot index " + std::to_string(robot) +
                                                   " is out of range; the batch has " + std::to_string(batch.count()) +
                                                   " robots");
}

template <int D>
void require_blocks(const Batch<D>& batch, const Blocks& blocks) {
  require(blocks.shape(0) == static_cast<std::size_t>(batch.count()) && blocks.shape(1) == batch.layout().size,
          "blocks must be (" + std::to_string(batch.count()) + ", " + std::to_string(batch.layout().size) + ")");
}

// Refuses arrays from which some robots cannot be moved.
template <int D>
void require_tables(const Batch<D>& batch, const std::vector<int>& robots, const Table& commands, const Blocks& blocks,
                    const Counts& statuses, const Counts& iterations, const Counts& factorizations) {
  const std::size_t count = batch.count(), size = batch.layout().size, cables = batch.layout().cables.size;
  require_blocks(batch, blocks);
  require(commands.shape(0) == count && commands.shape(1) == cables + 1,
          "commands must have a row of cables and length for each robot");
  require(statuses.shape(0) == count && iterations.shape(0) == count && factorizations.shape(0) == count,
          "statuses, iterations and factorizations must have a number for each robot");
  for (const int robot : robots) {
    require_index(batch, robot);
    require_sound(batch.layout(), blocks.data() + size * robot);
    require_command(commands.data() + (cables + 1) * robot, cables);
  }
}

// Works on these robots without the interpreter's lock, until a signal raises an error.
template <int D, class Work>
void each(Batch<D>& batch, const std::vector<int>& robots, Work work) {
  Interruption interruption;
  {
    nb::gil_scoped_release released;
    batch.each(robots, work, interruption);
  }
  if (interruption.raised()) throw nb::python_error();
}

// Where the slopes of steps go, if they are asked for: a row for each cable, and where there is one more for the
// length, of each robot that moves; and 1 for each whose slopes were found. The rows of the others are 0.
template <int D>
class SlopeTables {
 public:
  SlopeTables(const Batch<D>& batch, std::size_t robots, const std::optional<Output>& slopes,
              const std::optional<Counts>& found) {
    if (!slopes || !found) return;
    const std::size_t rows = robots > 0 ? slopes->size() / (robots * (batch.slope_row() + 1)) : 0;
    const std::size_t cables = batch.layout().cables.size;
    size_ = rows * (batch.slope_row() + 1);
    require(slopes->size() == robots * size_ && found->shape(0) == robots &&
                (robots == 0 || rows == cables || rows == cables + 1),
            "slopes must have a row for each cable, or for the length too, of each robot, and found a number");
    to_ = slopes->data();
    found_ = found->data();
    in_length_ = rows > cables;
  }

  // Of a robot, by its index in the list.
  StepSlopes of(int k) const { return {.rows = to_ ? to_ + size_ * k : nullptr, .in_length = in_length_}; }
  void finish(int k, const StepResult& result) const {
    if (!to_) return;
    found_[k] = result.differentiated;
    if (!result.differentiated) std::fill_n(to_ + size_ * k, size_, 0.0);
  }

 private:
  double* to_ = nullptr;
  std::int64_t* found_ = nullptr;
  std::size_t size_ = 0;  // of the rows of a robot
  bool in_length_ = false;
};

// A motion of the obstacles of one robot of a batch within its step.
template <int D>
using Motion = std::tuple<std::vector<Obstacle<D>>, std::vector<double>>;  // towards, and bounds

// Like `step`, for robots whose obstacles move meanwhile; writes which part of their way each robot's have gone.
template <int D>
void move(Batch<D>& batch, const std::vector<int>& robots, const std::vector<Motion<D>>& motions, const Table& commands,
          const Blocks& blocks, const Output& parts, const Counts& statuses, const Counts& iterations,
          const Counts& factorizations, const std::optional<Output>& slopes, const std::optional<Counts>& found) {
  const typename Batch<D>::Lock lock(batch);
  const std::size_t cables = batch.layout().cables.size, size = batch.layout().size;
  require_tables(batch, robots, commands, blocks, statuses, iterations, factorizations);
  const SlopeTables<D> tables(batch, robots.size(), slopes, found);
  require(motions.size() == robots.size() && parts.size() == robots.size(),
          "motions and parts must have an entry for each robot that moves");
  for (std::size_t k = 0; k < robots.size(); ++k) {
    const auto& [towards, bounds] = motions[k];
    require_points(batch.layout(), towards);
    require_motion(batch.scene(robots[k]), towards, bounds);
  }
  double *block = blocks.data(), *part = parts.data();
  const double* command = commands.data();
  std::int64_t *status = statuses.data(), *iterated = iterations.data(), *factored = factorizations.data();
  each(batch, robots, [&](Continuation<D>& continuation, int k) {
    const int i = robots[k];
    const auto& [towards, bounds] = motions[k];
    const StepResult result = continuation.move(block + size * i, command + (cables + 1) * i, towards, bounds,
                                                block + size * i, tables.of(k));
    if (result.interrupted) return;
    tables.finish(k, result);
    part[k] = result.scene;
    status[i] = static_cast<int>(result.status);
    iterated[i] = result.iterations;
    factored[i] = result.factorizations;
  });
}

template <int D>
void set_obstacles(Batch<D>& batch, int robot, std::vector<Obstacle<D>> obstacles) {
  const typename Batch<D>::Lock lock(batch);
  require_index(batch, robot);
  require(static_cast<int>(obstacles.size()) == batch.obstacles(),
          "the scene must have as many obstacles as the batch was made for, " + std::to_string(batch.obstacles()));
  require_points(batch.layout(), obstacles);
  batch.set_obstacles(robot, std::move(obstacles));
}

// Makes robots those of another batch of equal robots, and puts them among the same obstacles.
template <int D>
void copy(Batch<D>& batch, Batch<D>& other, const std::vector<int>& robots) {
  const typename Batch<D>::Lock lock(batch), others(other);
  require(&batch != &other && batch.obstacles() == other.obstacles() && batch.layout().size == other.layout().size,
          "the batches must be two, of equal robots among as many obstacles");
  for (const int robot : robots) {
    require_index(batch, robot);
    require_index(other, robot);
  }
  batch.copy(other, robots);
}

// Makes a robot another one with a block of the same fields; null for the batch's.
template <int D>
void set_robot(Batch<D>& batch, int index, const Robot* robot) {
  const typename Batch<D>::Lock lock(batch);
  require_index(batch, index);
  if (robot) {
    const auto numbers = [](const Robot& of) {
      return std::tuple(of.model, of.segments, of.rod.cables.size(), of.lines.size(), of.between);
    };
    require(numbers(*robot) == numbers(batch.robot()),
            "the robot must have the model and the numbers of segments, cables, lines and points of the batch's");
  }
  batch.set_robot(index, robot);
}

template <int D>
void step(Batch<D>& batch, const std::vector<int>& robots, const Table& commands, const Blocks& blocks,
          const Counts& statuses, const Counts& iterations, const Counts& factorizations,
          const std::optional<Output>& slopes, const std::optional<Counts>& found) {
  const typename Batch<D>::Lock lock(batch);
  const std::size_t size = batch.layout().size, cables = batch.layout().cables.size;
  require_tables(batch, robots, commands, blocks, statuses, iterations, factorizations);
  const SlopeTables<D> tables(batch, robots.size(), slopes, found);
  double* block = blocks.data();
  const double* command = commands.data();
  std::int64_t *status = statuses.data(), *iterated = iterations.data(), *factored = factorizations.data();
  each(batch, robots, [&](Continuation<D>& continuation, int k) {
    const int i = robots[k];
    const StepResult result =
        continuation.follow(block + size * i, command + (cables + 1) * i, block + size * i, tables.of(k));
    if (result.interrupted) return;
    tables.finish(k, result);
    status[i] = static_cast<int>(result.status);
    iterated[i] = result.iterations;
    factored[i] = result.factorizations;
  });
}

// Brings some robots to rest, each at its length.
template <int D>
void rest(Batch<D>& batch, const std::vector<int>& robots, const std::vector<double>& lengths, const Blocks& blocks,
          const Counts& statuses, const Counts& iterations, const Counts& factorizations) {
  const typename Batch<D>::Lock lock(batch);
  require_blocks(batch, blocks);
  const std::size_t count = batch.count(), size = batch.layout().size;
  require(statuses.shape(0) == count && iterations.shape(0) == count && factorizations.shape(0) == count,
          "statuses, iterations and factorizations must have a number for each robot");
  require_lengths(robots, lengths);
  for (const int robot : robots) require_index(batch, robot);
  double* block = blocks.data();
  std::int64_t *status = statuses.data(), *iterated = iterations.data(), *factored = factorizations.data();
  each(batch, robots, [&](Continuation<D>& continuation, int k) {
    const int i = robots[k];
    const StepResult result = continuation.rest(lengths[k], block + size * i);
    if (result.interrupted) return;
    status[i] = static_cast<int>(result.status);
    iterated[i] = result.iterations;
    factored[i] = result.factorizations;
  });
}

// Writes the slopes of some robots in their commands, and 1 for each whose slopes were found.
template <int D>
void slopes(Batch<D>& batch, const std::vector<int>& robots, const Blocks& blocks, const Output& slopes,
            const Counts& found) {
  const typename Batch<D>::Lock lock(batch);
  require_blocks(batch, blocks);
  const std::size_t count = robots.size(), size = batch.layout().size;
  const std::size_t each_row = (batch.layout().cables.size + 1) * batch.slope_row();
  require(slopes.size() == count * each_row && found.shape(0) == count,
          "slopes must have a row for each command of each robot, and found a number");
  for (const int robot : robots) {
    require_index(batch, robot);
    require_sound(batch.layout(), blocks.data() + size * robot);
  }
  const double* block = blocks.data();
  double* to = slopes.data();
  std::int64_t* ok = found.data();
  each(batch, robots, [&](Continuation<D>& continuation, int k) {
    ok[k] = continuation.slopes(block + size * robots[k], nullptr, false, to + each_row * k).found;
  });
}

template <int D>
void optimality(Batch<D>& batch, const Blocks& blocks, const Blocks& found) {
  const typename Batch<D>::Lock lock(batch);
  require_blocks(batch, blocks);
  require(found.shape(0) == blocks.shape(0) && found.shape(1) == 3,
          "found must have a row of three numbers for each robot");
  const std::size_t size = batch.layout().size;
  const double* block = blocks.data();
  double* to = found.data();
  std::vector<int> all(batch.count());
  std::iota(all.begin(), all.end(), 0);
  for (const int i : all) require_sound(batch.layout(), block + size * i);
  each(batch, all, [&](Continuation<D>& continuation, int k) {
    const Optimality at = continuation.optimality(block + size * k);
    const double numbers[] = {at.stationarity, at.gap, at.complementarity};
    std::copy_n(numbers, 3, to + 3 * k);
  });
}

template <int D>
std::vector<int> ramps_reach_forces(Batch<D>& batch, const std::vector<int>& robots, const Values& forces, int obstacle,
                                    const Table& directions, double increment, double limit,
                                    const std::vector<double>& lengths, const Blocks& reached) {
  const typename Batch<D>::Lock lock(batch);
  const std::size_t count = robots.size(), cables = batch.layout().cables.size;
  require(forces.shape(0) == count && directions.shape(0) == count && directions.shape(1) == cables &&
              reached.shape(0) == count && reached.shape(1) == D,
          "forces (k), directions (k, cables) and reached (k, d) must have a row for each robot");
  require_lengths(robots, lengths);
  for (const int robot : robots) require_index(batch, robot);
  std::vector<int> found(count);
  const double *force = forces.data(), *direction = directions.data();
  double* to = reached.data();
  each(batch, robots, [&](Continuation<D>& continuation, int k) {
    found[k] = continuation.ramp_reaches_force({.force = force[k],
                                                .obstacle = obstacle,
                                                .direction = direction + cables * k,
                                                .increment = increment,
                                                .limit = limit,
                                                .length = lengths[k]},
                                               to + D * k);
  });
  return found;
}

}  // namespace ccr::binding
