// hash.cpp: SHA-256 and its HMAC (OpenSSL), for what others may check, and XXH3 (xxHash), for files
// of a run, where a hash must cost nothing beside the writing.
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/sha.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <string_view>

#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

const unsigned char* bytes_of(std::string_view text) {
    return reinterpret_cast<const unsigned char*>(text.data());
}

// Pushes a digest as 64 hexadecimal digits.
int push_digest(lua_State* L, const unsigned char (&digest)[SHA256_DIGEST_LENGTH]) {
    char hex[2 * SHA256_DIGEST_LENGTH + 1];
    for (int i = 0; i < SHA256_DIGEST_LENGTH; ++i) std::snprintf(hex + 2 * i, 3, "%02x", digest[i]);
    return push(L, std::string_view(hex, sizeof hex - 1));
}

int lua_sha256(lua_State* L) {
    const std::string_view text = text_argument(L, 1);
    unsigned char digest[SHA256_DIGEST_LENGTH];
    SHA256(bytes_of(text), text.size(), digest);
    return push_digest(L, digest);
}

int lua_hmac_sha256(lua_State* L) {
    const std::string_view key = text_argument(L, 1), text = text_argument(L, 2);
    unsigned char digest[SHA256_DIGEST_LENGTH];
    if (HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), bytes_of(text), text.size(),
             digest, nullptr) == nullptr)
        throw std::runtime_error("OpenSSL cannot compute an HMAC");
    return push_digest(L, digest);
}

int lua_xxh3(lua_State* L) {
    const std::string_view text = text_argument(L, 1);
    if (lua_isnoneornil(L, 2)) return push(L, xxh3(text));
    const std::size_t following = lua_isnoneornil(L, 3) ? 0 : size_argument(L, 3, 0);
    return push(L, hash_digits(xxh3_sum(text, size_argument(L, 2, 1), following)));
}

}  // namespace

std::string hash_digits(std::uint64_t hash) {
    char hex[17];
    std::snprintf(hex, sizeof hex, "%016" PRIx64, hash);
    return hex;
}

std::string xxh3(std::string_view text) {
    return hash_digits(XXH3_64bits(text.data(), text.size()));
}

std::uint64_t xxh3_sum(std::string_view text, std::size_t row, std::uint64_t following) {
    std::uint64_t sum = 0;
    for (; !text.empty(); ++following) {
        const std::size_t size = std::min(row, text.size()), before = text.size() - size;
        sum += XXH3_64bits_withSeed(text.data() + before, size, following);
        text.remove_suffix(size);
    }
    return sum;
}

void open_hashes(lua_State* L) {
    add_function<lua_sha256>(L, "sha256");
    add_function<lua_hmac_sha256>(L, "hmac_sha256");
    add_function<lua_xxh3>(L, "xxh3");
}

}  // namespace limax::host
