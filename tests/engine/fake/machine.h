// machine.h: a machine with the fake driver, for one test.
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
    void fail_next(const char* function, CUresult result) const {
        fake->failing = function;
        fake->result = result;
    }
    // Everything was released, and no call was made without a context.
    void check_given_back() const {
        CHECK(fake->contexts == 0);
        CHECK(fake->streams == 0);
        CHECK(fake->events == 0);
        CHECK(fake->modules == 0);
        CHECK(fake->host_blocks == 0);
        CHECK(fake->held == 0);
        CHECK(fake->calls_without_context == 0);
        CHECK(cuda::gpu_bytes_held() == 0);
        CUcontext current = nullptr;
        api->ctx_get_current(&current);
        CHECK(current == nullptr);
    }

    cuda::shared_library library;
    fake_driver* fake = nullptr;
    std::unique_ptr<const cuda::driver> api;
    std::string why;
};

}  // namespace limax::test
