// Newton's method for one equilibrium under a fixed command, near it and far from it.
#pragma once

#include <vector>

#include "solve/contact_problem.hpp"
#include "solve/active_set_qp.hpp"
#include "solve/kkt_system.hpp"

namespace ccr {

struct Verdict {
  bool converged = false;  // to a stable equilibrium: the curvature is positive along the active gaps
  int iterations = 0;
};

template <class Model>
class Newton {
 public:
  using Iterate = ccr::Iterate<Model>;

  Newton(const Robot& robot, int obstacles);
  void enter(std::span<const Obstacle<Model::kSpace>> obstacles);

  // Iteration with an l1 merit search: quadratic, for a start close to a stable equilibrium. Gives up where the
  // curvature along the active gaps is not positive, after so many damped iterations.
  Verdict solve(Iterate& at, int damped);

  // One iterate of energy descent from a feasible shape. Returns the verdict on that shape, and where it is not yet an
  // equilibrium moves `at` to a feasible one of no more energy, by a step of at most the size `largest`; `moved` tells
  // whether it could.
  Verdict descend(Iterate& at, double largest, bool& moved);

  // Takes the curvature at `at` as the measure of motion for restore; false when it cannot be made positive.
  bool measure(const Iterate& at);
  // Smallest motion that closes the active gaps exactly and meets every other; false when there is none nearby.
  bool restore(Iterate& at);

  // Factorisations of the Hessian so far, which nearly all of the work goes with.
  std::int64_t work() const { return hessian_.factorizations; }

  Chain<Model> chain;  // evaluated at the last iterate

 private:
  bool equilibrium(const ActiveSet& active) const;
  ActiveSet closed(const ActiveSet& active) const;
  bool on_surface(const ActiveSet& active, double tolerance) const;
  bool convex(const ActiveSet& active, int penalties);
  bool convexify(const ActiveSet& active, int penalties);
  bool damp();
  double size(const Direction<Model>& step) const;
  double merit(double weight) const;
  double search(const Iterate& at, const ActiveSet& target, double& weight);

  Hessian<Model> hessian_;
  Contacts<Model> contacts_;
  Direction<Model> step_, correction_;
  double size_ = 0;  // of `step_`
  Iterate trial_;
  double damping_ = 0;
  double needed_ = 0;   // of damping, in the descent that goes on
  double stretch_ = 1;  // of its next damped iterate
  bool creeping_ = false;  // whether its iterates hardly move
};

}  // namespace ccr
