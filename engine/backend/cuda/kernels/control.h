// control.h: the controller of a robot in a kernel: one tick of a voxel, what the tick does to a
// spring, and what is measured once for the body. Its memory is in global memory, so that every
// path does the same. Compiled for one controller:
//   LIMAX_CONTROL            its program, as scripted::kernel_text() writes it
//   LIMAX_CONTROL_REGISTERS  that it needs
//   LIMAX_CONTROL_SENSORS    bits of the sensors that it reads
//   LIMAX_CONTROL_GENES, LIMAX_CONTROL_STATES, LIMAX_CONTROL_MESSAGES  that it uses
//   LIMAX_CONTROL_SLOTS      ticks for which measured inputs are kept; 0 without a delay
//   LIMAX_CONTROL_SEEN       1 if inputs are kept for samples
// SI units.
#pragma once

#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/solid.h"
#include "backend/cuda/kernels/springs.h"
#include "physics/body_frame.h"
#include "physics/drive.h"

#if !defined(LIMAX_CONTROL)
#define LIMAX_CONTROL
#define LIMAX_CONTROL_REGISTERS 1
#define LIMAX_CONTROL_GENES 0
#define LIMAX_CONTROL_STATES 0
#define LIMAX_CONTROL_MESSAGES 0
#define LIMAX_CONTROL_SLOTS 0
#define LIMAX_CONTROL_SEEN 0
#endif

namespace limax::cuda {

inline constexpr int control_genes = LIMAX_CONTROL_GENES;
inline constexpr int shared_genes = control_genes <= most_shared_genes ? control_genes : 0;
inline constexpr int measured_inputs =
    sensors::count_bits(control_sensors & ((uint64_t(1) << sensors::measured) - 1));
inline constexpr control_layout layout{LIMAX_CONTROL_STATES, LIMAX_CONTROL_MESSAGES,
                                       measured_inputs, LIMAX_CONTROL_SLOTS,
                                       LIMAX_CONTROL_SEEN* sensors::count_bits(control_sensors)};
inline constexpr bool senses_body = sensors::reads_body(control_sensors);
// Inputs that are the same for all voxels of a robot.
inline constexpr int whole_inputs = senses_body ? sensors::measured - sensors::gravity : 1;

// The same number, of which a compiler knows nothing: what follows from it is computed where it is
// needed, and occupies no register in the loop over steps.
__device__ inline int opaque(int number) {
#if defined(__CUDA_ARCH__)
    asm volatile("mov.u32 %0, %0;" : "+r"(number));
#endif
    return number;
}

// A scene of a kernel, for laws that take one of the host too.
struct scene_of_kernel {
    const scene_values& scene;
    LIMAX_LAW bool has(int effect) const { return LIMAX_EFFECTS >> effect & 1; }
    LIMAX_LAW int instances(int effect) const { return scene.count[effect]; }
    LIMAX_LAW const double* values(int effect, int instance) const {
        return scene.of(effect, instance);
    }
};

__device__ inline const double* control_values(const launch_arguments& launch) {
    return launch.scene.of(effects::index_of<effects::control>);
}

// ---- what a tick does to springs ----

// Where a robot is between two ticks, and its memory.
struct control_state {
    const real* columns;  // [column][voxel]
    int64_t voxels;
    int now;     // the half of the last tick
    real share;  // as in change_of()
};
__device__ inline real share_of(const scene_values& scene, const robot_record& record) {
    const bool holds =
        scene.of(effects::index_of<effects::control>)[effects::control::at_hold] != 0.0;
    return holds ? real(0) : real(1) / real(record.tick);
}
__device__ inline control_state control_state_of(const real* all, const scene_values& scene,
                                                 const robot_record& record, int64_t robot,
                                                 int64_t voxels) {
    return {all + robot * layout.count() * voxels, voxels, int(record.ticks - 1 & 1),
            share_of(scene, record)};
}

// The change of the rest length of the spring from a site along a direction. `columns` are the
// robot's springs; drive(voxel, half) is gain times activation.
template <class Drive>
__device__ inline drive_change<real> change_at(const control_state& state, const site_grid& grid,
                                               const float* columns, int number, int site,
                                               const Drive& drive) {
    const lattice body{grid.x - 1, grid.y - 1, grid.z - 1};
    const float scale = columns[(spring_columns * direction_count + number) * grid.count() + site];
    return change_of_spring(body, site % grid.x, site / grid.x % grid.y, site / (grid.x * grid.y),
                            direction_at(number), real(scale), state.share,
                            [&](int64_t voxel, int which) {
                                return drive(int(voxel), which ? 1 - state.now : state.now);
                            });
}
// As global memory has it, past the first-level cache.
struct stored_drive {
    const real* columns;
    int64_t voxels;
    __device__ explicit stored_drive(const control_state& state)
        : columns(state.columns + layout.drive() * state.voxels), voxels(state.voxels) {}
    __device__ real operator()(int voxel, int half) const {
        return __ldcg(columns + half * voxels + voxel);
    }
};
// Its A and B.
template <class Drive>
__device__ inline drive_change<float> driven_at(const launch_arguments& launch,
                                                const control_state& state, const site_grid& grid,
                                                const float* columns, int number, int site,
                                                const Drive& drive) {
    return driven_spring(change_at(state, grid, columns, number, site, drive),
                         rest_length(launch, direction_at(number).squared() - 1),
                         real(columns[number * grid.count() + site]));
}

// What a block keeps in shared memory.
struct control_block {
    alignas(16) float genes[shared_genes > 0 ? shared_genes : 1];
    int64_t sums[senses_body ? sensors::body_sums : 1];
    real whole[whole_inputs];
    real since_tick;   // steps from the last tick to the last event
    real share;        // as in change_of()
    real per_gravity;  // as in tick_voxel()

