// Whether a task that regulates an estimate can be met: a steady pull from rest brings the estimated force to its size.
#pragma once

#include <vector>

#include "transition/estimator.hpp"

namespace ccr {

struct Pull {
  const double* direction;  // commands per millimetre of pull
  double wanted;            // size of the estimated force [N]
  int target;               // obstacle whose force counts; -1 for all together
  double increment, limit;  // of the pull [mm]
};

// Pulls robots whose present equilibria are those at rest. They stay there; those of the estimator that nothing touches
// are moved, and what it has estimated before is lost.
template <int D>
class EstimatePulls {
 public:
  EstimatePulls(const Estimator<D>& estimator, const BatchArrays<D>& robots);

  // Whether a robot reaches its force, which is written as far as it gets; false too where the call was interrupted.
  bool reaches_force(int thread, int robot, const Pull& pull, double* force);

 private:
  struct Scratch {
    std::vector<double> block, command, actuated;
  };

  const Estimator<D>& estimator_;
  BatchArrays<D> robots_;
  std::vector<Scratch> scratch_;  // of each thread
  SlopeTable no_slopes_;
};

}  // namespace ccr
