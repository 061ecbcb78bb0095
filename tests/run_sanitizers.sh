#!/usr/bin/env bash
# Runs the tests labelled asan under the address and undefined-behaviour sanitizers and those labelled tsan under the
# thread sanitizer: what parses hostile bytes, keeps books or runs threads.
#   tests/run_sanitizers.sh [asan|tsan]
set -euo pipefail
cd "$(dirname "$0")/.."
[[ $# -gt 0 ]] || set -- asan tsan
for preset in "$@"; do
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" --target sanitized_tests
  ctest --preset "$preset" -L "$preset"
done
