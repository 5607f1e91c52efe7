// reconstruction.cpp: bodies as lists of masses and springs, three timed launches, and where the
// centres of mass are then.
#include "backend/cuda/run/reconstruction.h"

#include <algorithm>

#include "backend/cuda/driver/kernel.h"
#include "body/springs.h"
#include "physics/measure.h"
#include "physics/time_step.h"

namespace limax::cuda {

namespace {

constexpr int threads = 256, repeats = 3;
constexpr int state_columns = 6;

// A robot as a plain list.
struct listed_body {
    std::vector<spring_ends> ends;
    std::vector<float> parameters;  // [parameter][spring]
    std::vector<float> mass;        // kg
    std::vector<float> position;    // m from where the lowest corner of its box starts, [3][mass]
    reconstructed_robot robot{};
};

listed_body list_body(const simulation_setup& setup, int32_t index) {
    const lattice& grid = setup.grid;
    const limax_simulation_options& options = setup.options;
    const bool damped = setup.scene.has(effects::index_of<effects::damping>);
    const bool actuated = setup.scene.has(effects::index_of<effects::actuation>);
    const int64_t voxels = grid.voxels();
    const spring_body body(body_description{
        grid, setup.voxels.data() + index * voxels, setup.weights.data() + 3 * index * voxels,
        setup.materials.data(), options.edge, limax_sharing(options.sharing), damped, actuated});
    listed_body out;
    std::vector<int32_t> number(std::size_t(grid.sites()), -1);
    for (int32_t i = 0; i < body.masses; ++i) {
        number[std::size_t(body.sites[i])] = i;
        out.mass.push_back(body.mass[body.sites[i]]);
    }
    const int along_x = grid.nx + 1, along_y = grid.ny + 1;
    for (int axis = 0; axis < 3; ++axis)
        for (int32_t i = 0; i < body.masses; ++i) {
            const int32_t site = body.sites[i];
            const int index_of_site[3] = {site % along_x, site / along_x % along_y,
                                          site / (along_x * along_y)};
            out.position.push_back(
                float(options.edge * double(index_of_site[axis] - body.corner[axis])));
        }
    for_each_spring(body, [&](int64_t, int64_t near, int64_t far, int) {
        out.ends.push_back({number[std::size_t(near)], number[std::size_t(far)]});
    });
    for_each_spring(body, [&](int64_t, int64_t, int64_t, int d) {
        out.parameters.push_back(float(body.rest[d]));
    });
    for (const array<float>* column : {&body.stiffness, &body.damping, &body.sine, &body.cosine})
        if (column->size() > 0)
            for_each_spring(body, [&](int64_t slot, int64_t, int64_t, int) {
                out.parameters.push_back((*column)[slot]);
            });

    const schedule plan =
        make_schedule(options, setup.scene,
                      time_step_bound(body, setup.scene, limax_integrator(options.integrator)));
    out.robot.masses = body.masses;
    out.robot.springs = body.springs;
    out.robot.time_step = plan.time_step;
    out.robot.settle_steps = plan.settle_steps;
    if (actuated)
        out.robot.clock = effects::actuation::make_clock(
            setup.scene.values(effects::index_of<effects::actuation>), plan.time_step);
    return out;
}

void check_setup(const simulation_setup& setup) {
    if (setup.options.integrator != LIMAX_SYMPLECTIC_EULER ||
        setup.options.precision != LIMAX_SINGLE)
        fail(LIMAX_INVALID_ARGUMENT,
             "the reconstruction of the paper's scheme steps by symplectic Euler in single "
             "precision: integrator and precision must say so");
    effects::for_each([&]<class E>(E) {
        const bool unknown =
            effects::repeatable<E> ||
            (E::hooks & (effects::hook_hold | effects::hook_face | effects::hook_meet)) != 0 ||
            effects::reads_heights<E>;
        if (unknown && setup.scene.has(effects::index_of<E>))
            fail(LIMAX_INVALID_ARGUMENT,
                 format("the reconstruction of the paper's scheme knows no '%s'", E::name));
    });
    if (!setup.scene.scripts().empty())
        fail(LIMAX_INVALID_ARGUMENT,
             format("the reconstruction of the paper's scheme knows no scripted effect; the scene "
                    "has '%s'",
                    setup.scene.scripts()[0].name.c_str()));
    for (std::size_t i = 0; i < setup.bodies.size(); ++i)
        if (!setup.mask[i] || setup.bodies[i].status != LIMAX_BODY_VALID)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("the reconstruction of the paper's scheme runs valid bodies alone; robot "
                        "%zu is not one",
                        i + 1));
}

// Parameters on masses, relative to where the box of every robot starts.
mass_params<float> params_of(const simulation_setup& setup) {
    mass_params<float> params{};
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::acts_on_masses<E> && !effects::repeatable<E>)
            params.template of<E>() = E::template make<float>(
                setup.scene.values(effects::index_of<E>), setup.options.position);
    });
    return params;
}

// What `columns` hold, on the GPU.
template <class T>
device_memory<T> sent(const context& gpu, const stream& queue, const std::vector<T>& columns,
                      const char* what) {
    device_memory<T> memory(gpu, columns.size(), what);
    memory.upload(columns.data(), columns.size(), queue);
    return memory;
}

}  // namespace

