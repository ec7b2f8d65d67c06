// The KKT system of Newton's method: the Hessian of the Lagrangian, factored by the Riccati recursion in the controls
// of the segments and by a Schur complement in the displacements of the mounts.
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

  // A right-hand side, the gradient of a gap or, where that is null, of the Lagrangian, and what receives the solution.
  struct Load {
    const Slope* gap;
    Direction* response;
  };

  KktSystem(int segments, int mounts);

  // Assembles the Hessian at the problem's shape, with a penalty on each active gap: `strength` times the largest
  // curvature of a control.
  void assemble(const ContactProblem& problem, const ActiveSet& active, double strength);
  // Factors it plus `damping` on all unknowns; false where it is singular, or not positive definite and has to be. That
  // of a rod may have `negative` eigenvalues, which its taut cable and contacts make up for.
  bool factor(double damping);
  // Solves for several right-hand sides: H⁻¹ times the gradient of a gap, or -H⁻¹ times that of the Lagrangian.
  void solve(const ContactProblem& problem, std::span<const Load> loads);

  // The same for a gradient in the controls, or where that is null forces on the nodes. The response holds the
  // right-hand side of the mounts, and receives the solution.
  struct Forcing {
    const typename Model::Control* gradient;
    std::span<const typename Model::System::Force> forces;
    Direction* response;
  };
  void respond(std::span<const Forcing> forcings);

  const typename Model::System& system() const { return system_; }  // without the mounts
  std::int64_t factorizations = 0;                                  // so far
  int negative = 0;                                                 // eigenvalues at the last factor
  bool counts_inertia = Model::kRod;                                // whether H may have negative eigenvalues
  double penalty(int j) const { return penalty_[j]; }               // on the j-th active gap
  double max_curvature() const { return max_curvature_; }           // of a shear

 private:
  static constexpr int kSpace = Model::kSpace;
  static constexpr int kMaxLoads = std::max(tolerances::kMaxActive + 1, 3 * tolerances::kMaxObstacles);
  using System = typename Model::System;
  using Force = typename System::Force;

  // The coupling of one direction of a touched mount: its column of the Hessian, as forces on the nodes, and the
  // chain's response.
  struct Column {
    int mount, axis;
    std::vector<Force> forces;
    Direction response;
  };

  void assemble_mounts(const ContactProblem& problem, const ActiveSet& active);
  int factor_mounts(double damping);  // negative eigenvalues, -1 where it is singular
  void couple_mounts(Direction& response);

  System system_;
  std::vector<double> penalty_;
  std::vector<Mat<kSpace, kSpace>> mount_hessian_, mount_factor_;  // of each mount, without the chain
  // Damping of each mount over that of the controls: as much in relation to its own stiffness, or obstacles on soft
  // springs would hardly move.
  std::vector<double> mount_damping_;  // [1/mm²]
  std::vector<Column> columns_;
  int touched_ = 0;            // number of columns in use
  std::vector<double> schur_;  // Schur complement as L D Lᵀ: unit L below the diagonal, D on it, (touched, touched)
  std::vector<double> moves_;  // solution in these columns
  double max_curvature_ = 0;
  std::vector<typename System::Load> loads_;
};

}  // namespace ccr
