// cache.h: compiled kernels on disk, so that each is compiled once per user and not once per run.
// A problem with the cache never stops a run. Includes std only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace limax::cuda {

// FNV-1a of 128 bits: for names and for finding damage, not against an enemy.
class hash128 {
public:
    // Parts are kept apart: ("a", "bc") and ("ab", "c") differ.
    hash128& add(std::string_view part);
    std::string hex() const;  // 32 digits

private:
    __extension__ using wide = unsigned __int128;

    wide state_ = wide(0x6c62272e07bb0142u) << 64 | 0x62b821756295c58du;
};

class kernel_cache {
public:
    // In this folder, which is made when something is stored; empty for a cache that keeps nothing.
    explicit kernel_cache(std::string folder) : folder_(std::move(folder)) {}
    // $XDG_CACHE_HOME/limax, else $HOME/.cache/limax, else empty.
    static std::string users_folder();
    // The one in users_folder(), as it was at the first call.
    static kernel_cache& users();

    const std::string& folder() const { return folder_; }
    // `key` is a hash of everything that the bytes follow from. Several processes may use a folder
    // at once: a file appears whole or not at all. A damaged file is removed and counts as absent.
    std::optional<std::string> load(const hash128& key);
    void store(const hash128& key, std::string_view bytes);

    // Notes for the user since the last call, one sentence each. Each kind of problem is noted
    // once per cache.
    std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }

private:
    std::string path_of(const hash128& key) const;
    void note(bool& reported, const std::string& text);
    void cannot_write(const std::string& reason);

    const std::string folder_;
    std::vector<std::string> notes_;
    bool reported_damaged_ = false, reported_unwritable_ = false;
};

}  // namespace limax::cuda
