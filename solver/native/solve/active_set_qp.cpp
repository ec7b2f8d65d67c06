#include "solve/active_set_qp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "model/models.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
ActiveSetQp<Model>::ActiveSetQp(int segments, int mounts)
    : slopes_(kMaxActive),
      penalties_(kMaxActive),
      responses_(kMaxActive, Direction(segments, mounts)),
      loads_(kMaxActive + 1) {}

template <class Model>
ActiveSetQp<Model>::Load ActiveSetQp<Model>::linearize_gap(const ContactProblem& problem, int contact, int j,
                                                           double penalty) {
  slopes_[j] = problem.slope(contact);
  penalties_[j] = penalty;
  return {&slopes_[j], &responses_[j]};
}

// Adds the gradient of the penalty on open active gaps, -penalty c H⁻¹∇c.
template <class Model>
void ActiveSetQp<Model>::add_penalty_response(const ContactProblem& problem, const ActiveSet& active,
                                              Direction& step) const {
  for (int j = 0; j < active.count; ++j)
    if (penalties_[j] != 0) step.add(-penalties_[j] * problem.gaps()[active.contact[j]], responses_[j]);
}

// Removes a contact with its gradient and response. `responses` is the number of responses in use.
template <class Model>
void ActiveSetQp<Model>::remove_contact(ActiveSet& active, int j, int responses) {
  std::rotate(slopes_.begin() + j, slopes_.begin() + j + 1, slopes_.begin() + responses);
  std::rotate(penalties_.begin() + j, penalties_.begin() + j + 1, penalties_.begin() + responses);
  std::rotate(responses_.begin() + j, responses_.begin() + j + 1, responses_.begin() + responses);
  active.drop(j);
}

// Factors ∇cᵀH⁻¹∇c over the active gaps, which may be linearly dependent, or leave a direction of negative curvature.
template <class Model>
ActiveSetQp<Model>::Gram ActiveSetQp<Model>::factor_gram(const ActiveSet& active) {
  int negative = 0;
  for (int j = 0; j < active.count; ++j)
    for (int i = j; i < active.count; ++i) {
      const double entry = along(i, responses_[j]);
      double sum = entry;
      for (int k = 0; k < j; ++k) sum -= gram_[i][k] * gram_[j][k] * gram_[k][k];
      if (i == j && !(std::abs(sum) > kDependent * std::abs(entry))) {
        dependent_ = j;
        return Gram::kDependent;
      }
      negative += i == j && sum < 0;
      gram_[i][j] = i == j ? sum : sum / gram_[j][j];
    }
  return negative == negative_ ? Gram::kSound : Gram::kUnstable;
}

template <class Model>
bool ActiveSetQp<Model>::is_stable(const ContactProblem& problem, KktSystem& kkt, const ActiveSet& active) {
  negative_ = kkt.negative;
  if (negative_ == 0) return true;
  if (negative_ > active.count) return false;
  return are_sound(problem, kkt, active);
}

// Finds the responses to the slopes of active gaps; false where these depend on each other, or leave a direction of
// negative curvature.
template <class Model>
bool ActiveSetQp<Model>::are_sound(const ContactProblem& problem, KktSystem& kkt, const ActiveSet& active) {
  negative_ = kkt.negative;
  for (int j = 0; j < active.count; ++j) loads_[j] = linearize_gap(problem, active.contact[j], j, 0);
  kkt.solve(problem, std::span(loads_).first(active.count));
  return factor_gram(active) == Gram::kSound;
}

template <class Model>
void ActiveSetQp<Model>::solve_gram(int count, Multipliers& x) const {
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= gram_[i][k] * x[k];
  }
  for (int i = count - 1; i >= 0; --i) {
    x[i] /= gram_[i][i];
    for (int k = i + 1; k < count; ++k) x[i] -= gram_[k][i] * x[k];
  }
}

// Change of the multipliers for which c + ∇c·d = 0 on the active set.
template <class Model>
ActiveSetQp<Model>::Multipliers ActiveSetQp<Model>::closing_multipliers(const ContactProblem& problem,
                                                                        const ActiveSet& active,
                                                                        const Direction& step) const {
  Multipliers change;
  for (int j = 0; j < active.count; ++j) change[j] = -problem.gaps()[active.contact[j]] - along(j, step);
  solve_gram(active.count, change);
  return change;
}

