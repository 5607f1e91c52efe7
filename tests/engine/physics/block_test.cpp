// block_test.cpp: closed forms of a rigid block that turns, slides, sticks and is pushed.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "physics/effects/all.h"
#include "physics/solid.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

using effects::vector;

// A block at one moment.
struct block_state {
    vector<double> place;  // m
    quaternion points;
    vector<double> velocity, turning;  // m/s, rad/s
};
block_state block_of(simulation& simulation, int which = 0) {
    double s[LIMAX_BLOCK_STATE];
    simulation.block(0, which, s);
    return {
        {s[0], s[1], s[2]}, {s[3], s[4], s[5], s[6]}, {s[7], s[8], s[9]}, {s[10], s[11], s[12]}};
}

// A block with one voxel far away from it.
stage only_block(const std::vector<std::string>& names) {
    stage world({1, 1, 1});
    world.effects(names).effects({"block"});
    world.set("block", "position", {50, 0, 0});
    return world;
}

double length(const vector<double>& v) { return std::sqrt(effects::dot(v, v)); }

// The angular momentum of a block about its centre, kg m^2/s.
vector<double> turning_of(const block_state& block, const vector<double>& inertia) {
    const rotation frame = rotation_of(block.points);
    const vector<double> own = to_solid(frame, block.turning);
    return to_world(frame, {inertia.x * own.x, inertia.y * own.y, inertia.z * own.z});
}

}  // namespace

TEST_CASE("forces between a body and blocks conserve momentum and angular momentum") {
    for (const int precision : every_precision) {
        stage world({3, 2, 2}, 1, 3);
        world.effects({"damping", "block"}).set("block", "position", {0.4, 0.05, 0.05});
        world.set("block", "size", {0.2, 0.3, 0.4}).set("block", "spin", {0.5, -1, 2});
        // in the way of the first, and of the body a little later
        world.effects({"block"}).set("block", "position", {0.61, -0.1, 0.1});
        world.set("block", "size", {0.3, 0.4, 0.2}).set("block", "mass", {0.7});
        world.setup.options.precision = precision;
        world.setup.options.velocity[0] = 2.0;
        const auto simulation = world.open();
        const spring_body body = world.body();
        const auto momenta = [&](vector<double>& linear, vector<double>& angular) {
            const snapshot now = state_of(*simulation);
            linear = angular = {0, 0, 0};
            for (int32_t i = 0; i < body.masses; ++i) {
                const double m = body.mass[body.sites[i]];
                const double *x = now.positions.data() + 3 * i, *v = now.velocities.data() + 3 * i;
                linear = plus(linear, m, {v[0], v[1], v[2]});
                angular = plus(angular, m, cross({x[0], x[1], x[2]}, {v[0], v[1], v[2]}));
            }
            for (const int which : {0, 1}) {
                const auto law = effects::block::make<double>(
                    world.setup.scene.values(effects::index_of<effects::block>, which), nullptr);
                const block_state block = block_of(*simulation, which);
                linear = plus(linear, law.mass, block.velocity);
                angular = plus(angular, law.mass, cross(block.place, block.velocity));
                angular = plus(angular, 1.0, turning_of(block, inertia_of_box(law.half, law.mass)));
            }
        };
        vector<double> linear, angular, linear_end, angular_end;
        momenta(linear, angular);
        stage::finish(*simulation);
        REQUIRE(simulation->outcomes()[0].status == LIMAX_ROBOT_DONE);
        momenta(linear_end, angular_end);
        CHECK(block_of(*simulation, 0).velocity.x > 0.2);  // they were hit
        CHECK(block_of(*simulation, 1).velocity.x > 0.2);
        // single precision rounds the masses' velocities at every step, the others their springs
        const double most = precision == LIMAX_SINGLE   ? 2e-5
                            : precision == LIMAX_DOUBLE ? 1e-12
                                                        : 2e-7;
        CHECK(length(plus(linear_end, -1, linear)) < most);
        CHECK(length(plus(angular_end, -1, angular)) < most);
    }
}

TEST_CASE("a free block conserves angular momentum, and energy to second order") {
    double off[2];
    for (const bool half : {false, true}) {
        stage world = only_block({});
        world.set("block", "size", {0.2, 0.4, 0.6}).set("block", "spin", {0.02, 6, -0.03});
        world.setup.options.time_step = half ? 5e-4 : 1e-3;
        world.setup.options.duration = 50;  // 1e5 steps of the shorter
        const auto simulation = world.open();
        const vector<double> inertia = inertia_of_box({0.1, 0.2, 0.3}, 1.0);
        const block_state start = block_of(*simulation);
        const vector<double> first = turning_of(start, inertia);
        double worst = 0, least = 1;
        off[half] = 0;
        while (!simulation->advance(1.0, 50).finished) {
            const block_state now = block_of(*simulation);
            const vector<double> momentum = turning_of(now, inertia);
            worst = std::max(worst, length(plus(momentum, -1, first)));
            const double energy = effects::dot(momentum, now.turning);
            off[half] =
                std::max(off[half], std::abs(energy / effects::dot(first, start.turning) - 1));
            least = std::min(least, rotation_of(now.points).y.y);
        }
        CHECK(worst < 1e-9 * length(first));
        CHECK(off[half] < 1e-4);
        CHECK(least < -0.9);  // about its middle axis it turns over
    }
    CHECK(off[0] / off[1] == doctest::Approx(4).epsilon(0.05));
}

