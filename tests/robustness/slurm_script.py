#!/usr/bin/env python3
"""jobs/campaign.slurm hands SIGTERM on, queues an interrupted campaign again and ends with its exit code once it is done.

Stand-ins for srun and scontrol take Slurm's place. usage: slurm_script.py COHORT SOURCE_DIR
"""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import h5py

DONE, INTERRUPTED = 3, 3
SRUN = """#!/usr/bin/env bash
while [[ $1 == -* ]]; do shift; done
exec "$@"
"""
SCONTROL = """#!/usr/bin/env bash
echo "$@" > "$(dirname "$0")/requeued"
"""


def members_done(store):
    try:
        with h5py.File(store, "r", locking=False) as file:
            return int((file["status"][:] == DONE).sum())
    except OSError:
        return 0


def expect(condition, what):
    print(f"{'ok    ' if condition else 'FAILED'} {what}")
    if not condition:
        sys.exit(1)


def main(cohort, source):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for tool, text in (("srun", SRUN), ("scontrol", SCONTROL)):
            (folder / tool).write_text(text)
            (folder / tool).chmod(0o755)
        store, requeued = folder / "demo.h5", folder / "requeued"
        environment = dict(os.environ, PATH=f"{folder}:{os.environ['PATH']}", COHORT=cohort, SLURM_JOB_ID="17")
        script = [f"{source}/jobs/campaign.slurm", f"{source}/configs/ecg_campaign.yaml", "--store", str(store), "--device", "cpu",
                  "--set", "grid.dx_mm=6", "--set", "time.end_ms=100", "--set", "campaign.members=12"]

        def start():
            return subprocess.Popen(script, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        job = start()
        deadline = time.monotonic() + 60
        while members_done(store) < 2 and time.monotonic() < deadline and job.poll() is None:
            time.sleep(0.01)
        job.send_signal(signal.SIGTERM)
        expect(job.wait(60) == INTERRUPTED, "an interrupted campaign returns 3")
        expect(requeued.exists() and requeued.read_text() == "requeue 17\n", "and is queued again")
        expect(2 <= members_done(store) < 12, "with some members done")

        requeued.unlink()
        expect(start().wait(120) == 0, "the same command ends it")
        expect(not requeued.exists(), "and does not queue it again")
        expect(members_done(store) == 12, "with all members done")
        expect(subprocess.run(script[:1], env=environment, capture_output=True).returncode == 1, "no campaign is bad input")


if __name__ == "__main__":
    main(*sys.argv[1:])
