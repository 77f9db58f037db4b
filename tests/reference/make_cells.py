#!/usr/bin/env python3
"""Writes cells.csv: action potentials of the cell models in kernels/cells, integrated from their published equations, written out here
as the papers and the models' CellML files have them, by scipy (1.10.1 when they were made; DOP853 for the models
of a few equations, whose right-hand sides jump, LSODA for the others) with tolerances of 1e-9.

    python3 tests/reference/make_cells.py

A train of five pulses every second from the initial state, then one pulse more after `interval` ms (0: none). Columns: model,
layer, interval, rest (mV before the last pulse of the train), peak (mV), APD90 (ms; of the pulse more where there is one), greatest
dV/dt (mV/ms), diastolic and greatest Cai of the last beat (uM; 0 where the model has none).
APD90 runs between the crossings of rest + 0.1 (peak - rest), with rest and peak of the train's last beat.
"""
import pathlib
from math import exp, log, sqrt, tanh, expm1

import numpy as np
import scipy
from scipy.integrate import solve_ivp

here = pathlib.Path(__file__).parent


def fitzhugh_nagumo(layer):
    a, b, c1, c2, d, rest, amplitude = 0.13, 0.013, 0.26, 0.1, 1.0, -85.0, 125.0

    def f(t, y, stimulus):
        u, v = (y[0] - rest) / amplitude, y[1]
        return [amplitude * (c1 * u * (u - a) * (1 - u) - c2 * u * v) + stimulus, b * (u - d * v)]

    return f, [rest, 0.0], None, (2, 40)


def aliev_panfilov(layer):
    k, a, e0, mu1, mu2, unit = 8.0, 0.15, 0.002, 0.2, 0.3, 12.9

    def f(t, y, stimulus):
        u, v = (y[0] + 80) / 100, y[1]
        du = -k * u * (u - a) * (u - 1) - u * v
        dv = (e0 + mu1 * v / (u + mu2)) * (-v - k * u * (u - a - 1))
        return [100 * du / unit + stimulus, dv / unit]

    return f, [-80.0, 0.0], None, (2, 20)


BUENO = {  # Bueno-Orovio et al. 2008, table 1
    "epi": (0, 1.55, 0.3, 0.13, 0.006, 0.006, 60, 1150, 1.4506, 60, 15, 65, 0.03, 200, 0.11, 400, 6, 30.0181, 0.9957, 2.0458,
            0.65, 2.7342, 16, 2.0994, 0.9087, 1.8875, 0.07, 0.94),
    "endo": (0, 1.56, 0.3, 0.13, 0.2, 0.006, 75, 10, 1.4506, 6, 140, 200, 0.016, 280, 0.1, 470, 6, 40, 1.2, 2, 0.65, 2.7342, 2,
             2.0994, 0.9087, 2.9013, 0.0273, 0.78),
    "mid": (0, 1.61, 0.3, 0.13, 0.1, 0.005, 80, 1.4506, 1.4506, 70, 8, 200, 0.016, 280, 0.078, 410, 7, 91, 0.8, 2.1, 0.6, 2.7342, 4,
            2.0994, 0.9087, 3.3849, 0.01, 0.5),
}


