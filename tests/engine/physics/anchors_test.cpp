// anchors_test.cpp: the step and the refusals of masses that a scene holds. That they stay where
// they are is a hard case (tests/suites/hard/effects.lua). SI units.
#include <doctest/doctest.h>

#include "failure.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

TEST_CASE("a held mass does not limit the time step, its neighbours do") {
    const auto bound = [](double height, bool anchored) {
        stage body(lattice{2, 2, 4});
        body.effects({"damping"});
        if (anchored) body.effects({"anchors"}).set("anchors", "to", {1e6, 1e6, height});
        // the lowest voxels are the stiffest
        for (int i = 0; i < 4 * 3; ++i) body.setup.voxels[4 + i] = 3;
        return time_step_bound(body.body(), body.setup.scene, LIMAX_LEAPFROG);
    };
    const double free = bound(0, false);
    CHECK(bound(-1, true) == free);
    // half of the stiff layer is held, then all of it
    CHECK(bound(0, true) == free);
    CHECK(bound(0.1, true) > free);
    CHECK(std::isinf(bound(10, true)));
}

TEST_CASE("anchors that hold no mass change no bit, and invalid ones are refused") {
    const auto end = [](bool anchored) {
        stage body(lattice{2, 2, 2});
        body.randomize(2).effects({"gravity", "ground", "friction", "damping", "actuation"});
        if (anchored) body.effects({"anchors"}).set("anchors", "to", {1e6, 1e6, -1});
        return state_of(*body.run());
    };
    CHECK(end(true).positions == end(false).positions);
    scene wrong;
    wrong.add("anchors");
    const double low[3] = {0, 0, -2}, high[3] = {0, 0, -1};
    wrong.set("anchors", "from", high, 3);
    wrong.set("anchors", "to", low, 3);
    CHECK(refused([&] { wrong.check(); }) ==
          "scene.anchors: no component of 'from' may be above that of 'to'");
}
