# setup.sh: what the other scripts here share: packages through apt when missing, configure, build. Sourced, not run.
# Sets `root`, `build` and `jobs`. Safe to run again: what is there is left alone.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=${LIMAX_BUILD:-$root/build}
jobs=$(nproc)

say() { printf '%s\n' "limax: $*" >&2; }

# Installs those of the named Debian packages that are missing.
need_packages() {
    local missing=() package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || {
            say "missing packages; as root: apt-get install ${missing[*]}"
            exit 1
        }
        as_root=(sudo)
    fi
    say "installing ${missing[*]}"
    "${as_root[@]}" apt-get update -qq
    DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

build_packages=(g++ cmake ninja-build pkg-config libluajit-5.1-dev libeigen3-dev libcurl4-openssl-dev
    nlohmann-json3-dev doctest-dev libedit-dev zlib1g-dev libpng-dev libgif-dev libpugixml-dev libzip-dev libjs-three)

# configure_and_build [CMake options]: Release by default, into $build.
configure_and_build() {
    # an earlier configuration keeps its generator; a fresh one takes Ninja
    local generator=()
    [ -f "$build/CMakeCache.txt" ] || generator=(-G Ninja)
    say "building in $build"
    cmake -S "$root" -B "$build" "${generator[@]}" "$@" >"$build.log" 2>&1 || {
        cat "$build.log" >&2
        exit 1
    }
    rm -f "$build.log"
    cmake --build "$build" -j "$jobs" >&2
}
