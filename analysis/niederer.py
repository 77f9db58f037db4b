"""The benchmark of Niederer et al. 2011: runs configs/niederer.yaml, compares with the eleven codes of the paper, draws.

    /usr/bin/python3 -m analysis.niederer 0.5 0.2 0.1 --cohort build/cohort     # runs these spacings, then table and plot
    /usr/bin/python3 -m analysis.niederer                                       # table and plot of what has been run

Activation times are kept in niederer.csv of the folder --results, one row for each point; a spacing that is run again replaces its
rows. Called by jobs/niederer.sh. The plot needs matplotlib and is left out where there is none.
"""

import argparse
import csv
import pathlib
import subprocess
import sys
import tempfile

import numpy

from analysis.store import Store

SOURCE = pathlib.Path(__file__).resolve().parents[1]
CONFIG = SOURCE / "configs" / "niederer.yaml"
REFERENCE = SOURCE / "tests" / "reference" / "niederer2011.csv"
RESULTS = pathlib.Path("niederer-results")
END_MS = {0.5: 200, 0.2: 70}  # all is activated by then; finer grids by
FINE_END_MS = 55
CORNER = numpy.array([20.0, 7.0, 3.0])  # far end of the diagonal
DIAGONAL = numpy.linspace(0, 1, 21)
CONVERGED_MS, CONVERGED_TOLERANCE_MS = 42.75, 1  # at the far corner: codes that converge give 42.5 to 43 ms
COLUMNS = ("dx_mm", "dt_ms", "x_mm", "y_mm", "z_mm", "activation_ms", "set", "device", "seconds")


def reference():
    """{(x, y, z): {spacing: (mean, deviation)}} of the paper."""
    rows = csv.DictReader(line for line in REFERENCE.read_text().splitlines() if not line.startswith("#"))
    result = {}
    for row in rows:
        point = tuple(float(row[axis]) for axis in ("x_mm", "y_mm", "z_mm"))
        spacings = [float(name.removeprefix("mean_")) for name in row if name.startswith("mean_")]
        result[point] = {dx: (float(row[f"mean_{dx}"]), float(row[f"sd_{dx}"])) for dx in spacings}
    return result


def simulate(cohort, device, dx):
    """Rows of one spacing: the nine points of the paper and the diagonal through P1, P9 and P8."""
    points = [("point", f"p{i}", numpy.array(point)) for i, point in enumerate(reference(), 1)]
    points += [("diagonal", f"d{i}", share * CORNER) for i, share in enumerate(DIAGONAL)]
    probes = ", ".join(f"{name}_mm: [{', '.join(f'{x:.10g}' for x in place)}]" for _, name, place in points)
    settings = [f"grid.dx_mm={dx}", f"time.end_ms={END_MS.get(dx, FINE_END_MS)}", f"outputs.activation.probes={{{probes}}}"]
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "niederer.h5"
        command = [cohort, "run", str(CONFIG), "--store", str(path), *(["--device", device] if device else [])]
        for setting in settings:
            command += ["--set", setting]
        if subprocess.run(command, stdout=subprocess.DEVNULL).returncode != 0:
            sys.exit(f"dx {dx} mm did not end well")
        with Store(path) as store:
            times = dict(zip(store.feature_names, store.features[0]))
            dt_ms, seconds = store.column("dt_ms")[0], store.column("wall_s")[0]
            name = store.performance[0].device
    return [dict(zip(COLUMNS, (f"{dx:g}", f"{dt_ms:g}", *(f"{x:g}" for x in place), f"{times[f'activation_{probe}_ms']:.3f}",
                               kind, name, f"{seconds:.1f}"))) for kind, probe, place in points]


def read(path):
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(sorted(rows, key=lambda row: -float(row["dx_mm"])))  # stable: points keep their order


def times(rows, kind):
    """{spacing: {(x, y, z): ms}}, coarsest first."""
    result = {}
    for row in rows:
        if row["set"] == kind:
            place = tuple(float(row[axis]) for axis in ("x_mm", "y_mm", "z_mm"))
            result.setdefault(float(row["dx_mm"]), {})[place] = float(row["activation_ms"])
    return result


def richardson(coarse, middle, fine):
    """Order and limit of values on spacings that halve."""
    if not (coarse - middle) / (middle - fine) > 0:
        return float("nan"), float("nan")
    order = float(numpy.log2((coarse - middle) / (middle - fine)))
    return order, fine - (middle - fine) / (2**order - 1)


def table(dx, ours, codes):
    lines = [f"| point (mm) | ours (ms) | eleven codes, mean (SD) | difference | in SD |", "|---|---|---|---|---|"]
    for point, time in ours.items():
        name = f"({', '.join(f'{x:g}' for x in point)})"
        if dx in codes[point]:
            mean, deviation = codes[point][dx]
            lines.append(f"| {name} | {time:.2f} | {mean:.2f} ({deviation:.2f}) | {time - mean:+.2f} | {(time - mean) / deviation:+.2f} |")
        else:
            lines.append(f"| {name} | {time:.2f} | not published | | |")
    return lines


