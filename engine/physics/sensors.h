// sensors.h: what a controller reads (scripted/program.h): a list of sensors, and the laws of those
// of one voxel. A controller sees each divided by its range. Includes laws only. SI units.
#pragma once

#include "base/random.h"
#include "physics/effects/effect.h"

namespace limax::sensors {

// Where a sensor's value comes from.
enum class source : uint8_t {
    voxel,     // measured at the voxel's corners: takes noise and delay
    body,      // measured once for the body, in its frame: takes noise and delay
    scene,     // measured once, of a target or the block: takes noise and delay
    computed,  // known without measuring
};

struct sensor {
    const char* name;
    const char* unit;
    const char* note;
    int components;  // 1 or 3
    double range;    // in `unit`
    source from;
};

// First inputs of a controller; vectors have three.
enum input : int {
    strain = 0,
    strain_rate = 3,
    load = 4,
    contact = 5,
    gravity = 6,
    velocity = 9,
    spin = 12,
    target = 15,
    target_distance = 18,
    block = 19,
    block_velocity = 22,
    ahead = 25,
    measured = 28,  // those that take noise and delay end here
    activation = 28,
    place = 29,
    phase = 32,
    clock_sine = 33,
    clock_cosine = 34,
    time = 35,
    count = 36
};

// In the order of the inputs.
inline constexpr sensor list[] = {
    {"strain", "1", "of the voxel along its three axes: mean edge over the rest edge, less 1", 3,
     0.2, source::voxel},
    {"strain_rate", "1/s", "mean of the three strains' rates", 1, 5.0, source::voxel},
    {"load", "1", "static push of contacts on the corners over the corners' weight", 1, 4.0,
     source::voxel},
    {"contact", "1", "share of the corners that touch a contact", 1, 1.0, source::voxel},
    {"gravity", "1", "direction of gravity in the body's frame", 3, 1.0, source::body},
    {"velocity", "m/s", "of the centre of mass in the body's frame", 3, 1.0, source::body},
    {"spin", "rad/s", "angular velocity in the body's frame", 3, 5.0, source::body},
    {"target", "1", "direction from the centre of mass to scene.target, in the body's frame", 3,
     1.0, source::scene},
    {"target_distance", "m", "between the centre of mass and scene.target", 1, 5.0, source::scene},
    {"block", "m", "centre of the first scene.block from the centre of mass, in the body's frame",
     3, 1.0, source::scene},
    {"block_velocity", "m/s", "of the first scene.block in the body's frame", 3, 1.0,
     source::scene},
    {"ahead", "m",
     "height of ground or terrain 2, 4 and 6 edges ahead of the centre of mass, along the body's "
     "x axis, less that below it",
     3, 0.2, source::scene},
    {"activation", "1", "of this voxel, set at the last tick", 1, 1.0, source::computed},
    {"place", "1", "of the voxel in the lattice, -1 to 1 along each axis", 3, 1.0,
     source::computed},
    {"phase", "rad", "of the voxel's muscle", 1, 1.0, source::computed},
    {"clock_sine", "1", "sin(2 pi frequency t)", 1, 1.0, source::computed},
    {"clock_cosine", "1", "cos(2 pi frequency t)", 1, 1.0, source::computed},
    {"t", "s", "time since the muscles began", 1, 1.0, source::computed}};
inline constexpr int sensor_count = sizeof list / sizeof *list;

// Neighbours across the faces: -x, +x, -y, +y, -z, +z.
inline constexpr int neighbours = 6;
// All inputs: the sensors, the states, and the messages of the neighbours, [message][neighbour].
inline constexpr int first_state = count, first_heard = first_state + 16,
                     inputs = first_heard + 4 * neighbours;

LIMAX_LAW constexpr int count_components() {
    int sum = 0;
    for (const sensor& each : list) sum += each.components;
    return sum;
}
static_assert(count_components() == count, "the list of sensors is that of the inputs");

// Whether a controller reads one of the inputs from `first` to before `end`.
LIMAX_LAW constexpr bool reads(uint64_t mask, int first, int end) {
    return (mask >> first & ((uint64_t(1) << (end - first)) - 1)) != 0;
}
// Whether sensors read velocities of masses.
LIMAX_LAW constexpr bool reads_rates(uint64_t mask) {
    return reads(mask, strain_rate, load) || reads(mask, gravity, measured);
}
LIMAX_LAW constexpr int count_bits(uint64_t mask) {
    int bits = 0;
    for (; mask; mask &= mask - 1) ++bits;
    return bits;
}

template <class R>
using vector = effects::vector<R>;

// What the value of an input is multiplied by.
LIMAX_LAW constexpr double per_range(int first) {
    int at = 0;
    for (const sensor& each : list) {
        if (at == first) return 1.0 / each.range;
        at += each.components;
    }
    return 0;
}
template <int first, class R>
inline constexpr R scale = R(per_range(first));

// A corner of a voxel as its sensors see it.
template <class R>
struct corner {
    vector<R> position, velocity;  // m, m/s
    R push;                        // of contacts, without their damping, N
    bool touches;
};

// Fills the inputs of source::voxel. `at(c)` is corner c, by bits x = 1, y = 2, z = 4; `edge` is
// the rest edge, m, and `per_weight` one over the weight of the corners, 1/N, or 0.
template <class R, class At>
LIMAX_LAW void sense_voxel(R edge, R per_weight, const At& at, R in[]) {
    vector<R> e[3] = {}, w[3] = {};  // mean edges, and their rates
    R push = 0, touching = 0;
    for (int c = 0; c < 8; ++c) {
        const corner<R> seen = at(c);
        for (int axis = 0; axis < 3; ++axis) {
            const R sign = c >> axis & 1 ? R(0.25) : R(-0.25);
            e[axis].x = fma(sign, seen.position.x, e[axis].x);
            e[axis].y = fma(sign, seen.position.y, e[axis].y);
            e[axis].z = fma(sign, seen.position.z, e[axis].z);
            w[axis].x = fma(sign, seen.velocity.x, w[axis].x);
            w[axis].y = fma(sign, seen.velocity.y, w[axis].y);
            w[axis].z = fma(sign, seen.velocity.z, w[axis].z);
        }
        push += seen.push;
        touching += seen.touches ? R(1) : R(0);
    }
    const R per_edge = R(1) / edge;
    R rate = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const R squared =
            fma(e[axis].x, e[axis].x, fma(e[axis].y, e[axis].y, e[axis].z * e[axis].z));
        const R inverse = squared > R(0) ? inverse_length(squared) : R(0);
        in[strain + axis] = fma(squared * inverse, per_edge, R(-1)) * scale<strain, R>;
        rate = fma(fma(e[axis].x, w[axis].x, fma(e[axis].y, w[axis].y, e[axis].z * w[axis].z)),
                   inverse, rate);
    }
    in[strain_rate] = rate * per_edge * (scale<strain_rate, R> / R(3));
    in[load] = push * per_weight * scale<load, R>;
    in[contact] = touching * R(0.125);
}

// Uniform in [-1, 1], the same on every device.
LIMAX_LAW double noise(uint64_t seed, uint32_t tick, uint32_t voxel, uint32_t input) {
    const random_key key{seed, 0, uint32_t(random_stream::sensors), tick, voxel};
    return fma(2.0, random_uniform(key, input), -1.0);
}

}  // namespace limax::sensors
