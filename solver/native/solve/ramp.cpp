// Whether a task can be met: a steady pull from rest reaches its contact force.
#include <algorithm>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"
#include "tolerances.hpp"

namespace ccr {

template <class Model>
bool ModelContinuation<Model>::ramp_reaches_force(const Ramp& ramp, double* reached) {
  std::fill_n(reached, kSpace, 0.0);
  if (!(ramp.increment > 0)) return false;
  std::vector<double> start(layout_.size);
  if (rest(ramp.length, start.data()).status != Status::kConverged) return false;
  if (problem_.violation() > tolerances::kFeasibility * problem_.robot().max_length) return false;
  read_block(start.data());
  Command command{{}, ramp.length};
  for (int i = 1; i * ramp.increment < ramp.limit; ++i) {
    for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
      command.cables[k] = i * ramp.increment * ramp.direction[k];
    factorizations_before_ = newton_.factorizations();
    if (pursue(command) != Status::kConverged) return false;
    evaluate_present();
    Position force{};
    for (int j = 0; j < static_cast<int>(problem_.obstacles().size()); ++j)
      if (ramp.obstacle < 0 || j == ramp.obstacle) force += problem_.contact_force(present_.active, j);
    std::copy_n(force.v.begin(), kSpace, reached);
    if (problem_.touches_obstacle(present_.active) && norm(force) >= ramp.force) return true;
  }
  return false;
}

#define CCR_INSTANTIATE(Model) template bool ModelContinuation<Model>::ramp_reaches_force(const Ramp&, double*);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
