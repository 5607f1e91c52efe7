// modes.cpp: the eigenproblem of a body, scaled by its masses: A = M^-1/2 K M^-1/2. Few unknowns
// are solved densely, many by Lanczos iterations on (A - shift)^-1 (Spectra). Lanczos may miss
// copies of an equal frequency: the signs of a factorisation of A - x count the eigenvalues below x
// (Sylvester's law of inertia), and the iterations go on, without what is found, until none is
// missing.
#include "physics/modes.h"

#include <Spectra/SymEigsShiftSolver.h>
#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "physics/held.h"

namespace limax {

namespace {

using sparse = Eigen::SparseMatrix<double>;
using factorisation = Eigen::SimplicialLDLT<sparse>;
using triplets = std::vector<Eigen::Triplet<double>>;

constexpr double radians_of_turn = 6.283185307179586;
// Shares of the bound of A's eigenvalues: what is smaller is rigid, rounding being 1e-15 of it, and
// how far below 0 the shift of Lanczos is. The first mode of a beam of 100 voxels is at 5e-10.
constexpr double rigid_share = 1e-11, shift_share = 1e-9;
// Unknowns up to which all modes are computed densely, and rounds of Lanczos at most.
constexpr int dense_size = 200, most_rounds = 20;
// Equal frequencies differ by less.
constexpr double same_share = 1e-6;

// The directions in which a mass may move, columns of `axes`, and its first unknown.
struct freedom {
    int first = 0, count = 3;
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

struct linear_body {
    std::vector<freedom> masses;
    std::vector<double> roots;  // of the masses, sqrt(kg)
    sparse stiffness, damping;  // M^-1/2 K M^-1/2 in 1/s^2 and M^-1/2 C M^-1/2 in 1/s
    // M^-1/2 times the forces of the muscles' sine and cosine, N / kg^1/2
    Eigen::VectorXd sine, cosine;
    int size() const { return int(stiffness.rows()); }
};

// The contacts of a mass.
struct touching {
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero(), damping = Eigen::Matrix3d::Zero();
    std::vector<Eigen::Vector3d> normals;
};

Eigen::Vector3d vector_of(effects::up) { return {0, 0, 1}; }
Eigen::Vector3d vector_of(const effects::vector<double>& n) { return {n.x, n.y, n.z}; }

touching contacts_at(const scene& scene, const double* place, double mass) {
    touching out;
    const double world[3] = {0, 0, 0};
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::is_contact<E>)
            for (int i = 0; i < scene.instances(effects::index_of<E>); ++i) {
                const auto contact = effects::make_params<E, double>(
                    scene.values(effects::index_of<E>, i), world, scene.heights());
                const auto point =
                    E::surface(contact, effects::vector<double>{place[0], place[1], place[2]});
                if (!(point.depth > 0)) continue;
                const Eigen::Vector3d n = vector_of(point.normal);
                const effects::stiffness_damping one = effects::contact_bound(contact, mass);
                out.stiffness += one.stiffness * n * n.transpose();
                out.damping += one.damping * n * n.transpose();
                out.normals.push_back(n);
            }
    });
    return out;
}

// Friction leaves a mass the direction of the one surface that it touches, or none.
freedom freedom_of(const touching& contact, bool friction) {
    freedom out;
    if (!friction || contact.normals.empty()) return out;
    out.axes.col(0) = contact.normals[0];
    out.count = 1;
    for (const Eigen::Vector3d& n : contact.normals)
        if (std::abs(n.dot(contact.normals[0])) < 1 - 1e-9) out.count = 0;
    return out;
}

// Collects 3 x 3 blocks between masses, in the unknowns.
struct assembly {
    const std::vector<freedom>& masses;
    const std::vector<double>& roots;  // of the masses, sqrt(kg)
    triplets entries;

    void add(int i, int j, const Eigen::Matrix3d& block) {
        const freedom &a = masses[i], &b = masses[j];
        for (int p = 0; p < a.count; ++p)
            for (int q = 0; q < b.count; ++q)
                entries.emplace_back(
                    a.first + p, b.first + q,
                    a.axes.col(p).dot(block * b.axes.col(q)) / (roots[i] * roots[j]));
    }
    void add_spring(int i, int j, const Eigen::Matrix3d& block) {
        add(i, i, block);
        add(j, j, block);
        add(i, j, -block);
        add(j, i, -block);
    }
    sparse matrix(int size) const {
        sparse out(size, size);
        out.setFromTriplets(entries.begin(), entries.end());
        return out;
    }
};

// Calls visit(slot, i, j, L0) for each spring, i and j the numbers of its masses.
template <class Visit>
void each_spring(const spring_body& body, const Visit& visit) {
    std::vector<int> number(std::size_t(body.grid.sites()), -1);
    for (int32_t i = 0; i < body.masses; ++i) number[std::size_t(body.sites[i])] = i;
    for (int d = 0; d < direction_count; ++d) {
        const int64_t step = body.grid.step(directions[d]);
        for (int64_t site = 0; site + step < body.grid.sites(); ++site) {
            const int64_t slot = d * body.count + site;
            if (body.stiffness[slot] == 0) continue;
            visit(slot, number[std::size_t(site)], number[std::size_t(site + step)], body.rest[d]);
        }
    }
}

