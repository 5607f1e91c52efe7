// api.cpp: the bodies of limax.h, each inside one guard: exceptions end here as a status and a
// text.
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>

#include "backend/backend.h"
#if defined(LIMAX_WITH_CUDA)
#include "backend/cuda/memory.h"
#endif
#include "base/memory.h"
#include "base/random.h"
#include "body/material.h"
#include "genome/population.h"
#include "limax.h"
#include "physics/time_step.h"
#if defined(LIMAX_WITH_CUDA)
#include "backend/cuda/reconstruction.h"
#endif

// Handles share what they point to with their children, so that any order of freeing is safe.
struct limax_device {
    std::shared_ptr<limax::device> it;
};
struct limax_materials {
    limax::material_table it;
};
struct limax_encoding {
    std::shared_ptr<const limax::encoding> it;
};
struct limax_population {
    limax::population it;
};
struct limax_scene {
    limax::scene it;
};
struct limax_simulation {
    std::shared_ptr<limax::device> device;
    std::unique_ptr<limax::simulation> it;
    int32_t count;
    limax_simulation_options options;
};

namespace {

using limax::fail;
using limax::format;

thread_local std::string last_error;

limax_status remember(limax_status status, const char* text) noexcept {
    try {
        last_error = text;
    } catch (...) {
        last_error.clear();  // no memory even for the text
    }
    return status;
}

template <class Body>
limax_status guard(const Body& body) noexcept {
    try {
        body();
        return LIMAX_OK;
    } catch (const limax::error& failure) {
        return remember(failure.status(), failure.what());
    } catch (const std::bad_alloc&) {
        return remember(LIMAX_OUT_OF_MEMORY, "out of memory");
    } catch (const std::exception& failure) {
        return remember(LIMAX_INTERNAL, failure.what());
    } catch (...) {
        return remember(LIMAX_INTERNAL, "an exception of unknown type");
    }
}

void require(const void* pointer, const char* name) {
    if (!pointer) fail(LIMAX_INVALID_ARGUMENT, format("%s is null", name));
}

int32_t require_robot(const limax_simulation* simulation, int32_t robot) {
    require(simulation, "simulation");
    if (robot < 0 || robot >= simulation->count)
        fail(LIMAX_INVALID_ARGUMENT,
             format("robot %d does not exist; there are %d", robot + 1, simulation->count));
    return robot;
}

limax::random_key key_of(const limax_random_key& key) {
    return {key.seed, key.repetition, key.stream, key.generation, key.individual};
}

// An index into the list of effects, range checked.
const limax::effect_entry& entry_at(int32_t effect) {
    const auto& entries = limax::effect_entries();
    if (effect < 0 || effect >= static_cast<int32_t>(entries.size()))
        fail(LIMAX_INVALID_ARGUMENT,
             format("effect %d does not exist; there are %zu", effect + 1, entries.size()));
    return entries[effect];
}

bool lives_on(const limax::population& population, const limax::device& device) {
    return population.home() && device.houses(*population.home());
}

// Moves a population to where the device keeps its own: for the CPU, back to the host.
void settle(const limax::population& population, limax::device& device) {
    if (!population.code() || lives_on(population, device)) return;
    population.move_to(device.reside(population.code(), population.count()));
}

// Whether bodies that a device made can go to a simulation unseen: all are described, and their
// materials are of the table.
bool known_to_fit(const limax::population& population, const limax::material_table& materials) {
    for (int32_t i = 0; i < population.count(); ++i) {
        const limax_body& body = population.bodies()[i];
        if (body.status == LIMAX_BODY_UNKNOWN) return false;
        for (int32_t m = materials.count(); m < LIMAX_MAX_MATERIALS; ++m)
            if (body.counts[m] > 0) return false;
    }
    return true;
}

// Refuses bodies on the host that are not what their last check said.
void check_bodies(const limax::simulation_setup& setup, const limax::material_table& materials) {
    const int64_t voxels = setup.grid.voxels();
    for (int32_t i = 0; i < setup.count; ++i) {
        if (!setup.mask[i]) continue;
        const limax_body& body = setup.bodies[i];
        if (body.status == LIMAX_BODY_UNKNOWN)
            fail(LIMAX_INVALID_ARGUMENT, format("robot %d has no known body: it must be expressed "
                                                "or checked before it is simulated",
                                                i + 1));
        if (body.status == LIMAX_BODY_VALID &&
            limax::body_hash(setup.grid, setup.voxels.data() + i * voxels) != body.hash)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("robot %d was written to after its check: check it again", i + 1));
        const float* weights = setup.weights.data() + 3 * i * voxels;
        for (int64_t w = 0; w < 3 * voxels; ++w)
            if (!(weights[w] >= 0 && weights[w] <= 1))
                fail(
                    LIMAX_INVALID_ARGUMENT,
                    format("robot %d has a weight of %.9g; weights are 0 to 1", i + 1, weights[w]));
    }
    for (const uint8_t voxel : setup.voxels)
        if (voxel >= materials.count())
            fail(LIMAX_INVALID_ARGUMENT,
                 format("a body uses material index %d; the table '%s' has 0 to %d", voxel,
                        materials.name().c_str(), materials.count() - 1));
}

