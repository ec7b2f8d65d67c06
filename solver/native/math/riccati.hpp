// Riccati recursion for the KKT system of a chain: minimise ½ Σ (x,u)ᵀ H_i (x,u) + linear terms subject to
// x⁺ = A x + B u, x_0 = 0.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "math/linalg.hpp"

namespace ccr {

// `Transition` is the type of A: a Mat<NX, NX>, or a type that multiplies like one and exploits its structure.
template <int NX, int NU, class Transition = Mat<NX, NX>>
class Riccati {
 public:
  struct Stage {
    Transition a;
    Mat<NX, NU> b;
    Mat<NU, NX> hux;  // H of segment i in its control and state, and in its control
    Mat<NU, NU> huu;
  };

  explicit Riccati(int segments) : stages(segments), node_hessian(segments + 1), gain_(segments), factor_(segments) {}

  std::vector<Stage> stages;
  std::vector<Mat<NX, NX>> node_hessian;  // H in the state of each node

  // Adds a term of H that couples the state of a node (rows) with that of the next node (columns).
  void couple(int node, const Mat<NX, NX>& cross) {
    Mat<NX, NX> along = cross;
    multiply(along, stages[node].a);
    for (int r = 0; r < NX; ++r)
      for (int c = 0; c < NX; ++c) node_hessian[node](r, c) += along(r, c) + along(c, r);
    const Mat<NX, NU> turned = times(cross, stages[node].b);
    for (int r = 0; r < NX; ++r)
      for (int c = 0; c < NU; ++c) stages[node].hux(c, r) += turned(r, c);
  }

  // Factors the reduced Hessian plus `damping` on the controls. Returns the number of its negative eigenvalues, or -1
  // where it is singular or has more of them than `allowed`.
  int factor(double damping, int allowed = 0) {
    Mat<NX, NX> p;
    int negative = 0;
    idle_ = static_cast<int>(stages.size());
    for (int i = idle_ - 1; i >= 0; --i) {
      const Stage& s = stages[i];
      if (idle_ == i + 1 && node_hessian[i + 1].v == Mat<NX, NX>{}.v && s.hux.v == Mat<NU, NX>{}.v) idle_ = i;
      Mat<NU, NU>& quu = factor_[i];
      Mat<NU, NX> qux;
      if (i < idle_) {
        p += node_hessian[i + 1];
        for (int c = 0; c < NX; c += kBlock<NX>) set_columns(qux, c, transpose_times(s.b, columns(p, c)));
        quu = times(qux, s.b);
        quu += s.huu;
        multiply(qux, s.a);
        qux += s.hux;
      } else {
        quu = s.huu;
      }
      for (int k = 0; k < NU; ++k) quu(k, k) += damping;
      const int pivots = factorize(quu);
      if (pivots < 0 || (negative += pivots) > allowed) return -1;
      if (i < idle_) eliminate(i, qux, p);
    }
    return negative;
  }

  // The stage from which on nothing acts on a state: H is that of the controls alone there. Follows a factor.
  int idle() const { return idle_; }

  // A linear term in the state of a node, and in that of the next one where `split`.
  struct Force {
    int node;
    bool split;
    Vec<NX> here, next;

    double along(const std::vector<Vec<NX>>& states) const {
      return dot(here, states[node]) + (split ? dot(next, states[node + 1]) : 0.0);
    }
  };

  // A right-hand side, a gradient in the controls or else forces, and the arrays that receive its solution.
  struct Load {
    const Vec<NU>* slope;  // (n) or null
    std::span<const Force> forces;
    Vec<NU>* du;  // (n)
    Vec<NX>* dx;  // (n+1)
  };

  // Solves for several right-hand sides: H⁻¹ times the forces, or -H⁻¹ times the gradient. Follows a factor that
  // returned true.
  void respond(std::span<const Load> loads) {
    for (; loads.size() >= 2; loads = loads.subspan(2)) sweep<2>(loads.data());
    if (!loads.empty()) sweep<1>(loads.data());
  }

 private:
  // Eliminates the controls of a segment: p ← aᵀ p a - quxᵀ quu⁻¹ qux.
  void eliminate(int i, const Mat<NU, NX>& qux, Mat<NX, NX>& p) {
    multiply(p, stages[i].a);
    for (int c = 0; c < NX; c += kBlock<NX>) {
      auto gain = columns(qux, c);
      solve_factored(factor_[i], gain);
      set_columns(gain_[i], c, gain);
      auto column = transpose_times(stages[i].a, columns(p, c));
      column -= transpose_times(qux, gain);
      set_columns(p, c, column);
    }
  }

  // Solves W right-hand sides side by side. Beyond `reach` none acts, and neither does anything act on a state; beyond
  // `coupled` no force does, so that the controls of each segment move by themselves.
  template <int W>
  void sweep(const Load* loads) {
    using Lanes = Pack<W>;
    const int n = static_cast<int>(stages.size());
    Vec<NX, Lanes> v;
    bool sloped = false;
    int forced = 0;
    for (int k = 0; k < W; ++k) {
      sloped |= loads[k].slope != nullptr;
      for (const Force& force : loads[k].forces) forced = std::max(forced, force.node + force.split);
    }
    const int reach = sloped ? n : forced, coupled = std::max(forced, idle_);
    for (int i = reach; i < n; ++i)
      for (int k = 0; k < W; ++k) loads[k].du[i] = {};
    for (int i = reach - 1; i >= 0; --i) {
      const Stage& s = stages[i];
      for (int k = 0; k < W && i < forced; ++k)
        for (const Force& force : loads[k].forces) {
          if (force.node == i + 1) subtract(force.here, k, v);
          if (force.node == i && force.split) subtract(force.next, k, v);
        }
      Vec<NU, Lanes> h;
      if (i < coupled) {
        h = transpose_times(s.b, v);
        v = transpose_times(s.a, v);
      }
      for (int k = 0; k < W; ++k)
        if (const Vec<NU>* slope = loads[k].slope)
          for (int c = 0; c < NU; ++c) h[c].v[k] += slope[i][c];
      if (i < idle_) v -= transpose_times(gain_[i], h);
      solve_factored(factor_[i], h);
      for (int k = 0; k < W; ++k)
        for (int c = 0; c < NU; ++c) loads[k].du[i][c] = h[c].v[k];
    }
    Vec<NX, Lanes> x;
    for (int k = 0; k < W; ++k) loads[k].dx[0] = {};
    for (int i = 0; i < n; ++i) {
      Vec<NU, Lanes> u;
      if (i < idle_) u = times(gain_[i], x);
      for (int k = 0; k < W; ++k)
        for (int c = 0; c < NU; ++c) u[c].v[k] += loads[k].du[i][c];
      for (int c = 0; c < NU; ++c) u[c] = -u[c];
      x = times(stages[i].a, x);
      x += times(stages[i].b, u);
      for (int k = 0; k < W; ++k) {
        for (int c = 0; c < NU; ++c) loads[k].du[i][c] = u[c].v[k];
        for (int c = 0; c < NX; ++c) loads[k].dx[i + 1][c] = x[c].v[k];
      }
    }
  }

  template <int W>
  static void subtract(const Vec<NX>& force, int lane, Vec<NX, Pack<W>>& from) {
    for (int c = 0; c < NX; ++c) from[c].v[lane] -= force[c];
  }

  std::vector<Mat<NU, NX>> gain_;
  std::vector<Mat<NU, NU>> factor_;
  int idle_ = 0;  // the stage from which on nothing acts on a state, so that the gains are 0
};

}  // namespace ccr
