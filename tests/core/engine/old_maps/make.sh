#!/usr/bin/env bash
# Makes a map file with the program of an earlier commit and keeps it here.
#   tests/core/engine/old_maps/make.sh COMMIT NAME [DEFINITION]…
# Definitions: OLD_MAP_HAS_CONSTRAINTS, OLD_MAP_HAS_CLASSES, where people can give those.
# The commit is built by today's build system, which is several times faster than the first ones were.
set -euo pipefail
commit=${1:?usage: make.sh COMMIT NAME [DEFINITION]…} name=${2:?}
shift 2
here=$(cd "$(dirname "$0")" && pwd)
top=$(git -C "$here" rev-parse --show-toplevel)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
git -C "$top" archive --prefix=source/ "$commit" | tar --extract --directory "$work"
cp "$here/make_old_map.cc" "$work/source/"
cp "$top/CMakeLists.txt" "$work/source/"
cp -r "$top/deploy/cmake" "$work/source/deploy/"
sed -i '/^if(STRATA_BUILD_TESTS)/,/^endif/d' "$work/source/CMakeLists.txt"
cat >>"$work/source/CMakeLists.txt" <<CMAKE
strata_executable(make_old_map make_old_map SOURCES make_old_map.cc DEPS strata::engine)
target_compile_definitions(make_old_map PRIVATE OLD_MAP $*)
CMAKE
cmake -S "$work/source" -B "$work/build" -G Ninja -DSTRATA_BATCHES=ON -DCMAKE_CXX_FLAGS=-O0 >/dev/null
cmake --build "$work/build" --target make_old_map >"$work/log" || { cat "$work/log" >&2; exit 1; }
"$work/build/make_old_map" "$work/maps" | tee "$here/$name.txt"
zstd --quiet --force -19 "$work/maps/old.strata" -o "$here/$name.strata.zst"
ls -l "$here/$name.strata.zst"
