// cuda_sets_test.cpp: the kernels that scenes need: that the ones built with limax are among
// them, and that they spill little on every architecture.
#include "cuda_sets.h"

#include <algorithm>

using namespace limax;
using namespace limax::test;
using cuda::compiler;
using cuda::kernel_set;

namespace {

constexpr lattice cube{5, 5, 5};
constexpr cuda::kernel_form every_form[] = {cuda::kernel_form::many, cuda::kernel_form::one,
                                            cuda::kernel_form::any_lattice};

int number_in(const kernel_set& set, const char* define) {
    const auto found = set.defines.find(define);
    CAPTURE(set.title());
    REQUIRE(found != set.defines.end());
    return std::atoi(found->second.c_str());
}

bool steps_robots(const kernel_set& set) { return set.entry == "step" || set.entry == "grid"; }
bool for_any_lattice(const kernel_set& set) {
    return steps_robots(set) && set.defines.count("LIMAX_NX") == 0;
}
// The setup that a set for stepping robots was made for, or on `other` if it serves any lattice.
simulation_setup setup_behind(const kernel_set& set, const lattice& other = {4, 3, 6}) {
    const lattice grid = for_any_lattice(set)
                             ? other
                             : lattice{number_in(set, "LIMAX_NX"), number_in(set, "LIMAX_NY"),
                                       number_in(set, "LIMAX_NZ")};
    simulation_setup setup =
        setup_of(unsigned(number_in(set, "LIMAX_EFFECTS")), number_in(set, "LIMAX_PRECISION"),
                 number_in(set, "LIMAX_LEAPFROG") ? LIMAX_LEAPFROG : LIMAX_SYMPLECTIC_EULER, grid);
    const auto code = set.defines.find("LIMAX_INSTANCES");
    if (code != set.defines.end())
        effects::for_each([&]<class E>(E) {
            while (setup.scene.instances(effects::index_of<E>) <
                   cuda::instances_in<E>(std::stoull(code->second)))
                setup.scene.add(E::name);
        });
    return setup;
}

// Bytes that the threads of a set's kernel spill, each on its own.
int spilled(const compiler& nvrtc, const kernel_set& set, const std::string& architecture) {
    std::string log;
    compiled(nvrtc, set, architecture, {"--ptxas-options=-v"}, &log);
    const std::string after = " bytes spill stores";
    const std::size_t end = log.find(after);
    CAPTURE(log);
    REQUIRE(log.find("Compiling entry function 'limax_advance'") < end);
    REQUIRE(end != std::string::npos);
    // only one function, and so one figure
    REQUIRE(log.find(after, end + 1) == std::string::npos);
    return std::atoi(log.c_str() + log.find_last_not_of("0123456789", end - 1) + 1);
}
constexpr int most_spilled = 64;

void check_spills(const compiler& nvrtc, const kernel_set& set, const std::string& architecture) {
    CAPTURE(architecture);
    CAPTURE(set.title());
    CHECK(spilled(nvrtc, set, architecture) <= most_spilled);
}

void check_built(const kernel_set& set) {
    const auto& sets = cuda::ahead_of_time_sets();
    CAPTURE(set.title());
    CHECK(std::count(sets.begin(), sets.end(), set) == 1);
}

// The set of another file of kernels/ that serves the scene of `set`.
kernel_set of_scene(const char* entry, const kernel_set& set) {
    kernel_set serving{entry, {}};
    for (const char* name : {"LIMAX_EFFECTS", "LIMAX_PRECISION", "LIMAX_LEAPFROG"})
        serving.defines[name] = set.defines.at(name);
    for (const auto& [name, value] : set.defines)
        if (name.starts_with("LIMAX_CONTROL")) serving.defines[name] = value;
    return serving;
}

}  // namespace

TEST_CASE("every embedded step kernel is the one that its scene needs") {
    asking_machine machine;
    int steps = 0;
    for (const kernel_set& set : cuda::ahead_of_time_sets()) {
        if (!steps_robots(set)) continue;
        ++steps;
        // the optional words of a line of ahead_of_time.txt
        std::string wanted;
        bool found = false;
        for (const cuda::kernel_form form : every_form) {
            const kernel_set asked = machine.step_of(setup_behind(set), form);
            found |= asked == set;
            wanted += "\n" + asked.title();
        }
        CAPTURE(set.title());
        CAPTURE(wanted);
        CHECK(found);
    }
    CHECK(steps > 0);
}

