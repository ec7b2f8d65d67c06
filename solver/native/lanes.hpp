// Several numbers computed as one, so that the generated laws run on whatever vector registers there are.
#pragma once

#include <cmath>

namespace ccr {

struct Lanes {
  static constexpr int kWidth = 4;
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

template <class Function>
Lanes each(Lanes a, Function function) {
  for (int i = 0; i < Lanes::kWidth; ++i) a.v[i] = function(a.v[i]);
  return a;
}

inline Lanes asin(Lanes a) {
  return each(a, [](double x) { return std::asin(x); });
}
inline Lanes sqrt(Lanes a) {
  return each(a, [](double x) { return std::sqrt(x); });
}

}  // namespace ccr
