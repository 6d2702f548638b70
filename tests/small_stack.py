#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The command with the stack of docs/model/limits.md: the examples and everything that may be nested, to its limit and beyond, with 128 KiB,
sums and products of up to 4000 operands with 1 MiB, chains of bodies in every format and the equations of one with 64 KiB. It ends with a result or an error, never by a signal.

    python3 tests/small_stack.py build/dev/kempe [BODIES]
"""
import pathlib
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "bench"))
import long_models  # noqa: E402

PLAIN = "kempe: 1\nbodies: {{a: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1, inertia: {{zz: 1}}}}}}\nforces: {{f: {{joint: A, torque: \"{}\"}}}}\n"


def run(kempe, kib, *words):
    def bound():
        resource.setrlimit(resource.RLIMIT_STACK, (kib << 10, kib << 10))

    return subprocess.run([kempe, *map(str, words)], preexec_fn=bound, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, timeout=900,
                          env={"OPENBLAS_NUM_THREADS": "1", "PATH": "/usr/bin:/bin", "KEMPE_CACHE": "off"}, check=False)


def nested(folder):
    """Files that nest something, each with the commands that read them."""
    depths = (50, 190, 250, 1000, 100000)
    for depth in depths:
        yield f"parentheses {depth}", PLAIN.format("(" * depth + "t" + ")" * depth)
        yield f"functions {depth}", PLAIN.format("sin(" * depth + "t" + ")" * depth)
        yield f"signs {depth}", PLAIN.format("-" * depth + "t")
        yield f"powers {depth}", PLAIN.format("t^" * depth + "1")
        yield f"sums {depth}", PLAIN.format("t" + "+t" * depth)
        yield f"products {depth}", PLAIN.format("t" + "*q(A)" * depth)
        yield f"conditions {depth}", PLAIN.format("if(t < 1, " * depth + "1" + ", 2)" * depth)
        names = [f"v{k}: 'v{k - 1} + t'" if k else "v0: q(A)" for k in range(min(depth, 2000))]
        yield f"names {depth}", "kempe: 1\nalgebraic: {" + ", ".join(names) + "}\n" + PLAIN.format(names[-1].split(":")[0])[9:]
        yield f"lists {depth}", "kempe: " + "[" * depth + "]" * depth
        yield f"mappings {depth}", "kempe: " + "{a: " * depth + "1" + "}" * depth
        yield f"indents {depth}", "kempe: 1\n" + "".join(" " * k + "a:\n" for k in range(min(depth, 2000)))
        names = [f"p{k}: 'p{k - 1} + 1'" if k else "p0: 1" for k in range(min(depth, 5000))]  # 26 bytes of stack each: no recursion fits
        yield f"parameters {depth}", "kempe: 1\nparameters: {" + ", ".join(reversed(names)) + "}\n" + PLAIN.format(names[-1].split(":")[0])[9:]
        for ending, root in (("urdf", "robot"), ("sdf", "sdf"), ("mjcf", "mujoco"), ("mbs", "mbsDescR7")):
            (folder / f"deep.{ending}").write_text(f"<{root}>" + "<body>" * depth + "</body>" * depth + f"</{root}>")
            yield f"{ending} {depth}", folder / f"deep.{ending}"
    for k in range(30):
        (folder / f"part{k}.yaml").write_text(f"kempe: 1\ninclude: [{{file: part{k + 1}.yaml, prefix: p{k}_}}]\n")
    (folder / "part30.yaml").write_text(PLAIN.format("t"))
    yield "includes 30", folder / "part0.yaml"
    yield "includes 10", folder / "part20.yaml"


def chains():
    """Expressions of as many operations and operands as there may be, and names that would be longer when they are written out."""
    for sign in "+-*/":
        yield f"a chain of {sign}", PLAIN.format("t" + "".join(f"{sign}{k % 7 + 1}.{k}" if k % 2 else f"{sign}q(A)" for k in range(1990)))
    for section, first in (("parameters", "1.5"), ("algebraic", "t*q(A)")):
        names = ", ".join([f"v0: {first}"] + [f"v{k}: v{k - 1}*v{k - 1}" for k in range(1, 60)])
        yield f"squares of squares in {section}", f"kempe: 1\n{section}: {{{names}}}\n" + PLAIN.format("v59*t")[9:]


def main():
    kempe, bodies = str(pathlib.Path(sys.argv[1]).resolve()), int(sys.argv[2]) if len(sys.argv) > 2 else 2000
    died, count = [], 0

    def check(name, kib, *words):
        nonlocal count
        done = run(kempe, kib, *words)
        count += 1
        if done.returncode < 0 or done.returncode > 5:
            died.append(name)
            print(f"{name}, stack {kib} KiB: ended by {done.returncode} {done.stderr[:200]}")

    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        for name, text in nested(folder):
            path = text
            if isinstance(text, str):
                path = folder / "deep.yaml"
                path.write_text(text)
            long_sum = name.startswith(("sums", "products")) and not name.endswith((" 50", " 190", " 250"))
            for words in (("check", path), ("show", path, "--model")):
                check(name, 1024 if long_sum else 128, *words)
        for name, text in chains():
            path = folder / "deep.yaml"
            path.write_text(text)
            for words in (("check", path), ("show", path, "--equations"), ("generate", path, "--lang", "c", "--keep-parameters", "-o", folder / "made"),
                          ("simulate", path, "--t-end", "1e-3"), ("fmu", path, "--no-binary", "-o", folder / "made.fmu")):
                check(name, 1024, *words)
        for ending in long_models.FORMATS:
            check(f"chain of {bodies} bodies in {ending}", 64, "show", long_models.write(folder, ending, bodies, True), "--model")
        # 437 bytes for a body, as much as 128 KiB give each of 300 bodies, whose equations take five times as long
        check("equations of a chain of 150 bodies", 64, "show", long_models.write(folder, "yaml", 150, True), "--stats")
    for path in sorted(ROOT.glob("examples/*/*.yaml")):
        check(path.stem, 128, "simulate", path, "--t-end", "1e-3", "--no-convergence-check")
    print(f"{count} runs with a small stack, {len(died)} ended by a signal")
    return 1 if died else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main())
