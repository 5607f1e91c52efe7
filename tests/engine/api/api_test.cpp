// api_test.cpp: the C ABI: every misuse is a status and a text, handles may be freed in any order.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>

#include "abi.h"

using namespace limax::test::abi;

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

TEST_CASE("scenes refuse unknown, repeated and missing effects by name") {
    scene land;
    REQUIRE(limax_scene_create(&land.it) == LIMAX_OK);
    check_refused(limax_scene_add(land, "gravty"), LIMAX_INVALID_ARGUMENT,
                  "there are springs, damping");
    CHECK(limax_scene_add(land, "friction") == LIMAX_OK);
    check_refused(limax_scene_add(land, "friction"), LIMAX_INVALID_ARGUMENT, "twice");
    check_refused(limax_scene_check(land), LIMAX_INVALID_ARGUMENT, "needs one of ground");
    CHECK(limax_scene_add(land, "ground") == LIMAX_OK);
    CHECK(limax_scene_check(land) == LIMAX_OK);
    const double negative = -1, nan = std::nan("");
    check_refused(limax_scene_set(land, "ground", "stiffness", &negative, 1),
                  LIMAX_INVALID_ARGUMENT,
                  "scene.ground.stiffness is -1; it must be 1 to 1e+09 N/m");
    check_refused(limax_scene_set(land, "ground", "stiffness", &nan, 1), LIMAX_INVALID_ARGUMENT,
                  "nan");
    check_refused(limax_scene_set(land, "ground", "color", &nan, 1), LIMAX_INVALID_ARGUMENT,
                  "it has stiffness");
    check_refused(limax_scene_set(land, "ground", "stiffness", &nan, 3), LIMAX_INVALID_ARGUMENT,
                  "components");
}

TEST_CASE("options describe themselves, group by group") {
    for (const char* group : {"simulation", "genome", "breeding"}) {
        limax_field_info about;
        int32_t field = 0;
        for (; limax_option_field(group, field, &about) == LIMAX_OK; ++field) {
            CHECK(about.minimum < about.maximum);
            CHECK(std::strlen(about.note) > 0);
        }
        CHECK(field >= 3);
        CHECK(limax_option_field(group, -1, &about) == LIMAX_INVALID_ARGUMENT);
    }
    CHECK(limax_option_field("nothing", 0, nullptr) == LIMAX_INVALID_ARGUMENT);
}

TEST_CASE("simulations refuse options out of range, naming field and range") {
    ready stage;
    simulation run;
    check_refused(stage.simulate(stage.options(), run), LIMAX_INVALID_ARGUMENT,
                  "expressed or checked");
    REQUIRE(limax_population_check(stage.robots, stage.paper, 0, 0, 2) == LIMAX_OK);

    const auto refused = [&](auto change, const char* part) {
        limax_simulation_options options = stage.options();
        change(options);
        check_refused(stage.simulate(options, run), LIMAX_INVALID_ARGUMENT, part);
    };
    refused([](auto& o) { o.duration = -1; }, "duration is -1");
    refused([](auto& o) { o.duration = std::nan(""); }, "duration is nan");
    refused([](auto& o) { o.settle = -1; }, "settle");
    refused([](auto& o) { o.time_step = -1e-4; }, "time_step");
    refused([](auto& o) { o.time_step = std::nan(""); }, "time_step");
    refused([](auto& o) { o.time_step = 3e-4; }, "nearest that does");
    refused([](auto& o) { o.bound_fraction = 0; }, "bound_fraction");
    refused([](auto& o) { o.integrator = 2; }, "integrator");
    refused([](auto& o) { o.precision = -1; }, "precision");
    refused([](auto& o) { o.precision = 4; }, "precision is 4; it must be 0 to 3");
    refused([](auto& o) { o.sharing = 9; }, "sharing");
    refused([](auto& o) { o.edge = 0; }, "edge");
    refused([](auto& o) { o.record[0] = -1; }, "record.center_of_mass");
    refused([](auto& o) { o.position[1] = INFINITY; }, "position y");
    refused([](auto& o) { o.max_stretch = 0.5; }, "max_stretch");
    refused(
        [](auto& o) {
            const int32_t primes[] = {99991, 99989, 99971, 99961};
            std::copy(primes, primes + 4, o.record);
        },
        "least common multiple");
    CHECK(run.it == nullptr);

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
    CHECK(limax_simulation_advance(run, -1, 0, &progress) == LIMAX_INVALID_ARGUMENT);
    CHECK(limax_simulation_advance(run, 1, -1, &progress) == LIMAX_INVALID_ARGUMENT);
    const int32_t* sites;
    CHECK(limax_simulation_sites(nullptr, 0, &sites) == LIMAX_INVALID_ARGUMENT);
    CHECK(limax_simulation_place(nullptr, 0, nullptr, nullptr) == LIMAX_INVALID_ARGUMENT);
    CHECK(limax_simulation_state(nullptr, 0, nullptr, nullptr) == LIMAX_INVALID_ARGUMENT);
    REQUIRE(limax_simulation_advance(run, 10, 0, &progress) == LIMAX_OK);
    CHECK(progress.finished == 1);
    const double* data;
    int64_t samples, width;
    check_refused(limax_simulation_trace(run, 0, LIMAX_TRACE_ENERGY, &data, &samples, &width),
                  LIMAX_INVALID_ARGUMENT, "not recorded");
    check_refused(limax_simulation_trace(run, 2, 0, &data, &samples, &width),
                  LIMAX_INVALID_ARGUMENT, "there are 2");
    check_refused(limax_simulation_place(run, 0, nullptr, nullptr), LIMAX_INVALID_ARGUMENT,
                  "before its first step");
}

TEST_CASE("a request larger than the machine's memory is refused with the memory it needs") {
    // robots so many that simulating them takes twice the memory of the machine, at 320 B a site
    const double machine = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    const int32_t lattice[3] = {100, 100, 100};
    const int32_t count = static_cast<int32_t>(2 * machine / (320.0 * 101 * 101 * 101)) + 1;
    population none;
    check_refused(limax_population_create(lattice, count, nullptr, &none.it), LIMAX_OUT_OF_MEMORY,
                  "GB; this machine has");

    ready stage;
    REQUIRE(limax_population_check(stage.robots, stage.paper, 0, 0, 2) == LIMAX_OK);
    limax_simulation_options options = stage.options();
    options.duration = 1e6;
    options.record[LIMAX_TRACE_POSITION] = 100000;
    simulation run;
    check_refused(stage.simulate(options, run), LIMAX_OUT_OF_MEMORY, "record");
    CHECK(none.it == nullptr);
    CHECK(run.it == nullptr);
}
