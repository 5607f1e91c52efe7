// block_plan.cpp: the search for a layout without bank conflicts.
//
// Shared memory has 32 banks of 4 bytes. Every access here is 8 bytes wide (two floats; two passes
// of the same for doubles), which the hardware serves by half warps: 16 lanes take one wavefront
// if their places differ modulo 16. A corner's place is its cell's plus a constant, so a slot
// whose cells lie in different banks stays free of conflicts at all eight corners of a cube.
#include "backend/cuda/plan/block_plan.h"

#include "backend/cuda/kernels/cells.h"
#include "limax.h"

#include <algorithm>
#include <array>

namespace limax::cuda {

namespace {

constexpr int lanes = 32, half = 16, banks = 16;
// Padding that is tried: beyond these the classes of places repeat.
constexpr int most_row_padding = 3, most_plane_padding = 9;
// Padding may take this part of the memory more: robots that share a multiprocessor need theirs.
constexpr int64_t padding_share = 6;
// Half accesses count too: a corner is read in three and its sum written in one and a half; a mass
// adds eight sums of one and a half, and reads and writes three.
constexpr int64_t accesses_of_corner = 9, accesses_of_mass = 36;
// Warps of a block beyond which a thread has too few registers for a spring.
constexpr int most_warps = 16, most_warps_of_double = 8;
// The same where the block is the only one of its multiprocessor.
constexpr int most_warps_of_one = 8;
// Bytes of shared memory for the few values that a block has besides columns, and their alignment.
constexpr std::size_t shared_slack = 512;
// Layouts that are worth the search for better lanes.
constexpr std::size_t refined_candidates = 3;

struct layout {
    lattice grid;
    int row, plane;

