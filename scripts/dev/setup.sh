# setup.sh: shared by the other scripts of this folder: installs missing packages with apt, configures, builds.
# Sourced, not run. Sets `root`, `build` and `jobs`.
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

# libzip-dev brings zlib1g-dev, libspectra-dev libeigen3-dev
build_packages=(g++ cmake ninja-build libluajit-5.1-dev libcurl4-openssl-dev nlohmann-json3-dev libssl-dev
    libxxhash-dev libedit-dev libgif-dev libpugixml-dev libzip-dev libspectra-dev libcairo2 fonts-dejavu-core libjs-three)
test_packages=(doctest-dev libopenmpi-dev openmpi-bin)

# configure [CMake options]: into $build; Release by default.
configure() {
    # an existing build folder keeps its generator; a new one gets Ninja
    local generator=()
    [ -f "$build/CMakeCache.txt" ] || generator=(-G Ninja)
    say "building in $build"
    cmake -S "$root" -B "$build" "${generator[@]}" "$@" >"$build.log" 2>&1 || {
        cat "$build.log" >&2
        exit 1
    }
    rm -f "$build.log"
}

# build TARGET...: builds these targets in $build; `all` is everything but the tests.
build() {
    cmake --build "$build" -j "$jobs" --target "$@" >&2
}
