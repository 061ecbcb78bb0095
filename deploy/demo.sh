#!/usr/bin/env bash
# Strata's main job, from nothing: installs what it needs, builds, and shows two robots mapping a bridge.
#   deploy/demo.sh [--out DIR]                  simulated: two robots upload at once, plans over and under the bridge;
#                                               then a loop of 300 m is closed, and what was learned at one building
#                                               says what another one is made of
#   deploy/demo.sh --short [--out DIR]          the bridge only
#   deploy/demo.sh --data FOLDER [--out DIR]    recorded: FOLDER has scans/ and poses_*.txt (or .pose files)
# Files go to DIR, default ./demo-out. A second run skips the installing and building that is done.
set -euo pipefail

usage() { sed -n '3,8p' "$0" >&2; exit 2; }
out=demo-out
data=
short=
while [[ $# -gt 0 ]]; do
  case "$1" in
    --out) [[ $# -ge 2 ]] || usage; out=$2; shift 2 ;;
    --short) short=yes; shift ;;
    --data) [[ $# -ge 2 ]] || usage; data=$2; shift 2 ;;
    *) usage ;;
  esac
done
mkdir -p "$out"
out=$(cd "$out" && pwd)
if [[ -n $data ]]; then
  [[ -d $data ]] || { echo "demo: no folder $data" >&2; exit 2; }
  data=$(cd "$data" && pwd)
fi
cd "$(dirname "$0")/.."

step() { printf '\n== %s\n' "$*"; }
# Shows a command as one would type it, then runs it.
run() { local line="$*"; printf '$ %s\n' "${line/#strata_at/strata --server ${server_address:-}}"; "$@"; }

work=$(mktemp -d)
server=
cleanup() {
  if [[ -n $server ]]; then
    kill -TERM "$server" 2>/dev/null || true
    wait "$server" 2>/dev/null || true
  fi
  rm -rf "$work"
}
trap cleanup EXIT

build() {
  step "packages"
  deploy/install-packages.sh
  step "build"
  cmake --preset release >"$work/cmake.log" || { cat "$work/cmake.log" >&2; exit 1; }
  cmake --build --preset release --target stratad strata_cli strata_simulate
  PATH=$PWD/build/release/client/cli:$PWD/build/release/server:$PWD/build/release/tests/support:$PATH
}

start_server() {
  step "server"
  : >"$work/listening" # it is read before a busy machine lets the server open it
  stratad --data "$work/data" --listen 127.0.0.1:0 --optimize-every 0 >"$work/listening" 2>"$out/stratad.log" &
  server=$!
  local address=
  for _ in $(seq 200); do
    address=$(sed -n 's/^listening //p' "$work/listening")
    [[ -z $address ]] || break
    kill -0 "$server" 2>/dev/null || { cat "$out/stratad.log" >&2; exit 1; }
    sleep 0.1
  done
  [[ -n $address ]] || { echo "demo: stratad did not begin to listen" >&2; exit 1; }
  echo "stratad listens on $address"
  server_address=$address
}

strata_at() { strata --server "$server_address" "$@"; }

# place NAME: "x,y,z" of a named place of the simulated world.
place() { awk -v name="$1" '$1 == name { print $2 "," $3 "," $4 }' "$work/world/places.txt"; }

demo_simulated() {
  step "a bridge to cross and to pass under, seen by two robots with noisy odometry"
  run strata-simulate bridge "$work/world" --seed 1 --noise-m 0.02 --noise-rad 0.003
  start_server
  step "both upload at once"
  run strata_at map create bridge --cell-size 0.1
  local uploads=()
  for robot in over under; do
    strata_at scan import bridge "$work/world/$robot/scans" --poses "$work/world/$robot/poses_initial.txt" \
      --pose-format index-tum --trajectory "$robot" --align on --wait >"$work/$robot.txt" &
    uploads+=($!)
  done
  for upload in "${uploads[@]}"; do wait "$upload"; done
  for robot in over under; do
    printf -- '-- robot %s\n' "$robot"
    cat "$work/$robot.txt"
    strata_at pose export bridge --trajectory "$robot" --out "$out/poses_$robot.txt" >/dev/null
    drift "$work/world/$robot/poses_truth.txt" "$work/world/$robot/poses_initial.txt" "$out/poses_$robot.txt"
  done
  step "the map"
  run strata_at map show bridge
  step "paths"
  run strata_at plan bridge --from "$(place west)" --to "$(place east)" --out "$out/over.ply"
  run strata_at plan bridge --from "$(place south)" --to "$(place north)" --out "$out/under.ply"
  echo "from the deck to the road right beneath it, or why not:"
  run strata_at plan bridge --from "$(place deck)" --to "$(place under)" --out "$out/deck_to_road.ply"
  step "pictures"
  run strata_at map render bridge "$out/bridge.png" --view oblique --path "$out/over.ply" --path "$out/under.ply"
  run strata_at map render bridge "$out/bridge_top.png" --path "$out/over.ply" --path "$out/under.ply"
  run strata_at map render bridge "$out/bridge_road.png" --slice -1,2 --path "$out/under.ply"
}

demo_loop() {
  step "a robot with poor odometry drives a loop of 300 m"
  run strata-simulate campus_loop "$work/loop" --seed 1 --noise-m 0.03 --noise-rad 0.005
  run strata_at map create loop --cell-size 0.1
  run strata_at scan import loop "$work/loop/loop/scans" --poses "$work/loop/loop/poses_initial.txt" \
    --pose-format index-tum --trajectory loop --align off --wait
  run strata_at map render loop "$out/loop_before.png" --trajectories
  step "closing the loop"
  run strata_at job start loop optimize --wait
  strata_at pose export loop --out "$out/poses_loop.txt" >/dev/null
  drift "$work/loop/loop/poses_truth.txt" "$work/loop/loop/poses_initial.txt" "$out/poses_loop.txt"
  run strata_at map history loop
  run strata_at map render loop "$out/loop_after.png" --trajectories
}

demo_classes() {
  step "two buildings; of the first, people have said what every point is"
  run strata-simulate building "$work/library" --seed 1 --labels --step 10
  run strata-simulate building "$work/school" --seed 2 --labels --step 10
  run strata_at map create library --cell-size 0.2
  run strata_at map create school --cell-size 0.2
  local import=(--poses "$work/library/round/poses_initial.txt" --classes "$work/library/classes.txt")
  run strata_at scan import library "$work/library/round/scans" "${import[@]}" --wait
  import=(--poses "$work/school/round/poses_initial.txt" --no-labels)
  run strata_at scan import school "$work/school/round/scans" "${import[@]}" --wait
  step "learning from the first"
  run strata_at classifier train library --method amn --name buildings --folds 2 --wait
  run strata_at classifier export library buildings --out "$out/buildings.model"
  step "labelling the second"
  run strata_at classifier import school "$out/buildings.model" --name buildings
  run strata_at job start school classify model=buildings --wait
  step "pictures and scores"
  run strata_at map render library "$out/library_classes.png" --layer class --view oblique
  run strata_at map render school "$out/school_classes.png" --layer class --view oblique
  run strata classifier evaluate "$out/buildings.model" --data "$work/school/round/scans" \
    --classes "$work/school/classes.txt" --picture "$out/school_confusion.png"
}

# drift TRUTH UPLOADED ALIGNED: how far the last pose is from the truth before and after alignment.
drift() {
  local truth uploaded aligned
  truth=$(grep -v '^#' "$1" | tail -n 1)
  uploaded=$(grep -v '^#' "$2" | tail -n 1)
  aligned=$(grep -v '^#' "$3" | tail -n 1)
  awk -v t="$truth" -v u="$uploaded" -v a="$aligned" 'BEGIN {
    split(t, T); split(u, U); split(a, A)
    printf "last pose is off by %.2f m as uploaded, %.3f m as aligned\n",
      sqrt((T[3]-U[3])^2 + (T[4]-U[4])^2 + (T[5]-U[5])^2), sqrt((T[3]-A[2])^2 + (T[4]-A[3])^2 + (T[5]-A[4])^2) }'
}

# ground X Y Z: the place on the highest surface below a sensor.
ground() {
  strata_at surface recorded --at "$1,$2" |
    awk -v x="$1" -v y="$2" -v z="$3" 'NR > 1 && $4 < z { best = $4; found = 1 }
                                       END { print x "," y "," (found ? best : z) }'
}

scans_in() { strata_at map show "$1" --output json | sed -n 's/^ *"scans": \([0-9]*\),$/\1/p'; }

# Levelled by the floor where one is seen; goes on with what could be read where some files are bad.
import_recorded() {
  run strata_at scan import recorded "$@" --level && return
  if [[ $(scans_in recorded) == 0 ]]; then
    run strata_at scan import recorded "$@" && return
  fi
  [[ $(scans_in recorded) != 0 ]] || exit 1
  echo "demo: goes on with the $(scans_in recorded) scans that could be read"
}

demo_recorded() {
  local scans=$data/scans poses=
  [[ -d $scans ]] || scans=$data
  for name in poses_initial poses_odometry poses_reference poses; do
    for file in "$data/$name"*.txt; do
      [[ -n $poses || ! -f $file ]] || poses=$file
    done
  done
  start_server
  step "import"
  run strata_at map create recorded --cell-size 0.1
  local options=(--trajectory recorded --align on --wait)
  [[ -z $poses ]] || options+=(--poses "$poses")
  import_recorded "$scans" "${options[@]}"
  step "the map"
  run strata_at map show recorded
  run strata_at pose export recorded --out "$out/poses.txt"
  step "a path between two places of the trajectory"
  # The first pose and the one farthest from it: time x y z qx qy qz qw.
  read -r x0 y0 z0 x1 y1 z1 < <(awk '!/^#/ { if (!n++) { x=$2; y=$3; z=$4 }
      d = ($2-x)^2 + ($3-y)^2; if (d >= best) { best = d; fx=$2; fy=$3; fz=$4 } }
      END { print x, y, z, fx, fy, fz }' "$out/poses.txt")
  run strata_at plan recorded --from "$(ground "$x0" "$y0" "$z0")" --to "$(ground "$x1" "$y1" "$z1")" \
    --max-gap 0.6 --out "$out/path.ply"
  local paths=()
  [[ ! -f $out/path.ply ]] || paths=(--path "$out/path.ply")
  step "pictures"
  run strata_at map render recorded "$out/recorded.png" --view oblique "${paths[@]}"
  run strata_at map render recorded "$out/recorded_top.png" "${paths[@]}"
}

rm -f "$out"/{over,under,deck_to_road,path}.ply
build
if [[ -n $data ]]; then
  demo_recorded
else
  demo_simulated
  [[ -n $short ]] || { demo_loop; demo_classes; }
fi
step "stopping the server"
kill -TERM "$server"
wait "$server"
server=
step "files in $out"
ls -1 "$out"
