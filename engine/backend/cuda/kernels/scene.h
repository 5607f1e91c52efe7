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
#include "physics/sensors.h"
#include "physics/separation.h"

namespace limax::cuda {

template <class E>
inline constexpr bool has = (LIMAX_EFFECTS & effects::bit<E>) != 0;

enum precision { single = 0, compensated_sums = 1, twice = 2 };
// The type of state and forces.
template <int p>
struct real_type {
    using type = float;
};
template <>
struct real_type<twice> {
    using type = double;
};
using real = real_type<LIMAX_PRECISION>::type;

inline constexpr bool compensated = LIMAX_PRECISION == compensated_sums;
inline constexpr bool leapfrog = LIMAX_LEAPFROG;
inline constexpr bool damped = has<effects::damping>, controlled = has<effects::control>;
// Whether muscles move, by a sine or by a controller.
inline constexpr bool actuated = has<effects::actuation> || controlled;
inline constexpr bool holding = (LIMAX_EFFECTS & holding_bits) != 0;
inline constexpr bool touchable = (LIMAX_EFFECTS & effects::contact_bits) != 0;
inline constexpr bool has_faces = (LIMAX_EFFECTS & effects::face_bits) != 0;
inline constexpr bool meets = (LIMAX_EFFECTS & effects::meeting_bits) != 0;
inline constexpr bool has_solid = (LIMAX_EFFECTS & effects::solid_bits) != 0;
inline constexpr bool has_motion = (LIMAX_EFFECTS & effects::motion_bits) != 0;
// Other masses need a mass's velocity only where a law on more than one mass reads it.
#if defined(LIMAX_CONTROL_SENSORS)
inline constexpr uint64_t control_sensors = LIMAX_CONTROL_SENSORS;
#else
inline constexpr uint64_t control_sensors = 0;
#endif
inline constexpr bool senses_rates = sensors::reads_rates(control_sensors);
inline constexpr bool shares_velocity = damped || has_faces || meets || senses_rates;

// Columns of spring parameters: k, then c, then A and B.
inline constexpr int spring_columns = 1 + (damped ? 1 : 0) + (actuated ? 2 : 0);
// The same in memory: a controlled robot also has L0 over the number of owners (drive.h).
inline constexpr int stored_columns = spring_columns + (controlled ? 1 : 0);
inline constexpr bool grows = has<effects::growth>;
inline constexpr int muscle_columns = muscle_columns_of(grows);
// Kinds of samples that a robot may take.
inline constexpr int taken_kinds = controlled ? sample_kinds : uncontrolled_kinds;
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

// Rigid blocks of a robot. Kernels that state no instances count none.
inline constexpr int solids = instances<effects::block> > 1 ? instances<effects::block> : 1;

// Those of all instances; the ones that may be there several times are made here.
template <class E,
          int count = effects::repeatable<E>&& effects::acts_on_masses<E> ? instances<E> : 0>
struct instance_params {
    typename E::template params<real> instance[count];
};
template <class E>
struct instance_params<E, 0> {};
template <class List>
struct all_params;
template <class... E>
struct all_params<effects::list<E...>> : mass_params<real>, instance_params<E>... {
    LIMAX_LAW explicit all_params(const mass_params<real>& single) : mass_params<real>(single) {}
    template <class F>
    LIMAX_LAW typename F::template params<real>& instance_of(int i) {
        return static_cast<instance_params<F>&>(*this).instance[i];
    }
    template <class F>
    LIMAX_LAW const typename F::template params<real>& instance_of(int i) const {
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

using launch_arguments = step_launch<real>;

// Brings the parameters relative to the robot's own origin up to date, and makes those of
// effects that may be there several times. `time` is since the muscles began, s.
LIMAX_LAW void follow_origin(scene_params& params, const scene_values& scene, const double* origin,
                             double time) {
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        if constexpr (!effects::acts_on_masses<E>) {
            return;
        } else if constexpr (effects::repeatable<E>) {
            if constexpr (instances < E >> 0) {
#pragma unroll
                for (int i = 0; i < instances<E>; ++i)
                    params.template instance_of<E>(i) = effects::make_params<E, real>(
                        scene.of(index, i), origin, scene.heights, time);
            }
        } else if constexpr (has<E>) {
            auto& own = params.template of<E>();
            if constexpr (requires { E::follow(own, nullptr, nullptr); })
                E::follow(own, scene.of(index), origin);
            if constexpr (effects::reads_heights<E>) own.table = scene.heights;
        }
    });
}

// Moves contacts to where they are at a time, s since the muscles began.
LIMAX_LAW void move_contacts([[maybe_unused]] scene_params& params,
                             [[maybe_unused]] const scene_values& scene,
                             [[maybe_unused]] const double* origin, [[maybe_unused]] double time) {
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::moves<E> && instances < E >> 0) {
#pragma unroll
            for (int i = 0; i < instances<E>; ++i)
                E::move(params.template instance_of<E>(i), scene.of(effects::index_of<E>, i),
                        origin, time);
        }
    });
}

