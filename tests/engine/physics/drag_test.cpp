// drag_test.cpp: drag on exposed faces: the closed form of falling, what every corner takes
// against a plain list of faces, and safety at any speed. SI units.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/effects/drag.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

namespace {

constexpr double g = 9.81;  // m/s^2

// Mean velocity of all masses, which all have the same mass here.
std::array<double, 3> mean_velocity(simulation& run) {
    const snapshot now = state_of(run);
    std::array<double, 3> mean{};
    for (std::size_t i = 0; i < now.velocities.size(); ++i)
        mean[i % 3] += 3 * now.velocities[i] / double(now.velocities.size());
    return mean;
}

// What drag takes from each mass, [site][3], N s: over the six faces of every voxel, those that
// another voxel covers left out.
std::vector<double> impulses_of_faces(const stage& body, const std::vector<double>& positions,
                                      const std::vector<double>& velocities, double h,
                                      const double current[3]) {
    const lattice grid = body.setup.grid;
    const int size[3] = {grid.nx, grid.ny, grid.nz};
    std::vector<double> out(std::size_t(3 * grid.sites()));
    const auto filled = [&](const int at[3]) {
        for (int axis = 0; axis < 3; ++axis)
            if (at[axis] < 0 || at[axis] >= size[axis]) return false;
        return body.setup.voxels[grid.voxel(at[0], at[1], at[2])] != 0;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
            for (int64_t v = 0; v < grid.voxels(); ++v) {
                const int at[3] = {int(v % grid.nx), int(v / grid.nx % grid.ny),
                                   int(v / (int64_t(grid.nx) * grid.ny))};
                int beside[3] = {at[0], at[1], at[2]};
                beside[axis] += side ? 1 : -1;
                if (!filled(at) || filled(beside)) continue;
                std::size_t corner[4];
                for (int k = 0; k < 4; ++k) {
                    int c[3] = {at[0], at[1], at[2]};
                    c[axis] += side;
                    c[(axis + 1) % 3] += k & 1;
                    c[(axis + 2) % 3] += k >> 1;
                    corner[k] = std::size_t(3 * grid.site(c[0], c[1], c[2]));
                }
                double d1[3], d2[3], v_mean[3];
                for (std::size_t i = 0; i < 3; ++i) {
                    d1[i] = positions[corner[3] + i] - positions[corner[0] + i];
                    d2[i] = positions[corner[2] + i] - positions[corner[1] + i];
                    v_mean[i] = -current[i];
                    for (const std::size_t c : corner) v_mean[i] += velocities[c + i] / 4;
                }
                const double s[3] = {(d1[1] * d2[2] - d1[2] * d2[1]) / 2,
                                     (d1[2] * d2[0] - d1[0] * d2[2]) / 2,
                                     (d1[0] * d2[1] - d1[1] * d2[0]) / 2};
                const double area = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
                const double along =
                    (v_mean[0] * s[0] + v_mean[1] * s[1] + v_mean[2] * s[2]) / area;
                const double force = -0.5 * 1000.0 * area * std::fabs(along) * along;
                for (const std::size_t c : corner)
                    for (std::size_t i = 0; i < 3; ++i) out[c + i] += force * h * s[i] / area / 4;
            }
    return out;
}

}  // namespace

TEST_CASE("a face takes at most half of the momentum along its normal, at up to 1e4 m/s") {
    draws draw{7};
    using effects::drag;
    const double values[5] = {1000, 1, 0, 0, 0}, origin[3] = {0, 0, 0};
    const auto params = drag::make<double>(values, origin);
    int capped = 0, free = 0;
    for (int i = 0; i < 10000; ++i) {
        const double speed = std::pow(10.0, 4 * draw());
        effects::face_state<double> face{};
        face.area = {0.01 * draw(), 0.01 * draw(), 0.01 * draw()};
        face.velocity = {speed * draw(), speed * draw(), speed * draw()};
        // a kick may have turned it around
        face.after = {speed * draw(), speed * draw(), speed * draw()};
        face.mass = 0.1;
        const double h = 1e-4;
        const double area = std::sqrt(effects::dot(face.area, face.area));
        const double after = effects::dot(face.after, face.area) / area;
        const double along = effects::dot(drag::face(params, face, h), face.area) / area;
        const double most = 0.5 * face.mass * after;
        CHECK(along * after <= 0);
        REQUIRE(std::fabs(along) <= std::fabs(most) * (1 + 1e-9));
        const bool whole = std::fabs(along) < 0.99 * std::fabs(most);
        (whole ? free : capped) += along != 0;
        if (!whole || along == 0) continue;
        const double before = effects::dot(face.velocity, face.area) / area;
        CHECK(along == doctest::Approx(-500.0 * area * std::fabs(before) * before * h));
    }
    CHECK(capped > 500);
    CHECK(free > 500);
}

TEST_CASE("a cube falls in water at sqrt(m g / (rho C A)), with drag on both faces") {
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
            stage body(lattice{1, 1, 1});
            body.effects({"gravity", "drag", "damping"});
            body.set("drag", "density", {800}).set("drag", "coefficient", {0.5});
            body.set("drag", "current", {0.5, 0, 0.25});
            body.setup.options.precision = precision;
            body.setup.options.integrator = integrator;
            body.setup.options.time_step = 2e-4;
            body.setup.options.duration = 3;
            const auto run = body.run();
            REQUIRE(run->outcomes()[0].status == LIMAX_ROBOT_DONE);
            const auto now = mean_velocity(*run);
            // the pressure widens the cube by less than a thousandth
            CHECK(now[2] ==
                  doctest::Approx(0.25 - std::sqrt(0.8 * g / (800 * 0.5 * 0.01))).epsilon(1e-3));
            // the current takes it along, ever more slowly: 1 / (rho C A t / m + 1 / v) is left
            CHECK(now[0] ==
                  doctest::Approx(0.5 - 1 / (800 * 0.5 * 0.01 / 0.8 * 3 + 1 / 0.5)).epsilon(1e-3));
        }
}

