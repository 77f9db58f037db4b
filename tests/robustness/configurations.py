#!/usr/bin/env python3
"""Every file in configs/ runs to its end on a coarse grid, and what it records are numbers.

usage: configurations.py COHORT SOURCE_DIR
"""
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy

COARSE = ["grid.dx_mm=6", "time.end_ms=20", "campaign.members=2"]
OTHERWISE = {
    "slab": ["grid.dx_mm=1", "time.end_ms=5"],  # 3 mm thick
    "bidomain": ["grid.dx_mm=1", "time.end_ms=5"],
    "cell": ["time.end_ms=20"],
    "niederer": ["grid.dx_mm=1", "time.end_ms=5"],
    "reentry": ["grid.dx_mm=2"],
    "restitution": ["grid.dx_mm=0.5"],
    "land_inflation": ["grid.dx_mm=2"],
    "land_contraction": ["grid.dx_mm=2"],
    "arostica": ["grid.dx_mm=8"],
    "electromechanics": ["grid.dx_mm=1"],
}
ONE_BEAT = ["grid.dx_mm=6", "time.beats.at_most=1", "campaign.members=2"]
INSTEAD = {
    "circulation": ["time.beats.at_most=3", "campaign.members=2"],  # no tissue, no grid
    "heart": ONE_BEAT,
    "whole_heart": ONE_BEAT,
    "labels_heart": ONE_BEAT,
    "demo": ONE_BEAT,
    "windkessel": ONE_BEAT + ["mechanics.dx_mm=0"],
}
DONE = 3


def coarse(name):
    values = INSTEAD.get(name, COARSE + OTHERWISE.get(name, []))
    return [argument for value in values for argument in ("--set", value)]


def failure(cohort, config, store):
    """What went wrong, or None."""
    command = [cohort, "run", str(config), "--device", "cpu", "--store", str(store), *coarse(config.stem)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != 0:
        return f"exit code {result.returncode}: {result.stderr[-1000:]}"
    with h5py.File(store) as file:
        if len(file["status"]) != 2 or (file["status"][:] != DONE).any():
            return f"status {file['status'][:]}"
        if "ecg" in file and not (numpy.isfinite(file["ecg"][:]).all() and numpy.ptp(file["ecg"][:]) > 0):
            return "the ECG is flat or not finite"
        names = list(file["features"].attrs["names"])
        activated = [i for i, name in enumerate(names) if name.startswith("activated")]
        if activated and not (file["features"][:, activated] > 0).any():
            return "no tissue is activated"
        if "pv" in file and not all(numpy.isfinite(file[path][:]).all() and
                                    (file[path].shape[2] == 1 or numpy.ptp(file[path][:], axis=2).min() > 0)
                                    for path in ("pv/pressure", "pv/volume")):
            return "a pressure or a volume is constant or not finite"
        if "displacement" in file and not (numpy.isfinite(file["displacement"][:]).all() and
                                           numpy.abs(file["displacement"][:]).max() > 0):
            return "nothing moves, or a displacement is not finite"
        if "ecg" not in file and not activated and "pv" not in file:
            return "nothing is recorded"
    return None


def main(cohort, source):
    failures = 0
    configs = sorted((pathlib.Path(source) / "configs").glob("*.yaml"))
    with tempfile.TemporaryDirectory() as folder:
        for config in configs:
            reason = failure(cohort, config, pathlib.Path(folder) / f"{config.stem}.h5")
            print(f"{'FAILED' if reason else 'ok    '} {config.name} {reason or ''}")
            failures += reason is not None
    return 1 if failures or not configs else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
