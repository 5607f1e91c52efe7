// time_step.cpp: the bound of a body and the steps of a run.
#include "physics/time_step.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "physics/bound.h"
#include "physics/held.h"
#include "physics/ledger.h"
#include "physics/origin.h"
#include "physics/sensors.h"

namespace limax {

namespace {

constexpr int64_t least_rate = 20;      // Hz: a base of at most 50 ms
constexpr int64_t most_rate = 1000000;  // Hz: beyond it a base is shorter than any useful step
// Counted in 64 bits. The stiffest body of the legal materials at the smallest fraction of its
// bound takes 1e17 steps of the longest run.
constexpr double most_steps = 9e18;
// A ratio of decimal numbers is whole if it is so to this share: their rounding is about 1e-16.
constexpr double whole_within = 1e-9, rounding = 1e-12;

// The distance along `direction`, a unit vector, from which two boxes with edges along the axes
// first touch: the one that moves has its lowest corner at `start`. Infinite if they never do, or
// if they overlap at the start. m.
double way_to_box(const effects::vector<double>& start, const effects::vector<double>& size,
                  const effects::vector<double>& direction, const effects::vector<double>& from,
                  const effects::vector<double>& to) {
    double enter = -HUGE_VAL, leave = HUGE_VAL;
    const auto along_axis = [&](double at, double extent, double step, double low, double high) {
        const double before = low - extent - at, after = high - at;
        if (step == 0) {
            if (before >= 0 || after <= 0) enter = HUGE_VAL;
            return;
        }
        enter = std::max(enter, std::min(before / step, after / step));
        leave = std::min(leave, std::max(before / step, after / step));
    };
    along_axis(start.x, size.x, direction.x, from.x, to.x);
    along_axis(start.y, size.y, direction.y, from.y, to.y);
    along_axis(start.z, size.z, direction.z, from.z, to.z);
    return enter > 0 && enter < leave ? enter : HUGE_VAL;
}

// The square of the speed at which a box with this lowest corner, size and velocity first reaches
// what is below it, (m/s)^2: by its corner the ground, a plane or terrain, anywhere a box or a
// sphere, of which the box around it counts.
double squared_arrival_speed(const effects::vector<double>& start,
                             const effects::vector<double>& size, const double velocity[3],
                             const limax_simulation_options& options, const scene& scene) {
    using namespace effects;
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) squared += velocity[axis] * velocity[axis];
    const double* g = scene.values(index_of<gravity>);
    const vector<double> pull{g[0], g[1], g[2]};
    const double strength = scene.has(index_of<gravity>) ? std::sqrt(dot(pull, pull)) : 0;
    double way = HUGE_VAL;
    const double world[3] = {0, 0, 0};
    for_each([&]<class E>(E) {
        if constexpr (same_type<E, boxes> || same_type<E, spheres>)
            for (int i = 0; i < scene.instances(index_of<E>) && strength > 0; ++i) {
                const auto p = E::template make<double>(scene.values(index_of<E>, i), world);
                vector<double> half;
                if constexpr (same_type<E, boxes>)
                    half = p.half;
                else
                    half = {p.radius, p.radius, p.radius};
                way = std::min(
                    way, way_to_box(
                             start, size, {pull.x / strength, pull.y / strength, pull.z / strength},
                             {p.center.x - half.x, p.center.y - half.y, p.center.z - half.z},
                             {p.center.x + half.x, p.center.y + half.y, p.center.z + half.z}));
            }
        if constexpr (same_type<E, ground> || same_type<E, planes> || same_type<E, terrain>)
            for (int i = 0; i < scene.instances(index_of<E>); ++i) {
                const auto point = E::surface(
                    make_params<E, double>(scene.values(index_of<E>, i), world, scene.heights()),
                    start);
                const double towards = -along(point.normal, pull);
                if (point.depth < 0 && towards > 0)
                    way = std::min(way, -point.depth * strength / towards);
            }
    });
    if (strength > 0 && way < HUGE_VAL) {
        const double whole = options.settle + options.duration;
        const double reach = std::sqrt(squared) * whole + 0.5 * strength * whole * whole;
        squared += 2 * strength * std::min(way, reach);
    }
    return squared;
}

}  // namespace

double time_step_bound(const spring_body& body, const scene& scene, limax_integrator integrator,
                       limax_bound kind) {
    spring_constants springs{body.stiffness.data(), body.damping.data(), body.count};
    springs.by_voxels = kind == LIMAX_BOUND_VOXELS;
    if (springs.by_voxels && springs.damping) {
        springs.least_time = HUGE_VAL;
        for (std::size_t slot = 0; slot < body.stiffness.size(); ++slot)
            springs.least_time = std::min(
                springs.least_time, damping_time(springs.stiffness[slot], springs.damping[slot]));
    }
    const int across = body.grid.nx + 1, along = body.grid.ny + 1;
    double least = HUGE_VAL;
    for (int32_t i = 0; i < body.masses; ++i) {
        const int32_t site = body.sites[i];
        if (is_held(scene, body.rest[0], body.corner, site % across, site / across % along,
                    site / (across * along)))
            continue;
        least = std::min(least, stable_step_of_mass(scene, scheme(integrator), body.grid, springs,
                                                    site, body.mass[site]));
    }
    for (int i = 0; i < scene.instances(effects::index_of<effects::block>); ++i)
        least = std::min(
            least, stable_step_of_block(scene, i, scheme(integrator), body.rest[0], body.masses,
                                        *std::max_element(body.mass.begin(), body.mass.end())));
    return least;
}

