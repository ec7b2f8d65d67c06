// Numbers with slopes, and the laws of reward and estimate, against formulas written anew and central differences.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "differences.hpp"
#include "random.hpp"
#include "transition/laws.hpp"

namespace ccr::testing {
namespace {

constexpr int kTries = 200;

// The slope of a function of numbers along a direction.
template <std::size_t N, class F>
double difference(F f, const std::array<double, N>& at, const std::array<double, N>& along) {
  double ends[2];
  for (int end = 0; end < 2; ++end) {
    std::array<double, N> there = at;
    for (std::size_t k = 0; k < N; ++k) there[k] += (end == 0 ? kDifference : -kDifference) * along[k];
    ends[end] = f(there.data());
  }
  return (ends[0] - ends[1]) / (2 * kDifference);
}

// Checks that a function of duals has the values of that of numbers, and the slopes of its central differences along
// random directions.
template <std::size_t N, class F>
void check_slopes(Random& random, F f, const std::array<double, N>& at) {
  Dual<2> inputs[N];
  std::array<double, N> along[2];
  for (std::size_t k = 0; k < N; ++k) {
    inputs[k] = at[k];
    for (int p = 0; p < 2; ++p) inputs[k].slopes[p] = along[p][k] = random.uniform(-1, 1);
  }
  const Dual<2> out = f(static_cast<const Dual<2>*>(inputs));
  CHECK(out.value == f(at.data()));
  for (int p = 0; p < 2; ++p) CHECK(near(out.slopes[p], difference(f, at, along[p]), 10));
}

template <class F>
void check_operation(F f) {
  Random random(1);
  for (int k = 0; k < kTries; ++k) {
    const double a = random.uniform(0.3, 2) * (random.chance(0.5) ? 1 : -1), b = random.uniform(0.5, 2);
    check_slopes<2>(random, [&](const auto* x) { return f(x[0], x[1]); }, {a, b});
    check_slopes<2>(random, [&](const auto* x) { return f(x[1], x[0]); }, {b, a});
  }
}

template <int D, class T>
T length_of(const T& a, const T& b) {
  const T v[3] = {a, b, a - b};
  return norm<D>(v);
}

TEST_CASE("sums, products and quotients of duals have the slopes of their differences") {
  check_operation([](const auto& a, const auto& b) { return a + b; });
  check_operation([](const auto& a, const auto& b) { return a - b; });
  check_operation([](const auto& a, const auto& b) { return a * b; });
  check_operation([](const auto& a, const auto& b) { return a / b; });
  check_operation([](const auto& a, const auto&) { return -a; });
  check_operation([](auto a, const auto& b) { return a += b; });
  check_operation([](auto a, const auto& b) { return a -= b; });
  check_operation([](const auto& a, const auto& b) { return 3.0 * a + b / 2.0 - 1.0 / a * (b - 0.5); });
}

TEST_CASE("roots, magnitudes, lengths and bounds of duals have the slopes of their differences") {
  check_operation([](const auto& a, const auto& b) { return root(a * a + b * b); });
  check_operation([](const auto& a, const auto& b) { return magnitude(a) * b; });
  check_operation([](const auto& a, const auto& b) { return length_of<2>(a, b); });
  check_operation([](const auto& a, const auto& b) { return length_of<3>(a, b); });
  check_operation([](const auto& a, const auto& b) { return b * bounded(a, -0.2, 0.25); });
  check_operation([](const auto& a, const auto& b) { return b * bounded(a, -3, 3); });
}

TEST_CASE("duals compare by value, and have no slope where none is defined") {
  Dual<2> x(-2.0);
  x.slopes = {3, 4};
  CHECK(x < -1.0);
  CHECK_FALSE(x < -2.0);
  CHECK(x > -3.0);
  CHECK_FALSE(x > -2.0);
  CHECK(value_of(x) == -2);
  CHECK(value_of(1.5) == 1.5);
  const std::array<double, 2> none{};
  CHECK(bounded(x, -1, 1).slopes == none);
  CHECK(bounded(x, -1, 1).value == -1);
  CHECK(bounded(x, -4, -3).value == -3);
  CHECK(bounded(x, -2, 1).slopes == x.slopes);
  const Dual<2> zero = x - x.value - Dual<2>(0.0), vector[3] = {zero, zero, zero};
  CHECK(zero.slopes == x.slopes);
  CHECK(root(zero).slopes == none);
  CHECK(norm<2>(vector).slopes == none);
  CHECK(norm<3>(vector).slopes == none);
  CHECK(Dual<2>(5.0).slopes == none);
}

double clamped(double number, double low, double high) { return number < low ? low : number > high ? high : number; }

std::array<double, kTerms> expected_terms(const double* w, const double* inputs) {
  const double force = inputs[0], excess = force / inputs[1] - 1, error = inputs[2], span = 5.0 / 9;
  const double approach = force > 0 ? 0 : clamped(inputs[3], 0, span) / span;
  return {-w[0] * clamped(error, 0, 1), w[1] * std::exp(-20 * error), -w[2] * clamped(excess, 0, 1), -w[3] * approach,
          -w[4] * inputs[4]};
}

// Whether a term has no kink within the differences.
bool is_smooth(const std::array<double, kRewardInputs>& at) {
  const double excess = at[0] / at[1] - 1, least = 1e-3;
  for (const double kink : {at[2] - 1, excess, excess - 1, at[3], at[3] - 5.0 / 9})
    if (std::abs(kink) < least) return false;
  return true;
}

TEST_CASE("reward terms and their slopes are those of the formulas") {
  Random random(2);
  int checked = 0, touching = 0;
  for (int k = 0; k < kTries; ++k) {
    double weights[kTerms], terms[kTerms], slopes[kTerms * kRewardInputs];
    for (double& weight : weights) weight = random.uniform(0.1, 2);
    const std::array<double, kRewardInputs> at{random.chance(0.5) ? random.uniform(0.01, 2) : 0, random.uniform(0.2, 1),
                                               random.uniform(0, 1.5), random.uniform(-0.2, 0.8), random.uniform(0, 1)};
    reward_terms(weights, at.data(), terms);
    const auto expected = expected_terms(weights, at.data());
    for (int term = 0; term < kTerms; ++term) CHECK(near(terms[term], expected[term], 1e-6));
    if (!is_smooth(at)) continue;
    ++checked;
    touching += at[0] > 0;
    reward_slopes(weights, at.data(), slopes);
    for (int input = 0; input < kRewardInputs; ++input)
      for (int term = 0; term < kTerms; ++term) {
        const double slope = slopes[kTerms * input + term];
        if (input == 0 && at[0] == 0) {
          CHECK(slope == 0);
          continue;
        }
        std::array<double, kRewardInputs> along{};
        along[input] = 1;
        const auto value = [&](const double* inputs) { return expected_terms(weights, inputs)[term]; };
        CHECK(near(slope, difference(value, at, along), 100));
      }
  }
  CHECK(checked > kTries / 2);
  CHECK(touching > kTries / 5);
  CHECK(touching < checked);
}

double expected_factor(double product, double square, double least) {
  return product > 0 ? product / std::max(square, least * least) : 0;
}

TEST_CASE("the factor of works fits those that lack, and is none of works against") {
  Random random(3);
  for (int k = 0; k < kTries; ++k) {
    const std::array<double, 3> at{random.uniform(-1, 1), random.uniform(0.2, 1), random.uniform(0.3, 1.1)};
    if (std::abs(at[1] - at[2] * at[2]) < 1e-3 || std::abs(at[0]) < 1e-3) continue;
    CHECK(near(work_factor(at.data(), nullptr), expected_factor(at[0], at[1], at[2]), 1e-6));
    check_slopes<3>(random, [](const auto* x) { return apply<3>(work_factor, x); }, at);
  }
  double slopes[3];
  const double none[3] = {0, 0, 0}, against[3] = {-1, 2, 0};
  CHECK(work_factor(none, slopes) == 0);
  CHECK(work_factor(against, slopes) == 0);
  for (const double slope : slopes) CHECK(slope == 0);
}

TEST_CASE("works w that fit c w have the factor c") {
  Random random(4);
  for (int k = 0; k < kTries; ++k) {
    double inputs[3] = {0, 0, 0};
    const double factor = random.uniform(0.1, 3);
    for (int work = 0; work < 4; ++work) {
      const double w = random.uniform(-1, 1);
      inputs[0] += w * factor * w;
      inputs[1] += w * w;
    }
    CHECK(near(work_factor(inputs, nullptr), factor, 1e-6));
  }
}

double planar_factor(const double* x, double friction) {
  const double work = (x[0] - friction * x[1]) * x[3] + (x[1] + friction * x[0]) * x[4];
  return work < 0 ? x[2] * x[5] / work : 0;
}

TEST_CASE("the factor of virtual work in the plane is that of eq. 11") {
  Random random(5);
  int working = 0;
  for (int k = 0; k < kTries; ++k) {
    const double friction = random.uniform(0, 0.5);
    std::array<double, 6> at;
    for (double& number : at) number = random.uniform(-1, 1);
    const double expected = planar_factor(at.data(), friction);
    const double work = expected == 0 ? 1 : at[2] * at[5] / expected;
    CHECK(near(virtual_work<2>(at.data(), friction, nullptr), expected, 1e-6 * (1 + std::abs(expected))));
    if (work > 0 || work < -0.3) {
      const auto law = [friction](const double* x, double* to) { return virtual_work<2>(x, friction, to); };
      check_slopes<6>(random, [&](const auto* x) { return apply<6>(law, x); }, at);
      working += work < 0;
    } else {
      ++working;
    }
  }
  CHECK(working > kTries / 4);
}

// The normal force and friction along the part of a motion that is within the surface, both displacements pulled as
// they drive the tip into it.
double spatial_factor(const double* x, double friction) {
  const Vec<3> normal{{x[0], x[1], x[2]}}, motions[2] = {{{x[5], x[6], x[7]}}, {{x[10], x[11], x[12]}}};
  const double size = std::sqrt(dot(normal, normal));
  Vec<3> motion, force = normal;
  for (const Vec<3>& each : motions)
    for (int d = 0; d < 3; ++d) motion[d] -= dot(normal, each) / size * each[d];
  Vec<3> slip = motion;
  for (int d = 0; d < 3; ++d) slip[d] -= dot(motion, normal) / (size * size) * normal[d];
  for (int d = 0; d < 3; ++d) force[d] += friction * size * slip[d] / norm(slip);
  double product = 0, square = 0;
  for (int k = 0; k < 2; ++k) {
    const double work = dot(force, motions[k]), given = x[3] * x[8 + 5 * k] + x[4] * x[9 + 5 * k];
    product -= work * given;
    square += work * work;
  }
  return product > 0 ? product / square : 0;
}

TEST_CASE("the factor of virtual work in space is that of both loads") {
  Random random(6);
  int working = 0, checked = 0;
  for (int k = 0; k < kTries; ++k) {
    const double friction = random.uniform(0, 0.5);
    std::array<double, 15> at;
    for (double& number : at) number = random.uniform(-1, 1);
    const double expected = spatial_factor(at.data(), friction);
    const auto law = [friction](const double* x, double* to) { return virtual_work<3>(x, friction, to); };
    CHECK(near(law(at.data(), nullptr), expected, 1e-6 * (1 + std::abs(expected))));
    working += expected > 0;
    // Where works are small the factor bends too much for the differences.
    double slopes[15], largest = 0;
    law(at.data(), slopes);
    for (const double slope : slopes) largest = std::max(largest, std::abs(slope));
    if (largest > 5 || (expected > 0 && expected < 1e-2)) continue;
    ++checked;
    check_slopes<15>(random, [&](const auto* x) { return apply<15>(law, x); }, at);
  }
  CHECK(working > kTries / 4);
  CHECK(checked > kTries / 4);
}

}  // namespace
}  // namespace ccr::testing