def bueno_orovio(layer):
    (uo, uu, tv, tw, tvm, to, tv1, tv2, tvp, tw1, tw2, kw, uw, twp, tfi, to1, to2, tso1, tso2, kso, uso, ts1, ts2, ks, us, tsi, twinf,
     wstar) = BUENO[layer]

    def H(x):
        return 1.0 if x >= 0 else 0.0

    def f(t, y, stimulus):
        u, v, w, s = (y[0] + 84) / 85.7, y[1], y[2], y[3]
        tauvm = (1 - H(u - tvm)) * tv1 + H(u - tvm) * tv2
        tauwm = tw1 + (tw2 - tw1) * (1 + tanh(kw * (u - uw))) / 2
        tauso = tso1 + (tso2 - tso1) * (1 + tanh(kso * (u - uso))) / 2
        taus = (1 - H(u - tw)) * ts1 + H(u - tw) * ts2
        tauo = (1 - H(u - to)) * to1 + H(u - to) * to2
        vinf = 1.0 if u < tvm else 0.0
        winf = (1 - H(u - to)) * (1 - u / twinf) + H(u - to) * wstar
        Jfi = -v * H(u - tv) * (u - tv) * (uu - u) / tfi
        Jso = (u - uo) * (1 - H(u - tw)) / tauo + H(u - tw) / tauso
        Jsi = -H(u - tw) * w * s / tsi
        dv = (1 - H(u - tv)) * (vinf - v) / tauvm - H(u - tv) * v / tvp
        dw = (1 - H(u - tw)) * (winf - w) / tauwm - H(u - tw) * w / twp
        ds = ((1 + tanh(ks * (u - us))) / 2 - s) / taus
        return [-85.7 * (Jfi + Jso + Jsi) + stimulus, dv, dw, ds]

    return f, [-84.0, 1.0, 1.0, 0.0], None, (1, 40)


