// memory.h: owners of the objects of one GPU: its context, streams, events, memory, and host
// memory that the GPU can read at full speed. Sizes are in elements of T, else in bytes.
//
// An owner keeps a pointer to its context, which must outlive it. Every function here makes the
// context current on the calling thread while it works.
#pragma once

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

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
    uint64_t bytes_held() const {
        const std::lock_guard lock(mutex_);
        return on_gpu_.bytes_held;
    }
    // Memory that the driver can allocate now, given what other processes use; bytes.
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

    // Memory of ended owners that is kept for what is made next.
    uint64_t bytes_kept() const {
        const std::lock_guard lock(mutex_);
        return on_gpu_.bytes_kept;
    }
    // Frees the memory that is kept for what is made next. Waits for all work of the GPU.
    void free_kept() const;

private:
    template <class Handle, auto destroy>
    friend class owned;
    friend class device_block;
    friend class pinned_block;

    // Bytes to allocate: the next generation differs a little in its number of valid robots.
    static std::size_t with_room(std::size_t bytes) {
        return bytes < 65536 ? bytes : bytes + bytes / 16;
    }
    // Memory of one kind. What ends is kept for what is made next, since making it takes long and
    // freeing it waits for the GPU. Held and kept memory together stay below what was held at once
    // lately (or a little), since other processes may need the rest.
    static constexpr uint64_t always_kept = 256000000;
    static constexpr int period = 1024;  // blocks made: some tens of generations
    template <class Handle>
    struct memory_of_kind {
        std::multimap<std::size_t, Handle> kept;  // by their bytes
        uint64_t bytes_kept = 0, bytes_held = 0;
        uint64_t most_held = 0, most_before = 0;  // in this period, in the one before
        int made = 0;

        void count(int64_t bytes) {
            bytes_held += uint64_t(bytes);
            if (bytes > 0 && ++made == period) {
                most_before = std::exchange(most_held, 0);
                made = 0;
            }
            most_held = std::max(most_held, bytes_held);
        }
        bool has_room(std::size_t bytes) const {
            const uint64_t most = with_room(std::max({most_held, most_before, always_kept}));
            return bytes_held + bytes_kept + bytes <= most;
        }
        // False if it is to be freed.
        bool keep(Handle memory, std::size_t bytes) {
            if (!has_room(bytes)) return false;
            kept.emplace(bytes, memory);
            bytes_kept += bytes;
            return true;
        }
        // Takes a block of this size or up to twice as large; 0 and null if there is none.
        std::pair<std::size_t, Handle> take(std::size_t bytes) {
            const auto found = kept.lower_bound(bytes);
            if (found == kept.end() || found->first > 2 * bytes) return {};
            const std::pair<std::size_t, Handle> block = *found;
            bytes_kept -= block.first;
            kept.erase(found);
            return block;
        }
    };
    memory_of_kind<CUdeviceptr>& memory_of(CUdeviceptr /*kind*/) const { return on_gpu_; }
    memory_of_kind<void*>& memory_of(void* /*kind*/) const { return on_host_; }

    template <class Handle>
    void count(Handle memory, int64_t bytes) const {
        const std::lock_guard lock(mutex_);
        memory_of(memory).count(bytes);
    }
    // Frees what is kept unless these bytes, which none of it can serve, have room beside it.
    template <class Handle>
    void make_room(std::size_t bytes) const {
        const bool has_room = [&] {
            const std::lock_guard lock(mutex_);
            return memory_of(Handle{}).has_room(bytes);
        }();
        if (!has_room) free_kept();
    }
    template <class Handle>
    bool keep(Handle memory, std::size_t bytes) const {
        const std::lock_guard lock(mutex_);
        return memory_of(memory).keep(memory, bytes);
    }
    template <class Handle>
    std::pair<std::size_t, Handle> take(std::size_t bytes) const {
        const std::lock_guard lock(mutex_);
        return memory_of(Handle{}).take(bytes);
    }

    const driver& driver_;
    const gpu gpu_;
    const double memory_limit_;  // bytes, infinite where LIMAX_CUDA_MEMORY is unset
    CUcontext handle_ = nullptr;
    mutable std::mutex mutex_;  // guards what follows
    mutable memory_of_kind<CUdeviceptr> on_gpu_;
    mutable memory_of_kind<void*> on_host_;  // pinned
};

// Something that the driver made in a context and that `destroy`, a function of the driver, ends.
template <class Handle, auto destroy>
class owned {
public:
    owned() = default;
    explicit owned(const context& context) : context_(&context) {}
    owned(owned&& other) noexcept { *this = std::move(other); }
    // Swaps the two, so that the destructor of `other` frees the old value.
    owned& operator=(owned&& other) noexcept {
        std::swap(context_, other.context_);
        std::swap(handle_, other.handle_);
        std::swap(bytes_, other.bytes_);
        std::swap(allocated_, other.allocated_);
        return *this;
    }
    // Results are ignored: after a sticky error nothing can be freed, and that error was raised
    // where it occurred.
    ~owned() {
        if (!handle_) return;
        if constexpr (is_memory) {
            count(-int64_t(bytes_));
            if (context_->keep(handle_, allocated_)) return;
        }
        end();
    }

