// scratch_folder.h: a folder of one test, gone at its end.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace limax::test {

struct scratch_folder {
    scratch_folder() {
        std::string pattern =
            (std::filesystem::temp_directory_path() / "limax-test-XXXXXX").string();
        path = mkdtemp(pattern.data());
    }
    scratch_folder(const scratch_folder&) = delete;
    ~scratch_folder() { std::filesystem::remove_all(path); }

    std::filesystem::path path;
};

}  // namespace limax::test
