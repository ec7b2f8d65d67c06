#include "contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ccr {

using namespace limits;

void Direction::add(double scale, const Direction& other) {
  for (std::size_t i = 0; i < shear.size(); ++i) shear[i][0] += scale * other.shear[i][0];
  for (std::size_t i = 0; i < states.size(); ++i)
    for (int k = 0; k < 3; ++k) states[i][k] += scale * other.states[i][k];
}

Contacts::Contacts(int segments) : responses_(kMaxActive, Direction(segments)) {}

double Contacts::along(const Chain& chain, int contact, const Direction& d) const {
  return dot(chain.gaps()[contact].slope, d.states[chain.node(contact)]);
}

bool Contacts::factor(const Chain& chain, const ActiveSet& active) {
  for (int j = 0; j < active.count; ++j) {
    for (int i = j; i < active.count; ++i) {
      double sum = along(chain, active.contact[i], responses_[j]);
      const double diagonal = sum;
      for (int k = 0; k < j; ++k) sum -= gram_[i][k] * gram_[j][k];
      if (i == j) {
        if (!(sum > kDependent * diagonal)) return false;
        gram_[j][j] = std::sqrt(sum);
      } else {
        gram_[i][j] = sum / gram_[j][j];
      }
    }
  }
  return true;
}

void Contacts::apply_inverse(int count, Column& x) const {
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= gram_[i][k] * x[k];
    x[i] /= gram_[i][i];
  }
  for (int i = count - 1; i >= 0; --i) {
    for (int k = i + 1; k < count; ++k) x[i] -= gram_[k][i] * x[k];
    x[i] /= gram_[i][i];
  }
}

void Contacts::drop(ActiveSet& active, int j) {
  std::rotate(responses_.begin() + j, responses_.begin() + j + 1, responses_.begin() + active.count);
  active.drop(j);
}

bool Contacts::settle(const Chain& chain, System& system, const std::vector<double>& penalty, ActiveSet& active,
                      Direction& step) {
  for (int j = 0; j < active.count; ++j) {
    const Gap& gap = chain.gaps()[active.contact[j]];
    system.respond(chain.node(active.contact[j]), gap.slope, responses_[j].shear.data(), responses_[j].states.data());
    if (penalty[j] != 0) step.add(-penalty[j] * gap.value, responses_[j]);
  }
  while (active.count > 0) {
    if (!factor(chain, active)) {  // dependent: release the weakest
      const int weakest = static_cast<int>(
          std::min_element(active.multiplier.begin(), active.multiplier.begin() + active.count) - active.multiplier.begin());
      step.add(-active.multiplier[weakest], responses_[weakest]);
      drop(active, weakest);
      continue;
    }
    Column change;
    for (int j = 0; j < active.count; ++j)
      change[j] = -chain.gaps()[active.contact[j]].value - along(chain, active.contact[j], step);
    apply_inverse(active.count, change);
    int lowest = 0;
    for (int j = 1; j < active.count; ++j)
      if (active.multiplier[j] + change[j] < active.multiplier[lowest] + change[lowest]) lowest = j;
    if (active.multiplier[lowest] + change[lowest] >= 0) {
      for (int j = 0; j < active.count; ++j) {
        active.multiplier[j] += change[j];
        step.add(change[j], responses_[j]);
      }
      return true;
    }
    step.add(-active.multiplier[lowest], responses_[lowest]);
    drop(active, lowest);
  }
  return true;
}

bool Contacts::admit(const Chain& chain, System& system, int contact, ActiveSet& active, Direction& step) {
  if (active.count == kMaxActive) return false;
  const Gap& gap = chain.gaps()[contact];
  // The newcomer's response lives behind those of the active set; drop() moves it along.
  Direction& response = responses_[active.count];
  system.respond(chain.node(contact), gap.slope, response.shear.data(), response.states.data());
  double multiplier = 0;
  for (;;) {
    const int count = active.count;
    const Direction& newcomer = responses_[count];
    const double full = along(chain, contact, newcomer);
    Column coupling, trade;
    for (int j = 0; j < count; ++j) coupling[j] = along(chain, active.contact[j], newcomer);
    if (!factor(chain, active)) return false;
    trade = coupling;
    apply_inverse(count, trade);
    double curvature = full;
    for (int j = 0; j < count; ++j) curvature -= coupling[j] * trade[j];

    double to_drop = std::numeric_limits<double>::infinity();
    int blocking = -1;
    for (int j = 0; j < count; ++j)
      if (trade[j] > 0 && active.multiplier[j] / trade[j] < to_drop) {
        to_drop = active.multiplier[j] / trade[j];
        blocking = j;
      }
    const double shortfall = -gap.value - along(chain, contact, step);
    const double to_close =
        curvature > kDependent * full ? shortfall / curvature : std::numeric_limits<double>::infinity();
    const double length = std::min(to_drop, to_close);
    if (!std::isfinite(length)) return false;

    step.add(length, newcomer);
    for (int j = 0; j < count; ++j) {
      step.add(-length * trade[j], responses_[j]);
      active.multiplier[j] = std::max(0.0, active.multiplier[j] - length * trade[j]);
    }
    multiplier += length;
    if (to_close <= to_drop) {
      active.contact[count] = contact;
      active.multiplier[count] = multiplier;
      ++active.count;
      return true;
    }
    std::rotate(responses_.begin() + blocking, responses_.begin() + blocking + 1, responses_.begin() + count + 1);
    active.drop(blocking);
  }
}

bool Contacts::solve(const Chain& chain, System& system, const std::vector<double>& penalty, ActiveSet& active,
                     Direction& step) {
  if (!settle(chain, system, penalty, active, step)) return false;
  for (int change = 0; change < kActiveSetChanges; ++change) {
    int worst = -1;
    double lowest = -kFeasibility / 2;
    for (int c = 0; c < chain.contacts(); ++c) {
      const double predicted = chain.gaps()[c].value + along(chain, c, step);
      if (predicted < lowest &&
          std::find(active.contact.begin(), active.contact.begin() + active.count, c) ==
              active.contact.begin() + active.count) {
        lowest = predicted;
        worst = c;
      }
    }
    if (worst < 0) return true;
    if (!admit(chain, system, worst, active, step)) return false;
  }
  return false;
}

}  // namespace ccr
