// control.h: a controller moves the muscles: at each tick it gives every voxel an activation a from
// -1 to 1, which is reached linearly at the next tick; the rest length is L = L0 (1 + mean over all
// owners of s amplitude weight a). The controller is a text (scripted/program.h), which a scene has
// beside this effect. SI units.
#pragma once

#include "physics/effects/actuation.h"
#include "physics/effects/effect.h"

namespace limax::effects {

struct control {
    static constexpr const char* name = "control";
    static constexpr const char* summary = "a controller that senses and drives the muscles";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = 0;
    // places of the fields among the values
    enum { at_rate, at_frequency, at_hold, at_change, at_noise, at_delay, at_seed };
    static constexpr field fields[] = {
        {"rate", "Hz", "of the ticks, whole", 1, 1.0, 10000.0, {20.0, 0, 0}},
        {"frequency",
         "Hz",
         "of the sensors clock_sine and clock_cosine",
         1,
         0.0,
         1000.0,
         {2.0, 0, 0}},
        {"hold",
         "1",
         "1: an activation is reached at its own tick, at once",
         1,
         0.0,
         1.0,
         {0, 0, 0}},
        {"change", "1", "largest change of an activation per tick", 1, 0.001, 2.0, {2.0, 0, 0}},
        {"noise",
         "1",
         "of measured sensors: uniform, as a share of the range",
         1,
         0.0,
         1.0,
         {0, 0, 0}},
        {"delay",
         "s",
         "of measured sensors, rounded to ticks, at most 64 of them",
         1,
         0.0,
         64.0,
         {0, 0, 0}},
        {"seed", "1", "of the noise, whole", 1, 0.0, 4294967295.0, {1.0, 0, 0}}};
    static constexpr int field_count = 7;
    static constexpr int most_delay = 64;  // ticks

    LIMAX_LAW static const char* problem(const double* values) {
        const auto whole = [](double number) {
            return number == static_cast<double>(static_cast<int64_t>(number));
        };
        if (!whole(values[at_rate])) return "rate must be a whole number of Hz";
        if (!whole(values[at_hold])) return "hold must be 0 or 1";
        if (!whole(values[at_seed])) return "seed must be a whole number";
        if (values[at_delay] * values[at_rate] > most_delay + 0.5)
            return "delay must be at most 64 ticks";
        return nullptr;
    }

    // k L of a spring, N. Its state has, for A and B, what the tick makes of it: in double
    // precision what L differs from L0 by at the tick and its change per step, in single precision
    // k L and its change per step. `since.sine` is the number of steps since the tick.
    template <bool single, class R>
    LIMAX_LAW static R pull(const actuation::moment<R>& since, const spring_state<R>& s) {
        if constexpr (single) return fma(s.cosine, since.sine, s.sine);
        return s.stiffness * fma(s.cosine, since.sine, s.rest + s.sine);
    }
};

// The place of a target, which only controllers see. Of several, the one that appeared last.
struct target {
    static constexpr const char* name = "target";
    static constexpr const char* summary = "a place that controllers see";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = 0;
    static constexpr int most_instances = 8;
    // The time comes first, so that instances are in its order.
    static constexpr field fields[] = {
        {"time",
         "s",
         "from which on it is seen, until the next one appears",
         1,
         0.0,
         1e6,
         {0.0, 0, 0}},
        {"position", "m", "in the world", 3, -1e6, 1e6, {5.0, 0.0, 0.0}}};
    static constexpr int field_count = 2;
    // Where a field's components begin among the values.
    static constexpr int at_time = 0, at_position = 1;
};

}  // namespace limax::effects
