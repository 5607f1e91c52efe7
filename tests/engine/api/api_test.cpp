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

// Checked bodies and a simulation of them, not yet stepped.
struct prepared : ready {
    simulation run;

    prepared() {
        REQUIRE(limax_population_check(robots, paper, 0, 0, 0, 2) == LIMAX_OK);
        REQUIRE(simulate(options(), run) == LIMAX_OK);
    }
};

}  // namespace

TEST_CASE("a null is refused and named; without a status, the result is empty") {
    prepared stage;
    limax_progress progress;
    check_refused(limax_materials_load(LIMAX_SOURCE_DIR "/materials/paper.json", nullptr),
                  LIMAX_INVALID_ARGUMENT, "out is null");
    check_refused(limax_simulation_sites(stage.run, 0, nullptr), LIMAX_INVALID_ARGUMENT,
                  "sites is null");
    check_refused(limax_simulation_advance(nullptr, 1, 0, &progress), LIMAX_INVALID_ARGUMENT,
                  "simulation is null");
    CHECK(std::isnan(limax_random_uniform(nullptr, 1)));
    CHECK(limax_device_describe(nullptr) == std::string("{}"));
    CHECK(limax_error_text() == std::string("device is null"));
    limax_simulation_free(nullptr);
}

TEST_CASE("a time step too short for the step counter is refused") {
    prepared stage;
    for (const double most : {5e-324, 1e-10, 2.0, HUGE_VAL, std::nan("")}) {
        limax_simulation_options options = stage.options();
        options.time_step_most = most;
        simulation run;
        check_refused(stage.simulate(options, run), LIMAX_INVALID_ARGUMENT, "time_step_most is ");
        CHECK(run.it == nullptr);
    }
}

TEST_CASE("a handle in use by another thread is refused and usable afterwards") {
    prepared stage;
    limax_simulation_options options = stage.options();
    options.duration = 1e6;
    simulation endless;
    REQUIRE(stage.simulate(options, endless) == LIMAX_OK);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const auto in_time = [&] { return std::chrono::steady_clock::now() < deadline; };
    // either thread may be the one that finds the other at work
    limax_status other = LIMAX_INTERNAL, status = LIMAX_OK;
    std::thread worker([&] {
        limax_progress progress;
        do other = limax_simulation_advance(endless, 1e6, 0, &progress);
        while (other == LIMAX_INVALID_ARGUMENT && in_time());
    });
    while (status == LIMAX_OK && in_time()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        status = limax_simulation_state(endless, 0, nullptr, nullptr);
    }
    check_refused(status, LIMAX_INVALID_ARGUMENT, "another thread is using this handle");
    limax_interrupt();
    worker.join();
    limax_interrupt_clear();
    CHECK(other == LIMAX_OK);
    CHECK(limax_simulation_state(endless, 0, nullptr, nullptr) == LIMAX_OK);
}

TEST_CASE("threads that share a device, materials and a scene get the bits of one thread") {
    prepared stage;
    const auto end_of = [&](std::vector<double>& out) {
        population robots;
        const int32_t lattice[3] = {2, 2, 2};
        bool fine = limax_population_create(lattice, 2, nullptr, &robots.it) == LIMAX_OK;
        std::memset(limax_population_voxels(robots), 3, 16);
        for (int i = 0; i < 48; ++i) limax_population_weights(robots)[i] = 1;
        fine = fine && limax_population_check(robots, stage.paper, 0, 0, 0, 2) == LIMAX_OK;
        const limax_simulation_options options = stage.options();
        simulation run;
        fine = fine && limax_simulation_create(robots, stage.paper, stage.land, &options, nullptr,
                                               stage.cpu, &run.it) == LIMAX_OK;
        limax_progress progress{};
        while (fine && !progress.finished)
            fine = limax_simulation_advance(run, 0.001, 0, &progress) == LIMAX_OK;
        out.assign(81, 0.0);
        if (!fine || limax_simulation_state(run, 1, out.data(), nullptr) != LIMAX_OK) out.clear();
    };
    std::vector<double> expected, here, there;
    end_of(expected);
    REQUIRE(expected.size() == 81);
    std::thread worker([&] { end_of(there); });
    end_of(here);
    worker.join();
    CHECK(here == expected);
    CHECK(there == expected);
}

TEST_CASE("the version of the header is that of the library") {
    CHECK(limax_abi_version() == LIMAX_ABI);
}

TEST_CASE("unavailable devices are refused with the reason") {
    device none;
    device gpu;
    const limax_status status = limax_device_create("cuda", 1, nullptr, &gpu.it);
    if (status != LIMAX_OK) check_refused(status, LIMAX_NO_DEVICE, "use 'cpu' or 'auto'");
    check_refused(limax_device_create("gpu", 1, nullptr, &none.it), LIMAX_INVALID_ARGUMENT,
                  "auto, cpu or cuda");
    check_refused(limax_device_create("cpu", -1, nullptr, &none.it), LIMAX_INVALID_ARGUMENT,
                  "threads");
    check_refused(limax_device_create("cpu", 1, "sparc", &none.it), LIMAX_INVALID_ARGUMENT,
                  "sparc");
    CHECK(none.it == nullptr);
}

TEST_CASE("a body that was not checked, or changed after its check, is not simulated") {
    ready stage;
    simulation run;
    check_refused(stage.simulate(stage.options(), run), LIMAX_INVALID_ARGUMENT,
                  "expressed or checked");
    REQUIRE(limax_population_check(stage.robots, stage.paper, 0, 0, 0, 2) == LIMAX_OK);
    // a body changed after its check is not what was counted
    limax_population_voxels(stage.robots)[0] = 0;
    check_refused(stage.simulate(stage.options(), run), LIMAX_INVALID_ARGUMENT, "check it again");
    limax_population_voxels(stage.robots)[0] = 3;
    limax_population_weights(stage.robots)[5] = 10;
    check_refused(stage.simulate(stage.options(), run), LIMAX_INVALID_ARGUMENT, "0 to 1");
    limax_population_weights(stage.robots)[5] = 1;

    REQUIRE(stage.simulate(stage.options(), run) == LIMAX_OK);
    limax_progress progress;
    CHECK(limax_simulation_advance(run, std::nan(""), 0, &progress) == LIMAX_INVALID_ARGUMENT);
    CHECK(limax_simulation_advance(run, 1, -1, &progress) == LIMAX_INVALID_ARGUMENT);
    const double* data;
    int64_t samples, width;
    check_refused(limax_simulation_trace(run, 2, 0, &data, &samples, &width),
                  LIMAX_INVALID_ARGUMENT, "there are 2");
}
