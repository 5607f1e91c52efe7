// roles.h: what part an effect plays, told from its hooks, for whoever treats kinds of effects
// apart rather than effects by name.
#pragma once

#include "physics/effects/all.h"

namespace limax {

// Whether an effect is a contact: it acts on masses and stores energy only while they touch.
template <class E>
inline constexpr bool is_contact = bool(E::hooks& effects::hook_node) &&
                                   bool(E::hooks& effects::hook_energy) &&
                                   !same_type<E, effects::gravity>;

}  // namespace limax
