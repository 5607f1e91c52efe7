// robots.cpp: from bodies to records and columns on a GPU. Its other parts make room for them there
// (robots_memory.inl), step them (robots_steps.inl) and bring back what was asked
// (robots_state.inl).
#include "backend/cuda/run/robots.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>

#include "backend/cuda/plan/kernel_sets.h"
#include "backend/cuda/run/population.h"
#include "physics/drive.h"

namespace limax::cuda {

namespace {

using clock = std::chrono::steady_clock;

constexpr int64_t never = INT64_MAX;
// Steps of the first launch, before the time of one is measured.
constexpr int64_t first_steps = 64;
// The longest launch: an interrupt waits no longer.
constexpr double most_seconds = 0.05;

// R is the type of state and forces.
template <class R>
class robots_on_gpu final : public gpu_robots {
public:
    robots_on_gpu(const simulation_setup& setup, std::vector<int32_t> robots,
                  std::shared_ptr<gpu_team> team, gpu_place& place, limax_outcome* outcomes)
        : setup_(setup),
          robots_(std::move(robots)),
          team_(std::move(team)),
          place_(place),
          gpu_(place.gpu),
          outcomes_(outcomes),
          stream_(gpu_),
          start_(gpu_),
          end_(gpu_),
          sites_(setup.grid.sites()),
          local_(std::size_t(setup.count), -1) {
        for (std::size_t i = 0; i < robots_.size(); ++i) local_[robots_[i]] = int32_t(i);
    }
    ~robots_on_gpu() override { wait(); }
    robots_on_gpu(const robots_on_gpu&) = delete;

