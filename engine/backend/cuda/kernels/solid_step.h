// solid_step.h: the step of a robot's rigid block that one thread does: what acts on it, the
// friction of all that touches, its drift. The laws, their order and so the bits are the CPU's.
// Compiled for one scene (scene.h), for host and device alike. SI units.
#pragma once

#include "backend/cuda/kernels/scene.h"
#include "physics/solid_edges.h"

namespace limax::cuda {

// The constants of the scene's block.
struct solid_laws {
    solid::block_params block;
    solid::vector inertia;  // kg m^2

    LIMAX_LAW explicit solid_laws(const scene_values& scene)
        : block(effects::block::make<double>(scene.of(effects::index_of<effects::block>), nullptr)),
          inertia(inertia_of_box(block.half, block.mass)) {}
};

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

// A step of the block: forces at t_n, the kick of h, friction. `touching` are the masses that
// touch, in the order of their sites, whose velocities change; `corners` has room for all.
LIMAX_LAW void push_solid(solid_record& record, const scene_values& scene, const double* origin,
                          double time, solid_touch<real>* touching, int count,
                          solid::touch* corners, double h) {
    using namespace effects;
    const solid_laws laws(scene);
    solid::state block = record.block;
    const solid::moment moment = record.moment;
    solid::load load{{0, 0, 0}, {0, 0, 0}};
    if constexpr (has<gravity>) {
        const double* g = scene.of(index_of<gravity>);
        const double mass = laws.block.mass;
        load.force = {mass * g[0], mass * g[1], mass * g[2]};
    }
    for (int i = 0; i < count; ++i) solid::meet_back<real>(load, touching[i]);
    int standing = 0;
    const auto each = [&](const auto& visit) { each_fixed_contact(scene, origin, time, visit); };
    const auto keep = [&](const solid::touch& found) { corners[standing++] = found; };
    solid::meet_contacts(laws.block, record.seen, load, each, keep);
    if constexpr (has<edges>) solid::meet_edges(laws.block, record.seen, load, each, keep);
    solid::kick(block, load, laws.block.mass, h);
    if constexpr (has<friction>) {
        const auto law = friction::make<double>(scene.of(index_of<friction>), origin);
        solid::motion rubbed{};  // for the energy ledger, CPU only
        const auto grip = [&](const solid::vector& place) { return grip_at(scene, origin, place); };
        const auto wide = [](const vector<real>& v) { return solid::vector{v.x, v.y, v.z}; };
        solid::rub(
            law, laws.block, block, moment, h, rubbed,
            [&](const auto& visit) {
#pragma unroll 1
                for (int i = 0; i < count; ++i) visit(touching[i]);
            },
            [&](const solid_touch<real>& at) { return wide(at.before); },
            [&](const solid_touch<real>& at) { return wide(at.after); },
            [](const solid_touch<real>& at) { return at.inverse_mass; }, grip,
            [](solid_touch<real>& at, const solid::vector& impulse) {
                return solid::give_mass(at.after.x, at.after.y, at.after.z, impulse, at.mass,
                                        at.inverse_mass);
            });
        const auto still = [&]([[maybe_unused]] const solid::touch& at) {
            if constexpr (has_motion)
                return solid::surface_velocity(
                    at, [&](const auto& visit) { each_fixed_contact(scene, origin, time, visit); });
            return solid::vector{0, 0, 0};
        };
        solid::rub(
            law, laws.block, block, moment, h, rubbed,
            [&](const auto& visit) {
#pragma unroll 1
                for (int i = 0; i < standing; ++i) visit(corners[i]);
            },
            still, still, [](const solid::touch&) { return 0.0; }, grip,
            [](const solid::touch&, const solid::vector& impulse) { return impulse; });
    }
    record.block = block;
}

// On to t_n + dt. `share` as in predict().
LIMAX_LAW void move_solid(solid_record& record, const solid_laws& laws, double dt, double share) {
    solid::drift(record.block, laws.inertia, dt, leapfrog, share);
}
// Computes the quantities from which the next forces, and the masses' view of the block, follow.
LIMAX_LAW void show_solid(solid_record& record, const solid_laws& laws) {
    record.moment = solid::moment_of(record.block, laws.inertia);
    record.seen = solid::view_of(record.block, record.moment);
}

}  // namespace limax::cuda