def ten_tusscher_panfilov(layer):
    Rg, F, T = 8314.472, 96485.3415, 310.0
    RTF = Rg * T / F
    Ko, Cao, Nao, Cm, Vc, Vsr, Vss = 5.4, 2.0, 140.0, 0.185, 0.016404, 0.001094, 0.00005468
    gto = 0.073 if layer == "endo" else 0.294
    gKs = 0.098 if layer == "mid" else 0.392

    def f(t, y, stimulus):
        V, Cai, CaSR, CaSS, Nai, Ki, m, h, j, xr1, xr2, xs, r, s, d, f_, f2, fc, RR = y
        EK, ENa = RTF * log(Ko / Ki), RTF * log(Nao / Nai)
        EKs, ECa = RTF * log((Ko + 0.03 * Nao) / (Ki + 0.03 * Nai)), 0.5 * RTF * log(Cao / Cai)
        aK1 = 0.1 / (1 + exp(0.06 * (V - EK - 200)))
        bK1 = (3 * exp(0.0002 * (V - EK + 100)) + exp(0.1 * (V - EK - 10))) / (1 + exp(-0.5 * (V - EK)))
        IK1 = 5.405 * aK1 / (aK1 + bK1) * (V - EK)
        INa = 14.838 * m**3 * h * j * (V - ENa)
        x = 2 * (V - 15) * F / (Rg * T)
        ghk = 1.0 - x / 2 if abs(x) < 1e-7 else x / expm1(x)
        ICaL = 3.98e-5 * d * f_ * f2 * fc * 2 * F * ghk * (0.25 * CaSS * exp(x) - Cao)
        Ito = gto * r * s * (V - EK)
        IKr = 0.153 * sqrt(Ko / 5.4) * xr1 * xr2 * (V - EK)
        IKs = gKs * xs**2 * (V - EKs)
        e1, e2 = exp(0.35 * V / RTF), exp((0.35 - 1) * V / RTF)
        INaCa = 1000 * (e1 * Nai**3 * Cao - e2 * Nao**3 * Cai * 2.5) / ((87.5**3 + Nao**3) * (1.38 + Cao) * (1 + 0.1 * e2))
        INaK = 2.724 * Ko / (Ko + 1) * Nai / (Nai + 40) / (1 + 0.1245 * exp(-0.1 * V / RTF) + 0.0353 * exp(-V / RTF))
        IpCa = 0.1238 * Cai / (0.0005 + Cai)
        IpK = 0.0146 * (V - EK) / (1 + exp((25 - V) / 5.98))
        IbNa, IbCa = 0.00029 * (V - ENa), 0.000592 * (V - ECa)
        kcasr = 2.5 - 1.5 / (1 + (1.5 / CaSR)**2)
        k1, k2 = 0.15 / kcasr, 0.045 * kcasr
        OO = k1 * CaSS**2 * RR / (0.06 + k1 * CaSS**2)
        Irel, Ileak = 0.102 * OO * (CaSR - CaSS), 0.00036 * (CaSR - Cai)
        Iup, Ixfer = 0.006375 / (1 + 0.00025**2 / Cai**2), 0.0038 * (CaSS - Cai)
        dCai = (-(IbCa + IpCa - 2 * INaCa) * Cm / (2 * Vc * F) - (Iup - Ileak) * Vsr / Vc + Ixfer) / (1 + 0.2 * 0.001 / (Cai + 0.001)**2)
        dCaSR = (Iup - Irel - Ileak) / (1 + 10 * 0.3 / (CaSR + 0.3)**2)
        dCaSS = (-Ixfer * Vc / Vss + Irel * Vsr / Vss - ICaL * Cm / (2 * Vss * F)) / (1 + 0.4 * 0.00025 / (CaSS + 0.00025)**2)
        dNai = -(INa + IbNa + 3 * INaK + 3 * INaCa) * Cm / (Vc * F)
        dKi = -(IK1 + Ito + IKr + IKs - 2 * INaK + IpK - stimulus) * Cm / (Vc * F)
        minf = 1 / (1 + exp((-56.86 - V) / 9.03))**2
        taum = 1 / (1 + exp((-60 - V) / 5)) * (0.1 / (1 + exp((V + 35) / 5)) + 0.1 / (1 + exp((V - 50) / 200)))
        hinf = 1 / (1 + exp((V + 71.55) / 7.43))**2
        if V >= -40:
            rh = 0.77 / (0.13 * (1 + exp(-(V + 10.66) / 11.1)))
            rj = 0.6 * exp(0.057 * V) / (1 + exp(-0.1 * (V + 32)))
        else:
            rh = 0.057 * exp(-(V + 80) / 6.8) + 2.7 * exp(0.079 * V) + 3.1e5 * exp(0.3485 * V)
            rj = ((-2.5428e4 * exp(0.2444 * V) - 6.948e-6 * exp(-0.04391 * V)) * (V + 37.78) / (1 + exp(0.311 * (V + 79.23))) +
                  0.02424 * exp(-0.01052 * V) / (1 + exp(-0.1378 * (V + 40.14))))
        xr1inf, xr2inf = 1 / (1 + exp((-26 - V) / 7)), 1 / (1 + exp((V + 88) / 24))
        tauxr1 = 450 / (1 + exp((-45 - V) / 10)) * 6 / (1 + exp((V + 30) / 11.5))
        tauxr2 = 3 / (1 + exp((-60 - V) / 20)) * 1.12 / (1 + exp((V - 60) / 20))
        xsinf = 1 / (1 + exp((-5 - V) / 14))
        tauxs = 1400 / sqrt(1 + exp((5 - V) / 6)) / (1 + exp((V - 35) / 15)) + 80
        rinf, taur = 1 / (1 + exp((20 - V) / 6)), 9.5 * exp(-(V + 40)**2 / 1800) + 0.8
        if layer == "endo":
            sinf, taus = 1 / (1 + exp((V + 28) / 5)), 1000 * exp(-(V + 67)**2 / 1000) + 8
        else:
            sinf, taus = 1 / (1 + exp((V + 20) / 5)), 85 * exp(-(V + 45)**2 / 320) + 5 / (1 + exp((V - 20) / 5)) + 3
        dinf = 1 / (1 + exp((-8 - V) / 7.5))
        taud = (1.4 / (1 + exp((-35 - V) / 13)) + 0.25) * 1.4 / (1 + exp((V + 5) / 5)) + 1 / (1 + exp((50 - V) / 20))
        finf = 1 / (1 + exp((V + 20) / 7))
        tauf = 1102.5 * exp(-(V + 27)**2 / 225) + 200 / (1 + exp((13 - V) / 10)) + 180 / (1 + exp((V + 30) / 10)) + 20
        f2inf = 0.67 / (1 + exp((V + 35) / 7)) + 0.33
        tauf2 = 562 * exp(-(V + 27)**2 / 240) + 31 / (1 + exp((25 - V) / 10)) + 80 / (1 + exp((V + 30) / 10))
        fcinf, taufc = 0.6 / (1 + (CaSS / 0.05)**2) + 0.4, 80 / (1 + (CaSS / 0.05)**2) + 2
        total = INa + ICaL + Ito + IKr + IKs + IK1 + INaCa + INaK + IpCa + IpK + IbNa + IbCa
        return [stimulus - total, dCai, dCaSR, dCaSS, dNai, dKi, (minf - m) / taum, (hinf - h) * rh, (hinf - j) * rj,
                (xr1inf - xr1) / tauxr1, (xr2inf - xr2) / tauxr2, (xsinf - xs) / tauxs, (rinf - r) / taur, (sinf - s) / taus,
                (dinf - d) / taud, (finf - f_) / tauf, (f2inf - f2) / tauf2, (fcinf - fc) / taufc, 0.005 * (1 - RR) - k2 * CaSS * RR]

    y0 = [-85.23, 0.000126, 3.64, 0.00036, 8.604, 136.89, 0.00172, 0.7444, 0.7045, 0.00621, 0.4712, 0.0095, 2.42e-8, 0.999998, 3.373e-5,
          0.7888, 0.9755, 0.9953, 0.9073]
    return f, y0, 1, (1, 38)


