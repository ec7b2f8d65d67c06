// Compiled for four doubles a register, and called where the machine has them.
#define CCR_SIMD avx2
#include "model/segment_simd.inc"
