#!/usr/bin/env python3
"""What one would write by hand: fits in Numba on all cores, with somatic's kinds, slopes, starts and steps.

    benches/peers/fit.py SOMATIC     after benches/peers/run has made the Python environment; SOMATIC is the program

Simulates examples/simulations/turn.toml on the nine sensors of the hand's back, fits every frame four times over, checks the angles
against those of somatic's touches, and takes turns with `somatic tradeoff` on the same frames.
"""
import json
import math
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np

STEPS, PENALTY, PRIOR, VARIES = 6, 4.6, math.log(1.2), 0.3
SIGMA, GAIN = 0.007 / math.sqrt(3), 0.05
# What a point, a line, a segment and a blob may be off by, as shares of the largest pressure.
FLOORS = (0.01, 0.03, 0.03, 0.01)
SIDE = math.sqrt(1.96349537873175e-05)
jit = numba.njit(cache=False, fastmath=False)


@jit
def normal(z):
    return 0.5 * math.erfc(-z * 0.7071067811865476), 0.3989422804014327 * math.exp(-0.5 * z * z)


@jit
def point(x, a, w):
    (up, at_up), (low, at_low) = normal((x + a) / w), normal((x - a) / w)
    return up - low, (at_up - at_low) / w, (x - a) / w * at_low - (x + a) / w * at_up


@jit
def line(y, a, h, w):
    z = ((y + h + a) / w, (y + h - a) / w, (y - h + a) / w, (y - h - a) / w)
    (pa, da), (pb, db), (pc, dc), (pd, dd) = normal(z[0]), normal(z[1]), normal(z[2]), normal(z[3])
    s = 0.5 / h
    value = s * w * ((z[0] * pa + da - z[1] * pb - db) - (z[2] * pc + dc - z[3] * pd - dd))
    return value, s * ((pa - pb) - (pc - pd)), s * w * ((da - db) - (dc - dd)), 0.5 * ((pa - pb) + (pc - pd)) - value


# A shape is u, v, cos, sin, ln force, ln width, ln length; kinds are 0 point, 1 line, 2 segment, 3 blob.
@jit
def felt(kind, p, u, v, a, by):
    du, dv = u - p[0], v - p[1]
    x, y = dv * p[2] - du * p[3], du * p[2] + dv * p[3]
    force, w = math.exp(p[4]), math.exp(p[5])
    g, gx, gw = point(x, a, w)
    if kind == 1:
        load = force * 2.0 * a
        by[0], by[1], by[2], by[3] = -load * gx, -load * gx * y, load * g, load * gw
        return load * g
    if kind == 2:
        k, ky, kw, kh = line(y, a, math.exp(p[6]), w)
    else:
        k, ky, kw = point(y, a, w if kind == 0 else math.exp(p[6]))
        kh = 0.0
    m, bx, b_y = force * g * k, force * gx * k, force * g * ky
    if kind == 0:
        by[0], by[1], by[2], by[3] = -bx, -b_y, m, force * (gw * k + g * kw)
        return m
    by[0], by[1], by[2], by[3] = -bx, -b_y, b_y * x - bx * y, m
    if kind == 2:
        by[4], by[5] = force * (gw * k + g * kw), force * g * kh
    else:
        by[4], by[5] = force * gw * k, force * g * kw
    return m


@jit
def objective(kind, k, p, s, A, g, by):
    A[:], g[:] = 0.0, 0.0
    cost = 0.0
    for i in range(s.shape[0]):
        m = felt(kind, p, s[i, 0], s[i, 1], s[i, 2], by)
        off = m - s[i, 3]
        if s[i, 5] == 0.0 and off <= 0.0:
            continue
        per = 1.0 / math.sqrt(s[i, 4] + GAIN * GAIN * m * m + FLOORS[kind] * FLOORS[kind])
        r = off * per
        slope = per * (1.0 - r * GAIN * GAIN * m * per)
        cost += r * r
        for a in range(k):
            g[a] += by[a] * slope * r
            for b in range(a + 1):
                A[a, b] += by[a] * slope * by[b] * slope
    chi = cost
    at = 3 if k == 4 else 4
    r = (p[5] - PRIOR) / VARIES
    g[at] += r / VARIES
    A[at, at] += 1.0 / (VARIES * VARIES)
    return cost + r * r, chi


