// robot_control.h: the controller of one robot on the CPU: at each tick its sensors, its text, and
// what the muscles' springs follow until the next. SI units.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "backend/backend.h"
#include "backend/cpu/columns.h"
#include "backend/cpu/forces.h"
#include "physics/body_frame.h"
#include "physics/drive.h"
#include "physics/time_step.h"

namespace limax::cpu {

// S and `compensated` as in robot_columns. What it is made from must outlive it.
template <class S, bool compensated>
class robot_control {
public:
    robot_control(const simulation_setup& setup, int32_t robot, spring_body& body,
                  const pass_table& passes, const schedule& plan,
                  robot_columns<S, compensated>& columns, robot_forces<S, compensated>& forces)
        : setup_(setup),
          law_(setup.scene.controller()),
          values_(setup.scene.values(effects::index_of<effects::control>)),
          passes_(passes_of<S>(passes)),
          plan_(plan),
          body_(body),
          columns_(columns),
          forces_(forces),
          voxels_(body.grid.voxels()),
          materials_(setup.voxels.data() + robot * voxels_),
          genes_(setup.control.data() + int64_t(robot) * setup.control_genes),
          seed_(setup.noise_seed(robot)),
          delay_(int(std::lround(values_[control::at_delay] * values_[control::at_rate]))),
          clock_(sensors::clock_of(values_)) {
        const float* const weights = setup.weights.data() + 3 * robot * voxels_;
        muscles_.resize(std::size_t(voxels_));
        lowest_.resize(std::size_t(voxels_));
        beside_.resize(std::size_t(voxels_ * sensors::neighbours));
        for (int64_t v = 0; v < voxels_; ++v) {
            if (materials_[v] == 0) continue;
            used_.push_back(int32_t(v));
            const lattice& grid = body.grid;
            const int x = int(v % grid.nx), y = int(v / grid.nx % grid.ny),
                      z = int(v / (int64_t(grid.nx) * grid.ny));
            const int64_t lowest = grid.site(x, y, z);
            lowest_[std::size_t(v)] = lowest;
            for (int side = 0; side < sensors::neighbours; ++side)
                beside_[std::size_t(v * sensors::neighbours + side)] =
                    sensors::has_neighbour(grid, x, y, z, side)
                        ? v + sensors::step_to_neighbour(grid, side)
                        : -1;
            muscles_[std::size_t(v)] = muscle_of(
                law_of(setup.materials[materials_[v]]), weights, voxels_, v,
                [&](int c) { return body.mass[lowest + grid.site(c & 1, c >> 1 & 1, c >> 2)]; });
        }
        if (setup.scene.has(effects::index_of<effects::gravity>)) {
            const double* g = setup.scene.values(effects::index_of<effects::gravity>);
            const double pull = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
            per_gravity_ = pull > 0 ? S(1 / pull) : S(0);
        }
        for (std::vector<S>& half : activation_) half.resize(std::size_t(voxels_));
        for (std::vector<S>& half : drive_) half.resize(std::size_t(voxels_));
        for (std::vector<S>& half : said_)
            half.resize(std::size_t(law_.messages) * std::size_t(voxels_));
        states_.resize(std::size_t(law_.states) * std::size_t(voxels_));
        if (delay_ > 0)
            past_.resize(std::size_t(delay_ + 1) * sensors::measured * std::size_t(voxels_));
        if (plan.every[LIMAX_TRACE_SENSOR])
            seen_.resize(std::size_t(sensors::count) * std::size_t(voxels_));
        if (reads_contacts()) pushes_.resize(std::size_t(body.grid.sites()));
        registers_.resize(std::size_t(law_.registers()) * scripted_block);
        // scale of each spring; from now on the columns hold what the muscles do
        scale_ = std::move(body.sine);
        body.sine = array<float>(int64_t(scale_.size()));
        body.cosine = array<float>(int64_t(scale_.size()));
    }

    bool due(int64_t step) const {
        const int64_t since = step - plan_.settle_steps;
        return since >= 0 && since % plan_.tick == 0 && step < plan_.steps;
    }

