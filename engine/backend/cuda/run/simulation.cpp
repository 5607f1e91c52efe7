// simulation.cpp: the robots of a simulation, distributed over the GPUs of this host. Robots that
// do not fit on a GPU at once are halved until a part fits, and the parts run one at a time. A
// robot's results depend only on the robot.
#include <algorithm>
#include <chrono>

#include "backend/cuda/run/robots.h"

namespace limax::cuda {

namespace {

// The robots of one GPU.
class robot_batches {
public:
    robot_batches(const simulation_setup& setup, std::vector<int32_t> robots,
                  std::shared_ptr<gpu_team> team, gpu_place& place, limax_outcome* outcomes)
        : make_([=, &setup, &place](const std::vector<int32_t>& some) {
              return batch{some, make_robots(setup, some, team, place, outcomes)};
          }) {
        batches_.push_back(make_(robots));
    }

    // The batch of a robot, as it is.
    gpu_robots& batch_of(int32_t robot) const { return *batches_[place_of(robot)].stepper; }
    // The same, the only one on the GPU.
    gpu_robots& wake_for(int32_t robot);
    gpu_robots& wake_first() { return wake_for(batches_.front().robots.front()); }

    void advance(double seconds, int64_t steps);
    void enqueue(double seconds) {
        if (enqueued_) return;
        gpu_robots* const next = next_unfinished();
        if (next) next->enqueue(seconds);
        enqueued_ = next;
    }
    void collect() {
        if (gpu_robots* sent = std::exchange(enqueued_, nullptr)) sent->collect();
    }

private:
    struct batch {
        std::vector<int32_t> robots;  // ascending
        std::unique_ptr<gpu_robots> stepper;
        bool begun = false;  // it has been awake
    };

    std::size_t place_of(int32_t robot) const {
        std::size_t at = 0;
        while (!std::binary_search(batches_[at].robots.begin(), batches_[at].robots.end(), robot))
            ++at;
        return at;
    }
    gpu_robots* next_unfinished() {
        for (const batch& each : batches_)
            if (!each.stepper->finished()) return &wake_for(each.robots.front());
        return nullptr;
    }

    const std::function<batch(const std::vector<int32_t>&)> make_;
    std::vector<batch> batches_;
    gpu_robots* enqueued_ = nullptr;
};

// A batch that has never been awake is halved as long as it does not fit; one robot that does not
// fit is refused.
gpu_robots& robot_batches::wake_for(int32_t robot) {
    while (true) {
        const std::size_t at = place_of(robot);
        for (std::size_t i = 0; i < batches_.size(); ++i)
            if (i != at) batches_[i].stepper->sleep();
        try {
            batches_[at].stepper->wake();
            batches_[at].begun = true;
            return *batches_[at].stepper;
        } catch (const error& problem) {
            const std::vector<int32_t> robots = batches_[at].robots;
            if (problem.status() != LIMAX_OUT_OF_MEMORY || robots.size() < 2 || batches_[at].begun)
                throw;
            const auto half = robots.begin() + std::ptrdiff_t(robots.size() / 2);
            batches_[at] = make_({robots.begin(), half});
            batches_.insert(batches_.begin() + std::ptrdiff_t(at) + 1, make_({half, robots.end()}));
        }
    }
}

void robot_batches::advance(double seconds, int64_t steps) {
    if (steps > 0) {
        // halving while waking changes the list: by robot, in order
        for (std::size_t i = 0; i < batches_.size() && !interrupted(); ++i)
            if (!batches_[i].stepper->finished())
                wake_for(batches_[i].robots.front()).advance(seconds, steps);
        return;
    }
    const auto begin = std::chrono::steady_clock::now();
    for (gpu_robots* next = next_unfinished(); next && !interrupted(); next = next_unfinished()) {
        const double left =
            seconds -
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        if (left <= 0) return;
        next->advance(left, 0);
        if (!next->finished()) return;
    }
}

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
    void block(int32_t robot, int32_t which, double* out) override;
    const char* describe() override;

private:
    // The part of a robot, with all that was sent to its GPU collected.
    robot_batches* part_of(int32_t robot) const {
        if (gpu_of_[robot] < 0) return nullptr;
        robot_batches* const part = parts_[gpu_of_[robot]].get();
        part->collect();
        return part;
    }
    gpu_robots& simulated(int32_t robot);
    void on_all_gpus(const std::function<void(robot_batches&)>& work);
    limax_progress progress() const;

    simulation_setup setup_;
    const std::shared_ptr<gpu_team> team_;
    std::vector<limax_outcome> outcomes_;
    std::vector<int32_t> gpu_of_;  // [robot], -1 for one that is not simulated
    std::vector<std::unique_ptr<robot_batches>> parts_;  // [gpu], null without robots
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
                                           : std::make_unique<robot_batches>(
                                                 setup_, std::move(robots[k]), team_,
                                                 *team_->places()[k], outcomes_.data()));
}

// Runs each GPU's part on its own thread; rethrows the first exception.
void cuda_simulation::on_all_gpus(const std::function<void(robot_batches&)>& work) {
    team_->threads().run_on_all([&](int gpu) {
        if (robot_batches* part = parts_[std::size_t(gpu)].get()) work(*part);
    });
}

limax_progress cuda_simulation::advance(double seconds, int64_t steps) {
    on_all_gpus([&](robot_batches& part) {
        part.collect();
        part.advance(seconds, steps);
    });
    return progress();
}

void cuda_simulation::enqueue(double seconds) {
    on_all_gpus([&](robot_batches& part) { part.enqueue(seconds); });
}

limax_progress cuda_simulation::collect() {
    on_all_gpus([&](robot_batches& part) { part.collect(); });
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

void cuda_simulation::trace(int32_t robot, int32_t kind, const double** data, int64_t* samples,
                            int64_t* width) const {
    const robot_batches* part = part_of(robot);
    *data = part ? part->batch_of(robot).trace(robot, kind) : nullptr;
    *samples = part ? part->batch_of(robot).samples(robot, kind) : 0;
    *width = trace_width(kind, outcomes_[robot].masses, setup_.grid.voxels(), setup_.scene);
}

const int32_t* cuda_simulation::sites(int32_t robot) const {
    robot_batches* part = part_of(robot);
    return part ? part->wake_for(robot).sites(robot) : nullptr;
}

gpu_robots& cuda_simulation::simulated(int32_t robot) {
    robot_batches* part = part_of(robot);
    if (!part)
        fail(LIMAX_INVALID_ARGUMENT,
             format("robot %d is not simulated: it has no state", robot + 1));
    return part->wake_for(robot);
}

void cuda_simulation::place(int32_t robot, const double* positions, const double* velocities) {
    simulated(robot).place(robot, positions, velocities);
}

void cuda_simulation::state(int32_t robot, double* positions, double* velocities) {
    simulated(robot).state(robot, positions, velocities);
}

void cuda_simulation::block(int32_t robot, int32_t which, double* out) {
    require_block(setup_.scene, which);
    simulated(robot).block(robot, which, out);
}

const char* cuda_simulation::describe() {
    description_ = "{\"device\":\"cuda\"}";
    for (const auto& part : parts_)
        if (part) {
            part->collect();
            description_ = part->wake_first().describe();
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
