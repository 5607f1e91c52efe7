// robot.cpp: what happens to a robot around its steps: start, looks at its limits, its own origin,
// samples, end. kick_drift.h, runge_kutta.h and xpbd.h hold the order of a step. "Begun" is the
// state in which a step's forces at t_n are done and its masses not yet moved, where all velocities
// around t_n are at hand: samples are taken there.
#include "backend/cpu/robot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "backend/cpu/kick_drift.h"
#include "backend/cpu/runge_kutta.h"
#include "backend/cpu/xpbd.h"
#include "physics/held.h"
#include "physics/integrator.h"
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
    bool block(double* out) const override;
    const int32_t* sites() const override { return body_.sites.data(); }
    int64_t samples(int32_t kind) const override { return traces_.taken(kind); }
    const double* trace(int32_t kind) const override { return traces_.data(kind); }

private:
    std::unique_ptr<stepper<S>> make_stepper();
    void put_down();
    void move_origin(const std::array<double, 3>& shift);
    void check_limits();
    void recenter();
    void finish_step();
    void mark_centers();
    void mark_block();
    // Whether the velocities at t_n are half way between those before and after the kick.
    bool between() const {
        return setup_.options.integrator == LIMAX_LEAPFROG && step_ > 0 && begun_;
    }
    void release_springs();
    void keep_books();
    void sample_due();
    void record(int kind);
    // Columns of the masses as [mass][3], `from` an origin unless it is null: -0 + 0 loses a sign.
    void write(const S* const column[3], const double* from, double* out) const {
        for (int32_t i = 0; i < body_.masses; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                const double value = column[axis][body_.sites[i]];
                out[3 * i + axis] = from ? from[axis] + value : value;
            }
    }
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
    // ticks of the muscles' clock in a step
    const int ticks_;
    robot_columns<S, F, compensated> columns_;
    mass_arrays<S>& masses_ = columns_.masses;
    spring_arrays<F>& springs_ = columns_.springs;
    std::unique_ptr<robot_forces<S, F, compensated>> forces_;
    std::unique_ptr<rigid_block<S>> block_;  // null in a scene without one
    std::unique_ptr<stepper<S>> stepper_;
    double origin_[3] = {0, 0, 0};  // m
    int64_t step_ = 0;
    bool begun_ = false;
    traces traces_;
    std::unique_ptr<work_ledger<S>> ledger_;  // null unless recorded
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
      ticks_(setup.options.integrator == LIMAX_RK4 ? runge_kutta<S, F, compensated>::ticks_per_step
                                                   : 1),
      columns_(body_, setup.options.integrator == LIMAX_LEAPFROG) {
    outcome_.time_step_bound =
        time_step_bound(body_, setup.scene, limax_integrator(setup.options.integrator));
    plan_ = make_schedule(setup.options, setup.scene, outcome_.time_step_bound);
    forces_ = std::make_unique<robot_forces<S, F, compensated>>(setup.scene, body_, table, columns_,
                                                                plan_.time_step / ticks_);
    stepper_ = make_stepper();
    if (plan_.every[LIMAX_TRACE_LEDGER]) {
        ledger_ = std::make_unique<work_ledger<S>>(body_);
        forces_->tell(*ledger_);
    }
    outcome_.status = LIMAX_ROBOT_RUNNING;
    outcome_.steps = plan_.steps;
    outcome_.time_step = plan_.time_step;
    outcome_.time = -double(plan_.settle_steps) * plan_.time_step;
    outcome_.masses = body_.masses;
    outcome_.springs = body_.springs;
    outcome_.mass = body_.total_mass;
    traces_ = traces(plan_, body_.masses);
    put_down();
    move_origin({0, 0, 0});
}

