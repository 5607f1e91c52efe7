// error.h: the one exception of the engine. It carries a status and a text for a person, and ends
// at the C ABI.
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

// An index from 0 as messages show it, from 1; any index, those that no array has among them.
inline long long from_one(int32_t index) { return 1LL + index; }

// Refuses a value that is not a number or lies outside its closed range, naming both.
inline void require_range(const char* name, double value, double minimum, double maximum,
                          const char* unit) {
    if (value >= minimum && value <= maximum) return;
    fail(LIMAX_INVALID_ARGUMENT, format("%s is %.9g; it must be %.9g to %.9g%s%s", name, value,
                                        minimum, maximum, *unit ? " " : "", unit));
}

}  // namespace limax
