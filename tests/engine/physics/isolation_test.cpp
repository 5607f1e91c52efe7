// isolation_test.cpp: threads and the instruction set do not change a robot's bits. Slices and
// neighbours are tested by tests/suites/engine/same_bits.lua.
#include <doctest/doctest.h>

#include <cstring>
#include <sstream>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

stage walkers(int count, int precision = LIMAX_COMPENSATED, int integrator = LIMAX_LEAPFROG) {
    stage bodies(lattice{3, 3, 2}, count);
    bodies.randomize(77);
    bodies.effects({"gravity", "damping", "actuation"});
    if (integrator != LIMAX_RK4) bodies.effects({"ground", "friction"});
    bodies.setup.options.precision = precision;
    bodies.setup.options.integrator = integrator;
    bodies.setup.options.settle = 0.1;
    bodies.setup.options.duration = 0.5;
    bodies.setup.options.record[LIMAX_TRACE_POSITION] = 20;
    bodies.setup.options.record[LIMAX_TRACE_VELOCITY] = 20;
    bodies.setup.options.record[LIMAX_TRACE_ENERGY] = 20;
    return bodies;
}

bool same_bits(const simulation& a, int i, const simulation& b, int j) {
    const limax_outcome &left = a.outcomes()[i], &right = b.outcomes()[j];
    // compares bits, so that NaN summaries are equal too
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    if (std::memcmp(&left, &right, sizeof left) != 0) return false;
    for (const int kind : {LIMAX_TRACE_POSITION, LIMAX_TRACE_VELOCITY, LIMAX_TRACE_ENERGY}) {
        const trace_view x = trace_of(a, i, kind), y = trace_of(b, j, kind);
        if (x.samples != y.samples || x.width != y.width) return false;
        if (std::memcmp(x.data, y.data, sizeof(double) * x.samples * x.width) != 0) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("one thread or three: the same bits") {
    const stage bodies = walkers(7);
    const auto one = bodies.run(1), three = bodies.run(3);
    for (int i = 0; i < 7; ++i) CHECK(same_bits(*one, i, *three, i));
}

TEST_CASE("every instruction set that this processor runs: the same bits") {
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG, LIMAX_RK4}) {
            stage bodies = walkers(2, precision, integrator);
            // leapfrog takes every effect, twice where that is possible
            const auto& all = effect_entries();
            for (std::size_t e = 1; integrator == LIMAX_LEAPFROG && e < all.size(); ++e)
                while (bodies.setup.scene.instances(int(e)) < std::min(all[e].most_instances, 2))
                    bodies.effects({all[e].name});
            const auto reference = bodies.run(1, "baseline");
            std::istringstream names(cpu::available_isas());
            int compared = 0;
            for (std::string isa; std::getline(names, isa, ',');) {
                const auto other = bodies.run(1, isa.c_str());
                CAPTURE(isa);
                for (int i = 0; i < 2; ++i) CHECK(same_bits(*reference, i, *other, i));
                ++compared;
            }
            CHECK(compared >= 1);
        }
}
