// forces.h: the forces on one robot's masses at one moment, springs first, then the effects on
// masses in the order of effects::all; and the impulses that follow a kick. SI units.
#pragma once

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include "backend/cpu/columns.h"
#include "backend/cpu/rigid_blocks.h"
#include "backend/cpu/self_contacts.h"
#include "backend/cpu/work_ledger.h"
#include "physics/scene.h"

namespace limax::cpu {

// S and `compensated` as in robot_columns. What it is made from must outlive it.
template <class S, bool compensated>
class robot_forces {
public:
    // Muscles count time in ticks of `tick` seconds from t = 0.
    robot_forces(const scene& in, const spring_body& body, const pass_table& passes,
                 robot_columns<S, compensated>& columns, double tick)
        : scene_(in), body_(body), passes_(passes), columns_(columns), tick_(tick) {
        if (in.has(effects::index_of<effects::actuation>))
            clock_ = effects::actuation::make_clock(
                in.values(effects::index_of<effects::actuation>), tick);
        effects::for_each([&]<class E>(E) {
            constexpr int index = effects::index_of<E>;
            if (effects::acts_on_masses<E>)
                for (int i = 0; i < in.instances(index); ++i) active_.push_back({index, i, {}, {}});
            if constexpr (bool(E::hooks & effects::hook_meet))
                if (in.has(index)) {
                    const double edge = body.rest[0];
                    self_contacts_ = std::make_unique<self_contacts<S>>(
                        body, params_of<E, double>().reach * edge, edge);
                }
        });
    }

    // Takes the effects' parameters into the coordinates of a robot whose own origin is there.
    void follow(const double origin[3]) {
        std::copy(origin, origin + 3, origin_);
        for (active_effect& active : active_)
            effects::for_each([&]<class E>(E) {
                if constexpr (effects::acts_on_masses<E>) {
                    if (active.index == effects::index_of<E>) make<E>(active);
                }
            });
        patches_.clear();
        each_of<effects::patches>([&](const auto& params) { patches_.push_back(params); });
    }
    // Moves contacts that move to where they are at a time, s since the muscles began.
    void move(double time) {
        if (!(scene_.mask() & effects::motion_bits)) return;
        time_ = time;
        for (active_effect& active : active_)
            effects::for_each([&]<class E>(E) {
                if constexpr (effects::moves<E>)
                    if (active.index == effects::index_of<E>) make<E>(active);
            });
        if (blocks_) blocks_->move(origin_, time);
    }

    // Muscles rest while the body settles, before tick 0.
    bool actuated(int64_t tick) const { return body_.sine.size() != 0 && tick >= 0; }
    bool controlled() const { return scene_.has(effects::index_of<effects::control>); }
    // From now on a controller's tick is at `tick`, with `per_step` ticks of the clock in a step.
    void begin_drive(int64_t tick, int per_step) {
        drive_tick_ = tick;
        ticks_per_step_ = per_step;
    }
    // Steps since then.
    double since_drive(int64_t tick) const {
        return actuated(tick) ? double(tick - drive_tick_) / ticks_per_step_ : 0.0;
    }
    template <class R>
    effects::actuation::moment<R> moment(int64_t tick) const {
        if (!actuated(tick)) return {R(0), R(0)};
        if (controlled()) return {R(since_drive(tick)), R(0)};
        return effects::actuation::at<R>(clock_, tick, tick_);
    }
    // d moment / dt, 1/s.
    effects::actuation::moment<double> moment_rate(int64_t tick) const {
        if (!actuated(tick)) return {0, 0};
        if (controlled()) return {0, 1 / (tick_ * ticks_per_step_)};
        return effects::actuation::rate_at(clock_, tick, tick_);
    }
    // The moment for measures, whose columns have the change of a rest length at the controller's
    // tick and per step; else the same.
    effects::actuation::moment<double> measured_moment(int64_t tick) const {
        if (controlled()) return {1, since_drive(tick)};
        return moment<double>(tick);
    }

