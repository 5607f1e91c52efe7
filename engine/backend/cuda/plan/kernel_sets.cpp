// kernel_sets.cpp: from a scene to the defines of its kernels.
#include "backend/cuda/plan/kernel_sets.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

#include "body/springs.h"
#include "physics/body_frame.h"

namespace limax::cuda {

namespace {

// Voxels of a block beyond which no plan is worth making: it would not fit.
constexpr int64_t most_cubes_of_block = 512;
// Effects whose laws on masses need few registers.
constexpr unsigned light_effects = effects::bit<effects::springs> | effects::bit<effects::damping> |
                                   effects::muscle_bits | effects::bit<effects::target> |
                                   effects::bit<effects::gravity> | effects::bit<effects::ground> |
                                   effects::bit<effects::friction>;

// LIMAX_CUDA_PATH=grid or tiles sends small lattices over these paths too, so that tests can
// compare them.
std::string path_asked_for() {
    const char* path = std::getenv("LIMAX_CUDA_PATH");
    if (!path || !*path || std::string(path) == "auto") return "auto";
    if (std::string(path) == "grid" || std::string(path) == "tiles") return path;
    fail(LIMAX_INVALID_ARGUMENT,
         format("LIMAX_CUDA_PATH is '%s'; it must be auto, grid or tiles", path));
}

// Tiles wait for each other's packets, of 16 bytes that are read as one: since CUDA 12.3. They were
// never run on a GPU below compute capability 9.0.
bool tiles_possible(const gpu& device) {
    const compiler* nvrtc = compiler::get(nullptr);
    return device.capability >= 90 && (!nvrtc || std::stod(nvrtc->version()) >= 12.3);
}

std::string names_of_effects(unsigned mask) {
    std::string names;
    effects::for_each([&]<class E>(E) {
        if (mask & effects::bit<E>) names += (names.empty() ? "" : ", ") + std::string(E::name);
    });
    return names;
}

// Effects that a kernel may have and a scene lack: with these values, and with springs that have no
// damping and no amplitude, they do not change results. Null for an effect that cannot be
// silenced.
const double* silent_values(int effect) {
    using namespace effects;
    // a plane far below everything; no acceleration; no friction; any frequency
    static constexpr double ground_below[] = {1.0, 0.0, -1e30}, none[] = {0.0, 0.0, 0.0},
                            muscles[] = {1.0, 0.0};
    if (effect == index_of<ground>) return ground_below;
    if (effect == index_of<actuation>) return muscles;
    if (effect == index_of<damping> || effect == index_of<gravity> || effect == index_of<friction>)
        return none;
    return nullptr;
}

// Effects of kernels built with limax that include those of `wanted`, and otherwise only such as
// can be silenced: the fewest first.
std::vector<unsigned> covering_masks(unsigned wanted) {
    std::set<unsigned> found;
    for (const kernel_set& set : ahead_of_time_sets()) {
        if (set.entry != "step" && set.entry != "grid") continue;
        const auto mask = unsigned(std::stoul(set.defines.at("LIMAX_EFFECTS")));
        bool fits = (mask & wanted) == wanted;
        for (int effect = 0; effect < effects::all::count; ++effect)
            fits &= !((mask & ~wanted) >> effect & 1u) || silent_values(effect) != nullptr;
        if (fits) found.insert(mask);
    }
    std::vector<unsigned> masks(found.begin(), found.end());
    std::stable_sort(masks.begin(), masks.end(), [](unsigned a, unsigned b) {
        return __builtin_popcount(a) < __builtin_popcount(b);
    });
    return masks;
}

// Numbers that the scene's forces have as parameters.
int parameters_of_scripts(const scene& scene) {
    int count = 0;
    for (const scripted_effect& script : scene.scripts()) count += script.law.parameters;
    return count;
}

// Adds a scene's scripted effects to the kernels that step and prepare robots.
void add_scripts(const scene& scene, kernel_set& step, kernel_set& prepare) {
    if (scene.scripts().empty()) return;
    std::vector<const scripted::program*> laws;
    for (const scripted_effect& script : scene.scripts()) laws.push_back(&script.law);
    int registers = 0;
    step.defines.emplace("LIMAX_SCRIPTED", scripted::kernel_text(laws, registers));
    step.defines.emplace("LIMAX_SCRIPTED_REGISTERS", std::to_string(registers));
    const effects::stiffness_damping bound = scene.script_bound();
    prepare.defines.emplace("LIMAX_SCRIPTED_STIFFNESS", format("%a", bound.stiffness));
    prepare.defines.emplace("LIMAX_SCRIPTED_DAMPING", format("%a", bound.damping));
}

// Memory of a robot's controller in a kernel.
control_layout layout_of(const simulation_setup& setup) {
    const scripted::program& law = setup.scene.controller();
    const double* values = setup.scene.values(effects::index_of<effects::control>);
    const auto delay =
        int(std::lround(values[effects::control::at_delay] * values[effects::control::at_rate]));
    return {law.states, law.messages,
            sensors::count_bits(law.sensors & ((uint64_t(1) << sensors::measured) - 1)),
            delay > 0 ? delay + 1 : 0,
            setup.options.record[LIMAX_TRACE_SENSOR] ? sensors::count_bits(law.sensors) : 0};
}
// Genes of a robot on a GPU: rows of float4.
int genes_of(const simulation_setup& setup) { return (setup.scene.controller().genes + 3) / 4 * 4; }

// Adds a scene's controller to the kernels that step and measure robots.
void add_controller(const simulation_setup& setup, kernel_set& step, kernel_set& measure) {
    const scripted::program& law = setup.scene.controller();
    const control_layout layout = layout_of(setup);
    const std::pair<const char*, std::string> defines[] = {
        {"LIMAX_CONTROL", scripted::kernel_text(law, parameters_of_scripts(setup.scene))},
        {"LIMAX_CONTROL_REGISTERS", std::to_string(law.registers())},
        {"LIMAX_CONTROL_SENSORS", format("%lluull", static_cast<unsigned long long>(law.sensors))},
        {"LIMAX_CONTROL_GENES", std::to_string(genes_of(setup))},
        {"LIMAX_CONTROL_STATES", std::to_string(law.states)},
        {"LIMAX_CONTROL_MESSAGES", std::to_string(law.messages)},
        {"LIMAX_CONTROL_SLOTS", std::to_string(layout.slots)},
        {"LIMAX_CONTROL_SEEN", layout.seen > 0 ? "1" : "0"}};
    for (const auto& [name, value] : defines)
        for (kernel_set* set : {&step, &measure}) set->defines.emplace(name, value);
}

const char* name_of(kernel_form form) {
    switch (form) {
        case kernel_form::many: return "many";
        case kernel_form::one: return "one robot";
        case kernel_form::any_lattice: return "any lattice";
    }
    return "";
}

const char* name_of_precision(int32_t precision) {
    static const char* const names[] = {"single", "compensated", "double"};
    return names[precision];
}

}  // namespace

template <class R>
step_launch<R> scene_kernels::step_arguments() const {
    const simulation_setup& setup = *setup_;
    step_launch<R> launch{};
    const double origin[3] = {0, 0, 0};
    for (int kind = 0; kind < 3; ++kind) {
        launch.rest[kind] = setup.options.edge * std::sqrt(double(kind + 1));
        launch.rest_single[kind] = float(launch.rest[kind]);
    }
    launch.max_speed = setup.options.max_speed;
    launch.max_stretch = setup.options.max_stretch;
    // the owner of the memory sets the addresses
    launch.scene.heights = setup.scene.heights();
    launch.scene.heights.heights = nullptr;
    R* parameter = launch.parameters;
    const auto add_parameters = [&](const scripted::program& law) {
        for (int i = 0; i < law.parameters; ++i)
            *parameter++ = R(law.constants[std::size_t(law.first_parameter + i)]);
    };
    for (const scripted_effect& script : setup.scene.scripts()) add_parameters(script.law);
    add_parameters(setup.scene.controller());
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        constexpr int components = effects::components<E>;
        launch.scene.count[index] = setup.scene.instances(index);
        for (int i = 0; i < setup.scene.instances(index); ++i)
            std::copy_n(setup.scene.values(index, i), components, launch.scene.of(index, i));
        if (!setup.scene.has(index) && silent_values(index))
            std::copy_n(silent_values(index), components, launch.scene.of(index));
        if constexpr (effects::acts_on_masses<E> && !effects::repeatable<E>)
            launch.params.template of<E>() = E::template make<R>(launch.scene.of(index), origin);
    });
    return launch;
}