TEST_CASE("a sliding block stops after v^2 / (2 mu_k g) and stays there, whatever mu_s is") {
    for (const int integrator : {LIMAX_LEAPFROG, LIMAX_SYMPLECTIC_EULER})
        for (const double step : {2e-4, 5e-5})
            for (const double held : {0.6, 1.0, 3.0}) {
                stage world = only_block({"gravity", "ground", "friction"});
                world.set("block", "size", {0.4, 0.4, 0.05}).set("block", "velocity", {2, 1, 0});
                world.set("friction", "static", {held}).set("friction", "kinetic", {0.6});
                // so deep that it neither falls nor rises
                world.set("block", "position", {50, 0, -9.81 / (4 * 1e5)});
                world.setup.options.integrator = integrator;
                world.setup.options.time_step = step;
                world.setup.options.duration = 2.0;
                const auto simulation = world.run();
                const limax_outcome& outcome = simulation->outcomes()[0];
                const auto from = [&](const double* place) {
                    return std::hypot(outcome.block_end[0] - place[0],
                                      outcome.block_end[1] - place[1]);
                };
                // symplectic Euler moves with the velocity at the end of each step
                const double speed = std::sqrt(5.0);
                const double early = integrator == LIMAX_LEAPFROG ? 0 : 0.5 * speed * step;
                const double distance = speed * speed / (2 * 0.6 * 9.81) - early;
                CAPTURE(integrator);
                CAPTURE(step);
                CAPTURE(held);
                // static friction of 3 that caught it would shorten the distance by 7e-6 of it
                CHECK(from(outcome.block_start) == doctest::Approx(distance).epsilon(2e-6));
                CHECK(from(outcome.block_middle) < 1e-9);
            }
}

TEST_CASE("a block on a slope sticks or slides by its friction") {
    // mu_s = 1, mu_k = 0.6: the second sticks from rest, but not once it slides
    struct slope_case {
        double slope, speed;
    };
    for (const double step : {2e-4, 5e-5})
        for (const auto& [slope, speed] :
             {slope_case{0.3, 0}, slope_case{0.8, 0}, slope_case{0.8, 0.1}, slope_case{1.5, 0}}) {
            stage world = only_block({"gravity", "ground", "friction"});
            const double sine = std::sin(std::atan(slope)), cosine = std::cos(std::atan(slope));
            world.set("block", "size", {0.5, 0.5, 0.1});
            world.set("block", "position", {50, 0, -9.81 * cosine / (4 * 1e5)});
            world.set("block", "velocity", {speed, 0, 0});
            world.set("gravity", "acceleration", {9.81 * sine, 0, -9.81 * cosine});
            world.setup.options.time_step = step;
            world.setup.options.settle = 1.0;
            world.setup.options.duration = 2.0;
            const auto simulation = world.run();
            const limax_outcome& outcome = simulation->outcomes()[0];
            const double distance = outcome.block_end[0] - outcome.block_start[0];
            CAPTURE(step);
            CAPTURE(slope);
            CAPTURE(speed);
            if (slope < 1.0 && speed == 0) {
                // what sweeps leave, for 2 s
                CHECK(std::abs(distance) < 2 * solid::settled * 9.81 * step);
            } else {
                const double a = 9.81 * (sine - 0.6 * cosine);
                CHECK(distance ==
                      doctest::Approx(2 * speed + 0.5 * a * (3.0 * 3.0 - 1.0)).epsilon(0.02));
            }
        }
}

TEST_CASE("a start far away changes no bit of a push") {
    for (const int precision : every_precision) {
        std::vector<double> ends[2];
        for (const bool far : {false, true}) {
            stage world({3, 2, 2}, 1, 3);
            world.effects({"gravity", "ground", "friction", "damping", "block"});
            world.set("block", "position", {0.35, 0.05, 0});
            world.setup.options.precision = precision;
            world.setup.options.position[0] = far ? 1024 : 0;
            world.setup.options.velocity[0] = 3.0;
            const auto simulation = world.run();
            double state[LIMAX_BLOCK_STATE];
            simulation->block(0, 0, state);
            ends[far].assign(state + 3, state + LIMAX_BLOCK_STATE);
            const snapshot body = state_of(*simulation);
            ends[far].insert(ends[far].end(), body.velocities.begin(), body.velocities.end());
        }
        CHECK(std::memcmp(ends[0].data(), ends[1].data(), ends[0].size() * sizeof(double)) == 0);
    }
}

TEST_CASE("the automatic step is stable with a light hard block and a heavy soft one") {
    for (const auto& [mass, stiffness] : {std::pair{0.02, 1e5}, {100.0, 1e3}})
        for (const int integrator : {LIMAX_LEAPFROG, LIMAX_SYMPLECTIC_EULER}) {
            stage world({4, 4, 2}, 1, 4);
            world.effects({"gravity", "ground", "friction", "damping", "block"});
            world.set("block", "position", {0.05, 0.05, 0.2}).set("block", "mass", {mass});
            world.set("block", "size", {0.3, 0.3, 0.3});
            world.set("block", "stiffness", {stiffness});
            world.setup.options.integrator = integrator;
            world.setup.options.bound_fraction = 0.99;
            world.setup.options.duration = 3.0;
            const auto simulation = world.run();
            CAPTURE(mass);
            CAPTURE(integrator);
            REQUIRE(simulation->outcomes()[0].status == LIMAX_ROBOT_DONE);
            const block_state end = block_of(*simulation);
            // a load of 100 kg rings at 40 rad/s, where the springs' dashpots do little
            CHECK(length(end.velocity) < (mass > 10 ? 0.1 : 1e-3));
            CHECK(end.place.z > 0.1);  // above the ground, if not on it
        }
}

TEST_CASE("a block beyond the limits stops its robot as diverged") {
    stage world = only_block({});
    world.set("block", "velocity", {0, 0, 1001});
    const auto simulation = world.run();
    CHECK(simulation->outcomes()[0].status == LIMAX_ROBOT_DIVERGED);
    CHECK(simulation->outcomes()[0].reason == LIMAX_SPEED);
}
