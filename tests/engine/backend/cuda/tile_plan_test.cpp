// How lattices are cut into tiles that stay on their multiprocessors, without a GPU.
#include "backend/cuda/plan/tile_plan.h"

#include <map>
#include <set>

#include "backend/cuda/kernels/cells.h"
#include "cuda_sets.h"

using namespace limax;
using namespace limax::cuda;
using namespace limax::test;

namespace {

constexpr std::size_t memory = 232448;
kernel_needs needs_of(int precision) { return {precision, 4, true, false, true}; }

}  // namespace

TEST_CASE("every cell has one thread, and a tile receives what others send") {
    struct choice {
        lattice grid;
        std::array<int, 3> cut;
        int precision;
    };
    for (const auto& [grid, cut, precision] : {choice{{6, 5, 7}, {2, 2, 2}, LIMAX_DOUBLE},
                                               choice{{14, 14, 14}, {1, 1, 3}, LIMAX_COMPENSATED},
                                               choice{{40, 15, 1}, {3, 2, 1}, LIMAX_SINGLE}}) {
        CAPTURE(grid.nx);
        const auto plan = cut_into_tiles(grid, cut, needs_of(precision), memory);
        REQUIRE(plan);
        CHECK(plan->shared_bytes <= memory);
        const int slots = plan->rounds * plan->threads;
        const int stride = (precision == LIMAX_DOUBLE ? 2 : 1) * int(grid.sites());
        REQUIRE(int(plan->cells.size()) == plan->tiles * slots);
        const auto each = [](const std::vector<cell_entry>& list, int of_tile, const auto& visit) {
            for (int i = 0; i < int(list.size()); ++i)
                if (list[i].site >= 0) visit(i / of_tile, i % of_tile, list[i]);
        };
        std::vector<int> tile_of(std::size_t(grid.sites()), -1), place_in(tile_of);
        each(plan->cells, slots, [&](int tile, int, const cell_entry& cell) {
            CHECK(tile_of[cell.site] == -1);
            tile_of[cell.site] = tile;
            place_in[cell.site] = cell.axes & 0xffff;
        });
        CHECK(std::count(tile_of.begin(), tile_of.end(), -1) == 0);
        std::map<int, int> sent, received;  // tile by packet
        std::set<std::array<int, 2>> read,
            shown;  // mass of another tile, and the tile that reads it
        each(plan->cells, slots, [&](int tile, int slot, const cell_entry& cell) {
            const int round = slot / plan->threads, x = cell.site % (grid.nx + 1),
                      y = cell.site / (grid.nx + 1) % (grid.ny + 1),
                      z = cell.site / ((grid.nx + 1) * (grid.ny + 1));
            for (int c = 1; c < corners; ++c) {
                const bool inside = x + (c & 1) <= grid.nx && y + (c >> 1 & 1) <= grid.ny &&
                                    z + (c >> 2) <= grid.nz;
                const int site =
                    inside ? int(grid.site(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))) : -1;
                const bool own = inside && tile_of[site] == tile, other = inside && !own;
                CHECK((cell.axes >> (16 + c) & 1) == own);
                CHECK((cell.axes >> (23 + c) & 1) == other);
                if (own)
                    CHECK(place_in[site] == (cell.axes & 0xffff) + (c & 1) +
                                                (c >> 1 & 1) * plan->row + (c >> 2) * plan->plane);
                if (!other) continue;
                CHECK((round > 0 && round <= plan->senders));
                sent[(c - 1) * stride + site] = tile_of[site];
                read.insert({site, tile});
            }
        });
        each(plan->forces, plan->inbox * plan->threads, [&](int tile, int, const cell_entry& e) {
            CHECK(received.emplace(e.site, tile).second);
            CHECK(e.axes == e.site / stride * plan->own_places + place_in[e.site % stride]);
        });
        CHECK(sent == received);
        each(plan->masses, plan->halo * plan->threads, [&](int tile, int, const cell_entry& e) {
            CHECK((e.axes & 0xffff) < plan->places);
            shown.insert({e.site, tile});
        });
        CHECK(read == shown);
        each(plan->cells, slots, [&](int, int, const cell_entry& cell) {
            const auto reader = read.lower_bound({cell.site, 0});
            CHECK((cell.axes >> 16 & 1) == (reader != read.end() && (*reader)[0] == cell.site));
        });
    }
}

TEST_CASE("tiles of a robot fit the GPU together, whatever it has") {
    const auto at_once = [](const lattice& grid, int multiprocessors, int robots) {
        const auto plan =
            plan_tiles(grid, needs_of(LIMAX_COMPENSATED), memory, multiprocessors, robots);
        return plan ? multiprocessors / plan->tiles : 0;
    };
    CHECK(at_once({10, 10, 10}, 132, 528) == 66);
    CHECK(at_once({14, 14, 14}, 132, 44) == 44);
    CHECK(at_once({20, 20, 20}, 132, 66) == 14);
    CHECK(at_once({30, 30, 30}, 132, 16) == 4);
    CHECK(at_once({50, 50, 50}, 132, 1) == 1);
    CHECK(at_once({60, 50, 50}, 132, 1) == 0);
    CHECK(at_once({20, 20, 20}, 10, 66) == 1);
    CHECK(at_once({20, 20, 20}, 5, 66) == 0);
}

TEST_CASE("LIMAX_CUDA_PATH=tiles selects tiles where they can be used") {
    asking_machine machine;
    const environment_variable path("LIMAX_CUDA_PATH");
    path.set("tiles");
    const auto entry_of = [&](unsigned mask, const lattice& grid) {
        return machine.step_of(setup_of(mask, LIMAX_COMPENSATED, LIMAX_LEAPFROG, grid)).entry;
    };
    CHECK(entry_of(walking_effects, {14, 14, 14}) == "tiles");
    CHECK(entry_of(walking_effects, {5, 5, 5}) == "tiles");
    CHECK(entry_of(walking_effects | effects::bit<effects::drag>, {14, 14, 14}) != "tiles");
    CHECK(entry_of(walking_effects, {70, 70, 70}) == "grid");
}

TEST_CASE("tiles compile in every precision and integrator, with every effect that they take") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    asking_machine machine;
    const environment_variable path("LIMAX_CUDA_PATH");
    path.set("tiles");
    const unsigned others = effects::face_bits | effects::meeting_bits | effects::solid_bits |
                            effects::bit<effects::edges>;
    for (const int precision : every_precision)
        for (const int integrator : {LIMAX_SYMPLECTIC_EULER, LIMAX_LEAPFROG}) {
            if (skips_long_tests() && (integrator == LIMAX_LEAPFROG) == (precision == LIMAX_SINGLE))
                continue;
            simulation_setup setup =
                setup_of(every_effect & ~others, precision, integrator, {20, 20, 20});
            setup.scene.add("planes");
            const kernel_set set = machine.step_of(setup);
            CHECK(set.entry == "tiles");
            std::string log;
            CHECK(!compiled(*nvrtc, set, "compute_90", {}, &log).empty());
            CHECK(log == "");
        }
}
