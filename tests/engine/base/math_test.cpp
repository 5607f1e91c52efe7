// math_test.cpp: the elementary functions of base/math.h against long double, in units of the last
// place; special values; and the bits themselves, which no compiler and no instruction set may
// change.
#include "base/math.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

namespace {

constexpr float infinity_f = std::numeric_limits<float>::infinity();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr double nan_d = std::numeric_limits<double>::quiet_NaN();

// Distance in units of the last place of R at the true value.
template <class R>
double ulps(R got, long double truth) {
    const R nearest = static_cast<R>(truth);
    if (std::isinf(nearest) || std::isnan(nearest))
        return got == nearest || (std::isnan(got) && std::isnan(nearest)) ? 0 : infinity;
    int exponent;
    std::frexp(nearest == 0 ? std::numeric_limits<R>::min() : nearest, &exponent);
    exponent = std::max(exponent, std::numeric_limits<R>::min_exponent);
    const long double unit = std::ldexp(1.0L, exponent - std::numeric_limits<R>::digits);
    return static_cast<double>(std::fabs(static_cast<long double>(got) - truth) / unit);
}

// The largest distance of `law` from `truth` over floats whose bits run from `first` to `last` in
// steps of `stride`.
template <class Law, class Truth>
double worst_over_floats(float first, float last, uint32_t stride, const Law& law,
                         const Truth& truth) {
    double worst = 0;
    const uint32_t end = limax::bits_as<uint32_t>(last);
    for (uint64_t bits = limax::bits_as<uint32_t>(first); bits <= end; bits += stride) {
        const auto x = limax::bits_as<float>(static_cast<uint32_t>(bits));
        worst = std::max(worst, ulps(law(x), truth(static_cast<long double>(x))));
    }
    return worst;
}

// Sine and cosine of an angle in turns, by quarters so that pi enters only in small angles.
struct circle_point {
    long double sine, cosine;
};
circle_point true_circle(long double turns) {
    const long double part = turns - std::round(turns);
    const auto quarter = static_cast<int>(std::round(part * 4));
    const long double angle = (part - quarter * 0.25L) * 6.283185307179586476925286766559005768L;
    const long double s = std::sin(angle), c = std::cos(angle);
    switch (quarter & 3) {
        case 0: return {s, c};
        case 1: return {c, -s};
        case 2: return {-s, -c};
        default: return {-c, s};
    }
}

// A sequence that reaches every part of 64 bits: multiples of the golden ratio.
uint64_t spread(uint64_t k) { return k * 0x9e3779b97f4a7c15u; }

}  // namespace

TEST_CASE_TEMPLATE("sine and cosine of a phase stay within 4 ulp", R, float, double) {
    double worst = 0;
    const auto look = [&](uint64_t phase) {
        R sine, cosine;
        limax::sine_cosine(phase, sine, cosine);
        const circle_point truth = true_circle(std::ldexp(static_cast<long double>(phase), -64));
        worst = std::max({worst, ulps(sine, truth.sine), ulps(cosine, truth.cosine)});
    };
    for (uint64_t k = 0; k < 400000; ++k) look(spread(k));
    // around the zeros and the seams of the reduction, on both sides and at every scale
    for (uint64_t eighth = 0; eighth < 8; ++eighth)
        for (int shift = 0; shift < 61; ++shift)
            for (const uint64_t odd : {1u, 3u, 5u, 7u}) {
                look((eighth << 61) + (odd << shift >> 2));
                look((eighth << 61) - (odd << shift >> 2));
            }
    CHECK(worst <= 4);
}

TEST_CASE_TEMPLATE("sine and cosine of quarter turns are exact", R, float, double) {
    const R sines[4] = {0, 1, 0, -1}, cosines[4] = {1, 0, -1, 0};
    for (uint64_t quarter = 0; quarter < 4; ++quarter) {
        R sine, cosine;
        limax::sine_cosine(quarter << 62, sine, cosine);
        CHECK(sine == sines[quarter]);
        CHECK(cosine == cosines[quarter]);
    }
}

