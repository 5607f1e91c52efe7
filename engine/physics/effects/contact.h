// contact.h: laws shared by all contacts: force, energy and bound of a mass as functions of its
// depth below a surface, and sliding along a surface. SI units.
//
// A mass at depth d > 0 below a surface is pushed along the surface's unit normal n by
//     N = max(0, k d - c v.n),   c = 2 zeta sqrt(k m):
// a linear penalty with a dashpot that never pulls (a Kelvin-Voigt contact, cut off at 0).
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

// The two parameters that every contact has, by these names in its params.
inline constexpr field contact_stiffness = {"stiffness", "N/m", "of each contact", 1,
                                            1.0,         1e9,   {1e5, 0, 0}};
inline constexpr field contact_damping_ratio = {
    "damping_ratio", "1", "of each contact", 1, 0.0, 2.0, {0.1, 0, 0}};

// The normal of a surface that faces up: along +z. What is done along it or across it takes no
// arithmetic on x and y.
struct up {};

template <class E>
inline constexpr bool is_contact = (E::hooks & hook_contact) != 0;
// Whether an effect adds to the forces on masses.
template <class E>
inline constexpr bool pushes_masses = (E::hooks & (hook_node | hook_contact)) != 0;

// The position of a mass relative to a surface. Direction is `up` or vector<R>.
template <class R, class Direction>
struct surface_point {
    R depth;           // m; above 0 it touches
    Direction normal;  // out of the surface
};

