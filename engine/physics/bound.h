// bound.h: how long a step may be, of one mass: the laws behind the automatic time step, which any
// device may evaluate mass by mass. Includes laws only. SI units.
//
// Linearise about any pose in which every spring is at least half its rest length: a spring's
// stiffness block then has norm at most k, so by Gershgorin's theorem on M^-1 K and M^-1 C each
// mass i gives w^2 <= A_i and gamma <= B_i with
//     A_i = (2 sum_j k_ij + k_g) / m_i,   B_i = (2 sum_j c_ij + c_g) / m_i.
// One mode, x'' = -w^2 x - gamma x', under each integrator, with W = (w dt)^2 and G = gamma dt:
//   symplectic Euler: z^2 + (W + G - 2) z + (1 - G) = 0. Jury: p(1) = W > 0, |1 - G| < 1, and
//   p(-1) = 4 - W - 2 G > 0, the sharpest.
//       dt < (-B + sqrt(B^2 + 4 A)) / A.
//   leapfrog: z^3 + (W + 3 G / 2 - 2) z^2 + (1 - 2 G) z + G / 2 = 0. Jury: p(1) = W > 0; -p(-1) =
//   4 - W - 4 G > 0; |G / 2| < 1; and
//       1 - G^2 / 4 > |G W / 2 + 3 G^2 / 4 + G - 1|, which p(-1) implies: with W < 4 - 4 G the
//       right side's upper branch asks (G - 1)(G - 2) > 0, true for G < 1, and its lower branch 0
//       < G W / 2 + G^2 / 2 + G. So z = -1 leaves the unit circle first: dt < 2 (-B + sqrt(B^2 +
//       A)) / A, symplectic Euler's formula with B doubled.
//   RK4: each mode is multiplied by R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 in a step, with z = dt
//   times a root of s^2 + gamma s + w^2, so Re z <= 0. A complex pair has |z| = w dt; of two real
//   roots none is beyond gamma, so |z| <= gamma dt. |R| <= 1 on the imaginary axis up to sqrt(8) =
//   2.8284 (|R(iy)|^2 = 1 - y^6/72 + y^8/576) and on the negative real axis up to 2.7853; between
//   the two the region is narrowest at an angle of 0.68 pi, where it ends at |z| = 2.6156. By the
//   maximum principle the half disc up to there is inside it:
//       dt < 2.615 / max(sqrt(A), B).
//
// Bounded by voxels, A and B leave out the space diagonals. A spring adds at most k |x_i - x_j|^2
// to x.K x, for which the sums above take 2 k (|x_i|^2 + |x_j|^2). But the corners of a voxel of
// stiffness k are joined all with all: with k / 4 of each of its springs (an edge has up to four
// owners) sum |x_i - x_j|^2 = 8 sum |x_i|^2 - |sum x_i|^2 over its 8 corners takes 2 k of each
// corner instead of 7/2 k, and another k / 4 of its face diagonals (up to two owners), which join
// two sets of 4 corners all with all, k instead of 3/2 k. So each corner has 2 k less, which is
// what its one space diagonal adds. For B the same holds with t k in place of k, t the least c / k
// of all springs: t times the stiffness of a spring is at most its c.
//
// It is a result about the frozen linear system in every such pose, not about switching contacts:
// the run-time guard stays.
#pragma once

#include "body/lattice.h"
#include "physics/effects/all.h"
#include "physics/solid_pairs.h"

