// failure.h: the message of an expected error, whose status is checked, and whether it contains a
// text.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "base/error.h"

namespace limax::test {

// The message with which `body` fails, which must have `status`; "no failure" if it succeeds.
template <class Body>
std::string failure(limax_status status, const Body& body) {
    try {
        body();
    } catch (const limax::error& caught) {
        CHECK(caught.status() == status);
        return caught.what();
    }
    return "no failure";
}
template <class Body>
std::string refused(const Body& body) {
    return failure(LIMAX_INVALID_ARGUMENT, body);
}

inline bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

}  // namespace limax::test
