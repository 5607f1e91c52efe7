// tile_memory.h: a tile of a lattice in the shared memory of a block (tiles.h): its masses and the
// layer beyond that its springs end at, sums of forces, what never changes of springs and masses;
// and the packets in which tiles exchange masses and forces. Compiled with the defines of tiles.h.
// SI units.
#pragma once

#include "backend/cuda/kernels/block_memory.h"
#include "backend/cuda/kernels/control.h"
#include "backend/cuda/kernels/robot_sums.h"
#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/springs.h"

namespace limax::cuda {

constexpr int sites = site_grid(lattice{}).count();
constexpr int threads = LIMAX_THREADS, warps = threads / 32, rounds = LIMAX_ROUNDS;
constexpr int places = LIMAX_PLACES, own_places = LIMAX_OWN_PLACES;
constexpr int slots = rounds * threads;
constexpr int rim_slots = LIMAX_RIM_SLOTS, cube_rounds = rounds - (rim_slots > 0);
constexpr int cube_slots = cube_rounds * threads;
constexpr tile_rows rows{LIMAX_ROUNDS, LIMAX_HALO, LIMAX_INBOX};
// Forces that a tile may send: by sender, corner and thread.
constexpr int sent_forces = LIMAX_SENDERS * (corners - 1) * threads;

using tile_arguments = tile_launch<real>;

LIMAX_LAW constexpr int corner_place(int number) {
    return (number & 1) + (number >> 1 & 1) * LIMAX_ROW + (number >> 2) * LIMAX_PLANE;
}

struct tile_memory {
    corner_columns<places> at;       // every mass that a spring ends at
    sum_columns<own_places, 1> sum;  // forces of cells on masses other than their own
    float4 damping[damped ? 3 : 1][damped ? cube_slots : 1];  // c of springs 0 to 11 of a cube
    float last_damping[damped ? cube_slots : 1];              // of spring 12
    float4 square_damping[damped && rim_slots > 0 ? rim_slots : 1];  // c of a square
    typename wide<real>::four weights[cube_slots + rim_slots];
    effects::actuation::moment<real> moments[check_interval];  // of the muscles, from the
                                                               // last event on
    int64_t part[grid_sums][warps];
    int64_t sum_of[grid_sums];
    step_times times;
    double shift[3];  // of the origin, m
    int moved;
    int rank, tiles;      // of the tiles of this robot that have masses: which, how many
    robot_record record;  // every tile keeps its own, and they agree
    int64_t stop;
    control_block control;
};
static_assert(sizeof(tile_memory) <= LIMAX_SHARED_BYTES);

// ---- packets: a reader asks until the number is the one that it waits for. Nothing else orders
// two tiles: no flag, fence or barrier ----

__device__ inline void send(packet* to, const packet& p) {
#if defined(__CUDA_ARCH__)
    asm volatile(
        "{\n\t.reg .b64 low, high;\n\t.reg .b128 all;\n\t"
        "mov.b64 low, {%1, %2};\n\tmov.b64 high, {%3, %4};\n\tmov.b128 all, {low, high};\n\t"
        "st.relaxed.gpu.global.b128 [%0], all;\n\t}" ::"l"(to),
        "r"(p.word[0]), "r"(p.word[1]), "r"(p.word[2]), "r"(p.number)
        : "memory");
#else
    *to = p;
#endif
}
__device__ inline packet look(const packet* at) {
    packet p;
#if defined(__CUDA_ARCH__)
    asm volatile(
        "{\n\t.reg .b64 low, high;\n\t.reg .b128 all;\n\t"
        "ld.relaxed.gpu.global.b128 all, [%4];\n\tmov.b128 {low, high}, all;\n\t"
        "mov.b64 {%0, %1}, low;\n\tmov.b64 {%2, %3}, high;\n\t}"
        : "=r"(p.word[0]), "=r"(p.word[1]), "=r"(p.word[2]), "=r"(p.number)
        : "l"(at)
        : "memory");
#else
    p = *at;
    pause_thread();
#endif
    return p;
}
// A barrier of the threads that receive masses. compute-sanitizer's racecheck reports false races
// wherever only some threads of a block come to a barrier.
__device__ inline void wait_for_readers() {
#if defined(__CUDA_ARCH__)
    asm volatile("bar.sync 1, %0;" ::"n"(LIMAX_READERS) : "memory");
#endif
}
// The sender is on the GPU too, so this ends; after seconds something is wrong.
__device__ inline void wait_for(packet& p, const packet* at, uint32_t number) {
    for (int tries = 0; p.number != number; ++tries) {
        if (tries == 1 << 22) __trap();
        p = look(at);
    }
}

// Some numbers, as packets that are `apart` from each other.
template <int values, int apart>
struct parcel {
    static constexpr int count = values;
    static constexpr int packets = count * int(sizeof(real)) / int(sizeof(packet::word));
    struct words {
        uint32_t of[packets][3];
    };
    real value[count];

