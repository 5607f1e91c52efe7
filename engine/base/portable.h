// portable.h: lets the same text of a law compile with g++, clang, nvcc and NVRTC.
// The only header of the laws that may include std headers, and it hides them from NVRTC. No units.
#pragma once

#if !defined(__CUDACC_RTC__)
#include <cmath>
#include <cstdint>
#include <cstring>
#else
using uint8_t = unsigned char;
using int32_t = int;
using uint32_t = unsigned int;
using int64_t = long long;
using uint64_t = unsigned long long;
#endif

// Laws are always inlined: the CPU passes are compiled once per instruction set, and a shared
// out-of-line copy could carry instructions that an older processor lacks.
#if defined(__CUDACC_RTC__)
#define LIMAX_LAW __device__ __forceinline__
#elif defined(__CUDACC__)
#define LIMAX_LAW __host__ __device__ __forceinline__
#else
#define LIMAX_LAW [[gnu::always_inline]] inline
#endif

namespace limax {

// One rounding, on every device: contraction is switched off everywhere, so a fused multiply-add
// is always written out. NVRTC has no builtins; CUDA has the functions of C in namespace ::.
#if defined(__CUDA_ARCH__) || defined(__CUDACC_RTC__)
LIMAX_LAW float fma(float a, float b, float c) { return ::fmaf(a, b, c); }
LIMAX_LAW double fma(double a, double b, double c) { return ::fma(a, b, c); }

LIMAX_LAW float square_root(float x) { return ::sqrtf(x); }
LIMAX_LAW double square_root(double x) { return ::sqrt(x); }

LIMAX_LAW float absolute(float x) { return ::fabsf(x); }
LIMAX_LAW double absolute(double x) { return ::fabs(x); }
#else
LIMAX_LAW float fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
LIMAX_LAW double fma(double a, double b, double c) { return __builtin_fma(a, b, c); }

LIMAX_LAW float square_root(float x) { return __builtin_sqrtf(x); }
LIMAX_LAW double square_root(double x) { return __builtin_sqrt(x); }

LIMAX_LAW float absolute(float x) { return __builtin_fabsf(x); }
LIMAX_LAW double absolute(double x) { return __builtin_fabs(x); }
#endif

// Selects, written so that both sides are values: they become blends, never branches. NaN in the
// first operand falls through to the second.
template <class R>
LIMAX_LAW R larger(R a, R b) {
    return a > b ? a : b;
}
template <class R>
LIMAX_LAW R smaller(R a, R b) {
    return a < b ? a : b;
}

// 1 / sqrt(x) from y that is within 2^-20 of it. With e = 1 - x y^2, at most 2^-19, the series of
// y / sqrt(1 - e) up to e^2 leaves 5/16 e^3 < 2^-58; with the roundings, of x y and of the result,
// it stays within 1.01 ulp.
LIMAX_LAW double refined_inverse_root(double x, double y) {
    const double e = fma(-x * y, y, 1.0);
    return fma(y * e, fma(0.375, e, 0.5), y);
}

// The one function that differs by device: 1 / |e| from |e|^2. CUDA approximates: 2 ulp in float,
// 1.01 in double.
#if defined(__CUDA_ARCH__)
LIMAX_LAW float inverse_length(float squared) {
    float result;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(result) : "f"(squared));
    return result;
}
LIMAX_LAW double inverse_length(double squared) {
    double start;
    asm("rsqrt.approx.ftz.f64 %0, %1;" : "=d"(start) : "d"(squared));
    return refined_inverse_root(squared, start);
}
#else
LIMAX_LAW float inverse_length(float squared) { return 1.0f / square_root(squared); }
LIMAX_LAW double inverse_length(double squared) { return 1.0 / square_root(squared); }
#endif

// Whether two types are the same.
template <class A, class B>
inline constexpr bool same_type = false;
template <class A>
inline constexpr bool same_type<A, A> = true;

// The bits of a value as another type of the same size.
template <class To, class From>
LIMAX_LAW To bits_as(const From& from) {
    static_assert(sizeof(To) == sizeof(From));
    return __builtin_bit_cast(To, from);
}

}  // namespace limax
