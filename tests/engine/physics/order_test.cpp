// order_test.cpp: the observed order of each integrator on smooth scenes, by halving the step, and
// what RK4 does and refuses. SI units.
#include <doctest/doctest.h>

#include "failure.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

const int every_integrator[] = {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG, LIMAX_RK4, LIMAX_XPBD};
constexpr int order_of[] = {1, 2, 4, 1};

// Free in space: springs and dashpots, and muscles if `actuated`.
stage free_body(bool actuated) {
    stage body(lattice{2, 2, 2});
    body.randomize(17);
    body.effects({"damping"});
    if (actuated) body.effects({"actuation"});
    body.setup.options.duration = 0.25;
    return body;
}

// Where the masses are, and how fast, at the end of a run from a bent and turning start.
snapshot end_of(const stage& body) {
    auto run = body.open();
    bend(*run, 4e-3, 0.2);
    stage::finish(*run);
    REQUIRE(run->outcomes()[0].status == LIMAX_ROBOT_DONE);
    return state_of(*run);
}

// Root mean square over masses and axes.
double apart(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return std::sqrt(sum / double(a.size()));
}

}  // namespace

TEST_CASE(
    "the observed order is 1, 2, 4 and 1 on a vibrating body and on a working one in the air") {
    for (const bool actuated : {false, true})
        for (const int integrator : every_integrator) {
            // steps at which the error is far from both the bound and the rounding of double
            const double coarse = integrator == LIMAX_RK4 ? 1e-4 : 1e-5;
            snapshot end[3];
            for (int halving = 0; halving < 3; ++halving) {
                stage body = free_body(actuated);
                body.setup.options.integrator = integrator;
                body.setup.options.time_step = coarse / (1 << halving);
                end[halving] = end_of(body);
            }
            const double order = std::log2(apart(end[0].positions, end[1].positions) /
                                           apart(end[1].positions, end[2].positions));
            const double order_of_velocity = std::log2(apart(end[0].velocities, end[1].velocities) /
                                                       apart(end[1].velocities, end[2].velocities));
            CAPTURE(actuated);
            CAPTURE(integrator);
            MESSAGE("observed orders " << order << ", " << order_of_velocity);
            CHECK(std::fabs(order - order_of[integrator]) < 0.1);
            CHECK(std::fabs(order_of_velocity - order_of[integrator]) < 0.1);
        }
}

TEST_CASE("all integrators converge to the same motion, RK4 in every precision") {
    stage fine = free_body(true);
    fine.setup.options.integrator = LIMAX_RK4;
    fine.setup.options.time_step = 1e-4;
    const snapshot reference = end_of(fine);
    stage leapfrog = free_body(true);
    leapfrog.setup.options.time_step = 2e-6;
    CHECK(apart(end_of(leapfrog).positions, reference.positions) < 1e-8);
    for (const int precision : every_precision) {
        stage body = free_body(true);
        body.setup.options.integrator = LIMAX_RK4;
        body.setup.options.time_step = 1e-4;
        body.setup.options.precision = precision;
        const double error = apart(end_of(body).positions, reference.positions);
        CAPTURE(precision);
        MESSAGE("error " << error << " m");
        // fp32 resolves 0.2 m to 1.5e-8 m; plain sums round at each of 2500 steps
        CHECK(error < (precision == LIMAX_SINGLE ? 1e-6 : 5e-8));
        CHECK((error == 0) == (precision == LIMAX_DOUBLE));
    }
}

TEST_CASE("RK4 and XPBD refuse what they cannot integrate, and devices other than the CPU") {
    limax_simulation_options options = default_options();
    // the scene's effects, what RK4 names of them, whether XPBD refuses them
    struct refusal {
        std::vector<const char*> effects;
        std::string rough;
        bool xpbd;
    };
    for (const refusal& each : {refusal{{"damping", "actuation", "gravity"}, "", false},
                                {{"ground"}, "ground", false},
                                {{"ground", "friction"}, "ground and friction", false},
                                {{"drag"}, "drag", false},
                                {{"self_collision"}, "self_collision", false},
                                {{"block"}, "block", true}}) {
        limax::scene scene;
        for (const char* effect : each.effects) scene.add(effect);
        const auto answer = [&](limax_integrator integrator) {
            options.integrator = integrator;
            return refused([&] { check_options(options, scene); });
        };
        CHECK(answer(LIMAX_RK4) ==
              (each.rough.empty()
                   ? "no failure"
                   : "integrator: rk4 integrates smooth scenes only; the scene has " + each.rough +
                         "; use leapfrog"));
        CHECK((answer(LIMAX_XPBD) ==
               "integrator: xpbd has no place for a rigid solid; the scene has block; use "
               "leapfrog") == each.xpbd);
        CHECK(answer(LIMAX_LEAPFROG) == "no failure");
    }
    const auto beyond = [&] { return refused([&] { check_beyond_cpu(options); }); };
    CHECK(beyond() == "no failure");
    options.record[LIMAX_TRACE_LEDGER] = 20;
    CHECK(beyond() == "record.ledger: the energy ledger exists on the cpu only; use device 'cpu'");
    for (const std::string name : {"rk4", "xpbd"}) {
        options.integrator = name == "rk4" ? LIMAX_RK4 : LIMAX_XPBD;
        CHECK(beyond() == "integrator: " + name +
                              " runs on the cpu only; use device 'cpu' or the integrator leapfrog");
    }
}
