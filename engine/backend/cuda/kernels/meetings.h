// meetings.h: masses of a robot's surface that meet, though neither a spring nor a chain of two
// joins them, where masses lie in global memory. Each mass lists the others that may come within
// reach, with a margin, in ascending order of their sites; lists hold until some mass has moved
// half the margin, and are made by looking at every other mass of the surface. When they were made
// changes no bit. SI units.
#pragma once

#include "backend/cuda/kernels/surface.h"
#include "backend/cuda/kernels/tiles.h"

namespace limax::cuda {

// Of an edge: a larger margin makes longer lists, a smaller one more of them.
inline constexpr double margin_share = 0.3;
// Of the way that a mass may move before lists are made anew: what rounding may hide is left out.
inline constexpr double share_of_way = 0.999;

// One robot's columns and lists, [..][site].
struct meeting_columns : body_surface {
    const float* masses;
    int32_t* partners;
    spring_real* listed_at;
    spring_real reach, margin;  // m

    // Lists the partners of the mass at a site, which lies at `at`.
    __device__ void list(int site, const corner& at, const spring_real* seen) {
        const int sites = grid.count();
        listed_at[site] = at.x;
        listed_at[sites + site] = at.y;
        listed_at[2 * sites + site] = at.z;
        int count = 0;
        if (is_of_surface(site))
            each_of_surface([&](int other) {
                const corner there = exchanged_corner(grid, seen, other);
                const spring_real ex = there.x - at.x, ey = there.y - at.y, ez = there.z - at.z;
                const spring_real most = reach + margin;
                if (!(fma(ex, ex, fma(ey, ey, ez * ez)) < most * most) || other == site ||
                    joined(site, other))
                    return true;
                if (count < most_partners) partners[(1 + count) * sites + site] = other;
                return ++count <= most_partners;
            });
        partners[site] = count;
    }
    // Whether the lists no longer hold for a mass that lies at `at`.
    __device__ bool moved(int site, const corner& at) const {
        const int sites = grid.count();
        const spring_real ex = at.x - listed_at[site], ey = at.y - listed_at[sites + site],
                          ez = at.z - listed_at[2 * sites + site];
        const spring_real way = spring_real(0.5 * share_of_way) * margin;
        return !(fma(ex, ex, fma(ey, ey, ez * ez)) <= way * way);
    }

    // Calls visit(site) for every mass that the one at `site` may meet, in ascending order.
    template <class Visit>
    __device__ void each_partner(int site, const Visit& visit) const {
        const int count = partners[site];
        if (count <= most_partners) {
            for (int k = 0; k < count; ++k) visit(partners[(1 + k) * grid.count() + site]);
            return;
        }
        each_of_surface([&](int other) {
            if (other != site && !joined(site, other)) visit(other);
            return true;
        });
    }

    __device__ mass_real weight(int site) const { return mass_real(absolute(masses[site])); }
};

// Adds the pushes of the masses that the one at `site` meets. It lies and moves as `own` says.
template <class E>
__device__ inline void add_meetings(const meeting_columns& robot,
                                    const typename E::template params<mass_real>& params, int site,
                                    const corner& own, const spring_real* seen,
                                    effects::vector<mass_real>& total) {
    const mass_real reach = mass_real(robot.reach);
    robot.each_partner(site, [&](int other) {
        const corner there = exchanged_corner(robot.grid, seen, other);
        // from the mass with the lower site to the other, so that both find the same push
        const mass_real side = site < other ? mass_real(1) : mass_real(-1);
        const mass_real ex = side * (mass_real(there.x) - mass_real(own.x)),
                        ey = side * (mass_real(there.y) - mass_real(own.y)),
                        ez = side * (mass_real(there.z) - mass_real(own.z));
        const mass_real squared = fma(ex, ex, fma(ey, ey, ez * ez));
        if (!(squared < reach * reach)) return;
        const mass_real wx = side * (mass_real(there.vx) - mass_real(own.vx)),
                        wy = side * (mass_real(there.vy) - mass_real(own.vy)),
                        wz = side * (mass_real(there.vz) - mass_real(own.vz));
        // coincident masses get no direction, and so no push
        const mass_real inverse = inverse_length(squared + mass_real(1e-20));
        const mass_real nx = ex * inverse, ny = ey * inverse, nz = ez * inverse;
        const mass_real one = robot.weight(site), two = robot.weight(other);
        const effects::meeting_state<mass_real> found{
            reach - squared * inverse, fma(wx, nx, fma(wy, ny, wz * nz)), one * two / (one + two)};
        const mass_real push = -side * E::meet(params, found);
        total.x = fma(push, nx, total.x);
        total.y = fma(push, ny, total.y);
        total.z = fma(push, nz, total.z);
    });
}

// The farthest that any effect between masses reaches, m.
__device__ inline double reach_of_meetings(const launch_arguments& launch) {
    double reach = 0;
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_meet))
            reach = larger(reach, reach_of<E>(launch.scene, launch.rest[0]));
    });
    return reach;
}

__device__ inline meeting_columns meetings_of(const grid_arguments& arguments,
                                              const site_grid& grid, int64_t robot,
                                              const float* masses, const float* stiffness) {
    const meeting_lists<spring_real>& lists = arguments.meetings;
    const int64_t sites = grid.count();
    return {{grid, stiffness, lists.surface + robot * sites},
            masses,
            lists.partners + robot * (1 + most_partners) * sites,
            lists.listed_at + robot * 3 * sites,
            spring_real(reach_of_meetings(arguments.step)),
            spring_real(margin_share * arguments.step.rest[0])};
}

__device__ inline void add_all_meetings(const meeting_columns& robot,
                                        const launch_arguments& launch, int site, const corner& own,
                                        const spring_real* seen,
                                        effects::vector<mass_real>& total) {
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_meet))
            add_meetings<E>(robot, meeting_params<mass_real, E>(launch.scene), site, own, seen,
                            total);
    });
}

}  // namespace limax::cuda