TEST_CASE("every corner takes a quarter of each exposed face's drag, also in holes") {
    const double current[3] = {0.3, -0.2, 0.1};
    // s: so short that springs turn no face around, which would cap its drag
    const double h = 1e-7;
    for (uint32_t seed = 1; seed <= 5; ++seed) {
        stage body(lattice{3, 4, 2});
        body.randomize(seed, true).effects({"drag"});
        body.set("drag", "current", {current[0], current[1], current[2]});
        body.setup.options.integrator = LIMAX_SYMPLECTIC_EULER;
        body.setup.options.time_step = h;
        stage bare(lattice{3, 4, 2});
        bare.randomize(seed, true);
        bare.setup.options = body.setup.options;

        const spring_body masses = body.body();
        draws draw{seed};
        std::vector<double> x, v, all_x(std::size_t(3 * masses.count)), all_v(all_x.size());
        for (int32_t i = 0; i < masses.masses; ++i) {
            const int32_t site = masses.sites[i];
            const int at[3] = {site % 4, site / 4 % 5, site / 20};
            for (int axis = 0; axis < 3; ++axis) {
                x.push_back(0.1 * at[axis] + 0.02 * draw());
                v.push_back(draw());
                all_x[std::size_t(3 * site + axis)] = x.back();
                all_v[std::size_t(3 * site + axis)] = v.back();
            }
        }
        const auto end = [&](const stage& of) {
            const auto run = of.open();
            run->place(0, x.data(), v.data());
            run->advance(1.0, 1);
            return state_of(*run).velocities;
        };
        const std::vector<double> with = end(body), without = end(bare);
        const std::vector<double> expected = impulses_of_faces(body, all_x, all_v, h, current);
        double worst = 0, most = 0, sum = 0;
        for (int32_t i = 0; i < masses.masses; ++i)
            for (int32_t axis = 0; axis < 3; ++axis) {
                const auto k = std::size_t(3 * i + axis);
                const double took = (with[k] - without[k]) * double(masses.mass[masses.sites[i]]);
                const double impulse = expected[std::size_t(3 * masses.sites[i] + axis)];
                worst = std::max(worst, std::fabs(took - impulse));
                most = std::max(most, std::fabs(impulse));
                sum += took - impulse;
            }
        CHECK(most > 1e-8);
        CHECK(worst < 1e-7 * most);
        CHECK(std::fabs(sum) < 1e-7 * most);
    }
}
