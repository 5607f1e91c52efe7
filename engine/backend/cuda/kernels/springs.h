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

// The parameters that the springs of a class share, and c of the first of them, in the order of the
// columns: k, then c, then A and B.
struct alignas(spring_columns == 4 ? 16 : spring_columns == 2 ? 8 : 4) spring_parameters {
    float value[spring_columns];

    __device__ void load(const site_grid& grid, const float* columns, int slot) {
#pragma unroll
        for (int i = 0; i < spring_columns; ++i)
            value[i] = columns[i * (direction_count * grid.count()) + slot];
    }
    // A spring of the class with damping c.
    __device__ effects::spring_state<real> at_rest(real rest, float c) const {
        effects::spring_state<real> spring{};
        spring.rest = rest;
        spring.stiffness = real(value[0]);
        if constexpr (damped) spring.damping = real(c);
        if constexpr (actuated) {
            spring.sine = real(value[spring_columns - 2]);
            spring.cosine = real(value[spring_columns - 1]);
        }
        return spring;
    }
};

// Where the parameters of a spring of a cell are: its class, and its place among the c of springs
// that are not the first of their class, below 0 for those that are.
struct parameter_place {
    int of_class, other;
};
LIMAX_LAW constexpr parameter_place cube_place(int spring) {
    const int own = class_of(cube_spring_at(spring).direction);
    int others = 0;
    bool first = true;
    for (int i = 0; i < spring; ++i) {
        bool repeats = false;
        for (int j = 0; j < i; ++j)
            repeats |=
                class_of(cube_spring_at(i).direction) == class_of(cube_spring_at(j).direction);
        others += repeats;
        first &= class_of(cube_spring_at(i).direction) != own;
    }
    return {own, first ? -1 : others};
}
LIMAX_LAW constexpr parameter_place rim_place(int spring) {
    return spring < rim_classes ? parameter_place{spring, -1} : parameter_place{rim_classes - 1, 0};
}

// Parameters of all springs of a cell in registers, by parameter_place.
template <int classes, int springs>
struct held_parameters {
    spring_parameters first[classes];
    float others[springs - classes];

    __device__ spring_parameters& of_class(int i) { return first[i]; }
    __device__ float& damping(int i) { return others[i]; }
    __device__ const spring_parameters& of_class(int i) const { return first[i]; }
    __device__ float damping(int i) const { return others[i]; }
};
using held_cube = held_parameters<cube_classes, cube_springs>;
using held_square = held_parameters<rim_classes, rim_springs>;

// Loads the parameters of a cell with `axes` in the place of a cube. Springs that it lacks get
// none.
template <class Set>
__device__ inline void load_cube(Set&& set, const site_grid& grid, const float* columns, int site,
                                 int axes) {
    each_constant<cube_springs>([&](auto i) {
        constexpr cube_spring s = cube_spring_at(i.value);
        constexpr parameter_place at = cube_place(i.value);
        const int slot = s.direction * grid.count() + site + grid.corner(s.near);
        constexpr int needed = s.near ^ s.far;
        const bool owned = (axes & needed) == needed;
        if constexpr (at.other < 0) {
            spring_parameters own{};
            if (owned) own.load(grid, columns, slot);
            set.of_class(at.of_class) = own;
        } else if constexpr (damped) {
            set.damping(at.other) = owned ? columns[direction_count * grid.count() + slot] : 0.0f;
        }
    });
}
// The same in the place of a square across `square`.
template <class Set>
__device__ inline void load_square(Set&& set, const site_grid& grid, const float* columns, int site,
                                   int axes, int square) {
    const int first = square & -square;
    each_constant<rim_springs>([&](auto i) {
        constexpr parameter_place at = rim_place(i.value);
        const int needed = i.value == 0 ? square & ~first : i.value == 1 ? first : square;
        const bool owned = (axes & needed) == needed;
        const int slot = rim_direction(square, i.value) * grid.count() + site +
                         (rim_near(i.value) ? grid.corner(first) : 0);
        if constexpr (at.other < 0) {
            spring_parameters own{};
            if (owned) own.load(grid, columns, slot);
            set.of_class(at.of_class) = own;
        } else if constexpr (damped) {
            set.damping(at.other) = owned ? columns[direction_count * grid.count() + slot] : 0.0f;
        }
    });
}

// L0 of an edge, a face diagonal or a space diagonal.
LIMAX_LAW real rest_length(const launch_arguments& launch, int kind) {
    if constexpr (sizeof(real) == 4)
        return launch.rest_single[kind];
    else
        return launch.rest[kind];
}

