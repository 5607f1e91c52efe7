// backend.cpp: which device a name means, and what every device refuses.
#include "backend/backend.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "backend/cpu/device.h"
#include "base/fields.h"
#if defined(LIMAX_WITH_CUDA)
#include "backend/cuda/run/device.h"
#endif

namespace limax {

namespace {

std::atomic<bool> stop_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");
static_assert(int(trace_center) == int(LIMAX_TRACE_CENTER_OF_MASS) &&
              int(trace_contact) == int(LIMAX_TRACE_CONTACT) &&
              int(trace_energy) == int(LIMAX_TRACE_ENERGY) &&
              int(trace_strain) == int(LIMAX_TRACE_STRAIN));

void require_choice(const char* name, int value, int count) {
    if (value < 0 || value >= count)
        fail(LIMAX_INVALID_ARGUMENT,
             format("%s is %d; it must be 0 to %d", name, value, count - 1));
}

// RK4 has its order for smooth forces only, and cannot apply the impulses of drag and friction.
void require_smooth(const scene& scene) {
    std::string rough;
    effects::for_each([&]<class E>(E) {
        if (scene.has(effects::index_of<E>) &&
            (effects::is_contact<E> || (E::hooks & (effects::hook_face | effects::hook_slip |
                                                    effects::hook_meet | effects::hook_solid))))
            rough += (rough.empty() ? "" : " and ") + std::string(E::name);
    });
    if (!rough.empty())
        fail(LIMAX_INVALID_ARGUMENT,
             format("integrator: rk4 integrates smooth scenes only; the scene has %s; use leapfrog",
                    rough.c_str()));
}

}  // namespace

bool interrupted() { return stop_flag.load(std::memory_order_relaxed); }
void set_interrupted(bool stop) { stop_flag.store(stop, std::memory_order_relaxed); }

void require_block(const scene& scene, int32_t which) {
    const int count = scene.instances(effects::index_of<effects::block>);
    if (count == 0)
        fail(LIMAX_INVALID_ARGUMENT,
             "there is no block: the scene does not name the effect 'block'");
    if (which < 0 || which >= count)
        fail(LIMAX_INVALID_ARGUMENT, format("there is no block %d: the scene has %d block%s",
                                            which + 1, count, count == 1 ? "" : "s"));
}

void simulation::set_state(int32_t /*robot*/, int32_t /*state*/, const double* /*values*/) {
    fail(LIMAX_INVALID_ARGUMENT, "states of a controller can be set on the CPU only");
}

uint64_t all_bytes_held() {
    uint64_t bytes = bytes_held().load();
#if defined(LIMAX_WITH_CUDA)
    bytes += cuda::gpu_bytes_held().load();
#endif
    return bytes;
}

std::unique_ptr<device> make_device(const std::string& name, int threads, const char* isa) {
    require_range("threads", threads, 0, 1024, "");
#if defined(LIMAX_WITH_CUDA)
    const std::string why = cuda::why_no_cuda_device();
#else
    const std::string why = "this build has no CUDA engine";
#endif
    if (name == "cpu" || (name == "auto" && !why.empty()))
        return cpu::make_cpu_device(threads, isa, why.empty() ? "not asked for" : why);
    if (name == "auto" || name == "cuda") {
        if (!why.empty()) fail(LIMAX_NO_DEVICE, "device 'cuda': " + why + "; use 'cpu' or 'auto'");
#if defined(LIMAX_WITH_CUDA)
        return cuda::make_cuda_device(threads, isa);
#endif
    }
    fail(LIMAX_INVALID_ARGUMENT,
         format("device is '%s'; it must be auto, cpu or cuda", name.c_str()));
}

void start_outcome(const simulation_setup& setup, int32_t index, limax_outcome& outcome) {
    outcome = {};
    outcome.path_length = outcome.height = outcome.contact = outcome.kinetic = outcome.elastic =
        outcome.muscle_work = outcome.strain = outcome.strain_most = outcome.block_upright =
            std::nan("");
    for (double* place :
         {outcome.block_start, outcome.block_middle, outcome.block_end, outcome.block_velocity})
        std::fill_n(place, 3, std::nan(""));
    const limax_body& body = setup.bodies[std::size_t(index)];
    if (!setup.mask[std::size_t(index)]) {
        outcome.status = LIMAX_ROBOT_SKIPPED;
    } else if (body.status == LIMAX_BODY_VALID) {
        outcome.status = LIMAX_ROBOT_RUNNING;
        outcome.masses = body.masses;
        outcome.springs = body.springs;
    } else {
        outcome.status = LIMAX_ROBOT_INVALID;
        outcome.reason = body.status;
    }
}

void keep_summary(const trace_summary& summary, limax_outcome& outcome) {
    outcome.path_length = summary.path_length;
    outcome.height = summary.height;
    outcome.contact = summary.contact;
    outcome.kinetic = summary.kinetic;
    outcome.elastic = summary.elastic;
    outcome.muscle_work = summary.muscle_work;
    outcome.strain = summary.strain;
    outcome.strain_most = summary.strain_most;
}

void check_options(const limax_simulation_options& options, const scene& scene) {
    require_choice("integrator", options.integrator, 3);
    require_choice("precision", options.precision, 3);
    require_choice("sharing", options.sharing, 2);
    require_choice("bound", options.bound, 2);
    const auto check = [](const char* name, double value, const char* label = nullptr) {
        require_field(simulation_fields, name, value, label);
    };
    check("duration", options.duration);
    check("settle", options.settle);
    if (options.time_step != 0) {
        check("time_step", options.time_step);
    } else {
        check("bound_fraction", options.bound_fraction);
        if (options.time_step_most != 0)
            check("time_step", options.time_step_most, "time_step_most");
    }
    check("edge", options.edge);
    check("max_speed", options.max_speed);
    check("max_stretch", options.max_stretch);
    static const char* const axes[3] = {"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
        check("position", options.position[axis], format("position %s", axes[axis]).c_str());
        check("velocity", options.velocity[axis], format("velocity %s", axes[axis]).c_str());
    }
    static const char* const kinds[LIMAX_TRACE_KINDS] = {
        "center_of_mass", "position",   "velocity", "contact", "energy",
        "strain",         "activation", "sensor",   "ledger",  "block"};
    for (int kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
        check("record", options.record[kind], format("record.%s", kinds[kind]).c_str());
    if (options.record[LIMAX_TRACE_CONTACT] && !(scene.mask() & effects::contact_bits))
        fail(LIMAX_INVALID_ARGUMENT,
             format("record.contact needs the effect %s, which the scene does not name",
                    one_of(effect_entries()[effects::index_of<effects::friction>].needs).c_str()));
    if (options.record[LIMAX_TRACE_BLOCK] && !scene.has(effects::index_of<effects::block>))
        fail(LIMAX_INVALID_ARGUMENT,
             "record.block needs the effect 'block', which the scene does not name");
    scene.check();
    const bool controlled = scene.has(effects::index_of<effects::control>);
    for (const int kind : {LIMAX_TRACE_ACTIVATION, LIMAX_TRACE_SENSOR})
        if (options.record[kind] && !controlled)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("record.%s needs the effect 'control', which the scene does not name",
                        kinds[kind]));
    if (options.record[LIMAX_TRACE_LEDGER] && controlled &&
        scene.values(effects::index_of<effects::control>)[effects::control::at_hold] != 0)
        fail(LIMAX_INVALID_ARGUMENT,
             "record.ledger: the energy ledger does not support scene.control.hold, whose rest "
             "lengths jump");
    for (const scripted_effect& script : scene.scripts()) {
        if (options.time_step == 0 && !script.bounded)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("scene.%s states no bound, so no time step can be chosen for it: give "
                        "bound = { stiffness = N/m, damping = N s/m } of its force, or a time_step",
                        script.name.c_str()));
        if (options.record[LIMAX_TRACE_LEDGER])
            fail(LIMAX_INVALID_ARGUMENT,
                 format("record.ledger: the energy ledger does not support scripted effects; "
                        "the scene has '%s'",
                        script.name.c_str()));
    }
    if (options.integrator == LIMAX_RK4) require_smooth(scene);
}

uint64_t simulation_setup::noise_seed(int32_t robot) const {
    const double* values = scene.values(effects::index_of<effects::control>);
    uint64_t hash = bodies[std::size_t(robot)].hash + uint64_t(values[effects::control::at_seed]);
    for (int32_t g = 0; g < scene.controller().genes; ++g)  // FNV-1a
        hash =
            (hash ^ bits_as<uint32_t>(control[std::size_t(int64_t(robot) * control_genes + g)])) *
            1099511628211u;
    return hash;
}

void check_beyond_cpu(const limax_simulation_options& options) {
    if (options.integrator == LIMAX_RK4)
        fail(LIMAX_INVALID_ARGUMENT,
             "integrator: rk4 runs on the cpu only; use device 'cpu' or the integrator leapfrog");
    if (options.record[LIMAX_TRACE_LEDGER])
        fail(LIMAX_INVALID_ARGUMENT,
             "record.ledger: the energy ledger exists on the cpu only; use device 'cpu'");
}

}  // namespace limax
