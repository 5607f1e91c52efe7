#!/usr/bin/env bash
# quickstart.sh: from a fresh Debian 12 to a walking robot: installs what is missing, builds, evolves for 40 generations.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

need_packages "${build_packages[@]}"
configure_and_build
"$build/limax" run "$root/scripts/experiments/walk.lua" "$@"
