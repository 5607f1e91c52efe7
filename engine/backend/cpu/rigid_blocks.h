// rigid_blocks.h: the rigid blocks of one robot on the CPU: their state, their contacts, their
// energy. physics/solid.h has the laws. In double for every precision. SI units; places from the
// robot's own origin. Blocks are counted from 0, in the scene's order.
#pragma once

#include <cstring>
#include <vector>

#include "backend/cpu/passes.h"
#include "limax.h"
#include "physics/scene.h"
#include "physics/solid_pairs.h"

namespace limax::cpu {

template <class S>
class rigid_blocks {
public:
    using vector = solid::vector;

    // Puts the blocks where they start; `start` is the body's lowest corner. The fixed contacts
    // come with the first follow().
    rigid_blocks(const scene& in, const spring_body& body, const double start[3])
        : scene_(in), body_(body) {
        for (int i = 0; i < in.instances(effects::index_of<effects::block>); ++i)
            blocks_.push_back(
                solid::placed(i, in.values(effects::index_of<effects::block>, i), start));
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
        for (solid::body& block : blocks_) solid::follow(block.block, shift);
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
    // blocks.
    void evaluate(const mass_arrays<S>& seen) {
        for (solid::body& block : blocks_) {
            solid::show(block);
            solid::weigh(block, gravity_);
        }
        masses_.clear();
        for (int32_t i = 0; i < body_.masses; ++i) {
            const int32_t site = body_.sites[i];
            effects::vector<S> sum{};
            bool touches = false;
            for (solid::body& block : blocks_) {
                solid::touch found;
                if (!solid::meet_mass<S>(block.law, solid::view_of(block), block.number, site,
                                         at(seen.position, site), at(seen.predicted, site),
                                         double(body_.mass[site]), found))
                    continue;
                solid::add_push<S>(sum, found, touches);
                solid::meet_back<S>(block.on, found);
                masses_.push_back(found);
            }
            if (!touches) continue;
            seen.force[0][site] += sum.x;
            seen.force[1][site] += sum.y;
            seen.force[2][site] += sum.z;
        }
        corners_.clear();
        pairs_.clear();
        const auto each = [&](const auto& meet) {
            for (const contact_instance& contact : contacts_) visit(contact, meet);
        };
        const auto keep = [&]<class Touch>(const Touch& found) {
            if constexpr (same_type<Touch, solid::touch>)
                corners_.push_back(found);
            else
                pairs_.push_back(found);
        };
        if (scene_.has(effects::index_of<effects::edges>))
            solid::meet_all<true>(blocks_.data(), count(), each, keep);
        else
            solid::meet_all<false>(blocks_.data(), count(), each, keep);
    }

    // The velocities after the forces have acted for h, before any friction.
    void kick(double h) {
        kick_ = h;
        for (solid::body& block : blocks_) solid::kick(block, h);
    }

    // Friction between the blocks and the masses, after their kick of h.
    void rub_masses(const mass_arrays<S>& masses, double h) {
        const auto in = [](const auto& column) {
            return [&](const solid::touch& touch) {
                const effects::vector<S> u = at(column, touch.site);
                return vector{u.x, u.y, u.z};
            };
        };
        const solid::counterpart of_mass{
            in(masses.velocity), in(masses.next_velocity),
            [&](const solid::touch& touch, const vector&) {
                return double(masses.inverse_mass[touch.site]);
            },
            [&](const solid::touch& touch, const vector& impulse) {
                return solid::give_mass(
                    masses.next_velocity[0][touch.site], masses.next_velocity[1][touch.site],
                    masses.next_velocity[2][touch.site], impulse, double(body_.mass[touch.site]),
                    double(masses.inverse_mass[touch.site]));
            }};
        if (!rubs_) return;
        solid::rub(
            friction_, h, blocks_.data(), count(),
            [&](const auto& visit) {
                for (solid::touch& touch : masses_) visit(touch, of_mass);
            },
            grip());
    }

    // Friction between the blocks and what their corners touch, and of blocks with each other.
    void rub_contacts(double h) {
        if (!rubs_) return;
        solid::rub_all(
            friction_, h, blocks_.data(), count(), corners_.data(), int(corners_.size()),
            pairs_.data(), int(pairs_.size()),
            [&](const solid::touch& at) { return of_surface(at); }, grip());
    }

    // Moves the blocks for dt. `share` as in predict(); forces read u itself where not `predicted`.
    void drift(double dt, bool predicted, double share) {
        for (solid::body& block : blocks_) solid::drift(block, dt, predicted, share);
    }

    // ---- their part of the energy balance, at t_n ----

    // The energy of their motion, as solid::velocity() has it, J.
    double kinetic_energy(bool between) const {
        double sum = 0;
        for (const solid::body& block : blocks_) {
            const vector v = velocity(block, between), w = turning(block, between),
                         spin = solid::middle(block.block.now.spin, block.block.next.spin, between);
            sum += 0.5 * (block.law.mass * inner(v, v) + inner(w, spin));
        }
        return sum;
    }
    // From the world's origin, J; `origin` is the robot's own.
    double gravitational_energy(const double origin[3]) const {
        double sum = 0;
        for (const solid::body& block : blocks_)
            sum -= block.law.mass *
                   inner(gravity_, plus(block.block.place, 1.0, {origin[0], origin[1], origin[2]}));
        return sum;
    }
    // The energy stored in their contacts, J.
    double contact_energy() const {
        double sum = 0;
        for (const solid::touch& touch : masses_) sum += touch.stored;
        for (const solid::touch& touch : corners_) sum += touch.stored;
        for (const solid::touch& touch : pairs_) sum += touch.stored;
        return sum;
    }
    // The power of the other forces of contacts on the blocks and on masses that move at
    // `velocity`, and of what drives surfaces that move, W.
    double contact_power(const S* const velocity[3], bool between) const {
        const auto velocity_at = [&](int number, const vector& arm) {
            const solid::body& block = blocks_[number];
            return plus(cross(turning(block, between), arm), 1.0, solid::velocity(block, between));
        };
        double sum = 0;
        for (const solid::touch& touch : masses_) {
            const vector u{velocity[0][touch.site], velocity[1][touch.site],
                           velocity[2][touch.site]};
            sum += touch.beyond *
                   inner(touch.normal, solid::minus(u, velocity_at(touch.block, touch.arm)));
        }
        for (const solid::touch& touch : corners_)
            sum += touch.beyond * inner(touch.normal, velocity_at(touch.block, touch.arm)) +
                   (touch.push - touch.beyond) * inner(touch.normal, of_surface(touch));
        for (const solid::pair_touch& touch : pairs_)
            sum += touch.beyond *
                   inner(touch.normal, solid::minus(velocity_at(touch.guest, touch.guest_arm),
                                                    velocity_at(touch.block, touch.arm)));
        return sum;
    }
    // The power of this step's friction impulses on the blocks, as a force over the kick at the
    // mean of the velocities before and after it, W.
    double friction_power() const {
        double sum = 0;
        for (const solid::body& block : blocks_)
            sum += (inner(block.rubbed.velocity, velocity(block, true)) +
                    inner(block.rubbed.spin, turning(block, true))) /
                   kick_;
        return sum;
    }

    // Which limits they break, of their centres or of a corner.
    solid::breaks broken(double max_speed) const {
        solid::breaks all{false, false};
        for (const solid::body& block : blocks_) {
            const solid::breaks one = solid::broken(block, max_speed);
            all = {all.nonfinite || one.nonfinite, all.speed || one.speed};
        }
        return all;
    }

    int count() const { return int(blocks_.size()); }
    const solid::body& at(int number) const { return blocks_[number]; }

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

    // The factor on friction at a place.
    auto grip() const {
        return [&](const vector& place) {
            double factor = 1;
            for (const auto& patch : patches_) factor *= effects::patches::grip(patch, place);
            return factor;
        };
    }

    const scene& scene_;
    const spring_body& body_;
    vector gravity_{0, 0, 0};
    bool rubs_ = false;
    solid::friction_params friction_{};
    std::vector<contact_instance> contacts_;
    std::vector<effects::patches::params<double>> patches_;
    double time_ = -1;  // where contacts that move are, s

    double kick_ = 0;  // how long the kick lasts, s
    std::vector<solid::body> blocks_;
    std::vector<solid::touch> masses_, corners_;
    std::vector<solid::pair_touch> pairs_;
};

}  // namespace limax::cpu
