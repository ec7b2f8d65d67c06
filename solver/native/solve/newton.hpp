// Newton's method for one equilibrium under a fixed command, near it and far from it.
#pragma once

#include <vector>

#include "solve/active_set_qp.hpp"
#include "solve/contact_problem.hpp"
#include "solve/kkt_system.hpp"

namespace ccr {

struct NewtonResult {
  bool converged = false;  // to a stable equilibrium: H is positive definite on the tangent space of the active gaps
  int iterations = 0;
  bool moved = false;  // descent: whether another shape was reached
};

// Leaves in `to` a part of a step away from a shape.
template <class Model>
void advance(const Iterate<Model>& from, double scale, const Direction<Model>& step, Iterate<Model>& to) {
  for (std::size_t i = 0; i < from.controls.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) to.controls[i][k] = from.controls[i][k] + scale * step.controls[i][k];
  for (std::size_t m = 0; m < from.mounts.size(); ++m)
    for (int k = 0; k < Model::kSpace; ++k) to.mounts[m][k] = from.mounts[m][k] + scale * step.mounts[m][k];
}

template <class Model>
class Newton {
 public:
  using Iterate = ccr::Iterate<Model>;

  Newton(const Robot& robot, int obstacles);
  void set_obstacles(std::span<const Obstacle<Model::kSpace>> obstacles);

  // Newton iteration with an l1 merit line search, for a start close to a stable equilibrium. Gives up where H is not
  // positive definite on the tangent space of the active gaps, but for the first `damped` iterations, which are damped.
  NewtonResult solve(Iterate& at, int damped);

  // Moves a shape close to a stable equilibrium to it, where slopes of active gaps depend on those before: the
  // multipliers of these gaps are kept. False where there is none.
  bool settle(Iterate& at);
  // Of the last iteration: gaps that no step satisfies together; see ActiveSetQp.
  const ActiveSet& conflict() const { return qp_.conflict(); }

  // Begins to count the work of a step.
  void begin_step() { factorizations_before_ = factorizations(); }

  // One iterate of a feasible descent. Where `at` is an equilibrium, returns `converged`; otherwise moves `at` to a
  // feasible shape of no more energy, by a step of at most the size `largest`, and returns whether it `moved`. The
  // energy falls along the step of a Hessian that is damped until it is definite, which is the shorter one.
  NewtonResult descend_once(Iterate& at, double largest, bool definite);

  // Whether H is positive definite at the last iterate, not only on the tangent space of the active gaps.
  bool is_definite(const ActiveSet& active) {
    kkt_.assemble(problem, active, 0);
    return kkt_.factor(0) && kkt_.negative == 0;
  }

  // Sets the norm of `restore` to the convexified Hessian at a shape; false where it cannot be convexified.
  bool set_metric(const Iterate& at);
  // Moves a shape as little as closes its active gaps and satisfies all others; false where that fails nearby.
  bool restore(Iterate& at);

  // Moves a shape by so much in a direction that keeps some gaps to first order, and in which the metric of `restore`
  // is nearly least.
  bool bend_softly(Iterate& at, const ActiveSet& held, double size);

  // Factorisations of the KKT system so far, to which the work is nearly proportional.
  std::int64_t factorizations() const { return kkt_.factorizations; }

  ContactProblem<Model> problem;  // evaluated at the last iterate

 private:
  bool is_equilibrium(const ActiveSet& active) const;
  ActiveSet closed_contacts(const ActiveSet& active) const;
  bool gaps_closed(const ActiveSet& active, double tolerance) const;
  void choose_test();
  bool release_lowest(const Iterate& at, ActiveSet& target);
  bool exchange_dependent(ActiveSet& active);
  bool slide_along(const ActiveSet& active, ActiveSet& target);
  bool factor_penalized(const ActiveSet& active, int penalties);
  bool factor_stable(const ActiveSet& active, int penalties);
  bool stands(const ActiveSet& active);
  bool factor_convexified(const ActiveSet& active, int penalties);
  bool factor_damped(const ActiveSet& active);
  bool factor_definite();
  bool factor_metric();
  double step_size(const Direction<Model>& step) const;
  double slope_along_step() const;
  double rise_of_roundoff(const ActiveSet& active) const;
  bool has_moved(const Iterate& from, double least) const;
  bool is_flat(const ActiveSet& active);
  bool find_softest(const ActiveSet& held);
  bool take_step(Iterate& at, const ActiveSet& target, double largest);
  bool leave_saddle(Iterate& at, double largest);
  double merit(double weight) const;
  double line_search(const Iterate& at, const ActiveSet& target, double& weight);

  KktSystem<Model> kkt_;
  ActiveSetQp<Model> qp_;
  Direction<Model> step_, correction_;
  double step_size_ = 0;                    // of `step_`
  std::int64_t factorizations_before_ = 0;  // of the step
  Iterate trial_;
  double damping_ = 0;
  double needed_damping_ = 0;  // damping that was needed last in this descent
  double stretch_ = 1;         // of the next damped iterate of this descent
  bool creeping_ = false;      // whether the iterates of this descent hardly move
  double lowest_ = 0;          // energy of this descent when it fell last
  int fruitless_ = 0;          // iterates since then,
  int flat_ = 0;               // and since a saddle was suspected
  int iterates_ = 0;           // of this descent
  int exchanged_ = -1;         // the last gap that took the place of one that it depends on
  int dropped_ = 0;            // iterates that would not be stable without a gap that they drop
};

}  // namespace ccr
