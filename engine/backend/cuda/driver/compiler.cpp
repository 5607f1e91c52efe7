// compiler.cpp: NVRTC by dlopen: 13, then 12, by name, then in the folders where a toolkit has it.
// CMake defines LIMAX_KERNEL_OPTIONS and LIMAX_NVRTC_FOLDER (of the toolkit that limax was built
// with).
#include "backend/cuda/driver/compiler.h"

#include <nvrtc.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "backend/cuda/driver/driver.h"
#include "backend/cuda/driver/library.h"
#include "base/error.h"

namespace limax::cuda {

// f(member, function of nvrtc.h)
#define LIMAX_NVRTC_FUNCTIONS(f)                           \
    f(get_error_string, nvrtcGetErrorString);              \
    f(version, nvrtcVersion);                              \
    f(get_num_supported_archs, nvrtcGetNumSupportedArchs); \
    f(get_supported_archs, nvrtcGetSupportedArchs);        \
    f(create_program, nvrtcCreateProgram);                 \
    f(destroy_program, nvrtcDestroyProgram);               \
    f(compile_program, nvrtcCompileProgram);               \
    f(get_ptx_size, nvrtcGetPTXSize);                      \
    f(get_ptx, nvrtcGetPTX);                               \
    f(get_cubin_size, nvrtcGetCUBINSize);                  \
    f(get_cubin, nvrtcGetCUBIN);                           \
    f(get_program_log_size, nvrtcGetProgramLogSize);       \
    f(get_program_log, nvrtcGetProgramLog)

struct compiler::functions {
    shared_library library;
#define LIMAX_NVRTC_MEMBER(member, function) decltype(&function) member = nullptr
    LIMAX_NVRTC_FUNCTIONS(LIMAX_NVRTC_MEMBER);
#undef LIMAX_NVRTC_MEMBER

