#!/usr/bin/env bash
# Runs the tests labelled asan under the address and undefined-behaviour sanitizers and those labelled tsan under the
# thread sanitizer: what parses hostile bytes, keeps books or runs threads.
#   tests/run_sanitizers.sh [--build] [asan|tsan]     --build builds them only
# Reports name functions; for lines, once: cmake --preset asan -DCMAKE_CXX_FLAGS_DEBUG='-O1 -g1', and back with -O1.
set -euo pipefail
cd "$(dirname "$0")/.."
run=yes
[[ "${1:-}" != --build ]] || { run=; shift; }
[[ $# -gt 0 ]] || set -- asan tsan
for preset in "$@"; do
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" --target sanitized_tests
  [[ -z $run ]] || ctest --preset "$preset" -L "$preset"
done
