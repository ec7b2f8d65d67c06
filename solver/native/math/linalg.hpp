// Dense matrices of fixed size, small enough for the compiler to unroll their loops.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ccr {

template <int R, int C>
struct Mat {
  std::array<double, R * C> v{};
  double& operator()(int r, int c) { return v[r * C + c]; }
  double operator()(int r, int c) const { return v[r * C + c]; }
  double& operator[](int i) { return v[i]; }
  double operator[](int i) const { return v[i]; }
  Mat& operator+=(const Mat& o) {
    for (int i = 0; i < R * C; ++i) v[i] += o.v[i];
    return *this;
  }
  Mat& operator-=(const Mat& o) {
    for (int i = 0; i < R * C; ++i) v[i] -= o.v[i];
    return *this;
  }
};

template <int N>
using Vec = Mat<N, 1>;

template <int R, int K, int C>
Mat<R, C> times(const Mat<R, K>& a, const Mat<K, C>& b) {
  Mat<R, C> out;
  for (int r = 0; r < R; ++r)
    for (int k = 0; k < K; ++k)
      for (int c = 0; c < C; ++c) out(r, c) += a(r, k) * b(k, c);
  return out;
}

// aᵀ b
template <int K, int R, int C>
Mat<R, C> transpose_times(const Mat<K, R>& a, const Mat<K, C>& b) {
  Mat<R, C> out;
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

template <int N, int C>
void solve_factored(const Mat<N, N>& factor, Mat<N, C>& b) {
  for (int c = 0; c < C; ++c) {
    for (int i = 0; i < N; ++i)
      for (int k = 0; k < i; ++k) b(i, c) -= factor(i, k) * b(k, c);
    for (int i = N - 1; i >= 0; --i) {
      b(i, c) *= factor(i, i);
      for (int k = i + 1; k < N; ++k) b(i, c) -= factor(k, i) * b(k, c);
    }
  }
}

}  // namespace ccr
