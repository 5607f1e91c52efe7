// isolation_test.cpp: the instruction set does not change a robot's bits. Threads, slices and
// neighbours are tested by tests/suites/engine.
#include <doctest/doctest.h>

#include <cstring>
#include <sstream>

#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr int traces[] = {LIMAX_TRACE_POSITION, LIMAX_TRACE_VELOCITY, LIMAX_TRACE_ENERGY};

bool same_bits(const simulation& a, const simulation& b, int robot) {
    const limax_outcome &left = a.outcomes()[robot], &right = b.outcomes()[robot];
    // compares bits, so that NaN summaries are equal too
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    if (std::memcmp(&left, &right, sizeof left) != 0) return false;
    for (const int kind : traces) {
        const trace_view x = trace_of(a, robot, kind), y = trace_of(b, robot, kind);
        if (x.samples != y.samples || x.width != y.width) return false;
        if (std::memcmp(x.data, y.data, sizeof(double) * x.samples * x.width) != 0) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("every instruction set that this processor runs: the same bits") {
    constexpr int count = 2;
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG, LIMAX_RK4}) {
            stage bodies(lattice{3, 3, 2}, count);
            bodies.randomize(77).effects({"gravity", "damping", "actuation"});
            if (integrator == LIMAX_SYMPLECTIC_EULER) bodies.effects({"ground", "friction"});
            // leapfrog takes every effect but control, twice where that is possible
            const auto& all = effect_entries();
            for (std::size_t e = 1; integrator == LIMAX_LEAPFROG && e < all.size(); ++e)
                while (int(e) != effects::index_of<effects::control> &&
                       bodies.setup.scene.instances(int(e)) < std::min(all[e].most_instances, 2))
                    bodies.effects({all[e].name});
            limax_simulation_options& options = bodies.setup.options;
            options.precision = precision;
            options.integrator = integrator;
            options.settle = 0.1;
            options.duration = 0.5;
            for (const int kind : traces) options.record[kind] = 20;
            const auto reference = bodies.run(1, "baseline");
            std::istringstream names(cpu::available_isas());
            for (std::string isa; std::getline(names, isa, ',');) {
                const auto other = bodies.run(1, isa.c_str());
                CAPTURE(isa);
                for (int i = 0; i < count; ++i) CHECK(same_bits(*reference, *other, i));
            }
        }
}
