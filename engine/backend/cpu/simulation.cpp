// simulation.cpp: many robots in parallel, one thread each. A robot's results depend only
// on the robot.
#include <algorithm>
#include <atomic>

#include "backend/cpu/device.h"
#include "backend/cpu/robot.h"

namespace limax::cpu {

namespace {

class cpu_simulation final : public simulation {
public:
    cpu_simulation(simulation_setup setup, const pass_table& passes,
                   std::shared_ptr<thread_team> team);

    limax_progress advance(double seconds, int64_t steps) override;
    const limax_outcome* outcomes() const override { return outcomes_.data(); }
    void trace(int32_t robot, int32_t kind, const double** data, int64_t* samples,
               int64_t* width) const override;
    const int32_t* sites(int32_t robot) const override;
    void place(int32_t robot, const double* positions, const double* velocities) override;
    void state(int32_t robot, double* positions, double* velocities) override;
    void block(int32_t robot, int32_t which, double* out) override;
    void set_state(int32_t robot, int32_t state, const double* values) override;
    const char* describe() override;

private:
    robot& prepared(int32_t index);
    robot& simulated(int32_t index);
    limax_progress progress() const;

    simulation_setup setup_;
    const pass_table& passes_;
    std::shared_ptr<thread_team> team_;
    std::vector<limax_outcome> outcomes_;
    std::vector<std::unique_ptr<robot>> robots_;  // prepared by the thread that first steps them
    std::vector<int32_t> unfinished_;
    std::vector<std::unique_ptr<scratch>> scratch_;  // [thread]
    int32_t chosen_ = 0;                             // robots in the mask
    std::string description_;
};

cpu_simulation::cpu_simulation(simulation_setup setup, const pass_table& passes,
                               std::shared_ptr<thread_team> team)
    : setup_(std::move(setup)),
      passes_(passes),
      team_(std::move(team)),
      outcomes_(setup_.count),
      robots_(setup_.count) {
    for (int32_t i = 0; i < setup_.count; ++i) {
        start_outcome(setup_, i, outcomes_[i]);
        chosen_ += setup_.mask[i] != 0;
        if (outcomes_[i].status == LIMAX_ROBOT_RUNNING) unfinished_.push_back(i);
    }
    for (int thread = 0; thread < team_->size(); ++thread)
        scratch_.push_back(std::make_unique<scratch>(setup_.grid));
}

robot& cpu_simulation::prepared(int32_t index) {
    if (!robots_[index]) robots_[index] = make_robot(setup_, index, passes_, outcomes_[index]);
    return *robots_[index];
}

limax_progress cpu_simulation::advance(double seconds, int64_t steps) {
    const deadline until = std::chrono::steady_clock::now() +
                           std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                               std::chrono::duration<double>(std::clamp(seconds, 0.0, 1e6)));
    std::atomic<std::size_t> next{0};
    // with a number of steps every unfinished robot gets them, however long it takes
    const auto time_left = [&] { return steps > 0 || std::chrono::steady_clock::now() < until; };
    team_->run_on_all([&](int thread) {
        while (time_left() && !interrupted()) {
            const std::size_t i = next++;
            if (i >= unfinished_.size()) return;
            prepared(unfinished_[i])
                .advance(*scratch_[thread], steps > 0 ? deadline::max() : until, steps);
        }
    });
    std::erase_if(unfinished_,
                  [&](int32_t i) { return outcomes_[i].status != LIMAX_ROBOT_RUNNING; });
    return progress();
}

limax_progress cpu_simulation::progress() const {
    limax_progress result{};
    result.robots = chosen_;
    result.done = chosen_ - static_cast<int32_t>(unfinished_.size());
    result.finished = unfinished_.empty();
    result.interrupted = interrupted();
    double prepared = 0, running = 0;
    for (int32_t i = 0; i < setup_.count; ++i) {
        if (!setup_.mask[i] || setup_.bodies[i].status != LIMAX_BODY_VALID) continue;
        ++running;
        if (!robots_[i]) continue;
        ++prepared;
        const limax_outcome& outcome = outcomes_[i];
        result.steps += double(outcome.step);
        result.steps_total +=
            double(outcome.status == LIMAX_ROBOT_DIVERGED ? outcome.step : outcome.steps);
        result.spring_steps += double(outcome.step) * outcome.springs;
    }
    // assumes that the other robots take as many steps on average
    if (prepared > 0) result.steps_total *= running / prepared;
    return result;
}

void cpu_simulation::trace(int32_t index, int32_t kind, const double** data, int64_t* samples,
                           int64_t* width) const {
    const robot* robot = robots_[index].get();
    *data = robot ? robot->trace(kind) : nullptr;
    *samples = robot ? robot->samples(kind) : 0;
    *width = trace_width(kind, outcomes_[index].masses, setup_.grid.voxels(), setup_.scene);
}

const int32_t* cpu_simulation::sites(int32_t index) const {
    return robots_[index] ? robots_[index]->sites() : nullptr;
}

robot& cpu_simulation::simulated(int32_t index) {
    if (outcomes_[index].status == LIMAX_ROBOT_SKIPPED ||
        outcomes_[index].status == LIMAX_ROBOT_INVALID)
        fail(LIMAX_INVALID_ARGUMENT,
             format("robot %d is not simulated: it has no state", index + 1));
    return prepared(index);
}

void cpu_simulation::place(int32_t index, const double* positions, const double* velocities) {
    simulated(index).place(positions, velocities);
}

void cpu_simulation::state(int32_t index, double* positions, double* velocities) {
    simulated(index).state(*scratch_[0], positions, velocities);
}

void cpu_simulation::block(int32_t index, int32_t which, double* out) {
    require_block(setup_.scene, which);
    simulated(index).block(which, out);
}

void cpu_simulation::set_state(int32_t index, int32_t state, const double* values) {
    if (!simulated(index).set_state(state, values))
        fail(LIMAX_INVALID_ARGUMENT, format("the controller sets no state s[%d]", state));
}

const char* cpu_simulation::describe() {
    description_ = format("{\"device\":\"cpu\",\"passes\":\"%s\"}", passes_.isa);
    return description_.c_str();
}

}  // namespace

std::unique_ptr<simulation> make_simulation(simulation_setup setup, const pass_table& passes,
                                            std::shared_ptr<thread_team> team) {
    return std::make_unique<cpu_simulation>(std::move(setup), passes, std::move(team));
}

}  // namespace limax::cpu
