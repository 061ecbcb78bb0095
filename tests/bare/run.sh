#!/usr/bin/env bash
# What a stranger meets first: the README's first command on a Debian 12 that has nothing but apt. Packages, build, server,
# two robots' uploads, plans, pictures.
#   tests/bare/run.sh
# The checkout is mounted at its own path, so that the machine's compiler cache knows what its release build compiled; it cannot
# be written to but for an empty build folder.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p build "$work/build" "$work/out"
compiled=$(ccache --get-config cache_dir)
mkdir -p "$compiled"

# Only apt needs root: the rest is done by the owner of the checkout, who can delete it again.
demo='
  deploy/install-packages.sh
  export CCACHE_DIR=$2 CCACHE_STATSLOG=/out/compiled HOME=/tmp
  setpriv --reuid="$3" --regid="$4" --clear-groups deploy/demo.sh --short --out /out
  ccache --show-log-stats'
tests/bare/in_root.sh --after deploy/install-packages.sh --read-only "$PWD" --bind "$work/build:$PWD/build" --bind "$work/out:/out" --bind "$compiled" \
  bash -euc "cd \"\$1\"; $demo" bare "$PWD" "$compiled" "$(id -u)" "$(id -g)"

for file in over.ply under.ply bridge.png; do
  [[ -s $work/out/$file ]] || { echo "bare: the demo left no $file" >&2; exit 1; }
done
echo "bare: the demo ran on a machine with nothing but apt"
