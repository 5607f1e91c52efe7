// robots_memory.inl: allocation and release of GPU memory; a part of robots.cpp.

// Frees all GPU memory.
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
    device_summaries_ = {};
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
    // taken here, though used at the end: a run that began has all the memory that it needs
    device_summaries_ = device_memory<trace_summary>(gpu_, count, "the summaries" + of_robots);
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
    partners_ =
        device_memory<int32_t>(gpu_, count * memory.partners, "the contact pairs" + of_robots);
    listed_at_ =
        device_memory<float>(gpu_, count * memory.listed_at, "the contact pairs" + of_robots);
    moved_ = device_memory<unsigned long long>(gpu_, count * memory.moved,
                                               "the contact pairs" + of_robots);
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