template <class R>
measure_launch<R> scene_kernels::measure_arguments() const {
    const step_launch<R> step = step_arguments<R>();
    measure_launch<R> launch{};
    launch.grid = setup_->grid;
    std::copy_n(step.rest, 3, launch.rest);
    launch.scene = step.scene;
    return launch;
}

template <class R>
prepare_launch<R> scene_kernels::prepare_arguments() const {
    const limax_simulation_options& options = setup_->options;
    prepare_launch<R> launch{};
    launch.grid = setup_->grid;
    launch.summed = options.sharing == LIMAX_SHARING_SUM;
    launch.effects = int32_t(setup_->scene.mask());
    launch.by_voxels = options.bound == LIMAX_BOUND_VOXELS;
    launch.edge = options.edge;
    for (int axis = 0; axis < 3; ++axis) {
        launch.position[axis] = options.position[axis];
        launch.origin[axis] = whole_origin_steps(options.position[axis]);
        launch.velocity[axis] = options.velocity[axis];
    }
    launch.scene = step_arguments<R>().scene;
    static_assert(sizeof launch.materials / sizeof *launch.materials >= LIMAX_MAX_MATERIALS);
    for (std::size_t i = 0; i < setup_->materials.size(); ++i)
        launch.materials[i] = law_of(setup_->materials[i]);
    return launch;
}

