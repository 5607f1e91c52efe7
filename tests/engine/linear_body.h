// linear_body.h: a body linearised about rest, as dense matrices, written without the engine's own.
#pragma once

#include <Eigen/Dense>
#include <utility>
#include <vector>

#include "stage.h"

namespace limax::test {

// M^-1 K and M^-1 C of a body linearised about rest, [3 mass][3 mass]. With ground, the lowest
// masses are held by it from both sides.
struct linear_body {
    Eigen::MatrixXd stiffness, damping;

    linear_body(const stage& scene, bool with_damping, bool with_ground) {
        const spring_body body = scene.body();
        const lattice grid = body.grid;
        std::vector<int> number(grid.sites(), -1);
        for (int32_t i = 0; i < body.masses; ++i) number[body.sites[i]] = i;
        const int size = 3 * body.masses;
        stiffness = damping = Eigen::MatrixXd::Zero(size, size);
        for (int d = 0; d < direction_count; ++d) {
            const Eigen::Vector3d e =
                Eigen::Vector3d(directions[d].x, directions[d].y, directions[d].z).normalized();
            for (int64_t near = 0; near + grid.step(directions[d]) < grid.sites(); ++near) {
                const int64_t slot = d * body.count + near;
                if (body.stiffness[slot] == 0) continue;
                const int i = number[near], j = number[near + grid.step(directions[d])];
                for (const auto& [matrix, value] :
                     {std::pair<Eigen::MatrixXd*, double>{&stiffness, body.stiffness[slot]},
                      {&damping, with_damping ? body.damping[slot] : 0.0f}}) {
                    const Eigen::Matrix3d block = value * e * e.transpose();
                    matrix->block<3, 3>(3 * i, 3 * i) += block;
                    matrix->block<3, 3>(3 * j, 3 * j) += block;
                    matrix->block<3, 3>(3 * i, 3 * j) -= block;
                    matrix->block<3, 3>(3 * j, 3 * i) -= block;
                }
            }
        }
        const int64_t layer = int64_t(grid.nx + 1) * (grid.ny + 1);
        for (int32_t i = 0; i < body.masses; ++i) {
            const double mass = body.mass[body.sites[i]];
            if (with_ground && body.sites[i] / layer == body.corner[2]) {
                stiffness(3 * i + 2, 3 * i + 2) += 1e5;
                damping(3 * i + 2, 3 * i + 2) += 2 * 0.1 * std::sqrt(1e5 * mass);
            }
            stiffness.middleRows<3>(3 * i) /= mass;
            damping.middleRows<3>(3 * i) /= mass;
        }
    }
};

}  // namespace limax::test
