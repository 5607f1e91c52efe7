// solid.h: laws of a rigid block of one robot: what it and the body's masses do to each other,
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

// A block, and what a step needs of it.
struct body {
    int32_t number;  // among the scene's blocks, from 0
    block_params law;
    vector inertia;  // kg m^2, in its own frame
    state block;
    moment at;  // and the forces: at t_n
    load on;
    motion rubbed;  // what this step's friction impulses add up to, N s and N m s
};

// Something that touches a block.
struct touch {
    int32_t site;        // of a mass; -1 of a fixed contact
    int32_t block;       // its number
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

// A block where the effect's values put it; `start` is the body's lowest corner.
LIMAX_LAW body placed(int32_t number, const double* values, const double start[3]) {
    using effects::block;
    const block_params law = block::make<double>(values, start);
    const vector inertia = inertia_of_box(law.half, law.mass);
    const double* corner = values + block::at_position;
    const double *v = values + block::at_velocity, *w = values + block::at_spin;
    const motion first{{v[0], v[1], v[2]}, {inertia.x * w[0], inertia.y * w[1], inertia.z * w[2]}};
    return {number,
            law,
            inertia,
            {{start[0] + (corner[0] + law.half.x), start[1] + (corner[1] + law.half.y),
              start[2] + (corner[2] + law.half.z)},
             {1, 0, 0, 0},
             first,
             first,
             first},
            {},
            {},
            {}};
}

// The robot's own origin has moved by `shift`.
LIMAX_LAW void follow(state& block, const double shift[3]) {
    block.place = {block.place.x - shift[0], block.place.y - shift[1], block.place.z - shift[2]};
}

// Computes what follows from the state of a block.
LIMAX_LAW void show(body& of) {
    const rotation frame = rotation_of(of.block.points);
    const rotation turns = inverse_inertia(frame, of.inertia);
    of.at = {frame, turns, to_world(turns, of.block.read.spin)};
}
LIMAX_LAW view view_of(const body& of) {
    return {of.block.place, of.block.read.velocity, of.at.frame, of.at.turning};
}

// ---- forces at t_n ----

// The velocity of a point of the block, as forces read it, m/s.
LIMAX_LAW vector read_velocity_at(const view& block, const vector& arm) {
    return plus(cross(block.turning, arm), 1.0, block.velocity);
}

// Begins the forces on a block with its weight; `gravity` in m/s^2.
LIMAX_LAW void weigh(body& of, const vector& gravity) {
    const double mass = of.law.mass;
    of.on = {{mass * gravity.x, mass * gravity.y, mass * gravity.z}, {0, 0, 0}};
}

// Adds `sign` times a force at a place to those on the block.
LIMAX_LAW void add_force(load& on, const vector& force, const vector& arm, double sign) {
    on.force = plus(on.force, sign, force);
    on.torque = plus(on.torque, sign, cross(arm, force));
}

// Whether a mass touches the block, and then how. S is the real of masses.
template <class S>
LIMAX_LAW bool meet_mass(const block_params& law, const view& block, int32_t number, int32_t site,
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
    found = {site,          number,    arm, normal, push, 0.5 * spring * point.depth,
             push - spring, {0, 0, 0}, 0};
    return true;
}
// The numbers that a mass which touches adds to its force, N.
template <class S>
LIMAX_LAW effects::vector<S> push_on_mass(const touch& at) {
    return {S(at.push * at.normal.x), S(at.push * at.normal.y), S(at.push * at.normal.z)};
}
// Adds those numbers to the sum over blocks; `begun` after the first.
template <class S>
LIMAX_LAW void add_push(effects::vector<S>& sum, const touch& at, bool& begun) {
    const effects::vector<S> push = push_on_mass<S>(at);
    sum = begun ? effects::vector<S>{sum.x + push.x, sum.y + push.y, sum.z + push.z} : push;
    begun = true;
}
// Adds the reaction on the block.
template <class S>
LIMAX_LAW void meet_back(load& on, const touch& at) {
    const effects::vector<S> force = push_on_mass<S>(at);
    add_force(on, {double(force.x), double(force.y), double(force.z)}, at.arm, -1.0);
}

// A place of the block, or of an obstacle in it, as the law of a contact sees it; `arm` leads there
// from the block's centre.
LIMAX_LAW effects::node_state<double> node_at(const body& of, const vector& arm) {
    const double share = effects::block::corner_share * of.law.mass;
    return {plus(of.block.place, 1.0, arm), read_velocity_at(view_of(of), arm), share, 1.0 / share};
}
// Adds the push of a contact at such a place, if it is below the surface, and calls keep(touch).
// `moving` is the number of contacts that move so far, this one included.
template <class E, class Params, class Direction, class Keep>
LIMAX_LAW void meet_surface(const effects::node_state<double>& node, body& of, const Params& params,
                            const effects::surface_point<double, Direction>& point,
                            const vector& arm, [[maybe_unused]] int32_t moving, const Keep& keep) {
    if (!(point.depth > 0)) return;
    vector normal{0, 0, 0};
    effects::add_push(point.normal, 1.0, normal);
    const double push = effects::push_at(params, point, node);
    add_force(of.on, {push * normal.x, push * normal.y, push * normal.z}, arm, 1.0);
    const double spring = params.stiffness * point.depth;
    keep(touch{effects::moves<E> ? -1 - moving : -1,
               of.number,
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
LIMAX_LAW void meet_contacts(body& of, const EachContact& each_contact, const Keep& keep) {
    for (int corner = 0; corner < 8; ++corner) {
        [[maybe_unused]] int32_t moving = 0;
        const vector arm = to_world(of.at.frame, {corner & 1 ? of.law.half.x : -of.law.half.x,
                                                  corner & 2 ? of.law.half.y : -of.law.half.y,
                                                  corner & 4 ? of.law.half.z : -of.law.half.z});
        const effects::node_state<double> node = node_at(of, arm);
        each_contact([&]<class E>(E, const auto& params) {
            if constexpr (effects::moves<E>) ++moving;
            meet_surface<E>(node, of, params, E::surface(params, node.position), arm, moving, keep);
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
LIMAX_LAW void kick(body& of, double h) {
    of.block.next.velocity = plus(of.block.now.velocity, h / of.law.mass, of.on.force);
    of.block.next.spin = plus(of.block.now.spin, h, of.on.torque);
    of.rubbed = {};
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

// Adds `sign` times an impulse at a place of a block.
LIMAX_LAW void add_impulse(body& to, const vector& arm, const vector& impulse, double sign) {
    const vector turn = cross(arm, impulse);
    to.block.next.velocity = plus(to.block.next.velocity, sign / to.law.mass, impulse);
    to.block.next.spin = plus(to.block.next.spin, sign, turn);
    to.rubbed = {plus(to.rubbed.velocity, sign, impulse), plus(to.rubbed.spin, sign, turn)};
}

// What touches a block as friction sees it: before(touch) is how it moved before this step's forces
// and after(touch) how it moves now, m/s; mobility(touch, way) its 1/kg along a slip, 0 of what is
// held; give(touch, impulse) gives it an impulse and returns what it took of it, N s.
template <class Before, class After, class Mobility, class Give>
struct counterpart {
    Before before;
    After after;
    Mobility mobility;
    Give give;
};
template <class Before, class After, class Mobility, class Give>
counterpart(Before, After, Mobility, Give) -> counterpart<Before, After, Mobility, Give>;

// 1/kg of the block and what touches it together, along a slip of 1 m/s.
template <class Touch, class Other>
LIMAX_LAW double mobility_along(const body& of, const Touch& at, const vector& way,
                                const Other& other) {
    const vector lever = cross(at.arm, way);
    return other.mobility(at, way) + 1.0 / of.law.mass + inner(lever, to_world(of.at.turns, lever));
}
LIMAX_LAW vector slip_of(const touch& at, const vector& relative) {
    return plus(relative, -inner(at.normal, relative), at.normal);
}

// The largest friction impulse of a contact over h, N s. It depends on the slip before the forces
// of this step: static friction holds a contact at rest, kinetic friction only stops one that
// slips, as in friction.h. Static friction also limits the step in which a contact breaks away,
// because only the sweeps show whether several contacts together hold what one of them cannot.
template <class Touch, class Other>
LIMAX_LAW double friction_limit(const friction_params& friction, const body& of, const Touch& at,
                                const Other& other, double h) {
    const double available = at.push * h, kinetic = friction.kinetic_coefficient * available;
    const vector there = velocity_at(of.at, of.block.now, at.arm);
    const vector slip = slip_of(at, minus(other.before(at), there));
    const double speed = length(slip), floor = effects::friction::at_rest;
    if (speed > floor) {
        const vector way{slip.x / speed, slip.y / speed, slip.z / speed};
        const double stops = available * mobility_along(of, at, way, other);
        if (speed > larger(rest_share * stops, floor)) return kinetic;
    }
    return larger(friction.static_coefficient * available, kinetic);
}

// The change of the friction impulse on what touches, N s: Coulomb's law for the impulse of the
// whole step.
template <class Touch, class Other>
LIMAX_LAW vector friction_impulse(const body& of, Touch& at, const Other& other) {
    const vector there = velocity_at(of.at, of.block.next, at.arm);
    const vector slip = slip_of(at, minus(other.after(at), there));
    const double squared = inner(slip, slip);
    if (!(squared > 0) || !(at.push > 0)) return {0, 0, 0};
    const double inverse = inverse_length(squared);
    const vector way{slip.x * inverse, slip.y * inverse, slip.z * inverse};
    const vector stops = plus(at.rubbed, -1.0 / mobility_along(of, at, way, other), slip);
    const double size = inner(stops, stops);  // its square
    const vector before = at.rubbed;
    at.rubbed = size <= at.limit * at.limit
                    ? stops
                    : plus({0, 0, 0}, at.limit * inverse_length(size), stops);
    return minus(at.rubbed, before);
}

// Friction of all that touches `count` blocks, after a kick of h. Each impulse depends on all
// others, so they are gone through again until none changes. each(visit) calls visit(touch,
// counterpart) for each in order, and keeps what is changed of a touch; grip(place) is the factor
// on friction there.
template <class Each, class Grip>
LIMAX_LAW void rub(const friction_params& friction, double h, body* bodies, int count,
                   const Each& each, const Grip& grip) {
    const auto body_of = [&](const touch& at) -> body& {
        return bodies[count == 1 ? 0 : at.block];
    };
    each([&](auto& at, const auto& other) {
        const body& of = body_of(at);
        at.limit =
            grip(plus(of.block.place, 1.0, at.arm)) * friction_limit(friction, of, at, other, h);
    });
    bool changes = true;
    for (int sweep = 0; changes && sweep < most_sweeps; ++sweep) {
        changes = false;
        each([&](auto& at, const auto& other) {
            body& of = body_of(at);
            const vector applied = other.give(at, friction_impulse(of, at, other));
            add_impulse(of, at.arm, applied, -1.0);
            const double least = settled * at.push * h;
            changes |= inner(applied, applied) > least * least;
        });
    }
}

// Gives a mass an impulse, N s, in its own precision, and returns what it took of it: one that is
// held takes all.
template <class S>
LIMAX_LAW vector give_mass(S& x, S& y, S& z, const vector& impulse, double mass,
                           double inverse_mass) {
    if (!(inverse_mass > 0)) return impulse;
    const auto change = [&](S& velocity, double by) {
        const S before = velocity;
        velocity = S(double(before) + by);
        return mass * (double(velocity) - double(before));
    };
    return {change(x, impulse.x * inverse_mass), change(y, impulse.y * inverse_mass),
            change(z, impulse.z * inverse_mass)};
}

// Moves a block for dt. `share` as in predict(); forces read u itself where not `predicted`.
LIMAX_LAW void drift(body& of, double dt, bool predicted, double share) {
    state& block = of.block;
    block.place = plus(block.place, dt, block.next.velocity);
    block.points = turned_freely(block.points, of.inertia, block.next.spin, dt);
    block.read = block.next;
    if (predicted)
        block.read = {ahead(block.now.velocity, block.next.velocity, share),
                      ahead(block.now.spin, block.next.spin, share)};
    block.now = block.next;
}

// ---- what is recorded ----

// The velocity of its centre, m/s, and its angular velocity, rad/s. `between`: half way between the
// velocities before and after the kick, as leapfrog has them.
LIMAX_LAW vector velocity(const body& of, bool between) {
    return middle(of.block.now.velocity, of.block.next.velocity, between);
}
LIMAX_LAW vector turning(const body& of, bool between) {
    return angular_velocity(rotation_of(of.block.points), of.inertia,
                            middle(of.block.now.spin, of.block.next.spin, between));
}

// Its centre (m, in the world; `origin` is the robot's own), the quaternion w, x, y, z, velocity
// and angular velocity: 13 numbers, of which a trace has the first ones.
inline constexpr int sample_width = 7;
LIMAX_LAW void write_state(const body& of, const double origin[3], bool between, double* out) {
    const vector v = velocity(of, between), w = turning(of, between);
    const state& block = of.block;
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
LIMAX_LAW breaks broken(const body& of, double most) {
    const double infinite = bits_as<double>(uint64_t(0x7ff) << 52);
    const vector& place = of.block.place;
    const double speed =
        length(velocity(of, false)) + length(turning(of, false)) * length(of.law.half);
    const double reach = absolute(place.x) + absolute(place.y) + absolute(place.z);
    return {!(reach < infinite) || !(speed < infinite), !(speed <= most)};
}

}  // namespace limax::solid
