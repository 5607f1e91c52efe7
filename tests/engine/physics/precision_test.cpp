// precision_test.cpp: what the precisions promise: compensated and mixed stay close to double, and
// a start far from the origin changes no bit. Closed forms are tested by the hard cases. SI units.
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
            snapshot start = state_of(*run);
            for (std::size_t i = 0; i < start.positions.size(); ++i) {
                start.positions[i] += 0.01 * std::sin(7.0 * double(i + 1));
                start.velocities[i] += 0.5 * std::cos(5.0 * double(i));
            }
            run->place(0, start.positions.data(), start.velocities.data());
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

TEST_CASE("the starting point changes no bit of a robot's motion") {
    for (const int precision : {LIMAX_SINGLE, LIMAX_COMPENSATED, LIMAX_MIXED}) {
        snapshot end[2];
        for (int far = 0; far < 2; ++far) {
            stage body(lattice{3, 3, 3});
            body.randomize(11);
            body.effects({"gravity", "ground", "damping", "friction", "actuation"});
            body.setup.options.precision = precision;
            body.setup.options.duration = 2;
            body.setup.options.position[0] = far ? 1024.0 : 0.0;
            body.setup.options.position[1] = far ? -2048.0 : 0.0;
            end[far] = state_of(*body.run());
        }
        CHECK(end[0].velocities == end[1].velocities);
        double apart = 0;  // what adding 1024 to a double rounds away
        for (std::size_t i = 0; i < end[0].positions.size(); ++i)
            apart = std::max(apart, std::fabs(end[1].positions[i] - end[0].positions[i] -
                                              (i % 3 == 0   ? 1024.0
                                               : i % 3 == 1 ? -2048.0
                                                            : 0.0)));
        CHECK(apart < 1e-12);
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
