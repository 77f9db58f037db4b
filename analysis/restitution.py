"""Restitution of tissue: APD90 and conduction velocity of the last beat against the diastolic interval before it.

    /usr/bin/python3 -m analysis.restitution restitution.h5 [-o restitution.png] [--near near] [--far far]

Prints a row for each member of a campaign like configs/restitution.yaml and draws the curves. Members whose last stimulus
was not conducted to both probes are told and left out.
"""

import argparse
import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

from analysis.store import Store


def distance_mm(campaign, near, far):
    """Between two probes of a campaign's text, where what --set has changed comes last."""
    places = [re.findall(rf"\b{re.escape(probe)}_mm:\s*\[([^]]*)\]", campaign)[-1] for probe in (near, far)]
    return float(numpy.linalg.norm(numpy.subtract(*([float(x) for x in place.split(",")] for place in places))))


def curves(store, near, far):
    """Rows (diastolic interval ms, APD90 ms, velocity mm/ms) by rising interval, and the number of members left out."""
    names = store.feature_names
    for probe in (near, far):
        if f"apd90_{probe}_ms" not in names:
            sys.exit(f"{store.path}: no beats at a probe \"{probe}\"; the campaign needs outputs.activation.beats: true")
    features = store.features[store.done]
    get = lambda name: features[:, names.index(name)].astype(float)
    delay = get(f"activation_latest_{far}_ms") - get(f"activation_latest_{near}_ms")
    rows = numpy.column_stack([get(f"di_{near}_ms"), get(f"apd90_{near}_ms"), distance_mm(store.campaign, near, far) / delay])
    most = get(f"activations_{near}").max(initial=0)
    conducted = (get(f"activations_{near}") == most) & (get(f"activations_{far}") == most) & numpy.isfinite(rows).all(axis=1)
    rows = rows[conducted]
    return rows[numpy.argsort(rows[:, 0])], int((~conducted).sum())


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="/usr/bin/python3 -m analysis.restitution", description=__doc__.splitlines()[0])
    parser.add_argument("store")
    parser.add_argument("-o", "--output", help="PNG, PDF or SVG; default: the store's name with .png")
    parser.add_argument("--near", default="near", help="probe where APD90 is read")
    parser.add_argument("--far", default="far", help="probe to which the velocity is measured")
    options = parser.parse_args(arguments)
    with Store(options.store) as store:
        rows, left_out = curves(store, options.near, options.far)
    if len(rows) == 0:
        sys.exit(f"{options.store}: no member's last beat was conducted")
    print("di_ms  apd90_ms  velocity_mm_per_ms")
    for row in rows:
        print("{:5.1f}  {:8.1f}  {:18.3f}".format(*row))
    if left_out:
        print(f"{left_out} left out: the last beat was not conducted, or has not ended")
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
    for axes, column, label in zip(panels, (1, 2), ("APD90 (ms)", "conduction velocity (mm/ms)")):
        axes.plot(rows[:, 0], rows[:, column], color="#31688e", marker="o", markersize=4)
        axes.set(xlabel="diastolic interval (ms)", ylabel=label, xlim=(0, None), ylim=(0, None))
        axes.grid(color="#dddddd")
    figure.savefig(options.output or str(pathlib.Path(options.store).with_suffix("")) + ".png", dpi=110)


if __name__ == "__main__":
    main()