template <class S, class F, bool compensated>
std::unique_ptr<stepper<S>> robot_run<S, F, compensated>::make_stepper() {
    if (setup_.options.integrator == LIMAX_RK4)
        return std::make_unique<runge_kutta<S, F, compensated>>(plan_, body_, passes_, columns_,
                                                                *forces_);
    if (setup_.options.integrator == LIMAX_XPBD)
        return std::make_unique<xpbd<S, F, compensated>>(plan_, body_, passes_, columns_, *forces_);
    return std::make_unique<kick_drift<S, F, compensated>>(
        setup_.options.integrator == LIMAX_LEAPFROG, plan_, body_, passes_, columns_, *forces_);
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
    if (setup_.scene.has(effects::index_of<effects::block>)) {
        double start[3];
        for (int axis = 0; axis < 3; ++axis) start[axis] = options.position[axis] - origin_[axis];
        block_ = std::make_unique<rigid_block<S>>(setup_.scene, body_, start);
        forces_->meet(*block_);
    }
}

// The robot's own origin has moved by `shift`: what is not a mass follows.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::move_origin(const std::array<double, 3>& shift) {
    forces_->follow(origin_);
    if (block_) block_->follow(origin_, shift.data());
}

// Ends the robot if a limit is broken.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::check_limits() {
    columns_.show_springs(passes_, masses_);
    const limit_breaks breaks =
        mass_passes_.limit(masses_, S(setup_.options.max_speed),
                           S(coarse_speed(setup_.options.edge, plan_.time_step)));
    if (breaks.coarse) outcome_.coarse = 1;
    const solid::breaks of_block =
        block_ ? block_->broken(setup_.options.max_speed) : solid::breaks{false, false};
    const bool nonfinite = breaks.nonfinite || of_block.nonfinite;
    const bool speed = breaks.speed || of_block.speed;
    const int32_t stretched = spring_passes_.limit(springs_, F(setup_.options.max_stretch));
    if (!nonfinite && !speed && !stretched) return;
    outcome_.status = LIMAX_ROBOT_DIVERGED;
    outcome_.reason = nonfinite ? LIMAX_NONFINITE : speed ? LIMAX_SPEED : LIMAX_STRETCH;
}

// Moves the robot's own origin after it: a function of this robot alone.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::recenter() {
    std::array<double, 3> moved = {0, 0, 0};
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
        moved[axis] = shift;
    }
    if (moved != std::array<double, 3>{}) move_origin(moved);
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::finish_step() {
    stepper_->finish(step_);
    begun_ = false;
    ++step_;
    outcome_.step = step_;
    outcome_.time = double(step_ - plan_.settle_steps) * plan_.time_step;
}

template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::mark_centers() {
    const int64_t moving = plan_.steps - plan_.settle_steps;
    double* const marks[3] = {outcome_.center_start, outcome_.center_middle, outcome_.center_end};
    const int64_t at[3] = {plan_.settle_steps, plan_.settle_steps + moving / 2, plan_.steps};
    double* const block_marks[3] = {outcome_.block_start, outcome_.block_middle,
                                    outcome_.block_end};
    for (int mark = 0; mark < 3; ++mark) {
        if (step_ != at[mark]) continue;
        for (int axis = 0; axis < 3; ++axis) marks[mark][axis] = center(axis);
        double of_block[LIMAX_BLOCK_STATE];
        if (block(of_block)) std::copy_n(of_block, 3, block_marks[mark]);
    }
}

// How the block ends up.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::mark_block() {
    const effects::vector<double> velocity = block_->velocity(between());
    outcome_.block_velocity[0] = velocity.x;
    outcome_.block_velocity[1] = velocity.y;
    outcome_.block_velocity[2] = velocity.z;
    outcome_.block_upright = rotation_of(block_->points()).z.z;
}

// A robot that has ended needs no force again: most of its memory goes back.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::release_springs() {
    for (array<float>* column :
         {&body_.stiffness, &body_.damping, &body_.sine, &body_.cosine, &body_.faces})
        *column = array<float>();
    columns_.release_springs();
    stepper_->release();
}

