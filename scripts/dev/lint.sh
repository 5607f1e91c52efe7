#!/usr/bin/env bash
# lint.sh: clang-format (check only), luacheck, and with --tidy also clang-tidy over the whole tree.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

tidy=no
[ "${1:-}" = --tidy ] && tidy=yes
packages=(clang-format lua-check)
[ $tidy = yes ] && packages+=(clang-tidy)
need_packages "${packages[@]}"

cd "$root"
find engine bindings tests \( -name '*.h' -o -name '*.cpp' -o -name '*.inl' \) -print0 |
    xargs -0 clang-format --dry-run --Werror
luacheck --quiet bindings scripts tests
if [ $tidy = yes ]; then
    need_packages "${build_packages[@]}" "${test_packages[@]}"
    configure
    build all limax_tests
    # only the files that this build compiles: a build without CUDA leaves out engine/backend/cuda
    sed -n 's/^ *"file": "\(.*\.cpp\)",\{0,1\}$/\1/p' "$build/compile_commands.json" | sort -u |
        grep -E "^$root/(engine|bindings|tests)/" | tr '\n' '\0' |
        xargs -0 -P "$jobs" -n 1 clang-tidy --quiet -p "$build" 2>/dev/null
fi
say "lint passed"