// ---- springs ----

// A mass as its springs see it.
struct corner {
    real x, y, z;     // m
    real vx, vy, vz;  // m/s, the velocity that forces read; only if shares_velocity
};
struct force {
    real x, y, z;  // N
};

// Adds the force of one spring to the sums of its ends. `spring` brings the parameters.
LIMAX_LAW void add_spring(const corner& near, const corner& far, effects::spring_state<real> spring,
                          const effects::actuation::moment<real>& now, force& on_near,
                          force& on_far) {
    const separation<real> e{far.x - near.x, far.y - near.y, far.z - near.z};
    const distance<real> apart = spring_length(e);
    spring.length = apart.length;
    if constexpr (shares_velocity)
        spring.rate =
            dot(separation<real>{far.vx - near.vx, far.vy - near.vy, far.vz - near.vz}, e) *
            apart.inverse;
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_rest))
            spring.rest = E::rest(now, spring);
    });
    effects::spring_force<real> along;
    effects::for_each([&]<class E>(E) {
        if constexpr (controlled && same_type<E, effects::springs>)
            along = E::of_pull(spring,
                               effects::control::pull<sizeof(real) == sizeof(float)>(now, spring));
        else if constexpr (has<E> && bool(E::hooks & effects::hook_pair))
            along = E::pair(spring, along);
    });
    const real scale = fma(-apart.inverse, along.push, along.scale);
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
    real position[3], velocity[3];  // x_n; u, before the kick
    real predicted[3];              // p, what forces read; u in symplectic Euler
    real lost_position[3], lost_velocity[3];
    real mass, inverse_mass, root_mass;
};

LIMAX_LAW effects::node_state<real> node_of(const mass_state& m) {
    return {{m.position[0], m.position[1], m.position[2]},
            {m.predicted[0], m.predicted[1], m.predicted[2]},
            m.mass,
            m.inverse_mass,
            m.root_mass};
}

// The velocity after all forces on single masses at t_n over h, without friction.
// `met` is the force of masses that are not neighbours, `pushed` that of a solid.
LIMAX_LAW void kick_mass(mass_state& m, const force& springs, const effects::vector<real>& met,
                         const effects::vector<real>& pushed, const scene_params& params,
                         const scripted_moment<real>& now, real h, real next_velocity[3]) {
    using namespace effects;
    const node_state<real> node = node_of(m);
    vector<real> total{springs.x, springs.y, springs.z};
    for_each([&]<class E>(E) {
        if constexpr (pushes_masses<E>)
            each_instance<E>(params, [&](const auto& p) { add_force<E>(p, node, total); });
    });
    add_scripted_forces(node, now, total);
    if constexpr (meets) total = {total.x + met.x, total.y + met.y, total.z + met.z};
    if constexpr (has_solid) total = {total.x + pushed.x, total.y + pushed.y, total.z + pushed.z};
    const real all[3] = {total.x, total.y, total.z};
    for (int axis = 0; axis < 3; ++axis)
        next_velocity[axis] = kick<compensated>(m.velocity[axis], all[axis], m.inverse_mass, h,
                                                m.lost_velocity[axis]);
}

// The friction F at a place.
template <class F>
LIMAX_LAW typename F::template params<real> friction_at(
    const scene_params& params, [[maybe_unused]] const effects::vector<real>& place) {
    auto own = params.template of<F>();
    effects::for_each([&]<class E>(E) {
        if constexpr (bool(E::hooks & effects::hook_grip))
            each_instance<E>(params,
                             [&](const auto& p) { own = F::scaled(own, E::grip(p, place)); });
    });
    return own;
}

