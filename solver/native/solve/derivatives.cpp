// Slopes of the equilibrium in a block.
#include <algorithm>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

template <class Model>
int ModelContinuation<Model>::slope_row() const {
  const auto count = [](const BlockField& field) { return static_cast<int>(field.size); };
  const int obstacles = layout_.displacements.shape[0];
  return SlopeRow<Model>(problem_.robot().segments, count(layout_.multipliers), count(layout_.cables), obstacles)
      .size();
}

template <class Model>
int ModelContinuation<Model>::parameters() const {
  return static_cast<int>(layout_.cables.size) + 1 + ContactProblem::kMotions * layout_.displacements.shape[0];
}

// Lists the gaps that stay closed: of taut cables, of disks that meet, and of contacts. False where they are too many.
template <class Model>
bool ModelContinuation<Model>::find_held(const bool* held, ActiveSet& gaps) const {
  const ActiveSet& active = present_.active;
  gaps = active;
  if (!held) return active.count < tolerances::kMaxActive;
  gaps.count = 0;
  const auto add = [&](int contact) {
    if (gaps.count == tolerances::kMaxActive) return false;
    gaps.contact[gaps.count++] = contact;
    return true;
  };
  for (int j = 0; j < active.count; ++j)
    if (active.contact[j] >= problem_.contacts()) add(active.contact[j]);
  for (int contact = 0; contact < problem_.contacts(); ++contact)
    if (held[contact] && !add(contact)) return false;
  return active.count < tolerances::kMaxActive;
}

template <class Model>
SlopeResult ModelContinuation<Model>::slopes(const double* block, const bool* held, bool in_obstacles, double* to) {
  read_block(block);
  evaluate_present();
  ActiveSet gaps;
  if (!find_held(held, gaps)) return {};
  if (!slopes_ || slopes_->mounts() != problem_.mounts())
    slopes_ = std::make_unique<Slopes<Model>>(problem_.robot().segments, problem_.mounts());
  const int left_out = slopes_->differentiate(problem_, present_, gaps, in_obstacles, to);
  return {left_out >= 0, std::max(left_out, 0)};
}

#define CCR_INSTANTIATE(Model)                               \
  template int ModelContinuation<Model>::slope_row() const;  \
  template int ModelContinuation<Model>::parameters() const; \
  template SlopeResult ModelContinuation<Model>::slopes(const double*, const bool*, bool, double*);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
