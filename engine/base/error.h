// error.h: the exception of the engine: a status and a message. The C ABI turns it into a
// status.
#pragma once

#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "limax.h"

namespace limax {

class error : public std::runtime_error {
public:
    error(limax_status status, const std::string& text)
        : std::runtime_error(text), status_(status) {}
    limax_status status() const noexcept { return status_; }

private:
    limax_status status_;
};

// Formats like printf.
[[gnu::format(printf, 1, 2)]] inline std::string format(const char* pattern, ...) {
    va_list list;
    va_start(list, pattern);
    va_list again;
    va_copy(again, list);
    const int length = std::vsnprintf(nullptr, 0, pattern, list);
    va_end(list);
    std::string text(static_cast<std::size_t>(length), '\0');
    std::vsnprintf(text.data(), text.size() + 1, pattern, again);
    va_end(again);
    return text;
}

[[noreturn]] inline void fail(limax_status status, const std::string& text) {
    throw error(status, text);
}

// The 1-based index that messages show for a 0-based one, also for one that is out of range.
inline long long from_one(int32_t index) { return 1LL + index; }

// Throws LIMAX_INVALID_ARGUMENT if a value is not a number or is outside its closed range.
inline void require_range(const char* name, double value, double minimum, double maximum,
                          const char* unit) {
    if (value >= minimum && value <= maximum) return;
    fail(LIMAX_INVALID_ARGUMENT, format("%s is %.9g; it must be %.9g to %.9g%s%s", name, value,
                                        minimum, maximum, *unit ? " " : "", unit));
}

}  // namespace limax
