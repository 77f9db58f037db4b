"""What the published benchmarks of the mechanics share: a campaign of one member on several grids, rows kept in a CSV."""

import argparse
import contextlib
import csv
import pathlib
import subprocess
import sys
import tempfile

from analysis.store import Store

SOURCE = pathlib.Path(__file__).resolve().parents[1]


@contextlib.contextmanager
def simulated(cohort, device, config, settings):
    """The Store of configs/<config>.yaml with these settings, run to its end."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / f"{config}.h5"
        command = [cohort, "run", str(SOURCE / "configs" / f"{config}.yaml"), "--store", str(path),
                   *(["--device", device] if device else [])]
        for setting in settings:
            command += ["--set", setting]
        ended = subprocess.run(command, stdout=subprocess.DEVNULL)
        with Store(path) as store:
            if ended.returncode != 0 or not store.done.all():
                sys.exit(f"{config} with {settings} did not end well: {store.column('reason')[0]}")
            yield store


def read(path):
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write(path, rows):
    """Coarsest grid first; rows of a grid keep their order."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(sorted(rows, key=lambda row: -float(row["dx_mm"])))


def options(name, description, results):
    parser = argparse.ArgumentParser(prog=f"/usr/bin/python3 -m analysis.{name}", description=description)
    parser.add_argument("spacings", nargs="*", type=float, help="mm; run before the tables are made, others keep what the folder has")
    parser.add_argument("--cohort", default="build/cohort")
    parser.add_argument("--device", help="as of cohort run")
    parser.add_argument("--results", type=pathlib.Path, default=pathlib.Path(results),
                        help=f"folder of {name}.csv, .md and .png; default: %(default)s")
    return parser


def renewed(options, name, rows_of):
    """Rows of all grids: those named are run by rows_of(dx)."""
    path = options.results / f"{name}.csv"
    for dx in options.spacings:
        new = rows_of(dx)
        write(path, [row for row in read(path) if float(row["dx_mm"]) != dx] + new)
    rows = read(path)
    if not rows:
        sys.exit(f"{path}: nothing has been run")
    return rows


def table(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(row) + " |" for row in rows)]
