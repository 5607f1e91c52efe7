// block_plan.cpp: the search for a layout without bank conflicts.
//
// Shared memory has 32 banks of 4 bytes. A corner is read in 16 and 8 bytes, a sum written and read
// in 8 and 4 (doubles take several passes of the same). The hardware serves as many lanes at once
// as read 128 bytes: 8, 16 or 32, which take one wavefront if their places differ modulo that
// number. The cells of a slot have their corners at the same offsets, so a slot whose cells are in
// different banks is free of conflicts at every corner.
#include "backend/cuda/plan/block_plan.h"

#include "backend/cuda/kernels/cells.h"
#include "limax.h"

#include <algorithm>
#include <array>

namespace limax::cuda {

namespace {

constexpr int lanes = 32, cube = cube_axes, mixed = 0;
// Warps of a block beyond which a thread has too few registers for a spring.
constexpr int most_warps = 16, most_warps_of_double = 8;
// The same where the block is the only one of its multiprocessor.
constexpr int most_warps_of_one = 8;
// Padding may take this part of the memory more, or as many places for each warp of a block as
// leave room for 16 warps on a large GPU.
constexpr int padding_share = 6, places_of_warp = 109;
// Bytes of shared memory for the few values that a block has besides columns, and their alignment.
constexpr std::size_t shared_slack = 512;
// Layouts that are worth the search for the best lanes.
constexpr std::size_t tried_layouts = 4;

struct layout {
    lattice grid;
    int row, plane;

    int place(int x, int y, int z) const { return x + y * row + z * plane; }
    int place(int site) const {
        const int along_x = grid.nx + 1, along_y = grid.ny + 1;
        return place(site % along_x, site / along_x % along_y, site / (along_x * along_y));
    }
    // The places of the lattice and of what extends beyond it.
    int places() const { return place(grid.nx + 1, grid.ny + 1, grid.nz + 1) + 1; }
};

// A slot of cells and their places, below 0 for a free lane.
struct slot {
    int axes;  // of its squares, or of its cubes; `mixed` for any of the rim
    std::array<cell_entry, lanes> cell;
    std::array<int, lanes> place;