limax::simulation_setup make_setup(const limax::population& population,
                                   const limax::material_table& materials,
                                   const limax::scene& scene,
                                   const limax_simulation_options& options, const uint8_t* mask,
                                   const limax::device& device) {
    limax::check_options(options, scene);
    limax::simulation_setup setup;
    setup.options = options;
    setup.scene = scene;
    for (int32_t i = 0; i < materials.count(); ++i) setup.materials.push_back(materials.at(i));
    setup.grid = population.grid();
    setup.count = population.count();
    setup.bodies.assign(population.bodies(), population.bodies() + setup.count);
    for (int32_t i = 0; i < setup.count; ++i) setup.mask.push_back(mask ? mask[i] != 0 : 1);
    if (lives_on(population, device) && known_to_fit(population, materials))
        setup.resident = population.bodies_at_home();
    if (!setup.resident) {
        const int64_t voxels = setup.grid.voxels() * setup.count;
        setup.voxels = limax::array<uint8_t>(voxels);
        setup.weights = limax::array<float>(3 * voxels);
        std::copy_n(population.voxels(), voxels, setup.voxels.begin());
        std::copy_n(population.weights(), 3 * voxels, setup.weights.begin());
        check_bodies(setup, materials);
    }
    // a fixed step is refused here rather than by the first robot that is prepared, and so are
    // traces that would not fit; the number of samples does not depend on the step
    const limax::schedule plan = limax::make_schedule(options, scene, 1.0);
    double traces = 0;
    for (int32_t i = 0; i < setup.count; ++i)
        for (int32_t kind = 0; setup.mask[i] && kind < LIMAX_TRACE_KINDS; ++kind)
            traces += double(plan.samples[kind]) *
                      double(limax::trace_width(kind, setup.bodies[i].masses)) * sizeof(double);
    limax::require_memory("record: the traces of this population", traces);
    return setup;
}

// A pointer for whoever has no status to look at: null, and a text, where it cannot be had.
template <class Get>
auto pointer_or_null(const Get& get) noexcept {
    decltype(get()) pointer = nullptr;
    guard([&] { pointer = get(); });
    return pointer;
}

}  // namespace

