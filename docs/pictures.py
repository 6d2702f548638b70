#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the pictures of README.md and of the tutorial from runs of Kempe: docs/walk.svg, Jansen's legs walking, and
docs/four_bar.svg, the motion of the model that `kempe new` writes.

    python3 docs/pictures.py build/release/kempe
"""
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "examples"))
import panels  # noqa: E402
from panels import COLOURS, GREEN, RED  # noqa: E402


def run(kempe, model, *words):
    """Columns of a simulation of a model's text by name; `words` are options."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "model.yaml").write_text(model)
        subprocess.run([kempe, "simulate", "model.yaml", "--no-convergence-check", "-o", "rows.csv", *words], cwd=folder, check=True,
                       stdout=subprocess.DEVNULL)
        rows = panels.rows(path / "rows.csv")
    return {name: [row[name] for row in rows] for name in rows[0]}


def point(columns, name):
    return list(zip(columns[f"position.{name}.x"], columns[f"position.{name}.y"]))


def svg(title, width, height, shapes):
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
            f'font-family="sans-serif" font-size="14">\n<title>{title}</title>\n<rect width="{width}" height="{height}" fill="white"/>')
    return "\n".join([head, *shapes]) + "\n</svg>\n"


def pairs(points):
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def line(points, colour, width=1.5, more=""):
    return f'<polyline points="{pairs(points)}" fill="none" stroke="{colour}" stroke-width="{width}" {more}/>'


# -- Jansen's legs -------------------------------------------------------------------------------------

SECONDS, FRAMES = 4, 48
BODIES = {"crank": "OA", "upper_rod": "AU", "lower_rod": "AG", "upper": "BUW", "link": "WH", "lower": "BG", "leg": "GHF"}
OWNERS = {"A": "crank.A", "U": "upper.U", "G": "lower.G", "W": "upper.W", "H": "leg.H", "F": "leg.F"}


def leg(kempe):
    """The places of the points of one leg at each frame of a turn."""
    outputs = ", ".join(f"position({name})" for name in OWNERS.values())
    columns = run(kempe, f"kempe: 1\ninclude: [{{file: {ROOT}/examples/jansen_leg/jansen_leg.yaml}}]\n"
                  f"run: {{t_end: {SECONDS}, rtol: 1e-8, output_step: {SECONDS / FRAMES!r}, outputs: [{outputs}]}}\n")
    places = {name: point(columns, owner) for name, owner in OWNERS.items()}
    return [{**{name: places[name][k] for name in places}, "B": (0, 0), "O": (0.038, 0.0078)} for k in range(FRAMES)]


def moving(frames, attributes):
    """A polygon that goes through the places of all frames; drawn without motion it stands at the first one."""
    values = ";".join(pairs(points) for points in [*frames, frames[0]])
    return (f'<polygon points="{pairs(frames[0])}" {attributes}>'
            f'<animate attributeName="points" dur="{SECONDS}s" repeatCount="indefinite" values="{values}"/></polygon>')


