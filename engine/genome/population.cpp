// population.cpp: the arrays on host and device, and loops over ranges of robots that apply the
// laws of breeding.h, the express pass and grid.h.
#include "genome/population.h"

#include <algorithm>
#include <limits>

#include "base/fields.h"
#include "genome/breeding.h"

namespace limax {

namespace {

static_assert(uint32_t(random_stream::encoding) == LIMAX_STREAM_ENCODING);
static_assert(uint32_t(random_stream::initial) == LIMAX_STREAM_INITIAL);
static_assert(uint32_t(random_stream::breeding) == LIMAX_STREAM_BREEDING);
static_assert(uint32_t(random_stream::selection) == LIMAX_STREAM_SELECTION);
static_assert(uint32_t(random_stream::supervision) == LIMAX_STREAM_SUPERVISION);
static_assert(uint32_t(random_stream::user) == LIMAX_STREAM_USER);
static_assert(uint32_t(random_stream::variation) == LIMAX_STREAM_VARIATION);

// Threads take robots in lots of about this many voxels, some 50 us of work: waking a thread for
// less costs more.
constexpr int64_t voxels_per_lot = 512;

// Memory that a simulated robot takes per site: 13 directions of 4 spring parameters in fp32, and
// 14 columns of state in double (19 in compensated fp32 are fewer bytes).
constexpr double simulation_bytes_per_site = 13 * 4 * sizeof(float) + 14 * sizeof(double);

// Memory of a population and of its simulation, which copies the bodies and takes by far the most.
// A population that would not fit is refused before the first robot is made.
double bytes_per_voxel(int32_t count, const encoding* code, const int32_t size[3]) {
    const double voxels = double(size[0]) * size[1] * size[2];
    const double sites = (size[0] + 1.0) * (size[1] + 1.0) * (size[2] + 1.0);
    const double genome = code ? double(code->genes()) * sizeof(float) : 0;
    const double body = 2 * voxels * (sizeof(uint8_t) + weight_kinds * sizeof(float));
    const double simulation = sites * simulation_bytes_per_site + sizeof(limax_outcome);
    return count * (genome + body + simulation + sizeof(limax_body)) / std::max(voxels, 1.0);
}

int32_t checked_count(int32_t count) {
    if (count < 1)
        fail(LIMAX_INVALID_ARGUMENT,
             format("a population of %d robots: it must have at least 1", count));
    return count;
}

}  // namespace

population::population(const int32_t size[3], int32_t count, std::shared_ptr<const encoding> code)
    : grid_(checked_lattice(size, format("a population of %d robots", checked_count(count)),
                            bytes_per_voxel(count, code.get(), size))),
      count_(count),
      code_(std::move(code)) {
    if (code_) {
        const lattice& coded = code_->grid();
        if (coded.nx != grid_.nx || coded.ny != grid_.ny || coded.nz != grid_.nz)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("the population's lattice is %dx%dx%d voxels, its encoding's %dx%dx%d",
                        grid_.nx, grid_.ny, grid_.nz, coded.nx, coded.ny, coded.nz));
    }
    bodies_ = array<limax_body>(std::size_t(count));
}

// ---- where the arrays are ----

void population::genomes_to_host() const {
    if (genomes_at_.host || !code_) return;
    if (genomes_.size() == 0)
        genomes_ = array<float>(std::size_t(count_) * std::size_t(code_->genes()));
    if (genomes_at_.device) on_device_->fetch_genomes(genomes_.data(), 0, count_);
    genomes_at_.host = true;
}

void population::bodies_to_host() const {
    if (bodies_at_.host) return;
    if (voxels_.size() == 0) {
        const std::size_t voxels = std::size_t(count_) * std::size_t(grid_.voxels());
        array<float> weights(weight_kinds * voxels);
        voxels_ = array<uint8_t>(voxels);
        weights_ = std::move(weights);
    }
    if (bodies_at_.device) on_device_->bodies()->fetch(voxels_.data(), weights_.data());
    bodies_at_.host = true;
}

void population::genomes_to_device() const {
    if (genomes_at_.device && !genomes_at_.lent) return;
    if (genomes_at_.host)
        on_device_->send_genomes(genomes_.data(), 0, count_);
    else
        on_device_->clear_genomes();
    genomes_at_.device = true;
}

