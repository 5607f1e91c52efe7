// self_collision_test.cpp: collisions between parts of one body: the law, energy, and equal bits
// without contacts.
#include <doctest/doctest.h>

#include <cmath>

#include "physics/effects/all.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

using effects::self_collision;

// A hairpin: two legs of `length` voxels that stand on one foot, a gap of two voxels between them.
stage hairpin(int length, bool collides) {
    stage body({4, 1, length + 1}, 1, 0);
    const lattice& grid = body.setup.grid;
    for (int x = 0; x < 4; ++x) body.setup.voxels[grid.voxel(x, 0, 0)] = 3;
    for (int z = 1; z <= length; ++z)
        for (const int x : {0, 3}) body.setup.voxels[grid.voxel(x, 0, z)] = 3;
    body.effects({"damping"});
    if (collides) body.effects({"self_collision"});
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

TEST_CASE("the repulsion of two masses is the gradient of their energy and never attracts") {
    const self_collision::params<double> p{2e3, 0.1, 1.0};
    const auto at = [](double depth, double rate) {
        return effects::pair_state<double>{depth, rate, 0.05};
    };
    const double h = 1e-6, depth = 0.03;
    const double slope = (self_collision::stored(p, at(depth + h, 0)) -
                          self_collision::stored(p, at(depth - h, 0))) /
                         (2 * h);
    CHECK(self_collision::meet(p, at(depth, 0)) == doctest::Approx(slope).epsilon(1e-9));
    const double c = 2 * 0.1 * std::sqrt(2e3 * 0.05);
    CHECK(self_collision::meet(p, at(depth, -2.0)) == doctest::Approx(2e3 * depth + 2 * c));
    CHECK(self_collision::meet(p, at(depth, 100.0)) == 0.0);
    CHECK(self_collision::meet(p, at(-1e-9, -100.0)) == 0.0);
}

TEST_CASE("the energy balance holds while parts collide") {
    stage body = hairpin(5, true);
    body.setup.options.record[LIMAX_TRACE_LEDGER] = 100;
    const auto simulation = body.open();
    clap(*simulation, body, 3.0);
    stage::finish(*simulation);
    const energy_balance balance = balance_of(*simulation);
    CHECK(balance.in_contacts > 0.1);
    CHECK(balance.error < 5e-3 * balance.largest);
}
