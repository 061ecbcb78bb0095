#!/usr/bin/env bash
# Runs the tests that parse hostile bytes, keep books or run threads under ASan+UBSan and under TSan.
set -euo pipefail
cd "$(dirname "$0")/.."
for preset in asan tsan; do
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" --target "sanitized_tests"
  ctest --preset "$preset" -L "$preset"
done
