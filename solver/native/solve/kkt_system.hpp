// The Hessian of the Lagrangian in all unknowns, factored: the controls of the segments by the Riccati recursion, the
// displacements of the mounted obstacles by the Schur complement that is left.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "solve/contact_problem.hpp"

namespace ccr {

template <class Model>
struct Direction {
  Direction(int segments, int mounts) : controls(segments), states(segments + 1), mounts(mounts) {}
  std::vector<typename Model::Control> controls;
  std::vector<typename Model::State> states;
  std::vector<Position<Model::kSpace>> mounts;

  void clear();
  void add(double scale, const Direction& other);
};

template <class Model>
class KktSystem {
 public:
  using ContactProblem = ccr::ContactProblem<Model>;
  using Direction = ccr::Direction<Model>;
  using Slope = typename ContactProblem::Slope;

  // Something to respond to, a slope of a gap or else that of the Lagrangian at the problem, and where its response
  // goes.
  struct Load {
    const Slope* gap;
    Direction* response;
  };

  KktSystem(int segments, int mounts);

  // Takes the curvature at a shape, with a penalty on each active gap of this strength over the largest curvature.
  void assemble(const ContactProblem& problem, const ActiveSet& active, double strength);
  // True exactly when it is positive definite, with this damping of all unknowns.
  bool factor(double damping);
  // H⁻¹ times the slope of a gap, or -H⁻¹ times that of the Lagrangian.
  void solve(const ContactProblem& problem, std::span<const Load> loads);

  std::int64_t factorizations = 0;                         // so far
  double penalty(int j) const { return penalty_[j]; }      // on an active gap, in their order
  double max_curvature() const { return max_curvature_; }  // largest curvature of a control

 private:
  static constexpr int kSpace = Model::kSpace;
  static constexpr int kMaxLoads = std::max(tolerances::kMaxActive + 1, 3 * tolerances::kMaxObstacles);
  using System = typename Model::System;
  using Force = typename System::Force;

  // One of the directions a touched mount can move in: the forces that puts on the problem, and its response.
  struct Column {
    int mount, axis;
    std::vector<Force> forces;
    Direction response;
  };

  void assemble_mounts(const ContactProblem& problem, const ActiveSet& active);
  bool factor_mounts(double damping);
  void couple_mounts(Direction& response);

  System system_;
  std::vector<double> penalty_;
  std::vector<Mat<kSpace, kSpace>> mount_hessian_, mount_factor_;  // of each mount by itself
  std::vector<Column> columns_;
  int touched_ = 0;            // columns in use
  std::vector<double> schur_;  // Cholesky factor, (touched, touched)
  std::vector<double> moves_;  // of the touched columns
  double max_curvature_ = 0;
  double arm_ = 1;  // turns the damping of a control into that of a displacement [mm]
  std::vector<typename System::Load> loads_;
};

}  // namespace ccr
