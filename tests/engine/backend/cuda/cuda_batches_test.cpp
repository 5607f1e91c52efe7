// cuda_batches_test.cpp: robots that do not fit on a GPU at once are processed in batches, and
// several GPUs share robots. With the fake driver (fake/driver.cpp), whose kernels do next to
// nothing, so that robots stay where they are placed.
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "backend/cuda/run/robots.h"
#include "cuda_sets.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr lattice cube{5, 5, 5};
constexpr int sites = 216;
constexpr int robots = 8;
// What one robot of the walking scene takes of a GPU in `compensated`, bytes: 52 springs and 17
// numbers of 4 bytes for each site, and its part of what all share.
constexpr std::size_t least_of_robot = std::size_t(sites) * (4 * 13 + 17) * 4;

// Every site has a mass. The rest stays as it is in memory that was used before.
void prepare(const void* argument, unsigned blocks) {
    const auto& launch = *static_cast<const cuda::prepare_launch<float>*>(argument);
    std::fill_n(launch.ranks, blocks * std::size_t(sites), 0);
}

// Robots on fake GPUs, whose driver accepts every kernel.
struct fake_gpus {
    explicit fake_gpus(std::size_t memory, int gpus = 1)
        : origins("LIMAX_KERNELS"),
          machine(fake_driver{.gpus = gpus, .memory = memory, .prepare = prepare}) {
        origins.set("ahead-of-time,compiled");
        team = std::make_shared<cuda::gpu_team>(*machine.api);
    }
    simulation_setup setup() const {
        stage bodies(cube, robots);
        bodies.setup.scene =
            setup_of(walking_effects, LIMAX_COMPENSATED, LIMAX_LEAPFROG, cube).scene;
        bodies.setup.options.precision = LIMAX_COMPENSATED;
        bodies.setup.options.time_step = 1e-4;
        return bodies.checked();
    }
    // A simulation of some robots, of all where none are listed.
    std::unique_ptr<simulation> make(simulation_setup setup, const std::vector<int>& which = {}) {
        if (!which.empty()) std::fill_n(setup.mask.begin(), robots, 0);
        for (const int robot : which) setup.mask[robot] = 1;
        return cuda::make_simulation(std::move(setup), team);
    }

    environment_variable origins;
    fake_machine machine;
    std::shared_ptr<cuda::gpu_team> team;
};

// Where a robot is put: its own place, exact in single precision.
std::vector<double> place_of(int robot) {
    std::vector<double> place(3 * sites);
    for (std::size_t i = 0; i < place.size(); ++i)
        place[i] = 0.125 * double(robot) + double(i % 64) / 64 - 0.5;
    return place;
}

void put_all(simulation& some) {
    for (int robot = 0; robot < robots; ++robot) some.place(robot, place_of(robot).data(), nullptr);
}
void check_places(simulation& some) {
    // first those that were put last
    for (int robot = robots - 1; robot >= 0; --robot) {
        CAPTURE(robot);
        std::vector<double> seen(3 * sites), velocities(3 * sites);
        some.state(robot, seen.data(), velocities.data());
        CHECK(seen == place_of(robot));
    }
}

}  // namespace

TEST_CASE("robots that do not fit on a GPU run in batches with the same results") {
    if (!kernels_available()) return;
    struct limit {
        std::size_t memory;    // of the GPU, bytes
        const char* of_limax;  // LIMAX_CUDA_MEMORY
    };
    for (const limit& budget : {limit{4 * least_of_robot, ""}, limit{100000000, "0.00024"}}) {
        CAPTURE(budget.of_limax);
        const environment_variable most("LIMAX_CUDA_MEMORY");
        most.set(budget.of_limax);
        fake_gpus on(budget.memory);
        const std::size_t room = std::min(budget.memory, std::size_t(240000));
        const auto some = on.make(on.setup());
        put_all(*some);
        CHECK(on.machine.fake->held > least_of_robot);
        CHECK(on.machine.fake->held <= room);
        check_places(*some);
        // each batch is prepared and does its steps; one was on the GPU
        const int before = on.machine.fake->launches;
        some->advance(0, 3);
        CHECK(on.machine.fake->launches - before >= 2 + 1);
        check_places(*some);
    }
}

TEST_CASE("a robot that was refused at any allocation runs once when there is room") {
    if (!kernels_available()) return;
    fake_gpus on(100000000);
    int refused = 0;
    for (bool woken = false; !woken; ++refused) {
        REQUIRE(refused < 100);
        CAPTURE(refused);
        simulation_setup setup = on.setup();
        setup.options.record[LIMAX_TRACE_CENTER_OF_MASS] = 50;
        const auto some = on.make(std::move(setup), {4});
        on.team->places().front()->gpu.free_kept();
        on.machine.fake->allocations_left = refused;
        try {
            some->describe();
            woken = true;
        } catch (const error& problem) {
            CHECK(problem.status() == LIMAX_OUT_OF_MEMORY);
            CHECK(cuda::gpu_bytes_held() == 0);
        }
        on.machine.fake->allocations_left = -1;
        some->advance(0, 1);
        CHECK(on.machine.fake->blocks == 1);
    }
    // records, springs, state, the plan, traces
    CHECK(refused > 5);
}

TEST_CASE("a robot that no GPU has room for is refused, and nothing is lost") {
    if (!kernels_available()) return;
    fake_gpus on(least_of_robot / 2);
    const auto some = on.make(on.setup(), {0, 3, 5});
    const std::string text = failure(LIMAX_OUT_OF_MEMORY, [&] { some->describe(); });
    CHECK(text.find("of 1 robots: ") != std::string::npos);
    CHECK(cuda::gpu_bytes_held() == 0);
}

TEST_CASE("steps are sent to a GPU once, and collected by what needs them or at the end") {
    if (!kernels_available()) return;
    fake_gpus on(100000000);
    const auto some = on.make(on.setup());
    put_all(*some);
    const int before = on.machine.fake->launches;
    some->enqueue(0.1);
    const int sent = on.machine.fake->launches;
    CHECK(sent > before);
    some->enqueue(0.1);
    CHECK(on.machine.fake->launches == sent);
    check_places(*some);
    some->enqueue(0.1);
    CHECK(on.machine.fake->launches > sent);
}

TEST_CASE("GPUs share the robots, and what one of them refuses is raised") {
    if (!kernels_available()) return;
    fake_gpus on(100000000, 3);
    const auto simulation = on.make(on.setup());
    put_all(*simulation);
    check_places(*simulation);
    const int before = on.machine.fake->launches;
    CHECK_FALSE(simulation->advance(0, 2).finished);
    CHECK(on.machine.fake->launches - before == 3);
    on.machine.fail_next("cuLaunchKernelEx", CUDA_ERROR_ILLEGAL_ADDRESS);
    CHECK(failure(LIMAX_INTERNAL, [&] {
              simulation->advance(0, 1);
          }).find("stepping robots of 5x5x5 voxels with springs") != std::string::npos);
    CHECK_FALSE(simulation->advance(0, 1).finished);
}
