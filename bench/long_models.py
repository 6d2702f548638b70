#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Models of many bodies in every format that Kempe reads: a chain of pendulums, and a star of bodies on the ground. Each is read
and printed by `show --model`. A row has processor seconds, kB of memory a body, and the exponent of the time from one size to the next.

    bench/long_models.py build/release/kempe [BODIES ..]
"""
import math
import os
import pathlib
import subprocess
import sys
import tempfile

SIZES = [12500, 25000, 50000, 100000]
DEEPEST = 90  # elements of XML within each other: the reader takes 100


def yaml(n, chain):
    yield "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {P: [0, 0, 0]}}\nbodies:\n"
    for k in range(n):
        at = f"b{k - 1}.P" if chain and k else "ground.P"
        yield f"  b{k}: {{joint: {{name: j{k}, revolute: y, at: {at}}}, mass: 1, inertia: {{yy: 1}}, points: {{P: [1, 0, 0]}}}}\n"


def urdf(n, chain):
    yield "<robot name='long'>\n<link name='world'/>\n"
    for k in range(n):
        yield (f"<link name='b{k}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>\n"
               f"<joint name='j{k}' type='continuous'><parent link='{f'b{k - 1}' if chain and k else 'world'}'/><child link='b{k}'/>"
               "<origin xyz='1 0 0'/><axis xyz='0 1 0'/></joint>\n")
    yield "</robot>\n"


def sdf(n, chain):
    yield "<sdf version='1.9'><model name='long'>\n"
    for k in range(n):
        yield (f"<link name='b{k}'><pose>{k + 1} 0 0 0 0 0</pose><inertial><mass>1</mass></inertial></link>\n"
               f"<joint name='j{k}' type='revolute'><parent>{f'b{k - 1}' if chain and k else 'world'}</parent><child>b{k}</child><axis><xyz>0 1 0</xyz></axis></joint>\n")
    yield "</model></sdf>\n"


def mjcf(n, chain):
    """Bodies stand within each other: a chain is cut into pieces of DEEPEST bodies."""
    yield "<mujoco model='long'><worldbody>\n"
    depth = 0
    for k in range(n):
        if depth == (DEEPEST if chain else 1):
            yield "</body>" * depth + "\n"
            depth = 0
        yield f"<body name='b{k}' pos='1 0 0'><joint name='j{k}' axis='0 1 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n"
        depth += 1
    yield "</body>" * depth + "</worldbody></mujoco>\n"


def mbs(n, chain):
    yield ("<mbsDescR7><mbsname>long</mbsname><base><gravity><coordinates><z>-9.81</z></coordinates></gravity><baseBodyName>base</baseBodyName></base>\n<bodytree>\n")
    for k in range(n):
        parent = f"<bodyname>b{k - 1}</bodyname><pointname>P</pointname>" if chain and k else "<bodyname>base</bodyname><pointname>origin</pointname>"
        yield (f"<body><bodyname>b{k}</bodyname><parent>{parent}</parent><joint><jointname>j{k}</jointname><type>R2</type></joint><mass>1</mass>"
               "<inertia><Iyy>1</Iyy></inertia><point><pointname>P</pointname><coordinates><x>1</x></coordinates></point></body>\n")
    yield "</bodytree></mbsDescR7>\n"


FORMATS = {"yaml": yaml, "urdf": urdf, "sdf": sdf, "mjcf": mjcf, "mbs": mbs}


def write(folder, ending, n, chain):
    path = pathlib.Path(folder) / f"long.{ending}"
    with open(path, "w", encoding="utf-8") as file:
        file.writelines(FORMATS[ending](n, chain))
    return path


def read(kempe, path):
    """Processor seconds and peak memory in kB of reading a model and printing it."""
    with open(os.devnull, "w", encoding="utf-8") as nothing:
        process = subprocess.Popen([kempe, "show", path, "--model"], stdout=nothing, stderr=subprocess.PIPE)
        _, status, usage = os.wait4(process.pid, 0)
    told = process.stderr.read().decode()
    process.stderr.close()
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{path}: {told}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss


def main():
    kempe, sizes = sys.argv[1], [int(word) for word in sys.argv[2:]] or SIZES
    print("format  shape   bodies   seconds  exponent  kB a body")
    worst = 0
    with tempfile.TemporaryDirectory() as folder:
        for ending in FORMATS:
            for chain in (True, False):
                before = None
                for n in sizes:
                    path = write(folder, ending, n, chain)
                    seconds, memory = min(read(kempe, path) for _ in range(3))
                    exponent = math.log(seconds / before[1]) / math.log(n / before[0]) if before else math.nan
                    worst = max(worst, exponent if before else 0)
                    print(f"{ending:6}  {'chain' if chain else 'star ':5}  {n:7}  {seconds:8.3f}  {exponent:8.2f}  {memory / n:9.2f}", flush=True)
                    before = n, seconds
    print(f"largest exponent {worst:.2f}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main()
