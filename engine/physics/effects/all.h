// all.h: every effect there is, in the order in which their laws act. A new effect is a header and
// a line here.
#pragma once

#include "physics/effects/actuation.h"
#include "physics/effects/damping.h"
#include "physics/effects/effect.h"
#include "physics/effects/friction.h"
#include "physics/effects/gravity.h"
#include "physics/effects/ground.h"
#include "physics/effects/springs.h"

namespace limax::effects {

template <class... E>
struct list {
    static constexpr int count = sizeof...(E);
};

using all = list<springs, damping, actuation, gravity, ground, friction>;

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
    constexpr bool has_pair = requires(spring_state<float> s) { E::pair(s, 0.0f); };
    constexpr bool has_node = requires(node_state<float> s, node_force<float> f) {
        E::node(E::template make<float>(nullptr, nullptr), s, f);
    };
    // an impulse also says where it acts
    constexpr bool has_impulse = requires(node_state<float> s, vector<float> v) {
        bool(E::in_contact_only);
        E::impulse(E::template make<float>(nullptr, nullptr), s, v, 0.0f, 0.0f);
    };
    constexpr bool has_energy = requires(spring_state<double> s) { E::energy(s); }
    || requires(node_state<double> s) { E::energy(E::template make<double>(nullptr, nullptr), s); };
    constexpr bool has_bound = requires { E::bound(1.0, 1.0); }
    || requires { E::bound(E::template make<double>(nullptr, nullptr), 1.0); };
    constexpr unsigned found = has_rest * hook_rest | has_pair * hook_pair | has_node * hook_node |
                               has_impulse * hook_impulse | has_energy * hook_energy |
                               has_bound * hook_bound;
    return found == E::hooks && found != 0;
}

template <class... E>
constexpr bool all_hooks_match(list<E...>) {
    return (hooks_match<E>() && ...);
}
static_assert(all_hooks_match(all{}),
              "an effect declares a hook without its law (an impulse also needs in_contact_only), "
              "or has a law that it does not declare");
#endif

}  // namespace limax::effects
