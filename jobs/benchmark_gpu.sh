#!/usr/bin/env bash
# Speed on GPUs: builds into build-gpu, runs configs/speed.yaml at the thesis's three sizes and prints a table for
# tests/results/. With several ranks every run is also made with one, and the throughputs are compared.
# usage: jobs/benchmark_gpu.sh [ranks]     CMAKE_PREFIX_PATH names packages that lie in a folder of their own
set -euo pipefail
cd "$(dirname "$0")/.."
ranks=${1:-1}
python=${PYTHON:-python3}
cmake -S . -B build-gpu -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOHORT_TESTS=OFF > build-gpu.log 2>&1 || { tail -30 build-gpu.log; exit 1; }
cmake --build build-gpu >> build-gpu.log 2>&1 || { grep -E 'error|FAILED' build-gpu.log | head -20; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
run() {  # name, processes, then --set options
  local name=$1 processes=$2
  shift 2
  local launcher=(mpirun --oversubscribe --bind-to none -n "$processes")
  [ "$(id -u)" -eq 0 ] && launcher+=(--allow-run-as-root)
  "${launcher[@]}" build-gpu/cohort run configs/speed.yaml --store "$work/$name.h5" "$@" > "$work/$name.log" 2>&1 ||
    { tail -5 "$work/$name.log"; exit 1; }
  sed -n '/triad/,$p' "$work/$name.log" | head -6
}
sizes() {  # name suffix, processes: as many members for each process
  run "1mm$1" "$2" --set grid.dx_mm=1 --set campaign.members_per_device=1 --set campaign.members=$((10 * $2))
  run "half$1" "$2" --set grid.dx_mm=0.5 --set campaign.members_per_device=1 --set campaign.members=$((6 * $2))
  run "batch$1" "$2" --set grid.dx_mm=2 --set campaign.members_per_device=32 --set campaign.members=$((512 * $2))
}
sizes _1 1
# Set-up with a torso of its own for every member: nine elliptic solves each.
run torso 1 --set grid.dx_mm=1 --set campaign.members_per_device=1 --set campaign.members=10 \
  --set 'parameters.torso.half_width_mm={uniform: [165, 185]}'
[ "$ranks" -gt 1 ] && sizes "_$ranks" "$ranks"
# ECGs without a time loop, sizes of the heart sampled: hearts per hour stand in the last line.
echo "configs/eikonal.yaml"
build-gpu/cohort run configs/eikonal.yaml --store "$work/eikonal.store" > "$work/eikonal.log" 2>&1 || { tail -5 "$work/eikonal.log"; exit 1; }
sed -n '/triad/,$p' "$work/eikonal.log"
echo
echo "commit ${COMMIT:-$(git rev-parse --short HEAD 2> /dev/null || echo unknown)}, $(date -u +%F), $ranks process(es)"
"$python" -m analysis.speed $(ls -tr "$work"/*.h5)
