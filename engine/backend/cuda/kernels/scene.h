// scene.h: what a kernel is compiled for, and how the laws of its effects meet springs and masses.
// An effect that the scene lacks is never instantiated. Includes laws only. SI units.
//   LIMAX_EFFECTS    bits of the scene's effects
//   LIMAX_PRECISION  limax_precision
//   LIMAX_LEAPFROG   1 or 0
//   LIMAX_INSTANCES  instances of effects that may be there several times, as instances_code()
//                    packs them; not defined where there are none
#pragma once

#include "backend/cuda/kernels/records.h"
#include "backend/cuda/kernels/scripted.h"
#include "physics/effects/all.h"
#include "physics/held.h"
#include "physics/integrator.h"
#include "physics/separation.h"

namespace limax::cuda {

template <class E>
inline constexpr bool has = (LIMAX_EFFECTS & effects::bit<E>) != 0;

// `spring_real` holds what springs read and the forces they give, `mass_real` all else.
enum precision { single = 0, compensated_sums = 1, mixed = 2, twice = 3 };
template <int p>
struct real_types {
    using spring = float;
    using mass = float;
};
template <>
struct real_types<mixed> {
    using spring = float;
    using mass = double;
};
template <>
struct real_types<twice> {
    using spring = double;
    using mass = double;
};
using spring_real = real_types<LIMAX_PRECISION>::spring;
using mass_real = real_types<LIMAX_PRECISION>::mass;

inline constexpr bool compensated = LIMAX_PRECISION == compensated_sums;
inline constexpr bool leapfrog = LIMAX_LEAPFROG;
inline constexpr bool damped = has<effects::damping>, actuated = has<effects::actuation>;
inline constexpr bool holding = (LIMAX_EFFECTS & holding_bits) != 0;
inline constexpr bool touchable = (LIMAX_EFFECTS & effects::contact_bits) != 0;
inline constexpr bool has_faces = (LIMAX_EFFECTS & effects::face_bits) != 0;
inline constexpr bool meets = (LIMAX_EFFECTS & effects::meeting_bits) != 0;
inline constexpr bool has_solid = (LIMAX_EFFECTS & effects::solid_bits) != 0;
// Other masses need a mass's velocity only where a law on more than one mass reads it.
inline constexpr bool shares_velocity = damped || has_faces || meets;
// The shared position is the mass's own, not a rounded copy.
inline constexpr bool shares_state = sizeof(spring_real) == sizeof(mass_real);

// Columns of spring parameters: k, then c, then A and B.
inline constexpr int spring_columns = 1 + (damped ? 1 : 0) + (actuated ? 2 : 0);
// Columns of a robot's state, in the order of state_column.
inline constexpr int state_columns = compensated ? 15 : 9;

// ---- parameters of the scene's effects on masses ----

#if !defined(LIMAX_INSTANCES)
#define LIMAX_INSTANCES 0
#endif
template <class E>
inline constexpr int instances = !has<E>                  ? 0
                                 : effects::repeatable<E> ? instances_in<E>(LIMAX_INSTANCES)
                                                          : 1;

// Those of all instances; the ones that may be there several times are made here.
template <class E, int count = effects::repeatable<E> ? instances<E> : 0>
struct instance_params {
    typename E::template params<mass_real> instance[count];
};
template <class E>
struct instance_params<E, 0> {};
template <class List>
struct all_params;
template <class... E>
struct all_params<effects::list<E...>> : mass_params<mass_real>, instance_params<E>... {
    LIMAX_LAW explicit all_params(const mass_params<mass_real>& single)
        : mass_params<mass_real>(single) {}
    template <class F>
    LIMAX_LAW typename F::template params<mass_real>& instance_of(int i) {
        return static_cast<instance_params<F>&>(*this).instance[i];
    }
    template <class F>
    LIMAX_LAW const typename F::template params<mass_real>& instance_of(int i) const {
        return static_cast<const instance_params<F>&>(*this).instance[i];
    }
};
using scene_params = all_params<effects::all>;

// Calls visit(parameters) for each instance of an effect.
template <class E, class Visit>
LIMAX_LAW void each_instance(const scene_params& params, const Visit& visit) {
    if constexpr (!effects::repeatable<E> && instances < E >> 0) {
        visit(params.template of<E>());
    } else if constexpr (instances<E> > 0) {
#pragma unroll
        for (int i = 0; i < instances<E>; ++i) visit(params.template instance_of<E>(i));
    }
}

using launch_arguments = step_launch<mass_real>;

// Brings the parameters relative to the robot's own origin up to date, and makes those of
// effects that may be there several times.
LIMAX_LAW void follow_origin(scene_params& params, const scene_values& scene,
                             const double* origin) {
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        if constexpr (effects::repeatable<E>) {
            if constexpr (instances < E >> 0) {
#pragma unroll
                for (int i = 0; i < instances<E>; ++i)
                    params.template instance_of<E>(i) =
                        E::template make<mass_real>(scene.of(index, i), origin);
            }
        } else if constexpr (has<E> && effects::acts_on_masses<E>) {
            auto& own = params.template of<E>();
            if constexpr (requires { E::follow(own, nullptr, nullptr); })
                E::follow(own, scene.of(index), origin);
            if constexpr (effects::reads_heights<E>) own.table = scene.heights;
        }
    });
}

