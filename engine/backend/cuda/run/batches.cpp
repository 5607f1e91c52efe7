// batches.cpp: robots that do not fit on a GPU at once: they are halved until a part fits, and the
// parts run one at a time. Results do not depend on it.
#include <algorithm>
#include <chrono>

#include "backend/cuda/run/robots.h"

namespace limax::cuda {

namespace {

class robot_batches final : public gpu_robots {
public:
    robot_batches(const simulation_setup& setup, std::vector<int32_t> robots,
                  std::shared_ptr<gpu_team> team, gpu_place& place, limax_outcome* outcomes)
        : setup_(setup), team_(std::move(team)), place_(place), outcomes_(outcomes) {
        add(0, std::move(robots));
    }

    void wake() override { wake_for(batches_.front().robots.front()); }
    void sleep() override {
        for (batch& each : batches_) each.stepper->sleep();
    }
    void advance(double seconds, int64_t steps) override;
    void enqueue(double seconds) override;
    void collect() override;
    bool finished() const override {
        return std::all_of(batches_.begin(), batches_.end(),
                           [](const batch& each) { return each.stepper->finished(); });
    }
    int64_t samples(int32_t robot, int32_t kind) const override {
        return batches_[batch_of(robot)].stepper->samples(robot, kind);
    }
    const double* trace(int32_t robot, int32_t kind) override {
        return batches_[batch_of(robot)].stepper->trace(robot, kind);
    }
    const int32_t* sites(int32_t robot) override { return wake_for(robot).sites(robot); }
    void place(int32_t robot, const double* positions, const double* velocities) override {
        wake_for(robot).place(robot, positions, velocities);
    }
    void state(int32_t robot, double* positions, double* velocities) override {
        wake_for(robot).state(robot, positions, velocities);
    }
    void block(int32_t robot, double* out) override { wake_for(robot).block(robot, out); }
    std::string describe() override { return wake_for(batches_.front().robots.front()).describe(); }

private:
    struct batch {
        std::vector<int32_t> robots;  // ascending
        std::unique_ptr<gpu_robots> stepper;
        bool begun = false;  // it has been awake
    };

    void add(std::size_t at, std::vector<int32_t> robots) {
        auto stepper = make_batch(setup_, robots, team_, place_, outcomes_);
        batches_.insert(batches_.begin() + std::ptrdiff_t(at),
                        batch{std::move(robots), std::move(stepper)});
    }
    std::size_t batch_of(int32_t robot) const {
        std::size_t at = 0;
        while (!std::binary_search(batches_[at].robots.begin(), batches_[at].robots.end(), robot))
            ++at;
        return at;
    }
    gpu_robots& wake_for(int32_t robot);
    gpu_robots* next_unfinished();

    const simulation_setup& setup_;
    const std::shared_ptr<gpu_team> team_;
    gpu_place& place_;
    limax_outcome* const outcomes_;
    std::vector<batch> batches_;
    gpu_robots* enqueued_ = nullptr;
};

// The batch of a robot, the only one awake. One that has never been awake is halved as long as it
// does not fit; one robot that does not fit is refused.
gpu_robots& robot_batches::wake_for(int32_t robot) {
    while (true) {
        const std::size_t at = batch_of(robot);
        for (std::size_t i = 0; i < batches_.size(); ++i)
            if (i != at) batches_[i].stepper->sleep();
        try {
            batches_[at].stepper->wake();
            batches_[at].begun = true;
            return *batches_[at].stepper;
        } catch (const error& problem) {
            std::vector<int32_t> robots = batches_[at].robots;
            if (problem.status() != LIMAX_OUT_OF_MEMORY || robots.size() < 2 || batches_[at].begun)
                throw;
            const auto half = robots.begin() + std::ptrdiff_t(robots.size() / 2);
            batches_.erase(batches_.begin() + std::ptrdiff_t(at));
            add(at, {half, robots.end()});
            add(at, {robots.begin(), half});
        }
    }
}

gpu_robots* robot_batches::next_unfinished() {
    for (const batch& each : batches_)
        if (!each.stepper->finished()) return &wake_for(each.robots.front());
    return nullptr;
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

void robot_batches::enqueue(double seconds) {
    enqueued_ = next_unfinished();
    if (enqueued_) enqueued_->enqueue(seconds);
}

void robot_batches::collect() {
    if (gpu_robots* sent = std::exchange(enqueued_, nullptr)) sent->collect();
}

}  // namespace

std::unique_ptr<gpu_robots> make_robots(const simulation_setup& setup, std::vector<int32_t> robots,
                                        std::shared_ptr<gpu_team> team, gpu_place& place,
                                        limax_outcome* outcomes) {
    return std::make_unique<robot_batches>(setup, std::move(robots), std::move(team), place,
                                           outcomes);
}

}  // namespace limax::cuda
