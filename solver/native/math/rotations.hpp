// Small rotations in the plane, by an angle, and in space, by a vector about the axes of the base frame.
#pragma once

#include "math/linalg.hpp"

namespace ccr {

template <int D>
using Position = Vec<D>;

template <class A, class B>
auto cross(const Vec<3, A>& a, const Vec<3, B>& b) {
  return Vec<3, decltype(a[0] * b[0])>{
      {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

// Derivative of the end of a lever in the rotation.
inline Mat<2, 1> swing(const Vec<2>& lever) { return {{-lever[1], lever[0]}}; }
inline Mat<3, 3> swing(const Vec<3>& lever) {
  return {{0, lever[2], -lever[1], -lever[2], 0, lever[0], lever[1], -lever[0], 0}};
}

// Moment of a force at the end of a lever.
inline Vec<1> moment(const Vec<2>& lever, const Vec<2>& force) { return {{force[1] * lever[0] - force[0] * lever[1]}}; }
inline Vec<3> moment(const Vec<3>& lever, const Vec<3>& force) { return cross(lever, force); }

// Second derivative, in the rotation, of the work of a constant force at the end of a lever.
inline Mat<1, 1> hessian_contraction(const Vec<2>& lever, const Vec<2>& force) { return {{-dot(lever, force)}}; }
inline Mat<3, 3> hessian_contraction(const Vec<3>& lever, const Vec<3>& force) {
  Mat<3, 3> out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out(r, c) = (force[r] * lever[c] + lever[r] * force[c]) / 2;
  const double work = dot(lever, force);
  for (int k = 0; k < 3; ++k) out(k, k) -= work;
  return out;
}

}  // namespace ccr
