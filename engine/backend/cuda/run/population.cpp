// population.cpp: launches of the kernels between two simulations. Every function waits for its
// work, so populations need no order among themselves and a simulation may read bodies immediately.
#include "backend/cuda/run/population.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "backend/cuda/kernels/generation.h"
#include "body/grid.h"

namespace limax::cuda {

namespace {

static_assert(most_materials == LIMAX_MAX_MATERIALS);
static_assert(sizeof(body_record) == sizeof(limax_body));
static_assert(offsetof(body_record, counts) == offsetof(limax_body, counts));
static_assert(offsetof(body_record, masses) == offsetof(limax_body, masses));
static_assert(offsetof(body_record, size) == offsetof(limax_body, size));
static_assert(offsetof(body_record, hash) == offsetof(limax_body, hash));

// Shared memory of a block that every GPU has without asking, and what the describe kernel keeps
// there besides its links at most, bytes.
constexpr std::size_t block_memory = 48 * 1024, counts_of_describe = 1024;
// Global memory that blocks take instead where that is not enough, bytes: as many blocks at a time.
constexpr std::size_t scratch_memory = std::size_t(128) << 20;
constexpr int64_t most_blocks = 1 << 30;
constexpr int most_threads = 1024, warp = 32;

unsigned whole_warps(int64_t threads, int most) {
    return unsigned(std::min<int64_t>((threads + warp - 1) / warp * warp, most));
}
unsigned blocks_for(int64_t items) { return unsigned(std::min(items, most_blocks)); }
// Blocks that `scratch_memory` allows, each taking `bytes`; at least one.
unsigned blocks_with(int64_t items, std::size_t bytes) {
    return unsigned(std::min<int64_t>(items, std::max<std::size_t>(scratch_memory / bytes, 1)));
}

}  // namespace

// ---- bodies ----

gpu_bodies::gpu_bodies(std::shared_ptr<gpu_team> team, gpu_place& place, int64_t voxels,
                       int32_t count)
    : team_(std::move(team)),
      place_(place),
      voxels_(place.gpu, std::size_t(voxels) * std::size_t(count),
              format("the voxels of %d robots", count)),
      weights_(place.gpu, weight_kinds * std::size_t(voxels) * std::size_t(count),
               format("the weights of %d robots", count)) {}

void gpu_bodies::fetch(uint8_t* voxels, float* weights) const {
    const stream queue(place_.gpu);
    voxels_.download(voxels, voxels_.size(), queue);
    weights_.download(weights, weights_.size(), queue);
    queue.synchronize("fetching bodies");
}

// ---- populations ----

class gpu_population final : public device_population {
public:
    gpu_population(std::shared_ptr<gpu_team> team, const std::shared_ptr<const encoding>& code,
                   int32_t count)
        : team_(std::move(team)),
          place_(*team_->places().front()),
          code_(team_->encoding_on_gpu(code)),
          grid_(code->grid()),
          count_(count),
          genes_(code->genes()),
          stream_(place_.gpu, stream_work::brief),
          genomes_(place_.gpu, std::size_t(genes_) * std::size_t(count),
                   format("the genomes of %d robots", count)),
          described_(place_.gpu, std::size_t(count), format("the bodies of %d robots", count)),
          pairs_(place_.gpu, 2 * std::size_t(count), format("the parents of %d robots", count)),
          counts_(place_.gpu, std::size_t(grid_.voxels()) * most_materials,
                  "the diversity of bodies"),
          of_genes_(place_.gpu, kinds_of_gene_sums * std::size_t(genes_),
                    "the diversity of genomes"),
          bodies_(new_bodies()) {}

    const gpu_team& team() const { return *team_; }

