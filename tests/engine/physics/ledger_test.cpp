// ledger_test.cpp: the energy ledger: works of closed form, columns that stay 0, and the error of
// the energy balance. SI units.
#include <doctest/doctest.h>

#include "physics/ledger.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr double g = 9.81;  // m/s^2

// The ledger of robot 0, J.
struct energy_balance {
    double in_contacts = 0;  // the largest
    // The largest difference of energies and works since the start, of the energy turned over: all
    // works and the largest energy.
    double share = 0;
    double energy[ledger_energies] = {}, work[work_kinds] = {};  // at the end
};
energy_balance ledger_of(stage& body, int rate) {
    body.setup.options.record[LIMAX_TRACE_LEDGER] = rate;
    const auto run = body.run();
    const trace_view ledger = trace_of(*run, 0, LIMAX_TRACE_LEDGER);
    REQUIRE(ledger.width == ledger_width);
    REQUIRE(run->outcomes()[0].status == LIMAX_ROBOT_DONE);
    energy_balance out;
    double start = 0, error = 0, turned_over = 0;
    for (int64_t sample = 0; sample < ledger.samples; ++sample) {
        double energy = 0, works = 0;
        for (int k = 0; k < ledger_energies; ++k) energy += out.energy[k] = ledger.at(sample, k);
        for (int k = 0; k < work_kinds; ++k)
            works += out.work[k] = ledger.at(sample, ledger_energies + k);
        if (sample == 0) start = energy;
        error = std::max(error, std::abs(energy - start - works));
        out.in_contacts = std::max(out.in_contacts, out.energy[2]);
        // only changes of the gravitational energy count
        turned_over = std::max(turned_over, out.energy[0] + out.energy[1] + out.energy[2] +
                                                std::abs(out.energy[3] - ledger.at(0, 3)));
    }
    for (const double work : out.work) turned_over += std::abs(work);
    out.share = error / turned_over;
    return out;
}

enum situation { in_the_air, swimming, dropped, walking };

energy_balance ledger_in(situation where, int integrator, double fraction,
                         int precision = LIMAX_DOUBLE) {
    stage body(lattice{3, 2, 2});
    body.randomize(5);
    body.effects({"damping"});
    if (where != dropped) body.effects({"actuation"});
    if (where == swimming) body.effects({"drag"});
    if (where >= dropped) body.effects({"gravity", "ground", "friction"});
    if (where == dropped) body.setup.options.position[2] = 0.2;
    if (where == walking) body.setup.options.settle = 0.5;
    body.setup.options.duration = 2;
    body.setup.options.integrator = integrator;
    body.setup.options.precision = precision;
    body.setup.options.bound_fraction = fraction;
    return ledger_of(body, 1000);
}

}  // namespace

TEST_CASE("the energy balance holds in the air, in water, in a drop and on a walk") {
    // Shares of the energy that went through, about twice the worst of these bodies and more.
    // Contacts that switch within a step cost most, in the moments of an impact; symplectic
    // Euler's velocities are those of half a step later.
    struct bound {
        situation where;
        int integrator;
        double automatic, eighth;
    };
    for (const bound& most : {bound{in_the_air, LIMAX_LEAPFROG, 1e-5, 2e-7},
                              {in_the_air, LIMAX_SYMPLECTIC_EULER, 3e-4, 5e-5},
                              {in_the_air, LIMAX_RK4, 3e-4, 2e-5},
                              {swimming, LIMAX_LEAPFROG, 1e-5, 2e-7},
                              {dropped, LIMAX_LEAPFROG, 3e-2, 5e-4},
                              {dropped, LIMAX_SYMPLECTIC_EULER, 1.2e-1, 1.2e-2},
                              {walking, LIMAX_LEAPFROG, 1e-3, 1e-5},
                              {walking, LIMAX_SYMPLECTIC_EULER, 2e-3, 2e-4}})
        for (const bool fine : {false, true}) {
            const energy_balance kept =
                ledger_in(most.where, most.integrator, fine ? 0.9 / 8 : 0.9);
            CAPTURE(int(most.where));
            CAPTURE(most.integrator);
            CAPTURE(fine);
            MESSAGE("balance error " << kept.share);
            CHECK(kept.share < (fine ? most.eighth : most.automatic));
            CHECK(kept.work[work_damping] < 0);
            CHECK((kept.work[work_other] != 0) == (most.where == swimming));
            CHECK((kept.work[work_friction] < 0) == (most.where >= dropped));
            CHECK((kept.work[work_contact_damping] < 0) == (most.where >= dropped));
            CHECK((kept.work[work_muscles] > 0) == (most.where != dropped));
        }
    // and in fp32 as well
    for (const int precision : every_precision)
        CHECK(ledger_in(walking, LIMAX_LEAPFROG, 0.9, precision).share < 1e-3);
}

