// cells.h: how the springs of a lattice are assigned to cells so that each is computed once.
// Includes laws only.
//
// Every site is the lowest corner of a cell. A whole cell is a cube of eight corners and owns 13
// springs: the three edges at its lowest corner, both diagonals of its three low faces, its four
// space diagonals. On the high faces of the lattice the cell is only a square (two edges, two
// diagonals), on their common lines a bar (one edge): the rim. So every spring has one owner.
//
// Corners are numbered by bits: x = 1, y = 2, z = 4. The owner of a spring adds its force to the
// sums of both ends; a mass then adds up its sums in the up to eight cells that it is a corner of,
// always in the order of the corner's number. Nothing else decides the order of a sum.
#pragma once

#include "body/lattice.h"

namespace limax::cuda {

inline constexpr int cube_springs = 13, rim_springs = 4, corners = 8;

// A spring of a cube: from corner `near` to corner `far`, a spring of the lattice's direction.
struct cube_spring {
    int near, far, direction;
};

// Sorted by the far corner, so that registers hold at most the low face and one high corner at
// once.
LIMAX_LAW constexpr cube_spring cube_spring_at(int i) {
    constexpr cube_spring table[cube_springs] = {
        {0, 1, 0}, {0, 2, 1},  {0, 3, 3}, {1, 2, 4},               // low face
        {0, 4, 2}, {1, 4, 6},  {2, 4, 8}, {3, 4, 12},              // to the corner above it
        {0, 5, 5}, {2, 5, 11}, {0, 6, 7}, {1, 6, 10}, {0, 7, 9}};  // to the others
    return table[i];
}

// 0 for an edge, 1 for a face diagonal, 2 for a space diagonal.
LIMAX_LAW constexpr int length_class(int direction) {
    return direction < 3 ? 0 : direction < 9 ? 1 : 2;
}

// Ends of a square's springs among its corners: the cell, the end of its first axis, that of its
// second, the one across.
LIMAX_LAW constexpr int rim_near(int i) { return i == 3 ? 1 : 0; }
LIMAX_LAW constexpr int rim_far(int i) { return i == 0 ? 1 : i == 2 ? 3 : 2; }

// The directions of a square's springs: edge along its first axis, along its second, the diagonal
// from its lowest corner, the diagonal from the end of its first axis to that of its second.
LIMAX_LAW constexpr int rim_direction(int axes, int spring) {
    const int first = axes & 1 ? 0 : axes & 2 ? 1 : 2;
    const int second = axes == 3 ? 1 : 2;
    const int diagonal = axes == 3 ? 3 : axes == 5 ? 5 : 7;
    return spring == 0 ? first : spring == 1 ? second : diagonal + (spring - 2);
}

}  // namespace limax::cuda
