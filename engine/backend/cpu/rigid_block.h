// rigid_block.h: the rigid block of one robot on the CPU: its state, its contacts, its energy.
// physics/solid.h has the laws. In double for every precision. SI units; places from the robot's
// own origin.
#pragma once

#include <cstring>
#include <vector>

#include "backend/cpu/passes.h"
#include "limax.h"
#include "physics/scene.h"
#include "physics/solid_edges.h"

namespace limax::cpu {

template <class S>
class rigid_block {
public:
    using vector = solid::vector;

    // Puts the block where it starts; `start` is the body's lowest corner. The fixed contacts
    // come with the first follow().
    rigid_block(const scene& in, const spring_body& body, const double start[3])
        : scene_(in),
          body_(body),
          law_(effects::block::make<double>(in.values(effects::index_of<effects::block>), start)),
          inertia_(inertia_of_box(law_.half, law_.mass)),
          block_(
              solid::placed(law_, inertia_, in.values(effects::index_of<effects::block>), start)) {
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

    // The robot's own origin has moved by `shift` and is at `origin`.
    void follow(const double origin[3], const double shift[3]) {
        solid::follow(block_, shift);
        move(origin, time_);
        patches_.clear();
        for (int i = 0; i < scene_.instances(effects::index_of<effects::patches>); ++i)
            patches_.push_back(effects::patches::make<double>(
                scene_.values(effects::index_of<effects::patches>, i), origin));
    }
    // Makes the parameters of contacts at a time, s since the muscles began.
    void move(const double origin[3], double time) {
        time_ = time;
        for (contact_instance& contact : contacts_)
            visit(contact, [&]<class E>(E, auto& params) {
                params = effects::make_params<E, double>(
                    scene_.values(contact.index, contact.instance), origin, scene_.heights(), time);
                std::memcpy(contact.params, &params, sizeof params);
            });
    }

    // Adds to the forces on the masses, whose state is `seen`, and finds those on the
    // block.
    void evaluate(const mass_arrays<S>& seen) {
        moment_ = solid::moment_of(block_, inertia_);
        const solid::view view = solid::view_of(block_, moment_);
        load_ = {{law_.mass * gravity_.x, law_.mass * gravity_.y, law_.mass * gravity_.z},
                 {0, 0, 0}};
        masses_.clear();
        for (int32_t i = 0; i < body_.masses; ++i) {
            const int32_t site = body_.sites[i];
            solid::touch found;
            if (!solid::meet_mass<S>(law_, view, site, at(seen.position, site),
                                     at(seen.predicted, site), double(body_.mass[site]), found))
                continue;
            const effects::vector<S> force = solid::push_on_mass<S>(found);
            seen.force[0][site] += force.x;
            seen.force[1][site] += force.y;
            seen.force[2][site] += force.z;
            solid::meet_back<S>(load_, found);
            masses_.push_back(found);
        }
        corners_.clear();
        const auto each = [&](const auto& meet) {
            for (const contact_instance& contact : contacts_) visit(contact, meet);
        };
        const auto keep = [&](const solid::touch& found) { corners_.push_back(found); };
        solid::meet_contacts(law_, view, load_, each, keep);
        if (scene_.has(effects::index_of<effects::edges>))
            solid::meet_edges(law_, view, load_, each, keep);
    }

    // The velocities after the forces have acted for h, before any friction.
    void kick(double h) {
        kick_ = h;
        rubbed_ = {{0, 0, 0}, {0, 0, 0}};
        solid::kick(block_, load_, law_.mass, h);
    }

    // Friction between the block and the masses, after their kick of h.
    void rub_masses(const mass_arrays<S>& masses, double h) {
        const auto in = [](const auto& column) {
            return [&](const solid::touch& touch) {
                const effects::vector<S> u = at(column, touch.site);
                return vector{u.x, u.y, u.z};
            };
        };
        rub(
            masses_, h, in(masses.velocity), in(masses.next_velocity),
            [&](const solid::touch& touch) { return double(masses.inverse_mass[touch.site]); },
            [&](const solid::touch& touch, const vector& impulse) {
                return solid::give_mass(
                    masses.next_velocity[0][touch.site], masses.next_velocity[1][touch.site],
                    masses.next_velocity[2][touch.site], impulse, double(body_.mass[touch.site]),
                    double(masses.inverse_mass[touch.site]));
            });
    }

    // Friction between the corners and what they touch.
    void rub_contacts(double h) {
        const auto of_surface = [&](const solid::touch& at) { return this->of_surface(at); };
        rub(
            corners_, h, of_surface, of_surface, [](const solid::touch&) { return 0.0; },
            [](const solid::touch&, const vector& impulse) { return impulse; });
    }

    // Moves the block for dt. `share` as in predict(); forces read u itself where not `predicted`.
    void drift(double dt, bool predicted, double share) {
        solid::drift(block_, inertia_, dt, predicted, share);
    }

    // ---- its part of the energy balance, at t_n ----

    // The energy of its motion, as velocity() has it, J.
    double kinetic_energy(bool between) const {
        const vector v = velocity(between), w = turning(between),
                     spin = solid::middle(block_.now.spin, block_.next.spin, between);
        return 0.5 * (law_.mass * inner(v, v) + inner(w, spin));
    }
    // From the world's origin, J; `origin` is the robot's own.
    double gravitational_energy(const double origin[3]) const {
        return -law_.mass *
               inner(gravity_, plus(block_.place, 1.0, {origin[0], origin[1], origin[2]}));
    }
    // The energy stored in its contacts, J.
    double contact_energy() const {
        double sum = 0;
        for (const solid::touch& touch : masses_) sum += touch.stored;
        for (const solid::touch& touch : corners_) sum += touch.stored;
        return sum;
    }
    // The power of the other forces of contacts on the block and on masses that move at `velocity`,
    // and of what drives surfaces that move, W.
    double contact_power(const S* const velocity[3], bool between) const {
        const vector v = this->velocity(between), w = turning(between);
        double sum = 0;
        for (const solid::touch& touch : masses_) {
            const vector u{velocity[0][touch.site], velocity[1][touch.site],
                           velocity[2][touch.site]};
            sum += touch.beyond *
                   inner(touch.normal, solid::minus(u, plus(cross(w, touch.arm), 1.0, v)));
        }
        for (const solid::touch& touch : corners_)
            sum += touch.beyond * inner(touch.normal, plus(cross(w, touch.arm), 1.0, v)) +
                   (touch.push - touch.beyond) * inner(touch.normal, of_surface(touch));
        return sum;
    }
    // The power of this step's friction impulses on the block, as a force over the kick at the mean
    // of the velocities before and after it, W.
    double friction_power() const {
        return (inner(rubbed_.velocity, velocity(true)) + inner(rubbed_.spin, turning(true))) /
               kick_;
    }

    // Which limits it breaks, of its centre or of a corner.
    solid::breaks broken(double max_speed) const {
        return solid::broken(block_, law_, inertia_, max_speed);
    }

    // [LIMAX_BLOCK_STATE]; `origin` is the robot's own.
    void write(const double origin[3], bool between, double* out) const {
        solid::write_state(block_, inertia_, origin, between, out);
    }
    const quaternion& points() const { return block_.points; }
    const vector& place() const { return block_.place; }                  // of its centre
    const vector& read_velocity() const { return block_.read.velocity; }  // that forces read
    vector velocity(bool between) const { return solid::velocity(block_, between); }
    vector turning(bool between) const { return solid::turning(block_, inertia_, between); }

private:
    // An instance of an effect that corners meet, with its parameters.
    struct contact_instance {
        int index, instance;
        alignas(16) char params[96];
    };

    // The velocity of the surface that a corner touches, m/s.
    vector of_surface(const solid::touch& touch) const {
        if (!(scene_.mask() & effects::motion_bits)) return {0, 0, 0};
        return solid::surface_velocity(touch, [&](const auto& meet) {
            for (const contact_instance& contact : contacts_) visit(contact, meet);
        });
    }

    template <class Column>
    static effects::vector<S> at(const Column& column, int32_t site) {
        return {column[0][site], column[1][site], column[2][site]};
    }

    // Calls visit(effect, params) for an instance.
    template <class Visit>
    static void visit(const contact_instance& contact, const Visit& visit) {
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

    template <class Before, class After, class InverseMass, class Give>
    void rub(std::vector<solid::touch>& touching, double h, const Before& before,
             const After& after, const InverseMass& inverse_mass, const Give& give) {
        if (!rubs_) return;
        const auto each = [&](const auto& visit) {
            for (solid::touch& touch : touching) visit(touch);
        };
        const auto grip = [&](const vector& place) {
            double factor = 1;
            for (const auto& patch : patches_) factor *= effects::patches::grip(patch, place);
            return factor;
        };
        solid::rub(friction_, law_, block_, moment_, h, rubbed_, each, before, after, inverse_mass,
                   grip, give);
    }

    const scene& scene_;
    const spring_body& body_;
    const solid::block_params law_;
    const vector inertia_;  // kg m^2, in its own frame
    vector gravity_{0, 0, 0};
    bool rubs_ = false;
    solid::friction_params friction_{};
    std::vector<contact_instance> contacts_;
    std::vector<effects::patches::params<double>> patches_;
    double time_ = -1;  // where contacts that move are, s

    solid::state block_;
    solid::moment moment_;  // at t_n
    solid::load load_;
    double kick_ = 0;       // how long the kick lasts, s
    solid::motion rubbed_;  // what friction's impulses add up to, N s and N m s
    std::vector<solid::touch> masses_, corners_;
};

}  // namespace limax::cpu
