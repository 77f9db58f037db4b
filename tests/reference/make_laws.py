"""Writes laws.csv: second Piola-Kirchhoff stresses of the passive laws at a few states, from the energies as the papers write
them, in components or invariants, differentiated by complex steps (exact to rounding). Nothing of it comes from the kernels.

Energies: Guccione in the frame of fibre, sheet, normal (Land et al. 2015, eq. 2.2); neo-Hookean, Mooney-Rivlin, Saint Venant-Kirchhoff and
Ogden after Holzapfel 2000, section 6.5; Holzapfel & Ogden after Arostica et al. 2025.
Columns: law, F row by row, f, s, S as xx yy zz yz xz xy in kPa. Parameters are the defaults of kernels/laws.
"""

import csv
import sys

import numpy as np


def guccione(C, f, s):
    n = np.cross(f, s)
    frame = np.array([f, s, n])
    E = frame @ ((C - np.eye(3)) / 2) @ frame.T
    Q = (8 * E[0, 0] ** 2 + 3 * (E[1, 1] ** 2 + E[2, 2] ** 2 + E[1, 2] ** 2 + E[2, 1] ** 2)
         + 4 * (E[0, 1] ** 2 + E[1, 0] ** 2 + E[0, 2] ** 2 + E[2, 0] ** 2))
    return 4 / 2 * (np.exp(Q) - 1)


def isochoric(C):
    return C * np.linalg.det(C) ** (-1 / 3)


def neo_hookean(C, f, s):
    return 20 / 2 * (np.trace(isochoric(C)) - 3)


def mooney_rivlin(C, f, s):
    Cb = isochoric(C)
    I1, I2 = np.trace(Cb), 0.5 * (np.trace(Cb) ** 2 - np.trace(Cb @ Cb))
    return 5 * (I1 - 3) + 5 * (I2 - 3)


def st_venant_kirchhoff(C, f, s):
    E = (C - np.eye(3)) / 2
    return 0.0 / 2 * np.trace(E) ** 2 + 20 * np.trace(E @ E)


def ogden(C, f, s):
    values = np.linalg.eigvals(isochoric(C))
    return sum(mu / alpha * (np.sum(values ** (alpha / 2)) - 3) for mu, alpha in ((29.8, 1.3), (0.057, 5), (-0.47, -2)))


def holzapfel_ogden(C, f, s):
    I1, I4f, I4s, I8 = np.trace(isochoric(C)), f @ C @ f, s @ C @ s, f @ C @ s
    on = lambda x: 1 / (1 + np.exp(-100 * x))
    fibres = lambda x, a, b: a / (2 * b) * on(x) * (np.exp(b * x * x) - 1)
    return (0.059 / (2 * 8.023) * (np.exp(8.023 * (I1 - 3)) - 1) + fibres(I4f - 1, 18.472, 16.026) + fibres(I4s - 1, 2.481, 11.12)
            + 0.216 / (2 * 11.436) * (np.exp(11.436 * I8 ** 2) - 1))


def stress(energy, F, f, s):
    C, h, S = F.T @ F, 1e-30, {}
    for name, (i, k) in dict(xx=(0, 0), yy=(1, 1), zz=(2, 2), yz=(1, 2), xz=(0, 2), xy=(0, 1)).items():
        step = np.zeros((3, 3), complex)
        step[i, k] += 0.5j * h
        step[k, i] += 0.5j * h
        S[name] = 2 * energy(C + step, f, s).imag / h
    return S


def main():
    random = np.random.default_rng(4)
    rows = []
    for law in (guccione, neo_hookean, mooney_rivlin, st_venant_kirchhoff, ogden, holzapfel_ogden):
        for size in (0.03, 0.1, 0.2, 0.3):
            F = np.eye(3) + size * random.uniform(-1, 1, (3, 3))
            frame, _ = np.linalg.qr(random.normal(size=(3, 3)))
            S = stress(law, F, frame[0], frame[1])
            rows.append([law.__name__, *F.ravel(), *frame[0], *frame[1], *S.values()])
    with open(sys.argv[1] if len(sys.argv) > 1 else "laws.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["law"] + [f"F_{a}{b}" for a in "xyz" for b in "xyz"] + [f"f_{a}" for a in "xyz"] + [f"s_{a}" for a in "xyz"]
                        + ["S_" + c for c in ("xx", "yy", "zz", "yz", "xz", "xy")])
        for row in rows:
            writer.writerow([row[0]] + [f"{x:.17g}" for x in row[1:]])


main()
