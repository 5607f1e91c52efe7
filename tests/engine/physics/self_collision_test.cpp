// self_collision_test.cpp: the energy of collisions between parts of one body.
#include <doctest/doctest.h>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

// A hairpin: two legs of `length` voxels that stand on one foot, a gap of two voxels between them.
stage hairpin(int length) {
    stage body({4, 1, length + 1}, 1, 0);
    const lattice& grid = body.setup.grid;
    for (int x = 0; x < 4; ++x) body.setup.voxels[grid.voxel(x, 0, 0)] = 3;
    for (int z = 1; z <= length; ++z)
        for (const int x : {0, 3}) body.setup.voxels[grid.voxel(x, 0, z)] = 3;
    body.effects({"damping", "self_collision"});
    body.setup.options.duration = 0.5;
    return body;
}

// Throws the legs at each other, and keeps the body's momentum at 0.
void clap(simulation& simulation, const stage& body, double speed) {
    const snapshot at = state_of(simulation);
    std::vector<double> thrown(at.positions.size(), 0.0);
    const double middle = 2 * body.setup.options.edge;
    for (std::size_t i = 0; i < thrown.size(); i += 3)
        if (at.positions[i + 2] > 1.5 * body.setup.options.edge)
            thrown[i] = at.positions[i] < middle ? speed : -speed;
    simulation.place(0, nullptr, thrown.data());
}

}  // namespace

TEST_CASE("the energy balance holds while parts collide") {
    stage body = hairpin(5);
    body.setup.options.record[LIMAX_TRACE_LEDGER] = 100;
    const auto simulation = body.open();
    clap(*simulation, body, 3.0);
    stage::finish(*simulation);
    const energy_balance balance = balance_of(*simulation);
    CHECK(balance.in_contacts > 0.1);
    CHECK(balance.error < 5e-3 * balance.largest);
}
