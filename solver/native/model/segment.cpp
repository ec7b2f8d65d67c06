#define CCR_SIMD baseline
#include "model/segment_simd.inc"

namespace ccr {

#ifdef CCR_AVX2
namespace avx2 {
void bend(int n, const double* sines, double displacement, double length, double offset, PaperLaw::Bends& bends);
void bend(int n, const double* angles, double length, RodLaw::Bends& bends);
bool bend(int n, const SegmentInputs& inputs, const Rows& controls, Rows& bendings, Rows& bends);
void hessian_contraction(int n, const SegmentInputs& inputs, const Rows& controls, const Rows& bendings,
                         const Rows& adjoints, Rows& hessians);
void bend_arc(int n, double length, const Rows& controls, Rows& bends);
void take_cable(int n, double length, const double* hole, const Rows& controls, const Rows& bends, Rows& cable);
void cable_hessian(int n, const double* hole, const Rows& controls, const Rows& bends, Rows& hessians);
void arc_hessian_contraction(int n, const Rows& controls, const Rows& bends, const Rows& adjoints, Rows& hessians);
}  // namespace avx2

namespace {
const bool has_avx2 = __builtin_cpu_supports("avx2");
}
#endif

void PaperLaw::bend(int n, const double* sines, double displacement, double length, double offset, Bends& bends) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::bend(n, sines, displacement, length, offset, bends);
#endif
  baseline::bend(n, sines, displacement, length, offset, bends);
}

void RodLaw::bend(int n, const double* angles, double, double length, double, Bends& bends) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::bend(n, angles, length, bends);
#endif
  baseline::bend(n, angles, length, bends);
}

bool SpatialLaw::bend(int n, const SegmentInputs& inputs, const Rows& controls, Rows& bendings, Rows& bends) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::bend(n, inputs, controls, bendings, bends);
#endif
  return baseline::bend(n, inputs, controls, bendings, bends);
}

void SpatialLaw::hessian_contraction(int n, const SegmentInputs& inputs, const Rows& controls, const Rows& bendings,
                                     const Rows& adjoints, Rows& hessians) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::hessian_contraction(n, inputs, controls, bendings, adjoints, hessians);
#endif
  baseline::hessian_contraction(n, inputs, controls, bendings, adjoints, hessians);
}

void SpatialArcLaw::bend(int n, double length, const Rows& controls, Rows& bends) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::bend_arc(n, length, controls, bends);
#endif
  baseline::bend_arc(n, length, controls, bends);
}

void SpatialArcLaw::take(int n, double length, const double* hole, const Rows& controls, const Rows& bends,
                         Rows& cable) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::take_cable(n, length, hole, controls, bends, cable);
#endif
  baseline::take_cable(n, length, hole, controls, bends, cable);
}

void SpatialArcLaw::cable_hessian(int n, const double* hole, const Rows& controls, const Rows& bends, Rows& hessians) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::cable_hessian(n, hole, controls, bends, hessians);
#endif
  baseline::cable_hessian(n, hole, controls, bends, hessians);
}

void SpatialArcLaw::hessian_contraction(int n, const Rows& controls, const Rows& bends, const Rows& adjoints,
                                        Rows& hessians) {
#ifdef CCR_AVX2
  if (has_avx2) return avx2::arc_hessian_contraction(n, controls, bends, adjoints, hessians);
#endif
  baseline::arc_hessian_contraction(n, controls, bends, adjoints, hessians);
}

}  // namespace ccr
