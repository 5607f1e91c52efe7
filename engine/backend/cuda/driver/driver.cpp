// driver.cpp: opens the CUDA driver, lists its GPUs, and turns its errors into messages.
#include "backend/cuda/driver/driver.h"

#include <algorithm>
#include <cctype>

namespace limax::cuda {

namespace {

constexpr const char* driver_library = "libcuda.so.1";

// Newer than the oldest cuda.h that this is built with, of CUDA 12.0.
constexpr CUresult error_call_requires_newer_driver = CUresult(36), error_contained = CUresult(226);

// Errors with the same status and the same remedy, a clause without a capital and a full stop.
struct error_remedy {
    std::vector<int> results;
    limax_status status;
    const char* remedy;
    // Every later call fails too, memory on the GPU can no longer be read, and only a new process
    // gets a working context.
    bool loses_context = false;
};

constexpr const char* report =
    "this is a defect of limax: please report it with what 'compute-sanitizer limax run ...' "
    "prints";

const error_remedy remedies[] = {
    {{CUDA_ERROR_OUT_OF_MEMORY},
     LIMAX_OUT_OF_MEMORY,
     "simulate fewer robots at once, or end other programs that use the GPU's memory"},
    {{CUDA_ERROR_NO_DEVICE, CUDA_ERROR_INVALID_DEVICE},
     LIMAX_NO_DEVICE,
     "see which GPUs nvidia-smi lists and whether CUDA_VISIBLE_DEVICES hides them"},
    {{CUDA_ERROR_STUB_LIBRARY},
     LIMAX_NO_DEVICE,
     "the libcuda.so.1 found is the toolkit's stub, not a driver: remove its folder from "
     "LD_LIBRARY_PATH"},
    {{CUDA_ERROR_SYSTEM_DRIVER_MISMATCH},
     LIMAX_NO_DEVICE,
     "the driver's library and its kernel module differ in version, often after an update: reboot"},
    {{CUDA_ERROR_SYSTEM_NOT_READY},
     LIMAX_NO_DEVICE,
     "wait for the system's GPU services, such as nvidia-fabricmanager, or start them"},
    {{CUDA_ERROR_DEVICE_UNAVAILABLE},
     LIMAX_NO_DEVICE,
     "another program has exclusive use of the GPU: end it, or choose another GPU with "
     "CUDA_VISIBLE_DEVICES"},
    {{CUDA_ERROR_NOT_PERMITTED, CUDA_ERROR_OPERATING_SYSTEM},
     LIMAX_NO_DEVICE,
     "see whether this user, or this container, may open /dev/nvidia*"},
    {{CUDA_ERROR_NO_BINARY_FOR_GPU, CUDA_ERROR_INVALID_IMAGE, CUDA_ERROR_INVALID_PTX},
     LIMAX_NO_DEVICE,
     "the GPU needs compute capability 7.5 or newer, and a driver at least as new as the CUDA that "
     "the kernel was compiled with"},
    {{error_call_requires_newer_driver, CUDA_ERROR_UNSUPPORTED_PTX_VERSION,
      CUDA_ERROR_JIT_COMPILER_NOT_FOUND, CUDA_ERROR_COMPAT_NOT_SUPPORTED_ON_DEVICE},
     LIMAX_NO_DEVICE,
     "update the NVIDIA driver"},
    {{CUDA_ERROR_LAUNCH_TIMEOUT},
     LIMAX_NO_DEVICE,
     "a display is attached to this GPU and its watchdog ends long kernels: use a GPU without a "
     "display, or end the desktop",
     true},
    {{CUDA_ERROR_ECC_UNCORRECTABLE, CUDA_ERROR_NVLINK_UNCORRECTABLE, error_contained},
     LIMAX_NO_DEVICE,
     "the GPU's hardware failed: see 'nvidia-smi -q -d ECC', use another GPU, and resume the run",
     true},
    {{CUDA_ERROR_UNKNOWN},
     LIMAX_INTERNAL,
     "see the kernel's log (dmesg) for messages of the NVIDIA driver",
     true},
    {{CUDA_ERROR_ILLEGAL_ADDRESS, CUDA_ERROR_ASSERT, CUDA_ERROR_HARDWARE_STACK_ERROR,
      CUDA_ERROR_ILLEGAL_INSTRUCTION, CUDA_ERROR_MISALIGNED_ADDRESS,
      CUDA_ERROR_INVALID_ADDRESS_SPACE, CUDA_ERROR_INVALID_PC, CUDA_ERROR_LAUNCH_FAILED},
     LIMAX_INTERNAL,
     report,
     true},
    // last: every other error
    {{}, LIMAX_INTERNAL, report}};

const error_remedy& remedy_of(CUresult result) {
    return *std::find_if(std::begin(remedies), std::end(remedies) - 1, [&](const auto& row) {
        return std::count(row.results.begin(), row.results.end(), int(result)) > 0;
    });
}

// Functions whose versions differ in behaviour only: that of an older driver works too.
bool any_version_does(const std::string& function) {
    return function == "cuEventElapsedTime" || function == "cuDeviceGetUuid";
}

std::string version_text(int version) {
    return format("%d.%d", version / 1000, version % 1000 / 10);
}

std::string uuid_text(const CUuuid& uuid) {
    std::string text = "GPU-";
    for (int i = 0; i < 16; ++i) {
        if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
        text += format("%02x", unsigned(static_cast<unsigned char>(uuid.bytes[i])));
    }
    return text;
}

}  // namespace

const driver* driver::get(std::string* why) {
    struct attempt {
        std::string why;
        // never closed: owners that end after main() still call it
        const driver* found = open(driver_library, &why).release();
    };
    static const attempt once;
    if (!once.found && why) *why = once.why;
    return once.found;
}

std::unique_ptr<const driver> driver::open(const char* library, std::string* why) {
    std::unique_ptr<driver> made(new driver);
    const std::string problem = made->load(library);
    if (problem.empty()) return made;
    if (why) *why = problem;
    return nullptr;
}

std::string driver::load(const char* library) {
    std::string reason;
    library_ = shared_library(library, &reason);
    if (!library_) return "no NVIDIA driver: " + reason;
    // the version first: it explains why a function is missing
    if (!library_.find("cuDriverGetVersion", driver_get_version) ||
        driver_get_version(&version_) != CUDA_SUCCESS)
        return format("%s does not report its version: it is not an NVIDIA driver", library);
    if (version_ < oldest_driver)
        return format("the NVIDIA driver is for CUDA %s; CUDA %s or newer is needed: update it",
                      version_text(version_).c_str(), version_text(oldest_driver).c_str());
    if (const std::string missing = missing_function(); !missing.empty())
        return format("the NVIDIA driver for CUDA %s has no %s: update it",
                      version_text(version_).c_str(), missing.c_str());
    if (const CUresult result = init(0); result != CUDA_SUCCESS)
        return "the NVIDIA driver does not start: " + describe(result) + ": " +
               remedy_of(result).remedy;
    try {
        int count = 0;
        check(device_get_count(&count), "cuDeviceGetCount", "counting the GPUs");
        for (int ordinal = 0; ordinal < count; ++ordinal) {
            const gpu shown = describe_gpu(ordinal);
            (shown.capability < oldest_capability ? old_gpus_ : gpus_).push_back(shown);
        }
    } catch (const cuda_error& problem) {
        return problem.what();
    }
    if (!gpus_.empty()) return "";
    if (old_gpus_.empty())
        return std::string("the NVIDIA driver shows no GPU: ") +
               remedy_of(CUDA_ERROR_NO_DEVICE).remedy;
    const gpu& old = old_gpus_.front();
    return format("GPU %d (%s) has compute capability %d.%d; %d.%d or newer is needed", old.ordinal,
                  old.name.c_str(), old.capability / 10, old.capability % 10,
                  oldest_capability / 10, oldest_capability % 10);
}

std::string driver::missing_function() {
// cuda.h's macro gives the versioned name through the second level, the plain one through the first
#define LIMAX_CUDA_TEXT(function) #function
#define LIMAX_CUDA_VERSIONED(function) LIMAX_CUDA_TEXT(function)
#define LIMAX_CUDA_FIND(member, function)                                   \
    if (!library_.find(LIMAX_CUDA_VERSIONED(function), member) &&           \
        !(any_version_does(#function) && library_.find(#function, member))) \
    return LIMAX_CUDA_VERSIONED(function)
    LIMAX_CUDA_FUNCTIONS(LIMAX_CUDA_FIND);
#undef LIMAX_CUDA_FIND
#undef LIMAX_CUDA_VERSIONED
#undef LIMAX_CUDA_TEXT
    return "";
}

std::string driver::describe(CUresult result) const {
    const char *name = nullptr, *text = nullptr;
    if (get_error_name(result, &name) != CUDA_SUCCESS || !name)
        return format("error %d", int(result));
    if (get_error_string(result, &text) != CUDA_SUCCESS || !text) return name;
    return format("%s (%s)", name, text);
}

void driver::refuse(CUresult result, const char* call, const std::string& doing) const {
    std::string remedy = remedy_of(result).remedy;
    remedy[0] = char(std::toupper(static_cast<unsigned char>(remedy[0])));
    if (remedy_of(result).loses_context) remedy += ". Only a new process can use this GPU again";
    throw cuda_error(remedy_of(result).status,
                     format("CUDA: %s failed while %s: %s. %s", call, doing.c_str(),
                            describe(result).c_str(), remedy.c_str()),
                     result);
}

gpu driver::describe_gpu(int ordinal) const {
    const std::string doing = format("asking what GPU %d is", ordinal);
    CUdevice device = 0;
    check(device_get(&device, ordinal), "cuDeviceGet", doing);
    const auto attribute = [&](CUdevice_attribute which) {
        int value = 0;
        check(device_get_attribute(&value, which, device), "cuDeviceGetAttribute", doing);
        return value;
    };
    gpu g;
    g.ordinal = ordinal;
    char name[256] = "";
    check(device_get_name(name, int(sizeof name), device), "cuDeviceGetName", doing);
    g.name = name;
    CUuuid uuid{};
    check(device_get_uuid(&uuid, device), "cuDeviceGetUuid", doing);
    g.uuid = uuid_text(uuid);
    check(device_total_mem(&g.memory, device), "cuDeviceTotalMem", doing);
    g.capability = 10 * attribute(CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR) +
                   attribute(CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR);
    g.multiprocessors = attribute(CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT);
    g.second_level_cache = std::size_t(attribute(CU_DEVICE_ATTRIBUTE_L2_CACHE_SIZE));
    g.shared_memory_of_block =
        std::size_t(attribute(CU_DEVICE_ATTRIBUTE_MAX_SHARED_MEMORY_PER_BLOCK_OPTIN));
    return g;
}

}  // namespace limax::cuda
