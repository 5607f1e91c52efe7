// abi_misuse_test.cpp: misuse of the C ABI: null pointers, indices at the ends of their types,
// time steps too small to count, endless files, handles in use by another thread.
#include <doctest/doctest.h>

#include <chrono>
#include <climits>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "abi.h"

using namespace limax::test::abi;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Checked bodies and a simulation of them, not yet stepped.
struct prepared : ready {
    simulation run;

    prepared() {
        REQUIRE(limax_population_check(robots, paper, 0, 0, 2) == LIMAX_OK);
        REQUIRE(simulate(options(), run) == LIMAX_OK);
    }
};

}  // namespace

TEST_CASE("a null where a result should go is refused, and named") {
    prepared stage;
    const auto refused = [](limax_status status, const char* name) {
        check_refused(status, LIMAX_INVALID_ARGUMENT, (std::string(name) + " is null").c_str());
    };
    const limax_encoding_options encoding = small_encoding();
    const limax_simulation_options options = stage.options();
    const int32_t first = 0;
    double number;
    const char* text;
    int64_t count;
    const double* data;

    refused(limax_device_create("cpu", 1, nullptr, nullptr), "out");
    refused(limax_materials_load(LIMAX_SOURCE_DIR "/materials/paper.json", nullptr), "out");
    refused(limax_materials_parse("{}", 2, nullptr, nullptr), "out");
    refused(limax_materials_copy(stage.paper, nullptr), "out");
    refused(limax_materials_get(stage.paper, 0, nullptr), "out");
    refused(limax_materials_field(stage.paper, "phase", nullptr, &number, &number, &text), "unit");
    refused(limax_materials_field(stage.paper, "phase", &text, nullptr, &number, &text), "minimum");
    refused(limax_materials_field(stage.paper, "phase", &text, &number, nullptr, &text), "maximum");
    refused(limax_materials_field(stage.paper, "phase", &text, &number, &number, nullptr),
            "source");
    refused(limax_encoding_create(&encoding, nullptr), "out");
    refused(limax_population_create(encoding.lattice, 1, nullptr, nullptr), "out");
    refused(limax_population_diversity(stage.robots, &first, 1, nullptr), "out");
    refused(limax_effect_describe(0, nullptr), "out");
    refused(limax_effect_field(1, 0, nullptr), "out");
    refused(limax_scene_create(nullptr), "out");
    refused(limax_simulation_create(stage.robots, stage.paper, stage.land, &options, nullptr,
                                    stage.cpu, nullptr),
            "out");
    refused(limax_simulation_advance(stage.run, 1, 0, nullptr), "out");
    refused(limax_simulations_advance(&stage.run.it, 1, 1, nullptr), "out");
    refused(limax_simulation_describe(stage.run, nullptr), "out");
    refused(limax_simulation_sites(stage.run, 0, nullptr), "sites");
    refused(limax_simulation_trace(stage.run, 0, 0, nullptr, &count, &count), "data");
    refused(limax_simulation_trace(stage.run, 0, 0, &data, nullptr, &count), "samples");
    refused(limax_simulation_trace(stage.run, 0, 0, &data, &count, nullptr), "width");
}

TEST_CASE("functions without a status return an empty value for null and set the error text") {
    const auto says = [](const char* name) {
        return std::string(limax_error_text()) == std::string(name) + " is null";
    };
    limax_simulation_defaults(nullptr);
    CHECK(says("out"));
    CHECK(std::isnan(limax_random_uniform(nullptr, 1)));
    CHECK(says("key"));
    CHECK(std::isnan(limax_random_normal(nullptr, 1)));
    CHECK(limax_random_integer(nullptr, 1, 7) == 0);
    CHECK(limax_population_count(nullptr) == 0);
    CHECK(says("population"));
    CHECK(limax_materials_name(nullptr) == std::string());
    CHECK(says("materials"));
    CHECK(limax_encoding_features(nullptr) == nullptr);
    CHECK(says("encoding"));
    CHECK(limax_device_describe(nullptr) == std::string("{}"));
    CHECK(says("device"));
    CHECK(limax_population_genomes(nullptr) == nullptr);
    CHECK(limax_simulation_outcomes(nullptr) == nullptr);
    CHECK(says("simulation"));
    limax_device_free(nullptr);
    limax_simulation_free(nullptr);
    limax_population_free(nullptr);
}

