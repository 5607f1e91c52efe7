// passes_baseline.cpp: the passes for any processor of this architecture: slow, the same bits.
#define LIMAX_ISA baseline
#define LIMAX_ISA_NAME "baseline"
#include "backend/cpu/passes.inl"
