// sha256.h: SHA-256 of a text (FIPS 180-4).
// Standard library only.
#pragma once

#include <string>
#include <string_view>

namespace limax::host {

// 64 hexadecimal digits, lower case.
std::string sha256(std::string_view text);

}  // namespace limax::host
