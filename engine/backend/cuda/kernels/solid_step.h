// solid_step.h: the step of a robot's rigid block: what acts on it, the friction of all that
// touches, its drift. The laws, their order and so the bits are the CPU's.
// Compiled for one scene (scene.h), for host and device alike. SI units.
#pragma once

#include "backend/cuda/kernels/scene.h"

namespace limax::cuda {

// What never changes of the scene's block.
struct solid_laws {
    solid::block_params block;
    solid::vector inertia;  // kg m^2

    LIMAX_LAW explicit solid_laws(const scene_values& scene)
        : block(effects::block::make<double>(scene.of(effects::index_of<effects::block>), nullptr)),
          inertia(inertia_of_box(block.half, block.mass)) {}
};

// Calls visit(effect, params) for each instance of the scene's fixed contacts.
template <class Visit>
LIMAX_LAW void each_fixed_contact(const scene_values& scene, const double* origin,
                                  const Visit& visit) {
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::is_contact<E> && instances < E >> 0) {
#pragma unroll 1
            for (int i = 0; i < instances<E>; ++i)
                visit(E{}, effects::make_params<E, double>(scene.of(effects::index_of<E>, i),
                                                           origin, scene.heights));
        }
    });
}

// What touches lies in memory: masses in the order of their sites; corners at fixed contacts by
// corner, each with room for all contacts of the scene.
LIMAX_LAW constexpr int count_contacts() {
    int count = 0;
    effects::for_each([&]<class E>(E) {
        if (effects::is_contact<E>) count += instances<E>;
    });
    return count;
}
inline constexpr int contacts_of_scene = count_contacts();
struct touching_solid {
    solid_touch<mass_real>* masses;
    int count;
    solid::touch* corners;
    uint64_t standing;  // contacts that a corner touches, 8 bits for each

    template <class Visit>
    LIMAX_LAW void each_mass(const Visit& visit) const {
#pragma unroll 1
        for (int i = 0; i < count; ++i) visit(masses[i]);
    }
    template <class Visit>
    LIMAX_LAW void each_corner(const Visit& visit) const {
#pragma unroll 1
        for (int corner = 0; corner < solid::corners; ++corner)
#pragma unroll 1
            for (int i = 0; i < int(standing >> 8 * corner & 255u); ++i)
                visit(corners[corner * contacts_of_scene + i]);
    }
};

// ---- what is found for each by itself ----

// Leaves how a corner touches; its part of touching_solid::standing.
LIMAX_LAW uint64_t meet_corner(const solid_record& record, const solid_laws& laws,
                               const scene_values& scene, const double* origin, int corner,
                               solid::touch* corners, double h) {
    using namespace effects;
    int standing = 0;
    solid::meet_corner(
        laws.block, record.seen, corner,
        [&](const auto& visit) { each_fixed_contact(scene, origin, visit); },
        [&](solid::touch found) {
            if constexpr (has<friction>)
                found.limit = solid::friction_limit(
                    friction::make<double>(scene.of(index_of<friction>), origin), laws.block,
                    record.block, record.moment, found, {0, 0, 0}, 0.0, h);
            corners[corner * contacts_of_scene + standing++] = found;
        });
    return uint64_t(standing) << 8 * corner;
}

// Finds the limit of friction at a mass that touches.
LIMAX_LAW void limit_friction(const solid_record& record, const solid_laws& laws,
                              const scene_values& scene, const double* origin,
                              solid_touch<mass_real>& at, double h) {
    using namespace effects;
    if constexpr (has<friction>)
        at.limit = solid::friction_limit(
            friction::make<double>(scene.of(index_of<friction>), origin), laws.block, record.block,
            record.moment, at, {at.before.x, at.before.y, at.before.z}, at.inverse_mass, h);
}

// ---- what one thread does ----

// A step of the block: forces at t_n, the kick of h, friction, which changes the velocities of the
// masses that touch.
LIMAX_LAW void push_solid(solid_record& record, const solid_laws& laws, const scene_values& scene,
                          const touching_solid& touching, double h) {
    using namespace effects;
    solid::state block = record.block;
    const solid::moment moment = record.moment;
    solid::load load{{0, 0, 0}, {0, 0, 0}};
    if constexpr (has<gravity>) {
        const double* g = scene.of(index_of<gravity>);
        const double mass = laws.block.mass;
        load.force = {mass * g[0], mass * g[1], mass * g[2]};
    }
    touching.each_mass([&](const solid::touch& at) { solid::meet_back<mass_real>(load, at); });
    touching.each_corner([&](const solid::touch& at) { solid::stand_on(load, at); });
    solid::kick(block, load, laws.block.mass, h);
    if constexpr (has<friction>) {
        solid::motion rubbed{};  // of the books, which the CPU keeps
        solid::rub(
            laws.block, block, moment, h, rubbed,
            [&](const auto& visit) { touching.each_mass(visit); },
            [](const solid_touch<mass_real>& at) {
                return solid::vector{at.after.x, at.after.y, at.after.z};
            },
            [](const solid_touch<mass_real>& at) { return at.inverse_mass; },
            [](solid_touch<mass_real>& at, const solid::vector& impulse) {
                return solid::give_mass(at.after.x, at.after.y, at.after.z, impulse, at.mass,
                                        at.inverse_mass);
            });
        solid::rub(
            laws.block, block, moment, h, rubbed,
            [&](const auto& visit) { touching.each_corner(visit); },
            [](const solid::touch&) {
                return solid::vector{0, 0, 0};
            },
            [](const solid::touch&) { return 0.0; },
            [](const solid::touch&, const solid::vector& impulse) { return impulse; });
    }
    record.block = block;
}

// On to t_n + dt. `share` as in predict().
LIMAX_LAW void move_solid(solid_record& record, const solid_laws& laws, double dt, double share) {
    solid::drift(record.block, laws.inertia, dt, leapfrog, share);
}
// What the next forces, and what masses see, follow from.
LIMAX_LAW void show_solid(solid_record& record, const solid_laws& laws) {
    record.moment = solid::moment_of(record.block, laws.inertia);
    record.seen = solid::view_of(record.block, record.moment);
}

}  // namespace limax::cuda