def report(rows, folder):
    codes, points = reference(), times(rows, "point")
    lines = [
        "# The benchmark of Niederer et al. 2011", "",
        f"`jobs/niederer.sh --results {folder} {' '.join(f'{dx:g}' for dx in points)}` makes this page, `niederer.csv` and the plot",
        "on the device that each spacing names: `configs/niederer.yaml`, the problem as published",
        "(doi 10.1098/rsta.2011.0139), with ten Tusscher-Panfilov 2006 cells, monodomain, dt 0.01 ms, single precision. Nothing is",
        "fitted. Means and standard deviations (SD) are those of the paper's eleven codes at the same spacing and step. Seconds are wall time on the",
        "device as it was, busy or idle.", "",
        "![Activation along the diagonal](niederer.png)", ""]
    for dx, ours in points.items():
        run = next(row for row in rows if float(row["dx_mm"]) == dx)
        within = sum(abs(time - codes[point][dx][0]) <= codes[point][dx][1] for point, time in ours.items() if dx in codes[point])
        known = sum(dx in codes[point] for point in ours)
        lines += [f"## dx {dx:g} mm", "",
                  f"dt {run['dt_ms']} ms, {run['device']}, {run['seconds']} s."
                  + (f" {within} of {known} points within one SD." if known else ""), "", *table(dx, ours, codes), ""]
    lines += ["## Richardson's extrapolation at the far corner, (20, 7, 3)", ""]
    corner = tuple(CORNER)
    if all(dx in points for dx in (0.2, 0.1, 0.05)):
        series = [points[dx][corner] for dx in (0.2, 0.1, 0.05)]
        order, limit = richardson(*series)
        lines += [f"From t(0.2) = {series[0]:.2f}, t(0.1) = {series[1]:.2f}, t(0.05) = {series[2]:.2f} ms: observed order",
                  f"p = log2((t(0.2) - t(0.1)) / (t(0.1) - t(0.05))) = {order:.2f}, limit",
                  f"t(0.05) - (t(0.1) - t(0.05)) / (2^p - 1) = {limit:.2f} ms. Codes that converge give 42.5 to 43 ms; the difference from",
                  f"{CONVERGED_MS} ms is {limit - CONVERGED_MS:+.2f} ms, {'within' if abs(limit - CONVERGED_MS) <= CONVERGED_TOLERANCE_MS else 'NOT within'}"
                  f" {CONVERGED_TOLERANCE_MS} ms."]
    else:
        lines += ["Needs the spacings 0.2, 0.1 and 0.05 mm; not all have been run."]
    return "\n".join(lines) + "\n"


def plot(rows, path):
    try:
        import matplotlib
    except ImportError:
        print("no matplotlib: the plot is left out; run /usr/bin/python3 -m analysis.niederer where there is one")
        return
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    codes = reference()
    figure, axes = plt.subplots(figsize=(7.5, 5), layout="constrained")
    diagonals = times(rows, "diagonal")
    for colour, (dx, ours) in zip(plt.get_cmap("viridis")(numpy.linspace(0.9, 0, len(diagonals))), diagonals.items()):
        distance = [numpy.linalg.norm(place) for place in ours]
        axes.plot(distance, list(ours.values()), color=colour, marker=".", label=f"dx {dx:g} mm")
        for point in ((0, 0, 0), (10, 3.5, 1.5), tuple(CORNER)):
            if dx in codes[point]:
                mean, deviation = codes[point][dx]
                axes.errorbar(numpy.linalg.norm(point) + 0.12, mean, deviation, color=colour, marker="s", mfc="white", capsize=4)
    axes.errorbar([], [], [], color="grey", marker="s", mfc="white", capsize=4, linestyle="none", label="eleven codes: mean, SD")
    axes.set(xlabel="distance from (0, 0, 0) along the diagonal to (20, 7, 3), mm", ylabel="activation, ms", ylim=(0, None),
             xlim=(-0.3, numpy.linalg.norm(CORNER) + 0.5))
    axes.grid(color="#dddddd")
    axes.legend()
    figure.savefig(path, dpi=110)


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.niederer", description=__doc__.splitlines()[0])
    parser.add_argument("spacings", nargs="*", type=float, help="mm; run before the table is made")
    parser.add_argument("--cohort", default="build/cohort")
    parser.add_argument("--device", help="as of cohort run")
    parser.add_argument("--results", type=pathlib.Path, default=RESULTS, help="folder of niederer.csv, .md and .png; default: %(default)s")
    options = parser.parse_args(arguments)
    path = options.results / "niederer.csv"
    for dx in options.spacings:
        new = simulate(options.cohort, options.device, dx)
        options.results.mkdir(parents=True, exist_ok=True)
        write(path, [row for row in read(path) if float(row["dx_mm"]) != dx] + new)
    rows = read(path)
    if not rows:
        sys.exit(f"{path}: nothing has been run")
    (options.results / "niederer.md").write_text(report(rows, options.results))
    plot(rows, options.results / "niederer.png")


if __name__ == "__main__":
    main()