    Handle handle() const { return handle_; }
    std::size_t bytes() const { return bytes_; }

protected:
    void end() const {
        try {
            const auto here = context_->current();
            (void)(context_->api().*destroy)(handle_);
        } catch (const cuda_error&) {
        }
    }
    const driver& api() const { return context_->api(); }
    // Counts memory: that of a GPU by its address, else that of the host.
    void count(int64_t bytes) const {
        context_->count(handle_, bytes);
        (on_gpu ? gpu_bytes_held() : limax::bytes_held()) += uint64_t(bytes);
    }
    static constexpr bool on_gpu = std::is_same_v<Handle, CUdeviceptr>;
    static constexpr bool is_memory = on_gpu || std::is_same_v<Handle, void*>;

    const context* context_ = nullptr;
    Handle handle_{};
    std::size_t bytes_ = 0, allocated_ = 0;  // of memory
};

// A queue of work in order. Never waits for the default stream. A GPU that is busy takes up `brief`
// work as soon as a block ends, before what waits in other streams.
enum class stream_work { any, brief };
class stream : public owned<CUstream, &driver::stream_destroy> {
public:
    explicit stream(const context& context, stream_work work = stream_work::any);
    // Waits for all of it. `doing` as in driver::check().
    void synchronize(const std::string& doing) const;
};

class event : public owned<CUevent, &driver::event_destroy> {
public:
    explicit event(const context& context);
    void record(const stream& stream);
    // From `start` to this event, both recorded and done; s.
    double seconds_since(const event& start) const;
};

// Bytes on a GPU, counted. What device_memory is made of.
class device_block : public owned<CUdeviceptr, &driver::mem_free> {
public:
    device_block() = default;
    // Refuses (LIMAX_OUT_OF_MEMORY), naming what was needed and what is free, or the limit that it
    // would pass. `what` says for what: "the springs of 4096 robots".
    device_block(const context& context, std::size_t bytes, const std::string& what);

    // Queued on the stream; `from` or `to` must live until it has done them, and they overlap with
    // other work only if they are pinned. Ranges outside are a defect (LIMAX_INTERNAL).
    void clear(const stream& stream);
    void upload(std::size_t offset, const void* from, std::size_t bytes, const stream& stream);
    void download(std::size_t offset, void* to, std::size_t bytes, const stream& stream) const;
    void copy(std::size_t offset, const device_block& from, std::size_t from_offset,
              std::size_t bytes, const stream& stream);

private:
    void require_inside(std::size_t offset, std::size_t bytes) const;
};

// An array on a GPU. Its elements are not set.
template <class T>
class device_memory : device_block {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    device_memory() = default;
    device_memory(const context& context, std::size_t size, const std::string& what)
        : device_block(context, size * sizeof(T), what) {}

    // As kernels read it; never to be followed on the host.
    // NOLINTBEGIN(performance-no-int-to-ptr): the driver gives addresses as numbers
    T* data() { return reinterpret_cast<T*>(handle_); }
    const T* data() const { return reinterpret_cast<const T*>(handle_); }
    // NOLINTEND(performance-no-int-to-ptr)
    std::size_t size() const { return bytes_ / sizeof(T); }

    // As device_block's, in elements.
    using device_block::clear;
    void upload(const T* from, std::size_t count, const stream& stream, std::size_t first = 0) {
        device_block::upload(first * sizeof(T), from, count * sizeof(T), stream);
    }
    void download(T* to, std::size_t count, const stream& stream, std::size_t first = 0) const {
        device_block::download(first * sizeof(T), to, count * sizeof(T), stream);
    }
    void copy(const device_memory& from, std::size_t count, const stream& stream,
              std::size_t first = 0, std::size_t from_first = 0) {
        device_block::copy(first * sizeof(T), from, from_first * sizeof(T), count * sizeof(T),
                           stream);
    }
};

// Host memory that does not move, so that copies to and from a GPU overlap with other work. Counted
// as memory of the host. Bytes are not set.
class pinned_block : public owned<void*, &driver::mem_free_host> {
public:
    pinned_block() = default;
    pinned_block(const context& context, std::size_t bytes, const std::string& what);
};

template <class T>
class pinned : pinned_block {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    pinned() = default;
    pinned(const context& context, std::size_t size, const std::string& what)
        : pinned_block(context, size * sizeof(T), what) {}

    T* data() { return static_cast<T*>(handle_); }
    const T* data() const { return static_cast<const T*>(handle_); }
    std::size_t size() const { return bytes_ / sizeof(T); }
    T& operator[](std::size_t i) { return data()[i]; }
    const T& operator[](std::size_t i) const { return data()[i]; }
};

}  // namespace limax::cuda
