// robot.cpp: runs the steps of one robot: checks its limits, records its centre of mass and its
// samples, and ends it. robot_state.h holds its state, robot_samples.h its records, and
// kick_drift.h and runge_kutta.h the order of a step. A step has "begun" when its forces at
// t_n are computed and its masses not yet moved; all velocities around t_n are available then.
#include "backend/cpu/robot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "backend/cpu/kick_drift.h"
#include "backend/cpu/robot_control.h"
#include "backend/cpu/robot_samples.h"
#include "backend/cpu/robot_state.h"
#include "backend/cpu/runge_kutta.h"

namespace limax::cpu {

namespace {

// Sites moved between checks of the clock and the stop flag: well under a millisecond.
constexpr int64_t sites_per_look = 16384;

// The steps of a robot with this body, and their outcome.
schedule planned(const simulation_setup& setup, const spring_body& body, limax_outcome& outcome) {
    outcome.time_step_bound =
        time_step_bound(body, setup.scene, limax_integrator(setup.options.integrator),
                        limax_bound(setup.options.bound));
    const schedule plan = make_schedule(setup.options, setup.scene, setup.grid,
                                        outcome.time_step_bound, setup.amplitude());
    if (std::isinf(outcome.time_step_bound)) outcome.time_step_bound = NAN;
    outcome.status = LIMAX_ROBOT_RUNNING;
    outcome.steps = plan.steps;
    outcome.time_step = plan.time_step;
    outcome.time = -double(plan.settle_steps) * plan.time_step;
    outcome.masses = body.masses;
    outcome.springs = body.springs;
    outcome.mass = body.total_mass;
    return plan;
}

// S and `compensated` as in robot_columns.
template <class S, bool compensated>
class robot_run final : public robot {
public:
    robot_run(const simulation_setup& setup, int32_t index, spring_body body,
              const pass_table& passes, limax_outcome& outcome)
        : options_(setup.options),
          passes_(passes),
          outcome_(outcome),
          plan_(planned(setup, body, outcome)),
          marks_{plan_.settle_steps, plan_.settle_steps + (plan_.steps - plan_.settle_steps) / 2,
                 plan_.steps},
          ticks_(options_.integrator == LIMAX_RK4 ? runge_kutta<S, compensated>::ticks_per_step
                                                  : 1),
          state_(setup, std::move(body), passes, plan_.time_step / ticks_),
          stepper_(make_stepper()) {
        if (plan_.tick) {
            control_ = std::make_unique<robot_control<S, compensated>>(
                setup, index, state_.body, passes, plan_, state_.columns, state_.forces);
            control_->follow();
        }
        samples_ = std::make_unique<robot_samples<S, compensated>>(plan_, state_, *stepper_,
                                                                   control_.get(), ticks_);
    }

    bool advance(scratch& memory, deadline until, int64_t most) override;
    void place(const double* positions, const double* velocities) override;
    void state(scratch& memory, double* positions, double* velocities) override;
    void block(int32_t which, double* out) const override {
        solid::write_state(state_.blocks->at(which), state_.origin, between(), out);
    }
    bool set_state(int32_t state, const double* values) override {
        return control_ && control_->set_state(state, values);
    }
    const int32_t* sites() const override { return state_.body.sites.data(); }
    int64_t samples(int32_t kind) const override { return samples_->all().taken(kind); }
    const double* trace(int32_t kind) const override { return samples_->all().data(kind); }

private:
    std::unique_ptr<stepper<S>> make_stepper();
    void check_limits();
    bool take_tick();
    void count_steps(int64_t count);
    int64_t steps_without_events(int64_t stop) const;
    void mark_centers();
    void mark_block();
    // Whether the velocities at t_n are half way between those before and after the kick.
    bool between() const { return options_.integrator == LIMAX_LEAPFROG && step_ > 0 && begun_; }

