#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws flexible_car.svg: spectra and weighted accelerations of the rigid and the flexible car body, and its modes.

    kempe simulate flexible_car.yaml --no-convergence-check -o flexible.csv
    kempe simulate flexible_car.yaml --no-convergence-check --set vertical=0 --set lateral=0 --set twist=0 -o rigid.csv
    python3 draw_flexible_car.py flexible.csv rigid.csv > flexible_car.svg

Points are spectra of the runs on rails, means of sections of 5 s with Hann's window; lines are the linear equations of
reference_flexible_car.py. The script also prints both on standard error.
"""
import math
import pathlib
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import reference_flexible_car as reference  # noqa: E402
from panels import BLUE, GREEN, RED, Panel, page, rows  # noqa: E402

WIDE, HIGH, LEFT, RIGHT, TOP = 330, 150, 50, 520, 30
FLEXIBLE, RIGID, OTHER = RED, BLUE, GREEN
SPEED, BEGIN, SECTION, END = 55.6, 5, 5, 21
MIDDLE, ABOVE = "acceleration.car.middle.z", "acceleration.car.above_front.z"


def spectrum(table, name):
    """Frequencies, and the spectral density of a column, m^2/s^4/Hz, in bands of 0.4 Hz."""
    step = table[1]["t"] - table[0]["t"]
    values = np.array([row[name] for row in table if row["t"] >= BEGIN])
    length = round(SECTION / step)
    window = np.hanning(length)
    sections = [values[k:k + length] for k in range(0, len(values) - length + 1, length // 2)]
    density = np.mean([abs(np.fft.rfft((s - s.mean()) * window)) ** 2 for s in sections], axis=0) * 2 * step / (window**2).sum()
    frequencies = np.fft.rfftfreq(length, step)
    centres = np.arange(0.8, END, 0.4)
    return centres, np.array([density[abs(frequencies - f) <= 0.21].mean() for f in centres])


def known(name, frequencies, flexible):
    return abs(reference.wave(name, frequencies, SPEED, flexible)) ** 2 * reference.level(frequencies, SPEED)


def spectra(left, top, title, name, tables):
    panel = Panel(left, top, WIDE, HIGH, (0, END), (-6, -5, -4, -3, -2, -1))
    panel.frame(title)
    for flexible, colour, word, down in ((True, FLEXIBLE, "flexible", 20), (False, RIGID, "rigid", 36)):
        fine = np.arange(0.8, END, 0.05)
        panel.curve(list(zip(fine, np.log10(known(name, fine, flexible)))), colour, word, down, 1.2)
        for f, density in zip(*spectrum(tables[flexible], name)):
            if density > 1e-6:
                panel.lines.append(f'<circle cx="{panel.x(f):.1f}" cy="{panel.y(np.log10(density)):.1f}" r="1.8" fill="{colour}"/>')
    panel.axis(range(0, END, 5), "Hz", 8)
    return panel


def over_speed(left, top):
    panel = Panel(left, top, WIDE, HIGH, (15, 70), (0, 0.05, 0.1, 0.15, 0.2))
    panel.frame("weighted acceleration (Wb) in the middle, m/s²")
    speeds = np.arange(15, 70.1, 0.5)
    for flexible, colour, word, down in ((True, FLEXIBLE, "flexible", 20), (False, RIGID, "rigid", 36)):
        panel.curve([(v, reference.weighted(MIDDLE, v, flexible)) for v in speeds], colour, word, down, 1.4)
    for k in (2, 3, 4, 5):
        panel.mark(first() * reference.CENTRES / (k + 0.5))
    panel.axis(range(20, 71, 10), "m/s", 8)
    return panel


def first():
    """The first frequency of vertical bending, Hz."""
    rates = reference.Beam((0, reference.SHAPES[1], 0)).rates
    return rates[rates > 0].min() / (2 * math.pi)


def over_stiffness(left, top):
    panel = Panel(left, top, WIDE, HIGH, (5, 20), (0, 0.05, 0.1, 0.15, 0.2))
    panel.frame(f"the same at {SPEED} m/s over the first frequency")
    rate = first()
    curve = [(rate * root, reference.weighted(MIDDLE, SPEED, True, reference.EI * root**2)) for root in np.geomspace(5 / rate, 20 / rate, 80)]
    panel.curve(curve, FLEXIBLE, "flexible", 20, 1.4)
    panel.curve([(f, reference.weighted(MIDDLE, SPEED, False)) for f in (5, 20)], RIGID, "rigid", 36, 1.4)
    panel.axis((5, 10, 15, 20), "Hz", 8)
    return panel


def modes(left, top, wide):
    """Deflections and twist over the length, largest 1; circles: bogies."""
    panel = Panel(left, top, wide, 90, (-reference.LENGTH / 2, reference.LENGTH / 2), (-1, 0, 1))
    panel.frame("modes of the free car body: deflection or twist over its length; dashed: bogies")
    places = np.linspace(-reference.LENGTH / 2, reference.LENGTH / 2, 61)
    down = 10
    for shapes, row, colour, word in (((0, 5, 0), 2, FLEXIBLE, "bending"), ((0, 5, 0), 2, OTHER, "bending"), ((0, 0, 3), 3, RIGID, "torsion")):
        beam = reference.Beam(shapes)
        order = [k for k in np.argsort(beam.rates) if beam.rates[k] > 0][1 if colour == OTHER else 0]
        if row == 2:
            values = [beam.point(x)[0][2] @ beam.modes[:, order] for x in places]
        else:
            values = [beam.point(x)[1][0] @ beam.modes[:, order] for x in places]
        values = np.array(values) / max(values, key=abs)
        panel.curve(list(zip(places, values)), colour, f"{word} {beam.rates[order] / (2 * math.pi):.1f} Hz", down, 1.4)
        down += 18
    for x in (-reference.CENTRES / 2, reference.CENTRES / 2):
        panel.mark(x)
    panel.axis((-10, -5, 0, 5, 10), "m", 8)
    return panel


def main(flexible, rigid):
    tables = {True: rows(flexible), False: rows(rigid)}
    lower = TOP + HIGH + 60
    panels = [spectra(LEFT, TOP, "vertical, middle: log10 of m²/s⁴/Hz", MIDDLE, tables),
              spectra(RIGHT, TOP, "vertical, above a bogie", ABOVE, tables),
              over_speed(LEFT, lower), over_stiffness(RIGHT, lower),
              modes(LEFT, lower + HIGH + 60, RIGHT + WIDE - LEFT)]
    page(RIGHT + WIDE + 120, lower + HIGH + 60 + 90 + 30, panels)
    for name in (MIDDLE, ABOVE):
        for k in (True, False):
            f, found = spectrum(tables[k], name)
            print(f"{name} {'flexible' if k else 'rigid'}: root mean square {math.sqrt(found.sum() * 0.4):.4f} m/s^2, by the equations "
                  f"{math.sqrt(known(name, np.arange(0.6, END, 0.05), k).sum() * 0.05):.4f}; weighted, by the equations "
                  f"{reference.weighted(name, SPEED, k):.4f}", file=sys.stderr)


if __name__ == "__main__":
    main(*sys.argv[1:])
