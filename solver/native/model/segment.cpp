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

}  // namespace ccr
