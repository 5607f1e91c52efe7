// driver.cpp: a fake CUDA driver: a library with the driver's functions whose GPUs use memory of
// the host, initially 0, so that everything but the kernels can be tested on any machine. Launches
// do nothing.
#include "driver.h"

#include <cuda.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>

namespace {

std::mutex mutex;  // guards what follows
limax::test::fake_driver fake;
std::map<CUdeviceptr, std::size_t> blocks;  // bytes of each
std::uintptr_t last_stream = 0;
thread_local CUcontext current = nullptr;
char something;       // other handles point here
char prepare_kernel;  // "limax_prepare"

// Addresses of the fake GPU are addresses of the host.
void* bytes_at(CUdeviceptr address) {
    return reinterpret_cast<void*>(address);  // NOLINT(performance-no-int-to-ptr)
}

// Whether this call is the one that is set to fail.
bool fails(const char* function) {
    if (!fake.failing || std::strcmp(fake.failing, function) != 0) return false;
    fake.failing = nullptr;
    return true;
}

// The checks of every call that needs a context.
bool refuses(const char* function) {
    if (!current) ++fake.calls_without_context;
    return !current || fails(function);
}

CUresult refusal() { return current ? CUresult(fake.result) : CUDA_ERROR_INVALID_CONTEXT; }

}  // namespace

