// bound_test.cpp: the automatic time step is stable and not wasteful. Steps just below and above
// the true limit are hard cases (tests/suites/hard/modes.lua); random bodies at the automatic step
// are those of tests/suites/engine/random_robots.lua.
#include <doctest/doctest.h>

#include <complex>

#include "linear_body.h"
#include "physics/bound.h"
#include "physics/time_step.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

struct stepped_body : linear_body {
    using linear_body::linear_body;

    // Largest growth per step, from the eigenvalues of the step as a linear map of (x, u, a).
    double growth(limax_integrator integrator, double dt) const {
        const long n = stiffness.rows();
        const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n),
                              none = Eigen::MatrixXd::Zero(n, n);
        Eigen::MatrixXd step;
        if (integrator == LIMAX_SYMPLECTIC_EULER) {
            step.resize(2 * n, 2 * n);
            const Eigen::MatrixXd kick = one - dt * damping;
            step << one - dt * dt * stiffness, dt * kick, -dt * stiffness, kick;
        } else if (integrator == LIMAX_RK4) {
            // of (x, v)' = (v, -K x - C v)
            Eigen::MatrixXd slope(2 * n, 2 * n);
            slope << none, dt * one, -dt * stiffness, -dt * damping;
            const Eigen::MatrixXd twice = slope * slope,
                                  unchanged = Eigen::MatrixXd::Identity(2 * n, 2 * n);
            step = unchanged + slope + twice / 2 + twice * slope / 6 + twice * twice / 24;
        } else {
            // a' = -K x - C (u + a dt / 2), u' = u + dt a', x' = x + dt u'
            step.resize(3 * n, 3 * n);
            const Eigen::MatrixXd on_x = -stiffness, on_u = -damping, on_a = -0.5 * dt * damping;
            step << one + dt * dt * on_x, dt * one + dt * dt * on_u, dt * dt * on_a, dt * on_x,
                one + dt * on_u, dt * on_a, on_x, on_u, on_a;
        }
        return step.eigenvalues().cwiseAbs().maxCoeff();
    }

    // The largest stable step, by bisection between one that is and one that is not. Rigid motion
    // has |z| = 1.
    double limit(limax_integrator integrator, double stable) const {
        double low = stable, high = 8 * stable;
        for (int i = 0; i < 14; ++i) {
            const double middle = std::sqrt(low * high);
            (growth(integrator, middle) > 1 + 1e-6 ? high : low) = middle;
        }
        return low;
    }
};

constexpr double pi = 3.14159265358979323846;

const limax_integrator integrators[] = {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG};
const limax_integrator every_integrator[] = {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG, LIMAX_RK4};

double bound_of(const stage& scene, limax_integrator integrator,
                limax_bound kind = LIMAX_BOUND_SPRINGS) {
    return time_step_bound(scene.body(), scene.setup.scene, integrator, kind);
}

}  // namespace

TEST_CASE("the closed form of one mass is the limit that Jury's conditions give") {
    // x'' = -w^2 x - gamma x', stepped until it grows or not, on both sides of the formula
    for (const limax_integrator integrator : integrators)
        for (const double w : {100.0, 1000.0})
            for (const double gamma : {0.0, 0.1 * w, 0.5 * w, 2.0 * w}) {
                const double limit = stable_step(scheme(integrator), w * w, gamma);
                for (const double share : {0.995, 1.005}) {
                    const double dt = share * limit;
                    double x = 1, u = 0, p = 0;
                    for (int i = 0; i < 20000 && std::fabs(x) < 1e6; ++i) {
                        const double next = u + dt * (-w * w * x - gamma * p);
                        p = integrator == LIMAX_LEAPFROG ? next + 0.5 * (next - u) : next;
                        u = next;
                        x += dt * u;
                    }
                    CAPTURE(int(integrator));
                    CAPTURE(gamma / w);
                    CHECK((std::fabs(x) < 100) == (share < 1));
                }
            }
}

TEST_CASE("the closed form of RK4 is the largest half disc in which no mode grows") {
    const auto growth = [](std::complex<double> z) {
        return std::abs(1.0 + z + z * z / 2.0 + z * z * z / 6.0 + z * z * z * z / 24.0);
    };
    CHECK(stable_step(scheme::rk4, 1e4, 50) == doctest::Approx(rk4_radius / 100));
    CHECK(stable_step(scheme::rk4, 1e4, 400) == doctest::Approx(rk4_radius / 400));
    CHECK(stable_step(scheme::rk4, 0, 0) == HUGE_VAL);
    // the roots of modes with w^2 <= A and gamma <= B, on and off the edge of what A and B allow
    double most = 0, beyond = 0;
    for (int i = 0; i <= 400; ++i)
        for (int k = 1; k <= 20; ++k) {
            const double w = 0.05 * k * rk4_radius, gamma = i / 400.0 * rk4_radius;
            const std::complex<double> root =
                std::sqrt(std::complex<double>(gamma * gamma / 4 - w * w));
            most = std::max({most, growth(-gamma / 2 + root), growth(-gamma / 2 - root)});
            const double angle = pi / 2 * (1 + i / 400.0);
            beyond = std::max(beyond, growth(std::polar(1.001 * rk4_radius, angle)));
        }
    CHECK(most <= 1);
    CHECK(beyond > 1);
}

