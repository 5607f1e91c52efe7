// device.cpp: status, interruption, devices and random numbers of limax.h.
#include <cmath>
#include <string>

#include "api/api.h"
#include "base/random.h"

namespace {

using namespace limax::api;

thread_local std::string last_error;

limax::random_key key_of(const limax_random_key& key) {
    return {key.seed, key.repetition, key.stream, key.generation, key.individual};
}

}  // namespace

limax_status limax::api::remember(limax_status status, const char* text) noexcept {
    try {
        last_error = text;
    } catch (...) {
        last_error.clear();  // no memory even for the text
    }
    return status;
}

extern "C" {

// ---- status, version, interruption ----

uint32_t limax_abi_version(void) { return LIMAX_ABI; }
const char* limax_version(void) { return LIMAX_VERSION; }
const char* limax_error_text(void) { return last_error.c_str(); }
uint64_t limax_bytes_held(void) { return limax::all_bytes_held(); }
void limax_interrupt(void) { limax::set_interrupted(true); }
void limax_interrupt_clear(void) { limax::set_interrupted(false); }
int32_t limax_interrupted(void) { return limax::interrupted(); }

// ---- device ----

limax_status limax_device_create(const char* name, int32_t threads, const char* isa,
                                 limax_device** out) {
    return guard([&] {
        require("name, out", name, out);
        *out = new limax_device{limax::make_device(name, threads, isa)};
    });
}
void limax_device_free(limax_device* device) { delete device; }
const char* limax_device_describe(const limax_device* device) {
    return value_or("{}", device, "device", [&] { return device->it->describe(); });
}

// ---- random numbers ----

double limax_random_uniform(const limax_random_key* key, uint32_t draw) {
    return value_or(std::nan(""), key, "key",
                    [&] { return limax::random_uniform(key_of(*key), draw); });
}
double limax_random_normal(const limax_random_key* key, uint32_t draw) {
    return value_or(std::nan(""), key, "key",
                    [&] { return limax::random_normal(key_of(*key), draw); });
}
uint32_t limax_random_integer(const limax_random_key* key, uint32_t draw, uint32_t n) {
    return value_or(0u, key, "key", [&] { return limax::random_integer(key_of(*key), draw, n); });
}

}  // extern "C"
