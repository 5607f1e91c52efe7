// rigid_block.h: the rigid block of one robot: its state, what it and the body's masses do to each
// other, what fixed contacts do to its corners, and its part of a step of leapfrog and symplectic
// Euler. In double for every precision. SI units; places from the robot's own origin.
//
// What a mass gets from the block, rounded as the mass holds it, the block gets with the other
// sign, at the mass's place, so that momentum and angular momentum lose nothing but the roundings
// of the sums. Corners come in the order of their bits (x lowest), contacts in the order of
// effects::all, masses in that of their sites.
#pragma once

#include <cstring>
#include <utility>
#include <vector>

#include "backend/cpu/passes.h"
#include "limax.h"
#include "physics/rigid_body.h"
#include "physics/scene.h"

namespace limax::cpu {

template <class S>
class rigid_block {
public:
    using vector = effects::vector<double>;

    // Puts the block where it starts; `start` is the body's lowest corner. The fixed contacts
    // come with the first follow().
    rigid_block(const scene& in, const spring_body& body, const double start[3])
        : scene_(in),
          body_(body),
          law_(effects::block::make<double>(in.values(effects::index_of<effects::block>), start)),
          inertia_(inertia_of_box(law_.half, law_.mass)) {
        const double* values = in.values(effects::index_of<effects::block>);
        const double* corner = values + effects::block::at_position;
        place_ = {start[0] + (corner[0] + law_.half.x), start[1] + (corner[1] + law_.half.y),
                  start[2] + (corner[2] + law_.half.z)};
        const double *v = values + effects::block::at_velocity,
                     *w = values + effects::block::at_spin;
        now_ = {{v[0], v[1], v[2]}, {inertia_.x * w[0], inertia_.y * w[1], inertia_.z * w[2]}};
        next_ = read_ = now_;
        if (in.has(effects::index_of<effects::gravity>)) {
            const double* g = in.values(effects::index_of<effects::gravity>);
            gravity_ = {g[0], g[1], g[2]};
        }
        effects::for_each([&]<class E>(E) {
            if constexpr (effects::is_contact<E>)
                for (int i = 0; i < in.instances(effects::index_of<E>); ++i)
                    contacts_.push_back({effects::index_of<E>, i, {}});
        });
        if (in.has(effects::index_of<effects::friction>)) {
            rubs_ = true;
            friction_ = effects::friction::make<double>(
                in.values(effects::index_of<effects::friction>), start);
        }
    }

    // The robot's own origin has moved by `shift` and lies at `origin`.
    void follow(const double origin[3], const double shift[3]) {
        place_ = {place_.x - shift[0], place_.y - shift[1], place_.z - shift[2]};
        for (fixed_contact& contact : contacts_)
            visit(contact, [&]<class E>(E, auto& params) {
                params = effects::make_params<E, double>(
                    scene_.values(contact.index, contact.instance), origin, scene_.heights());
                std::memcpy(contact.params, &params, sizeof params);
            });
    }

    // Adds to the forces on the masses, which lie and move as `seen` says, and finds those on the
    // block.
    void evaluate(const mass_arrays<S>& seen) {
        frame_ = rotation_of(points_);
        turns_ = inverse_inertia(frame_, inertia_);
        turning_ = to_world(turns_, read_.spin);
        force_ = {law_.mass * gravity_.x, law_.mass * gravity_.y, law_.mass * gravity_.z};
        torque_ = {0, 0, 0};
        meet_masses(seen);
        meet_contacts();
    }

    // The velocities after the forces have acted for h, before any friction.
    void kick(double h) {
        kick_ = h;
        rubbed_ = {{0, 0, 0}, {0, 0, 0}};
        next_.velocity = plus(now_.velocity, h / law_.mass, force_);
        next_.spin = plus(now_.spin, h, torque_);
    }

