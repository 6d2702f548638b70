#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The cache of derived equations changes no result, whatever happens to its folder.

    python3 tests/cache_folders.py KEMPE [EXAMPLE ..]

Every third example (./check full: every one) runs without a cache, with an empty one, and with the files that this has left: the results are equal but
for times, and the third run writes nothing. Damaged files do not count and are replaced. Other sources, settings and
algorithms have files of their own. Processes share a folder; a folder that cannot be written to, or is no folder, is
ignored; the folder has a bound.
"""
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TIMES = re.compile(r'"(\w*_s|time_\w+)": [-+0-9.eE]+')
DAMAGED = "four_bar"
CODED = "bogie"  # large enough that machine code is kept


def run(kempe, folder, words, limit=None):
    """The output of the command with a cache folder (None: no cache), without times."""
    environment = dict(os.environ, KEMPE_CACHE=str(folder) if folder else "off", OPENBLAS_NUM_THREADS="1")
    bound = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))) if limit is not None else None
    done = subprocess.run([kempe, *map(str, words)], capture_output=True, text=True, env=environment, cwd=ROOT,
                          preexec_fn=bound, timeout=300)
    return done.returncode, TIMES.sub(r'"\1": T', done.stdout), done.stderr


def model_of(name):
    return ROOT / "examples" / name / f"{name}.yaml"


def simulation(name, *more):
    return ["simulate", model_of(name), "--t-end", "2e-3", "--no-convergence-check", "--json", "-", *more]


def stamps(folder):
    """The files of a folder: content, and the file itself."""
    return {f.name: (f.read_bytes(), f.stat().st_ino) for f in sorted(folder.glob("*.kempe"))} if folder.exists() else {}


def expect(good, what):
    if not good:
        sys.exit(f"cache_folders.py: {what}")


def compare_examples(kempe, names, folder):
    """Cold and warm runs equal those without a cache."""
    for name in names:
        for words in (["check", model_of(name), "--json", "-"], simulation(name)):
            without = run(kempe, None, words)
            cold = run(kempe, folder, words)
            left = stamps(folder)
            warm = run(kempe, folder, words)
            expect(cold == without, f"{name}: '{words[0]}' with an empty cache differs")
            expect(warm == without, f"{name}: '{words[0]}' with a filled cache differs")
            expect(stamps(folder) == left, f"{name}: '{words[0]}' wrote to a filled cache")
    expect(len(stamps(folder)) >= len(names) // 2, "most examples were not cached")


def damages(content):
    """Ways in which a file may be damaged."""
    middle = len(content) // 2
    yield "empty", b""
    yield "a single byte", content[:1]
    yield "its head alone", content[:56]
    yield "without its last byte", content[:-1]
    yield "half", content[:middle]
    yield "longer", content + b"\0"
    yield "zeros", bytes(len(content))
    for at in (0, 7, 8, 20, 40, 48, 56, 60, middle, len(content) - 1):
        yield f"byte {at} changed", content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1:]
    yield "parts exchanged", content[:56] + content[middle:] + content[56:middle]


def damage_code(kempe, folder):
    """Files of programs and of their machine code."""
    words = simulation(CODED)
    without = run(kempe, None, words)
    run(kempe, folder, words)
    files = stamps(folder)
    run(kempe, folder, [*simulation(CODED), "--backend", "tape"])
    expect(stamps(folder) == files, "the interpreter has files of its own")
    expect(len(files) > len(tape_files(kempe, folder.parent / "tape")), f"no machine code of {CODED} is kept")
    for name, (content, _) in files.items():
        for what, damaged in list(damages(content))[::4]:
            (folder / name).write_bytes(damaged)
            expect(run(kempe, folder, words) == without, f"a damaged file ({what}) changes the result")
            expect((folder / name).read_bytes() == content, f"a damaged file ({what}) stays")
        (folder / name).chmod(0o622)
        expect(run(kempe, folder, words) == without, "a file that others may write changes the result")
        expect((folder / name).stat().st_mode & 0o22 == 0, "a file that others may write is used")


def tape_files(kempe, folder):
    run(kempe, folder, [*simulation(CODED), "--backend", "tape"])
    return stamps(folder)


def damage_files(kempe, folder):
    words = simulation(DAMAGED)
    without = run(kempe, None, words)
    run(kempe, folder, words)
    files = stamps(folder)
    expect(files, f"{DAMAGED} is not cached")
    for name, (content, _) in files.items():
        for what, damaged in damages(content):
            (folder / name).write_bytes(damaged)
            expect(run(kempe, folder, words) == without, f"a damaged file ({what}) changes the result")
            expect((folder / name).read_bytes() == content, f"a damaged file ({what}) stays")
        other = next(o for o in [*files, None] if o != name)
        if other:
            (folder / name).write_bytes(files[other][0])
            expect(run(kempe, folder, words) == without, "a file under another name changes the result")
    files = [*files, "counted"]
    for name in files:
        (folder / name).unlink()
        (folder / name).mkdir()
    expect(run(kempe, folder, words) == without, "a folder in a file's place changes the result")
    for name in files:
        (folder / name).rmdir()
        os.mkfifo(folder / name)
    expect(run(kempe, folder, words) == without, "a pipe in a file's place changes the result")


def tell_apart(kempe, folder):
    """Inputs that differ have files of their own."""
    model = folder.parent / "model.yaml"
    text = model_of(DAMAGED).read_text()
    model.write_text(text)
    words = ["simulate", model, "--t-end", "2e-3", "--no-convergence-check", "--json", "-"]
    seen = set()
    for change in ([], ["--set", "crank=0.31"], ["--set", "crank=0.32"], ["--algorithm", "plain"],
                   ["--closure-tolerance", "1e-5"]):
        without = run(kempe, None, [*words, *change])
        for _ in range(2):
            expect(run(kempe, folder, [*words, *change]) == without, f"{change}: a file of other inputs is taken")
        expect(not set(stamps(folder)) <= seen, f"{change}: no file of its own")
        seen |= set(stamps(folder))
    model.write_text(text.replace("-9.81", "-9.82"))
    expect(model.read_text() != text, "the model has another gravity")
    expect(run(kempe, folder, words) == run(kempe, None, words), "an edited model takes the old file")


def move(kempe, folder):
    """A model with conditions in folders whose names have different lengths: one after the other, and back."""
    text = """kempe: 1
