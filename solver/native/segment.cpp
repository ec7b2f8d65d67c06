#include "segment.hpp"

#include <math.h>

#include "lanes.hpp"

namespace ccr {

#define CASADI_SYMBOL_EXPORT static inline
#define casadi_real Lanes
#include "segment_laws.c"
#undef casadi_real

namespace {

// Calls `use` with the index of each segment, its place in the lanes, and the values of a law of (coordinate, constants).
template <int Values, class Law, class Use>
void for_segments(int n, const double* coordinates, const Lanes** in, Law law, Use use) {
  for (int first = 0; first < n; first += Lanes::kWidth) {
    const int count = n - first < Lanes::kWidth ? n - first : Lanes::kWidth;
    Lanes coordinate = 0.0;
    for (int k = 0; k < count; ++k) coordinate.v[k] = coordinates[first + k];
    in[0] = &coordinate;
    Lanes values[Values];
    Lanes* out[] = {values};
    law(in, out, nullptr, nullptr, 0);
    for (int k = 0; k < count; ++k) use(first + k, k, values);
  }
}

}  // namespace

// The laws are worth inlining.
[[gnu::flatten]]
void UniformCable::bend(int n, const double* sines, double pull, double length, double offset, Bend* bends) {
  const Lanes pulls = pull, lengths = length, offsets = offset;
  const Lanes* in[] = {nullptr, &pulls, &lengths, &offsets};
  for_segments<10>(n, sines, in, ccr_segment, [&](int i, int k, const Lanes* law) {
    bends[i] = {law[0].v[k], law[1].v[k], law[2].v[k], law[3].v[k], law[4].v[k], law[5].v[k],
                law[6].v[k], law[7].v[k], law[8].v[k], law[9].v[k], 0,           0};
  });
}

[[gnu::flatten]]
void SlidingCable::bend(int n, const double* angles, double, double length, double offset, Bend* bends) {
  const Lanes lengths = length, offsets = offset;
  const Lanes* in[] = {nullptr, &lengths, &offsets};
  for_segments<9>(n, angles, in, ccr_arc, [&](int i, int k, const Lanes* law) {
    bends[i] = {angles[i],   law[0].v[k], law[1].v[k], law[2].v[k], law[3].v[k], law[4].v[k],
                law[5].v[k], law[6].v[k], law[7].v[k], law[8].v[k], 0,           0};
  });
}

}  // namespace ccr
