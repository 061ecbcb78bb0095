#!/usr/bin/env bash
# Installs a build into a temporary prefix and builds and runs a stranger's programs against it. In the build's folder, so that the
# compiler cache knows what the same headers have been compiled to.
#   tests/consumer/run.sh BUILD_DIR
set -euo pipefail
build=$(realpath "${1:?usage: tests/consumer/run.sh BUILD_DIR}")
here=$(cd "$(dirname "$0")" && pwd)
work=$build/consumer
rm -rf "$work"
mkdir "$work"
trap 'rm -rf "$work"' EXIT
CCACHE_BASEDIR=$(cd "$here/../.." && pwd)
export CCACHE_BASEDIR CCACHE_NOHASHDIR=true
cmake --install "$build" --prefix "$work/prefix" >/dev/null
cmake -S "$here" -B "$work/build" -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_COMPILER_LAUNCHER=ccache >/dev/null
cmake --build "$work/build"
output=$("$work/build/consumer")
[[ "$output" == "2 patches" ]] || { echo "consumer printed '$output', expected '2 patches'" >&2; exit 1; }
metres=$("$work/build/graph")
[[ "$metres" == "3.00 m" ]] || { echo "graph printed '$metres', expected '3.00 m'" >&2; exit 1; }
echo "consumer: $output, $metres"
