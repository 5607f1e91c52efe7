// contact_test.cpp: the height field: its surface, its force, what it refuses. SI units.
#include <doctest/doctest.h>

#include <limits>

#include "failure.h"
#include "physics/solid.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;
using effects::terrain;

namespace {

constexpr double spacing = 0.25;  // m

// A terrain whose height is a function of x and y at its places.
template <class Height>
scene field_of(int nx, int ny, const std::vector<double>& origin, const Height& height) {
    scene out;
    out.add("terrain");
    std::vector<double> table;
    for (int i = 0; i < nx; ++i)
        for (int j = 0; j < ny; ++j)
            table.push_back(height(origin[0] + spacing * i, origin[1] + spacing * j));
    out.set("terrain", "spacing", &spacing, 1);
    out.set("terrain", "origin", origin.data(), 3);
    out.set_heights("terrain", "heights", table.data(), nx, ny);
    return out;
}
template <class R>
terrain::params<R> params_of(const scene& scene) {
    const double world[3] = {0, 0, 0};
    return effects::make_params<terrain, R>(scene.values(effects::index_of<terrain>), world,
                                            scene.heights());
}

}  // namespace

TEST_CASE_TEMPLATE("a terrain of one slope is a plane and continues at its border's height", R,
                   float, double) {
    // half a metre above what the table says
    const auto height = [](double x, double y) { return 0.5 * x - 0.25 * y; };
    const scene sloped = field_of(9, 5, {-1, -0.5, 0.5}, height);
    const auto p = params_of<R>(sloped);
    const double length = std::sqrt(1 + 0.25 + 0.0625);
    const double rounding = sizeof(R) == 4 ? 1e-6 : 1e-15;
    draws draw{99};
    for (int i = 0; i < 1000; ++i) {
        const double x = 0.99 * draw(), y = 0.49 * draw(), z = draw();
        const auto point = terrain::surface(p, effects::vector<R>{R(x), R(y), R(z)});
        CHECK(std::fabs(point.depth - (height(x, y) + 0.5 - z) / length) < rounding);
        CHECK(std::fabs(point.normal.x + 0.5 / length) < rounding);
        CHECK(std::fabs(point.normal.y - 0.25 / length) < rounding);
        CHECK(std::fabs(point.normal.z - 1 / length) < rounding);
    }
    // beyond a corner: level, as high as the corner
    const auto beyond = terrain::surface(p, effects::vector<R>{R(7), R(8), R(0)});
    CHECK(std::fabs(beyond.depth - (height(1, 0.5) + 0.5)) < rounding);
    CHECK(beyond.normal.z == R(1));
    // beyond an edge it still slopes along it
    const auto beside = terrain::surface(p, effects::vector<R>{R(-3), R(0.1), R(0)});
    CHECK(beside.normal.x == R(0));
    CHECK(beside.normal.y > R(0));
    // NaN does not read outside of the table
    const R nothing = std::numeric_limits<R>::quiet_NaN();
    const auto lost = terrain::surface(p, effects::vector<R>{nothing, nothing, nothing});
    CHECK(!(lost.depth > R(0)));
}

TEST_CASE("the stiffness of a terrain does not grow with its slope") {
    draws draw{99};
    for (const double steep : {0.0, 1.0, 5.0, 50.0}) {
        const scene sloped = field_of(4, 4, {-0.5, -0.5, 0},
                                      [&](double x, double y) { return steep * (x + 0.5 * y); });
        const auto p = params_of<double>(sloped);
        const auto force = [&](effects::vector<double> x) {
            effects::vector<double> sum{0, 0, 0};
            effects::add_force<terrain>(p, effects::node_state<double>{x, {0, 0, 0}, 0.1, 10}, sum);
            return sum;
        };
        double most = 0;
        for (int i = 0; i < 200; ++i) {
            const double x = 0.2 * draw(), y = 0.2 * draw(), step = 1e-7;
            const effects::vector<double> at{x, y, steep * (x + 0.5 * y) - 0.01};
            const effects::vector<double> aside{draw(), draw(), draw()};
            const double share = step / std::sqrt(effects::dot(aside, aside));
            const effects::vector<double> change =
                solid::minus(force(plus(at, share, aside)), force(at));
            most = std::max(most, std::sqrt(effects::dot(change, change)) / step);
        }
        CAPTURE(steep);
        CHECK(most <= 1e5 * (1 + 1e-6));
        CHECK(most > 0.5e5);
    }
}

TEST_CASE("a table of heights is checked") {
    const double heights[6] = {0, 1, 2, 3, 4, 1001};
    scene out;
    CHECK(refused([&] { out.set_heights("terrain", "heights", heights, 2, 2); }) ==
          "scene.terrain.heights is set, but the scene does not name 'terrain'");
    out.add("terrain");
    CHECK(refused([&] { out.set_heights("terrain", "heights", heights, 1, 6); }) ==
          "scene.terrain.heights is a table of 1 x 6; it must be 2 x 2 to 512 x 512");
    CHECK(refused([&] {
              out.set_heights("terrain", "heights", heights, 2, 3);
          }).find("scene.terrain.heights[2][3] is 1001") == 0);
    out.set_heights("terrain", "heights", heights, 2, 2);
    CHECK(out.heights().heights[3] == 3.0f);
}