template prepare_launch<float> scene_kernels::prepare_arguments<float>() const;
template prepare_launch<double> scene_kernels::prepare_arguments<double>() const;
template step_launch<float> scene_kernels::step_arguments<float>() const;
template step_launch<double> scene_kernels::step_arguments<double>() const;
template measure_launch<float> scene_kernels::measure_arguments<float>() const;
template measure_launch<double> scene_kernels::measure_arguments<double>() const;

std::string scene_kernels::describe() const {
    const function_facts facts = step_->facts("limax_advance");
    nlohmann::ordered_json text;
    text["device"] = "cuda";
    text["path"] = tiles ? "tiles" : on_grid_ ? "grid" : "block";
    text["effects"] = names_of_effects(setup_->scene.mask());
    if (mask_ != setup_->scene.mask()) text["made_for"] = names_of_effects(mask_);
    text["form"] = name_of(form_);
    text["precision"] = name_of_precision(setup_->options.precision);
    text["origin"] = name_of(step_->binary().origin);
    text["seconds"] = step_->binary().seconds;
    text["architecture"] = step_->binary().architecture;
    text["threads"] = step_threads();
    text["registers"] = facts.registers;
    text["spilled"] = facts.spilled;
    text["shared_bytes"] = step_bytes() + std::size_t(facts.shared);
    text["blocks_of_multiprocessor"] =
        step_->blocks_of_multiprocessor("limax_advance", step_threads(), step_bytes());
    if (on_grid_) text["tiles"] = grid_.tiles;
    if (tiles) text["tiles"] = tiles->tiles, text["robots_at_once"] = most_robots_;
    text["instructions"] = facts.instructions;
    return text.dump();
}

int scene_kernels::step_threads() const {
    return tiles ? tiles->threads : on_grid_ ? grid_.threads : shape_.threads;
}
std::size_t scene_kernels::step_bytes() const {
    return tiles ? tiles->shared_bytes : on_grid_ ? grid_.shared_bytes : shape_.shared_bytes;
}

