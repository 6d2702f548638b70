#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Commands in WebAssembly, by the JavaScript interface in Node.js, beside the same commands by the native tape: exit codes, texts and
files are equal, or their numbers within 1e-12 of the largest of their column; DIFFERENT says which models may differ by more and why.

    python3 tests/wasm_commands.py build/dev/kempe build/wasm/javascript          every command, with times
    python3 tests/wasm_commands.py build/dev/kempe build/wasm/javascript --some   the sample that the test runs, and the calls of wasm_calls.mjs
    python3 tests/wasm_commands.py build/dev/kempe build/wasm/javascript --chromium   the page of one script, in Chromium
    python3 tests/wasm_commands.py build/dev/kempe build/wasm/javascript --all-in-chromium   every command there
    python3 tests/wasm_commands.py build/dev/kempe build/wasm/javascript --start      where the start of the page takes how long
    python3 tests/wasm_commands.py build/dev/kempe build/wasm/javascript --speed      integration in Chromium, in Node.js and natively

The exit code is 77, which skips a test, where Node.js, Chromium or the build for WebAssembly (packaging/build_wasm) is missing. Times and
estimated errors, which are differences of two runs, are not compared.
"""
import base64
import csv
import gzip
import json
import os
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import browser
import windows_commands as beside

ROOT = pathlib.Path(__file__).resolve().parent.parent
HERE = ROOT / "tests"
WITHIN = 1e-12
X = "examples/{0}/{0}.yaml"
CHECKED, TAPE = "--no-convergence-check", "--no-convergence-check --backend tape"
# Short runs of models with loops, without loops, with friction, impacts, contacts, flexible bodies, elements; then other studies. That of
# valve_train ends where its example does: from 0.05 s on one step is refused in one of the builds alone, and numbers differ by 5e-9.
RUNS = """andrews 0.03
bennett 0.5
bowling_ball 0.5
bricard 0.5
car_axis 0.3
cart_pole 0.5
chebyshev 0.5
crane 0.5
crank_rocker 0.5
delta_robot 0.3
double_four_bar 0.5
double_wishbone 0.3
driven_slider_crank 0.5
excavator 0.3
flexible_pendulum 0.3
four_bar 1
gearbox 0.3
geneva_drive 0.5
governor 0.5
jansen_leg 0.5
jansen_walker 0.3
n_four_bar 0.5
parallel_robot 0.3
peaucellier 0.5
planetary_gearbox 0.3
quarter_car 0.5
scissor_lift 0.5
slider_crank 0.5
slider_crank_spatial 0.5
spatial_slider_crank 0.3
stephenson 0.5
stewart 0.3
stick_slip 0.5
toggle_press 0.3
unbalanced_shaft 0.1
valve_train 0.025"""
STUDIES = f"""check {X.format('four_bar')} --json OUT/check.json
check {X.format('andrews')} --json OUT/check.json
check {X.format('bricard')}
assemble {X.format('four_bar')} --json OUT/start.json
kinematics {X.format('four_bar')} --sweep crank=0:6:37 -o OUT/turn.csv
equilibrium {X.format('governor')} --rates shaft=5.5
modes {X.format('quarter_car')} -o OUT/modes.csv
linearize {X.format('four_bar')} --at start
sensitivity {X.format('four_bar')} --parameters crank,base --t-end 0.3 --integrator radau -o OUT/derivatives.csv
simulate examples/missing.yaml
check tests/malformed/unknown_key.yaml"""
SOME = ("four_bar", "stewart", "bowling_ball")
ROUNDING = 1e-9  # columns whose largest number is smaller are zero but for rounding: they differ by less than this
# Commands whose numbers may differ by more, by how much, and why: C libraries differ in last digits of their functions.
DIFFERENT = {
    "simulate examples/planetary_gearbox": (1e-6, "exp in the torque of its motor"),
    "sensitivity examples/four_bar": (1e-9, "powers in the choice of steps"),
}


def lines_of(words):
    runs = [line.split() for line in RUNS.splitlines()]
    chosen = [(name, end) for name, end in runs if (ROOT / X.format(name)).exists() and ("--some" not in words or name in SOME)]
    runs = [f"simulate {X.format(name)} --t-end {end} {TAPE} --integrator {('dop853', 'radau')[k % 2]} -o OUT/run.csv"
            for k, (name, end) in enumerate(chosen)]
    return runs + STUDIES.splitlines()


def files_of(line):
    """The files that a command may read: those of its model's folder."""
    found = {}
    for word in line.split():
        folder = (ROOT / word).parent
        if word.startswith(("examples/", "tests/")) and folder.is_dir():
            found |= {path.relative_to(ROOT).as_posix(): str(path) for path in folder.rglob("*")
                      if path.is_file() and path.suffix in (".yaml", ".csv", ".npz", ".txt", ".xml", ".urdf") and path.stat().st_size < 4 << 20}
    return found