    // Friction between the block and the masses, after their kick of h.
    void rub_masses(const mass_arrays<S>& masses, double h) {
        rub(masses_, h, [&](touch& at) {
            const vector u{masses.next_velocity[0][at.site], masses.next_velocity[1][at.site],
                           masses.next_velocity[2][at.site]};
            const double inverse_mass = masses.inverse_mass[at.site];
            const vector impulse =
                friction_impulse(at, minus(u, velocity_at(at.arm)), inverse_mass, h);
            if (!(inverse_mass > 0)) return impulse;
            // what the mass gets in its own precision
            const double mass = body_.mass[at.site];
            return vector{mass * change(masses, 0, at.site, impulse.x * inverse_mass),
                          mass * change(masses, 1, at.site, impulse.y * inverse_mass),
                          mass * change(masses, 2, at.site, impulse.z * inverse_mass)};
        });
    }

    // Friction between the corners and what they stand on.
    void rub_contacts(double h) {
        rub(corners_, h, [&](touch& at) {
            return friction_impulse(at, minus({0, 0, 0}, velocity_at(at.arm)), 0.0, h);
        });
    }

    // Moves the block for dt. `share` as in predict(); forces read u itself where not `predicted`.
    void drift(double dt, bool predicted, double share) {
        place_ = plus(place_, dt, next_.velocity);
        points_ = turned_freely(points_, inertia_, next_.spin, dt);
        read_ = next_;
        if (predicted)
            read_ = {ahead(now_.velocity, next_.velocity, share),
                     ahead(now_.spin, next_.spin, share)};
        now_ = next_;
    }

    // ---- its part of the books, at t_n ----

    // Of its motion, as velocity() has it, J.
    double kinetic_energy(bool between) const {
        const vector v = velocity(between), w = turning(between),
                     spin = middle(now_.spin, next_.spin, between);
        return 0.5 * (law_.mass * inner(v, v) + inner(w, spin));
    }
    // From the world's origin, J; `origin` is the robot's own.
    double gravitational_energy(const double origin[3]) const {
        return -law_.mass * inner(gravity_, plus(place_, 1.0, {origin[0], origin[1], origin[2]}));
    }
    // Stored in what touches it, J.
    double contact_energy() const {
        double sum = 0;
        for (const touch& at : masses_) sum += at.stored;
        for (const touch& at : corners_) sum += at.stored;
        return sum;
    }
    // What contacts do beyond that, to masses that move at `velocity` and to the block, W.
    double contact_power(const S* const velocity[3], bool between) const {
        const vector v = this->velocity(between), w = turning(between);
        double sum = 0;
        for (const touch& at : masses_) {
            const vector u{velocity[0][at.site], velocity[1][at.site], velocity[2][at.site]};
            sum += at.beyond * inner(at.normal, minus(u, plus(cross(w, at.arm), 1.0, v)));
        }
        for (const touch& at : corners_)
            sum += at.beyond * inner(at.normal, plus(cross(w, at.arm), 1.0, v));
        return sum;
    }
    // What friction's impulses of this step do to the block, as a force over the kick at the mean
    // of the velocities before and after it, W.
    double friction_power() const {
        return (inner(rubbed_.velocity, velocity(true)) + inner(rubbed_.spin, turning(true))) /
               kick_;
    }

    // Which limit is broken: LIMAX_NOT_DIVERGED, LIMAX_NONFINITE or LIMAX_SPEED, of its centre or
    // of a corner.
    limax_divergence broken(double max_speed) const {
        const vector turning = angular_velocity(rotation_of(points_), inertia_, now_.spin);
        const double speed = length(now_.velocity) + length(turning) * length(law_.half);
        const double reach = absolute(place_.x) + absolute(place_.y) + absolute(place_.z);
        if (!(reach < HUGE_VAL) || !(speed < HUGE_VAL)) return LIMAX_NONFINITE;
        return speed <= max_speed ? LIMAX_NOT_DIVERGED : LIMAX_SPEED;
    }

    const vector& place() const { return place_; }  // of its centre
    const quaternion& points() const { return points_; }
    // Of its centre, m/s, and angular velocity, rad/s. `between`: half way between the velocities
    // before and after the kick, as leapfrog has them.
    vector velocity(bool between) const { return middle(now_.velocity, next_.velocity, between); }
    vector turning(bool between) const {
        return angular_velocity(rotation_of(points_), inertia_,
                                middle(now_.spin, next_.spin, between));
    }

private:
    // Friction has settled where no impulse changes by more than this share of its push over the
    // kick: what is left lets a block creep by that share of g times the step, in m/s. A block on
    // four corners takes fewer sweeps than the most.
    static constexpr double settled = 1e-3;
    static constexpr int most_sweeps = 32;

