// driver.h: the CUDA driver, opened at run time: its functions with the types of cuda.h, the GPUs
// that it shows, and its errors as texts for a person. Nothing here links against CUDA.
#pragma once

#include <cuda.h>

#include <memory>
#include <string>
#include <vector>

#include "backend/cuda/driver/library.h"
#include "base/error.h"

namespace limax::cuda {

// f(member, function of cuda.h): every function that is called. cuda.h gives many of them a
// versioned name by a macro; that name is what the library is asked for.
#define LIMAX_CUDA_FUNCTIONS(f)                        \
    f(init, cuInit);                                   \
    f(driver_get_version, cuDriverGetVersion);         \
    f(get_error_name, cuGetErrorName);                 \
    f(get_error_string, cuGetErrorString);             \
    f(device_get_count, cuDeviceGetCount);             \
    f(device_get, cuDeviceGet);                        \
    f(device_get_name, cuDeviceGetName);               \
    f(device_get_attribute, cuDeviceGetAttribute);     \
    f(device_get_uuid, cuDeviceGetUuid);               \
    f(device_total_mem, cuDeviceTotalMem);             \
    f(primary_ctx_retain, cuDevicePrimaryCtxRetain);   \
    f(primary_ctx_release, cuDevicePrimaryCtxRelease); \
    f(ctx_get_current, cuCtxGetCurrent);               \
    f(ctx_set_current, cuCtxSetCurrent);               \
    f(mem_get_info, cuMemGetInfo);                     \
    f(mem_alloc, cuMemAlloc);                          \
    f(mem_free, cuMemFree);                            \
    f(mem_alloc_host, cuMemAllocHost);                 \
    f(mem_free_host, cuMemFreeHost);                   \
    f(memcpy_htod_async, cuMemcpyHtoDAsync);           \
    f(memcpy_dtoh_async, cuMemcpyDtoHAsync);           \
    f(memcpy_dtod_async, cuMemcpyDtoDAsync);           \
    f(memset_d8_async, cuMemsetD8Async);               \
    f(stream_create, cuStreamCreateWithPriority);      \
    f(stream_destroy, cuStreamDestroy);                \
    f(stream_synchronize, cuStreamSynchronize);        \
    f(event_create, cuEventCreate);                    \
    f(event_destroy, cuEventDestroy);                  \
    f(event_record, cuEventRecord);                    \
    f(event_elapsed_time, cuEventElapsedTime);         \
    f(module_load_data_ex, cuModuleLoadDataEx);        \
    f(module_unload, cuModuleUnload);                  \
    f(module_get_function, cuModuleGetFunction);       \
    f(func_get_attribute, cuFuncGetAttribute);         \
    f(func_set_attribute, cuFuncSetAttribute);         \
    f(launch_kernel_ex, cuLaunchKernelEx);             \
    f(occupancy_max_active_blocks, cuOccupancyMaxActiveBlocksPerMultiprocessor)

// The driver and the GPUs that are served: CUDA 12 or newer, compute capability 7.5 or newer.
inline constexpr int oldest_driver = 12010, oldest_capability = 75;

// The properties of a GPU that do not change while it works.
struct gpu {
    int ordinal;             // as the driver counts, after CUDA_VISIBLE_DEVICES
    std::string name, uuid;  // "NVIDIA H200", "GPU-..."
    int capability;          // 90 for 9.0
    int multiprocessors;
    std::size_t memory;                  // bytes
    std::size_t second_level_cache;      // bytes
    std::size_t shared_memory_of_block;  // bytes, the most that a kernel can opt in to
};

// A call that the driver refused.
class cuda_error : public error {
public:
    cuda_error(limax_status status, const std::string& text, CUresult result)
        : error(status, text), result_(result) {}
    CUresult result() const noexcept { return result_; }

private:
    CUresult result_;
};

class driver {
public:
    // The driver of this machine, opened at the first call and kept. Null where there is none that
    // could be used, with the reason, one sentence without a full stop, in `why` (may be null).
    // From any thread.
    static const driver* get(std::string* why);
    // The same from the library of this name, not kept.
    static std::unique_ptr<const driver> open(const char* library, std::string* why);

    int version() const { return version_; }  // 13000 for 13.0
    // The GPUs that are served: at least one, ascending by ordinal.
    const std::vector<gpu>& gpus() const { return gpus_; }
    // Those that the driver shows too and that are too old.
    const std::vector<gpu>& old_gpus() const { return old_gpus_; }

    // Throws cuda_error unless `result` is success: "CUDA: CALL failed while DOING: NAME
    // (explanation). REMEDY", and what a sticky error means; LIMAX_OUT_OF_MEMORY when memory ran
    // out, LIMAX_NO_DEVICE when GPU or driver are to blame, else LIMAX_INTERNAL. `doing` continues
    // "while".
    void check(CUresult result, const char* call, const std::string& doing) const {
        if (result != CUDA_SUCCESS) refuse(result, call, doing);
    }
    [[noreturn]] void refuse(CUresult result, const char* call, const std::string& doing) const;

#define LIMAX_CUDA_MEMBER(member, function) decltype(&function) member = nullptr
    LIMAX_CUDA_FUNCTIONS(LIMAX_CUDA_MEMBER);
#undef LIMAX_CUDA_MEMBER

private:
    driver() = default;
    // Empty, or the reason why this library cannot be used.
    std::string load(const char* library);
    std::string missing_function();
    std::string describe(CUresult result) const;  // "CUDA_ERROR_X (explanation)"
    gpu describe_gpu(int ordinal) const;

    shared_library library_;
    int version_ = 0;
    std::vector<gpu> gpus_, old_gpus_;
};

}  // namespace limax::cuda