// Friction, last of all: what it stops stays.
LIMAX_LAW void slow_mass(const mass_state& m, const scene_params& params, real h,
                         real next_velocity[3]) {
    using namespace effects;
    const node_state<real> node = node_of(m);
    const vector<real> before{m.velocity[0], m.velocity[1], m.velocity[2]};
    vector<real> after{next_velocity[0], next_velocity[1], next_velocity[2]};
    for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & hook_slip))
            for_each([&]<class C>(C) {
                if constexpr (is_contact<C>)
                    each_instance<C>(params, [&](const auto& contact) {
                        // most masses touch nothing
                        const auto point = C::surface(contact, node.position);
                        const real push = push_at(contact, point, node);
                        if (push > real(0))
                            after =
                                slid<E>(contact, friction_at<E>(params, node.position),
                                        point.normal, push, node.inverse_mass, before, after, h);
                    });
            });
    });
    next_velocity[0] = after.x;
    next_velocity[1] = after.y;
    next_velocity[2] = after.z;
}

// The velocity after everything that acts over h where neither a law on faces nor a solid does.
LIMAX_LAW void begin_mass(mass_state& m, const force& springs, const effects::vector<real>& met,
                          const scene_params& params, const scripted_moment<real>& now, real h,
                          real next_velocity[3]) {
    kick_mass(m, springs, met, {}, params, now, h, next_velocity);
    slow_mass(m, params, h, next_velocity);
}

// Whether a mass is below the surface of any contact.
LIMAX_LAW bool touches(const mass_state& m, const scene_params& params) {
    bool found = false;
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::is_contact<E>)
            each_instance<E>(params, [&](const auto& contact) {
                const effects::vector<real> at{m.position[0], m.position[1], m.position[2]};
                found |= E::surface(contact, at).depth > real(0);
            });
    });
    return found && m.mass > real(0);
}

// On to t_n + dt with the velocity after the kick. `share` as in predict().
LIMAX_LAW void finish_mass(mass_state& m, const real next_velocity[3], real dt, real share) {
    for (int axis = 0; axis < 3; ++axis) {
        m.position[axis] =
            drift<compensated>(m.position[axis], next_velocity[axis], dt, m.lost_position[axis]);
        m.predicted[axis] =
            leapfrog ? predict(m.velocity[axis], next_velocity[axis], share) : next_velocity[axis];
        m.velocity[axis] = next_velocity[axis];
    }
}

// ---- loads and stores of a mass ----

// The position, and the velocity where springs read it; and a mass that takes them back.
LIMAX_LAW corner corner_of(const mass_state& m) {
    corner c{m.position[0], m.position[1], m.position[2]};
    if constexpr (shares_velocity) {
        c.vx = m.predicted[0];
        c.vy = m.predicted[1];
        c.vz = m.predicted[2];
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
LIMAX_LAW void load_mass(mass_state& m, real next_velocity[3], float mass, const real* state,
                         int64_t stride) {
    m.mass = real(mass);
    m.inverse_mass = m.mass > real(0) ? real(1) / m.mass : real(0);
    if constexpr (holding) m.mass = absolute(m.mass);
    m.root_mass = square_root(m.mass);
    for (int axis = 0; axis < 3; ++axis) {
        const real* column = state + axis * stride;
        m.position[axis] = column[column_position * stride];
        m.velocity[axis] = m.predicted[axis] = column[column_velocity * stride];
        next_velocity[axis] = column[column_next_velocity * stride];
        if constexpr (compensated) {
            m.lost_position[axis] = column[column_lost_position * stride];
            m.lost_velocity[axis] = column[column_lost_velocity * stride];
        }
    }
}
LIMAX_LAW void store_mass(const mass_state& m, real* state, int64_t stride) {
    for (int axis = 0; axis < 3; ++axis) {
        real* column = state + axis * stride;
        column[column_position * stride] = m.position[axis];
        column[column_velocity * stride] = m.velocity[axis];
        if constexpr (compensated) {
            column[column_lost_position * stride] = m.lost_position[axis];
            column[column_lost_velocity * stride] = m.lost_velocity[axis];
        }
    }
}
// Stores the values of a mass that a kick changes; between kick and drift the others stay.
LIMAX_LAW void store_kick(const mass_state& m, real* state, int64_t stride) {
    for (int axis = 0; axis < 3; ++axis) {
        real* column = state + axis * stride;
        column[column_next_velocity * stride] = m.velocity[axis];
        if constexpr (compensated) column[column_lost_velocity * stride] = m.lost_velocity[axis];
    }
}
LIMAX_LAW void store_next_velocity(const real next_velocity[3], real* state, int64_t stride) {
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
