// Newton systems of a chain: minimise ½ Σ (x,u)ᵀ H_i (x,u) + linear terms subject to x⁺ = A x + B u, x_0 = 0.
#pragma once

#include <vector>

#include "linalg.hpp"

namespace ccr {

template <int NX, int NU>
class Riccati {
 public:
  struct Stage {
    Mat<NX, NX> a;    // dynamics
    Mat<NX, NU> b;
    Mat<NX, NX> hxx;  // curvature of segment i in its own state and control
    Mat<NU, NX> hux;
    Mat<NU, NU> huu;
  };

  explicit Riccati(int segments) : stages(segments), node_hessian(segments + 1), gain_(segments), factor_(segments), feed_(segments) {}

  std::vector<Stage> stages;
  std::vector<Mat<NX, NX>> node_hessian;  // curvature added at each node

  // True exactly when the reduced Hessian (plus damping on the controls) is positive definite.
  bool factor(double damping) {
    Mat<NX, NX> p;
    for (int i = static_cast<int>(stages.size()) - 1; i >= 0; --i) {
      const Stage& s = stages[i];
      p += node_hessian[i + 1];
      const Mat<NU, NX> btp = transpose_times(s.b, p);
      Mat<NU, NU> quu = btp * s.b;
      quu += s.huu;
      for (int k = 0; k < NU; ++k) quu(k, k) += damping;
      Mat<NU, NX> qux = btp * s.a;
      qux += s.hux;
      if (!cholesky(quu)) return false;
      factor_[i] = quu;
      gain_[i] = qux;
      cholesky_solve(quu, gain_[i]);
      p = transpose_times(s.a, p * s.a);
      p += s.hxx;
      p -= transpose_times(qux, gain_[i]);
    }
    return true;
  }

  // Response of controls du (n) and states dx (n+1) to a force f on one node: H⁻¹ times its reduced gradient.
  void respond(int node, const Vec<NX>& f, Vec<NU>* du, Vec<NX>* dx) {
    Vec<NX> v;
    for (int k = 0; k < NX; ++k) v[k] = -f[k];
    for (int i = node - 1; i >= 0; --i) {
      Vec<NU> h = transpose_times(stages[i].b, v);
      v = transpose_times(stages[i].a, v);
      v -= transpose_times(gain_[i], h);
      cholesky_solve(factor_[i], h);
      feed_[i] = h;
    }
    for (std::size_t i = node; i < feed_.size(); ++i) feed_[i] = {};
    roll(du, dx);
  }

  // Response to a reduced gradient g on the controls: -H⁻¹ g.
  void descend(const Vec<NU>* g, Vec<NU>* du, Vec<NX>* dx) {
    Vec<NX> v;
    for (int i = static_cast<int>(stages.size()) - 1; i >= 0; --i) {
      Vec<NU> h = transpose_times(stages[i].b, v);
      h += g[i];
      v = transpose_times(stages[i].a, v);
      v -= transpose_times(gain_[i], h);
      cholesky_solve(factor_[i], h);
      feed_[i] = h;
    }
    roll(du, dx);
  }

 private:
  void roll(Vec<NU>* du, Vec<NX>* dx) const {
    dx[0] = {};
    for (std::size_t i = 0; i < stages.size(); ++i) {
      du[i] = {};
      du[i] -= feed_[i];
      du[i] -= gain_[i] * dx[i];
      dx[i + 1] = stages[i].a * dx[i];
      dx[i + 1] += stages[i].b * du[i];
    }
  }

  std::vector<Mat<NU, NX>> gain_;
  std::vector<Mat<NU, NU>> factor_;
  std::vector<Vec<NU>> feed_;
};

}  // namespace ccr
