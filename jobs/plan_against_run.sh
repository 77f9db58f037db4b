#!/usr/bin/env bash
# What `cohort plan` says of scenes beside what `cohort run` then takes: seconds of a member behind the first two batches, of which one compiles and
# one has its launches timed, with the beats that members had where these are not known before, and bytes at the peak. Prints a table: scene, predicted s, measured s, ratio, stated MB, taken MB, ratio.
# Plan and run in turn; of the rounds the least counts, as another program's load only adds. SCENES="slab speed" takes these alone.
# usage: jobs/plan_against_run.sh [build folder, build unless given] [cpu|gpu: sizes of the scenes, cpu unless given] [rounds, 1 unless given]
#        [further options of both commands]
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build} size=${2:-cpu} rounds=${3:-1}
shift $(($# < 3 ? $# : 3))
"${PYTHON:-/usr/bin/python3}" - "$build/cohort" "$size" "$rounds" "$@" << 'PYTHON'
import os
import re
import subprocess
import sys
import tempfile

import h5py
import numpy

cohort, size, rounds, *options = sys.argv[1:]
chosen = os.environ.get("SCENES", "").split()
many = {"cpu": ["campaign.members=6"], "gpu": ["campaign.members=960", "campaign.members_per_device=32"]}[size]
alone = ["campaign.members=5", "campaign.members_per_device=1"]
fine = size == "gpu"
# A GPU at rest takes a second to reach its clock.
short = ["campaign.members=25", "campaign.members_per_device=1"] if fine else alone
one_beat = ["time.beats.at_most=1"]
# Three batches at least.
SCENES = [
    ("eikonal", [f"grid.dx_mm={2 if fine else 3}"] + many),
    ("ecg_campaign", [f"grid.dx_mm={2 if fine else 4}"] + many),
    ("speed", [f"grid.dx_mm={1 if fine else 3}", "time.end_ms=200"] + short),
    ("slab", [f"grid.dx_mm={0.2 if fine else 0.5}"] + short),
    ("bidomain", [f"grid.dx_mm={0.25 if fine else 0.5}", "time.end_ms=10"] + short),
    ("circulation", ["campaign.members=256", "campaign.members_per_device=64"]),
    ("demo", [f"grid.dx_mm={2 if fine else 6}"] + one_beat + (["campaign.members=160", "campaign.members_per_device=32"] if fine else alone)),
    ("heart", [f"grid.dx_mm={1 if fine else 6}"] + alone),
    ("arostica", [f"grid.dx_mm={3 if fine else 8}", "time.end_ms=200"] + alone),
    ("land_inflation", [f"grid.dx_mm={1 if fine else 2}"] + short),
    ("electromechanics", [f"grid.dx_mm={0.5 if fine else 1}", "time.end_ms=100"] + alone),
]
UNITS = {"B": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9}
SECONDS = {"s": 1, "min": 60, "h": 3600}


def seconds(text):
    return sum(float(number) * SECONDS[unit] for number, unit in re.findall(r"([\d.]+(?:e-?\d+)?) (s|min|h)\b", text))


def megabytes(text):
    number, unit = re.match(r"([\d.]+) (\w+)", text).groups()
    return float(number) * UNITS[unit] * 1e-6


def said(scene, settings):
    command = [cohort, "plan", f"configs/{scene}.yaml", *options, *settings]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    field = {name: next((line[len(name):].strip() for line in lines if line.startswith(name + " ")), "")
             for name in ("one member", "memory", "beats")}
    member, setup = field["one member"].split(", of which set-up ")
    beat = re.search(r"agree, (.*) a beat", field["beats"])
    return seconds(member), seconds(setup), seconds(beat.group(1)) if beat else None, megabytes(field["memory"])


def taken(scene, settings, store):
    command = [cohort, "run", f"configs/{scene}.yaml", "--store", store, *options, *settings]
    run = subprocess.run(command, capture_output=True, text=True)
    peak = next(line for line in run.stdout.splitlines() if line.endswith("of device memory at the peak"))
    with h5py.File(store) as file:
        wall = file["members/wall_s"][:]
        batches = wall[numpy.sort(numpy.unique(wall, return_index=True)[1])]  # in turn: members of a batch share its time
        behind = batches[2:] if len(batches) > 2 else batches[-1:]
        names = [name.decode() if isinstance(name, bytes) else name for name in file["features"].attrs["names"]]
        beats = float(numpy.mean(file["features"][:, names.index("beats")])) if "beats" in names else None
    return float(numpy.median(behind)), beats, megabytes(peak)


print("| scene | predicted s | measured s | ratio | beats | stated MB | taken MB | ratio |")
print("|---|---|---|---|---|---|---|---|")
with tempfile.TemporaryDirectory() as folder:
    for scene, settings in SCENES:
        if chosen and scene not in chosen:
            continue
        # Checks are runs of another grid.
        settings = [word for setting in settings + ["campaign.check_fraction=0"] for word in ("--set", setting)]
        predictions, measurements = [], []
        for turn in range(int(rounds)):
            member, setup, beat, stated = said(scene, settings)
            measured, beats, peak = taken(scene, settings, f"{folder}/{scene}{turn}.h5")
            predictions.append(member if beat is None else setup + beats * beat)
            measurements.append(measured)
        member, measured = min(predictions), min(measurements)
        print(f"| {scene} | {member:.3g} | {measured:.3g} | {member / measured:.2f} | {'' if beats is None else f'{beats:.3g}'} | "
              f"{stated:.4g} | {peak:.4g} | {peak / stated:.3f} |", flush=True)
PYTHON