    __device__ void send_to(packet* to, uint32_t number) const {
        const words all = bits_as<words>(*this);
#pragma unroll
        for (int i = 0; i < packets; ++i)
            send(to + i * apart, {{all.of[i][0], all.of[i][1], all.of[i][2]}, number});
    }
    __device__ static void ask(packet (&p)[packets], const packet* from) {
#pragma unroll
        for (int i = 0; i < packets; ++i) p[i] = look(from + i * apart);
    }
    __device__ static parcel wait(packet (&p)[packets], const packet* from, uint32_t number) {
        words all;
#pragma unroll
        for (int i = 0; i < packets; ++i) {
            wait_for(p[i], from + i * apart, number);
            for (int word = 0; word < 3; ++word) all.of[i][word] = p[i].word[word];
        }
        return bits_as<parcel>(all);
    }
};
using shown_mass = parcel<shares_velocity ? 6 : 3, LIMAX_TILES * slots>;
using sent_force = parcel<3, LIMAX_TILES * sent_forces>;

__device__ inline shown_mass shown(const corner& c) {
    const real all[6] = {c.x, c.y, c.z, c.vx, c.vy, c.vz};
    shown_mass m;
    for (int i = 0; i < shown_mass::count; ++i) m.value[i] = all[i];
    return m;
}
__device__ inline corner corner_of(const shown_mass& m) {
    real all[6] = {};
    for (int i = 0; i < shown_mass::count; ++i) all[i] = m.value[i];
    return {all[0], all[1], all[2], all[3], all[4], all[5]};
}

// Receives what a thread expects, bit i of `expected` for number i: entry(i) gives the packet among
// `from` and where it goes, take(where, parcel) puts it there. Several are on their way at once.
template <class Parcel, int entries, class Entry, class Take>
__device__ inline void receive(const packet* from, unsigned expected, uint32_t number,
                               const Entry& entry, const Take& take) {
    constexpr int at_once = 4 / Parcel::packets > 0 ? 4 / Parcel::packets : 1;
#pragma unroll
    for (int first = 0; first < entries; first += at_once) {
        cell_entry e[at_once] = {};  // else they would be kept from step to step
        packet p[at_once][Parcel::packets] = {};
#pragma unroll
        for (int i = 0; i < at_once; ++i)
            if (expected >> (first + i) & 1u) {
                e[i] = entry(first + i);
                Parcel::ask(p[i], from + e[i].site);
            }
#pragma unroll
        for (int i = 0; i < at_once; ++i)
            if (expected >> (first + i) & 1u)
                take(e[i].axes, Parcel::wait(p[i], from + e[i].site, number));
    }
}

// ---- springs ----

// Parameters of a cell: what a class of springs shares in registers, each spring's c in shared
// memory, where those of four springs are read at once.
struct cell_parameters {
    spring_parameters (&of)[cube_classes];
    tile_memory& shared;
    int slot;
    mutable float4 four;

    __device__ float damping_of(int spring) const {
        if (spring == cube_springs - 1) return shared.last_damping[slot];
        if (spring % 4 == 0) four = shared.damping[spring / 4][slot];
        return spring % 4 == 0   ? four.x
               : spring % 4 == 1 ? four.y
               : spring % 4 == 2 ? four.z
                                 : four.w;
    }
    __device__ spring_parameters of_class(int i) const {
        constexpr int first[cube_classes] = {3, 1, 0, 4, 5, 2, 7};
        spring_parameters own = of[i];
        if constexpr (damped) own.value[1] = damping_of(first[i]);
        return own;
    }
    __device__ float damping(int other) const {
        constexpr int others[cube_springs - cube_classes] = {6, 8, 9, 10, 11, 12};
        return damping_of(others[other]);
    }
    // Keeps what load_cube() loaded.
    __device__ void store(const held_cube& all) const {
        float c[cube_springs] = {};
        each_constant<cube_springs>([&](auto i) {
            constexpr parameter_place at = cube_place(i.value);
            if constexpr (at.other < 0) of[at.of_class] = all.first[at.of_class];
            if constexpr (damped)
                c[i.value] = at.other < 0 ? all.first[at.of_class].value[1]
                                          : all.others[larger(at.other, 0)];
        });
        if constexpr (damped) {
            for (int i = 0; i < 3; ++i)
                shared.damping[i][slot] = {c[4 * i], c[4 * i + 1], c[4 * i + 2], c[4 * i + 3]};
            shared.last_damping[slot] = c[cube_springs - 1];
        }
    }
};

// The same of a square across `axes`. A bar is one of which only an edge has parameters.
struct square_parameters {
    spring_parameters (&of)[rim_classes];
    float4& c;
    int axes;

    // Which corner of the cell is corner `i` of the square.
    __device__ int corner(int i) const {
        const int first = axes & -axes;
        return (i & 1 ? first : 0) | (i & 2 ? axes & ~first : 0);
    }
    __device__ spring_parameters of_class(int i) const {
        spring_parameters own = of[i];
        if constexpr (damped) own.value[1] = i == 0 ? c.x : i == 1 ? c.y : c.z;
        return own;
    }
    __device__ float damping(int) const { return c.w; }
    __device__ void store(const held_square& all) const {
        for (int i = 0; i < rim_classes; ++i) of[i] = all.first[i];
        if constexpr (damped) c = {of[0].value[1], of[1].value[1], of[2].value[1], all.others[0]};
    }
};

}  // namespace limax::cuda