name: two wheels and a stop
gravity: [0.0, 0.0, -9.81]
parameters: {stiff: 24.828, load: 0}
ground: {points: {N: [1.5, 0.5, 0]}}
bodies:
  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.113}}
  b: {joint: {name: B, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.074}}
loops: {wheels: {constraint: "q(B) - (0.3)*q(A)"}}
states:
  z0: {next: "z0 + 1", when: "q(A) > 0.059", start: 0}
forces:
  f0: {joint: A, torque: "load - stiff*q(A) - 0.232*qd(A)"}
  f1: {joint: A, torque: "0.205*z0"}
  f2: {joint: A, torque: "if(q(A) > 0.037, -2.866, 1.433)"}
contacts:
  soft: {joint: A, upper: -0.622, law: hunt_crossley, stiffness: 36830.0, exponent: 1.0, damping: 0.333}
start: {q: {A: -0.793, B: -0.2379}, qd: {A: 1.643}, hold: [A]}
run: {t_end: 1.21, output_step: 0.3025, rtol: 1e-8, atol: 1e-8, outputs: [q, qd]}
"""
    models = [folder.parent / ("m" * length) / "model.yaml" for length in (1, 17, 33, 49, 65, 97)]
    for model in models:
        model.parent.mkdir()
        model.write_text(text)
    simulations = [["simulate", model, "--no-convergence-check", "--json", "-"] for model in models]
    without = [run(kempe, None, words) for words in simulations]
    for first in range(len(models)):
        for k in (first, *range(len(models))):
            expect(run(kempe, folder, simulations[k]) == without[k], "a model in another folder has another result")
        for file in folder.glob("*"):
            file.unlink()


def share(kempe, folder):
    """Processes at the same time, some of which fill the cache."""
    words = simulation(DAMAGED)
    without = run(kempe, None, words)
    environment = dict(os.environ, KEMPE_CACHE=str(folder), OPENBLAS_NUM_THREADS="1")
    for _ in range(3):
        for f in folder.glob("*"):
            f.unlink()
        running = [subprocess.Popen([kempe, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                    text=True, env=environment, cwd=ROOT) for _ in range(8)]
        for p in running:
            out, err = p.communicate(timeout=300)
            expect((p.returncode, TIMES.sub(r'"\1": T', out), err) == without, "processes at the same time differ")
        expect(all(f.endswith(".kempe") or f == "counted" for f in stamps_names(folder)), "temporary files stay")


def spoil_folder(kempe, folder):
    """Folders that cannot be used."""
    words = simulation(DAMAGED)
    without = run(kempe, None, words)
    file = folder.parent / "file"
    file.write_text("")
    expect(run(kempe, file, words) == without, "a file in the folder's place changes the result")
    expect(run(kempe, file / "below", words) == without, "a folder below a file changes the result")
    expect(run(kempe, "/proc/kempe", words) == without, "a folder that cannot be made changes the result")
    empty = folder.parent / "full"
    expect(run(kempe, empty, words, limit=0) == without, "a limit on the size of files changes the result")
    expect(not stamps(empty), "a limit on the size of files leaves some")
    run(kempe, folder, words)
    left = stamps(folder)
    folder.chmod(0o500)
    expect(run(kempe, folder, words) == without, "a read-only folder changes the result")
    folder.chmod(0o700)
    expect(stamps(folder) == left, "a read-only folder was written to")


def switch_off(kempe, folder):
    words = simulation(DAMAGED)
    run(kempe, folder, [*words, "--no-cache"])
    expect(not stamps(folder), "--no-cache writes files")


def keep_bound(kempe, folder):
    """The oldest files go; temporary files without an owner go too."""
    folder.mkdir()
    names = [f"{k:064x}.kempe" for k in range(4)]
    for k, name in enumerate(names):
        with open(folder / name, "wb") as f:
            f.truncate(80 << 20)
        os.utime(folder / name, (1000 + k, 1000 + k))
    for name, age in (("new.old", 1000), ("other", 1000)):
        (folder / name).write_text("x")
        os.utime(folder / name, (age, age))
    (folder / "new.young").write_text("x")
    run(kempe, folder, simulation(DAMAGED))
    left = set(stamps_names(folder))
    expect(names[0] not in left and names[1] not in left and {names[2], names[3]} <= left,
           "not the oldest files were removed")
    expect("new.old" not in left and {"other", "new.young"} <= left, "other files were removed, or old ones stay")
    # The folder is looked through again when the count of what has been written exceeds the bound, and not before.
    size = (folder / "counted").stat().st_size
    expect(160 << 20 <= size << 12 < 161 << 20, f"the count is {size} after the folder was looked through")
    with open(folder / names[0], "wb") as f:
        f.truncate(200 << 20)
    os.utime(folder / names[0], (1000, 1000))
    run(kempe, folder, simulation("andrews"))
    expect(names[0] in stamps_names(folder), "a folder whose count is below the bound was looked through")
    expect((folder / "counted").stat().st_size > size, "what is written is not counted")
    os.truncate(folder / "counted", 256 << 8)
    run(kempe, folder, simulation("stephenson"))
    expect(names[0] not in stamps_names(folder), "a folder whose count exceeds the bound was not looked through")


def stamps_names(folder):
    return [f.name for f in folder.iterdir()]


def main():
    kempe = str(pathlib.Path(sys.argv[1]).resolve())
    names = sorted(f.parent.name for f in ROOT.glob("examples/*/*.yaml") if f.stem == f.parent.name)
    names = sys.argv[2:] or (names if "KEMPE_FULL" in os.environ else names[::3])
    steps = (lambda k, f: compare_examples(k, names, f), damage_files, damage_code, tell_apart, move, share, spoil_folder,
             switch_off, keep_bound)
    for step in steps:
        with tempfile.TemporaryDirectory() as parent:
            step(kempe, pathlib.Path(parent) / "cache")
    print(f"{len(names)} examples are the same with and without a cache")


if __name__ == "__main__":
    main()
