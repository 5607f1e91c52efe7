// self_contacts.h: which masses of one robot may meet, for effects between masses that no spring
// joins. Only masses on the surface count. SI units.
//
// Pairs that may come within reach are listed with a margin, from a sorted grid of cells; the list
// holds until a mass has moved half the margin, so that it never lacks a pair that is within reach.
// Pairs are sorted by their sites, and a pair out of reach adds nothing, so results do not depend
// on when the list was made.
#pragma once

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "backend/cpu/passes.h"
#include "physics/separation.h"

namespace limax::cpu {

template <class S>
class self_contacts {
public:
    // `reach` and `edge` in m.
    self_contacts(const spring_body& body, double reach, double edge)
        : reach_(reach), margin_(margin_share * edge) {
        std::vector<std::vector<int32_t>> joined(std::size_t(body.grid.sites()));
        for (int d = 0; d < direction_count; ++d) {
            const int64_t step = body.grid.step(directions[d]);
            for (int64_t near = 0; near + step < body.grid.sites(); ++near)
                if (body.stiffness[d * body.count + near] > 0) {
                    joined[std::size_t(near)].push_back(int32_t(near + step));
                    joined[std::size_t(near + step)].push_back(int32_t(near));
                }
        }
        for (int32_t i = 0; i < body.masses; ++i) {
            const int32_t site = body.sites[i];
            std::vector<int32_t>& springs = joined[std::size_t(site)];
            // inside a body springs go out in all directions
            if (springs.size() == 2 * direction_count) continue;
            std::sort(springs.begin(), springs.end());
            surface_.push_back({site, S(body.mass[site]), springs});
        }
        listed_at_.resize(3 * surface_.size(), S(std::nan("")));
    }

    // Calls visit(near, far, place) for every pair of masses within reach, in the state
    // `seen`, near below far; `place` is the law's state and the unit vector from near to far.
    struct pair {
        effects::pair_state<S> state;
        S normal[3];
    };
    template <class Visit>
    void each(const S* const position[3], const S* const velocity[3], const Visit& visit) {
        if (!list_holds(position)) list(position);
        for (const auto& [a, b] : pairs_) {
            const mass &near = surface_[std::size_t(a)], &far = surface_[std::size_t(b)];
            const auto between = [&](const S* const of[3]) -> separation<S> {
                return {of[0][far.site] - of[0][near.site], of[1][far.site] - of[1][near.site],
                        of[2][far.site] - of[2][near.site]};
            };
            const separation<S> e = between(position), w = between(velocity);
            const S squared = dot(e, e);
            if (!(squared < S(reach_ * reach_))) continue;
            const distance<S> apart = contact_distance(squared);
            const separation<S> n{e.x * apart.inverse, e.y * apart.inverse, e.z * apart.inverse};
            pair found{{}, {n.x, n.y, n.z}};
            found.state.depth = S(reach_) - apart.length;
            found.state.rate = dot(w, n);
            found.state.reduced_mass = near.weight * far.weight / (near.weight + far.weight);
            visit(near.site, far.site, found);
        }
    }

private:
    // As a share of an edge: a larger margin makes longer lists, a smaller one more of them.
    static constexpr double margin_share = 0.3;
    // m: masses farther out than any lattice reaches diverge, and have no cell
    static constexpr double farthest = 1e6;

    struct mass {
        int32_t site;
        S weight;                     // kg
        std::vector<int32_t> joined;  // sites at the other ends of its springs, ascending
    };
    struct cell_entry {
        int64_t x, y, z;
        int32_t index;  // in surface_
        bool operator<(const cell_entry& other) const {
            return std::tie(x, y, z, index) < std::tie(other.x, other.y, other.z, other.index);
        }
    };

    bool list_holds(const S* const position[3]) const {
        const S most = S(0.25 * margin_ * margin_);
        bool holds = true;
        for (std::size_t i = 0; i < surface_.size(); ++i) {
            S squared = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const S moved = position[axis][surface_[i].site] - listed_at_[3 * i + axis];
                squared = fma(moved, moved, squared);
            }
            holds &= squared <= most;  // not before the first list
        }
        return holds;
    }

    void list(const S* const position[3]) {
        pairs_.clear();
        cells_.clear();
        const double size = reach_ + margin_;
        for (std::size_t i = 0; i < surface_.size(); ++i) {
            int64_t cell[3];
            bool near = true;
            for (int axis = 0; axis < 3; ++axis) {
                const S place = position[axis][surface_[i].site];
                listed_at_[3 * i + axis] = place;
                near &= std::fabs(double(place)) < farthest;
                cell[axis] = near ? int64_t(std::floor(double(place) / size)) : 0;
            }
            if (near) cells_.push_back({cell[0], cell[1], cell[2], int32_t(i)});
        }
        std::sort(cells_.begin(), cells_.end());
        for (const cell_entry& from : cells_)
            for (int64_t x = from.x - 1; x <= from.x + 1; ++x)
                for (int64_t y = from.y - 1; y <= from.y + 1; ++y) {
                    // the three cells along z lie one after the other
                    auto to = std::lower_bound(cells_.begin(), cells_.end(),
                                               cell_entry{x, y, from.z - 1, 0});
                    for (; to != cells_.end() && to->x == x && to->y == y && to->z <= from.z + 1;
                         ++to)
                        if (to->index > from.index) consider(position, from.index, to->index);
                }
        std::sort(pairs_.begin(), pairs_.end());
    }

    // Joined by a spring, or by two in a chain.
    static bool neighbours(const mass& a, const mass& b) {
        if (std::binary_search(a.joined.begin(), a.joined.end(), b.site)) return true;
        auto i = a.joined.begin(), j = b.joined.begin();
        while (i != a.joined.end() && j != b.joined.end()) {
            if (*i == *j) return true;
            ++(*i < *j ? i : j);
        }
        return false;
    }

    void consider(const S* const position[3], int32_t a, int32_t b) {
        const mass &near = surface_[std::size_t(a)], &far = surface_[std::size_t(b)];
        double squared = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double e = double(position[axis][far.site]) - double(position[axis][near.site]);
            squared += e * e;
        }
        const double most = reach_ + margin_;
        if (squared < most * most && !neighbours(near, far)) pairs_.emplace_back(a, b);
    }

    const double reach_, margin_;    // m
    std::vector<mass> surface_;      // in ascending order of sites
    std::vector<S> listed_at_;       // places when the list was made, [mass][3]
    std::vector<cell_entry> cells_;  // scratch of list()
    std::vector<std::pair<int32_t, int32_t>> pairs_;
};

}  // namespace limax::cpu
