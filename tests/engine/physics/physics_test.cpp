// physics_test.cpp: closed forms and conservation laws. Tolerances follow from the order of the
// integrator and the precision.
#include <doctest/doctest.h>

#include <Eigen/Dense>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double g = 9.81;  // m/s^2

// A robot of two masses and one spring along x: `stretch` is r - L0 at the start, both masses at
// rest.
struct oscillator {
    stage scene{lattice{1, 1, 1}};
    limax_outcome outcome{};
    std::unique_ptr<cpu::scratch> memory;
    std::unique_ptr<cpu::robot> robot;

    oscillator(double stiffness, double damping, double stretch, double time_step) {
        scene.setup.options.time_step = time_step;
        scene.setup.options.duration = 100;
        if (damping > 0) scene.effects({"damping"});
        spring_body body = scene.body();
        for (int64_t site = 2; site < 8; ++site) body.mass[site] = 0;
        for (float& k : body.stiffness) k = 0;
        for (float& c : body.damping) c = 0;
        body.stiffness[0] = static_cast<float>(stiffness);
        body.damping[0] = static_cast<float>(damping);
        body.masses = 2;
        body.springs = 1;
        body.total_mass = 2 * double(body.mass[0]);
        memory = std::make_unique<cpu::scratch>(scene.setup.grid);
        robot = cpu::make_robot(scene.setup, std::move(body), cpu::choose_passes(""), outcome);
        const double places[6] = {0, 0, 0, 0.1 + stretch, 0, 0};
        robot->place(places, nullptr);
    }
    double stretch_after_step() {
        robot->advance(*memory, cpu::deadline::max(), 1);
        double places[6];
        robot->state(*memory, places, nullptr);
        return places[3] - places[0] - 0.1;
    }
};

// Times at which a sampled, decaying oscillation crosses zero downwards, by linear interpolation.
std::vector<double> down_crossings(const std::vector<double>& samples, double interval) {
    std::vector<double> times;
    for (std::size_t i = 1; i < samples.size(); ++i)
        if (samples[i - 1] > 0 && samples[i] <= 0)
            times.push_back(interval *
                            (double(i - 1) + samples[i - 1] / (samples[i - 1] - samples[i])));
    return times;
}

}  // namespace

TEST_CASE("free fall is exact: leapfrog continuous, symplectic Euler its own sum") {
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
            stage body(lattice{2, 2, 2});
            body.effects({"gravity"});
            body.setup.options.precision = precision;
            body.setup.options.integrator = integrator;
            body.setup.options.time_step = 1e-3;
            const auto run = body.run();
            const limax_outcome& outcome = run->outcomes()[0];
            const double fallen = outcome.center_start[2] - outcome.center_end[2];
            const double n = 1000, dt = 1e-3;
            const double expected =
                integrator == LIMAX_LEAPFROG ? 0.5 * g : g * dt * dt * n * (n + 1) / 2;
            // plain fp32 rounds each of 1000 steps at a position below 8 m
            // (in mixed, springs see rounded positions, so their sums are not quite 0)
            const double tolerance = precision == LIMAX_SINGLE        ? 3e-4
                                     : precision == LIMAX_COMPENSATED ? 2e-6
                                     : precision == LIMAX_MIXED       ? 1e-9
                                                                      : 1e-12;
            CHECK(std::fabs(fallen - expected) < tolerance);
        }
}

TEST_CASE(
    "a two-mass oscillator keeps its period, and its error falls with the square of the step") {
    const double stiffness = 1000, reduced_mass = 0.05;
    const double period = 2 * pi / std::sqrt(stiffness / reduced_mass);
    double error[2];
    for (int refinement = 0; refinement < 2; ++refinement) {
        const double dt = 5e-4 / (1 << refinement);
        oscillator pair(stiffness, 0, 0.01, dt);
        std::vector<double> samples;
        samples.resize(static_cast<std::size_t>(2.0 / dt));
        for (double& sample : samples) sample = pair.stretch_after_step();
        const auto times = down_crossings(samples, dt);
        const double measured = (times.back() - times.front()) / double(times.size() - 1);
        // the leapfrog's own period, exactly
        const double discrete = pi * dt / std::asin(pi * dt / period);
        CHECK(measured == doctest::Approx(discrete).epsilon(1e-6));
        error[refinement] = period - measured;
    }
    CHECK(error[0] / error[1] == doctest::Approx(4.0).epsilon(0.02));
}

TEST_CASE("a damped oscillator decays as exp(-c t / 2 m_r)") {
    const double stiffness = 1000, reduced_mass = 0.05;
    const double damping = 2 * 0.1 * std::sqrt(stiffness * reduced_mass);
    const double dt = 1e-4, rate = damping / (2 * reduced_mass);
    oscillator pair(stiffness, damping, 0.01, dt);
    const double frequency = std::sqrt(stiffness / reduced_mass - rate * rate);
    double worst = 0;
    for (int i = 1; i <= 2000; ++i) {
        const double t = i * dt;
        const double exact = 0.01 * std::exp(-rate * t) *
                             (std::cos(frequency * t) + rate / frequency * std::sin(frequency * t));
        worst = std::max(worst, std::fabs(pair.stretch_after_step() - exact));
    }
    CHECK(worst < 1e-5);  // 0.1 % of the amplitude
}

