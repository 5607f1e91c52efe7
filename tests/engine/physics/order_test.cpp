// order_test.cpp: leapfrog and RK4 converge to the same motion; what RK4 and XPBD refuse.
// tests/suites/engine/order.lua measures the orders. SI units.
#include <doctest/doctest.h>

#include "failure.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

// Free in space, with muscles.
stage free_body() {
    stage body(lattice{2, 2, 2});
    body.randomize(17);
    body.effects({"damping", "actuation"});
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

TEST_CASE("leapfrog and RK4 converge to the same motion, RK4 in every precision") {
    stage fine = free_body();
    fine.setup.options.integrator = LIMAX_RK4;
    fine.setup.options.time_step = 1e-4;
    const snapshot reference = end_of(fine);
    stage leapfrog = free_body();
    leapfrog.setup.options.time_step = 2e-6;
    CHECK(apart(end_of(leapfrog).positions, reference.positions) < 1e-8);
    for (const int precision : every_precision) {
        stage body = free_body();
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
    for (const refusal& each : {refusal{{"damping", "actuation", "gravity", "wind"}, "", false},
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
