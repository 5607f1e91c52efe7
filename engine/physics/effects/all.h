// all.h: every effect there is, in the order in which their laws act within one hook. A new effect
// is a header here and a place at the end of the list, so that the bits of the others stay.
#pragma once

#include "physics/effects/actuation.h"
#include "physics/effects/anchors.h"
#include "physics/effects/block.h"
#include "physics/effects/boxes.h"
#include "physics/effects/change.h"
#include "physics/effects/contact.h"
#include "physics/effects/control.h"
#include "physics/effects/damping.h"
#include "physics/effects/drag.h"
#include "physics/effects/edges.h"
#include "physics/effects/effect.h"
#include "physics/effects/friction.h"
#include "physics/effects/gravity.h"
#include "physics/effects/ground.h"
#include "physics/effects/moving.h"
#include "physics/effects/patches.h"
#include "physics/effects/planes.h"
#include "physics/effects/self_collision.h"
#include "physics/effects/spheres.h"
#include "physics/effects/springs.h"
#include "physics/effects/terrain.h"
#include "physics/effects/wind.h"

namespace limax::effects {

template <class... E>
struct list {
    static constexpr int count = sizeof...(E);
};

using all = list<springs, damping, actuation, gravity, ground, friction, wind, planes, spheres,
                 boxes, anchors, terrain, drag, self_collision, block, control, target, patches,
                 moving_boxes, moving_spheres, damage, growth, edges>;

// Place of an effect in the list: its bit in a scene.
template <class E, class... L>
LIMAX_LAW constexpr int index_in(list<L...>) {
    int index = 0, found = -1;
    ((found = same_type<E, L> ? index : found, ++index), ...);
    return found;
}
template <class E>
inline constexpr int index_of = index_in<E>(all{});

template <class E>
inline constexpr unsigned bit = 1u << index_of<E>;

// Effects that move the muscles, of which a scene has one at most.
inline constexpr unsigned muscle_bits = bit<actuation> | bit<control>;

// Whether an effect has laws on masses, and so parameters for them.
template <class E>
inline constexpr bool acts_on_masses = (E::hooks & (hook_node | hook_contact | hook_slip |
                                                    hook_face | hook_grip)) != 0;

// Whether an effect reads a scene's table of heights.
template <class E>
inline constexpr bool reads_heights = requires(typename E::template params<float> p) {
    p.table;
};

// Whether the surface of a contact moves.
template <class E>
inline constexpr bool moves = requires(typename E::template params<float> p) {
    E::move(p, nullptr, nullptr, 0.0);
};

// Parameters of an effect for a robot whose own origin is `origin`, with the table that it may
// read, at a time, s since the muscles began; before that if it is left out.
template <class E, class R>
LIMAX_LAW typename E::template params<R> make_params(const double* values, const double* origin,
                                                     const height_table& heights,
                                                     double time = -1.0) {
    auto params = E::template make<R>(values, origin);
    if constexpr (moves<E>) E::move(params, values, origin, time);
    if constexpr (reads_heights<E>) params.table = heights;
    return params;
}

// Bits of the effects that have one of these hooks.
template <class... E>
LIMAX_LAW constexpr unsigned bits_with(list<E...>, unsigned hooks) {
    return ((E::hooks & hooks ? bit<E> : 0u) | ... | 0u);
}
inline constexpr unsigned contact_bits = bits_with(all{}, hook_contact);
inline constexpr unsigned face_bits = bits_with(all{}, hook_face);
inline constexpr unsigned meeting_bits = bits_with(all{}, hook_meet);
inline constexpr unsigned solid_bits = bits_with(all{}, hook_solid);
inline constexpr unsigned grip_bits = bits_with(all{}, hook_grip);
// Contacts whose surface moves, and effects that a controller's tick takes into account.
inline constexpr unsigned motion_bits = bit<moving_boxes> | bit<moving_spheres>;
inline constexpr unsigned change_bits = bit<damage> | bit<growth>;

// How many instances of an effect a scene may have; one if it does not state it.
template <class E>
LIMAX_LAW constexpr int find_most_instances() {
    if constexpr (requires { E::most_instances; })
        return E::most_instances;
    else
        return 1;
}
template <class E>
inline constexpr int most_instances = find_most_instances<E>();
template <class E>
inline constexpr bool repeatable = most_instances<E> != 1;

// Whether instances stay in the order of adding.
template <class E>
inline constexpr bool keeps_order = requires {
    E::keeps_order;
};

// Components of all fields of an effect.
template <class E>
LIMAX_LAW constexpr int count_components() {
    int count = 0;
    for (int f = 0; f < E::field_count; ++f) count += E::fields[f].components;
    return count;
}
template <class E>
inline constexpr int components = count_components<E>();

// Calls visit(E{}) for each effect in order.
template <class Visit, class... E>
LIMAX_LAW constexpr void for_each(list<E...>, const Visit& visit) {
    (visit(E{}), ...);
}
template <class Visit>
LIMAX_LAW constexpr void for_each(const Visit& visit) {
    for_each(all{}, visit);
}

#if !defined(__CUDACC_RTC__)
// ---- the contract, checked at compile time ----

template <class E>
constexpr bool hooks_match() {
    constexpr bool has_rest = requires(spring_state<float> s) { E::rest({}, s); };
    constexpr bool has_pair = requires(spring_state<float> s) {
        E::pair(s, spring_force<float>{});
    };
    constexpr bool has_node = requires(node_state<float> s, vector<float> f) {
        E::node(E::template make<float>(nullptr, nullptr), s, f);
    };
    // a contact also has what its push follows from
    constexpr bool has_contact = requires(vector<float> x) {
        E::surface(E::template make<float>(nullptr, nullptr), x).depth > 0.0f;
        E::template make<float>(nullptr, nullptr).stiffness;
        E::template make<float>(nullptr, nullptr).damping;
    };
    constexpr bool has_slip = requires(vector<float> v) {
        E::slip(E::template make<float>(nullptr, nullptr), up{}, 0.0f, 0.0f, v, v, 0.0f);
        E::slip(E::template make<float>(nullptr, nullptr), v, 0.0f, 0.0f, v, v, 0.0f);
    };
    constexpr bool has_face = requires(face_state<float> s) {
        E::face(E::template make<float>(nullptr, nullptr), s, 0.0f);
    };
    constexpr bool has_energy = requires(spring_state<double> s) { E::energy(s); }
    || requires(node_state<double> s) { E::energy(E::template make<double>(nullptr, nullptr), s); };
    constexpr bool has_bound = requires { E::bound(1.0, 1.0); }
    || requires { E::bound(E::template make<double>(nullptr, nullptr), 1.0); };
    constexpr bool has_hold = requires(vector<double> x) {
        bool(E::holds(E::template make<double>(nullptr, nullptr), x));
    };
    constexpr bool has_meet = requires(pair_state<float> s) {
        E::meet(E::template make<float>(nullptr, nullptr), s);
        E::stored(E::template make<float>(nullptr, nullptr), s);
        E::template make<float>(nullptr, nullptr).reach;
    };
    constexpr bool has_solid = requires(vector<float> x) {
        E::solid(E::template make<float>(nullptr, nullptr), x).depth > 0.0f;
        E::parts(E::template make<float>(nullptr, nullptr), 0.0f, 0.0f, 0.0f);
    };
    constexpr bool has_grip = requires(vector<float> x) {
        E::grip(E::template make<float>(nullptr, nullptr), x) > 0.0f;
    };
    constexpr unsigned found = has_rest * hook_rest | has_pair * hook_pair | has_node * hook_node |
                               has_energy * hook_energy | has_bound * hook_bound |
                               has_contact * hook_contact | has_slip * hook_slip |
                               has_hold * hook_hold | has_face * hook_face | has_meet * hook_meet |
                               has_solid * hook_solid | has_grip * hook_grip;
    return found == E::hooks;
}

// A struct, so that the compiler's message names the effect.
template <class E>
struct checked {
    static_assert(hooks_match<E>(),
                  "this effect declares a hook without its law (a contact's params also have "
                  "stiffness and damping), or has a law that it does not declare");
    static_assert(E::field_count == 0 || sizeof(E::fields) == E::field_count * sizeof(field),
                  "this effect's field_count is not the number of its fields");
};
template <class... E>
constexpr bool all_checked(list<E...>) {
    return ((sizeof(checked<E>) > 0) && ...);
}
static_assert(all_checked(all{}));
#endif

}  // namespace limax::effects
