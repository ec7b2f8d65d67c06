// Arrays with a row for each episode, which the caller owns, and batches whose equilibria stand in such arrays.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "batch.hpp"

namespace ccr {

// Rows of equal width, one for each episode.
template <class T>
struct RowsOf {
  T* data = nullptr;
  std::size_t width = 0;
  T* operator[](std::size_t row) const { return data + width * row; }
  explicit operator bool() const { return data != nullptr; }
};

// Slopes of the blocks of the robots of a batch in their commands: a row for each cable, and for the length where it is
// commanded.
class SlopeTable {
 public:
  enum class Kind : std::uint8_t { kUnknown, kNone, kFound };

  SlopeTable() = default;
  SlopeTable(int robots, int commands, int numbers)
      : commands_(commands),
        numbers_(numbers),
        kinds_(robots, Kind::kUnknown),
        slopes_(static_cast<std::size_t>(robots) * commands * (numbers + 1)) {}

  explicit operator bool() const { return !kinds_.empty(); }
  int commands() const { return commands_; }
  int width() const { return numbers_ + 1; }  // the last one is the slope of the clearance
  double* rows(int robot) { return slopes_.data() + static_cast<std::size_t>(robot) * commands_ * width(); }
  Kind& kind(int robot) { return kinds_[robot]; }

 private:
  int commands_ = 0, numbers_ = 0;
  std::vector<Kind> kinds_;
  std::vector<double> slopes_;
};

// A batch, and the arrays that its robots are moved in.
template <int D>
struct BatchArrays {
  Batch<D>* batch = nullptr;
  RowsOf<double> blocks, commands;
  std::int64_t *statuses = nullptr, *iterations = nullptr, *factorizations = nullptr;

  const BlockLayout& layout() const { return batch->layout(); }
  SlopeTable make_slopes(bool in_length) const {
    return {batch->count(), static_cast<int>(layout().cables.size) + in_length, batch->slope_row()};
  }

  // Moves a robot to its command, and finds the slopes of the step where there is a table of them; false where the call
  // was interrupted, and the robot is where it was.
  bool follow(int thread, int robot, SlopeTable& slopes) const {
    Continuation<D>& continuation = batch->at(thread, robot);
    StepSlopes to;
    if (slopes) to = {slopes.rows(robot), slopes.commands() > static_cast<int>(layout().cables.size)};
    const StepResult result = continuation.follow(blocks[robot], commands[robot], blocks[robot], to);
    if (result.interrupted) return false;
    statuses[robot] = static_cast<int>(result.status);
    iterations[robot] = result.iterations;
    factorizations[robot] = result.factorizations;
    if (slopes) slopes.kind(robot) = result.differentiated ? SlopeTable::Kind::kFound : SlopeTable::Kind::kNone;
    return true;
  }

  // Finds the slopes of a robot where it is, by a step that does not move it.
  void differentiate(int thread, int robot, SlopeTable& slopes) const {
    const double* block = blocks[robot];
    std::vector<double> there(layout().size),
        command(block + layout().cables.offset, block + layout().cables.offset + layout().cables.size);
    command.push_back(block[layout().length.offset]);
    const StepSlopes to{slopes.rows(robot), slopes.commands() > static_cast<int>(layout().cables.size)};
    const StepResult result = batch->at(thread, robot).follow(block, command.data(), there.data(), to);
    slopes.kind(robot) = result.differentiated ? SlopeTable::Kind::kFound : SlopeTable::Kind::kNone;
  }

  // The same of a robot that something else has moved, if its step converged.
  void differentiate_step(int thread, int robot, SlopeTable& slopes) const {
    if (slopes.kind(robot) != SlopeTable::Kind::kUnknown) return;
    if (statuses[robot] == static_cast<int>(Status::kConverged)) return differentiate(thread, robot, slopes);
    slopes.kind(robot) = SlopeTable::Kind::kNone;
  }
};

}  // namespace ccr
