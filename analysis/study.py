"""Error against run time: draws what `cohort study` has written for a study of kind work_precision.

    /usr/bin/python3 -m analysis.study study_circulation.h5               # study_circulation.png
    /usr/bin/python3 -m analysis.study study_circulation.h5 -o picture.svg

In the file (R settings, M measures, N members, K repeats):
    settings/label, set, outcome (R) text; default (R) 1 where it is the scene's own; roof_s (R)
    settings/device_s, wall_s (R, K) s: of the device's kernels, and by the host's clock, for one member
    measures/name, unit (M) text; rms, largest, front (M, R); error (M, R, N)
Attributes: study, base, reference, program, device, triad_GB_per_s.
"""

import argparse
import pathlib
from dataclasses import dataclass

import h5py
import matplotlib
import numpy

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

FRONT, OTHER, OWN, ROOF = "#0b5394", "#888888", "#cc4125", "#bbbbbb"
WORD_LIMIT = 60


@dataclass
class Study:
    labels: list
    outcomes: list
    default: numpy.ndarray  # (R) bool
    device_s: numpy.ndarray  # (R, K)
    roof_s: numpy.ndarray  # (R)
    measures: list  # (M) of (name, unit)
    rms: numpy.ndarray  # (M, R)
    front: numpy.ndarray  # (M, R) bool
    reference: str
    device: str
    triad_GB_per_s: float


def read(path):
    with h5py.File(path, "r") as file:
        if file.attrs.get("kind") != "work_precision":
            raise SystemExit(f"{path} is not of a study of kind work_precision")
        texts = lambda name: [text.decode() for text in file[name][:]]  # noqa: E731
        return Study(
            labels=texts("settings/label"), outcomes=texts("settings/outcome"), default=file["settings/default"][:] > 0,
            device_s=file["settings/device_s"][:], roof_s=file["settings/roof_s"][:],
            measures=list(zip(texts("measures/name"), texts("measures/unit"))),
            rms=file["measures/rms"][:], front=file["measures/front"][:] > 0,
            reference=file.attrs["reference"], device=file.attrs["device"], triad_GB_per_s=file.attrs["triad_GB_per_s"])


def draw_measure(axes, study, m):
    """One measure: settings by median device time and rms error, the front joined, the roof to the left of each."""
    name, unit = study.measures[m]
    time, error = numpy.nanmedian(study.device_s, axis=1), study.rms[m]
    shown = numpy.isfinite(error) & (error > 0) & (time > 0)
    if not shown.any():
        axes.text(0.5, 0.5, "no error above zero", ha="center", transform=axes.transAxes)
    for i in numpy.flatnonzero(shown):
        colour = OWN if study.default[i] else FRONT if study.front[m][i] else OTHER
        low, high = numpy.nanmin(study.device_s[i]), numpy.nanmax(study.device_s[i])
        if study.roof_s[i] > 0:
            axes.plot([study.roof_s[i], time[i]], [error[i]] * 2, color=ROOF, linewidth=0.6, zorder=1)
            axes.plot(study.roof_s[i], error[i], "|", color=ROOF, markersize=7, zorder=1)
        axes.plot([low, high], [error[i]] * 2, color=colour, linewidth=2.5, alpha=0.5, solid_capstyle="butt", zorder=2)
        axes.plot(time[i], error[i], "D" if study.default[i] else "o", color=colour, markersize=5, zorder=3,
                  markerfacecolor=colour if study.front[m][i] or study.default[i] else "white")
        axes.annotate(study.labels[i], (time[i], error[i]), xytext=(5, 3), textcoords="offset points", fontsize=6.5, color=colour)
    front = numpy.flatnonzero(study.front[m] & shown)
    front = front[numpy.argsort(time[front])]
    axes.plot(time[front], error[front], color=FRONT, linewidth=0.8, zorder=2)
    axes.set(xscale="log", yscale="log", xlabel="device time of a member (s)", ylabel=f"error of {name} ({unit}, rms)")
    axes.margins(x=0.25, y=0.12)
    axes.grid(which="major", color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw(study, title):
    count = len(study.measures)
    columns = min(3, count)
    rows = -(-count // columns)
    figure, all_axes = plt.subplots(rows, columns, figsize=(5.2 * columns, 4.2 * rows + 0.6), squeeze=False, layout="constrained")
    for m, axes in enumerate(all_axes.flat):
        if m < count:
            draw_measure(axes, study, m)
        else:
            axes.set_visible(False)
    failed = [f"{label}: {outcome}" for label, outcome in zip(study.labels, study.outcomes) if outcome]
    against = study.reference if len(study.reference) < WORD_LIMIT else study.reference[:WORD_LIMIT] + " ..."
    lines = [f"{title} on {study.device} (triad {study.triad_GB_per_s:.0f} GB/s), against {against}",
             "filled: Pareto front; diamond: default; bar: least to most of the repeats; tick to the left: least traffic at the triad"]
    figure.suptitle("\n".join(lines + failed[:3]), fontsize=8.5)
    return figure


def main():
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.study", description=__doc__.splitlines()[0])
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: the file's name with .png")
    options = parser.parse_args()
    figure = draw(read(options.file), options.file.stem)
    figure.savefig(options.output or options.file.with_suffix(".png"), dpi=130)


if __name__ == "__main__":
    main()
