// api_test.cpp: the C ABI: every misuse is a status and a text: null pointers, steps too small to
// count, values out of range, handles in use by another thread.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "abi.h"

using namespace limax::test::abi;

namespace {

// Two soft bodies of 2x2x2 voxels, which are not checked.
handle<limax_population> two_bodies() {
    const int32_t lattice[3] = {2, 2, 2};
    auto robots = made<limax_population>(limax_population_create, lattice, 2, nullptr);
    std::memset(limax_population_voxels(robots.get()), 3, 16);
    for (int i = 0; i < 48; ++i) limax_population_weights(robots.get())[i] = 1;
    return robots;
}

// What a simulation on the ground needs.
struct ready {
    handle<limax_device> cpu = made<limax_device>(limax_device_create, "cpu", 1, nullptr);
    handle<limax_materials> paper = paper_table();
    handle<limax_scene> land = made<limax_scene>(limax_scene_create);
    limax_simulation_options options{};

    ready() {
        for (const char* effect : {"gravity", "ground"})
            require_done(limax_scene_add(land.get(), effect));
        limax_simulation_defaults(&options);
        options.duration = 0.1;
    }
    limax_status check(const handle<limax_population>& robots) const {
        return limax_population_check(robots.get(), paper.get(), 0, 0, 0, 2);
    }
    limax_status simulate(const handle<limax_population>& robots,
                          handle<limax_simulation>& out) const {
        limax_simulation* run = nullptr;
        const limax_status status = limax_simulation_create(robots.get(), paper.get(), land.get(),
                                                            &options, nullptr, cpu.get(), &run);
        out.reset(run);
        return status;
    }
};

}  // namespace

TEST_CASE("a null is refused and named; without a status, the result is empty") {
    limax_progress progress;
    check_refused(limax_materials_load(LIMAX_SOURCE_DIR "/materials/paper.json", nullptr),
                  LIMAX_INVALID_ARGUMENT, "out is null");
    check_refused(limax_simulation_advance(nullptr, 1, 0, &progress), LIMAX_INVALID_ARGUMENT,
                  "simulation is null");
    CHECK(std::isnan(limax_random_uniform(nullptr, 1)));
    CHECK(limax_device_describe(nullptr) == std::string("{}"));
    CHECK(limax_error_text() == std::string("device is null"));
    limax_simulation_free(nullptr);
}

TEST_CASE("a time step too short for the step counter is refused") {
    ready stage;
    const auto robots = two_bodies();
    require_done(stage.check(robots));
    for (const double most : {5e-324, 1e-10, 2.0, HUGE_VAL, std::nan("")}) {
        stage.options.time_step_most = most;
        handle<limax_simulation> run;
        check_refused(stage.simulate(robots, run), LIMAX_INVALID_ARGUMENT, "time_step_most is ");
        CHECK(run == nullptr);
    }
}

TEST_CASE("a handle in use by another thread is refused and usable afterwards") {
    ready stage;
    const auto robots = two_bodies();
    require_done(stage.check(robots));
    stage.options.duration = 1e6;
    handle<limax_simulation> endless;
    require_done(stage.simulate(robots, endless));
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const auto in_time = [&] { return std::chrono::steady_clock::now() < deadline; };
    // either thread may be the one that finds the other at work
    limax_status other = LIMAX_INTERNAL, status = LIMAX_OK;
    std::thread worker([&] {
        limax_progress progress;
        do other = limax_simulation_advance(endless.get(), 1e6, 0, &progress);
        while (other == LIMAX_INVALID_ARGUMENT && in_time());
    });
    while (status == LIMAX_OK && in_time()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        status = limax_simulation_state(endless.get(), 0, nullptr, nullptr);
    }
    check_refused(status, LIMAX_INVALID_ARGUMENT, "another thread is using this handle");
    limax_interrupt();
    worker.join();
    limax_interrupt_clear();
    CHECK(other == LIMAX_OK);
    CHECK(limax_simulation_state(endless.get(), 0, nullptr, nullptr) == LIMAX_OK);
}

TEST_CASE("threads that share a device, materials and a scene get the bits of one thread") {
    const ready stage;
    // positions, or nothing after an error
    const auto end_of = [&] {
        const auto robots = two_bodies();
        handle<limax_simulation> run;
        limax_progress progress{};
        std::vector<double> end(81);
        bool fine = stage.check(robots) == LIMAX_OK && stage.simulate(robots, run) == LIMAX_OK;
        while (fine && !progress.finished)
            fine = limax_simulation_advance(run.get(), 0.001, 0, &progress) == LIMAX_OK;
        fine = fine && limax_simulation_state(run.get(), 1, end.data(), nullptr) == LIMAX_OK;
        return fine ? end : std::vector<double>();
    };
    const std::vector<double> expected = end_of();
    REQUIRE(expected.size() == 81);
    std::vector<double> there;
    std::thread worker([&] { there = end_of(); });
    const std::vector<double> here = end_of();
    worker.join();
    CHECK(here == expected);
    CHECK(there == expected);
}

TEST_CASE("devices that do not exist are refused with the reason") {
    limax_device* none = nullptr;
    check_refused(limax_device_create("gpu", 1, nullptr, &none), LIMAX_INVALID_ARGUMENT,
                  "auto, cpu or cuda");
    check_refused(limax_device_create("cpu", -1, nullptr, &none), LIMAX_INVALID_ARGUMENT,
                  "threads");
    check_refused(limax_device_create("cpu", 1, "sparc", &none), LIMAX_INVALID_ARGUMENT, "sparc");
    CHECK(none == nullptr);
}

TEST_CASE("a body that was not checked, or changed after its check, is not simulated") {
    const ready stage;
    const auto robots = two_bodies();
    handle<limax_simulation> run;
    const auto refused = [&](const char* part) {
        check_refused(stage.simulate(robots, run), LIMAX_INVALID_ARGUMENT, part);
    };
    refused("expressed or checked");
    require_done(stage.check(robots));
    // a body changed after its check is not what was counted
    limax_population_voxels(robots.get())[0] = 0;
    refused("check it again");
    limax_population_voxels(robots.get())[0] = 3;
    limax_population_weights(robots.get())[5] = 10;
    refused("0 to 1");
    limax_population_weights(robots.get())[5] = 1;
    require_done(stage.simulate(robots, run));
    limax_progress progress;
    CHECK(limax_simulation_advance(run.get(), std::nan(""), 0, &progress) ==
          LIMAX_INVALID_ARGUMENT);
    CHECK(limax_simulation_advance(run.get(), 1, -1, &progress) == LIMAX_INVALID_ARGUMENT);
}
