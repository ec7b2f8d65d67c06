// The Riccati recursion against a dense factorisation of the same problem with the states eliminated.
#include <doctest/doctest.h>

#include "dense.hpp"
#include "math/riccati.hpp"
#include "model/planar.hpp"
#include "model/spatial_chain.hpp"
#include "random.hpp"

namespace ccr::testing {
namespace {

template <int N>
Mat<N, N> dense(const Mat<N, N>& a) {
  return a;
}

template <int N, class Transition>
Mat<N, N> dense(const Transition& a) {
  Mat<N, N> identity;
  for (int k = 0; k < N; ++k) identity(k, k) = 1;
  multiply(identity, a);
  return identity;
}

template <int N>
void sample(Random& random, Mat<N, N>& a) {
  a = random.matrix<N, N>();
}
void sample(Random& random, PlanarTransition& a) { a = {random.uniform(-1, 1), random.uniform(-1, 1)}; }
void sample(Random& random, SpatialTransition& a) { a.chord = random.matrix<3>(); }

// A random problem in two forms: for the recursion, and dense in the controls alone.
template <int NX, int NU, class Transition>
struct Problem {
  using System = Riccati<NX, NU, Transition>;

  Problem(Random& random, int n, double shift) : system(n), motion(NX * (n + 1), NU * n), hessian(NU * n, NU * n) {
    Dense curvature(NX * (n + 1), NX * (n + 1)), cross(NX * (n + 1), NU * n);
    for (int i = 0; i <= n; ++i) {
      system.node_hessian[i] = random.symmetric<NX>(shift / 2);
      curvature.add(NX * i, NX * i, system.node_hessian[i]);
    }
    for (int i = 0; i < n; ++i) {
      auto& stage = system.stages[i];
      sample(random, stage.a);
      stage.b = random.matrix<NX, NU>();
      stage.hux = random.matrix<NU, NX>(0.3);
      stage.huu = random.symmetric<NU>(shift);
      hessian.add(NU * i, NU * i, stage.huu);
      cross.add(NX * i, NU * i, transposed_block(stage.hux));
    }
    for (int i = 0; i < n; ++i) {
      if (!random.chance(0.4)) continue;
      const Mat<NX, NX> beside = random.matrix<NX, NX>(0.5);
      system.couple(i, beside);
      curvature.add(NX * i, NX * (i + 1), beside);
      curvature.add(NX * (i + 1), NX * i, transposed_block(beside));
    }
    for (int i = 0; i < n; ++i) advance(i);
    reduce(curvature, cross);
  }

  template <int R, int C>
  static Mat<C, R> transposed_block(const Mat<R, C>& a) {
    Mat<C, R> out;
    for (int r = 0; r < R; ++r)
      for (int c = 0; c < C; ++c) out(c, r) = a(r, c);
    return out;
  }

  // The states of node i + 1 as a function of all controls.
  void advance(int i) {
    const Mat<NX, NX> a = dense<NX>(system.stages[i].a);
    for (int c = 0; c < motion.columns(); ++c)
      for (int r = 0; r < NX; ++r)
        for (int k = 0; k < NX; ++k) motion(NX * (i + 1) + r, c) += a(r, k) * motion(NX * i + k, c);
    motion.add(NX * (i + 1), NU * i, system.stages[i].b);
  }

  // H = Huu + Mᵀ Hxx M + Mᵀ Hxu + Hux M, where x = M u.
  void reduce(const Dense& curvature, const Dense& cross) {
    const Dense seen = product(transposed(motion), product(curvature, motion)),
                mixed = product(transposed(motion), cross);
    for (int r = 0; r < hessian.rows(); ++r)
      for (int c = 0; c < hessian.columns(); ++c) hessian(r, c) += seen(r, c) + mixed(r, c) + mixed(c, r);
  }

  Dense damped(double damping) const {
    Dense out = hessian;
    for (int k = 0; k < out.rows(); ++k) out(k, k) += damping;
    return out;
  }

  System system;
  Dense motion, hessian;
};

template <int N>
Column flat(const std::vector<Vec<N>>& blocks) {
  Column out;
  for (const Vec<N>& block : blocks) out.insert(out.end(), block.v.begin(), block.v.end());
  return out;
}

// Random right-hand sides of the recursion, one to four at a time: slopes of the controls and forces on nodes.
template <int NX, int NU, class Transition>
struct RightHandSides {
  using System = Riccati<NX, NU, Transition>;