TEST_CASE("sine and cosine of turns stay within 4 ulp, however many turns") {
    double worst = 0;
    const auto look = [&](double turns) {
        double sine, cosine;
        limax::sine_cosine_turns(turns, sine, cosine);
        const circle_point truth = true_circle(static_cast<long double>(turns));
        worst = std::max({worst, ulps(sine, truth.sine), ulps(cosine, truth.cosine)});
    };
    for (int exponent = -60; exponent <= 70; ++exponent)
        for (uint64_t k = 0; k < 3000; ++k) {
            const double turns =
                std::ldexp(1.0 + static_cast<double>(spread(k) >> 12) * 0x1p-52, exponent);
            look(turns);
            look(-turns);
        }
    CHECK(worst <= 4);

    double sine, cosine;
    for (const double turns : {infinity, -infinity, nan_d}) {
        limax::sine_cosine_turns(turns, sine, cosine);
        CHECK(std::isnan(sine));
        CHECK(std::isnan(cosine));
    }
    limax::sine_cosine_turns(-0.0, sine, cosine);
    CHECK((sine == 0 && std::signbit(sine) && cosine == 1));
    limax::sine_cosine_turns(1e300, sine, cosine);  // a whole number of turns
    CHECK((sine == 0 && cosine == 1));
}

TEST_CASE("sine of turns, float, stays within 4 ulp, however many turns") {
    double worst = 0;
    for (int exponent = -60; exponent <= 30; ++exponent)
        for (uint64_t k = 0; k < 1000; ++k)
            for (const float sign : {1.0f, -1.0f}) {
                const float turns =
                    sign *
                    std::ldexp(1.0f + static_cast<float>(spread(k) >> 41) * 0x1p-23f, exponent);
                const circle_point truth = true_circle(static_cast<long double>(turns));
                worst = std::max(worst, ulps(limax::sine_turns(turns), truth.sine));
            }
    CHECK(worst <= 4);
    CHECK(std::isnan(limax::sine_turns(infinity_f)));
    CHECK(std::isnan(limax::sine_turns(nan_f)));
}

TEST_CASE("functions of a float: 4 ulp over every result, and their limits") {
    struct law {
        float (*law)(float);
        long double (*truth)(long double);
        float least, most;    // into subnormals
        float zero, far, up;  // results at 0, at -infinity and at infinity
    };
    for (const law& one :
         {law{[](float x) { return limax::exponential(x); },
              [](long double x) { return std::exp(x); }, 110, 95, 1, 0, infinity_f},
          law{[](float x) { return limax::hyperbolic_tangent(x); },
              [](long double x) { return std::tanh(x); }, 12, 12, 0, -1, 1},
          law{[](float x) { return limax::logistic(x); },
              [](long double x) { return 1 / (1 + std::exp(-x)); }, 110, 200, 0.5f, 0, 1}}) {
        const double worst =
            std::max(worst_over_floats(1e-45f, one.most, 397, one.law, one.truth),
                     worst_over_floats(-1e-45f, -one.least, 397, one.law, one.truth));
        CHECK(worst <= 4);
        CHECK(one.law(0.0f) == one.zero);
        for (const float x : {infinity_f, 3e38f}) {
            CHECK(one.law(x) == one.up);
            CHECK(one.law(-x) == one.far);
        }
        CHECK(std::isnan(one.law(nan_f)));
    }
    for (int exponent = -140; exponent < 100; ++exponent) {
        const float x = std::ldexp(1.37f, exponent);
        REQUIRE(limax::hyperbolic_tangent(-x) == -limax::hyperbolic_tangent(x));
        REQUIRE(std::fabs(limax::hyperbolic_tangent(x)) <= 1.0f);
    }
    CHECK(std::signbit(limax::hyperbolic_tangent(-0.0f)));
}

TEST_CASE("exponential, double: 4 ulp over every result, infinite above and 0 below") {
    double worst = 0;
    for (uint64_t k = 0; k < 1000000; ++k) {
        const double x = -760.0 + 1480.0 * static_cast<double>(spread(k) >> 11) * 0x1p-53;
        worst = std::max(worst, ulps(limax::exponential(x), std::exp(static_cast<long double>(x))));
    }
    CHECK(worst <= 4);
    CHECK(limax::exponential(0.0) == 1.0);
    CHECK(limax::exponential(infinity) == infinity);
    CHECK(limax::exponential(1e300) == infinity);
    CHECK(limax::exponential(-infinity) == 0.0);
    CHECK(std::isnan(limax::exponential(nan_d)));
}

