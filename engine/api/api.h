// api.h: what the bodies of limax.h share: the handles, and the guard at which exceptions end as a
// status and a text.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <shared_mutex>

#include "backend/backend.h"
#include "base/error.h"
#include "body/material.h"
#include "genome/population.h"
#include "limax.h"

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

// For what returns no status: what `get` gives, or `otherwise` and a text.
template <class T, class Get>
T value_or(T otherwise, const Get& get) noexcept {
    guard([&] { otherwise = get(); });
    return otherwise;
}

inline void require(const void* pointer, const char* name) {
    if (!pointer) fail(LIMAX_INVALID_ARGUMENT, format("%s is null", name));
}

// Holds a handle for a call that reads it; refuses one that another thread is changing.
template <class Handle>
[[nodiscard]] std::shared_lock<std::shared_mutex> reading(const Handle* handle, const char* name) {
    require(handle, name);
    std::shared_lock use(handle->users, std::try_to_lock);
    if (!use)
        fail(LIMAX_INVALID_ARGUMENT, format("%s: another thread is changing this handle", name));
    return use;
}
// Holds a handle for a call that changes it; refuses one that another thread is using.
template <class Handle>
[[nodiscard]] std::unique_lock<std::shared_mutex> changing(const Handle* handle, const char* name) {
    require(handle, name);
    std::unique_lock use(handle->users, std::try_to_lock);
    if (!use) fail(LIMAX_INVALID_ARGUMENT, format("%s: another thread is using this handle", name));
    return use;
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
