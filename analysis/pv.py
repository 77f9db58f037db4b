"""Pressure-volume loops of all chambers, and pressures and volumes over the beat, of a campaign.

    /usr/bin/python3 -m analysis.pv demo.h5 [-o demo_pv.png] [--member 3]
    /usr/bin/python3 -m analysis.pv demo.h5 --check [RANGES]

All members that are done are drawn light, one bold. Behind the pressures of the bold member ejection is shaded dark and
filling light. `--check` draws nothing: it lists the features of that member beside what is healthy, and how many of all
members are within.
"""

import argparse
import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy
from matplotlib.collections import LineCollection

from analysis.store import Store

RANGES = pathlib.Path(__file__).resolve().parents[1] / "tests" / "reference" / "physiology.yaml"
COLOURS = {"LV": "#b2182b", "RV": "#2166ac", "LA": "#e08214", "RA": "#35978f",
           "aorta": "#762a83", "pulmonary_artery": "#1b7837"}
OTHERS = ["#b2182b", "#2166ac", "#e08214", "#35978f"]
TITLES = {"LV": "left ventricle", "RV": "right ventricle", "LA": "left atrium", "RA": "right atrium",
          "pulmonary_artery": "pulmonary artery"}
ARTERIES = ("aorta", "pulmonary_artery")
SIDES = (("LV", "LA", "aorta"), ("RV", "RA", "pulmonary_artery"))
EJECTION, FILLING = "#d9d9d9", "#f2f2f2"


def colour(name, names):
    return COLOURS.get(name, OTHERS[names.index(name) % len(OTHERS)])


def opacity(members):
    return float(numpy.clip(4 / max(members - 1, 1), 0.05, 0.5))


def draw_lines(axes, x, y, bold, tint, closed=False, label=None):
    """x, y (N, T); `bold` is the row that is drawn bold."""
    if closed:
        x, y = (numpy.concatenate([series, series[:, :1]], axis=1) for series in (x, y))
    others = [numpy.column_stack([x[i], y[i]]) for i in range(len(y)) if i != bold]
    axes.add_collection(LineCollection(others, colors=tint, linewidths=0.7, alpha=opacity(len(y)), zorder=2))
    axes.plot(x[bold], y[bold], color=tint, linewidth=2, solid_joinstyle="round", zorder=3, label=label)


def tidy(axes, horizontal, vertical, title=None):
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e8e8e8", linewidth=0.6, zorder=0)
    axes.set_xlabel(horizontal)
    axes.set_ylabel(vertical)
    if title:
        axes.set_title(title, loc="left", fontsize=11)


def draw_loop(axes, name, names, pressure, volume, bold):
    """pressure, volume (N, T). A beat that ends as it began is closed."""
    ends = [numpy.ptp(series[bold]) > 0 and abs(series[bold, -1] - series[bold, 0]) < 0.05 * numpy.ptp(series[bold])
            for series in (pressure, volume)]
    draw_lines(axes, volume, pressure, bold, colour(name, names), closed=all(ends))
    axes.margins(0.06)
    axes.autoscale_view()
    tidy(axes, "volume, mL", "pressure, mmHg", TITLES.get(name, name))


def shade(axes, time_ms, where, tint):
    axes.fill_between(time_ms, 0, 1, where=where, color=tint, transform=axes.get_xaxis_transform(), linewidth=0, zorder=0)


def draw_pressures(axes, shown, names, time_ms, pressure, bold):
    """pressure (N, C, T) of `shown`, one side of the heart or all cavities."""
    at = {name: pressure[:, names.index(name)] for name in shown}
    ventricle = next((name for name in shown if name in ("LV", "RV")), None)
    artery = next((name for name in shown if name in ARTERIES), None)
    atrium = next((name for name in shown if name in ("LA", "RA")), None)
    tidy(axes, "time, ms", "pressure, mmHg")
    axes.grid(False)
    if ventricle and artery:
        shade(axes, time_ms, at[ventricle][bold] > at[artery][bold], EJECTION)
    if ventricle and atrium:
        shade(axes, time_ms, at[atrium][bold] > at[ventricle][bold], FILLING)
    draw_series(axes, at, names, time_ms, bold)


def draw_series(axes, at, names, time_ms, bold):
    for name, series in at.items():
        draw_lines(axes, numpy.broadcast_to(time_ms, series.shape), series, bold, colour(name, names),
                   label=TITLES.get(name, name))
    axes.set_xlim(time_ms[0], time_ms[-1] if len(time_ms) > 1 else time_ms[0] + 1)
    axes.margins(y=0.06)
    axes.autoscale_view(scalex=False)
    axes.legend(loc="lower right", bbox_to_anchor=(1, 0.97), frameon=False, fontsize=9, ncols=len(at))


def summary(store, member):
    """One line of the features that a reader looks for first."""
    values = dict(zip(store.feature_names, store.features[member]))
    shown = [("EDV/ESV {:.0f}/{:.0f} mL", "lv_edv_mL", "lv_esv_mL"), ("EF {:.0f} %", "lv_ef_percent"),
             ("LV peak {:.0f} mmHg", "lv_peak_mmHg"), ("aorta {:.0f}/{:.0f} mmHg", "aorta_systolic_mmHg", "aorta_diastolic_mmHg"),
             ("{:.1f} L/min", "cardiac_output_L_per_min")]
    return "    ".join(text.format(*(values[name] for name in names)) for text, *names in shown
                       if all(numpy.isfinite(values.get(name, numpy.nan)) for name in names))


