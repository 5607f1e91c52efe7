// tile_plan.cpp: chooses tiles, and lists which thread owns which cell and receives what.
#include "backend/cuda/plan/tile_plan.h"

#include <algorithm>
#include <map>

#include "backend/cuda/kernels/cells.h"
#include "limax.h"

namespace limax::cuda {

namespace {

constexpr int lanes = 32;
// Warps of a block that leave registers for two cells of a thread, and for three.
constexpr int most_warps_of_two = 16, most_warps = 12, most_warps_of_double = 8, most_rounds = 3;
// Free places after a row and a plane that are tried.
constexpr int row_paddings = 2, plane_paddings = 4;
constexpr std::size_t shared_slack = 512;
// What a step takes beside its cells, in warps of cells: always, for a warp of packets, for a warp
// of the rim, and for a round of it. More warps hide more.
constexpr double work_of_step = 8, work_of_packets = 0.3, work_of_rim = 0.5, work_of_rims = 3,
                 share_of_more_warps = 0.9;

int parts(int items, int size) { return (items + size - 1) / size; }

struct box {
    std::array<int, 3> low, high;  // sites, from low to before high

    int along(int axis) const { return high[axis] - low[axis]; }
    bool holds(const std::array<int, 3>& at) const {
        for (int axis = 0; axis < 3; ++axis)
            if (at[axis] < low[axis] || at[axis] >= high[axis]) return false;
        return true;
    }
    template <class Visit>
    void each(const Visit& visit) const {
        for (int z = low[2]; z < high[2]; ++z)
            for (int y = low[1]; y < high[1]; ++y)
                for (int x = low[0]; x < high[0]; ++x) visit(std::array<int, 3>{x, y, z});
    }
};
std::array<int, 3> moved(std::array<int, 3> at, int corner, int by) {
    for (int axis = 0; axis < 3; ++axis) at[axis] += by * (corner >> axis & 1);
    return at;
}

// The tiles of one plan while it is made.
struct tiling {
    std::array<int, 3> along, cut, most;  // sites of the lattice; tiles; sites of the largest
    bool rims_apart;
    int row, plane;

