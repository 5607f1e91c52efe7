// pareto.cpp: efficient non-dominated sort with binary search (ENS-BS; X. Zhang et al., IEEE Trans.
// Evol. Comp. 19, 2015) and the crowding distance of NSGA-II (K. Deb et al., 2002).
#include "genome/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "base/error.h"

namespace limax {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Points without their copies, best first: by the first objective, ties by the second, and so on.
// A point is dominated only by points before it.
struct sorted_points {
    int32_t objectives;
    std::vector<double> values;     // [point][objective]
    std::vector<int32_t> first;     // [point]: the lowest index of the copies
    std::vector<int32_t> point_of;  // [index]: the point that it is a copy of

    const double* at(int32_t point) const {
        return values.data() + std::size_t(point) * std::size_t(objectives);
    }
    int32_t count() const { return int32_t(first.size()); }
};

sorted_points sorted(const double* values, int32_t count, int32_t objectives) {
    const auto at = [&](int32_t i) { return values + int64_t(i) * objectives; };
    std::vector<int32_t> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    // stable: of copies the lowest index comes first
    std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
        return std::lexicographical_compare(at(b), at(b) + objectives, at(a), at(a) + objectives);
    });
    sorted_points points{objectives, {}, {}, std::vector<int32_t>(order.size())};
    points.values.reserve(order.size() * std::size_t(objectives));
    for (const int32_t i : order) {
        if (points.first.empty() ||
            !std::equal(at(i), at(i) + objectives, at(points.first.back()))) {
            points.first.push_back(i);
            points.values.insert(points.values.end(), at(i), at(i) + objectives);
        }
        points.point_of[std::size_t(i)] = points.count() - 1;
    }
    return points;
}

// Whether a point before `later` dominates it; the first objective is known to be no smaller.
bool dominates(const double* earlier, const double* later, int32_t objectives) {
    for (int32_t k = 1; k < objectives; ++k)
        if (earlier[k] < later[k]) return false;
    return true;
}

// Each front holds points in their order.
using fronts_of_points = std::vector<std::vector<int32_t>>;

// A point that no one of a front dominates is not dominated by later fronts either, hence the
// binary search.
fronts_of_points fronts_of(const sorted_points& points) {
    fronts_of_points fronts;
    const int32_t objectives = points.objectives;
    const auto dominated_by = [&](const std::vector<int32_t>& front, int32_t point) {
        const double* const own = points.at(point);
        // with two objectives the last of a front is its largest in the second
        const auto end = objectives <= 2 ? front.rbegin() + 1 : front.rend();
        return std::any_of(front.rbegin(), end, [&](int32_t other) {
            return dominates(points.at(other), own, objectives);
        });
    };
    for (int32_t point = 0; point < points.count(); ++point) {
        const auto found = std::partition_point(
            fronts.begin(), fronts.end(),
            [&](const std::vector<int32_t>& front) { return dominated_by(front, point); });
        if (found == fronts.end())
            fronts.push_back({point});
        else
            found->push_back(point);
    }
    return fronts;
}

// Adds to `crowding` [point] the gaps of one objective in a front, which is sorted by it here.
void add_gaps(const sorted_points& points, std::vector<int32_t>& front, int32_t objective,
              std::vector<double>& crowding) {
    const auto value = [&](int32_t point) { return points.at(point)[objective]; };
    // ties by the points' order
    std::sort(front.begin(), front.end(), [&](int32_t a, int32_t b) {
        return value(a) != value(b) ? value(a) < value(b) : a < b;
    });
    const double extent = value(front.back()) - value(front.front());
    if (!(extent > 0)) return;
    crowding[std::size_t(front.front())] = crowding[std::size_t(front.back())] = infinity;
    if (extent == infinity) return;
    for (std::size_t k = 1; k + 1 < front.size(); ++k)
        crowding[std::size_t(front[k])] += (value(front[k + 1]) - value(front[k - 1])) / extent;
}

void require_numbers(const double* values, int32_t count, int32_t objectives) {
    require_range("number of points", count, 0, std::numeric_limits<int32_t>::max(), "");
    require_range("number of objectives", objectives, 1, most_objectives, "");
    for (int64_t k = 0; k < int64_t(count) * objectives; ++k)
        if (std::isnan(values[k]))
            fail(LIMAX_INVALID_ARGUMENT,
                 format("point %lld, objective %lld: expected a number, got nan",
                        static_cast<long long>(k / objectives + 1),
                        static_cast<long long>(k % objectives + 1)));
}

}  // namespace

void pareto_rank(const double* values, int32_t count, int32_t objectives, int32_t* rank,
                 double* crowding) {
    require_numbers(values, count, objectives);
    const sorted_points points = sorted(values, count, objectives);
    fronts_of_points fronts = fronts_of(points);
    std::vector<int32_t> rank_of(points.first.size());
    std::vector<double> crowding_of(points.first.size(), 0.0);
    for (std::size_t k = 0; k < fronts.size(); ++k) {
        for (const int32_t point : fronts[k]) rank_of[std::size_t(point)] = int32_t(k);
        if (fronts[k].size() == 1) crowding_of[std::size_t(fronts[k][0])] = infinity;
        for (int32_t objective = 0; objective < objectives; ++objective)
            add_gaps(points, fronts[k], objective, crowding_of);
    }
    for (int32_t i = 0; i < count; ++i) {
        const auto point = std::size_t(points.point_of[std::size_t(i)]);
        rank[i] = rank_of[point];
        crowding[i] = points.first[point] == i ? crowding_of[point] : 0.0;
    }
}

}  // namespace limax