    // The tick at `step`. Returns false if the controller gave a value that is not finite.
    bool tick(int64_t step, const double origin[3], const rigid_blocks<S>* blocks) {
        const int64_t number = (step - plan_.settle_steps) / plan_.tick;
        now_ = int(number & 1);
        tick_ = number;
        if (reads_contacts())
            forces_.static_pushes(pushes_, double(step - plan_.settle_steps) * plan_.time_step);
        if (sensors::reads_body(law_.sensors)) sense_whole(origin, blocks);
        bool finite = true;
        for (std::size_t first = 0; first < used_.size(); first += scripted_block) {
            const int count = int(std::min<std::size_t>(scripted_block, used_.size() - first));
            fill_inputs(used_.data() + first, count);
            passes_.controller({law_, genes_, registers_.data()}, count);
            finite &= take_results(used_.data() + first, count);
        }
        follow();
        return finite;
    }

    // Makes the cells' parameters from the drives.
    void follow() {
        columns_.follow_drive(body_, scale_.data(), drive_[now_].data(), drive_[1 - now_].data(),
                              share_of_step());
        current_ = false;
    }

    // Brings the body's columns up to date, which only measures read: the change of each rest
    // length at the tick, and per step since.
    void show_measures() {
        if (current_) return;
        current_ = true;
        for (int d = 0; d < direction_count; ++d)
            for_each_site(body_.grid, [&](int x, int y, int z) {
                const int64_t slot = d * body_.count + body_.grid.site(x, y, z);
                if (!(body_.stiffness[slot] > 0)) return;
                const drive_change<S> change =
                    change_of_spring(body_.grid, x, y, z, directions[d], S(scale_[slot]),
                                     share_of_step(), [&](int64_t voxel, int which) {
                                         return drive_[which ? 1 - now_ : now_][voxel];
                                     });
                body_.sine[slot] = float(change.at_tick);
                body_.cosine[slot] = float(change.per_step);
            });
    }

    // Steps since the tick, in steps of the muscles; 0 while the body settles.
    template <class R>
    R since(int64_t tick, int per_step) const {
        return tick < 0 ? R(0) : R(double(tick - tick_ * plan_.tick * per_step) / per_step);
    }

    // As in robot.
    bool set_state(int32_t state, const double* values) {
        if (state < 0 || state >= law_.states) return false;
        std::copy_n(values, voxels_, states_.begin() + state * voxels_);
        return true;
    }

    // Activations at a step, [voxel].
    void write_activations(int64_t step, double* out) const {
        const double share = values_[control::at_hold] != 0
                                 ? 1.0
                                 : since<double>(step - plan_.settle_steps, 1) / double(plan_.tick);
        for (int64_t v = 0; v < voxels_; ++v) {
            const double from = activation_[now_][v], to = activation_[1 - now_][v];
            out[v] = fma(share, to - from, from);
        }
    }
    // What the controller read at the last tick, [input][voxel].
    void write_sensors(double* out) const {
        for (int input = 0; input < sensors::count; ++input)
            if (law_.sensors >> input & 1)
                for (int64_t v = 0; v < voxels_; ++v) *out++ = seen_[input * voxels_ + v];
    }

private:
    using control = effects::control;

    bool reads_contacts() const {
        return sensors::reads(law_.sensors, sensors::load, sensors::gravity);
    }
    bool reads_corners() const {
        return sensors::reads(law_.sensors, sensors::strain, sensors::gravity);
    }
    // As in change_of().
    S share_of_step() const { return values_[control::at_hold] != 0 ? S(0) : S(1) / S(plan_.tick); }
    S* input(int number) { return registers_.data() + int64_t(number) * scripted_block; }