void population::bodies_to_device() const {
    if (bodies_at_.device && !bodies_at_.lent) return;
    if (bodies_at_.host)
        on_device_->send_bodies(voxels_.data(), weights_.data());
    else
        on_device_->clear_bodies();
    bodies_at_.device = true;
}

const float* population::genomes() const {
    genomes_to_host();
    return code_ ? genomes_.data() : nullptr;
}
const uint8_t* population::voxels() const {
    bodies_to_host();
    return voxels_.data();
}
const float* population::weights() const {
    bodies_to_host();
    return weights_.data();
}

float* population::genomes() {
    genomes_to_host();
    genomes_at_.lent = true;
    return code_ ? genomes_.data() : nullptr;
}
uint8_t* population::voxels() {
    bodies_to_host();
    bodies_at_.lent = true;
    return voxels_.data();
}
float* population::weights() {
    bodies_to_host();
    bodies_at_.lent = true;
    return weights_.data();
}

void population::read_genomes(int32_t first, int32_t count, float* out) const {
    require_genomes();
    require_robots(first, count);
    if (genomes_at_.device && !genomes_at_.host)
        on_device_->fetch_genomes(out, first, count);
    else
        std::copy_n(genomes() + int64_t(first) * genes(), int64_t(count) * genes(), out);
}

void population::write_genomes(int32_t first, int32_t count, const float* in) {
    require_genomes();
    require_robots(first, count);
    if (on_device_) {
        if (!whole(first, count)) genomes_to_device();
        on_device_->send_genomes(in, first, count);
        genomes_at_ = {.device = true};
    } else {
        genomes_to_host();
        std::copy_n(in, int64_t(count) * genes(), genomes_.data() + int64_t(first) * genes());
    }
    forget(first, count);
}

void population::move_to(std::shared_ptr<device_population> stored) const {
    if (stored == on_device_) return;
    if (genomes_at_.device) genomes_to_host();
    if (bodies_at_.device) bodies_to_host();
    genomes_at_.device = bodies_at_.device = false;
    on_device_ = std::move(stored);
}

std::shared_ptr<const device_bodies> population::bodies_on_device() const {
    return bodies_at_.device && !bodies_at_.lent ? on_device_->bodies() : nullptr;
}

// ---- operations on robots ----

void population::require_robots(int32_t first, int32_t count) const {
    if (first >= 0 && count >= 0 && first <= count_ - count) return;
    fail(LIMAX_INVALID_ARGUMENT,
         format("robots %lld to %lld do not all exist; there are %d", from_one(first),
                static_cast<long long>(first) + count, count_));
}

void population::require_genomes() const {
    if (!code_)
        fail(LIMAX_INVALID_ARGUMENT,
             "this population was made without an encoding: it has no genomes");
}

void population::number(int32_t before) {
    require_range("before", before, 0, std::numeric_limits<int32_t>::max() - count_, "");
    before_ = before;
}

void population::forget(int32_t first, int32_t count) {
    require_robots(first, count);
    for (int32_t robot = first; robot < first + count; ++robot)
        bodies_[std::size_t(robot)] = limax_body{};
}

void population::write_text(int32_t first, int32_t count, const char* letters, char* out) const {
    require_robots(first, count);
    const uint8_t* voxel = voxels() + std::size_t(first) * std::size_t(grid_.voxels());
    for (int32_t robot = 0; robot < count; ++robot) {
        for (int z = 0; z < grid_.nz; ++z) {
            for (int y = 0; y < grid_.ny; ++y) {
                for (int x = 0; x < grid_.nx; ++x)
                    *out++ = letters[*voxel++ & (LIMAX_MAX_MATERIALS - 1)];
                *out++ = '\n';
            }
            *out++ = '\n';
        }
        // no line ends after the last layer
        out[-2] = 0;
    }
}

