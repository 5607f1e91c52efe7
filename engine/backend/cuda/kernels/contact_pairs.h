// contact_pairs.h: masses of a robot's surface that meet, though neither a spring nor a chain of
// two joins them. Each mass lists the others that may come within reach, with a margin, in
// ascending order of their sites; lists hold until some mass has moved half the margin, and are
// made by looking at every other mass of the surface. When they were made changes no bit. SI units.
#pragma once

#include "backend/cuda/kernels/surface.h"

namespace limax::cuda {

// As a share of an edge: a larger margin makes longer lists, a smaller one more frequent ones.
inline constexpr double margin_share = 0.3;
// As a share of the distance that a mass may move before lists are made again; less than 1 because
// of rounding.
inline constexpr double share_of_way = 0.999;

// One robot's lists, [..][site]. corner_of(site) is a mass as springs read it.
struct contact_pairs : body_surface {
    const float* masses;
    int32_t* partners;
    float* listed_at;
    real reach, margin;  // m

    // Lists the partners of the mass at a site.
    template <class CornerOf>
    __device__ void list(int site, const CornerOf& corner_of) const {
        const int sites = grid.count();
        const corner at = corner_of(site);
        listed_at[site] = float(at.x);
        listed_at[sites + site] = float(at.y);
        listed_at[2 * sites + site] = float(at.z);
        int count = 0;
        if (is_of_surface(site))
            each_of_surface([&](int other) {
                const corner there = corner_of(other);
                const separation<real> e{there.x - at.x, there.y - at.y, there.z - at.z};
                const real most = reach + margin;
                if (!(dot(e, e) < most * most) || other == site || joined(site, other)) return true;
                if (count < most_partners) partners[(1 + count) * sites + site] = other;
                return ++count <= most_partners;
            });
        partners[site] = count;
    }
    // Whether the lists are out of date for a mass at `at`.
    __device__ bool moved(int site, const corner& at) const {
        const int sites = grid.count();
        const separation<float> e{float(at.x) - listed_at[site],
                                  float(at.y) - listed_at[sites + site],
                                  float(at.z) - listed_at[2 * sites + site]};
        const float way = float(0.5 * share_of_way * margin);
        return !(dot(e, e) <= way * way);
    }

    // Calls visit(site) for every mass that the one at `site` may touch, in ascending order.
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

    __device__ real weight(int site) const { return real(absolute(masses[site])); }
};

__device__ inline contact_pairs pairs_of(const launch_arguments& launch, const site_grid& grid,
                                         int64_t robot) {
    double reach = 0;
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_meet))
            reach = larger(reach, reach_of<E>(launch.scene, launch.rest[0]));
    });
    const pair_lists& lists = launch.pairs;
    const int64_t sites = grid.count();
    return {{grid, launch.springs + robot * (stored_columns * direction_count) * sites,
             lists.surface + robot * sites},
            launch.mass + robot * sites,
            lists.partners + robot * (1 + most_partners) * sites,
            lists.listed_at + robot * 3 * sites,
            real(reach),
            real(margin_share * launch.rest[0])};
}

// Adds the push of the mass at `other` on the one at `site`, whose state is `own`.
template <class E>
__device__ inline void add_push(const contact_pairs& robot,
                                const typename E::template params<real>& params, int site,
                                const corner& own, int other, const corner& there,
                                effects::vector<real>& total) {
    const real reach = real(robot.reach);
    // from the mass with the lower site to the other, so that both find the same push
    const real side = site < other ? real(1) : real(-1);
    const separation<real> e{side * (there.x - own.x), side * (there.y - own.y),
                             side * (there.z - own.z)};
    const real squared = dot(e, e);
    if (!(squared < reach * reach)) return;
    const separation<real> w{side * (there.vx - own.vx), side * (there.vy - own.vy),
                             side * (there.vz - own.vz)};
    const distance<real> apart = contact_distance(squared);
    const separation<real> n{e.x * apart.inverse, e.y * apart.inverse, e.z * apart.inverse};
    const real one = robot.weight(site), two = robot.weight(other);
    const effects::pair_state<real> found{reach - apart.length, dot(w, n), one * two / (one + two)};
    const real push = -side * E::meet(params, found);
    total.x = fma(push, n.x, total.x);
    total.y = fma(push, n.y, total.y);
    total.z = fma(push, n.z, total.z);
}

// The force on the mass at a site of all masses that it touches, N.
template <class CornerOf>
__device__ inline effects::vector<real> force_of_pairs(const contact_pairs& robot,
                                                       const launch_arguments& launch, int site,
                                                       const CornerOf& corner_of) {
    effects::vector<real> total{};
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_meet)) {
            robot.each_partner(site, [&](int other) {
                add_push<E>(robot, pair_params<real, E>(launch.scene), site, corner_of(site), other,
                            corner_of(other), total);
            });
        }
    });
    return total;
}

}  // namespace limax::cuda
