// The quadratic program of a Newton step: minimise ½ dᵀH d + gᵀd subject to c + ∇c·d >= 0.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "solve/contact_problem.hpp"
#include "solve/kkt_system.hpp"

namespace ccr {

// Dual active-set method (Goldfarb and Idnani): every intermediate step minimises the model on its active set, with
// multipliers λ >= 0, and violated gaps are added one by one.
template <class Model>
class ActiveSetQp {
 public:
  using ContactProblem = ccr::ContactProblem<Model>;
  using KktSystem = ccr::KktSystem<Model>;
  using Direction = ccr::Direction<Model>;

  ActiveSetQp(int segments, int mounts);

  // Returns whether H is positive definite on the tangent space of the active gaps: ∇cᵀH⁻¹∇c has as many negative
  // eigenvalues as H.
  bool is_stable(const ContactProblem& problem, KktSystem& kkt, const ActiveSet& active);

  // Finds the step that minimises the model subject to all linearised gaps. On entry `active` holds the multipliers
  // that the gradient contains; on success it is the active set of the solution. False where no step was found.
  bool solve(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);

  // Finds the smallest step in the norm of H that closes the active gaps, as equalities, and satisfies all others.
  bool restore(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);

  // Finds, by inverse iteration, a direction on the tangent space of the active gaps in which the curvature of H is
  // nearly the least; the closer H is to losing its definiteness there, the more nearly. Starts from the controls of
  // `seed`, which it overwrites.
  bool find_softest(const ContactProblem& problem, KktSystem& kkt, const ActiveSet& active, Direction& seed,
                    Direction& softest);

  // Finds the step and the multipliers that balance the gradient while the active gaps stay as they are. Leaves out of
  // `active` the gaps whose slopes depend on those before; they keep the multipliers that the gradient
  // contains. False where H is not positive definite on the tangent space. Multipliers may become negative.
  bool balance(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);

  // Lets a closed gap whose slope depends on those of the active ones take the place of one of them, with multipliers
  // that balance the same: a link that lies flush on a flank may go on along it on other points. Returns that gap, the
  // next one after a given one, from the first again after the last; -1 where there is none.
  int exchange_dependent(const ContactProblem& problem, KktSystem& kkt, int after, ActiveSet& active);

  // Where the last solve or restoration found that the linearised gaps have no common solution: those gaps, the last
  // one that which could not be added, with multipliers ν >= 0 that balance each other, Σ ν ∇c = 0. Empty otherwise.
  const ActiveSet& conflict() const { return conflict_; }

  using Multipliers = std::array<double, tolerances::kMaxActive>;

  // Factors the system of gaps that stay closed; leaves out those whose slopes depend on those before. Curvature of any
  // sign is accepted. Returns the least curvature that one adds, over that of the gap alone: how far they are from
  // depending on each other.
  double hold(const ContactProblem& problem, KktSystem& kkt, ActiveSet& held);
  // Completes a response at fixed multipliers to one that keeps the gaps of the last `hold` closed, in whose order
  // `changes` holds how each changes at a fixed shape. Leaves the changes of their multipliers there.
  void close(int count, Multipliers& changes, Direction& response) const;

  // Finds a further step near the last solve, on its active set and with its factorisation. False where a multiplier
  // would be negative.
  bool correct(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step);

 private:
  enum class Gram { kSound, kDependent, kUnstable };
  using Load = typename KktSystem::Load;

  double along(int j, const Direction& d) const { return slopes_[j].along(d); }
  Load linearize_gap(const ContactProblem& problem, int contact, int j, double penalty);
  void add_penalty_response(const ContactProblem& problem, const ActiveSet& active, Direction& step) const;
  void remove_contact(ActiveSet& active, int j, int responses);
  Gram factor_gram(const ActiveSet& active);
  bool are_sound(const ContactProblem& problem, KktSystem& kkt, const ActiveSet& active);
  void solve_gram(int count, Multipliers& x) const;
  bool drop_negative_multipliers(const ContactProblem& problem, ActiveSet& active, Direction& step);
  bool satisfy_gaps(const ContactProblem& problem, KktSystem& kkt, ActiveSet& active, Direction& step,
                    double tolerance);
  Multipliers closing_multipliers(const ContactProblem& problem, const ActiveSet& active, const Direction& step) const;
  void apply(const Multipliers& change, ActiveSet& active, Direction& step) const;
  bool add_violated_gap(const ContactProblem& problem, KktSystem& kkt, int contact, ActiveSet& active, Direction& step);
  double combine(int count, Multipliers& trade) const;
  void drop_roundoff(int count, double full, Multipliers& trade) const;
  std::pair<int, double> first_released(const ActiveSet& active, const Multipliers& trade) const;
  int most_violated(const ContactProblem& problem, const ActiveSet& active, const Direction& step,
                    double tolerance) const;

  // Of the active gaps in their order, then of the one that is being added.
  std::vector<typename ContactProblem::Slope> slopes_;
  std::vector<double> penalties_;     // contained in H
  std::vector<Direction> responses_;  // H⁻¹∇c
  std::vector<Load> loads_;
  std::array<Multipliers, tolerances::kMaxActive> gram_;  // ∇cᵀH⁻¹∇c as L D Lᵀ: unit L below the diagonal, D on it
  int dependent_ = 0;                                     // the first such gap of the last dependent set
  ActiveSet conflict_;
  int negative_ = 0;  // eigenvalues of H
};

}  // namespace ccr
