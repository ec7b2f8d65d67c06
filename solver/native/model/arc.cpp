#include <algorithm>

// Two lanes here: without AVX2 a register holds no more, and twice as many lanes spill.
#define CCR_SIMD narrow
#define CCR_LANES 2
#include "model/arc_simd.inc"

namespace ccr {

#ifdef CCR_AVX2
namespace broad {
void bend_arcs(int n, double length, const Rows& controls, Arc* arcs, Rows& shared);
void measure_cables(std::span<const ArcCable> cables, const Rows& controls, const Rows& shared);
void contract_arcs(int n, const Rows& controls, const Rows& shared, const Rows& adjoints,
                   std::span<const ArcPull> pulls, Rows& hessians);
}  // namespace broad

namespace {
const bool has_avx2 = __builtin_cpu_supports("avx2");
}
#endif

namespace {

void bend_each(int n, double length, const Rows& controls, Arc* arcs, Rows& shared) {
#ifdef CCR_AVX2
  if (has_avx2) return broad::bend_arcs(n, length, controls, arcs, shared);
#endif
  narrow::bend_arcs(n, length, controls, arcs, shared);
}

void measure_each(std::span<const ArcCable> cables, const Rows& controls, const Rows& shared) {
#ifdef CCR_AVX2
  if (has_avx2) return broad::measure_cables(cables, controls, shared);
#endif
  narrow::measure_cables(cables, controls, shared);
}

// Whether all of n segments have the same controls.
bool are_alike(int n, const Rows& controls) {
  for (int k = 0; k < ArcLaw::kControl; ++k) {
    const double* row = controls.row(k);
    if (!std::all_of(row, row + n, [&](double control) { return control == row[0]; })) return false;
  }
  return true;
}

}  // namespace

bool ArcLaw::bend(int n, double length, const Rows& controls, Arc* arcs, Rows& shared) {
  const bool alike = n > 1 && are_alike(n, controls);
  bend_each(alike ? 1 : n, length, controls, arcs, shared);
  if (!alike) return false;
  std::fill_n(arcs + 1, n - 1, arcs[0]);
  for (int k = 0; k < kShared; ++k) std::fill_n(shared.row(k) + 1, n - 1, shared.row(k)[0]);
  return true;
}

void ArcLaw::measure(std::span<const ArcCable> cables, const Rows& controls, const Rows& shared, bool alike) {
  if (!alike) return measure_each(cables, controls, shared);
  for (const auto& [hole, end, distances, slopes] : cables) {
    const ArcCable first{{hole[0], hole[1], hole[2]}, 1, distances, slopes};
    measure_each({&first, 1}, controls, shared);
    std::fill_n(distances + 1, end - 1, distances[0]);
    std::fill_n(slopes + 1, end - 1, slopes[0]);
  }
}

void ArcLaw::hessian_contraction(int n, const Rows& controls, const Rows& shared, const Rows& adjoints,
                                 std::span<const ArcPull> pulls, Rows& hessians) {
#ifdef CCR_AVX2
  if (has_avx2) return broad::contract_arcs(n, controls, shared, adjoints, pulls, hessians);
#endif
  narrow::contract_arcs(n, controls, shared, adjoints, pulls, hessians);
}

}  // namespace ccr
