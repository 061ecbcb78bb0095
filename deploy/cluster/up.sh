#!/usr/bin/env bash
# Several servers on one machine, for a look at what becomes of it when some of them die: two databases of PostgreSQL 15, the second the
# synchronous replica of the first, and three stratad. Two robots upload the simulated bridge; meanwhile the server that has the map and
# then the first database are killed, and the replica takes over. At the end the map is that of one server alone: "digest equal".
#   deploy/cluster/up.sh [--build DIR]      programs: DIR/server/stratad … (build/release); else those on the PATH
# The replica is promoted by this script: no Patroni, no etcd, which do that on machines of one's own (README.md, "Several servers").
# Needs postgresql-15. Everything is in a temporary folder and ends with the script.
set -euo pipefail

build=
while [[ $# -gt 0 ]]; do
  case "$1" in
    --build) [[ $# -ge 2 ]] || { sed -n '5,6p' "$0" >&2; exit 2; }; build=$(cd "$2" && pwd); shift 2 ;;
    *) sed -n '5,6p' "$0" >&2; exit 2 ;;
  esac
done
postgres=$(ls -d /usr/lib/postgresql/15/bin 2>/dev/null) || { echo "up: postgresql-15 is not installed" >&2; exit 3; }
[[ -z $build ]] || PATH=$build/server:$build/client/cli:$build/tests/support:$PATH
for program in stratad strata strata-simulate; do
  command -v "$program" >/dev/null || { echo "up: no $program; build it, or name the folder with --build" >&2; exit 2; }
done

work=$(mktemp -d)
chmod 711 "$work"
user=$(id -un)
declare -A servers=()
as_user=()
# PostgreSQL does not run as root.
if [[ $user == root ]]; then
  user=nobody
  as_user=(setpriv "--reuid=$user" "--regid=$(id -g "$user")" --clear-groups)
fi
install -d -o "$user" "$work/db"
control() { "${as_user[@]}" "$postgres/pg_ctl" --pgdata "$work/db/$1" --silent "${@:2}"; }
stop_all() {
  local name
  for name in "${!servers[@]}"; do kill -KILL "${servers[$name]}" 2>/dev/null || true; done
  for name in first second; do control "$name" stop --mode immediate 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap stop_all EXIT
step() { printf '== %s\n' "$*"; }
query() { "${as_user[@]}" "$postgres/psql" -h "$work/db" -p "$1" -U strata -d postgres -qAtc "$2"; }
# Until the command succeeds, for at most a minute.
await() {
  local end=$((SECONDS + 60))
  while ((SECONDS < end)); do "$@" >/dev/null 2>&1 && return; sleep 0.2; done
  echo "up: waited in vain for: $*" >&2
  return 1
}
start_database() {  # name, port
  control "$1" start --wait --log "$work/db/$1.log" --options \
    "-c listen_addresses='' -c unix_socket_directories='$work/db' -p $2 -c shared_buffers=64MB"
}

step "two databases, each commit on both"
"${as_user[@]}" "$postgres/initdb" --pgdata "$work/db/first" --username strata --auth trust --encoding UTF8 --locale C >/dev/null
start_database first 5001
"${as_user[@]}" "$postgres/pg_basebackup" --pgdata "$work/db/second" -h "$work/db" -p 5001 -U strata --write-recovery-conf --wal-method stream
start_database second 5002
query 5001 "ALTER SYSTEM SET synchronous_standby_names = '*'"
query 5001 "SELECT pg_reload_conf()" >/dev/null
replicated() { [[ $(query 5001 "SELECT sync_state FROM pg_stat_replication") == sync ]]; }
await replicated
store="postgresql://strata@/postgres?host=$work/db,$work/db&port=5001,5002&target_session_attrs=read-write"

start_server() {  # name, further options
  stratad --data "$work/$1" --listen 127.0.0.1:0 --server-name "$1" "${@:2}" >"$work/$1.out" 2>"$work/$1.log" &
  servers[$1]=$!
}
address_of() { sed -n 's/^listening //p' "$work/$1.out"; }
listens() { [[ -n $(address_of "$1") ]]; }
step "three servers"
for name in a b c; do start_server "$name" --store "$store" --map-lease 2; done
for name in a b c; do await listens "$name"; done
all=$(address_of a),$(address_of b),$(address_of c)

strata-simulate bridge "$work/world" --step 1 >/dev/null
upload() {  # addresses, robot, map
  strata --server "$1" scan import "$3" "$work/world/$2/scans" --poses "$work/world/$2/poses_initial.txt" --trajectory "$2" --align off
}
scans_of() { strata --server "$1" map show "$2" 2>/dev/null | awk '$1 == "scans" {print $2}'; }
strata --server "$(address_of a)" map create bridge >/dev/null
step "two robots upload"
upload "$all" over bridge >"$work/over.out" 2>&1 & over=$!
upload "$all" under bridge >"$work/under.out" 2>&1 & under=$!
some() { (($(scans_of "$(address_of b)" bridge) >= $1)); }
await some 5
step "server a, which has the map, is killed ($(scans_of "$(address_of b)" bridge) scans)"
kill -KILL "${servers[a]}"
wait "${servers[a]}" 2>/dev/null || true
await some 15
step "the first database is killed, the second takes its place ($(scans_of "$(address_of b)" bridge) scans)"
control first stop --mode immediate
control second promote --wait
query 5002 "ALTER SYSTEM RESET synchronous_standby_names"
query 5002 "SELECT pg_reload_conf()" >/dev/null
for robot in "$over" "$under"; do
  wait "$robot" || { cat "$work/over.out" "$work/under.out" >&2; exit 1; }
done
settled() { strata --server "$1" map show "$2" | awk '$1 == "scans_pending" {exit $2 != 0}'; }
await settled "$(address_of b),$(address_of c)" bridge

step "the same scans to one server with files"
start_server alone
await listens alone
strata --server "$(address_of alone)" map create bridge >/dev/null
for robot in over under; do upload "$(address_of alone)" "$robot" bridge >/dev/null 2>&1; done
await settled "$(address_of alone)" bridge
digest() { strata --server "$1" map show "$2" | awk '$1 == "content_digest" {print $2}'; }
shared=$(digest "$(address_of b),$(address_of c)" bridge)
alone=$(digest "$(address_of alone)" bridge)
echo "$(scans_of "$(address_of b)" bridge) scans, $shared"
if [[ -z $shared || $shared != "$alone" ]]; then
  echo "digests differ: $shared, alone $alone ($(scans_of "$(address_of alone)" bridge) scans)" >&2
  exit 1
fi
echo "digest equal"
