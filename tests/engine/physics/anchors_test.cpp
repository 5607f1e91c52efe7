// anchors_test.cpp: masses that a scene holds. SI units.
#include <doctest/doctest.h>

#include "failure.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

// Which masses of a robot lie at most `height` above its lowest.
std::vector<bool> below(const snapshot& state, double height) {
    double lowest = HUGE_VAL;
    for (std::size_t i = 2; i < state.positions.size(); i += 3)
        lowest = std::min(lowest, state.positions[i]);
    std::vector<bool> found;
    for (std::size_t i = 2; i < state.positions.size(); i += 3)
        found.push_back(state.positions[i] <= lowest + height);
    return found;
}

}  // namespace

TEST_CASE("held masses stay where they start, bit for bit, and the others do not") {
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
            stage body(lattice{2, 3, 3});
            body.randomize(5);
            body.effects(
                {"anchors", "gravity", "ground", "friction", "damping", "actuation", "wind"});
            // 2 of its 3 layers of voxels, and 0.2 m is 2 edges of 0.1 m
            body.set("anchors", "to", {1e6, 1e6, 0.2});
            body.set("gravity", "acceleration", {3, 1, 5}).set("ground", "height", {0.35});
            body.setup.options.precision = precision;
            body.setup.options.integrator = integrator;
            body.setup.options.velocity[0] = 1;
            // more than 4 m away, so that the robot's own origin is not the world's
            body.setup.options.position[0] = 37;
            body.setup.options.duration = 0.5;
            const auto opened = body.open();
            const snapshot start = state_of(*opened);
            stage::finish(*opened);
            REQUIRE(opened->outcomes()[0].status == LIMAX_ROBOT_DONE);
            const snapshot end = state_of(*opened);
            const std::vector<bool> held = below(start, 0.25);
            int stayed = 0, moved = 0;
            for (std::size_t i = 0; i < held.size(); ++i)
                for (int axis = 0; axis < 3; ++axis) {
                    const bool same =
                        end.positions[3 * i + axis] == start.positions[3 * i + axis] &&
                        end.velocities[3 * i + axis] == 0;
                    CHECK(same == held[i]);
                    ++(held[i] ? stayed : moved);
                }
            CHECK(stayed > 0);
            CHECK(moved > 0);
        }
}

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