listed_population list_population(const simulation_setup& setup, const parallel_for& each) {
    check_setup(setup);
    setup.fetch_bodies();
    std::vector<listed_body> bodies(std::size_t(setup.count));
    each(setup.count, [&](int i) { bodies[std::size_t(i)] = list_body(setup, i); });
    listed_population out{};
    std::copy_n(setup.options.position, 3, out.position);
    out.params = params_of(setup);
    std::size_t masses = 0, springs = 0;
    for (listed_body& body : bodies) {
        body.robot.first_mass = int64_t(masses);
        body.robot.first_spring = int64_t(springs);
        masses += body.mass.size();
        springs += body.ends.size();
        out.robots.push_back(body.robot);
        out.ends.insert(out.ends.end(), body.ends.begin(), body.ends.end());
        out.mass.insert(out.mass.end(), body.mass.begin(), body.mass.end());
    }
    const std::size_t parameters =
        springs > 0 ? bodies.front().parameters.size() / bodies.front().ends.size() : 0;
    out.parameters.resize(parameters * springs);
    out.state.resize(state_columns * masses);
    for (const listed_body& body : bodies) {
        const auto first_mass = std::size_t(body.robot.first_mass);
        const auto first_spring = std::size_t(body.robot.first_spring);
        for (std::size_t p = 0; p < parameters; ++p)
            std::copy_n(body.parameters.begin() + std::ptrdiff_t(p * body.ends.size()),
                        body.ends.size(),
                        out.parameters.begin() + std::ptrdiff_t(p * springs + first_spring));
        for (std::size_t axis = 0; axis < 3; ++axis) {
            std::copy_n(body.position.begin() + std::ptrdiff_t(axis * body.mass.size()),
                        body.mass.size(),
                        out.state.begin() + std::ptrdiff_t(axis * masses + first_mass));
            std::fill_n(out.state.begin() + std::ptrdiff_t((3 + axis) * masses + first_mass),
                        body.mass.size(), float(setup.options.velocity[axis]));
        }
    }
    return out;
}

reconstruction_launch listed_population::arguments(const reconstructed_robot* robots_at,
                                                   const spring_ends* ends_at,
                                                   const float* parameters_at, const float* mass_at,
                                                   float* state_at, int64_t steps) const {
    return {robots_at,
            ends_at,
            parameters_at,
            mass_at,
            state_at,
            int64_t(ends.size()),
            int64_t(mass.size()),
            steps,
            params};
}

std::vector<double> listed_population::centers(const std::vector<float>& of_state) const {
    std::vector<double> center;
    for (const reconstructed_robot& robot : robots)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto first = std::size_t(robot.first_mass);
            double moment = 0, total = 0;
            for (std::size_t i = first; i < first + std::size_t(robot.masses); ++i) {
                moment += double(mass[i]) * double(of_state[axis * mass.size() + i]);
                total += double(mass[i]);
            }
            center.push_back(position[axis] + moment / total);
        }
    return center;
}

reconstructed_run run_reconstruction(const simulation_setup& setup, const parallel_for& each,
                                     int64_t steps) {
    std::string why;
    const driver* api = driver::get(&why);
    if (!api) fail(LIMAX_NO_DEVICE, "the reconstruction of the paper's scheme: " + why);
    const context gpu(*api, api->gpus().front().ordinal);
    const listed_population all = list_population(setup, each);
    int32_t most_masses = 0;
    for (const reconstructed_robot& robot : all.robots)
        most_masses = std::max(most_masses, robot.masses);
    const std::size_t shared_bytes =
        std::size_t(most_masses) * reconstructed_values * sizeof(float);
    // the muscles' moment lies there too
    constexpr std::size_t moment_bytes = 16;
    static_assert(sizeof(effects::actuation::moment<float>) <= moment_bytes);
    const std::size_t most = gpu.device().shared_memory_of_block - moment_bytes;
    if (shared_bytes > most)
        fail(LIMAX_INVALID_ARGUMENT,
             format("the reconstruction of the paper's scheme keeps a body in a block's shared "
                    "memory, where %zu masses fit on this GPU; a robot has %d",
                    most / (reconstructed_values * sizeof(float)), most_masses));

    const stream queue(gpu);
    const auto robots = sent(gpu, queue, all.robots, "the robots of the reconstruction");
    const auto ends = sent(gpu, queue, all.ends, "the springs of the reconstruction");
    const auto parameters = sent(gpu, queue, all.parameters, "the springs of the reconstruction");
    const auto mass = sent(gpu, queue, all.mass, "the masses of the reconstruction");
    auto state = sent(gpu, queue, all.state, "the state of the reconstruction");
    kernel_library kernels(gpu, origins_of_environment());
    const auto module = kernels.load({"reconstruction",
                                      {{"LIMAX_EFFECTS", std::to_string(setup.scene.mask())},
                                       {"LIMAX_PRECISION", std::to_string(setup.options.precision)},
                                       {"LIMAX_LEAPFROG", "0"},
                                       {"LIMAX_THREADS", std::to_string(threads)}}});
    const char* const entry = "limax_reconstruct";
    module->allow_shared_memory(entry, shared_bytes);
    const reconstruction_launch arguments = all.arguments(
        robots.data(), ends.data(), parameters.data(), mass.data(), state.data(), steps);
    const std::string doing = "stepping by the reconstruction of the paper's scheme";
    event start(gpu), end(gpu);
    reconstructed_run out{};
    for (int repeat = 0; repeat < repeats && !(repeat > 0 && interrupted()); ++repeat) {
        state.upload(all.state.data(), all.state.size(), queue);
        start.record(queue);
        launch(gpu, module->function(entry), {unsigned(setup.count), threads, shared_bytes}, queue,
               doing, arguments);
        end.record(queue);
        queue.synchronize(doing);
        const double seconds = end.seconds_since(start);
        out.seconds = repeat == 0 ? seconds : std::min(out.seconds, seconds);
    }
    std::vector<float> last(all.state.size());
    state.download(last.data(), last.size(), queue);
    queue.synchronize(doing);
    out.center = all.centers(last);
    return out;
}

}  // namespace limax::cuda
