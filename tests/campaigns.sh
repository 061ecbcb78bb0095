#!/usr/bin/env bash
# Long campaigns, by hand, on the release build (tests/README.md says how to build it).
#   tests/campaigns.sh                       what there is, what each costs and would find
#   tests/campaigns.sh NAME… [--seed N]      runs them one after the other; exits 1 where one found something
#   tests/campaigns.sh all [--seed N]
set -euo pipefail
cd "$(dirname "$0")/.."

build=${STRATA_BUILD:-build/release}
experiments=$build/tests/experiments
seed=1

# name | minutes on two cores, ~ where nobody has timed it | what it would find | command; $seed is put in
campaigns() {
  cat <<LIST
kills|35|an acknowledged scan, deletion or label that is lost or there twice after SIGKILL|$experiments/kill_campaign --seed $seed kills --work
aligned_kills|10|the same where scans are aligned|$experiments/kill_campaign --seed $seed --align kills --server-kills 30 --robot-kills 20
terms|~5|the same after SIGTERM|$experiments/kill_campaign --seed $seed terms
clocks|~2|the same where the wall clock is set back and forward|$experiments/kill_campaign --seed $seed clock
cluster|~6|the same where servers of one database are killed and frozen, and it crashes|$experiments/kill_campaign --seed $seed --robots 2 --period-ms 150 --columns 320 cluster
cluster_work|~8|the same with jobs, deletions, labels and backups|$experiments/kill_campaign --seed $seed --robots 2 --period-ms 150 --columns 320 cluster --work
cluster_unfenced|~4|a campaign that does not notice servers that write maps of others|$experiments/kill_campaign --seed $seed --robots 4 --period-ms 60 --columns 160 cluster --faults 30 --no-fence
disks|90|a broken promise on a disk that fails, fills up or loses power|env TMPDIR=/dev/shm $experiments/disk_campaign --every 40 --seed $seed
flips|~10|a flipped bit of a map's file that nobody notices|env TMPDIR=/dev/shm $experiments/disk_campaign --flips 60 --seed $seed
watchers|~20|a change that a watcher is not told of|env STRATA_RUNS=1000 $build/tests/core/engine/engine_watch_model_test
optimize_crash|8|a map that an optimize job leaves half done|env STRATA_KILLS=30 STRATA_SEED=$seed $build/tests/integration/optimize_crash_test
classify_crash|8|the same for jobs that learn and label|env STRATA_KILLS=30 STRATA_SEED=$seed $build/tests/integration/classify_crash_test
thesis|~4|a table or figure of the thesis whose bounds no longer hold (the gate has samples of some)|tests/experiments/results.py --build $build table_7_1 fig_7_9 directions table_5_1 planes_walls planes_rack planes_boxes planes_corridor planes_jacket planes_carpet table_4_1 table_4_2 fig_6_1
lost_answers|~3|a commit whose lost answer leaves something else than was said|env STRATA_LOST_ANSWERS=1 $build/tests/core/engine/engine_lost_answers_test
memory|~3|an allocation that fails and ends or hangs more than its work|env STRATA_MEMORY_FAULTS=200 STRATA_SEED=$seed $build/tests/core/engine/engine_memory_fault_test
hostile|9|an attack that slows others down, takes memory or stops the server|/usr/bin/python3 tests/experiments/hostile_clients.py --build $build --seconds 12 --seed $seed
fuzzers|15|an input that a decoder, reader or call does not survive|tests/fuzz/run.sh 720
endurance|11|memory or latency that grows|/usr/bin/python3 tests/bench/endurance.py --build $build
loops|~10|simulated loops that do not close|/usr/bin/python3 tests/experiments/loops.py --build $build
subsets|~25|recordings in parts, backwards, by two robots, that end off|/usr/bin/python3 tests/experiments/subsets.py --build $build --seed $seed
fleet|~15|robots of a fleet that are put where neither they nor the world are|$experiments/fleet --seed $seed --draws 4
path_uncertainty|3|a way that is known worse than the pose graph says|$experiments/path_uncertainty --seed $seed
tracking|~6|a robot that is not where it is said to be, or not found again|$experiments/tracking --seeds 5
two_sides|~40|a thin deck or wall that is drawn together, or pulls scans to its other side|/usr/bin/python3 tests/experiments/two_sides.py --build $build --seed $seed
localisation|~20|a scan from elsewhere that is given a place in a map|/usr/bin/python3 tests/experiments/localisation.py --build $build --seed $seed
ros2|14|a keyframe of a robot of ROS 2 that is lost or otherwise in the map than its recording, memory of strata-ros2|$experiments/ros2_campaign
egomotion|~5|a filter of IMU, wheels and GPS that is off by more than its bounds|tests/experiments/results.py --build $build husky dresden simulated_car
car_maps|~12|a car's way of 2.3 km that is off by more than closures should leave, or a map larger than the thesis'|/usr/bin/python3 tests/experiments/car_maps.py --build $build --seed $seed
paced|8|a scan that is not in the map within 2 s while loops are closed|/usr/bin/python3 tests/experiments/paced.py --build $build
recordings|4|recorded drives that end off|/usr/bin/python3 tests/experiments/real_data.py --build $build
runbook|~6|a page of the runbook that does not help (as root)|/usr/bin/python3 tests/experiments/runbook.py --build $build
LIST
}

list() { campaigns | awk -F'|' '{ printf "%-15s %3s min  %s\n", $1, $2, $3 }'; }

names=()
while (($#)); do
  case $1 in
    --seed) seed=${2:?--seed needs a number}; shift ;;
    -h | --help) sed -n '2,5p' "$0"; list; exit 0 ;;
    *) names+=("$1") ;;
  esac
  shift
done
if ((${#names[@]} == 0)); then
  sed -n '3,5p' "$0"
  list
  exit 0
fi
[[ ${names[0]} != all ]] || mapfile -t names < <(campaigns | cut -d'|' -f1)

cmake --build "$build" --target experiments
found=0
rows=()
for name in "${names[@]}"; do
  command=$(campaigns | awk -F'|' -v name="$name" '$1 == name { print $4 }')
  [[ -n $command ]] || { echo "campaigns: no campaign '$name'; they are:" >&2; list >&2; exit 2; }
  printf '\n== %s: %s\n' "$name" "$command" >&2
  begun=$SECONDS
  status=0
  $command || status=$?
  case $status in
    0) answer="nothing found" ;;
    77) answer="left out: data are absent" ;;
    *) answer="ended with $status"; found=1 ;;
  esac
  rows+=("$(printf '%-15s %5.1f min  %s' "$name" "$(awk "BEGIN { print ($SECONDS - $begun) / 60 }")" "$answer")")
done
printf '%s\n' "" "${rows[@]}"
exit $found
