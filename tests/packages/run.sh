#!/usr/bin/env bash
# Makes the Debian packages of a build, unpacks them beside each other and runs what is in them.
#   tests/packages/run.sh BUILD_DIR
set -euo pipefail
build=$(realpath "${1:?usage: tests/packages/run.sh BUILD_DIR}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cpack --config "$build/CPackConfig.cmake" -G DEB -B "$work/packages" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
for name in stratad strata libstrata-dev python3-strata strata-ros2; do
  dpkg-deb --extract "$work"/packages/"${name}"_*.deb "$work/root"
done
root=$work/root
sed -i "s|/var/lib/strata|$work/maps|" "$root/etc/strata/stratad.conf"
# What the service does before it starts: no file in the folder of maps may keep it from that.
mkdir "$work/maps"
echo "of another program" >"$work/maps/foreign.strata"
sed "s|/usr/bin|$root/usr/bin|; s|/etc/strata|$root/etc/strata|" "$root/lib/systemd/system/stratad.service" >"$work/stratad.service"
before=$(sed -n 's/^ExecStartPre=//p' "$work/stratad.service")
timeout 60 $before || { echo "packages: ExecStartPre=$before ends with $?" >&2; exit 1; }
# The nightly copies: off by default, and their command does what the unit says.
for unit in strata-backup.service strata-backup.timer; do
  sed "s|/usr/lib/strata|$root/usr/lib/strata|" "$root/lib/systemd/system/$unit" >"$work/$unit"
done
[[ ! -e $root/etc/systemd/system/timers.target.wants/strata-backup.timer ]] || { echo "packages: the backup timer is on" >&2; exit 1; }
faults=$(systemd-analyze verify --man=no "$work/stratad.service" "$work/strata-backup.service" "$work/strata-backup.timer" 2>&1)
[[ -z $faults ]] || { echo "packages: $faults" >&2; exit 1; }
"$root/usr/bin/strata" --embedded "$work/maps" map create yard >/dev/null
PYTHONPATH=$root/usr/lib/python3/dist-packages /usr/bin/python3 -c 'import strata, strata.native; strata.connect; assert strata.native.LIBRARY, "_tiles.so does not load"'
backup=$(sed -n 's/^ExecStart=//p' "$work/strata-backup.service")
mkdir "$work/copies"
coproc server { exec "$root/usr/bin/stratad" --data "$work/maps" --listen 127.0.0.1:0 2>"$work/stratad.log"; }
server_pid=$!
read -r _ address <&"${server[0]}"
STRATA_PROGRAM=$root/usr/bin/strata STRATA_SERVER=$address STRATA_BACKUP_DIR=$work/copies $backup >"$work/backup.log" 2>&1 || {
  cat "$work/backup.log" >&2
  exit 1
}
kill "$server_pid"
[[ $(ls "$work/copies") == yard@*.strata ]] || { echo "packages: $backup made $(ls "$work/copies")" >&2; exit 1; }
depends=$(dpkg-deb --field "$work"/packages/python3-strata_*.deb Depends)
[[ $depends == *python3-grpcio* && $depends == *libzstd1* ]] || { echo "packages: python3-strata depends on $depends" >&2; exit 1; }
"$root/usr/bin/strata-ros2" --version >/dev/null
depends=$(dpkg-deb --field "$work"/packages/strata-ros2_*.deb Depends)
[[ $depends == *libddsc* && $depends != *libceres* ]] || { echo "packages: strata-ros2 depends on $depends" >&2; exit 1; }
# What shells want: pages that man shows without a complaint, scripts where they look for them that complete a word.
for page in man1/strata.1 man1/strata-map-create.1 man1/strata-plan.1 man1/strata-ros2.1 man8/stratad.8 man8/stratad-token-add.8; do
  [[ -s $root/usr/share/man/$page.gz ]] || { echo "packages: no page $page" >&2; exit 1; }
done
if command -v mandoc >/dev/null; then
  for page in "$root"/usr/share/man/man?/strata*; do
    faults=$(zcat "$page" | mandoc -Tlint -W warning 2>&1) || { echo "packages: ${page##*/}: $faults" >&2; exit 1; }
  done
fi
completed=$(PATH=$root/usr/bin:$PATH bash -c "source $root/usr/share/bash-completion/completions/strata
  COMP_LINE='strata --embedded $work/maps map show y'
  COMP_POINT=\${#COMP_LINE}; _strata; echo \"\${COMPREPLY[*]}\"")
[[ $completed == yard ]] || { echo "packages: bash completes '$completed', not yard" >&2; exit 1; }
for file in usr/share/zsh/vendor-completions/_strata usr/share/fish/vendor_completions.d/strata.fish lib/systemd/system/stratad.service usr/share/doc/stratad/README.md usr/include/strata/core/api/database.h; do
  [[ -s $root/$file ]] || { echo "packages: no $file" >&2; exit 1; }
done
echo "packages: $(cd "$work/packages" && ls ./*.deb | wc -l), unpacked and run"
