"""Page of studies of error against run time: a picture for each, the default against the front, orders and rounding as printed.

    jobs/studies.sh build study-results niederer land ecg circulation cell splitting heart
    /usr/bin/python3 -m analysis.studies study-results RESULTS              # RESULTS/studies.md, study_*.csv, study_*.png
"""

import argparse
import pathlib
import shutil

import numpy

from analysis import study as work_precision

DECIMALS = 3


def table(scenes):
    lines = ["| scene | measure | default | error rms | device s | from the front | times as slow | times the error | least error measured, with |",
             "|---|---|---|---|---|---|---|---|---|"]
    for scene in scenes:
        time = numpy.nanmedian(scene.device_s, axis=1)
        own = int(numpy.flatnonzero(scene.default)[0]) if scene.default.any() else None
        for m, (name, unit) in enumerate(scene.measures):
            error = scene.rms[m]
            least = int(numpy.nanargmin(error))
            ours = "- | - | - | - | - | -" if own is None else (
                f"{scene.labels[own]} | {error[own]:.{DECIMALS}g} | {time[own]:.{DECIMALS}g} | {scene.distance[m][own]:.2f} | "
                f"{scene.times_as_slow[m][own]:.2f} | {scene.times_the_error[m][own]:.2f}")
            lines.append(f"| {scene.scene or '-'} | {name} ({unit}) | {ours} | {error[least]:.{DECIMALS}g}, {scene.labels[least]} |")
    return lines


def told(text):
    """Orders and shares of rounding, from what `cohort study` has printed."""
    blocks, inside, scene = [], False, ""
    for line in text.splitlines():
        if line.endswith("for one member") and " on " in line:
            scene = line.split(" on ")[0]
        if line.startswith(("observed order", "rounding of single")):
            inside = True
            blocks.append([scene] if scene else [])
        if inside and not line.strip():
            inside = False
        if inside:
            blocks[-1].append(line)
    return ["```", *"\n\n".join("\n".join(block) for block in blocks if len(block) > 1 + bool(scene)).splitlines(), "```"] if blocks else []


def main():
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.studies", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, help="what jobs/studies.sh has left there: study_NAME.h5, .csv, .txt")
    parser.add_argument("results", type=pathlib.Path, help="folder of the page")
    options = parser.parse_args()
    lines = ["# Error against run time", "",
             "Made by `jobs/studies.sh` and `/usr/bin/python3 -m analysis.studies` from the studies in `configs/studies`, whose heads say what each compares.",
             "Seconds are those of the device's kernels for one member of a batch, medians of repeats; the default stands beside the Pareto front of what was",
             "measured: 1.00 is on it, else the factor by which both its time and its error had to shrink so that no other setting is better in both. Beside it, how",
             "many times as slow it is as the fastest of no larger error, and how many times its error is that of the best in no more time.",
             "Below, an order of - means that errors did not fall between the two, or by less than the logarithm of the step: one of the two, often both, is off by",
             "what the step has no part in. Shares of rounding near 100 % are of errors that are rounding. What is of which order, and why, stands in",
             "[solver](../../solver/README.md) (\"What is of which order in the step\") and [kernels](../../kernels/README.md) (arrival times, operators).", ""]
    for path in sorted(options.folder.glob("study_*.h5")):
        scenes = work_precision.read(path)
        first = scenes[0]
        name = path.stem.removeprefix("study_")
        work_precision.draw(scenes, path.stem).savefig(options.results / f"{path.stem}.png", dpi=100)
        shutil.copyfile(path.with_suffix(".csv"), options.results / f"{path.stem}.csv")
        lines += [f"## {name}", "", f"`configs/studies/{name}.yaml` on {first.device}, triad {first.triad_GB_per_s:.0f} GB/s, against {first.reference}.", "",
                  f"![{name}]({path.stem}.png)", "", *table(scenes), "", *told(path.with_suffix(".txt").read_text()), ""]
    (options.results / "studies.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()
