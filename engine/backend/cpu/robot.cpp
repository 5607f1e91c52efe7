// robot.cpp: the order of one step, and what happens between steps.
//
// A step from t_n: forces at x_n and t_n, springs first, then the effects on masses in the order
// of effects::all; kick; impulses, friction last; drift. In `mixed` springs see x and p rounded to
// fp32, and their sums are widened before anything on masses. "Begun" is the state between kick and
// drift, where both velocities around t_n are at hand: samples are taken there.
#include "backend/cpu/robot.h"

#include <algorithm>
#include <cmath>

#include "physics/held.h"
#include "physics/integrator.h"
#include "physics/measure.h"
#include "physics/origin.h"

namespace limax::cpu {

namespace {

// Sites moved between looks at the clock and the stop flag: well under a millisecond.
constexpr int64_t sites_per_look = 16384;
// S, F and `compensated` as in robot_columns.
template <class S, class F, bool compensated>
class robot_run final : public robot {
public:
    robot_run(const simulation_setup& setup, spring_body body, const pass_table& passes,
              limax_outcome& outcome);

    bool advance(scratch& memory, deadline until, int64_t most) override;
    void place(const double* positions, const double* velocities) override;
    void state(scratch& memory, double* positions, double* velocities) override;
    const int32_t* sites() const override { return body_.sites.data(); }
    int64_t samples(int32_t kind) const override { return traces_.taken(kind); }
    const double* trace(int32_t kind) const override { return traces_.data(kind); }

private:
    // One instance of an effect of the scene with its parameters in this robot's coordinates.
    struct active_effect {
        int index, instance;
        alignas(16) char params[64];
    };

    void put_down();
    void refresh_params();
    bool actuated_now() const { return body_.sine.size() != 0 && step_ >= plan_.settle_steps; }
    effects::actuation::moment<F> moment() const;
    void check_limits();
    void recenter();
    void begin();
    void finish_step();
    void mark_centers();
    void release_springs();
    void sample_due();
    void record(int kind);
    // Whether the mass at a site lies below the surface of any contact.
    bool touches(int32_t site) const;
    // Velocities at t_n, from those on both sides.
    void velocity_now(S* out[3]) const;
    double center(int axis) const {
        return origin_[axis] + center_of_mass(body_, masses_.position[axis]);
    }

    const simulation_setup& setup_;
    const pass_table& passes_;
    const spring_passes<F>& spring_passes_;
    const mass_passes<S>& mass_passes_;
    limax_outcome& outcome_;
    spring_body body_;
    schedule plan_;
    effects::actuation::clock clock_{};
    const bool leapfrog_;
    std::vector<active_effect> active_;
    robot_columns<S, F, compensated> columns_;
    mass_arrays<S>& masses_ = columns_.masses;
    spring_arrays<F>& springs_ = columns_.springs;
    double origin_[3] = {0, 0, 0};  // m
    int64_t step_ = 0;
    bool begun_ = false;
    traces traces_;
};

template <class S, class F, bool compensated>
robot_run<S, F, compensated>::robot_run(const simulation_setup& setup, spring_body body,
                                        const pass_table& table, limax_outcome& outcome)
    : setup_(setup),
      passes_(table),
      spring_passes_(spring_passes_of<F>(table)),
      mass_passes_(mass_passes_of<S>(table)),
      outcome_(outcome),
      body_(std::move(body)),
      leapfrog_(setup.options.integrator == LIMAX_LEAPFROG),
      columns_(body_, leapfrog_) {
    outcome_.time_step_bound =
        time_step_bound(body_, setup.scene, limax_integrator(setup.options.integrator));
    plan_ = make_schedule(setup.options, outcome_.time_step_bound);
    if (body_.sine.size() != 0)
        clock_ = effects::actuation::make_clock(
            setup.scene.values(effects::index_of<effects::actuation>), plan_.time_step);
    outcome_.status = LIMAX_ROBOT_RUNNING;
    outcome_.steps = plan_.steps;
    outcome_.time_step = plan_.time_step;
    outcome_.time = -double(plan_.settle_steps) * plan_.time_step;
    outcome_.masses = body_.masses;
    outcome_.springs = body_.springs;
    outcome_.mass = body_.total_mass;
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        if (effects::acts_on_masses<E>)
            for (int i = 0; i < setup.scene.instances(index); ++i)
                active_.push_back({index, i, {}});
    });
    traces_ = traces(plan_, body_.masses);
    put_down();
    refresh_params();
}