@jit
def solve(A, g, k, damping, L, x):
    for i in range(k):
        for j in range(i):
            rest = A[i, j]
            for n in range(j):
                rest -= L[i, n] * L[j, n]
            L[i, j] = rest * L[j, j]
        rest = A[i, i] * (1.0 + damping)
        for n in range(i):
            rest -= L[i, n] * L[i, n]
        L[i, i] = 1.0 / math.sqrt(max(rest, 1e-12))
    for i in range(k):
        rest = g[i]
        for n in range(i):
            rest -= L[i, n] * x[n]
        x[i] = rest * L[i, i]
    for i in range(k - 1, -1, -1):
        rest = x[i]
        for n in range(i + 1, k):
            rest -= L[n, i] * x[n]
        x[i] = rest * L[i, i]


@jit
def moved(kind, p, x, q):
    q[:] = p
    c, s = p[2], p[3]
    at = 0
    for parameter in range(6):
        if (kind == 0 and (parameter == 2 or parameter == 5)) or (kind == 1 and (parameter == 1 or parameter == 5)):
            continue
        step = min(max(-x[at], -1.5), 1.5)
        at += 1
        if parameter == 0:
            q[0] -= s * step
            q[1] += c * step
        elif parameter == 1:
            q[0] += c * step
            q[1] += s * step
        elif parameter == 2:
            n = math.sqrt((c - s * step) ** 2 + (s + c * step) ** 2)
            q[2], q[3] = (c - s * step) / n, (s + c * step) / n
        elif parameter == 3:
            q[4] += step
        else:
            q[parameter + 1] = min(max(q[parameter + 1] + step, -4.0), 4.0)


@jit
def descend(kind, p, s):
    k = 4 if kind < 2 else 6
    A, g, A2, g2 = np.zeros((6, 6)), np.zeros(6), np.zeros((6, 6)), np.zeros(6)
    L, x, by, q = np.zeros((6, 6)), np.zeros(6), np.zeros(6), np.zeros(7)
    cost, chi = objective(kind, k, p, s, A, g, by)
    damping = 0.01
    for _ in range(STEPS):
        solve(A, g, k, damping, L, x)
        moved(kind, p, x, q)
        tried, chi2 = objective(kind, k, q, s, A2, g2, by)
        if tried < cost:
            cost, chi = tried, chi2
            p[:] = q
            A[:], g[:] = A2, g2
            damping *= 0.1
        else:
            damping *= 10.0
    solve(A, g, k, 0.0, L, x)
    ahead = 0.0
    for i in range(k):
        ahead += x[i] * g[i]
    return cost, chi, ahead


@jit
def with_force(kind, p, s, by):
    both, own = 0.0, 1e-300
    for i in range(s.shape[0]):
        if s[i, 5] > 0.0:
            m = felt(kind, p, s[i, 0], s[i, 1], s[i, 2], by)
            both += m * s[i, 3]
            own += m * m
    p[4] = math.log(max(both / own, 1e-300))


