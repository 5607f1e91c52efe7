// cuda_driver_test.cpp: the messages without a usable driver, and, with a fake one
// (fake/driver.cpp), that every owner frees what it allocated and every refusal has a message.
#include <doctest/doctest.h>

#include <memory>
#include <thread>
#include <tuple>

#include "backend/cuda/driver/memory.h"
#include "environment.h"
#include "failure.h"
#include "fake/machine.h"

using namespace limax::cuda;
using limax::test::contains;
using limax::test::failure;
using limax::test::fake_machine;

namespace {

limax::test::fake_driver started_with(const char* failing, CUresult result) {
    limax::test::fake_driver fake;
    fake.failing = failing;
    fake.result = result;
    return fake;
}

}  // namespace

TEST_CASE("a library that is not a driver is refused with the reason") {
    std::string why;
    CHECK_FALSE(driver::open("liblimax-has-no-such-library.so.1", &why));
    CHECK(contains(why, "no NVIDIA driver: liblimax-has-no-such-library.so.1: "));
    CHECK_FALSE(driver::open("libm.so.6", &why));
    CHECK(why == "libm.so.6 does not report its version: it is not an NVIDIA driver");
}

TEST_CASE("the error of an unusable driver names the remedy") {
    limax::test::fake_driver old, empty;
    old.version = 11080;
    empty.gpus = 0;
    const std::pair<limax::test::fake_driver, const char*> unusable[] = {
        {old, "the NVIDIA driver is for CUDA 11.8; CUDA 12.1 or newer is needed: update it"},
        {empty, "the NVIDIA driver shows no GPU: see which GPUs"},
        {started_with("cuInit", CUDA_ERROR_SYSTEM_DRIVER_MISMATCH),
         "the NVIDIA driver does not start: CUDA_ERROR_803 (as set in the fake driver): the "
         "driver's library and its kernel module differ"},
        {started_with("cuInit", CUDA_ERROR_NO_DEVICE), "CUDA_VISIBLE_DEVICES"},
        {started_with("cuDeviceGetAttribute", CUDA_ERROR_UNKNOWN),
         "cuDeviceGetAttribute failed while asking what GPU 0 is"}};
    for (const auto& [start, message] : unusable) {
        const fake_machine machine(start);
        CAPTURE(machine.why);
        CHECK_FALSE(machine.api);
        CHECK(contains(machine.why, message));
    }
}

TEST_CASE("GPUs that are too old are left out") {
    limax::test::fake_driver old;
    old.capability = 61;
    const fake_machine pascal(old);
    CHECK_FALSE(pascal.api);  // so that `auto` takes the CPU
    CHECK(pascal.why == "GPU 0 (Fake GPU) has compute capability 6.1; 7.5 or newer is needed");

    limax::test::fake_driver mixed;
    mixed.gpus = 3;
    mixed.capability_of_last = 61;
    const fake_machine machine(mixed);
    REQUIRE(machine.api);
    REQUIRE(machine.api->gpus().size() == 2);
    CHECK(machine.api->gpus()[1].ordinal == 1);
    REQUIRE(machine.api->old_gpus().size() == 1);
    CHECK(machine.api->old_gpus()[0].ordinal == 2);
    CHECK(failure(LIMAX_NO_DEVICE, [&] { context(*machine.api, 2); }) ==
          "device 'cuda': GPU 2 was asked for; it is none of the 2 that can be used");
}

TEST_CASE("memory is copied to the GPU and back, counted and freed") {
    const fake_machine machine;
    const context gpu(*machine.api, 0);
    const stream queue(gpu);
    pinned<double> host(gpu, 100, "some numbers");
    for (std::size_t i = 0; i < 100; ++i) host[i] = double(i);
    device_memory<double> a(gpu, 100, "some numbers"), b(gpu, 100, "the same");
    CHECK(gpu.bytes_held() == 1600);
    CHECK(gpu_bytes_held() == 1600);
    CHECK(gpu.free_memory() == 1000000 - 1600);
    a.upload(host.data(), 100, queue);
    b.clear(queue);
    b.copy(a, 10, queue, 50, 20);  // elements 20 to 29 as 50 to 59
    double back[30];
    b.download(back, 30, queue, 40);
    queue.synchronize("testing");
    for (int i = 0; i < 30; ++i) CHECK(back[i] == (i >= 10 && i < 20 ? i + 10 : 0));
    device_memory<double> moved = std::move(a);
    CHECK(moved.size() == 100);
    a = device_memory<double>(gpu, 3, "a few more");
    CHECK(a.size() == 3);
    CHECK(gpu.bytes_held() == 1624);
    CHECK_NOTHROW(device_memory<float>(gpu, 0, "nothing").clear(queue));
    CHECK(contains(failure(LIMAX_INTERNAL, [&] { moved.upload(host.data(), 51, queue, 50); }),
                   "a copy of 408 bytes at 400 leaves a block of 800"));
}

