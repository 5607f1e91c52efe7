// memory.cpp: the calls of the owners of GPU objects.
#include "backend/cuda/driver/memory.h"

#include <cmath>
#include <cstdlib>
#include <tuple>

namespace limax::cuda {

std::atomic<uint64_t>& gpu_bytes_held() {
    static std::atomic<uint64_t> bytes{0};
    return bytes;
}

namespace {

const gpu& gpu_at(const driver& driver, int ordinal) {
    for (const gpu& one : driver.gpus())
        if (one.ordinal == ordinal) return one;
    fail(LIMAX_NO_DEVICE, format("device 'cuda': GPU %d was asked for; it is none of the %zu that "
                                 "can be used",
                                 ordinal, driver.gpus().size()));
}

// LIMAX_CUDA_MEMORY: the most memory that limax uses on each GPU, in GB; unlimited if unset.
double memory_limit_of_environment() {
    const char* text = secure_getenv("LIMAX_CUDA_MEMORY");
    if (!text || !*text) return HUGE_VAL;
    char* end = nullptr;
    const double limit = std::strtod(text, &end);
    if (*end != 0 || !(limit > 0))
        fail(LIMAX_INVALID_ARGUMENT,
             format("LIMAX_CUDA_MEMORY is '%s'; it must be a number of GB above 0", text));
    return 1e9 * limit;
}

std::string title(const gpu& gpu) { return format("GPU %d (%s)", gpu.ordinal, gpu.name.c_str()); }

}  // namespace

// ---- context ----

context::context(const driver& driver, int ordinal)
    : driver_(driver), gpu_(gpu_at(driver, ordinal)), memory_limit_(memory_limit_of_environment()) {
    const std::string doing = "opening " + title(gpu_);
    CUdevice device = 0;
    driver_.check(driver_.device_get(&device, ordinal), "cuDeviceGet", doing);
    driver_.check(driver_.primary_ctx_retain(&handle_, device), "cuDevicePrimaryCtxRetain", doing);
}

context::~context() {
    free_kept();
    CUdevice device = 0;
    if (driver_.device_get(&device, gpu_.ordinal) == CUDA_SUCCESS)
        (void)driver_.primary_ctx_release(device);
}

void context::free_kept() const {
    std::multimap<std::size_t, CUdeviceptr> blocks;
    std::multimap<std::size_t, void*> on_host;
    {
        const std::lock_guard lock(mutex_);
        blocks.swap(on_gpu_.kept);
        on_host.swap(on_host_.kept);
        on_gpu_.bytes_kept = on_host_.bytes_kept = 0;
    }
    if (blocks.empty() && on_host.empty()) return;
    try {
        const scope here = current();
        for (const auto& [bytes, memory] : blocks) (void)driver_.mem_free(memory);
        for (const auto& [bytes, memory] : on_host) (void)driver_.mem_free_host(memory);
    } catch (const cuda_error&) {
    }
}

std::size_t context::free_memory() const {
    const scope here = current();
    std::size_t free = 0, total = 0;
    driver_.check(driver_.mem_get_info(&free, &total), "cuMemGetInfo",
                  "asking " + title(gpu_) + " for its free memory");
    return free;
}

context::scope::scope(const context& context) : driver_(context.driver_), handle_(context.handle_) {
    driver_.check(driver_.ctx_get_current(&before_), "cuCtxGetCurrent", "selecting a GPU");
    if (before_ != handle_)
        driver_.check(driver_.ctx_set_current(handle_), "cuCtxSetCurrent", "selecting a GPU");
}

context::scope::~scope() {
    if (before_ != handle_) (void)driver_.ctx_set_current(before_);
}

// ---- stream and event ----

stream::stream(const context& context, stream_work work) : owned(context) {
    const auto here = context.current();
    // lower numbers come first
    const int priority = work == stream_work::brief ? -1 : 0;
    api().check(api().stream_create(&handle_, CU_STREAM_NON_BLOCKING, priority),
                "cuStreamCreateWithPriority", "making a stream of " + title(context.device()));
}

void stream::synchronize(const std::string& doing) const {
    const auto here = context_->current();
    api().check(api().stream_synchronize(handle_), "cuStreamSynchronize", doing);
}

event::event(const context& context) : owned(context) {
    const auto here = context.current();
    api().check(api().event_create(&handle_, CU_EVENT_DEFAULT), "cuEventCreate",
                "making an event of " + title(context.device()));
}

void event::record(const stream& stream) {
    const auto here = context_->current();
    api().check(api().event_record(handle_, stream.handle()), "cuEventRecord",
                "recording an event");
}

double event::seconds_since(const event& start) const {
    const auto here = context_->current();
    float milliseconds = 0;
    api().check(api().event_elapsed_time(&milliseconds, start.handle_, handle_),
                "cuEventElapsedTime", "reading a time");
    return double(milliseconds) * 1e-3;
}

// ---- memory ----

device_block::device_block(const context& context, std::size_t bytes, const std::string& what)
    : owned(context) {
    if (bytes == 0) return;
    const auto here = context.current();
    const auto out_of_memory = [&](const std::string& limit) {
        throw cuda_error(LIMAX_OUT_OF_MEMORY,
                         format("CUDA: out of memory: %s: %.3g GB were needed; %s", what.c_str(),
                                double(bytes) / 1e9, limit.c_str()),
                         CUDA_ERROR_OUT_OF_MEMORY);
    };
    const std::string gpu = title(context.device());
    const double held = double(context.bytes_held());
    if (held + double(bytes) > context.memory_limit_)
        out_of_memory(format("LIMAX_CUDA_MEMORY allows %.3g GB of %s, of which %.3g GB are taken",
                             context.memory_limit_ / 1e9, gpu.c_str(), held / 1e9));
    std::tie(allocated_, handle_) = context.take<CUdeviceptr>(bytes);
    if (!handle_) {
        allocated_ = context::with_room(bytes);
        context.make_room<CUdeviceptr>(allocated_);
        const auto allocate = [&] { return api().mem_alloc(&handle_, allocated_); };
        CUresult result = CUDA_ERROR_OUT_OF_MEMORY;
        if (held + double(context.bytes_kept()) + double(allocated_) <= context.memory_limit_)
            result = allocate();
        if (result == CUDA_ERROR_OUT_OF_MEMORY) {
            context.free_kept();
            allocated_ = bytes;
            result = allocate();
        }
        if (result == CUDA_ERROR_OUT_OF_MEMORY)
            out_of_memory(format("%s has %.3g GB, of which %.3g GB are free", gpu.c_str(),
                                 double(context.device().memory) / 1e9,
                                 double(context.free_memory()) / 1e9));
        api().check(result, "cuMemAlloc", "making room for " + what);
    }
    bytes_ = bytes;
    count(int64_t(bytes));
}

void device_block::require_inside(std::size_t offset, std::size_t bytes) const {
    if (offset > bytes_ || bytes > bytes_ - offset)
        fail(LIMAX_INTERNAL, format("a copy of %zu bytes at %zu leaves a block of %zu on the GPU",
                                    bytes, offset, bytes_));
}

void device_block::clear(const stream& stream) {
    if (bytes_ == 0) return;
    const auto here = context_->current();
    api().check(api().memset_d8_async(handle_, 0, bytes_, stream.handle()), "cuMemsetD8Async",
                format("clearing %.3g MB", double(bytes_) / 1e6));
}

void device_block::upload(std::size_t offset, const void* from, std::size_t bytes,
                          const stream& stream) {
    require_inside(offset, bytes);
    if (bytes == 0) return;
    const auto here = context_->current();
    api().check(api().memcpy_htod_async(handle_ + offset, from, bytes, stream.handle()),
                "cuMemcpyHtoDAsync", format("sending %.3g MB to the GPU", double(bytes) / 1e6));
}

void device_block::download(std::size_t offset, void* to, std::size_t bytes,
                            const stream& stream) const {
    require_inside(offset, bytes);
    if (bytes == 0) return;
    const auto here = context_->current();
    api().check(api().memcpy_dtoh_async(to, handle_ + offset, bytes, stream.handle()),
                "cuMemcpyDtoHAsync", format("fetching %.3g MB from the GPU", double(bytes) / 1e6));
}

void device_block::copy(std::size_t offset, const device_block& from, std::size_t from_offset,
                        std::size_t bytes, const stream& stream) {
    require_inside(offset, bytes);
    from.require_inside(from_offset, bytes);
    if (bytes == 0) return;
    const auto here = context_->current();
    api().check(api().memcpy_dtod_async(handle_ + offset, from.handle_ + from_offset, bytes,
                                        stream.handle()),
                "cuMemcpyDtoDAsync", format("copying %.3g MB on the GPU", double(bytes) / 1e6));
}

pinned_block::pinned_block(const context& context, std::size_t bytes, const std::string& what)
    : owned(context) {
    if (bytes == 0) return;
    const auto here = context.current();
    std::tie(allocated_, handle_) = context.take<void*>(bytes);
    if (!handle_) {
        allocated_ = context::with_room(bytes);
        context.make_room<void*>(allocated_);
    }
    const CUresult result = handle_ ? CUDA_SUCCESS : api().mem_alloc_host(&handle_, allocated_);
    if (result == CUDA_ERROR_OUT_OF_MEMORY)
        throw cuda_error(
            LIMAX_OUT_OF_MEMORY,
            format("CUDA: out of memory: %s: %.3g GB of this machine's memory were needed where "
                   "the GPU can read them",
                   what.c_str(), double(bytes) / 1e9),
            result);
    api().check(result, "cuMemAllocHost", "making room for " + what);
    bytes_ = bytes;
    count(int64_t(bytes));
}

}  // namespace limax::cuda