void population::initialize(uint32_t generation, int32_t first, int32_t count,
                            const parallel_for& each) {
    require_genomes();
    require_robots(first, count);
    const network_shape& shape = code_->shape();
    const limax_encoding_options& options = code_->options();
    const int32_t genome_size = genes();
    if (on_device_) {
        if (!whole(first, count)) genomes_to_device();
        on_device_->initialize(generation, before_, first, count);
        genomes_at_ = {.device = true};
        forget(first, count);
        return;
    }
    genomes_to_host();
    double deviation[most_hidden_layers + 3];
    initial_deviations(shape, options.initial_scale, options.control_spread, deviation);
    each(count, [&](int index) {
        const int32_t robot = first + index;
        const random_key key{options.seed, options.repetition, LIMAX_STREAM_INITIAL, generation,
                             static_cast<uint32_t>(before_ + robot)};
        float* genome = genomes_.data() + int64_t(robot) * genome_size;
        for (int32_t gene = 0; gene < genome_size; ++gene)
            genome[gene] = initial_gene(shape, deviation, key, gene);
    });
    forget(first, count);
}

void population::describe(const material_table& materials, bool require_muscle, int32_t robot) {
    describe_body(grid_, voxels_.data() + robot * grid_.voxels(), bodies_[std::size_t(robot)]);
    judge(materials, require_muscle, robot);
}

void population::judge(const material_table& materials, bool require_muscle, int32_t robot) {
    limax_body& body = bodies_[std::size_t(robot)];
    int32_t muscles = 0;
    for (int32_t material = 1; material < materials.count(); ++material)
        if (is_muscle(materials.at(material))) muscles += body.counts[material];
    body.status = body.voxels == 0                 ? LIMAX_BODY_NO_VOXEL
                  : require_muscle && muscles == 0 ? LIMAX_BODY_NO_MUSCLE
                                                   : LIMAX_BODY_VALID;
}

void population::express(const material_table& materials, body_rules rules, express_pass pass,
                         const parallel_for& each, int32_t first, int32_t count) {
    require_genomes();
    require_robots(first, count);
    const network_shape& shape = code_->shape();
    if (shape.law == network_law::none)
        fail(
            LIMAX_INVALID_ARGUMENT,
            "genomes of network \"none\" are expressed by the script: write the bodies, then check "
            "them");
    if (materials.count() != shape.materials)
        fail(LIMAX_INVALID_ARGUMENT,
             format("the encoding chooses among %d materials, but the table \"%s\" has %d",
                    shape.materials, materials.name().c_str(), materials.count()));
    if (on_device_) {
        genomes_to_device();
        if (!whole(first, count)) bodies_to_device();
        on_device_->express(rules.largest_part, first, count, bodies_.data() + first);
        bodies_at_ = {.device = true};
        for (int32_t robot = first; robot < first + count; ++robot)
            judge(materials, rules.require_muscle, robot);
        return;
    }
    genomes_to_host();
    bodies_to_host();
    const int64_t voxels = grid_.voxels();
    const auto lot = static_cast<int32_t>(std::max<int64_t>(1, voxels_per_lot / voxels));
    const int64_t genome_size = genes();
    each(count / lot + (count % lot != 0), [&](int index) {
        array<float> scratch(std::size_t(express_scratch(shape)));
        component_search search;
        const int32_t begin = first + index * lot, end = std::min(begin + lot, first + count);
        for (int32_t robot = begin; robot < end; ++robot) {
            uint8_t* body = voxels_.data() + robot * voxels;
            pass(shape, code_->features(), genomes_.data() + robot * genome_size, scratch.data(),
                 body, weights_.data() + robot * (weight_kinds * voxels),
                 static_cast<int32_t>(voxels));
            if (rules.largest_part) keep_largest_component(grid_, body, search);
            describe(materials, rules.require_muscle, robot);
        }
    });
}