// ---- springs ----

// A mass as its springs see it.
struct corner {
    spring_real x, y, z;     // m
    spring_real vx, vy, vz;  // m/s, the velocity that forces read; only if shares_velocity
};
struct force {
    spring_real x, y, z;  // N
};

// Adds the force of one spring to the sums of its ends. `spring` brings the parameters.
LIMAX_LAW void add_spring(const corner& near, const corner& far,
                          effects::spring_state<spring_real> spring,
                          const effects::actuation::moment<spring_real>& now, force& on_near,
                          force& on_far) {
    const separation<spring_real> e{far.x - near.x, far.y - near.y, far.z - near.z};
    const distance<spring_real> apart = spring_length(e);
    spring.length = apart.length;
    if constexpr (shares_velocity)
        spring.rate =
            dot(separation<spring_real>{far.vx - near.vx, far.vy - near.vy, far.vz - near.vz}, e) *
            apart.inverse;
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_rest))
            spring.rest = E::rest(now, spring);
    });
    effects::spring_force<spring_real> along;
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_pair)) along = E::pair(spring, along);
    });
    const spring_real scale = fma(-apart.inverse, along.push, along.scale);
    on_near.x = fma(scale, e.x, on_near.x);
    on_near.y = fma(scale, e.y, on_near.y);
    on_near.z = fma(scale, e.z, on_near.z);
    on_far.x = fma(-scale, e.x, on_far.x);
    on_far.y = fma(-scale, e.y, on_far.y);
    on_far.z = fma(-scale, e.z, on_far.z);
}

// ---- masses ----

// One mass with the velocities around t_n.
struct mass_state {
    mass_real position[3], velocity[3];  // x_n; u, before the kick
    mass_real predicted[3];              // p, what forces read; u in symplectic Euler
    mass_real lost_position[3], lost_velocity[3];
    mass_real mass, inverse_mass, root_mass;
};

LIMAX_LAW effects::node_state<mass_real> node_of(const mass_state& m) {
    return {{m.position[0], m.position[1], m.position[2]},
            {m.predicted[0], m.predicted[1], m.predicted[2]},
            m.mass,
            m.inverse_mass,
            m.root_mass};
}

// The velocity after all forces on single masses at t_n over h, without friction.
// `met` is the force of masses that are not neighbours, `pushed` that of a solid.
LIMAX_LAW void kick_mass(mass_state& m, const force& springs, const effects::vector<mass_real>& met,
                         const effects::vector<mass_real>& pushed, const scene_params& params,
                         const scripted_moment& now, mass_real h, mass_real next_velocity[3]) {
    using namespace effects;
    const node_state<mass_real> node = node_of(m);
    vector<mass_real> total{mass_real(springs.x), mass_real(springs.y), mass_real(springs.z)};
    for_each([&]<class E>(E) {
        if constexpr (pushes_masses<E>)
            each_instance<E>(params, [&](const auto& p) { add_force<E>(p, node, total); });
    });
    add_scripted_forces(node, now, total);
    if constexpr (meets) total = {total.x + met.x, total.y + met.y, total.z + met.z};
    if constexpr (has_solid) total = {total.x + pushed.x, total.y + pushed.y, total.z + pushed.z};
    const mass_real all[3] = {total.x, total.y, total.z};
    for (int axis = 0; axis < 3; ++axis)
        next_velocity[axis] = kick<compensated>(m.velocity[axis], all[axis], m.inverse_mass, h,
                                                m.lost_velocity[axis]);
}

// Friction, last of all: what it stops stays.
LIMAX_LAW void slow_mass(const mass_state& m, const scene_params& params, mass_real h,
                         mass_real next_velocity[3]) {
    using namespace effects;
    const node_state<mass_real> node = node_of(m);
    const vector<mass_real> before{m.velocity[0], m.velocity[1], m.velocity[2]};
    vector<mass_real> after{next_velocity[0], next_velocity[1], next_velocity[2]};
    for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & hook_slip))
            for_each([&]<class C>(C) {
                if constexpr (is_contact<C>)
                    each_instance<C>(params, [&](const auto& contact) {
                        // most masses touch nothing
                        const auto point = C::surface(contact, node.position);
                        const mass_real push = push_at(contact, point, node);
                        if (push > mass_real(0))
                            after = E::slip(params.template of<E>(), point.normal, push,
                                            node.inverse_mass, before, after, h);
                    });
            });
    });
    next_velocity[0] = after.x;
    next_velocity[1] = after.y;
    next_velocity[2] = after.z;
}