#define BEGIN(function)                    \
    const std::lock_guard one_call(mutex); \
    if (fails(#function)) return CUresult(fake.result)
#define BEGIN_IN_CONTEXT(function)         \
    const std::lock_guard one_call(mutex); \
    if (refuses(#function)) return refusal()
// A function that needs a context, with what it does. It is set to fail by its plain name, which a
// nested macro would turn into cuda.h's versioned one.
#define CALL(function, parameters, ...)           \
    CUresult function parameters {                \
        const std::lock_guard one_call(mutex);    \
        if (refuses(#function)) return refusal(); \
        __VA_ARGS__;                              \
        return CUDA_SUCCESS;                      \
    }

#pragma GCC visibility push(default)
extern "C" {

limax::test::fake_driver* limax_fake_driver() { return &fake; }

CUresult cuDriverGetVersion(int* version) {
    *version = fake.version;
    return CUDA_SUCCESS;
}
CUresult cuInit(unsigned) {
    BEGIN(cuInit);
    return CUDA_SUCCESS;
}
CUresult cuGetErrorName(CUresult error, const char** name) {
    static std::string text;
    text = "CUDA_ERROR_" + std::to_string(int(error));
    *name = text.c_str();
    return CUDA_SUCCESS;
}
CUresult cuGetErrorString(CUresult, const char** text) {
    *text = "as set in the fake driver";
    return CUDA_SUCCESS;
}

CUresult cuDeviceGetCount(int* count) {
    BEGIN(cuDeviceGetCount);
    *count = fake.gpus;
    return CUDA_SUCCESS;
}
CUresult cuDeviceGet(CUdevice* device, int ordinal) {
    *device = ordinal;
    return CUDA_SUCCESS;
}
CUresult cuDeviceGetName(char* name, int length, CUdevice) {
    std::strncpy(name, "Fake GPU", std::size_t(length));
    return CUDA_SUCCESS;
}
CUresult cuDeviceGetAttribute(int* value, CUdevice_attribute which, CUdevice device) {
    BEGIN(cuDeviceGetAttribute);
    const bool differs = device == fake.gpus - 1 && fake.capability_of_last != 0;
    const int capability = differs ? fake.capability_of_last : fake.capability;
    switch (which) {
        case CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR: *value = capability / 10; break;
        case CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR: *value = capability % 10; break;
        case CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT: *value = 132; break;
        case CU_DEVICE_ATTRIBUTE_MAX_SHARED_MEMORY_PER_BLOCK_OPTIN:
            *value = fake.shared_memory_of_block;
            break;
        case CU_DEVICE_ATTRIBUTE_L2_CACHE_SIZE: *value = 50 << 20; break;
        default: *value = 1;
    }
    return CUDA_SUCCESS;
}
CUresult cuDeviceGetUuid(CUuuid* uuid, CUdevice) {
    for (int i = 0; i < 16; ++i) uuid->bytes[i] = char(0x11 * i);
    return CUDA_SUCCESS;
}
CUresult cuDeviceTotalMem(std::size_t* bytes, CUdevice) {
    *bytes = fake.memory;
    return CUDA_SUCCESS;
}

CUresult cuDevicePrimaryCtxRetain(CUcontext* context, CUdevice) {
    BEGIN(cuDevicePrimaryCtxRetain);
    ++fake.contexts;
    *context = reinterpret_cast<CUcontext>(&something);
    return CUDA_SUCCESS;
}
CUresult cuDevicePrimaryCtxRelease(CUdevice) {
    --fake.contexts;
    return CUDA_SUCCESS;
}
CUresult cuCtxGetCurrent(CUcontext* context) {
    *context = current;
    return CUDA_SUCCESS;
}
CUresult cuCtxSetCurrent(CUcontext context) {
    current = context;
    return CUDA_SUCCESS;
}

CALL(cuMemGetInfo, (std::size_t * free, std::size_t* total), *free = fake.memory - fake.held;
     *total = fake.memory)
CUresult cuMemAlloc(CUdeviceptr* address, std::size_t bytes) {
    BEGIN_IN_CONTEXT(cuMemAlloc);
    if (bytes > fake.memory - fake.held || fake.allocations_left == 0)
        return CUDA_ERROR_OUT_OF_MEMORY;
    if (fake.allocations_left > 0) --fake.allocations_left;
    *address = reinterpret_cast<CUdeviceptr>(std::calloc(bytes, 1));
    blocks[*address] = bytes;
    fake.held += bytes;
    return CUDA_SUCCESS;
}
CALL(cuMemFree, (CUdeviceptr address), fake.held -= blocks.at(address); blocks.erase(address);
     std::free(bytes_at(address)))
CALL(cuMemAllocHost, (void** data, std::size_t bytes), ++fake.host_blocks;
     *data = std::calloc(bytes, 1))
CALL(cuMemFreeHost, (void* data), --fake.host_blocks; std::free(data))
CALL(cuMemcpyHtoDAsync, (CUdeviceptr to, const void* from, std::size_t bytes, CUstream),
     std::memcpy(bytes_at(to), from, bytes))
CALL(cuMemcpyDtoHAsync, (void* to, CUdeviceptr from, std::size_t bytes, CUstream),
     std::memcpy(to, bytes_at(from), bytes))
CALL(cuMemcpyDtoDAsync, (CUdeviceptr to, CUdeviceptr from, std::size_t bytes, CUstream),
     std::memcpy(bytes_at(to), bytes_at(from), bytes))
CALL(cuMemsetD8Async, (CUdeviceptr to, unsigned char value, std::size_t bytes, CUstream),
     std::memset(bytes_at(to), value, bytes))

CALL(cuStreamCreateWithPriority, (CUstream * stream, unsigned, int), ++fake.streams;
     *stream = reinterpret_cast<CUstream>(++last_stream))  // NOLINT(performance-no-int-to-ptr)
CALL(cuStreamDestroy, (CUstream), --fake.streams)
CALL(cuStreamSynchronize, (CUstream), )
CALL(cuEventCreate, (CUevent * event, unsigned), ++fake.events;
     *event = reinterpret_cast<CUevent>(&something))
CALL(cuEventDestroy, (CUevent), --fake.events)
CALL(cuEventRecord, (CUevent, CUstream), )
CALL(cuEventElapsedTime, (float* milliseconds, CUevent, CUevent), *milliseconds = 1500)

CUresult cuModuleLoadDataEx(CUmodule* module, const void* image, unsigned count, CUjit_option*,
                            void** values) {
    BEGIN_IN_CONTEXT(cuModuleLoadDataEx);
    if (fake.refused_image &&
        std::memcmp(image, fake.refused_image, std::strlen(fake.refused_image)) == 0) {
        const char log[] = "the fake driver's log";
        if (count > 0) std::memcpy(values[0], log, sizeof log);
        return CUDA_ERROR_UNSUPPORTED_PTX_VERSION;
    }
    ++fake.modules;
    *module = reinterpret_cast<CUmodule>(&something);
    return CUDA_SUCCESS;
}
CALL(cuModuleUnload, (CUmodule), --fake.modules)
CUresult cuModuleGetFunction(CUfunction* function, CUmodule, const char* name) {
    BEGIN_IN_CONTEXT(cuModuleGetFunction);
    const bool prepares = std::strcmp(name, "limax_prepare") == 0;
    *function = reinterpret_cast<CUfunction>(prepares ? &prepare_kernel : &something);
    return CUDA_SUCCESS;
}
CALL(cuFuncGetAttribute, (int* value, CUfunction_attribute which, CUfunction),
     *value = 100 + int(which))
CALL(cuFuncSetAttribute, (CUfunction, CUfunction_attribute, int), )
CUresult cuLaunchKernelEx(const CUlaunchConfig* config, CUfunction function, void** arguments,
                          void**) {
    BEGIN_IN_CONTEXT(cuLaunchKernelEx);
    ++fake.launches;
    fake.blocks = config->gridDimX;
    if (fake.prepare && function == reinterpret_cast<CUfunction>(&prepare_kernel))
        fake.prepare(arguments[0], config->gridDimX);
    return CUDA_SUCCESS;
}
CALL(cuOccupancyMaxActiveBlocksPerMultiprocessor, (int* count, CUfunction, int, std::size_t),
     *count = 3)

}  // extern "C"
#pragma GCC visibility pop
