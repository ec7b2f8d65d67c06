#include "transition/laws.hpp"

#include <cmath>

// The generated laws, inlined here.
#define CASADI_SYMBOL_EXPORT static inline
#include "transition_laws.c"

namespace ccr {

void reward_terms(const double* weights, const double* inputs, double* terms) {
  const double* in[] = {weights, inputs};
  ccr_reward_terms(in, &terms, nullptr, nullptr, 0);
}

void reward_slopes(const double* weights, const double* inputs, double* slopes) {
  const double* in[] = {weights, inputs};
  ccr_reward_slopes(in, &slopes, nullptr, nullptr, 0);
}

double work_factor(const double* inputs, double* slopes) {
  double factor;
  double *out[] = {&factor}, *to[] = {slopes};
  ccr_work_factor(&inputs, out, nullptr, nullptr, 0);
  if (slopes) ccr_work_factor_slopes(&inputs, to, nullptr, nullptr, 0);
  return factor;
}

template <>
double virtual_work<2>(const double* inputs, double friction, double* slopes) {
  double factor;
  const double* in[] = {inputs, &friction};
  double *out[] = {&factor}, *to[] = {slopes};
  ccr_planar_work(in, out, nullptr, nullptr, 0);
  if (slopes) ccr_planar_work_slopes(in, to, nullptr, nullptr, 0);
  return factor;
}

template <>
double virtual_work<3>(const double* inputs, double friction, double* slopes) {
  double factor;
  const double* in[] = {inputs, &friction};
  double *out[] = {&factor}, *to[] = {slopes};
  ccr_spatial_work(in, out, nullptr, nullptr, 0);
  if (slopes) ccr_spatial_work_slopes(in, to, nullptr, nullptr, 0);
  return factor;
}

}  // namespace ccr