    // By one thread.
    __device__ void prepare(const launch_arguments& launch, const robot_record& record) {
        share = share_of(launch.scene, record);
        const double* g = launch.scene.of(effects::index_of<effects::gravity>);
        const double squared = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
        per_gravity =
            has<effects::gravity> && squared > 0.0 ? real(1.0 / square_root(squared)) : real(0);
    }

    // Copies the genes of a robot, by all threads of the block.
    __device__ void load(const launch_arguments& launch, const robot_record& record, int64_t robot,
                         int threads) {
        if (threadIdx.x == 0) prepare(launch, record);
        for (int i = threadIdx.x; i < shared_genes; i += threads)
            genes[i] = launch.control.genes[robot * control_genes + i];
    }
    __device__ const float* genes_of(const launch_arguments& launch, int64_t robot) const {
        return shared_genes > 0 ? genes : launch.control.genes + robot * control_genes;
    }
};

// ---- the body as a whole ----

// What the mass at a site adds to a sum of body_frame.h.
__device__ inline int64_t part_of_body(int number, const corner& c, float mass,
                                       const site_grid& grid, int site, double of_total) {
    return sensors::part_of_sum(
        number, double(absolute(mass)) * of_total, {double(c.x), double(c.y), double(c.z)},
        {double(c.vx), double(c.vy), double(c.vz)},
        {double(site % grid.x), double(site / grid.x % grid.y), double(site / (grid.x * grid.y))});
}

// The inputs that are the same for all voxels. `block` is the first one; null in a scene without
// any.
__device__ __noinline__ void sense_whole(const launch_arguments& launch, const robot_record& record,
                                         const int64_t sums[sensors::body_sums],
                                         const solid_record* block, real out[whole_inputs]) {
    const scene_of_kernel in{launch.scene};
    const double rate = control_values(launch)[effects::control::at_rate];
    sensors::surroundings around =
        sensors::surroundings_of(in, record.origin, double(record.ticks) / rate);
    if constexpr (has_solid) {
        around.has_block = true;
        around.block = fetched(block->body.block.place);
        around.block_velocity = fetched(block->body.block.read.velocity);
    }
    double sensed[sensors::measured - sensors::gravity];
    sensors::sense_body(
        sensors::frame_of(sums), around, launch.rest[0],
        [&](double x, double y) {
            return sensors::ground_height(in, record.origin, launch.scene.heights, x, y);
        },
        sensed);
    for (int i = 0; i < whole_inputs; ++i) out[i] = real(sensed[i]);
}

// ---- one voxel ----

// A perceptron (scripted/program.h): some hidden units at once, so that their sums overlap.
template <int first, int hidden, int outputs, int inputs>
__device__ inline void evaluate_layer(const float* genes, const real (&in)[inputs], real* out) {
    constexpr int at_once = hidden % 4 == 0 ? 4 : 1;
    constexpr int row = scripted::row_of_layer(inputs, outputs);
    const float* const c = genes + first + hidden * row;
    for (int o = 0; o < outputs; ++o) out[o] = real(c[hidden + o]);
#pragma unroll 1
    for (int group = 0; group < hidden; group += at_once) {
#pragma unroll
        for (int u = 0; u < at_once; ++u) {
            const float* const weights = genes + first + (group + u) * row;
            float w[row];
#pragma unroll
            for (int k = 0; k < row; k += 4) {
                const float4 four = *reinterpret_cast<const float4*>(weights + k);
                w[k] = four.x;
                w[k + 1] = four.y;
                w[k + 2] = four.z;
                w[k + 3] = four.w;
            }
            real z = real(c[group + u]);
#pragma unroll
            for (int k = 0; k < inputs; ++k) z = fma(real(w[k]), in[k], z);
            z = tangent_of_controller(z);
#pragma unroll
            for (int o = 0; o < outputs; ++o) out[o] = fma(real(w[inputs + o]), z, out[o]);
        }
    }
}

// The controller on the registers of a voxel, whose inputs are filled.
__device__ inline void run_controller([[maybe_unused]] const real* parameters,
                                      [[maybe_unused]] const float* genes,
                                      real (&at)[LIMAX_CONTROL_REGISTERS],
                                      real results[1 + layout.states + layout.messages]) {
    using namespace scripted;
#define LIMAX_CONSTANT(to, number) at[to] = real(number);
#define LIMAX_OPERATION(to, what, a, b, c) at[to] = apply<operation(what)>(at[a], at[b], at[c]);
#define LIMAX_PARAMETER(to, number) at[to] = parameters[number];
#define LIMAX_GENE(to, number) at[to] = real(genes[number]);
#define LIMAX_LAYER(to, first, hidden, outputs, inputs, ...)        \
    {                                                               \
        const real in[inputs] = {__VA_ARGS__};                      \
        evaluate_layer<first, hidden, outputs>(genes, in, at + to); \
    }
#define LIMAX_RESULT(number, from) results[number] = at[from];
    LIMAX_CONTROL
#undef LIMAX_CONSTANT
#undef LIMAX_PARAMETER
#undef LIMAX_OPERATION
#undef LIMAX_GENE
#undef LIMAX_LAYER
#undef LIMAX_RESULT
}

// The push of all contacts on a place, without damping, N, and whether any touches it.
__device__ inline void press(const scene_params& params, const effects::vector<real>& place,
                             real& push, bool& touches) {
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::is_contact<E>)
            each_instance<E>(params, [&](const auto& contact) {
                const real depth = E::surface(contact, place).depth;
                push += depth > real(0) ? contact.stiffness * depth : real(0);
                touches |= depth > real(0);
            });
    });
}

