// The calls of the module solver._kernel with which episodes begin.
#pragma once

#include <vector>

#include "transition/pull.hpp"
#include "transition_calls.hpp"

namespace ccr::binding {

// Returns whether steady pulls from rest bring the estimated forces of some robots to their sizes, and writes how far.
template <int D>
std::vector<bool> pulls_reach_estimates(const Estimator<D>& estimator, const BatchArrays<D>& arrays,
                                        const Indices& robots, const Values& forces, int obstacle,
                                        const Table& directions, double increment, double limit,
                                        const Blocks& reached) {
  const std::vector<int> indices(robots.data(), robots.data() + robots.size());
  const std::size_t count = indices.size(), commands = estimator.actuation().commands;
  require(arrays.layout().size == estimator.layout().size && arrays.batch->count() == estimator.count(),
          "the robots must be those of the estimator");
  require(obstacle < arrays.batch->obstacles(), "obstacle must be an obstacle");
  require(increment > 0, "increment must be positive");
  require(forces.shape(0) == count && directions.shape(0) == count && directions.shape(1) == commands &&
              reached.shape(0) == count && reached.shape(1) == D,
          "forces (k), directions (k, commands) and reached (k, d) must have a row for each robot");
  const Session<D> session(*arrays.batch, nullptr, estimator.free().batch);
  for (const int robot : indices) {
    require_index(*arrays.batch, robot);
    require_sound(arrays.layout(), arrays.blocks[robot]);
  }
  EstimatePulls<D> pulls(estimator, arrays);
  std::vector<char> found(count);
  const double *force = forces.data(), *direction = directions.data();
  double* to = reached.data();
  Interruption interruption;
  {
    nb::gil_scoped_release released;
    arrays.batch->share(
        indices,
        [&](int thread, int k) {
          const Pull pull{direction + commands * k, force[k], obstacle, increment, limit};
          found[k] = pulls.reaches_force(thread, indices[k], pull, to + D * k);
        },
        interruption);
  }
  if (interruption.raised()) throw nb::python_error();
  return {found.begin(), found.end()};
}

// Turns white noise of robots, (k, disks, numbers), into an autoregressive process from disk to disk.
inline void correlate(const nb::ndarray<double, nb::ndim<3>, nb::c_contig, nb::device::cpu>& noise, double correlation,
                      double fresh) {
  const std::size_t each = noise.shape(1) * noise.shape(2), width = noise.shape(2);
  for (double* robot = noise.data(); robot < noise.data() + noise.size(); robot += each)
    for (std::size_t k = width; k < each; ++k) robot[k] = correlation * robot[k - width] + fresh * robot[k];
}

}  // namespace ccr::binding