scene_kernels::robot_memory scene_kernels::memory_of_robot() const {
    const auto sites = std::size_t(setup_->grid.sites());
    robot_memory memory;
    if (on_grid_) {
        // values of a mass, as `exchanged` of kernels/grid_tiles.h
        const std::size_t seen = shares_velocity ? 6 : 3;
        memory.exchange = 2 * seen * sites;
        memory.sums = sum_sets * grid_sums;
        memory.arrived = 1;
        if (has_faces || has_solid) memory.after = 6 * sites;
    }
    if (tiles) {
        // as `parcel` of kernels/tile_memory.h
        const std::size_t parts = setup_->options.precision == LIMAX_DOUBLE ? 2 : 1;
        const auto threads = std::size_t(tiles->tiles * tiles->threads);
        memory.sums = sum_sets * grid_sums;
        memory.arrived = 3;
        memory.masses = parts * (shares_velocity ? 2 : 1) * threads * std::size_t(tiles->rounds);
        memory.forces = parts * threads * std::size_t(7 * tiles->senders);
    }
    if (has_faces) memory.faces = 3 * sites;
    if (controlled) {
        const auto voxels = std::size_t(setup_->grid.voxels());
        memory.control = std::size_t(layout_of(*setup_).count()) * voxels;
        memory.genes = std::size_t(genes_of(*setup_));
        memory.muscles =
            std::size_t(muscle_columns_of(setup_->scene.has(effects::index_of<effects::growth>))) *
            voxels;
    }
    if (meets) {
        memory.surface = sites;
        memory.partners = (1 + most_partners) * sites;
        memory.listed_at = 3 * sites;
        memory.moved = 1;
    }
    if (has_solid) {
        int contacts = 0;
        effects::for_each([&]<class E>(E) {
            if (effects::is_contact<E>) contacts += setup_->scene.instances(effects::index_of<E>);
        });
        const int solids = setup_->scene.instances(effects::index_of<effects::block>);
        memory.solids = std::size_t(solids);
        memory.solid_marks = std::size_t(marks_of(int64_t(sites)));
        memory.solid_touches = 2 * sites *
                               std::size_t(setup_->options.precision == LIMAX_DOUBLE
                                               ? doubles_of_touch<double>(solids)
                                               : doubles_of_touch<float>(solids));
        memory.solid_corners = std::size_t(
            solids *
            corners_of_solid(contacts, setup_->scene.has(effects::index_of<effects::edges>)));
        memory.solid_pairs = std::size_t(pairs_of_solids(solids));
        if (!on_grid_) memory.solid_after = 3 * sites;
    }
    return memory;
}

// Robots that the second-level cache does not hold read their parameters from global memory at
// every step: 66 robots of 24x24x24 took 1.5 times as long, stepped all at once, as 9 at a time.
int scene_kernels::robots_in_cache(const gpu& device) const {
    const std::size_t real =
        setup_->options.precision == LIMAX_DOUBLE ? sizeof(double) : sizeof(float);
    const std::size_t of_site = sizeof(float) * std::size_t(spring_columns) * direction_count +
                                real * std::size_t(state_columns);
    const std::size_t bytes =
        of_site * std::size_t(setup_->grid.sites()) + real * memory_of_robot().exchange;
    return int(device.second_level_cache / bytes);
}

int scene_kernels::blocks_of_robot(unsigned robots) const {
    return std::min(blocks_at_once_ / int(robots), grid_.tiles);
}