    struct motion {
        vector velocity, spin;  // m/s; angular momentum in the world, kg m^2/s
    };
    // Something that touches the block.
    struct touch {
        int32_t site;        // of a mass; -1 of a fixed contact
        vector arm, normal;  // from the block's centre, m; the way that the push acts
        double push;         // N
        double stored;       // J
        double beyond;       // the part of the push that it does not come from, N
        vector rubbed;       // friction's impulse so far on what touches, N s
    };
    // An instance of an effect that corners meet, with its parameters.
    struct fixed_contact {
        int index, instance;
        alignas(16) char params[64];
    };

    static vector minus(const vector& a, const vector& b) { return plus(a, -1.0, b); }
    static double length(const vector& v) { return square_root(inner(v, v)); }
    static vector ahead(const vector& before, const vector& after, double share) {
        return plus(after, share, minus(after, before));
    }
    static vector middle(const vector& before, const vector& after, bool between) {
        return between ? plus(before, 0.5, minus(after, before)) : before;
    }

    // Calls visit(effect, params) for an instance.
    template <class Visit>
    static void visit(fixed_contact& contact, const Visit& visit) {
        effects::for_each([&]<class E>(E) {
            if constexpr (effects::is_contact<E>) {
                if (contact.index != effects::index_of<E>) return;
                typename E::template params<double> params;
                static_assert(sizeof params <= sizeof contact.params);
                std::memcpy(&params, contact.params, sizeof params);
                visit(E{}, params);
            }
        });
    }

    void meet_masses(const mass_arrays<S>& seen) {
        masses_.clear();
        const double around = inner(law_.half, law_.half);
        for (int32_t i = 0; i < body_.masses; ++i) {
            const int32_t site = body_.sites[i];
            const vector arm{double(seen.position[0][site]) - place_.x,
                             double(seen.position[1][site]) - place_.y,
                             double(seen.position[2][site]) - place_.z};
            if (!(inner(arm, arm) < around)) continue;
            const auto point = effects::block::solid(law_, to_solid(frame_, arm));
            if (!(point.depth > 0)) continue;
            const vector normal = to_world(frame_, point.normal);
            const vector there = plus(cross(turning_, arm), 1.0, read_.velocity);
            const double rate = inner(
                normal, vector{seen.predicted[0][site] - there.x, seen.predicted[1][site] - there.y,
                               seen.predicted[2][site] - there.z});
            const double push =
                effects::block::parts(law_, point.depth, rate, double(body_.mass[site]));
            // the numbers that the mass adds
            const S force[3] = {S(push * normal.x), S(push * normal.y), S(push * normal.z)};
            for (int axis = 0; axis < 3; ++axis) seen.force[axis][site] += force[axis];
            take({force[0], force[1], force[2]}, arm, -1.0);
            const double spring = law_.stiffness * point.depth;
            masses_.push_back(
                {site, arm, normal, push, 0.5 * spring * point.depth, push - spring, {0, 0, 0}});
        }
    }

    void meet_contacts() {
        corners_.clear();
        for (int corner = 0; corner < 8; ++corner) {
            const vector arm = to_world(frame_, {corner & 1 ? law_.half.x : -law_.half.x,
                                                 corner & 2 ? law_.half.y : -law_.half.y,
                                                 corner & 4 ? law_.half.z : -law_.half.z});
            const vector there = plus(cross(turning_, arm), 1.0, read_.velocity);
            const double share = effects::block::corner_share * law_.mass;
            const effects::node_state<double> node{plus(place_, 1.0, arm), there, share,
                                                   1.0 / share};
            for (fixed_contact& contact : contacts_)
                visit(contact, [&]<class E>(E, const auto& params) {
                    const auto point = E::surface(params, node.position);
                    if (!(point.depth > 0)) return;
                    vector normal{0, 0, 0};
                    effects::add_push(point.normal, 1.0, normal);
                    const double push = effects::push_at(params, point, node);
                    take({push * normal.x, push * normal.y, push * normal.z}, arm, 1.0);
                    const double spring = params.stiffness * point.depth;
                    corners_.push_back({-1,
                                        arm,
                                        normal,
                                        push,
                                        0.5 * spring * point.depth,
                                        push - spring,
                                        {0, 0, 0}});
                });
        }
    }