    void clear_genomes() override;
    void clear_bodies() override;
    void send_bodies(const uint8_t* voxels, const float* weights) override;
    void send_genomes(const float* genomes, int32_t first, int32_t count) override;
    void fetch_genomes(float* genomes, int32_t first, int32_t count) const override;
    void initialize(uint32_t generation, int32_t before, int32_t first, int32_t count) override;
    void breed(const device_population& parents, const int32_t* pairs,
               const limax_breeding& breeding, int32_t before, int32_t first,
               int32_t count) override;
    void express(bool largest_part, int32_t first, int32_t count, limax_body* bodies) override;
    void count_materials(const int32_t* robots, int32_t count, int64_t* counts) const override;
    uint32_t largest_gene(const int32_t* robots, int32_t count) const override;
    void sum_genes(const int32_t* robots, int32_t count, double scale,
                   int64_t* sums) const override;
    std::shared_ptr<const device_bodies> bodies() const override { return bodies_; }

private:
    std::shared_ptr<gpu_bodies> new_bodies() const {
        return std::make_shared<gpu_bodies>(team_, place_, grid_.voxels(), count_);
    }
    gpu_bodies& bodies_to_write(bool all);
    device_memory<float> launch_express(int32_t first, int32_t count, gpu_bodies& bodies);
    device_memory<int32_t> launch_describe(bool largest_part, int32_t first, int32_t count,
                                           gpu_bodies& bodies);
    void compare(const char* function, const launch_shape& shape, const int32_t* robots,
                 int32_t count, double scale, device_memory<int64_t>& result, int64_t* out,
                 std::size_t size) const;
    template <class Launch>
    void run(const char* entry, const char* function, const launch_shape& shape,
             const std::string& doing, const Launch& arguments) const;

