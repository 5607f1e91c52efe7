// robots.cpp: from bodies to records and columns on a GPU, slices of steps, and back.
#include "backend/cuda/robots.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "backend/cuda/kernel_sets.h"
#include "backend/cuda/residence.h"
#include "backend/summary.h"

namespace limax::cuda {

namespace {

using clock = std::chrono::steady_clock;

constexpr int64_t never = INT64_MAX;
// Steps of the first launch, before it is known how long one takes.
constexpr int64_t first_steps = 64;
// Of one launch, so that an interrupt does not wait longer.
constexpr double most_seconds = 0.05;

// R: the real of the masses.
template <class R>
class robots_on_gpu final : public gpu_robots {
public:
    robots_on_gpu(const simulation_setup& setup, std::vector<int32_t> robots,
                  std::shared_ptr<gpu_team> team, gpu_place& place, limax_outcome* outcomes)
        : setup_(setup),
          robots_(std::move(robots)),
          team_(std::move(team)),
          gpu_(place.gpu),
          kernels_(place.kernels),
          outcomes_(outcomes),
          stream_(gpu_),
          start_(gpu_),
          end_(gpu_),
          sites_(setup.grid.sites()),
          local_(std::size_t(setup.count), -1) {
        for (std::size_t i = 0; i < robots_.size(); ++i) local_[robots_[i]] = int32_t(i);
    }

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
    void block(int32_t robot, double* out) override;
    std::string describe() override;

private:
    void allocate(std::size_t count);
    void release();
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
    void step_robots(const step_launch<R>& launch);
    int64_t most_steps_left() const;
    // Kinds of traces are those of limax_trace_kind: the block's stands in its own record, and no
    // GPU has the ledger's.
    bool takes(int32_t kind) const {
        return kind < sample_kinds || (kind == LIMAX_TRACE_BLOCK && scene_.has_solid);
    }
    int64_t taken(std::size_t local, int32_t kind) const {
        if (!takes(kind)) return 0;
        return kind == LIMAX_TRACE_BLOCK ? solid_records_[local].taken
                                         : records_[local].taken[kind];
    }
    int64_t& offset(std::size_t local, int32_t kind) {
        return kind == LIMAX_TRACE_BLOCK ? solid_records_[local].offset
                                         : records_[local].offset[kind];
    }
    template <class Visit>
    void each_kind(const Visit& visit) const {
        for (int32_t kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
            if (takes(kind)) visit(kind);
    }
    void put_block(std::size_t local, const schedule& plan);
    // Whether a robot's velocities at t_n are half way between those before and after the kick: at
    // n = 0, and at every step of symplectic Euler, u is the velocity at t_n.
    bool between(const robot_record& record) const {
        return setup_.options.integrator == LIMAX_LEAPFROG && record.step > 0 && record.begun;
    }
    void tell_block(std::size_t local, limax_outcome& outcome) const;
    R* column_of(std::vector<R>& state, int column) { return state.data() + column * sites_; }

    const simulation_setup& setup_;
    const std::vector<int32_t> robots_;
    const std::shared_ptr<gpu_team> team_;
    const context& gpu_;
    kernel_library& kernels_;
    limax_outcome* const outcomes_;
    stream stream_;
    event start_, end_;
    const int64_t sites_;
    std::vector<int32_t> local_;  // place in robots_ of each robot of the setup
    bool prepared_ = false;       // what follows from the bodies is known
    bool awake_ = false;          // everything is on the GPU

    scene_kernels scene_;
    device_memory<robot_record> device_records_;
    device_memory<int32_t> device_running_, device_ranks_, device_masses_;
    device_memory<cell_entry> device_cells_;
    device_memory<float> mass_, springs_;
    device_memory<R> state_;
    std::vector<R> saved_state_;    // what state_ held before sleep()
    device_memory<char> exchange_;  // of spring_real
    device_memory<unsigned long long> sums_;
    device_memory<unsigned> arrived_;
    device_memory<float> faces_;  // what follows is there where the scene needs it alone
    device_memory<R> after_;
    device_memory<int32_t> surface_, partners_;
    device_memory<float> listed_at_;
    device_memory<unsigned long long> moved_;
    device_memory<float> heights_;  // of the terrain
    device_memory<solid_record> solids_;
    device_memory<uint32_t> solid_marks_;
    device_memory<solid_touch<R>> solid_touches_;
    device_memory<solid::touch> solid_corners_;
    device_memory<R> solid_after_;
    device_memory<double> device_samples_[LIMAX_TRACE_KINDS];
    pinned<robot_record> records_;
    pinned<solid_record> solid_records_;            // empty in a scene without a block
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
    if (!prepared_) scene_ = load_scene(setup_, count, *team_, gpu_, kernels_);
    try {
        allocate(count);
        const pinned<prepared_robot> made = make_springs(count);
        if (!prepared_) {
            plan_robots(made);
        } else {
            state_.upload(saved_state_.data(), saved_state_.size(), stream_);
        }
        lay_out_samples();
        device_records_.upload(records_.data(), count, stream_);
        if (scene_.has_solid) solids_.upload(solid_records_.data(), count, stream_);
        stream_.synchronize("preparing robots");
    } catch (...) {
        release();
        throw;
    }
    saved_state_ = {};
    prepared_ = awake_ = true;
}

template <class R>
void robots_on_gpu<R>::sleep() {
    if (!awake_) return;
    each_kind([&](int32_t kind) { fetch_samples(kind); });
    saved_state_.resize(state_.size());
    state_.download(saved_state_.data(), saved_state_.size(), stream_);
    stream_.synchronize("making room for other robots");
    release();
}

// Gives back what lies on the GPU.
template <class R>
void robots_on_gpu<R>::release() {
    awake_ = false;
    device_records_ = {};
    device_running_ = {};
    device_ranks_ = {};
    device_masses_ = {};
    device_cells_ = {};
    mass_ = {};
    springs_ = {};
    state_ = {};
    exchange_ = {};
    sums_ = {};
    arrived_ = {};
    faces_ = {};
    after_ = {};
    surface_ = {};
    partners_ = {};
    listed_at_ = {};
    moved_ = {};
    solids_ = {};
    solid_marks_ = {};
    solid_touches_ = {};
    solid_corners_ = {};
    solid_after_ = {};
    heights_ = {};
    for (device_memory<double>& samples : device_samples_) samples = {};
}

template <class R>
void robots_on_gpu<R>::allocate(std::size_t count) {
    const std::string of_robots = format(" of %zu robots", count);
    const std::size_t sites = std::size_t(sites_);
    const std::size_t spring_size = std::size_t(scene_.spring_columns) * direction_count * sites;
    device_records_ = device_memory<robot_record>(gpu_, count, "the records" + of_robots);
    device_running_ = device_memory<int32_t>(gpu_, count, "the list" + of_robots);
    device_ranks_ = device_memory<int32_t>(gpu_, count * sites, "the sites" + of_robots);
    if (setup_.scene.has(effects::index_of<effects::terrain>)) {
        const effects::height_table table = setup_.scene.heights();
        heights_ = device_memory<float>(gpu_, std::size_t(table.nx) * std::size_t(table.ny),
                                        "the terrain");
        heights_.upload(table.heights, heights_.size(), stream_);
    }
    mass_ = device_memory<float>(gpu_, count * sites, "the masses" + of_robots);
    // on the grid path a cell on the high side of the lattice reads a little beyond the last column
    const std::size_t beyond =
        scene_.on_grid() ? std::size_t(setup_.grid.step(direction{1, 1, 1})) : 0;
    springs_ = device_memory<float>(gpu_, count * spring_size + beyond, "the springs" + of_robots);
    state_ = device_memory<R>(gpu_, count * std::size_t(scene_.state_columns) * sites,
                              "the state" + of_robots);
    const auto memory = scene_.memory_of_robot();
    faces_ = device_memory<float>(gpu_, count * memory.faces, "the faces" + of_robots);
    surface_ = device_memory<int32_t>(gpu_, count * memory.surface, "the surfaces" + of_robots);
    partners_ = device_memory<int32_t>(gpu_, count * memory.partners, "the meetings" + of_robots);
    listed_at_ = device_memory<float>(gpu_, count * memory.listed_at, "the meetings" + of_robots);
    moved_ =
        device_memory<unsigned long long>(gpu_, count * memory.moved, "the meetings" + of_robots);
    moved_.clear(stream_);
    const std::string of_blocks = format("the blocks of %zu robots", count);
    solids_ = device_memory<solid_record>(gpu_, count * memory.solids, of_blocks);
    solid_marks_ = device_memory<uint32_t>(gpu_, count * memory.solid_marks, of_blocks);
    solid_marks_.clear(stream_);
    solid_touches_ = device_memory<solid_touch<R>>(gpu_, count * memory.solid_touches, of_blocks);
    solid_corners_ = device_memory<solid::touch>(gpu_, count * memory.solid_corners, of_blocks);
    solid_after_ = device_memory<R>(gpu_, count * memory.solid_after, of_blocks);
    if (scene_.on_grid()) {
        const std::size_t real = scene_.double_springs() ? sizeof(double) : sizeof(float);
        exchange_ =
            device_memory<char>(gpu_, count * memory.exchange * real, "the exchange" + of_robots);
        sums_ =
            device_memory<unsigned long long>(gpu_, count * memory.sums, "the sums" + of_robots);
        arrived_ =
            device_memory<unsigned>(gpu_, count * memory.arrived, "the barriers" + of_robots);
        after_ = device_memory<R>(gpu_, count * memory.after, "the impulses" + of_robots);
        springs_.clear(stream_);
    } else {
        const block_plan& plan = *scene_.plan;
        device_cells_ = device_memory<cell_entry>(gpu_, plan.cells.size(), "the plan");
        device_masses_ = device_memory<int32_t>(gpu_, plan.masses.size(), "the plan");
        device_cells_.upload(plan.cells.data(), plan.cells.size(), stream_);
        device_masses_.upload(plan.masses.data(), plan.masses.size(), stream_);
    }
}

// Makes springs, masses and the first state on the GPU, from bodies that live there or are sent.
template <class R>
pinned<prepared_robot> robots_on_gpu<R>::make_springs(std::size_t count) {
    prepare_launch<R> launch = scene_.template prepare_arguments<R>();
    device_memory<uint8_t> voxels;
    device_memory<float> weights;
    const auto* bodies = dynamic_cast<const gpu_bodies*>(setup_.resident.get());
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
    device_memory<prepared_robot> device_prepared(gpu_, count, "what is known of robots");
    pinned<prepared_robot> prepared(gpu_, count, "what is known of robots");
    launch.robots = device_running_.data();
    launch.prepared = device_prepared.data();
    launch.mass = mass_.data();
    launch.springs = springs_.data();
    launch.ranks = device_ranks_.data();
    launch.state = state_.data();
    launch.faces = faces_.data();
    launch.surface = surface_.data();
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
            pinned<solid_record>(gpu_, count, format("the blocks of %zu robots", count));
    mass_sites_.resize(count);
    plans_.resize(count);
    for (std::size_t i = 0; i < count; ++i) plan_robot(i, made[i]);
    for (std::size_t i = 0; i < count; ++i) running_.push_back(int32_t(i));
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
    const schedule plan = make_schedule(options, setup_.scene, outcome.time_step_bound);
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
    for (int kind = 0; kind < sample_kinds; ++kind) {
        record.every[kind] = plan.every[kind];
        record.next_sample[kind] = plan.every[kind] ? plan.settle_steps : never;
    }
    for (int axis = 0; axis < 3; ++axis)
        record.origin[axis] = whole_origin_steps(options.position[axis]);
    if (scene_.has_solid) put_block(local, plan);

    outcome.status = LIMAX_ROBOT_RUNNING;
    outcome.steps = plan.steps;
    outcome.time_step = plan.time_step;
    outcome.time = -double(plan.settle_steps) * plan.time_step;
    outcome.masses = prepared.masses;
    outcome.springs = setup_.bodies[std::size_t(robot)].springs;
    outcome.mass = prepared.total_mass;
}

// Puts a robot's block where it starts.
template <class R>
void robots_on_gpu<R>::put_block(std::size_t local, const schedule& plan) {
    const limax_simulation_options& options = setup_.options;
    const double* values = setup_.scene.values(effects::index_of<effects::block>);
    double start[3];
    for (int axis = 0; axis < 3; ++axis)
        start[axis] = options.position[axis] - records_[local].origin[axis];
    const auto law = effects::block::make<double>(values, start);
    solid_record& solid = solid_records_[local];
    solid = {};
    solid.block = solid::placed(law, inertia_of_box(law.half, law.mass), values, start);
    for (double(&center)[3] : solid.center) std::fill_n(center, 3, std::nan(""));
    solid.every = plan.every[LIMAX_TRACE_BLOCK];
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

template <class R>
void robots_on_gpu<R>::lay_out_samples() {
    each_kind([&](int32_t kind) {
        int64_t size = 0;
        for (std::size_t i = 0; i < robots_.size(); ++i) {
            offset(i, kind) = size;
            size += plans_[i].samples[kind] * trace_width(kind, records_[i].masses);
        }
        if (size == 0) return;
        device_samples_[kind] = device_memory<double>(
            gpu_, size, format("record: the traces of %zu robots", robots_.size()));
        if (prepared_) device_samples_[kind].upload(samples_[kind].data(), size, stream_);
    });
}

template <class R>
int64_t robots_on_gpu<R>::most_steps_left() const {
    int64_t most = 0;
    for (const int32_t i : running_) most = std::max(most, records_[i].steps - records_[i].step);
    return most;
}

// Steps that take about `seconds`, as far as is known.
template <class R>
int64_t robots_on_gpu<R>::steps_in(double seconds) const {
    if (!(seconds_per_step_ > 0)) return first_steps;
    return std::clamp<int64_t>(int64_t(seconds / seconds_per_step_), 1, most_steps_left() + 1);
}

template <class R>
void robots_on_gpu<R>::enqueue(double seconds) {
    wake();
    if (running_.empty() || interrupted()) return;
    enqueue_slice(steps_in(seconds));
}

template <class R>
void robots_on_gpu<R>::collect() {
    if (slice_ > 0) collect_slice();
}

template <class R>
void robots_on_gpu<R>::advance(double seconds, int64_t steps) {
    wake();
    const clock::time_point begin = clock::now();
    const auto left = [&] {
        return seconds - std::chrono::duration<double>(clock::now() - begin).count();
    };
    int64_t done = 0;
    while (!running_.empty() && !interrupted()) {
        // in launches that end often enough for an interrupt
        int64_t now = steps_in(most_seconds);
        if (steps > 0) {
            now = std::min(now, steps - done);
            if (now == 0) return;
        } else {
            const double remaining = left();
            // a rest that is too short for a step is not worth a launch
            if (remaining <= 0 || (done > 0 && remaining < seconds_per_step_)) return;
            now = std::min(now, steps_in(remaining));
        }
        enqueue_slice(now);
        collect_slice();
        done += now;
    }
}

// Steps all running robots: in one launch, or, where several blocks share a robot and have to wait
// for each other, in as many as fit the GPU one after the other.
template <class R>
void robots_on_gpu<R>::step_robots(const step_launch<R>& launch) {
    const auto robots = unsigned(running_.size());
    if (!scene_.on_grid()) {
        scene_.launch_step(gpu_, stream_, launch, robots);
        return;
    }
    arrived_.clear(stream_);
    sums_.clear(stream_);
    const auto on_grid = [&](auto* exchange) {
        for (unsigned first = 0; first < robots; first += scene_.most_robots()) {
            grid_launch<R, std::remove_pointer_t<decltype(exchange)>> arguments{
                launch, after_.data(), exchange, sums_.data(), arrived_.data(), setup_.grid, 0};
            arguments.step.running += first;
            scene_.launch_grid(gpu_, stream_, arguments,
                               std::min(robots - first, scene_.most_robots()));
        }
    };
    if (scene_.double_springs())
        on_grid(reinterpret_cast<double*>(exchange_.data()));
    else
        on_grid(reinterpret_cast<float*>(exchange_.data()));
}

template <class R>
void robots_on_gpu<R>::enqueue_slice(int64_t most) {
    slice_ = most;
    device_running_.upload(running_.data(), running_.size(), stream_);
    step_launch<R> launch = scene_.template step_arguments<R>();
    launch.records = device_records_.data();
    launch.running = device_running_.data();
    launch.cells = device_cells_.data();
    launch.masses = device_masses_.data();
    launch.mass = mass_.data();
    launch.springs = springs_.data();
    launch.state = state_.data();
    launch.faces = faces_.data();
    launch.meetings = {surface_.data(), partners_.data(), listed_at_.data(), moved_.data()};
    launch.solids = {solids_.data(),        solid_marks_.data(),
                     solid_touches_.data(), solid_corners_.data(),
                     solid_after_.data(),   device_samples_[LIMAX_TRACE_BLOCK].data()};
    launch.most = most;
    measure_launch<R> measure = scene_.template measure_arguments<R>();
    measure.records = launch.records;
    measure.running = launch.running;
    measure.ranks = device_ranks_.data();
    measure.mass = launch.mass;
    measure.springs = launch.springs;
    measure.state = launch.state;
    measure.surface = surface_.data();
    launch.scene.heights.heights = measure.scene.heights.heights = heights_.data();
    for (int kind = 0; kind < sample_kinds; ++kind)
        launch.samples[kind] = measure.samples[kind] = device_samples_[kind].data();

    // Robots pause wherever the measure kernel has to take a sample: so often at most in a slice.
    int64_t pauses = 0;
    for (const int32_t i : running_)
        for (int kind = 0; kind < sample_kinds; ++kind)
            if (!taken_by_step(kind) && plans_[i].every[kind])
                pauses = std::max(pauses, 1 + (most + 1) / plans_[i].every[kind]);
    start_.record(stream_);
    for (int64_t k = 0; k <= pauses; ++k) {
        step_robots(launch);
        if (pauses > 0) scene_.launch_measure(gpu_, stream_, measure, unsigned(running_.size()));
        launch.most = 0;
    }
    end_.record(stream_);
    device_records_.download(records_.data(), records_.size(), stream_);
    if (scene_.has_solid) solids_.download(solid_records_.data(), solid_records_.size(), stream_);
}

template <class R>
void robots_on_gpu<R>::collect_slice() {
    stream_.synchronize("stepping robots");
    seconds_per_step_ = end_.seconds_since(start_) / double(std::exchange(slice_, 0));
    std::fill(std::begin(fetched_), std::end(fetched_), false);
    take_records();
}

// Brings the outcomes up to date.
template <class R>
void robots_on_gpu<R>::take_records() {
    std::vector<int32_t> ended;
    for (const int32_t i : running_) {
        const robot_record& record = records_[i];
        limax_outcome& outcome = outcomes_[robots_[i]];
        outcome.step = record.step;
        outcome.time = double(record.step - record.settle_steps) * record.time_step;
        outcome.coarse = record.coarse;
        std::copy_n(record.center[0], 3, outcome.center_start);
        std::copy_n(record.center[1], 3, outcome.center_middle);
        std::copy_n(record.center[2], 3, outcome.center_end);
        if (scene_.has_solid) tell_block(std::size_t(i), outcome);
        if (record.status != robot_running) ended.push_back(i);
    }
    if (!ended.empty()) end_robots(ended);
    std::erase_if(running_, [&](int32_t i) { return records_[i].status != robot_running; });
}

// What is known of a robot's block so far; of its end once the robot is done.
template <class R>
void robots_on_gpu<R>::tell_block(std::size_t local, limax_outcome& outcome) const {
    const solid_record& solid = solid_records_[local];
    const robot_record& record = records_[local];
    std::copy_n(solid.center[0], 3, outcome.block_start);
    std::copy_n(solid.center[1], 3, outcome.block_middle);
    std::copy_n(solid.center[2], 3, outcome.block_end);
    if (record.status != robot_done) return;
    const solid::vector v = solid::velocity(solid.block, between(record));
    outcome.block_velocity[0] = v.x;
    outcome.block_velocity[1] = v.y;
    outcome.block_velocity[2] = v.z;
    outcome.block_upright = rotation_of(solid.block.points).z.z;
}

template <class R>
void robots_on_gpu<R>::end_robots(const std::vector<int32_t>& ended) {
    const std::size_t count = ended.size();
    device_running_.upload(ended.data(), count, stream_);
    device_memory<trace_summary> device_summaries(gpu_, count, "the summaries of traces");
    pinned<trace_summary> summaries(gpu_, count, "the summaries of traces");
    summarize_launch launch{device_records_.data(),
                            device_running_.data(),
                            device_summaries.data(),
                            {},
                            int32_t(count)};
    for (int kind = 0; kind < sample_kinds; ++kind)
        launch.samples[kind] = device_samples_[kind].data();
    scene_.launch_summarize(gpu_, stream_, launch);
    device_summaries.download(summaries.data(), count, stream_);
    stream_.synchronize("summarizing traces");
    for (std::size_t k = 0; k < count; ++k) {
        const robot_record& record = records_[ended[k]];
        limax_outcome& outcome = outcomes_[robots_[ended[k]]];
        outcome.status = record.status;
        outcome.reason = record.reason;
        keep_summary(summaries[k], outcome);
    }
}

// Brings one kind of trace to the host, always to the same place: views of it live on.
template <class R>
void robots_on_gpu<R>::fetch_samples(int32_t kind) {
    if (!awake_ || fetched_[kind]) return;
    const device_memory<double>& from = device_samples_[kind];
    if (samples_[kind].size() == 0) samples_[kind] = array<double>(from.size());
    from.download(samples_[kind].data(), from.size(), stream_);
    stream_.synchronize("fetching traces");
    fetched_[kind] = true;
}

template <class R>
const double* robots_on_gpu<R>::trace(int32_t robot, int32_t kind) {
    if (!prepared_ || !takes(kind)) return nullptr;
    fetch_samples(kind);
    return samples_[kind].data() + offset(std::size_t(local_[robot]), kind);
}

template <class R>
const int32_t* robots_on_gpu<R>::sites(int32_t robot) {
    return prepared_ ? sites_of(local_[robot]).data() : nullptr;
}

template <class R>
void robots_on_gpu<R>::place(int32_t robot, const double* positions, const double* velocities) {
    wake();
    const std::size_t local = local_[robot];
    robot_record& record = records_[local];
    if (record.step > 0 || record.begun)
        fail(LIMAX_INVALID_ARGUMENT, "a robot can only be placed before its first step");
    const std::vector<int32_t>& at = sites_of(local);
    const std::size_t masses = at.size();
    for (std::size_t i = 0; i < 3 * masses; ++i)
        if ((positions && !std::isfinite(positions[i])) ||
            (velocities && !std::isfinite(velocities[i])))
            fail(LIMAX_INVALID_ARGUMENT,
                 format("mass %zu is to be placed at, or with, a value that is not finite",
                        i / 3 + 1));
    double shift[3] = {0, 0, 0};
    for (int axis = 0; positions && axis < 3; ++axis) {
        double sum = 0;
        for (std::size_t i = 0; i < masses; ++i) sum += positions[3 * i + axis];
        const double origin = whole_origin_steps(sum / double(masses));
        shift[axis] = origin - record.origin[axis];
        record.origin[axis] = origin;
    }
    if (scene_.has_solid) {
        solid::follow(solid_records_[local].block, shift);
        solids_.upload(&solid_records_[local], 1, stream_, local);
    }
    std::vector<R> state(scene_.state_columns * sites_);
    state_.download(state.data(), state.size(), stream_, local * state.size());
    stream_.synchronize("placing a robot");
    // a mass that the scene holds has the other sign, and takes no velocity
    std::vector<float> mass(static_cast<std::size_t>(sites_));
    mass_.download(mass.data(), mass.size(), stream_, local * mass.size());
    stream_.synchronize("placing a robot");
    for (std::size_t i = 0; i < masses; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            if (positions)
                column_of(state, column_position + axis)[at[i]] =
                    R(positions[3 * i + axis] - record.origin[axis]);
            if (velocities && mass[std::size_t(at[i])] > 0)
                column_of(state, column_velocity + axis)[at[i]] = R(velocities[3 * i + axis]);
        }
    state_.upload(state.data(), state.size(), stream_, local * state.size());
    device_records_.upload(&record, 1, stream_, local);
    stream_.synchronize("placing a robot");
}

template <class R>
void robots_on_gpu<R>::state(int32_t robot, double* positions, double* velocities) {
    wake();
    const std::size_t local = local_[robot];
    const robot_record& record = records_[local];
    std::vector<R> state(scene_.state_columns * sites_);
    state_.download(state.data(), state.size(), stream_, local * state.size());
    stream_.synchronize("fetching a robot's state");
    const bool halved = between(record);
    const std::vector<int32_t>& at = sites_of(local);
    for (std::size_t i = 0; i < at.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) {
            if (positions)
                positions[3 * i + axis] =
                    record.origin[axis] + double(column_of(state, column_position + axis)[at[i]]);
            if (!velocities) continue;
            const R before = column_of(state, column_velocity + axis)[at[i]];
            const R after = column_of(state, column_next_velocity + axis)[at[i]];
            velocities[3 * i + axis] = double(halved ? R(0.5) * (before + after) : before);
        }
}

template <class R>
void robots_on_gpu<R>::block(int32_t robot, double* out) {
    wake();
    const std::size_t local = std::size_t(local_[robot]);
    const robot_record& record = records_[local];
    const solid::state& block = solid_records_[local].block;
    const auto law = effects::block::make<double>(
        setup_.scene.values(effects::index_of<effects::block>), record.origin);
    const bool halved = between(record);
    solid::write_state(block, inertia_of_box(law.half, law.mass), record.origin, halved, out);
}

template <class R>
std::string robots_on_gpu<R>::describe() {
    wake();
    return scene_.describe();
}

}  // namespace

std::unique_ptr<gpu_robots> make_batch(const simulation_setup& setup, std::vector<int32_t> robots,
                                       std::shared_ptr<gpu_team> team, gpu_place& place,
                                       limax_outcome* outcomes) {
    const bool twice =
        setup.options.precision == LIMAX_DOUBLE || setup.options.precision == LIMAX_MIXED;
    if (twice)
        return std::make_unique<robots_on_gpu<double>>(setup, std::move(robots), std::move(team),
                                                       place, outcomes);
    return std::make_unique<robots_on_gpu<float>>(setup, std::move(robots), std::move(team), place,
                                                  outcomes);
}

}  // namespace limax::cuda
