"""Speed of finished campaigns as one markdown table: /usr/bin/python3 -m analysis.speed F.h5 [G.h5 ...]"""

import argparse

import numpy as np

from analysis.store import Store

COLUMNS = (
    "scene", "device", "triad GB/s", "processes", "members", "seconds a heart", "hearts an hour", "set-up share",
    "step us", "step GB/s", "of triad", "cell updates/s",
)


def row(path):
    """The cells of the table for one file.

    "-" stands where a scene has no time loop, hence no monodomain step. Seconds a heart: median wall time of a member on its process, which shares a batch; the first member, whose kernels
    are still being compiled, counts in "hearts an hour" alone. Set-up: geometry, operators and lead fields.
    """
    with Store(path) as store:
        done = store.done
        processes = store.performance
        wall = store.column("wall_s")[done]
        setup = store.column("setup_s")[done]
        step = [kernel for process in processes for kernel in process.kernels if kernel.name == "monodomain_step"]
        calls = sum(kernel.calls for kernel in step)  # none without a time loop
        step_s = sum(kernel.device_ms for kernel in step) * 1e-3 / calls if calls else 0
        timed = step_s > 0
        rate = sum(k.bytes_per_call * k.calls for k in step) / calls / step_s * 1e-9 if timed else 0
        triad = np.mean([process.triad_GB_per_s for process in processes])
        longest = max(process.wall_s for process in processes)
        updates = sum(process.cell_updates for process in processes) / longest
        return (
            f"{store.column('dx_mm')[done][0]:g} mm, dt {store.column('dt_ms')[done][0]:g} ms",
            processes[0].device, f"{triad:.0f}", str(len(processes)), str(int(done.sum())), f"{np.median(wall):.3f}",
            f"{done.sum() / longest * 3600:.0f}", f"{np.median(setup / wall):.1%}",
            *((f"{step_s * 1e6:.1f}", f"{rate:.0f}", f"{rate / triad:.0%}", f"{updates:.2e}") if timed else "-" * 4),
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+")
    arguments = parser.parse_args()
    print("| " + " | ".join(COLUMNS) + " |")
    print("|" + "---|" * len(COLUMNS))
    for path in arguments.files:
        print("| " + " | ".join(row(path)) + " |")


if __name__ == "__main__":
    main()