template <class Model>
void ActiveSetQp<Model>::apply(const Multipliers& change, ActiveSet& active, Direction& step) const {
  for (int j = 0; j < active.count; ++j) {
    active.multiplier[j] += change[j];
    step.add(change[j], responses_[j]);
  }
}

// Closes the active gaps; where λ + Δλ < 0 for any, removes the lowest and tries again.
template <class Model>
bool ActiveSetQp<Model>::drop_negative_multipliers(const ContactProblem& problem, ActiveSet& active, Direction& step) {
  while (active.count > 0) {
    int lowest;
    const auto begin = active.multiplier.begin(), end = begin + active.count;
    const Gram gram = factor_gram(active);
    if (gram == Gram::kUnstable) return false;
    if (gram == Gram::kSound) {
      const Multipliers change = closing_multipliers(problem, active, step);
      lowest = 0;
      for (int j = 1; j < active.count; ++j)
        if (begin[j] + change[j] < begin[lowest] + change[lowest]) lowest = j;
      if (begin[lowest] + change[lowest] >= 0) {
        apply(change, active, step);
        return true;
      }
    } else {
      lowest = static_cast<int>(std::min_element(begin, end) - begin);
    }
    step.add(-begin[lowest], responses_[lowest]);
    remove_contact(active, lowest, active.count);
  }
  return negative_ == 0;
}

// Leaves in `trade` the combination of the active gaps that is nearest to the slope of the gap after them; returns the
// curvature ∇cᵀH⁻¹∇c of the rest.
template <class Model>
double ActiveSetQp<Model>::combine(int count, Multipliers& trade) const {
  const Direction& response = responses_[count];
  Multipliers coupling;
  for (int j = 0; j < count; ++j) coupling[j] = trade[j] = along(j, response);
  solve_gram(count, trade);
  double curvature = along(count, response);
  for (int j = 0; j < count; ++j) curvature -= coupling[j] * trade[j];
  return curvature;
}

// Leaves out of the combination that a dependent gap is what comes of roundoff: a gap that has no part in it would seem
// to be released.
template <class Model>
void ActiveSetQp<Model>::drop_roundoff(int count, double full, Multipliers& trade) const {
  for (int j = 0; j < count; ++j)
    if (trade[j] * trade[j] * std::abs(along(j, responses_[j])) <= kNoPart * full) trade[j] = 0;
}

// The active gap whose multiplier is the first to vanish as a combination is taken off, or -1; and how much of it is
// then.
template <class Model>
std::pair<int, double> ActiveSetQp<Model>::first_released(const ActiveSet& active, const Multipliers& trade) const {
  int first = -1;
  double part = std::numeric_limits<double>::infinity();
  for (int j = 0; j < active.count; ++j)
    if (trade[j] > 0 && active.multiplier[j] / trade[j] < part) {
      part = active.multiplier[j] / trade[j];
      first = j;
    }
  return {first, part};
}

// Adds a violated gap by dual steps: its multiplier grows until the gap is closed. A step that would make another
// multiplier negative ends where that is 0, and removes it. False where the gaps have no common solution.
template <class Model>
bool ActiveSetQp<Model>::add_violated_gap(const ContactProblem& problem, KktSystem& kkt, int contact, ActiveSet& active,
                                          Direction& step) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (active.count == kMaxActive) return false;
  const Load newcomer = linearize_gap(problem, contact, active.count, 0);
  kkt.solve(problem, {&newcomer, 1});
  double multiplier = 0;
  for (;;) {
    const int count = active.count;
    const Direction& response = responses_[count];
    if (factor_gram(active) != Gram::kSound) return false;
    Multipliers trade;
    const double curvature = combine(count, trade), full = std::abs(along(count, response));
    const bool depends = !(curvature > kDependent * full);
    if (depends) drop_roundoff(count, full, trade);
    const auto [blocking, to_release] = first_released(active, trade);
    const double shortfall = -problem.gaps()[contact] - along(count, step);
    const double to_close = depends ? kNever : shortfall / curvature;
    const double length = std::min(to_release, to_close);
    if (!(length < kNever)) {
      conflict_ = active;
      for (int j = 0; j < count; ++j) conflict_.multiplier[j] = std::max(0.0, -trade[j]);
      conflict_.contact[count] = contact;
      conflict_.multiplier[count] = 1;
      ++conflict_.count;
      return false;
    }

    step.add(length, response);
    for (int j = 0; j < count; ++j) {
      step.add(-length * trade[j], responses_[j]);
      active.multiplier[j] = std::max(0.0, active.multiplier[j] - length * trade[j]);
    }
    multiplier += length;
    if (to_close <= to_release) {
      active.contact[count] = contact;
      active.multiplier[count] = multiplier;
      ++active.count;
      return true;
    }
    remove_contact(active, blocking, count + 1);
  }
}

