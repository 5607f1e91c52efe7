// kernel.cpp: sets, and where their binaries come from.
#include "backend/cuda/driver/kernel.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <sstream>

namespace limax::cuda {

namespace {

using clock = std::chrono::steady_clock;

// Compilations that take longer are announced, s.
constexpr double noticeable = 1;
using binary_pointer = std::shared_ptr<const kernel_binary>;

double seconds_since(clock::time_point start) {
    return std::chrono::duration<double>(clock::now() - start).count();
}

enum class image_form { machine_code, ptx };

// The number in "sm_90" or "compute_90".
int capability_of(std::string_view architecture) {
    return std::atoi(std::string(architecture.substr(architecture.find('_') + 1)).c_str());
}
image_form form_of(std::string_view architecture) {
    return architecture.rfind("sm_", 0) == 0 ? image_form::machine_code : image_form::ptx;
}
// Machine code runs on later GPUs of its major version, PTX on all later ones.
bool runs_on(std::string_view architecture, int capability) {
    const int made_for = capability_of(architecture);
    return made_for <= capability &&
           (form_of(architecture) == image_form::ptx || made_for / 10 == capability / 10);
}

// The embedded binary of this form that was made for the latest GPU up to this capability.
binary_pointer ahead_of_time(const kernel_set& set, int capability, image_form form) {
    const auto start = clock::now();
    const embedded_binary* best = nullptr;
    for (const embedded_binary& b : embedded_binaries())
        if (form_of(b.architecture) == form && runs_on(b.architecture, capability) &&
            (!best || capability_of(best->architecture) < capability_of(b.architecture)) &&
            kernel_set::of_title(b.set) == set)
            best = &b;
    if (!best) return nullptr;
    return std::make_shared<const kernel_binary>(
        kernel_binary{set, best->architecture, std::string(best->bytes),
                      kernel_origin::ahead_of_time, seconds_since(start), ""});
}

// Everything that a compiled kernel follows from.
hash128 cache_key(const std::string& text, const std::string& architecture, const compiler& nvrtc) {
    hash128 key;
    key.add("limax " LIMAX_VERSION).add(nvrtc.version()).add(architecture);
    for (const std::string& option : kernel_options()) key.add(option);
    for (const header& h : kernel_headers()) key.add(h.name).add(h.text);
    return key.add(text);
}

binary_pointer cached_or_compiled(const kernel_set& set, const std::string& architecture,
                                  const compiler& nvrtc, const allowed_origins& allowed,
                                  kernel_cache& cache) {
    const auto start = clock::now();
    kernel_binary made{set, architecture, "", kernel_origin::cached, 0, ""};
    const std::string text = set.text();
    const hash128 key = cache_key(text, architecture, nvrtc);
    std::optional<std::string> found;
    if (allowed.cached) found = cache.load(key);
    if (found) {
        made.bytes = std::move(*found);
    } else if (allowed.compiled) {
        made.origin = kernel_origin::compiled;
        try {
            made.bytes =
                nvrtc.compile(text, kernel_headers(), architecture, kernel_options(), &made.log);
        } catch (const error& problem) {
            fail(problem.status(), "kernel '" + set.title() + "': " + problem.what());
        }
        if (allowed.cached) cache.store(key, made.bytes);
    }
    if (made.bytes.empty()) return nullptr;
    made.seconds = seconds_since(start);
    return std::make_shared<const kernel_binary>(std::move(made));
}

}  // namespace

std::string kernel_set::text() const {
    std::string text;
    for (const auto& [name, value] : defines) text += "#define " + name + " " + value + "\n";
    return text + "#include \"backend/cuda/kernels/" + entry + ".h\"\n";
}

std::string kernel_set::title() const {
    std::string title = entry;
    for (const auto& [name, value] : defines) title += " " + name + "=" + value;
    return title;
}

kernel_set kernel_set::of_title(const std::string& title) {
    std::istringstream words(title);
    kernel_set set;
    words >> set.entry;
    for (std::string word; words >> word;) {
        const std::size_t equals = std::min(word.find('='), word.size());
        set.defines[word.substr(0, equals)] =
            equals < word.size() ? word.substr(equals + 1) : std::string();
    }
    return set;
}

const char* name_of(kernel_origin origin) {
    switch (origin) {
        case kernel_origin::ahead_of_time: return "ahead of time";
        case kernel_origin::cached: return "cached";
        case kernel_origin::compiled: return "compiled";
    }
    return "";
}

allowed_origins origins_of_environment() {
    const char* list = secure_getenv("LIMAX_KERNELS");
    if (!list || !*list) return {};
    allowed_origins allowed{false, false, false};
    std::istringstream words(list);
    for (std::string word; std::getline(words, word, ',');) {
        if (word == "ahead-of-time")
            allowed.ahead_of_time = true;
        else if (word == "cached")
            allowed.cached = true;
        else if (word == "compiled")
            allowed.compiled = true;
        else
            fail(LIMAX_INVALID_ARGUMENT,
                 format("LIMAX_KERNELS names '%s'; it is a list of ahead-of-time, cached and "
                        "compiled, with commas between",
                        word.c_str()));
    }
    return allowed;
}

const std::vector<kernel_set>& ahead_of_time_sets() {
    static const std::vector<kernel_set> sets = [] {
        std::vector<kernel_set> list;
        for (const char* title : embedded_sets()) list.push_back(kernel_set::of_title(title));
        return list;
    }();
    return sets;
}

binary_pointer make_binary(const kernel_set& set, int capability, const allowed_origins& allowed,
                           kernel_cache& cache) {
    if (allowed.ahead_of_time)
        if (auto binary = ahead_of_time(set, capability, image_form::machine_code)) return binary;
    std::string why, remedy = "Install NVRTC of the CUDA Toolkit 13 or 12";
    if (!allowed.compiled) remedy = "Let LIMAX_KERNELS name 'compiled' too";
    if (allowed.cached || allowed.compiled) {
        const compiler* nvrtc = compiler::get(&why);
        const std::string architecture = nvrtc ? nvrtc->architecture_for(capability) : "";
        if (nvrtc && architecture.empty())
            why = format("NVRTC %s does not compile for it", nvrtc->version().c_str());
        if (!architecture.empty()) {
            if (auto binary = cached_or_compiled(set, architecture, *nvrtc, allowed, cache))
                return binary;
            why = "it is not in the cache, and LIMAX_KERNELS forbids to compile it";
        }
    } else {
        why = "LIMAX_KERNELS forbids it";
    }
    if (allowed.ahead_of_time)
        if (auto binary = ahead_of_time(set, capability, image_form::ptx)) return binary;
    fail(
        LIMAX_NO_DEVICE,
        format("device 'cuda': no kernel for compute capability %d.%d: '%s' was not built with "
               "limax, and it cannot be compiled: %s. %s, or use device 'cpu'",
               capability / 10, capability % 10, set.title().c_str(), why.c_str(), remedy.c_str()));
}

binary_pointer binary_of(const kernel_set& set, int capability, const allowed_origins& allowed) {
    static std::mutex mutex;
    static std::map<std::string, binary_pointer> made;

    const std::string name =
        format("%d %d%d%d ", capability, allowed.ahead_of_time, allowed.cached, allowed.compiled) +
        set.title();
    const std::lock_guard lock(mutex);
    binary_pointer& binary = made[name];
    if (binary) return binary;
    kernel_cache& cache = kernel_cache::users();
    binary = make_binary(set, capability, allowed, cache);
    if (binary->origin == kernel_origin::compiled && binary->seconds >= noticeable)
        std::fprintf(stderr, "limax: compiled the kernel '%s' in %.1f s%s\n", set.entry.c_str(),
                     binary->seconds, allowed.cached ? "; later runs take it from the cache" : "");
    for (const std::string& text : cache.take_notes())
        std::fprintf(stderr, "limax: %s\n", text.c_str());
    return binary;
}

}  // namespace limax::cuda
