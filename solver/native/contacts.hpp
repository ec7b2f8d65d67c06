// The quadratic subproblem of Newton's method: which linearised gaps carry a multiplier, and the step they allow.
#pragma once

#include <array>
#include <vector>

#include "chain.hpp"

namespace ccr {

struct Direction {
  explicit Direction(int segments) : shear(segments), states(segments + 1) {}
  std::vector<Control> shear;
  std::vector<State> states;

  void add(double scale, const Direction& other);
};

// Dual active-set method: every intermediate point minimises the model on its active set with multipliers >= 0.
class Contacts {
 public:
  Contacts(int segments);

  // On entry `step` minimises the model without further forces and `active` holds the present multipliers, already
  // part of the model's gradient. On success `step` satisfies every linearised gap and `active` is the new set.
  // `penalty` is what was added to the curvature of each active gap.
  bool solve(const Chain& chain, System& system, const std::vector<double>& penalty, ActiveSet& active, Direction& step);

 private:
  using Column = std::array<double, limits::kMaxActive>;

  double along(const Chain& chain, int contact, const Direction& d) const;
  bool factor(const Chain& chain, const ActiveSet& active);
  void apply_inverse(int count, Column& x) const;
  bool settle(const Chain& chain, System& system, const std::vector<double>& penalty, ActiveSet& active, Direction& step);
  bool admit(const Chain& chain, System& system, int contact, ActiveSet& active, Direction& step);
  void drop(ActiveSet& active, int j);

  std::vector<Direction> responses_;  // H⁻¹∇c of the active gaps, in their order
  std::array<Column, limits::kMaxActive> gram_;
};

}  // namespace ccr
