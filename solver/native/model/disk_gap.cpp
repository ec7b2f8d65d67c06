#include "model/disk_gap.hpp"

// The generated law, inlined here.
#define CASADI_SYMBOL_EXPORT static inline
#include "disk_laws.c"

namespace ccr {

DiskGap measure_disk_gap(double angle, double length, double radius, double thickness) {
  const double* in[] = {&angle, &length, &radius, &thickness};
  DiskGap gap;
  double* out[] = {&gap.value};
  ccr_disk_gap(in, out, nullptr, nullptr, 0);
  return gap;
}

}  // namespace ccr
