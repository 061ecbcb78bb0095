#!/usr/bin/env bash
# Strata's tests: installs what they need, builds, checks and runs them. A second run skips what is there.
#   tests/run.sh            everything the gate runs
#   tests/run.sh --full     also the viewer in a browser, long tests, all sanitized tests and fuzzers, clang's warnings of
#                           all, clang-tidy, a whole build by clang, every header alone (some two hours more)
# Recorded data are read from $STRATA_DATA (default ../shared/data); tests that need them skip where they are absent.
set -euo pipefail
cd "$(dirname "$0")/.."
[[ "${1:-}" == "" || "${1:-}" == --full ]] || { sed -n '2,6p' "$0" >&2; exit 2; }

# Fuzzers of what is made of few sources; --full has all.
byte_fuzzers="bag_file_fuzzer message_fuzzer mls_tile_fuzzer scan_file_fuzzer surface_tile_fuzzer wire_check_fuzzer"

stage() { printf '\n== %s (%s s)\n' "$1" "$SECONDS"; }

# A bare machine, and what clang compiles. Tests leave processors idle while they wait for disks and clocks: clang takes only
# what they leave.
begin_beside() {
  set -m # a group of processes, that ends as a whole
  {
    nice -n 5 tests/bare/run.sh
    CMAKE_BUILD_PARALLEL_LEVEL=$(nproc) nice -n 19 tests/build_clang.sh $byte_fuzzers
  } >build/beside.log 2>&1 &
  beside=$!
  set +m
  trap 'kill -- -$beside 2>/dev/null || true' EXIT
}
end_beside() {
  local status=0
  wait "$beside" || status=$?
  trap - EXIT
  cat build/beside.log
  return "$status"
}

stage "packages"
deploy/install-packages.sh --dev

stage "includes"
python3 tests/check_includes.py
python3 tests/check_names.py
python3 tests/check_doors.py
python3 tests/check_pages.py
python3 tests/experiments/results.py --check

stage "format"
git ls-files '*.h' '*.cc' '*.proto' | xargs -P "$(nproc)" -n 300 clang-format --dry-run --Werror

stage "release build"
cmake --preset release -DSTRATA_BUILD_TESTS=ON -DSTRATA_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release

begin_beside

stage "tests; pages, packages, recorded data through a real server"
ctest --preset release -LE "browser|long"

stage "beside the tests: a bare machine; clang: sanitized builds, fuzzers"
end_beside

stage "sanitizers"
tests/run_sanitizers.sh bytes

stage "fuzzers"
tests/fuzz/run.sh 60 $byte_fuzzers

if [[ "${1:-}" == --full ]]; then
  stage "the viewer in a browser"
  cmake --build --preset release --target viewer
  ctest --preset release -L browser

  stage "long tests"
  ctest --preset release -L long

  stage "all sanitized tests, all fuzzers"
  tests/run_sanitizers.sh
  tests/fuzz/run.sh 120

  stage "experiments"
  cmake --build --preset release --target experiments

  stage "clang's warnings and thread-safety analysis of the whole product"
  python3 tests/check_clang.py

  stage "clang-tidy"
  python3 tests/check_clang.py --tidy

  stage "clang build"
  cmake --preset dev >/dev/null
  cmake --build --preset dev

  stage "self-contained headers"
  python3 tests/check_headers.py
fi

stage "passed"
