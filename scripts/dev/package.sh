#!/usr/bin/env bash
# package.sh: installs missing packages, builds, and makes build/limax_VERSION_ARCHITECTURE.deb.
# LIMAX_CMAKE adds CMake options, such as -DLIMAX_CUDA_ARCHITECTURES="80;90" for the GPUs that get built-in kernels, or
# -DLIMAX_MPI=ON for runs over MPI, which the package then depends on.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

need_packages "${build_packages[@]}" dpkg-dev file git
# shellcheck disable=SC2086  # options are words
configure -DLIMAX_MPI=OFF ${LIMAX_CMAKE:-} -DBUILD_TESTING=OFF
build all
cd "$build"
cpack -G DEB >/dev/null
say "made $(ls -t "$build"/limax_*.deb | head -1)"
