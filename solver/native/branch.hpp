// An equilibrium followed from cable displacement to cable displacement, as the robot would move.
#pragma once

#include <cstddef>

#include <vector>

#include "newton.hpp"

namespace ccr {

enum class Status { kConverged, kSnapped, kStalled, kJammed, kFailed };

class Branch {
 public:
  Branch(const Robot& robot, const std::vector<Obstacle>& obstacles);

  // An equilibrium as one block of numbers, in this order: cable, tension, objective; sine of the shear angle of
  // each segment; x, y, angle of each node; x, y of each cable point; multiplier of each contact; gap of each contact.
  std::size_t block_size() const;

  // Takes the cable from the equilibrium in one block towards `target` and writes the one reached to another.
  Status follow(const double* from, double target, double* to);

  int iterations = 0;                    // of Newton's method in the last follow
  std::vector<double>* trace = nullptr;  // when set, receives (x, y, angle) of every node at every accepted shape

 private:
  enum class Move { kAccepted, kRejected, kOverTension };
  enum class End { kPassed, kSnapped, kBlocked, kOverTension };

  void load(const double* block);
  void store(double* block) const;
  Status follow(double target);
  Move attempt(double cable);
  bool attempt_free(double cable);
  bool approach_limit();
  bool at_limit() const;
  End pass_end(double increment);
  bool finish();
  bool passable(double allowed) const;
  double measure_tension() const;
  void accept();
  void remember();
  void settle();

  Newton newton_;
  Iterate present_, trial_;
  double tension_ = 0, trial_tension_ = 0;
  std::vector<Position> nodes_, levers_;  // of the block last read
  std::vector<Position> points_;          // of `present_`
  bool settled_ = false;          // whether the chain is evaluated at `present_`
};

}  // namespace ccr