// The velocity after everything that acts over h where neither a law on faces nor a solid does.
LIMAX_LAW void begin_mass(mass_state& m, const force& springs,
                          const effects::vector<mass_real>& met, const scene_params& params,
                          const scripted_moment& now, mass_real h, mass_real next_velocity[3]) {
    kick_mass(m, springs, met, {}, params, now, h, next_velocity);
    slow_mass(m, params, h, next_velocity);
}

// Whether a mass is below the surface of any contact.
LIMAX_LAW bool touches(const mass_state& m, const scene_params& params) {
    bool found = false;
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::is_contact<E>)
            each_instance<E>(params, [&](const auto& contact) {
                const effects::vector<mass_real> at{m.position[0], m.position[1], m.position[2]};
                found |= E::surface(contact, at).depth > mass_real(0);
            });
    });
    return found && m.mass > mass_real(0);
}

// On to t_n + dt with the velocity after the kick. `share` as in predict().
LIMAX_LAW void finish_mass(mass_state& m, const mass_real next_velocity[3], mass_real dt,
                           mass_real share) {
    for (int axis = 0; axis < 3; ++axis) {
        m.position[axis] =
            drift<compensated>(m.position[axis], next_velocity[axis], dt, m.lost_position[axis]);
        m.predicted[axis] =
            leapfrog ? predict(m.velocity[axis], next_velocity[axis], share) : next_velocity[axis];
        m.velocity[axis] = next_velocity[axis];
    }
}

// ---- loads and stores of a mass ----

// As its springs see it, and what they see taken back where nothing was rounded.
LIMAX_LAW corner corner_of(const mass_state& m) {
    corner c{spring_real(m.position[0]), spring_real(m.position[1]), spring_real(m.position[2])};
    if constexpr (shares_velocity) {
        c.vx = spring_real(m.predicted[0]);
        c.vy = spring_real(m.predicted[1]);
        c.vz = spring_real(m.predicted[2]);
    }
    return c;
}
LIMAX_LAW void take_corner(mass_state& m, const corner& c) {
    m.position[0] = c.x;
    m.position[1] = c.y;
    m.position[2] = c.z;
    if constexpr (shares_velocity) {
        m.predicted[0] = c.vx;
        m.predicted[1] = c.vy;
        m.predicted[2] = c.vz;
    }
}

// A mass of a robot's state, whose columns are `stride` elements apart.
LIMAX_LAW void load_mass(mass_state& m, mass_real next_velocity[3], float mass,
                         const mass_real* state, int64_t stride) {
    m.mass = mass_real(mass);
    m.inverse_mass = m.mass > mass_real(0) ? mass_real(1) / m.mass : mass_real(0);
    if constexpr (holding) m.mass = absolute(m.mass);
    m.root_mass = square_root(m.mass);
    for (int axis = 0; axis < 3; ++axis) {
        const mass_real* column = state + axis * stride;
        m.position[axis] = column[column_position * stride];
        m.velocity[axis] = m.predicted[axis] = column[column_velocity * stride];
        next_velocity[axis] = column[column_next_velocity * stride];
        if constexpr (compensated) {
            m.lost_position[axis] = column[column_lost_position * stride];
            m.lost_velocity[axis] = column[column_lost_velocity * stride];
        }
    }
}
LIMAX_LAW void store_mass(const mass_state& m, mass_real* state, int64_t stride) {
    for (int axis = 0; axis < 3; ++axis) {
        mass_real* column = state + axis * stride;
        column[column_position * stride] = m.position[axis];
        column[column_velocity * stride] = m.velocity[axis];
        if constexpr (compensated) {
            column[column_lost_position * stride] = m.lost_position[axis];
            column[column_lost_velocity * stride] = m.lost_velocity[axis];
        }
    }
}
// What a kick changes of a mass that has finished its step: between kick and drift the rest stays.
LIMAX_LAW void store_kick(const mass_state& m, mass_real* state, int64_t stride) {
    for (int axis = 0; axis < 3; ++axis) {
        mass_real* column = state + axis * stride;
        column[column_next_velocity * stride] = m.velocity[axis];
        if constexpr (compensated) column[column_lost_velocity * stride] = m.lost_velocity[axis];
    }
}
LIMAX_LAW void store_next_velocity(const mass_real next_velocity[3], mass_real* state,
                                   int64_t stride) {
    for (int axis = 0; axis < 3; ++axis)
        state[(column_next_velocity + axis) * stride] = next_velocity[axis];
}

// Copies a record by the `threads` threads of which this is number `thread`.
LIMAX_LAW void copy_record(robot_record& to, const robot_record& from, int thread, int threads) {
    static_assert(sizeof(robot_record) % sizeof(int64_t) == 0);
    for (int word = thread; word < int(sizeof(robot_record) / sizeof(int64_t)); word += threads)
        reinterpret_cast<int64_t*>(&to)[word] = reinterpret_cast<const int64_t*>(&from)[word];
}

}  // namespace limax::cuda
