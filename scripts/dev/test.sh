#!/usr/bin/env bash
# test.sh: installs what is missing, builds, runs every test: the engine's (doctest) and the scripted suites.
# Arguments go to `limax test`. LIMAX_BUILD names another build folder, LIMAX_CMAKE holds further CMake options.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

need_packages "${build_packages[@]}" valgrind python3 openssl python3-numpy python3-meshio python3-crcmod \
    protobuf-compiler admesh unzip
# shellcheck disable=SC2086  # options are words
configure_and_build ${LIMAX_CMAKE:-}
status=0
"$build/limax_tests" || status=1
# as many files at a time as there are cores, unless a later -j says another number, or tests run in one process
parallel=(-j "$jobs")
[[ " $* " =~ " --"(update-golden|one-process|json-seq)" " ]] && parallel=()
"$build/limax" test "${parallel[@]}" "$@" || status=1
exit $status
