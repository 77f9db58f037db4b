"""Activation of one member as filled isochrones on three cuts, from what `cohort run F.yaml --export vtk` wrote.

    /usr/bin/python3 -m analysis.activation heart_vtk [-o heart_activation.png] [--at 0,0,-20] [--step 10]

The cuts go through the middle of the tissue, or through --at (mm). Only tissue is drawn; where it is not activated, grey.
"""

import argparse
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy
from matplotlib.colors import BoundaryNorm

from analysis import vti

FINER = 6  # points drawn along the edge of a cell
MAP = "viridis"  # even steps of lightness, told apart by all kinds of colour vision
NOT_ACTIVATED = "#c8c8c8"
AXES = "xyz"
STEPS = (0.5, 1, 2, 5, 10, 20, 25, 50, 100, 200, 500)


def spread(values, known, rounds):
    """values (ny, nx) where known; from there outwards, `rounds` cells far, the mean of known neighbours."""
    values, known = numpy.where(known, values, 0.0), known.copy()
    for _ in range(rounds):
        padded, marks = numpy.pad(values * known, 1), numpy.pad(known.astype(float), 1)
        total = sum(padded[1 + j:padded.shape[0] - 1 + j, 1 + i:padded.shape[1] - 1 + i] for j in (-1, 0, 1) for i in (-1, 0, 1))
        count = sum(marks[1 + j:marks.shape[0] - 1 + j, 1 + i:marks.shape[1] - 1 + i] for j in (-1, 0, 1) for i in (-1, 0, 1))
        reached = ~known & (count > 0)
        values[reached] = (total / numpy.maximum(count, 1))[reached]
        known |= reached
    return values


def refined(values):
    """Linear interpolation of values (ny, nx) between centres, at FINER x FINER points of each cell."""
    for axis, n in enumerate(values.shape):
        at = numpy.clip((numpy.arange(n * FINER) + 0.5) / FINER - 0.5, 0, n - 1)
        low = numpy.minimum(at.astype(int), max(n - 2, 0))
        high = numpy.minimum(low + 1, n - 1)
        share = (at - low).reshape((-1, 1) if axis == 0 else (1, -1))
        values = values.take(low, axis) * (1 - share) + values.take(high, axis) * share
    return values


def draw_cut(axes, image, axis, index, norm, levels):
    """The cut across `axis` at cell `index`; returns the filled contours, or None where nothing is activated."""
    across = [a for a in range(3) if a != axis]  # horizontal, vertical
    take = lambda name: image.fields[name].take(index, 2 - axis)
    activation, fraction, tissue = take("activation_ms"), take("fraction"), image.tissue.take(index, 2 - axis)
    activated = tissue & numpy.isfinite(activation)
    x, y = (image.origin_mm[a] + image.dx_mm * ((numpy.arange(image.cells[a] * FINER) + 0.5) / FINER) for a in across)
    # The surface lies where a cell would be half full.
    inside = refined(numpy.where(tissue, fraction, 0.0).astype(float)) >= 0.5
    filled = None
    reached = refined(spread(activated.astype(float), tissue, 3)) >= 0.5
    if (inside & ~reached).any():
        axes.contourf(x, y, (inside & ~reached).astype(float), levels=[0.5, 1.5], colors=[NOT_ACTIVATED])
    if activated.any():
        times = numpy.ma.masked_where(~(inside & reached), refined(spread(activation, activated, 3)))
        filled = axes.contourf(x, y, times, levels=levels, cmap=MAP, norm=norm, extend="neither")
        crossed = levels[(levels > times.min()) & (levels < times.max())]
        if len(crossed):
            lines = axes.contour(x, y, times, levels=crossed, colors="black", linewidths=0.5)
            axes.clabel(lines, crossed[::2] if len(crossed) > 10 else crossed, fmt="%g", fontsize=7, inline_spacing=2)
    drawn = numpy.argwhere(inside)
    if len(drawn):
        for limits, values, column in ((axes.set_xlim, x, 1), (axes.set_ylim, y, 0)):
            margin = 1.5 * image.dx_mm
            limits(values[drawn[:, column].min()] - margin, values[drawn[:, column].max()] + margin)
    axes.set(aspect="equal", anchor="W", xlabel=f"{AXES[across[0]]} (mm)", ylabel=f"{AXES[across[1]]} (mm)",
             title=f"{AXES[axis]} = {image.centres(axis)[index]:.1f} mm")
    return filled


