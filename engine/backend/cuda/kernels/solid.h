// solid.h: the rigid blocks of a robot's scene. Each mass checks which blocks it touches and stores
// how; one warp of the robot lists the masses that touch in the order of their sites, and its first
// thread steps the blocks (solid_step.h). All of it is in global memory, so that every
// path does the same. Compiled for one scene (scene.h). SI units.
#pragma once

#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/solid_step.h"

namespace limax::cuda {

inline constexpr int lanes = 32;

// Reads what other blocks of the robot may have written, past the first-level cache.
template <class T>
__device__ inline T fetched(const T& from) {
    static_assert(sizeof(T) % sizeof(double) == 0);
    constexpr int words = int(sizeof(T) / sizeof(double));
    T to;
#pragma unroll
    for (int i = 0; i < words; ++i)
        reinterpret_cast<double*>(&to)[i] = __ldcg(reinterpret_cast<const double*>(&from) + i);
    return to;
}

// ---- what is recorded ----

// At a step of the robot, whose own origin moved by `shift` and is at `origin`: marks and the
// sample that is due of solid `number`.
__device__ inline void note_solid(solid_record& record, int number, const robot_record& robot,
                                  int64_t step, const double shift[3], bool moved,
                                  double* samples) {
    if (moved) {
        solid::follow(record.body.block, shift);
        record.seen.place = record.body.block.place;
    }
    const solid::vector& at = record.body.block.place;
    const double place[3] = {robot.origin[0] + at.x, robot.origin[1] + at.y,
                             robot.origin[2] + at.z};
    for (int axis = 0; axis < 3; ++axis) {
        if (step == robot.settle_steps) record.center[0][axis] = place[axis];
        if (step == middle_step(robot)) record.center[1][axis] = place[axis];
        if (step == robot.steps) record.center[2][axis] = place[axis];
    }
    const int64_t since = step - robot.settle_steps;
    if (record.every == 0 || since < 0 || since % record.every != 0) return;
    constexpr int width = solid::sample_width;
    double* const sample =
        samples + record.offset + width * (solids * (since / record.every) + number);
    const quaternion& q = record.body.block.points;
    const double values[width] = {place[0], place[1], place[2], q.w, q.x, q.y, q.z};
    for (int i = 0; i < width; ++i) sample[i] = values[i];
    record.taken = since / record.every + 1;
}
// The next step after `step` at which a sample is due, `most` at the latest.
LIMAX_LAW int64_t next_solid_sample(const solid_record& record, const robot_record& robot,
                                    int64_t step, int64_t most) {
    if (record.every == 0) return most;
    const int64_t since = step - robot.settle_steps;
    const int64_t next = since < 0 ? 0 : (since / record.every + 1) * record.every;
    return smaller(robot.settle_steps + next, most);
}

// Steps from an event at `step` to the next, which is at `stop` at the latest. `own_solid` gives
// the robot's.
template <class Solid>
__device__ inline int steps_to_event(const robot_record& record, int64_t step, int64_t stop,
                                     const Solid& own_solid) {
    int steps = int(next_event(record, step, stop) - step);
    if constexpr (has_solid)
        steps = int(next_solid_sample(own_solid().records[0], record, step, step + steps) - step);
    return steps;
}

// ---- where it is stored ----

// One robot's, whose masses lie at `sites` sites. `after` are all masses' velocities after the
// kick, [3][site].
struct robot_solid {
    solid_record* records;
    uint32_t* marked;
    touching_solids *touches, *listed;
    solid::touch* corners;
    solid::pair_touch* pairs;
    real* after;
    int sites;
};
__device__ inline robot_solid solid_of(const launch_arguments& launch, int64_t robot, int sites,
                                       real* after) {
    constexpr int contacts = [] {
        int count = 0;
        effects::for_each([&]<class E>(E) {
            if (effects::is_contact<E>) count += instances<E>;
        });
        return count;
    }();
    static_assert(sizeof(touching_solids) == sizeof(double) * doubles_of_touch<real>(solids));
    const solid_columns<real>& columns = launch.solids;
    auto* const touches = reinterpret_cast<touching_solids*>(columns.touches);
    return {columns.records + robot * solids,
            columns.marked + robot * marks_of(sites),
            touches + robot * 2 * sites,
            touches + (robot * 2 + 1) * sites,
            columns.corners + robot * solids * corners_of_solid(contacts, has<effects::edges>),
            columns.pairs + robot * pairs_of_solids(solids),
            after,
            sites};
}

// ---- the parts of all threads ----

// The solids of a robot as its masses see them.
struct seen_solids {
    solid::view of[solids];

