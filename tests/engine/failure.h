// failure.h: the text of a refusal, with its status checked.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "base/error.h"

namespace limax::test {

// What `body` says when it fails, which must be with `status`; "no failure" if it does not.
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

}  // namespace limax::test