TEST_CASE("a body at rest presses into the ground by its weight over the stiffness below it") {
    for (const int precision : {LIMAX_COMPENSATED, LIMAX_MIXED, LIMAX_DOUBLE}) {
        stage body(lattice{2, 2, 1});
        body.effects({"gravity", "ground", "damping", "friction"});
        body.setup.options.precision = precision;
        body.setup.options.duration = 5;
        const auto run = body.run();
        const snapshot rest = state_of(*run);
        double pressed = 0, fastest = 0;
        for (std::size_t i = 0; i < rest.positions.size(); i += 3) {
            pressed += std::max(0.0, -rest.positions[i + 2]);
            for (int axis = 0; axis < 3; ++axis)
                fastest = std::max(fastest, std::fabs(rest.velocities[i + axis]));
        }
        CHECK(pressed == doctest::Approx(run->outcomes()[0].mass * g / 1e5).epsilon(1e-3));
        CHECK(fastest < 1e-4);
    }
}

TEST_CASE("a sliding body stops after v^2 / (2 mu g)") {
    for (const double mu : {0.2, 0.4}) {
        stage body(lattice{3, 3, 1});
        body.effects({"gravity", "ground", "damping", "friction"});
        body.set("friction", "static", {mu}).set("friction", "kinetic", {mu});
        body.setup.options.velocity[0] = 2.0;
        body.setup.options.duration = 3.0;
        const auto run = body.run();
        const limax_outcome& outcome = run->outcomes()[0];
        CHECK(outcome.center_end[0] - outcome.center_start[0] ==
              doctest::Approx(4.0 / (2 * mu * g)).epsilon(0.01));
        CHECK(std::fabs(outcome.center_end[1] - outcome.center_start[1]) < 1e-9);
    }
}

TEST_CASE(
    "on a slope a mass sticks below atan(max(mu_s, mu_k)) and slides above, in both orders of the "
    "coefficients") {
    // one mass, so that the ratio of tangential to normal load is the slope's everywhere and always
    struct order {
        double still, sliding;
    };
    for (const order mu : {order{0.5, 0.3}, order{0.3, 0.5}, order{1.0, 0.6}, order{0.6, 1.0}}) {
        const double critical = std::atan(std::max(mu.still, mu.sliding));
        for (const double degrees : {-0.5, 0.5}) {
            const double angle = critical + degrees * pi / 180;
            stage scene(lattice{1, 1, 1});
            scene.effects({"gravity", "ground", "friction"});
            scene.set("friction", "static", {mu.still}).set("friction", "kinetic", {mu.sliding});
            scene.set("gravity", "acceleration", {g * std::sin(angle), 0, -g * std::cos(angle)});
            scene.setup.options.duration = 2.0;
            spring_body body = scene.body();
            for (float& k : body.stiffness) k = 0;
            for (int64_t site = 1; site < 8; ++site) body.mass[site] = 0;
            body.masses = 1;
            body.springs = 0;
            body.total_mass = body.mass[0];
            limax_outcome outcome{};
            cpu::scratch memory(scene.setup.grid);
            auto mass =
                cpu::make_robot(scene.setup, std::move(body), cpu::choose_passes(""), outcome);
            const double pressed[3] = {0, 0, -0.1 * g * std::cos(angle) / 1e5};
            mass->place(pressed, nullptr);
            mass->advance(memory, cpu::deadline::max(), 0);
            REQUIRE(outcome.status == LIMAX_ROBOT_DONE);
            const double slid = outcome.center_end[0] - outcome.center_start[0];
            CAPTURE(mu.still);
            CAPTURE(mu.sliding);
            CAPTURE(degrees);
            const double acceleration = g * (std::sin(angle) - mu.sliding * std::cos(angle));
            if (degrees < 0)
                CHECK(std::fabs(slid) < 1e-12);
            else
                CHECK(slid == doctest::Approx(0.5 * acceleration * 4.0).epsilon(0.01));
        }
    }
}

TEST_CASE(
    "a whole body holds on a slope where each of its masses has grip to spare, and slides where "
    "none has") {
    for (const double mu : {0.3, 0.5})
        for (const double degrees : {-4.0, 1.0}) {
            const double angle = std::atan(mu) + degrees * pi / 180;
            stage body(lattice{4, 4, 1});
            body.effects({"gravity", "ground", "damping", "friction"});
            body.set("friction", "static", {mu}).set("friction", "kinetic", {mu});
            body.set("gravity", "acceleration", {g * std::sin(angle), 0, -g * std::cos(angle)});
            body.setup.options.settle = 1.0;
            body.setup.options.duration = 1.0;
            const auto run = body.run();
            const double slid =
                run->outcomes()[0].center_end[0] - run->outcomes()[0].center_start[0];
            CAPTURE(mu);
            CAPTURE(degrees);
            if (degrees < 0)
                CHECK(std::fabs(slid) < 1e-6);
            else  // from rest a second before: 3/2 a t^2
                CHECK(slid == doctest::Approx(1.5 * g * (std::sin(angle) - mu * std::cos(angle)))
                                  .epsilon(0.05));
        }
}

