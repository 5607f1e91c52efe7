// measure.h: what is read off a body: sums over masses and springs in ascending order, in double,
// so that results do not depend on vector width or threads. SI units.
#pragma once

#include "body/springs.h"
#include "physics/effects/all.h"
#include "physics/scene.h"
#include "physics/separation.h"

namespace limax {

// Energies of a body at one moment.
struct energies {
    double kinetic = 0;        // J
    double elastic = 0;        // J, of springs and of contacts
    double gravitational = 0;  // J, from the world's origin
    double power = 0;          // W, what the muscles put in by changing rest lengths
};

// Mean and largest |r - L0| / L0.
struct strains {
    double mean = 0, most = 0;
};

// Mass-weighted mean of `coordinate` (of one axis, [site]) over the masses of a body.
template <class R>
double center_of_mass(const spring_body& body, const R* coordinate) {
    double sum = 0;
    for (int32_t i = 0; i < body.masses; ++i) {
        const int32_t site = body.sites[i];
        sum += double(body.mass[site]) * double(coordinate[site]);
    }
    return sum / body.total_mass;
}

// Calls visit(slot, near, far, direction) for every spring.
template <class Visit>
void for_each_spring(const spring_body& body, const Visit& visit) {
    for (int d = 0; d < direction_count; ++d) {
        const int64_t step = body.grid.step(directions[d]);
        for (int64_t near = 0; near + step < body.grid.sites(); ++near)
            if (body.stiffness[d * body.count + near] > 0)
                visit(d * body.count + near, near, near + step, d);
    }
}

template <class R>
double length_between(const R* const position[3], int64_t near, int64_t far) {
    const separation<double> e{double(position[0][far]) - double(position[0][near]),
                               double(position[1][far]) - double(position[1][near]),
                               double(position[2][far]) - double(position[2][near])};
    return square_root(dot(e, e));
}

template <class R>
strains measure_strain(const spring_body& body, const R* const position[3]) {
    strains result;
    int64_t springs = 0;
    for_each_spring(body, [&](int64_t, int64_t near, int64_t far, int d) {
        const double strain =
            absolute(length_between(position, near, far) - body.rest[d]) / body.rest[d];
        result.mean += strain;
        result.most = larger(result.most, strain);
        ++springs;
    });
    if (springs) result.mean /= double(springs);
    return result;
}

// `moment` and `rate` are the actuation's and its derivative, zero without it. `velocity` is at
// the same time as `position`, `time` since the muscles began, s.
template <class R>
energies measure_energy(const spring_body& body, const scene& scene, const R* const position[3],
                        const R* const velocity[3], const double origin[3], double time,
                        const effects::actuation::moment<double>& moment,
                        const effects::actuation::moment<double>& rate) {
    using namespace effects;
    energies result;
    const bool actuated = body.sine.size() != 0;
    for_each_spring(body, [&](int64_t slot, int64_t near, int64_t far, int d) {
        spring_state<double> spring{};
        spring.length = length_between(position, near, far);
        spring.stiffness = body.stiffness[slot];
        spring.rest = body.rest[d];
        if (actuated) {
            spring.sine = body.sine[slot];
            spring.cosine = body.cosine[slot];
            // dE/dt at fixed length: the tension times the rest length's speed, against it
            spring_state<double> change = spring;
            change.rest = 0;
            spring.rest = actuation::rest(moment, spring);
            result.power -=
                tension(springs::pair(spring, {}), spring.length) * actuation::rest(rate, change);
        }
        result.elastic += springs::energy(spring);
    });
    const double world[3] = {0, 0, 0};
    for (int32_t i = 0; i < body.masses; ++i) {
        const int32_t site = body.sites[i];
        const double mass = body.mass[site];
        const double u = velocity[0][site], v = velocity[1][site], w = velocity[2][site];
        result.kinetic += 0.5 * mass * fma(u, u, fma(v, v, w * w));
        const node_state<double> node{{origin[0] + position[0][site], origin[1] + position[1][site],
                                       origin[2] + position[2][site]},
                                      {u, v, w},
                                      mass,
                                      1.0 / mass};
        for_each([&]<class E>(E) {
            if constexpr (stores_energy_on_masses<E>) {
                if (!scene.has(index_of<E>)) return;
                for (int i = 0; i < scene.instances(index_of<E>); ++i)
                    (same_type<E, gravity> ? result.gravitational : result.elastic) +=
                        energy_of_mass<E>(make_params<E, double>(scene.values(index_of<E>, i),
                                                                 world, scene.heights(), time),
                                          node);
            }
        });
    }
    return result;
}

}  // namespace limax
