// passes_v4.cpp: the passes for x86-64-v4 processors.
#define LIMAX_ISA x86_64_v4
#define LIMAX_ISA_NAME "x86-64-v4"
#include "backend/cpu/passes.inl"