    tiling(const lattice& grid, const tile_cut& how)
        : along{grid.nx + 1, grid.ny + 1, grid.nz + 1}, cut(how.tiles), rims_apart(how.rims_apart) {
        for (int axis = 0; axis < 3; ++axis) most[axis] = parts(along[axis], cut[axis]);
        pad(0, 0);
    }
    // Whether cells read masses beyond a side of the tile. A cube on the rim does, a square only
    // masses whose force on it is 0, which may be any.
    int beyond(int axis) const { return cut[axis] > 1 || !rims_apart; }
    void pad(int of_row, int of_plane) {
        row = most[0] + beyond(0) + of_row;
        plane = row * (most[1] + beyond(1)) + of_plane;
    }
    int places() const { return plane * (most[2] - 1 + beyond(2)) + row * most[1] + most[0] + 1; }
    // Most cells of a tile that are stepped as cubes, and as squares.
    std::array<int, 2> cubes_and_squares() const {
        if (!rims_apart) return {cells(), 0};
        std::array<int, 2> most_of{};
        for (int number = 0; number < cut[0] * cut[1] * cut[2]; ++number) {
            const box b = tile(number);
            int all = 1, cubes = 1;
            for (int axis = 0; axis < 3; ++axis) {
                all *= b.along(axis);
                cubes *= b.along(axis) - (b.high[axis] == along[axis]);
            }
            most_of = {std::max(most_of[0], cubes), std::max(most_of[1], all - cubes)};
        }
        return most_of;
    }
    int cells() const { return most[0] * most[1] * most[2]; }
    int site(const std::array<int, 3>& at) const {
        return at[0] + along[0] * (at[1] + along[1] * at[2]);
    }
    box lattice_box() const { return {{0, 0, 0}, along}; }
    box tile(int number) const {
        const std::array<int, 3> of{number % cut[0], number / cut[0] % cut[1],
                                    number / (cut[0] * cut[1])};
        box b{};
        for (int axis = 0; axis < 3; ++axis) {
            b.low[axis] = of[axis] * along[axis] / cut[axis];
            b.high[axis] = (of[axis] + 1) * along[axis] / cut[axis];
        }
        return b;
    }
    int place(const box& b, const std::array<int, 3>& at) const {
        return (at[0] - b.low[0]) + row * (at[1] - b.low[1]) + plane * (at[2] - b.low[2]);
    }
    // What a step of the largest tile takes of its multiprocessor, in warps of cells, where it has
    // neighbours on all sides that are cut. Packets of faces across x, less so across y, are not
    // side by side.
    double work(int packets_of_mass) const {
        int window = 1, inner = 1;
        for (int axis = 0; axis < 3; ++axis) {
            window *= most[axis] + (cut[axis] > 1);
            inner *= most[axis] - (cut[axis] > 1);
        }
        const int packets = (window - cells()) * packets_of_mass + 4 * (cells() - inner);
        const auto [cubes, squares] = cubes_and_squares();
        const int warps = parts(cubes, 2 * lanes);
        return (work_of_step + (cubes + work_of_rim * squares) / lanes) *
                   (warps > most_warps && warps <= most_warps_of_two ? share_of_more_warps : 1) +
               work_of_packets * packets / lanes + (rims_apart ? work_of_rims : 0) +
               0.01 * (2 * cut[0] + cut[1]);
    }
};

// Puts cells into the lanes of warps from `first` on so that places of a warp differ modulo 32, as
// far as possible.
void put_in_lanes(const std::vector<cell_entry>& cells, cell_entry* first, int warps) {
    std::array<std::vector<cell_entry>, lanes> of_bank;
    for (auto cell = cells.rbegin(); cell != cells.rend(); ++cell)
        of_bank[std::size_t((cell->axes & 0xffff) % lanes)].push_back(*cell);
    std::size_t left = cells.size();
    for (int warp = 0; warp < warps && left > 0; ++warp) {
        cell_entry* const out = first + warp * lanes;
        const auto take = [&](int lane, std::vector<cell_entry>& bank) {
            out[lane] = bank.back();
            bank.pop_back();
            --left;
        };
        for (int lane = 0; lane < lanes; ++lane)
            if (!of_bank[lane].empty()) take(lane, of_bank[lane]);
        for (int lane = 0; lane < lanes && left > 0; ++lane)
            if (out[lane].site < 0)
                take(lane, *std::max_element(
                               of_bank.begin(), of_bank.end(),
                               [](const auto& a, const auto& b) { return a.size() < b.size(); }));
    }
}

// The cells of a tile by round: 0 has none that reaches into another tile, and masses that others
// wait for come first. Those on the rim are in the last where they are apart. Empty where those
// that reach out are too many.
std::vector<std::vector<cell_entry>> rounds_of(const tiling& t, const box& b, int rounds,
                                               std::size_t threads) {
    std::vector<cell_entry> low, high, inner, rim;
    b.each([&](const std::array<int, 3>& at) {
        int flags = 0;
        for (int c = 1; c < corners; ++c) {
            const auto corner = moved(at, c, 1), cell = moved(at, c, -1);
            if (t.lattice_box().holds(corner)) flags |= 1 << (b.holds(corner) ? c : 7 + c);
            flags |= t.lattice_box().holds(cell) && !b.holds(cell);
        }
        const bool reaches_out = flags >> corners, on_rim = !t.lattice_box().holds(moved(at, 7, 1));
        const cell_entry cell{t.site(at), t.place(b, at) | flags << 16};
        if (t.rims_apart && on_rim)
            rim.insert(reaches_out ? rim.begin() : rim.end(), cell);
        else
            (reaches_out ? high : flags & 1 ? low : inner).push_back(cell);
    });
    std::vector<std::vector<cell_entry>> of(static_cast<std::size_t>(rounds));
    if (high.size() > threads * (of.size() - 1)) return {};
    const auto even =
        std::size_t(parts(int(low.size() + high.size() + inner.size()), rounds * lanes) * lanes);
    std::size_t round = 1;
    for (const cell_entry& cell : high) {
        if (of[round].size() == threads) ++round;
        of[round].push_back(cell);
    }
    low.insert(low.end(), inner.begin(), inner.end());
    round = 0;
    for (const std::size_t most : {even, threads})
        for (auto& some : of)
            for (; some.size() < most && round < low.size(); ++round) some.push_back(low[round]);
    if (t.rims_apart) of.push_back(rim);
    return of;
}

}  // namespace

std::optional<tile_plan> cut_into_tiles(const lattice& grid, const tile_cut& cut,
                                        const kernel_needs& needs, std::size_t most_shared_bytes) {
    tiling t(grid, cut);
    const bool in_double = needs.precision == LIMAX_DOUBLE;
    const int most_of_two = in_double ? most_warps_of_double : most_warps_of_two,
              most_of_three = in_double ? most_warps_of_double : most_warps;
    tile_plan plan;
    plan.cut = cut.tiles;
    plan.tiles = t.cut[0] * t.cut[1] * t.cut[2];
    const auto [cubes, rims] = t.cubes_and_squares();
    const int cube_rounds =
        parts(cubes, 2 * lanes) <= most_of_two ? 2 : parts(cubes, most_of_three * lanes);
    if (cube_rounds > (cut.rims_apart ? 2 : most_rounds)) return std::nullopt;
    const int warps = std::max(parts(cubes, cube_rounds * lanes), parts(rims, lanes));
    if (warps > most_of_two) return std::nullopt;
    plan.threads = warps * lanes;
    plan.rounds = cube_rounds + cut.rims_apart;
    plan.rim_slots = parts(rims, lanes) * lanes;
    const int cube_slots = cube_rounds * plan.threads;
    const auto threads = std::size_t(plan.threads), slots = threads * std::size_t(plan.rounds);

    // tile_memory of kernels/tile_memory.h, which asserts that this suffices
    const auto measure = [&] {
        plan.row = t.row;
        plan.plane = t.plane;
        plan.places = t.places();
        plan.own_places = t.plane * (t.most[2] - 1) + t.row * (t.most[1] - 1) + t.most[0];
        const std::size_t real = in_double ? 8 : 4;
        plan.shared_bytes =
            (std::size_t(plan.places) * (needs.shares_velocity ? 6 : 4) +
             std::size_t(plan.own_places) * 3 * (corners - 1) +
             std::size_t(4 * (cube_slots + plan.rim_slots) + 2 * check_interval)) *
                real +
            (needs.spring_columns > 1
                 ? std::size_t(cube_slots * cube_springs + plan.rim_slots * rim_springs) *
                       sizeof(float)
                 : 0) +
            std::size_t(plan.threads / lanes + 1) * grid_sums * sizeof(int64_t) +
            sizeof(robot_record) + needs.control + shared_slack;
        return plan.shared_bytes <= most_shared_bytes;
    };
    // the paddings with which the fewest cells of the first tile miss the lane of their bank
    std::size_t least = 0;
    std::array<int, 2> best{-1, 0};
    for (int of_row = 0; of_row < row_paddings; ++of_row)
        for (int of_plane = 0; of_plane < plane_paddings; ++of_plane) {
            t.pad(of_row, of_plane);
            if (!measure()) continue;
            const auto of = rounds_of(t, t.tile(0), cube_rounds, threads);
            std::size_t misfits = 0;
            for (const auto& round : of) {
                std::array<std::size_t, lanes> used{};
                for (const cell_entry& cell : round) ++used[(cell.axes & 0xffff) % lanes];
                for (const std::size_t cells : used)
                    misfits += std::max(cells, threads / lanes) - threads / lanes;
            }
            if (best[0] >= 0 && misfits >= least) continue;
            least = misfits;
            best = {of_row, of_plane};
        }
    if (best[0] < 0) return std::nullopt;
    t.pad(best[0], best[1]);
    measure();

    // the cells of all threads, and where each mass is
    std::vector<cell_entry> cells(std::size_t(plan.tiles) * slots, {-1, 0});
    for (int number = 0; number < plan.tiles; ++number) {
        const auto of = rounds_of(t, t.tile(number), cube_rounds, threads);
        if (of.empty()) return std::nullopt;
        for (std::size_t k = 0; k < of.size(); ++k) {
            cell_entry* const first = &cells[std::size_t(number) * slots + k * threads];
            const int used = int(k) == cube_rounds ? plan.rim_slots : plan.threads;
            put_in_lanes(of[k], first, used / lanes);
            for (int i = 0; i < used; ++i)
                if (first[i].site >= 0 && first[i].axes >> 16 >> corners) {
                    plan.senders = std::max(plan.senders, int(k));
                    plan.readers = std::max(plan.readers, (i / lanes + 1) * lanes);
                }
        }
    }
    std::vector<std::size_t> slot_of(std::size_t(grid.sites()));  // of all tiles
    for (std::size_t i = 0; i < cells.size(); ++i)
        if (cells[i].site >= 0) slot_of[std::size_t(cells[i].site)] = i;

    // what others send, in the order in which warps send it, so that packets are side by side
    using received = std::array<int, 4>;  // packet, where it goes, site, corners of cells
    std::vector<std::vector<received>> halo(static_cast<std::size_t>(plan.tiles)), inbox(halo);
    for (std::size_t tile = 0; tile < halo.size(); ++tile) {
        const box b = t.tile(int(tile));
        box window = b;
        for (int& high : window.high) ++high;
        window.each([&](const std::array<int, 3>& at) {
            if (b.holds(at) || !t.lattice_box().holds(at)) return;
            int ends = 0;
            for (int c = 1; c < corners; ++c) ends |= b.holds(moved(at, c, -1)) << c;
            halo[tile].push_back(
                {int(slot_of[std::size_t(t.site(at))]), t.place(b, at), t.site(at), ends});
        });
        b.each([&](const std::array<int, 3>& at) {
            for (int c = 1; c < corners; ++c) {
                const auto cell = moved(at, c, -1);
                if (b.holds(cell) || !t.lattice_box().holds(cell)) continue;
                const int from = int(slot_of[std::size_t(t.site(cell))]), slot = from % int(slots),
                          sender = slot / plan.threads - 1;
                inbox[tile].push_back(
                    {((from / int(slots) * plan.senders + sender) * (corners - 1) + c - 1) *
                             plan.threads +
                         slot % plan.threads,
                     (c - 1) * plan.own_places + t.place(b, at), t.site(at), 0});
            }
        });
        std::sort(halo[tile].begin(), halo[tile].end());
        std::sort(inbox[tile].begin(), inbox[tile].end());
        plan.readers = std::max(
            plan.readers, std::min(parts(int(halo[tile].size()), lanes) * lanes, plan.threads));
        plan.halo = std::max(plan.halo, parts(int(halo[tile].size()), plan.threads));
        plan.inbox = std::max(plan.inbox, parts(int(inbox[tile].size()), plan.threads));
    }

    const tile_rows rows{plan.rounds, plan.halo, plan.inbox};
    plan.table.assign(std::size_t(plan.tiles * rows.count()) * threads, -1);
    for (std::size_t tile = 0; tile < halo.size(); ++tile) {
        const auto put = [&](int row, std::size_t i, int value) {
            plan.table[(tile * std::size_t(rows.count()) + std::size_t(row)) * threads + i] = value;
        };
        for (std::size_t i = 0; i < slots; ++i) {
            put(rows.site(), i, cells[tile * slots + i].site);
            put(rows.cell(), i, cells[tile * slots + i].axes);
        }
        const auto put_list = [&](const std::vector<received>& list, int first, int length,
                                  int count) {
            for (std::size_t i = 0; i < list.size(); ++i)
                for (int k = 0; k < count; ++k) put(first + k * length, i, list[i][std::size_t(k)]);
        };
        put_list(halo[tile], rows.mass(), plan.halo, 4);
        put_list(inbox[tile], rows.force(), plan.inbox, 3);
    }
    return plan;
}

std::optional<tile_plan> plan_tiles(const lattice& grid, const kernel_needs& needs,
                                    std::size_t most_shared_bytes, int multiprocessors,
                                    int robots) {
    const std::array<int, 3> along{grid.nx + 1, grid.ny + 1, grid.nz + 1};
    std::multimap<double, tile_cut> cuts;  // by the time of all robots
    for (int z = 1; z <= along[2]; ++z)
        for (int y = 1; y <= along[1] && y * z <= multiprocessors; ++y)
            for (int x = 1; x <= along[0] && x * y * z <= multiprocessors; ++x)
                for (const bool rims_apart : {false, true}) {
                    const tile_cut cut{{x, y, z}, rims_apart};
                    if (rims_apart && needs.precision == LIMAX_DOUBLE) continue;  // not tried
                    cuts.emplace(parts(robots, multiprocessors / (x * y * z)) *
                                     tiling(grid, cut).work(needs.shares_velocity ? 2 : 1),
                                 cut);
                }
    for (const auto& [time, cut] : cuts)
        if (auto plan = cut_into_tiles(grid, cut, needs, most_shared_bytes)) return plan;
    return std::nullopt;
}

}  // namespace limax::cuda
