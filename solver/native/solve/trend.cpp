// The change of the equilibrium along its branch, from which the search for the next one starts.
#include <algorithm>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

// The difference quotient from `present_` to `trial_`; zero for a free robot and where the active set changed.
template <class Model>
void ModelContinuation<Model>::update_trend() {
  const ActiveSet &before = present_.active, &now = trial_.active;
  const double travelled = travel(present_.command, trial_.command);
  clear_trend();
  const bool known = bends_evenly_ && !problem_.touches_obstacle(now);
  if (travelled == 0 || trial_.command.length != present_.command.length || moves_obstacles(trial_.command) || known ||
      before.count != now.count || now.count > tolerances::kMaxTrend ||
      !std::equal(now.contact.begin(), now.contact.begin() + now.count, before.contact.begin()))
    return;
  const auto slope = [&](const auto& now, const auto& before, auto& slope) {
    for (std::size_t k = 0; k < slope.v.size(); ++k) slope[k] = (now[k] - before[k]) / travelled;
  };
  for (std::size_t i = 0; i < trend_.controls.size(); ++i)
    slope(trial_.controls[i], present_.controls[i], trend_.controls[i]);
  for (std::size_t m = 0; m < trend_.mounts.size(); ++m) slope(trial_.mounts[m], present_.mounts[m], trend_.mounts[m]);
  for (int j = 0; j < now.count; ++j) trend_.multipliers[j] = (now.multiplier[j] - before.multiplier[j]) / travelled;
}

template <class Model>
void ModelContinuation<Model>::clear_trend() {
  std::fill(trend_.controls.begin(), trend_.controls.end(), Control{});
  std::fill(trend_.mounts.begin(), trend_.mounts.end(), Position{});
  trend_.multipliers.fill(0);
}

// Moves `trial_` from `present_` along the trend, with multipliers >= 0.
template <class Model>
void ModelContinuation<Model>::extrapolate_trial() {
  has_trend_ = false;
  const double travelled = travel(present_.command, trial_.command);
  const auto extrapolate = [&](auto& at, const auto& slope) {
    for (std::size_t k = 0; k < slope.v.size(); ++k) at[k] += travelled * slope[k];
  };
  for (std::size_t i = 0; i < trend_.controls.size(); ++i) {
    extrapolate(trial_.controls[i], trend_.controls[i]);
    has_trend_ |= trial_.controls[i].v != present_.controls[i].v;
  }
  predicted_ = trial_.controls;
  for (std::size_t m = 0; m < trend_.mounts.size(); ++m) extrapolate(trial_.mounts[m], trend_.mounts[m]);
  for (int j = 0; j < std::min(trial_.active.count, tolerances::kMaxTrend); ++j)
    trial_.active.multiplier[j] = std::max(0.0, trial_.active.multiplier[j] + travelled * trend_.multipliers[j]);
}

#define CCR_INSTANTIATE(Model)                            \
  template void ModelContinuation<Model>::update_trend(); \
  template void ModelContinuation<Model>::clear_trend();  \
  template void ModelContinuation<Model>::extrapolate_trial();
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
