// abi.h: helpers for tests of the C ABI: handles that free themselves, and checks of a status.
#pragma once

#include <doctest/doctest.h>

#include <memory>
#include <string>

#include "limax.h"

namespace limax::test::abi {

struct free_handle {
    void operator()(limax_device* it) const { limax_device_free(it); }
    void operator()(limax_materials* it) const { limax_materials_free(it); }
    void operator()(limax_encoding* it) const { limax_encoding_free(it); }
    void operator()(limax_population* it) const { limax_population_free(it); }
    void operator()(limax_scene* it) const { limax_scene_free(it); }
    void operator()(limax_simulation* it) const { limax_simulation_free(it); }
};
template <class T>
using handle = std::unique_ptr<T, free_handle>;

inline void require_done(limax_status status) {
    if (status != LIMAX_OK) FAIL(limax_error_text());
}
// The handle that `create` writes to its last argument.
template <class T, class... Declared, class... Passed>
handle<T> made(limax_status (*create)(Declared...), Passed... arguments) {
    T* it = nullptr;
    require_done(create(arguments..., &it));
    return handle<T>(it);
}

// Checks a status and that the error text contains `part`.
inline void check_refused(limax_status status, limax_status expected, const char* part) {
    CHECK(status == expected);
    const std::string text = limax_error_text();
    CAPTURE(text);
    CHECK(text.find(part) != std::string::npos);
}

inline handle<limax_materials> paper_table() {
    return made<limax_materials>(limax_materials_load, LIMAX_SOURCE_DIR "/materials/paper.json");
}

}  // namespace limax::test::abi
