"""ECGs of a campaign as a clinical sheet: 25 mm/s, 10 mm/mV, squares of 1 mm, three rows of four leads and a strip of II.

    /usr/bin/python3 -m analysis.ecg demo.h5 [-o demo_ecg.png] [--member 3] [--gain 20]

All members that are done are drawn light, one bold. The time axis begins anew with each lead: every lead shows the same
beat, at most 2.5 s of it; the strip shows all of the recording.
"""

import argparse
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy
from matplotlib.collections import LineCollection

from analysis.store import Store

LAYOUT = [["I", "aVR", "V1", "V4"], ["II", "aVL", "V2", "V5"], ["III", "aVF", "V3", "V6"]]
RHYTHM = "II"
MM_PER_MS = 25 / 1000
LONGEST_LEAD_MS = 2500
LARGE_SQUARE_MM = 5
CALIBRATION_MM, CALIBRATION_MV = 5, 1
INCHES_PER_MM = 0.085  # twice life size, so that a millimetre can be seen on a screen
PAPER, FINE, COARSE = "#fff7f5", "#f9d5d0", "#eea79f"
LIGHT, BOLD = "#5b7fb5", "#101010"


def up_to_large_square(mm):
    return LARGE_SQUARE_MM * int(numpy.ceil(mm / LARGE_SQUARE_MM - 1e-9))


def draw_paper(axes, width, height):
    axes.set_facecolor(PAPER)
    for axis, extent in (("x", width), ("y", height)):
        for mm in range(extent + 1):
            large = mm % LARGE_SQUARE_MM == 0
            line = axes.axvline if axis == "x" else axes.axhline
            line(mm, color=COARSE if large else FINE, linewidth=0.7 if large else 0.4, zorder=0)
    axes.set(xlim=(0, width), ylim=(0, height), xticks=[], yticks=[], aspect="equal")
    for spine in axes.spines.values():
        spine.set_color(COARSE)


def draw_calibration(axes, left, baseline, gain):
    x = left + numpy.array([-1, 0, 0, CALIBRATION_MM, CALIBRATION_MM, CALIBRATION_MM + 1])
    y = baseline + gain * CALIBRATION_MV * numpy.array([0, 0, 1, 1, 0, 0])
    axes.plot(x, y, color=BOLD, linewidth=1)


def draw_lead(axes, name, left, baseline, label_height, time_ms, ecg, bold, gain):
    """ecg (N, T) mV, time_ms (T); `bold` is the row that is drawn bold."""
    x = left + MM_PER_MS * (time_ms - time_ms[0])
    y = baseline + gain * ecg
    others = [numpy.column_stack([x, row]) for i, row in enumerate(y) if i != bold]
    opacity = numpy.clip(6 / max(len(others), 1), 0.04, 0.6)
    axes.add_collection(LineCollection(others, colors=LIGHT, linewidths=0.7, alpha=opacity, zorder=2))
    axes.plot(x, y[bold], color=BOLD, linewidth=1.4, solid_joinstyle="round", zorder=3)
    axes.text(left + 0.5, baseline + label_height, name, fontsize=11, fontweight="bold", va="center", zorder=4)


def draw(leads, time_ms, ecg, bold, gain, title, note):
    """A figure of ecg (N, L, T) mV at time_ms (T)."""
    index = {name: i for i, name in enumerate(leads)}
    shown = time_ms - time_ms[0] <= LONGEST_LEAD_MS
    tallest = gain * numpy.nanmax(numpy.abs(ecg))
    row = max(4 * LARGE_SQUARE_MM, min(up_to_large_square(1.2 * tallest), 12 * LARGE_SQUARE_MM))
    first = up_to_large_square(max(row / 2, tallest + 2, gain * CALIBRATION_MV + 2))  # baseline of the first row, from the top
    column = max(up_to_large_square(MM_PER_MS * numpy.ptp(time_ms[shown]) + 3), 4 * LARGE_SQUARE_MM)
    left = 2 * LARGE_SQUARE_MM
    width = left + max(len(LAYOUT[0]) * column, up_to_large_square(MM_PER_MS * numpy.ptp(time_ms) + 3))
    height = first + row * len(LAYOUT) + up_to_large_square(row / 2)
    label_height = row / 2 - 2

    figure, axes = plt.subplots(figsize=(INCHES_PER_MM * (width + 4), INCHES_PER_MM * (height + 12)))
    draw_paper(axes, width, height)
    for r, names in enumerate(LAYOUT + [[RHYTHM]]):
        baseline = height - first - r * row
        draw_calibration(axes, 2, baseline, gain)
        for c, name in enumerate(names):
            if name not in index:
                continue
            samples = shown if r < len(LAYOUT) else slice(None)
            draw_lead(axes, name, left + c * column, baseline, label_height, time_ms[samples],
                      ecg[:, index[name]][:, samples], bold, gain)
    axes.set_title(title, loc="left", fontsize=11)
    axes.set_xlabel(note, loc="left", fontsize=9)
    figure.tight_layout(pad=0.5)
    return figure


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.ecg", description=__doc__.splitlines()[0])
    parser.add_argument("store", help="HDF5 file of a campaign, finished or not")
    parser.add_argument("-o", "--output", help="PNG, PDF or SVG; default: the store's name with _ecg.png")
    parser.add_argument("--member", type=int, help="member drawn bold; default: the first that is done")
    parser.add_argument("--gain", type=float, default=10, help="mm per mV")
    options = parser.parse_args(arguments)
    output = options.output or str(pathlib.Path(options.store).with_suffix("")) + "_ecg.png"
    with Store(options.store) as store:
        members = numpy.flatnonzero(store.done)
        if not store.leads:
            sys.exit(f"{options.store}: the campaign records no ECG")
        if len(members) == 0:
            sys.exit(f"{options.store}: no member is done yet")
        member = members[0] if options.member is None else options.member
        if member not in members:
            sys.exit(f"{options.store}: member {member} is not done; status {store.status[member]}"
                     if 0 <= member < store.members else f"{options.store}: no member {member} among {store.members}")
        figure = draw(
            store.leads, store.ecg_ms, store.ecg(store.done), int(numpy.searchsorted(members, member)), options.gain,
            f"{pathlib.Path(options.store).name}: {len(members)} of {store.members} members, member {member} bold",
            f"25 mm/s    {options.gain:g} mm/mV    small squares 1 mm = 40 ms x {1 / options.gain:g} mV    "
            f"calibration {CALIBRATION_MV} mV, {CALIBRATION_MM / MM_PER_MS:.0f} ms")
    figure.savefig(output, dpi=100)


if __name__ == "__main__":
    main()