template <class Model>
int ActiveSetQp<Model>::most_violated(const ContactProblem& problem, const ActiveSet& active, const Direction& step,
                                      double tolerance) const {
  double reach = 0;  // bound on the motion of any point
  for (const auto& d : step.states) {
    double motion = 0, turn = 0;
    for (int k = 0; k < Model::kSpace; ++k) motion += std::abs(d[k]);
    for (int k = 0; k < Model::kTurn; ++k) turn += std::abs(d[Model::kSpace + k]);
    reach = std::max(reach, motion + problem.farthest_line() * turn);
  }
  double shift = 0;  // of any mount
  for (const auto& d : step.mounts) {
    double motion = 0;
    for (const double part : d.v) motion += std::abs(part);
    shift = std::max(shift, motion);
  }
  reach += shift;
  int worst = -1;
  double lowest = -tolerance * problem.robot().max_length / 2;
  for (const int c : problem.near_contacts()) {
    const double gap = problem.gaps()[c];
    if (gap > 2 * reach && c < problem.contacts()) continue;
    const double predicted = gap + problem.slope(c).along(step);
    const auto end = active.contact.begin() + active.count;
    if (predicted < lowest && std::find(active.contact.begin(), end, c) == end) {
      lowest = predicted;
      worst = c;
    }
  }
  return worst;
}

template <class Model>
bool ActiveSetQp<Model>::satisfy_gaps(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step,
                                      double tolerance) {
  conflict_.count = 0;
  if (!drop_negative_multipliers(problem, active, step)) return false;
  for (int change = 0; change < kActiveSetChanges; ++change) {
    const int contact = most_violated(problem, active, step, tolerance);
    if (contact < 0) return true;
    if (!add_violated_gap(problem, kkt, contact, active, step)) return false;
  }
  return false;
}

template <class Model>
bool ActiveSetQp<Model>::solve(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step) {
  int count = 0;
  negative_ = kkt.negative;
  for (; count < active.count; ++count)
    loads_[count] = linearize_gap(problem, active.contact[count], count, kkt.penalty(count));
  loads_[count++] = {nullptr, &step};
  kkt.solve(problem, std::span(loads_).first(count));
  add_penalty_response(problem, active, step);
  return satisfy_gaps(problem, kkt, active, step, kFeasibility);
}

template <class Model>
bool ActiveSetQp<Model>::restore(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step) {
  negative_ = kkt.negative;
  for (int j = 0; j < active.count; ++j) loads_[j] = linearize_gap(problem, active.contact[j], j, 0);
  std::fill_n(active.multiplier.begin(), active.count, kHeld);
  step.clear();
  kkt.solve(problem, std::span(loads_).first(active.count));
  return satisfy_gaps(problem, kkt, active, step, kDescentFeasibility);
}

template <class Model>
bool ActiveSetQp<Model>::correct(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step) {
  const Load load{nullptr, &step};
  kkt.solve(problem, {&load, 1});
  add_penalty_response(problem, active, step);
  if (factor_gram(active) != Gram::kSound) return false;
  apply(closing_multipliers(problem, active, step), active, step);
  const auto end = active.multiplier.begin() + active.count;
  return std::all_of(active.multiplier.begin(), end, [](double multiplier) { return multiplier >= 0; });
}

#define CCR_INSTANTIATE(Model) template class ActiveSetQp<Model>;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
