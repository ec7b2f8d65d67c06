// From actions to cables and back: the actuated coordinates of a robot.
#pragma once

#include <algorithm>
#include <vector>

#include "transition/dual.hpp"

namespace ccr {

// The actuated coordinates are a signed displacement for each command, and the length where the base inserts the robot.
struct Actuation {
  int cables, commands, actions;
  std::vector<double> matrix;                // displacement of each cable per command, (cables, commands)
  std::vector<double> recovery;              // of commands from cables that stop short, (commands, cables); or none
  std::vector<double> low, high, increment;  // of each actuated coordinate [mm]

  bool inserts() const { return actions > commands; }
  double bounded(int k, double value) const { return ccr::bounded(value, low[k], high[k]); }

  // Displacement of a cable.
  template <class T>
  T cable(const T* actuated, int cable) const {
    T sum = actuated[0] * matrix[commands * cable];
    for (int k = 1; k < commands; ++k) sum += actuated[k] * matrix[commands * cable + k];
    return sum;
  }

  // Work of tensions per command.
  template <class T>
  T work(const T* tensions, int command) const {
    T sum = tensions[0] * matrix[command];
    for (int c = 1; c < cables; ++c) sum += tensions[c] * matrix[commands * c + command];
    return sum;
  }

  template <class T>
  void write_command(const T* actuated, T* command) const {
    for (int c = 0; c < cables; ++c) command[c] = cable(actuated, c);
    if (inserts()) command[cables] = actuated[commands];
  }

  // Writes the actuated coordinates reached by a robot whose pulled cables may have stopped short; may be in place.
  void reached(const double* commanded, const double* cables_mm, double length, double* to) const {
    if (recovery.empty()) {
      for (int k = 0; k < commands; ++k) to[k] = bounded(k, cables_mm[k] / matrix[commands * k + k]);
    } else {
      double short_mm[kMost], out[kMost];
      for (int c = 0; c < cables; ++c) {
        const double wanted = cable(commanded, c);
        short_mm[c] = wanted > 0 ? std::min(cables_mm[c] - wanted, 0.0) : 0.0;
      }
      for (int k = 0; k < commands; ++k) {
        double sum = short_mm[0] * recovery[cables * k];
        for (int c = 1; c < cables; ++c) sum += short_mm[c] * recovery[cables * k + c];
        out[k] = bounded(k, commanded[k] + sum);
      }
      std::copy_n(out, commands, to);
    }
    if (inserts()) to[commands] = bounded(commands, length);
  }

  static constexpr int kMost = 32;  // cables or actuated coordinates
};

}  // namespace ccr