    void wake() override;
    void sleep() override;
    void advance(double seconds, int64_t steps) override;
    void enqueue(double seconds) override;
    void collect() override;
    bool finished() const override { return prepared_ && running_.empty(); }
    int64_t samples(int32_t robot, int32_t kind) const override {
        return prepared_ ? taken(std::size_t(local_[robot]), kind) : 0;
    }
    const double* trace(int32_t robot, int32_t kind) override;
    const int32_t* sites(int32_t robot) override;
    void place(int32_t robot, const double* positions, const double* velocities) override;
    void state(int32_t robot, double* positions, double* velocities) override;
    void block(int32_t robot, int32_t which, double* out) override;
    std::string describe() override;

private:
    void allocate(std::size_t count);
    void release();
    void wait() noexcept;
    void fetch_samples(int32_t kind);
    pinned<prepared_robot> make_springs(std::size_t count);
    void plan_robots(const pinned<prepared_robot>& made);
    void plan_robot(std::size_t local, const prepared_robot& prepared);
    const std::vector<int32_t>& sites_of(std::size_t local);
    void lay_out_samples();
    void take_records();
    void end_robots(const std::vector<int32_t>& ended);
    int64_t steps_in(double seconds) const;
    void enqueue_slice(int64_t most);
    void collect_slice();
    void launch_steps(step_launch<R> launch, const measure_launch<R>& measure);
    void step_robots(const step_launch<R>& launch);
    int64_t most_steps_left() const;
    // Kinds of traces are those of limax_trace_kind: that of blocks is in their own records, and no
    // GPU has the ledger's.
    bool takes(int32_t kind) const {
        return kind < sample_kinds || (kind == LIMAX_TRACE_BLOCK && scene_.has_solid);
    }
    int64_t taken(std::size_t local, int32_t kind) const {
        if (!takes(kind)) return 0;
        return kind == LIMAX_TRACE_BLOCK ? first_solid(local)->taken : records_[local].taken[kind];
    }
    int64_t offset(std::size_t local, int32_t kind) const {
        return kind == LIMAX_TRACE_BLOCK ? first_solid(local)->offset
                                         : records_[local].offset[kind];
    }
    void set_offset(std::size_t local, int32_t kind, int64_t offset) {
        if (kind != LIMAX_TRACE_BLOCK) records_[local].offset[kind] = offset;
        for (int i = 0; kind == LIMAX_TRACE_BLOCK && i < solids(); ++i)
            first_solid(local)[i].offset = offset;
    }
    // Rigid blocks of a robot, and the record of its first.
    int solids() const { return setup_.scene.instances(effects::index_of<effects::block>); }
    solid_record* first_solid(std::size_t local) { return &solid_records_[local * solids()]; }
    const solid_record* first_solid(std::size_t local) const {
        return &solid_records_[local * solids()];
    }
    template <class Visit>
    void each_kind(const Visit& visit) const {
        for (int32_t kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
            if (takes(kind)) visit(kind);
    }
    void put_blocks(std::size_t local, const schedule& plan);
    // Whether a robot's velocities at t_n are half way between those before and after the kick: at
    // n = 0, and at every step of symplectic Euler, u is the velocity at t_n.
    bool between(const robot_record& record) const {
        return setup_.options.integrator == LIMAX_LEAPFROG && record.step > 0 && record.begun;
    }
    void write_block_outcome(std::size_t local, limax_outcome& outcome) const;
    R* column_of(std::vector<R>& state, int column) { return state.data() + column * sites_; }

    const simulation_setup& setup_;
    const std::vector<int32_t> robots_;
    const std::shared_ptr<gpu_team> team_;
    gpu_place& place_;
    const context& gpu_;
    limax_outcome* const outcomes_;
    stream stream_;
    event start_, end_;
    const int64_t sites_;
    std::vector<int32_t> local_;  // place in robots_ of each robot of the setup
    bool prepared_ = false;       // records and plans are made
    bool awake_ = false;          // everything is on the GPU

    scene_kernels scene_;
    device_memory<robot_record> device_records_;
    device_memory<int32_t> device_running_, device_ranks_;
    device_memory<cell_entry> device_cells_;
    device_memory<int32_t> table_;  // of tiles
    device_memory<float> mass_, springs_;
    device_memory<R> state_;
    std::vector<R> saved_state_;  // what state_ held before sleep()
    device_memory<R> exchange_;
    device_memory<unsigned long long> sums_;
    device_memory<unsigned> arrived_;
    device_memory<packet> masses_, forces_;  // that tiles exchange
    device_memory<float> faces_;  // these and the following only where the scene needs them
    device_memory<R> after_;
    device_memory<int32_t> surface_, partners_;
    device_memory<float> listed_at_;
    device_memory<unsigned long long> moved_;
    device_memory<float> heights_;  // of the terrain
    device_memory<R> control_;      // of a controller
    device_memory<float> genes_, muscles_;
    std::vector<R> saved_control_;  // what control_ held before sleep()
    device_memory<solid_record> solids_;
    device_memory<uint32_t> solid_marks_;
    device_memory<double> solid_touches_;  // as in solid_columns
    device_memory<solid::touch> solid_corners_;
    device_memory<solid::pair_touch> solid_pairs_;
    device_memory<R> solid_after_;
    device_memory<double> device_samples_[LIMAX_TRACE_KINDS];
    device_memory<trace_summary> device_summaries_;
    pinned<robot_record> records_;
    pinned<solid_record> solid_records_;  // empty in a scene without a block
    pinned<trace_summary> summaries_;
    std::vector<int32_t> running_;                  // places in robots_
    std::vector<std::vector<int32_t>> mass_sites_;  // [robot][mass], empty until it is asked for
    std::vector<schedule> plans_;                   // [robot]
    array<double> samples_[LIMAX_TRACE_KINDS];      // what device_samples_ held last
    bool fetched_[LIMAX_TRACE_KINDS] = {};
    int64_t slice_ = 0;            // steps that were sent to the GPU and not collected
    double seconds_per_step_ = 0;  // of all running robots
};

template <class R>
void robots_on_gpu<R>::wake() {
    if (awake_) return;
    const std::size_t count = robots_.size();
    if (!prepared_) scene_ = load_scene(setup_, count, team_->plans(), place_);
    try {
        allocate(count);
        const pinned<prepared_robot> made = make_springs(count);
        if (!prepared_) {
            plan_robots(made);
        } else {
            state_.upload(saved_state_.data(), saved_state_.size(), stream_);
            control_.upload(saved_control_.data(), saved_control_.size(), stream_);
        }
        lay_out_samples();
        device_records_.upload(records_.data(), count, stream_);
        if (scene_.has_solid) solids_.upload(solid_records_.data(), solid_records_.size(), stream_);
        stream_.synchronize("preparing robots");
    } catch (...) {
        wait();
        release();
        throw;
    }
    saved_state_ = {};
    saved_control_ = {};
    prepared_ = awake_ = true;
}

template <class R>
void robots_on_gpu<R>::sleep() {
    if (!awake_) return;
    each_kind([&](int32_t kind) { fetch_samples(kind); });
    saved_state_.resize(state_.size());
    state_.download(saved_state_.data(), saved_state_.size(), stream_);
    saved_control_.resize(control_.size());
    control_.download(saved_control_.data(), saved_control_.size(), stream_);
    stream_.synchronize("making room for other robots");
    release();
}

// Makes springs, masses and the first state on the GPU, from bodies that are stored there or
// uploaded.
template <class R>
pinned<prepared_robot> robots_on_gpu<R>::make_springs(std::size_t count) {
    prepare_launch<R> launch = scene_.template prepare_arguments<R>();
    device_memory<uint8_t> voxels;
    device_memory<float> weights;
    const auto* bodies = dynamic_cast<const gpu_bodies*>(setup_.bodies_on_device.get());
    if (bodies && &bodies->place().gpu == &gpu_) {
        launch.voxels = bodies->voxels();
        launch.weights = bodies->weights();
    } else {
        setup_.fetch_bodies();
        voxels = device_memory<uint8_t>(gpu_, setup_.voxels.size(), "the voxels of a population");
        weights = device_memory<float>(gpu_, setup_.weights.size(), "the weights of a population");
        voxels.upload(setup_.voxels.data(), setup_.voxels.size(), stream_);
        weights.upload(setup_.weights.data(), setup_.weights.size(), stream_);
        launch.voxels = voxels.data();
        launch.weights = weights.data();
    }
    device_running_.upload(robots_.data(), count, stream_);
    device_memory<prepared_robot> device_prepared(gpu_, count, "the masses of robots");
    pinned<prepared_robot> prepared(gpu_, count, "the masses of robots");
    launch.robots = device_running_.data();
    launch.prepared = device_prepared.data();
    launch.mass = mass_.data();
    launch.springs = springs_.data();
    launch.ranks = device_ranks_.data();
    launch.state = state_.data();
    launch.faces = faces_.data();
    launch.surface = surface_.data();
    launch.muscles = muscles_.data();
    scene_.launch_prepare(gpu_, stream_, launch, unsigned(count));
    device_prepared.download(prepared.data(), count, stream_);
    stream_.synchronize("preparing robots");
    return prepared;
}

template <class R>
void robots_on_gpu<R>::plan_robots(const pinned<prepared_robot>& made) {
    const std::size_t count = robots_.size();
    records_ = pinned<robot_record>(gpu_, count, format("the records of %zu robots", count));
    if (scene_.has_solid)
        solid_records_ =
            pinned<solid_record>(gpu_, count * solids(), format("the blocks of %zu robots", count));
    summaries_ = pinned<trace_summary>(gpu_, count, "the summaries of traces");
    mass_sites_.resize(count);
    plans_.resize(count);
    for (std::size_t i = 0; i < count; ++i) plan_robot(i, made[i]);
    // also where an attempt before found no room for all of it
    running_.resize(count);
    std::iota(running_.begin(), running_.end(), 0);
    // long runs first, so that the last ones to end are short
    std::stable_sort(running_.begin(), running_.end(),
                     [&](int32_t a, int32_t b) { return plans_[a].steps > plans_[b].steps; });
}

// Fills one robot's record and its outcome.
template <class R>
void robots_on_gpu<R>::plan_robot(std::size_t local, const prepared_robot& prepared) {
    const limax_simulation_options& options = setup_.options;
    const int32_t robot = robots_[local];
    limax_outcome& outcome = outcomes_[robot];
    outcome.time_step_bound = prepared.time_step_bound;
    const schedule plan = make_schedule(options, setup_.scene, setup_.grid, outcome.time_step_bound,
                                        setup_.amplitude());
    if (std::isinf(outcome.time_step_bound)) outcome.time_step_bound = NAN;
    plans_[local] = plan;

    robot_record& record = records_[local];
    record = {};
    record.time_step = plan.time_step;
    record.settle_steps = plan.settle_steps;
    record.steps = plan.steps;
    record.total_mass = prepared.total_mass;
    record.masses = prepared.masses;
    record.status = robot_running;
    if (setup_.scene.has(effects::index_of<effects::actuation>)) {
        const effects::actuation::clock muscles = effects::actuation::make_clock(
            setup_.scene.values(effects::index_of<effects::actuation>), plan.time_step);
        record.phase_per_step = muscles.per_step;
        record.ramp = muscles.ramp;
    }
    record.tick = plan.tick;
    record.next_tick = plan.settle_steps;
    if (plan.tick) {
        const double* values = setup_.scene.values(effects::index_of<effects::control>);
        record.noise_seed = setup_.noise_seed(robot);
        record.phase_per_step = sensors::clock_of(values).per_step;
    }
    for (int kind = 0; kind < sample_kinds; ++kind) {
        record.every[kind] = plan.every[kind];
        record.next_sample[kind] = plan.every[kind] ? plan.settle_steps : never;
    }
    for (int axis = 0; axis < 3; ++axis)
        record.origin[axis] = whole_origin_steps(options.position[axis]);
    if (scene_.has_solid) put_blocks(local, plan);

    outcome.status = LIMAX_ROBOT_RUNNING;
    outcome.steps = plan.steps;
    outcome.time_step = plan.time_step;
    outcome.time = -double(plan.settle_steps) * plan.time_step;
    outcome.masses = prepared.masses;
    outcome.springs = setup_.bodies[std::size_t(robot)].springs;
    outcome.mass = prepared.total_mass;
}

// Puts a robot's blocks where they start.
template <class R>
void robots_on_gpu<R>::put_blocks(std::size_t local, const schedule& plan) {
    const limax_simulation_options& options = setup_.options;
    double start[3];
    for (int axis = 0; axis < 3; ++axis)
        start[axis] = options.position[axis] - records_[local].origin[axis];
    for (int i = 0; i < solids(); ++i) {
        solid_record& solid = first_solid(local)[i];
        solid = {};
        solid.body =
            solid::placed(i, setup_.scene.values(effects::index_of<effects::block>, i), start);
        for (double(&center)[3] : solid.center) std::fill_n(center, 3, std::nan(""));
        solid.every = plan.every[LIMAX_TRACE_BLOCK];
    }
}

// Sites of a robot's masses, [mass].
template <class R>
const std::vector<int32_t>& robots_on_gpu<R>::sites_of(std::size_t local) {
    std::vector<int32_t>& at = mass_sites_[local];
    if (!at.empty()) return at;
    std::vector<int32_t> ranks(static_cast<std::size_t>(sites_));
    device_ranks_.download(ranks.data(), ranks.size(), stream_, local * ranks.size());
    stream_.synchronize("fetching a robot's sites");
    for (std::size_t site = 0; site < ranks.size(); ++site)
        if (ranks[site] >= 0) at.push_back(int32_t(site));
    return at;
}

#include "backend/cuda/run/robots_memory.inl"
#include "backend/cuda/run/robots_state.inl"
#include "backend/cuda/run/robots_steps.inl"

}  // namespace

std::unique_ptr<gpu_robots> make_robots(const simulation_setup& setup, std::vector<int32_t> robots,
                                        std::shared_ptr<gpu_team> team, gpu_place& place,
                                        limax_outcome* outcomes) {
    if (setup.options.precision == LIMAX_DOUBLE)
        return std::make_unique<robots_on_gpu<double>>(setup, std::move(robots), std::move(team),
                                                       place, outcomes);
    return std::make_unique<robots_on_gpu<float>>(setup, std::move(robots), std::move(team), place,
                                                  outcomes);
}

}  // namespace limax::cuda
