#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Limit cycles of cooperrider.yaml over the speed, by Kempe's motions, beside those of cycles.csv; the diagram.

    python3 cycles_cooperrider.py                        table of differences
    python3 cycles_cooperrider.py --svg cycles.svg       the diagram of cycles.csv

Newton's method and the sequence of amplitudes are those of reference_cooperrider.py, which needs nothing of Kempe.
"""
import csv
import io
import pathlib
import sys

import numpy as np
from reference_cooperrider import CLEARANCE, write_cycles

HERE = pathlib.Path(__file__).resolve().parent


class Motion:
    """move(state, duration, speed) by a stepper of Kempe."""

    def __init__(self):
        import kempe

        self.model = kempe.Model(HERE / "cooperrider.yaml", parameters={"start": 0})
        self.stepper = self.model.system().stepper(rtol=1e-10, atol=1e-10, t_end=1e3)
        self.speed = 60.0

    def __call__(self, state, duration, speed):
        self.stepper.reset()
        if speed != self.speed:
            self.stepper.set_parameters(V=float(speed))
            self.speed = speed
        self.stepper.set_state(state[:7], state[7:])
        self.stepper.advance(float(duration))
        return np.concatenate([self.stepper.q, self.stepper.qd])

    def critical(self):
        """Speed and circular frequency."""
        found = self.model.system().modes(sweep="V=66:71:6").critical
        return float(found["value"][0]), float(found["im"][0])


def rows(lines):
    return [[float(x) for x in row] for row in csv.reader(line for line in lines if line[0] in "0123456789")]


def draw(path):
    """Amplitude of the front wheelset over the speed; dashed where the limit cycle is unstable."""
    known = rows((HERE / "cycles.csv").read_text().splitlines())
    fold = min(range(len(known) - 1), key=lambda k: known[k][1])
    x = lambda v: 60 + 90 * (v - 65.5)  # noqa: E731
    y = lambda a: 330 - 26 * a  # noqa: E731
    path_of = lambda part: "M" + " L".join(f"{x(r[1]):.1f} {y(r[0]):.1f}" for r in part)  # noqa: E731
    critical = known[-1][1]
    lines = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 520 380" font-family="sans-serif" font-size="13">',
             '<rect width="520" height="380" fill="white"/>']
    for v in (66, 67, 68, 69, 70):
        lines.append(f'<path d="M{x(v)} 330 V60" stroke="#ddd"/><text x="{x(v)}" y="348" text-anchor="middle">{v}</text>')
    for a in (0, 2, 4, 6, 8, 10):
        lines.append(f'<path d="M60 {y(a)} H490" stroke="#ddd"/><text x="52" y="{y(a) + 4}" text-anchor="end">{a}</text>')
    lines += [f'<path d="{path_of(known[: fold + 1])}" fill="none" stroke="#253c9f" stroke-width="2.5"/>',
              f'<path d="{path_of(known[fold:])}" fill="none" stroke="#253c9f" stroke-width="2" stroke-dasharray="6 4"/>',
              f'<path d="M60 {y(0)} H{x(critical):.1f}" stroke="#253c9f" stroke-width="2.5"/>',
              f'<path d="M{x(critical):.1f} {y(0)} H490" stroke="#253c9f" stroke-width="2" stroke-dasharray="6 4"/>',
              f'<path d="M60 {y(1e3 * CLEARANCE):.1f} H490" stroke="#999" stroke-dasharray="2 3"/>',
              f'<text x="486" y="{y(1e3 * CLEARANCE) + 17:.1f}" text-anchor="end" fill="#666">clearance of the flange</text>',
              '<text x="275" y="370" text-anchor="middle">speed, m/s</text>',
              '<text x="20" y="195" text-anchor="middle" transform="rotate(-90 20 195)">amplitude of the front wheelset, mm</text>',
              f'<text x="{x(critical) + 8:.1f}" y="{y(0) - 8}">{critical:.2f}</text>',
              f'<text x="{x(known[fold][1]) - 8:.1f}" y="{y(known[fold][0]) + 20:.1f}" text-anchor="end">{known[fold][1]:.2f}</text>',
              '<text x="60" y="38">solid: stable, dashed: unstable</text>', "</svg>"]
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def compare():
    """Rows of Kempe and of cycles.csv."""
    motion, told = Motion(), io.StringIO()
    write_cycles(motion, motion.critical(), told)
    return rows(told.getvalue().splitlines()), rows((HERE / "cycles.csv").read_text().splitlines())


def main(words):
    if words[:1] == ["--svg"]:
        return draw(words[1])
    print(f"{'y1, mm':>10s} {'V, m/s':>13s} {'T, s':>13s} {'y2, mm':>9s} {'y3, mm':>9s} {'V off':>9s}")
    for own, other in zip(*compare()):
        print(f"{own[0]:10.6f} {own[1]:13.9f} {own[2]:13.10f} {own[3]:9.4f} {own[4]:9.4f} {own[1] - other[1]:9.1e}")


if __name__ == "__main__":
    main(sys.argv[1:])