linear_body linearised(const spring_body& body, const scene& scene, const double* pose,
                       const std::vector<double>& places) {
    linear_body out;
    const bool friction = scene.has(effects::index_of<effects::friction>);
    const bool damped = scene.has(effects::index_of<effects::damping>);
    const bool wind = scene.has(effects::index_of<effects::wind>);
    const double drag = scene.values(effects::index_of<effects::wind>)[3];
    const int across = body.grid.nx + 1, along = body.grid.ny + 1;
    out.roots.reserve(std::size_t(body.masses));
    std::vector<touching> contacts;
    int size = 0;
    for (int32_t i = 0; i < body.masses; ++i) {
        const int32_t site = body.sites[i];
        const double mass = double(body.mass[site]);
        out.roots.push_back(std::sqrt(mass));
        contacts.push_back(pose ? contacts_at(scene, pose + 3 * std::size_t(i), mass) : touching{});
        freedom mine = freedom_of(contacts.back(), friction);
        if (is_held(scene, body.rest[0], body.corner, site % across, site / across % along,
                    site / (across * along)))
            mine.count = 0;
        mine.first = size;
        size += mine.count;
        out.masses.push_back(mine);
    }
    assembly stiffness{out.masses, out.roots, {}}, damping{out.masses, out.roots, {}};
    out.sine = out.cosine = Eigen::VectorXd::Zero(size);
    const auto push = [&](Eigen::VectorXd& forces, int i, const Eigen::Vector3d& force) {
        const freedom& mine = out.masses[std::size_t(i)];
        forces.segment(mine.first, mine.count) +=
            mine.axes.leftCols(mine.count).transpose() * force / out.roots[std::size_t(i)];
    };
    each_spring(body, [&](int64_t slot, int i, int j, double rest) {
        const Eigen::Map<const Eigen::Vector3d> from(&places[3 * std::size_t(i)]),
            to(&places[3 * std::size_t(j)]);
        const double length = std::max((to - from).norm(), 1e-10);
        const Eigen::Vector3d n = (to - from) / length;
        const Eigen::Matrix3d along_it = n * n.transpose();
        const double k = double(body.stiffness[slot]), tension = 1 - rest / length;
        stiffness.add_spring(
            i, j, k * ((1 - tension) * along_it + tension * Eigen::Matrix3d::Identity()));
        if (damped) damping.add_spring(i, j, double(body.damping[slot]) * along_it);
        if (body.sine.size() == 0) return;
        // a longer rest length pushes the ends apart
        for (const int end : {i, j}) {
            const Eigen::Vector3d apart = (end == j ? k : -k) * n;
            push(out.sine, end, double(body.sine[slot]) * apart);
            push(out.cosine, end, double(body.cosine[slot]) * apart);
        }
    });
    for (int i = 0; i < body.masses; ++i) {
        stiffness.add(i, i, contacts[std::size_t(i)].stiffness);
        damping.add(i, i, contacts[std::size_t(i)].damping);
        if (wind) damping.add(i, i, drag * Eigen::Matrix3d::Identity());
    }
    out.stiffness = stiffness.matrix(size);
    out.damping = damping.matrix(size);
    return out;
}

// The undeformed body, [mass][3], m.
std::vector<double> undeformed(const spring_body& body) {
    std::vector<double> places;
    const int across = body.grid.nx + 1, along = body.grid.ny + 1;
    for (int32_t i = 0; i < body.masses; ++i) {
        const int32_t site = body.sites[i];
        for (const int place : {site % across, site / across % along, site / (across * along)})
            places.push_back(body.rest[0] * place);
    }
    return places;
}

// Factorises A - x for any x.
class shifted {
public:
    explicit shifted(const sparse& a) : a_(a), one_(a.rows(), a.rows()) {
        one_.setIdentity();
        // the same pattern for every x
        solver_.analyzePattern(sparse(a_ - one_));
    }
    const factorisation& at(double x) {
        solver_.factorize(sparse(a_ - x * one_));
        if (solver_.info() != Eigen::Success)
            fail(LIMAX_INTERNAL, "modes: the factorisation of the stiffness failed");
        return solver_;
    }
    // Eigenvalues below x.
    int count_below(double x) { return int((at(x).vectorD().array() < 0).count()); }

private:
    const sparse& a_;
    sparse one_;
    factorisation solver_;
};

// (A - shift)^-1 across the vectors that are found already, for Spectra.
class inverse_across {
public:
    using Scalar = double;
    inverse_across(const factorisation& solver, const Eigen::MatrixXd& found)
        : solver_(solver), found_(found) {}
    Eigen::Index rows() const { return found_.rows(); }
    Eigen::Index cols() const { return found_.rows(); }
    void set_shift(double /*fixed by the factorisation*/) {}
    void perform_op(const double* in, double* out) const {
        Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(in, rows());
        x -= found_ * (found_.transpose() * x);
        x = solver_.solve(x);
        Eigen::Map<Eigen::VectorXd>(out, rows()) = x - found_ * (found_.transpose() * x);
    }

private:
    const factorisation& solver_;
    const Eigen::MatrixXd& found_;
};

