#include "segment.hpp"

#include <math.h>

#include "lanes.hpp"

namespace ccr {

#define CASADI_SYMBOL_EXPORT static inline
#define casadi_real Lanes
#include "segment_law.c"
#undef casadi_real

#if defined(__GNUC__)
[[gnu::flatten]]  // the law is worth inlining
#endif
void bend_segments(int n, const double* shear_sines, double pull, double length, double offset, Bend* bends) {
  const Lanes pulls = pull, lengths = length, offsets = offset;
  for (int first = 0; first < n; first += Lanes::kWidth) {
    const int count = n - first < Lanes::kWidth ? n - first : Lanes::kWidth;
    Lanes sines = 0.0;
    for (int k = 0; k < count; ++k) sines.v[k] = shear_sines[first + k];
    Lanes law[10];
    const Lanes* in[] = {&sines, &pulls, &lengths, &offsets};
    Lanes* out[] = {law};
    ccr_segment(in, out, nullptr, nullptr, 0);
    for (int k = 0; k < count; ++k)
      bends[first + k] = {law[0].v[k], law[1].v[k], law[2].v[k], law[3].v[k], law[4].v[k], law[5].v[k],
                          law[6].v[k], law[7].v[k], law[8].v[k], law[9].v[k], 0,           0};
  }
}

}  // namespace ccr