// Puts the body where it starts.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::put_down() {
    const lattice& grid = body_.grid;
    const limax_simulation_options& options = setup_.options;
    const int sites_along[3] = {grid.nx + 1, grid.ny + 1, grid.nz + 1};
    for (int axis = 0; axis < 3; ++axis) origin_[axis] = whole_origin_steps(options.position[axis]);
    for (int64_t site = 0; site < grid.sites(); ++site) {
        const int64_t index[3] = {site % sites_along[0], site / sites_along[0] % sites_along[1],
                                  site / (int64_t(sites_along[0]) * sites_along[1])};
        const bool held = is_held(setup_.scene, options.edge, body_.corner, int(index[0]),
                                  int(index[1]), int(index[2]));
        if (held) columns_.hold(site);
        const bool moving = body_.mass[site] > 0 && !held;
        for (int axis = 0; axis < 3; ++axis) {
            masses_.position[axis][site] =
                S((options.position[axis] - origin_[axis]) +
                  options.edge * double(index[axis] - body_.corner[axis]));
            masses_.velocity[axis][site] = moving ? S(options.velocity[axis]) : S(0);
            masses_.predicted[axis][site] = masses_.velocity[axis][site];
        }
    }
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::refresh_params() {
    for (active_effect& active : active_)
        effects::for_each([&]<class E>(E) {
            if constexpr (effects::acts_on_masses<E>) {
                if (active.index != effects::index_of<E>) return;
                const auto params =
                    effects::make_params<E, S>(setup_.scene.values(active.index, active.instance),
                                               origin_, setup_.scene.heights());
                static_assert(sizeof params <= sizeof active.params);
                std::memcpy(active.params, &params, sizeof params);
            }
        });
}

template <class S, class F, bool compensated>
effects::actuation::moment<F> robot_run<S, F, compensated>::moment() const {
    if (!actuated_now()) return {F(0), F(0)};
    return effects::actuation::at<F>(clock_, step_ - plan_.settle_steps, plan_.time_step);
}

// Ends the robot if a limit is broken.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::check_limits() {
    columns_.show_springs(passes_);
    const limit_breaks breaks = mass_passes_.limit(masses_, S(setup_.options.max_speed));
    const int32_t stretched = spring_passes_.limit(springs_, F(setup_.options.max_stretch));
    if (!breaks.nonfinite && !breaks.speed && !stretched) return;
    outcome_.status = LIMAX_ROBOT_DIVERGED;
    outcome_.reason = breaks.nonfinite ? LIMAX_NONFINITE
                      : breaks.speed   ? LIMAX_SPEED
                                       : LIMAX_STRETCH;
}

