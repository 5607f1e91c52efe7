// actuation.h: muscles change the rest lengths of their springs: L(t) = L0 + g(t) (A sin(2 pi f t)
// + B cos(2 pi f t)). SI units. A and B are the mean over all owners of s a cos(phi) L0 and s a
// sin(phi) L0, since sin(wt + phi) = sin wt cos phi + cos wt sin phi.
#pragma once

#include "base/math.h"
#include "physics/effects/effect.h"

namespace limax::effects {

struct actuation {
    static constexpr const char* name = "actuation";
    static constexpr const char* summary = "the drive of the muscles";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_rest;
    static constexpr field fields[] = {
        {"frequency", "Hz", "of every muscle", 1, 0.001, 1000.0, {2.0, 0, 0}},
        {"ramp",
         "1",
         "periods over which the amplitude rises from 0",
         1,
         0.0,
         1000.0,
         {0.25, 0, 0}}};
    static constexpr int field_count = 2;

    // The scene's parameters, and the step that the time comes from.
    struct clock {
        double frequency;   // Hz
        double ramp;        // s
        uint64_t per_step;  // phase of one step, 2^-64 turns
    };

    LIMAX_LAW static clock make_clock(const double* values, double time_step) {
        const double turns = values[0] * time_step;
        // only the fraction of a turn: phase arithmetic is modulo 2^64; 2^32 twice, since 2^64 is
        // out of range of a cast
        const double fraction = turns - static_cast<double>(static_cast<int64_t>(turns));
        const double high = fraction * 4294967296.0;
        const uint64_t whole = static_cast<uint64_t>(high);
        const double low = (high - static_cast<double>(whole)) * 4294967296.0;
        const uint64_t rest = static_cast<uint64_t>(low);
        const bool up = low - static_cast<double>(rest) >= 0.5;
        return {values[0], values[1] / values[0], (whole << 32) + rest + (up ? 1 : 0)};
    }

    // The factors that all springs of a robot share at one step: g sin(2 pi f t) and g cos(2 pi f
    // t).
    template <class R>
    struct moment {
        R sine, cosine;
    };

    // `step` counts from t = 0. No recurrence and no floating-point time: step 10^12 is as exact
    // as step 1.
    template <class R>
    LIMAX_LAW static moment<R> at(const clock& c, int64_t step, double time_step) {
        R sine, cosine;
        sine_cosine(static_cast<uint64_t>(step) * c.per_step, sine, cosine);
        const R rise = ramp<R>(c, step, time_step);
        return {rise * sine, rise * cosine};
    }

    // g(t): linear from 0 to 1 over the ramp.
    template <class R>
    LIMAX_LAW static R ramp(const clock& c, int64_t step, double time_step) {
        const double t = static_cast<double>(step) * time_step;
        return t < c.ramp ? R(t / c.ramp) : R(1);
    }

    template <class R>
    LIMAX_LAW static R rest(const moment<R>& m, const spring_state<R>& s) {
        return fma(s.sine, m.sine, fma(s.cosine, m.cosine, s.rest));
    }

    // d moment / dt, 1/s: what the muscles' power follows from.
    LIMAX_LAW static moment<double> rate_at(const clock& c, int64_t step, double time_step) {
        const double t = static_cast<double>(step) * time_step,
                     omega = radians_per_turn * c.frequency;
        double sine, cosine;
        sine_cosine(static_cast<uint64_t>(step) * c.per_step, sine, cosine);
        const double rise = ramp<double>(c, step, time_step);
        const double slope = t < c.ramp ? 1.0 / c.ramp : 0.0;
        return {slope * sine + rise * omega * cosine, slope * cosine - rise * omega * sine};
    }
};

}  // namespace limax::effects