def native(command, line, folder):
    began = time.perf_counter()
    done = subprocess.run([command, *line.replace("OUT", str(folder)).split()], capture_output=True, timeout=600, cwd=ROOT, check=False,
                          env={**os.environ, "KEMPE_CACHE": "off", "XDG_CACHE_HOME": str(folder.parent), "OPENBLAS_NUM_THREADS": "1"})
    return done.returncode, done.stdout.decode(), done.stderr.decode(), time.perf_counter() - began


def tables(one, two):
    """(numbers, the largest difference relative to its column, a sentence or "") of two files of CSV."""
    rows = [list(csv.reader(path.read_text().splitlines())) for path in (one, two)]
    if rows[0][0] != rows[1][0] or len(rows[0]) != len(rows[1]):
        return 0, 1.0, f"{len(rows[0])} rows of {rows[0][0]} and {len(rows[1])} of {rows[1][0]}"
    worst, count = 0.0, 0
    for name, first, second in zip(rows[0][0], zip(*rows[0][1:]), zip(*rows[1][1:])):
        apart, largest = 0.0, 0.0
        for u, v in zip(first, second):
            if u != v and not (beside.NUMBER.fullmatch(u.encode()) and beside.NUMBER.fullmatch(v.encode())):
                return count, 1.0, f"{name}: {u} and {v}"
            if beside.NUMBER.fullmatch(u.encode()):
                apart, largest, count = max(apart, abs(float(u) - float(v))), max(largest, abs(float(u))), count + 1
        if apart > (beside.WITHIN * largest if largest > ROUNDING else ROUNDING):
            return count, apart / largest, f"{name}: {apart:.1e} of {largest:.1e}"
        worst = max(worst, apart / largest if largest > ROUNDING else 0)
    return count, worst, ""


def compare(line, told, answer, folders):
    """(True where both agree, what is compared) of what the native command and the one in WebAssembly gave."""
    code, out, err, _ = told
    if code != answer["code"]:
        return False, f"exit codes {code} and {answer['code']}: {answer['messages']}"
    one, two = ((text.strip().replace(str(folders[0]), "OUT").replace("/out", "OUT") + "\n").encode() for text in (out, answer["text"]))
    one, two = (re.sub(rb"changed \d+ times, (?:back end tape, )?\S+ s", b"changed TIME", text) for text in (one, two))
    beside.WITHIN, reason = next((row for name, row in DIFFERENT.items() if line.startswith(name)), (WITHIN, ""))
    count, worst, why = (0, 0.0, "") if reason else beside.differences(one, two, True, True)
    if why:
        return False, f"printed {why}"
    said = [message["text"] for message in answer["messages"]]
    if any(not any(sentence.strip().endswith(words) for words in said) for sentence in err.splitlines()):
        return False, f"said {err!r} and {said}"
    exact = beside.shared(one, True) == beside.shared(two, True)
    names = [sorted(path.name for path in folder.rglob("*") if path.is_file()) for folder in folders]
    if names[0] != names[1]:
        return False, f"files {names[0]} and {names[1]}"
    for name in names[0]:
        first, second = folders[0] / name, folders[1] / name
        if first.read_bytes() == second.read_bytes():
            continue
        found, apart, why = tables(first, second) if name.endswith(".csv") else \
            beside.differences(first.read_bytes(), second.read_bytes(), False, True)
        exact, count, worst = exact and apart == 0 and not why, count + found, max(worst, apart)
        if why:
            return False, f"{name}: {why}"
    return True, "equal" if exact else f"{count} numbers, largest difference {worst:.1e}{reason and '; ' + reason}"


