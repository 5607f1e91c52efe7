// solid_step.h: the step of a robot's rigid blocks that one thread does: what acts on them, the
// friction of all that touches, their drift. The laws, their order and so the bits are the CPU's.
// Compiled for one scene (scene.h), for host and device alike. SI units.
#pragma once

#include "backend/cuda/kernels/scene.h"
#include "physics/solid_pairs.h"

namespace limax::cuda {

using touching_solids = solid_touch<real, solids>;

// Calls visit(effect, params) for each instance of the scene's contacts at a time, s since the
// muscles began.
template <class Visit>
LIMAX_LAW void each_fixed_contact(const scene_values& scene, const double* origin, double time,
                                  const Visit& visit) {
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::is_contact<E> && instances < E >> 0) {
#pragma unroll 1
            for (int i = 0; i < instances<E>; ++i)
                visit(E{}, effects::make_params<E, double>(scene.of(effects::index_of<E>, i),
                                                           origin, scene.heights, time));
        }
    });
}

// The factor on friction at a place.
LIMAX_LAW double grip_at(const scene_values& scene, const double* origin,
                         const solid::vector& place) {
    double factor = 1.0;
    effects::for_each([&]<class E>(E) {
        if constexpr (bool(E::hooks & effects::hook_grip) && instances < E >> 0) {
#pragma unroll 1
            for (int i = 0; i < instances<E>; ++i)
                factor *= E::grip(
                    E::template make<double>(scene.of(effects::index_of<E>, i), origin), place);
        }
    });
    return factor;
}

// A step of the blocks: forces at t_n, the kick of h, friction. `touching` are the masses that
// touch, in the order of their sites, whose velocities change; `corners` and `pairs` have room for
// all.
LIMAX_LAW void push_solids(solid_record* records, const scene_values& scene, const double* origin,
                           double time, touching_solids* touching, int count, solid::touch* corners,
                           solid::pair_touch* pairs, double h) {
    using namespace effects;
    solid::body bodies[solids];
#pragma unroll 1
    for (int b = 0; b < solids; ++b) {
        bodies[b] = records[b].body;
        bodies[b].on = {{0, 0, 0}, {0, 0, 0}};
        if constexpr (has<gravity>) {
            const double* g = scene.of(index_of<gravity>);
            solid::weigh(bodies[b], {g[0], g[1], g[2]});
        }
    }
    // a block that a mass does not touch does not push it
    const auto each_mass = [&](const auto& visit) {
#pragma unroll 1
        for (int i = 0; i < count; ++i)
#pragma unroll 1
            for (int b = 0; b < solids; ++b)
                if (solids == 1 || touching[i].of[b].push > 0) visit(touching[i], b);
    };
    each_mass([&](const touching_solids& mass, int b) {
        solid::meet_back<real>(bodies[b].on, mass.of[b]);
    });
    int standing = 0, met = 0;
    const auto each = [&](const auto& visit) { each_fixed_contact(scene, origin, time, visit); };
    solid::meet_all<has<edges>>(bodies, solids, each, [&]<class Touch>(const Touch& found) {
        if constexpr (same_type<Touch, solid::touch>)
            corners[standing++] = found;
        else
            pairs[met++] = found;
    });
#pragma unroll 1
    for (int b = 0; b < solids; ++b) solid::kick(bodies[b], h);
    if constexpr (has<friction>) {
        const auto law = friction::make<double>(scene.of(index_of<friction>), origin);
        const auto grip = [&](const solid::vector& place) { return grip_at(scene, origin, place); };
        const auto wide = [](const vector<real>& v) { return solid::vector{v.x, v.y, v.z}; };
        touching_solids* mass = nullptr;  // that is visited
        const solid::counterpart of_mass{
            [&](const solid::touch&) { return wide(mass->before); },
            [&](const solid::touch&) { return wide(mass->after); },
            [&](const solid::touch&, const solid::vector&) { return mass->inverse_mass; },
            [&](const solid::touch&, const solid::vector& impulse) {
                return solid::give_mass(mass->after.x, mass->after.y, mass->after.z, impulse,
                                        mass->mass, mass->inverse_mass);
            }};
        solid::rub(
            law, h, bodies, solids,
            [&](const auto& visit) {
                each_mass([&](touching_solids& touches, int b) {
                    mass = &touches;
                    visit(touches.of[b], of_mass);
                });
            },
            grip);
        const auto surface = [&]([[maybe_unused]] const solid::touch& at) {
            if constexpr (has_motion) return solid::surface_velocity(at, each);
            return solid::vector{0, 0, 0};
        };
        solid::rub_all(law, h, bodies, solids, corners, standing, pairs, met, surface, grip);
    }
#pragma unroll 1
    for (int b = 0; b < solids; ++b) records[b].body.block = bodies[b].block;
}

// Computes the quantities from which the next forces, and the masses' view of the blocks, follow.
LIMAX_LAW void show_solids(solid_record* records) {
#pragma unroll 1
    for (int b = 0; b < solids; ++b) {
        solid::show(records[b].body);
        records[b].seen = solid::view_of(records[b].body);
    }
}
// On to t_n + dt. `share` as in predict().
LIMAX_LAW void move_solids(solid_record* records, double dt, double share) {
#pragma unroll 1
    for (int b = 0; b < solids; ++b) solid::drift(records[b].body, dt, leapfrog, share);
    show_solids(records);
}

}  // namespace limax::cuda
