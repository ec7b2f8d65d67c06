// Numbers with their slopes in a few inputs, for which formulas that are written for numbers give slopes as well.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace ccr {

template <int P>
struct Dual {
  double value = 0;
  std::array<double, P> slopes{};

  Dual() = default;
  Dual(double number) : value(number) {}

  // A number and the multiple of another one's slopes.
  static Dual of(double value, double factor, const Dual& x) {
    Dual out(value);
    for (int p = 0; p < P; ++p) out.slopes[p] = factor * x.slopes[p];
    return out;
  }
  Dual& add(double factor, const Dual& x) {
    for (int p = 0; p < P; ++p) slopes[p] += factor * x.slopes[p];
    return *this;
  }
  Dual& operator+=(const Dual& b) {
    value += b.value;
    return add(1, b);
  }
  Dual& operator-=(const Dual& b) {
    value -= b.value;
    return add(-1, b);
  }
  friend Dual operator+(Dual a, const Dual& b) { return a += b; }
  friend Dual operator-(Dual a, const Dual& b) { return a -= b; }
  friend Dual operator-(const Dual& a) { return of(-a.value, -1, a); }
  friend Dual operator*(const Dual& a, const Dual& b) { return of(a.value * b.value, b.value, a).add(a.value, b); }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double quotient = a.value / b.value;
    return of(quotient, 1 / b.value, a).add(-quotient / b.value, b);
  }
  friend bool operator>(const Dual& a, double b) { return a.value > b; }
  friend bool operator<(const Dual& a, double b) { return a.value < b; }
};

inline double value_of(double number) { return number; }
template <int P>
double value_of(const Dual<P>& number) {
  return number.value;
}

// Square root; of zero, as the length of a vector, without a slope.
inline double root(double number) { return std::sqrt(number); }
template <int P>
Dual<P> root(const Dual<P>& number) {
  const double root = std::sqrt(number.value);
  return Dual<P>::of(root, root > 0 ? 0.5 / root : 0.0, number);
}

inline double magnitude(double number) { return std::abs(number); }
template <int P>
Dual<P> magnitude(const Dual<P>& number) {
  return Dual<P>::of(std::abs(number.value), number.value < 0 ? -1 : 1, number);
}

// The number within bounds, beyond which it has no slope.
inline double bounded(double number, double low, double high) { return std::min(std::max(number, low), high); }
template <int P>
Dual<P> bounded(const Dual<P>& number, double low, double high) {
  const double inside = bounded(number.value, low, high);
  return inside == number.value ? number : Dual<P>(inside);
}

// Length of a vector.
template <int D>
double norm(const double* v) {
  if constexpr (D == 2) return std::hypot(v[0], v[1]);
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}
template <int D, int P>
Dual<P> norm(const Dual<P>* v) {
  double values[D];
  for (int d = 0; d < D; ++d) values[d] = v[d].value;
  Dual<P> out(norm<D>(values));
  for (int d = 0; d < D && out.value > 0; ++d) out.add(values[d] / out.value, v[d]);
  return out;
}

}  // namespace ccr