    __device__ explicit seen_solids(const solid_record* records) {
        for (int b = 0; b < solids; ++b) of[b] = fetched(records[b].seen);
    }
};

// The push of the solids on the mass at a site; whether it touches is left in `touched`.
__device__ inline effects::vector<real> push_of_solids(const robot_solid& solid,
                                                       const launch_arguments& launch,
                                                       const seen_solids& seen, int site,
                                                       const mass_state& m, bool& touched) {
    touched = false;
    if (!(m.mass > real(0))) return {};
    touching_solids found;
    effects::vector<real> push{};
    for (int b = 0; b < solids; ++b) {
        const auto law = effects::block::make<double>(
            launch.scene.of(effects::index_of<effects::block>, b), nullptr);
        if (solid::meet_mass<real>(
                law, seen.of[b], b, site, {m.position[0], m.position[1], m.position[2]},
                {m.predicted[0], m.predicted[1], m.predicted[2]}, double(m.mass), found.of[b])) {
            solid::add_push<real>(push, found.of[b], touched);
        } else if constexpr (solids > 1) {
            found.of[b] = {};
            found.of[b].site = site;
        }
    }
    if (!touched) return {};
    found.mass = double(m.mass);
    found.inverse_mass = double(m.inverse_mass);
    found.before = {m.velocity[0], m.velocity[1], m.velocity[2]};
    solid.touches[site] = found;
    atomicOr(solid.marked + site / lanes, 1u << site % lanes);
    return push;
}

// Lists what touches in the order of the sites, and takes the marks away. By the first warp of one
// block, once all marks are made; returns how many there are.
__device__ inline int list_touching(const robot_solid& solid) {
    const int lane = threadIdx.x % lanes, words = marks_of(solid.sites);
    int listed = 0;
    for (int first = 0; first < words; first += lanes) {
        const int word = first + lane;
        const unsigned marks = word < words ? __ldcg(solid.marked + word) : 0u;
        if (marks != 0) solid.marked[word] = 0;
        const int own = __popc(marks);
        int before = own;
        for (int distance = 1; distance < lanes; distance *= 2) {
            const int other = __shfl_up_sync(0xffffffffu, before, distance);
            if (lane >= distance) before += other;
        }
        const int all = __shfl_sync(0xffffffffu, before, lanes - 1);
        int place = listed + before - own;
        for (unsigned left = marks; left != 0; left &= left - 1) {
            const int site = word * lanes + __ffs(int(left)) - 1;
            touching_solids found = fetched(solid.touches[site]);
            found.after = {__ldcg(solid.after + site), __ldcg(solid.after + solid.sites + site),
                           __ldcg(solid.after + 2 * solid.sites + site)};
            solid.listed[place++] = found;
        }
        listed += all;
    }
    __syncwarp();
    return listed;
}

// The step of the solids after a kick of h, and, unless the launch ends here, on for dt. By the
// first warp of one block, between two barriers of all threads of the robot: before the first all
// masses that touch are marked and their velocities after the kick left, after the second these
// are what friction made of them. `origin` is the robot's own, `time` that since the muscles began.
__device__ inline void step_solids(const robot_solid& solid, const launch_arguments& launch,
                                   const double* origin, double time, double h, bool moves,
                                   double dt, double share) {
    const int lane = threadIdx.x % lanes, count = list_touching(solid);
    if (lane == 0) {
        push_solids(solid.records, launch.scene, origin, time, solid.listed, count, solid.corners,
                    solid.pairs, h);
        if (moves) move_solids(solid.records, dt, share);
    }
    __syncwarp();
    for (int i = lane; i < count; i += lanes) {
        const touching_solids& at = solid.listed[i];
        const int site = at.of[0].site;
        solid.after[site] = at.after.x;
        solid.after[solid.sites + site] = at.after.y;
        solid.after[2 * solid.sites + site] = at.after.z;
    }
    __syncwarp();
}

// At the begin of a launch; `begun` between kick and drift.
__device__ inline void begin_solids(const robot_solid& solid, bool begun, double dt, double share) {
    if (begun)
        move_solids(solid.records, dt, share);
    else
        show_solids(solid.records);
}

// The limits that they break.
__device__ inline int broken_by_solids(const robot_solid& solid, const launch_arguments& launch) {
    int broken = 0;
    for (int b = 0; b < solids; ++b) {
        const solid::breaks found = solid::broken(solid.records[b].body, launch.max_speed);
        broken |= (found.nonfinite ? limit_nonfinite : 0) | (found.speed ? limit_speed : 0);
    }
    return broken;
}

}  // namespace limax::cuda
