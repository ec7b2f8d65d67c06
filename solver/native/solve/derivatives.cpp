// Slopes of the equilibrium in a block.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

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
  if (!held) return active.count < kMaxActive;
  gaps.count = 0;
  const auto add = [&](int contact) {
    if (gaps.count == kMaxActive) return false;
    gaps.contact[gaps.count++] = contact;
    return true;
  };
  for (int j = 0; j < active.count; ++j)
    if (active.contact[j] >= problem_.contacts()) add(active.contact[j]);
  for (int contact = 0; contact < problem_.contacts(); ++contact)
    if (held[contact] && !add(contact)) return false;
  return active.count < kMaxActive;
}

template <class Model>
Slopes<Model>& ModelContinuation<Model>::prepare_slopes() {
  const std::size_t mounts = problem_.mounts();
  if (slopes_.size() <= mounts) slopes_.resize(mounts + 1);
  if (!slopes_[mounts]) slopes_[mounts] = std::make_unique<Slopes<Model>>(problem_.robot().segments, mounts);
  return *slopes_[mounts];
}

template <class Model>
SlopeResult ModelContinuation<Model>::slopes(const double* block, const bool* held, bool in_obstacles, double* to) {
  read_block(block);
  evaluate_present();
  ActiveSet gaps;
  if (!find_held(held, gaps)) return {};
  const int left_out = prepare_slopes().differentiate(problem_, present_, gaps, {.obstacles = in_obstacles}, to);
  return {left_out >= 0, std::max(left_out, 0)};
}

// Slopes of the equilibrium that a step has reached and written to a block.
template <class Model>
bool ModelContinuation<Model>::differentiate_step(const Command& start, const Command& target, const double* block,
                                                  const StepSlopes& to) {
  if (result_.status != Status::kConverged || result_.interrupted || result_.scene < 1) return false;
  const Robot& robot = problem_.robot();
  const double resolution = kCommandResolution * robot.offset;
  const double least = Model::kRod ? robot.rod.least_pull : kSpace == 2 ? 0 : -HUGE_VAL;
  if (!Model::kRod && kSpace == 3 && largest_displacement(present_.command.cables) == 0) return false;
  problem_.evaluate(present_);
  problem_.reduced_gradient(present_.active);
  const int cables = static_cast<int>(layout_.cables.size), size = slope_row() + 1;
  Tensions motion{};
  for (int k = 0; k < cables; ++k)
    motion[k] = present_.command.cables[k] <= least ? robot.offset : target.cables[k] - start.cables[k];
  const double* gaps = block + layout_.gaps.offset;
  const int contacts = problem_.contacts();
  const int closest = contacts > 0 ? static_cast<int>(std::min_element(gaps, gaps + contacts) - gaps) : -1;
  if (!differentiate_towards(
          motion, {.length = to.in_length, .obstacles = to.in_obstacles, .gap = true, .contact = closest}, to.rows))
    return false;
  for (int k = 0; k < cables; ++k)
    if (std::abs(present_.command.cables[k] - target.cables[k]) > resolution)
      std::fill_n(to.rows + k * size, size, 0.0);
  return true;
}

// The side is found as that of a quadratic program along the motion: of the gaps that are closed and not pressed, one
// that would be violated is held, and one whose multiplier would be negative is let go, the first such one at a time.
template <class Model>
bool ModelContinuation<Model>::differentiate_towards(const Tensions& motion, const SlopeRequest& request,
                                                     double* rows) {
  if (present_.active.count == kMaxActive) return false;
  ActiveSet held, loose;
  find_loose(held, loose);
  for (int change = 0; change <= 2 * loose.count + 2; ++change) {
    if (prepare_slopes().differentiate(problem_, present_, held, request, rows) < 0) return false;
    const int contact = misjudged(held, loose, motion);
    if (contact < 0) return true;
    const auto begin = held.contact.begin(), found = std::find(begin, begin + held.count, contact);
    if (found != begin + held.count)
      held.drop(static_cast<int>(found - begin));
    else if (held.count < kMaxActive)
      held.contact[held.count++] = contact;
    else
      return false;
  }
  return false;
}

// Tells the gaps that press from those that are closed and do not, but for roundoff.
template <class Model>
void ModelContinuation<Model>::find_loose(ActiveSet& held, ActiveSet& loose) const {
  const ActiveSet& active = present_.active;
  const double balance = kPressed * problem_.stationarity_tolerance(active);
  for (int j = 0; j < active.count; ++j) {
    ActiveSet& set = active.multiplier[j] * problem_.lever_arm(active.contact[j]) > balance ? held : loose;
    set.contact[set.count++] = active.contact[j];
  }
  const auto begin = active.contact.begin(), end = begin + active.count;
  for (const int contact : problem_.near_contacts())
    if (problem_.gaps()[contact] <= kFeasibility * problem_.robot().max_length && loose.count < kMaxActive &&
        std::find(begin, end, contact) == end)
      loose.contact[loose.count++] = contact;
}

// The first of the gaps that do not press whose motion or multiplier, where the cables move farther, is not that of a
// gap; -1 where all are.
template <class Model>
int ModelContinuation<Model>::misjudged(const ActiveSet& held, const ActiveSet& loose, const Tensions& motion) const {
  if (loose.count == 0) return -1;
  const Slopes<Model>& slopes = *slopes_[problem_.mounts()];
  const Robot& robot = problem_.robot();
  const double travel = kAlong * largest_displacement(motion) / robot.offset;
  const auto begin = held.contact.begin(), end = begin + held.count;
  for (int j = 0; j < loose.count; ++j) {
    const int contact = loose.contact[j];
    const bool wrong = std::find(begin, end, contact) == end
                           ? slopes.gap_along(problem_, contact, motion) < -travel * robot.max_length
                           : slopes.multiplier_along(contact, motion) * problem_.lever_arm(contact) < -travel;
    if (wrong) return contact;
  }
  return -1;
}

#define CCR_INSTANTIATE(Model)                                                                              \
  template int ModelContinuation<Model>::slope_row() const;                                                 \
  template int ModelContinuation<Model>::parameters() const;                                                \
  template SlopeResult ModelContinuation<Model>::slopes(const double*, const bool*, bool, double*);         \
  template bool ModelContinuation<Model>::differentiate_step(const Command&, const Command&, const double*, \
                                                             const StepSlopes&);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
