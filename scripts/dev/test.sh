#!/usr/bin/env bash
# test.sh: installs missing packages, builds, runs the tests of the engine (doctest) and the scripted suites.
# Arguments go to `limax test`. LIMAX_BUILD names another build folder, LIMAX_CMAKE adds CMake options.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

need_packages "${build_packages[@]}" "${test_packages[@]}" valgrind python3 openssl python3-numpy \
    python3-pandas python3-meshio unzip
# shellcheck disable=SC2086  # options are words
configure ${LIMAX_CMAKE:-} -DBUILD_TESTING=ON
build all limax_tests
status=0
# the engine's tests, in one process, run beside the suites and are printed after them
"$build/limax_tests" >"$build/limax_tests.log" 2>&1 &
engine=$!
trap 'kill $engine 2>/dev/null || true' EXIT
# limits are for hangs; as many test files at once as there are cores, unless an argument sets
# another number or needs one process
parallel=(-j "$jobs")
[[ " $* " =~ " --"(update-golden|one-process|json-seq)" " ]] && parallel=()
"$build/limax" test --limit 1200 "${parallel[@]}" "$@" || status=1
wait $engine || status=1
trap - EXIT
cat "$build/limax_tests.log"
exit $status