double accuracy_cap(const limax_simulation_options& options, const scene& scene,
                    const lattice& grid) {
    using namespace effects;
    const double *x = options.position, edge = options.edge;
    double squared =
        squared_arrival_speed({x[0], x[1], x[2]}, {edge * grid.nx, edge * grid.ny, edge * grid.nz},
                              options.velocity, options, scene);
    for (int i = 0; i < scene.instances(index_of<block>); ++i) {
        const double* values = scene.values(index_of<block>, i);
        const double* from = values + block::at_position;
        squared = std::max(squared,
                           squared_arrival_speed({x[0] + from[0], x[1] + from[1], x[2] + from[2]},
                                                 {values[0], values[1], values[2]},
                                                 values + block::at_velocity, options, scene));
    }
    return coarse_share * options.edge / std::sqrt(squared);
}

schedule make_schedule(const limax_simulation_options& options, const scene& scene,
                       const lattice& grid, double bound, double amplitude) {
    using effects::control;
    int64_t rate = 1;
    const double* controller =
        scene.has(effects::index_of<control>) ? scene.values(effects::index_of<control>) : nullptr;
    const auto ticks = controller ? int64_t(controller[control::at_rate]) : 0;  // Hz
    if (ticks) rate = ticks;
    for (const int32_t hertz : options.record)
        // at most 10^6 times 10^5 at each turn: no overflow
        if (hertz > 0 && rate <= most_rate) rate = std::lcm(rate, int64_t(hertz));
    if (rate > most_rate)
        fail(LIMAX_INVALID_ARGUMENT,
             format("record, control: the least common multiple of the rates is "
                    "%lld Hz or more; it must be at most %lld Hz",
                    static_cast<long long>(rate), static_cast<long long>(most_rate)));
    if (rate < least_rate) rate *= (least_rate + rate - 1) / rate;
    const double base = 1.0 / double(rate);

    double wanted = options.time_step;
    if (wanted == 0) {
        wanted = options.bound_fraction * bound;
        if (options.time_step_most > 0) wanted = std::min(wanted, options.time_step_most);
        wanted = std::min({wanted, accuracy_cap(options, scene, grid), base});
        if (ticks && controller[control::at_hold] == 0) {
            // of space diagonals
            const double fastest =
                std::sqrt(3.0) * amplitude * controller[control::at_change] * double(ticks);
            wanted = std::min(wanted, coarse_share / fastest);
        }
    }
    const double ratio = base / wanted;
    int64_t per_base = static_cast<int64_t>(std::ceil(ratio * (1.0 - rounding)));
    if (options.time_step > 0) {
        per_base = std::max<int64_t>(1, std::llround(ratio));
        if (std::fabs(ratio - double(per_base)) > whole_within * ratio)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("time_step is %.9g s, which does not divide the sample interval of %.9g s; "
                        "the nearest that does is "
                        "%.9g s",
                        options.time_step, base, base / double(per_base)));
    }

    schedule plan;
    if (ticks) plan.tick = rate / ticks * per_base;
    plan.time_step = base / double(per_base);
    // samples begin at t = 0: settling takes whole steps, the duration whole samples
    const auto whole = [](double count) { return std::ceil(count * (1.0 - rounding)); };
    const double settle = whole(options.settle * double(rate) * double(per_base));
    const double moving = whole(options.duration * double(rate)) * double(per_base);
    if (settle + moving > most_steps)
        fail(LIMAX_INVALID_ARGUMENT,
             format("duration and settle take %.3g steps of %.9g s; at most %.3g are possible",
                    settle + moving, plan.time_step, most_steps));
    plan.settle_steps = static_cast<int64_t>(settle);
    plan.steps = plan.settle_steps + static_cast<int64_t>(moving);
    for (int kind = 0; kind < LIMAX_TRACE_KINDS; ++kind) {
        if (options.record[kind] <= 0) continue;
        plan.every[kind] = rate / options.record[kind] * per_base;
        plan.samples[kind] = (plan.steps - plan.settle_steps) / plan.every[kind] + 1;
    }
    return plan;
}

int64_t trace_width(int32_t kind, int64_t masses, int64_t voxels, const scene& scene) {
    switch (kind) {
        case LIMAX_TRACE_CENTER_OF_MASS: return 3;
        case LIMAX_TRACE_POSITION:
        case LIMAX_TRACE_VELOCITY: return 3 * masses;
        case LIMAX_TRACE_CONTACT: return 1;
        case LIMAX_TRACE_ENERGY: return 4;
        case LIMAX_TRACE_LEDGER: return ledger_width;
        case LIMAX_TRACE_BLOCK:
            return solid::sample_width * scene.instances(effects::index_of<effects::block>);
        case LIMAX_TRACE_ACTIVATION: return voxels;
        case LIMAX_TRACE_SENSOR: return voxels * sensors::count_bits(scene.controller().sensors);
        default: return 2;
    }
}

}  // namespace limax