    const limax_simulation_options& options_;
    const pass_table& passes_;
    limax_outcome& outcome_;
    const schedule plan_;
    // steps at which the centre of mass is recorded
    const std::array<int64_t, 3> marks_;
    // ticks of the muscles' clock in a step
    const int ticks_;
    robot_state<S, compensated> state_;
    std::unique_ptr<stepper<S>> stepper_;
    std::unique_ptr<robot_control<S, compensated>> control_;  // null in a scene without it
    std::unique_ptr<robot_samples<S, compensated>> samples_;
    int64_t step_ = 0;
    bool begun_ = false;
};

template <class S, bool compensated>
std::unique_ptr<stepper<S>> robot_run<S, compensated>::make_stepper() {
    if (options_.integrator == LIMAX_RK4)
        return std::make_unique<runge_kutta<S, compensated>>(plan_, state_.body, passes_,
                                                             state_.columns, state_.forces);
    return std::make_unique<kick_drift<S, compensated>>(options_.integrator == LIMAX_LEAPFROG,
                                                        plan_, state_.body, passes_, state_.columns,
                                                        state_.forces);
}

// Ends the robot if a limit is broken.
template <class S, bool compensated>
void robot_run<S, compensated>::check_limits() {
    const mass_arrays<S>& masses = state_.columns.masses;
    state_.columns.show_springs(masses);
    const limit_breaks breaks = passes_of<S>(passes_).limit_masses(
        masses, S(options_.max_speed), S(coarse_speed(options_.edge, plan_.time_step)));
    if (breaks.coarse) outcome_.coarse = 1;
    const solid::breaks of_block =
        state_.blocks ? state_.blocks->broken(options_.max_speed) : solid::breaks{false, false};
    const bool nonfinite = breaks.nonfinite || of_block.nonfinite;
    const bool speed = breaks.speed || of_block.speed;
    const int32_t stretched =
        passes_of<S>(passes_).limit_springs(state_.columns.springs, S(options_.max_stretch));
    if (!nonfinite && !speed && !stretched) return;
    outcome_.status = LIMAX_ROBOT_DIVERGED;
    outcome_.reason = nonfinite ? LIMAX_NONFINITE : speed ? LIMAX_SPEED : LIMAX_STRETCH;
}

// Lets the controller act. Returns false, and ends the robot, if it gives a value that is not
// finite.
template <class S, bool compensated>
bool robot_run<S, compensated>::take_tick() {
    if (!control_->tick(step_, state_.origin, state_.blocks.get())) {
        outcome_.status = LIMAX_ROBOT_DIVERGED;
        outcome_.reason = LIMAX_CONTROL;
        return false;
    }
    state_.forces.begin_drive(ticks_ * (step_ - plan_.settle_steps), ticks_);
    return true;
}

template <class S, bool compensated>
void robot_run<S, compensated>::count_steps(int64_t count) {
    step_ += count;
    outcome_.step = step_;
    outcome_.time = double(step_ - plan_.settle_steps) * plan_.time_step;
}

// How many steps from this one on may be taken in one pass: nothing is to be done between them.
template <class S, bool compensated>
int64_t robot_run<S, compensated>::steps_without_events(int64_t stop) const {
    const int64_t most = std::min(step_ + steps_at_once(state_.body.count), stop);
    int64_t next = step_ + 1;
    while (next < most && next % check_interval != 0 && samples_->idle(next) &&
           !(control_ && control_->due(next)) &&
           std::find(marks_.begin(), marks_.end(), next) == marks_.end())
        ++next;
    return next - step_;
}

// Where the robot and its first block are at t = 0, half way from there, and at the end.
template <class S, bool compensated>
void robot_run<S, compensated>::mark_centers() {
    double* const marks[3] = {outcome_.center_start, outcome_.center_middle, outcome_.center_end};
    double* const block_marks[3] = {outcome_.block_start, outcome_.block_middle,
                                    outcome_.block_end};
    for (int mark = 0; mark < 3; ++mark) {
        if (step_ != marks_[mark]) continue;
        for (int axis = 0; axis < 3; ++axis) marks[mark][axis] = state_.center(axis);
        if (!state_.blocks) continue;
        double of_block[LIMAX_BLOCK_STATE];
        block(0, of_block);
        std::copy_n(of_block, 3, block_marks[mark]);
    }
}

// Records the last velocity and the tilt of the first block.
template <class S, bool compensated>
void robot_run<S, compensated>::mark_block() {
    const effects::vector<double> velocity = solid::velocity(state_.blocks->at(0), between());
    outcome_.block_velocity[0] = velocity.x;
    outcome_.block_velocity[1] = velocity.y;
    outcome_.block_velocity[2] = velocity.z;
    outcome_.block_upright = rotation_of(state_.blocks->at(0).block.points).z.z;
}

template <class S, bool compensated>
bool robot_run<S, compensated>::advance(scratch& memory, deadline until, int64_t most) {
    if (outcome_.status != LIMAX_ROBOT_RUNNING) return true;
    memory.lend(state_.columns.masses, state_.columns.springs);
    const int64_t start = step_;
    const int64_t look_interval = std::max<int64_t>(1, sites_per_look / state_.body.count);
    const int64_t stop = most > 0 && most < plan_.steps - step_ ? step_ + most : plan_.steps;
    while (true) {
        if (!begun_) {
            const bool due = step_ % check_interval == 0;
            if (due || step_ == plan_.steps) {
                check_limits();
                if (outcome_.status == LIMAX_ROBOT_DIVERGED) break;
            }
            if (due) state_.recenter();
            mark_centers();
            if (control_ && control_->due(step_)) {
                samples_->before_tick(step_);
                if (!take_tick()) break;
            }
            const bool ends = step_ % look_interval == 0 && step_ > start &&
                              (interrupted() || std::chrono::steady_clock::now() >= until);
            if (step_ < stop && !ends && samples_->idle(step_)) {
                const int64_t together = steps_without_events(stop);
                if (stepper_->whole(step_, together)) {
                    count_steps(together);
                    continue;
                }
            }
            stepper_->begin(step_);
            begun_ = true;
            samples_->take(step_);
            if (step_ == plan_.steps) {
                outcome_.status = LIMAX_ROBOT_DONE;
                if (state_.blocks) mark_block();
                break;
            }
            if (ends) return false;
        }
        if (step_ == stop) return false;
        stepper_->finish(step_);
        begun_ = false;
        count_steps(1);
    }
    samples_->all().summarize(outcome_);
    // no more forces are needed: most of the memory can be freed
    state_.release_springs();
    stepper_->release();
    return true;
}

template <class S, bool compensated>
void robot_run<S, compensated>::place(const double* positions, const double* velocities) {
    if (step_ > 0 || begun_)
        fail(LIMAX_INVALID_ARGUMENT, "a robot can only be placed before its first step");
    state_.place(positions, velocities);
}

template <class S, bool compensated>
void robot_run<S, compensated>::state(scratch& memory, double* positions, double* velocities) {
    mass_arrays<S>& masses = state_.columns.masses;
    memory.lend(masses, state_.columns.springs);
    if (positions) state_.write(masses.position, state_.origin, positions);
    if (!velocities) return;
    // no part of a step is under way, so the scratch of forces is free
    S* const velocity[3] = {masses.force[0], masses.force[1], masses.force[2]};
    stepper_->velocity_now(step_, begun_, velocity);
    state_.write(velocity, nullptr, velocities);
}

}  // namespace

std::unique_ptr<robot> make_robot(const simulation_setup& setup, int32_t index,
                                  const pass_table& passes, limax_outcome& outcome) {
    const int64_t voxels = setup.grid.voxels();
    spring_body body(body_description{
        setup.grid, setup.voxels.data() + index * voxels, setup.weights.data() + 3 * index * voxels,
        setup.materials.data(), setup.options.edge, limax_sharing(setup.options.sharing),
        setup.scene.has(effects::index_of<effects::damping>),
        (setup.scene.mask() & effects::muscle_bits) != 0,
        (setup.scene.mask() & effects::face_bits) != 0,
        setup.scene.has(effects::index_of<effects::control>)});
    switch (setup.options.precision) {
        case LIMAX_SINGLE:
            return std::make_unique<robot_run<float, false>>(setup, index, std::move(body), passes,
                                                             outcome);
        case LIMAX_COMPENSATED:
            return std::make_unique<robot_run<float, true>>(setup, index, std::move(body), passes,
                                                            outcome);
        default:
            return std::make_unique<robot_run<double, false>>(setup, index, std::move(body), passes,
                                                              outcome);
    }
}

}  // namespace limax::cpu
