// Dense matrices of fixed size, small enough for the compiler to unroll their loops.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "math/pack.hpp"

namespace ccr {

template <int R, int C, class T = double>
struct Mat {
  std::array<T, R * C> v{};
  T& operator()(int r, int c) { return v[r * C + c]; }
  const T& operator()(int r, int c) const { return v[r * C + c]; }
  T& operator[](int i) { return v[i]; }
  const T& operator[](int i) const { return v[i]; }
  Mat& operator+=(const Mat& o) {
    for (int i = 0; i < R * C; ++i) v[i] += o.v[i];
    return *this;
  }
  Mat& operator-=(const Mat& o) {
    for (int i = 0; i < R * C; ++i) v[i] -= o.v[i];
    return *this;
  }
};

template <int N, class T = double>
using Vec = Mat<N, 1, T>;

template <int R, int K, int C, class T>
[[gnu::always_inline]] inline Mat<R, C, T> times(const Mat<R, K>& a, const Mat<K, C, T>& b) {
  Mat<R, C, T> out;
  for (int r = 0; r < R; ++r)
    for (int k = 0; k < K; ++k)
      for (int c = 0; c < C; ++c) out(r, c) += a(r, k) * b(k, c);
  return out;
}

// The same, of two numbers in a row and of the third.
inline Mat<3, 3> times(const Mat<3, 3>& a, const Mat<3, 3>& b) {
  Mat<3, 3> out;
  Pack<2> two[3];
  for (int k = 0; k < 3; ++k) std::memcpy(&two[k].v, &b(k, 0), sizeof two[k].v);
  for (int r = 0; r < 3; ++r) {
    Pack<2> sum = a(r, 0) * two[0];
    double last = a(r, 0) * b(0, 2);
    for (int k = 1; k < 3; ++k) {
      sum += a(r, k) * two[k];
      last += a(r, k) * b(k, 2);
    }
    std::memcpy(&out(r, 0), &sum.v, sizeof sum.v);
    out(r, 2) = last;
  }
  return out;
}

// aᵀ b
template <int K, int R, int C, class T>
[[gnu::always_inline]] inline Mat<R, C, T> transpose_times(const Mat<K, R>& a, const Mat<K, C, T>& b) {
  Mat<R, C, T> out;
  for (int k = 0; k < K; ++k)
    for (int r = 0; r < R; ++r)
      for (int c = 0; c < C; ++c) out(r, c) += a(k, r) * b(k, c);
  return out;
}

template <int N>
double dot(const Vec<N>& a, const Vec<N>& b) {
  double sum = 0;
  for (int i = 0; i < N; ++i) sum += a[i] * b[i];
  return sum;
}

template <int N>
Vec<N> minus(Vec<N> a, const Vec<N>& b) {
  a -= b;
  return a;
}

template <int N>
double norm(const Vec<N>& a) {
  return std::sqrt(dot(a, a));
}

// Returns the smallest of n values, infinity for none. Four running minima, because each comparison depends on the
// one before.
template <class Value>
double lowest(int n, Value value) {
  double least[4];
  for (double& one : least) one = std::numeric_limits<double>::infinity();
  int i = 0;
  for (; i + 4 <= n; i += 4)
    for (int k = 0; k < 4; ++k) least[k] = std::min(least[k], value(i + k));
  for (; i < n; ++i) least[0] = std::min(least[0], value(i));
  return std::min(std::min(least[0], least[1]), std::min(least[2], least[3]));
}

// Factors a symmetric matrix in place as L D Lᵀ, with unit L below the diagonal and 1/D on it. Returns the number of
// its negative eigenvalues, which is that of negative pivots, or -1 where a pivot is zero.
template <int N>
int factorize(Mat<N, N>& a) {
  int negative = 0;
  for (int j = 0; j < N; ++j) {
    Vec<N> scaled;
    for (int k = 0; k < j; ++k) {
      scaled[k] = a(j, k) / a(k, k);
      a(j, j) -= a(j, k) * scaled[k];
    }
    if (!(std::abs(a(j, j)) > 0)) return -1;
    negative += a(j, j) < 0;
    a(j, j) = 1 / a(j, j);
    for (int i = j + 1; i < N; ++i) {
      for (int k = 0; k < j; ++k) a(i, j) -= a(i, k) * scaled[k];
      a(i, j) *= a(j, j);
    }
  }
  return negative;
}

template <int N, int C, class T>
[[gnu::always_inline]] inline void solve_factored(const Mat<N, N>& factor, Mat<N, C, T>& b) {
  for (int c = 0; c < C; ++c) {
    for (int i = 0; i < N; ++i)
      for (int k = 0; k < i; ++k) b(i, c) -= factor(i, k) * b(k, c);
    for (int i = N - 1; i >= 0; --i) {
      b(i, c) *= factor(i, i);
      for (int k = i + 1; k < N; ++k) b(i, c) -= factor(k, i) * b(k, c);
    }
  }
}

// Columns of a matrix that are computed as one: two where their number is even, or else all of them.
template <int C>
inline constexpr int kBlock = C % 2 == 0 ? 2 : C;

template <int R, int C>
[[gnu::always_inline]] inline auto columns(const Mat<R, C>& a, int first) {
  if constexpr (kBlock<C> == C) {
    return a;
  } else {
    Vec<R, Pack<2>> out;
    for (int r = 0; r < R; ++r) std::memcpy(&out[r].v, &a(r, first), sizeof out[r].v);
    return out;
  }
}

template <int R, int C>
[[gnu::always_inline]] inline void set_columns(Mat<R, C>& a, int, const Mat<R, C>& all) {
  a = all;
}
template <int R, int C>
[[gnu::always_inline]] inline void set_columns(Mat<R, C>& a, int first, const Vec<R, Pack<2>>& two) {
  for (int r = 0; r < R; ++r) std::memcpy(&a(r, first), &two[r].v, sizeof two[r].v);
}

// a ← a b
template <int R, int N>
void multiply(Mat<R, N>& a, const Mat<N, N>& b) {
  a = times(a, b);
}

}  // namespace ccr
