# SPDX-License-Identifier: BSD-3-Clause
"""Many four-bars whose crank keeps turning, by their energy alone, in NumPy: the reference of the others in this folder.

Positions are circles that meet, as complex numbers. With the inertia I and the potential V at the crank's angle the energy
gives the crank's rate, and t = integral of sqrt(I / (2 (E - V))) over the angle. The integrand has the period of a turn: its Fourier
series by equally spaced angles converges faster than any power, and is integrated term by term.

    crank_energy.py ROWS.csv END
"""
import csv
import sys

import numpy as np

GRAVITY = 9.81
ANGLES = 512                                              # of a turn


def meet(b, d, coupler, rocker):
    """The joint of coupler and rocker, left of the way from b to d."""
    way = d - b
    far = np.abs(way)
    along = (coupler**2 - rocker**2 + far**2) / (2 * far)
    return b + way / far * (along + 1j * np.sqrt(coupler**2 - along**2))


def cross(a, b):
    return a.real * b.imag - a.imag * b.real


def state(lengths, angle):
    """I, V; the rates of coupler and rocker over that of the crank, and their absolute angles. Bars have a mass of 1."""
    crank, coupler, rocker, base = lengths
    b = crank * np.exp(1j * angle)
    c = meet(b, base, coupler, rocker)
    along, swinging, rate = c - b, c - base, 1j * b
    spin = -cross(rate, 1j * swinging) / cross(1j * along, 1j * swinging)
    swing = cross(1j * along, rate) / cross(1j * along, 1j * swinging)
    inertia = crank**2 / 3 + np.abs(rate + 1j * spin * along / 2)**2 + (spin * coupler)**2 / 12 + (swing * rocker)**2 / 3
    potential = GRAVITY * (b.imag / 2 + (b.imag + c.imag) / 2 + c.imag / 2)
    return inertia, potential, spin, swing, np.angle(along), np.angle(swinging)


def crank_rate(lengths, start, rate, angle):
    inertia, potential, *_ = state(lengths, np.full_like(lengths[0], start))
    energy = inertia * rate**2 / 2 + potential
    inertia, potential, *_ = state(lengths, angle)
    return np.sqrt(2 * (energy - potential) / inertia)


def ends(lengths, end, start=np.pi / 2, rate=20.0, angles=ANGLES):
    """Coordinates of the crank, of the coupler on the crank, and of the rocker at the end; columns crank, coupler, rocker, base."""
    lengths = np.asarray(lengths, dtype=float).T
    turn = start + 2 * np.pi * np.arange(angles)[:, None] / angles
    slowness = 1 / crank_rate(lengths, start, rate, turn)
    series = np.fft.rfft(slowness, axis=0) / angles
    order = np.arange(1, angles // 2)[:, None]
    mean, terms = series[0].real, 2 * series[1:angles // 2]

    def time(x):                                          # x: the angle since the start
        return mean * x + np.sum((terms * (np.exp(1j * order * x) - 1) / (1j * order)).real, axis=0)

    x = end / mean
    for _ in range(8):
        x = x - (time(x) - end) * crank_rate(lengths, start, rate, start + x)
    *_, coupler, rocker = state(lengths, start + x)
    *_, coupler0, rocker0 = state(lengths, np.full_like(x, start))
    return np.stack([x, coupler - coupler0 - x, rocker - rocker0], axis=1)


def extremes(lengths, start=np.pi / 2, rate=20.0, angles=4096):
    """The rocker's range and its largest rate over a turn: both by parabolas through the highest of equally spaced angles."""
    lengths = np.asarray(lengths, dtype=float).T
    turn = start + 2 * np.pi * np.arange(angles)[:, None] / angles
    _, _, _, swing, _, rocker = state(lengths, turn)
    top = lambda f: highest(f)
    return np.stack([top(rocker) + top(-rocker), top(swing * crank_rate(lengths, start, rate, turn))], axis=1)


def highest(f):
    at = np.argmax(f, axis=0)
    values = [np.take_along_axis(f, ((at + k) % len(f))[None], axis=0)[0] for k in range(-2, 3)]
    x = np.linspace(-2, 2, 5)
    fits = np.linalg.solve(np.vander(x, 5, increasing=True), np.array(values))
    best = np.zeros_like(fits[0])
    for _ in range(6):                                    # of the polynomial through five points
        slope = fits[1] + best * (2 * fits[2] + best * (3 * fits[3] + best * 4 * fits[4]))
        best = best - slope / (2 * fits[2] + best * (6 * fits[3] + best * 12 * fits[4]))
    return sum(c * best**k for k, c in enumerate(fits))


def main(rows, end):
    """Prints the largest errors of a table of Kempe: of q over max(|q|, 1), of the quantities `swing` and `fast` where it has them."""
    with open(rows, encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    take = lambda *names: np.array([[float(row[name]) for name in names] for row in table])
    lengths, q = take("crank", "coupler", "rocker", "base"), take("q.crank", "q.coupler", "q.rocker")
    exact = ends(lengths, end)
    found = [np.max(np.abs(q - exact) / np.maximum(np.abs(exact), 1))]
    if "swing" in table[0]:
        found += list(np.max(np.abs(take("swing", "fast") - extremes(lengths)), axis=0))
    print(*(f"{x:.3g}" for x in found))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
