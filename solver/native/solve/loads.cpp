// The loads of a rod: gravity, dead forces and moments on its disks, and cables whose motors keep their tension.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/contact_problem.hpp"

namespace ccr {

// Calls `each` with node, lever, force and moment of every load: gravity as the weight of each segment, half and half
// at its nodes, then the dead loads.
template <class Model>
template <class Each>
void ContactProblem<Model>::each_load(Each each) const {
  const Rod& rod = robot_.rod;
  const double scale = loaded_ / energy_scale();
  const auto scaled = [&](const Vec<3>& force, double by) {
    Position out;
    for (int k = 0; k < kSpace; ++k) out[k] = scale * by * force[k];
    return out;
  };
  const int n = robot_.segments;
  if (dot(rod.weight, rod.weight) > 0)
    for (int i = 1; i <= n; ++i)
      each(i, Position{}, scaled(rod.weight, model_.segment_length() * (i < n ? 1 : 0.5)), 0.0);
  for (const Load& load : rod.loads)
    each(load.node, Model::lever(frames()[load.node], load.at), scaled(load.force, 1), scale * load.moment);
}

template <class Model>
double ContactProblem<Model>::load_work() {
  double work = 0, pressed = 0;
  each_load([&](int node, const Position& lever, const Position& force, double moment) {
    for (int k = 0; k < kSpace; ++k) work += force[k] * (states()[node][k] + lever[k]);
    if constexpr (Model::kTurn == 1) work += moment * states()[node][2];
    pressed += norm(force) * robot_.max_length + std::abs(moment);
  });
  load_slope_ = pressed;
  return work;
}

template <class Model>
void ContactProblem<Model>::add_loads(std::vector<State>& node_forces) const {
  each_load([&](int node, const Position& lever, const Position& force, double moment) {
    const auto turning = ccr::moment(lever, force);
    for (int k = 0; k < kSpace; ++k) node_forces[node][k] += force[k];
    for (int k = 0; k < Model::kTurn; ++k) node_forces[node][kSpace + k] += turning[k];
    if constexpr (Model::kTurn == 1) node_forces[node][2] += moment;
  });
}

template <class Model>
void ContactProblem<Model>::add_load_curvature(System& system) const {
  each_load([&](int node, const Position& lever, const Position& force, double) {
    const auto turn = hessian_contraction(lever, force);
    for (int r = 0; r < Model::kTurn; ++r)
      for (int c = 0; c < Model::kTurn; ++c) system.node_hessian[node](kSpace + r, kSpace + c) -= turn(r, c);
  });
}

template <class Model>
void ContactProblem<Model>::keep_tension(int cable, double tension) {
  kept_tensions_[cable] = tension;
  kept_multipliers_ = {};
  kept_slope_ = 0;
  keeps_tensions_ =
      std::any_of(kept_tensions_.v.begin(), kept_tensions_.v.end(), [](double t) { return t < HUGE_VAL; });
  evaluated_ = false;
}

// The work of motors that keep their tension: the shape takes up from their cables what it likes.
template <class Model>
double ContactProblem<Model>::kept_work() {
  double work = 0;
  kept_slope_ = 0;
  for (int k = 0; k < model_.cables().count(); ++k) {
    if (!keeps_tension(k)) continue;
    kept_multipliers_[k] = kept_tensions_[k] / energy_scale();
    work += kept_multipliers_[k] * taken(k);
    kept_slope_ = std::max(kept_slope_, kept_multipliers_[k] * lever_arm(slack_contact(k)));
  }
  return work;
}

#define CCR_INSTANTIATE(Model)                                                      \
  template double ContactProblem<Model>::load_work();                               \
  template double ContactProblem<Model>::kept_work();                               \
  template void ContactProblem<Model>::keep_tension(int, double);                   \
  template void ContactProblem<Model>::add_loads(std::vector<Model::State>&) const; \
  template void ContactProblem<Model>::add_load_curvature(Model::System&) const;
CCR_INSTANTIATE(PlanarRod)
CCR_INSTANTIATE(SpatialRod)
#undef CCR_INSTANTIATE

}  // namespace ccr