def courtemanche(layer):
    Rg, F, T = 8.3143, 96.4867, 310.0
    RTF = Rg * T / F
    Ko, Nao, Cao, Cm, Vi, Vup, Vrel = 5.4, 140.0, 1.8, 100.0, 13668.0, 1109.52, 96.48

    def linear(x, width):  # x / (1 - exp(-x / width))
        return width if abs(x) < 1e-9 else x / -expm1(-x / width)

    def f(t, y, stimulus):
        V, Cai, Carel, Caup, Nai, Ki, m, h, j, oa, oi, ua, ui, xr, xs, d, f_, fCa, u, v, w = y
        EK, ENa, ECa = RTF * log(Ko / Ki), RTF * log(Nao / Nai), 0.5 * RTF * log(Cao / Cai)
        INa = Cm * 7.8 * m**3 * h * j * (V - ENa)
        IK1 = Cm * 0.09 * (V - EK) / (1 + exp(0.07 * (V + 80)))
        Ito = Cm * 0.1652 * oa**3 * oi * (V - EK)
        IKur = Cm * (0.005 + 0.05 / (1 + exp((V - 15) / -13))) * ua**3 * ui * (V - EK)
        IKr = Cm * 0.029411765 * xr * (V - EK) / (1 + exp((V + 15) / 22.4))
        IKs = Cm * 0.12941176 * xs**2 * (V - EK)
        ICaL = Cm * 0.12375 * d * f_ * fCa * (V - 65)
        sigma = (exp(Nao / 67.3) - 1) / 7
        fNaK = 1 / (1 + 0.1245 * exp(-0.1 * V / RTF) + 0.0365 * sigma * exp(-V / RTF))
        INaK = Cm * 0.59933874 * fNaK / (1 + (10 / Nai)**1.5) * Ko / (Ko + 1.5)
        e1, e2 = exp(0.35 * V / RTF), exp((0.35 - 1) * V / RTF)
        INaCa = Cm * 1600 * (e1 * Nai**3 * Cao - e2 * Nao**3 * Cai) / ((87.5**3 + Nao**3) * (1.38 + Cao) * (1 + 0.1 * e2))
        IbCa, IbNa = Cm * 0.001131 * (V - ECa), Cm * 0.0006744375 * (V - ENa)
        IpCa = Cm * 0.275 * Cai / (0.0005 + Cai)
        Irel = 30 * u**2 * v * w * (Carel - Cai)
        Itr, Iup, leak = (Caup - Carel) / 180, 0.005 / (1 + 0.00092 / Cai), 0.005 * Caup / 15
        Fn = 1e3 * (1e-15 * Vrel * Irel - 1e-15 / (2 * F) * (0.5 * ICaL - 0.2 * INaCa))
        am = 0.32 * linear(V + 47.13, 10)
        bm = 0.08 * exp(-V / 11)
        if V >= -40:
            ah, bh, aj = 0.0, 1 / (0.13 * (1 + exp((V + 10.66) / -11.1))), 0.0
            bj = 0.3 * exp(-2.535e-7 * V) / (1 + exp(-0.1 * (V + 32)))
        else:
            ah, bh = 0.135 * exp((V + 80) / -6.8), 3.56 * exp(0.079 * V) + 3.1e5 * exp(0.35 * V)
            aj = (-127140 * exp(0.2444 * V) - 3.474e-5 * exp(-0.04391 * V)) * (V + 37.78) / (1 + exp(0.311 * (V + 79.23)))
            bj = 0.1212 * exp(-0.01052 * V) / (1 + exp(-0.1378 * (V + 40.14)))
        aoa = 0.65 / (exp((V + 10) / -8.5) + exp((V - 30) / -59))
        boa = 0.65 / (2.5 + exp((V + 82) / 17))
        aoi, boi = 1 / (18.53 + exp((V + 113.7) / 10.95)), 1 / (35.56 + exp((V + 1.26) / -7.44))
        aui, bui = 1 / (21 + exp((V - 185) / -28)), 1 / exp((V - 158) / -16)
        axr = 0.0003 * linear(V + 14.1, 5)
        z = V - 3.3328
        bxr = 7.3898e-5 * (5.1237 if abs(z) < 1e-9 else z / expm1(z / 5.1237))
        z = V - 19.9
        axs = 4e-5 * linear(z, 17)
        bxs = 3.5e-5 * (9 if abs(z) < 1e-9 else z / expm1(z / 9))
        z = V + 10
        taud = (1 / (0.035 * 6.24 * 2) if abs(z) < 1e-9 else -expm1(z / -6.24) / (0.035 * z * (1 + exp(z / -6.24))))
        tauf = 9 / (0.0197 * exp(-0.0337**2 * z**2) + 0.02)
        z = V - 7.9
        tauw = 6 * 0.2 / 1.3 if abs(z) < 1e-9 else -6 * expm1(-z / 5) / ((1 + 0.3 * exp(-z / 5)) * z)
        step = lambda centre: 1 / (1 + exp(min(-(Fn - centre) / 1.367e-15, 700)))
        uinf = step(3.4175e-13)
        tauv, vinf = 1.91 + 2.09 * uinf, 1 - step(6.835e-14)
        winf = 1 - 1 / (1 + exp(-(V - 40) / 17))
        B1 = (2 * INaCa - IpCa - ICaL - IbCa) / (2 * Vi * F) + (Vup * (leak - Iup) + Irel * Vrel) / Vi
        B2 = 1 + 0.07 * 0.0005 / (Cai + 0.0005)**2 + 0.05 * 0.00238 / (Cai + 0.00238)**2
        IK = IK1 + Ito + IKur + IKr + IKs
        total = INa + IK + ICaL + INaK + INaCa + IpCa + IbNa + IbCa
        return [stimulus - total / Cm, B1 / B2, (Itr - Irel) / (1 + 10 * 0.8 / (Carel + 0.8)**2), Iup - leak - Itr * Vrel / Vup,
                (-3 * INaK - 3 * INaCa - IbNa - INa) / (Vi * F), (2 * INaK - IK) / (Vi * F),
                am * (1 - m) - bm * m, ah * (1 - h) - bh * h, aj * (1 - j) - bj * j,
                (1 / (1 + exp((V + 20.47) / -17.54)) - oa) * 3 * (aoa + boa), (1 / (1 + exp((V + 43.1) / 5.3)) - oi) * 3 * (aoi + boi),
                (1 / (1 + exp((V + 30.3) / -9.6)) - ua) * 3 * (aoa + boa), (1 / (1 + exp((V - 99.45) / 27.48)) - ui) * 3 * (aui + bui),
                (1 / (1 + exp((V + 14.1) / -6.5)) - xr) * (axr + bxr), (1 / sqrt(1 + exp((V - 19.9) / -12.7)) - xs) * 2 * (axs + bxs),
                (1 / (1 + exp((V + 10) / -8)) - d) / taud, (1 / (1 + exp((V + 28) / 6.9)) - f_) / tauf,
                (1 / (1 + Cai / 0.00035) - fCa) / 2, (uinf - u) / 8, (vinf - v) / tauv, (winf - w) / tauw]

    y0 = [-81.18, 0.0001013, 1.488, 1.488, 11.17, 139.0, 0.002908, 0.9649, 0.9775, 0.03043, 0.9992, 0.004966, 0.9986, 3.296e-5,
          0.01869, 0.0001367, 0.9996, 0.7755, 0.0, 1.0, 0.9992]
    return f, y0, 1, (2, 20)


