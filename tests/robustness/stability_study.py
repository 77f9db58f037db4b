#!/usr/bin/env python3
"""A study of stability end to end: outcomes are named, spoilt rows are caught, a killed study goes on, bad files are refused.

Usage: stability_study.py COHORT SOURCE_DIR. Needs an OpenCL device. Prints a line for each case; exits 1 if one fails.
"""

import csv
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import h5py
import numpy

COHORT, SOURCE = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
DONE, UNSTABLE, REJECTED = 3, 6, 7
# Circulations of elastances, and a bar of muscle whose step may be carried beyond its limit.
STUDY = f"""kind: stability
base: {SOURCE}/configs/circulation.yaml
set: {{time.beats.at_most: 2, time.beats.until_periodic: 0, outputs.pv.rate_hz: 100}}
store: study.h5
stability:
  seed: 2
  ranges:
    circulation.systemic.arterial_resistance_mmHg_s_per_mL: [0.5, 1.1]
    circulation.initial.systemic_venous_pressure_mmHg: [24, 32]
  corners: 4
  interior: 3
  with_inside: 1
  extremes:
    planted: {{circulation.initial.la_volume_mL: 0, circulation.initial.pulmonary_venous_pressure_mmHg: -20}}  # sucks the atrium empty
    closed: {{circulation.valves.open_resistance_mmHg_s_per_mL: 10}}
  cases:
    bar:
      base: bar.yaml
      extremes: {{step_2x: {{mechanics.step_factor: 2}}}}
"""
BAR = """scene:
  geometry:
    shapes:
      block: {box: {size_mm: [12, 3, 3], centre_mm: [0, 1.5, 1.5]}}
      right_of_clamp: {half_space: {point_mm: [0, 0, 0], normal: [-1, 0, 0]}}
      bar: {intersection: [block, right_of_clamp]}
    regions: {muscle: {shape: bar, fibres: constant}}
    fibres: {direction: [1, 0, 0]}
  grid: {dx_mm: 1}
  time: {end_ms: 20}
  electrophysiology: {activation: monodomain, conductivity_longitudinal_mS_per_mm: 0.9, conductivity_transverse_mS_per_mm: 0.9}
  stimuli: {left: {shape: box, upper_mm: [1.2, 3, 3]}}
  mechanics:
    tension: twitch
    boundary: {left: {surface: right_of_clamp, clamp: all}}
outputs: {displacement: {points: {end_mm: [5.5, 1.5, 1.5]}}}
"""

failures = 0


def report(name, good, found=""):
    global failures
    print(f"{'ok    ' if good else 'FAILED'} {name}")
    if not good:
        failures += 1
        print(f"  found {found}")


def study(folder, *arguments, file="study.yaml"):
    return subprocess.run([COHORT, "study", file, "--device", "cpu", *arguments], cwd=folder, capture_output=True, text=True,
                          timeout=120)


def write(folder, name, text):
    (folder / name).write_text(text)


def outcomes(folder, name="study.h5"):
    with h5py.File(folder / name, "r") as file:
        return {name: file[f"study/{name}"][:] for name in ("group", "inside", "outcome")}, file["status"][:]


def table(folder):
    with open(folder / "study.csv", newline="") as file:
        return list(csv.DictReader(file))


def outcomes_are_named(folder):
    result = study(folder)
    rows, status = outcomes(folder)
    groups = [group.decode() for group in rows["group"]]
    report("groups stand in the file", groups == ["defaults"] + 4 * ["corners"] + 3 * ["interior"] + 2 * ["planted"] + 2 * ["closed"],
           groups)
    report("extremes lie outside", rows["inside"].tolist() == 8 * [1] + 4 * [0], rows["inside"])
    report("members inside are done", (status[:8] == DONE).all() and (rows["outcome"][:8] == b"done").all(), status)
    planted = [rows["outcome"][i].decode() for i in (8, 9)]
    report("the planted instability is named", all(text.startswith("unstable: ") and "#" in text for text in planted), planted)
    lines = [line for line in table(folder) if line["group"] == "planted"]
    report("with member, time and numbers", len(lines) >= 1 and all(
        line["first_member"] in ("8", "9") and float(line["at_ms"]) >= 0 and any(c.isdigit() for c in line["reason_of_first"])
        for line in lines), lines)
    bar, status = outcomes(folder, "study.bar.h5")
    report("another scene has a store of its own", [group.decode() for group in bar["group"]] == ["defaults", "step_2x"], bar)
    report("a step beyond the limit is named", status[1] == UNSTABLE and b"#" in bar["outcome"][1], (status, bar["outcome"]))
    report("the study holds", result.returncode == 0 and "\nholds: 14 members" in result.stdout, result.stdout + result.stderr)
    report("the picture is drawn", (folder / "study.png").stat().st_size > 10000 if (folder / "study.png").exists() else False,
           result.stderr)