    int place(int site) const {
        const int along_x = grid.nx + 1, along_y = grid.ny + 1;
        return site % along_x + site / along_x % along_y * row + site / (along_x * along_y) * plane;
    }
    // Places of a cell's corners: eight of a cube, four of a square, two of a bar.
    int corner_places(const cell_entry& cell, std::array<int, 8>& out) const {
        int count = 0;
        for (int corner = 0; corner < 8; ++corner)
            if ((corner & ~cell.axes) == 0)
                out[count++] = place(cell.site) + (corner & 1) + (corner >> 1 & 1) * row +
                               (corner >> 2) * plane;
        return count;
    }
};

using slot = std::array<cell_entry, lanes>;

slot empty_slot() {
    slot out;
    out.fill({-1, 0});
    return out;
}

// Wavefronts that a slot takes to read each of its corners once.
int wavefronts(const slot& cells, const layout& at) {
    int sum = 0;
    for (int first = 0; first < lanes; first += half) {
        int used[8][banks] = {}, most[8] = {};
        for (int lane = first; lane < first + half; ++lane) {
            if (cells[lane].site < 0) continue;
            std::array<int, 8> places;
            const int count = at.corner_places(cells[lane], places);
            for (int corner = 0; corner < count; ++corner)
                most[corner] = std::max(most[corner], ++used[corner][places[corner] % banks]);
        }
        for (const int n : most) sum += n;
    }
    return sum;
}

// What the same slot would take without conflicts.
int least_wavefronts(const slot& cells) {
    int sum = 0;
    for (int first = 0; first < lanes; first += half) {
        int corners = 0;
        for (int lane = first; lane < first + half; ++lane)
            if (cells[lane].site >= 0)
                corners = std::max(corners, 1 << __builtin_popcount(unsigned(cells[lane].axes)));
        sum += corners;
    }
    return sum;
}

// Assigns each cell the lane of its bank, in the first slot where that lane is free, and the rest
// to the free lanes with the lowest cost.
std::vector<slot> assign(const std::vector<cell_entry>& cells, const layout& at) {
    std::vector<slot> slots((cells.size() + lanes - 1) / lanes, empty_slot());
    std::vector<cell_entry> left;
    for (const cell_entry& cell : cells) {
        const int lane = at.place(cell.site) % lanes;
        const auto free_slot = std::find_if(slots.begin(), slots.end(), [&](const slot& s) {
            if (s[lane].site >= 0) return false;
            // squares of one orientation share a slot: their corners lie alike
            const auto other =
                std::find_if(s.begin(), s.end(), [](const cell_entry& c) { return c.site >= 0; });
            return other == s.end() || other->axes == cell.axes;
        });
        if (free_slot != slots.end())
            (*free_slot)[lane] = cell;
        else
            left.push_back(cell);
    }
    for (const cell_entry& cell : left) {
        cell_entry* best = nullptr;
        int least = 0;
        for (slot& s : slots) {
            const int before = wavefronts(s, at);
            for (cell_entry& lane : s) {
                if (lane.site >= 0) continue;
                lane = cell;
                const int added = wavefronts(s, at) - before;
                lane = {-1, 0};
                if (!best || added < least) best = &lane, least = added;
            }
        }
        *best = cell;
    }
    return slots;
}

// Exchanges lanes, of one slot or of two, as long as that saves wavefronts.
void refine(std::vector<slot>& slots, const layout& at) {
    constexpr int most_sweeps = 8;
    std::vector<int> cost;
    for (const slot& s : slots) cost.push_back(wavefronts(s, at));
    bool improved = true;
    for (int sweep = 0; sweep < most_sweeps && improved; ++sweep) {
        improved = false;
        for (std::size_t a = 0; a < slots.size() * lanes; ++a)
            for (std::size_t b = 0; b < slots.size() * lanes; ++b) {
                const std::size_t i = a / lanes, j = b / lanes;
                if (cost[i] == least_wavefronts(slots[i])) break;
                cell_entry &one = slots[i][a % lanes], &other = slots[j][b % lanes];
                if (one.site < 0 && other.site < 0) continue;
                std::swap(one, other);
                const int of_one = wavefronts(slots[i], at);
                const int of_other = i == j ? of_one : wavefronts(slots[j], at);
                const int before = i == j ? cost[i] : cost[i] + cost[j];
                if ((i == j ? of_one : of_one + of_other) < before) {
                    cost[i] = of_one;
                    cost[j] = of_other;
                    improved = true;
                } else {
                    std::swap(one, other);
                }
            }
    }
}

int axes_of(const lattice& grid, int site) {
    const int x = site % (grid.nx + 1), y = site / (grid.nx + 1) % (grid.ny + 1),
              z = site / ((grid.nx + 1) * (grid.ny + 1));
    return (x < grid.nx) | (y < grid.ny) << 1 | (z < grid.nz) << 2;
}

int first_layer(const lattice& grid, int cluster, int block) { return block * grid.nz / cluster; }

block_plan plan_with(const lattice& grid, int cluster, int row, int plane, bool refined) {
    block_plan plan;
    plan.cluster = cluster;
    plan.row = row;
    plan.plane = plane;
    std::vector<std::vector<slot>> of_cubes, of_rim, of_masses;  // [block][slot]
    for (int block = 0; block < cluster; ++block) {
        const int below = first_layer(grid, cluster, block);
        const int height = first_layer(grid, cluster, block + 1) - below;
        plan.layers = std::max(plan.layers, height + 1);
        const lattice slab{grid.nx, grid.ny, height};
        const layout at{slab, row, plane};
        // the masses above a slab, and the cells that begin there, are the next block's
        const auto own = int(slab.site(0, 0, height)), all = int(slab.sites());
        const int count = block + 1 == cluster ? all : own;
        std::vector<cell_entry> cubes, rim, masses;
        // squares by orientation, then bars, which fit anywhere
        for (const int axes : {7, 3, 5, 6, 1, 2, 4})
            for (int site = 0; site < count; ++site)
                if (axes_of(slab, site) == axes) (axes == 7 ? cubes : rim).push_back({site, axes});
        // a mass reads and writes one place: a cell of a single corner
        for (int site = 0; site < count; ++site) masses.push_back({site, 0});
        for (const auto& [cells, slots] :
             {std::pair{&cubes, &of_cubes}, {&rim, &of_rim}, {&masses, &of_masses}}) {
            slots->push_back(assign(*cells, at));
            if (refined && cells != &masses) refine(slots->back(), at);
            const auto offset = int32_t(grid.site(0, 0, below));
            for (slot& s : slots->back())
                for (cell_entry& cell : s)
                    if (cell.site >= 0) cell.site += offset;
        }
    }
    const auto most = [](const std::vector<std::vector<slot>>& blocks) {
        std::size_t slots = 0;
        for (const auto& block : blocks) slots = std::max(slots, block.size());
        return int(slots);
    };
    plan.cube_slots = most(of_cubes);
    plan.rim_slots = most(of_rim);
    plan.mass_slots = most(of_masses);
    for (int block = 0; block < cluster; ++block) {
        of_cubes[block].resize(plan.cube_slots, empty_slot());
        of_rim[block].resize(plan.rim_slots, empty_slot());
        of_masses[block].resize(plan.mass_slots, empty_slot());
        for (const auto* slots : {&of_cubes[block], &of_rim[block]})
            for (const slot& s : *slots) plan.cells.insert(plan.cells.end(), s.begin(), s.end());
        for (const slot& s : of_masses[block])
            for (const cell_entry& mass : s) plan.masses.push_back(mass.site);
    }
    return plan;
}

// Wavefronts of shared memory that one step of the plan takes.
int64_t cost_of(const block_plan& plan, const lattice& grid) {
    const layout at{grid, plan.row, plan.plane};
    int64_t cost = 0;
    for (std::size_t first = 0; first < plan.cells.size(); first += lanes) {
        slot s;
        std::copy_n(plan.cells.begin() + std::ptrdiff_t(first), lanes, s.begin());
        cost += accesses_of_corner * wavefronts(s, at);
    }
    for (std::size_t first = 0; first < plan.masses.size(); first += lanes) {
        slot s;
        for (int lane = 0; lane < lanes; ++lane) s[lane] = {plan.masses[first + lane], 0};
        cost += accesses_of_mass * wavefronts(s, at);
    }
    return cost;
}

}  // namespace

std::optional<block_shape> shape_block(const block_plan& plan, const kernel_needs& needs,
                                       std::size_t most_shared_bytes, kernel_form form) {
    const bool double_springs = needs.precision == LIMAX_DOUBLE;
    const bool double_masses = double_springs || needs.precision == LIMAX_MIXED;
    const int warps_of_many = std::max(plan.cube_slots, (plan.mass_slots + 1) / 2);
    if (warps_of_many > (double_springs ? most_warps_of_double : most_warps)) return std::nullopt;
    const int warps_of_one = std::max(plan.cube_slots + plan.rim_slots, plan.mass_slots);
    const bool one = form == kernel_form::one && warps_of_one <= most_warps_of_one;
    const int warps = one ? warps_of_one : warps_of_many;

    // A scheduler shares 512 registers of a lane among its warps: three of them have 168 each, two
    // 255, four 128. Measured: three are best where the block is small enough.
    block_shape shape;
    shape.threads = warps * lanes;
    shape.blocks = one ? 1 : double_springs ? std::max(1, 8 / warps) : warps <= 6 ? 12 / warps : 1;
    const int warps_of_scheduler = (warps * shape.blocks + 3) / 4;
    // What keeps spills under 64 bytes.
    shape.cube_held = double_springs            ? 0
                      : double_masses           ? (warps_of_scheduler <= 3 ? 10 : 0)
                      : warps_of_scheduler <= 3 ? cube_springs
                                                : 4;

    const int cell_rounds = (plan.cube_slots + plan.rim_slots + warps - 1) / warps;
    const int cube_rounds = (plan.cube_slots + warps - 1) / warps;
    const std::size_t in_memory =
        std::size_t(shape.threads) * std::size_t(cube_rounds * (cube_springs - shape.cube_held) +
                                                 (cell_rounds - cube_rounds) * rim_springs);
    const std::size_t places = std::size_t(plan.plane) * std::size_t(plan.layers);
    const std::size_t spring_real = double_springs ? 8 : 4, mass_real = double_masses ? 8 : 4;
    // block_memory of kernels/slabs.h, which asserts that this suffices
    const std::size_t own = needs.precision == LIMAX_COMPENSATED ? 8
                            : double_springs                     ? 5
                            : double_masses                      ? 8
                                                                 : 2;
    shape.shared_bytes = places * ((needs.shares_velocity ? 6 : 3) + 3 * corners) * spring_real +
                         places * (own + (needs.has_faces ? 6 : 0)) * mass_real +
                         in_memory * std::size_t(needs.spring_columns) * sizeof(float) +
                         std::size_t(warps + plan.cluster) * block_sums * sizeof(int64_t) +
                         sizeof(robot_record) + shared_slack;
    if (shape.shared_bytes > most_shared_bytes) return std::nullopt;
    return shape;
}

block_plan plan_block(const lattice& grid, int cluster) {
    struct candidate {
        int64_t cost;
        block_plan plan;
    };
    std::vector<candidate> candidates;
    for (int row_padding = 0; row_padding <= most_row_padding; ++row_padding)
        for (int plane_padding = 0; plane_padding <= most_plane_padding; ++plane_padding) {
            const int row = grid.nx + 1 + row_padding;
            const int plane = row * (grid.ny + 1) + plane_padding;
            const int unpadded = (grid.nx + 1) * (grid.ny + 1);
            // the first candidate, without padding, always stays
            if (!candidates.empty() && plane > unpadded + unpadded / padding_share) continue;
            block_plan plan = plan_with(grid, cluster, row, plane, false);
            candidates.push_back({cost_of(plan, grid), std::move(plan)});
        }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const candidate& a, const candidate& b) { return a.cost < b.cost; });
    candidates.resize(std::min(candidates.size(), refined_candidates));
    for (candidate& c : candidates) {
        c.plan = plan_with(grid, cluster, c.plan.row, c.plan.plane, true);
        c.cost = cost_of(c.plan, grid);
    }
    return std::min_element(candidates.begin(), candidates.end(),
                            [](const candidate& a, const candidate& b) { return a.cost < b.cost; })
        ->plan;
}

std::shared_ptr<const block_plan> block_plans::of(const lattice& grid, int cluster) {
    const std::lock_guard lock(mutex_);
    auto& plan = plans_[{grid.nx, grid.ny, grid.nz, cluster}];
    if (!plan) plan = std::make_shared<const block_plan>(plan_block(grid, cluster));
    return plan;
}

}  // namespace limax::cuda