def walker(frames, place, shift, mirror, faint):
    """Seven bodies of one leg, `shift` frames ahead; the mirrored leg shares the crank's shaft."""
    turned = [frames[(FRAMES // 2 - k + shift) % FRAMES if mirror else (k + shift) % FRAMES] for k in range(FRAMES)]
    side = lambda p: (0.076 - p[0], p[1]) if mirror else p
    shapes = []
    for k, corners in enumerate(BODIES.values()):
        colour = "#b8c0c8" if faint else COLOURS[k]
        at = [[place(side(frame[corner])) for corner in corners] for frame in turned]
        fill = f'fill="{colour}" fill-opacity="0.18"' if len(corners) > 2 else 'fill="none"'
        shapes.append(moving(at, f'{fill} stroke="{colour}" stroke-width="{4 if faint else 5}" stroke-linejoin="round"'))
    return shapes


def ground(frames, place, width):
    """Marks that go by at the speed of the foot on the ground."""
    level = min(frame["F"][1] for frame in frames)
    down = [k for k in range(FRAMES) if frames[k]["F"][1] < level + 0.002 and frames[(k + 1) % FRAMES]["F"][1] < level + 0.002]
    steps = [frames[(k + 1) % FRAMES]["F"][0] - frames[k]["F"][0] for k in down]
    way = (place((sum(steps) / len(steps) * FRAMES, 0))[0] - place((0, 0))[0])
    y = place((0, level))[1] + 3
    marks = " ".join(f"M {x:.1f} {y:.1f} l -8 10" for x in [-abs(way) + k * abs(way) / 12 for k in range(12 * (2 + int(width / abs(way))))])
    return [f'<line x1="0" y1="{y:.1f}" x2="{width}" y2="{y:.1f}" stroke="#333" stroke-width="2"/>',
            f'<path d="{marks}" stroke="#777" stroke-width="1.3"><animateTransform attributeName="transform" type="translate" '
            f'dur="{SECONDS}s" repeatCount="indefinite" from="0 0" to="{way:.1f} 0"/></path>']


def walk(kempe):
    frames, width, height, scale = leg(kempe), 640, 360, 2450
    place = lambda p: (width / 2 + scale * (p[0] - 0.038), 120 - scale * p[1])
    feet = [line([place((p[0] if side else 0.076 - p[0], p[1])) for p in [frame["F"] for frame in [*frames, frames[0]]]], "#5d6d7e", 1.3,
                 'stroke-dasharray="4 4"') for side in (0, 1)]
    shapes = ground(frames, place, width) + feet
    for shift, faint in ((FRAMES // 2, True), (0, False)):
        for mirror in (True, False):
            shapes += walker(frames, place, shift, mirror, faint)
    for p in ((0, 0), (0.038, 0.0078), (0.076, 0)):
        x, y = place(p)
        shapes.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="white" stroke="#333" stroke-width="2"/>')
    return svg("Jansen's legs walking", width, height, shapes)


# -- the first model -----------------------------------------------------------------------------------

def linkage(columns, angle):
    """Bars at a few places of one turn, and the path of C."""
    A, D = (0.0, 0.0), (0.9, 0.0)
    place = lambda p: (70 + 215 * p[0], 235 - 215 * p[1])
    C = point(columns, "coupler.C")
    B = [(0.3 * math.cos(q), 0.3 * math.sin(q)) for q in columns["q.A"]]
    turn = [k for k, q in enumerate(columns["q.A"]) if angle <= q <= angle + 2 * math.pi]
    shapes = [line([place(C[k]) for k in turn], GREEN, 3), line([place(B[k]) for k in turn], RED, 1.2, 'stroke-dasharray="3 4"')]
    wanted = [angle + j * math.pi / 4 for j in range(8)]
    poses = [min(turn, key=lambda k: abs(columns["q.A"][k] - q)) for q in wanted]
    for order, k in enumerate(reversed(poses)):
        opacity = 1 if order == len(poses) - 1 else 0.18
        for a, b, colour in ((A, B[k], COLOURS[0]), (B[k], C[k], COLOURS[1]), (D, C[k], COLOURS[2])):
            shapes.append(line([place(a), place(b)], colour, 5, f'stroke-linecap="round" opacity="{opacity}"'))
    for name, p in (("A", A), ("B", B[poses[0]]), ("C", C[poses[0]]), ("D", D)):
        x, y = place(p)
        if name in "AD":
            shapes.append(f'<path d="M {x:.1f} {y:.1f} l -10 18 h 20 Z" fill="#eee" stroke="#333" stroke-width="1.5"/>')
        shapes.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="white" stroke="#333" stroke-width="2"/>')
        shapes.append(f'<text x="{x - 20:.1f}" y="{y - 8:.1f}" fill="#333" font-weight="bold">{name}</text>')
    return shapes


def graph(columns, name, factor, title, colour, top, ticks):
    panel = panels.Panel(420, top, 280, 100, (0, 5), ticks)
    panel.frame(title)
    panel.curve([(t, factor * v) for t, v in zip(columns["t"], columns[name])], colour, "", 0)
    panel.axis(range(6), "s", 6)
    return panel.lines


def four_bar(kempe):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([kempe, "new", "four_bar"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        model = (pathlib.Path(folder) / "four_bar.yaml").read_text()
    columns = run(kempe, model, "--output-step", "10 ms")
    shapes = linkage(columns, 6 * math.pi + math.radians(60))
    shapes += graph(columns, "q.D", 180 / math.pi, "Rocker: angle q(D), degrees", COLOURS[2], 40, [90, 120, 150])
    shapes += graph(columns, "qd.A", 1, "Crank: rate qd(A), rad/s", COLOURS[0], 200, [0, 10, 20, 30])
    return svg("The four-bar linkage of kempe new", 720, 340, shapes)


if __name__ == "__main__":
    command = str(pathlib.Path(sys.argv[1]).resolve())
    (ROOT / "docs/walk.svg").write_text(walk(command))
    (ROOT / "docs/four_bar.svg").write_text(four_bar(command))