    // The motion of the muscles around a tick, with steps of `step` ticks.
    muscle_motion muscles_around(int64_t tick, int step) const {
        if (controlled()) return {measured_moment(tick), moment_rate(tick), moment_rate(tick)};
        const auto per_second = [&](int64_t from, int64_t to) {
            const auto before = moment<double>(from), after = moment<double>(to);
            return effects::actuation::moment<double>{
                (after.sine - before.sine) / (tick_ * step),
                (after.cosine - before.cosine) / (tick_ * step)};
        };
        return {moment<double>(tick), per_second(tick - step, tick), per_second(tick, tick + step)};
    }

    // Fills the forces on the robot's masses, whose state is `seen`.
    void evaluate(const mass_arrays<S>& seen, int64_t tick) {
        move(double(tick) * tick_);
        columns_.show_springs(seen);
        pair_place place;
        passes_of<S>(passes_).pair[variant(tick)](columns_.springs, moment<S>(tick), place,
                                                  seen.count);
        act_on_masses(seen, tick);
        if (blocks_) blocks_->evaluate(seen);
    }

    // Do masses act on each other by springs only?
    bool local() const {
        return !self_contacts_ && !blocks_ && !ledger_ && !(scene_.mask() & effects::face_bits);
    }
    // In a scene where local(): computes the forces of `steps` steps on some masses after the
    // others. Calls act(part, n) with each part of masses[n] once its forces at tick + n are
    // complete. Springs of the other parts do not read it any more: the rest of the step may
    // follow, while the part is in the cache. Step n + 1 is as far behind step n as springs reach.
    template <class Act>
    void evaluate_parts(const mass_arrays<S>* masses, int64_t tick, int64_t steps, const Act& act) {
        spring_arrays<S>& springs = columns_.springs;
        S* const sums = springs.sums;
        const int64_t count = body_.count, reach = longest_step(body_.grid);
        pair_place place[most_steps_at_once];
        int64_t done[most_steps_at_once] = {};  // sites
        while (done[steps - 1] < count)
            for (int64_t n = 0; n < steps; ++n) {
                const int64_t first = done[n], end = std::min(place[n].cell + sites_of_part, count);
                const bool waits = n > 0 && done[n - 1] < std::min(end + reach, count);
                if (waits || first == count) continue;
                move(double(tick + n) * tick_);
                columns_.show_springs(masses[n]);
                springs.sums = sums + n * 3 * cell_corners * springs.sums_column;
                passes_of<S>(passes_).pair[variant(tick + n)](springs, moment<S>(tick + n),
                                                              place[n], end);
                done[n] = end == count ? end : end - site_block;
                const mass_arrays<S> part = part_of(masses[n], first, done[n]);
                act_on_masses(part, tick + n);
                act(part, n);
            }
        springs.sums = sums;
    }

    // The energy stored in contacts between masses of the body, J.
    double energy_of_pairs() {
        double sum = 0;
        const mass_arrays<S>& masses = columns_.masses;
        each_pair(masses.position, masses.predicted,
                  [&]<class E>(E, const auto& params, auto, auto, const auto& found) {
                      sum += double(E::stored(params, found.state));
                  });
        return sum;
    }
    // The power of the other forces between them on masses that move at `velocity`, W.
    double power_of_pairs(const S* const velocity[3]) {
        double sum = 0;
        const mass_arrays<S>& masses = columns_.masses;
        each_pair(masses.position, masses.predicted,
                  [&]<class E>(E, const auto& params, auto a, auto b, const auto& found) {
                      auto at_rest = found.state;
                      at_rest.rate = 0;
                      const double beyond =
                          double(E::meet(params, found.state)) - double(E::meet(params, at_rest));
                      for (int axis = 0; axis < 3; ++axis)
                          sum += beyond * double(found.normal[axis]) *
                                 (double(velocity[axis][b]) - double(velocity[axis][a]));
                  });
        return sum;
    }

    // Records impulses in this ledger from now on; it must outlive this.
    void set_ledger(work_ledger<S>& ledger) { ledger_ = &ledger; }
    // From now on blocks take part in every step; they must outlive this.
    void meet(rigid_blocks<S>& blocks) { blocks_ = &blocks; }

