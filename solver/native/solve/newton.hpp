// Newton's method for one equilibrium under a fixed command, near it and far from it.
#pragma once

#include <vector>

#include "solve/active_set_qp.hpp"
#include "solve/contact_problem.hpp"
#include "solve/kkt_system.hpp"

namespace ccr {

struct NewtonResult {
  bool converged = false;  // to a stable equilibrium: the curvature is positive along the active gaps
  int iterations = 0;
  bool moved = false;  // of a descent: whether it went on to another shape
};

template <class Model>
class Newton {
 public:
  using Iterate = ccr::Iterate<Model>;

  Newton(const Robot& robot, int obstacles);
  void set_obstacles(std::span<const Obstacle<Model::kSpace>> obstacles);

  // Iteration with an l1 merit search: quadratic, for a start close to a stable equilibrium. Gives up where the
  // curvature along the active gaps is not positive, after so many damped iterations.
  NewtonResult solve(Iterate& at, int damped);

  // One iterate of energy descent from a feasible shape. Returns the result on that shape, and where it is not yet an
  // equilibrium moves `at` to a feasible one of no more energy, by a step of at most the size `largest`; `moved` tells
  // whether it could.
  NewtonResult descend_once(Iterate& at, double largest);

  // Takes the curvature at `at` as the measure of motion for restore; false when it cannot be made positive.
  bool set_metric(const Iterate& at);
  // Smallest motion that closes the active gaps exactly and meets every other; false when there is none nearby.
  bool restore(Iterate& at);

  // Factorisations of the Hessian so far, which nearly all of the work goes with.
  std::int64_t factorizations() const { return kkt_.factorizations; }

  ContactProblem<Model> problem;  // evaluated at the last iterate

 private:
  bool is_equilibrium(const ActiveSet& active) const;
  ActiveSet closed_contacts(const ActiveSet& active) const;
  bool gaps_closed(const ActiveSet& active, double tolerance) const;
  bool factor_penalized(const ActiveSet& active, int penalties);
  bool factor_convexified(const ActiveSet& active, int penalties);
  bool factor_damped();
  double step_size(const Direction<Model>& step) const;
  double merit(double weight) const;
  double line_search(const Iterate& at, const ActiveSet& target, double& weight);

  KktSystem<Model> kkt_;
  ActiveSetQp<Model> qp_;
  Direction<Model> step_, correction_;
  double step_size_ = 0;  // of `step_`
  Iterate trial_;
  double damping_ = 0;
  double needed_ = 0;      // of damping, in the descent that goes on
  double stretch_ = 1;     // of its next damped iterate
  bool creeping_ = false;  // whether its iterates hardly move
};

}  // namespace ccr
