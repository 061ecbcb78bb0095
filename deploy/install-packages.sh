#!/usr/bin/env bash
# Installs what Strata needs from Debian 12's packages; as root or with sudo. Does nothing where all is there.
#   deploy/install-packages.sh          to build and run
#   deploy/install-packages.sh --dev    and to test, lint and measure
set -euo pipefail

packages=(
  ca-certificates ccache cmake g++ git mold ninja-build pkg-config
  libabsl-dev libassimp-dev libboost-dev libbz2-dev libceres-dev libcli11-dev libeigen3-dev libexpat1-dev libfcl-dev libgeographiclib-dev libgoogle-glog-dev
  libgrpc++-dev liblz4-dev liblzf-dev libmeshoptimizer-dev libnanoflann-dev libopenblas-serial-dev libpcap-dev libpcl-dev libpng-dev libpq-dev libprotobuf-dev
  libqhull-dev libsqlite3-dev libssl-dev libtiff-dev liburdfdom-dev libxxhash-dev libyaml-cpp-dev libzstd-dev nlohmann-json3-dev prometheus-cpp-dev
  protobuf-compiler protobuf-compiler-grpc python3 zlib1g-dev
)
# prometheus is there for its promtool, etcd-server and postgresql-15 for tests that start their own; where systemd runs they serve at this
# machine's ports 9090, 2379 and 5432 until `systemctl disable --now prometheus etcd postgresql`.
# The viewer's nodejs and npm, and the chromium of its tests (tests/run.sh --full), are left to whoever wants it: what npm needs is hundreds of
# packages, a nodejs of other origin has its own npm and conflicts with Debian's, and the gate installs --dev.
# strata-ros2 is built where cyclonedds-dev and cyclonedds-tools are; libfastrtps-dev is the robot that it is tried on.
if [[ "${1:-}" == --dev ]]; then
  packages+=(clang clang-format clang-tidy coinor-libclp-dev coinor-libipopt-dev cyclonedds-dev cyclonedds-tools dpkg-dev etcd-server file fish libbenchmark-dev libcgal-dev libclang-rt-dev libdlib-dev libfastrtps-dev libgdal-dev libgmock-dev libgtest-dev liboctomap-dev libtinygltf-dev mandoc mmdebstrap mypy openssl patroni postgresql-15 prometheus python3-etcd python3-grpcio python3-numpy python3-pip python3-protobuf python3-setuptools python3-venv python3-wheel python3-xarray python3-xxhash python3-yaml python3-zstandard sqlite3 systemd zsh)
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

as_root=()
if [[ $EUID -ne 0 ]]; then
  command -v sudo >/dev/null || { echo "install-packages: run as root or install sudo" >&2; exit 1; }
  as_root=(sudo)
fi
echo "installing: ${missing[*]}" >&2
"${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2