// Tick `number` of the voxel (x, y, z) of a robot. corner_at(site, c) gives the mass at corner c as
// springs read it. `per_gravity` is one over its strength, s^2/m, or 0; show(site, half, drive)
// gets the drive that it stores. Returns false if the controller gave a value that is not finite.
template <class Corner, class Show>
__device__ inline bool tick_voxel(const launch_arguments& launch, const robot_record& record,
                                  const scene_params& params, int64_t robot, int64_t number,
                                  const site_grid& grid, int x, int y, int z, const float* genes,
                                  const real* whole, real per_gravity, const Corner& corner_at,
                                  const Show& show) {
    using namespace sensors;
    const lattice body{grid.x - 1, grid.y - 1, grid.z - 1};
    const int64_t voxels = body.voxels(), voxel = body.voxel(x, y, z);
    const double* const values = control_values(launch);
    real* const columns = launch.control.columns + robot * layout.count() * voxels + voxel;
    const int now = int(number & 1);
    const auto column = [&](int place) -> real& { return columns[place * voxels]; };
    const float* const muscles = launch.control.muscles + robot * muscle_columns * voxels + voxel;
    const float gain = muscles[0];  // NaN of an empty voxel, which computes in vain
    real at[LIMAX_CONTROL_REGISTERS];
    if constexpr (reads(control_sensors, strain, gravity)) {
        real sensed[gravity];
        real per_weight = 0;
        if constexpr (has<effects::gravity> && reads(control_sensors, load, contact))
            per_weight = real(muscles[2 * voxels]) * per_gravity;
        sense_voxel<real>(
            rest_length(launch, 0), per_weight,
            [&](int c) {
                const cuda::corner own = corner_at(grid.at(x, y, z), c);
                sensors::corner<real> seen{{own.x, own.y, own.z}, {}, real(0), false};
                if constexpr (senses_rates) seen.velocity = {own.vx, own.vy, own.vz};
                if constexpr (reads(control_sensors, load, gravity))
                    press(params, seen.position, seen.push, seen.touches);
                return seen;
            },
            sensed);
        for (int i = 0; i < gravity; ++i) at[i] = sensed[i];
    }
    if constexpr (senses_body)
        for (int i = 0; i < whole_inputs; ++i) at[gravity + i] = whole[i];
    each_constant<measured>([&](auto i) {
        if constexpr (control_sensors >> i.value & 1) {
            real& value = at[i.value];
            if (values[effects::control::at_noise] > 0.0)
                value = fma(real(values[effects::control::at_noise]),
                            real(noise(record.noise_seed, uint32_t(number), uint32_t(voxel),
                                       uint32_t(i.value))),
                            value);
            if constexpr (layout.slots > 0) {
                constexpr int place = count_bits(control_sensors & ((uint64_t(1) << i.value) - 1));
                const auto slot = [&](int64_t tick) -> real& {
                    constexpr int slots = layout.slots > 0 ? layout.slots : 1;
                    return column(layout.past() + int(tick % slots) * layout.measured + place);
                };
                slot(number) = value;
                const int64_t seen = number - (layout.slots - 1);
                value = slot(seen > 0 ? seen : 0);
            }
        }
    });
    const real before = column(layout.activation() + now);
    at[activation] = before;
    at[place] = place_along<real>(x, body.nx);
    at[place + 1] = place_along<real>(y, body.ny);
    at[place + 2] = place_along<real>(z, body.nz);
    at[phase] = real(muscles[voxels]);
    sine_cosine(uint64_t(number) * record.phase_per_step, at[clock_sine], at[clock_cosine]);
    at[sensors::time] = real(double(number) / values[effects::control::at_rate]);
    each_constant<layout.states>(
        [&](auto i) { at[first_state + i.value] = column(layout.state() + i.value); });
    const real* const said = columns + (layout.said() + now * layout.messages) * voxels;
    each_constant<layout.messages * neighbours>([&](auto i) {
        constexpr int message = i.value / neighbours, side = i.value % neighbours;
        at[first_heard + i.value] =
            has_neighbour(body, x, y, z, side)
                ? __ldcg(said + (message * voxels + step_to_neighbour(body, side)))
                : real(0);
    });
    if constexpr (layout.seen > 0)
        each_constant<sensors::count>([&](auto i) {
            if constexpr (control_sensors >> i.value & 1)
                column(layout.last_seen() +
                       count_bits(control_sensors & ((uint64_t(1) << i.value) - 1))) =
                    gain == gain ? at[i.value] : real(0);
        });

    real results[1 + layout.states + layout.messages];
    run_controller(launch.parameters, genes, at, results);
    if (gain != gain) return true;
    bool finite = true;
    for (const real result : results) finite &= result - result == real(0);
    const real next =
        next_activation(results[0], before, real(values[effects::control::at_change]));
    column(layout.activation() + 1 - now) = next;
    const int material = grows ? int(muscles[3 * voxels]) : 0;
    const real drive = drive_of(scene_of_kernel{launch.scene}, real(gain), next, body, voxel,
                                material, double(number) / values[effects::control::at_rate]);
    column(layout.drive() + 1 - now) = drive;
    show(grid.at(x, y, z), 1 - now, drive);
    each_constant<layout.states>(
        [&](auto i) { column(layout.state() + i.value) = results[1 + i.value]; });
    each_constant<layout.messages>([&](auto i) {
        column(layout.said() + (1 - now) * layout.messages + i.value) =
            results[1 + layout.states + i.value];
    });
    return finite;
}

}  // namespace limax::cuda
