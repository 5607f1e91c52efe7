// module.cpp: binaries on a GPU, and launches.
#include "backend/cuda/driver/kernel.h"

namespace limax::cuda {

namespace {

// Whether another compilation of the same kernel may load where this one did not.
bool refused_as_too_new(CUresult result) {
    return result == CUDA_ERROR_INVALID_IMAGE || result == CUDA_ERROR_NO_BINARY_FOR_GPU ||
           result == CUDA_ERROR_INVALID_PTX || result == CUDA_ERROR_UNSUPPORTED_PTX_VERSION ||
           result == CUDA_ERROR_JIT_COMPILER_NOT_FOUND ||
           result == CUDA_ERROR_JIT_COMPILATION_DISABLED;
}

// A launch's configuration with room for its attributes.
struct launch_config {
    CUlaunchConfig config{};
    CUlaunchAttribute attributes[1]{};

    launch_config(const launch_shape& shape, CUstream stream) {
        config.gridDimX = shape.blocks;
        config.gridDimY = config.gridDimZ = 1;
        config.blockDimX = shape.threads;
        config.blockDimY = config.blockDimZ = 1;
        config.sharedMemBytes = unsigned(shape.shared_bytes);
        config.hStream = stream;
        config.attrs = attributes;
        if (shape.cooperative) {
            CUlaunchAttribute& together = attributes[config.numAttrs++];
            together.id = CU_LAUNCH_ATTRIBUTE_COOPERATIVE;
            together.value.cooperative = 1;
        }
    }
    launch_config(const launch_config&) = delete;
};

}  // namespace

kernel_module::kernel_module(const context& context, std::shared_ptr<const kernel_binary> binary)
    : context_(context), binary_(std::move(binary)) {
    const auto here = context_.current();
    const driver& api = context_.api();
    // PTX is compiled by the driver, which logs its errors here
    char log[4096] = "";
    CUjit_option options[] = {CU_JIT_ERROR_LOG_BUFFER, CU_JIT_ERROR_LOG_BUFFER_SIZE_BYTES};
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the driver takes numbers in the place of pointers
    void* values[] = {log, reinterpret_cast<void*>(sizeof log)};
    const CUresult result =
        api.module_load_data_ex(&handle_, binary_->bytes.c_str(), 2, options, values);
    log[sizeof log - 1] = '\0';
    if (result == CUDA_SUCCESS) return;
    api.refuse(
        result, "cuModuleLoadDataEx",
        format("loading kernel '%s' (%s, %s)%s%s", binary_->set.title().c_str(),
               binary_->architecture.c_str(), name_of(binary_->origin), *log ? ": " : "", log));
}

kernel_module::~kernel_module() {
    try {
        const auto here = context_.current();
        (void)context_.api().module_unload(handle_);
    } catch (const cuda_error&) {
        // the context is lost, and the module with it
    }
}

CUfunction kernel_module::function(const char* name) const {
    const auto here = context_.current();
    const driver& api = context_.api();
    CUfunction function = nullptr;
    api.check(api.module_get_function(&function, handle_, name), "cuModuleGetFunction",
              format("looking for %s in kernel '%s'", name, binary_->set.title().c_str()));
    return function;
}

function_facts kernel_module::facts(const char* name) const {
    const CUfunction function = this->function(name);
    const auto here = context_.current();
    const driver& api = context_.api();
    const auto attribute = [&](CUfunction_attribute which) {
        int value = 0;
        api.check(api.func_get_attribute(&value, which, function), "cuFuncGetAttribute",
                  format("asking what %s needs", name));
        return value;
    };
    function_facts facts;
    facts.registers = attribute(CU_FUNC_ATTRIBUTE_NUM_REGS);
    facts.spilled = attribute(CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES);
    facts.shared = attribute(CU_FUNC_ATTRIBUTE_SHARED_SIZE_BYTES);
    facts.instructions = instruction_count(binary_->bytes, name);
    return facts;
}

void kernel_module::allow_shared_memory(const char* name, std::size_t bytes) const {
    const CUfunction function = this->function(name);
    const auto here = context_.current();
    const driver& api = context_.api();
    api.check(api.func_set_attribute(function, CU_FUNC_ATTRIBUTE_MAX_DYNAMIC_SHARED_SIZE_BYTES,
                                     int(bytes)),
              "cuFuncSetAttribute",
              format("asking for %zu bytes of shared memory for %s", bytes, name));
}

int kernel_module::blocks_of_multiprocessor(const char* name, int threads,
                                            std::size_t shared_bytes) const {
    const CUfunction function = this->function(name);
    const auto here = context_.current();
    const driver& api = context_.api();
    int blocks = 0;
    api.check(api.occupancy_max_active_blocks(&blocks, function, threads, shared_bytes),
              "cuOccupancyMaxActiveBlocksPerMultiprocessor",
              format("asking how many blocks of %s fit", name));
    return blocks;
}

std::shared_ptr<const kernel_module> kernel_library::load(const kernel_set& set) {
    const std::lock_guard lock(mutex_);
    auto& module = modules_[set.title()];
    if (module) return module;
    const auto made = [&](const allowed_origins& allowed) {
        return std::make_shared<const kernel_module>(
            context_, binary_of(set, context_.device().capability, allowed));
    };
    try {
        module = made(allowed_);
    } catch (const cuda_error& problem) {
        const bool other_way = allowed_.ahead_of_time && (allowed_.cached || allowed_.compiled);
        if (!other_way || !refused_as_too_new(problem.result()) || !compiler::get(nullptr)) throw;
        module = made({false, allowed_.cached, allowed_.compiled});
    }
    return module;
}

void launch_with(const context& context, CUfunction function, const launch_shape& shape,
                 const stream& stream, void** arguments, const std::string& doing) {
    if (shape.blocks == 0) return;
    const auto here = context.current();
    const driver& api = context.api();
    const launch_config launch(shape, stream.handle());
    api.check(api.launch_kernel_ex(&launch.config, function, arguments, nullptr),
              "cuLaunchKernelEx", doing);
}

}  // namespace limax::cuda