TEST_CASE("the largest index is refused without overflow in the message") {
    prepared stage;
    const auto refused = [](limax_status status) {
        check_refused(status, LIMAX_INVALID_ARGUMENT, "2147483648");
    };
    limax_material material;
    limax_effect_info effect;
    limax_field_info field;
    limax_diversity diversity;
    const int32_t most = INT_MAX;
    refused(limax_materials_get(stage.paper, INT_MAX, &material));
    refused(limax_effect_describe(INT_MAX, &effect));
    refused(limax_effect_field(1, INT_MAX, &field));
    refused(limax_simulation_state(stage.run, INT_MAX, nullptr, nullptr));
    refused(limax_population_diversity(stage.robots, &most, 1, &diversity));
    refused(limax_population_check(stage.robots, stage.paper, 0, INT_MAX, 1));

    const limax_encoding_options options = small_encoding();
    encoding code;
    REQUIRE(limax_encoding_create(&options, &code.it) == LIMAX_OK);
    population parents, children;
    REQUIRE(limax_population_create(options.lattice, 1, code, &parents.it) == LIMAX_OK);
    REQUIRE(limax_population_create(options.lattice, 1, code, &children.it) == LIMAX_OK);
    limax_breeding breeding{};
    breeding.repetition = 1;
    const int32_t pair[2] = {0, INT_MAX};
    refused(limax_population_breed(children, parents, pair, &breeding, stage.cpu, 0, 1));
}

TEST_CASE("a time step too short for the step counter is refused") {
    prepared stage;
    for (const double most : {5e-324, 1e-10, -1e-4, 2.0, infinity, std::nan("")}) {
        limax_simulation_options options = stage.options();
        options.time_step_most = most;
        simulation run;
        check_refused(stage.simulate(options, run), LIMAX_INVALID_ARGUMENT, "time_step_most is ");
        CHECK(run.it == nullptr);
    }
}

TEST_CASE("advancing several simulations refuses the same one twice") {
    prepared stage;
    limax_progress progress[2];
    limax_simulation* const twice[2] = {stage.run, stage.run};
    check_refused(limax_simulations_advance(twice, 2, 0.1, progress), LIMAX_INVALID_ARGUMENT,
                  "listed twice");
    check_refused(limax_simulations_advance(twice, -1, 0.1, progress), LIMAX_INVALID_ARGUMENT,
                  "count is -1");
    CHECK(limax_simulations_advance(twice, 0, 0.1, progress) == LIMAX_OK);
}

TEST_CASE("an endless file is refused as a material table") {
    materials none;
    check_refused(limax_materials_load("/dev/zero", &none.it), LIMAX_INVALID_FILE,
                  "/dev/zero: longer than 1048576 bytes");
    check_refused(limax_materials_load("/", &none.it), LIMAX_IO, "/: ");
    const std::string blanks(2u << 20, ' ');
    check_refused(limax_materials_parse(blanks.data(), blanks.size(), "blanks", &none.it),
                  LIMAX_INVALID_FILE, "blanks: longer than");
    check_refused(limax_materials_parse("{}", UINT64_MAX, "blanks", &none.it), LIMAX_INVALID_FILE,
                  "blanks: longer than");
    CHECK(none.it == nullptr);
}

TEST_CASE("a scripted effect needs a valid name and a valid number of parameters") {
    scene land;
    REQUIRE(limax_scene_create(&land.it) == LIMAX_OK);
    for (const char* name : {"", "a b", "a\"b\n", "\xff", "1st"})
        check_refused(limax_scene_add_script(land, name, "f = x;", nullptr, 0, nullptr),
                      LIMAX_INVALID_ARGUMENT, "the name of a scripted effect is letters");
    limax_script_parameter parameter{};
    check_refused(limax_scene_add_script(land, "mine", "f = x;", &parameter, INT_MAX, nullptr),
                  LIMAX_INVALID_ARGUMENT, "count is");
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
        fine = fine && limax_population_check(robots, stage.paper, 0, 0, 2) == LIMAX_OK;
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