def sizes(folder):
    rows = []
    for name in ("kempe_module.wasm", "kempe_module.js", "kempe.mjs", "kempe_page.js"):
        content = (folder / name).read_bytes()
        rows.append(f"{name:20}{len(content) / 1e6:8.3f} MB{len(gzip.compress(content, 9)) / 1e6:8.3f} MB by gzip -9")
    return "\n".join(rows)


def jobs_of_node(jobs, folder, top):
    """Runs the jobs by wasm_jobs.mjs, which writes their files, and returns its answers."""
    (top / "jobs").write_text(json.dumps(jobs))
    done = subprocess.run(["node", HERE / "wasm_jobs.mjs", folder, top / "jobs"], capture_output=True, timeout=3000, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr.decode())
    return json.loads(done.stdout)


# In a page: `answer` waits for Kempe; job(words, files) runs a command with files in base64, and gives back those that it writes.
JOBS = """<!doctype html><meta charset="utf-8"><title>Kempe</title><script src="{script}"></script><script>
const began = performance.now(), kempe = Kempe.start(), answer = kempe.then(() => (performance.now() - began) / 1000);
const toBytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const toText = (bytes) => {{
    let text = "";
    for (const byte of bytes) text += String.fromCharCode(byte);
    return btoa(text);
}};
const mapped = (object, f) => Object.fromEntries(Object.entries(object).map(([name, value]) => [name, f(value)]));
async function job(words, files) {{
    const began = performance.now(), {{ files: written, ...outcome }} = await (await kempe).command(words, {{ files: mapped(files, toBytes) }});
    return {{ ...outcome, seconds: (performance.now() - began) / 1000, written: mapped(written, toText) }};
}}
</script>"""


def jobs_of_chromium(jobs, folder, top):
    """Does the same in a page of one script."""
    page, done = top / "jobs.html", []
    page.write_text(JOBS.format(script=(folder / "kempe_page.js").as_uri()))
    chromium = opened(page)
    started = evaluated(chromium, "answer")
    for job in jobs:
        files = {name: base64.b64encode(pathlib.Path(path).read_bytes()).decode() for name, path in job["files"].items()}
        answer = evaluated(chromium, f"job({json.dumps(job['words'])}, {json.dumps(files)})")
        for name, content in answer["written"].items():
            path = pathlib.Path(job["to"]) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(base64.b64decode(content))
        done.append(answer)
    chromium.end()
    return {"start_s": started, "jobs": done}


def by_all(words, command, folder):
    lines, there = lines_of(words), "Chromium" if "--all-in-chromium" in words else "Node.js"
    with tempfile.TemporaryDirectory() as top:
        top, told, jobs, pairs = pathlib.Path(top), [], [], []
        for k, line in enumerate(lines):
            folders = [top / f"{k}" / side for side in ("native", "wasm")]
            for made in folders:
                made.mkdir(parents=True)
            told.append(native(command, line, folders[0]))
            jobs.append({"words": line.replace("OUT", "/out").split(), "files": files_of(line), "to": str(folders[1])})
            pairs.append(folders)
        answers, wrong, same = (jobs_of_chromium if there == "Chromium" else jobs_of_node)(jobs, folder, top), 0, 0
        print(f"start in {there}: {answers['start_s']:.3f} s\n{sizes(folder)}\n")
        for line, was, answer, folders in zip(lines, told, answers["jobs"], pairs):
            agrees, row = compare(line, was, answer, folders)
            wrong += not agrees
            same += row == "equal"
            name = line.replace("examples/", "").replace(f" {TAPE}", "").replace(" -o OUT/run.csv", "").replace("OUT/", "")
            print(f"{'agrees' if agrees else 'DIFFERS':8}{name:80.80}{was[3]:8.3f} s native{answer['seconds']:8.3f} s  {row}", flush=True)
        print(f"{len(lines) - wrong} of {len(lines)} commands agree in {there}, {same} of them to the last bit")
    return 1 if wrong else 0


def by_calls(folder):
    return subprocess.run(["node", "--test", HERE / "wasm_calls.mjs"], check=False, timeout=600,
                          env={**os.environ, "KEMPE_JAVASCRIPT_FOLDER": str(folder)}).returncode


