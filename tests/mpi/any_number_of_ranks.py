#!/usr/bin/env python3
"""A campaign on 1, 2 and 4 ranks gives the same file to the bit, but for what its attribute `run_dependent` names.

usage: any_number_of_ranks.py COHORT CAMPAIGN [argument of cohort run]...
"""
import os
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy

RANKS = (1, 2, 4)
DONE = 3


def run(cohort, campaign, arguments, store, ranks):
    environment = dict(os.environ, OMPI_MCA_btl_vader_single_copy_mechanism="none")
    if os.getuid() == 0:
        environment.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    command = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", str(ranks), cohort, "run", campaign, *arguments,
               "--device", "cpu", "--store", str(store)]
    result = subprocess.run(command, env=environment, capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"exit code {result.returncode} on {ranks} ranks:\n{result.stderr[-2000:]}")


def attribute_bytes(value):
    return value.tobytes() if isinstance(value, numpy.ndarray) and value.dtype != object else repr(value)


def content(path):
    """The bytes of every dataset and attribute by its path, without what may differ between runs; and how many ranks took
    part, since the comparison says nothing where one rank did everything."""
    found = {}
    with h5py.File(path) as file:
        ignored = set(file.attrs["run_dependent"])

        def add(name, item):
            if isinstance(item, h5py.Dataset) and f"/{name}" not in ignored:
                found[f"/{name}"] = item[...].tobytes()
            for key, value in item.attrs.items():
                path_of_attribute = f"/{name}@{key}" if name else f"@{key}"
                if path_of_attribute not in ignored:
                    found[path_of_attribute] = attribute_bytes(value)

        file.visititems(add)
        add("", file)
        if not (file["status"][:] == DONE).all():
            sys.exit(f"{path.name}: not all members are done")
        return found, len(set(file["members/rank"][:]))


def main(cohort, campaign, *arguments):
    with tempfile.TemporaryDirectory() as folder:
        contents = {}
        for ranks in RANKS:
            store = pathlib.Path(folder) / f"ranks{ranks}.h5"
            run(cohort, campaign, arguments, store, ranks)
            contents[ranks], took_part = content(store)
            print(f"{ranks} ranks: {took_part} took part")
            if ranks > 1 and took_part == 1:
                sys.exit(f"one rank of {ranks} did everything")
    first = contents[RANKS[0]]
    wrong = [f"{name} differs on {ranks} ranks" for ranks in RANKS[1:]
             for name in sorted(first.keys() | contents[ranks].keys()) if first.get(name) != contents[ranks].get(name)]
    print("\n".join(wrong) or f"{len(first)} datasets and attributes are equal")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
