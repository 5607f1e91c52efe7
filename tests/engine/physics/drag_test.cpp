// drag_test.cpp: drag on exposed faces and wind: closed forms of falling, and safety at any speed.
// SI units.
#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "physics/effects/drag.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr double g = 9.81;  // m/s^2

// Mean velocity of all masses, which all have the same mass here.
std::array<double, 3> mean_velocity(simulation& run) {
    const snapshot now = state_of(run);
    std::array<double, 3> mean{};
    for (std::size_t i = 0; i < now.velocities.size(); ++i)
        mean[i % 3] += 3 * now.velocities[i] / double(now.velocities.size());
    return mean;
}

}  // namespace

TEST_CASE("a face takes at most half of the momentum along its normal, at up to 1e4 m/s") {
    draws draw{7};
    using effects::drag;
    const double values[5] = {1000, 1, 0, 0, 0}, origin[3] = {0, 0, 0};
    const auto params = drag::make<double>(values, origin);
    int capped = 0, free = 0;
    for (int i = 0; i < 10000; ++i) {
        const double speed = std::pow(10.0, 4 * draw());
        effects::face_state<double> face{};
        face.area = {0.01 * draw(), 0.01 * draw(), 0.01 * draw()};
        face.velocity = {speed * draw(), speed * draw(), speed * draw()};
        // a kick may have turned it around
        face.after = {speed * draw(), speed * draw(), speed * draw()};
        face.mass = 0.1;
        const double h = 1e-4;
        const double area = std::sqrt(effects::dot(face.area, face.area));
        const double after = effects::dot(face.after, face.area) / area;
        const double along = effects::dot(drag::face(params, face, h), face.area) / area;
        const double most = 0.5 * face.mass * after;
        CHECK(along * after <= 0);
        REQUIRE(std::fabs(along) <= std::fabs(most) * (1 + 1e-9));
        const bool whole = std::fabs(along) < 0.99 * std::fabs(most);
        (whole ? free : capped) += along != 0;
        if (!whole || along == 0) continue;
        const double before = effects::dot(face.velocity, face.area) / area;
        CHECK(along == doctest::Approx(-500.0 * area * std::fabs(before) * before * h));
    }
    CHECK(capped > 500);
    CHECK(free > 500);
}

TEST_CASE("a cube falls in water at sqrt(m g / (rho C A)), with drag on both faces") {
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
            stage body(lattice{1, 1, 1});
            body.effects({"gravity", "drag", "damping"});
            body.set("drag", "density", {800}).set("drag", "coefficient", {0.5});
            body.set("drag", "current", {0.5, 0, 0.25});
            body.setup.options.precision = precision;
            body.setup.options.integrator = integrator;
            body.setup.options.time_step = 2e-4;
            body.setup.options.duration = 3;
            const auto run = body.run();
            REQUIRE(run->outcomes()[0].status == LIMAX_ROBOT_DONE);
            const auto now = mean_velocity(*run);
            // the pressure widens the cube by less than a thousandth
            CHECK(now[2] ==
                  doctest::Approx(0.25 - std::sqrt(0.8 * g / (800 * 0.5 * 0.01))).epsilon(1e-3));
            // the current takes it along, ever more slowly: 1 / (rho C A t / m + 1 / v) is left
            CHECK(now[0] ==
                  doctest::Approx(0.5 - 1 / (800 * 0.5 * 0.01 / 0.8 * 3 + 1 / 0.5)).epsilon(1e-3));
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
            // every mass is 0.1 kg, rounded once: after 30 times m / c the start is forgotten
            const double expected[3] = {2, -1, 0.5 - double(0.1f) * g};
            const auto now = mean_velocity(*body.run());
            for (int axis = 0; axis < 3; ++axis)
                CHECK(std::fabs(now[axis] - expected[axis]) <
                      (precision == LIMAX_DOUBLE ? 1e-11 : 2e-5));
        }
}
