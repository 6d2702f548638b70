#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Scenes with many rigid contacts: time of a run of 1 s with its check, time of an event, and how they grow.

    bench/contact_scenes.py KEMPE [--most N]

Spheres bounce with friction on a plane, each apart from the others. Blocks slide on two corners each. Balls of one column fall on the
ground and on each other. Balls bounce on the ground, and each may touch each other one. Balls fly between four walls, without
and with friction, and each may touch each other one. All at rtol 1e-6, without the cache. Processor times, the least of three runs: of the whole command, with its
preparation and the repetition at another tolerance; and of an event, of the first run alone. The exponent is that of the growth of the
command's time since the line before."""
import argparse
import json
import math
import os
import subprocess

import tables

LONGEST = 60  # s of a command; the next number is left out
HEAD = "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
END = "run: {t_end: 1, rtol: 1e-6, outputs: [q]}\n"
PLANE = "on: {plane: ground.O, normal: y}"


def planar(n, points):
    return "".join(f"  s{i}: {{joint: {{name: j{i}, planar: z, at: ground}}, mass: 1, inertia: {{zz: 0.004}}, points: {{{points}}}}}\n"
                   for i in range(n))


def start(q, qd=()):
    return "start: {q: {" + ", ".join(q) + "}" + (", qd: {" + ", ".join(qd) + "}" if qd else "") + "}\n"


def spheres(n):
    contacts = "".join(f"  c{i}: {{sphere: s{i}.C, radius: 0.1, {PLANE}, restitution: 0.5, friction: 0.3}}\n" for i in range(n))
    q = [f"j{i}.1: {0.3 * i}, j{i}.2: {0.3 + 0.2 * (i * 7919 % n) / n}" for i in range(n)]
    return HEAD + planar(n, "C: [0, 0, 0]") + "contacts:\n" + contacts + start(q, [f"j{i}.1: 0.5" for i in range(n)]) + END


def blocks(n):
    contacts = "".join(f"  c{i}{p}: {{point: s{i}.{p}, {PLANE}, restitution: 0, friction: 0.4}}\n" for i in range(n) for p in "LR")
    q = [f"j{i}.1: {0.5 * i}, j{i}.2: 0.1" for i in range(n)]
    return (HEAD + planar(n, "L: [-0.1, -0.1, 0], R: [0.1, -0.1, 0]") + "contacts:\n" + contacts +
            start(q, [f"j{i}.1: {1 + 0.01 * i}" for i in range(n)]) + END)


def column(n):
    balls = "".join(f"  s{i}: {{joint: {{name: j{i}, prismatic: y, at: ground}}, mass: 1, points: {{C: [0, 0, 0]}}}}\n" for i in range(n))
    contacts = f"  f: {{sphere: s0.C, radius: 0.1, {PLANE}, restitution: 0.5}}\n"
    contacts += "".join(f"  c{i}: {{gap: q(j{i}) - q(j{i - 1}) - 0.2, restitution: 0.5}}\n" for i in range(1, n))
    return HEAD + balls + "contacts:\n" + contacts + start([f"j{i}: {0.12 + 0.22 * i}" for i in range(n)]) + END


def box(n):
    """Balls in a row of rows fall on the ground, and each may touch each other one: N (N + 1) / 2 contacts."""
    contacts = ""
    for i in range(n):
        contacts += f"  c{i}: {{sphere: s{i}.C, radius: 0.1, {PLANE}, restitution: 0.5}}\n"
        contacts += "".join(f"  c{i}_{k}: {{sphere: s{i}.C, radius: 0.1, on: {{sphere: s{k}.C, radius: 0.1}}, restitution: 0.5}}\n" for k in range(i))
    wide = max(1, int(math.sqrt(n)))
    q = [f"j{i}.1: {0.3 * (i % wide)}, j{i}.2: {0.3 + 0.3 * (i // wide)}" for i in range(n)]
    qd = [f"j{i}.1: {(i * 7919 % 17 - 8) / 8}, j{i}.2: {(i * 104729 % 17 - 8) / 8}" for i in range(n)]
    return HEAD + planar(n, "C: [0, 0, 0]") + "contacts:\n" + contacts + start(q, qd) + END


def walls(n, friction=""):
    """Balls fly between four walls, and each may touch each other one: N (N + 7) / 2 contacts."""
    side = math.ceil(math.sqrt(n))
    end = f"restitution: {0.8 if friction else 1}{friction}}}\n"
    contacts = ""
    for i in range(n):
        for wall, (point, normal) in enumerate((("O", "x"), ("O", "y"), ("E", "-x"), ("E", "-y"))):
            contacts += f"  w{i}_{wall}: {{sphere: s{i}.C, radius: 0.1, on: {{plane: ground.{point}, normal: {normal}}}, {end}"
        contacts += "".join(f"  c{i}_{k}: {{sphere: s{i}.C, radius: 0.1, on: {{sphere: s{k}.C, radius: 0.1}}, {end}" for k in range(i))
    head = HEAD.replace("gravity: [0, -9.81, 0]\n", "").replace("O: [0, 0, 0]", f"O: [0, 0, 0], E: [{0.5 * side}, {0.5 * side}, 0]")
    q = [f"j{i}.1: {0.25 + 0.5 * (i % side)}, j{i}.2: {0.25 + 0.5 * (i // side)}" for i in range(n)]
    qd = [f"j{i}.1: {math.cos(i * i + 1):.4f}, j{i}.2: {math.sin(i * i + 1):.4f}" for i in range(n)]
    return head + planar(n, "C: [0, 0, 0]") + "contacts:\n" + contacts + start(q, qd) + END


def rubbing(n):
    return walls(n, ", friction: 0.3")


def measure(kempe, path):
    """Time of the command, time of an event in s, events, steps; None: it takes longer than LONGEST, or fails."""
    found = None
    for _ in range(3):
        words = [kempe, "simulate", path, "--no-cache", "-q", "--json", "-"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
            try:
                text, _ = process.communicate(timeout=3 * LONGEST)
            except subprocess.TimeoutExpired:
                process.kill()
                return None
        result = json.loads(text or "{}")
        if "work" not in result or result["status"] not in ("complete", "not trustworthy"):
            return None
        own = result["cpu_s"], result["work"]["events"], result["work"]["steps"]
        whole = timed(words)
        now = (whole, own[0] / max(1, own[1]))
        found = (*map(min, found[:2], now), *own[1:]) if found else (*now, *own[1:])
        if whole > LONGEST / 10:
            break
    return found


def timed(words):
    """Processor time of a command, s."""
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kempe")
    parser.add_argument("--most", type=int, default=1000, help="the largest number of bodies")
    given = parser.parse_args()
    columns = (("command", 1, True), ("event", 1e3, False), ("events", 1, False), ("steps", 1, False))
    for name, make, numbers in (("spheres over a plane", spheres, (1, 10, 30, 100, 300, 1000)), ("blocks on two corners", blocks, (1, 3, 10, 30, 100)),
                                ("column of balls", column, (3, 10, 30)), ("balls that may all touch", box, (4, 8, 16, 32, 64)),
                                ("balls between walls", walls, (9, 16, 36, 64, 100)),
                                ("balls with friction between walls", rubbing, (9, 16, 36, 64, 100))):
        tables.growth(f"{name}: the command, s; its growth; an event, ms; events; steps", columns, make, [n for n in numbers if n <= given.most],
                      lambda path: measure(given.kempe, path), LONGEST)


if __name__ == "__main__":
    main()
