"""Convergence of the operators on deformed grids: runs the tests that measure it on finer grids, writes tables and a picture.

    /usr/bin/python3 -m analysis.convergence --tests build/tests --finest 256   # minutes; study.csv, tables and picture
    /usr/bin/python3 -m analysis.convergence                                    # tables and picture of what has been run

Errors are kept in operators.csv of the folder --results; tables go into its operators.md, each between a line `<!-- table NAME -->` and
`<!-- end -->`.
"""

import argparse
import csv
import math
import os
import pathlib
import re
import subprocess
import sys

RESULTS = pathlib.Path("tests/results")
SOLVER_FINEST = 64  # Jacobi's method takes some n^2 sweeps
LENGTH = 2  # mm, edge of the domain
PROGRAMS = {
    "operators": "*Order*:*Remedy*",
    "operators_rounding": "*",
    "jacobi": "*Jacobi.Solution*",
}
OPERATORS = ("interpolation", "gradient", "divergence", "laplacian", "jacobi")
TITLES = {"laplacian": "Laplacian", "jacobi": "solution by Jacobi's method"}
CASES = (("reference", "none"), ("deformed", "displacement"))
PRECISIONS = ("single", "double")


def run(tests, finest, path):
    """Appends what the test programs measure to the file `path`, made anew."""
    path.unlink(missing_ok=True)
    for program, tests_of_it in PROGRAMS.items():
        cells = min(finest, SOLVER_FINEST) if program == "jacobi" else finest
        environment = {**os.environ, "COHORT_STUDY": str(path), "COHORT_STUDY_FINEST": str(cells)}
        command = [str(tests / program), f"--gtest_filter={tests_of_it}"]
        if subprocess.run(command, env=environment, stdout=subprocess.DEVNULL).returncode != 0:
            print(f"{program}: some expectation was not met", file=sys.stderr)


def read(path):
    """errors {(operator, configuration, coordinates, precision): {n: error}} and the other rows by their first entry."""
    errors, others = {}, {}
    for row in csv.reader(path.open()):
        if row[0] in ("rounding", "place", "pairs"):
            others.setdefault(row[0], []).append(row[1:])
        else:
            errors.setdefault(tuple(row[:4]), {})[int(row[4])] = float(row[5])
    return errors, others


def orders(errors):
    """{n: observed order from n / 2 to n}."""
    return {n: math.log2(errors[n // 2] / error) for n, error in errors.items() if n // 2 in errors}


def error_table(errors, operator):
    columns = [(*case, precision) for case in CASES for precision in PRECISIONS]
    found = [errors.get((operator, *column), {}) for column in columns]
    lines = ["| n | dx (mm) | " + " | ".join(f"{configuration}, {precision} | order" for configuration, _, precision in columns) + " |"]
    lines.append("|---" * (2 + 2 * len(columns)) + "|")
    for n in sorted(set().union(*found)):
        cells = []
        for series in found:
            p = orders(series).get(n)
            cells += [f"{series[n]:.3e}" if n in series else "", f"{p:.2f}" if p is not None else ""]
        lines.append(f"| {n} | {LENGTH / n:.5g} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def remedy_table(errors):
    names = ("left", "at the vertex", "moved")
    columns = [(f"remedy {name}", grid, "position", "double") for grid in ("deformed", "rough") for name in names]
    lines = ["| n | " + " | ".join(f"{column[1]}, {column[0].removeprefix('remedy ')} | order" for column in columns) + " |"]
    lines.append("|---" * (1 + 2 * len(columns)) + "|")
    for n in sorted(errors[columns[0]]):
        cells = []
        for column in columns:
            p = orders(errors[column]).get(n)
            cells += [f"{errors[column][n]:.2e}", f"{p:.2f}" if p is not None else ""]
        lines.append(f"| {n} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def plain_table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def sweeps_table(errors):
    """Error over sweeps of the runs that were followed, for each grid the first and last few."""
    lines = ["| configuration | precision | n | sweeps: error |", "|---|---|---|---|"]
    runs = {}
    for (operator, configuration, _, precision), series in errors.items():
        if operator.startswith("jacobi at "):
            for n, error in series.items():
                runs.setdefault((configuration, precision, n), []).append((int(operator.split()[-1]), error))
    for (configuration, precision, n), steps in sorted(runs.items()):
        steps.sort()
        kept = steps if len(steps) <= 6 else steps[:2] + steps[-4:]
        lines.append(f"| {configuration} | {precision} | {n} | " + ", ".join(f"{k}: {error:.2e}" for k, error in kept) + " |")
    return "\n".join(lines)


def tables(errors, others):
    result = {operator: error_table(errors, operator) for operator in OPERATORS}
    result["laplacian on the dual"] = error_table(errors, "laplacian on the dual")
    result["remedies"] = remedy_table(errors)
    result["sweeps"] = sweeps_table(errors)
    result["rounding"] = plain_table(["operator", "u single", "x single", "both", "single throughout"], others["rounding"])
    result["pairs"] = plain_table(["operator", "one float", "two floats"], others["pairs"])
    result["place"] = plain_table(["operator", "positions", "positions, 100 mm away", "displacements"], others["place"])
    return result


def write_tables(page, found):
    """Replaces what stands between the markers of each table."""
    text = page.read_text()
    for name, table in found.items():
        pattern = re.compile(rf"(<!-- table {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
        if not pattern.search(text):
            sys.exit(f"{page} has no place for the table '{name}'")
        text = pattern.sub(lambda match, table=table: f"{match[1]}\n{table}\n\n{match[2]}", text)
    page.write_text(text)


def draw(errors, path):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(2, len(OPERATORS), figsize=(3.1 * len(OPERATORS), 6.2), sharex=True, constrained_layout=True)
    for row, (configuration, coordinates) in zip(panels, CASES):
        for panel, operator in zip(row, OPERATORS):
            for precision, style in zip(PRECISIONS, ("o-", "s--")):
                series = errors.get((operator, configuration, coordinates, precision), {})
                sizes = sorted(series)
                panel.loglog([LENGTH / n for n in sizes], [series[n] for n in sizes], style, label=precision, markersize=5)
            last = sorted(series)
            slope = [series[last[0]] * (n / last[0]) ** -2 * 0.6 for n in last]
            panel.loglog([LENGTH / n for n in last], slope, color="0.6", linewidth=1, label="dx$^2$")
            panel.grid(True, which="major", color="0.9")
            panel.set_title(f"{TITLES.get(operator, operator)}\n{configuration}", fontsize=10)
    for panel in panels[1]:
        panel.set_xlabel("dx (mm)")
    for row in panels:
        row[0].set_ylabel("L$_2$ error")
    panels[0][0].legend(frameon=False)
    figure.savefig(path, dpi=110)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--tests", type=pathlib.Path, help="folder of the built test programs; without it nothing is run")
    arguments.add_argument("--finest", type=int, default=256, help="cells an edge of the finest grid")
    arguments.add_argument("--results", type=pathlib.Path, default=RESULTS)
    given = arguments.parse_args()
    path = given.results / "operators.csv"
    if given.tests:
        run(given.tests, given.finest, path.resolve())
    errors, others = read(path)
    draw(errors, given.results / "operators.png")
    found = tables(errors, others)
    if (given.results / "operators.md").exists():
        write_tables(given.results / "operators.md", found)
    else:
        print("\n\n".join(f"{name}\n\n{table}" for name, table in found.items()))


if __name__ == "__main__":
    main()
