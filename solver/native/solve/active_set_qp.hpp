// The quadratic subproblem of Newton's method: which linearised gaps carry a multiplier, and the step they allow.
#pragma once

#include <array>
#include <vector>

#include "solve/contact_problem.hpp"
#include "solve/kkt_system.hpp"

namespace ccr {

// Dual active-set method: every intermediate point minimises the model on its active set with multipliers >= 0.
template <class Model>
class Contacts {
 public:
  using Chain = ccr::Chain<Model>;
  using Hessian = ccr::Hessian<Model>;
  using Direction = ccr::Direction<Model>;

  Contacts(int segments, int mounts);

  // The step that minimises the model at `chain` within every linearised gap. On entry `active` holds the present
  // multipliers, which are part of the slope of the model; on success it is the new active set.
  bool solve(const Chain& chain, Hessian& hessian, ActiveSet& active, Direction& step);

  // The smallest step, measured by the Hessian, that closes the active gaps, which are held, and meets every other.
  bool restore(const Chain& chain, Hessian& hessian, ActiveSet& active, Direction& step);

  // A further step from a point close by, on the same active set and with the curvature and responses of the last
  // solve. False when a multiplier would turn negative.
  bool correct(const Chain& chain, Hessian& hessian, ActiveSet& active, Direction& step);

 private:
  using Column = std::array<double, tolerances::kMaxActive>;
  using Load = typename Hessian::Load;

  double along(int j, const Direction& d) const { return slopes_[j].along(d); }
  Load load(const Chain& chain, int contact, int j, double penalty);
  void penalize(const Chain& chain, const ActiveSet& active, Direction& step) const;
  void release(ActiveSet& active, int j, int responses);
  bool factor(const ActiveSet& active);
  void apply_inverse(int count, Column& x) const;
  void settle(const Chain& chain, ActiveSet& active, Direction& step);
  bool meet(const Chain& chain, Hessian& hessian, ActiveSet& active, Direction& step);
  Column closing(const Chain& chain, const ActiveSet& active, const Direction& step) const;
  void push(const Column& change, ActiveSet& active, Direction& step) const;
  bool admit(const Chain& chain, Hessian& hessian, int contact, ActiveSet& active, Direction& step);
  int most_violated(const Chain& chain, const ActiveSet& active, const Direction& step) const;

  // Of the active gaps in their order, then of one that is being admitted.
  std::vector<typename Chain::Slope> slopes_;
  std::vector<double> penalties_;     // in the curvature
  std::vector<Direction> responses_;  // H⁻¹∇c
  std::vector<Load> loads_;
  std::array<Column, tolerances::kMaxActive> gram_;
};

}  // namespace ccr
