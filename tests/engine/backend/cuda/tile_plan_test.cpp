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
        tile_cut cut;
        int precision;
    };
    for (const auto& [grid, cut, precision] :
         {choice{{6, 5, 7}, {{2, 2, 2}, false}, LIMAX_DOUBLE},
          choice{{14, 14, 14}, {{1, 1, 3}, false}, LIMAX_COMPENSATED},
          choice{{14, 14, 14}, {{1, 1, 3}, true}, LIMAX_COMPENSATED},
          choice{{10, 10, 10}, {{1, 1, 1}, true}, LIMAX_COMPENSATED},
          choice{{20, 20, 20}, {{1, 3, 3}, true}, LIMAX_COMPENSATED},
          choice{{40, 15, 1}, {{3, 2, 1}, false}, LIMAX_SINGLE}}) {
        CAPTURE(grid.nx);
        const auto plan = cut_into_tiles(grid, cut, needs_of(precision), memory);
        REQUIRE(plan);
        CHECK(plan->shared_bytes <= memory);
        const tile_rows rows{plan->rounds, plan->halo, plan->inbox};
        REQUIRE(int(plan->table.size()) == plan->tiles * rows.count() * plan->threads);
        // calls visit(tile, place in the list, ..) for all that do not have -1 in the last row
        const auto each = [&](int length, int first, int last, const auto& visit) {
            const auto at = [&](int tile, int row, int i) {
                return plan->table[(tile * rows.count() + row) * plan->threads + i];
            };
            for (int tile = 0; tile < plan->tiles; ++tile)
                for (int i = 0; i < length * plan->threads; ++i)
                    if (at(tile, last, i) >= 0)
                        visit(tile, i, at(tile, first, i), at(tile, first + length, i));
        };
        const auto each_cell = [&](const auto& visit) {
            each(plan->rounds, rows.site(), rows.site(), visit);
        };
        std::vector<int> tile_of(std::size_t(grid.sites()), -1), place_in(tile_of);
        each_cell([&](int tile, int, int site, int cell) {
            CHECK(tile_of[site] == -1);
            tile_of[site] = tile;
            place_in[site] = cell & 0xffff;
        });
        CHECK(std::count(tile_of.begin(), tile_of.end(), -1) == 0);
        // by packet: the tile that waits for it, and the sum that it belongs to
        std::map<int, std::array<int, 2>> sent, received;
        std::set<std::array<int, 2>> read, shown;  // packet of a mass, and the tile that reads it
        std::map<int, int> packet_of;              // by site
        each_cell([&](int tile, int slot, int site, int cell) {
            if (cell >> 16 & 1) packet_of[site] = tile * plan->rounds * plan->threads + slot;
        });
        each_cell([&](int tile, int slot, int lowest, int cell) {
            const int round = slot / plan->threads, x = lowest % (grid.nx + 1),
                      y = lowest / (grid.nx + 1) % (grid.ny + 1),
                      z = lowest / ((grid.nx + 1) * (grid.ny + 1));
            for (int c = 1; c < corners; ++c) {
                const bool inside = x + (c & 1) <= grid.nx && y + (c >> 1 & 1) <= grid.ny &&
                                    z + (c >> 2) <= grid.nz;
                const int site =
                    inside ? int(grid.site(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))) : -1;
                const bool own = inside && tile_of[site] == tile, other = inside && !own;
                CHECK((cell >> (16 + c) & 1) == own);
                CHECK((cell >> (23 + c) & 1) == other);
                if (own)
                    CHECK(place_in[site] == (cell & 0xffff) + (c & 1) + (c >> 1 & 1) * plan->row +
                                                (c >> 2) * plan->plane);
                if (!other) continue;
                CHECK((round > 0 && round <= plan->senders));
                CHECK(slot % plan->threads < plan->readers);
                const int packet = (tile * plan->senders + round - 1) * 7 * plan->threads +
                                   (c - 1) * plan->threads + slot % plan->threads;
                sent[packet] = {tile_of[site], (c - 1) * plan->own_places + place_in[site]};
                REQUIRE(packet_of.count(site) == 1);
                read.insert({packet_of[site], tile});
            }
        });
        each(plan->inbox, rows.force(), rows.force_site(), [&](int tile, int, int packet, int sum) {
            CHECK(received.emplace(packet, std::array<int, 2>{tile, sum}).second);
        });
        CHECK(sent == received);
        each(plan->halo, rows.mass(), rows.mass_site(),
             [&](int tile, int i, int packet, int place) {
                 CHECK(place < plan->places);
                 CHECK(i % plan->threads < plan->readers);
                 shown.insert({packet, tile});
             });
        CHECK(read == shown);
    }
}

TEST_CASE("tiles of a robot fit the GPU together, whatever it has") {
    const auto at_once = [](const lattice& grid, int multiprocessors, int robots) {
        const auto plan =
            plan_tiles(grid, needs_of(LIMAX_COMPENSATED), memory, multiprocessors, robots);
        return plan ? multiprocessors / plan->tiles : 0;
    };
    CHECK(at_once({10, 10, 10}, 132, 528) == 132);
    CHECK(at_once({12, 12, 12}, 132, 264) == 66);
    CHECK(at_once({14, 14, 14}, 132, 44) == 44);
    CHECK(at_once({20, 20, 20}, 132, 66) == 11);
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
