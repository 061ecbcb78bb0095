#!/usr/bin/env bash
# Installs the Debian packages of a build with apt on a Debian 12 that has nothing but apt; stratad serves there as its service
# would, and strata uploads a simulated drive and plans in it.
#   tests/packages/install.sh BUILD_DIR
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(realpath "${1:?usage: tests/packages/install.sh BUILD_DIR}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cpack --config "$build/CPackConfig.cmake" -G DEB -B "$work/packages" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
"$build/tests/support/strata-simulate" bridge "$work/world" --seed 1 --noise-m 0.02 --noise-rad 0.003 --robot over >/dev/null
chmod -R a+rX "$work"

# No init system is there: the unit's user, checks and command are used without it.
serve='
  apt-get update -qq
  apt-get install -y -qq --no-install-recommends /packages/stratad_*.deb /packages/strata_*.deb >/tmp/apt 2>&1 || { cat /tmp/apt; exit 1; }
  sed -i "s|^listen = .*|listen = \"127.0.0.1:0\"|" /etc/strata/stratad.conf  # beside what else the machine runs
  unit=/lib/systemd/system/stratad.service
  as_service() { setpriv --reuid=strata --regid=strata --init-groups bash -c "$(sed -n "s/^$1=//p" $unit)"; }
  as_service ExecStartPre
  as_service ExecStart >/tmp/listening 2>/tmp/log &
  for _ in $(seq 100); do grep -q ^listening /tmp/listening && break; sleep 0.1; done
  grep ^listening /tmp/listening || { cat /tmp/log; exit 1; }
  strata() { command strata --server "$(sed -n "s/^listening //p" /tmp/listening)" "$@"; }
  strata map create bridge --cell-size 0.1 >/dev/null
  strata scan import bridge /world/over/scans --poses /world/over/poses_initial.txt --trajectory over --wait
  strata plan bridge --from -26,0,0 --to 26,0,0
  strata map render bridge /tmp/bridge.png >/dev/null
  [[ -s /tmp/bridge.png ]]
  find /var/lib/strata -exec stat -c "%a %U %n" {} +'
tests/bare/in_root.sh --read-only "$work/packages:/packages" --read-only "$work/world:/world" bash -euc "$serve"
echo "packages: installed on a machine with nothing but apt, served, imported, planned"
