// effects_test.cpp: what every effect promises in its contract, beyond what the compiler checks.
#include <doctest/doctest.h>

#include <cstring>
#include <vector>

#include "physics/scene.h"

using namespace limax;
using namespace limax::effects;

namespace {

// Numbers of both signs between -1 and 1, the same at every run.
struct draws {
    uint32_t state = 12345;
    double operator()() {
        return double((state = state * 1664525u + 1013904223u) >> 8) / double(1 << 23) - 1;
    }
};

// The components of all fields of an effect, at their defaults.
template <class E>
std::vector<double> default_values() {
    std::vector<double> values;
    for (int f = 0; f < E::field_count; ++f)
        values.insert(values.end(), E::fields[f].value,
                      E::fields[f].value + E::fields[f].components);
    return values;
}

template <class P>
bool same_bytes(const P& a, const P& b) {
    // bits, not values: -0 is no 0 here
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    return std::memcmp(&a, &b, sizeof a) == 0;
}

}  // namespace

TEST_CASE_TEMPLATE("parameters follow the origin as if they were made anew", R, float, double) {
    const double here[3] = {0, 0, 0}, there[3] = {6, -14, 998};
    int following = 0;
    for_each([&]<class E>(E) {
        if constexpr (bool(E::hooks & (hook_node | hook_impulse))) {
            const std::vector<double> values = default_values<E>();
            auto params = E::template make<R>(values.data(), here);
            if constexpr (requires { E::follow(params, values.data(), there); }) {
                E::follow(params, values.data(), there);
                ++following;
            }
            CAPTURE(E::name);
            CHECK(same_bytes(params, E::template make<R>(values.data(), there)));
        }
    });
    CHECK(following > 0);
}

TEST_CASE_TEMPLATE(
    "an impulse never reverses a velocity nor adds to it, and without contact leaves it alone "
    "where "
    "it says so",
    R, float, double) {
    draws draw;
    const double origin[3] = {0, 0, 0};
    int impulses = 0;
    for_each([&]<class E>(E) {
        if constexpr (bool(E::hooks & hook_impulse)) {
            ++impulses;
            CAPTURE(E::name);
            const std::vector<double> values = default_values<E>();
            const auto params = E::template make<R>(values.data(), origin);
            bool reversed = false, longer = false, touched = false;
            for (int i = 0; i < 20000; ++i) {
                // slips from 1e-12 to 10 m/s, loads from none to far more than stops any of them
                const R scale = R(std::pow(10.0, 6.5 * draw() - 5.5));
                const vector<R> v{scale * R(draw()), i % 7 ? scale * R(draw()) : R(0), R(draw())};
                const node_state<R> node{{R(draw()), R(draw()), R(draw())}, v, R(0.1), R(10)};
                const R load = i % 5 ? R(std::pow(10.0, 4 * draw())) : R(1e6);
                const R h = R(1e-4);
                const vector<R> after = E::impulse(params, node, v, load, h);
                const auto against = [](R now, R then) { return then * now < R(0); };
                reversed |= against(v.x, after.x) || against(v.y, after.y);
                longer |= absolute(after.x) > absolute(v.x) || absolute(after.y) > absolute(v.y);
                if (E::in_contact_only)
                    touched |= !same_bytes(E::impulse(params, node, v, R(0), h), v);
            }
            CHECK(!reversed);
            CHECK(!longer);
            CHECK(!touched);
        }
    });
    CHECK(impulses > 0);
}