def isochrones(activation, step):
    """Levels from below the first to above the last activation."""
    first, last = numpy.nanmin(activation), numpy.nanmax(activation)
    step = step or next((s for s in STEPS if (last - first) / s <= 20), STEPS[-1])
    return step * numpy.arange(numpy.floor(first / step), max(numpy.ceil(last / step), numpy.floor(first / step) + 1) + 1)


def draw(image, at, step, title):
    """A figure of the three cuts through `at` (mm)."""
    levels = isochrones(image.fields["activation_ms"], step)
    norm = BoundaryNorm(levels, plt.get_cmap(MAP).N)
    extents = [(numpy.ptp(numpy.flatnonzero(image.tissue.any(axis=tuple(2 - a for a in range(3) if a != axis)))) + 4)
               * image.dx_mm for axis in range(3)]
    across = [[a for a in range(3) if a != axis] for axis in range(3)]
    # Cuts side by side at one scale, unless they are so flat that they stand above each other better.
    widths, heights = [extents[a] for a, _ in across], [extents[b] for _, b in across]
    stacked = sum(widths) > 3.5 * max(heights)
    size, most = (sum(heights), max(widths)) if stacked else (sum(widths), max(heights))
    inches = min(10 / (most if stacked else size), 12 / (size if stacked else most))
    layout = {"height_ratios": heights} if stacked else {"width_ratios": widths}
    shape = (3, 1) if stacked else (1, 3)
    figure, axes = plt.subplots(
        *shape, layout="constrained", gridspec_kw=layout,
        figsize=(inches * (most if stacked else size) + 2.5, inches * (size if stacked else most) + (2.8 if stacked else 1.4)))
    filled = None
    for axis, panel in enumerate(axes):
        index = int(numpy.clip((at[axis] - image.origin_mm[axis]) // image.dx_mm, 0, image.cells[axis] - 1))
        filled = draw_cut(panel, image, axis, index, norm, levels) or filled
    if filled is not None:
        bar = figure.colorbar(filled, ax=axes, label="activation (ms)", shrink=0.9, ticks=levels)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    if filled is not None:
        thin_labels(figure, bar, levels)
    return figure


def thin_labels(figure, bar, levels):
    """Labels as many of the levels as the bar has room for."""
    figure.draw_without_rendering()
    room = bar.ax.get_window_extent().height / len(levels)  # pixels to a level
    needed = 1.3 * max(label.get_window_extent().height for label in bar.ax.get_yticklabels())
    every = next((n for n in (1, 2, 5, 10, 20, 50, 100) if n * room >= needed), len(levels))
    first = round(levels[0] / (levels[1] - levels[0]))
    bar.set_ticks([level for k, level in enumerate(levels, first) if k % every == 0])


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.activation", description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="folder that --export vtk wrote, or the tissue.vti in it")
    parser.add_argument("-o", "--output", help="PNG, PDF or SVG; default: the folder's name with _activation.png for _vtk")
    parser.add_argument("--at", help="x,y,z in mm, where the cuts meet; default: the middle of the tissue")
    parser.add_argument("--step", type=float, help="ms between isochrones; default: at most 20 of them")
    options = parser.parse_args(arguments)
    path = pathlib.Path(options.folder)
    path = path / "tissue.vti" if path.is_dir() else path
    name = path.resolve().parent.name.removesuffix("_vtk")
    output = options.output or str(path.parent).removesuffix("_vtk") + "_activation.png"
    try:
        image = vti.read(path)
    except (OSError, ValueError) as error:
        sys.exit(str(error))
    activated = image.tissue & numpy.isfinite(image.fields["activation_ms"])
    if not activated.any():
        sys.exit(f"{path}: nothing is activated")
    if options.at:
        at = [float(word) for word in options.at.split(",")]
        if len(at) != 3:
            sys.exit(f"--at {options.at}: three numbers x,y,z")
    else:
        cells = numpy.argwhere(image.tissue)[:, ::-1]
        at = image.origin_mm + image.dx_mm * ((cells.min(0) + cells.max(0)) / 2 + 0.5)
    last = numpy.nanmax(image.fields["activation_ms"])
    figure = draw(image, at, options.step,
                  f"{name}: activation of {activated.sum() / image.tissue.sum():.0%} of the tissue, to {last:.0f} ms")
    figure.savefig(output, dpi=110)


if __name__ == "__main__":
    main()
