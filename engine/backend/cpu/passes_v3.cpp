// passes_v3.cpp: the passes for x86-64-v3 processors.
#define LIMAX_ISA x86_64_v3
#define LIMAX_ISA_NAME "x86-64-v3"
#include "backend/cpu/passes.inl"
