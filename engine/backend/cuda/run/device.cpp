// device.cpp: the description of the GPUs of this host, and the threads that serve them.
#include "backend/cuda/run/device.h"

#include <bit>
#include <nlohmann/json.hpp>

#include "backend/cuda/run/population.h"

namespace limax::cuda {

namespace {

// "9.0" for 90.
std::string version_of(int capability) { return format("%d.%d", capability / 10, capability % 10); }

class cuda_device final : public device {
public:
    cuda_device(const driver& driver, int threads, const char* isa)
        : host_(make_device("cpu", threads, isa)), team_(std::make_shared<gpu_team>(driver)) {
        auto text = nlohmann::ordered_json::parse(host_->describe());
        text["kind"] = "cuda";
        nlohmann::ordered_json gpus = nlohmann::ordered_json::array();
        for (const auto& place : team_->places()) {
            const gpu& one = place->gpu.device();
            gpus.push_back({{"ordinal", one.ordinal},
                            {"name", one.name},
                            {"uuid", one.uuid},
                            {"capability", version_of(one.capability)},
                            {"multiprocessors", one.multiprocessors},
                            {"memory", one.memory}});
        }
        text["gpus"] = gpus;
        for (const gpu& old : driver.old_gpus())
            text["gpus_too_old"].push_back(
                {{"name", old.name}, {"capability", version_of(old.capability)}});
        text["cuda"] =
            format("driver %d.%d", driver.version() / 1000, driver.version() % 1000 / 10);
        std::string why;
        const compiler* nvrtc = compiler::get(&why);
        text["nvrtc"] = nvrtc ? nvrtc->version() : why;
        text["kernel_cache"] = kernel_cache::users().folder();
        description_ = text.dump();
    }
    const char* describe() const override { return description_.c_str(); }
    const parallel_for& each() const override { return host_->each(); }
    express_pass express() const override { return host_->express(); }
    std::unique_ptr<simulation> simulate(simulation_setup setup) override {
        check_beyond_cpu(setup.options);
        return make_simulation(std::move(setup), team_);
    }
    std::shared_ptr<device_population> make_population(const std::shared_ptr<const encoding>& code,
                                                       int32_t count) override {
        return cuda::make_population(team_, code, count);
    }
    bool stores(const device_population& population) const override {
        return stored_on(population, *team_);
    }

private:
    std::unique_ptr<device> host_;
    std::shared_ptr<gpu_team> team_;
    std::string description_;
};

}  // namespace

gpu_team::gpu_team(const driver& driver) : threads_(int(driver.gpus().size())) {
    for (const gpu& one : driver.gpus())
        places_.push_back(std::make_unique<gpu_place>(driver, one.ordinal));
}

std::shared_ptr<const device_encoding> gpu_team::encoding_on_gpu(
    const std::shared_ptr<const encoding>& code) {
    const std::lock_guard lock(mutex_);
    std::erase_if(encodings_, [](const auto& entry) { return entry.second.expired(); });
    std::weak_ptr<const device_encoding>& entry = encodings_[code.get()];
    if (auto there = entry.lock()) return there;
    const context& gpu = places_.front()->gpu;
    auto made = std::make_shared<device_encoding>();
    made->code = code;
    if (const std::size_t size = code->features_size()) {
        made->features = device_memory<float>(gpu, size, "the features of an encoding");
        const stream queue(gpu);
        made->features.upload(code->features(), size, queue);
        queue.synchronize("sending the features of an encoding to the GPU");
    }
    entry = made;
    return made;
}

double& gpu_team::last_step_time(const lattice& grid, std::size_t robots) {
    return step_times_[{grid.sites(), int(std::bit_width(robots))}];
}

double gpu_team::step_time(const lattice& grid, std::size_t robots) {
    const std::lock_guard lock(mutex_);
    return last_step_time(grid, robots);
}

void gpu_team::note_step_time(const lattice& grid, std::size_t robots, double seconds) {
    const std::lock_guard lock(mutex_);
    last_step_time(grid, robots) = seconds;
}

std::string why_no_cuda_device() {
    std::string why;
    driver::get(&why);
    return why;
}

std::unique_ptr<device> make_cuda_device(int threads, const char* isa) {
    std::string why;
    const driver* driver = driver::get(&why);
    if (!driver) fail(LIMAX_NO_DEVICE, "device 'cuda': " + why + "; use 'cpu' or 'auto'");
    return std::make_unique<cuda_device>(*driver, threads, isa);
}

}  // namespace limax::cuda