// Adds the works of the moment t_n to the ledger.
template <class S, class F, bool compensated>
void robot_run<S, F, compensated>::keep_books() {
    const int64_t since = step_ - plan_.settle_steps;
    if (since < 0) return;
    S* velocity[3] = {masses_.force[0], masses_.force[1], masses_.force[2]};
    stepper_->velocity_now(step_, begun_, velocity);
    const moving_masses<S> seen{masses_.position, masses_.predicted, velocity, origin_};
    powers now;
    double muscles_ahead = 0;
    add_spring_powers(body_, setup_.scene, seen, forces_->muscles_around(ticks_ * since, ticks_),
                      now, muscles_ahead);
    add_node_powers(body_, setup_.scene, seen, now);
    now.of[work_contact_damping] += forces_->power_of_meetings(velocity);
    if (block_) {
        now.of[work_contact_damping] += block_->contact_power(velocity, between());
        now.of[work_friction] += block_->friction_power();
    }
    ledger_->add_impulse_powers(masses_, now);
    ledger_->add(now, muscles_ahead, since > 0 ? plan_.time_step : 0.0);
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
    if (kind == LIMAX_TRACE_VELOCITY || kind == LIMAX_TRACE_ENERGY || kind == LIMAX_TRACE_LEDGER)
        stepper_->velocity_now(step_, begun_, velocity);
    switch (kind) {
        case LIMAX_TRACE_CENTER_OF_MASS:
            for (int axis = 0; axis < 3; ++axis) out[axis] = center(axis);
            break;
        case LIMAX_TRACE_POSITION: write(masses_.position, origin_, out); break;
        case LIMAX_TRACE_VELOCITY: write(velocity, nullptr, out); break;
        case LIMAX_TRACE_CONTACT: {
            int64_t touching = 0;
            for (int32_t i = 0; i < body_.masses; ++i) touching += forces_->touches(body_.sites[i]);
            out[0] = double(touching) / body_.masses;
            break;
        }
        case LIMAX_TRACE_ENERGY:
        case LIMAX_TRACE_LEDGER: {
            const int64_t tick = ticks_ * (step_ - plan_.settle_steps);
            energies energy = measure_energy<S>(body_, setup_.scene, masses_.position, velocity,
                                                origin_, forces_->template moment<double>(tick),
                                                forces_->moment_rate(tick));
            const double in_meetings = forces_->energy_of_meetings();
            energy.elastic += in_meetings;
            if (kind == LIMAX_TRACE_ENERGY) {
                out[0] = energy.kinetic;
                out[1] = energy.elastic;
                out[2] = energy.gravitational;
                out[3] = energy.power;
                break;
            }
            const double in_contacts =
                in_meetings + contact_energy<S>(body_, setup_.scene,
                                                {masses_.position, velocity, velocity, origin_});
            out[0] = energy.kinetic;
            out[1] = energy.elastic - in_contacts;
            out[2] = in_contacts;
            out[3] = energy.gravitational;
            if (block_) {
                out[0] += block_->kinetic_energy(between());
                out[2] += block_->contact_energy();
                out[3] += block_->gravitational_energy(origin_);
            }
            std::copy_n(ledger_->works(), work_kinds, out + ledger_energies);
            break;
        }
        case LIMAX_TRACE_BLOCK: {
            double of_block[LIMAX_BLOCK_STATE];
            block(of_block);
            std::copy_n(of_block, traces_.width(kind), out);
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
            stepper_->begin(step_);
            begun_ = true;
            if (ledger_) keep_books();
            sample_due();
            if (step_ == plan_.steps) {
                outcome_.status = LIMAX_ROBOT_DONE;
                if (block_) mark_block();
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
    std::array<double, 3> moved = {0, 0, 0};
    for (int axis = 0; positions && axis < 3; ++axis) {
        double sum = 0;
        for (int32_t i = 0; i < body_.masses; ++i) sum += positions[3 * i + axis];
        const double origin = whole_origin_steps(sum / body_.masses);
        moved[axis] = origin - origin_[axis];
        origin_[axis] = origin;
    }
    move_origin(moved);
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
    if (positions) write(masses_.position, origin_, positions);
    if (!velocities) return;
    stepper_->velocity_now(step_, begun_, velocity);
    write(velocity, nullptr, velocities);
}

template <class S, class F, bool compensated>
bool robot_run<S, F, compensated>::block(double* out) const {
    if (!block_) return false;
    block_->write(origin_, between(), out);
    return true;
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
                          setup.scene.has(effects::index_of<effects::actuation>),
                          (setup.scene.mask() & effects::face_bits) != 0}),
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