@jit
def fit(uv, pressures, sigmas, threshold, found):
    """Of one touch: found gets kind, u, v, angle; kind is -1 where there is none."""
    n = pressures.shape[0]
    peak, total, pressed, cu, cv = 0.0, 0.0, 0, 0.0, 0.0
    for i in range(n):
        peak, total = max(peak, pressures[i]), total + pressures[i]
        cu, cv = cu + pressures[i] * uv[i, 0], cv + pressures[i] * uv[i, 1]
        pressed += pressures[i] > 0.0
    found[0] = -1.0
    if pressed <= 4:
        return
    cu, cv = cu / total, cv / total
    s = np.empty((n, 6))
    a, b, d, cell, mass = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        s[i, 0], s[i, 1], s[i, 2] = (uv[i, 0] - cu) / SIGMA, (uv[i, 1] - cv) / SIGMA, 0.5 * SIDE / SIGMA
        on = pressures[i] > 0.0
        s[i, 3] = (pressures[i] if on else threshold) / peak
        s[i, 4] = max(sigmas[i] / peak, 1e-3) ** 2
        s[i, 5] = 1.0 if on else 0.0
        if on:
            w = s[i, 3]
            mass, cell = mass + w, cell + w * s[i, 2] ** 2 / 3.0
            a, b, d = a + w * s[i, 0] ** 2, b + w * s[i, 0] * s[i, 1], d + w * s[i, 1] ** 2
    a, b, d, cell = a / mass, b / mass, d / mass, cell / mass
    mean, apart = 0.5 * (a + d), math.hypot(0.5 * (a - d), b)
    turn = 0.5 * math.atan2(2.0 * b, a - d)
    low, middle, high = (
        0.5 * math.log(max(mean - apart - cell, 1.0)),
        0.5 * math.log(max(mean - cell, 1.0)),
        0.5 * math.log(max(mean + apart - cell, 1.0)),
    )
    half = math.log(max(math.sqrt(6.0 * apart), 0.5))
    by, best, p = np.zeros(6), math.inf, np.zeros(7)
    of_line = np.zeros(7)
    for kind in range(4 if pressed > 6 else 2):
        p[:] = 0.0
        if kind == 0:
            p[2], p[5] = 1.0, middle
        elif kind == 2:
            p[:] = of_line
            p[4] += half + math.log(2.0)
            p[6] = half
        else:
            p[2], p[3], p[5], p[6] = math.cos(turn), math.sin(turn), low, high if kind == 3 else 0.0
        if kind != 2:
            with_force(kind, p, s, by)
        cost, _, _ = descend(kind, p, s)
        if kind == 1:
            of_line[:] = p
        k = 4 if kind < 2 else 6
        room = 0.0
        for i in range(n):
            if s[i, 5] > 0.0:
                room += math.log1p(FLOORS[kind] ** 2 / (s[i, 4] + (GAIN * s[i, 3]) ** 2))
        if cost + room + 2.0 * PENALTY * k < best:
            best = cost + room + 2.0 * PENALTY * k
            found[0], found[1], found[2] = kind, cu + SIGMA * p[0], cv + SIGMA * p[1]
            found[3] = math.atan2(p[3], p[2]) % math.pi


@numba.njit(parallel=True)
def fit_all(uv, pressures, sigmas, threshold, found):
    for i in numba.prange(pressures.shape[0]):
        fit(uv, pressures[i], sigmas[i], threshold, found[i])


def newton(counts):
    """The force of a reading of the paper's circuit, 0 where it is open."""
    divider = 50e3 * 38 / 256 + 52
    exponent = math.log(30) / math.log(50)
    resistance = divider * (counts + 0.5) / (1024 - (counts + 0.5))
    at_break = math.floor(1024 * (r := 30e3 * (0.1 / 0.2) ** -exponent) / (r + divider))
    force = np.clip(0.2 * (resistance / 30e3) ** (-1 / exponent), 0.1, 10.0)
    return np.where(counts > at_break, 0.0, force), newton_at_break(at_break, divider, exponent)


def newton_at_break(counts, divider, exponent):
    resistance = divider * (counts + 0.5) / (1024 - (counts + 0.5))
    return max(0.1, 0.2 * (resistance / 30e3) ** (-1 / exponent))


