#!/usr/bin/env python3
"""Writes sobol_directions.inc from scipy's copy of the table new-joe-kuo-6.21201.

    python3 ensemble/sobol_directions.py > ensemble/sobol_directions.inc

S. Joe, F. Y. Kuo, "Constructing Sobol' sequences with better two-dimensional projections",
SIAM J. Sci. Comput. 30 (2008) 2635-2654; https://web.maths.unsw.edu.au/~fkuo/sobol/
"""
import pathlib
import textwrap

import numpy
import scipy

DIMENSIONS = 1024  # sobol_dimensions in sampler.hpp

table = numpy.load(pathlib.Path(scipy.__file__).parent / "stats" / "_sobol_direction_numbers.npz")
numbers = []
for polynomial, initial in zip(table["poly"][1:DIMENSIONS], table["vinit"][1:DIMENSIONS]):
    degree = int(polynomial).bit_length() - 1
    numbers += [polynomial, *initial[:degree]]

print("// Direction numbers new-joe-kuo-6.21201, dimensions 2 to %d: for each the primitive polynomial" % DIMENSIONS)
print("// (binary, leading bit = degree) and its initial numbers m_1 ... m_degree. Made by sobol_directions.py.")
print("// S. Joe, F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008) 2635-2654. Copyright (c) 2008, Frances Y. Kuo and Stephen Joe,")
print("// BSD-3-Clause: https://web.maths.unsw.edu.au/~fkuo/sobol/")
print(textwrap.fill(", ".join(map(str, numbers)), 110))
