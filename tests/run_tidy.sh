#!/usr/bin/env bash
# Every check of .clang-tidy, the slow clang-analyzer included; check_clang.py --tidy has the quick ones.
#   tests/run_tidy.sh            every source: hours of one core
#   tests/run_tidy.sh FILE...    these
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset dev >/dev/null
cmake --build --preset dev --target strata_proto_code >/dev/null
[[ $# -gt 0 ]] || set -- $(git ls-files 'core/*.cc' 'server/*.cc' 'client/*.cc' 'proto/*.cc')
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 2 clang-tidy -p build/dev --quiet \
  2> >(grep -vE 'warnings? (generated|treated)' >&2)
echo "clang-tidy: $# files clean"