TEST_CASE("momentum and centre of mass are conserved in free flight, muscles working") {
    for (const int precision : {LIMAX_COMPENSATED, LIMAX_MIXED, LIMAX_DOUBLE}) {
        stage body(lattice{3, 3, 3});
        body.randomize(7);
        body.effects({"damping", "actuation"});
        body.setup.options.precision = precision;
        body.setup.options.duration = 2;
        for (int axis = 0; axis < 3; ++axis) body.setup.options.velocity[axis] = 0.3 * (axis - 1);
        const auto run = body.run();
        const limax_outcome& outcome = run->outcomes()[0];
        for (int axis = 0; axis < 3; ++axis) {
            const double moved = outcome.center_end[axis] - outcome.center_start[axis];
            CHECK(std::fabs(moved - 2 * 0.3 * (axis - 1)) <
                  (precision == LIMAX_DOUBLE ? 1e-12 : 2e-6));
        }
    }
}

TEST_CASE(
    "energy of an undamped body: within 0.1 % at a tenth of the bound over 5 s, falling as the "
    "square of the step") {
    double worst[2];
    for (int refinement = 0; refinement < 2; ++refinement) {
        stage body(lattice{2, 2, 2});
        body.randomize(3);
        body.setup.options.duration = 5;
        body.setup.options.bound_fraction = 0.1 / (1 << refinement);
        body.setup.options.record[LIMAX_TRACE_ENERGY] = 50;
        auto run = body.open();
        snapshot start = state_of(*run);
        // stretched by 5 % along x and spinning about z
        for (std::size_t i = 0; i < start.positions.size(); i += 3) {
            start.velocities[i] = -3.0 * (start.positions[i + 1] - 0.1);
            start.velocities[i + 1] = 3.0 * (start.positions[i] - 0.1);
            start.positions[i] *= 1.05;
        }
        run->place(0, start.positions.data(), start.velocities.data());
        stage::finish(*run);
        const trace_view energy = trace_of(*run, 0, LIMAX_TRACE_ENERGY);
        REQUIRE(energy.samples == 251);
        const double first = energy.at(0, 0) + energy.at(0, 1);
        worst[refinement] = 0;
        for (int64_t s = 0; s < energy.samples; ++s)
            worst[refinement] = std::max(
                worst[refinement], std::fabs((energy.at(s, 0) + energy.at(s, 1)) / first - 1));
    }
    CHECK(worst[0] < 1e-3);
    CHECK(worst[0] / worst[1] == doctest::Approx(4.0).epsilon(0.1));
}

TEST_CASE("coincident masses and crushed bodies give finite forces") {
    for (const int precision : every_precision) {
        stage body(lattice{2, 2, 2});
        body.effects({"damping"});
        body.setup.options.precision = precision;
        auto run = body.open();
        snapshot start = state_of(*run);
        for (double& x : start.positions) x *= 1e-3;
        start.positions[3] = start.positions[0];
        start.positions[4] = start.positions[1];
        start.positions[5] = start.positions[2];
        run->place(0, start.positions.data(), nullptr);
        stage::finish(*run);
        CHECK(run->outcomes()[0].status == LIMAX_ROBOT_DONE);
    }
}

TEST_CASE(
    "a vibrating body: compensated and mixed stay with double, also at a step where single drifts "
    "off by its rounding") {
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

TEST_CASE("where a robot starts changes no bit of its motion, near or far") {
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

TEST_CASE("a body dropped from 1 km rests at the penetration of one dropped from 1 m") {
    double pressed[2] = {0, 0};
    for (int high = 0; high < 2; ++high) {
        stage body(lattice{1, 1, 1});
        body.effects({"gravity", "ground", "damping", "friction"});
        body.setup.options.precision = LIMAX_COMPENSATED;
        body.setup.options.position[2] = high ? 1000.0 : 1.0;
        body.setup.options.duration = high ? 200.0 : 20.0;
        const auto run = body.run();
        REQUIRE(run->outcomes()[0].status == LIMAX_ROBOT_DONE);
        const snapshot end = state_of(*run);
        for (std::size_t i = 2; i < end.positions.size(); i += 3)
            pressed[high] += std::max(0.0, -end.positions[i]);
        CHECK(pressed[high] == doctest::Approx(0.8 * g / 1e5).epsilon(0.01));
    }
    CHECK(std::fabs(pressed[1] - pressed[0]) <
          1e-6);  // m: fp32 within 4 m of the robot's own origin
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
