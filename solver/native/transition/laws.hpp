// The formulas of reward and estimate, generated from solver/common/transition_laws.py.
#pragma once

#include <algorithm>

#include "transition/dual.hpp"

namespace ccr {

inline constexpr int kTerms = 5;  // of the reward

// What the reward depends on, in this order: magnitudes of force and set-point [N], relative error, smallest gap over
// the robot's length, and mean square of the action.
inline constexpr int kRewardInputs = 5;

// Writes the weighted terms of the reward; and their slopes in the inputs, one column after the other.
void reward_terms(const double* weights, const double* inputs, double* terms);
void reward_slopes(const double* weights, const double* inputs, double* slopes);

// Factor for which works fit those that lack, by least squares, from sums of their products and squares and the least
// size of a work: three inputs. Writes its slopes in them unless null.
double work_factor(const double* inputs, double* slopes);

// Factor for which a force does the virtual work of the cable loads, with friction added to it. Inputs in the plane are
// the force (2), the load over its lever, and slopes of the tip (3); in space the force (3), loads (2), slopes (2, 5).
template <int D>
double virtual_work(const double* inputs, double friction, double* slopes);

// Calls one of these functions of N numbers, or of duals.
template <int N, class Law>
double apply(Law law, const double* inputs) {
  return law(inputs, nullptr);
}
template <int N, class Law, int P>
Dual<P> apply(Law law, const Dual<P>* inputs) {
  double values[N], slopes[N];
  for (int k = 0; k < N; ++k) values[k] = inputs[k].value;
  Dual<P> out(law(values, slopes));
  for (int k = 0; k < N; ++k) out.add(slopes[k], inputs[k]);
  return out;
}

}  // namespace ccr