extern "C" {

// ---- status, version, interruption ----

uint32_t limax_abi_version(void) { return LIMAX_ABI; }
const char* limax_version(void) { return LIMAX_VERSION; }
const char* limax_error_text(void) { return last_error.c_str(); }
uint64_t limax_bytes_held(void) {
    uint64_t bytes = limax::bytes_held().load();
#if defined(LIMAX_WITH_CUDA)
    bytes += limax::cuda::gpu_bytes_held().load();
#endif
    return bytes;
}
void limax_interrupt(void) { limax::set_interrupted(true); }
void limax_interrupt_clear(void) { limax::set_interrupted(false); }
int32_t limax_interrupted(void) { return limax::interrupted(); }

// ---- device ----

limax_status limax_device_create(const char* name, int32_t threads, const char* isa,
                                 limax_device** out) {
    return guard([&] {
        require(name, "name");
        *out = new limax_device{limax::make_device(name, threads, isa)};
    });
}
void limax_device_free(limax_device* device) { delete device; }
const char* limax_device_describe(const limax_device* device) {
    return device ? device->it->describe() : "{}";
}

// ---- materials ----

limax_status limax_materials_load(const char* path, limax_materials** out) {
    return guard([&] {
        require(path, "path");
        *out = new limax_materials{limax::material_table::load(path)};
    });
}
limax_status limax_materials_parse(const char* text, uint64_t length, const char* origin,
                                   limax_materials** out) {
    return guard([&] {
        require(text, "text");
        *out = new limax_materials{
            limax::material_table::parse(std::string(text, length), origin ? origin : "materials")};
    });
}
limax_status limax_materials_copy(const limax_materials* materials, limax_materials** out) {
    return guard([&] {
        require(materials, "materials");
        *out = new limax_materials{materials->it};
    });
}
void limax_materials_free(limax_materials* materials) { delete materials; }
int32_t limax_materials_count(const limax_materials* materials) {
    return materials ? materials->it.count() : 0;
}
const char* limax_materials_name(const limax_materials* materials) {
    return materials ? materials->it.name().c_str() : "";
}
limax_status limax_materials_get(const limax_materials* materials, int32_t index,
                                 limax_material* out) {
    return guard([&] {
        require(materials, "materials");
        *out = materials->it.at(index);
    });
}
limax_status limax_materials_set(limax_materials* materials, int32_t index, const char* field,
                                 double value) {
    return guard([&] {
        require(materials, "materials");
        require(field, "field");
        materials->it.set(index, field, value);
    });
}
limax_status limax_materials_field(const limax_materials* materials, const char* field,
                                   const char** unit, double* minimum, double* maximum,
                                   const char** source) {
    return guard([&] {
        require(materials, "materials");
        require(field, "field");
        const limax::material_field& found = materials->it.field(field);
        *unit = found.unit.c_str();
        *minimum = found.minimum;
        *maximum = found.maximum;
        *source = found.source.c_str();
    });
}

// ---- genome ----

limax_status limax_encoding_create(const limax_encoding_options* options, limax_encoding** out) {
    return guard([&] {
        require(options, "options");
        *out = new limax_encoding{std::make_shared<const limax::encoding>(*options)};
    });
}
void limax_encoding_free(limax_encoding* encoding) { delete encoding; }
int32_t limax_encoding_genes(const limax_encoding* encoding) {
    return encoding ? encoding->it->genes() : 0;
}
const double* limax_encoding_matrix(const limax_encoding* encoding) {
    return encoding ? encoding->it->matrix() : nullptr;
}
const float* limax_encoding_features(const limax_encoding* encoding) {
    return encoding ? encoding->it->features() : nullptr;
}

// ---- random numbers ----

double limax_random_uniform(const limax_random_key* key, uint32_t draw) {
    return limax::random_uniform(key_of(*key), draw);
}
double limax_random_normal(const limax_random_key* key, uint32_t draw) {
    return limax::random_normal(key_of(*key), draw);
}
uint32_t limax_random_integer(const limax_random_key* key, uint32_t draw, uint32_t n) {
    return limax::random_integer(key_of(*key), draw, n);
}

// ---- population ----

limax_status limax_population_create(const int32_t lattice[3], int32_t count,
                                     const limax_encoding* encoding, limax_population** out) {
    return guard([&] {
        require(lattice, "lattice");
        *out = new limax_population{
            limax::population(lattice, count, encoding ? encoding->it : nullptr)};
    });
}
void limax_population_free(limax_population* population) { delete population; }
int32_t limax_population_count(const limax_population* population) {
    return population ? population->it.count() : 0;
}
float* limax_population_genomes(limax_population* population) {
    return population ? pointer_or_null([&] { return population->it.genomes(); }) : nullptr;
}
uint8_t* limax_population_voxels(limax_population* population) {
    return population ? pointer_or_null([&] { return population->it.voxels(); }) : nullptr;
}
float* limax_population_weights(limax_population* population) {
    return population ? pointer_or_null([&] { return population->it.weights(); }) : nullptr;
}
const limax_body* limax_population_bodies(const limax_population* population) {
    return population ? population->it.bodies() : nullptr;
}
limax_status limax_population_read_genomes(const limax_population* population, int32_t first,
                                           int32_t count, float* out) {
    return guard([&] {
        require(population, "population");
        require(out, "out");
        population->it.read_genomes(first, count, out);
    });
}
limax_status limax_population_text(const limax_population* population, int32_t robot,
                                   const char* letters, char* out) {
    return guard([&] {
        require(population, "population");
        require(letters, "letters");
        require(out, "out");
        population->it.write_text(robot, letters, out);
    });
}
limax_status limax_population_initialize(limax_population* population, int32_t first,
                                         int32_t count) {
    return guard([&] {
        require(population, "population");
        const limax::parallel_for alone = [](int n, const std::function<void(int)>& work) {
            for (int i = 0; i < n; ++i) work(i);
        };
        population->it.initialize(first, count, alone);
    });
}
limax_status limax_population_express(limax_population* population,
                                      const limax_materials* materials, int32_t require_muscle,
                                      limax_device* device, int32_t first, int32_t count) {
    return guard([&] {
        require(population, "population");
        require(materials, "materials");
        require(device, "device");
        settle(population->it, *device->it);
        population->it.express(materials->it, require_muscle != 0, device->it->express(),
                               device->it->each(), first, count);
    });
}
limax_status limax_population_check(limax_population* population, const limax_materials* materials,
                                    int32_t require_muscle, int32_t first, int32_t count) {
    return guard([&] {
        require(population, "population");
        require(materials, "materials");
        population->it.check(materials->it, require_muscle != 0, first, count);
    });
}
limax_status limax_population_breed(limax_population* children, const limax_population* parents,
                                    const int32_t* pairs, const limax_breeding* breeding,
                                    limax_device* device, int32_t first, int32_t count) {
    return guard([&] {
        require(children, "children");
        require(parents, "parents");
        require(pairs, "pairs");
        require(breeding, "breeding");
        require(device, "device");
        settle(children->it, *device->it);
        settle(parents->it, *device->it);
        children->it.breed(parents->it, pairs, *breeding, device->it->each(), first, count);
    });
}
limax_status limax_population_diversity(const limax_population* population, const int32_t* robots,
                                        int32_t count, limax_diversity* out) {
    return guard([&] {
        require(population, "population");
        require(robots, "robots");
        *out = population->it.diversity(robots, count);
    });
}

// ---- scene ----

int32_t limax_effect_count(void) { return static_cast<int32_t>(limax::effect_entries().size()); }
limax_status limax_effect_describe(int32_t effect, limax_effect_info* out) {
    return guard([&] {
        const limax::effect_entry& entry = entry_at(effect);
        *out = {entry.name, entry.summary, entry.needs.c_str(), entry.field_count,
                entry.most_instances};
    });
}
limax_status limax_effect_field(int32_t effect, int32_t field, limax_field_info* out) {
    return guard([&] {
        const limax::effect_entry& entry = entry_at(effect);
        if (field < 0 || field >= entry.field_count)
            fail(LIMAX_INVALID_ARGUMENT, format("effect '%s' has %d fields, not %d", entry.name,
                                                entry.field_count, field + 1));
        const limax::effects::field& found = entry.fields[field];
        *out = {found.name, found.unit,    found.note,    found.components,
                0,          found.minimum, found.maximum, {}};
        std::copy(found.value, found.value + 3, out->value);
    });
}
limax_status limax_scene_create(limax_scene** out) {
    return guard([&] { *out = new limax_scene; });
}
void limax_scene_free(limax_scene* scene) { delete scene; }
limax_status limax_scene_add(limax_scene* scene, const char* effect) {
    return guard([&] {
        require(scene, "scene");
        require(effect, "effect");
        scene->it.add(effect);
    });
}
limax_status limax_scene_set(limax_scene* scene, const char* effect, const char* field,
                             const double* values, int32_t count) {
    return guard([&] {
        require(scene, "scene");
        require(effect, "effect");
        require(field, "field");
        require(values, "values");
        scene->it.set(effect, field, values, count);
    });
}
limax_status limax_scene_set_heights(limax_scene* scene, const char* effect, const char* field,
                                     const double* heights, int32_t nx, int32_t ny) {
    return guard([&] {
        require(scene, "scene");
        require(effect, "effect");
        require(field, "field");
        require(heights, "heights");
        scene->it.set_heights(effect, field, heights, nx, ny);
    });
}
limax_status limax_scene_add_script(limax_scene* scene, const char* name, const char* text,
                                    const limax_script_parameter* parameters, int32_t count,
                                    const double* bound) {
    return guard([&] {
        require(scene, "scene");
        require(name, "name");
        require(text, "text");
        if (count < 0)
            fail(LIMAX_INVALID_ARGUMENT, format("count is %d; it must be 0 or more", count));
        if (count > 0) require(parameters, "parameters");
        std::vector<limax::scripted::parameter> given;
        for (int32_t i = 0; i < count; ++i) {
            require(parameters[i].name, "a parameter's name");
            given.push_back({parameters[i].name, parameters[i].components, {}});
            std::copy(parameters[i].value, parameters[i].value + 3, given.back().value);
        }
        scene->it.add_script(name, text, given, bound);
    });
}
limax_status limax_scene_check(const limax_scene* scene) {
    return guard([&] {
        require(scene, "scene");
        scene->it.check();
    });
}

// ---- simulation ----

void limax_simulation_defaults(limax_simulation_options* out) {
    *out = {};
    out->integrator = LIMAX_LEAPFROG;
    out->precision = LIMAX_COMPENSATED;
    out->sharing = LIMAX_SHARING_MEAN;
    out->duration = 5.0;
    out->bound_fraction = 0.9;
    out->edge = 0.1;
    out->max_speed = 1000.0;
    out->max_stretch = 10.0;
}
limax_status limax_simulation_create(const limax_population* population,
                                     const limax_materials* materials, const limax_scene* scene,
                                     const limax_simulation_options* options, const uint8_t* mask,
                                     limax_device* device, limax_simulation** out) {
    return guard([&] {
        require(population, "population");
        require(materials, "materials");
        require(scene, "scene");
        require(options, "options");
        require(device, "device");
        auto setup =
            make_setup(population->it, materials->it, scene->it, *options, mask, *device->it);
        *out = new limax_simulation{device->it, device->it->simulate(std::move(setup)),
                                    population->it.count(), *options};
    });
}
void limax_simulation_free(limax_simulation* simulation) { delete simulation; }
limax_status limax_simulation_advance(limax_simulation* simulation, double seconds, int64_t steps,
                                      limax_progress* out) {
    return guard([&] {
        require(simulation, "simulation");
        limax::require_range("seconds", seconds, 0, 1e6, "s");
        limax::require_range("steps", double(steps), 0, 9223372036854775807.0, "");
        *out = simulation->it->advance(seconds, steps);
    });
}
limax_status limax_simulations_advance(limax_simulation* const* simulations, int32_t count,
                                       double seconds, limax_progress* out) {
    return guard([&] {
        require(simulations, "simulations");
        limax::require_range("seconds", seconds, 0, 1e6, "s");
        for (int32_t i = 0; i < count; ++i) require(simulations[i], "a simulation");
        // what was sent to a GPU is collected even if another simulation fails
        std::exception_ptr failure;
        int32_t sent = 0;
        const auto attempt = [&](const auto& work) {
            try {
                work();
            } catch (...) {
                if (!failure) failure = std::current_exception();
            }
        };
        for (; sent < count && !failure; ++sent)
            attempt([&] { simulations[sent]->it->enqueue(seconds / count); });
        for (int32_t i = 0; i < sent; ++i) attempt([&] { out[i] = simulations[i]->it->collect(); });
        if (failure) std::rethrow_exception(failure);
    });
}
const limax_outcome* limax_simulation_outcomes(const limax_simulation* simulation) {
    return simulation ? simulation->it->outcomes() : nullptr;
}
limax_status limax_simulation_trace(const limax_simulation* simulation, int32_t robot, int32_t kind,
                                    const double** data, int64_t* samples, int64_t* width) {
    return guard([&] {
        require_robot(simulation, robot);
        if (kind < 0 || kind >= LIMAX_TRACE_KINDS || simulation->options.record[kind] == 0)
            fail(LIMAX_INVALID_ARGUMENT, format("trace kind %d is not recorded", kind));
        simulation->it->trace(robot, kind, data, samples, width);
    });
}
limax_status limax_simulation_describe(limax_simulation* simulation, const char** out) {
    return guard([&] {
        require(simulation, "simulation");
        *out = simulation->it->describe();
    });
}
limax_status limax_simulation_sites(const limax_simulation* simulation, int32_t robot,
                                    const int32_t** sites) {
    return guard([&] {
        const int32_t index = require_robot(simulation, robot);
        *sites = simulation->it->sites(index);
    });
}
limax_status limax_simulation_place(limax_simulation* simulation, int32_t robot,
                                    const double* positions, const double* velocities) {
    return guard([&] {
        const int32_t index = require_robot(simulation, robot);
        simulation->it->place(index, positions, velocities);
    });
}
limax_status limax_simulation_state(const limax_simulation* simulation, int32_t robot,
                                    double* positions, double* velocities) {
    return guard([&] {
        const int32_t index = require_robot(simulation, robot);
        simulation->it->state(index, positions, velocities);
    });
}

limax_status limax_simulation_block(const limax_simulation* simulation, int32_t robot,
                                    double* out) {
    return guard([&] {
        const int32_t index = require_robot(simulation, robot);
        require(out, "out");
        simulation->it->block(index, out);
    });
}

// ---- comparison ----

limax_status limax_reconstruction_run(limax_device* device, const limax_population* population,
                                      const limax_materials* materials, const limax_scene* scene,
                                      const limax_simulation_options* options, int64_t steps,
                                      double* seconds, double* center) {
    return guard([&] {
        require(device, "device");
        require(population, "population");
        require(materials, "materials");
        require(scene, "scene");
        require(options, "options");
        require(seconds, "seconds");
        require(center, "center");
        limax::require_range("steps", double(steps), 1, 1e9, "");
        const std::string kind = nlohmann::json::parse(device->it->describe()).at("kind");
        if (kind != "cuda")
            fail(LIMAX_NO_DEVICE, format("the reconstruction of the paper's scheme runs on a GPU "
                                         "alone; this device is '%s'",
                                         kind.c_str()));
#if defined(LIMAX_WITH_CUDA)
        const auto setup =
            make_setup(population->it, materials->it, scene->it, *options, nullptr, *device->it);
        const limax::cuda::reconstructed_run run =
            limax::cuda::run_reconstruction(setup, device->it->each(), steps);
        *seconds = run.seconds;
        std::copy(run.center.begin(), run.center.end(), center);
#endif
    });
}

}  // extern "C"
