// solid.h: laws of the rigid block of one robot: what it and the body's masses do to each other,
// what fixed contacts do to its corners, and its part of a step of leapfrog and symplectic Euler.
// In double for every precision. Laws; includes laws only. SI units; places from the robot's own
// origin.
//
// The block gets the opposite of each impulse on a mass, rounded as the mass stores it, at the
// place of the mass, so that momentum and angular momentum are conserved up to the rounding of the
// sums. Corners come in the order of their bits (x lowest), contacts in the order of effects::all,
// masses in that of their sites.
#pragma once

#include "physics/effects/all.h"
#include "physics/rigid_body.h"

namespace limax::solid {

using vector = effects::vector<double>;
using block_params = effects::block::params<double>;
using friction_params = effects::friction::params<double>;

struct motion {
    vector velocity, spin;  // m/s; angular momentum in the world, kg m^2/s
};

// The block between two steps.
struct state {
    vector place;            // of its centre, m
    quaternion points;       // from its own frame to the world
    motion now, next, read;  // before and after the kick, and as forces read it
};

// Quantities derived from a state at t_n.
struct moment {
    rotation frame;
    rotation turns;  // angular momentum to angular velocity
    vector turning;  // as forces read it, rad/s
};

// The same as a mass sees it.
struct view {
    vector place, velocity;  // of the centre, m, and as forces read it, m/s
    rotation frame;
    vector turning;  // rad/s
};

// The forces on the block at t_n.
struct load {
    vector force, torque;  // N, N m
};

// Something that touches the block.
struct touch {
    int32_t site;        // of a mass; -1 of a fixed contact
    vector arm, normal;  // from the block's centre, m; the way that the push acts
    double push;         // N
    double stored;       // J
    double beyond;       // the part of the push that it does not come from, N
    vector rubbed;       // friction's impulse so far on what touches, N s
    double limit;        // the most that it may be, N s
};

LIMAX_LAW vector minus(const vector& a, const vector& b) { return plus(a, -1.0, b); }
LIMAX_LAW double length(const vector& v) { return square_root(inner(v, v)); }
LIMAX_LAW vector ahead(const vector& before, const vector& after, double share) {
    return plus(after, share, minus(after, before));
}
LIMAX_LAW vector middle(const vector& before, const vector& after, bool between) {
    return between ? plus(before, 0.5, minus(after, before)) : before;
}

// Where the effect's values put the block; `start` is the body's lowest corner.
LIMAX_LAW state placed(const block_params& law, const vector& inertia, const double* values,
                       const double start[3]) {
    using effects::block;
    const double* corner = values + block::at_position;
    const double *v = values + block::at_velocity, *w = values + block::at_spin;
    const motion first{{v[0], v[1], v[2]}, {inertia.x * w[0], inertia.y * w[1], inertia.z * w[2]}};
    return {{start[0] + (corner[0] + law.half.x), start[1] + (corner[1] + law.half.y),
             start[2] + (corner[2] + law.half.z)},
            {1, 0, 0, 0},
            first,
            first,
            first};
}

// The robot's own origin has moved by `shift`.
LIMAX_LAW void follow(state& block, const double shift[3]) {
    block.place = {block.place.x - shift[0], block.place.y - shift[1], block.place.z - shift[2]};
}

LIMAX_LAW moment moment_of(const state& block, const vector& inertia) {
    const rotation frame = rotation_of(block.points);
    const rotation turns = inverse_inertia(frame, inertia);
    return {frame, turns, to_world(turns, block.read.spin)};
}
LIMAX_LAW view view_of(const state& block, const moment& at) {
    return {block.place, block.read.velocity, at.frame, at.turning};
}

// ---- forces at t_n ----

// The velocity of a point of the block, as forces read it, m/s.
LIMAX_LAW vector read_velocity_at(const view& block, const vector& arm) {
    return plus(cross(block.turning, arm), 1.0, block.velocity);
}

// Adds `sign` times a force at a place to those on the block.
LIMAX_LAW void add_force(load& on, const vector& force, const vector& arm, double sign) {
    on.force = plus(on.force, sign, force);
    on.torque = plus(on.torque, sign, cross(arm, force));
}

// Whether a mass touches the block, and then how. S is the real of masses.
template <class S>
LIMAX_LAW bool meet_mass(const block_params& law, const view& block, int32_t site,
                         const effects::vector<S>& position, const effects::vector<S>& velocity,
                         double mass, touch& found) {
    const vector arm{double(position.x) - block.place.x, double(position.y) - block.place.y,
                     double(position.z) - block.place.z};
    if (!(inner(arm, arm) < inner(law.half, law.half))) return false;
    const auto point = effects::block::solid(law, to_solid(block.frame, arm));
    if (!(point.depth > 0)) return false;
    const vector normal = to_world(block.frame, point.normal);
    const vector there = read_velocity_at(block, arm);
    const double rate =
        inner(normal, vector{velocity.x - there.x, velocity.y - there.y, velocity.z - there.z});
    const double push = effects::block::parts(law, point.depth, rate, mass);
    const double spring = law.stiffness * point.depth;
    found = {site, arm, normal, push, 0.5 * spring * point.depth, push - spring, {0, 0, 0}, 0};
    return true;
}
// The numbers that a mass which touches adds to its force, N.
template <class S>
LIMAX_LAW effects::vector<S> push_on_mass(const touch& at) {
    return {S(at.push * at.normal.x), S(at.push * at.normal.y), S(at.push * at.normal.z)};
}
// Adds the reaction on the block.
template <class S>
LIMAX_LAW void meet_back(load& on, const touch& at) {
    const effects::vector<S> force = push_on_mass<S>(at);
    add_force(on, {double(force.x), double(force.y), double(force.z)}, at.arm, -1.0);
}

// A place of the block, or of an obstacle in it, as the law of a contact sees it; `arm` leads there
// from the block's centre.
LIMAX_LAW effects::node_state<double> node_at(const block_params& law, const view& block,
                                              const vector& arm) {
    const double share = effects::block::corner_share * law.mass;
    return {plus(block.place, 1.0, arm), read_velocity_at(block, arm), share, 1.0 / share};
}
// Adds the push of a contact at such a place, if it is below the surface, and calls keep(touch).
// `moving` is the number of contacts that move so far, this one included.
template <class E, class Params, class Direction, class Keep>
LIMAX_LAW void meet_surface(const effects::node_state<double>& node, load& on, const Params& params,
                            const effects::surface_point<double, Direction>& point,
                            const vector& arm, [[maybe_unused]] int32_t moving, const Keep& keep) {
    if (!(point.depth > 0)) return;
    vector normal{0, 0, 0};
    effects::add_push(point.normal, 1.0, normal);
    const double push = effects::push_at(params, point, node);
    add_force(on, {push * normal.x, push * normal.y, push * normal.z}, arm, 1.0);
    const double spring = params.stiffness * point.depth;
    keep(touch{effects::moves<E> ? -1 - moving : -1,
               arm,
               normal,
               push,
               0.5 * spring * point.depth,
               push - spring,
               {0, 0, 0},
               0});
}

// The corners below the surfaces of fixed contacts: adds their pushes, and calls keep(touch) for
// each. each_contact(visit) calls visit(effect, params) for each instance of the scene's contacts.
template <class EachContact, class Keep>
LIMAX_LAW void meet_contacts(const block_params& law, const view& block, load& on,
                             const EachContact& each_contact, const Keep& keep) {
    for (int corner = 0; corner < 8; ++corner) {
        [[maybe_unused]] int32_t moving = 0;
        const vector arm = to_world(block.frame, {corner & 1 ? law.half.x : -law.half.x,
                                                  corner & 2 ? law.half.y : -law.half.y,
                                                  corner & 4 ? law.half.z : -law.half.z});
        const effects::node_state<double> node = node_at(law, block, arm);
        each_contact([&]<class E>(E, const auto& params) {
            if constexpr (effects::moves<E>) ++moving;
            meet_surface<E>(node, on, params, E::surface(params, node.position), arm, moving, keep);
        });
    }
}

// The velocity of the surface that a corner touches, m/s. each_contact as above.
template <class EachContact>
LIMAX_LAW vector surface_velocity(const touch& at, const EachContact& each_contact) {
    vector found{0, 0, 0};
    int32_t moving = 0;
    each_contact([&]<class E>(E, const auto& params) {
        if constexpr (effects::moves<E>)
            if (at.site == -1 - ++moving) found = params.surface_velocity;
    });
    return found;
}

// ---- after the kick ----

// The velocities after the forces have acted for h, before any friction.
LIMAX_LAW void kick(state& block, const load& on, double mass, double h) {
    block.next.velocity = plus(block.now.velocity, h / mass, on.force);
    block.next.spin = plus(block.now.spin, h, on.torque);
}

// The velocity of a point of the block, m/s.
LIMAX_LAW vector velocity_at(const moment& at, const motion& of, const vector& arm) {
    return plus(cross(to_world(at.turns, of.spin), arm), 1.0, of.velocity);
}

// The sweeps over friction impulses end when none changes by more than this share of its normal
// impulse. The remaining error lets a block creep at up to this share of g times the step, m/s. A
// block on four corners needs fewer than `most_sweeps`.
inline constexpr double settled = 1e-3;
inline constexpr int most_sweeps = 32;
// A contact is at rest if it slips by no more than this share of the speed that its normal impulse
// could stop, or by no more than at_rest of friction.h, which covers rounding. Sweeps leave each
// contact a slip of about `settled` of that speed plus parts of the others': ten times `settled` is
// more than a dozen contacts leave. It is far below mu_k times that speed, so kinetic friction also
// stops so slow a slip within the step: the share only decides whether the contact then sticks.
inline constexpr double rest_share = 10 * settled;

// 1/kg of the block and what touches it together, along a slip of 1 m/s.
LIMAX_LAW double mobility_along(const block_params& law, const moment& moment, const touch& at,
                                const vector& way, double inverse_mass) {
    const vector lever = cross(at.arm, way);
    return inverse_mass + 1.0 / law.mass + inner(lever, to_world(moment.turns, lever));
}
LIMAX_LAW vector slip_of(const touch& at, const vector& relative) {
    return plus(relative, -inner(at.normal, relative), at.normal);
}

// The largest friction impulse of a contact over h, N s. It depends on the slip before the forces
// of this step: static friction holds a contact at rest, kinetic friction only stops one that
// slips, as in friction.h. Static friction also limits the step in which a contact breaks away,
// because only the sweeps show whether several contacts together hold what one of them cannot.
LIMAX_LAW double friction_limit(const friction_params& friction, const block_params& law,
                                const moment& moment, const touch& at, const vector& before,
                                double inverse_mass, double h) {
    const double available = at.push * h, kinetic = friction.kinetic_coefficient * available;
    const vector slip = slip_of(at, before);
    const double speed = length(slip), floor = effects::friction::at_rest;
    if (speed > floor) {
        const vector way{slip.x / speed, slip.y / speed, slip.z / speed};
        const double stops = available * mobility_along(law, moment, at, way, inverse_mass);
        if (speed > larger(rest_share * stops, floor)) return kinetic;
    }
    return larger(friction.static_coefficient * available, kinetic);
}

// The change of the friction impulse on a mass or corner in contact that moves at `relative`, N s:
// Coulomb's law for the impulse of the whole step.
LIMAX_LAW vector friction_impulse(const block_params& law, const moment& moment, touch& at,
                                  const vector& relative, double inverse_mass) {
    const vector slip = slip_of(at, relative);
    const double squared = inner(slip, slip);
    if (!(squared > 0) || !(at.push > 0)) return {0, 0, 0};
    const double inverse = inverse_length(squared);
    const vector way{slip.x * inverse, slip.y * inverse, slip.z * inverse};
    const double mobility = mobility_along(law, moment, at, way, inverse_mass);
    const vector stops = plus(at.rubbed, -1.0 / mobility, slip);
    const double size = inner(stops, stops);  // its square
    const vector before = at.rubbed;
    at.rubbed = size <= at.limit * at.limit
                    ? stops
                    : plus({0, 0, 0}, at.limit * inverse_length(size), stops);
    return minus(at.rubbed, before);
}

// Friction of all that touches, after a kick of h; `rubbed`, which it adds to, is what it does to
// the block, N s and N m s. Each impulse depends on all others, so they are gone through again
// until none changes. each(visit) calls visit(touch) for each in order, and keeps what is changed;
// of what touches, before(touch) is how it moved before this step's forces and after(touch) how it
// moves now, m/s, inverse_mass(touch) 1/kg, 0 of what is held, grip(place) the factor on friction
// there, and give(touch, impulse) gives it an impulse and returns what it took of it, N s.
template <class Each, class Before, class After, class InverseMass, class Grip, class Give>
LIMAX_LAW void rub(const friction_params& friction, const block_params& law, state& block,
                   const moment& moment, double h, motion& rubbed, const Each& each,
                   const Before& before, const After& after, const InverseMass& inverse_mass,
                   const Grip& grip, const Give& give) {
    each([&](auto& at) {
        const vector there = velocity_at(moment, block.now, at.arm);
        at.limit = grip(plus(block.place, 1.0, at.arm)) * friction_limit(friction, law, moment, at,
                                                                         minus(before(at), there),
                                                                         inverse_mass(at), h);
    });
    bool changes = true;
    for (int sweep = 0; changes && sweep < most_sweeps; ++sweep) {
        changes = false;
        each([&](auto& at) {
            const double share = inverse_mass(at);
            const vector impulse = friction_impulse(
                law, moment, at, minus(after(at), velocity_at(moment, block.next, at.arm)), share);
            const vector applied = share > 0 ? give(at, impulse) : impulse;
            const vector turn = cross(at.arm, applied);
            block.next.velocity = plus(block.next.velocity, -1.0 / law.mass, applied);
            block.next.spin = plus(block.next.spin, -1.0, turn);
            rubbed = {plus(rubbed.velocity, -1.0, applied), plus(rubbed.spin, -1.0, turn)};
            const double least = settled * at.push * h;
            changes |= inner(applied, applied) > least * least;
        });
    }
}

// Gives a mass an impulse, N s, in its own precision, and returns what it took of it.
template <class S>
LIMAX_LAW vector give_mass(S& x, S& y, S& z, const vector& impulse, double mass,
                           double inverse_mass) {
    const auto change = [&](S& velocity, double by) {
        const S before = velocity;
        velocity = S(double(before) + by);
        return mass * (double(velocity) - double(before));
    };
    return {change(x, impulse.x * inverse_mass), change(y, impulse.y * inverse_mass),
            change(z, impulse.z * inverse_mass)};
}

// Moves the block for dt. `share` as in predict(); forces read u itself where not `predicted`.
LIMAX_LAW void drift(state& block, const vector& inertia, double dt, bool predicted, double share) {
    block.place = plus(block.place, dt, block.next.velocity);
    block.points = turned_freely(block.points, inertia, block.next.spin, dt);
    block.read = block.next;
    if (predicted)
        block.read = {ahead(block.now.velocity, block.next.velocity, share),
                      ahead(block.now.spin, block.next.spin, share)};
    block.now = block.next;
}

// ---- what is recorded ----

// The velocity of its centre, m/s, and its angular velocity, rad/s. `between`: half way between the
// velocities before and after the kick, as leapfrog has them.
LIMAX_LAW vector velocity(const state& block, bool between) {
    return middle(block.now.velocity, block.next.velocity, between);
}
LIMAX_LAW vector turning(const state& block, const vector& inertia, bool between) {
    return angular_velocity(rotation_of(block.points), inertia,
                            middle(block.now.spin, block.next.spin, between));
}

// Its centre (m, in the world; `origin` is the robot's own), the quaternion w, x, y, z, velocity
// and angular velocity: 13 numbers.
LIMAX_LAW void write_state(const state& block, const vector& inertia, const double origin[3],
                           bool between, double* out) {
    const vector v = velocity(block, between), w = turning(block, inertia, between);
    const quaternion& q = block.points;
    const double values[13] = {origin[0] + block.place.x,
                               origin[1] + block.place.y,
                               origin[2] + block.place.z,
                               q.w,
                               q.x,
                               q.y,
                               q.z,
                               v.x,
                               v.y,
                               v.z,
                               w.x,
                               w.y,
                               w.z};
    for (int i = 0; i < 13; ++i) out[i] = values[i];
}

// Whether its place or its speed, of its centre or a corner, is not finite; whether the speed is
// above `most`, m/s.
struct breaks {
    bool nonfinite, speed;
};
LIMAX_LAW breaks broken(const state& block, const block_params& law, const vector& inertia,
                        double most) {
    const double infinite = bits_as<double>(uint64_t(0x7ff) << 52);
    const double speed =
        length(block.now.velocity) + length(turning(block, inertia, false)) * length(law.half);
    const double reach =
        absolute(block.place.x) + absolute(block.place.y) + absolute(block.place.z);
    return {!(reach < infinite) || !(speed < infinite), !(speed <= most)};
}

}  // namespace limax::solid
