#!/usr/bin/env bash
# Does what `accuracy:` promises hold? Random members of the default heart with `accuracy: {LV_EF: 1 %, QRS: 3 ms}`, and the same members two levels
# finer than the setting that it took: every length of its grids halved twice. Prints a row for each member and how many hold. The finer stores are
# kept in the folder, so that a run that was cut short goes on: for a GPU, hours of it where the setting is fine.
# usage: jobs/accuracy_against_finer.sh [build folder, build unless given] [folder for the stores, . unless given] [members, 20 unless given]
#        [further options of cohort run]; several ranks: LAUNCHER="mpirun -n 2"
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build} folder=${2:-.} members=${3:-20}
shift $(($# < 3 ? $# : 3))
"${PYTHON:-/usr/bin/python3}" - "$build/cohort" "$folder" "$members" "$@" << 'PYTHON'
import os
import pathlib
import re
import subprocess
import sys

import h5py
import numpy

cohort, folder, members, *options = sys.argv[1:]
folder = pathlib.Path(folder)
launcher = os.environ.get("LAUNCHER", "").split()
WISHED = {"lv_ef_percent": ("%", 1), "ecg_QRS_ms": ("ms", 3)}
study = pathlib.Path("configs/studies/heart.yaml").read_text()
sampled = re.search(r"\n  parameters:\n((?:    .*\n)+)", study).group(1)
campaign = folder / "accuracy.yaml"
campaign.write_text(pathlib.Path("configs/heart.yaml").read_text() + "parameters:\n" + sampled +
                    f"campaign: {{members: {members}, method: monte_carlo, seed: 2026, check_fraction: 0}}\n")
wish = ["--set", "accuracy={LV_EF: 1 %, QRS: 3 ms}"]


def run(store, *settings):
    command = [*launcher, cohort, "run", str(campaign), "--store", str(store), *options, *settings]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode not in (0, 2):
        raise SystemExit(f"{' '.join(command)}\n{result.stderr[-2000:]}")
    with h5py.File(store) as file:
        names = [name.decode() if isinstance(name, bytes) else name for name in file["features"].attrs["names"]]
        return file["status"][:] == 3, {name: file["features"][:, names.index(name)] for name in WISHED}, float(numpy.mean(file["members/wall_s"][:]))


plan = subprocess.run([cohort, "plan", str(campaign), "--quick", *options, *wish], capture_output=True, text=True)
told = next((line for line in (plan.stdout + plan.stderr).splitlines() if "accuracy: " in line), None)
if plan.returncode or told is None:
    raise SystemExit(plan.stdout + plan.stderr)
print(told[told.index("accuracy: "):])
label = re.search(r"accuracy: (.*?) \([\d.e-]+ s a member", told).group(1)
measured = pathlib.Path("configs/measurements/heart.yaml").read_text()
chosen = dict(re.findall(r"([\w.]+): ([\w.]+)", re.search(rf'label: "{re.escape(label)}"\n    set: {{(.*)}}', measured).group(1)))
wave = float(chosen["grid.dx_mm"])
tissue = max(float(chosen.get("mechanics.dx_mm", 2)), wave)
done, ours, seconds = run(folder / "accuracy_chosen.h5", *wish)
finer_done, finer, finer_seconds = run(folder / "accuracy_finer.h5", "--set", f"grid.dx_mm={wave / 4}", "--set", f"mechanics.dx_mm={tissue / 4}")
both = done & finer_done
print(f"waves on {wave:g} and {wave / 4:g} mm, tissue on {tissue:g} and {tissue / 4:g} mm; {seconds:.3g} and {finer_seconds:.3g} s a member")
print("member  LV EF, %  finer  error, % of it  QRS, ms  finer  error, ms")
holds = both.copy()
for m in numpy.flatnonzero(both):
    ef, qrs = (ours[name][m] - finer[name][m] for name in WISHED)
    share = 100 * ef / finer["lv_ef_percent"][m]
    holds[m] = abs(share) <= 1 and abs(qrs) <= 3
    print(f"{m:6} {ours['lv_ef_percent'][m]:9.3f} {finer['lv_ef_percent'][m]:7.3f} {share:10.3f} {ours['ecg_QRS_ms'][m]:12.2f} "
          f"{finer['ecg_QRS_ms'][m]:7.2f} {qrs:8.2f}{'' if holds[m] else '  beyond'}")
print(f"{holds.sum()} of {both.sum()} hold" + (f"; {len(both) - both.sum()} not run in both" if not both.all() else ""))
PYTHON
