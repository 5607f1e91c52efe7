// driver.cpp: a fake CUDA driver: a library with the driver's functions whose GPUs use memory of
// the host, initially 0, so that everything but the kernels can be tested on any machine. Launches
// do nothing.
#include "driver.h"

#include <cuda.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>

namespace {

std::mutex mutex;  // guards what follows
limax::test::fake_driver fake;
std::map<CUdeviceptr, std::size_t> blocks;  // bytes of each
thread_local CUcontext current = nullptr;
char something;  // handles point here

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
        case CU_DEVICE_ATTRIBUTE_CLUSTER_LAUNCH: *value = capability >= 90; break;
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

CUresult cuMemGetInfo(std::size_t* free, std::size_t* total) {
    BEGIN_IN_CONTEXT(cuMemGetInfo);
    *free = fake.memory - fake.held;
    *total = fake.memory;
    return CUDA_SUCCESS;
}
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
CUresult cuMemFree(CUdeviceptr address) {
    BEGIN_IN_CONTEXT(cuMemFree);
    fake.held -= blocks.at(address);
    blocks.erase(address);
    std::free(bytes_at(address));
    return CUDA_SUCCESS;
}
CUresult cuMemAllocHost(void** data, std::size_t bytes) {
    BEGIN_IN_CONTEXT(cuMemAllocHost);
    ++fake.host_blocks;
    *data = std::calloc(bytes, 1);
    return CUDA_SUCCESS;
}
CUresult cuMemFreeHost(void* data) {
    BEGIN_IN_CONTEXT(cuMemFreeHost);
    --fake.host_blocks;
    std::free(data);
    return CUDA_SUCCESS;
}
CUresult cuMemcpyHtoDAsync(CUdeviceptr to, const void* from, std::size_t bytes, CUstream) {
    BEGIN_IN_CONTEXT(cuMemcpyHtoDAsync);
    std::memcpy(bytes_at(to), from, bytes);
    return CUDA_SUCCESS;
}
CUresult cuMemcpyDtoHAsync(void* to, CUdeviceptr from, std::size_t bytes, CUstream) {
    BEGIN_IN_CONTEXT(cuMemcpyDtoHAsync);
    std::memcpy(to, bytes_at(from), bytes);
    return CUDA_SUCCESS;
}
CUresult cuMemcpyDtoDAsync(CUdeviceptr to, CUdeviceptr from, std::size_t bytes, CUstream) {
    BEGIN_IN_CONTEXT(cuMemcpyDtoDAsync);
    std::memcpy(bytes_at(to), bytes_at(from), bytes);
    return CUDA_SUCCESS;
}
CUresult cuMemsetD8Async(CUdeviceptr to, unsigned char value, std::size_t bytes, CUstream) {
    BEGIN_IN_CONTEXT(cuMemsetD8Async);
    std::memset(bytes_at(to), value, bytes);
    return CUDA_SUCCESS;
}

CUresult cuStreamCreate(CUstream* stream, unsigned) {
    BEGIN_IN_CONTEXT(cuStreamCreate);
    ++fake.streams;
    *stream = reinterpret_cast<CUstream>(&something);
    return CUDA_SUCCESS;
}
CUresult cuStreamDestroy(CUstream) {
    BEGIN_IN_CONTEXT(cuStreamDestroy);
    --fake.streams;
    return CUDA_SUCCESS;
}
CUresult cuStreamSynchronize(CUstream) {
    BEGIN_IN_CONTEXT(cuStreamSynchronize);
    return CUDA_SUCCESS;
}
CUresult cuEventCreate(CUevent* event, unsigned) {
    BEGIN_IN_CONTEXT(cuEventCreate);
    ++fake.events;
    *event = reinterpret_cast<CUevent>(&something);
    return CUDA_SUCCESS;
}
CUresult cuEventDestroy(CUevent) {
    BEGIN_IN_CONTEXT(cuEventDestroy);
    --fake.events;
    return CUDA_SUCCESS;
}
CUresult cuEventRecord(CUevent, CUstream) {
    BEGIN_IN_CONTEXT(cuEventRecord);
    return CUDA_SUCCESS;
}
CUresult cuEventElapsedTime(float* milliseconds, CUevent, CUevent) {
    BEGIN_IN_CONTEXT(cuEventElapsedTime);
    *milliseconds = 1500;
    return CUDA_SUCCESS;
}

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
CUresult cuModuleUnload(CUmodule) {
    BEGIN_IN_CONTEXT(cuModuleUnload);
    --fake.modules;
    return CUDA_SUCCESS;
}
CUresult cuModuleGetFunction(CUfunction* function, CUmodule, const char* name) {
    BEGIN_IN_CONTEXT(cuModuleGetFunction);
    if (std::strcmp(name, "absent") == 0) return CUDA_ERROR_NOT_FOUND;
    *function = reinterpret_cast<CUfunction>(&something);
    return CUDA_SUCCESS;
}
CUresult cuFuncGetAttribute(int* value, CUfunction_attribute which, CUfunction) {
    BEGIN_IN_CONTEXT(cuFuncGetAttribute);
    *value = 100 + int(which);
    return CUDA_SUCCESS;
}
CUresult cuFuncSetAttribute(CUfunction, CUfunction_attribute, int) {
    BEGIN_IN_CONTEXT(cuFuncSetAttribute);
    return CUDA_SUCCESS;
}
CUresult cuLaunchKernelEx(const CUlaunchConfig* config, CUfunction, void** arguments, void**) {
    BEGIN_IN_CONTEXT(cuLaunchKernelEx);
    ++fake.launches;
    fake.blocks = config->gridDimX;
    fake.threads = config->blockDimX;
    fake.shared_bytes = config->sharedMemBytes;
    fake.cluster = 1;
    fake.cooperative = false;
    for (unsigned i = 0; i < config->numAttrs; ++i) {
        const CUlaunchAttribute& attribute = config->attrs[i];
        if (attribute.id == CU_LAUNCH_ATTRIBUTE_CLUSTER_DIMENSION)
            fake.cluster = attribute.value.clusterDim.x;
        if (attribute.id == CU_LAUNCH_ATTRIBUTE_COOPERATIVE)
            fake.cooperative = attribute.value.cooperative != 0;
    }
    std::memcpy(&fake.argument, arguments[0], sizeof fake.argument);
    return CUDA_SUCCESS;
}
CUresult cuOccupancyMaxActiveBlocksPerMultiprocessor(int* count, CUfunction, int, std::size_t) {
    BEGIN_IN_CONTEXT(cuOccupancyMaxActiveBlocksPerMultiprocessor);
    *count = 3;
    return CUDA_SUCCESS;
}

}  // extern "C"
#pragma GCC visibility pop
