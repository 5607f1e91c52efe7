// robots_state.inl: what is asked of robots on a GPU: traces, sites, states, the block, and which
// kernel steps them; a part of robots.cpp.

// Brings one kind of trace to the host, always to the same address: views of it stay valid.
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
        for (int i = 0; i < solids(); ++i) solid::follow(first_solid(local)[i].body.block, shift);
        solids_.upload(first_solid(local), solids(), stream_, local * solids());
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
void robots_on_gpu<R>::block(int32_t robot, int32_t which, double* out) {
    wake();
    const std::size_t local = std::size_t(local_[robot]);
    const robot_record& record = records_[local];
    solid::write_state(first_solid(local)[which].body, record.origin, between(record), out);
}

template <class R>
std::string robots_on_gpu<R>::describe() {
    wake();
    return scene_.describe();
}