    // Adds `sign` times a force at a place to those on the block.
    void take(const vector& force, const vector& arm, double sign) {
        force_ = plus(force_, sign, force);
        torque_ = plus(torque_, sign, cross(arm, force));
    }

    // ---- after the kick ----

    // Gives the block the opposite of what `impulse` gives each thing that touches it. Each depends
    // on all others, so they are gone through again until none changes.
    template <class Impulse>
    void rub(std::vector<touch>& touching, double h, const Impulse& impulse) {
        if (!rubs_) return;
        bool changes = true;
        for (int sweep = 0; changes && sweep < most_sweeps; ++sweep) {
            changes = false;
            for (touch& at : touching) {
                const vector given = impulse(at);
                push(at.arm, given, -1.0);
                changes |= length(given) > settled * at.push * h;
            }
        }
    }

    // Of a place of the block, m/s.
    vector velocity_at(const vector& arm) const {
        return plus(cross(to_world(turns_, next_.spin), arm), 1.0, next_.velocity);
    }
    // Changes the velocities by `sign` times an impulse at a place, N s.
    void push(const vector& arm, const vector& impulse, double sign) {
        const vector turn = cross(arm, impulse);
        next_.velocity = plus(next_.velocity, sign / law_.mass, impulse);
        next_.spin = plus(next_.spin, sign, turn);
        rubbed_ = {plus(rubbed_.velocity, sign, impulse), plus(rubbed_.spin, sign, turn)};
    }
    // What to add to the friction's impulse on what touches the block and moves at `relative` to
    // it, N s: Coulomb's law for the impulse of the whole step. Unlike that of effects/friction.h
    // it lets static friction catch what slips, since sweeps leave no slip of exactly 0 to know
    // rest by.
    vector friction_impulse(touch& at, const vector& relative, double inverse_mass,
                            double h) const {
        const vector slip = plus(relative, -inner(at.normal, relative), at.normal);
        const double squared = inner(slip, slip);
        if (!(squared > 0) || !(at.push > 0)) return {0, 0, 0};
        const double inverse = inverse_length(squared);
        // 1/kg of both together, along the slip
        const vector lever = cross(at.arm, {slip.x * inverse, slip.y * inverse, slip.z * inverse});
        const double mobility =
            inverse_mass + 1.0 / law_.mass + inner(lever, to_world(turns_, lever));
        const vector stops = plus(at.rubbed, -1.0 / mobility, slip);
        const double size = length(stops), available = at.push * h;
        const double most = friction_.kinetic_coefficient * available;
        const bool holds = size <= larger(friction_.static_coefficient * available, most);
        const vector before =
            std::exchange(at.rubbed, holds ? stops : plus({0, 0, 0}, most / size, stops));
        return minus(at.rubbed, before);
    }
    // Adds to the velocity of a mass; what that changes it by.
    static double change(const mass_arrays<S>& masses, int axis, int32_t site, double by) {
        S& velocity = masses.next_velocity[axis][site];
        const S before = velocity;
        velocity = S(double(before) + by);
        return double(velocity) - double(before);
    }

    const scene& scene_;
    const spring_body& body_;
    const effects::block::params<double> law_;
    const vector inertia_;  // kg m^2, in its own frame
    vector gravity_{0, 0, 0};
    bool rubs_ = false;
    effects::friction::params<double> friction_{};
    std::vector<fixed_contact> contacts_;

    vector place_;                   // of its centre, m
    quaternion points_{1, 0, 0, 0};  // from its own frame to the world
    motion now_, next_, read_;       // before and after the kick, and as forces read it

    // at t_n
    rotation frame_;
    rotation turns_;         // angular momentum to angular velocity
    vector turning_;         // as forces read it, rad/s
    vector force_, torque_;  // N, N m
    double kick_ = 0;        // how long the kick lasts, s
    motion rubbed_;          // what friction's impulses add up to, N s and N m s
    std::vector<touch> masses_, corners_;
};

}  // namespace limax::cpu