TEST_CASE("memory that ends is used again, and freed when something else needs it") {
    const fake_machine machine;
    const context gpu(*machine.api, 0);
    auto first = std::make_unique<device_memory<double>>(gpu, 100, "some numbers");
    const device_memory<double> other(gpu, 200, "others");
    const double* const at = first->data();
    first.reset();
    CHECK(gpu.bytes_held() == 1600);
    CHECK(machine.fake->held == 2400);
    device_memory<double> again(gpu, 95, "fewer");
    CHECK(again.data() == at);
    CHECK(machine.fake->held == 2400);
    // what does not fit beside it is made of it
    again = device_memory<double>();
    const device_memory<char> rest(gpu, 1000000 - 2000, "the rest");
    CHECK(machine.fake->held == 1000000 - 2000 + 1600);
}

TEST_CASE("memory is kept for what is made next, up to what was held lately") {
    const fake_machine machine(limax::test::fake_driver{.memory = 1000000000});
    const context gpu(*machine.api, 0);
    constexpr std::size_t large = 300000000, half = 140000000;
    device_memory<char>(gpu, large, "some");
    CHECK(machine.fake->held == large + large / 16);
    // the large block is too large for a half, and there is no room beside it
    { const device_memory<char> one(gpu, half, "some"), other(gpu, half, "some"); }
    CHECK(machine.fake->held == 2 * (half + half / 16));
    // after two periods of little nothing needs so much anymore
    for (int k = 0; k < 2048; ++k) device_memory<char>(gpu, 8, "little");
    device_memory<char>(gpu, 1000, "some");
    CHECK(machine.fake->held == 8 + 1000);
}

TEST_CASE("another thread may make memory, and events measure time") {
    const fake_machine machine;
    const context gpu(*machine.api, 0);
    device_memory<int> memory;
    std::thread([&] { memory = device_memory<int>(gpu, 10, "numbers"); }).join();
    CHECK(gpu.bytes_held() == 40);
    event start(gpu), end(gpu);
    const stream queue(gpu);
    start.record(queue);
    end.record(queue);
    CHECK(end.seconds_since(start) == doctest::Approx(1.5));
}

TEST_CASE("an allocation that does not fit is refused with its size") {
    const fake_machine machine;
    const context gpu(*machine.api, 0);
    const device_memory<char> most(gpu, 950000, "most of it");
    const std::string text = failure(LIMAX_OUT_OF_MEMORY, [&] {
        const device_memory<double> more(gpu, 50000, "the springs of 7 robots");
    });
    CHECK(contains(text, "the springs of 7 robots: 0.0004 GB were needed; GPU 0"));
    CHECK(gpu.bytes_held() == 950000);
    machine.fail_next("cuMemAllocHost", CUDA_ERROR_OUT_OF_MEMORY);
    CHECK(
        contains(failure(LIMAX_OUT_OF_MEMORY, [&] { pinned<char>(gpu, 1000000, "the outcomes"); }),
                 "the outcomes: 0.001 GB of this machine's memory"));
}

TEST_CASE("LIMAX_CUDA_MEMORY limits the memory of a GPU") {
    const limax::test::environment_variable limit("LIMAX_CUDA_MEMORY");
    const fake_machine machine;
    limit.set("0.0001");
    {
        const context gpu(*machine.api, 0);
        device_memory<char> most(gpu, 90000, "most of it");
        CHECK(contains(
            failure(LIMAX_OUT_OF_MEMORY, [&] { device_memory<char>(gpu, 10001, "springs"); }),
            "LIMAX_CUDA_MEMORY allows 0.0001 GB of GPU 0 (Fake GPU), of which 9e-05 GB are taken"));
        CHECK_NOTHROW(device_memory<char>(gpu, 10000, "the rest"));
        most = {};
        CHECK_NOTHROW(device_memory<char>(gpu, 100000, "all of it"));
    }
    // unset and empty mean no limit
    limit.set("");
    CHECK_NOTHROW(device_memory<char>(context(*machine.api, 0), 900000, "most of it"));
    for (const char* wrong : {"5GB", "0", "nan"}) {
        CAPTURE(wrong);
        limit.set(wrong);
        CHECK(failure(LIMAX_INVALID_ARGUMENT, [&] { context(*machine.api, 0); }) ==
              "LIMAX_CUDA_MEMORY is '" + std::string(wrong) +
                  "'; it must be a number of GB above 0");
    }
}

TEST_CASE("an error names the call, the operation, the error and the remedy") {
    const fake_machine machine;
    const context gpu(*machine.api, 0);
    const stream queue(gpu);
    const std::tuple<CUresult, limax_status, const char*> refusals[] = {
        {CUDA_ERROR_ILLEGAL_ADDRESS, LIMAX_INTERNAL,
         "CUDA: cuStreamSynchronize failed while simulating 3 robots: CUDA_ERROR_700"},
        {CUDA_ERROR_LAUNCH_FAILED, LIMAX_INTERNAL, "Only a new process can use this GPU again"},
        {CUDA_ERROR_NOT_PERMITTED, LIMAX_NO_DEVICE, "/dev/nvidia"}};
    for (const auto& [result, status, part] : refusals) {
        machine.fail_next("cuStreamSynchronize", result);
        CHECK(contains(failure(status, [&] { queue.synchronize("simulating 3 robots"); }), part));
    }
    // what a destructor is refused is not raised
    machine.fail_next("cuEventDestroy", CUDA_ERROR_ILLEGAL_ADDRESS);
    { const event lost(gpu); }
    machine.fake->events = 0;
}