# A model without motion of its own that the page reads, and its own answer to an error in it.
PAGE = """<!doctype html><meta charset="utf-8"><title>Kempe</title><script>const script = performance.now();</script>
<script src="{script}"></script><script>
const read = performance.now(), answer = (async () => {{
    const began = performance.now(), kempe = await Kempe.start();
    const version = await kempe.version(), started = performance.now();
    const run = await kempe.simulate({model}, {{tEnd: 1, noConvergenceCheck: true, backend: "tape", integrator: "dop853"}});
    const ran = performance.now(), marks = performance.getEntriesByType("mark").map((mark) => [mark.name.replace("kempe: ", ""), mark.startTime]);
    const error = await kempe.check({model}.replace("bodies:", "bodis:")).catch((error) => error);
    const control = new AbortController();
    const cancelled = kempe.simulate({model}, {{tEnd: 1e6, outputStep: 1e5, noConvergenceCheck: true}},
        {{signal: control.signal, onProgress: () => control.abort()}}).catch((error) => error.name);
    return {{version, start_s: (started - began) / 1000, run_s: (ran - started) / 1000, names: run.table.names,
        last: run.table.columns.map((column) => String(column[column.length - 1])), rows: run.table.rowCount,
        error: error.message, line: error.line, column: error.column, cancelled: await cancelled,
        marks: [["script", script], ["read", read], ...marks, ["first command", started], ["first motion", ran]]}};
}})();
</script>"""


def opened(page):
    """Begins a Chromium with the page, a file."""
    chromium = browser.Chromium()
    chromium.call("Page.navigate", chromium.tab, url=page.as_uri())
    chromium.wait("Page.loadEventFired")
    return chromium


def evaluated(chromium, expression):
    told = chromium.call("Runtime.evaluate", chromium.tab, expression=expression, awaitPromise=True, returnByValue=True)
    if "exceptionDetails" in told:
        raise RuntimeError(told["exceptionDetails"])
    return told["result"].get("value")


def page_answer(folder, top):
    """Returns the answer of the page in a new Chromium."""
    model = (ROOT / X.format("four_bar")).read_text()
    page = pathlib.Path(top) / "page.html"
    page.write_text(PAGE.format(script=(folder / "kempe_page.js").as_uri(), model=json.dumps(model).replace("</", "<\\/")))
    chromium = opened(page)
    answer = evaluated(chromium, "answer")
    chromium.end()
    return answer


# Models, the ends of their runs, and their integrators.
SPEEDS = (("four_bar", 5, "dop853"), ("stewart", 1, "dop853"), ("jansen_walker", 1, "dop853"), ("andrews", 0.1, "radau"))
PART = 50  # of a run: what takes its time, too, is not integration


def spent_by_chromium(chromium, job, times):
    """The processor time of the whole browser for some runs of a job, s. Its clock has steps of 10 ms."""
    def spent():
        return sum(process["cpuTime"] for process in chromium.call("SystemInfo.getProcessInfo")["processInfo"])
    files = {name: base64.b64encode(pathlib.Path(path).read_bytes()).decode() for name, path in job["files"].items()}
    before = spent()
    evaluated(chromium, f"(async () => {{ for (let k = 0; k < {times}; k++) await job({json.dumps(job['words'])}, {json.dumps(files)}); }})()")
    return spent() - before