template <class R>
LIMAX_LAW R dot(const vector<R>& a, const vector<R>& b) {
    return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

// The part of a velocity along a normal.
template <class R>
LIMAX_LAW R along(up, const vector<R>& v) {
    return v.z;
}
template <class R>
LIMAX_LAW R along(const vector<R>& normal, const vector<R>& v) {
    return dot(normal, v);
}

// The part of a velocity across a normal.
template <class R>
LIMAX_LAW vector<R> across(up, const vector<R>& v) {
    return {v.x, v.y, R(0)};
}
template <class R>
LIMAX_LAW vector<R> across(const vector<R>& normal, const vector<R>& v) {
    const R out = dot(normal, v);
    return {fma(-out, normal.x, v.x), fma(-out, normal.y, v.y), fma(-out, normal.z, v.z)};
}
// The square of such a part, and `least` besides.
template <class R>
LIMAX_LAW R square_across(up, const vector<R>& slip, R least) {
    return fma(slip.x, slip.x, fma(slip.y, slip.y, least));
}
template <class R>
LIMAX_LAW R square_across(const vector<R>& /*normal*/, const vector<R>& slip, R least) {
    return fma(slip.x, slip.x, fma(slip.y, slip.y, fma(slip.z, slip.z, least)));
}
// The product of a velocity's part across a normal with such a part.
template <class R>
LIMAX_LAW R product_across(up, const vector<R>& v, const vector<R>& slip) {
    return fma(v.x, slip.x, v.y * slip.y);
}
template <class R>
LIMAX_LAW R product_across(const vector<R>& /*normal*/, const vector<R>& v, const vector<R>& slip) {
    return dot(v, slip);
}
// A velocity with `kept` (0 to 1) of its part across a normal left; itself, bit for bit, where all
// of that is kept.
template <class R>
LIMAX_LAW vector<R> slowed_across(up, const vector<R>& v, const vector<R>& /*slip*/, R kept) {
    return {v.x * kept, v.y * kept, v.z};
}
template <class R>
LIMAX_LAW vector<R> slowed_across(const vector<R>& /*normal*/, const vector<R>& v,
                                  const vector<R>& slip, R kept) {
    const R change = kept - R(1);
    return {fma(change, slip.x, v.x), fma(change, slip.y, v.y), fma(change, slip.z, v.z)};
}

// Adds a push along a normal to a force.
template <class R>
LIMAX_LAW void add_push(up, R push, vector<R>& force) {
    force.z += push;
}
template <class R>
LIMAX_LAW void add_push(const vector<R>& normal, R push, vector<R>& force) {
    force.x = fma(push, normal.x, force.x);
    force.y = fma(push, normal.y, force.y);
    force.z = fma(push, normal.z, force.z);
}

// c of a mass of 1 kg, N s/m: that of a mass m is sqrt(m) times as large.
LIMAX_LAW double unit_damping(double stiffness, double damping_ratio) {
    return 2.0 * damping_ratio * square_root(stiffness);
}

// A velocity relative to the surface of a contact with parameters `p`, and back in the world.
template <class P, class R>
LIMAX_LAW vector<R> relative_to(const P& p, const vector<R>& v) {
    if constexpr (requires { p.surface_velocity; })
        return {v.x - p.surface_velocity.x, v.y - p.surface_velocity.y, v.z - p.surface_velocity.z};
    else
        return v;
}
template <class P, class R>
LIMAX_LAW vector<R> in_world(const P& p, const vector<R>& v) {
    if constexpr (requires { p.surface_velocity; })
        return {v.x + p.surface_velocity.x, v.y + p.surface_velocity.y, v.z + p.surface_velocity.z};
    else
        return v;
}

// N of a mass at a point of the surface of a contact with parameters `p`; 0 where it does not
// touch.
template <class P, class R, class Direction>
LIMAX_LAW R push_at(const P& p, const surface_point<R, Direction>& point, const node_state<R>& s) {
    const R damping = p.damping * s.root_mass;
    const R push = larger(
        fma(p.stiffness, point.depth, -(damping * along(point.normal, relative_to(p, s.velocity)))),
        R(0));
    return point.depth > R(0) ? push : R(0);
}

// k d^2 / 2 while d > 0, J.
template <class E, class R>
LIMAX_LAW R contact_energy(const typename E::template params<R>& p, const node_state<R>& s) {
    const R d = E::surface(p, s.position).depth;
    return d > R(0) && s.mass > R(0) ? R(0.5) * p.stiffness * d * d : R(0);
}

// Energy that an effect stores in a mass, J.
template <class E>
inline constexpr bool stores_energy_on_masses = is_contact<E> || ((E::hooks & hook_node) != 0 &&
                                                                  (E::hooks & hook_energy) != 0);
template <class E, class R>
LIMAX_LAW R energy_of_mass(const typename E::template params<R>& p, const node_state<R>& s) {
    if constexpr (is_contact<E>)
        return contact_energy<E>(p, s);
    else
        return E::energy(p, s);
}

// Any mass may come to touch a surface. Its force has the gradient k n n^T and the damping c n n^T,
// whose norms are k and c whatever n is.
template <class P>
LIMAX_LAW stiffness_damping contact_bound(const P& p, double mass) {
    return {p.stiffness, p.damping * square_root(mass)};
}

// Adds the force of an effect on one mass.
template <class E, class R>
LIMAX_LAW void add_force(const typename E::template params<R>& p, const node_state<R>& s,
                         vector<R>& force) {
    if constexpr (bool(E::hooks & hook_node)) E::node(p, s, force);
    if constexpr (is_contact<E>) {
        const auto point = E::surface(p, s.position);
        add_push(point.normal, push_at(p, point, s), force);
    }
}

// The velocity after the friction F of a contact has acted for h on a mass that it pushes.
template <class F, class P, class R, class Direction>
LIMAX_LAW vector<R> slid(const P& contact, const typename F::template params<R>& friction,
                         const Direction& normal, R push, R inverse_mass, const vector<R>& before,
                         const vector<R>& velocity, R h) {
    const vector<R> after =
        in_world(contact, F::slip(friction, normal, push, inverse_mass,
                                  relative_to(contact, before), relative_to(contact, velocity), h));
    if constexpr (requires { contact.surface_velocity; })
        return push > R(0) ? after : velocity;
    else
        return after;
}

// The velocity after the friction F of a contact E has acted for h; `before`, before this step.
template <class E, class F, class R>
LIMAX_LAW vector<R> after_friction(const typename E::template params<R>& contact,
                                   const typename F::template params<R>& friction,
                                   const node_state<R>& s, const vector<R>& before,
                                   const vector<R>& velocity, R h) {
    const auto point = E::surface(contact, s.position);
    return slid<F>(contact, friction, point.normal, push_at(contact, point, s), s.inverse_mass,
                   before, velocity, h);
}

}  // namespace limax::effects
