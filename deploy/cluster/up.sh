#!/usr/bin/env bash
# Several machines on one, for a look at what becomes of Strata when some of them are lost: two databases of PostgreSQL 15, which Patroni and
# etcd keep, the second the synchronous replica of the first, and three stratad. Two robots upload the simulated bridge; meanwhile the
# server that has the map is killed, and then the first database with its Patroni, whose place the second takes. At the end the first is the
# replica, and the map is that of one server alone: "digest equal".
#   deploy/cluster/up.sh [--build DIR]      programs: DIR/server/stratad … (build/release); else those on the PATH
# Needs postgresql-15, patroni and etcd-server; nothing of theirs that runs here already is touched. All is in a temporary folder, listens
# on 127.0.0.1 and ends with the script. Nothing in it asks for a password: others on this machine can reach it as long as it runs.
set -euo pipefail

build=
while [[ $# -gt 0 ]]; do
  case "$1" in
    --build) [[ $# -ge 2 ]] || { sed -n '6p' "$0" >&2; exit 2; }; build=$(cd "$2" && pwd); shift 2 ;;
    *) sed -n '6p' "$0" >&2; exit 2 ;;
  esac
done
postgres=/usr/lib/postgresql/15/bin
for program in "$postgres/postgres" patroni patronictl etcd; do
  command -v "$program" >/dev/null ||
    { echo "up: no $program; apt-get install postgresql-15 patroni python3-etcd etcd-server" >&2; exit 3; }
done
[[ -z $build ]] || PATH=$build/server:$build/client/cli:$build/tests/support:$PATH
for program in stratad strata strata-simulate; do
  command -v "$program" >/dev/null || { echo "up: no $program; build it, or name the folder with --build" >&2; exit 2; }
done

work=$(mktemp -d)
chmod 711 "$work"
user=$(id -un)
declare -A servers=() machines=() port=()
as_user=()
# PostgreSQL does not run as root.
if [[ $user == root ]]; then
  user=nobody
  as_user=(setpriv "--reuid=$user" "--regid=$(id -g "$user")" --clear-groups)
fi
install -d -m 700 -o "$user" "$work/db"
# What runs of a machine with a database, its Patroni first, which would start the rest again.
processes_of() {
  local parent
  for parent in "${machines[$1]}" $(head -n 1 "$work/db/$1/postmaster.pid"); do
    echo "$parent" "$(<"/proc/$parent/task/$parent/children")"
  done 2>/dev/null
}
lose() {  # the machine and all on it, at one blow
  # shellcheck disable=SC2046  # a list of numbers
  kill -KILL $(processes_of "$1") 2>/dev/null || true
  unset "machines[$1]"
}
stop_all() {
  local name
  for name in "${!servers[@]}"; do kill -KILL "${servers[$name]}" 2>/dev/null || true; done
  for name in "${!machines[@]}"; do lose "$name"; done
  [[ -z ${etcd:-} ]] || kill -KILL "$etcd" 2>/dev/null || true
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap "stop_all 2>/dev/null" EXIT
trap 'exit 130' INT TERM
step() { printf '== %s\n' "$*"; }
# Until the command succeeds, for at most five minutes.
await() {
  local end=$((SECONDS + 300))
  while ((SECONDS < end)); do "$@" >/dev/null 2>&1 && return; sleep 0.2; done
  echo "up: waited in vain for: $*" >&2
  return 1
}

# Ports that nobody listens at, below those that the system gives to connections, which could take that of a database that is down.
free_port=$((10000 + RANDOM % 20000))
for name in etcd peers db1 db2 db1_rest db2_rest; do
  while (exec 3<>"/dev/tcp/127.0.0.1/$free_port") 2>/dev/null; do ((free_port += 1)); done
  port[$name]=$((free_port++))
done
# One etcd here; three on machines of one's own, as a cluster without its etcd has no primary.
start_etcd() {
  local url=http://127.0.0.1:${port[etcd]} peers=http://127.0.0.1:${port[peers]}
  "${as_user[@]}" etcd --data-dir "$work/db/etcd" --listen-client-urls "$url" --advertise-client-urls "$url" --listen-peer-urls "$peers" \
    --initial-advertise-peer-urls "$peers" --initial-cluster "default=$peers" >"$work/etcd.log" 2>&1 &
  etcd=$!
}
# `ttl` is how long a primary's word holds that is not heard of again. Patroni's own 30, 10 and 10 seconds are for networks.
configure() {
  cat >"$work/$1.yml" <<END
scope: strata
name: $1
restapi: {listen: "127.0.0.1:${port[$1_rest]}", connect_address: "127.0.0.1:${port[$1_rest]}"}
etcd3: {host: "127.0.0.1:${port[etcd]}"}
bootstrap:
  dcs:
    ttl: 10
    loop_wait: 2
    retry_timeout: 4
    synchronous_mode: true
    postgresql: {use_pg_rewind: true, parameters: {shared_buffers: 64MB}}
  initdb: [{encoding: UTF8}, {locale: C}, {auth: trust}]
postgresql:
  listen: 127.0.0.1:${port[$1]}
  connect_address: 127.0.0.1:${port[$1]}
  bin_dir: $postgres
  data_dir: $work/db/$1
  pgpass: $work/db/$1.pgpass
  authentication: {superuser: {username: strata}, replication: {username: strata}}
  parameters: {unix_socket_directories: ''}
  pg_hba: ["host all,replication strata 127.0.0.1/32 trust"]
END
}
start_machine() {
  "${as_user[@]}" patroni "$work/$1.yml" >>"$work/$1.log" 2>&1 &
  machines[$1]=$!
}
machine_is() { timeout 10 patronictl -c "$work/db1.yml" list -f tsv | grep -qP "^strata\t$1\t[^\t]*\t$2\trunning\t"; }

step "two databases, each commit on both"
start_etcd
for name in db1 db2; do configure "$name"; done
start_machine db1
await machine_is db1 Leader
start_machine db2
await machine_is db2 "Sync Standby"
store="postgresql://strata@127.0.0.1:${port[db1]},127.0.0.1:${port[db2]}/postgres?target_session_attrs=read-write"

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
# However fast they are, one of them has scans left when the database is lost.
read -ra second <"/proc/$under/task/$under/children" || true
pause() { kill "-$1" "$under" "${second[@]}" 2>/dev/null || true; }
pause STOP
step "server a, which has the map, is killed ($(scans_of "$(address_of b)" bridge) scans)"
kill -KILL "${servers[a]}"
wait "${servers[a]}" 2>/dev/null || true
await some 15
before=$(scans_of "$(address_of b)" bridge)
step "the first database's machine is lost ($before scans)"
pause CONT
lose db1
lost=$SECONDS
await machine_is db2 Leader
await some $((before + 1))
step "the second has taken its place, uploads go on after $((SECONDS - lost)) s; the first comes back"
start_machine db1
for robot in "$over" "$under"; do
  wait "$robot" || { cat "$work/over.out" "$work/under.out" >&2; exit 1; }
done
settled() { strata --server "$1" map show "$2" | awk '$1 == "scans_pending" {exit $2 != 0}'; }
await settled "$(address_of b),$(address_of c)" bridge
await machine_is db1 "Sync Standby"
step "it is the replica now"

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