    // The first function that the library lacks; null if it has all.
    const char* missing() {
#define LIMAX_NVRTC_FIND(member, function) \
    if (!library.find(#function, member)) return #function
        LIMAX_NVRTC_FUNCTIONS(LIMAX_NVRTC_FIND);
#undef LIMAX_NVRTC_FIND
        return nullptr;
    }
    void check(nvrtcResult result, const char* call) const {
        if (result != NVRTC_SUCCESS)
            fail(LIMAX_INTERNAL, format("NVRTC: %s failed while compiling a kernel: %s", call,
                                        get_error_string(result)));
    }
    // The log of a compilation; empty if NVRTC has none.
    std::string log_of(nvrtcProgram program) const {
        std::size_t size = 0;  // counts the ending zero
        if (get_program_log_size(program, &size) != NVRTC_SUCCESS || size == 0) return "";
        std::string text(size, '\0');
        if (get_program_log(program, text.data()) != NVRTC_SUCCESS) return "";
        text.resize(size - 1);
        return text;
    }
};

namespace {

// Where to look, best first. A kernel from a newer CUDA than the driver's does not load.
std::vector<std::string> places() {
    std::vector<int> majors = {13, 12};
    const driver* driver = driver::get(nullptr);
    if (driver && driver->version() / 1000 < 13) std::swap(majors[0], majors[1]);
    std::vector<std::string> paths;
    for (const int major : majors)
        for (const std::string folder : {"", LIMAX_NVRTC_FOLDER "/", "/usr/local/cuda/lib64/"})
            paths.push_back(folder + format("libnvrtc.so.%d", major));
    return paths;
}

}  // namespace

const std::vector<std::string>& kernel_options() {
    static const std::vector<std::string> options = [] {
        std::istringstream words(LIMAX_KERNEL_OPTIONS);
        std::vector<std::string> list;
        for (std::string word; words >> word;) list.push_back(word);
        return list;
    }();
    return options;
}

compiler::compiler() : nvrtc_(std::make_unique<functions>()) {}
compiler::~compiler() = default;

const compiler* compiler::get(std::string* why) {
    struct attempt {
        std::string why;
        const compiler* found = nullptr;
        attempt() {
            for (const std::string& path : places()) {
                // not worth a reason: the folder does not have it
                if (path.front() == '/' && access(path.c_str(), F_OK) != 0) continue;
                std::string reason;
                found = open(path.c_str(), &reason).release();
                if (found) return;
                // one reason for each name
                const std::string name = path.substr(path.rfind('/') + 1);
                if (why.find(name) == std::string::npos) why += (why.empty() ? "" : "; ") + reason;
            }
        }
    };
    static const attempt once;
    if (!once.found && why) *why = "no NVRTC: " + once.why;
    return once.found;
}

std::unique_ptr<const compiler> compiler::open(const char* name, std::string* why) {
    std::unique_ptr<compiler> made(new compiler);
    functions& nvrtc = *made->nvrtc_;
    nvrtc.library = shared_library(name, why);
    if (!nvrtc.library) return nullptr;
    if (const char* missing = nvrtc.missing()) {
        *why = format("%s has no %s", name, missing);
        return nullptr;
    }
    try {
        int major = 0, minor = 0, count = 0;
        nvrtc.check(nvrtc.version(&major, &minor), "nvrtcVersion");
        made->version_ = format("%d.%d", major, minor);
        nvrtc.check(nvrtc.get_num_supported_archs(&count), "nvrtcGetNumSupportedArchs");
        made->capabilities_.resize(std::size_t(count));
        nvrtc.check(nvrtc.get_supported_archs(made->capabilities_.data()),
                    "nvrtcGetSupportedArchs");
        std::sort(made->capabilities_.begin(), made->capabilities_.end());
        if (count == 0) fail(LIMAX_INTERNAL, "it compiles for no GPU");
        // NVRTC loads its builtins library when it compiles, which may be missing
        made->compile("extern \"C\" __global__ void trial() {}", {},
                      format("sm_%d", made->capabilities_.front()), {}, nullptr);
    } catch (const error& problem) {
        std::string text = problem.what();
        std::replace(text.begin(), text.end(), '\n', ' ');
        *why = format("%s does not work: %s", name, text.c_str());
        return nullptr;
    }
    return made;
}

std::string compiler::architecture_for(int capability) const {
    int best = 0;
    for (const int c : capabilities_)
        if (c <= capability) best = c;
    if (best == 0) return "";
    return format(best / 10 == capability / 10 ? "sm_%d" : "compute_%d", best);
}

std::string compiler::compile(const std::string& text, const std::vector<header>& headers,
                              const std::string& architecture,
                              const std::vector<std::string>& options, std::string* log) const {
    const functions& nvrtc = *nvrtc_;
    std::vector<const char*> names, texts, flags;
    for (const header& h : headers) {
        names.push_back(h.name);
        texts.push_back(h.text);
    }
    const std::string target = "--gpu-architecture=" + architecture;
    flags.push_back(target.c_str());
    // otherwise NVRTC takes unmarked functions, even lambdas in device code, for host code
    flags.push_back("--device-as-default-execution-space");
    for (const std::string& option : options) flags.push_back(option.c_str());

    struct program {
        const functions& nvrtc;
        nvrtcProgram handle = nullptr;
        ~program() {
            if (handle) (void)nvrtc.destroy_program(&handle);
        }
    } program{nvrtc};
    nvrtc.check(nvrtc.create_program(&program.handle, text.c_str(), "kernel.cu", int(names.size()),
                                     texts.data(), names.data()),
                "nvrtcCreateProgram");
    const nvrtcResult result =
        nvrtc.compile_program(program.handle, int(flags.size()), flags.data());
    const std::string output = nvrtc.log_of(program.handle);
    if (result != NVRTC_SUCCESS)
        fail(LIMAX_INTERNAL,
             format("a kernel does not compile for %s with NVRTC %s: %s%s%s", architecture.c_str(),
                    version_.c_str(), nvrtc.get_error_string(result), output.empty() ? "" : "\n",
                    output.c_str()));
    if (log) *log = output;

    if (architecture.rfind("compute_", 0) == 0) {
        std::size_t size = 0;
        nvrtc.check(nvrtc.get_ptx_size(program.handle, &size), "nvrtcGetPTXSize");
        std::string ptx(size, '\0');
        nvrtc.check(nvrtc.get_ptx(program.handle, ptx.data()), "nvrtcGetPTX");
        ptx.pop_back();  // its size counts the ending zero
        return ptx;
    }
    std::size_t size = 0;
    nvrtc.check(nvrtc.get_cubin_size(program.handle, &size), "nvrtcGetCUBINSize");
    std::string bytes(size, '\0');
    nvrtc.check(nvrtc.get_cubin(program.handle, bytes.data()), "nvrtcGetCUBIN");
    return bytes;
}

}  // namespace limax::cuda
