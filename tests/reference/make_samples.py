#!/usr/bin/env python3
"""Writes sobol.csv and truncated_normal.csv from scipy (1.10.1 when they were made), and prints the checksum of
sobol_directions that tests/unit/sobol.cpp pins.

    python3 tests/reference/make_samples.py
"""
import pathlib
import warnings
import zlib

import scipy
from scipy.stats import qmc, truncnorm

warnings.simplefilter("ignore")
here = pathlib.Path(__file__).parent

points = qmc.Sobol(1024, scramble=False).random(2048)
with open(here / "sobol.csv", "w") as out:
    out.write("# scipy %s, qmc.Sobol(1024, scramble=False): member, axis, coordinate\n" % scipy.__version__)
    for member in [0, 1, 2, 3, 4, 5, 6, 7, 15, 16, 100, 1000, 2047]:
        for axis in [0, 1, 2, 3, 10, 100, 500, 1023]:
            out.write("%d,%d,%r\n" % (member, axis, float(points[member, axis])))
print("crc32 of 2048 x 1024 little-endian doubles: 0x%08x" % zlib.crc32(points.astype("<f8").tobytes()))

with open(here / "truncated_normal.csv", "w") as out:
    out.write("# scipy %s, truncnorm.ppf: mean, standard deviation, lower, upper, u, value\n" % scipy.__version__)
    for mean, sd, lower, upper in [(10, 1, 7, 14), (0, 1, -1, 1), (0, 1, 5, 9), (0, 1, -30, -8), (0, 1, -8, 30), (5, 0.1, 0, 100)]:
        for u in [0, 1e-9, 0.001, 0.1, 0.25, 0.5, 0.75, 0.9, 0.999, 1]:
            value = truncnorm.ppf(u, (lower - mean) / sd, (upper - mean) / sd, mean, sd)
            out.write(",".join(repr(float(x)) for x in (mean, sd, lower, upper, u, value)) + "\n")
