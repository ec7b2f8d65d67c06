// Motors with backlash and sensors with errors, of many episodes; formulas in docs/sensing.md.
#pragma once

#include <cmath>
#include <cstdint>

#include "transition/actuation.hpp"
#include "transition/arrays.hpp"

namespace ccr {

struct Sensors {
  // Columns of `numbers`.
  enum Number { kLatency, kBacklash, kLoss, kRigidity, kTensionNoise, kForceNoise, kResolution, kStart, kNumbers };

  RowsOf<const double> numbers, tension_zero, force_bias, pose_noise, pose_error;
  RowsOf<double> motor;           // [mm]
  RowsOf<bool> moved_in;          // whether each cable last moved in
  RowsOf<double> history;         // the last `kHistory` observations
  RowsOf<bool> starting;          // whether there is none yet
  const double* table = nullptr;  // of standard normal numbers
  std::int64_t table_size = 0;
  int cables = 0, space = 0, nodes = 0, turns = 0;

  static constexpr int kHistory = 8;
  static constexpr double kRounding = 1e-12;  // of a displacement: a stalled cable comes out of a step a last bit away

  explicit operator bool() const { return static_cast<bool>(numbers); }
  double number(int robot, Number which) const { return numbers[robot][which]; }
  int pose_size() const { return space + turns; }

  // Backlash of an actuated coordinate: that of the cables; the insertion has none.
  double play(const Actuation& actuation, int robot, int k) const {
    return k < actuation.commands ? number(robot, kBacklash) : 0.0;
  }

  // Moves the motors by an action within bounds and returns where that leaves an actuated coordinate.
  double apply_backlash(const Actuation& actuation, int robot, int k, double actuated, double increment) const {
    const double moved = actuation.bounded(k, motor[robot][k] + increment);
    motor[robot][k] = moved;
    const double half = play(actuation, robot, k) / 2;
    return actuation.bounded(k, std::min(std::max(actuated, moved - half), moved + half));
  }

  // Notes which way a cable has moved.
  void note_motion(int robot, int cable, double before, double after) const {
    if (std::abs(after - before) > kRounding * std::abs(before)) moved_in[robot][cable] = after > before;
  }

  // White noise of unit variance of a step of an episode.
  double white(int robot, std::int64_t time, int index) const {
    const std::int64_t size = cables + space + (nodes - 1) * pose_size();
    const auto start = static_cast<std::int64_t>(number(robot, kStart));
    return table[(start + time * size + index) % table_size];
  }

  // What a load cell at the motor reads of a nominal tension in the robot.
  template <class T>
  T tension(int robot, std::int64_t time, int cable, const T& nominal) const {
    const double kept = 1 - number(robot, kLoss);
    const double arriving = moved_in[robot][cable] ? kept : 1 / kept;
    return number(robot, kRigidity) * nominal / arriving + tension_zero[robot][cable] +
           white(robot, time, cable) * number(robot, kTensionNoise);
  }

  // What the force sensor reads of a component: bias, noise, then steps of its resolution, whose slope is that of the
  // line through them.
  template <class T>
  T force(int robot, std::int64_t time, int axis, const T& actual) const {
    const T read = actual + force_bias[robot][axis] + white(robot, time, cables + axis) * number(robot, kForceNoise);
    const double step = number(robot, kResolution), seen = value_of(read);
    return step > 0 ? read + (std::nearbyint(seen / step) * step - seen) : read;
  }

  // Error of a seen place or turn of the disk of a node.
  double pose(int robot, std::int64_t time, int node, int k) const {
    const double error = pose_error[robot][pose_size() * node + k];
    if (node == 0) return error;  // the base is clamped where everybody knows it
    return error + white(robot, time, cables + space + pose_size() * (node - 1) + k) * pose_noise[robot][k];
  }

  // Replaces the delayed columns of an observation by those of an earlier step, at the beginning of the first.
  void apply_latency(int robot, std::int64_t time, const std::uint8_t* delayed, double* row, std::size_t size) const {
    double* kept = history[robot];
    if (starting[robot][0])
      for (int k = 0; k < kHistory; ++k) std::copy_n(row, size, kept + size * k);
    starting[robot][0] = false;
    std::copy_n(row, size, kept + size * (time % kHistory));
    const auto late = static_cast<std::int64_t>(number(robot, kLatency));
    const double* earlier = kept + size * (((time - late) % kHistory + kHistory) % kHistory);
    for (std::size_t j = 0; j < size; ++j)
      if (delayed[j]) row[j] = earlier[j];
  }
};

}  // namespace ccr
