#!/usr/bin/env bash
# All that clang compiles for the gate: tests and fuzzers under sanitizers, then the warnings of the rest. tests/run.sh starts
# it behind the release build.
set -euo pipefail
cd "$(dirname "$0")/.."
tests/run_sanitizers.sh --build
cmake --build --preset asan --target fuzzers
python3 tests/check_clang.py --rest
