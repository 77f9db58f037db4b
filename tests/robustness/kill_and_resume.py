#!/usr/bin/env python3
"""Kills a campaign with SIGKILL again and again, resumes it, and holds the file to what it promises:

- stock h5py opens it at every moment at which it exists;
- a row that once stood as ended, of a member or a check, never changes again, and its checksum is right;
- errors that once stood as written never change again, and their checksum is right;
- the final file is that of an undisturbed run, to the bit, but for what its attribute `run_dependent` names.

The campaign is a command with {store} and {rank} in it; the same command resumes it.

    kill_and_resume.py [--processes 3] [--kills 20] [--points 100 --preload kill_at_call.so] -- cohort run x.yaml --store {store}
    kill_and_resume.py -- mpirun -n 4 cohort run x.yaml --store {store}

--kills: at random moments, any process of the command's tree or all of them. --points: at the n-th file operation of one
process (see kill_at_call.cpp), n spread over the creation and all commits.
"""
import argparse
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time
import zlib

import h5py
import numpy

ENDED = 3  # smallest status of a row that has ended
CHECKSUMMED = ["members/seed", "parameters", "unit_parameters", "ecg", "pv/pressure", "pv/volume", "displacement", "features",
               "members/reason", "members/failed_at_ms", "members/dt_ms", "members/dx_mm", "members/step_factor", "status"]
ERRORS = ["errors/checks", "errors/mean", "errors/rms", "errors/largest", "errors/left_out_rms", "errors/left_out_rms_constant",
          "errors/model", "members/error_measured", "members/error_estimate"]


class Failure(Exception):
    pass


def columns(file):
    """Paths of all datasets."""
    found = []
    file.visititems(lambda name, item: found.append(name) if isinstance(item, h5py.Dataset) else None)
    return sorted(found)


def row_bytes(file, name, row):
    return numpy.ascontiguousarray(file[name][row]).tobytes().ljust(file[name].dtype.itemsize, b"\0")


def rows_of_checks(store):
    """How many rows have ended when this or that check has, after all members."""
    with h5py.File(store, "r") as file:
        checks = len(file["checks/status"]) if "checks" in file else 0
        return range(len(file["status"]), len(file["status"]) + checks + 1)


class Witness:
    """Remembers every row that has been seen ended."""

    def __init__(self, store):
        self.store, self.rows, self.checks, self.errors, self.looks = store, {}, {}, None, 0

    def ended(self):
        return len(self.rows) + len(self.checks)

    def look(self):
        if not self.store.exists():
            return
        with h5py.File(self.store, "r") as file:
            if file.attrs["format"] != "cohort":
                raise Failure("format")
            self.look_at_errors(file)
            if "checks" in file:
                look_at_rows(file["checks"], self.checks)
            look_at_rows(file, self.rows)
        self.looks += 1

    def look_at_errors(self, file):
        if "errors" not in file:
            return
        if file["errors/state"][0] != 1:  # first: what it says was written must be whole
            if self.errors is not None:
                raise Failure("errors that had been written are gone")
            return
        contents = b"".join(file[name][()].tobytes() for name in ERRORS)
        if zlib.crc32(contents) != file["errors/crc32"][0]:
            raise Failure("errors with a wrong checksum")
        if self.errors not in (None, contents):
            raise Failure("errors changed after they had been written")
        self.errors = contents


def look_at_rows(group, rows):
    """`rows`: bytes of those that have been seen ended; adds to them."""
    status = group["status"][:]  # first: what it says ended must be whole
    for row in rows:
        if status[row] < ENDED:
            raise Failure(f"{group.name}: row {row} had ended and has status {status[row]}")
    present = [name for name in CHECKSUMMED if name in group]
    for row in numpy.flatnonzero(status >= ENDED):
        contents = b"".join(row_bytes(group, name, row) for name in present)
        if zlib.crc32(contents) != group["members/crc32"][row]:
            raise Failure(f"{group.name}: row {row} ended with a wrong checksum")
        if rows.setdefault(row, contents) != contents:
            raise Failure(f"{group.name}: row {row} changed after it had ended")


def start(command, store, rank, environment=None):
    arguments = [part.replace("{store}", str(store)).replace("{rank}", str(rank)) for part in command]
    return subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
                            env={**os.environ, **(environment or {})})


def tree(pid):
    """A process and all that descend from it."""
    pids = [pid]
    try:
        for task in os.listdir(f"/proc/{pid}/task"):
            for child in pathlib.Path(f"/proc/{pid}/task/{task}/children").read_text().split():
                pids += tree(int(child))
    except FileNotFoundError:
        pass
    return pids


def kill(pids):
    for pid in pids:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass


def finish(command, store, processes=1):
    """Runs to the end. 0: all done; 2: some members failed."""
    running = [start(command, store, rank) for rank in range(processes)]
    for process in running:
        _, errors = process.communicate()
        if process.returncode not in (0, 2):
            raise Failure(f"the campaign ends with {process.returncode}: {errors.decode()[-2000:]}")


def is_finished(store):
    if not store.exists():
        return False
    with h5py.File(store, "r") as file:
        rows = ["status", "checks/status"] if "checks" in file else ["status"]
        return all((file[name][:] >= ENDED).all() for name in rows) and ("errors" not in file or file["errors/state"][0] == 1)


