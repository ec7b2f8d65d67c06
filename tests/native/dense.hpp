// Textbook dense linear algebra as a reference.
#pragma once

#include <cmath>
#include <vector>

#include "math/linalg.hpp"

namespace ccr::testing {

using Column = std::vector<double>;

class Dense {
 public:
  Dense(int rows, int columns) : rows_(rows), columns_(columns), values_(static_cast<std::size_t>(rows * columns)) {}

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  double& operator()(int r, int c) { return values_[static_cast<std::size_t>(r * columns_ + c)]; }
  double operator()(int r, int c) const { return values_[static_cast<std::size_t>(r * columns_ + c)]; }

  // Adds a small block at this row and column.
  template <int R, int C>
  void add(int row, int column, const Mat<R, C>& block) {
    for (int r = 0; r < R; ++r)
      for (int c = 0; c < C; ++c) (*this)(row + r, column + c) += block(r, c);
  }

 private:
  int rows_, columns_;
  std::vector<double> values_;
};

inline Dense product(const Dense& a, const Dense& b) {
  Dense out(a.rows(), b.columns());
  for (int r = 0; r < a.rows(); ++r)
    for (int k = 0; k < a.columns(); ++k)
      for (int c = 0; c < b.columns(); ++c) out(r, c) += a(r, k) * b(k, c);
  return out;
}

inline Dense transposed(const Dense& a) {
  Dense out(a.columns(), a.rows());
  for (int r = 0; r < a.rows(); ++r)
    for (int c = 0; c < a.columns(); ++c) out(c, r) = a(r, c);
  return out;
}

inline Column product(const Dense& a, const Column& x) {
  Column out(static_cast<std::size_t>(a.rows()));
  for (int r = 0; r < a.rows(); ++r)
    for (int c = 0; c < a.columns(); ++c) out[static_cast<std::size_t>(r)] += a(r, c) * x[static_cast<std::size_t>(c)];
  return out;
}

inline double dot(const Column& a, const Column& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

inline double largest(const Column& x) {
  double size = 0;
  for (const double entry : x) size = std::max(size, std::abs(entry));
  return size;
}

inline double apart(const Column& a, const Column& b) {
  double farthest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) farthest = std::max(farthest, std::abs(a[k] - b[k]));
  return farthest;
}

// Replaces a symmetric matrix by its Cholesky factor, below the diagonal. Returns the smallest ratio of a pivot to its
// diagonal entry, which is positive if and only if the matrix is positive definite.
inline double cholesky(Dense& a) {
  double least = 1;
  for (int j = 0; j < a.rows(); ++j) {
    double pivot = a(j, j);
    for (int k = 0; k < j; ++k) pivot -= a(j, k) * a(j, k);
    least = std::min(least, pivot / std::abs(a(j, j)));
    if (!(pivot > 0)) return std::min(least, 0.0);
    a(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < a.rows(); ++i) {
      for (int k = 0; k < j; ++k) a(i, j) -= a(i, k) * a(j, k);
      a(i, j) /= a(j, j);
    }
  }
  return least;
}

// Counts the negative eigenvalues of a symmetric matrix, which Jacobi's rotations make diagonal.
inline int negative_eigenvalues(Dense a) {
  const int n = a.rows();
  for (int sweep = 0; sweep < 30; ++sweep)
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        const double angle = std::atan2(2 * a(p, q), a(q, q) - a(p, p)) / 2, c = std::cos(angle), s = std::sin(angle);
        for (int k = 0; k < n; ++k) {
          const double left = a(k, p), right = a(k, q);
          a(k, p) = c * left - s * right;
          a(k, q) = s * left + c * right;
        }
        for (int k = 0; k < n; ++k) {
          const double upper = a(p, k), lower = a(q, k);
          a(p, k) = c * upper - s * lower;
          a(q, k) = s * upper + c * lower;
        }
      }
  int negative = 0;
  for (int k = 0; k < n; ++k) negative += a(k, k) < 0;
  return negative;
}

inline Column solve_cholesky(const Dense& factor, Column x) {
  const auto at = [&](int i) -> double& { return x[static_cast<std::size_t>(i)]; };
  for (int i = 0; i < factor.rows(); ++i) {
    for (int k = 0; k < i; ++k) at(i) -= factor(i, k) * at(k);
    at(i) /= factor(i, i);
  }
  for (int i = factor.rows() - 1; i >= 0; --i) {
    for (int k = i + 1; k < factor.rows(); ++k) at(i) -= factor(k, i) * at(k);
    at(i) /= factor(i, i);
  }
  return x;
}

}  // namespace ccr::testing
