// kernel.h: kernels, each specialised by its defines: where their binaries come from (built with
// limax, the cache, or compiled now) and how they reach a GPU.
#pragma once

#include <map>
#include <mutex>

#include "backend/cuda/driver/cache.h"
#include "backend/cuda/driver/compiler.h"
#include "backend/cuda/driver/memory.h"

namespace limax::cuda {

// One specialisation of one file of kernels/. Values hold no white space.
struct kernel_set {
    std::string entry;                           // "step" for kernels/step.h
    std::map<std::string, std::string> defines;  // value of each name

    // The source to compile: a line "#define NAME VALUE" for each, then the include of the entry.
    std::string text() const;
    // "step LIMAX_EFFECTS=63 LIMAX_NX=5 ...", equal for equal sets only.
    std::string title() const;
    // The set of a title, whose defines may come in any order.
    static kernel_set of_title(const std::string& title);
    bool operator==(const kernel_set&) const = default;
};

enum class kernel_origin { ahead_of_time, cached, compiled };
// "ahead of time", "cached", "compiled"
const char* name_of(kernel_origin origin);

// Where binaries may come from.
struct allowed_origins {
    bool ahead_of_time = true, cached = true, compiled = true;
};
// From LIMAX_KERNELS, a list of "ahead-of-time", "cached" and "compiled" with commas between;
// everything where that is unset or empty. An unknown word is refused (LIMAX_INVALID_ARGUMENT).
allowed_origins origins_of_environment();

// A set for one architecture, not yet on any GPU.
struct kernel_binary {
    kernel_set set;            // what it was made from
    std::string architecture;  // "sm_90" for a binary, "compute_90" for PTX
    std::string bytes;
    kernel_origin origin;
    double seconds;   // that it took to come by
    std::string log;  // the compiler's warnings
};

// Texts and binaries that CMake embeds in limax (kernels.cmake generates the definitions): the laws
// and kernels, as texts that a kernel may include; the titles of the sets of ahead_of_time.txt,
// whether this build compiled them for a GPU or not; the compiled ones, each for one architecture.
struct embedded_binary {
    const char* set;           // its title
    const char* architecture;  // as in kernel_binary
    std::string_view bytes;
};
const std::vector<header>& kernel_headers();
const std::vector<const char*>& embedded_sets();
const std::vector<embedded_binary>& embedded_binaries();

// The sets of ahead_of_time.txt.
const std::vector<kernel_set>& ahead_of_time_sets();

// The binary of a set for a GPU of this compute capability (90 for 9.0): ahead of time, else
// cached, else compiled. Raises LIMAX_NO_DEVICE saying what is missing, or LIMAX_INTERNAL where the
// text does not compile.
std::shared_ptr<const kernel_binary> make_binary(const kernel_set& set, int capability,
                                                 const allowed_origins& allowed,
                                                 kernel_cache& cache);

// The same with the user's cache, once per process: later calls get what the first one got. Notes
// of the cache go to stderr. From any thread.
std::shared_ptr<const kernel_binary> binary_of(const kernel_set& set, int capability,
                                               const allowed_origins& allowed = {});

// Machine instructions of a function in a binary for compute capability 7.0 or newer, without
// padding at its end; 0 for PTX, and if the binary lacks the function.
std::size_t instruction_count(std::string_view binary, std::string_view function);

// The resources that a compiled function uses.
struct function_facts {
    int registers;             // of a thread
    int spilled;               // bytes of local memory of a thread
    int shared;                // bytes of static shared memory of a block
    std::size_t instructions;  // 0 where the driver made the binary from PTX
};

// How a kernel is spread out, in one dimension.
struct launch_shape {
    unsigned blocks, threads;
    std::size_t shared_bytes = 0;  // dynamic
    bool cooperative = false;      // all blocks at once, so that they can wait for each other
};

// A binary on one GPU.
class kernel_module {
public:
    kernel_module(const context& context, std::shared_ptr<const kernel_binary> binary);
    kernel_module(const kernel_module&) = delete;
    ~kernel_module();

    const kernel_binary& binary() const { return *binary_; }
    // A function by its (extern "C") name; one that is not there is a defect (LIMAX_INTERNAL).
    CUfunction function(const char* name) const;
    function_facts facts(const char* name) const;
    // Lets the function be launched with this much dynamic shared memory, bytes.
    void allow_shared_memory(const char* name, std::size_t bytes) const;
    // Blocks of this size that one multiprocessor holds at a time.
    int blocks_of_multiprocessor(const char* name, int threads, std::size_t shared_bytes) const;

private:
    const context& context_;
    const std::shared_ptr<const kernel_binary> binary_;
    CUmodule handle_ = nullptr;
};

// The modules of one GPU, each loaded once. They must not live longer than the context. From any
// thread.
class kernel_library {
public:
    explicit kernel_library(const context& context, const allowed_origins& allowed = {})
        : context_(context), allowed_(allowed) {}

    // As binary_of(). A binary that this driver refuses to load, since it was built with a newer
    // CUDA, is compiled again with what is here.
    std::shared_ptr<const kernel_module> load(const kernel_set& set);

private:
    const context& context_;
    const allowed_origins allowed_;
    std::mutex mutex_;
    std::map<std::string, std::shared_ptr<const kernel_module>> modules_;  // by text
};

// One GPU with the kernels that were loaded on it.
struct gpu_place {
    gpu_place(const driver& driver, int ordinal,
              const allowed_origins& allowed = origins_of_environment())
        : gpu(driver, ordinal), kernels(gpu, allowed) {}

    context gpu;
    kernel_library kernels;
};

// Launches a kernel with its arguments' addresses; nothing for 0 blocks. `doing` as in
// driver::check().
void launch_with(const context& context, CUfunction function, const launch_shape& shape,
                 const stream& stream, void** arguments, const std::string& doing);

// Launches a kernel whose parameters are exactly `arguments`.
template <class... Arguments>
void launch(const context& context, CUfunction function, const launch_shape& shape,
            const stream& stream, const std::string& doing, const Arguments&... arguments) {
    static_assert((std::is_trivially_copyable_v<Arguments> && ...));
    void* addresses[] = {const_cast<Arguments*>(&arguments)..., nullptr};
    launch_with(context, function, shape, stream, addresses, doing);
}

}  // namespace limax::cuda