// Chooses the path, and the shape of its blocks.
void scene_kernels::choose_path(block_plans& plans, const gpu& device, int robots) {
    // The path depends on no effect except those on faces, which need more memory: it is chosen
    // for all other effects together.
    const bool many_laws = has_faces || meets || has_solid || (mask_ & ~light_effects) != 0 ||
                           !setup_->scene.scripts().empty();
    kernel_needs needs{setup_->options.precision, spring_columns, shares_velocity, has_faces,
                       many_laws};
    if (controlled) {
        const int genes = genes_of(*setup_);
        const std::size_t real = setup_->options.precision == LIMAX_DOUBLE ? 8 : 4;
        needs.control = sizeof(float) * std::size_t(genes <= most_shared_genes ? genes : 0) +
                        sizeof(double) * (sensors::body_sums + sensors::measured);
        needs.drive = 2 * real * std::size_t(setup_->grid.sites() + setup_->grid.site(1, 1, 1));
    }
    const kernel_needs most{setup_->options.precision, 4, true, has_faces, true};
    const std::size_t shared = device.shared_memory_of_block;
    const std::string path = path_asked_for();
    const bool any = form_ == kernel_form::any_lattice;
    if (!any && path == "auto" && setup_->grid.voxels() <= most_cubes_of_block) {
        const auto candidate = plans.of(setup_->grid);
        if (shape_block(*candidate, most, shared)) {
            plan = candidate;
            const auto many = shape_block(*plan, needs, shared);
            shape_ = form_ == kernel_form::one
                         ? shape_block(*plan, needs, shared, kernel_form::one).value_or(*many)
                         : *many;
            return;
        }
    }
    // one kernel for all large populations
    const int most_robots = device.multiprocessors;
    if (!any && path != "grid" && !has_faces && !meets && !has_solid && tiles_possible(device))
        tiles = plan_tiles(setup_->grid, needs, shared, device.multiprocessors,
                           robots <= most_robots ? robots : 32 * most_robots);
    on_grid_ = !tiles;
    if (on_grid_)
        grid_ = form_ == kernel_form::any_lattice
                    ? shape_any_grid(setup_->grid, needs)
                    : shape_grid(setup_->grid, needs, shared, device.multiprocessors);
}

// Adds what follows from lattice and path to the defines of the kernel that steps robots.
void scene_kernels::define_shape(kernel_set& step) const {
    const auto define = [&](const char* name, auto value) {
        step.defines.emplace(name, std::to_string(value));
    };
    if (form_ != kernel_form::any_lattice) {
        define("LIMAX_NX", setup_->grid.nx);
        define("LIMAX_NY", setup_->grid.ny);
        define("LIMAX_NZ", setup_->grid.nz);
    }
    define("LIMAX_THREADS", step_threads());
    define("LIMAX_SHARED_BYTES", step_bytes());
    if (tiles) {
        define("LIMAX_ROW", tiles->row);
        define("LIMAX_PLANE", tiles->plane);
        define("LIMAX_PLACES", tiles->places);
        define("LIMAX_OWN_PLACES", tiles->own_places);
        define("LIMAX_TILES", tiles->tiles);
        define("LIMAX_ROUNDS", tiles->rounds);
        define("LIMAX_RIM_SLOTS", tiles->rim_slots);
        define("LIMAX_SENDERS", tiles->senders);
        define("LIMAX_READERS", tiles->readers);
        define("LIMAX_HALO", tiles->halo);
        define("LIMAX_INBOX", tiles->inbox);
    } else if (on_grid_) {
        define("LIMAX_TILE_X", grid_.tile[0]);
        define("LIMAX_TILE_Y", grid_.tile[1]);
        define("LIMAX_TILE_Z", grid_.tile[2]);
        define("LIMAX_BLOCKS", grid_.blocks);
    } else {
        define("LIMAX_ROW", plan->row);
        define("LIMAX_PLANE", plan->plane);
        define("LIMAX_PLACES", plan->places);
        define("LIMAX_CUBE_SLOTS", plan->cube_slots);
        define("LIMAX_RIM_SLOTS", plan->rim_slots);
        define("LIMAX_MIXED", int(plan->mixed));
        define("LIMAX_BLOCKS", shape_.blocks);
    }
}

