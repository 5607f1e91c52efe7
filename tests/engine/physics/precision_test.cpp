// precision_test.cpp: compensated and mixed precision stay close to double; steady fall in wind. SI
// units.
#include <doctest/doctest.h>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr double g = 9.81;  // m/s^2

}  // namespace

TEST_CASE("compensated and mixed precision stay close to double where single drifts") {
    for (const double time_step : {1e-4, 1e-5}) {
        snapshot end[4];
        for (const int precision : every_precision) {
            stage body(lattice{3, 3, 3});
            body.randomize(21);
            body.effects({"damping", "actuation"});
            body.setup.options.precision = precision;
            body.setup.options.time_step = time_step;
            auto run = body.open();
            bend(*run, 0.01, 0.5);
            stage::finish(*run);
            end[precision] = state_of(*run);
        }
        const auto apart = [&](int precision) {
            double most = 0;
            for (std::size_t i = 0; i < end[precision].positions.size(); ++i)
                most = std::max(
                    most, std::fabs(end[precision].positions[i] - end[LIMAX_DOUBLE].positions[i]));
            return most;
        };
        CAPTURE(time_step);
        // springs in fp32 err by 2^-24 of a length of 0.1 m, and not in one direction
        CHECK(apart(LIMAX_MIXED) > 0);
        CHECK(apart(LIMAX_MIXED) < 1e-7);
        CHECK(apart(LIMAX_COMPENSATED) < 1e-7);
        // every step rounds a position of 0.3 m once more: the shorter the step, the more it drifts
        const double drift = time_step > 5e-5 ? 3 : 100;
        CHECK(apart(LIMAX_SINGLE) > drift * apart(LIMAX_MIXED));
    }
}

TEST_CASE("a body in wind falls steadily at the air's velocity plus m g / c") {
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
            stage body(lattice{1, 1, 1});
            body.effects({"gravity", "wind"});
            body.set("wind", "velocity", {2, -1, 0.5}).set("wind", "drag", {1});
            body.setup.options.precision = precision;
            body.setup.options.integrator = integrator;
            body.setup.options.time_step = 1e-3;
            body.setup.options.duration = 3;
            const auto run = body.run();
            const snapshot state = state_of(*run);
            // every mass is 0.1 kg, rounded once: after 30 times m / c the start is forgotten
            const double expected[3] = {2, -1, 0.5 - double(0.1f) * g};
            // of all masses together: what springs do to each other is not in it
            double mean[3] = {};
            for (std::size_t i = 0; i < state.velocities.size(); ++i)
                mean[i % 3] += state.velocities[i] / 8;
            for (int axis = 0; axis < 3; ++axis)
                CHECK(std::fabs(mean[axis] - expected[axis]) <
                      (precision == LIMAX_DOUBLE ? 1e-11 : 2e-5));
        }
}
