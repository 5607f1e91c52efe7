// library.h: a shared library that is loaded at run time, so that one binary runs with and
// without it. Includes std and dlfcn.h only.
#pragma once

#include <dlfcn.h>

#include <string>
#include <utility>

namespace limax::cuda {

class shared_library {
public:
    shared_library() = default;
    // Opens a library by its name or path. An object that holds none has the loader's reason in
    // `why`, which may be null.
    explicit shared_library(const char* name, std::string* why = nullptr)
        : handle_(dlopen(name, RTLD_NOW | RTLD_LOCAL)) {
        if (handle_ || !why) return;
        // NOLINTNEXTLINE(concurrency-mt-unsafe): glibc keeps the message per thread
        const char* reason = dlerror();
        *why = reason ? reason : std::string(name) + " cannot be opened";
    }
    shared_library(shared_library&& other) noexcept
        : handle_(std::exchange(other.handle_, nullptr)) {}
    shared_library& operator=(shared_library&& other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    ~shared_library() {
        if (handle_) dlclose(handle_);
    }

    explicit operator bool() const { return handle_ != nullptr; }

    // Sets `function` to what the library calls `symbol`, or to null; false where it has none.
    template <class Function>
    bool find(const char* symbol, Function*& function) const {
        function = reinterpret_cast<Function*>(dlsym(handle_, symbol));
        return function != nullptr;
    }

private:
    void* handle_ = nullptr;
};

}  // namespace limax::cuda
