// The segment laws compiled for AVX2; called where the processor has it.
#define CCR_SIMD avx2
#include "model/segment_simd.inc"