    // Changes the velocities after a kick of h by the effects' impulses, friction last: what it
    // stops stays.
    void push(const mass_arrays<S>& masses, S h) {
        const step_passes<S>& passes = passes_of<S>(passes_);
        if (ledger_) ledger_->forget_impulses();
        for (const active_effect& active : active_)
            if (const auto face = passes.face[active.index])
                recorded(masses, active.index, h, [&] { face(masses, active.params, h); });
        if (blocks_) {
            blocks_->kick(double(h));
            recorded(masses, effects::index_of<effects::friction>, h,
                     [&] { blocks_->rub_masses(masses, double(h)); });
        }
        for (const active_effect& active : active_)
            if (active.index == effects::index_of<effects::friction>)
                for (const active_effect& contact : active_)
                    if (const auto slip = passes.slip[contact.index])
                        recorded(masses, active.index, h, [&] {
                            slip(masses, contact.touching, contact.params, active.params, patches_,
                                 h);
                        });
        if (blocks_) blocks_->rub_contacts(double(h));
    }

    // Moves what is not the body's for dt; `predicted` and `share` as the drift of the masses.
    void drift(double dt, bool predicted, double share) {
        if (blocks_) blocks_->drift(dt, predicted, share);
    }

    // The pushes of all contacts on the masses as they are at a time, without damping, [site].
    void static_pushes(std::vector<S>& out, double time) {
        move(time);
        const auto& position = columns_.masses.position;
        std::fill(out.begin(), out.end(), S(0));
        for (const active_effect& active : active_)
            effects::for_each([&]<class E>(E) {
                if constexpr (effects::is_contact<E>) {
                    if (active.index != effects::index_of<E>) return;
                    typename E::template params<S> params;
                    std::memcpy(&params, active.params, sizeof params);
                    for (int32_t i = 0; i < body_.masses; ++i) {
                        const int32_t site = body_.sites[i];
                        const S depth = E::surface(params, {position[0][site], position[1][site],
                                                            position[2][site]})
                                            .depth;
                        if (depth > S(0)) out[std::size_t(site)] += params.stiffness * depth;
                    }
                }
            });
    }

    // Whether the mass at a site lies below the surface of any contact.
    bool touches(int32_t site) const {
        const auto& position = columns_.masses.position;
        const effects::vector<S> place{position[0][site], position[1][site], position[2][site]};
        bool found = false;
        for (const active_effect& active : active_)
            effects::for_each([&]<class E>(E) {
                if constexpr (effects::is_contact<E>) {
                    if (active.index != effects::index_of<E>) return;
                    typename E::template params<S> params;
                    std::memcpy(&params, active.params, sizeof params);
                    found |= E::surface(params, place).depth > S(0);
                }
            });
        return found;
    }

private:
    // Few enough for a core's cache, with the sums of cells and the layer above.
    static constexpr int64_t sites_of_part = 1024;

    static mass_arrays<S> part_of(mass_arrays<S> masses, int64_t first, int64_t end) {
        masses.count = end - first;
        for (auto* column :
             {&masses.position, &masses.velocity, &masses.next_velocity, &masses.predicted,
              &masses.lost_position, &masses.lost_velocity, &masses.force})
            for (S*& axis : *column)
                if (axis) axis += first;
        masses.mass += first;
        masses.inverse_mass += first;
        return masses;
    }