scene_kernels load_kernels(const simulation_setup& setup, unsigned mask, kernel_form form,
                           block_plans& plans, gpu_place& place, int robots) {
    const context& gpu = place.gpu;
    kernel_library& kernels = place.kernels;
    scene_kernels out;
    out.setup_ = &setup;
    out.mask_ = mask;
    out.form_ = form;
    out.damped = mask & effects::bit<effects::damping>;
    out.actuated = mask & effects::muscle_bits;
    out.controlled = mask & effects::bit<effects::control>;
    out.has_faces = mask & effects::face_bits;
    out.meets = mask & effects::meeting_bits;
    out.has_solid = mask & effects::solid_bits;
    out.shares_velocity = out.damped || out.has_faces || out.meets ||
                          sensors::reads_rates(setup.scene.controller().sensors);
    out.spring_columns = 1 + (out.damped ? 1 : 0) + (out.actuated ? 2 : 0);
    out.state_columns = setup.options.precision == LIMAX_COMPENSATED ? 15 : 9;
    out.doing_ = format("stepping robots of %dx%dx%d voxels with %s in %s", setup.grid.nx,
                        setup.grid.ny, setup.grid.nz, names_of_effects(setup.scene.mask()).c_str(),
                        name_of_precision(setup.options.precision));

    out.choose_path(plans, gpu.device(), robots);

    const std::map<std::string, std::string> of_scene = {
        {"LIMAX_EFFECTS", std::to_string(mask)},
        {"LIMAX_PRECISION", std::to_string(setup.options.precision)},
        {"LIMAX_LEAPFROG", setup.options.integrator == LIMAX_LEAPFROG ? "1" : "0"}};
    kernel_set step{out.tiles      ? "tiles"
                    : out.on_grid_ ? "grid"
                                   : "step",
                    of_scene},
        prepare{"prepare", of_scene}, measure{"measure", of_scene};
    if (const uint64_t code = instances_code(setup.scene))
        step.defines.emplace("LIMAX_INSTANCES", std::to_string(code));
    add_scripts(setup.scene, step, prepare);
    if (out.controlled) add_controller(setup, step, measure);
    out.define_shape(step);
    out.step_ = kernels.load(step);
    out.step_->allow_shared_memory("limax_advance", out.step_bytes());
    out.blocks_at_once_ = gpu.device().multiprocessors *
                          std::max(1, out.step_->blocks_of_multiprocessor(
                                          "limax_advance", out.step_threads(), out.step_bytes()));
    if (out.tiles) out.most_robots_ = unsigned(out.blocks_at_once_ / out.tiles->tiles);
    if (out.on_grid_) {
        out.most_robots_ = unsigned(robots_together(out.grid_.tiles, out.blocks_at_once_,
                                                    out.robots_in_cache(gpu.device())));
    }
    out.summarize_ = kernels.load(kernel_set{"summarize", {}});
    out.prepare_ = kernels.load(prepare);
    bool measures = false;
    for (int kind = 0; kind < sample_kinds; ++kind)
        measures |= !taken_by_step(kind) && setup.options.record[kind] > 0;
    if (measures) out.measure_ = kernels.load(measure);
    return out;
}

scene_kernels load_scene(const simulation_setup& setup, std::size_t robots, block_plans& plans,
                         gpu_place& place) {
    const unsigned wanted = setup.scene.mask();
    const bool few = robots <= std::size_t(place.gpu.device().multiprocessors);
    const kernel_form best = few ? kernel_form::one : kernel_form::many;
    try {
        return load_kernels(setup, wanted, best, plans, place, int(robots));
    } catch (const error& problem) {
        if (problem.status() != LIMAX_NO_DEVICE) throw;
        // Nothing can be compiled: what was built with limax for more effects, more robots or
        // more lattices will do.
        for (const kernel_form form : {best, kernel_form::many, kernel_form::any_lattice})
            for (const unsigned mask : covering_masks(wanted)) try {
                    return load_kernels(setup, mask, form, plans, place, int(robots));
                } catch (const error& other) {
                    if (other.status() != LIMAX_NO_DEVICE) throw;
                }
        fail(LIMAX_NO_DEVICE,
             format("%s on %dx%dx%d voxels in %s: %s", names_of_effects(wanted).c_str(),
                    setup.grid.nx, setup.grid.ny, setup.grid.nz,
                    name_of_precision(setup.options.precision), problem.what()));
    }
}

}  // namespace limax::cuda
