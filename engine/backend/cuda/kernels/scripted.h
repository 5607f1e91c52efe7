// scripted.h: the forces of the scene's scripted effects on one mass, with the operations and the
// order of the CPU's pass. SI units.
//   LIMAX_SCRIPTED            their programs, as scripted::kernel_text() writes them; nothing where
//                             there are none
//   LIMAX_SCRIPTED_REGISTERS  the most that one of them needs
#pragma once

#include "physics/effects/effect.h"
#include "physics/scripted/operations.h"

namespace limax::cuda {

// Inputs of a law besides the mass: the robot's own origin, m, what scripts set as parameters, and
// the time since the muscles began, s.
template <class R>
struct scripted_moment {
    const double* origin;
    const R* parameters;
    double time;
};

#if defined(LIMAX_SCRIPTED)
template <class R>
LIMAX_LAW void add_scripted_forces(const effects::node_state<R>& s, const scripted_moment<R>& now,
                                   effects::vector<R>& force) {
    using namespace scripted;
    // every index is a constant: these are registers of the thread
    R at[LIMAX_SCRIPTED_REGISTERS];
    at[input_position] = R(now.origin[0]) + s.position.x;
    at[input_position + 1] = R(now.origin[1]) + s.position.y;
    at[input_position + 2] = R(now.origin[2]) + s.position.z;
    at[input_velocity] = s.velocity.x;
    at[input_velocity + 1] = s.velocity.y;
    at[input_velocity + 2] = s.velocity.z;
    at[input_mass] = s.mass;
    at[input_time] = R(now.time);
    const bool used = s.mass > R(0);
#define LIMAX_CONSTANT(to, number) at[to] = R(number);
#define LIMAX_PARAMETER(to, number) at[to] = now.parameters[number];
#define LIMAX_OPERATION(to, what, a, b, c) at[to] = apply<operation(what)>(at[a], at[b], at[c]);
#define LIMAX_FORCE(along_x, along_y, along_z) \
    force.x += used ? at[along_x] : R(0);      \
    force.y += used ? at[along_y] : R(0);      \
    force.z += used ? at[along_z] : R(0);
    LIMAX_SCRIPTED
#undef LIMAX_CONSTANT
#undef LIMAX_PARAMETER
#undef LIMAX_OPERATION
#undef LIMAX_FORCE
}
#else
template <class R>
LIMAX_LAW void add_scripted_forces(const effects::node_state<R>&, const scripted_moment<R>&,
                                   effects::vector<R>&) {}
#endif

}  // namespace limax::cuda