// Moves the robot's own origin after it: a function of this robot alone.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::recenter() {
    bool moved = false;
    for (int axis = 0; axis < 3; ++axis) {
        const double shift = origin_shift(center_of_mass(body_, masses_.position[axis]));
        if (shift == 0.0) continue;
        for (int32_t i = 0; i < body_.masses; ++i) {
            const int32_t site = body_.sites[i];
            S carried = compensated ? masses_.lost_position[axis][site] : S(0);
            S& position = masses_.position[axis][site];
            position = accumulate<compensated>(position, -S(shift), carried);
            if constexpr (compensated) masses_.lost_position[axis][site] = carried;
        }
        origin_[axis] += shift;
        moved = true;
    }
    if (moved) refresh_params();
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::begin() {
    const int64_t count = masses_.count;
    columns_.show_springs(passes_);
    for (F* force : springs_.force) std::memset(force, 0, count * sizeof(F));
    // muscles rest while the body settles: then the passes are those of a scene without actuation
    const unsigned resting = actuated_now() ? 0u : effects::bit<effects::actuation>;
    spring_passes_.pair[pair_variant(setup_.scene.mask() & ~resting)](springs_, moment());
    columns_.take_forces(passes_);
    for (const active_effect& active : active_)
        if (const auto node = mass_passes_.node[active.index]) node(masses_, active.params);
    const double h = leapfrog_ && step_ == 0 ? 0.5 * plan_.time_step : plan_.time_step;
    mass_passes_.kick[compensated](masses_, S(h));
    for (const active_effect& active : active_)
        if (const auto impulse = mass_passes_.impulse[active.index])
            impulse(masses_, active.params, S(h));
    // friction last: what it stops stays
    for (const active_effect& active : active_)
        if (active.index == effects::index_of<effects::friction>)
            for (const active_effect& contact : active_)
                if (const auto slip = mass_passes_.slip[contact.index])
                    slip(masses_, contact.params, active.params, S(h));
    begun_ = true;
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::finish_step() {
    const S share = step_ == 0 ? S(1) : S(0.5);
    mass_passes_.drift[compensated][leapfrog_](masses_, S(plan_.time_step), share);
    for (int axis = 0; axis < 3; ++axis) {
        std::swap(masses_.velocity[axis], masses_.next_velocity[axis]);
        if (!leapfrog_) masses_.predicted[axis] = masses_.velocity[axis];
    }
    begun_ = false;
    ++step_;
    outcome_.step = step_;
    outcome_.time = double(step_ - plan_.settle_steps) * plan_.time_step;
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::velocity_now(S* out[3]) const {
    // at n = 0, and at every step of symplectic Euler, u is the velocity at t_n; a diverged robot
    // has no better one
    const bool between = leapfrog_ && step_ > 0 && begun_;
    for (int axis = 0; axis < 3; ++axis)
        for (int32_t i = 0; i < body_.masses; ++i) {
            const int32_t site = body_.sites[i];
            const S before = masses_.velocity[axis][site],
                    after = masses_.next_velocity[axis][site];
            out[axis][site] = between ? S(0.5) * (before + after) : before;
        }
}

template <class S, class F, bool compensated>
bool robot_run<S, F, compensated>::touches(int32_t site) const {
    const effects::vector<S> place{masses_.position[0][site], masses_.position[1][site],
                                   masses_.position[2][site]};
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

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::mark_centers() {
    const int64_t moving = plan_.steps - plan_.settle_steps;
    double* const marks[3] = {outcome_.center_start, outcome_.center_middle, outcome_.center_end};
    const int64_t at[3] = {plan_.settle_steps, plan_.settle_steps + moving / 2, plan_.steps};
    for (int mark = 0; mark < 3; ++mark)
        if (step_ == at[mark])
            for (int axis = 0; axis < 3; ++axis) marks[mark][axis] = center(axis);
}

// A robot that has ended needs no force again: most of its memory goes back.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::release_springs() {
    for (array<float>* column : {&body_.stiffness, &body_.damping, &body_.sine, &body_.cosine})
        *column = array<float>();
    columns_.release_springs();
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::sample_due() {
    const int64_t since = step_ - plan_.settle_steps;
    if (since < 0) return;
    for (int kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
        if (traces_.due(kind, since)) record(kind);
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::record(int kind) {
    double* out = traces_.next(kind);
    // the force scratch is free between kick and drift
    S* velocity[3] = {masses_.force[0], masses_.force[1], masses_.force[2]};
    if (kind == LIMAX_TRACE_VELOCITY || kind == LIMAX_TRACE_ENERGY) velocity_now(velocity);
    switch (kind) {
        case LIMAX_TRACE_CENTER_OF_MASS:
            for (int axis = 0; axis < 3; ++axis) out[axis] = center(axis);
            break;
        case LIMAX_TRACE_POSITION:
        case LIMAX_TRACE_VELOCITY:
            for (int32_t i = 0; i < body_.masses; ++i)
                for (int axis = 0; axis < 3; ++axis) {
                    const int32_t site = body_.sites[i];
                    out[3 * i + axis] = kind == LIMAX_TRACE_VELOCITY
                                            ? double(velocity[axis][site])
                                            : origin_[axis] + double(masses_.position[axis][site]);
                }
            break;
        case LIMAX_TRACE_CONTACT: {
            int64_t touching = 0;
            for (int32_t i = 0; i < body_.masses; ++i) touching += touches(body_.sites[i]);
            out[0] = double(touching) / body_.masses;
            break;
        }
        case LIMAX_TRACE_ENERGY: {
            effects::actuation::moment<double> now{0, 0}, rate{0, 0};
            if (actuated_now()) {
                now = effects::actuation::at<double>(clock_, step_ - plan_.settle_steps,
                                                     plan_.time_step);
                rate = effects::actuation::rate_at(clock_, step_ - plan_.settle_steps,
                                                   plan_.time_step);
            }
            const energies energy = measure_energy<S>(body_, setup_.scene, masses_.position,
                                                      velocity, origin_, now, rate);
            out[0] = energy.kinetic;
            out[1] = energy.elastic;
            out[2] = energy.gravitational;
            out[3] = energy.power;
            break;
        }
        case LIMAX_TRACE_STRAIN: {
            const strains strain = measure_strain<S>(body_, masses_.position);
            out[0] = strain.mean;
            out[1] = strain.most;
            break;
        }
    }
}

template <class S, class F, bool compensated>
bool robot_run<S, F, compensated>::advance(scratch& memory, deadline until, int64_t most) {
    if (outcome_.status != LIMAX_ROBOT_RUNNING) return true;
    memory.lend(masses_, springs_);
    const int64_t start = step_;
    const int64_t look_interval = std::max<int64_t>(1, sites_per_look / body_.count);
    const int64_t stop = most > 0 && most < plan_.steps - step_ ? step_ + most : plan_.steps;
    while (true) {
        if (!begun_) {
            const bool due = step_ % check_interval == 0;
            if (due || step_ == plan_.steps) {
                check_limits();
                if (outcome_.status == LIMAX_ROBOT_DIVERGED) break;
            }
            if (due) recenter();
            mark_centers();
            begin();
            sample_due();
            if (step_ == plan_.steps) {
                outcome_.status = LIMAX_ROBOT_DONE;
                break;
            }
            if (step_ % look_interval == 0 && step_ > start &&
                (interrupted() || std::chrono::steady_clock::now() >= until))
                return false;
        }
        if (step_ == stop) return false;
        finish_step();
    }
    traces_.summarize(outcome_);
    release_springs();
    return true;
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::place(const double* positions, const double* velocities) {
    if (step_ > 0 || begun_)
        fail(LIMAX_INVALID_ARGUMENT, "a robot can only be placed before its first step");
    for (int32_t i = 0; i < 3 * body_.masses; ++i)
        if ((positions && !std::isfinite(positions[i])) ||
            (velocities && !std::isfinite(velocities[i])))
            fail(LIMAX_INVALID_ARGUMENT,
                 format("mass %d is to be placed at, or with, a value that is not finite",
                        i / 3 + 1));
    // the robot's own origin comes along, so that fp32 resolves as much there as anywhere
    for (int axis = 0; positions && axis < 3; ++axis) {
        double sum = 0;
        for (int32_t i = 0; i < body_.masses; ++i) sum += positions[3 * i + axis];
        origin_[axis] = whole_origin_steps(sum / body_.masses);
    }
    refresh_params();
    for (int32_t i = 0; i < body_.masses; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t site = body_.sites[i];
            if (positions)
                masses_.position[axis][site] = S(positions[3 * i + axis] - origin_[axis]);
            if (!velocities || masses_.inverse_mass[site] == S(0)) continue;
            masses_.velocity[axis][site] = S(velocities[3 * i + axis]);
            masses_.predicted[axis][site] = masses_.velocity[axis][site];
        }
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::state(scratch& memory, double* positions, double* velocities) {
    memory.lend(masses_, springs_);
    S* velocity[3] = {masses_.force[0], masses_.force[1], masses_.force[2]};
    if (velocities) velocity_now(velocity);
    for (int32_t i = 0; i < body_.masses; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t site = body_.sites[i];
            if (positions)
                positions[3 * i + axis] = origin_[axis] + double(masses_.position[axis][site]);
            if (velocities) velocities[3 * i + axis] = velocity[axis][site];
        }
}

}  // namespace

std::unique_ptr<robot> make_robot(const simulation_setup& setup, int32_t index,
                                  const pass_table& passes, limax_outcome& outcome) {
    const int64_t voxels = setup.grid.voxels();
    return make_robot(setup,
                      spring_body(body_description{
                          setup.grid, setup.voxels.data() + index * voxels,
                          setup.weights.data() + 3 * index * voxels, setup.materials.data(),
                          setup.options.edge, limax_sharing(setup.options.sharing),
                          setup.scene.has(effects::index_of<effects::damping>),
                          setup.scene.has(effects::index_of<effects::actuation>)}),
                      passes, outcome);
}

std::unique_ptr<robot> make_robot(const simulation_setup& setup, spring_body body,
                                  const pass_table& passes, limax_outcome& outcome) {
    switch (setup.options.precision) {
        case LIMAX_SINGLE:
            return std::make_unique<robot_run<float, float, false>>(setup, std::move(body), passes,
                                                                    outcome);
        case LIMAX_COMPENSATED:
            return std::make_unique<robot_run<float, float, true>>(setup, std::move(body), passes,
                                                                   outcome);
        case LIMAX_MIXED:
            return std::make_unique<robot_run<double, float, false>>(setup, std::move(body), passes,
                                                                     outcome);
        default:
            return std::make_unique<robot_run<double, double, false>>(setup, std::move(body),
                                                                      passes, outcome);
    }
}

}  // namespace limax::cpu