void population::check(const material_table& materials, body_rules rules, int32_t first,
                       int32_t count) {
    require_robots(first, count);
    bodies_to_host();
    const int64_t voxels = grid_.voxels();
    const auto refuse = [&](int32_t robot, int64_t voxel, const std::string& text) {
        const auto x = int(voxel % grid_.nx), y = int(voxel / grid_.nx % grid_.ny);
        const auto z = int(voxel / grid_.nx / grid_.ny);
        fail(LIMAX_INVALID_ARGUMENT,
             format("robot %d, voxel (%d, %d, %d): ", robot + 1, x + 1, y + 1, z + 1) + text);
    };
    static const char* const kinds[weight_kinds] = {"stiffness", "amplitude", "phase"};
    for (int32_t robot = first; robot < first + count; ++robot) {
        const uint8_t* material = voxels_.data() + robot * voxels;
        const float* weight = weights_.data() + robot * (weight_kinds * voxels);
        for (int64_t voxel = 0; voxel < voxels; ++voxel)
            if (material[voxel] >= materials.count())
                refuse(robot, voxel,
                       format("material %d; the table \"%s\" has 0 to %d", material[voxel],
                              materials.name().c_str(), materials.count() - 1));
        for (int64_t k = 0; k < weight_kinds * voxels; ++k)
            if (!(weight[k] >= 0.0f && weight[k] <= 1.0f))
                refuse(robot, k % voxels,
                       format("%s weight %.9g; it must be 0 to 1", kinds[k / voxels],
                              double(weight[k])));
    }
    component_search search;
    if (rules.largest_part) bodies_at_.device = false;
    for (int32_t robot = first; robot < first + count; ++robot) {
        if (rules.largest_part)
            keep_largest_component(grid_, voxels_.data() + robot * voxels, search);
        describe(materials, rules.require_muscle, robot);
    }
}

void population::breed(const population& parents, const int32_t* pairs,
                       const limax_breeding& breeding, const parallel_for& each, int32_t first,
                       int32_t count) {
    require_genomes();
    require_robots(first, count);
    if (&parents == this)
        fail(LIMAX_INVALID_ARGUMENT,
             "children and parents are the same population; breeding needs two");
    if (parents.genes() != genes())
        fail(LIMAX_INVALID_ARGUMENT,
             format("the parents have %d genes, the children %d", parents.genes(), genes()));
    if (parents.control_genes() != control_genes())
        fail(LIMAX_INVALID_ARGUMENT, format("the parents have %d genes of control, the children %d",
                                            parents.control_genes(), control_genes()));
    require_field(breeding_fields, "mutation_rate", breeding.mutation_rate);
    require_field(breeding_fields, "mutation_scale", breeding.mutation_scale);
    require_field(breeding_fields, "crossover_rate", breeding.crossover_rate);
    require_field(breeding_fields, "control_mutation_rate", breeding.control_mutation_rate);
    require_field(breeding_fields, "control_mutation_scale", breeding.control_mutation_scale);
    require_range("repetition", breeding.repetition, 1, most_repetitions, "");
    require_range("elites", breeding.elites, 0, count_, "");
    for (int32_t child = first; child < first + count; ++child)
        for (const int32_t parent : {pairs[2 * int64_t(child)], pairs[2 * int64_t(child) + 1]})
            if (parent < 0 || parent >= parents.count())
                fail(LIMAX_INVALID_ARGUMENT,
                     format("child %d: parent %lld does not exist; there are %d", child + 1,
                            from_one(parent), parents.count()));

    if (on_device_ && parents.on_device_) {
        parents.genomes_to_device();
        if (!whole(first, count)) genomes_to_device();
        on_device_->breed(*parents.on_device_, pairs + 2 * int64_t(first), breeding, before_, first,
                          count);
        genomes_at_ = {.device = true};
        forget(first, count);
        return;
    }
    genomes_to_host();
    genomes_at_.device = false;
    const float* const of_parents = parents.genomes();
    const breeding_rates rates{breeding.mutation_rate, breeding.mutation_scale,
                               breeding.crossover_rate};
    const breeding_rates control_rates{breeding.control_mutation_rate,
                                       breeding.control_mutation_scale, breeding.crossover_rate};
    const int32_t genome_size = genes(), of_network = genome_size - control_genes();
    each(count, [&](int index) {
        const int32_t child = first + index;
        const random_key key{breeding.seed, breeding.repetition, LIMAX_STREAM_BREEDING,
                             breeding.generation, static_cast<uint32_t>(before_ + child)};
        const int64_t one = pairs[2 * int64_t(child)], other = pairs[2 * int64_t(child) + 1];
        const float* of_first = of_parents + one * genome_size;
        const float* of_second = of_parents + other * genome_size;
        float* genome = genomes_.data() + int64_t(child) * genome_size;
        if (child < breeding.elites) {
            std::copy_n(of_first, genome_size, genome);
            return;
        }
        for (int32_t gene = 0; gene < genome_size; ++gene)
            genome[gene] = child_gene(gene < of_network ? rates : control_rates, key,
                                      uint32_t(gene), of_first[gene], of_second[gene]);
    });
    forget(first, count);
}

}  // namespace limax
