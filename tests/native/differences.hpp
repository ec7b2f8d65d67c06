// What the tests of the segment laws share: scales, central differences, and rotations that are close.
#pragma once

#include <cmath>
#include <cstring>

#include "math/rotations.hpp"
#include "math/rows.hpp"

namespace ccr::testing {

inline constexpr double kScales[] = {1e-3, 1,
                                     1e3};   // of a robot with segments of 10 mm and cables 8 mm off the backbone
inline constexpr double kDifference = 1e-5;  // of a coordinate, for central differences
inline constexpr double kClose = 1e-8;       // error of the differences, relative to derivatives of about one

inline bool near(double a, double b, double scale) { return std::abs(a - b) <= kClose * scale; }

// Small rotation between two rotations that are close.
inline Vec<3> turn(const Mat<3, 3>& from, const Mat<3, 3>& to) {
  Mat<3, 3> between;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) between(r, c) += to(r, k) * from(c, k);
  return {
      {(between(2, 1) - between(1, 2)) / 2, (between(0, 2) - between(2, 0)) / 2, (between(1, 0) - between(0, 1)) / 2}};
}

inline bool same_bits(const Rows& a, const Rows& b, int numbers, int segments) {
  for (int k = 0; k < numbers; ++k)
    if (std::memcmp(a.row(k), b.row(k), static_cast<std::size_t>(segments) * sizeof(double)) != 0) return false;
  return true;
}

}  // namespace ccr::testing
