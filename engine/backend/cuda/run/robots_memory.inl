// robots_memory.inl: allocation and release of GPU memory; a part of robots.cpp.

// Waits for all that was sent, also after an error: memory that ends may be used again at once.
template <class R>
void robots_on_gpu<R>::wait() noexcept {
    try {
        stream_.synchronize("ending robots");
    } catch (const cuda_error&) {
    }
}

template <class R>
void robots_on_gpu<R>::release() {
    awake_ = false;
    const auto free = [](auto&... memory) { ((memory = std::decay_t<decltype(memory)>()), ...); };
    free(device_records_, device_running_, device_ranks_, device_cells_, table_, masses_, forces_,
         mass_, springs_, state_, exchange_, sums_, arrived_, faces_, after_, surface_, partners_,
         listed_at_, moved_, solids_, solid_marks_, solid_touches_, solid_corners_, solid_pairs_,
         solid_after_, heights_, control_, genes_, muscles_, device_summaries_);
    for (device_memory<double>& samples : device_samples_) free(samples);
}

template <class R>
void robots_on_gpu<R>::allocate(std::size_t count) {
    const std::string of_robots = format(" of %zu robots", count);
    const auto make = [&](auto& memory, std::size_t size, const std::string& what) {
        memory = std::decay_t<decltype(memory)>(gpu_, size, what);
    };
    const auto of_each = [&](auto& memory, std::size_t size, const char* what) {
        make(memory, count * size, what + of_robots);
    };
    const std::size_t sites = std::size_t(sites_);
    const std::size_t spring_size =
        std::size_t(scene_.spring_columns + (scene_.controlled ? 1 : 0)) * direction_count * sites;
    of_each(device_records_, 1, "the records");
    of_each(device_running_, 1, "the list");
    of_each(device_ranks_, sites, "the sites");
    if (setup_.scene.has(effects::index_of<effects::terrain>)) {
        const effects::height_table table = setup_.scene.heights();
        make(heights_, std::size_t(table.nx) * std::size_t(table.ny), "the terrain");
        heights_.upload(table.heights, heights_.size(), stream_);
    }
    // taken here, though used at the end: a run that began has all the memory that it needs
    of_each(device_summaries_, 1, "the summaries");
    of_each(mass_, sites, "the masses");
    // on the grid path a cell on the high side of the lattice reads a little beyond the last column
    const std::size_t beyond =
        scene_.on_grid() ? std::size_t(setup_.grid.step(direction{1, 1, 1})) : 0;
    make(springs_, count * spring_size + beyond, "the springs" + of_robots);
    of_each(state_, std::size_t(scene_.state_columns) * sites, "the state");
    const auto memory = scene_.memory_of_robot();
    of_each(faces_, memory.faces, "the faces");
    of_each(surface_, memory.surface, "the surfaces");
    of_each(partners_, memory.partners, "the contact pairs");
    of_each(listed_at_, memory.listed_at, "the contact pairs");
    of_each(moved_, memory.moved, "the contact pairs");
    moved_.clear(stream_);
    of_each(solids_, memory.solids, "the blocks");
    of_each(solid_marks_, memory.solid_marks, "the blocks");
    solid_marks_.clear(stream_);
    of_each(solid_touches_, memory.solid_touches, "the blocks");
    of_each(solid_corners_, memory.solid_corners, "the blocks");
    of_each(solid_pairs_, memory.solid_pairs, "the blocks");
    of_each(solid_after_, memory.solid_after, "the blocks");
    of_each(control_, memory.control, "the controllers");
    control_.clear(stream_);
    of_each(muscles_, memory.muscles, "the muscles");
    of_each(genes_, memory.genes, "the genes of control");
    if (memory.genes > 0) {
        std::vector<float> genes(count * memory.genes);
        for (std::size_t i = 0; i < count; ++i)
            std::copy_n(setup_.control.begin() + int64_t(robots_[i]) * setup_.control_genes,
                        setup_.scene.controller().genes, genes.begin() + i * memory.genes);
        genes_.upload(genes.data(), genes.size(), stream_);
        stream_.synchronize("copying genes");
    }
    of_each(sums_, memory.sums, "the sums");
    of_each(arrived_, memory.arrived, "the barriers");
    const auto make_list = [&](auto& to, const auto& list) {
        make(to, list.size(), "the plan");
        to.upload(list.data(), list.size(), stream_);
    };
    if (scene_.on_grid()) {
        of_each(exchange_, memory.exchange, "the exchange");
        of_each(after_, memory.after, "the impulses");
        springs_.clear(stream_);
    } else if (scene_.tiles) {
        const auto at_once = std::min(count, std::size_t(scene_.most_robots()));
        make(masses_, at_once * memory.masses, "the exchange");
        make(forces_, at_once * memory.forces, "the exchange");
        make_list(table_, scene_.tiles->table);
    } else {
        make_list(device_cells_, scene_.plan->cells);
    }
}

template <class R>
void robots_on_gpu<R>::lay_out_samples() {
    each_kind([&](int32_t kind) {
        int64_t size = 0;
        for (std::size_t i = 0; i < robots_.size(); ++i) {
            set_offset(i, kind, size);
            size += plans_[i].samples[kind] *
                    trace_width(kind, records_[i].masses, setup_.grid.voxels(), setup_.scene);
        }
        if (size == 0) return;
        device_samples_[kind] = device_memory<double>(
            gpu_, size, format("record: the traces of %zu robots", robots_.size()));
        if (prepared_) device_samples_[kind].upload(samples_[kind].data(), size, stream_);
    });
}