TEST_CASE(
    "the bound is at least 0.30 of the bisected limit, 0.35 for symplectic Euler, and never above "
    "it") {
    for (const limax_integrator integrator : every_integrator)
        for (int which = 0; which < 5; ++which) {
            const bool ground = which != 1, damped = which != 2;
            stage body(which == 4 ? lattice{3, 2, 2} : lattice{2, 2, 2});
            if (which >= 3) body.randomize(40 + which, which == 4);
            if (damped) body.effects({"damping"});
            if (ground) body.effects({"ground"});
            const double bound = bound_of(body, integrator);
            const double limit = stepped_body(body, damped, ground).limit(integrator, 0.9 * bound);
            CAPTURE(int(integrator));
            CAPTURE(which);
            MESSAGE("bound / limit = " << bound / limit);
            CHECK(bound <= limit * 1.001);
            if (ground)
                CHECK(bound >= (integrator == LIMAX_SYMPLECTIC_EULER ? 0.35 : 0.30) * limit);
            CHECK(bound >= 0.29 * limit);
        }
}

TEST_CASE("bounded by voxels, a step is longer and stable, in every pose") {
    for (uint32_t seed = 1; seed <= 60; ++seed) {
        CAPTURE(seed);
        stage body(seed % 2 ? lattice{3, 2, 2} : lattice{2, 2, 2});
        body.randomize(seed, seed % 3 == 0);
        body.setup.options.sharing = seed % 5 ? LIMAX_SHARING_MEAN : LIMAX_SHARING_SUM;
        // soft and stiff, light and heavy, damped and not
        draws draw{seed};
        for (limax_material& material : body.setup.materials) {
            material.stiffness *= std::exp(3 * draw());
            material.mass_per_site *= std::exp(draw());
            material.damping_ratio = std::max(0.0, draw());
        }
        // x.K x <= sum of k |x_i - x_j|^2 in every pose: w^2 is at most the largest eigenvalue of
        // that sum, whose matrix has the traces of the blocks of K; for leapfrog without damping
        // dt = 2 / w
        const linear_body at_rest(body, false, false);
        const long n = at_rest.stiffness.rows() / 3;
        Eigen::MatrixXd sum(n, n);
        for (long i = 0; i < n; ++i)
            for (long j = 0; j < n; ++j)
                sum(i, j) = at_rest.stiffness.block<3, 3>(3 * i, 3 * j).trace();
        const double most = sum.eigenvalues().real().maxCoeff();
        const double plain = bound_of(body, LIMAX_LEAPFROG);
        const double longer = bound_of(body, LIMAX_LEAPFROG, LIMAX_BOUND_VOXELS);
        CHECK(longer > 1.05 * plain);
        CHECK(longer <= 2 / std::sqrt(most));
        // with damping and ground, about rest
        body.effects({"damping", "ground"});
        // a kernel leaves the least time infinite where it is not read
        const spring_body springs = body.body();
        const spring_constants unread{springs.stiffness.data(), springs.damping.data(),
                                      springs.count, false, HUGE_VAL};
        const int32_t site = springs.sites[0];
        CHECK(stable_step_of_mass(body.setup.scene, scheme::leapfrog, springs.grid, unread, site,
                                  springs.mass[site]) < HUGE_VAL);
        for (const limax_integrator integrator : integrators) {
            const double bound = bound_of(body, integrator, LIMAX_BOUND_VOXELS);
            CHECK(bound >= bound_of(body, integrator));
            if (seed <= 12)
                CHECK(stepped_body(body, true, true).growth(integrator, bound) <= 1 + 1e-6);
        }
    }
}

TEST_CASE("a held mass does not limit the time step, its neighbours do") {
    const auto bound = [](double height, bool anchored) {
        stage body(lattice{2, 2, 4});
        body.effects({"damping"});
        if (anchored) body.effects({"anchors"}).set("anchors", "to", {1e6, 1e6, height});
        // the lowest voxels are the stiffest
        for (int i = 0; i < 4 * 3; ++i) body.setup.voxels[4 + i] = 3;
        return bound_of(body, LIMAX_LEAPFROG);
    };
    const double free = bound(0, false);
    CHECK(bound(-1, true) == free);
    // half of the stiff layer is held, then all of it
    CHECK(bound(0, true) == free);
    CHECK(bound(0.1, true) > free);
    CHECK(std::isinf(bound(10, true)));
}

constexpr lattice five{5, 5, 5};

