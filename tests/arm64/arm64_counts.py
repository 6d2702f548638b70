#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Instructions of a right-hand side on arm64 under QEMU: by machine code, by the tape, and by machine code for eight states at once.

    tests/arm64/arm64_counts.py ROOT PROGRAM [HERE]

ROOT: the folder of arm64's libraries; PROGRAM: arm64_evaluations of arm64; HERE: that of this machine, for the bits. Counted by a plugin
of QEMU (count_instructions.c): the difference of two processes with different numbers of evaluations, divided by the difference.
Fails where the bits of machine code, tape and this machine differ, or machine code needs more than LIMIT of the tape's instructions.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
EXAMPLES = HERE.parents[1] / "examples"
MODELS = ["four_bar", "slider_crank", "andrews", "stewart", "bricard", "suspension", "excavator", "governor"]
LIMIT = 0.5
FEW, MORE = 20, 420


def plugin_in(folder):
    made = pathlib.Path(folder) / "count_instructions.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", str(made), str(HERE / "count_instructions.c")], check=True)
    return str(made)


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return None, None
    count = re.search(r"instructions (\d+)", done.stderr)
    return done.stdout, int(count[1]) if count else None


def counted(qemu, program, model, *words):
    """Bits, and instructions of an evaluation; None: the model has none of this kind."""
    bits, few = run([*qemu, program, model, words[0], str(FEW), *words[1:]])
    again, more = run([*qemu, program, model, words[0], str(MORE), *words[1:]])
    if bits is None or again is None:
        return None, None
    assert bits == again, "evaluations differ"
    return bits, (more - few) / (MORE - FEW)


def main():
    root, program, here = sys.argv[1], sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else None
    faults = 0
    print(f"{'model':14} {'machine code':>12} {'tape':>8} {'ratio':>6} {'8 lanes, of each':>17}  bits")
    with tempfile.TemporaryDirectory() as folder:
        qemu = ["qemu-aarch64", "-L", root, "-plugin", plugin_in(folder)]
        for name in MODELS:
            model = str(EXAMPLES / name / f"{name}.yaml")
            bits, native = counted(qemu, program, model, "native")
            of_tape, tape = counted(qemu, program, model, "tape")
            of_lanes, lanes = counted(qemu, program, model, "native", "lanes")
            said = ["tape" if bits == of_tape else "NOT the tape's"]
            if here:
                said.append("this machine" if run([here, model, "native", "1"])[0] == bits else "NOT this machine's")
                if of_lanes:
                    said.append("its lanes" if run([here, model, "native", "1", "lanes"])[0] == of_lanes else "NOT its lanes'")
            wrong = any("NOT" in word for word in said) or native > LIMIT * tape
            faults += wrong
            print(f"{name:14} {native:12.0f} {tape:8.0f} {native / tape:6.2f} {lanes / 8 if lanes else float('nan'):17.0f}  "
                  f"{', '.join(said)}{' FAILED' if wrong else ''}", flush=True)
    sys.exit(faults > 0)


main()