// Eigenvectors of A, ascending by eigenvalue.
struct eigenpairs {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
};

// Sorted by the Rayleigh quotients, which err by the square of a vector's error.
eigenpairs sorted(const sparse& a, const Eigen::MatrixXd& vectors) {
    const Eigen::VectorXd values = (vectors.transpose() * (a * vectors)).diagonal();
    std::vector<int> order(std::size_t(values.size()));
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int i, int j) { return values[i] < values[j]; });
    return {values(order), vectors(Eigen::all, order)};
}

eigenpairs lowest_by_lanczos(const sparse& a, shifted& solver, int wanted, double bound) {
    const auto n = int(a.rows());
    eigenpairs pairs{{}, Eigen::MatrixXd(n, 0)};
    for (int round = 0; round < most_rounds; ++round) {
        if (pairs.values.size() >= wanted) {
            const double edge = pairs.values[wanted - 1] * (1 - same_share);
            if (solver.count_below(edge) == (pairs.values.array() < edge).count()) return pairs;
        }
        const int missing = std::max(2, wanted - int(pairs.values.size()));
        const inverse_across inverse(solver.at(-shift_share * bound), pairs.vectors);
        inverse_across operation = inverse;
        Spectra::SymEigsShiftSolver<inverse_across> lanczos(
            operation, missing, std::min(n, std::max(2 * missing + 1, 20)), -shift_share * bound);
        lanczos.init();  // always the same vector
        lanczos.compute(Spectra::SortRule::LargestMagn, 1000, 1e-12);
        const Eigen::MatrixXd fresh = lanczos.eigenvectors();
        Eigen::MatrixXd all(n, pairs.vectors.cols() + fresh.cols());
        all << pairs.vectors, fresh - pairs.vectors * (pairs.vectors.transpose() * fresh);
        for (Eigen::Index k = pairs.vectors.cols(); k < all.cols(); ++k) all.col(k).normalize();
        pairs = sorted(a, all);
    }
    fail(LIMAX_INTERNAL, "modes: the Lanczos iterations did not find all modes");
}

// Displacements of the masses in a mode, the largest of length 1 and upwards, to the right or to
// the back. Returns that length before it is scaled, 1 / kg^1/2.
double write_shape(const linear_body& body, const Eigen::VectorXd& vector,
                   std::vector<double>& shapes) {
    std::vector<Eigen::Vector3d> moves;
    double most = 0, sign = 1;
    for (std::size_t i = 0; i < body.masses.size(); ++i) {
        const freedom& mine = body.masses[i];
        moves.emplace_back(mine.axes.leftCols(mine.count) * vector.segment(mine.first, mine.count) /
                           body.roots[i]);
        // a little more, so that rounding does not choose among equal ones
        if (moves[i].norm() <= most * (1 + 1e-6)) continue;
        most = moves[i].norm();
        int axis = 0;
        moves[i].cwiseAbs().maxCoeff(&axis);
        sign = moves[i][axis] < 0 ? -1 : 1;
    }
    for (const Eigen::Vector3d& move : moves)
        for (int axis = 0; axis < 3; ++axis) shapes.push_back(sign / most * move[axis]);
    return most;
}

}  // namespace

natural_modes modes_of(const spring_body& body, const scene& scene, const double* positions,
                       int32_t count) {
    const std::vector<double> places =
        positions ? std::vector<double>(positions, positions + 3 * std::size_t(body.masses))
                  : undeformed(body);
    const linear_body system = linearised(body, scene, positions, places);
    natural_modes out;
    const int n = system.size();
    if (n == 0) return out;
    const sparse& a = system.stiffness;
    // Gershgorin
    const double bound = (a.cwiseAbs() * Eigen::VectorXd::Ones(n)).maxCoeff();
    shifted solver(a);
    if (solver.count_below(-rigid_share * bound) > 0)
        fail(LIMAX_INVALID_ARGUMENT,
             "modes: this pose is not stable: the body moves away from it; let it settle longer");
    out.rigid = solver.count_below(rigid_share * bound);
    const int wanted = std::min(n, out.rigid + count);
    eigenpairs pairs;
    if (n <= dense_size || 2 * wanted + 2 > n)
        pairs = sorted(
            a, Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd(a)).eigenvectors());
    else
        pairs = lowest_by_lanczos(a, solver, wanted, bound);
    for (int k = out.rigid; k < wanted; ++k) {
        const Eigen::VectorXd x = pairs.vectors.col(k);
        const double w = std::sqrt(pairs.values[k]);
        const double most = write_shape(system, x, out.shapes);
        out.modes.push_back({w / radians_of_turn, x.dot(system.damping * x) / (2 * w),
                             most * std::fabs(x.dot(system.sine)) / (w * w),
                             most * std::fabs(x.dot(system.cosine)) / (w * w)});
    }
    return out;
}

}  // namespace limax