def go(f, y, start, end, stimulus, trace):
    """Integrates and appends (t, V, Cai) every 0.02 ms."""
    times = np.linspace(start, end, max(int(round((end - start) / 0.02)), 1) + 1)
    method = "LSODA" if len(y) > 4 else "DOP853"
    found = solve_ivp(f, (start, end), y, method=method, t_eval=times, rtol=1e-9, atol=1e-11, args=(stimulus,), max_step=1.0)
    assert found.success, found.message
    trace.append((times[:-1], found.y[:, :-1]))
    return found.y[:, -1]


def beat(f, y, start, length, stimulus):
    trace = []
    y = go(f, y, start, start + stimulus[0], stimulus[1], trace)
    y = go(f, y, start + stimulus[0], start + length, 0.0, trace)
    return y, np.concatenate([t for t, _ in trace]), np.concatenate([x for _, x in trace], axis=1)


def duration(t, V, level):
    up = int(np.argmax(V > level))
    down = up + int(np.argmax(V[up:] < level))
    cross = lambda i: t[i - 1] + (level - V[i - 1]) / (V[i] - V[i - 1]) * (t[i] - t[i - 1])
    return (cross(down) - cross(up) if up > 0 else cross(down) - t[0]) if down > up else -1.0


def rows(name, model, layer, intervals):
    f, y, Ca, stimulus = model(layer)
    for k in range(4):
        y, t, x = beat(f, y, 1000.0 * k, 1000.0, stimulus)
    rest = y[0]
    last, t, x = beat(f, y, 4000.0, 1000.0, stimulus)
    V = x[0]
    peak = V.max()
    level = rest + 0.1 * (peak - rest)
    Cai = x[Ca] * 1e3 if Ca else np.zeros(1)
    slope = np.max(np.diff(V) / np.diff(t))
    yield name, layer, 0, rest, peak, duration(t, V, level), slope, Cai[0], Cai.max()
    for interval in intervals:
        before, _, _ = beat(f, y, 4000.0, float(interval), stimulus)
        _, t, x = beat(f, before, 4000.0 + interval, 1000.0, stimulus)
        Cai = x[Ca] * 1e3 if Ca else np.zeros(1)
        yield (name, layer, interval, before[0], x[0].max(), duration(t, x[0], level), np.max(np.diff(x[0]) / np.diff(t)), Cai[0],
               Cai.max())


if __name__ == "__main__":
    with open(here / "cells.csv", "w") as out:
        out.write("# scipy %s, make_cells.py: model, layer, interval_ms, rest_mV, peak_mV, APD90_ms, dVdt_max_mV_per_ms, Cai_rest_uM, "
                  "Cai_peak_uM\n" % scipy.__version__)
        for model, layer, intervals in [(fitzhugh_nagumo, "-", (450, 600, 800)), (aliev_panfilov, "-", (400, 500, 700)),
                                        (bueno_orovio, "epi", (320, 360, 450, 700)), (bueno_orovio, "endo", (360, 450, 700)),
                                        (bueno_orovio, "mid", (480, 550, 700)),
                                        (ten_tusscher_panfilov, "epi", (340, 380, 450, 700)),
                                        (ten_tusscher_panfilov, "endo", (340, 380, 450, 700)),
                                        (ten_tusscher_panfilov, "mid", (440, 500, 700)),
                                        (courtemanche, "-", (330, 400, 500, 700))]:
            for row in rows(model.__name__, model, layer, intervals):
                out.write("%s,%s,%d,%.4f,%.4f,%.3f,%.2f,%.5f,%.5f\n" % row)
                out.flush()
                print(row, flush=True)
