// Several doubles computed as one, so that the generated laws run on the vector registers at hand.
#pragma once

#include <cmath>

#include "math/rows.hpp"

#ifndef CCR_LANES
#define CCR_LANES 4
#endif

namespace ccr::CCR_SIMD {
namespace {

struct Lanes {
  static constexpr int kWidth = CCR_LANES;
#if defined(__GNUC__)
  typedef double Vector __attribute__((vector_size(8 * kWidth)));
#else
#error "the kernel needs a compiler with GNU vector types (GCC or Clang)"
#endif

  Vector v;

  Lanes() = default;
  Lanes(double x) : v(x - Vector{}) {}
  Lanes(Vector x) : v(x) {}
};

inline Lanes operator+(Lanes a, Lanes b) { return {a.v + b.v}; }
inline Lanes operator-(Lanes a, Lanes b) { return {a.v - b.v}; }
inline Lanes operator*(Lanes a, Lanes b) { return {a.v * b.v}; }
inline Lanes operator/(Lanes a, Lanes b) { return {a.v / b.v}; }
inline Lanes operator-(Lanes a) { return {-a.v}; }

inline Lanes sqrt(Lanes a) {
  for (int i = 0; i < Lanes::kWidth; ++i) a.v[i] = std::sqrt(a.v[i]);
  return a;
}

template <class Mask>
bool any(Mask mask) {
  bool found = false;
  for (int i = 0; i < Lanes::kWidth; ++i) found |= mask[i] != 0;
  return found;
}

// Arcsine by the rational approximation of Sun's fdlibm, within one or two units in the last place; NaN outside
// [-1, 1].
inline Lanes asin(Lanes a) {
  using Vector = Lanes::Vector;
  const Vector size = a.v < 0.0 ? -a.v : a.v;
  const auto steep = size > 0.5;
  const Vector z = steep ? (1.0 - size) * 0.5 : size * size;
  const Vector p = z * (1.66666666666666657415e-01 +
                        z * (-3.25565818622400915405e-01 +
                             z * (2.01212532134862925881e-01 +
                                  z * (-4.00555345006794114027e-02 +
                                       z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)))));
  const Vector q =
      1.0 + z * (-2.40339491173441421878e+00 +
                 z * (2.02094576023350569471e+00 + z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)));
  const Vector rest = p / q;
  Vector angle = size + size * rest;
  if (any(steep)) {
    const Vector root = sqrt(Lanes(z)).v;
    angle = steep ? 1.57079632679489661923 - 2.0 * (root + root * rest) : angle;
  }
  return {a.v < 0.0 ? -angle : angle};
}

// Numbers of as many segments as there are lanes, from `first` on.
template <int N>
void read(const Rows& rows, int first, Lanes (&lanes)[N], int from = 0) {
  for (int k = 0; k < N; ++k) __builtin_memcpy(&lanes[k].v, rows.row(from + k) + first, sizeof lanes[k].v);
}

template <int N>
void write(const Lanes (&lanes)[N], int first, Rows& rows) {
  for (int k = 0; k < N; ++k) __builtin_memcpy(rows.row(k) + first, &lanes[k].v, sizeof lanes[k].v);
}

}  // namespace
}  // namespace ccr::CCR_SIMD
