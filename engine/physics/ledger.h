// ledger.h: the energy balance of a body: its energy at one moment, and the power of everything
// that changes it. Summed in double over springs and masses in ascending order. SI units.
//
// An effect on masses that stores energy has, on a mass at rest, minus that energy's gradient as
// its force: this part only moves energy from one account to another. Any further work
// on a moving mass is dissipation. All work of an effect that stores no energy is counted.
#pragma once

#include "physics/measure.h"

namespace limax {

// The kinds of work that change a body's energy; positive work adds energy.
enum work_kind {
    work_muscles = 0,          // rest lengths that change
    work_damping = 1,          // dashpots along springs
    work_contact_damping = 2,  // what contacts do beyond their stored energy
    work_friction = 3,
    work_other = 4,  // every other effect
    work_kinds = 5
};

// W of each kind.
struct powers {
    double of[work_kinds] = {};
};

// A sample of the ledger: kinetic, elastic, contact and gravitational energy, then the works.
inline constexpr int ledger_energies = 4, ledger_width = ledger_energies + work_kinds;

// The account of an effect that is none of the muscles'.
template <class E>
constexpr work_kind account_of() {
    if (same_type<E, effects::damping>) return work_damping;
    if (same_type<E, effects::friction>) return work_friction;
    return effects::is_contact<E> ? work_contact_damping : work_other;
}

// The masses of a body at one moment, columns of [site].
template <class S>
struct moving_masses {
    const S* const* position;  // m, from `origin`
    const S* const* read;      // velocity that the forces read, m/s
    const S* const* velocity;  // at the moment itself, m/s
    const double* origin;      // m
};

// One mass of a body as the effects see it, in the world.
template <class S>
effects::node_state<double> node_of(const spring_body& body, const moving_masses<S>& masses,
                                    int32_t site) {
    const double mass = body.mass[site];
    return {
        {masses.origin[0] + masses.position[0][site], masses.origin[1] + masses.position[1][site],
         masses.origin[2] + masses.position[2][site]},
        {masses.read[0][site], masses.read[1][site], masses.read[2][site]},
        mass,
        1.0 / mass};
}

// The energy stored in contacts at a time, s since the muscles began, J.
template <class S>
double contact_energy(const spring_body& body, const scene& scene, const moving_masses<S>& masses,
                      double time) {
    const double world[3] = {0, 0, 0};
    double sum = 0;
    for (int32_t i = 0; i < body.masses; ++i) {
        const auto node = node_of(body, masses, body.sites[i]);
        effects::for_each([&]<class E>(E) {
            if constexpr (effects::is_contact<E>)
                for (int j = 0; j < scene.instances(effects::index_of<E>); ++j)
                    sum += effects::energy_of_mass<E>(
                        effects::make_params<E, double>(scene.values(effects::index_of<E>, j),
                                                        world, scene.heights(), time),
                        node);
        });
    }
    return sum;
}

// How the rest lengths change around a moment, zero without actuation: the actuation's state, and
// its change per second since the step before and until the next one. Differences rather than a
// derivative, so that muscles whose ramp ends within a step do not lower the order.
struct muscle_motion {
    effects::actuation::moment<double> now{0, 0}, since{0, 0}, until{0, 0};
};

// Adds what springs take and give; the muscles' part is that of the step before, and
// `muscles_ahead` is that of the next one, W.
template <class S>
void add_spring_powers(const spring_body& body, const scene& scene, const moving_masses<S>& masses,
                       const muscle_motion& muscles, powers& sum, double& muscles_ahead) {
    using namespace effects;
    const bool actuated = body.sine.size() != 0;
    for_each_spring(body, [&](int64_t slot, int64_t near, int64_t far, int d) {
        spring_state<double> spring{};
        spring.length = length_between(masses.position, near, far);
        if (!(spring.length > 0)) return;  // of no direction, and so without force
        double lengthening = 0;            // m/s, at the moment itself
        for (int axis = 0; axis < 3; ++axis) {
            const double e =
                (double(masses.position[axis][far]) - double(masses.position[axis][near])) /
                spring.length;
            spring.rate += e * (double(masses.read[axis][far]) - double(masses.read[axis][near]));
            lengthening +=
                e * (double(masses.velocity[axis][far]) - double(masses.velocity[axis][near]));
        }
        spring.stiffness = body.stiffness[slot];
        spring.damping = body.damping.size() ? double(body.damping[slot]) : 0.0;
        spring.rest = body.rest[d];
        if (actuated) {
            spring.sine = body.sine[slot];
            spring.cosine = body.cosine[slot];
            // dE/dt at fixed length: the tension times the rest length's speed, against it
            spring_state<double> change = spring;
            change.rest = 0;
            spring.rest = actuation::rest(muscles.now, spring);
            const double pull = tension(springs::pair(spring, {}), spring.length);
            sum.of[work_muscles] -= pull * actuation::rest(muscles.since, change);
            muscles_ahead -= pull * actuation::rest(muscles.until, change);
        }
        for_each([&]<class E>(E) {
            if constexpr (bool(E::hooks & hook_pair) && !bool(E::hooks & hook_energy))
                if (scene.has(index_of<E>))
                    sum.of[account_of<E>()] -=
                        tension(E::pair(spring, {}), spring.length) * lengthening;
        });
    });
}

// Adds what each effect on masses takes and gives by its force at a time, s since the muscles
// began. What drives a surface that moves adds the work of its pushes.
template <class S>
void add_node_powers(const spring_body& body, const scene& scene, const moving_masses<S>& masses,
                     double time, powers& sum) {
    using namespace effects;
    const double world[3] = {0, 0, 0};
    for_each([&]<class E>(E) {
        if constexpr (pushes_masses<E>) {
            for (int j = 0; j < scene.instances(index_of<E>); ++j) {
                const auto params = make_params<E, double>(scene.values(index_of<E>, j), world,
                                                           scene.heights(), time);
                const vector<double> of_surface = in_world(params, vector<double>{0, 0, 0});
                double power = 0, driven = 0;
                for (int32_t i = 0; i < body.masses; ++i) {
                    const int32_t site = body.sites[i];
                    node_state<double> node = node_of(body, masses, site);
                    vector<double> force{}, stored{};
                    add_force<E>(params, node, force);
                    node.velocity = of_surface;
                    if constexpr (stores_energy_on_masses<E>) add_force<E>(params, node, stored);
                    const vector<double> velocity{double(masses.velocity[0][site]),
                                                  double(masses.velocity[1][site]),
                                                  double(masses.velocity[2][site])};
                    const vector<double> slip = relative_to(params, velocity);
                    power += (force.x - stored.x) * slip.x + (force.y - stored.y) * slip.y +
                             (force.z - stored.z) * slip.z;
                    if constexpr (moves<E>) driven += dot(force, of_surface);
                }
                sum.of[work_other] += driven;
                sum.of[account_of<E>()] += power;
            }
        }
    });
}

}  // namespace limax
