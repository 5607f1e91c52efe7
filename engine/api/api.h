// api.h: what the bodies of limax.h share: the handles, and the guard at which exceptions end as a
// status and a text.
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <shared_mutex>
#include <string>
#include <string_view>

#include "backend/backend.h"
#include "base/error.h"
#include "body/material.h"
#include "genome/population.h"
#include "limax.h"
#include "physics/overlap.h"

// Handles share what they point to with their children, so that any order of freeing is safe. What
// changes has `users`: the calls that are at work on it, of which only reading ones may be several.
struct limax_device {
    std::shared_ptr<limax::device> it;
};
struct limax_materials {
    limax::material_table it;
    mutable std::shared_mutex users = {};
};
struct limax_encoding {
    std::shared_ptr<const limax::encoding> it;
};
struct limax_population {
    limax::population it;
    mutable std::shared_mutex users = {};
};
struct limax_scene {
    limax::scene it = {};
    mutable std::shared_mutex users = {};
};
struct limax_simulation {
    std::shared_ptr<limax::device> device;
    std::unique_ptr<limax::simulation> it;
    int32_t count;
    limax_simulation_options options;
    limax::overlap overlap = {};
    mutable std::shared_mutex users = {};
};

namespace limax::api {

// Keeps the text of a failure for limax_error_text of this thread; returns its status.
limax_status remember(limax_status status, const char* text) noexcept;

// Runs one body of limax.h: what it throws becomes its status and this thread's text.
template <class Body>
limax_status guard(const Body& body) noexcept {
    try {
        body();
        return LIMAX_OK;
    } catch (const limax::error& failure) {
        return remember(failure.status(), failure.what());
    } catch (const std::bad_alloc&) {
        return remember(LIMAX_OUT_OF_MEMORY, "out of memory");
    } catch (const std::exception& failure) {
        return remember(LIMAX_INTERNAL, failure.what());
    } catch (...) {
        return remember(LIMAX_INTERNAL, "an exception of unknown type");
    }
}

// Refuses null pointers. `names` lists their names, separated by a comma and a space.
template <class... Pointers>
void require(std::string_view names, const Pointers*... pointers) {
    for (const void* pointer : {static_cast<const void*>(pointers)...}) {
        const std::string name(names.substr(0, names.find(',')));
        if (!pointer) fail(LIMAX_INVALID_ARGUMENT, format("%s is null", name.c_str()));
        names.remove_prefix(std::min(names.size(), name.size() + 2));
    }
}

// Holds a handle for a call that reads it; refuses one that another thread is changing.
template <class Handle>
[[nodiscard]] std::shared_lock<std::shared_mutex> reading(const Handle* handle, const char* name) {
    require(name, handle);
    std::shared_lock use(handle->users, std::try_to_lock);
    if (!use)
        fail(LIMAX_INVALID_ARGUMENT, format("%s: another thread is changing this handle", name));
    return use;
}
// Holds a handle for a call that changes it; refuses one that another thread is using.
template <class Handle>
[[nodiscard]] std::unique_lock<std::shared_mutex> changing(const Handle* handle, const char* name) {
    require(name, handle);
    std::unique_lock use(handle->users, std::try_to_lock);
    if (!use) fail(LIMAX_INVALID_ARGUMENT, format("%s: another thread is using this handle", name));
    return use;
}

// Guarded bodies that read or change what a handle holds.
template <class Handle, class Body>
limax_status read(const Handle* handle, const char* name, const Body& body) noexcept {
    return guard([&] {
        const auto use = reading(handle, name);
        body();
    });
}
template <class Handle, class Body>
limax_status change(const Handle* handle, const char* name, const Body& body) noexcept {
    return guard([&] {
        const auto use = changing(handle, name);
        body();
    });
}

// For what returns no status: what `get` gives for a handle, or `otherwise` and a text.
template <class T, class Handle, class Get>
T value_or(T otherwise, const Handle* handle, const char* name, const Get& get) noexcept {
    guard([&] {
        require(name, handle);
        otherwise = get();
    });
    return otherwise;
}

// Everything that a simulation needs, checked; null `mask` is all robots.
simulation_setup make_setup(const population& population, const material_table& materials,
                            const scene& scene, const limax_simulation_options& options,
                            const uint8_t* mask, const device& device);

// Whether the population's genomes and bodies are where the device keeps its own.
inline bool is_stored_on(const limax::population& population, const limax::device& device) {
    return population.on_device() && device.stores(*population.on_device());
}

}  // namespace limax::api
