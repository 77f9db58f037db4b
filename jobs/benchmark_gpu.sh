#!/usr/bin/env bash
# Speed on a GPU: builds into build-gpu and runs configs/speed.yaml at the thesis's three sizes. Prints the reports.
# usage: jobs/benchmark_gpu.sh [ranks]     with CMAKE_PREFIX_PATH set where packages lie in a folder of their own
set -euo pipefail
cd "$(dirname "$0")/.."
ranks=${1:-1}
cmake -S . -B build-gpu -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOHORT_TESTS=OFF > build-gpu.log 2>&1 || { tail -30 build-gpu.log; exit 1; }
cmake --build build-gpu >> build-gpu.log 2>&1 || { grep -E 'error|FAILED' build-gpu.log | head -20; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
launcher=()
if [ "$ranks" -gt 1 ]; then launcher=(mpirun --allow-run-as-root --oversubscribe -n "$ranks"); fi
run() {
  echo "== $*"
  "${launcher[@]}" build-gpu/cohort run configs/speed.yaml --store "$work/$RANDOM.h5" "$@" 2>&1 | grep -vE 'info (created|rank)'
}
build-gpu/cohort devices
run --set grid.dx_mm=1 --set campaign.members_per_device=1 --set campaign.members=5
run --set grid.dx_mm=0.5 --set campaign.members_per_device=1 --set campaign.members=3
run --set grid.dx_mm=2 --set campaign.members=192
