#!/usr/bin/env bash
# Builds fuzzers, runs them on copies of their corpora, one after the other, and fails with the first that finds something.
#   tests/fuzz/run.sh SECONDS [NAME…]   each gets an equal share; all without names
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
for name in "$@"; do
  work=build/asan/fuzz/$name
  mkdir -p "$work/corpus"
  [[ ! -d tests/fuzz/corpus/$name ]] || cp -n tests/fuzz/corpus/"$name"/* "$work/corpus/"
  # 2 GiB: memory that an input takes beyond its worth is a find, too.
  "build/asan/tests/fuzz/$name" -max_total_time="$((share > 0 ? share : 1))" -timeout=20 -rss_limit_mb=2048 \
    -artifact_prefix="$work/" -print_final_stats=1 "$work/corpus" >"$work/log" 2>&1 || { tail -60 "$work/log" >&2; exit 1; }
  echo "$name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$work/log") executions" \
    "$(grep -o 'cov: [0-9]*' "$work/log" | tail -1)"
done
