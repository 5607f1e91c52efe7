// robots_steps.inl: slices of steps on a GPU, and what they did to outcomes; a part of robots.cpp.

template <class R>
int64_t robots_on_gpu<R>::most_steps_left() const {
    int64_t most = 0;
    for (const int32_t i : running_) most = std::max(most, records_[i].steps - records_[i].step);
    return most;
}

// Steps that are estimated to take `seconds`.
template <class R>
int64_t robots_on_gpu<R>::steps_in(double seconds) const {
    if (!(seconds_per_step_ > 0)) return first_steps;
    return std::clamp<int64_t>(int64_t(seconds / seconds_per_step_), 1, most_steps_left() + 1);
}

template <class R>
void robots_on_gpu<R>::enqueue(double seconds) {
    wake();
    // so that no slice is shorter than it could be, or much longer
    if (!(seconds_per_step_ > 0))
        seconds_per_step_ = team_->step_time(setup_.grid, running_.size());
    if (!(seconds_per_step_ > 0)) advance(0, first_steps);
    if (!running_.empty() && !interrupted()) enqueue_slice(steps_in(seconds));
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
// for each other, in several.
template <class R>
void robots_on_gpu<R>::step_robots(const step_launch<R>& launch) {
    const auto robots = unsigned(running_.size());
    if (!scene_.on_grid() && !scene_.tiles) {
        scene_.launch_step(gpu_, stream_, launch, robots);
        return;
    }
    arrived_.clear(stream_);
    sums_.clear(stream_);
    for (unsigned first = 0; first < robots; first += scene_.most_robots()) {
        const unsigned now = std::min(robots - first, scene_.most_robots());
        step_launch<R> some = launch;
        some.running += first;
        if (scene_.tiles) {
            masses_.clear(stream_);
            forces_.clear(stream_);
            const std::size_t sums = sums_.size() / robots_.size() * first;
            scene_.launch_tiles(
                gpu_, stream_,
                tile_launch<R>{some, table_.data(), masses_.data(), forces_.data(),
                               sums_.data() + sums, arrived_.data() + 3 * std::size_t(first)},
                now);
        } else {
            scene_.launch_grid(gpu_, stream_,
                               grid_launch<R>{some, after_.data(), exchange_.data(), sums_.data(),
                                              arrived_.data(), setup_.grid, 0},
                               now);
        }
    }
}

// Robots pause wherever the measure kernel has to take a sample: so often at most in a launch.
template <class R>
void robots_on_gpu<R>::launch_steps(step_launch<R> launch, const measure_launch<R>& measure) {
    int64_t pauses = 0;
    for (const int32_t i : running_)
        for (int kind = 0; kind < sample_kinds; ++kind)
            if (!taken_by_step(kind) && plans_[i].every[kind])
                pauses = std::max(pauses, 1 + (launch.most + 1) / plans_[i].every[kind]);
    for (int64_t k = 0; k <= pauses; ++k) {
        step_robots(launch);
        if (pauses > 0) scene_.launch_measure(gpu_, stream_, measure, unsigned(running_.size()));
        launch.most = 0;
    }
}

template <class R>
void robots_on_gpu<R>::enqueue_slice(int64_t most) {
    slice_ = most;
    device_running_.upload(running_.data(), running_.size(), stream_);
    step_launch<R> launch = scene_.template step_arguments<R>();
    launch.records = device_records_.data();
    launch.running = device_running_.data();
    launch.cells = device_cells_.data();
    launch.mass = mass_.data();
    launch.springs = springs_.data();
    launch.state = state_.data();
    launch.faces = faces_.data();
    launch.pairs = {surface_.data(), partners_.data(), listed_at_.data(), moved_.data()};
    launch.solids = {solids_.data(),
                     solid_marks_.data(),
                     solid_touches_.data(),
                     solid_corners_.data(),
                     solid_pairs_.data(),
                     solid_after_.data(),
                     device_samples_[LIMAX_TRACE_BLOCK].data()};
    launch.control = {control_.data(), genes_.data(), muscles_.data()};
    measure_launch<R> measure = scene_.template measure_arguments<R>();
    measure.records = launch.records;
    measure.running = launch.running;
    measure.ranks = device_ranks_.data();
    measure.mass = launch.mass;
    measure.springs = launch.springs;
    measure.state = launch.state;
    measure.surface = surface_.data();
    measure.control = control_.data();
    launch.scene.heights.heights = measure.scene.heights.heights = heights_.data();
    for (int kind = 0; kind < sample_kinds; ++kind)
        launch.samples[kind] = measure.samples[kind] = device_samples_[kind].data();

    start_.record(stream_);
    // in launches that are short enough for other work on the GPU
    const int64_t most_of_launch = std::min(most, steps_in(most_seconds));
    for (int64_t sent = 0; sent < most; sent += most_of_launch) {
        launch.most = std::min(most_of_launch, most - sent);
        launch_steps(launch, measure);
    }
    end_.record(stream_);
    device_records_.download(records_.data(), records_.size(), stream_);
    if (scene_.has_solid) solids_.download(solid_records_.data(), solid_records_.size(), stream_);
}

template <class R>
void robots_on_gpu<R>::collect_slice() {
    stream_.synchronize("stepping robots");
    slice_ = 0;
    int64_t done = 1;  // fewer than were sent where robots diverged
    for (const int32_t i : running_)
        done = std::max(done, records_[i].step - outcomes_[robots_[i]].step);
    seconds_per_step_ = end_.seconds_since(start_) / double(done);
    team_->note_step_time(setup_.grid, running_.size(), seconds_per_step_);
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
        if (scene_.has_solid) write_block_outcome(std::size_t(i), outcome);
        if (record.status != robot_running) ended.push_back(i);
    }
    if (!ended.empty()) end_robots(ended);
    std::erase_if(running_, [&](int32_t i) { return records_[i].status != robot_running; });
}

// The first block's part of an outcome, complete once the robot is done.
template <class R>
void robots_on_gpu<R>::write_block_outcome(std::size_t local, limax_outcome& outcome) const {
    const solid_record& solid = *first_solid(local);
    const robot_record& record = records_[local];
    std::copy_n(solid.center[0], 3, outcome.block_start);
    std::copy_n(solid.center[1], 3, outcome.block_middle);
    std::copy_n(solid.center[2], 3, outcome.block_end);
    if (record.status != robot_done) return;
    const solid::vector v = solid::velocity(solid.body, between(record));
    outcome.block_velocity[0] = v.x;
    outcome.block_velocity[1] = v.y;
    outcome.block_velocity[2] = v.z;
    outcome.block_upright = rotation_of(solid.body.block.points).z.z;
}

template <class R>
void robots_on_gpu<R>::end_robots(const std::vector<int32_t>& ended) {
    const std::size_t count = ended.size();
    device_running_.upload(ended.data(), count, stream_);
    summarize_launch launch{device_records_.data(),
                            device_running_.data(),
                            device_summaries_.data(),
                            {},
                            int32_t(count)};
    for (int kind = 0; kind < sample_kinds; ++kind)
        launch.samples[kind] = device_samples_[kind].data();
    scene_.launch_summarize(gpu_, stream_, launch);
    device_summaries_.download(summaries_.data(), count, stream_);
    stream_.synchronize("summarizing traces");
    for (std::size_t k = 0; k < count; ++k) {
        const robot_record& record = records_[ended[k]];
        limax_outcome& outcome = outcomes_[robots_[ended[k]]];
        outcome.status = record.status;
        outcome.reason = record.reason;
        keep_summary(summaries_[k], outcome);
    }
}