def spent_natively(command, words, backend, times):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for _ in range(times):
        subprocess.run([command, *words, "--backend", backend], check=True, capture_output=True, cwd=ROOT, env={**os.environ, "KEMPE_CACHE": "off", "OPENBLAS_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def by_speed(command, folder, rounds=4, times=10):
    """Prints processor times of integration: runs less their first parts, in turn natively, in Chromium and in Node.js. A busy machine makes
    processor times longer, too, but those of one round alike: the ratios are medians of the rounds' ratios."""
    print(f"integration, ms of the processor, medians of {rounds} rounds of {times} runs less those over 1/{PART} of the time; times: of the native tape")
    print(f"{'':28}{'Chromium':>10}{'times':>7}{'(least, most)':>15}{'Node.js':>10}{'times':>7}{'(least, most)':>15}{'native tape':>13}{'machine code':>14}")
    with tempfile.TemporaryDirectory() as top:
        page = pathlib.Path(top) / "jobs.html"
        page.write_text(JOBS.format(script=(folder / "kempe_page.js").as_uri()))
        chromium = opened(page)
        evaluated(chromium, "answer")
        for name, end, integrator in SPEEDS:
            line = f"simulate {X.format(name)} --no-convergence-check --integrator {integrator} --t-end "
            whole, part = ({"words": f"{line}{until}".split(), "files": files_of(line), "to": top} for until in (end, end / PART))
            spent_by_chromium(chromium, whole, times)  # its code is compiled by its better compiler meanwhile
            taken = []
            for _ in range(rounds):
                node = [job["processor_s"] for job in jobs_of_node([whole] * times + [part, whole] * times, folder, pathlib.Path(top))["jobs"][times:]]
                sides = [spent_by_chromium(chromium, whole, times) - spent_by_chromium(chromium, part, times), sum(node[1::2]) - sum(node[::2])]
                sides += [spent_natively(command, whole["words"], backend, times) - spent_natively(command, part["words"], backend, times) for backend in ("tape", "native")]
                taken.append([1000 * side / times / (1 - 1 / PART) for side in sides])
            columns = [statistics.median(side) for side in zip(*taken)]
            ratios = [sorted(row[side] / row[2] for row in taken) for side in (0, 1)]
            told = [f"{columns[side]:10.1f}{statistics.median(ratios[side]):7.1f}{f'({ratios[side][0]:.1f}, {ratios[side][-1]:.1f})':>15}" for side in (0, 1)]
            print(f"{f'{name}, {end} s, {integrator}':28}{''.join(told)}{columns[2]:13.1f}{columns[3]:14.1f}", flush=True)
        chromium.end()
    return 0


STARTED = (("script", "the page is opened"), ("read", "kempe_page.js is read"), ("parts", "its base64 is decoded"),
           ("compiled", "it is decompressed and compiled"), ("ready", "its worker waits for commands"), ("first command", "the first command, --version"),
           ("first motion", "the first motion, four_bar over 1 s"))


def by_start(folder, times=9):
    """Prints what the start of the page takes: medians over several Chromiums of the time from its opening on."""
    with tempfile.TemporaryDirectory() as top:
        runs = [dict(page_answer(folder, top)["marks"]) for _ in range(times)]
    print(f"kempe_page.js in headless Chromium, opened as a file {times} times: median (least, most) from its opening on, ms")
    for name, what in STARTED:
        values = sorted(run[name] for run in runs)
        print(f"{what:40}{statistics.median(values):8.0f}  ({values[0]:.0f}, {values[-1]:.0f})")
    return 0


def by_chromium(command, folder):
    with tempfile.TemporaryDirectory() as top:
        answer = page_answer(folder, top)
        table = pathlib.Path(top) / "run.csv"
        subprocess.run([command, "simulate", ROOT / X.format("four_bar"), "--t-end", "1", *TAPE.split(), "--integrator", "dop853", "-o", table],
                       check=True, capture_output=True)
        rows = list(csv.reader(table.read_text().splitlines()))
    wrong = [name for name, there, here in zip(rows[0], answer["last"], rows[-1]) if float(there) != float(here)]
    checks = {
        "columns": rows[0] == answer["names"] and len(rows) == answer["rows"] + 1,
        "numbers": not wrong,
        "error": answer["line"] > 0 and answer["column"] > 0 and "bodis" in answer["error"],
        "cancel": answer["cancelled"] == "AbortError",
    }
    print(f"Chromium: {answer['version']} started in {answer['start_s']:.3f} s, {X.format('four_bar')} over 1 s in {answer['run_s']:.3f} s; {checks} {wrong}")
    print(answer["error"])
    return 0 if all(checks.values()) else 1


def main(words):
    command, folder = (os.path.abspath(word) for word in words if not word.startswith("--"))
    folder = pathlib.Path(folder)
    if not shutil.which("node") or not (folder / "kempe_module.wasm").exists():
        print(f"skipped: {'Node.js is missing' if not shutil.which('node') else str(folder) + ' is missing: packaging/build_wasm makes it'}")
        return 77
    in_chromium = {"--chromium": lambda: by_chromium(command, folder), "--all-in-chromium": lambda: by_all(words, command, folder),
                   "--start": lambda: by_start(folder), "--speed": lambda: by_speed(command, folder)}
    asked = next((run for word, run in in_chromium.items() if word in words), None)
    if asked and not browser.CHROMIUM:
        print("skipped: Chromium is missing")
        return 77
    return asked() if asked else by_all(words, command, folder) or ("--some" in words and by_calls(folder)) or 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
