// edges.h: the edges and faces of rigid blocks meet boxes, spheres and terrain, not only its
// corners: a beam lies on two narrow posts. Law: physics/solid_edges.h. SI units.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct edges {
    static constexpr const char* name = "edges";
    static constexpr const char* summary =
        "edges and faces of blocks meet boxes, spheres and terrain, not only their corners";
    static constexpr unsigned needs = hook_solid;
    static constexpr unsigned hooks = 0;
    static constexpr const field* fields = nullptr;
    static constexpr int field_count = 0;
};

}  // namespace limax::effects