    const std::shared_ptr<gpu_team> team_;  // outlives everything below
    gpu_place& place_;
    const std::shared_ptr<const device_encoding> code_;
    const lattice grid_;
    const int32_t count_, genes_;
    const stream stream_;
    device_memory<float> genomes_;          // [robot][gene]
    device_memory<body_record> described_;  // [robot]
    mutable device_memory<int32_t> pairs_;  // [robot][2], or the robots of a set
    // Sums over the robots of a set. Freeing memory waits for all work of the GPU.
    mutable device_memory<int64_t> counts_;    // [voxel][material]
    mutable device_memory<int64_t> of_genes_;  // [kind][gene]
    std::shared_ptr<gpu_bodies> bodies_;
};

template <class Launch>
void gpu_population::run(const char* entry, const char* function, const launch_shape& shape,
                         const std::string& doing, const Launch& arguments) const {
    const auto module = place_.kernels.load({entry, {}});
    launch(place_.gpu, module->function(function), shape, stream_, doing, arguments);
}

// The bodies, after a copy if a simulation holds them too. With `all`, all of them are overwritten,
// so nothing is copied.
gpu_bodies& gpu_population::bodies_to_write(bool all) {
    if (bodies_.use_count() > 1) {
        auto fresh = new_bodies();
        if (!all) {
            fresh->voxels_.copy(bodies_->voxels_, bodies_->voxels_.size(), stream_);
            fresh->weights_.copy(bodies_->weights_, bodies_->weights_.size(), stream_);
            stream_.synchronize("copying bodies");
        }
        bodies_ = std::move(fresh);
    }
    return *bodies_;
}

void gpu_population::clear_genomes() {
    genomes_.clear(stream_);
    stream_.synchronize("clearing genomes");
}

void gpu_population::clear_bodies() {
    gpu_bodies& bodies = bodies_to_write(true);
    bodies.voxels_.clear(stream_);
    bodies.weights_.clear(stream_);
    stream_.synchronize("clearing bodies");
}

void gpu_population::send_genomes(const float* genomes, int32_t first, int32_t count) {
    genomes_.upload(genomes, std::size_t(genes_) * std::size_t(count), stream_,
                    std::size_t(genes_) * std::size_t(first));
    stream_.synchronize("sending genomes to the GPU");
}

void gpu_population::send_bodies(const uint8_t* voxels, const float* weights) {
    gpu_bodies& bodies = bodies_to_write(true);
    bodies.voxels_.upload(voxels, bodies.voxels_.size(), stream_);
    bodies.weights_.upload(weights, bodies.weights_.size(), stream_);
    stream_.synchronize("sending bodies to the GPU");
}

void gpu_population::fetch_genomes(float* genomes, int32_t first, int32_t count) const {
    genomes_.download(genomes, std::size_t(genes_) * std::size_t(count), stream_,
                      std::size_t(genes_) * std::size_t(first));
    stream_.synchronize("fetching genomes");
}

void gpu_population::initialize(uint32_t generation, int32_t before, int32_t first, int32_t count) {
    const limax_encoding_options& options = code_->code->options();
    initialize_launch arguments{};
    arguments.shape = code_->code->shape();
    initial_deviations(arguments.shape, options.initial_scale, options.control_spread,
                       arguments.deviation);
    arguments.key = {options.seed, options.repetition, LIMAX_STREAM_INITIAL, generation, 0};
    arguments.genomes = genomes_.data() + int64_t(first) * genes_;
    arguments.first = before + first;
    arguments.count = count;
    arguments.genes = genes_;
    run("breed", "limax_initialize",
        {blocks_for(int64_t(count) * ((genes_ - 1) / gene_threads + 1)), gene_threads},
        format("drawing the genomes of %d robots", count), arguments);
    stream_.synchronize("drawing genomes");
}

void gpu_population::breed(const device_population& parents, const int32_t* pairs,
                           const limax_breeding& breeding, int32_t before, int32_t first,
                           int32_t count) {
    pairs_.upload(pairs, 2 * std::size_t(count), stream_);
    breed_launch arguments{};
    arguments.rates = {breeding.mutation_rate, breeding.mutation_scale, breeding.crossover_rate};
    arguments.control_rates = {breeding.control_mutation_rate, breeding.control_mutation_scale,
                               breeding.crossover_rate};
    arguments.key = {breeding.seed, breeding.repetition, LIMAX_STREAM_BREEDING, breeding.generation,
                     0};
    arguments.parents = dynamic_cast<const gpu_population&>(parents).genomes_.data();
    arguments.pairs = pairs_.data();
    arguments.genomes = genomes_.data() + int64_t(first) * genes_;
    arguments.first = before + first;
    arguments.count = count;
    arguments.genes = genes_;
    arguments.control_genes = code_->code->control_genes();
    arguments.elites = before + breeding.elites;
    run("breed", "limax_breed",
        {blocks_for(int64_t(count) * ((genes_ - 1) / gene_threads + 1)), gene_threads},
        format("breeding %d robots", count), arguments);
    stream_.synchronize("breeding");
}

void gpu_population::express(bool largest_part, int32_t first, int32_t count, limax_body* bodies) {
    gpu_bodies& written = bodies_to_write(count == count_);
    const auto columns = launch_express(first, count, written);
    const auto numbers = launch_describe(largest_part, first, count, written);
    // both have the same layout, checked above
    described_.download(reinterpret_cast<body_record*>(bodies), std::size_t(count), stream_,
                        std::size_t(first));
    stream_.synchronize("expressing robots");
}

// Returns what the kernel needs until it has ended, as the next does.
device_memory<float> gpu_population::launch_express(int32_t first, int32_t count,
                                                    gpu_bodies& bodies) {
    const int64_t voxels = grid_.voxels();
    express_launch arguments{};
    arguments.shape = code_->code->shape();
    for (int32_t layer = 1; layer <= arguments.shape.layers; ++layer)
        arguments.units = std::max(arguments.units, arguments.shape.width[layer]);
    arguments.features = code_->features.data();
    arguments.genomes = genomes_.data() + int64_t(first) * genes_;
    arguments.genes = genes_;
    arguments.voxels = bodies.voxels_.data() + first * voxels;
    arguments.weights = bodies.weights_.data() + weight_kinds * first * voxels;
    arguments.voxel_count = int32_t(voxels);

    // as wide a tile as the columns of a block's threads leave
    const std::size_t thread_bytes = 2 * sizeof(float) * std::size_t(arguments.units);
    launch_shape shape{0, whole_warps(voxels, 4 * warp)};
    while (shape.threads > warp && shape.threads * thread_bytes > block_memory)
        shape.threads = whole_warps(shape.threads / 2, 4 * warp);
    const std::size_t bytes = shape.threads * thread_bytes;
    arguments.tiles_of_robot = int32_t((voxels - 1) / shape.threads + 1);
    arguments.tiles = int64_t(count) * arguments.tiles_of_robot;
    const bool wide = bytes > block_memory;
    device_memory<float> scratch;
    if (wide) {
        shape.blocks = blocks_with(arguments.tiles, bytes);
        scratch = device_memory<float>(place_.gpu, shape.blocks * bytes / sizeof(float),
                                       "the units of a wide network");
        arguments.scratch = scratch.data();
    } else {
        shape.blocks = blocks_for(arguments.tiles);
        shape.shared_bytes = bytes;
    }
    run("express", wide ? "limax_express_wide" : "limax_express", shape,
        format("expressing %d robots of %dx%dx%d voxels", count, grid_.nx, grid_.ny, grid_.nz),
        arguments);
    return scratch;
}

device_memory<int32_t> gpu_population::launch_describe(bool largest_part, int32_t first,
                                                       int32_t count, gpu_bodies& bodies) {
    const int64_t voxels = grid_.voxels();
    describe_launch arguments{};
    arguments.grid = grid_;
    arguments.voxels = bodies.voxels_.data() + first * voxels;
    arguments.bodies = described_.data() + first;
    arguments.count = count;
    arguments.largest_part = largest_part;
    const std::size_t bytes = 2 * sizeof(int32_t) * std::size_t(voxels);
    launch_shape shape{0, whole_warps(voxels, most_threads)};
    const bool large = bytes > block_memory - counts_of_describe;
    device_memory<int32_t> scratch;
    if (large) {
        shape.blocks = blocks_with(count, bytes);
        scratch = device_memory<int32_t>(place_.gpu, shape.blocks * bytes / sizeof(int32_t),
                                         "the components of large bodies");
        arguments.scratch = scratch.data();
    } else {
        shape.blocks = blocks_for(count);
        shape.shared_bytes = bytes;
    }
    run("describe", large ? "limax_describe_large" : "limax_describe", shape,
        format("describing %d robots of %dx%dx%d voxels", count, grid_.nx, grid_.ny, grid_.nz),
        arguments);
    return scratch;
}

void gpu_population::compare(const char* function, const launch_shape& shape, const int32_t* robots,
                             int32_t count, double scale, device_memory<int64_t>& result,
                             int64_t* out, std::size_t size) const {
    if (std::size_t(count) > pairs_.size())
        pairs_ = device_memory<int32_t>(place_.gpu, std::size_t(count), "the robots of a set");
    pairs_.upload(robots, std::size_t(count), stream_);
    diversity_launch arguments{pairs_.data(),
                               count,
                               genomes_.data(),
                               genes_,
                               scale,
                               of_genes_.data(),
                               bodies_->voxels_.data(),
                               counts_.data(),
                               int32_t(grid_.voxels())};
    run("diversity", function, shape, format("comparing %d robots", count), arguments);
    result.download(out, size, stream_);
    stream_.synchronize("comparing robots");
}

void gpu_population::count_materials(const int32_t* robots, int32_t count, int64_t* counts) const {
    const auto voxels = std::size_t(grid_.voxels());
    compare("limax_hamming", {unsigned((voxels - 1) / set_voxels + 1), set_voxels * set_warps},
            robots, count, 0.0, counts_, counts, counts_.size());
}

uint32_t gpu_population::largest_gene(const int32_t* robots, int32_t count) const {
    std::vector<int64_t> bits(static_cast<std::size_t>(genes_));
    compare("limax_genotype", {unsigned((genes_ - 1) / genotype_threads + 1), genotype_threads},
            robots, count, 0.0, of_genes_, bits.data(), bits.size());
    return uint32_t(*std::max_element(bits.begin(), bits.end()));
}

void gpu_population::sum_genes(const int32_t* robots, int32_t count, double scale,
                               int64_t* sums) const {
    compare("limax_genotype", {unsigned((genes_ - 1) / genotype_threads + 1), genotype_threads},
            robots, count, scale, of_genes_, sums, of_genes_.size());
}

std::shared_ptr<device_population> make_population(std::shared_ptr<gpu_team> team,
                                                   const std::shared_ptr<const encoding>& code,
                                                   int32_t count) {
    try {
        return std::make_shared<gpu_population>(std::move(team), code, count);
    } catch (const cuda_error& problem) {
        if (problem.result() != CUDA_ERROR_OUT_OF_MEMORY) throw;
        return nullptr;
    }
}

bool stored_on(const device_population& population, const gpu_team& team) {
    const auto* found = dynamic_cast<const gpu_population*>(&population);
    return found && &found->team() == &team;
}

}  // namespace limax::cuda
