#include "transition/pull.hpp"

#include <algorithm>

#include "transition/dual.hpp"

namespace ccr {

template <int D>
EstimatePulls<D>::EstimatePulls(const Estimator<D>& estimator, const BatchArrays<D>& robots)
    : estimator_(estimator), robots_(robots) {
  const BlockLayout& layout = robots.layout();
  const std::size_t actions = estimator.actuation().actions;
  for (int k = 0; k < robots.batch->threads(); ++k)
    scratch_.push_back(
        {std::vector<double>(layout.size), std::vector<double>(layout.cables.size + 1), std::vector<double>(actions)});
}

template <int D>
bool EstimatePulls<D>::reaches_force(int thread, int robot, const Pull& pull, double* force) {
  const Actuation& actuation = estimator_.actuation();
  const BlockLayout& layout = robots_.layout();
  auto& [block, command, actuated] = scratch_[thread];
  std::copy_n(robots_.blocks[robot], layout.size, block.begin());
  const double length = block[layout.length.offset];
  command.back() = length;
  std::fill_n(force, D, 0.0);
  for (double pulled = 0; pulled < pull.limit;) {
    pulled = std::min(pulled + pull.increment, pull.limit);
    for (int k = 0; k < actuation.actions; ++k)
      actuated[k] = actuation.bounded(k, k < actuation.commands ? pulled * pull.direction[k] : length);
    actuation.write_command(actuated.data(), command.data());
    const StepResult result = robots_.batch->at(thread, robot).follow(block.data(), command.data(), block.data());
    if (result.interrupted) return false;
    estimator_.prepare(robot, block.data(), actuated.data());
    if (estimator_.moves_free(block.data()) && !estimator_.move(thread, robot, no_slopes_)) return false;
    const double *tensions = &block[layout.tensions.offset], *onsets = &block[layout.onset.offset];
    estimator_.update(robot, {block.data(), actuated.data(), tensions, onsets, estimator_.free_block(robot)});
    const double* known = &block[pull.target < 0 ? layout.force.offset : layout.forces.offset + D * pull.target];
    for (int d = 0; d < D; ++d) force[d] = estimator_.chosen(robot) * known[d];
    if (result.status != Status::kConverged) return false;
    if (norm<D>(force) >= pull.wanted) return true;
  }
  return false;
}

template class EstimatePulls<2>;
template class EstimatePulls<3>;

}  // namespace ccr
