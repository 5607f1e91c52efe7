// cells.h: how the springs of a lattice are assigned to cells so that each is computed once.
// Includes laws only.
//
// Every site is the lowest corner of one cell. A whole cell is a cube of eight corners and owns 13
// springs: the three edges at its lowest corner, both diagonals of its three low faces, its four
// space diagonals. On the high faces of the lattice the cell is only a square (two edges, two
// diagonals), on their common lines a bar (one edge), at the topmost site it has no spring: the
// rim. So every spring has one owner, and the owner of a cell can own the mass at its lowest corner
// too.
//
// Corners are numbered by bits: x = 1, y = 2, z = 4. The owner of a spring adds its force to the
// sums of both ends; a mass then adds up its sums in the up to eight cells that it is a corner of,
// always in the order of the corner's number. Nothing else decides the order of a sum.
//
// The voxels at both ends of a spring determine k, A and B, so the two diagonals of a face share
// theirs, and so do the four of a cube: seven classes of springs in a cube, three in a square.
#pragma once

#include "body/lattice.h"

namespace limax::cuda {

inline constexpr int cube_springs = 13, rim_springs = 4, corners = 8;
inline constexpr int cube_classes = 7, rim_classes = 3;
inline constexpr int cube_axes = 7;  // bits x = 1, y = 2, z = 4

// A spring of a cube: from corner `near` to corner `far`, a spring of the lattice's direction.
struct cube_spring {
    int near, far, direction;
};

// In an order that keeps few corners in registers at once. Among the springs of a square it is
// the same for all three orientations: a sum has the same bits on the rim, which some kernels
// compute as squares and some as cubes.
LIMAX_LAW constexpr cube_spring cube_spring_at(int i) {
    constexpr cube_spring table[cube_springs] = {
        {0, 4, 2},  {0, 2, 1}, {2, 4, 8},  {0, 1, 0}, {1, 2, 4},  {1, 4, 6}, {0, 3, 3},
        {3, 4, 12}, {0, 5, 5}, {2, 5, 11}, {0, 6, 7}, {1, 6, 10}, {0, 7, 9}};
    return table[i];
}
// The first and the last spring of a corner in this order.
LIMAX_LAW constexpr int first_spring(int corner) {
    int i = 0;
    while (cube_spring_at(i).near != corner && cube_spring_at(i).far != corner) ++i;
    return i;
}
LIMAX_LAW constexpr int last_spring(int corner) {
    int i = cube_springs - 1;
    while (cube_spring_at(i).near != corner && cube_spring_at(i).far != corner) --i;
    return i;
}

// Calls visit(constant<i>) for i from 0 to count - 1.
template <int i>
struct constant {
    static constexpr int value = i;
};
template <int count, int from = 0, class Visit>
LIMAX_LAW void each_constant(const Visit& visit) {
    if constexpr (from < count) {
        visit(constant<from>{});
        each_constant<count, from + 1>(visit);
    }
}

// Classes of the lattice's directions: 0 to 2 for edges, 3 to 5 for faces, 6 for the inside.
LIMAX_LAW constexpr int class_of(int direction) {
    return direction < 3 ? direction : direction < 9 ? 3 + (direction - 3) / 2 : 6;
}

// 0 for an edge, 1 for a face diagonal, 2 for a space diagonal.
LIMAX_LAW constexpr int length_class(int direction) {
    return direction < 3 ? 0 : direction < 9 ? 1 : 2;
}

// A square's springs, in the order of cube_spring_at(): the edge along its second axis, along its
// first, the diagonal from the end of its first axis to that of its second, the one from its lowest
// corner. Ends among its corners: the cell, the end of its first axis, that of its second, the one
// across.
LIMAX_LAW constexpr int rim_near(int i) { return i == 2 ? 1 : 0; }
LIMAX_LAW constexpr int rim_far(int i) { return i == 1 ? 1 : i == 3 ? 3 : 2; }
LIMAX_LAW constexpr int rim_direction(int axes, int spring) {
    const int first = axes & 1 ? 0 : axes & 2 ? 1 : 2;
    const int second = axes == 3 ? 1 : 2;
    const int diagonal = axes == 3 ? 3 : axes == 5 ? 5 : 7;
    return spring == 0 ? second : spring == 1 ? first : diagonal + (3 - spring);
}

}  // namespace limax::cuda
