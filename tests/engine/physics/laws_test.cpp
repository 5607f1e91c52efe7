// laws_test.cpp: forces of random bodies are the gradient of their energy. That internal forces sum
// to zero and passive scenes never gain energy is checked in every hard case. SI units.
#include <doctest/doctest.h>

#include <algorithm>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

// Moves every mass by up to `size` m, as a function of its index.
void disturb(snapshot& state, double size) {
    for (std::size_t i = 0; i < state.positions.size(); ++i)
        state.positions[i] += size * std::sin(12.9898 * double(i + 1));
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
            disturb(base, 0.02);
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
