#!/usr/bin/env bash
# Installs the Debian 12 packages that are missing. Called by jobs/demo.sh, tests/run.sh and tests/sanitise.sh.
# Installs nothing and asks for nothing where all are there.
set -euo pipefail

packages=(
  g++ cmake ninja-build
  ocl-icd-opencl-dev opencl-clhpp-headers pocl-opencl-icd
  libopenmpi-dev openmpi-bin
  libhdf5-dev zlib1g-dev libnifti-dev libyaml-cpp-dev libspdlog-dev libcli11-dev libgtest-dev
  python3-h5py python3-numpy python3-scipy python3-matplotlib
)

if ! command -v dpkg-query > /dev/null || ! command -v apt-get > /dev/null; then
  echo "jobs/setup.sh: not a Debian system; needed are what these packages of Debian 12 hold: ${packages[*]}" >&2
  exit 0  # they may be there under other names: CMake says what it does not find
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query --show --showformat='${db:Status-Status}' "$package" 2> /dev/null | grep -qx installed || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then exit 0; fi
echo "jobs/setup.sh: missing packages: ${missing[*]}"

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo > /dev/null; then
    echo "jobs/setup.sh: neither root nor sudo; ask for: apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
"${as_root[@]}" apt-get update -q > "$log" 2>&1 || true  # one repository out of reach need not matter
if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}" \
    >> "$log" 2>&1; then
  tail -20 "$log" >&2
  echo "jobs/setup.sh: apt-get could not install: ${missing[*]}" >&2
  exit 1
fi
echo "jobs/setup.sh: installed"
