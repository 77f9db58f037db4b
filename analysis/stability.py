"""Map of the outcomes of a study of stability.

    /usr/bin/python3 -m analysis.stability heart_stability.h5 heart_stability.slab.h5 [-o heart_stability.png]

For each store: members by group and outcome, and all members over the two parameters that tell best who is done and who
is not. Parameters are judged one by one, by the rank statistic of Mann and Whitney (Ann. Math. Statist. 18 (1947) 50-60);
where all came to the same, the two that vary most over their ranges are shown.
"""

import argparse
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

from analysis.store import Store

RIGHT, WRONG = "#4d9221", "#000000"
OTHERS = ["#b2182b", "#e08214", "#762a83", "#2166ac", "#35978f", "#c51b7d", "#8c510a", "#737373"]
LONGEST = 90


def causes(outcomes):
    """The different outcomes, done first, then by how many there are."""
    names, counts = numpy.unique(outcomes, return_counts=True)
    return sorted(names, key=lambda name: (name != "done", -counts[list(names).index(name)]))


def colours(names):
    """{outcome: colour}: green for done, black for a failed check."""
    others = iter(OTHERS * (1 + len(names) // len(OTHERS)))
    return {name: RIGHT if name == "done" else WRONG if name.startswith("check failed") else next(others) for name in names}


def ranks(values):
    """Ranks from 1, equal values share their mean."""
    distinct, places, counts = numpy.unique(values, return_inverse=True, return_counts=True)
    last = numpy.cumsum(counts)
    return (last - (counts - 1) / 2)[places]


def separation(values, good):
    """How well a parameter tells members apart: 0 not at all, 0.5 wholly."""
    n, bad = int(good.sum()), int((~good).sum())
    if n == 0 or bad == 0:
        return 0.0
    u = ranks(values)[good].sum() - n * (n + 1) / 2
    return float(abs(u / (n * bad) - 0.5))


def axes_of(parameters, good):
    """Indices of the two parameters that separate best; fewer where there are fewer."""
    score = [(separation(column, good), len(numpy.unique(column)), -i) for i, column in enumerate(parameters.T)]
    return [-entry[2] for entry in sorted(score, reverse=True)[:2]]


def short(text):
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def draw_groups(axes, groups, outcomes, tint):
    """A bar for each group, with its outcomes side by side as shares of it."""
    order = list(dict.fromkeys(groups))
    for y, group in enumerate(order):
        own, left = outcomes[groups == group], 0.0
        for name in tint:
            share = float((own == name).mean())
            axes.barh(y, share, left=left, color=tint[name], height=0.75, linewidth=0)
            left += share
    axes.set_yticks(range(len(order)), [f"{group} ({int((groups == group).sum())})" for group in order], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0, 1)
    axes.set_xlabel("share of the group")
    axes.spines[["top", "right"]].set_visible(False)


def draw_map(axes, store, outcomes, inside, tint):
    names, units, parameters = store.parameter_names, store.parameter_units, store.parameters
    shown = axes_of(parameters, outcomes == "done")
    x = parameters[:, shown[0]] if shown else numpy.arange(len(outcomes))
    y = parameters[:, shown[1]] if len(shown) > 1 else numpy.arange(len(outcomes))
    for name in tint:  # the rare ones last, on top
        for where, marker, fill in ((inside, "o", True), (~inside, "D", False)):
            members = (outcomes == name) & where
            axes.scatter(x[members], y[members], s=22, marker=marker, linewidths=1, edgecolors=tint[name],
                         facecolors=tint[name] if fill else "none", alpha=0.75)
    axes.set_xlabel(label(names, units, shown, 0), fontsize=9)
    axes.set_ylabel(label(names, units, shown, 1), fontsize=9)
    axes.grid(color="#e8e8e8", linewidth=0.6, zorder=0)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title("filled: inside the documented ranges; diamonds: outside", fontsize=8, loc="left")


def label(names, units, shown, axis):
    if axis >= len(shown):
        return "member"
    name, unit = ".".join(names[shown[axis]].split(".")[-2:]), units[shown[axis]]
    return name + ("" if unit == "1" else f", {unit}")


def draw(stores):
    """A figure with a row for each store."""
    rows = []
    for store in stores:
        groups, outcomes = store.study_groups, store.study_outcomes
        if groups is None:
            raise ValueError(f"{store.path}: not the store of a study")
        rows.append((store, groups, numpy.where(outcomes == "", "open", outcomes), store.study_inside))
    names = causes(numpy.concatenate([row[2] for row in rows]))
    tint = colours(names)
    heights = [max(3.0, 1.2 + 0.22 * len(set(row[1]))) for row in rows]
    legend = 0.2 * -(-len(names) // 2) + 0.3
    figure = plt.figure(figsize=(13, sum(heights) + legend), layout="constrained")
    grid = figure.add_gridspec(len(rows) + 1, 2, height_ratios=[*heights, legend])
    for i, (store, groups, outcomes, inside) in enumerate(rows):
        bars = figure.add_subplot(grid[i, 0])
        own = {name: tint[name] for name in names if (outcomes == name).any()}
        draw_groups(bars, groups, outcomes, own)
        bars.set_title(f"{pathlib.Path(store.path).name}: {int((outcomes == 'done').sum())} of {len(outcomes)} done; inside "
                       f"{int((outcomes[inside] == 'done').sum())} of {int(inside.sum())}", fontsize=10, loc="left")
        draw_map(figure.add_subplot(grid[i, 1]), store, outcomes, inside, own)
    handles = [plt.Line2D([], [], marker="s", linestyle="", color=tint[name], label=short(name)) for name in names]
    below = figure.add_subplot(grid[-1, :])
    below.axis("off")
    below.legend(handles=handles, loc="upper left", fontsize=8, ncols=2, frameon=False)
    return figure


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.stability", description=__doc__.splitlines()[0])
    parser.add_argument("stores", nargs="+", help="HDF5 files of a study of stability, one for each case")
    parser.add_argument("-o", "--output", help="PNG, PDF or SVG; default: the first store's name with .png")
    options = parser.parse_args(arguments)
    stores = [Store(path) for path in options.stores]
    try:
        figure = draw(stores)
    except ValueError as error:
        sys.exit(str(error))
    figure.savefig(options.output or str(pathlib.Path(options.stores[0]).with_suffix(".png")), dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