// Adds the force of a spring whose parameters are at a place in `set`; `own` are those of its
// class.
template <class Set>
__device__ inline void add_spring_of(const Set& set, parameter_place place, spring_parameters& own,
                                     real rest, const effects::actuation::moment<real>& now,
                                     const corner& near, const corner& far, force& on_near,
                                     force& on_far) {
    if (place.other < 0) own = set.of_class(place.of_class);
    float c = 0;
    if constexpr (damped) c = place.other < 0 ? own.value[1] : set.damping(place.other);
    add_spring(near, far, own.at_rest(rest, c), now, on_near, on_far);
}

// Forces of a cube's springs. `set` has their parameters, load(c) reads corner c, store(c, force)
// takes the sum on it. Each corner is read once; `at_once` reads all before the first spring and
// stores all after the last, else each only as long as it is needed.
template <bool at_once, class Set, class Load, class Store>
__device__ inline void cube_forces(const launch_arguments& launch, const Set& set,
                                   const effects::actuation::moment<real>& now, const Load& load,
                                   const Store& store) {
    corner at[corners];
    force sum[corners] = {};
    spring_parameters own[cube_classes];
    if constexpr (at_once) each_constant<corners>([&](auto c) { at[c.value] = load(c.value); });
    each_constant<cube_springs>([&](auto i) {
        constexpr cube_spring s = cube_spring_at(i.value);
        constexpr parameter_place place = cube_place(i.value);
        if constexpr (!at_once && first_spring(s.near) == i.value) at[s.near] = load(s.near);
        if constexpr (!at_once && first_spring(s.far) == i.value) at[s.far] = load(s.far);
        add_spring_of(set, place, own[place.of_class],
                      rest_length(launch, length_class(s.direction)), now, at[s.near], at[s.far],
                      sum[s.near], sum[s.far]);
        if constexpr (!at_once && last_spring(s.near) == i.value) store(s.near, sum[s.near]);
        if constexpr (!at_once && last_spring(s.far) == i.value) store(s.far, sum[s.far]);
    });
    if constexpr (at_once) each_constant<corners>([&](auto c) { store(c.value, sum[c.value]); });
}

// The same for a square, whose corners are: the cell, the end of its first axis, that of its
// second, the one across.
template <class Set, class Load, class Store>
__device__ inline void square_forces(const launch_arguments& launch, const Set& set,
                                     const effects::actuation::moment<real>& now, const Load& load,
                                     const Store& store) {
    corner at[4];
    force sum[4] = {};
    spring_parameters own[rim_classes];
    each_constant<4>([&](auto c) { at[c.value] = load(c.value); });
    each_constant<rim_springs>([&](auto i) {
        constexpr parameter_place place = rim_place(i.value);
        constexpr int near = rim_near(i.value), far = rim_far(i.value);
        add_spring_of(set, place, own[place.of_class], rest_length(launch, i.value / 2), now,
                      at[near], at[far], sum[near], sum[far]);
    });
    each_constant<4>([&](auto c) { store(c.value, sum[c.value]); });
}

LIMAX_LAW bool stretched(float stiffness, const corner& a, const corner& b,
                         const launch_arguments& launch, int kind) {
    const real longest = real(launch.max_stretch) * rest_length(launch, kind);
    const real ex = b.x - a.x, ey = b.y - a.y, ez = b.z - a.z;
    const real squared = fma(ex, ex, fma(ey, ey, ez * ez));
    return stiffness > 0.0f && !(squared <= longest * longest);
}

// Whether a spring of this cube, or of this square, is longer than the limit.
template <class Set, class Load>
__device__ inline bool cube_stretched(const launch_arguments& launch, const Set& set,
                                      const Load& load) {
    bool broken = false;
    each_constant<cube_springs>([&](auto i) {
        constexpr cube_spring s = cube_spring_at(i.value);
        broken |= stretched(set.of_class(class_of(s.direction)).value[0], load(s.near), load(s.far),
                            launch, length_class(s.direction));
    });
    return broken;
}
template <class Set, class Load>
__device__ inline bool square_stretched(const launch_arguments& launch, const Set& set,
                                        const Load& load) {
    bool broken = false;
    each_constant<rim_springs>([&](auto i) {
        broken |= stretched(set.of_class(rim_place(i.value).of_class).value[0],
                            load(rim_near(i.value)), load(rim_far(i.value)), launch, i.value / 2);
    });
    return broken;
}

}  // namespace limax::cuda
