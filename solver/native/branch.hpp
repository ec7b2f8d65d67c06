// An equilibrium followed from cable displacement to cable displacement, as the robot would move.
#pragma once

#include <vector>

#include "newton.hpp"

namespace ccr {

enum class Status { kConverged, kSnapped, kStalled, kJammed, kFailed };

class Branch {
 public:
  Branch(const Robot& robot, const std::vector<Obstacle>& obstacles);

  // Starts from `present`, which must be an equilibrium, and takes the cable towards `target`.
  Status follow(double target);

  Iterate present;
  double tension = 0;
  int iterations = 0;                  // of Newton's method in the last follow
  std::vector<double>* trace = nullptr;  // when set, receives (x, y, angle) of every node at every accepted shape

  const Chain& chain() const { return newton_.chain; }  // evaluated at `present` after follow

 private:
  enum class Move { kAccepted, kRejected, kOverTension };

  Move attempt(double cable);
  bool attempt_free(double cable);
  bool stall();
  bool pass_end(double direction, bool& snapped);
  bool passable(double allowed) const;
  double measure_tension();
  void accept(double tension);
  void remember();
  void settle();

  Newton newton_;
  Iterate trial_;
  double trial_tension_ = 0;
  std::vector<Position> points_;  // of the last accepted shape
};

}  // namespace ccr
