// Riccati recursion for the KKT system of a chain: minimise ½ Σ (x,u)ᵀ H_i (x,u) + linear terms subject to
// x⁺ = A x + B u, x_0 = 0.
#pragma once

#include <cstddef>
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
    const Mat<NX, NX> along = times(cross, stages[node].a);
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
    bool idle = true;  // whether no term acts on a state so far
    for (int i = static_cast<int>(stages.size()) - 1; i >= 0; --i) {
      const Stage& s = stages[i];
      idle = idle && node_hessian[i + 1].v == Mat<NX, NX>{}.v && s.hux.v == Mat<NU, NX>{}.v;
      if (idle) {
        Mat<NU, NU> quu = s.huu;
        for (int k = 0; k < NU; ++k) quu(k, k) += damping;
        const int pivots = factorize(quu);
        if (pivots < 0 || (negative += pivots) > allowed) return -1;
        factor_[i] = quu;
        gain_[i] = {};
        continue;
      }
      p += node_hessian[i + 1];
      const Mat<NU, NX> btp = transpose_times(s.b, p);
      Mat<NU, NU> quu = times(btp, s.b);
      quu += s.huu;
      for (int k = 0; k < NU; ++k) quu(k, k) += damping;
      Mat<NU, NX> qux = times(btp, s.a);
      qux += s.hux;
      const int pivots = factorize(quu);
      if (pivots < 0 || (negative += pivots) > allowed) return -1;
      factor_[i] = quu;
      gain_[i] = qux;
      solve_factored(quu, gain_[i]);
      p = transpose_times(s.a, times(p, s.a));
      p -= transpose_times(qux, gain_[i]);
    }
    return negative;
  }

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
  // Solves W right-hand sides side by side: the operations of one depend on each other, those of several do not.
  template <int W>
  void sweep(const Load* loads) {
    Vec<NX> v[W];
    for (int i = static_cast<int>(stages.size()) - 1; i >= 0; --i) {
      const Stage& s = stages[i];
      for (int k = 0; k < W; ++k) {
        for (const Force& force : loads[k].forces) {
          if (force.node == i + 1) v[k] -= force.here;
          if (force.node == i && force.split) v[k] -= force.next;
        }
        Vec<NU> h = transpose_times(s.b, v[k]);
        if (loads[k].slope) h += loads[k].slope[i];
        v[k] = transpose_times(s.a, v[k]);
        v[k] -= transpose_times(gain_[i], h);
        solve_factored(factor_[i], h);
        loads[k].du[i] = h;
      }
    }
    Vec<NX> x[W];
    for (int k = 0; k < W; ++k) loads[k].dx[0] = {};
    for (std::size_t i = 0; i < stages.size(); ++i)
      for (int k = 0; k < W; ++k) {
        Vec<NU> u = times(gain_[i], x[k]);
        u += loads[k].du[i];
        for (int c = 0; c < NU; ++c) u[c] = -u[c];
        x[k] = times(stages[i].a, x[k]);
        x[k] += times(stages[i].b, u);
        loads[k].du[i] = u;
        loads[k].dx[i + 1] = x[k];
      }
  }

  std::vector<Mat<NU, NX>> gain_;
  std::vector<Mat<NU, NU>> factor_;
};

}  // namespace ccr
