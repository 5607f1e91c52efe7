// held.h: which masses of a body a scene holds where they start. A law; includes laws only. m.
#pragma once

#include "physics/effects/all.h"

namespace limax {

// Effects that hold masses.
inline constexpr unsigned holding_bits = effects::bits_with(effects::all{}, effects::hook_hold);

// Whether `scene`, as in bound.h, holds the mass at a site x, y, z of a lattice of voxels with this
// edge, whose body's lowest site is `corner`.
template <class Scene>
LIMAX_LAW bool is_held(const Scene& scene, double edge, const int corner[3], int x, int y, int z) {
    const double origin[3] = {0, 0, 0};
    const effects::vector<double> start{edge * double(x - corner[0]), edge * double(y - corner[1]),
                                        edge * double(z - corner[2])};
    bool held = false;
    effects::for_each([&]<class E>(E) {
        if constexpr (bool(E::hooks & effects::hook_hold))
            for (int i = 0; i < scene.instances(effects::index_of<E>); ++i)
                held |= E::holds(
                    E::template make<double>(scene.values(effects::index_of<E>, i), origin), start);
    });
    return held;
}

}  // namespace limax
