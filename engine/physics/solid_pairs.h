// solid_pairs.h: contacts of the rigid blocks of one robot with each other, and all that they do in
// a step besides their contacts with masses. The corners of a block, the guest, in another, its
// host, and the ends of the parts of its edges there, are places that the host pushes out by
//     N = max(0, k d - c w.n),   c = 2 zeta sqrt(k m),
// w the velocity of the place relative to the host's there, k and zeta those of the softer block
// (of equals the first), m the reduced mass of what a corner carries of both; the host gets the
// opposite at the same place. All leave through one face f of the host: that below which the
// deepest of them is least deep. A corner has its depth d and normal n; an end on another face has
// the distance from the edge that the two faces share, along the normal n of both edges, so that
// pushes without c have an energy. Each block is the other's host in turn. With a face for each
// place, as masses have it, blocks of equal size would push each other sideways where their edges
// coincide. In double; laws only. SI units; places from the robot's own origin.
#pragma once

#include "physics/solid_edges.h"

namespace limax::solid {

// How large a host is for its guests, of its size: blocks whose sides are flush rest on each
// other's corners, whatever the last bit.
inline constexpr double size_of_host = 1.001;
// Places of two blocks in each other: corners, and two ends of the part of each edge, of both.
inline constexpr int most_of_pair = 2 * (8 + 2 * 12);

// A place of a guest in its host, which is the block of the touch.
struct pair_touch : touch {
    int32_t guest;
    vector guest_arm;  // from the guest's centre, m
};

// The stiffness of a contact of two blocks, N/m, and its damping, N s/m.
LIMAX_LAW effects::stiffness_damping contact_of_pair(const block_params& first,
                                                     const block_params& second) {
    const block_params& soft = second.stiffness < first.stiffness ? second : first;
    const double mass =
        effects::block::corner_share * first.mass * second.mass / (first.mass + second.mass);
    return {soft.stiffness, soft.damping * square_root(mass)};
}

// Calls visit(arm, at, along) for each place of a guest in a host: from the guest's centre, in the
// world; in the host's own frame; and there the edge of which it is an end, or 0.
template <class Visit>
LIMAX_LAW void each_place_in(const body& guest, const body& host, const Visit& visit) {
    const vector away = minus(guest.block.place, host.block.place);
    const vector half = plus({0, 0, 0}, size_of_host, host.law.half);
    const auto arm_of = [&](int corner) {
        return to_world(guest.at.frame, corner_of(guest.law.half, corner));
    };
    const auto inside = [&](const vector& arm) {
        return to_solid(host.at.frame, plus(away, 1.0, arm));
    };
    for (int corner = 0; corner < 8; ++corner) {
        const vector arm = arm_of(corner), at = inside(arm);
        if (absolute(at.x) <= half.x && absolute(at.y) <= half.y && absolute(at.z) <= half.z)
            visit(arm, at, vector{0, 0, 0});
    }
    each_edge([&](int first, int second) {
        const vector arm = arm_of(first), edge = minus(arm_of(second), arm), from = inside(arm),
                     to = inside(arm_of(second)), along = minus(to, from);
        const crossing part = crossing_of(from, to, half);
        if (!(part.enter < part.leave)) return;
        const auto visit_end = [&](double share) {
            visit(plus(arm, share, edge), plus(from, share, along), along);
        };
        if (part.enter > 0.0) visit_end(part.enter);
        if (part.leave < 1.0) visit_end(part.leave);
    });
}

// Adds the pushes of a host on its guest, and calls keep(touch) for each.
template <class Keep>
LIMAX_LAW void push_guest(body& guest, body& host, const effects::stiffness_damping& contact,
                          const Keep& keep) {
    const vector& half = host.law.half;
    const auto face_of = [](int number) {  // -x, +x, -y, ...
        const double out = number & 1 ? 1.0 : -1.0;
        return vector{number < 2 ? out : 0.0, number == 2 || number == 3 ? out : 0.0,
                      number > 3 ? out : 0.0};
    };
    const auto depth_below = [&](const vector& face, const vector& at) {
        return inner(face,
                     {face.x * half.x - at.x, face.y * half.y - at.y, face.z * half.z - at.z});
    };
    double deepest[6] = {};
    each_place_in(guest, host, [&](const vector&, const vector& at, const vector&) {
        for (int i = 0; i < 6; ++i) deepest[i] = larger(deepest[i], depth_below(face_of(i), at));
    });
    int least = 5;  // of equals the upper one
    for (int i = 4; i >= 0; --i)
        if (deepest[i] < deepest[least]) least = i;
    if (!(deepest[least] > 0.0)) return;
    const vector face = face_of(least), away = minus(guest.block.place, host.block.place);
    each_place_in(guest, host, [&](const vector& arm, const vector& at, const vector& along) {
        double depth = depth_below(face, at);
        if (!(depth > 0.0)) return;
        vector own = face;
        if (inner(along, along) > 0.0) {
            const vector side =
                effects::nearest_face(plus({0, 0, 0}, size_of_host, half), at).normal;
            own = plus(face, -inner(face, along) / inner(side, along), side);
            const double inverse = inverse_length(inner(own, own));
            own = {own.x * inverse, own.y * inverse, own.z * inverse};
            depth *= inverse;
        }
        const vector normal = to_world(host.at.frame, own), host_arm = plus(away, 1.0, arm);
        const double rate = inner(normal, minus(read_velocity_at(view_of(guest), arm),
                                                read_velocity_at(view_of(host), host_arm)));
        const double spring = contact.stiffness * depth;
        const double push = larger(spring - contact.damping * rate, 0.0);
        const vector force{push * normal.x, push * normal.y, push * normal.z};
        add_force(guest.on, force, arm, 1.0);
        add_force(host.on, force, host_arm, -1.0);
        keep(pair_touch{{-1,
                         host.number,
                         host_arm,
                         normal,
                         push,
                         0.5 * spring * depth,
                         push - spring,
                         {0, 0, 0},
                         0},
                        guest.number,
                        arm});
    });
}

// The contacts of two blocks.
template <class Keep>
LIMAX_LAW void meet_pair(body& first, body& second, const Keep& keep) {
    const vector away = minus(second.block.place, first.block.place);
    const double reach = size_of_host * (length(first.law.half) + length(second.law.half));
    if (!(inner(away, away) < reach * reach)) return;
    const effects::stiffness_damping contact = contact_of_pair(first.law, second.law);
    push_guest(second, first, contact, keep);
    push_guest(first, second, contact, keep);
}

// Adds the forces of fixed contacts, and of edges `with_edges`, on the blocks and of the blocks on
// each other, and calls keep(touch) for each. each_contact as in meet_contacts().
template <bool with_edges, class EachContact, class Keep>
LIMAX_LAW void meet_all(body* bodies, int count, const EachContact& each_contact,
                        const Keep& keep) {
    for (int i = 0; i < count; ++i) {
        meet_contacts(bodies[i], each_contact, keep);
        if constexpr (with_edges) meet_edges(bodies[i], each_contact, keep);
    }
    for (int i = 0; i < count; ++i)
        for (int j = i + 1; j < count; ++j) meet_pair(bodies[i], bodies[j], keep);
}

// Friction of the blocks with fixed contacts and with each other. surface(touch) is the velocity of
// what a corner touches, m/s; grip as in rub().
template <class Surface, class Grip>
LIMAX_LAW void rub_all(const friction_params& friction, double h, body* bodies, int count,
                       touch* corners, int standing, pair_touch* pairs, int met,
                       const Surface& surface, const Grip& grip) {
    const counterpart fixed{surface, surface, [](const touch&, const vector&) { return 0.0; },
                            [](const touch&, const vector& impulse) { return impulse; }};
    const auto velocity_of = [&](const pair_touch& at, const motion& of) {
        return velocity_at(bodies[at.guest].at, of, at.guest_arm);
    };
    const counterpart guests{
        [&](const pair_touch& at) { return velocity_of(at, bodies[at.guest].block.now); },
        [&](const pair_touch& at) { return velocity_of(at, bodies[at.guest].block.next); },
        [&](const pair_touch& at, const vector& way) {
            const body& of = bodies[at.guest];
            const vector lever = cross(at.guest_arm, way);
            return 1.0 / of.law.mass + inner(lever, to_world(of.at.turns, lever));
        },
        [&](const pair_touch& at, const vector& impulse) {
            add_impulse(bodies[at.guest], at.guest_arm, impulse, 1.0);
            return impulse;
        }};
    rub(
        friction, h, bodies, count,
        [&](const auto& visit) {
            for (int i = 0; i < standing; ++i) visit(corners[i], fixed);
            if (count == 1) return;
            for (int i = 0; i < met; ++i) visit(pairs[i], guests);
        },
        grip);
}

}  // namespace limax::solid