TEST_CASE("logarithm: 4 ulp over all positive doubles, subnormals included") {
    double worst = 0;
    const auto look = [&](double x) {
        worst = std::max(worst, ulps(limax::logarithm(x), std::log(static_cast<long double>(x))));
    };
    for (uint64_t k = 1; k < 1000000; ++k)
        look(limax::bits_as<double>(spread(k) % 0x7ff0000000000000u));
    // around 1, where the result goes through 0
    for (uint64_t k = 0; k < 500000; ++k)
        look(0.5 + static_cast<double>(spread(k) >> 11) * 0x1p-53);
    for (int exponent = -52; exponent < 0; ++exponent)
        for (const double sign : {1.0, -0.5}) look(1.0 + sign * std::ldexp(1.0, exponent));
    for (const double x : {0x1p-1074, 0x1.8p-1073, 0x1p-1022, std::numeric_limits<double>::max()})
        look(x);
    CHECK(worst <= 4);
    CHECK(limax::logarithm(1.0) == 0.0);
    CHECK(limax::logarithm(0.0) == -infinity);
    CHECK(limax::logarithm(-0.0) == -infinity);
    CHECK(limax::logarithm(infinity) == infinity);
    CHECK(std::isnan(limax::logarithm(-1.0)));
    CHECK(std::isnan(limax::logarithm(-infinity)));
    CHECK(std::isnan(limax::logarithm(nan_d)));
}

TEST_CASE("an inverse root refined from a start that is off by 2^-20 is within 1.01 ulp") {
    double worst = 0;
    for (uint64_t k = 1; k < 1000000; ++k) {
        // squared lengths from 1e-20 m^2, the least there is, to 1e18
        const double x = std::ldexp(1.0 + static_cast<double>(spread(k) >> 11) * 0x1p-53,
                                    static_cast<int>(k % 128) - 67);
        const long double truth = 1.0L / std::sqrt(static_cast<long double>(x));
        // the whole interval, and its ends most of all
        const double off = k % 4
                               ? (k % 2 ? 0x1p-20 : -0x1p-20)
                               : (static_cast<double>(spread(k + 1) >> 11) * 0x1p-52 - 1) * 0x1p-20;
        const auto start = static_cast<double>(truth * (1 + static_cast<long double>(off)));
        worst = std::max(worst, ulps(limax::refined_inverse_root(x, start), truth));
    }
    CHECK(worst <= 1.01);
    CHECK(worst > 0.5);  // the start matters: no correctly rounded result hides here
}

TEST_CASE("bits: the functions use only exactly rounded operations and give the recorded bits") {
    uint64_t hash = 0;
    const auto add = [&](uint64_t bits) { hash = (hash ^ bits) * 0x9e3779b97f4a7c15u; };
    for (uint64_t k = 0; k < 20000; ++k) {
        const double part = static_cast<double>(spread(k) >> 11) * 0x1p-53;
        const auto x = static_cast<float>(24 * part - 12);
        add(limax::bits_as<uint32_t>(limax::hyperbolic_tangent(x)));
        add(limax::bits_as<uint32_t>(limax::logistic(x)));
        add(limax::bits_as<uint32_t>(limax::exponential(x)));
        add(limax::bits_as<uint64_t>(limax::exponential(100 * part - 50)));
        add(limax::bits_as<uint64_t>(limax::logarithm(part)));
        float sine_f, cosine_f;
        limax::sine_cosine(spread(k), sine_f, cosine_f);
        add(limax::bits_as<uint32_t>(sine_f));
        add(limax::bits_as<uint32_t>(cosine_f));
        double sine, cosine;
        limax::sine_cosine_turns(1000 * part, sine, cosine);
        add(limax::bits_as<uint64_t>(sine));
        add(limax::bits_as<uint64_t>(cosine));
    }
    CHECK(hash == 9281706750491301878u);
}
