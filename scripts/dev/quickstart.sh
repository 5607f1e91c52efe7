#!/usr/bin/env bash
# quickstart.sh: from a fresh Debian 12 to a walking robot: installs missing packages, builds, evolves 40 generations.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

need_packages "${build_packages[@]}"
configure
build all
"$build/limax" run "$root/scripts/experiments/walk.lua" "$@"