TEST_CASE("works of closed form: a fall and an impact") {
    // falling changes only potential and kinetic energy: no work
    stage fall(lattice{2, 2, 2});
    fall.effects({"gravity"});
    fall.setup.options.position[2] = 1000;
    const energy_balance fallen = ledger_of(fall, 20);
    const double mass = 27 * 0.1;  // kg
    CHECK(fallen.energy[0] == doctest::Approx(0.5 * mass * g * g).epsilon(1e-6));
    CHECK(fallen.energy[3] == doctest::Approx(mass * g * (1000.1 - 0.5 * g)).epsilon(1e-6));
    for (const double work : fallen.work) CHECK(work == 0);
    CHECK(fallen.share < 1e-12);

    // without dashpots, friction and contact damping a bouncing body keeps what it has
    stage bounce(lattice{1, 1, 1});
    bounce.effects({"gravity", "ground"});
    bounce.set("ground", "damping_ratio", {0.0});
    bounce.setup.options.position[2] = 0.1;
    bounce.setup.options.time_step = 1e-5;
    const energy_balance bounced = ledger_of(bounce, 1000);
    for (const double work : bounced.work) CHECK(work == 0);
    CHECK(bounced.share < 1e-4);
    CHECK(bounced.in_contacts > 0.5);  // J, of 0.78 that it falls with
}

TEST_CASE("the work of every contact is in its column, and a held mass does none") {
    // between a floor and two tilted planes, with friction on all
    stage funnel(lattice{2, 2, 2});
    funnel.randomize(5);
    funnel.effects({"damping", "gravity", "ground", "friction"});
    for (const double side : {-1.0, 1.0}) {
        funnel.effects({"planes"});
        funnel.set("planes", "normal", {side, 0, 1}).set("planes", "offset", {-0.05});
    }
    funnel.setup.options.position[2] = 0.3;
    funnel.setup.options.bound_fraction = 0.9 / 8;
    const energy_balance fallen = ledger_of(funnel, 100);
    CHECK(fallen.work[work_friction] < -0.1);
    CHECK(fallen.work[work_contact_damping] < -0.1);
    CHECK(fallen.work[work_other] == 0);
    CHECK(fallen.share < 1e-2);

    // a held mass does no work, whatever pulls at it
    stage hung(lattice{1, 1, 3});
    hung.effects({"gravity", "damping", "anchors"});
    const energy_balance hanging = ledger_of(hung, 20);
    CHECK(hanging.work[work_damping] < 0);
    CHECK(hanging.share < 2e-3);
}

TEST_CASE("recording a ledger changes no bit of the motion, and slices change none of it") {
    for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
        const auto run_of = [&](int rate, int64_t slice) {
            stage body(lattice{3, 2, 2});
            body.randomize(5);
            body.effects({"damping", "actuation", "gravity", "ground", "friction"});
            body.setup.options.integrator = integrator;
            body.setup.options.precision = LIMAX_COMPENSATED;
            body.setup.options.settle = 0.1;
            body.setup.options.record[LIMAX_TRACE_LEDGER] = rate;
            body.setup.options.record[LIMAX_TRACE_CENTER_OF_MASS] = 20;
            auto run = body.open();
            while (!run->advance(1.0, slice).finished) {
            }
            return run;
        };
        const auto without = run_of(0, 0), with = run_of(20, 0), sliced = run_of(20, 7);
        CHECK(state_of(*without).positions == state_of(*with).positions);
        CHECK(state_of(*without).velocities == state_of(*with).velocities);
        const trace_view one = trace_of(*with, 0, LIMAX_TRACE_LEDGER),
                         other = trace_of(*sliced, 0, LIMAX_TRACE_LEDGER);
        REQUIRE(one.samples == 21);
        CHECK(std::equal(one.data, one.data + one.samples * one.width, other.data));
    }
}
