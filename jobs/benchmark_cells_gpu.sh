#!/usr/bin/env bash
# Speed of ten Tusscher-Panfilov cells on a GPU: builds into build-gpu, runs configs/speed_cells.yaml as the slab of Niederer et al. 2011
# (dx 0.1 mm, 150 ms, 7500 steps) and as a block of 640,000 cells (500 ms, 25,000 steps), three members each, one after the other.
# usage: jobs/benchmark_cells_gpu.sh [build folder, made here unless given] [further options of cohort run, such as --device cpu]
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
build=${1:-}
shift || true
if [ -z "$build" ]; then
  build=build-gpu
  cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOHORT_TESTS=OFF > build-gpu.log 2>&1 || { tail -30 build-gpu.log; exit 1; }
  cmake --build "$build" >> build-gpu.log 2>&1 || { grep -E 'error|FAILED' build-gpu.log | head -20; exit 1; }
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
run() {  # name, then options
  local name=$1
  shift
  "$build/cohort" run configs/speed_cells.yaml --store "$work/$name.h5" "$@" > "$work/$name.log" 2>&1 || { tail -5 "$work/$name.log"; exit 1; }
}
run slab --set 'geometry.box.size_mm=[20, 7, 3]' --set grid.dx_mm=0.1 --set time.end_ms=150 \
  --set 'stimuli.face.upper_mm=[1.5, 1.5, 1.5]' "$@"
run block "$@"
"$python" - "$work/slab.h5" "$work/block.h5" << 'PYTHON'
import sys

import numpy as np

from analysis.store import Store

print("| scene | device | steps | stepping s | step us | step cells/s | step GB/s | of triad |")
print("|---|---|---|---|---|---|---|---|")
for path in sys.argv[1:]:
    with Store(path) as store:
        process = store.performance[0]
        step = [kernel for kernel in process.kernels if kernel.name == "monodomain_step"][0]
        members = int(store.done.sum())
        # Wall time of a member less its set-up; the first one waits for its kernels' compilation.
        stepping = float(np.median((store.column("wall_s") - store.column("setup_s"))[store.done][1:]))
        seconds = step.device_ms * 1e-3 / step.calls
        cells = process.cell_updates / step.calls
        rate = step.bytes_per_call / seconds * 1e-9
        print(f"| {path.split('/')[-1][:-3]} | {process.device} | {step.calls // members} | {stepping:.3f} | {seconds * 1e6:.1f} | "
              f"{cells / seconds:.3g} | {rate:.0f} | {rate / process.triad_GB_per_s:.0%} |")
PYTHON
