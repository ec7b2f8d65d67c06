// What active gaps determine without a program: multipliers that balance, the softest motion that keeps them, and those
// that may take each other's place.
#include <algorithm>
#include <cmath>
#include <span>

#include "model/models.hpp"
#include "solve/active_set_qp.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
bool ActiveSetQp<Model>::find_softest(const ContactProblem& problem, KktSystem& kkt, const ActiveSet& active,
                                      Direction& seed, Direction& softest) {
  if (!are_sound(problem, kkt, active)) return false;
  const typename ContactProblem::Slope slope{{}, -1, {}, seed.controls.data()};
  const Load load{&slope, &softest};
  for (int round = 0; round < kSofteningRounds; ++round) {
    kkt.solve(problem, {&load, 1});
    Multipliers change;
    for (int j = 0; j < active.count; ++j) change[j] = -along(j, softest);
    solve_gram(active.count, change);
    for (int j = 0; j < active.count; ++j) softest.add(change[j], responses_[j]);
    double largest = 0;
    for (const auto& d : softest.controls)
      for (const double part : d.v) largest = std::max(largest, std::abs(part));
    if (!(largest > 0 && std::isfinite(largest))) return false;
    for (std::size_t i = 0; i < seed.controls.size(); ++i)
      for (int k = 0; k < Model::kControl; ++k) seed.controls[i][k] = softest.controls[i][k] / largest;
  }
  return true;
}

template <class Model>
int ActiveSetQp<Model>::exchange_dependent(const ContactProblem& problem, KktSystem& kkt, int after,
                                           ActiveSet& active) {
  const int count = active.count;
  if (count == kMaxActive) return -1;
  if (!are_sound(problem, kkt, active)) return -1;
  const auto end = active.contact.begin() + count;
  for (const bool comes_after : {true, false})
    for (const int contact : problem.near_contacts()) {
      if ((contact > after) != comes_after) continue;
      if (problem.gaps()[contact] > kFeasibility * problem.robot().max_length) continue;
      if (std::find(active.contact.begin(), end, contact) != end) continue;
      const Load newcomer = linearize_gap(problem, contact, count, 0);
      kkt.solve(problem, {&newcomer, 1});
      Multipliers trade;
      const double curvature = combine(count, trade);
      if (curvature > kNearlyDependent * std::abs(along(count, responses_[count]))) continue;
      const auto [leaving, multiplier] = first_released(active, trade);
      if (leaving < 0) continue;
      for (int j = 0; j < count; ++j)
        active.multiplier[j] = std::max(0.0, active.multiplier[j] - multiplier * trade[j]);
      active.contact[leaving] = contact;
      active.multiplier[leaving] = multiplier;
      return contact;
    }
  return -1;
}

template <class Model>
bool ActiveSetQp<Model>::balance(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step) {
  int count = 0;
  negative_ = kkt.negative;
  for (; count < active.count; ++count) loads_[count] = linearize_gap(problem, active.contact[count], count, 0);
  loads_[count++] = {nullptr, &step};
  kkt.solve(problem, std::span(loads_).first(count));
  Gram gram = factor_gram(active);
  for (; gram == Gram::kDependent; gram = factor_gram(active)) remove_contact(active, dependent_, active.count);
  if (gram == Gram::kUnstable) return false;
  Multipliers change;
  for (int j = 0; j < active.count; ++j) change[j] = -along(j, step);
  solve_gram(active.count, change);
  apply(change, active, step);
  return true;
}

template <class Model>
double ActiveSetQp<Model>::hold(const ContactProblem& problem, KktSystem& kkt, ActiveSet& held) {
  for (int j = 0; j < held.count; ++j) loads_[j] = linearize_gap(problem, held.contact[j], j, 0);
  kkt.solve(problem, std::span(loads_).first(held.count));
  while (factor_gram(held) == Gram::kDependent) remove_contact(held, dependent_, held.count);
  double least = 1;
  for (int j = 0; j < held.count; ++j) least = std::min(least, std::abs(gram_[j][j] / along(j, responses_[j])));
  return least;
}

template <class Model>
void ActiveSetQp<Model>::close(int count, Multipliers& changes, Direction& response) const {
  for (int j = 0; j < count; ++j) changes[j] = -changes[j] - along(j, response);
  solve_gram(count, changes);
  for (int j = 0; j < count; ++j) response.add(changes[j], responses_[j]);
}

#define CCR_INSTANTIATE(Model)                                                                                    \
  template bool ActiveSetQp<Model>::find_softest(const ContactProblem&, KktSystem&, const ActiveSet&, Direction&, \
                                                 Direction&);                                                     \
  template int ActiveSetQp<Model>::exchange_dependent(const ContactProblem&, KktSystem&, int, ActiveSet&);        \
  template bool ActiveSetQp<Model>::balance(const ContactProblem&, KktSystem&, ActiveSet&, Direction&);           \
  template double ActiveSetQp<Model>::hold(const ContactProblem&, KktSystem&, ActiveSet&);                        \
  template void ActiveSetQp<Model>::close(int, Multipliers&, Direction&) const;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
