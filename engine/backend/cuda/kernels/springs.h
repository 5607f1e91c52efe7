// springs.h: the springs of a cell in a kernel: their parameters, their forces, whether they are
// too long. Compiled for one lattice, or, where these are not defined, for any:
//   LIMAX_NX, LIMAX_NY, LIMAX_NZ  voxels
// SI units.
#pragma once

#include "backend/cuda/kernels/cells.h"
#include "backend/cuda/kernels/scene.h"

namespace limax::cuda {

// The lattice's sites along each axis: constants in a kernel for one lattice, else from its launch.
struct site_grid {
#if defined(LIMAX_NX)
    static constexpr bool fixed = true;
    static constexpr int x = LIMAX_NX + 1, y = LIMAX_NY + 1, z = LIMAX_NZ + 1;
    LIMAX_LAW constexpr explicit site_grid(const lattice& /*grid*/) {}
#else
    static constexpr bool fixed = false;
    int x, y, z;
    LIMAX_LAW constexpr explicit site_grid(const lattice& grid)
        : x(grid.nx + 1), y(grid.ny + 1), z(grid.nz + 1) {}
#endif
    LIMAX_LAW constexpr int count() const { return x * y * z; }
    LIMAX_LAW constexpr int at(int i, int j, int k) const { return i + x * (j + y * k); }
    // Offset of a corner from its cell in the numbering of sites.
    LIMAX_LAW constexpr int corner(int number) const {
        return at(number & 1, number >> 1 & 1, number >> 2);
    }
};

// Parameters of one spring, as its columns are sorted: k, then c, then A and B.
struct alignas(spring_columns == 4 ? 16 : spring_columns == 2 ? 8 : 4) spring_parameters {
    float value[spring_columns];

    __device__ void load(const site_grid& grid, const float* columns, int slot) {
#pragma unroll
        for (int i = 0; i < spring_columns; ++i)
            value[i] = columns[i * (direction_count * grid.count()) + slot];
    }
    __device__ effects::spring_state<spring_real> at_rest(spring_real rest) const {
        effects::spring_state<spring_real> spring{};
        spring.rest = rest;
        spring.stiffness = spring_real(value[0]);
        if constexpr (damped) spring.damping = spring_real(value[1]);
        if constexpr (actuated) {
            spring.sine = spring_real(value[spring_columns - 2]);
            spring.cosine = spring_real(value[spring_columns - 1]);
        }
        return spring;
    }
};

// L0 of an edge, a face diagonal or a space diagonal.
LIMAX_LAW spring_real rest_length(const launch_arguments& launch, int kind) {
    if constexpr (sizeof(spring_real) == 4)
        return launch.rest_single[kind];
    else
        return launch.rest[kind];
}

// Forces of a cube's springs. `set[i]` has the parameters of its spring i, load(c) reads corner c,
// store(c, force) takes the sum on it. Each corner is read once and its sum stored as soon as it is
// complete, so that few are in registers at a time.
template <class Set, class Load, class Store>
__device__ inline void cube_forces(const launch_arguments& launch, const Set& set,
                                   const effects::actuation::moment<spring_real>& now,
                                   const Load& load, const Store& store) {
    corner low[4], high{};
    force sum[4] = {}, high_sum{};
#pragma unroll
    for (int c = 0; c < 4; ++c) low[c] = load(c);
#pragma unroll
    for (int i = 0; i < cube_springs; ++i) {
        const cube_spring s = cube_spring_at(i);
        const auto spring = set[i].at_rest(rest_length(launch, length_class(s.direction)));
        if (s.far < 4) {
            add_spring(low[s.near], low[s.far], spring, now, sum[s.near], sum[s.far]);
            continue;
        }
        if (cube_spring_at(i - 1).far != s.far) {
            high = load(s.far);
            high_sum = {};
        }
        add_spring(low[s.near], high, spring, now, sum[s.near], high_sum);
        if (i + 1 == cube_springs || cube_spring_at(i + 1).far != s.far) store(s.far, high_sum);
    }
#pragma unroll
    for (int c = 0; c < 4; ++c) store(c, sum[c]);
}

// The same for a square or a bar, whose corners are: the cell, the end of its first axis, that of
// its second, the one across.
template <class Set, class Load, class Store>
__device__ inline void rim_forces(const launch_arguments& launch, const Set& set,
                                  const effects::actuation::moment<spring_real>& now,
                                  const Load& load, const Store& store) {
    corner at[4];
    force sum[4] = {};
#pragma unroll
    for (int c = 0; c < 4; ++c) at[c] = load(c);
#pragma unroll
    for (int i = 0; i < rim_springs; ++i)
        add_spring(at[rim_near(i)], at[rim_far(i)], set[i].at_rest(rest_length(launch, i / 2)), now,
                   sum[rim_near(i)], sum[rim_far(i)]);
#pragma unroll
    for (int c = 0; c < 4; ++c) store(c, sum[c]);
}

LIMAX_LAW bool stretched(float stiffness, const corner& a, const corner& b,
                         const launch_arguments& launch, int kind) {
    const spring_real longest = spring_real(launch.max_stretch) * rest_length(launch, kind);
    const spring_real ex = b.x - a.x, ey = b.y - a.y, ez = b.z - a.z;
    const spring_real squared = fma(ex, ex, fma(ey, ey, ez * ez));
    return stiffness > 0.0f && !(squared <= longest * longest);
}

// Whether a spring of this cube, or of this rim cell, is longer than the limit.
template <class Set, class Load>
__device__ inline bool cube_stretched(const launch_arguments& launch, const Set& set,
                                      const Load& load) {
    bool broken = false;
#pragma unroll
    for (int i = 0; i < cube_springs; ++i) {
        const cube_spring s = cube_spring_at(i);
        broken |= stretched(set[i].value[0], load(s.near), load(s.far), launch,
                            length_class(s.direction));
    }
    return broken;
}
template <class Set, class Load>
__device__ inline bool rim_stretched(const launch_arguments& launch, const Set& set,
                                     const Load& load) {
    bool broken = false;
#pragma unroll
    for (int i = 0; i < rim_springs; ++i)
        broken |= stretched(set[i].value[0], load(rim_near(i)), load(rim_far(i)), launch, i / 2);
    return broken;
}

}  // namespace limax::cuda