TEST_CASE("without a compiler the common scenes have a kernel for every lattice") {
    asking_machine machine;
    for (const lattice& grid : {lattice{1, 1, 1}, lattice{3, 7, 2}, lattice{60, 50, 50}})
        for (const int precision : every_precision) {
            const kernel_set set =
                machine.step_of(setup_of(walking_effects, precision, LIMAX_LEAPFROG, grid),
                                cuda::kernel_form::any_lattice);
            CHECK(for_any_lattice(set));
            check_built(set);
        }
}

TEST_CASE("kernels that are needed between steps are built with limax") {
    for (const kernel_set& set : cuda::ahead_of_time_sets())
        if (steps_robots(set)) check_built(of_scene("prepare", set));
    for (const char* entry : {"express", "describe", "breed", "diversity", "summarize"})
        check_built({entry, {}});
}

TEST_CASE("scripted effects are compiled into the step kernels") {
    asking_machine machine;
    simulation_setup setup =
        setup_of(walking_effects, LIMAX_COMPENSATED, LIMAX_LEAPFROG, {5, 5, 5});
    CHECK(machine.step_of(setup).defines.count("LIMAX_SCRIPTED") == 0);
    const double bound[2] = {20, 0};
    setup.scene.add_script("pull", "f = k * (vec(0, 0, sin(t)) - x) - exp(-m) * v;",
                           {{"k", 1, {3, 0, 0}}}, bound);
    for (const cuda::kernel_form form : {cuda::kernel_form::many, cuda::kernel_form::any_lattice}) {
        const kernel_set set = machine.step_of(setup, form);
        CHECK(set.defines.count("LIMAX_SCRIPTED") == 1);
        const compiler* nvrtc = found_compiler();
        if (nvrtc) CHECK(!compiled(*nvrtc, set, "compute_90").empty());
    }
}

TEST_CASE("the kernels of the common lattices spill little") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    const bool all = !skips_long_tests();
    // the oldest GPU's blocks have the least memory; in 10x10x10 voxels robots are on the grid path
    // before compute capability 9.0
    for (const int capability : all ? std::vector<int>{75, 80, 90} : std::vector<int>{75}) {
        asking_machine machine(capability);
        for (const int n : {5, 10})
            for (const int precision : every_precision)
                for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG})
                    if (all || (precision == LIMAX_COMPENSATED && integrator == LIMAX_LEAPFROG))
                        check_spills(*nvrtc,
                                     machine.step_of(setup_of(walking_effects, precision,
                                                              integrator, {n, n, n})),
                                     nvrtc->architecture_for(capability));
    }
    for (const kernel_set& set : cuda::ahead_of_time_sets())
        if (steps_robots(set) && unsigned(number_in(set, "LIMAX_EFFECTS")) == walking_effects)
            check_spills(*nvrtc, set, "sm_90");
}

TEST_CASE("all effects together, some several times, compile on both paths") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    const auto compiles = [&](const kernel_set& set, const std::string& architecture) {
        CAPTURE(set.title());
        CAPTURE(architecture);
        std::string log;
        CHECK(!compiled(*nvrtc, set, architecture, {}, &log).empty());
        CHECK(log == "");
    };
    for (const int precision : every_precision)
        for (const lattice& grid : {cube, lattice{60, 50, 50}})
            for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
                if (skips_long_tests() && integrator != LIMAX_LEAPFROG) continue;
                simulation_setup setup = setup_of(every_effect, precision, integrator, grid);
                for (const char* more : {"planes", "spheres", "boxes", "boxes"})
                    setup.scene.add(more);
                const kernel_set set = asking_machine().step_of(setup);
                CHECK(set.entry == (grid.nx == 5 ? "step" : "grid"));
                CHECK(uint64_t(std::stoull(set.defines.at("LIMAX_INSTANCES"))) ==
                      cuda::instances_code(setup.scene));
                compiles(set, "compute_90");
                if (grid.nx != 5) continue;
                for (const char* entry : {"prepare", "measure"})
                    compiles(of_scene(entry, set), "compute_90");
                if (skips_long_tests()) continue;
                for (const int capability : {75, 80, 90})
                    compiles(asking_machine(capability).step_of(setup),
                             nvrtc->architecture_for(capability));
            }
}