def masked(store):
    """The bytes of the file, those of run-dependent datasets and attributes blanked."""
    data = bytearray(store.read_bytes())
    with h5py.File(store, "r") as file:
        for name in file.attrs["run_dependent"]:
            if name.startswith("@"):
                text = file.attrs[name[1:]].encode()
                if data.count(text) != 1:
                    raise Failure(f"attribute {name} stands {data.count(text)} times in the file")
                at = data.index(text)
                data[at:at + len(text)] = bytes(len(text))
            else:
                dataset = file[name].id
                at, size = dataset.get_offset(), dataset.get_storage_size()
                data[at:at + size] = bytes(size)
    return bytes(data)


def compare(store, reference):
    with h5py.File(store, "r") as ours, h5py.File(reference, "r") as theirs:
        if columns(ours) != columns(theirs):
            raise Failure("the files have other datasets")
        run_dependent = {name.lstrip("/") for name in ours.attrs["run_dependent"]}
        for name in columns(ours):
            if name not in run_dependent and ours[name][()].tobytes() != theirs[name][()].tobytes():
                rows = [i for i in range(len(ours[name])) if ours[name][i].tobytes() != theirs[name][i].tobytes()]
                raise Failure(f"/{name} differs from the undisturbed run in rows {rows[:10]}")
    if masked(store) != masked(reference):
        raise Failure("the files differ outside their datasets")


def clean(store):
    for path in store.parent.glob(store.name + "*"):
        path.unlink()


def no_litter(store):
    litter = [path.name for path in store.parent.glob(store.name + ".creating.*")]
    if litter:
        raise Failure(f"left behind: {litter}")


def kill_at_points(options, store, reference):
    count = store.with_suffix(".calls")
    clean(store)
    process = start(options.command, store, 0, {"LD_PRELOAD": options.preload, "COHORT_COUNT_CALLS": str(count)})
    process.communicate()
    calls = int(count.read_text())
    # The creation of the store and the first commits, where each operation is of its own kind; the checks and errors at the end.
    parts = [(range(1, calls // 8), 2), (range(calls // 8, calls * 7 // 8), 4), (range(calls * 7 // 8, calls + 1), 4)]
    chosen = sorted({point for part, share in parts for point in random.sample(part, min(options.points // share, len(part)))})
    for point in chosen:
        clean(store)
        witness = Witness(store)
        process = start(options.command, store, 0, {"LD_PRELOAD": options.preload, "COHORT_KILL_AT": str(point)})
        process.communicate()
        if process.returncode != -signal.SIGKILL:
            raise Failure(f"call {point} of {calls}: ended with {process.returncode} instead of being killed")
        witness.look()
        finish(options.command, store)
        witness.look()
        no_litter(store)
        compare(store, reference)
    print(f"{len(chosen)} of {calls} file operations interrupted, each resumed to the same file", flush=True)


def kill_at_random(options, store, reference, duration):
    kills = campaigns = looks = during_creation = during_members = during_checks = 0
    while kills < options.kills:
        clean(store)
        witness = Witness(store)
        campaigns += 1
        while not is_finished(store):
            if kills >= options.kills:
                finish(options.command, store, options.processes)
                continue
            running = [start(options.command, store, rank) for rank in range(options.processes)]
            # Half of the first kills of a campaign come early, where the store is being created.
            creating = not store.exists()
            moment = time.monotonic() + random.uniform(0, duration * (0.3 if creating and kills % 2 else 1))
            # The others come once some more rows have ended: a program that starts slowly would else always die in its start.
            enough = witness.ended() + random.randint(1, 16) if kills % 2 == 0 else 0
            if kills % 3 == 2 and store.exists():
                enough = max(enough, random.choice(rows_of_checks(store)))
            while (witness.ended() < enough or time.monotonic() < moment) and any(p.poll() is None for p in running):
                if enough and witness.ended() >= enough:
                    break
                witness.look()
                time.sleep(0.002)
            alive = [pid for p in running if p.poll() is None for pid in tree(p.pid)]
            if alive:
                victims = alive if random.random() < 0.5 else random.sample(alive, random.randint(1, len(alive)))
                during_creation += not store.exists()
                during_members += bool(witness.rows)
                during_checks += bool(witness.checks)
                kill(victims)
                kills += 1
                witness.look()
                if random.random() < 0.5:  # what is left is killed too, or goes on to the end
                    kill([pid for p in running if p.poll() is None for pid in tree(p.pid)])
            for p in running:
                while p.poll() is None:
                    witness.look()
                    time.sleep(0.005)
                p.communicate()
        witness.look()
        looks += witness.looks
        no_litter(store)
        compare(store, reference)
    print(f"{kills} kills at random moments of {campaigns} campaigns, {during_creation} before the store stood, "
          f"{during_members} with members and {during_checks} with checks ended; {looks} looks with h5py", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=1, help="how many times the command runs at once")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--points", type=int, default=0)
    parser.add_argument("--preload", help="path of kill_at_call.so, for --points")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--counts", type=lambda text: [int(n) for n in text.split(",")], default=[],
                        help="numbers of processes that must give the same file")
    parser.add_argument("command", nargs="+")
    options = parser.parse_args()
    random.seed(options.seed)
    print(f"seed {options.seed}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        store, reference = pathlib.Path(folder) / "campaign.h5", pathlib.Path(folder) / "reference.h5"
        finish(options.command, reference)
        begun = time.monotonic()
        finish(options.command, store, options.processes)
        duration = time.monotonic() - begun
        compare(store, reference)
        try:
            for count in options.counts:
                clean(store)
                finish(options.command, store, count)
                compare(store, reference)
                print(f"{count} processes: the same file", flush=True)
            if options.points:
                kill_at_points(options, store, reference)
            if options.kills:
                kill_at_random(options, store, reference, duration)
        except Failure as failure:
            sys.exit(f"FAILED (seed {options.seed}): {failure}")


if __name__ == "__main__":
    main()
