#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Commands by the build for Windows, under Wine, beside the same commands by the build for Linux: the exit codes are equal, and so are
texts and files, or their numbers within 1e-9 of the largest of their column.

    python3 tests/windows_commands.py build/dev/kempe build/windows/kempe/kempe.exe         every command
    python3 tests/windows_commands.py build/dev/kempe build/windows/kempe/kempe.exe --some  the sample that the test runs

The exit code is 77, which skips a test, where Wine or the build for Windows is missing. Times, counts of work and estimated errors, which
are differences of two runs, are not compared; a number that is rounded in a text may differ by one in its last digit.
"""
import concurrent.futures
import contextlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
WITHIN = 1e-9  # of the largest number of a column: msvcrt and glibc differ in the last digits of functions
X = "examples/{0}/{0}.yaml"
FOUR, STEWART, CHECKED = X.format("four_bar"), X.format("stewart"), "--no-convergence-check"
SHORT = f"--t-end 0.5 {CHECKED}"
# OUT is the folder of a run; commands of a line, after ";", share it.
SOME = f"""check {FOUR}
check examples/andrews/andrews.yaml --json OUT/check.json
simulate {FOUR} --t-end 1 -o OUT/run.csv
simulate {STEWART} {SHORT} -o OUT/run.csv
kinematics {FOUR} --sweep "crank=0 deg:360 deg:37" -o OUT/turn.csv
equilibrium examples/governor/governor.yaml --rates shaft=5.5
modes examples/quarter_car/quarter_car.yaml
ensemble {FOUR} --sample crank=0.28:0.32 --instances 32 --t-end 0.3 -o OUT/ends.csv
generate {FOUR} --lang c -o OUT
simulate examples/missing.yaml"""
MORE = f"""check {STEWART}
check examples/bricard/bricard.yaml
check examples/tram/tram.yaml
check examples/jansen_walker/jansen_walker.yaml --json OUT/check.json
assemble {FOUR} --json OUT/start.json
assemble examples/delta_robot/delta_robot.yaml
show {FOUR}
show examples/stephenson/stephenson.yaml --model
show examples/andrews/andrews.yaml --stats
simulate examples/andrews/andrews.yaml --t-end 0.03 -o OUT/run.csv
simulate examples/slider_crank/slider_crank.yaml {SHORT} --formulation dae -o OUT/run.csv
simulate examples/slider_crank/slider_crank.yaml {SHORT} --formulation dae --integrator ida -o OUT/run.csv
simulate examples/slider_crank_spatial/slider_crank_spatial.yaml {SHORT} --integrator radau -o OUT/run.csv
simulate examples/car_axis/car_axis.yaml {SHORT} -o OUT/run.csv
simulate examples/bowling_ball/bowling_ball.yaml {SHORT} -o OUT/run.csv
simulate examples/geneva_drive/geneva_drive.yaml {SHORT} -o OUT/run.csv
simulate examples/stick_slip/stick_slip.yaml {SHORT} -o OUT/run.csv
simulate examples/flexible_pendulum/flexible_pendulum.yaml {SHORT} -o OUT/run.csv
simulate examples/gearbox/gearbox.yaml {SHORT} -o OUT/run.csv
simulate examples/quarter_car_on_tyre/quarter_car_on_tyre.yaml {SHORT} -o OUT/run.csv
simulate examples/tram/tram.yaml --t-end 0.1 {CHECKED} -o OUT/run.csv
simulate {FOUR} {SHORT} -o OUT/run.npz
simulate {FOUR} {SHORT} -o OUT/run.parquet
simulate {FOUR} {SHORT} -o OUT/run.mat
simulate {FOUR} {SHORT} --plot OUT/curves.svg --y "qd(rocker)"
simulate {FOUR} {SHORT} --report OUT/page.html
simulate {FOUR} {SHORT} --backend tape -o OUT/run.csv
simulate {FOUR} {SHORT} --integrator adams -o OUT/run.csv
simulate {FOUR} {SHORT} --integrator dirk -o OUT/run.csv
simulate {FOUR} --t-end 0.2 {CHECKED} --checkpoint OUT/half.kempe ; simulate {FOUR} --t-end 0.4 {CHECKED} --resume OUT/half.kempe -o OUT/run.csv
compare {FOUR} --t-end 0.5 --integrators dop853,radau
compare examples/andrews/andrews.yaml --reference examples/andrews/reference.csv --integrators dop853
kinematics examples/chebyshev/chebyshev.yaml --sweep "crank=0 deg:360 deg" --svg OUT/paths.svg
equilibrium examples/double_four_bar/double_four_bar.yaml
equilibrium examples/double_four_bar/double_four_bar.yaml --global
inverse examples/driven_slider_crank/driven_slider_crank.yaml -o OUT/forces.csv
inverse examples/parallel_robot/parallel_robot.yaml --actuators a1,b1,a2 --weights a2=4
linearize {FOUR} --at start
linearize examples/suspension/suspension.yaml --inputs "force(chassis.R.z)" --outputs q
modes examples/suspension/suspension.yaml --json OUT/modes.json
modes examples/quarter_car/quarter_car.yaml --sweep damper=0:6000:7
response examples/suspension/suspension.yaml --inputs "force(chassis.R.z)" --outputs "position(chassis.R).z" --frequencies 0.2:30:300 -o OUT/response.csv
sensitivity {FOUR} --parameters crank,base --t-end 0.3 -o OUT/derivatives.csv
comfort examples/ride/ride.yaml --vertical "acceleration(body.L).y" --t-end 10
contact examples/manchester/manchester.yaml --sweep "shift=0:1 mm:3" -o OUT/contact.csv
cycles examples/wheelset/wheelset.yaml --sweep v=24:26:3 --outputs "q(x)"
ensemble {FOUR} --sample crank=IT7 --instances 64 --t-end 0.3 --out OUT/bars.kempe ; gather OUT/bars.kempe -o OUT/bars.csv
ensemble {FOUR} --sample crank=0.28:0.32,base=0.85:0.95 --design sobol --instances 64 --t-end 0.3 --quantity "swing = range(q(rocker))" -o OUT/ends.csv
ensemble examples/unbalanced_shaft/unbalanced_shaft.yaml --sample speed=100:300:5 --design grid --t-end 0.1 -o OUT/ends.csv
optimize {FOUR} --minimize "max(qd(rocker))" --parameter crank:0.28:0.32 --t-end 0.3
generate examples/andrews/andrews.yaml --count
generate examples/andrews/andrews.yaml --lang python -o OUT
generate examples/slider_crank/slider_crank.yaml --lang octave -o OUT
fmu {FOUR} -o OUT/unit.fmu --no-binary
fmu {FOUR} -o OUT/unit.fmu --no-binary --fmi 2
new OUT/first ; check OUT/first.yaml
new OUT/Öl ; check OUT/Öl.yaml ; simulate OUT/Öl.yaml {SHORT} -o OUT/Länge.csv
check tests/malformed/unknown_key.yaml
simulate {FOUR} --no-such-option
new --elements
help simulate"""

NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|nan|NaN|inf(?:inity)?", re.I)
# Two runs of one build do not share times, and estimates that are differences of two numbers near each other: a word stands in their place.
TIME = re.compile(rb"(?<![\w.])[\d.]+(?:e[-+]?\d+)?\s+(?:us|ms|s)(?=,?\s+(?:of preparation|per |on \d|after |analysis|preparation))"
                  rb"|(?<=\bin )[\d.]+(?:e[-+]?\d+)?\s+(?:us|ms|s)\b|(?<=\bafter )[\d.]+(?:e[-+]?\d+)?\s+(?:us|ms|s)(?=\s+of prep)"
                  rb"|(?<= times, )[\d.]+(?:e[-+]?\d+)? s\b|\"(?:cpu|wall|build)_s\": *[^,}\n]+")
ESTIMATE = re.compile(rb"estimated.error|convergence|drift|residual|within", re.I)
ICON = re.compile(rb"(?<=sources only, )\d+ kB|\d+ files inside")  # Linux has librsvg, which draws a bitmap of the icon
BACKEND = re.compile(rb", back end tape(?=[;,\n])|\"backend\": *\"(?:native|tape)\",?\s*")  # what ran, on a machine without machine code
TOKEN = re.compile(rb"(?:instantiationToken|guid|generationDateAndTime)=\"[^\"]*\"", re.I)


def shared(text, printed):
    """A text without what two runs do not share."""
    text = re.sub(rb"\n {10}(?=\S)", b" ", text) if printed else text  # a time of more digits breaks lines elsewhere
    text = TOKEN.sub(b"", TIME.sub(b"TIME", BACKEND.sub(b"", text)))
    text = ICON.sub(b"SIZE", text) if printed else text
    return b"\n".join(b"ESTIMATE" if ESTIMATE.search(line) else line for line in text.split(b"\n")) if printed else text


def places(word):
    """The value of the last digit of a number as it is written."""
    mantissa, _, exponent = word.lower().partition(b"e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(b".")[2]))


def differences(one, other, digits, printed):
    """(numbers, the largest difference relative to the column, a sentence or "") of two texts."""
    worst, count = 0.0, 0
    first, second = shared(one, printed).splitlines(), shared(other, printed).splitlines()
    if len(first) != len(second):
        return 0, 1.0, f"{len(first)} lines and {len(second)}"
    largest = {}
    for line in first:
        for k, word in enumerate(NUMBER.findall(line)):
            largest[k] = max(largest.get(k, 0.0), abs(float(word)) if float(word) == float(word) else 0.0)
    for a, b in zip(first, second):
        if a == b:
            count += len(NUMBER.findall(a))
            continue
        x, y = NUMBER.findall(a), NUMBER.findall(b)
        if re.sub(rb"\s+", b" ", NUMBER.sub(b"#", a)) != re.sub(rb"\s+", b" ", NUMBER.sub(b"#", b)) or len(x) != len(y):
            return count, 1.0, f"{a[:100]!r} and {b[:100]!r}"
        for k, (u, v) in enumerate(zip(x, y)):
            count += 1
            apart = abs(float(u) - float(v))
            if apart == 0 or u == v:
                continue
            if digits and apart <= 1.01 * max(places(u), places(v)):
                continue
            scale = largest[k] if largest[k] > 0 else 1.0
            worst = max(worst, apart / scale)
            if not apart <= WITHIN * scale:
                return count, worst, f"{a[:100]!r} and {b[:100]!r}"
    return count, worst, ""


def arrays(path):
    """The text of a binary table as Linux reads it: CSV of the same values."""
    import numpy
    if path.suffix == ".npz":
        with numpy.load(path) as opened:
            return "\n".join(f"{name} " + " ".join(map(repr, opened[name].ravel().tolist())) for name in sorted(opened)).encode()
    return None


def texts(path):
    """(bytes, whether numbers are rounded to few digits) of a file that was written; None: bytes alone are compared."""
    if path.suffix == ".npz":
        return arrays(path), False
    if path.suffix == ".fmu":
        import zipfile
        with zipfile.ZipFile(path) as archive:
            return b"\n".join(name.encode() + b"\n" + archive.read(name) for name in sorted(archive.namelist())
                              if not name.endswith(".png")), False
    if path.suffix in (".parquet", ".mat", ".kempe"):
        return None, False
    return path.read_bytes(), path.suffix in (".svg", ".html", ".json")


def run(start, line, folder):
    """(exit codes, what is printed) of the commands of a line."""
    codes, said = [], b""
    environment = {**os.environ, "KEMPE_CACHE": "off", "WINEDEBUG": "-all", "OPENBLAS_NUM_THREADS": "1", "BROWSER": "",
                   "KEMPE_JAVASCRIPT": "/usr/share/javascript", "WINEPATH": ""}
    for part in line.split(" ; "):
        words = [word.replace("OUT", str(folder)) if "OUT" in word else word for word in re.findall(r'"([^"]*)"|(\S+)', part) for word in word if word]
        done = subprocess.run([*start, *words], capture_output=True, timeout=600, env=environment, cwd=ROOT)
        codes.append(done.returncode)
        said += done.stdout + done.stderr
    return codes, said.replace(str(folder).encode(), b"OUT")


def compare(line, linux, windows):
    """(True where they agree, a row of the table) of a line of commands."""
    with tempfile.TemporaryDirectory() as top:
        folders = [pathlib.Path(top) / "linux", pathlib.Path(top) / "other"]
        for folder in folders:
            folder.mkdir()
        (codes, said), (others, other) = (run(start, line, folder) for start, folder in zip((linux, windows), folders))
        other = re.sub(rb"0\d\d\d:[a-z]+:[^\n]*\n", b"", other)
        if codes != others:
            return False, f"exit codes {codes} and {others}: {other[-200:]!r}"
        exact, count, worst = shared(said, True) == shared(other, True), 0, 0.0
        found, apart, why = differences(said, other, True, True)
        count, worst = count + found, max(worst, apart)
        if why:
            return False, f"printed {why}"
        names = sorted(path.relative_to(folders[0]).as_posix() for path in folders[0].rglob("*") if path.is_file())
        if names != sorted(path.relative_to(folders[1]).as_posix() for path in folders[1].rglob("*") if path.is_file()):
            return False, f"files {names} and {sorted(os.listdir(folders[1]))}"
        for name in names:
            one, two = (folder / name for folder in folders)
            if one.read_bytes() == two.read_bytes():
                continue
            exact = False
            (a, digits), (b, _) = texts(one), texts(two)
            if a is None:
                if abs(one.stat().st_size - two.stat().st_size) > 0.02 * one.stat().st_size + 64:
                    return False, f"{name}: {one.stat().st_size} bytes and {two.stat().st_size}"
                continue
            found, apart, why = differences(a.replace(str(folders[0]).encode(), b"OUT"), b.replace(str(folders[1]).encode(), b"OUT"), digits,
                                             one.suffix == ".json")
            count, worst = count + found, max(worst, apart)
            if why:
                return False, f"{name}: {why}"
        refused = f"exit code {max(codes)}, " if max(codes) else ""
        return True, refused + ("equal" if exact else f"{count} numbers, largest difference {worst:.1e}")


def wine_of():
    """The program of Wine for 64 bits; None: it is missing."""
    debian = "/usr/lib/wine/wine64"
    return debian if os.path.exists(debian) else shutil.which("wine64") or shutil.which("wine")


@contextlib.contextmanager
def session(wine):
    """One session of Wine for all commands. Each would begin one otherwise, whose services keep its pipes open for three seconds after its
    end; and they begin before the first command, with no pipe of it."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": {**os.environ, "WINEDEBUG": "-all"}}
    with subprocess.Popen([wine, "cmd"], stdin=subprocess.PIPE, **quiet) as kept:
        subprocess.run([wine, "cmd", "/c", "exit"], stdin=subprocess.DEVNULL, check=False, **quiet)
        yield
        kept.stdin.close()


def main(words):
    chosen = [word for word in words if not word.startswith("--")]
    linux, windows = os.path.abspath(chosen[0]), os.path.abspath(chosen[1])
    wine = wine_of()
    if not wine or not os.path.exists(windows):
        print(f"skipped: {'Wine is missing' if not wine else windows + ' is missing: packaging/build_windows makes it'}")
        return 77
    lines = SOME.splitlines() + ([] if "--some" in words else MORE.splitlines())
    wrong, same = 0, 0
    with session(wine), concurrent.futures.ThreadPoolExecutor(int(os.environ.get("PARALLEL", "1"))) as pool:
        for line, (agrees, row) in zip(lines, pool.map(lambda line: compare(line, [linux], [wine, windows]), lines)):
            wrong += not agrees
            same += row.endswith("equal")
            print(f"{'agrees' if agrees else 'DIFFERS':8}{line.replace('OUT/', ''):100.100}  {row}", flush=True)
    print(f"{len(lines) - wrong} of {len(lines)} lines of commands agree, {same} of them with equal texts and files")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
