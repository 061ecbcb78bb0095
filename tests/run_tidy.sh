#!/usr/bin/env bash
# clang-tidy over our sources, which compiles them with clang 14 and its thread-safety analysis as well.
#   tests/run_tidy.sh            every source, without the slow clang-analyzer checks: what the gate runs
#   tests/run_tidy.sh --deep     every source, every check of .clang-tidy (twice the time)
#   tests/run_tidy.sh FILE...    these sources, every check
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset dev >/dev/null
cmake --build --preset dev --target strata_proto_code >/dev/null
checks=()
if [[ $# -eq 0 ]]; then checks=(--checks=-clang-analyzer-*); fi
if [[ $# -eq 0 || "$1" == --deep ]]; then
  set -- $(git ls-files 'core/*.cc' 'server/*.cc' 'client/*.cc' 'proto/*.cc')
fi
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 2 clang-tidy -p build/dev --quiet "${checks[@]}" \
  2> >(grep -vE 'warnings? (generated|treated)' >&2)
echo "clang-tidy: $# files clean"
