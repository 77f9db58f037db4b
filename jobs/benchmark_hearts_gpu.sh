#!/usr/bin/env bash
# Speed of beating hearts on a GPU: builds into build-gpu, then runs one beat of configs/heart.yaml at 2 and 1 mm (the second of two runs
# counts: the first compiles) and, at 2 mm, members of configs/demo.yaml with sampled sizes, three beats each, once with the density of tissue and
# once with twice that, which hardly changes a loop (solver/README.md).
# usage: jobs/benchmark_hearts_gpu.sh [build folder, made here unless given] [members, 126 unless given] [coarsening of all spacings, 1]
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-} members=${2:-126} coarser=${3:-1}
if [ -z "$build" ]; then
  build=build-gpu
  cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOHORT_TESTS=OFF > build-gpu.log 2>&1 || { tail -30 build-gpu.log; exit 1; }
  cmake --build "$build" >> build-gpu.log 2>&1 || { grep -E 'error|FAILED' build-gpu.log | head -20; exit 1; }
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
run() {  # name, file, then options
  local name=$1 file=$2
  shift 2
  "$build/cohort" run "$file" --store "$work/$name.h5" "$@" > "$work/$name.log" 2>&1 || { tail -5 "$work/$name.log"; exit 1; }
  echo "$name: $(grep ' on 1 rank in ' "$work/$name.log")"
  grep -E 'triad|^solid_' "$work/$name.log"
}
one_beat=(--set time.beats.at_most=1 --set mechanics.dx_mm=0)
run 2mm_compiles configs/heart.yaml --set "grid.dx_mm=$((2 * coarser))" "${one_beat[@]}"
run 2mm configs/heart.yaml --set "grid.dx_mm=$((2 * coarser))" "${one_beat[@]}"
run 1mm configs/heart.yaml --set "grid.dx_mm=$coarser" "${one_beat[@]}"
many=(--set "grid.dx_mm=$((2 * coarser))" --set time.beats.at_most=3 --set "campaign.members=$members" --set campaign.check_fraction=0)
run many configs/demo.yaml "${many[@]}"
run many_twice_the_density configs/demo.yaml "${many[@]}" --set mechanics.density_mg_per_mm3=2.12
