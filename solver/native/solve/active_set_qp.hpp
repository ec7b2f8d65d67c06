// The quadratic subproblem of Newton's method: which linearised gaps carry a multiplier, and the step they allow.
#pragma once

#include <array>
#include <vector>

#include "solve/contact_problem.hpp"
#include "solve/kkt_system.hpp"

namespace ccr {

// Dual active-set method: every intermediate point minimises the model on its active set with multipliers >= 0.
template <class Model>
class ActiveSetQp {
 public:
  using ContactProblem = ccr::ContactProblem<Model>;
  using KktSystem = ccr::KktSystem<Model>;
  using Direction = ccr::Direction<Model>;

  ActiveSetQp(int segments, int mounts);

  // The step that minimises the model at `problem` within every linearised gap. On entry `active` holds the present
  // multipliers, which are part of the slope of the model; on success it is the new active set.
  bool solve(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);

  // The smallest step, measured by the Hessian, that closes the active gaps, which are held, and meets every other.
  bool restore(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);

  // A further step from a point close by, on the same active set and with the curvature and responses of the last
  // solve. False when a multiplier would turn negative.
  bool correct(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);

 private:
  using Column = std::array<double, tolerances::kMaxActive>;
  using Load = typename KktSystem::Load;

  double along(int j, const Direction& d) const { return slopes_[j].along(d); }
  Load linearize_gap(const ContactProblem& problem, int contact, int j, double penalty);
  void add_penalty_response(const ContactProblem& problem, const ActiveSet& active, Direction& step) const;
  void remove_contact(ActiveSet& active, int j, int responses);
  bool factor_gram(const ActiveSet& active);
  void solve_gram(int count, Column& x) const;
  void drop_negative_multipliers(const ContactProblem& problem, ActiveSet& active, Direction& step);
  bool satisfy_gaps(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);
  Column closing_multipliers(const ContactProblem& problem, const ActiveSet& active, const Direction& step) const;
  void apply(const Column& change, ActiveSet& active, Direction& step) const;
  bool add_violated_gap(const ContactProblem& problem, KktSystem& kkt, int contact, ActiveSet& active, Direction& step);
  int most_violated(const ContactProblem& problem, const ActiveSet& active, const Direction& step) const;

  // Of the active gaps in their order, then of one that is being admitted.
  std::vector<typename ContactProblem::Slope> slopes_;
  std::vector<double> penalties_;     // in the curvature
  std::vector<Direction> responses_;  // H⁻¹∇c
  std::vector<Load> loads_;
  std::array<Column, tolerances::kMaxActive> gram_;
};

}  // namespace ccr
