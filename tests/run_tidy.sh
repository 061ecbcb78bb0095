#!/usr/bin/env bash
# clang-tidy over every source of ours, which compiles it with clang 14 and its thread-safety analysis as well.
#   tests/run_tidy.sh [FILE...]
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset dev >/dev/null
cmake --build --preset dev --target strata_proto >/dev/null
[[ $# -gt 0 ]] || set -- $(git ls-files 'core/*.cc' 'server/*.cc' 'client/*.cc' 'proto/*.cc')
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 4 clang-tidy -p build/dev --quiet 2> >(grep -v 'warnings generated' >&2)
echo "clang-tidy: $# files clean"
