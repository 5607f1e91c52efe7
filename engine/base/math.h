// math.h: our own sine, cosine, exponential, logarithm, hyperbolic tangent and logistic function,
// so that every device and every C library gives the same bits. Laws: only + - * / and explicit
// fma, selects for branches, so that loops over them vectorise. At most 4 ulp; NaN in, NaN out.
// Angles in turns (1 turn = 2 pi rad).
//
// All coefficients are minimax fits made for this file by Remez exchange (in 60-digit decimals,
// relative error of the whole function as the weight), then rounded to the nearest float or double.
// Each table states the function, the interval and the relative error that is left, rounding of the
// coefficients included.
#pragma once

#include "base/portable.h"

namespace limax {

inline constexpr double radians_per_turn = 6.283185307179586477;  // 2 pi

// Coefficients from the lowest power up, by Horner's rule.
template <class R>
LIMAX_LAW R polynomial(R, R last) {
    return last;
}
template <class R, class... Rest>
LIMAX_LAW R polynomial(R x, R lowest, Rest... rest) {
    return fma(x, polynomial(x, rest...), lowest);
}

// ---- sine and cosine ----

// Sine and cosine of t turns, |t| <= 1/8. With z = t^2:
// sine = t (2 pi + z S(z)), 2 pi in two parts; S fits (sin(2 pi t)/t - 2 pi)/z on z in [0, 1/64].
// cosine = 1 + z C(z); C fits (cos(2 pi t) - 1)/z there.
LIMAX_LAW void sine_cosine_eighth(float t, float& sine, float& cosine) {
    const float z = t * t;
    const float s = polynomial(z, -0x1.4abbbep+5f, 0x1.466004p+6f, -0x1.2dc84cp+6f);  // 2^-27.1
    const float c = polynomial(z, -0x1.3bd3ccp+4f, 0x1.03c1dep+6f, -0x1.55c5e0p+6f,   // 2^-26.5
                               0x1.d9d57ep+5f);
    sine = fma(t, 0x1.921fb6p+2f, t * fma(z, s, -0x1.777a5cp-23f));
    cosine = fma(z, c, 1.0f);
}
LIMAX_LAW void sine_cosine_eighth(double t, double& sine, double& cosine) {
    const double z = t * t;
    const double s = polynomial(z, -0x1.4abbce625be46p+5, 0x1.466bc67758cb2p+6,  // 2^-56.9
                                -0x1.32d2cce324161p+6, 0x1.5078300c445d1p+5, -0x1.e30098990f984p+3,
                                0x1.e3ff28374d881p+1);
    const double c = polynomial(z, -0x1.3bd3cc9be45dep+4, 0x1.03c1f081b5aaep+6,  // 2^-55.3
                                -0x1.55d3c7e3c9280p+6, 0x1.e1f5068367b12p+5, -0x1.a6d1ec7e0b177p+4,
                                0x1.f9cc40ac6a069p+2, -0x1.b263c3399c1f7p+0);
    sine = fma(t, 0x1.921fb54442d18p+2, t * fma(z, s, 0x1.1a62633145c07p-52));
    cosine = fma(z, c, 1.0);
}

// Rotates by `quarters` quarter turns: sine and cosine of the remainder become those of the whole
// angle.
template <class R>
LIMAX_LAW void turn_by_quarters(uint32_t quarters, R& sine, R& cosine) {
    const R s = (quarters & 1) ? cosine : sine;
    const R c = (quarters & 1) ? sine : cosine;
    sine = (quarters & 2) ? -s : s;
    cosine = ((quarters + 1) & 2) ? -c : c;
}

// Sine and cosine of `phase` / 2^64 turns. The reduction is exact, so the error does not grow with
// the length of a run.
template <class R>
LIMAX_LAW void sine_cosine(uint64_t phase, R& sine, R& cosine) {
    const uint64_t quarters = (phase + (uint64_t(1) << 61)) >> 62;
    const int64_t rest = int64_t(phase - (quarters << 62));  // within an eighth of a turn
    sine_cosine_eighth(R(rest) * R(0x1p-64), sine, cosine);
    turn_by_quarters(uint32_t(quarters), sine, cosine);
}

// Sine and cosine of an angle in turns, of any finite size; the reduction is exact. Infinity gives
// NaN.
LIMAX_LAW void sine_cosine_turns(double turns, double& sine, double& cosine) {
    constexpr double whole = 0x1p52;  // from here on every double is a whole number of turns
    const double size = absolute(turns);
    const double bounded = size < whole ? size : size - size;
    const double part = bounded - ((bounded + whole) - whole);  // [-1/2, 1/2]
    // Adding 1.5 x 2^52 rounds to a whole number, which is then in the lowest bits.
    const double shifted = fma(part, 4.0, 1.5 * whole);
    const double rest = fma(shifted - 1.5 * whole, -0.25, part);
    sine_cosine_eighth(rest, sine, cosine);
    turn_by_quarters(uint32_t(bits_as<uint64_t>(shifted)), sine, cosine);
    const uint64_t sign = bits_as<uint64_t>(turns) & (uint64_t(1) << 63);
    sine = bits_as<double>(bits_as<uint64_t>(sine) ^ sign);
}

// Sine of an angle in turns, in float; otherwise as above.
LIMAX_LAW float sine_turns(float turns) {
    constexpr float whole = 0x1p23f;  // from here on every float is a whole number of turns
    const float size = absolute(turns);
    const float bounded = size < whole ? size : size - size;
    const float part = bounded - ((bounded + whole) - whole);  // [-1/2, 1/2]
    const float shifted = fma(part, 4.0f, 1.5f * whole);
    const float rest = fma(shifted - 1.5f * whole, -0.25f, part);
    float sine, cosine;
    sine_cosine_eighth(rest, sine, cosine);
    turn_by_quarters(bits_as<uint32_t>(shifted), sine, cosine);
    const uint32_t sign = bits_as<uint32_t>(turns) & 0x80000000u;
    return bits_as<float>(bits_as<uint32_t>(sine) ^ sign);
}

// ---- exponential, hyperbolic tangent, logistic function ----

// Writes x = n ln 2 + r, |r| <= ln(2)/2, and returns e^r - 1. |x| below 2^21 (float), 2^50
// (double). e^r - 1 = r + r^2 Q(r); Q fits (e^r - 1 - r)/r^2, in float for the relative error of
// e^r - 1, in double of e^r.
LIMAX_LAW float exponential_rest(float x, int32_t& n) {
    constexpr float shift = 0x1.8p23f;  // rounds to a whole number
    const float shifted = fma(x, 0x1.715476p+0f, shift);
    n = int32_t(bits_as<uint32_t>(shifted) - bits_as<uint32_t>(shift));
    const float whole = shifted - shift;
    const float r = fma(whole, 0x1.05c61p-29f, fma(whole, -0x1.62e43p-1f, x));  // ln 2 in two parts
    const float q = polynomial(r, 0x1.000000p-1f, 0x1.555554p-3f, 0x1.5554b2p-5f,  // 2^-28.8
                               0x1.11118ap-7f, 0x1.6d71f8p-10f, 0x1.a032e0p-13f);
    return fma(r * r, q, r);
}
LIMAX_LAW double exponential_rest(double x, int32_t& n) {
    constexpr double shift = 0x1.8p52;
    const double shifted = fma(x, 0x1.71547652b82fep+0, shift);
    n = int32_t(uint32_t(bits_as<uint64_t>(shifted)));
    const double whole = shifted - shift;
    const double r = fma(whole, -0x1.abc9e3b39803fp-56, fma(whole, -0x1.62e42fefa39efp-1, x));
    const double q =
        polynomial(r, 0x1.0000000000000p-1, 0x1.555555555555bp-3,  // 2^-60.3
                   0x1.5555555555503p-5, 0x1.111111110ec5dp-7, 0x1.6c16c16c3049ep-10,
                   0x1.a01a01b37e5ecp-13, 0x1.a01a01368a6cdp-16, 0x1.71ddf02075bcdp-19,
                   0x1.27e5b4502b29ep-22, 0x1.af6be8722afb2p-26, 0x1.1e3d1ef7b7d4ap-29);
    return fma(r * r, q, r);
}

// 2^n for exponents of normal numbers.
LIMAX_LAW float power_of_two(float, int32_t n) { return bits_as<float>(uint32_t(n + 127) << 23); }
LIMAX_LAW double power_of_two(double, int32_t n) {
    return bits_as<double>(uint64_t(uint32_t(n + 1023)) << 52);
}

// e^x. Infinity above the largest finite result, and gradual underflow to 0: hence 2^n in two
// factors.
template <class R>
LIMAX_LAW R exponential(R x) {
    // Beyond these the result is infinite, or 0, anyway.
    constexpr R most = sizeof(R) == 4 ? R(89) : R(710), least = sizeof(R) == 4 ? R(-104) : R(-746);
    int32_t n;
    const R rest = exponential_rest(larger(least, smaller(most, x)), n);
    const int32_t half = n >> 1;
    return (R(1) + rest) * power_of_two(R(), half) * power_of_two(R(), n - half);
}

// tanh x = e / (e + 2) with e = e^(2|x|) - 1, which keeps the relative error small around 0; 1 in
// float from 10 on.
LIMAX_LAW float hyperbolic_tangent(float x) {
    const float size = smaller(10.0f, absolute(x));
    int32_t n;
    const float rest = exponential_rest(size + size, n);
    const float power = power_of_two(float(), n);
    const float e = fma(power, rest, power - 1.0f);
    const uint32_t sign = bits_as<uint32_t>(x) & 0x80000000u;
    return bits_as<float>(bits_as<uint32_t>(e / (e + 2.0f)) | sign);
}

// a / d for d from 2 to 2^30, at most 1 ulp off. A division in the kernels has a branch, which
// keeps a compiler from interleaving several of them.
LIMAX_LAW float quotient(float a, float d) {
    float inverse = bits_as<float>(0x7ef311c3u - bits_as<uint32_t>(d));  // within 12 %
    float error = fma(-d, inverse, 1.0f);
    inverse = fma(fma(error, error, error), inverse, inverse);
    error = fma(-d, inverse, 1.0f);
    inverse = fma(fma(error, error, error), inverse, inverse);
    const float q = a * inverse;
    return fma(fma(-d, q, a), inverse, q);
}
LIMAX_LAW double quotient(double a, double d) { return a / d; }

// tanh x for controllers: as hyperbolic_tangent(), with quotient() and in both precisions; 1 in
// double from 20 on.
template <class R>
LIMAX_LAW R tangent_of_controller(R x) {
    constexpr R most = sizeof(R) == 4 ? R(10) : R(20);
    const R size = absolute(x), held = most < size ? most : size;  // NaN stays NaN
    int32_t n;
    const R rest = exponential_rest(held + held, n);
    const R power = power_of_two(R(), n), e = fma(power, rest, power - R(1));
    const R t = quotient(e, e + R(2));
    return x < R(0) ? -t : t;
}

// 1 / (1 + e^-x), through e^-|x| so that nothing overflows and small results keep their digits.
LIMAX_LAW float logistic(float x) {
    const float e = exponential(-absolute(x));
    return (x < 0.0f ? e : 1.0f) / (1.0f + e);
}

// ---- logarithm ----

// Natural logarithm. x = 2^k m, m in [sqrt(1/2), sqrt(2)); log m = 2 atanh(s) = 2 s + s^3 L(s^2), s
// = (m - 1)/(m + 1); L fits (2 atanh(s) - 2 s)/s^3 on |s| <= (sqrt(2) - 1)/(sqrt(2) + 1). -infinity
// at 0, NaN below.
LIMAX_LAW double logarithm(double x) {
    const double infinity = bits_as<double>(uint64_t(0x7ff) << 52);
    const double not_a_number = bits_as<double>(uint64_t(0xfff) << 51);
    const bool subnormal = x < 0x1p-1022;
    const uint64_t bits = bits_as<uint64_t>(subnormal ? x * 0x1p54 : x);
    // Measures the exponent from sqrt(1/2), plus 1024 so that it cannot be negative.
    constexpr uint64_t root_half = 0x3fe6a09e667f3bcd;
    const uint64_t exponent = (bits - root_half + (uint64_t(1024) << 52)) >> 52;
    const double m = bits_as<double>(bits - ((exponent - 1024) << 52));
    const double k = double(int32_t(uint32_t(exponent)) - (subnormal ? 1024 + 54 : 1024));
    const double s = (m - 1.0) / (m + 1.0);
    const double z = s * s;
    const double l = polynomial(z, 0x1.5555555555592p-1, 0x1.999999997fe6ap-2,  // 2^-59.2
                                0x1.24924941e8618p-2, 0x1.c71c520fa7f7fp-3, 0x1.74663dc6836f8p-3,
                                0x1.39a1d41a09461p-3, 0x1.2f048829dd516p-3);
    const double tail = fma(s * z, l, k * 0x1.abc9e3b39803fp-56);  // ln 2 in two parts
    const double result = fma(k, 0x1.62e42fefa39efp-1, fma(s, 2.0, tail));
    const double finite = x > 0.0 ? result : (x == 0.0 ? -infinity : not_a_number);
    return x < infinity ? finite : x + x;  // infinity and NaN pass through
}

}  // namespace limax