  RightHandSides(Random& random, const Problem<NX, NU, Transition>& problem, int n)
      : count(random.integer(1, 4)),
        slopes(count, std::vector<Vec<NU>>(n)),
        controls(slopes),
        states(count, std::vector<Vec<NX>>(n + 1)),
        forces(count) {
    for (int k = 0; k < count; ++k) {
      dense.push_back(product(transposed(problem.motion), add_forces(random, n, forces[k])));
      const bool sloped = random.chance(0.5);
      for (Vec<NU>& slope : slopes[k]) slope = random.matrix<NU>();
      if (sloped)
        for (std::size_t i = 0; i < dense[k].size(); ++i) dense[k][i] -= flat(slopes[k])[i];
      loads.push_back({sloped ? slopes[k].data() : nullptr, forces[k], controls[k].data(), states[k].data()});
    }
  }

  // Adds up to two forces; returns their sum in all states.
  static Column add_forces(Random& random, int n, std::vector<typename System::Force>& forces) {
    Column on_states(static_cast<std::size_t>(NX * (n + 1)));
    for (int left = random.integer(0, 2); left > 0; --left) {
      const int node = random.integer(0, n);
      const bool split = node < n && random.chance(0.5);
      forces.push_back({node, split, random.matrix<NX>(), random.matrix<NX>()});
      for (int c = 0; c < NX; ++c) {
        on_states[NX * node + c] += forces.back().here[c];
        if (split) on_states[NX * (node + 1) + c] += forces.back().next[c];
      }
    }
    return on_states;
  }

  int count;
  std::vector<std::vector<Vec<NU>>> slopes, controls;
  std::vector<std::vector<Vec<NX>>> states;
  std::vector<std::vector<typename System::Force>> forces;
  std::vector<typename System::Load> loads;
  std::vector<Column> dense;  // the same, reduced to the controls
};

template <int NX, int NU, class Transition>
void compare(std::uint64_t seed) {
  Random random(seed);
  int definite = 0, indefinite = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const int n = random.integer(1, 9);
    Problem<NX, NU, Transition> problem(random, n, random.decades(-1, 2.5));
    const double damping = random.chance(0.3) ? random.decades(-2, 1) : 0;
    Dense factor = problem.damped(damping);
    const double pivot = cholesky(factor);
    CHECK((problem.system.factor(damping) == 0) == (pivot > 0));
    CHECK(problem.system.factor(damping, NU * n) == negative_eigenvalues(problem.damped(damping)));
    ++(pivot > 0 ? definite : indefinite);
    if (pivot < 1e-6) continue;

    RightHandSides<NX, NU, Transition> right(random, problem, n);
    problem.system.respond(right.loads);
    for (int k = 0; k < right.count; ++k) {
      const Column expected = solve_cholesky(factor, right.dense[k]), moved = product(problem.motion, expected);
      const double scale = largest(expected) + 1e-300, reach = largest(moved) + 1e-300;
      CHECK(apart(flat(right.controls[k]), expected) <= 1e-8 * scale);
      CHECK(apart(flat(right.states[k]), moved) <= 1e-8 * (scale + reach));
      for (const auto& force : right.forces[k]) {
        double along = 0;
        for (int c = 0; c < NX; ++c)
          along += force.here[c] * moved[NX * force.node + c] +
                   (force.split ? force.next[c] * moved[NX * (force.node + 1) + c] : 0);
        CHECK(std::abs(force.along(right.states[k]) - along) <= 1e-8 * (scale + reach) * NX);
      }
    }
  }
  CHECK(definite > 40);
  CHECK(indefinite > 40);
}

TEST_CASE("the recursion is a dense Cholesky factorisation, 3 states and 1 control") {
  compare<3, 1, Mat<3, 3>>(1);
  compare<3, 1, PlanarTransition>(2);
}

TEST_CASE("the recursion is a dense Cholesky factorisation, 4 states and 1 control") {
  compare<4, 1, Mat<4, 4>>(3);
  compare<4, 1, PlanarTransition>(4);
}

TEST_CASE("the recursion is a dense Cholesky factorisation, 6 states and 3 controls") {
  compare<6, 3, Mat<6, 6>>(5);
  compare<6, 3, SpatialTransition>(6);
}

TEST_CASE("L D Lᵀ of a small matrix detects whether it is positive definite, and solves") {
  Random random(7);
  int definite = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Mat<3, 3> matrix = random.symmetric<3>(random.uniform(0, 2));
    Dense same(3, 3);
    same.add(0, 0, matrix);
    const double pivot = cholesky(same);
    Mat<3, 3> factor = matrix;
    CHECK((factorize(factor) == 0) == (pivot > 0));
    if (pivot < 1e-6) continue;
    ++definite;
    const Vec<3> right = random.matrix<3>();
    Vec<3> x = right;
    solve_factored(factor, x);
    const Vec<3> left = minus(times(matrix, x), right);
    CHECK(norm(left) <= 1e-9 * (1 + norm(x)));
  }
  CHECK(definite > 100);
}

}  // namespace
}  // namespace ccr::testing