def spoilt_rows_are_caught(folder):
    shutil.copy(folder / "study.h5", folder / "kept.h5")
    with h5py.File(folder / "study.h5", "r+") as file:
        file["pv/volume"][5, 0, 7] = numpy.nan
    result = study(folder)
    rows, _ = outcomes(folder)
    report("a spoilt row fails its check", result.returncode == 2 and rows["outcome"][5].startswith(b"check failed: ") and
           (numpy.delete(rows["outcome"], [5, 8, 9, 10, 11]) == b"done").all(), (result.returncode, rows["outcome"]))
    report("and is told", "does not hold" in result.stdout and "checks failed 1" in result.stdout, result.stdout)
    shutil.move(folder / "kept.h5", folder / "study.h5")


def too_few_inside(folder):
    """The planted values as a corner of the ranges."""
    result = study(folder, "--store", "few.h5", "--set", "circulation.initial.la_volume_mL=0", "--set",
                   "circulation.initial.pulmonary_venous_pressure_mmHg=-20", "--set", "stability.cases=null")
    report("too few done inside the ranges", result.returncode == 2 and "inside the ranges 0 of 10 (0.0 %" in result.stdout,
           (result.returncode, result.stdout))


def goes_on_after_a_kill(folder):
    command = [COHORT, "study", "study.yaml", "--device", "cpu", "--store", "killed.h5", "--set", "stability.interior=400",
               "--set", "time.beats.at_most=20"]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    done = 0
    for _ in range(600):
        time.sleep(0.02)
        if (folder / "killed.h5").exists():
            with h5py.File(folder / "killed.h5", "r", locking=False) as file:
                done = int((file["status"][:] >= DONE).sum())
            if done > 0:
                break
    process.send_signal(signal.SIGKILL)
    process.wait()
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
    rows, status = outcomes(folder, "killed.h5")
    report(f"killed after {done} of {len(status)}, it goes on", 0 < done < len(status) and result.returncode == 0 and
           (status >= DONE).all() and (rows["outcome"] != b"").all() and "resuming" in result.stderr,
           (done, result.returncode, result.stderr[-2000:]))
    result = study(folder, "--store", "killed.h5")
    report("another design's store is refused", result.returncode == 1 and "was made by another campaign" in result.stderr,
           result.stderr)


def bad_files_are_refused(folder):
    def refused(name, old, new, *messages):
        assert STUDY.count(old) >= 1, old
        write(folder, "bad.yaml", STUDY.replace(old, new, 1).replace("study.h5", "bad.h5"))
        result = study(folder, file="bad.yaml")
        missing = [message for message in messages if message not in result.stderr]
        report(name, result.returncode == 1 and not missing and not (folder / "bad.h5").exists(), (missing, result.stderr))

    refused("no section", "stability:\n", "stable:\n", '"stability" is missing', 'unknown key "stable"')
    refused("an unknown parameter", "arterial_resistance_mmHg_s_per_mL: [0", "arterial_resistence_mmHg_s_per_mL: [0",
            "bad.yaml:8:5: parameter", "does not exist in this scene; did you mean")
    refused("a range that is none", "[0.5, 1.1]", "[1.1, 0.5]", "bad.yaml:8:", "the first must be less than the second")
    refused("beyond what is admissible", "[24, 32]", "[24, 3200]", "bad.yaml:9:", "it must lie in [-20, 300] mmHg")
    refused("an extreme beyond it", "open_resistance_mmHg_s_per_mL: 10", "open_resistance_mmHg_s_per_mL: 1000", "bad.yaml:15:",
            "it must lie in")
    refused("a structural parameter", "circulation.initial.systemic_venous_pressure_mmHg: [", "time.beats.length_ms: [",
            "bad.yaml:9:5:", "structural")
    refused("an unknown key", "with_inside: 1", "with_insides: 1", "bad.yaml:12:3: unknown key \"with_insides\"")
    refused("a group's name", "    closed:", "    corners:", "bad.yaml:15:5:", "a group of members has that name")
    refused("no base", "base: bar.yaml", "base: bars.yaml", "bad.yaml:18:", "cannot be read")
    refused("a setting that the base refuses", "time.beats.at_most: 2,", "time.beats.at_most: two,", "time.beats.at_most")
    refused("corners without ranges", "      extremes: {step", "      corners: 4\n      extremes: {step", "bad.yaml:18:",
            "needs ranges")
    refused("a share of two", "seed: 2", "inside_done: 2", "bad.yaml:6:", "a share lies in [0, 1]")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write(folder, "study.yaml", STUDY)
        write(folder, "bar.yaml", BAR)
        bad_files_are_refused(folder)
        outcomes_are_named(folder)
        spoilt_rows_are_caught(folder)
        too_few_inside(folder)
        goes_on_after_a_kill(folder)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
