// Compiled for four doubles a register, and called where the machine has them.
#define CCR_REGISTERS wide
#include "bend.inc"
