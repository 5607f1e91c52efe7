// reconstruction.cpp: a population as lists of masses and springs, and three timed launches of
// kernels/reconstruction.h.
#include "bench/reconstruction.h"

#include <algorithm>
#include <limits>

#include "api/api.h"
#include "backend/cuda/driver/kernel.h"
#include "backend/cuda/kernels/reconstruction_records.h"
#include "body/springs.h"
#include "physics/measure.h"
#include "physics/time_step.h"

namespace limax::cuda {

namespace {

constexpr int threads = 256, repeats = 3;

// All robots as columns, as the kernel reads them.
struct robot_lists {
    std::size_t robots = 0, masses = 0, springs = 0;  // masses and springs of one robot
    std::vector<spring_ends> ends;                    // [robot][spring]
    std::vector<float> parameters;                    // [parameter][robot][spring]
    std::vector<float> mass;                          // kg, [robot][mass]
    std::vector<float> state;  // m from options.position, m/s, [6][robot][mass]
};

void list_robot(const simulation_setup& setup, std::size_t robot, robot_lists& out) {
    const lattice& grid = setup.grid;
    const auto voxels = std::size_t(grid.voxels());
    const spring_body body(body_description{grid, setup.voxels.data() + robot * voxels,
                                            setup.weights.data() + 3 * robot * voxels,
                                            setup.materials.data(), setup.options.edge,
                                            limax_sharing(setup.options.sharing), true, true});
    std::vector<int32_t> number(std::size_t(grid.sites()));
    for (std::size_t i = 0; i < out.masses; ++i) {
        const int32_t site = body.sites[i], row = site / (grid.nx + 1);
        const int at[3] = {site % (grid.nx + 1), row % (grid.ny + 1), row / (grid.ny + 1)};
        const std::size_t mass = robot * out.masses + i;
        number[std::size_t(site)] = int32_t(i);
        out.mass[mass] = body.mass[site];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            out.state[axis * out.mass.size() + mass] =
                float(setup.options.edge * double(at[axis] - body.corner[axis]));
            out.state[(3 + axis) * out.mass.size() + mass] = float(setup.options.velocity[axis]);
        }
    }
    std::size_t spring = robot * out.springs;
    for_each_spring(body, [&](int64_t slot, int64_t near, int64_t far, int d) {
        out.ends[spring] = {number[std::size_t(near)], number[std::size_t(far)]};
        const float values[reconstructed_parameters] = {float(body.rest[d]), body.stiffness[slot],
                                                        body.damping[slot], body.sine[slot],
                                                        body.cosine[slot]};
        for (std::size_t p = 0; p < reconstructed_parameters; ++p)
            out.parameters[p * out.ends.size() + spring] = values[p];
        ++spring;
    });
}

robot_lists list_robots(const simulation_setup& setup) {
    robot_lists out;
    out.robots = std::size_t(setup.count);
    out.masses = std::size_t(setup.bodies[0].masses);
    out.springs = std::size_t(setup.bodies[0].springs);
    out.ends.resize(out.robots * out.springs);
    out.parameters.resize(reconstructed_parameters * out.ends.size());
    out.mass.resize(out.robots * out.masses);
    out.state.resize(6 * out.mass.size());
    for (std::size_t robot = 0; robot < out.robots; ++robot) list_robot(setup, robot, out);
    return out;
}

// The launch arguments but for the addresses of the lists.
reconstruction_launch arguments_of(const simulation_setup& setup, const robot_lists& lists,
                                   int64_t steps) {
    reconstruction_launch launch{};
    launch.robots = int32_t(lists.robots);
    launch.masses = int32_t(lists.masses);
    launch.springs = int32_t(lists.springs);
    launch.steps = steps;
    launch.time_step = setup.options.time_step;
    launch.settle_steps = make_schedule(setup.options, setup.scene, 1.0).settle_steps;
    launch.clock = effects::actuation::make_clock(
        setup.scene.values(effects::index_of<effects::actuation>), launch.time_step);
    // positions of masses are relative to options.position
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::acts_on_masses<E> && !effects::repeatable<E>)
            if (setup.scene.has(effects::index_of<E>))
                launch.params.template of<E>() = E::template make<float>(
                    setup.scene.values(effects::index_of<E>), setup.options.position);
    });
    return launch;
}

template <class T>
device_memory<T> uploaded(const context& gpu, const stream& queue, const std::vector<T>& column) {
    device_memory<T> memory(gpu, column.size(), "the lists of the reconstruction");
    memory.upload(column.data(), column.size(), queue);
    return memory;
}

void run(const simulation_setup& setup, int64_t steps, double& seconds, double center[3]) {
    const robot_lists lists = list_robots(setup);
    std::string why;
    const driver* api = driver::get(&why);
    if (!api) fail(LIMAX_NO_DEVICE, "the reconstruction of the paper's scheme: " + why);
    gpu_place place(*api, api->gpus().front().ordinal);
    const context& gpu = place.gpu;
    const stream queue(gpu);
    const auto ends = uploaded(gpu, queue, lists.ends);
    const auto parameters = uploaded(gpu, queue, lists.parameters);
    const auto mass = uploaded(gpu, queue, lists.mass);
    auto state = uploaded(gpu, queue, lists.state);
    reconstruction_launch arguments = arguments_of(setup, lists, steps);
    arguments.ends = ends.data();
    arguments.parameters = parameters.data();
    arguments.mass = mass.data();
    arguments.state = state.data();

    const auto module = place.kernels.load({"reconstruction",
                                            {{"LIMAX_EFFECTS", std::to_string(setup.scene.mask())},
                                             {"LIMAX_PRECISION", "0"},
                                             {"LIMAX_LEAPFROG", "0"},
                                             {"LIMAX_THREADS", std::to_string(threads)}}});
    const char* const function = "limax_reconstruct";
    const std::size_t shared = lists.masses * reconstructed_values * sizeof(float);
    module->allow_shared_memory(function, shared);
    const std::string doing = "stepping by the reconstruction of the paper's scheme";
    event start(gpu), end(gpu);
    seconds = std::numeric_limits<double>::infinity();
    for (int repeat = 0; repeat < repeats; ++repeat) {
        state.upload(lists.state.data(), lists.state.size(), queue);
        start.record(queue);
        launch(gpu, module->function(function), {unsigned(lists.robots), threads, shared}, queue,
               doing, arguments);
        end.record(queue);
        queue.synchronize(doing);
        seconds = std::min(seconds, end.seconds_since(start));
    }
    std::vector<float> last(lists.state.size());
    state.download(last.data(), last.size(), queue);
    queue.synchronize(doing);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double moment = 0, total = 0;
        for (std::size_t i = 0; i < lists.masses; ++i) {
            moment += double(lists.mass[i]) * double(last[axis * lists.mass.size() + i]);
            total += double(lists.mass[i]);
        }
        center[axis] = setup.options.position[axis] + moment / total;
    }
}

}  // namespace

}  // namespace limax::cuda

extern "C" limax_status limax_bench_reconstruction(
    limax_device* device, const limax_population* population, const limax_materials* materials,
    const limax_scene* scene, const limax_simulation_options* options, int64_t steps,
    double* seconds, double center[3]) {
    return limax::api::guard([&] {
        const limax::simulation_setup setup = limax::api::make_setup(
            population->it, materials->it, scene->it, *options, nullptr, *device->it);
        setup.fetch_bodies();
        limax::cuda::run(setup, steps, *seconds, center);
    });
}
