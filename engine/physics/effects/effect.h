// effect.h: the contract of an effect. An effect is a struct in its own header: its name,
// the hooks that it needs another effect to have, its parameters with units and valid ranges, and
// laws under the names of the hooks that it declares. May include base/ only.
//
//   rest     R rest(moment, spring): a spring's rest length with its change, m
//   pair     spring_force<R> pair(spring, force): the force along a spring with that of this law
//   node     void node(params, node, force&): adds to the force on a mass, N
//   contact  surface_point surface(params, position): the depth of a place below its surface and
//            the unit normal there, `up` or a vector. contact.h computes push, energy and bound
//            from it; params have a `stiffness` and the `damping` of unit_damping()
//   face     vector<R> face(params, face, h): the impulse over h on an exposed face, N s, of which
//            each corner takes a quarter; after all forces, axis by axis
//   slip     vector<R> slip(params, normal, push, inverse_mass, before, velocity, h): the velocity
//            after the impulse of a contact across its normal, which never reverses what it
//            opposes, m/s; `before` is the one before this step's forces. Asked for each contact in
//            turn, after all other impulses, and does not change the velocity where `push` is 0
//   grip     R grip(params, place): by what the friction coefficients of contacts are multiplied
//   there hold     bool holds(params, start): whether the mass that starts there, m from the body's
//            lowest corner, stays there whatever acts on it
//   meet     R meet(params, pair): the push that separates two masses of the body's surface that
//            neither a spring nor a chain of two joins, N, and R stored(params, pair): its
//            energy, J; params have a `reach` in edges, beyond which neither is called
//   solid    surface_point solid(params, place): the depth in a rigid solid of a place in its own
//            frame and the normal there, and R parts(params, depth, rate, mass): the push that
//            separates a mass from it, N. physics/solid.h moves it
//   energy   R energy(params, node) or R energy(spring): energy stored in it, J
//   bound    stiffness_damping bound(...): largest stiffness (N/m) and damping (N s/m) that it adds
//            to a mass or along a spring, for the automatic time step
//
// An effect with laws on masses has `params<R>`, its parameters in the precision of the robot, and
// `params<R> make(values, origin)`, which takes them from the components of all fields, one after
// the other, and from the robot's own origin in the world (m). Where any of them depends on that
// origin, `void follow(params&, values, origin)` brings those, and no others, up to date.
// Where they depend on the time since the muscles began (s), `void move(params&, values, origin,
// time)` does the same for each evaluation of forces; params of such a contact have its
// `surface_velocity`, m/s.
// An effect that a scene may have several times declares `most_instances`; its laws see one
// instance, whose params are made again when the origin moves. Instances are sorted by their
// values, or stay in the order of adding if it declares `keeps_order`. `const char*
// problem(values)` reports invalid combinations of values that are each within range. If its params
// have a `height_table table`, it is set to the scene's. engine/README.md shows a whole one.
//
// A hook is declared in `hooks`, and hooks_match() refuses, at compile time, a declared hook
// without its law and a law without its declaration, so that a misspelt one cannot vanish. An
// effect that a scene does not name is never instantiated into its passes.
#pragma once

#include "base/portable.h"

namespace limax::effects {

enum hook : unsigned {
    hook_rest = 1,
    hook_pair = 2,
    hook_node = 4,
    hook_energy = 8,
    hook_bound = 16,
    hook_contact = 32,
    hook_slip = 64,
    hook_hold = 128,
    hook_face = 256,
    hook_meet = 512,
    hook_solid = 1024,
    hook_grip = 2048
};

// Components of a field that is a table of heights: it is not among the values.
inline constexpr int table_of_heights = 0;

// One parameter of an effect: `components` numbers (1 or 3), each within [minimum, maximum].
struct field {
    const char* name;
    const char* unit;
    const char* note;
    int components;
    double minimum, maximum;
    double value[3];  // default
};

// Heights on a grid, [x][y], m. The scene, or a GPU's memory, owns them.
struct height_table {
    const float* heights;
    int32_t nx, ny;
};

template <class R>
struct vector {
    R x, y, z;
};

// One spring at one moment, as a law sees it.
template <class R>
struct spring_state {
    R length;     // |e|, m
    R rest;       // rest length now, m
    R rate;       // d length / dt, m/s; only where a law asks for velocity
    R stiffness;  // k, N/m
    R damping;    // c, N s/m
    R sine;       // A: amplitude of sin(2 pi f t) in the rest length, m
    R cosine;     // B: amplitude of cos(2 pi f t), m
};

// A force along a spring: (scale - push / length) e on the near end, e from there to the far end.
// Neither part needs the length itself. Adding to -0 takes no instruction.
template <class R>
struct spring_force {
    R scale = R(-0.0);  // N/m
    R push = R(-0.0);   // N
};
// Positive pulls the ends together, N.
template <class R>
LIMAX_LAW R tension(const spring_force<R>& force, R length) {
    return fma(force.scale, length, -force.push);
}

// One mass at one moment. Positions are relative to the robot's own origin.
template <class R>
struct node_state {
    vector<R> position;  // m
    vector<R> velocity;  // m/s, the velocity that forces read
    R mass;              // kg; 0 at a site that is not in use
    R inverse_mass;      // 1/kg; 0 at a site that is not in use
    R root_mass = square_root(mass);
};

// One exposed face of a voxel at one moment: the square between a voxel and an empty one. Which of
// the two is empty does not matter to a law: `area` may point either way.
template <class R>
struct face_state {
    vector<R> area;      // along the normal, as long as the face is large: half of d1 x d2, m^2
    vector<R> velocity;  // mean of its corners', that forces read, m/s
    vector<R> after;     // mean of its corners' after all forces and the impulses so far, m/s
    R mass;              // of its lightest corner, kg; 0 where no face is exposed
};

// Two masses that no spring joins, within reach of each other.
template <class R>
struct pair_state {
    R depth;         // reach less their distance, m
    R rate;          // d distance / dt, m/s
    R reduced_mass;  // kg
};

// Contribution to the bound on the time step.
struct stiffness_damping {
    double stiffness;  // N/m
    double damping;    // N s/m
};

}  // namespace limax::effects
