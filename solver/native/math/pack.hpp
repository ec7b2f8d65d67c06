// A few doubles computed as one. Each is rounded as it would be alone.
#pragma once

namespace ccr {

template <int W>
struct Pack {
#if defined(__GNUC__)
  typedef double Vector __attribute__((vector_size(8 * W)));
#else
#error "the kernel needs a compiler with GNU vector types (GCC or Clang)"
#endif

  Vector v;

  Pack& operator+=(const Pack& o) {
    v += o.v;
    return *this;
  }
  Pack& operator-=(const Pack& o) {
    v -= o.v;
    return *this;
  }
  Pack& operator*=(double x) {
    v *= x;
    return *this;
  }
  friend Pack operator+(const Pack& a, const Pack& b) { return {a.v + b.v}; }
  friend Pack operator-(const Pack& a, const Pack& b) { return {a.v - b.v}; }
  friend Pack operator-(const Pack& a) { return {-a.v}; }
  friend Pack operator*(const Pack& a, double x) { return {a.v * x}; }
  friend Pack operator*(double x, const Pack& a) { return {x * a.v}; }
};

}  // namespace ccr