TEST_CASE(
    "steps fall on samples, and a fixed step that does not is refused with the nearest that does") {
    limax_simulation_options options = default_options();
    options.record[LIMAX_TRACE_CENTER_OF_MASS] = 50;
    options.record[LIMAX_TRACE_CONTACT] = 20;
    options.settle = 0.503;
    options.duration = 1.0;
    const schedule plan = make_schedule(options, scene(), five, 3.3e-4);
    CHECK(plan.time_step <= 0.9 * 3.3e-4);
    CHECK(plan.time_step * double(plan.every[LIMAX_TRACE_CENTER_OF_MASS]) ==
          doctest::Approx(0.02).epsilon(1e-12));
    CHECK(plan.settle_steps * plan.time_step >= 0.503);
    CHECK((plan.settle_steps - 1) * plan.time_step < 0.503);
    CHECK(plan.samples[LIMAX_TRACE_CENTER_OF_MASS] == 51);
    CHECK(plan.samples[LIMAX_TRACE_CONTACT] == 21);
    options.time_step = 1e-5;
    CHECK(make_schedule(options, scene(), five, 1).time_step ==
          doctest::Approx(1e-5).epsilon(1e-15));
    options.time_step = 3e-4;
    CHECK_THROWS_WITH_AS(make_schedule(options, scene(), five, 1),
                         "time_step is 0.0003 s, which does not divide the sample interval of 0.01 "
                         "s; the nearest that "
                         "does is 0.000303030303 s",
                         error);
}

TEST_CASE("an automatic step is not coarse at the speeds of the start and of the drop") {
    limax_simulation_options options = default_options();
    const double down = 9.81;
    // ground 2 m below, with tilted gravity, two planes, and terrain that is lowest below the body
    scene falling;
    falling.add("gravity");
    scene drop = falling, box = falling, hill = falling;
    const double ground = 18, planes[] = {18, 19}, tilted[3] = {down * 0.6, 0, -down * 0.8};
    drop.add("ground");
    drop.set("ground", "height", &ground, 1);
    scene slope = drop;
    slope.set("gravity", "acceleration", tilted, 3);
    for (const double& offset : planes) {
        box.add("planes");
        box.set("planes", "offset", &offset, 1);
    }
    const double rising[4] = {17, 17, 21, 21}, spacing = 4;
    hill.add("terrain");
    hill.set_heights("terrain", "heights", rising, 2, 2);
    hill.set("terrain", "spacing", &spacing, 1);
    // a body of 0.5 m falls on a box under its edge, 1 m below it, and misses one beside it
    scene onto_box = falling, beside_box = drop, onto_sphere = falling;
    const auto add_box = [](scene& to, double x) {
        const double from[3] = {x, -1, 0}, upto[3] = {x + 1, 1, 19};
        to.add("boxes");
        to.set("boxes", "from", from, 3);
        to.set("boxes", "to", upto, 3);
    };
    add_box(onto_box, 1.4);
    add_box(beside_box, 1.6);
    const double center[3] = {1, 0, 18}, radius = 1;
    onto_sphere.add("spheres");
    onto_sphere.set("spheres", "center", center, 3);
    onto_sphere.set("spheres", "radius", &radius, 1);
    struct start {
        const scene& where;
        double height, across, up;  // m, m/s
        double speed;               // m/s, the fastest
    };
    for (const start& each : {start{falling, 20, 0, 0, 0},
                              {drop, 20, 0, 0, std::sqrt(2 * down * 2)},
                              {slope, 20, 0, 0, std::sqrt(2 * down * 2 / 0.8)},
                              {box, 20, 0, 0, std::sqrt(2 * down * 1)},
                              {hill, 20, 0, 0, std::sqrt(2 * down * 2)},
                              {onto_box, 20, 0, 0, std::sqrt(2 * down * 1)},
                              {beside_box, 20, 0, 0, std::sqrt(2 * down * 2)},
                              {onto_sphere, 20, 0, 0, std::sqrt(2 * down * 1)},
                              // the drop adds to the throw
                              {falling, 20, 3, 4, 5},
                              {drop, 20, 3, 4, std::sqrt(25 + 4 * down)},
                              // a run of 1 s does not fall for 1 km
                              {drop, 1018, 0, 0, down},
                              // pressed into the ground nothing falls
                              {drop, 17, 0, 0, 0}}) {
        options.position[0] = 1;
        options.position[2] = each.height;
        options.velocity[0] = each.across;
        options.velocity[2] = each.up;
        CAPTURE(each.speed);
        const double cap = accuracy_cap(options, each.where, five);
        if (each.speed == 0)
            CHECK(cap == HUGE_VAL);
        else
            CHECK(cap == doctest::Approx(0.01 / each.speed));
    }
    options.position[2] = 18;
    options.velocity[0] = 100;
    CHECK(make_schedule(options, drop, five, 3.3e-4).time_step == doctest::Approx(1e-4));
    options.time_step = 2e-4;
    CHECK(make_schedule(options, drop, five, 3.3e-4).time_step == doctest::Approx(2e-4));
}
