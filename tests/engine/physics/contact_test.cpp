// contact_test.cpp: contacts that face anywhere: closed forms of one mass that rests and slides. SI
// units.
#include <doctest/doctest.h>

#include "physics/solid.h"
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
    void put(const effects::vector<double>& at) {
        spring_body body = scene.body();
        for (float& k : body.stiffness) k = 0;
        for (int64_t site = 1; site < 8; ++site) body.mass[site] = 0;
        body.masses = 1;
        body.springs = 0;
        body.total_mass = body.mass[0];
        memory = std::make_unique<cpu::scratch>(scene.setup.grid);
        robot = cpu::make_robot(scene.setup, std::move(body), cpu::choose_passes(""), outcome);
        const effects::vector<double> velocity{};
        robot->place(&at.x, &velocity.x);
    }
    effects::vector<double> end() {
        robot->advance(*memory, cpu::deadline::max(), 0);
        REQUIRE(outcome.status == LIMAX_ROBOT_DONE);
        effects::vector<double> at{}, velocity{};
        robot->state(*memory, &at.x, &velocity.x);
        return at;
    }
};

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
                const effects::vector<double> way = solid::minus(end, start);
                CAPTURE(precision);
                CAPTURE(turn);
                CAPTURE(mu);
                const double slid = 0.5 * g * (std::sin(angle) - mu * std::cos(angle)) * 4.0;
                const double length = std::sqrt(effects::dot(way, way));
                CHECK(length == doctest::Approx(slid).epsilon(1e-3));
                // straight down the slope
                const effects::vector<double> down{std::cos(angle) * std::cos(turn),
                                                   std::cos(angle) * std::sin(turn),
                                                   -std::sin(angle)};
                CHECK(effects::dot(way, down) == doctest::Approx(length).epsilon(1e-5));
            }
}
