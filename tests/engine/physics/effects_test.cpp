// effects_test.cpp: what every effect promises in its contract, beyond what the compiler checks.
#include <doctest/doctest.h>

#include <cstring>
#include <vector>

#include "failure.h"
#include "physics/scene.h"
#include "stage.h"

using namespace limax;
using namespace limax::effects;
using limax::test::draws;
using limax::test::failure;

namespace {

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
    // bits, not values: -0 is not 0 here
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    return std::memcmp(&a, &b, sizeof a) == 0;
}

}  // namespace

TEST_CASE_TEMPLATE("parameters follow the origin as if they were recomputed", R, float, double) {
    const double here[3] = {0, 0, 0}, there[3] = {6, -14, 998};
    int following = 0;
    for_each([&]<class E>(E) {
        // what may be there several times is made anew
        if constexpr (acts_on_masses<E> && !repeatable<E>) {
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
    "friction never reverses or increases slip, never changes the velocity along the normal, and "
    "has no effect without contact",
    R, float, double) {
    draws draw{12345};
    const double origin[3] = {0, 0, 0};
    const auto params = friction::make<R>(default_values<friction>().data(), origin);
    const R inverse_mass = 10, h = R(1e-4);
    const auto check = [&](auto direction_of) {
        R reversed = 0, longer = 0, turned = 0;
        bool touched = false;
        for (int i = 0; i < 20000; ++i) {
            // slips from 1e-12 to 10 m/s, loads from none to far more than stops any of them
            const R scale = R(std::pow(10.0, 6.5 * draw() - 5.5));
            const vector<R> v{scale * R(draw()), i % 7 ? scale * R(draw()) : R(0), R(draw())};
            const R load = i % 5 ? R(std::pow(10.0, 4 * draw())) : R(1e6);
            const auto normal = direction_of();
            // a mass that rested before, and one that slipped already
            const vector<R> before = i % 2 ? vector<R>{} : v;
            const vector<R> after =
                friction::slip(params, normal, load, inverse_mass, before, v, h);
            const vector<R> slip = across(normal, v), left = across(normal, after);
            reversed = larger(reversed, -dot(slip, left));
            longer = larger(longer, square_root(dot(left, left)) - square_root(dot(slip, slip)));
            turned = larger(turned, absolute(along(normal, after) - along(normal, v)));
            touched |=
                !same_bytes(friction::slip(params, normal, R(0), inverse_mass, before, v, h), v);
        }
        // rounding of a velocity of some m/s, which is nothing where it is not turned
        const R rounding =
            same_type<decltype(direction_of()), up> ? R(0) : (sizeof(R) == 4 ? R(1e-5) : R(1e-13));
        CHECK(reversed <= rounding);
        CHECK(longer <= rounding);
        CHECK(turned <= rounding);
        CHECK(!touched);
    };
    check([] { return up{}; });
    check([&] {
        vector<R> n{R(draw()), R(draw()), R(draw())};
        const R inverse = R(1) / square_root(dot(n, n));
        return vector<R>{n.x * inverse, n.y * inverse, n.z * inverse};
    });
}

TEST_CASE_TEMPLATE("a slip that reverses stops where static friction can hold it", R, float,
                   double) {
    // thrown up a slope between atan(mu_k) and atan(mu_s), at speeds that end anywhere in a step
    const double origin[3] = {0, 0, 0};
    const auto params = friction::make<R>(default_values<friction>().data(), origin);
    const R inverse_mass = 10, load = 20, h = R(1e-3);
    const R pull =
        R(0.5) * (params.static_coefficient + params.kinetic_coefficient) * load * inverse_mass;
    const auto speed_after = [&](R speed, R downhill, auto normal) {
        vector<R> u{-speed, 0, 0};
        for (int step = 0; step < 1000; ++step) {
            const vector<R> v{u.x + downhill * h, 0, 0};
            u = friction::slip(params, normal, load, inverse_mass, u, v, h);
        }
        return u.x;
    };
    int slid = 0;
    for (int i = 0; i < 200; ++i) {
        const R speed = 1 + R(0.00317) * R(i);
        slid += speed_after(speed, pull, up{}) != 0;
        slid += speed_after(speed, pull, vector<R>{0, 0, 1}) != 0;
        // steeper than static friction allows, it comes back
        CHECK(speed_after(speed, R(3) * pull, up{}) > 0);
    }
    CHECK(slid == 0);
    // to the side of its way it has turned by less than a right angle, and slips on
    const R between = pull * h, kinetic = params.kinetic_coefficient * load * inverse_mass * h;
    const vector<R> aside = friction::slip(params, up{}, load, inverse_mass, {R(0.01), R(0.1), 0},
                                           {R(0.01), between, 0}, h);
    CHECK(aside.y > R(0.9) * (between - kinetic));
}

TEST_CASE("the force of an effect on a mass at rest is the gradient of its energy") {
    draws draw{12345};
    const double origin[3] = {0, 0, 0};
    int effects = 0;
    for_each([&]<class E>(E) {
        if constexpr (stores_energy_on_masses<E>) {
            ++effects;
            CAPTURE(E::name);
            const scene flat;
            const auto params =
                make_params<E, double>(default_values<E>().data(), origin, flat.heights());
            const double step = 1e-6;
            double worst = 0, acted = 0;
            for (int i = 0; i < 20000; ++i) {
                const vector<double> at{2 * draw(), 2 * draw(), 2 * draw()};
                const auto energy = [&](double x, double y, double z) {
                    return energy_of_mass<E>(params, node_state<double>{{x, y, z}, {}, 0.1, 10});
                };
                vector<double> force{0, 0, 0};
                add_force<E>(params, node_state<double>{at, {0, 0, 0}, 0.1, 10}, force);
                const double slope[3] = {
                    energy(at.x + step, at.y, at.z) - energy(at.x - step, at.y, at.z),
                    energy(at.x, at.y + step, at.z) - energy(at.x, at.y - step, at.z),
                    energy(at.x, at.y, at.z + step) - energy(at.x, at.y, at.z - step)};
                const double size = std::sqrt(dot(force, force)) + 1;
                worst = larger(worst, absolute(force.x + slope[0] / (2 * step)) / size);
                worst = larger(worst, absolute(force.y + slope[1] / (2 * step)) / size);
                worst = larger(worst, absolute(force.z + slope[2] / (2 * step)) / size);
                acted = larger(acted, size - 1);
            }
            // a difference over 1e-6 m of energies of up to 1e5 J
            CHECK(worst < 1e-4);
            CHECK(acted > 0);
        }
    });
    CHECK(effects > 1);
}

TEST_CASE("the order in which instances are added does not matter to laws") {
    const auto planes_at = [](const std::vector<double>& offsets) {
        scene out;
        for (const double& offset : offsets) {
            out.add("planes");
            out.set("planes", "offset", &offset, 1);
        }
        return out;
    };
    const scene one = planes_at({0.5, -0.5, 2}), other = planes_at({2, 0.5, -0.5});
    REQUIRE(one.instances(index_of<planes>) == 3);
    for (int i = 0; i < 3; ++i)
        for (int v = 0; v < components<planes>; ++v)
            CHECK(one.values(index_of<planes>, i)[v] == other.values(index_of<planes>, i)[v]);
    // equal numbers are equal bits
    CHECK(!std::signbit(planes_at({-0.0}).values(index_of<planes>)[5]));
}

TEST_CASE("instances are counted, named in messages, and checked one by one") {
    scene out;
    for (int i = 0; i < 2; ++i) out.add("planes");
    const double nothing[3] = {0, 0, 0};
    out.set("planes", "normal", nothing, 3);
    CHECK(failure(LIMAX_INVALID_ARGUMENT, [&] { out.check(); }) ==
          "scene.planes[2]: normal is 0: it has no direction");
    scene held;
    held.add("anchors");
    const double low[3] = {0, 0, -2}, high[3] = {0, 0, -1};
    held.set("anchors", "from", high, 3);
    held.set("anchors", "to", low, 3);
    CHECK(failure(LIMAX_INVALID_ARGUMENT, [&] { held.check(); }) ==
          "scene.anchors: no component of 'from' may be above that of 'to'");
    while (out.instances(index_of<planes>) < most_instances<planes>) out.add("planes");
    CHECK(failure(LIMAX_INVALID_ARGUMENT, [&] { out.add("planes"); }) ==
          "scene.planes: at most 16 of them are possible");
    const double drag = 1;
    CHECK(failure(LIMAX_INVALID_ARGUMENT, [&] { out.set("wind", "drag", &drag, 1); }) ==
          "scene.wind.drag is set, but the scene does not name 'wind'");
}
