// modes_test.cpp: natural modes against a dense solution of matrices that the test writes itself.
// tests/suites/robot/modes.lua compares them with motion.
#include "physics/modes.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>

#include "linear_body.h"

using namespace limax;
using namespace limax::test;

namespace {

// w^2 of all modes, ascending, and x.C x / (2 w x.M x) of each.
struct dense_modes {
    Eigen::VectorXd squares, ratios;

    explicit dense_modes(const linear_body& body) {
        // M^-1 K has the eigenvectors of K x = w^2 M x
        const Eigen::EigenSolver<Eigen::MatrixXd> solver(body.stiffness);
        const Eigen::MatrixXd left =
            solver.pseudoEigenvectors().inverse() * body.damping * solver.pseudoEigenvectors();
        const Eigen::VectorXd found = solver.eigenvalues().real();
        std::vector<int> order(std::size_t(found.size()));
        std::iota(order.begin(), order.end(), 0);
        std::sort(order.begin(), order.end(), [&](int i, int j) { return found[i] < found[j]; });
        squares = found(order);
        ratios = left.diagonal()(order).array() / (2 * squares.array().abs().sqrt());
    }
};

constexpr double turn = 2 * 3.14159265358979323846;

}  // namespace

TEST_CASE("modes of a body are those of its dense matrices") {
    // few unknowns, solved densely, and many, by Lanczos
    for (const lattice grid : {lattice{2, 2, 1}, lattice{5, 4, 3}})
        for (const bool on_ground : {false, true}) {
            CAPTURE(grid.nx);
            CAPTURE(on_ground);
            stage bodies(grid);
            bodies.randomize(3).effects({"ground", "damping"});
            const spring_body body = bodies.body();
            // on the ground, so little below it that no spring notices
            std::vector<double> pose;
            for (int32_t i = 0; i < body.masses; ++i) {
                const int site = body.sites[i], across = grid.nx + 1, along = grid.ny + 1;
                pose.insert(pose.end(), {0.1 * (site % across), 0.1 * (site / across % along),
                                         0.1 * (site / (across * along)) - 1e-9});
            }
            const natural_modes found =
                modes_of(body, bodies.setup.scene, on_ground ? pose.data() : nullptr, 12);
            const dense_modes expected(linear_body(bodies, true, on_ground));
            // the ground holds three motions of the six, without friction
            REQUIRE(found.rigid == (on_ground ? 3 : 6));
            REQUIRE(found.modes.size() == 12);
            for (int k = 0; k < 12; ++k) {
                CAPTURE(k);
                const double w = std::sqrt(expected.squares[found.rigid + k]);
                CHECK(found.modes[k].frequency == doctest::Approx(w / turn).epsilon(1e-7));
                CHECK(found.modes[k].damping_ratio ==
                      doctest::Approx(expected.ratios[found.rigid + k]).epsilon(1e-5));
            }
        }
}

TEST_CASE("a voxel has the modes of a cube, each as often as its symmetry asks") {
    stage bodies({1, 1, 1}, 1, 3);
    bodies.effects({"damping"});
    const natural_modes found = modes_of(bodies.body(), bodies.setup.scene, nullptr, 100);
    REQUIRE(found.modes.size() == 18);
    const double of_one = std::sqrt(1e3 / 0.1) / turn, zeta = 0.1 * std::sqrt(2.0);
    // in units of k / m: two stretches, six bends and shears, two twists, seven, and the breath
    const std::pair<int, double> groups[] = {{2, 1}, {6, 2}, {2, 3}, {7, 4}, {1, 8}};
    auto mode = found.modes.begin();
    for (const auto& [count, square] : groups)
        for (int k = 0; k < count; ++k, ++mode) {
            CHECK(mode->frequency == doctest::Approx(of_one * std::sqrt(square)).epsilon(1e-7));
            // c = 2 zeta sqrt(k m / 2) of every spring: C = c / k K
            CHECK(mode->damping_ratio ==
                  doctest::Approx(zeta / 2 * std::sqrt(square)).epsilon(1e-6));
        }
}
