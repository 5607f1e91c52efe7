// array.h: owner of bulk memory: move-only, zeroed, aligned for the widest vectors, and counted, so
// that a garbage collector can take the memory held by the engine into account.
#pragma once

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <type_traits>
#include <utility>

#include "base/error.h"

namespace limax {

// Bytes held by all arrays of the process.
inline std::atomic<uint64_t>& bytes_held() {
    static std::atomic<uint64_t> bytes{0};
    return bytes;
}

template <class T>
class array {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    static constexpr std::size_t alignment = 64;  // bytes: a cache line and the widest x86 vector

    array() = default;
    explicit array(std::size_t size) : size_(size) {
        if (size == 0) return;
        const std::size_t bytes = rounded_bytes();
        data_ = static_cast<T*>(std::aligned_alloc(alignment, bytes));
        if (!data_)
            fail(LIMAX_OUT_OF_MEMORY,
                 format("out of memory: %.1f MB more were needed", double(bytes) / 1e6));
        std::memset(static_cast<void*>(data_), 0, bytes);
        bytes_held() += bytes;
    }
    array(array&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
    // Swaps: `other` frees what this array held.
    array& operator=(array&& other) noexcept {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        return *this;
    }
    ~array() {
        if (!data_) return;
        bytes_held() -= rounded_bytes();
        std::free(data_);
    }

    T* data() { return data_; }
    const T* data() const { return data_; }
    std::size_t size() const { return size_; }
    T& operator[](std::size_t i) { return data_[i]; }
    const T& operator[](std::size_t i) const { return data_[i]; }
    T* begin() { return data_; }
    T* end() { return data_ + size_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }

private:
    std::size_t rounded_bytes() const {
        return (size_ * sizeof(T) + alignment - 1) / alignment * alignment;
    }

    T* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace limax
