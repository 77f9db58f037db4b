"""The monoventricle of Arostica et al. 2025: runs configs/arostica.yaml on several grids, tables and picture.

    /usr/bin/python3 -m analysis.arostica 6 4 3 --cohort build/cohort   # runs these spacings, then tables and picture
    /usr/bin/python3 -m analysis.arostica                               # tables and picture of what has been run

Series stand in arostica.csv of the folder --results, a row every 5 ms; the picture needs matplotlib.
"""

import itertools

from analysis import benchmark

KPA = 1 / 7.50061683  # of a mmHg
PEAK_PA, AXES = 16074, ("x", "y", "z")
POINTS = ("p0", "p1")
KEPT_MS, TABLE_MS = 5, 100  # between rows of the CSV and of the table
COLUMNS = [f"{point}_{axis}_mm" for point in POINTS for axis in AXES]


def rows_of(store, dx):
    moved = store.displacement()[0].reshape(6, -1)
    pressure, volume = store.pressure()[0, 0] * KPA * 1000, store.volume()[0, 0]
    highest = int(pressure.argmax())  # of samples of 1 ms
    shared = {"peak_Pa": f"{pressure[highest]:.2f}", "peak_ms": f"{store.pv_ms[highest]:g}",
              "device": store.performance[0].device, "seconds": f"{store.column('wall_s')[0]:.1f}"}
    return [{"dx_mm": f"{dx:g}", "ms": f"{ms:g}", "pressure_Pa": f"{pressure[k]:.2f}", "volume_mL": f"{volume[k]:.4f}",
             **{name: f"{moved[i, k]:.4f}" for i, name in enumerate(COLUMNS)}, **shared}
            for k, ms in enumerate(store.pv_ms) if ms % KEPT_MS == 0]


def simulate(options, dx):
    with benchmark.simulated(options.cohort, options.device, "arostica", [f"grid.dx_mm={dx}"]) as store:
        return rows_of(store, dx)


def series(rows):
    """{dx: {column: list}}, coarsest first."""
    result = {}
    for dx, own in itertools.groupby(rows, lambda row: float(row["dx_mm"])):
        own = list(own)
        result[dx] = {name: [float(row[name]) for row in own] for name in ("ms", "pressure_Pa", "volume_mL", "peak_Pa", "peak_ms", *COLUMNS)}
        result[dx].update(device=own[0]["device"], seconds=own[0]["seconds"])
    return result


def extremes(all_series):
    head = ["dx (mm)", "pressure (Pa)", "off", "at (ms)", "V at rest (mL)", "largest V", "smallest V",
            *(f"{name.removesuffix('_mm').replace('_', ' ')} (mm)" for name in COLUMNS), "device", "s"]
    lines = []
    for dx, own in all_series.items():
        peak, at = own["peak_Pa"][0], own["peak_ms"][0]
        lines.append([f"{dx:g}", f"{peak:.0f}", f"{peak / PEAK_PA - 1:+.3%}", f"{at:g}",
                      f"{own['volume_mL'][0]:.2f}", f"{max(own['volume_mL']):.2f}", f"{min(own['volume_mL']):.2f}",
                      *(f"{max(own[name], key=abs):+.3f}" for name in COLUMNS), own["device"], own["seconds"]])
    return benchmark.table(head, lines)


def trajectories(all_series):
    head = ["ms", *(f"{what} at {dx:g} mm" for what in ("V", "p0 z", "p1 z") for dx in all_series)]
    lines = []
    for k in range(TABLE_MS // KEPT_MS, 1000 // KEPT_MS, TABLE_MS // KEPT_MS):
        lines.append([f"{k * KEPT_MS}", *(f"{own[name][k]:.2f}" for name in ("volume_mL", "p0_z_mm", "p1_z_mm") for own in all_series.values())])
    return benchmark.table(head, lines)


def report(all_series, options):
    grids = " ".join(f"{dx:g}" for dx in all_series)
    return "\n".join([
        "# The monoventricle of Arostica et al. 2025", "",
        f"`/usr/bin/python3 -m analysis.arostica {grids} --results {options.results}` makes this page, `arostica.csv` and the picture:",
        "`configs/arostica.yaml`, the problem as published (doi 10.1016/j.cma.2024.117485), a beat of 1 s, explicit in time, single precision. Nothing is",
        "fitted. z is the benchmark's x (the long axis, towards the base), x its y. The paper's curves are not here; what can be compared is the",
        f"largest pressure of its drive, {PEAK_PA} Pa (that of its tension: `tests/verification/tension.cpp`), and the convergence in dx. Points as there: p0 near the base, p1 26.5 mm below its rim, both in",
        "the wall. Largest displacements have the sign they had. Seconds are wall time on the device as it was, busy or idle.", "",
        "![Points and volume over the beat](arostica.png)", "",
        "## Over the beat", "", *extremes(all_series), "", "## Volume (mL) and displacement along the axis (mm)", "", *trajectories(all_series), ""])


def plot(all_series, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
    styles = {"x": ":", "y": "--", "z": "-"}
    for colour, (dx, own) in zip(plt.get_cmap("viridis")([0.85, 0.6, 0.35, 0.1, 0.0]), all_series.items()):
        for axis, point in zip(axes, POINTS):
            for direction, style in styles.items():
                axis.plot(own["ms"], own[f"{point}_{direction}_mm"], style, color=colour,
                          label=f"{direction}, {dx:g} mm" if direction == "z" else None)
        axes[2].plot(own["ms"], own["volume_mL"], color=colour, label=f"{dx:g} mm")
    for axis, point in zip(axes, POINTS):
        axis.set(title=f"{point}: x dotted, y dashed, z", xlabel="ms", ylabel="displacement, mm")
    axes[2].set(title="cavity", xlabel="ms", ylabel="volume, mL")
    for axis in axes:
        axis.grid(color="#dddddd")
        axis.legend()
    figure.savefig(path, dpi=100)


def main(arguments=None):
    options = benchmark.options("arostica", __doc__.splitlines()[0], "arostica-results").parse_args(arguments)
    all_series = series(benchmark.renewed(options, "arostica", lambda dx: simulate(options, dx)))
    (options.results / "arostica.md").write_text(report(all_series, options))
    plot(all_series, options.results / "arostica.png")


if __name__ == "__main__":
    main()