def main(somatic):
    simulation = Path(__file__).resolve().parents[2] / "examples/simulations/turn.toml"
    with tempfile.TemporaryDirectory() as folder:
        # Sixteen times as many frames as the example has, so that a call has many.
        rod, text = Path(folder, "rod.csv"), simulation.read_text()
        simulation = Path("target/peers/turn.toml")
        simulation.write_text(re.sub(r"(?m)^rate_hz = (\d+)", lambda rate: f"rate_hz = {16 * int(rate[1])}", text))
        subprocess.run([somatic, "simulate", simulation, "-o", rod], check=True, capture_output=True)
        header = rod.read_text().splitlines()[0].split(",")
        table = np.genfromtxt(rod, delimiter=",", skip_header=1)
        ids = [16, 17, 18, 19, 20, 21, 22, 23, 24]
        # The other sensors of the hand have no value, so that both have the same nine.
        kept = [0, *(header.index(str(i)) for i in ids)]
        rows = (",".join(line.split(",")[column] for column in kept) for line in rod.read_text().splitlines())
        nine = Path("target/peers/nine.csv")
        nine.write_text("\n".join(rows) + "\n")
        calibration = Path("target/peers/nine.calibration.toml")
        calibration.write_text(rod.with_suffix(".calibration.toml").read_text())
        source = ["--body", "hand", "--source", nine, "--calibration", calibration]
        outputs = "touches.fit_kind,touches.fit_direction,touches.fit_place"
        run = [somatic, "run", *source, "--outputs", outputs, "--sink", "-"]
        lines = subprocess.run(run, check=True, capture_output=True, text=True).stdout.splitlines()
    touches = [json.loads(line).get("touches", []) for line in lines]
    theirs = [max(of, key=lambda touch: touch["total"], default={}) for of in touches]
    uv = np.array([[u, v] for v in (0.011, 0.0, -0.011) for u in (-0.012, 0.0, 0.012)])
    counts = table[:, [header.index(str(i)) for i in ids]]
    pressures, threshold = newton(counts)
    noise = math.sqrt(1 + 1 / 12)
    sigmas = np.abs(newton(np.minimum(counts - noise, 1022))[0] - pressures)
    found = np.zeros((len(pressures), 4))
    fit_all(uv, pressures, sigmas, threshold, found)
    pairs = [(f, t) for f, t in zip(found, theirs) if f[0] > 0 and "fit_angle" in t]
    apart = [abs((f[3] - t["fit_angle"] + math.pi / 2) % math.pi - math.pi / 2) for f, t in pairs]
    print(f"{len(pairs)} of {len(found)} are fitted by both; angles differ by up to {math.degrees(max(apart)):.1e} degrees")
    many, results = np.tile(counts, (4, 1)), np.zeros((4 * len(counts), 4))
    # All frames in one call, as Numba has them.
    tradeoff = [somatic, "tradeoff", *source, "--fields", "hand/back", "--backend", "cpu", "--seconds", "2", "--frames", "2880",
                "--batch", "2880", "--json"]
    times, own, ratios = [], [], []
    for _ in range(5):
        rounds = []
        for _ in range(5):
            begin = time.perf_counter()
            # From raw values on, as somatic does.
            pressed = newton(many)[0]
            fit_all(uv, pressed, np.abs(newton(np.minimum(many - noise, 1022))[0] - pressed), threshold, results)
            rounds.append((time.perf_counter() - begin) / len(many) * 1e6)
        rows = json.loads(subprocess.run(tradeoff, check=True, capture_output=True, text=True).stdout)["rows"]
        of = lambda by: min(row["p50_us"] for row in rows if row["way"] == "batch" and row["orientation_by"] == by)
        times.append(sorted(rounds)[2])
        # What touches and their fits take beside the moments of the same frames.
        own.append(of("fit") - of("second-moments"))
        ratios.append(times[-1] / own[-1])
    middle = lambda numbers: sorted(numbers)[2]
    print(f"a frame's fits: numba, {numba.get_num_threads()} threads {middle(times):.2f} us, somatic {middle(own):.2f} us: "
          f"{middle(ratios):.1f} times ({min(ratios):.1f} to {max(ratios):.1f})")


if __name__ == "__main__":
    main(sys.argv[1])
