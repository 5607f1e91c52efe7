// modes.h: the natural modes of a body: small vibrations about a pose at rest. SI units.
//
// With u the displacements of the masses that may move, M u'' + C u' + K u = 0, linearised at the
// pose: a spring adds k ((L / r) n n^T + (1 - L / r) I) to K and c n n^T to C, n along it; a
// contact that touches adds its k and c along its normal, and friction holds what touches across
// it; wind adds its drag to C. A mode is an eigenvector of K x = w^2 M x, its damping ratio x.C x /
// (2 w x.M x), which is exact where C is diagonal in the modes and else to first order in C.
// The rest lengths of muscles that change slowly by A sin + B cos push with k A and k B along each
// spring; the mode then moves by x.F / w^2.
// Ignored are the block, self-collision, drag on faces, which is quadratic, and scripted forces.
#pragma once

#include <vector>

#include "body/springs.h"
#include "limax.h"
#include "physics/scene.h"

namespace limax {

struct natural_modes {
    // directions of motion without a restoring force: 6 of a free body in one piece
    int32_t rigid = 0;
    std::vector<limax_mode> modes;  // ascending by frequency, without the rigid ones
    std::vector<double> shapes;     // [mode][mass][3]; the largest displacement is 1
};

// The first `count` modes, or all where there are fewer. `positions` are of the masses in the
// world, [mass][3], m; null for the undeformed body without contacts. Refuses a pose that is not
// stable.
natural_modes modes_of(const spring_body& body, const scene& scene, const double* positions,
                       int32_t count);

}  // namespace limax