    // Sensors of the body and the scene, the same for all voxels.
    void sense_whole(const double origin[3], const rigid_blocks<S>* blocks) {
        const mass_arrays<S>& masses = columns_.masses;
        const lattice& grid = body_.grid;
        int64_t sums[sensors::body_sums] = {};
        for (int32_t i = 0; i < body_.masses; ++i) {
            const int32_t site = body_.sites[i];
            const sensors::dvector x{double(masses.position[0][site]),
                                     double(masses.position[1][site]),
                                     double(masses.position[2][site])},
                v{double(masses.predicted[0][site]), double(masses.predicted[1][site]),
                  double(masses.predicted[2][site])},
                X{double(site % (grid.nx + 1)), double(site / (grid.nx + 1) % (grid.ny + 1)),
                  double(site / ((grid.nx + 1) * (grid.ny + 1)))};
            const double share = double(body_.mass[site]) / body_.total_mass;
            for (int k = 0; k < sensors::body_sums; ++k)
                sums[k] += sensors::part_of_sum(k, share, x, v, X);
        }
        const scene& in = setup_.scene;
        sensors::surroundings around =
            sensors::surroundings_of(in, origin, double(tick_) / values_[control::at_rate]);
        around.has_block = blocks != nullptr;
        if (blocks) {
            around.block = blocks->at(0).block.place;
            around.block_velocity = blocks->at(0).block.read.velocity;
        }
        double out[sensors::measured - sensors::gravity];
        sensors::sense_body(
            sensors::frame_of(sums), around, body_.rest[0],
            [&](double x, double y) {
                return sensors::ground_height(in, origin, in.heights(), x, y);
            },
            out);
        for (int i = 0; i < sensors::measured - sensors::gravity; ++i) whole_[i] = S(out[i]);
    }

    bool used(int number) const { return law_.sensors >> number & 1; }

    void fill_inputs(const int32_t* voxels, int count) {
        const lattice& grid = body_.grid;
        S sine, cosine;
        sine_cosine(uint64_t(tick_) * clock_.per_step, sine, cosine);
        if (reads_corners()) sense_corners(voxels, count);
        for (int number = sensors::gravity; number < sensors::measured; ++number)
            if (used(number)) std::fill_n(input(number), count, whole_[number - sensors::gravity]);
        if (values_[control::at_noise] > 0 || delay_ > 0)
            for (int number = 0; number < sensors::measured; ++number)
                for (int i = 0; used(number) && i < count; ++i)
                    input(number)[i] = measured(number, voxels[i], input(number)[i]);
        // calls value(voxel) for an input that is read
        const auto each = [&](int number, const auto& value) {
            for (int i = 0; used(number) && i < count; ++i) input(number)[i] = value(voxels[i]);
        };
        each(sensors::activation, [&](int64_t v) { return activation_[now_][v]; });
        each(sensors::place,
             [&](int64_t v) { return sensors::place_along<S>(int(v % grid.nx), grid.nx); });
        each(sensors::place + 1, [&](int64_t v) {
            return sensors::place_along<S>(int(v / grid.nx % grid.ny), grid.ny);
        });
        each(sensors::place + 2, [&](int64_t v) {
            return sensors::place_along<S>(int(v / (int64_t(grid.nx) * grid.ny)), grid.nz);
        });
        each(sensors::phase, [&](int64_t v) { return S(muscles_[std::size_t(v)].phase); });
        each(sensors::clock_sine, [&](int64_t) { return sine; });
        each(sensors::clock_cosine, [&](int64_t) { return cosine; });
        each(sensors::time, [&](int64_t) { return S(double(tick_) / values_[control::at_rate]); });
        for (int k = 0; k < law_.states; ++k)
            for (int i = 0; i < count; ++i)
                input(sensors::first_state + k)[i] = states_[k * voxels_ + voxels[i]];
        for (int i = 0; law_.messages > 0 && i < count; ++i) {
            const int64_t* const beside = beside_.data() + sensors::neighbours * voxels[i];
            for (int k = 0; k < law_.messages; ++k)
                for (int side = 0; side < sensors::neighbours; ++side)
                    input(sensors::first_heard + k * sensors::neighbours + side)[i] =
                        beside[side] < 0 ? S(0) : said_[now_][k * voxels_ + beside[side]];
        }
        if (!seen_.empty())
            for (int number = 0; number < sensors::count; ++number)
                for (int i = 0; used(number) && i < count; ++i)
                    seen_[number * voxels_ + voxels[i]] = double(input(number)[i]);
    }

