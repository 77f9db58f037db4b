#!/usr/bin/env bash
# What each leave-out saves: the same scene with and without, seconds of a member (wall time behind the first batch) and bytes of the device at the
# peak. Rows of a pair are run in turn, so that a machine that drifts harms none; medians. Prints a table.
# usage: jobs/leave_outs.sh [build folder, build unless given] [cpu|gpu: sizes, cpu unless given] [rounds, 3 unless given] [further options of cohort run]
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build} size=${2:-cpu} rounds=${3:-3}
shift $(($# < 3 ? $# : 3))
"${PYTHON:-/usr/bin/python3}" - "$build/cohort" "$size" "$rounds" "$@" << 'PYTHON'
import re
import statistics
import subprocess
import sys
import tempfile

import h5py
import numpy

cohort, size, rounds, *options = sys.argv[1:]
fine = size == "gpu"
heart = [f"grid.dx_mm={2 if fine else 6}", "time.beats.at_most=1", f"torso.dx_mm={6 if fine else 12}"]
wave = [f"grid.dx_mm={1 if fine else 4}", "time.end_ms=200", f"torso.dx_mm={6 if fine else 12}"]
short = [f"grid.dx_mm={2 if fine else 4}", "time.end_ms=300", f"torso.dx_mm={6 if fine else 12}"]
slab = [f"grid.dx_mm={0.2 if fine else 0.5}", "time.end_ms=50"]
# Name, file, settings of both, with, without.
PAIRS = [
    ("torso and ECG of a beating heart", "heart", heart, ["outputs={ecg: {}, pv: {}}"], ["outputs={pv: {}}"]),
    ("torso and ECG, arrival times", "ecg", short, ["outputs={ecg: {}, activation: {}}"], ["outputs={activation: {}}"]),
    ("mechanics and circulation", "heart", heart, ["outputs={ecg: {}, pv: {}}"], ["outputs={ecg: {}}"]),
    ("reaction_eikonal, for eikonal", "ecg", short, ["scene.electrophysiology.activation=reaction_eikonal"], []),
    ("monodomain, for reaction_eikonal on twice the spacing", "speed", wave,
     [f"grid.dx_mm={0.5 if fine else 2}", "scene.electrophysiology.activation=monodomain"],
     ["scene.electrophysiology.activation=reaction_eikonal"]),
    ("mechanics on the wave's grid, not twice as coarse", "heart",
     [f"grid.dx_mm={2 if fine else 4}", "time.beats.at_most=1", "outputs={pv: {}}"], ["mechanics.dx_mm=0"],
     [f"mechanics.dx_mm={4 if fine else 8}"]),
    ("double precision, a time loop", "speed", wave, ["precision=double"], ["precision=single"]),
    ("double precision, a beating heart", "heart", heart + ["outputs={pv: {}}"], ["precision=double"], ["precision=single"]),
    ("displacement of two points", "arostica", [f"grid.dx_mm={3 if fine else 8}", "time.end_ms=100"], [], ["outputs={pv: {}}"]),
    ("activation times, a time loop", "speed", wave, ["outputs={ecg: {}, activation: {}}"], ["outputs={ecg: {}}"]),
    ("beats at probes, a time loop", "slab", slab, ["outputs={activation: {probes: {far_mm: [10, 3, 3]}, beats: true}}"],
     ["outputs={activation: {probes: {far_mm: [10, 3, 3]}}}"]),
]
UNITS = {"B": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9}


def run(file, settings, store):
    words = [word for setting in settings for word in ("--set", setting)]
    command = [cohort, "run", f"configs/{file}.yaml", "--store", store, *options, *words, "--set", "campaign.members=3",
               "--set", "campaign.members_per_device=1", "--set", "campaign.check_fraction=0"]
    result = subprocess.run(command, capture_output=True, text=True)
    line = next((line for line in result.stdout.splitlines() if line.endswith("of device memory at the peak")), None)
    if line is None:
        raise SystemExit(f"{' '.join(command)}\n{result.stderr[-2000:]}")
    number, unit = re.match(r"([\d.]+) (\w+)", line).groups()
    with h5py.File(store) as members:
        assert (members["status"][:] == 3).all(), (file, settings)
        return float(numpy.mean(members["members/wall_s"][1:])), float(number) * UNITS[unit] * 1e-6


print("| left out | scene | with, s | without, s | saved | with, MB | without, MB | saved |")
print("|---|---|---|---|---|---|---|---|")
with tempfile.TemporaryDirectory() as folder:
    count = 0
    for name, file, both, with_it, without in PAIRS:
        seconds, megabytes = {True: [], False: []}, {}
        for turn in range(int(rounds)):
            for asked in (True, False):
                count += 1
                taken, megabytes[asked] = run(file, both + (with_it if asked else without), f"{folder}/{count}.h5")
                seconds[asked].append(taken)
        a, b = statistics.median(seconds[True]), statistics.median(seconds[False])
        print(f"| {name} | {file} | {a:.3g} | {b:.3g} | {1 - b / a:.0%} | {megabytes[True]:.3g} | {megabytes[False]:.3g} | "
              f"{1 - megabytes[False] / megabytes[True]:.0%} |", flush=True)
text = subprocess.run([cohort, "plan", "configs/ecg.yaml", *options], capture_output=True, text=True).stdout
nx, ny, nz = map(int, re.search(r"grid +(\d+) x (\d+) x (\d+)", text).groups())
cells, segments = map(int, re.search(r"(\d+) cells in (\d+) segments", text).groups())
print(f"\nEmpty segments: of configs/ecg.yaml {nx * ny * nz} cells of the grid, {8 * segments} places in segments with tissue "
      f"({8 * segments / (nx * ny * nz):.0%}), {cells} cells of tissue.")
PYTHON