    explicit slot(int of_slot) : axes(of_slot) {
        cell.fill({-1, 0});
        place.fill(-1);
    }
    bool takes(const cell_entry& other) const {
        if (axes == cube || other.axes == cube) return axes == other.axes;
        return axes == mixed || (other.axes & ~axes) == 0;
    }
    void put(int lane, const cell_entry& entry, int at) {
        cell[lane] = entry;
        place[lane] = at;
    }
};

// Wavefronts that a slot takes in a step.
int wavefronts(const slot& s) {
    // by the number of lanes that are served at once
    const auto passes = [&](int at_once) {
        int sum = 0;
        for (int first = 0; first < lanes; first += at_once) {
            std::array<int, lanes> used{};
            int most = 0;
            for (int lane = first; lane < first + at_once; ++lane)
                if (s.place[lane] >= 0) most = std::max(most, ++used[s.place[lane] % at_once]);
            sum += most;
        }
        return sum;
    };
    // all corners but the lowest are read and their sums written; the mass shows itself and reads
    // its sums in the cells around
    const int read = s.axes == cube ? corners - 1 : 3;
    return (read + 1) * (passes(8) + passes(16)) + (read + corners - 1) * (passes(16) + passes(32));
}

// The axes of the square in whose place a cell is, the topmost site and a cube included.
int square_of(int axes) {
    return __builtin_popcount(unsigned(axes)) > 1 ? axes : axes == 4 ? 5 : 3;
}

// Puts a cell into the free lane where it takes the fewest wavefronts, or into a new slot.
void put_anywhere(std::vector<slot>& slots, const cell_entry& cell, int place) {
    slot* best = nullptr;
    int best_lane = place % lanes, least = 0;
    for (slot& s : slots) {
        if (!s.takes(cell)) continue;
        const int before = wavefronts(s);
        for (int lane = 0; lane < lanes; ++lane) {
            if (s.place[lane] >= 0) continue;
            s.put(lane, cell, place);
            const int added = wavefronts(s) - before;
            s.put(lane, {-1, 0}, -1);
            if (!best || added < least) best = &s, best_lane = lane, least = added;
        }
    }
    // bars and the topmost site may be without a slot
    if (!best) best = &slots.emplace_back(square_of(cell.axes));
    best->put(best_lane, cell, place);
}

// Assigns each cell the lane of its bank, in the first slot where that lane is free, and the rest
// to free lanes. There are as many slots as the cells of each orientation need.
std::vector<slot> assign(const std::vector<cell_entry>& cells, const layout& at,
                         const std::vector<int>& kinds) {
    std::vector<slot> slots;
    for (const int axes : kinds) {
        const auto takes = [axes](const cell_entry& cell) {
            return axes == mixed || cell.axes == axes;
        };
        for (std::ptrdiff_t left = std::count_if(cells.begin(), cells.end(), takes); left > 0;
             left -= lanes)
            slots.emplace_back(axes);
    }
    // what fits the fewest slots first
    for (int many = 3; many >= 0; --many) {
        std::vector<cell_entry> left;
        for (const cell_entry& cell : cells) {
            if (__builtin_popcount(unsigned(cell.axes)) != many) continue;
            const int place = at.place(cell.site), lane = place % lanes;
            const auto free_slot = std::find_if(slots.begin(), slots.end(), [&](const slot& s) {
                return s.place[lane] < 0 && s.takes(cell);
            });
            if (free_slot != slots.end())
                free_slot->put(lane, cell, place);
            else
                left.push_back(cell);
        }
        for (const cell_entry& cell : left) put_anywhere(slots, cell, at.place(cell.site));
    }
    return slots;
}

// Exchanges lanes, of one slot or of two, as long as that saves wavefronts.
void refine(std::vector<slot>& slots) {
    constexpr int most_sweeps = 8;
    std::vector<int> cost, least;
    for (const slot& s : slots) {
        cost.push_back(wavefronts(s));
        slot spread(s.axes);
        for (int lane = 0; lane < lanes; ++lane) spread.place[lane] = lane;
        least.push_back(wavefronts(spread));
    }
    const auto exchange = [](slot& a, int i, slot& b, int j) {
        std::swap(a.cell[i], b.cell[j]);
        std::swap(a.place[i], b.place[j]);
    };
    bool improved = true;
    for (int sweep = 0; sweep < most_sweeps && improved; ++sweep) {
        improved = false;
        for (std::size_t a = 0; a < slots.size() * lanes; ++a)
            for (std::size_t b = 0; b < slots.size() * lanes; ++b) {
                const std::size_t i = a / lanes, j = b / lanes;
                slot &one = slots[i], &other = slots[j];
                const int here = int(a % lanes), there = int(b % lanes);
                if (cost[i] == least[i]) break;
                if (one.place[here] < 0 && other.place[there] < 0) continue;
                if (one.place[here] >= 0 && !other.takes(one.cell[here])) continue;
                if (other.place[there] >= 0 && !one.takes(other.cell[there])) continue;
                exchange(one, here, other, there);
                const int of_one = wavefronts(one), of_other = i == j ? 0 : wavefronts(other);
                if (of_one + of_other < cost[i] + (i == j ? 0 : cost[j])) {
                    cost[i] = of_one;
                    if (i != j) cost[j] = of_other;
                    improved = true;
                } else {
                    exchange(one, here, other, there);
                }
            }
    }
}

int axes_of(const lattice& grid, int site) {
    const int x = site % (grid.nx + 1), y = site / (grid.nx + 1) % (grid.ny + 1),
              z = site / ((grid.nx + 1) * (grid.ny + 1));
    return (x < grid.nx) | (y < grid.ny) << 1 | (z < grid.nz) << 2;
}

// Gives every free lane a place of its own that no mass has, in the lane's bank where one is left.
// `places` grows where there is none.
void fill(std::vector<slot>& slots, const layout& at, int& places) {
    const int reach = at.place(1, 1, 1);
    std::vector<bool> taken(std::size_t(places), false);
    for (int site = 0; site < int(at.grid.sites()); ++site) taken[at.place(site)] = true;
    for (slot& s : slots)
        for (int lane = 0; lane < lanes; ++lane) {
            if (s.place[lane] >= 0) continue;
            int found = -1;
            for (int place = 0; place + reach < places; ++place) {
                if (taken[place]) continue;
                if (found < 0) found = place;
                if (place % lanes != lane) continue;
                found = place;
                break;
            }
            if (found < 0) {
                found = places - reach;
                taken.resize(std::size_t(++places), false);
            }
            taken[found] = true;
            s.put(lane, {-1 - found, 0}, found);
        }
}

// Cubes and squares that cannot all have the lanes of their banks.
int misfits(const layout& at) {
    std::array<std::array<int, lanes>, 8> used{};
    std::array<int, 8> count{};
    for (int site = 0; site < int(at.grid.sites()); ++site) {
        const int axes = axes_of(at.grid, site);
        ++count[axes];
        ++used[axes][at.place(site) % lanes];
    }
    int sum = 0;
    for (const int axes : {cube, 3, 5, 6})
        for (const int cells : used[axes])
            sum += std::max(0, cells - (count[axes] + lanes - 1) / lanes);
    return sum;
}

struct candidate {
    int64_t cost;
    block_plan plan;
};

candidate plan_with(const lattice& grid, int row, int plane) {
    candidate out{0, {}};
    block_plan& plan = out.plan;
    plan.row = row;
    plan.plane = plane;
    const layout at{grid, row, plane};
    plan.places = at.places();
    std::vector<cell_entry> cubes, rim;
    for (int site = 0; site < int(grid.sites()); ++site) {
        const int axes = axes_of(grid, site);
        (axes == cube ? cubes : rim).push_back({site, axes});
    }
    std::vector<slot> slots = assign(cubes, at, {cube}), of_rim = assign(rim, at, {3, 5, 6});
    std::vector<slot> fewer = assign(rim, at, {mixed});
    plan.mixed = fewer.size() < of_rim.size();
    if (plan.mixed) of_rim = std::move(fewer);
    refine(slots);
    refine(of_rim);
    plan.cube_slots = int(slots.size());
    plan.rim_slots = int(of_rim.size());
    slots.insert(slots.end(), of_rim.begin(), of_rim.end());
    fill(slots, at, plan.places);
    for (const slot& s : slots) {
        out.cost += wavefronts(s);
        for (const cell_entry& cell : s.cell)
            plan.cells.push_back(
                {cell.site, cell.axes + 8 * (s.axes == mixed ? square_of(cell.axes) : s.axes)});
    }
    return out;
}

}  // namespace

std::optional<block_shape> shape_block(const block_plan& plan, const kernel_needs& needs,
                                       std::size_t most_shared_bytes, kernel_form form) {
    const bool in_double = needs.precision == LIMAX_DOUBLE;
    const int slots = plan.cube_slots + plan.rim_slots;
    // a cube and a square a thread, or with two squares in the smallest lattices
    const bool one_warp = plan.cube_slots == 1 && slots <= 3;
    const int warps_of_many = one_warp ? 1 : std::max(plan.cube_slots, (slots + 1) / 2);
    if (warps_of_many > (in_double ? most_warps_of_double : most_warps)) return std::nullopt;
    const bool one = form == kernel_form::one && slots <= most_warps_of_one;
    const int warps = one ? slots : warps_of_many;

    // A scheduler shares 512 registers of a lane among its warps: five of them have 96 each, four
    // 128, three 168, two 255.
    const int warps_at_once = in_double                     ? 8
                              : needs.many_laws || one_warp ? 12
                              : needs.shares_velocity       ? 16
                                                            : 20;
    block_shape shape;
    shape.threads = warps * lanes;
    shape.blocks = one ? 1 : std::max(1, warps_at_once / warps);

    // block_memory of kernels/block.h, which asserts that this suffices
    const int cube_rounds = (plan.cube_slots + warps - 1) / warps;
    const int rim_rounds = (slots + warps - 1) / warps - cube_rounds;
    const std::size_t real = in_double ? 8 : 4;
    const std::size_t of_class = needs.spring_columns == 3 ? 4 : std::size_t(needs.spring_columns);
    const auto places = std::size_t(plan.places);
    shape.shared_bytes =
        places * ((needs.shares_velocity ? 6 : 4) + 3 * (corners - 1)) * real +
        places * (needs.has_faces ? 6 : 0) * real +
        std::size_t(rim_rounds * shape.threads) *
            ((rim_classes * of_class + 1) * sizeof(float) + (plan.mixed ? 16 : 0) + 4 * real) +
        check_interval * 2 * real + std::size_t(warps + 1) * block_sums * sizeof(int64_t) +
        sizeof(robot_record) + needs.control + needs.drive + shared_slack;
    if (shape.shared_bytes > most_shared_bytes) return std::nullopt;
    return shape;
}

block_plan plan_block(const lattice& grid) {
    struct strides {
        int misfits, places, row, plane;
    };
    std::vector<strides> choices;
    const int along_x = grid.nx + 1, along_y = grid.ny + 1;
    const int unpadded = layout{grid, along_x, along_x * along_y}.places();
    const int cubes = (grid.nx * grid.ny * grid.nz + lanes - 1) / lanes;
    const int slots = (int(grid.sites()) + lanes - 1) / lanes;
    const int most = std::max(unpadded + unpadded / padding_share,
                              std::max(cubes, (slots + 1) / 2) * places_of_warp);
    // beyond these the classes of places repeat
    for (int row = along_x; row < along_x + lanes; ++row)
        for (int plane = row * grid.ny + along_x; plane < row * grid.ny + along_x + lanes;
             ++plane) {
            // the first choice, without padding, always stays
            const layout at{grid, row, plane};
            if (!choices.empty() && at.places() > most) break;
            choices.push_back({misfits(at), at.places(), row, plane});
        }
    std::stable_sort(choices.begin(), choices.end(), [](const strides& a, const strides& b) {
        return a.misfits != b.misfits ? a.misfits < b.misfits : a.places < b.places;
    });
    choices.resize(std::min(choices.size(), tried_layouts));
    candidate best{0, {}};
    for (const strides& choice : choices) {
        candidate tried = plan_with(grid, choice.row, choice.plane);
        // two per cent more wavefronts are worth a smaller memory
        if (best.plan.cells.empty() || 102 * tried.cost < 100 * best.cost) best = std::move(tried);
    }
    return best.plan;
}

std::shared_ptr<const block_plan> block_plans::of(const lattice& grid) {
    const std::lock_guard lock(mutex_);
    auto& plan = plans_[{grid.nx, grid.ny, grid.nz}];
    if (!plan) plan = std::make_shared<const block_plan>(plan_block(grid));
    return plan;
}

}  // namespace limax::cuda
