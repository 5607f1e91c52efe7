// cuda_sets.h: the kernel that the engine selects for a scene, a lattice and a fake GPU, and
// how to compile it. No GPU is needed.
#pragma once

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "backend/cuda/plan/kernel_sets.h"
#include "cuda_compiler.h"
#include "environment.h"
#include "failure.h"
#include "fake/machine.h"
#include "stage.h"

namespace limax::test {

// Shared memory of a block on a GPU of this capability, bytes.
inline int shared_memory_of(int capability) {
    return capability < 80 ? 65536 : capability < 90 ? 166912 : 232448;
}

inline constexpr unsigned every_effect =
    ((1u << effects::all::count) - 1) & ~effects::bit<effects::actuation>;
// Those of a robot that walks on flat ground: kernels for them are built with limax.
inline constexpr unsigned walking_effects =
    effects::bit<effects::springs> | effects::bit<effects::damping> |
    effects::bit<effects::actuation> | effects::bit<effects::gravity> |
    effects::bit<effects::ground> | effects::bit<effects::friction>;

// A setup without robots, whose scene has the effects of `mask`.
inline simulation_setup setup_of(unsigned mask, int precision, int integrator,
                                 const lattice& grid) {
    simulation_setup setup;
    setup.options = default_options();
    setup.options.precision = precision;
    setup.options.integrator = integrator;
    setup.grid = grid;
    for (std::size_t i = 1; i < effect_entries().size(); ++i)
        if (mask >> i & 1u) setup.scene.add(effect_entries()[i].name);
    if (setup.scene.has(effects::index_of<effects::control>)) {
        const double delay = 0.1;
        setup.scene.set("control", "delay", &delay, 1);
        setup.scene.set_controller(
            "real y[3] = perceptron(4, g[0], strain, strain_rate, load, contact, gravity, velocity,"
            "  spin, target, target_distance, block, block_velocity, ahead, activation, place);"
            "s[0] += soft(y[1]) + heard[0]; say[0] = clamp(y[2] * t, -1, 1);"
            "a = y[0] + clock_sine * cos(phase) + clock_cosine * sin(phase);",
            {});
    }
    return setup;
}

// A machine with a fake GPU on which no kernel may be loaded: the error names the kernel that was
// asked for.
class asking_machine {
public:
    explicit asking_machine(int capability = 90)
        : path_("LIMAX_CUDA_PATH"),
          machine_(fake_driver{.capability = capability,
                               .shared_memory_of_block = shared_memory_of(capability)}),
          place_(*machine_.api, 0, {false, false, false}) {
        path_.unset();
    }

    // The kernel that steps robots of this setup.
    cuda::kernel_set step_of(const simulation_setup& setup,
                             cuda::kernel_form form = cuda::kernel_form::many) {
        const std::string text = failure(LIMAX_NO_DEVICE, [&] {
            cuda::load_kernels(setup, setup.scene.mask(), form, plans_, place_);
        });
        const std::string before = ": '", after = "' was not built with limax";
        const std::size_t begin = text.find(before), end = text.find(after);
        CAPTURE(text);
        REQUIRE(begin < end);
        REQUIRE(end != std::string::npos);
        return cuda::kernel_set::of_title(
            text.substr(begin + before.size(), end - begin - before.size()));
    }

private:
    environment_variable path_;
    fake_machine machine_;
    cuda::block_plans plans_;
    cuda::gpu_place place_;
};

// What the engine itself would compile a set to, with further options. `log` may be null.
inline std::string compiled(const cuda::compiler& nvrtc, const cuda::kernel_set& set,
                            const std::string& architecture,
                            const std::vector<std::string>& more = {}, std::string* log = nullptr) {
    std::vector<std::string> options = cuda::kernel_options();
    options.insert(options.end(), more.begin(), more.end());
    return nvrtc.compile(set.text(), cuda::kernel_headers(), architecture, options, log);
}

// Tests that compile for minutes: LIMAX_TESTS=full runs them too, -ts=full --no-skip only them.
inline bool skips_long_tests() {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): before any thread
    const char* which = std::getenv("LIMAX_TESTS");
    return !which || std::string(which) != "full";
}

}  // namespace limax::test
