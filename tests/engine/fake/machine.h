// machine.h: a machine with the fake driver, for one test, at whose end everything must be
// released.
#pragma once

#include <doctest/doctest.h>

#include <memory>
#include <string>

#include "backend/cuda/driver/memory.h"
#include "driver.h"

namespace limax::test {

// The fake driver, opened with the settings `start`; if that failed `api` is null and `why` has the
// reason.
struct fake_machine {
    explicit fake_machine(const fake_driver& start = {}) : library(LIMAX_FAKE_DRIVER) {
        fake_driver* (*find)() = nullptr;
        REQUIRE(library.find("limax_fake_driver", find));
        fake = find();
        *fake = start;
        api = cuda::driver::open(LIMAX_FAKE_DRIVER, &why);
    }
    fake_machine(const fake_machine&) = delete;
    // Everything was released, and no call was made without a context.
    ~fake_machine() {
        for (const int owned :
             {fake->contexts, fake->streams, fake->events, fake->modules, fake->host_blocks})
            CHECK(owned == 0);
        CHECK(fake->held == 0);
        CHECK(fake->calls_without_context == 0);
        CHECK(cuda::gpu_bytes_held() == 0);
        CUcontext current = nullptr;
        if (api) api->ctx_get_current(&current);
        CHECK(current == nullptr);
    }
    void fail_next(const char* function, CUresult result) const {
        fake->failing = function;
        fake->result = result;
    }

    cuda::shared_library library;
    fake_driver* fake = nullptr;
    std::unique_ptr<const cuda::driver> api;
    std::string why;
};

}  // namespace limax::test