def draw(compartments, time_ms, pressure, volume, bold, title="", note=""):
    """A figure of pressure and volume (N, C, T) at time_ms (T): a loop for each chamber, below them the pressures of
    either side and the volumes of the chambers."""
    chambers = [name for name in compartments if name not in ARTERIES]
    sides = [[name for name in side if name in compartments] for side in SIDES]
    sides = [side for side in sides if side]
    if any(name not in sum(sides, []) for name in chambers):
        sides = [list(compartments)]
    columns = 2 if len(chambers) > 1 else 1
    loop_rows = -(-len(chambers) // columns)
    rows = [3.2] * loop_rows + [2.6] * (len(sides) + 1)
    figure = plt.figure(figsize=(5.2 * columns + 0.4 if columns > 1 else 7, sum(rows) + 0.9), layout="constrained")
    grid = figure.add_gridspec(len(rows), columns, height_ratios=rows)
    for i, name in enumerate(chambers):
        c = compartments.index(name)
        draw_loop(figure.add_subplot(grid[i // columns, i % columns]), name, chambers, pressure[:, c], volume[:, c], bold)
    for i, side in enumerate(sides):
        draw_pressures(figure.add_subplot(grid[loop_rows + i, :]), side, compartments, time_ms, pressure, bold)
    axes = figure.add_subplot(grid[-1, :])
    tidy(axes, "time, ms", "volume, mL")
    draw_series(axes, {name: volume[:, compartments.index(name)] for name in chambers}, chambers, time_ms, bold)
    figure.suptitle(title + ("\n" + note if note else ""), x=0.01, ha="left", fontsize=11)
    return figure


def read_ranges(path):
    """{feature: (lower, upper)} of a file with a line `feature: [lower, upper]` for each; # begins a comment."""
    ranges = {}
    for number, line in enumerate(pathlib.Path(path).read_text().splitlines(), 1):
        text = line.split("#")[0].strip()
        if not text:
            continue
        match = re.fullmatch(r"(\w+): *\[ *([-+.\deE]+) *, *([-+.\deE]+) *\]", text)
        if not match:
            raise ValueError(f"{path}:{number}: expected `feature: [lower, upper]`, found: {text}")
        ranges[match[1]] = (float(match[2]), float(match[3]))
    return ranges


def check(store, member, ranges):
    """Rows (feature, value of the member, lower, upper, whether it lies within, share of all done members that do) of the
    features that have a range. A feature that is NaN lies outside."""
    features, done = store.features, store.done
    rows = []
    for column, name in enumerate(store.feature_names):
        if name not in ranges:
            continue
        lower, upper = ranges[name]
        within = (features[:, column] >= lower) & (features[:, column] <= upper)
        rows.append((name, float(features[member, column]), lower, upper, bool(within[member]), float(within[done].mean())))
    return rows


def print_check(rows, member):
    width = max(len(row[0]) for row in rows)
    print(f"{'feature':<{width}}  {f'member {member}':>10}  {'healthy':>15}           of all")
    for name, value, lower, upper, within, share in rows:
        healthy = f"{lower:g} to {upper:g}"
        verdict = "not told" if numpy.isnan(value) else "ok" if within else "OUTSIDE"
        print(f"{name:<{width}}  {value:10.4g}  {healthy:>15}  {verdict:<8}  {100 * share:3.0f} %")
    untold = sum(bool(numpy.isnan(row[1])) for row in rows)
    print(f"{sum(row[4] for row in rows)} of {len(rows)} within" + (f", {untold} not told (solver/README.md says when)" if untold else ""))


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.pv", description=__doc__.splitlines()[0])
    parser.add_argument("store", help="HDF5 file of a campaign, finished or not")
    parser.add_argument("-o", "--output", help="PNG, PDF or SVG; default: the store's name with _pv.png")
    parser.add_argument("--member", type=int, help="member drawn bold; default: the first that is done")
    parser.add_argument("--check", nargs="?", const=RANGES, metavar="RANGES",
                        help="list features beside these ranges; exit code 2 where one lies outside; "
                             "default: tests/reference/physiology.yaml")
    options = parser.parse_args(arguments)
    output = options.output or str(pathlib.Path(options.store).with_suffix("")) + "_pv.png"
    with Store(options.store) as store:
        members = numpy.flatnonzero(store.done)
        if not store.compartments:
            sys.exit(f"{options.store}: the campaign records no pressure and volume")
        if len(members) == 0:
            sys.exit(f"{options.store}: no member is done yet")
        member = members[0] if options.member is None else options.member
        if member not in members:
            sys.exit(f"{options.store}: member {member} is not done; status {store.status[member]}"
                     if 0 <= member < store.members else f"{options.store}: no member {member} among {store.members}")
        if options.check:
            rows = check(store, member, read_ranges(options.check))
            if not rows:
                sys.exit(f"{options.store}: no feature has a range in {options.check}")
            print_check(rows, member)
            sys.exit(0 if all(row[4] for row in rows) else 2)
        figure = draw(store.compartments, store.pv_ms, store.pressure(store.done), store.volume(store.done),
                      int(numpy.searchsorted(members, member)),
                      f"{pathlib.Path(options.store).name}: {len(members)} of {store.members} members, member {member} bold",
                      summary(store, member))
    figure.savefig(output, dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
