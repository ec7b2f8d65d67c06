// A contact problem at a random shape, with contacts where a test wants them.
#pragma once

#include <doctest/doctest.h>

#include "dense.hpp"
#include "model/models.hpp"
#include "random.hpp"
#include "robots.hpp"
#include "solve/contact_problem.hpp"
#include "solve/kkt_system.hpp"

namespace ccr::testing {

template <class Model>
RobotNumbers numbers_of(int segments) {
  RobotNumbers of;
  of.rod = Model::kRod;
  of.segments = segments;
  of.length = 10 * segments;
  return of;
}

// Cables pulled by 0.4 mm per segment, and controls near those of the free robot.
template <class Model>
Iterate<Model> random_shape(Random& random, const RobotNumbers& of, int mounts, double size) {
  Iterate<Model> at;
  for (double& cable : at.command.cables.v) cable = 0.4 * of.segments;
  at.command.length = of.length;
  at.controls.resize(of.segments);
  for (auto& control : at.controls) {
    control = random.matrix<Model::kControl>(size);
    if (Model::kRod) control[Model::kControl / 2] += 0.05;  // towards the cable
  }
  at.mounts.resize(mounts);
  for (auto& mount : at.mounts) mount = random.matrix<Model::kSpace>(0.5);
  return at;
}

// Updates the broad phase with the nodes of the problem's last shape.
template <class Model>
void update_broadphase(ContactProblem<Model>& problem, const Iterate<Model>& at) {
  std::vector<Position<Model::kSpace>> nodes(problem.states().size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (int k = 0; k < Model::kSpace; ++k) nodes[i][k] = problem.states()[i][k];
  problem.update_broadphase(nodes, at.mounts);
}

// All unknowns in one column: controls, then mounts.
template <class Model>
Column flat(const std::vector<typename Model::Control>& controls, const std::vector<Position<Model::kSpace>>& mounts) {
  Column out;
  for (const auto& control : controls) out.insert(out.end(), control.v.begin(), control.v.end());
  for (const auto& mount : mounts) out.insert(out.end(), mount.v.begin(), mount.v.end());
  return out;
}

template <class Model>
void move(Iterate<Model>& at, std::size_t unknown, double by) {
  const std::size_t controls = at.controls.size() * Model::kControl;
  if (unknown < controls)
    at.controls[unknown / Model::kControl][static_cast<int>(unknown % Model::kControl)] += by;
  else
    at.mounts[(unknown - controls) / Model::kSpace][static_cast<int>((unknown - controls) % Model::kSpace)] += by;
}

template <class Model>
std::size_t unknowns(const Iterate<Model>& at) {
  return at.controls.size() * Model::kControl + at.mounts.size() * Model::kSpace;
}

// Gradient of the Lagrangian at a shape, in all unknowns.
template <class Model>
Column lagrangian_slope(ContactProblem<Model>& problem, const Iterate<Model>& at) {
  REQUIRE(problem.evaluate(at));
  problem.reduced_gradient(at.active);
  return flat<Model>(problem.gradient(), problem.mount_gradient());
}

}  // namespace ccr::testing
