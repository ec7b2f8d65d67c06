#include "solve/kkt_system.hpp"

#include <algorithm>
#include <cmath>

#include "model/models.hpp"

namespace ccr {

using namespace tolerances;

template <class Model>
void Direction<Model>::clear() {
  std::fill(controls.begin(), controls.end(), typename Model::Control{});
  std::fill(states.begin(), states.end(), typename Model::State{});
  std::fill(mounts.begin(), mounts.end(), Position<Model::kSpace>{});
}

template <class Model>
void Direction<Model>::add(double scale, const Direction& other) {
  for (std::size_t i = 0; i < controls.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) controls[i][k] += scale * other.controls[i][k];
  for (std::size_t i = 0; i < states.size(); ++i)
    for (int k = 0; k < Model::kState; ++k) states[i][k] += scale * other.states[i][k];
  for (std::size_t m = 0; m < other.mounts.size(); ++m)
    for (int k = 0; k < Model::kSpace; ++k) mounts[m][k] += scale * other.mounts[m][k];
}

template <class Model>
KktSystem<Model>::KktSystem(int segments, int mounts)
    : system_(segments),
      penalty_(kMaxActive),
      mount_hessian_(mounts),
      mount_factor_(mounts),
      mount_damping_(mounts),
      columns_(kSpace * mounts, Column{0, 0, {}, Direction(segments, 0)}),
      schur_(kSpace * kSpace * mounts * mounts),
      moves_(kSpace * mounts),
      loads_(kMaxLoads) {
  for (Column& column : columns_) column.forces.reserve(kMaxActive);
}

namespace {

template <int N>
Mat<N, N> outer(double scale, const Vec<N>& a, const Vec<N>& b) {
  Mat<N, N> product;
  for (int r = 0; r < N; ++r)
    for (int c = 0; c < N; ++c) product(r, c) = scale * a[r] * b[c];
  return product;
}

template <int N>
double largest(const Mat<N, N>& matrix) {
  double entry = 0;
  for (const double value : matrix.v) entry = std::max(entry, std::abs(value));
  return entry;
}

}  // namespace

template <class Model>
void KktSystem<Model>::assemble(const ContactProblem& problem, const ActiveSet& active, double strength) {
  problem.lagrangian_hessian(active, system_);
  max_curvature_ = 0;
  for (const auto& stage : system_.stages)
    for (int k = 0; k < Model::kShears; ++k) max_curvature_ = std::max(max_curvature_, std::abs(stage.huu(k, k)));
  for (int j = 0; j < active.count; ++j) {
    penalty_[j] = 0;
    if (strength == 0 || problem.is_slack(active.contact[j])) continue;
    const Force slope = problem.slope(active.contact[j]).force;
    const double arm = problem.lever_arm(active.contact[j]);
    penalty_[j] = strength * max_curvature_ / (arm * arm);
    system_.node_hessian[slope.node] += outer(penalty_[j], slope.here, slope.here);
    if (!slope.split) continue;
    system_.node_hessian[slope.node + 1] += outer(penalty_[j], slope.next, slope.next);
    system_.couple(slope.node, outer(penalty_[j], slope.here, slope.next));
  }
  assemble_mounts(problem, active);
}

// A contact with a mount has the Hessian -λ∇²c + penalty ∇c∇cᵀ in the point, the same in the mount, and its negative
// between them.
template <class Model>
void KktSystem<Model>::assemble_mounts(const ContactProblem& problem, const ActiveSet& active) {
  touched_ = 0;
  const double arm = problem.robot().max_length / problem.robot().segments;
  for (std::size_t m = 0; m < mount_hessian_.size(); ++m) {
    mount_hessian_[m] = problem.spring(m);
    mount_damping_[m] = largest(mount_hessian_[m]) / max_curvature_;
  }
  if (mount_hessian_.empty()) return;
  for (int j = 0; j < active.count; ++j) {
    const int mount = problem.mount(active.contact[j]);
    if (mount < 0) continue;
    int first = 0;
    while (first < touched_ && columns_[first].mount != mount) first += kSpace;
    if (first == touched_) {
      touched_ += kSpace;
      for (int k = 0; k < kSpace; ++k) {
        columns_[first + k].mount = mount;
        columns_[first + k].axis = k;
        columns_[first + k].forces.clear();
      }
    }
    const Gap<kSpace> gap = problem.gap(active.contact[j]);
    Mat<kSpace, kSpace> stiffening = gap.curvature(active.multiplier[j]);
    mount_damping_[mount] += largest(stiffening) / max_curvature_;
    stiffening -= outer(penalty_[j], gap.slope, gap.slope);
    mount_hessian_[mount] -= stiffening;
    for (int k = 0; k < kSpace; ++k) {
      Position<kSpace> column;
      for (int r = 0; r < kSpace; ++r) column[r] = stiffening(r, k);
      columns_[first + k].forces.push_back(problem.force(active.contact[j], column));
    }
  }
  for (double& damping : mount_damping_) damping = std::min(damping, 1 / (arm * arm));
}

template <class Model>
bool KktSystem<Model>::factor(double damping) {
  ++factorizations;
  negative = system_.factor(damping, counts_inertia ? Model::kControl * static_cast<int>(system_.stages.size()) : 0);
  if (negative < 0 || mount_hessian_.empty()) return negative >= 0;
  const int of_mounts = factor_mounts(damping);
  if (of_mounts < 0 || (of_mounts > 0 && !counts_inertia)) return false;
  negative += of_mounts;
  return true;
}

template <class Model>
int KktSystem<Model>::factor_mounts(double damping) {
  int negative = 0;
  for (std::size_t m = 0; m < mount_hessian_.size(); ++m) {
    mount_factor_[m] = mount_hessian_[m];
    for (int k = 0; k < kSpace; ++k) mount_factor_[m](k, k) += mount_damping_[m] * damping;
  }
  for (int a = 0; a < touched_; ++a) {
    Column& column = columns_[a];
    loads_[a] = {nullptr, column.forces, column.response.controls.data(), column.response.states.data()};
  }
  system_.respond(std::span(loads_).first(touched_));
  for (int a = 0; a < touched_; ++a)
    for (int b = 0; b <= a; ++b) {
      double entry = 0;
      if (columns_[a].mount == columns_[b].mount)
        entry = mount_factor_[columns_[a].mount](columns_[a].axis, columns_[b].axis);
      for (const Force& force : columns_[a].forces) entry -= force.along(columns_[b].response.states);
      for (int k = 0; k < b; ++k)
        entry -= schur_[a * touched_ + k] * schur_[b * touched_ + k] * schur_[k * touched_ + k];
      if (a == b && !(std::abs(entry) > 0)) return -1;
      negative += a == b && entry < 0;
      schur_[a * touched_ + b] = a == b ? entry : entry / schur_[b * touched_ + b];
    }
  // Of a touched mount only the Schur complement matters, whose curvature may have any sign.
  for (Mat<kSpace, kSpace>& factor : mount_factor_)
    if (const int own = factorize(factor); own < 0 || (own > 0 && !counts_inertia)) return -1;
  return negative;
}

// Completes the response of the chain alone, with the right-hand side of the mounts in `response.mounts`, to that of
// all unknowns.
template <class Model>
void KktSystem<Model>::couple_mounts(Direction& response) {
  for (int a = 0; a < touched_; ++a) {
    moves_[a] = response.mounts[columns_[a].mount][columns_[a].axis];
    for (const Force& force : columns_[a].forces) moves_[a] -= force.along(response.states);
    for (int k = 0; k < a; ++k) moves_[a] -= schur_[a * touched_ + k] * moves_[k];
  }
  for (int a = touched_ - 1; a >= 0; --a) {
    moves_[a] /= schur_[a * touched_ + a];
    for (int k = a + 1; k < touched_; ++k) moves_[a] -= schur_[k * touched_ + a] * moves_[k];
  }
  for (std::size_t m = 0; m < mount_factor_.size(); ++m) solve_factored(mount_factor_[m], response.mounts[m]);
  for (int a = 0; a < touched_; ++a) {
    response.mounts[columns_[a].mount][columns_[a].axis] = moves_[a];
    response.add(-moves_[a], columns_[a].response);
  }
}

template <class Model>
void KktSystem<Model>::solve(const ContactProblem& problem, std::span<const Load> loads) {
  for (std::size_t k = 0; k < loads.size(); ++k) {
    Direction& response = *loads[k].response;
    const Slope* gap = loads[k].gap;
    const auto* slope = gap ? gap->minus_controls : problem.gradient().data();
    loads_[k] = {slope, slope ? std::span<const Force>() : std::span(&gap->force, 1), response.controls.data(),
                 response.states.data()};
  }
  system_.respond(std::span(loads_).first(loads.size()));
  if (mount_hessian_.empty()) return;
  for (const Load& load : loads) {
    std::vector<Position<kSpace>>& mounts = load.response->mounts;
    for (std::size_t m = 0; m < mounts.size(); ++m) {
      mounts[m] = {};
      if (!load.gap) mounts[m] -= problem.mount_gradient()[m];
      if (load.gap && load.gap->mount == static_cast<int>(m)) mounts[m] -= load.gap->normal;
    }
    couple_mounts(*load.response);
  }
}

template <class Model>
void KktSystem<Model>::respond(std::span<const Forcing> forcings) {
  while (!forcings.empty()) {
    const auto some = forcings.first(std::min(forcings.size(), loads_.size()));
    for (std::size_t k = 0; k < some.size(); ++k) {
      const auto& [gradient, forces, response] = some[k];
      loads_[k] = {gradient, forces, response->controls.data(), response->states.data()};
    }
    system_.respond(std::span(loads_).first(some.size()));
    if (!mount_hessian_.empty())
      for (const Forcing& forcing : some) couple_mounts(*forcing.response);
    forcings = forcings.subspan(some.size());
  }
}

#define CCR_INSTANTIATE(Model)      \
  template struct Direction<Model>; \
  template class KktSystem<Model>;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
