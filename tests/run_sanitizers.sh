#!/usr/bin/env bash
# Runs the tests labelled asan under the address and undefined-behaviour sanitizers and those labelled tsan under the
# thread sanitizer: what parses hostile bytes, keeps books or runs threads. Those of asan that parse bytes are labelled bytes, too.
#   tests/run_sanitizers.sh [--build] [bytes|asan|tsan]     asan and tsan without a name; --build builds them only
# Reports name functions; for lines, once: cmake --preset asan -DCMAKE_CXX_FLAGS_DEBUG='-O1 -g1', and back with -O1.
set -euo pipefail
cd "$(dirname "$0")/.."
run=yes
[[ "${1:-}" != --build ]] || { run=; shift; }
[[ $# -gt 0 ]] || set -- asan tsan
for label in "$@"; do
  preset=${label/bytes/asan}
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" --target "${label}_tests"
  [[ -z $run ]] || ctest --preset "$preset" -L "$label"
done
