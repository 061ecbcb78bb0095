#!/usr/bin/env bash
# All that clang compiles for the gate: the tests labelled bytes and fuzzers under sanitizers, with its warnings and its
# thread-safety analysis of what they are made of. tests/run.sh starts it behind the release build.
#   tests/build_clang.sh FUZZER…
set -euo pipefail
cd "$(dirname "$0")/.."
tests/run_sanitizers.sh --build bytes
cmake --build --preset asan --target "$@"