    // Makes the parameters of an instance.
    template <class E, class Active>
    void make(Active& active) {
        const auto params = effects::make_params<E, S>(scene_.values(active.index, active.instance),
                                                       origin_, scene_.heights(), time_);
        static_assert(sizeof params <= sizeof active.params);
        std::memcpy(active.params, &params, sizeof params);
    }
    // Calls visit(params) for each instance of an effect.
    template <class E, class Visit>
    void each_of(const Visit& visit) const {
        for (const auto& active : active_) {
            if (active.index != effects::index_of<E>) continue;
            typename E::template params<S> params;
            std::memcpy(&params, active.params, sizeof params);
            visit(params);
        }
    }
    // The passes of a resting body are those of a scene without actuation.
    unsigned variant(int64_t tick) const {
        const unsigned resting = actuated(tick) ? 0u : effects::muscle_bits;
        return pair_variant(scene_.mask() & ~resting);
    }
    void act_on_masses(const mass_arrays<S>& seen, int64_t tick) {
        const step_passes<S>& passes = passes_of<S>(passes_);
        for (active_effect& active : active_)
            if (const auto node = passes.node[active.index])
                active.touching = node(seen, active.params);
        for (const scripted_effect& script : scene_.scripts()) evaluate(script.law, seen, tick);
        each_pair(seen.position, seen.predicted,
                  [&]<class E>(E, const auto& params, auto a, auto b, const auto& found) {
                      const S push = E::meet(params, found.state);
                      for (int axis = 0; axis < 3; ++axis) {
                          seen.force[axis][a] = fma(-push, found.normal[axis], seen.force[axis][a]);
                          seen.force[axis][b] = fma(push, found.normal[axis], seen.force[axis][b]);
                      }
                  });
    }
    // Lets `push` change the velocities by an impulse over h and records it in the ledger.
    template <class Push>
    void recorded(const mass_arrays<S>& masses, int effect, S h, const Push& push) {
        if (ledger_) ledger_->before_impulse(masses);
        push();
        if (ledger_) ledger_->after_impulse(masses, effect, double(h));
    }

    template <class E, class R>
    typename E::template params<R> params_of() const {
        const double world[3] = {0, 0, 0};
        return E::template make<R>(scene_.values(effects::index_of<E>), world);
    }
    // Calls visit(effect, params, near, far, pair) for masses of the body that meet.
    template <class Visit>
    void each_pair(const S* const position[3], const S* const velocity[3], const Visit& visit) {
        if (!self_contacts_) return;
        effects::for_each([&]<class E>(E) {
            if constexpr (bool(E::hooks & effects::hook_meet))
                if (scene_.has(effects::index_of<E>)) {
                    const auto params = params_of<E, S>();
                    self_contacts_->each(position, velocity,
                                         [&](auto a, auto b, const auto& found) {
                                             visit(E{}, params, a, b, found);
                                         });
                }
        });
    }

    // Adds the forces of a scripted effect.
    void evaluate(const scripted::program& law, const mass_arrays<S>& seen, int64_t tick) {
        // written before it is read within one call
        static thread_local std::vector<S> registers;
        const std::size_t needed = std::size_t(law.registers()) * scripted_block;
        if (registers.size() < needed) registers.resize(needed);
        passes_of<S>(passes_).scripted(seen, {law.instructions.data(),
                                              law.constants.data(),
                                              int(law.instructions.size()),
                                              int(law.constants.size()),
                                              {law.results[0], law.results[1], law.results[2]},
                                              registers.data(),
                                              double(tick) * tick_,
                                              {origin_[0], origin_[1], origin_[2]}});
    }

    // One instance of an effect of the scene with its parameters in this robot's coordinates.
    struct active_effect {
        int index, instance;
        alignas(16) char params[96];
        site_range touching;  // of a contact, in the last evaluation of forces
    };

    const scene& scene_;
    const spring_body& body_;
    const pass_table& passes_;
    robot_columns<S, compensated>& columns_;
    double tick_;                   // s
    double origin_[3] = {0, 0, 0};  // the robot's own, m
    double time_ = -1;              // where contacts that move are, s
    std::vector<effects::patches::params<S>> patches_;
    effects::actuation::clock clock_{};
    int64_t drive_tick_ = 0;  // of a controller
    int ticks_per_step_ = 1;
    std::vector<active_effect> active_;
    std::unique_ptr<self_contacts<S>> self_contacts_;  // null where no effect needs them
    rigid_blocks<S>* blocks_ = nullptr;
    work_ledger<S>* ledger_ = nullptr;
};

}  // namespace limax::cpu