    void sense_corners(const int32_t* voxels, int count) {
        const lattice& grid = body_.grid;
        voxel_senses<S> of{};
        int64_t lowest[scripted_block];
        S per_weight[scripted_block];
        for (int i = 0; i < count; ++i) {
            lowest[i] = lowest_[std::size_t(voxels[i])];
            per_weight[i] = S(muscles_[std::size_t(voxels[i])].inverse_mass) * per_gravity_;
        }
        for (int c = 0; c < 8; ++c) of.corner[c] = grid.site(c & 1, c >> 1 & 1, c >> 2);
        of.count = count;
        of.lowest = lowest;
        of.edge = S(body_.rest[0]);
        of.per_weight = per_weight;
        of.push = pushes_.empty() ? nullptr : pushes_.data();
        of.registers = registers_.data();
        passes_.sense(columns_.masses, of);
    }

    // A measured value with its noise, as it was `delay_` ticks ago; before the first tick, then.
    S measured(int number, int64_t voxel, S value) {
        if (values_[control::at_noise] > 0)
            value =
                fma(S(values_[control::at_noise]),
                    S(sensors::noise(seed_, uint32_t(tick_), uint32_t(voxel), uint32_t(number))),
                    value);
        if (delay_ == 0) return value;
        const int64_t slots = delay_ + 1;
        const auto slot = [&](int64_t tick) -> S& {
            return past_[((tick % slots) * sensors::measured + number) * voxels_ + voxel];
        };
        slot(tick_) = value;
        return slot(std::max<int64_t>(tick_ - delay_, 0));
    }

    bool take_results(const int32_t* voxels, int count) {
        bool finite = true;
        const S most = S(values_[control::at_change]);
        for (int i = 0; i < count; ++i) {
            const int64_t v = voxels[i];
            const auto result = [&](int number) {
                const S value = input(law_.results[std::size_t(number)])[i];
                finite &= std::isfinite(value);
                return value;
            };
            const S a = sensors::next_activation(result(0), activation_[now_][v], most);
            activation_[1 - now_][v] = a;
            drive_[1 - now_][v] =
                drive_of(setup_.scene, S(muscles_[std::size_t(v)].gain), a, body_.grid, v,
                         materials_[v], double(tick_) / values_[control::at_rate]);
            for (int k = 0; k < law_.states; ++k) states_[k * voxels_ + v] = result(1 + k);
            for (int k = 0; k < law_.messages; ++k)
                said_[1 - now_][k * voxels_ + v] = result(1 + law_.states + k);
        }
        return finite;
    }

    const simulation_setup& setup_;
    const scripted::program& law_;
    const double* const values_;  // of the effect
    const step_passes<S>& passes_;
    const schedule& plan_;
    spring_body& body_;
    robot_columns<S, compensated>& columns_;
    robot_forces<S, compensated>& forces_;
    const int64_t voxels_;
    const uint8_t* const materials_;  // [voxel]
    const float* const genes_;
    const uint64_t seed_;                    // of the noise
    const int delay_;                        // ticks
    const effects::actuation::clock clock_;  // of the ticks
    std::vector<int32_t> used_;              // voxels that are not empty
    std::vector<muscle> muscles_;            // [voxel]
    std::vector<int64_t> lowest_;            // site of each voxel's lowest corner
    std::vector<int64_t> beside_;            // [voxel][side], -1 outside of the lattice
    S per_gravity_ = 0;                      // s^2/m
    array<float> scale_;                     // as a spring's, [direction][count]
    // [voxel]; of two halves one is of the last tick, the other of the next
    std::vector<S> activation_[2], drive_[2], said_[2];
    std::vector<S> states_;     // [state][voxel]
    std::vector<S> past_;       // [slot][input][voxel]
    std::vector<double> seen_;  // [input][voxel]
    std::vector<S> pushes_;     // of contacts, N, [site]
    S whole_[sensors::measured - sensors::gravity] = {};
    std::vector<S> registers_;
    int64_t tick_ = 0;  // number of the last
    int now_ = 1;       // the half of the last tick
    bool current_ = true;
};

}  // namespace limax::cpu
