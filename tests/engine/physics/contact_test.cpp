// contact_test.cpp: contacts that face anywhere, and several at once: closed forms of one mass that
// rests and slides, and whole bodies. SI units.
#include <doctest/doctest.h>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr double g = 9.81;     // m/s^2
constexpr double mass = 0.1f;  // kg, of every mass
constexpr double stiffness = 1e5;

// One mass without springs in a scene.
struct lone_mass {
    stage scene{lattice{1, 1, 1}};
    limax_outcome outcome{};
    std::unique_ptr<cpu::scratch> memory;
    std::unique_ptr<cpu::robot> robot;

    lone_mass() { scene.setup.options.duration = 2.0; }
    void put(const effects::vector<double>& at, const effects::vector<double>& velocity = {}) {
        spring_body body = scene.body();
        for (float& k : body.stiffness) k = 0;
        for (int64_t site = 1; site < 8; ++site) body.mass[site] = 0;
        body.masses = 1;
        body.springs = 0;
        body.total_mass = body.mass[0];
        memory = std::make_unique<cpu::scratch>(scene.setup.grid);
        robot = cpu::make_robot(scene.setup, std::move(body), cpu::choose_passes(""), outcome);
        robot->place(&at.x, &velocity.x);
    }
    effects::vector<double> end(effects::vector<double>* velocity = nullptr) {
        robot->advance(*memory, cpu::deadline::max(), 0);
        REQUIRE(outcome.status == LIMAX_ROBOT_DONE);
        effects::vector<double> at{}, moving{};
        robot->state(*memory, &at.x, &moving.x);
        if (velocity) *velocity = moving;
        return at;
    }
};

double length(const effects::vector<double>& v) { return std::sqrt(effects::dot(v, v)); }

}  // namespace

TEST_CASE(
    "a mass slides down a tilted plane with a = g (sin - mu cos), whichever way it is tilted") {
    for (const int precision : every_precision)
        for (const double turn : {0.0, 1.0, 2.5})
            for (const double mu : {0.0, 0.3}) {
                const double angle = 0.6, height = 3;
                lone_mass body;
                body.scene.setup.options.precision = precision;
                const effects::vector<double> n{std::sin(angle) * std::cos(turn),
                                                std::sin(angle) * std::sin(turn), std::cos(angle)};
                body.scene.effects({"gravity", "planes", "friction"});
                // of any length, as a script may have it
                body.scene.set("planes", "normal", {5 * n.x, 5 * n.y, 5 * n.z})
                    .set("planes", "offset", {height})
                    .set("friction", "static", {mu})
                    .set("friction", "kinetic", {mu});
                const double d = height - mass * g * std::cos(angle) / stiffness;
                const effects::vector<double> start{d * n.x, d * n.y, d * n.z};
                body.put(start);
                const effects::vector<double> end = body.end();
                const effects::vector<double> way{end.x - start.x, end.y - start.y,
                                                  end.z - start.z};
                CAPTURE(precision);
                CAPTURE(turn);
                CAPTURE(mu);
                const double slid = 0.5 * g * (std::sin(angle) - mu * std::cos(angle)) * 4.0;
                CHECK(length(way) == doctest::Approx(slid).epsilon(1e-3));
                // straight down the slope
                const effects::vector<double> down{std::cos(angle) * std::cos(turn),
                                                   std::cos(angle) * std::sin(turn),
                                                   -std::sin(angle)};
                CHECK(effects::dot(way, down) == doctest::Approx(length(way)).epsilon(1e-5));
            }
}

TEST_CASE("a mass rests on top of a sphere and slides off its side") {
    for (const int precision : every_precision) {
        lone_mass body;
        body.scene.setup.options.precision = precision;
        body.scene.setup.options.duration = 4;
        body.scene.effects({"gravity", "spheres", "friction"});
        body.scene.set("spheres", "center", {1, 2, 3})
            .set("spheres", "radius", {0.5})
            .set("spheres", "damping_ratio", {1});
        body.put({1, 2, 3.52});
        const effects::vector<double> end = body.end();
        // fp32 resolves a height of 3.5 m to 2e-7 m
        CHECK(std::fabs(end.z - (3.5 - mass * g / stiffness)) < 1e-6);
        CHECK(std::hypot(end.x - 1, end.y - 2) < 1e-6);
    }
    // without friction it leaves a sphere at cos = 2/3 of the way down: from then on it is free
    lone_mass body;
    body.scene.setup.options.duration = 0.4;
    body.scene.setup.options.time_step = 1e-5;
    body.scene.effects({"gravity", "spheres"});
    body.scene.set("spheres", "center", {0, 0, 0}).set("spheres", "radius", {0.5});
    const double lean = 0.3;
    body.put({0.5 * std::sin(lean), 0, 0.5 * std::cos(lean)});
    effects::vector<double> velocity;
    const effects::vector<double> end = body.end(&velocity);
    // energy is kept but for the first touch
    const double fallen = 0.5 * std::cos(lean) - end.z;
    CHECK(effects::dot(velocity, velocity) == doctest::Approx(2 * g * fallen).epsilon(0.01));
    CHECK(length(end) > 0.5);
    CHECK(std::fabs(end.y) < 1e-12);
}

TEST_CASE("instances that no mass can touch at the same time do not shorten the step") {
    const auto bound = [](const std::vector<double>& places) {
        stage body(lattice{1, 1, 1});
        for (const double x : places) {
            body.effects({"spheres", "boxes"});
            body.set("spheres", "center", {x, 0, 0}).set("spheres", "radius", {0.3});
            body.set("boxes", "from", {x, 0, 0}).set("boxes", "to", {x + 0.5, 1, 1});
        }
        return time_step_bound(body.body(), body.setup.scene, LIMAX_LEAPFROG);
    };
    const double one = bound({0});
    CHECK(bound({0, 1, 2}) == one);
    CHECK(bound({0, 0.5}) < one);
    // three in a row of which the middle one touches both
    CHECK(bound({0, 0.4, 0.8}) < bound({0, 0.4}));
    CHECK(bound({0, 0.4, 5}) == bound({0, 0.4}));
}
