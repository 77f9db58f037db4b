"""Error against run time: draws what `cohort study` has written for a study of kind work_precision.

    /usr/bin/python3 -m analysis.study study_circulation.h5               # study_circulation.png
    /usr/bin/python3 -m analysis.study study_circulation.h5 -o picture.svg

In the file a group for each scene ("000", ...; attribute scene) with R settings, M measures, N members, K repeats:
    settings/label, set, outcome (R) text; default (R) 1 where it is the scene's own; roof_s (R)
    settings/device_s, wall_s (R, K) s: of the device's kernels, and by the host's clock, for one member
    measures/name, unit (M) text; rms, largest (M, R); error (M, R, N); reference (M, N), NaN for norms
    measures/front (M, R) 1 on it; distance from it, times_as_slow as the fastest of no larger error, times_the_error of the best
        in no more time (M, R), all 1 on it
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
    scene: str
    labels: list
    outcomes: list
    default: numpy.ndarray  # (R) bool
    device_s: numpy.ndarray  # (R, K)
    roof_s: numpy.ndarray  # (R)
    measures: list  # (M) of (name, unit)
    rms: numpy.ndarray  # (M, R)
    front: numpy.ndarray  # (M, R) bool
    distance: numpy.ndarray  # (M, R), as the two below
    times_as_slow: numpy.ndarray
    times_the_error: numpy.ndarray
    reference: str
    device: str
    triad_GB_per_s: float


def read(path):
    """Its scenes, a Study each."""
    with h5py.File(path, "r") as file:
        if file.attrs.get("kind") != "work_precision":
            raise SystemExit(f"{path} is not of a study of kind work_precision")
        return [read_scene(file, file[name]) for name in sorted(file)]


def read_scene(file, group):
    def texts(name):
        return [text.decode() for text in group[name][:]]

    return Study(
        scene=group.attrs["scene"], labels=shortened(texts("settings/label")), outcomes=texts("settings/outcome"),
        default=group["settings/default"][:] > 0, device_s=group["settings/device_s"][:], roof_s=group["settings/roof_s"][:],
        measures=list(zip(texts("measures/name"), texts("measures/unit"))), rms=group["measures/rms"][:],
        front=group["measures/front"][:] > 0, distance=group["measures/distance"][:], times_as_slow=group["measures/times_as_slow"][:],
        times_the_error=group["measures/times_the_error"][:], reference=file.attrs["reference"], device=file.attrs["device"],
        triad_GB_per_s=file.attrs["triad_GB_per_s"])


def shortened(labels):
    """Without the words that all of them begin with."""
    words = [label.split() for label in labels if label != "default"]
    same = 0
    while words and all(len(own) > same + 1 and own[same] == words[0][same] for own in words):
        same += 1
    return [label if label == "default" else " ".join(label.split()[same:]) for label in labels]


def place_labels(axes, labels):
    """Texts of (x, y, text, colour) where they cover neither each other nor a point, with a line to points that are not beside them."""
    figure = axes.figure
    renderer = figure.canvas.get_renderer()
    points = axes.transData.transform([(x, y) for x, y, *_ in labels]) if labels else []
    frame = axes.get_window_extent(renderer)
    scale = figure.dpi / 72
    taken = [(x - 4 * scale, y - 4 * scale, x + 4 * scale, y + 4 * scale) for x, y in points]
    for (x, y), (*place, text, colour) in zip(points, labels):
        note = axes.annotate(text, place, xytext=(0, 0), textcoords="offset points", fontsize=6, color=colour, zorder=4,
                             bbox={"facecolor": "white", "alpha": 0.75, "pad": 0.3, "linewidth": 0})
        size = note.get_window_extent(renderer)
        best, least = None, numpy.inf
        for radius in (5, 9, 14, 20, 27, 35, 44, 54):
            for angle in numpy.arange(0, 2 * numpy.pi, numpy.pi / 8):
                dx, dy = radius * numpy.cos(angle) * scale, radius * numpy.sin(angle) * scale
                left = x + dx - (0 if numpy.cos(angle) > 0.3 else size.width if numpy.cos(angle) < -0.3 else size.width / 2)
                low = y + dy - size.height / 2
                box = (left, low, left + size.width, low + size.height)
                overlap = sum(max(0, min(box[2], other[2]) - max(box[0], other[0])) * max(0, min(box[3], other[3]) - max(box[1], other[1]))
                              for other in taken)
                beyond = max(0, frame.x0 - box[0]) + max(0, box[2] - frame.x1) + max(0, frame.y0 - box[1]) + max(0, box[3] - frame.y1)
                cost = 20 * overlap + 50 * beyond + radius * radius
                if cost < least:
                    best, least = (box, radius), cost
        box, radius = best
        taken.append(box)
        note.set_position(((box[0] - x) / scale, (box[1] - y) / scale))
        if radius > 9:
            middle = axes.transData.inverted().transform(((box[0] if box[0] > x else min(box[2], x)), (box[1] + box[3]) / 2))
            axes.plot([place[0], middle[0]], [place[1], middle[1]], color=colour, linewidth=0.4, zorder=1)


def draw_measure(axes, study, m):
    """One measure: settings by median device time and rms error, the front joined, the roof to the left of each. Returns its labels."""
    name, unit = study.measures[m]
    time, error = numpy.nanmedian(study.device_s, axis=1), study.rms[m]
    shown = numpy.isfinite(error) & (error > 0) & (time > 0)
    if not shown.any():
        axes.text(0.5, 0.5, f"{name}: no error above zero", ha="center", transform=axes.transAxes)
        axes.set_axis_off()
        return []
    labels = []
    for i in numpy.flatnonzero(shown):
        colour = OWN if study.default[i] else FRONT if study.front[m][i] else OTHER
        low, high = numpy.nanmin(study.device_s[i]), numpy.nanmax(study.device_s[i])
        if study.roof_s[i] > 0:
            axes.plot([study.roof_s[i], time[i]], [error[i]] * 2, color=ROOF, linewidth=0.6, zorder=1)
            axes.plot(study.roof_s[i], error[i], "|", color=ROOF, markersize=7, zorder=1)
        axes.plot([low, high], [error[i]] * 2, color=colour, linewidth=2.5, alpha=0.5, solid_capstyle="butt", zorder=2)
        axes.plot(time[i], error[i], "D" if study.default[i] else "o", color=colour, markersize=5, zorder=3,
                  markerfacecolor=colour if study.front[m][i] or study.default[i] else "white")
        labels.append((time[i], error[i], study.labels[i], colour))
    front = numpy.flatnonzero(study.front[m] & shown)
    front = front[numpy.argsort(time[front])]
    axes.plot(time[front], error[front], color=FRONT, linewidth=0.8, zorder=2)
    axes.set(xscale="log", yscale="log", xlabel="device time of a member (s)", ylabel=f"error of {name} ({unit}, rms)", title=study.scene)
    axes.margins(x=0.25, y=0.12)
    axes.grid(which="major", color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return labels


def draw(scenes, title):
    panels = [(study, m) for study in scenes for m in range(len(study.measures))]
    columns = min(3, len(panels)) if len(scenes) == 1 else len(scenes[0].measures)
    rows = -(-len(panels) // columns)
    figure, all_axes = plt.subplots(rows, columns, figsize=(5.2 * columns, 4 * rows + 0.6), squeeze=False, layout="constrained")
    for axes in all_axes.flat[len(panels):]:
        axes.set_visible(False)
    labels = [draw_measure(axes, study, m) for axes, (study, m) in zip(all_axes.flat, panels)]
    study = scenes[0]
    failed = [f"{study.scene} {label}: {outcome}" for study in scenes for label, outcome in zip(study.labels, study.outcomes) if outcome]
    against = study.reference if len(study.reference) < WORD_LIMIT else study.reference[:WORD_LIMIT] + " ..."
    lines = [f"{title} on {study.device} (triad {study.triad_GB_per_s:.0f} GB/s), against {against}",
             "filled: Pareto front; diamond: default; bar: least to most of the repeats; tick to the left: least traffic at the triad"]
    figure.suptitle("\n".join(lines + failed[:3]), fontsize=8.5)
    figure.draw_without_rendering()  # sizes are known from here on
    figure.set_layout_engine("none")
    for axes, own in zip(all_axes.flat, labels):
        axes.autoscale(False)
        place_labels(axes, own)
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
