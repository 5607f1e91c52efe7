// moving.h: boxes and spheres that move as the scene prescribes, whatever pushes against them: at a
// constant velocity, for ever or back and forth. They begin to move when the muscles do. SI units.
#pragma once

#include "physics/effects/boxes.h"
#include "physics/effects/spheres.h"

namespace limax::effects {

inline constexpr field motion_velocity = {"velocity", "m/s", "at first",      3,
                                          -100.0,     100.0, {-0.2, 0.0, 0.0}};
inline constexpr field motion_turns = {
    "turns", "s", "until it goes back, again and again; 0: never", 1, 0.0, 1e6, {0, 0, 0}};

// How far a shape has moved along each axis per m/s, s, and in which direction it moves.
struct motion_state {
    double way;   // s
    double sign;  // 1, -1 on the way back, 0 before t = 0
};
LIMAX_LAW motion_state motion_at(double turns, double time) {
    if (!(time >= 0.0)) return {0.0, 0.0};
    if (!(turns > 0.0)) return {time, 1.0};
    const double count = static_cast<double>(static_cast<int64_t>(time / turns));
    const double since = time - count * turns;
    const bool back = static_cast<int64_t>(count) % 2 != 0;
    return {back ? turns - since : since, back ? -1.0 : 1.0};
}

// A contact whose shape moves. `at_velocity` is where the velocity lies among its values.
template <class Shape, int at_velocity>
struct moving {
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_contact;
    static constexpr int most_instances = 4;

    // Why the values are refused, or null.
    static const char* problem(const double* values) {
        const double turns = values[at_velocity + 3];
        return turns > 0.0 && turns < 0.001 ? "turns must be 0 or at least 0.001 s" : nullptr;
    }

    template <class R>
    struct params : Shape::template params<R> {
        vector<R> surface_velocity;  // m/s
    };
    // At rest where it is until t = 0.
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        return {Shape::template make<R>(values, origin), {R(0), R(0), R(0)}};
    }
    template <class R>
    LIMAX_LAW static void move(params<R>& p, const double* values, const double* origin,
                               double time) {
        const double* velocity = values + at_velocity;
        const motion_state now = motion_at(values[at_velocity + 3], time);
        const double there[3] = {origin[0] - velocity[0] * now.way,
                                 origin[1] - velocity[1] * now.way,
                                 origin[2] - velocity[2] * now.way};
        p.center = Shape::template make<R>(values, there).center;
        p.surface_velocity = {R(now.sign * velocity[0]), R(now.sign * velocity[1]),
                              R(now.sign * velocity[2])};
    }
    template <class R>
    LIMAX_LAW static surface_point<R, vector<R>> surface(const params<R>& p,
                                                         const vector<R>& position) {
        return Shape::template surface<R>(p, position);
    }
};

struct moving_boxes : moving<boxes, 8> {
    static constexpr const char* name = "moving_boxes";
    static constexpr const char* summary = "boxes along the axes that move as prescribed";
    static constexpr field fields[] = {boxes::fields[0], boxes::fields[1], boxes::fields[2],
                                       boxes::fields[3], motion_velocity,  motion_turns};
    static constexpr int field_count = 6;
    static const char* problem(const double* values) {
        const char* of_shape = boxes::problem(values);
        return of_shape ? of_shape : moving::problem(values);
    }
};

struct moving_spheres : moving<spheres, 6> {
    static constexpr const char* name = "moving_spheres";
    static constexpr const char* summary = "spheres that move as prescribed";
    static constexpr field fields[] = {spheres::fields[0], spheres::fields[1], spheres::fields[2],
                                       spheres::fields[3], motion_velocity,    motion_turns};
    static constexpr int field_count = 6;
};

}  // namespace limax::effects
