// Random numbers that are the same on every platform, unlike those of the standard distributions.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "math/linalg.hpp"

namespace ccr::testing {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  double decades(double low, double high) { return std::pow(10.0, uniform(low, high)); }
  int integer(int low, int high) {
    return low + static_cast<int>(engine_() % static_cast<std::uint64_t>(high - low + 1));
  }
  bool chance(double probability) { return uniform(0, 1) < probability; }

  template <int R, int C = 1>
  Mat<R, C> matrix(double size = 1) {
    Mat<R, C> out;
    for (double& entry : out.v) entry = uniform(-size, size);
    return out;
  }

  // A symmetric matrix with `shift` added to its diagonal.
  template <int N>
  Mat<N, N> symmetric(double shift) {
    Mat<N, N> out;
    for (int r = 0; r < N; ++r)
      for (int c = 0; c <= r; ++c) out(r, c) = out(c, r) = uniform(-1, 1);
    for (int k = 0; k < N; ++k) out(k, k) += shift;
    return out;
  }

  template <int N>
  Vec<N> direction() {
    for (;;) {
      Vec<N> out = matrix<N>();
      const double size = norm(out);
      if (size > 1 || size < 0.1) continue;
      for (double& part : out.v) part /= size;
      return out;
    }
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace ccr::testing
