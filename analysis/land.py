"""Problems 2 and 3 of Land et al. 2015: runs configs/land_inflation.yaml and land_contraction.yaml, compares, draws.

    /usr/bin/python3 -m analysis.land 2 1 0.5 --cohort build/cohort     # runs these spacings, then tables and picture
    /usr/bin/python3 -m analysis.land                                   # tables and picture of what has been run

Places stand in land.csv of the folder --results, a row for each point; the picture needs matplotlib.
"""

import math
import re

from analysis import benchmark

BASE_MM = 5  # z of the base in the benchmark's frame; 0 in ours
PROBLEMS = {"inflation": 2, "contraction": 3}
# tests/reference/land2015.yaml: z of the apices, or its range.
REFERENCE = {("inflation", "apex_endocardium"): (-26.533, -26.533), ("inflation", "apex_epicardium"): (-28.179, -28.179),
             ("contraction", "apex_endocardium"): (-12.5, -11.99), ("contraction", "apex_epicardium"): (-15.5, -15.22)}


def simulate(options, dx):
    rows = []
    for problem in PROBLEMS:
        with benchmark.simulated(options.cohort, options.device, f"land_{problem}", [f"grid.dx_mm={dx}"]) as store:
            places = {name: [float(x) for x in place.split(",")]
                      for name, place in re.findall(r"(\w+)_mm: *\[([^\]]*)\]", store.campaign)}
            for name, moved in zip(store.points, store.displacement()[0, :, :, 0]):
                X = places[name]
                rows.append({"problem": problem, "dx_mm": f"{dx:g}", "point": name,
                             **{f"{axis}0_mm": f"{value:g}" for axis, value in zip("xyz", (X[0], X[1], X[2] + BASE_MM))},
                             **{f"{axis}_mm": f"{value + float(step):.4f}"
                                for axis, value, step in zip("xyz", (X[0], X[1], X[2] + BASE_MM), moved)},
                             "volume_mL": f"{store.volume()[0, 0, 0]:.4f}", "device": store.performance[0].device,
                             "seconds": f"{store.column('wall_s')[0]:.1f}"})
    return rows


def deviation(z, low, high):
    """Relative to the nearer end of the range; 0 within."""
    nearer = min(max(z, low), high)
    return (abs(z) - abs(nearer)) / abs(nearer)


def apices(rows, problem):
    head = ["dx (mm)", "endocardium z (mm)", "off", "epicardium z (mm)", "off", "cavity (mL)", "device", "s"]
    lines = []
    for dx in sorted({float(row["dx_mm"]) for row in rows}, reverse=True):
        own = {row["point"]: row for row in rows if row["problem"] == problem and float(row["dx_mm"]) == dx}
        line = [f"{dx:g}"]
        for point in ("apex_endocardium", "apex_epicardium"):
            z = float(own[point]["z_mm"])
            off = deviation(z, *REFERENCE[problem, point])
            line += [f"{z:.3f}", f"{off:+.2%}" if off else "within"]
        first = own["apex_endocardium"]
        lines.append([*line, first["volume_mL"], first["device"], first["seconds"]])
    ends = [" to ".join(dict.fromkeys(f"{end:g}" for end in REFERENCE[problem, point])) for point in ("apex_endocardium", "apex_epicardium")]
    return benchmark.table(head, [*lines, ["reference", ends[0], "", ends[1], "", "", "", ""]])


def line_of(rows, problem, dx):
    """Mid-wall line: ((r0, z0), (r, z), twist in degrees) from apex to base."""
    result = []
    for row in rows:
        if row["problem"] == problem and float(row["dx_mm"]) == dx and row["point"].startswith("mid_wall"):
            place = {axis: float(row[f"{axis}_mm"]) for axis in "xyz"}
            before = {axis: float(row[f"{axis}0_mm"]) for axis in "xyz"}
            twist = math.degrees(math.atan2(place["y"], place["x"])) if before["x"] > 0 else float("nan")
            result.append(((before["x"], before["z"]), (math.hypot(place["x"], place["y"]), place["z"]), twist))
    return result


def mid_wall(rows, problem):
    grids = sorted({float(row["dx_mm"]) for row in rows}, reverse=True)
    head = ["z at rest (mm)", *(f"r, z at {dx:g} mm" for dx in grids), *(f"twist at {dx:g} mm (deg)" for dx in grids)]
    lines = []
    for of_point in zip(*(line_of(rows, problem, dx) for dx in grids)):
        lines.append([f"{of_point[0][0][1]:g}", *(f"{r:.2f}, {z:.2f}" for _, (r, z), _ in of_point),
                      *("" if math.isnan(twist) else f"{twist:+.2f}" for *_, twist in of_point)])
    return benchmark.table(head, lines)


def report(rows, options):
    grids = " ".join(f"{dx:g}" for dx in sorted({float(row["dx_mm"]) for row in rows}, reverse=True))
    lines = ["# The benchmark of Land et al. 2015, problems 2 and 3", "",
             f"`/usr/bin/python3 -m analysis.land {grids} --results {options.results}` makes this page, `land.csv` and the picture:",
             "`configs/land_inflation.yaml` and `configs/land_contraction.yaml`, the problems as published (doi 10.1098/rspa.2015.0641) with Guccione's",
             "own law, bulk modulus 1000 kPa, double precision. Nothing is fitted. z counts from 5 mm below the base, as there. *off*: from the reference",
             "value, or from the nearer end of its range. Fibres take the transmural coordinate from the distances to both surfaces, as everywhere in",
             "Cohort; the benchmark's counts ellipsoids between them. Seconds are wall time on the device as it was, busy or idle.", "",
             "![Mid-wall line and twist](land.png)", ""]
    for problem, number in PROBLEMS.items():
        lines += [f"## Problem {number}, {problem}", "", *apices(rows, problem), "", "Mid-wall line, from the apex to the base:", "", *mid_wall(rows, problem), ""]
    return "\n".join(lines)


def plot(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 3, figsize=(11, 4.6), layout="constrained")
    grids = sorted({float(row["dx_mm"]) for row in rows}, reverse=True)
    for column, problem in enumerate(PROBLEMS):
        at_rest = line_of(rows, problem, grids[0])
        axes[column].plot(*zip(*(before for before, *_ in at_rest)), color="grey", linestyle="--", label="at rest")
        for colour, dx in zip(plt.get_cmap("viridis")([0.85, 0.5, 0.1, 0.0]), grids):
            line = line_of(rows, problem, dx)
            axes[column].plot(*zip(*(after for _, after, _ in line)), color=colour, marker=".", label=f"{dx:g} mm")
            if problem == "contraction":
                axes[2].plot([twist for *_, twist in line], [before[1] for before, *_ in line], color=colour, marker=".", label=f"{dx:g} mm")
        axes[column].set(title=f"problem {PROBLEMS[problem]}: mid-wall line", xlabel="distance from the axis, mm", ylabel="z, mm", aspect="equal")
        axes[column].legend(title="dx")
    axes[2].set(title="problem 3: twist of the mid-wall", xlabel="degrees", ylabel="z at rest, mm")
    axes[2].legend(title="dx")
    for axis in axes:
        axis.grid(color="#dddddd")
    figure.savefig(path, dpi=100)


def main(arguments=None):
    options = benchmark.options("land", __doc__.splitlines()[0], "land-results").parse_args(arguments)
    rows = benchmark.renewed(options, "land", lambda dx: simulate(options, dx))
    (options.results / "land.md").write_text(report(rows, options))
    plot(rows, options.results / "land.png")


if __name__ == "__main__":
    main()
