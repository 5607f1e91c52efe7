// laws_test.cpp: properties of the physics that hold for every body: forces are the gradient of the
// energy, internal forces sum to zero, and motion does not depend on place, speed or orientation.
// The bodies are random. That passive scenes never gain energy is checked in every hard case. SI
// units.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

using point = std::array<double, 3>;

point at(const std::vector<double>& values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}
point cross(const point& a, const point& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double length(const point& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

// Moves every mass by up to `size` m and gives it up to `speed` m/s, as a function of its index.
void disturb(snapshot& state, double size, double speed) {
    for (std::size_t i = 0; i < state.positions.size(); ++i) {
        state.positions[i] += size * std::sin(12.9898 * double(i + 1));
        state.velocities[i] += speed * std::sin(78.233 * double(i + 1));
    }
}

// The largest difference of two lists.
double apart(const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
    return most;
}

// Where a body ends that starts in `start`.
snapshot ends(const stage& body, const snapshot& start) {
    auto run = body.open();
    run->place(0, start.positions.data(), start.velocities.data());
    stage::finish(*run);
    REQUIRE(run->outcomes()[0].status == LIMAX_ROBOT_DONE);
    return state_of(*run);
}

}  // namespace

TEST_CASE("each force is -dE/dx, separately and combined, in random bodies") {
    // Energies are read at t = 0, forces from the first step of symplectic Euler from rest. A
    // central difference of d errs by d^2 E''' / 6 and rounds by 1e-16 E / d.
    const double d = 1e-6, dt = 1e-6;
    const std::vector<std::vector<std::string>> scenes = {{},
                                                          {"gravity"},
                                                          {"ground"},
                                                          {"actuation"},
                                                          {"damping"},
                                                          {"planes"},
                                                          {"gravity", "ground", "actuation"}};
    uint32_t seed = 0;
    for (const auto& names : scenes)
        for (const int sharing : {LIMAX_SHARING_MEAN, LIMAX_SHARING_SUM}) {
            stage body(lattice{2, 2, 1});
            body.randomize(++seed, true);
            body.setup.voxels[0] = 1;  // never empty
            body.effects(names);
            if (!names.empty() && names.back() == "actuation") body.set("actuation", "ramp", {0});
            body.setup.options.sharing = sharing;
            body.setup.options.integrator = LIMAX_SYMPLECTIC_EULER;
            body.setup.options.time_step = dt;
            body.setup.options.duration = 0.05;
            body.setup.options.record[LIMAX_TRACE_ENERGY] = 20;
            body.setup.options.position[2] = -0.05;
            snapshot base = state_of(*body.open());
            disturb(base, 0.02, 0);
            const auto energy_at = [&](const std::vector<double>& positions) {
                auto run = body.open();
                run->place(0, positions.data(), nullptr);
                run->advance(1, 1);
                const trace_view energy = trace_of(*run, 0, LIMAX_TRACE_ENERGY);
                return energy.at(0, 1) + energy.at(0, 2);
            };
            auto run = body.open();
            run->place(0, base.positions.data(), nullptr);
            run->advance(1, 1);
            const snapshot after = state_of(*run);
            const spring_body masses = body.body();
            double largest = 0, worst = 0;
            for (std::size_t i = 0; i < base.positions.size(); ++i) {
                std::vector<double> ahead = base.positions, behind = base.positions;
                ahead[i] += d;
                behind[i] -= d;
                const double slope = (energy_at(ahead) - energy_at(behind)) / (2 * d);
                const double force = masses.mass[masses.sites[i / 3]] *
                                     (after.positions[i] - base.positions[i]) / (dt * dt);
                largest = std::max(largest, std::fabs(force));
                worst = std::max(worst, std::fabs(force + slope));
            }
            CAPTURE(seed);
            CHECK(largest > 1.0);  // N: the test would see a missing law
            CHECK(worst < 1e-4 * largest);
        }
}

TEST_CASE("internal forces sum to zero force and zero torque") {
    for (uint32_t seed = 1; seed <= 8; ++seed) {
        const double dt = 1e-6;
        stage body(lattice{3, 2, 2});
        body.randomize(seed, seed % 2 == 0);
        body.setup.voxels[0] = 1;
        body.effects({"damping", "actuation"}).set("actuation", "ramp", {0});
        body.setup.options.integrator = LIMAX_SYMPLECTIC_EULER;
        body.setup.options.time_step = dt;
        auto run = body.open();
        snapshot start = state_of(*run);
        disturb(start, 0.03, 1.0);
        run->place(0, start.positions.data(), start.velocities.data());
        run->advance(1, 1);
        const snapshot after = state_of(*run);
        const spring_body masses = body.body();
        point force{}, torque{};
        double forces = 0, torques = 0;
        for (std::size_t i = 0; i < std::size_t(masses.masses); ++i) {
            const double mass = masses.mass[masses.sites[i]];
            const point x = at(start.positions, i);
            point f;
            // the drift's velocity: what the step moved over its length
            for (int axis = 0; axis < 3; ++axis)
                f[axis] = mass *
                          ((after.positions[3 * i + axis] - start.positions[3 * i + axis]) / dt -
                           start.velocities[3 * i + axis]) /
                          dt;
            const point t = cross(x, f);
            for (int axis = 0; axis < 3; ++axis) {
                force[axis] += f[axis];
                torque[axis] += t[axis];
            }
            forces += length(f);
            torques += length(t);
        }
        CAPTURE(seed);
        CHECK(forces > 100.0);
        // a place of 0.3 m is rounded to 5e-17 m; over dt^2 that is 5e-5 m/s^2 of 0.1 kg a mass
        CHECK(length(force) < 1e-6 * forces);
        CHECK(length(torque) < 1e-6 * torques);
    }
}

TEST_CASE("motion does not depend on place, speed or orientation") {
    for (uint32_t seed = 1; seed <= 4; ++seed) {
        stage body(lattice{3, 2, 2});
        body.randomize(seed);
        body.effects({"damping", "actuation"});
        body.setup.options.duration = 0.5;
        snapshot start = state_of(*body.open());
        disturb(start, 0.005, 0.2);
        const snapshot expected = ends(body, start);
        CAPTURE(seed);

        // elsewhere, by no whole number of metres: 3000 m are kept to 5e-13 m
        const point shift = {17.3, -3001.7, 0.123}, boost = {3.1, -0.7, 11.3};
        snapshot moved = start;
        for (std::size_t i = 0; i < moved.positions.size(); ++i) {
            moved.positions[i] += shift[i % 3];
            moved.velocities[i] += boost[i % 3];
        }
        snapshot end = ends(body, moved);
        for (std::size_t i = 0; i < end.positions.size(); ++i) {
            end.positions[i] -= shift[i % 3] + 0.5 * boost[i % 3];
            end.velocities[i] -= boost[i % 3];
        }
        CHECK(apart(end.positions, expected.positions) < 1e-9);
        CHECK(apart(end.velocities, expected.velocities) < 1e-7);

        // turned about (1, 2, 3) by 1 rad, by Rodrigues' formula
        const double norm = std::sqrt(14.0), cosine = std::cos(1.0), sine = std::sin(1.0);
        const point axis = {1 / norm, 2 / norm, 3 / norm};
        const auto turn = [&](std::vector<double>& values) {
            for (std::size_t i = 0; i < values.size() / 3; ++i) {
                const point v = at(values, i), w = cross(axis, v);
                const double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
                for (int k = 0; k < 3; ++k)
                    values[3 * i + k] =
                        cosine * v[k] + sine * w[k] + (1 - cosine) * along * axis[k];
            }
        };
        snapshot turned = start, goal = expected;
        turn(turned.positions);
        turn(turned.velocities);
        turn(goal.positions);
        turn(goal.velocities);
        end = ends(body, turned);
        CHECK(apart(end.positions, goal.positions) < 1e-9);
        CHECK(apart(end.velocities, goal.velocities) < 1e-7);
    }
}
