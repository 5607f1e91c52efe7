// simulation.cpp: the robots of a simulation, distributed over the GPUs of this host. A robot's
// results depend only on the robot.
#include "backend/cuda/run/robots.h"

namespace limax::cuda {

namespace {

class cuda_simulation final : public simulation {
public:
    cuda_simulation(simulation_setup setup, std::shared_ptr<gpu_team> team);

    limax_progress advance(double seconds, int64_t steps) override;
    void enqueue(double seconds) override;
    limax_progress collect() override;
    const limax_outcome* outcomes() const override { return outcomes_.data(); }
    void trace(int32_t robot, int32_t kind, const double** data, int64_t* samples,
               int64_t* width) const override;
    const int32_t* sites(int32_t robot) const override;
    void place(int32_t robot, const double* positions, const double* velocities) override;
    void state(int32_t robot, double* positions, double* velocities) override;
    void block(int32_t robot, double* out) override;
    const char* describe() override;

private:
    gpu_robots* part_of(int32_t robot) const;
    gpu_robots& simulated(int32_t robot);
    void on_all_gpus(const std::function<void(gpu_robots&)>& work);
    limax_progress progress() const;

    simulation_setup setup_;
    const std::shared_ptr<gpu_team> team_;
    std::vector<limax_outcome> outcomes_;
    std::vector<int32_t> gpu_of_;  // [robot], -1 for one that is not simulated
    std::vector<std::unique_ptr<gpu_robots>> parts_;
    std::string description_;
    int32_t chosen_ = 0;  // robots in the mask
};

cuda_simulation::cuda_simulation(simulation_setup setup, std::shared_ptr<gpu_team> team)
    : setup_(std::move(setup)),
      team_(std::move(team)),
      outcomes_(setup_.count),
      gpu_of_(setup_.count, -1) {
    const std::size_t gpus = team_->places().size();
    std::vector<std::vector<int32_t>> robots(gpus);
    std::size_t next = 0;
    for (int32_t i = 0; i < setup_.count; ++i) {
        start_outcome(setup_, i, outcomes_[i]);
        chosen_ += setup_.mask[i] != 0;
        if (outcomes_[i].status != LIMAX_ROBOT_RUNNING) continue;
        gpu_of_[i] = int32_t(next++ % gpus);
        robots[gpu_of_[i]].push_back(i);
    }
    for (std::size_t k = 0; k < gpus; ++k)
        parts_.push_back(robots[k].empty() ? nullptr
                                           : make_robots(setup_, std::move(robots[k]), team_,
                                                         *team_->places()[k], outcomes_.data()));
}

// Runs each GPU's part on its own thread; rethrows the first exception.
void cuda_simulation::on_all_gpus(const std::function<void(gpu_robots&)>& work) {
    team_->threads().run_on_all([&](int gpu) {
        if (gpu_robots* part = parts_[std::size_t(gpu)].get()) work(*part);
    });
}

limax_progress cuda_simulation::advance(double seconds, int64_t steps) {
    on_all_gpus([&](gpu_robots& part) { part.advance(seconds, steps); });
    return progress();
}

void cuda_simulation::enqueue(double seconds) {
    on_all_gpus([&](gpu_robots& part) { part.enqueue(seconds); });
}

limax_progress cuda_simulation::collect() {
    on_all_gpus([&](gpu_robots& part) { part.collect(); });
    return progress();
}

limax_progress cuda_simulation::progress() const {
    limax_progress result{};
    result.robots = chosen_;
    result.interrupted = interrupted();
    for (int32_t i = 0; i < setup_.count; ++i) {
        if (!setup_.mask[i]) continue;
        const limax_outcome& outcome = outcomes_[i];
        result.done += outcome.status != LIMAX_ROBOT_RUNNING;
        if (gpu_of_[i] < 0) continue;
        result.steps += double(outcome.step);
        result.steps_total +=
            double(outcome.status == LIMAX_ROBOT_DIVERGED ? outcome.step : outcome.steps);
        result.spring_steps += double(outcome.step) * outcome.springs;
    }
    result.finished = result.done == chosen_;
    return result;
}

gpu_robots* cuda_simulation::part_of(int32_t robot) const {
    return gpu_of_[robot] < 0 ? nullptr : parts_[gpu_of_[robot]].get();
}

void cuda_simulation::trace(int32_t robot, int32_t kind, const double** data, int64_t* samples,
                            int64_t* width) const {
    gpu_robots* part = part_of(robot);
    *data = part ? part->trace(robot, kind) : nullptr;
    *samples = part ? part->samples(robot, kind) : 0;
    *width = trace_width(kind, outcomes_[robot].masses);
}

const int32_t* cuda_simulation::sites(int32_t robot) const {
    gpu_robots* part = part_of(robot);
    return part ? part->sites(robot) : nullptr;
}

gpu_robots& cuda_simulation::simulated(int32_t robot) {
    gpu_robots* part = part_of(robot);
    if (!part)
        fail(LIMAX_INVALID_ARGUMENT,
             format("robot %d is not simulated: it has no state", robot + 1));
    return *part;
}

void cuda_simulation::place(int32_t robot, const double* positions, const double* velocities) {
    simulated(robot).place(robot, positions, velocities);
}

void cuda_simulation::state(int32_t robot, double* positions, double* velocities) {
    simulated(robot).state(robot, positions, velocities);
}

void cuda_simulation::block(int32_t robot, double* out) {
    if (!setup_.scene.has(effects::index_of<effects::block>)) simulation::block(robot, out);
    simulated(robot).block(robot, out);
}

const char* cuda_simulation::describe() {
    description_ = "{\"device\":\"cuda\"}";
    for (const auto& part : parts_)
        if (part) {
            description_ = part->describe();
            break;
        }
    return description_.c_str();
}

}  // namespace

std::unique_ptr<simulation> make_simulation(simulation_setup setup,
                                            std::shared_ptr<gpu_team> team) {
    return std::make_unique<cuda_simulation>(std::move(setup), std::move(team));
}

}  // namespace limax::cuda
