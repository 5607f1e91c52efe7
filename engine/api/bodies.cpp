// bodies.cpp: materials, genomes and populations of limax.h: from a genome to a body, and breeding.
#include <functional>
#include <memory>

#include "api/api.h"
#include "genome/pareto.h"

namespace {

using namespace limax::api;

// Moves a population to where the device keeps its own: for the CPU, back to the host.
void settle(const limax::population& population, limax::device& device) {
    if (!population.code() || is_stored_on(population, device)) return;
    population.move_to(device.make_population(population.code(), population.count()));
}

}  // namespace

extern "C" {

// ---- materials ----

limax_status limax_materials_load(const char* path, limax_materials** out) {
    return guard([&] {
        require("path, out", path, out);
        *out = new limax_materials{limax::material_table::load(path)};
    });
}
limax_status limax_materials_parse(const char* text, uint64_t length, const char* origin,
                                   limax_materials** out) {
    return guard([&] {
        require("text, out", text, out);
        *out = new limax_materials{
            limax::material_table::parse({text, length}, origin ? origin : "materials")};
    });
}
limax_status limax_materials_copy(const limax_materials* materials, limax_materials** out) {
    return read(materials, "materials", [&] {
        require("out", out);
        *out = new limax_materials{materials->it};
    });
}
void limax_materials_free(limax_materials* materials) { delete materials; }
int32_t limax_materials_count(const limax_materials* materials) {
    return value_or(0, materials, "materials", [&] { return materials->it.count(); });
}
const char* limax_materials_name(const limax_materials* materials) {
    return value_or("", materials, "materials", [&] { return materials->it.name().c_str(); });
}
limax_status limax_materials_get(const limax_materials* materials, int32_t index,
                                 limax_material* out) {
    return read(materials, "materials", [&] {
        require("out", out);
        *out = materials->it.at(index);
    });
}
limax_status limax_materials_set(limax_materials* materials, int32_t index, const char* field,
                                 double value) {
    return change(materials, "materials", [&] {
        require("field", field);
        materials->it.set(index, field, value);
    });
}
limax_status limax_materials_field(const limax_materials* materials, const char* field,
                                   const char** unit, double* minimum, double* maximum,
                                   const char** source) {
    return read(materials, "materials", [&] {
        require("field, unit, minimum, maximum, source", field, unit, minimum, maximum, source);
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
        require("options, out", options, out);
        *out = new limax_encoding{std::make_shared<const limax::encoding>(*options)};
    });
}
void limax_encoding_free(limax_encoding* encoding) { delete encoding; }
int32_t limax_encoding_genes(const limax_encoding* encoding) {
    return value_or(0, encoding, "encoding", [&] { return encoding->it->genes(); });
}
int32_t limax_encoding_control_genes(const limax_encoding* encoding) {
    return value_or(0, encoding, "encoding", [&] { return encoding->it->control_genes(); });
}
const double* limax_encoding_matrix(const limax_encoding* encoding) {
    return value_or<const double*>(nullptr, encoding, "encoding",
                                   [&] { return encoding->it->matrix(); });
}
const float* limax_encoding_features(const limax_encoding* encoding) {
    return value_or<const float*>(nullptr, encoding, "encoding",
                                  [&] { return encoding->it->features(); });
}

// ---- population ----

limax_status limax_population_create(const int32_t lattice[3], int32_t count,
                                     const limax_encoding* encoding, limax_population** out) {
    return guard([&] {
        require("lattice, out", lattice, out);
        *out = new limax_population{
            limax::population(lattice, count, encoding ? encoding->it : nullptr)};
    });
}
void limax_population_free(limax_population* population) { delete population; }
int32_t limax_population_count(const limax_population* population) {
    return value_or(0, population, "population", [&] { return population->it.count(); });
}
float* limax_population_genomes(limax_population* population) {
    return value_or<float*>(nullptr, population, "population", [&] {
        const auto use = changing(population, "population");
        return population->it.genomes();
    });
}
uint8_t* limax_population_voxels(limax_population* population) {
    return value_or<uint8_t*>(nullptr, population, "population", [&] {
        const auto use = changing(population, "population");
        return population->it.voxels();
    });
}
float* limax_population_weights(limax_population* population) {
    return value_or<float*>(nullptr, population, "population", [&] {
        const auto use = changing(population, "population");
        return population->it.weights();
    });
}
const limax_body* limax_population_bodies(const limax_population* population) {
    return value_or<const limax_body*>(nullptr, population, "population",
                                       [&] { return population->it.bodies(); });
}
limax_status limax_population_read_genomes(const limax_population* population, int32_t first,
                                           int32_t count, float* out) {
    return change(population, "population", [&] {
        require("out", out);
        population->it.read_genomes(first, count, out);
    });
}
limax_status limax_population_write_genomes(limax_population* population, int32_t first,
                                            int32_t count, const float* in) {
    return change(population, "population", [&] {
        require("in", in);
        population->it.write_genomes(first, count, in);
    });
}
limax_status limax_population_number(limax_population* population, int32_t before) {
    return change(population, "population", [&] { population->it.number(before); });
}
limax_status limax_population_text(const limax_population* population, int32_t first, int32_t count,
                                   const char* letters, char* out) {
    return change(population, "population", [&] {
        require("letters, out", letters, out);
        population->it.write_text(first, count, letters, out);
    });
}
limax_status limax_population_initialize(limax_population* population, uint32_t generation,
                                         limax_device* device, int32_t first, int32_t count) {
    return change(population, "population", [&] {
        require("device", device);
        settle(population->it, *device->it);
        population->it.initialize(generation, first, count, device->it->each());
    });
}
limax_status limax_population_express(limax_population* population,
                                      const limax_materials* materials, int32_t require_muscle,
                                      int32_t largest_part, limax_device* device, int32_t first,
                                      int32_t count) {
    return change(population, "population", [&] {
        const auto materials_use = reading(materials, "materials");
        require("device", device);
        settle(population->it, *device->it);
        population->it.express(materials->it, {require_muscle != 0, largest_part != 0},
                               device->it->express(), device->it->each(), first, count);
    });
}
limax_status limax_population_check(limax_population* population, const limax_materials* materials,
                                    int32_t require_muscle, int32_t largest_part, int32_t first,
                                    int32_t count) {
    return change(population, "population", [&] {
        const auto materials_use = reading(materials, "materials");
        population->it.check(materials->it, {require_muscle != 0, largest_part != 0}, first, count);
    });
}
limax_status limax_population_forget(limax_population* population, int32_t first, int32_t count) {
    return change(population, "population", [&] { population->it.forget(first, count); });
}
limax_status limax_population_breed(limax_population* children, const limax_population* parents,
                                    const int32_t* pairs, const limax_breeding* breeding,
                                    limax_device* device, int32_t first, int32_t count) {
    return change(children, "children", [&] {
        std::unique_lock<std::shared_mutex> parents_use;
        // a population that is both is held already, and refused below
        if (parents != children) parents_use = changing(parents, "parents");
        require("pairs, breeding, device", pairs, breeding, device);
        settle(children->it, *device->it);
        settle(parents->it, *device->it);
        children->it.breed(parents->it, pairs, *breeding, device->it->each(), first, count);
    });
}
limax_status limax_population_diversity(const limax_population* population, const int32_t* robots,
                                        int32_t count, limax_diversity* out) {
    return change(population, "population", [&] {
        require("robots, out", robots, out);
        *out = population->it.diversity(robots, count);
    });
}
limax_status limax_population_largest_gene(const limax_population* population,
                                           const int32_t* robots, int32_t count, float* out) {
    return change(population, "population", [&] {
        require("robots, out", robots, out);
        *out = population->it.largest_gene(robots, count);
    });
}
int64_t limax_population_sums_size(const limax_population* population) {
    return population->it.sums_size();
}
limax_status limax_population_sums(const limax_population* population, const int32_t* robots,
                                   int32_t count, float largest_gene, int64_t* sums) {
    return change(population, "population", [&] {
        require("robots, sums", robots, sums);
        population->it.sums(robots, count, largest_gene, sums);
    });
}
limax_status limax_population_diversity_of(const limax_population* population, const int64_t* sums,
                                           float largest_gene, int32_t distinct, int32_t count,
                                           limax_diversity* out) {
    return change(population, "population", [&] {
        require("sums, out", sums, out);
        *out = population->it.diversity_of(sums, largest_gene, distinct, count);
    });
}
limax_status limax_distinct(const uint64_t* hashes, int32_t count, int32_t* out) {
    return guard([&] {
        require("hashes, out", hashes, out);
        *out = limax::distinct(hashes, count);
    });
}

limax_status limax_pareto_rank(const double* values, int32_t count, int32_t objectives,
                               int32_t* rank, double* crowding) {
    return guard([&] {
        require("values, rank, crowding", values, rank, crowding);
        limax::pareto_rank(values, count, objectives, rank, crowding);
    });
}

}  // extern "C"
