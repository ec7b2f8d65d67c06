// The laws of an arc compiled for AVX2; called where the processor has it.
#define CCR_SIMD broad  // not avx2: the generated functions of both files carry the name of the namespace
#include "model/arc_simd.inc"