namespace limax {

// The integrators that have a bound, numbered as in limax_integrator.
enum class scheme { symplectic_euler, leapfrog, rk4 };

// Radius of the largest half disc about 0, Re z <= 0, in which RK4 is stable, rounded down.
inline constexpr double rk4_radius = 2.615;

// Largest stable step of one mass, s; infinite where nothing acts on it. A in 1/s^2, B in 1/s.
LIMAX_LAW double stable_step(scheme method, double a, double b) {
    const double infinite = bits_as<double>(uint64_t(0x7ff) << 52);
    if (method == scheme::rk4) {
        const double fastest = larger(a > 0 ? square_root(a) : 0.0, b);
        return fastest > 0 ? rk4_radius / fastest : infinite;
    }
    const bool leapfrog = method == scheme::leapfrog;
    if (!(a > 0)) return b > 0 ? (leapfrog ? 1.0 : 2.0) / b : infinite;
    const double damping = leapfrog ? 2.0 * b : b;
    // (-B + sqrt(B^2 + 4 A)) / A without cancellation
    return 4.0 / (damping + square_root(damping * damping + 4.0 * a));
}

// Springs of a body: k and c, [direction][stride], by the site of their near end; `damping` null in
// a scene without it.
struct spring_constants {
    const float* stiffness;  // N/m; 0 where there is no spring
    const float* damping;    // N s/m
    int64_t stride;
    bool by_voxels = false;
    double least_time = 0;  // of damping_time of all springs, s; read where by_voxels
};

// Whether an effect bounds springs rather than masses.
template <class E>
inline constexpr bool bounds_springs = (E::hooks & effects::hook_bound) != 0 &&
                                       (E::hooks & effects::hook_pair) != 0;
template <class E>
inline constexpr bool bounds_masses = effects::is_contact<E> ||
                                      ((E::hooks & effects::hook_bound) != 0 &&
                                       (E::hooks & effects::hook_pair) == 0);
template <class E>
LIMAX_LAW effects::stiffness_damping bound_of_mass(const typename E::template params<double>& p,
                                                   double mass) {
    if constexpr (effects::is_contact<E>)
        return effects::contact_bound(p, mass);
    else
        return E::bound(p, mass);
}

// c / k of a spring, s; infinite where there is none.
LIMAX_LAW double damping_time(float stiffness, float damping) {
    return stiffness > 0 ? double(damping) / double(stiffness)
                         : bits_as<double>(uint64_t(0x7ff) << 52);
}

// Adds the spring along direction `d` at `slot` to the sums of one of its ends.
template <class Scene>
LIMAX_LAW void add_spring_bound(const Scene& scene, const spring_constants& springs, int d,
                                int64_t slot, effects::stiffness_damping& sum) {
    if (springs.stiffness[slot] == 0) return;
    const double stiffness = double(springs.stiffness[slot]);
    const double damping = springs.damping ? double(springs.damping[slot]) : 0.0;
    const bool left_out = springs.by_voxels && d >= first_space_diagonal;
    effects::for_each([&]<class E>(E) {
        if constexpr (bounds_springs<E>) {
            if (!scene.has(effects::index_of<E>)) return;
            const effects::stiffness_damping most =
                left_out ? E::bound(0.0, damping - springs.least_time * stiffness)
                         : E::bound(stiffness, damping);
            sum.stiffness += 2.0 * most.stiffness;
            sum.damping += 2.0 * most.damping;
        }
    });
}

// The share of all instances of an effect in the bound of a mass: the largest sum over instances
// that can act on it at once. Those that can are apart from none of the others, so no such sum is
// above the sum over the instances that are not apart from one of them.
template <class E, class Scene>
LIMAX_LAW effects::stiffness_damping bound_of_instances(const Scene& scene, double mass) {
    constexpr int index = effects::index_of<E>;
    const double origin[3] = {0, 0, 0};
    effects::stiffness_damping most{0, 0};
    for (int i = 0; i < scene.instances(index); ++i) {
        effects::stiffness_damping sum{0, 0};
        for (int j = 0; j < scene.instances(index); ++j) {
            const double* values = scene.values(index, j);
            if constexpr (requires { E::apart(values, values); })
                if (j != i && E::apart(scene.values(index, i), values)) continue;
            const effects::stiffness_damping one =
                bound_of_mass<E>(E::template make<double>(values, origin), mass);
            sum.stiffness += one.stiffness;
            sum.damping += one.damping;
        }
        most = {larger(most.stiffness, sum.stiffness), larger(most.damping, sum.damping)};
    }
    return most;
}

// The longest stable step that the mass, which nothing holds, at `site`, of `mass` kg, allows, s.
// `scene` has `has(effect)`, `instances(effect)` and `values(effect, instance)`, the components of
// all fields; where it may have scripted effects, also `script_bound()`.
template <class Scene>
LIMAX_LAW double stable_step_of_mass(const Scene& scene, scheme method, const lattice& grid,
                                     const spring_constants& springs, int64_t site, double mass) {
    effects::stiffness_damping sum{0, 0};
    // direction by direction, the spring that ends here before the one that starts here
    for (int d = 0; d < direction_count; ++d) {
        const int64_t step = grid.step(direction_at(d));
        if (site >= step)
            add_spring_bound(scene, springs, d, d * springs.stride + site - step, sum);
        add_spring_bound(scene, springs, d, d * springs.stride + site, sum);
    }
    effects::for_each([&]<class E>(E) {
        if constexpr (bounds_masses<E>) {
            if (!scene.has(effects::index_of<E>)) return;
            const effects::stiffness_damping most = bound_of_instances<E>(scene, mass);
            sum.stiffness += most.stiffness;
            sum.damping += most.damping;
        }
    });
    if constexpr (requires { scene.script_bound(); }) {
        const effects::stiffness_damping most = scene.script_bound();
        sum.stiffness += most.stiffness;
        sum.damping += most.damping;
    }
    return stable_step(method, sum.stiffness / mass, sum.damping / mass);
}

// The longest stable step of rigid block `which` of a scene, s: effects/block.h has the shares.
// Contacts of two that move count twice; no more masses touch than the body has. `heaviest` is its
// heaviest mass, kg, `edge` that of its voxels, m.
template <class Scene>
LIMAX_LAW double stable_step_of_block(const Scene& scene, int which, scheme method, double edge,
                                      int32_t masses, double heaviest) {
    using namespace effects;
    const double origin[3] = {0, 0, 0};
    const auto block_at = [&](int i) {
        return block::make<double>(scene.values(index_of<block>, i), origin);
    };
    const block::params<double> p = block_at(which);
    const double touching = smaller(double(masses), block::most_touching(p, edge));
    const stiffness_damping of_mass = block::bound(p, heaviest);
    stiffness_damping sum{block::most_of_place * touching * of_mass.stiffness,
                          block::most_of_place * touching * of_mass.damping};
    // each block is guest and host
    const double of_pair = 2.0 * 2.0 * solid::most_of_box * block::most_of_place;
    for (int i = 0; i < scene.instances(index_of<block>); ++i) {
        if (i == which) continue;
        const stiffness_damping one = i < which ? solid::contact_of_pair(block_at(i), p)
                                                : solid::contact_of_pair(p, block_at(i));
        sum.stiffness += of_pair * one.stiffness;
        sum.damping += of_pair * one.damping;
    }
    for_each([&]<class E>(E) {
        if constexpr (is_contact<E>) {
            const bool flat = same_type<E, ground> || same_type<E, planes>;
            if (!scene.has(index_of<E>)) return;
            double share = flat ? block::most_of_corners : 8 * block::most_of_place;
            if (!flat && scene.has(index_of<edges>)) {
                share = solid::most_of_box * block::most_of_place;
                if constexpr (reads_heights<E>)
                    share = solid::touches_of_terrain(p.half,
                                                      E::spacing_of(scene.values(index_of<E>, 0))) *
                            block::most_of_place;
            }
            for (int i = 0; i < scene.instances(index_of<E>); ++i) {
                const stiffness_damping one =
                    contact_bound(E::template make<double>(scene.values(index_of<E>, i), origin),
                                  block::corner_share * p.mass);
                sum.stiffness += share * one.stiffness;
                sum.damping += share * one.damping;
            }
        }
    });
    return stable_step(method, sum.stiffness / p.mass, sum.damping / p.mass);
}

}  // namespace limax
