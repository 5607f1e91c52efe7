// memory.h: owners of the objects of one GPU: its context, streams, events, memory, and host
// memory that the GPU can read at full speed. Sizes are in elements of T, else in bytes.
//
// An owner keeps a pointer to its context, which must outlive it. Every function here makes the
// context current on the calling thread while it works.
#pragma once

#include <atomic>

#include "backend/cuda/driver/driver.h"
#include "base/array.h"

namespace limax::cuda {

// Bytes of GPU memory held by all contexts of the process.
std::atomic<uint64_t>& gpu_bytes_held();

// The primary context of one GPU. Several threads may use it at once.
class context {
public:
    // Refuses (LIMAX_NO_DEVICE) an ordinal that is not one of driver.gpus(), and
    // (LIMAX_INVALID_ARGUMENT) a LIMAX_CUDA_MEMORY that is not a positive number of GB.
    context(const driver& driver, int ordinal);
    context(const context&) = delete;
    ~context();

    const driver& api() const { return driver_; }
    const gpu& device() const { return gpu_; }
    uint64_t bytes_held() const { return bytes_held_.load(); }
    // What the driver would give now, other processes considered; bytes.
    std::size_t free_memory() const;

    // Makes the context current on this thread, and what was current before at the end of its
    // scope.
    class scope {
    public:
        explicit scope(const context& context);
        scope(const scope&) = delete;
        ~scope();

    private:
        const driver& driver_;
        CUcontext handle_, before_ = nullptr;
    };
    [[nodiscard]] scope current() const { return scope(*this); }

private:
    friend class device_block;

    const driver& driver_;
    const gpu gpu_;
    const double memory_limit_;  // bytes, infinite where LIMAX_CUDA_MEMORY is unset
    CUcontext handle_ = nullptr;
    mutable std::atomic<uint64_t> bytes_held_{0};
};

// A queue of work in order. Never waits for the default stream.
class stream {
public:
    explicit stream(const context& context);
    stream(stream&& other) noexcept
        : context_(other.context_), handle_(std::exchange(other.handle_, nullptr)) {}
    stream& operator=(stream&&) = delete;
    ~stream();

    CUstream handle() const { return handle_; }
    // Waits for all of it. `doing` as in driver::check().
    void synchronize(const std::string& doing) const;

private:
    const context* context_;
    CUstream handle_ = nullptr;
};

class event {
public:
    explicit event(const context& context);
    event(event&& other) noexcept
        : context_(other.context_), handle_(std::exchange(other.handle_, nullptr)) {}
    event& operator=(event&&) = delete;
    ~event();

    CUevent handle() const { return handle_; }
    void record(const stream& stream);
    // From `start` to this event, both recorded and done; s.
    double seconds_since(const event& start) const;

private:
    const context* context_;
    CUevent handle_ = nullptr;
};

// Bytes on a GPU, counted. What device_memory is made of.
class device_block {
public:
    device_block() = default;
    // Refuses (LIMAX_OUT_OF_MEMORY), naming what was needed and what is free, or the limit that it
    // would pass. `what` says for what: "the springs of 4096 robots".
    device_block(const context& context, std::size_t bytes, const std::string& what);
    device_block(device_block&& other) noexcept
        : context_(other.context_),
          address_(std::exchange(other.address_, 0)),
          bytes_(std::exchange(other.bytes_, 0)) {}
    // What was here moves into `other`, and ends with it.
    device_block& operator=(device_block&& other) noexcept {
        std::swap(context_, other.context_);
        std::swap(address_, other.address_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    ~device_block();

    CUdeviceptr address() const { return address_; }
    std::size_t bytes() const { return bytes_; }
    // Queued on the stream; `from` or `to` must live until it has done them, and they overlap with
    // other work only if they are pinned. Ranges outside are a defect (LIMAX_INTERNAL).
    void clear(const stream& stream);
    void upload(std::size_t offset, const void* from, std::size_t bytes, const stream& stream);
    void download(std::size_t offset, void* to, std::size_t bytes, const stream& stream) const;
    void copy(std::size_t offset, const device_block& from, std::size_t from_offset,
              std::size_t bytes, const stream& stream);

private:
    void require_inside(std::size_t offset, std::size_t bytes) const;

    const context* context_ = nullptr;
    CUdeviceptr address_ = 0;
    std::size_t bytes_ = 0;
};

// An array on a GPU. Its elements are not set.
template <class T>
class device_memory {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    device_memory() = default;
    device_memory(const context& context, std::size_t size, const std::string& what)
        : block_(context, size * sizeof(T), what) {}

    // As kernels read it; never to be followed on the host.
    // NOLINTBEGIN(performance-no-int-to-ptr): the driver gives addresses as numbers
    T* data() { return reinterpret_cast<T*>(block_.address()); }
    const T* data() const { return reinterpret_cast<const T*>(block_.address()); }
    // NOLINTEND(performance-no-int-to-ptr)
    std::size_t size() const { return block_.bytes() / sizeof(T); }

    // As device_block's, in elements.
    void clear(const stream& stream) { block_.clear(stream); }
    void upload(const T* from, std::size_t count, const stream& stream, std::size_t first = 0) {
        block_.upload(first * sizeof(T), from, count * sizeof(T), stream);
    }
    void download(T* to, std::size_t count, const stream& stream, std::size_t first = 0) const {
        block_.download(first * sizeof(T), to, count * sizeof(T), stream);
    }
    void copy(const device_memory& from, std::size_t count, const stream& stream,
              std::size_t first = 0, std::size_t from_first = 0) {
        block_.copy(first * sizeof(T), from.block_, from_first * sizeof(T), count * sizeof(T),
                    stream);
    }

private:
    device_block block_;
};

// Host memory that does not move, so that copies to and from a GPU overlap with other work. Counted
// as memory of the host. Bytes are not set.
class pinned_block {
public:
    pinned_block() = default;
    pinned_block(const context& context, std::size_t bytes, const std::string& what);
    pinned_block(pinned_block&& other) noexcept
        : context_(other.context_),
          data_(std::exchange(other.data_, nullptr)),
          bytes_(std::exchange(other.bytes_, 0)) {}
    pinned_block& operator=(pinned_block&& other) noexcept {
        std::swap(context_, other.context_);
        std::swap(data_, other.data_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    ~pinned_block();

    void* data() const { return data_; }
    std::size_t bytes() const { return bytes_; }

private:
    const context* context_ = nullptr;
    void* data_ = nullptr;
    std::size_t bytes_ = 0;
};

template <class T>
class pinned {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    pinned() = default;
    pinned(const context& context, std::size_t size, const std::string& what)
        : block_(context, size * sizeof(T), what) {}

    T* data() { return static_cast<T*>(block_.data()); }
    const T* data() const { return static_cast<const T*>(block_.data()); }
    std::size_t size() const { return block_.bytes() / sizeof(T); }
    T& operator[](std::size_t i) { return data()[i]; }
    const T& operator[](std::size_t i) const { return data()[i]; }

private:
    pinned_block block_;
};

}  // namespace limax::cuda
