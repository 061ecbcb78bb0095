#!/usr/bin/env bash
# Runs a command as root in a fresh Debian 12 that has nothing but apt, in /, and gives its exit code.
#   tests/bare/in_root.sh [--after SCRIPT] [--bind FOLDER[:AT]]… [--read-only FOLDER[:AT]]… COMMAND…
# Folders of the machine are mounted AT a path in the root (default: their own), in the order given. The root is
# made by mmdebstrap from the machine's own apt sources, fetched as the machine fetches, kept in ~/.cache/strata and made
# again when /etc/apt changes; what COMMAND does to it goes away. What SCRIPT, which needs nothing but itself, makes of it is kept there,
# too, until SCRIPT changes or the day ends. Needs root or sudo, mmdebstrap, and leave to mount.
set -euo pipefail

if [[ $EUID -ne 0 ]]; then
  command -v sudo >/dev/null || { echo "in_root: run as root or install sudo" >&2; exit 1; }
  exec sudo --preserve-env=HOME,TMPDIR,http_proxy,https_proxy,no_proxy "$0" "$@"
fi

usage() { sed -n '3p' "$0" >&2; exit 2; }
script=
mounts=()
while [[ $# -gt 0 && $1 == --* ]]; do
  case "$1" in
    --after) script=$2 ;;
    --bind) mounts+=("bind,rw $2") ;;
    --read-only) mounts+=("bind,ro $2") ;;
    *) usage ;;
  esac
  shift 2
done
[[ $# -gt 0 ]] || usage
command -v mmdebstrap >/dev/null || { echo "in_root: no mmdebstrap: deploy/install-packages.sh --dev" >&2; exit 1; }
unshare --mount --pid --fork true 2>/dev/null ||
  { echo "in_root: this machine lets nobody make namespaces (a container without CAP_SYS_ADMIN?)" >&2; exit 1; }

work=$(mktemp -d)
# Mounts are of a namespace of their own: nothing of the machine is below.
trap 'rm -rf --one-file-system "$work"' EXIT

# Of the machine's apt: where packages are and how they come, but none of its hooks.
cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list 2>/dev/null >"$work/sources.list" || true
cat /etc/apt/sources.list.d/*.sources 2>/dev/null >"$work/debian.sources" || true
apt-config dump Acquire >"$work/apt.conf"
key=$(cat "$0" "$work"/* | sha256sum | head -c 16)
kept=$HOME/.cache/strata/debian-$key.tar

make_kept() {
  mkdir -p "$(dirname "$kept")"
  rm -f "$(dirname "$kept")"/{debian,after}-*.tar
  sources=()
  for file in "$work"/*.list "$work"/*.sources; do [[ ! -s $file ]] || sources+=("$file"); done
  mmdebstrap --quiet --mode=root --variant=minbase --format=tar --aptopt="$work/apt.conf" bookworm "$kept.$$" "${sources[@]}" ||
    { rm -f "$kept.$$"; echo "in_root: mmdebstrap made no root from the sources in /etc/apt" >&2; exit 1; }
  mv "$kept.$$" "$kept"
}

root=$work/root
mkdir "$root"
unpack() { tar --extract --numeric-owner --file "$1" --directory "$root"; }

# Processes end, and mounts go, with the namespaces.
inside() {
  root=$1 count=$2
  shift 2
  mount --bind "$root" "$root" # so that / is a mount: a bare root can be made within a bare root
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  for _ in $(seq "$count"); do
    folder=${1#* }
    mount --bind "${folder%%:*}" "$root${folder#*:}"
    mount -o "remount,${1%% *}" "$root${folder#*:}"
    shift
  done
  exec chroot "$root" env --ignore-environment HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin "$@"
}
export -f inside
in_namespaces() {  # how many mounts, mounts…, command…
  unshare --mount --pid --fork --kill-child bash -euc 'inside "$@"' in_root "$root" "$@"
}

after=
if [[ -n $script ]]; then
  after=$(dirname "$kept")/after-$({ echo "$key" && date +%F && cat "$script"; } | sha256sum | head -c 16).tar
fi
if [[ -f $after ]]; then
  unpack "$after"
else
  [[ -f $kept ]] || make_kept
  unpack "$kept"
  cp --dereference /etc/hosts /etc/resolv.conf "$root/etc/"
  if [[ -n $script ]]; then
    cp "$script" "$root/script"
    in_namespaces 0 /script
    rm -f "$root/script" "$root"/var/cache/apt/archives/*.deb "$(dirname "$kept")"/after-*.tar
    # Without room for it the next run does all again.
    { tar --create --numeric-owner --file "$after.$$" --directory "$root" . && mv "$after.$$" "$after"; } || rm -f "$after.$$"
  fi
fi
cp --dereference /etc/hosts /etc/resolv.conf "$root/etc/"
for mount in "${mounts[@]}"; do
  folder=${mount#* }
  mkdir -p "$root${folder#*:}"
done
in_namespaces "${#mounts[@]}" "${mounts[@]}" "$@" ||
  { code=$?; echo "in_root: exit $code of: $*" >&2; exit "$code"; }
