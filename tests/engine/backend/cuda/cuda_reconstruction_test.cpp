// cuda_reconstruction_test.cpp: the reconstruction of the paper's scheme ends where a simulation
// ends: its kernel run by one thread of the host, and the same on a GPU where there is one.
#include "backend/cuda/run/reconstruction.h"

#include <doctest/doctest.h>

#include "cuda_sets.h"

// What makes the kernel's text a function of the host: a block of one thread, which waits for
// nobody and whose sums nobody else adds to.
#define __device__
#define __global__
#define __shared__
#define __grid_constant__
#define __launch_bounds__(threads)
#define LIMAX_EFFECTS 63
#define LIMAX_PRECISION 0
#define LIMAX_LEAPFROG 0
#define LIMAX_THREADS 1

namespace {

struct place_in_launch {
    int x = 0;
} threadIdx, blockIdx;

void __syncthreads() {}
void atomicAdd(float* sum, float term) { *sum += term; }

}  // namespace

float memory[10000];  // of a block

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include "backend/cuda/kernels/reconstruction.h"
#pragma GCC diagnostic pop
// also the name of an integrator
#undef LIMAX_LEAPFROG

using limax::test::checked_setup;
using limax::test::stage;

namespace {

// Bodies of several sizes that fall onto raised ground while they settle, slide, and then work.
stage landing() {
    stage scene({3, 2, 2}, 4);
    scene.randomize(5, true).effects({"damping", "actuation", "gravity", "ground", "friction"});
    scene.set("ground", "height", {0.25}).set("ground", "stiffness", {2e4});
    limax_simulation_options& options = scene.setup.options;
    options.integrator = LIMAX_SYMPLECTIC_EULER;
    options.precision = LIMAX_SINGLE;
    options.time_step = 1e-4;
    options.settle = 0.1;
    options.duration = 0.2;
    const double position[3] = {100.3, -7.7, 0.26}, velocity[3] = {0.5, -0.2, 0.1};
    std::copy_n(position, 3, options.position);
    std::copy_n(velocity, 3, options.velocity);
    return scene;
}
constexpr int64_t landing_steps = 3000;

// Both sums in single precision, in another order.
constexpr double tolerance = 2e-5;  // m

void check_centers(const stage& scene, const std::vector<double>& center) {
    const auto simulation = scene.run();
    REQUIRE(center.size() == 3 * std::size_t(scene.setup.count));
    for (int robot = 0; robot < scene.setup.count; ++robot) {
        CAPTURE(robot);
        const limax_outcome& outcome = simulation->outcomes()[robot];
        REQUIRE(outcome.status == LIMAX_ROBOT_DONE);
        REQUIRE(outcome.step == landing_steps);
        for (int axis = 0; axis < 3; ++axis) {
            CAPTURE(axis);
            CHECK(std::fabs(center[3 * robot + axis] - outcome.center_end[axis]) < tolerance);
            // it has gone somewhere
            CHECK(std::fabs(outcome.center_end[axis] - outcome.center_start[axis]) >
                  10 * tolerance);
        }
    }
}

}  // namespace

TEST_CASE("the reconstruction's kernel ends where a simulation ends") {
    const stage scene = landing();
    const limax::cuda::listed_population all =
        limax::cuda::list_population(checked_setup(scene), [](int count, const auto& work) {
            for (int i = 0; i < count; ++i) work(i);
        });
    REQUIRE(all.robots.size() == 4);
    // ends, and L0, k, c, A and B of each spring; six values of each mass
    CHECK(all.parameters.size() == 5 * all.ends.size());
    CHECK(all.state.size() == 6 * all.mass.size());
    std::vector<float> state = all.state;
    const auto launch = all.arguments(all.robots.data(), all.ends.data(), all.parameters.data(),
                                      all.mass.data(), state.data(), landing_steps);
    for (blockIdx.x = 0; blockIdx.x < 4; ++blockIdx.x) {
        REQUIRE(std::size_t(all.robots[blockIdx.x].masses) * limax::cuda::reconstructed_values <=
                std::size(memory));
        limax_reconstruct(launch);
    }
    check_centers(scene, all.centers(state));
}

TEST_CASE("the reconstruction takes its own options and valid bodies alone") {
    const auto refused = [](const auto& change) {
        auto setup = checked_setup(landing());
        change(setup);
        return limax::test::refused([&] { limax::cuda::list_population(setup, nullptr); });
    };
    CHECK(refused([](auto& setup) {
              setup.options.integrator = LIMAX_LEAPFROG;
          }).find("integrator and precision") != std::string::npos);
    CHECK(refused([](auto& setup) {
              setup.options.precision = LIMAX_DOUBLE;
          }).find("integrator and precision") != std::string::npos);
    CHECK(refused([](auto& setup) {
              setup.bodies[2].status = LIMAX_BODY_NO_VOXEL;
          }).find("robot 3") != std::string::npos);
    CHECK(refused([](auto& setup) { setup.mask[1] = 0; }).find("robot 2") != std::string::npos);
}

TEST_CASE("the reconstruction on a GPU ends where a simulation ends") {
    const std::string why = limax::cuda::why_no_cuda_device();
    if (!why.empty()) {
        MESSAGE("skipped: ", why);
        return;
    }
    const auto device = limax::cuda::make_cuda_device(1, "");
    stage scene = landing();
    const limax::cuda::reconstructed_run run =
        limax::cuda::run_reconstruction(checked_setup(scene), device->each(), landing_steps);
    CHECK(run.seconds > 0);
    CHECK(run.seconds < 10);
    check_centers(scene, run.center);

    // 21 x 21 x 21 masses take more shared memory than any block has
    const stage large({20, 20, 20});
    auto setup = checked_setup(large);
    setup.options.integrator = LIMAX_SYMPLECTIC_EULER;
    setup.options.precision = LIMAX_SINGLE;
    CHECK(limax::test::refused([&] {
              limax::cuda::run_reconstruction(setup, device->each(), 1);
          }).find("a robot has 9261") != std::string::npos);
}
