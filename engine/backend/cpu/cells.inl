// cells.inl: the forces of all springs, cell by cell; a part of passes.inl.
//
// As many cells as fit a vector read their corners once and leave one sum of forces per corner; a
// mass adds its eight sums in the order of their corners. So neither the lattice nor the width of a
// vector changes the order of a sum.

#include "backend/cpu/lanes.inl"

inline constexpr int face_springs = 4, face_corners = 4;

// Whether spring `number` is the first with its owners, or to its far corner; or the last to it.
LIMAX_LAW constexpr bool first_of_owners(int number) {
    for (int i = 0; i < number; ++i)
        if (cell_springs[i].owners == cell_springs[number].owners) return false;
    return true;
}
LIMAX_LAW constexpr bool first_to_corner(int number) {
    return number == 0 || cell_springs[number - 1].far != cell_springs[number].far;
}
LIMAX_LAW constexpr bool last_to_corner(int number) {
    return number == direction_count - 1 ||
           cell_springs[number + 1].far != cell_springs[number].far;
}

// Sites from a cell's lowest corner to its others.
struct corner_offsets {
    int64_t of[cell_corners];
};
template <class R>
LIMAX_LAW corner_offsets offsets_of(const spring_arrays<R>& robot) {
    corner_offsets corners;
    for (int c = 0; c < cell_corners; ++c)
        corners.of[c] =
            (c & 1) * robot.step[0] + (c >> 1 & 1) * robot.step[1] + (c >> 2) * robot.step[2];
    return corners;
}

// The columns of a corner's sums.
template <class R>
struct corner_sums {
    R* of[3];
};
template <class R>
LIMAX_LAW corner_sums<R> sums_of(const spring_arrays<R>& robot, int corner) {
    R* first = robot.sums + 3 * corner * robot.sums_column;
    return {{first, first + robot.sums_column, first + 2 * robot.sums_column}};
}

// Fills the sums at `slot` of the cells from `cell` on: of their low faces only if `springs` is
// face_springs.
template <class R, bool damped, drive driven, int springs>
LIMAX_LAW void pull_cells(const spring_arrays<R>& robot, const corner_offsets& corners,
                          const actuation::moment<lanes<R>>& moment, int64_t cell, int64_t slot) {
    using V = lanes<R>;
    const float* const parameters =
        robot.cells + (cell / site_block * robot.cell_rows) * site_block + cell % site_block;
    const auto row = [&](int number) { return load<R>(parameters + number * site_block); };
    vector<V> position[cell_corners], velocity[cell_corners], force[cell_corners];
    spring_state<V> state[owner_classes];
    V driven_pull[owner_classes];  // k L of a controlled body
    const auto read = [&](int corner) {
        position[corner] = load(robot.position, cell + corners.of[corner]);
        if constexpr (damped) velocity[corner] = load(robot.velocity, cell + corners.of[corner]);
        force[corner] = {V(0), V(0), V(0)};
    };
    const auto write = [&](int corner) { store(sums_of(robot, corner).of, slot, force[corner]); };
    read(0);
#pragma GCC unroll 13
    for (int i = 0; i < springs; ++i) {
        const auto [near, far, d, owners] = cell_springs[i];
        if (first_to_corner(i)) read(far);
        spring_state<V>& spring = state[owners];
        if (first_of_owners(i)) {
            spring.stiffness = row(owners);
            spring.rest = V(robot.rest[d]);
            if constexpr (driven != no_drive) {
                spring.sine = row(sine_row(damped) + owners);
                spring.cosine = row(cosine_row(damped) + owners);
            }
            if constexpr (driven == sine_drive) spring.rest = actuation::rest(moment, spring);
            if constexpr (driven == controlled_drive)
                driven_pull[owners] = control::pull<sizeof(R) == sizeof(float)>(moment, spring);
        }
        const auto& from = position[near];
        const auto& to = position[far];
        const separation<V> e{to.x - from.x, to.y - from.y, to.z - from.z};
        const V inverse = spring_length(e).inverse;
        spring_force<V> pull = driven == controlled_drive
                                   ? springs::of_pull(spring, driven_pull[owners])
                                   : springs::pair(spring, {});
        if constexpr (damped) {
            const auto& before = velocity[near];
            const auto& after = velocity[far];
            const separation<V> w{after.x - before.x, after.y - before.y, after.z - before.z};
            spring.damping = row(damping_row + i);
            spring.rate = dot(w, e) * inverse;
            pull = damping::pair(spring, pull);
        }
        const V scale = fma(-inverse, pull.push, pull.scale);
        force[near] = {fma(scale, e.x, force[near].x), fma(scale, e.y, force[near].y),
                       fma(scale, e.z, force[near].z)};
        force[far] = {fma(-scale, e.x, force[far].x), fma(-scale, e.y, force[far].y),
                      fma(-scale, e.z, force[far].z)};
        if (far >= face_corners && last_to_corner(i)) write(far);
    }
#pragma GCC unroll 4
    for (int corner = 0; corner < face_corners; ++corner) write(corner);
}

// Adds up the forces on the masses from `site` on, whose cells' sums are at `slot`.
template <class R>
LIMAX_LAW void gather(const spring_arrays<R>& robot, const corner_offsets& corners, int64_t site,
                      int64_t slot) {
    vector<lanes<R>> sum = load(sums_of(robot, 0).of, slot);
#pragma GCC unroll 8
    for (int corner = 1; corner < cell_corners; ++corner) {
        const int64_t behind = slot - corners.of[corner];
        const auto more =
            load(sums_of(robot, corner).of, behind < 0 ? behind + robot.sums_window : behind);
        sum = {sum.x + more.x, sum.y + more.y, sum.z + more.z};
    }
    store(robot.force, site, sum);
}

// Sums are kept in a ring as long as they are needed; its first vector is also behind its end, so
// that a vector may begin anywhere.
template <class R, bool damped, drive driven>
LIMAX_FEW_POINTERS void pair(const spring_arrays<R>& shared, const actuation::moment<R>& now,
                             pair_place& place, int64_t end) {
    constexpr int width = lanes<R>::count;
    const spring_arrays<R> robot = shared;
    const corner_offsets corners = offsets_of(robot);
    const actuation::moment<lanes<R>> moment{lanes<R>(now.sine), lanes<R>(now.cosine)};
    const int64_t window = robot.sums_window, cubes = robot.sites - robot.step[2];
    const vector<lanes<R>> zero{lanes<R>(0), lanes<R>(0), lanes<R>(0)};
    // before the first cell there is none
    for (int corner = 1; corner < cell_corners && place.cell == 0; ++corner)
        for (int64_t at = window; at > window - corners.of[corner] - width; at -= width)
            store(sums_of(robot, corner).of, at, zero);
    int64_t slot = place.slot, last_slot = place.last_slot;
    for (int64_t cell = place.cell; cell < end; cell += width) {
        if (cell < cubes)
            pull_cells<R, damped, driven, direction_count>(robot, corners, moment, cell, slot);
        else
            pull_cells<R, damped, driven, face_springs>(robot, corners, moment, cell, slot);
        if (slot == 0)
            for (int corner = 1; corner < cell_corners; ++corner)
                store(sums_of(robot, corner).of, window, load(sums_of(robot, corner).of, 0));
        // one vector late, when what it reads has left the processor's store buffer
        if (cell > 0) gather(robot, corners, cell - width, last_slot);
        last_slot = slot;
        slot = slot + width == window ? 0 : slot + width;
    }
    place = {end, slot, last_slot};
    if (end == robot.count) gather(robot, corners, robot.count - width, last_slot);
}
