// block_test.cpp: the rigid block: how it falls, turns and rests, and what it and a body do to each
// other.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "failure.h"
#include "physics/effects/all.h"
#include "physics/rigid_body.h"
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
block_state block_of(simulation& simulation, int robot = 0) {
    double s[LIMAX_BLOCK_STATE];
    simulation.block(robot, s);
    return {
        {s[0], s[1], s[2]}, {s[3], s[4], s[5], s[6]}, {s[7], s[8], s[9]}, {s[10], s[11], s[12]}};
}

// One voxel far from a block, which is alone then.
stage alone(const std::vector<std::string>& names) {
    stage world({1, 1, 1});
    world.effects(names).effects({"block"});
    world.set("block", "position", {50, 0, 0});
    return world;
}

double length(const vector<double>& v) { return std::sqrt(effects::dot(v, v)); }

}  // namespace

TEST_CASE("a block falls as a mass does") {
    for (const int integrator : {LIMAX_LEAPFROG, LIMAX_SYMPLECTIC_EULER}) {
        stage world = alone({"gravity"});
        world.set("block", "position", {50, 1, 20}).set("block", "velocity", {1, -2, 3});
        world.setup.options.integrator = integrator;
        world.setup.options.time_step = 1e-3;
        const auto simulation = world.run();
        REQUIRE(simulation->outcomes()[0].status == LIMAX_ROBOT_DONE);
        const block_state end = block_of(*simulation);
        const double t = 1.0, dt = 1e-3;
        // leapfrog is exact under a constant force; symplectic Euler's velocity is, and its place
        // is g t dt / 2 further
        const double late = integrator == LIMAX_LEAPFROG ? 0.0 : 0.5 * 9.81 * t * dt;
        CHECK(end.place.x == doctest::Approx(50.15 + t).epsilon(1e-12));
        CHECK(end.place.y == doctest::Approx(1.25 - 2 * t).epsilon(1e-12));
        CHECK(end.place.z ==
              doctest::Approx(20.15 + 3 * t - 0.5 * 9.81 * t * t - late).epsilon(1e-12));
        CHECK(end.velocity.z == doctest::Approx(3 - 9.81 * t).epsilon(1e-12));
        CHECK(end.points.w == 1.0);
        CHECK(length(end.turning) == 0.0);
    }
}

TEST_CASE("a block comes to rest at m g / (4 k) below the ground") {
    for (const int precision : every_precision) {
        stage world = alone({"gravity", "ground", "friction"});
        world.set("block", "position", {50, 0, 0.02}).set("block", "mass", {7});
        world.setup.options.precision = precision;
        world.setup.options.duration = 4.0;
        const auto simulation = world.run();
        REQUIRE(simulation->outcomes()[0].status == LIMAX_ROBOT_DONE);
        const block_state end = block_of(*simulation);
        const double depth = 0.15 - end.place.z;
        CHECK(depth == doctest::Approx(7 * 9.81 / (4 * 1e5)).epsilon(1e-6));
        CHECK(length(end.velocity) < 1e-8);
        CHECK(length(end.turning) < 1e-8);
    }
}

TEST_CASE("what a body and a block do to each other keeps their momenta") {
    for (const int precision : every_precision) {
        stage world({3, 2, 2}, 1, 3);
        world.effects({"damping", "block"}).set("block", "position", {0.4, 0.05, 0.05});
        world.set("block", "size", {0.2, 0.3, 0.4}).set("block", "spin", {0.5, -1, 2});
        world.setup.options.precision = precision;
        world.setup.options.velocity[0] = 2.0;
        const auto simulation = world.open();
        const spring_body body = world.body();
        const effects::block::params<double> law = effects::block::make<double>(
            world.setup.scene.values(effects::index_of<effects::block>), nullptr);
        const vector<double> inertia = inertia_of_box(law.half, law.mass);
        const auto momenta = [&](vector<double>& linear, vector<double>& angular) {
            const snapshot now = state_of(*simulation);
            linear = angular = {0, 0, 0};
            for (int32_t i = 0; i < body.masses; ++i) {
                const double m = body.mass[body.sites[i]];
                const double *x = now.positions.data() + 3 * i, *v = now.velocities.data() + 3 * i;
                linear = plus(linear, m, {v[0], v[1], v[2]});
                angular = plus(angular, m, cross({x[0], x[1], x[2]}, {v[0], v[1], v[2]}));
            }
            const block_state block = block_of(*simulation);
            linear = plus(linear, law.mass, block.velocity);
            const rotation frame = rotation_of(block.points);
            const vector<double> own = to_solid(frame, block.turning);
            angular = plus(angular, law.mass, cross(block.place, block.velocity));
            angular =
                plus(angular, 1.0,
                     to_world(frame, {inertia.x * own.x, inertia.y * own.y, inertia.z * own.z}));
        };
        vector<double> linear, angular, linear_end, angular_end;
        momenta(linear, angular);
        stage::finish(*simulation);
        REQUIRE(simulation->outcomes()[0].status == LIMAX_ROBOT_DONE);
        momenta(linear_end, angular_end);
        const block_state end = block_of(*simulation);
        CHECK(end.velocity.x > 0.5);  // it was hit
        // single precision rounds the masses' velocities at every step, the others their springs
        const double most = precision == LIMAX_SINGLE   ? 2e-5
                            : precision == LIMAX_DOUBLE ? 1e-12
                                                        : 1e-7;
        CHECK(length(plus(linear_end, -1, linear)) < most);
        CHECK(length(plus(angular_end, -1, angular)) < most);
    }
}
