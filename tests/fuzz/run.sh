#!/usr/bin/env bash
# Builds fuzzers, runs them on copies of their corpora, one a processor, and fails with the first that finds something.
#   tests/fuzz/run.sh SECONDS [NAME…]   of a processor: each gets an equal share; all without names
# What they find lies in build/asan/fuzz/NAME/ (crash…): build/asan/tests/fuzz/NAME FILE repeats it.
# To add what a long run has learned to the tree: NAME -merge=1 tests/fuzz/corpus/NAME build/asan/fuzz/NAME/corpus
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:?usage: tests/fuzz/run.sh SECONDS [NAME…]}
shift
[[ $# -gt 0 ]] || set -- $(cd tests/fuzz && ls ./*_fuzzer.cc | sed 's|^\./||; s|\.cc$||')
share=$((seconds / $#))
cmake --preset asan >/dev/null
cmake --build --preset asan --target "$@"
[[ ! -w /dev/shm ]] || export TMPDIR=/dev/shm # what matters is not the disk
fuzz() {
  local work=build/asan/fuzz/$1
  mkdir -p "$work/corpus"
  [[ ! -d tests/fuzz/corpus/$1 ]] || cp -n tests/fuzz/corpus/"$1"/* "$work/corpus/"
  # 2 GiB: memory that an input takes beyond its worth is a find, too.
  "build/asan/tests/fuzz/$1" -max_total_time="$((share > 0 ? share : 1))" -timeout=20 -rss_limit_mb=2048 \
    -artifact_prefix="$work/" -print_final_stats=1 "$work/corpus" >"$work/log" 2>&1 || { tail -60 "$work/log" >&2; exit 255; }
  echo "$1: $(sed -n 's/^stat::number_of_executed_units: *//p' "$work/log") executions" \
    "$(grep -o 'cov: [0-9]*' "$work/log" | tail -1)"
}
export share
export -f fuzz
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 1 bash -euo pipefail -c 'fuzz "$1"' fuzz # ends with the first 255
