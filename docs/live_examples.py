#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the live pages of the examples and of the tutorial, whose mechanisms are simulated while they are read (docs/live_pages.md).

    python3 docs/live_examples.py build/wasm/javascript build/wasm/live       pages for the module in the first folder
    python3 docs/live_examples.py --list                                      the examples, and why some have no live page
    python3 docs/live_examples.py --measure build/wasm/javascript             times of all runs in Node.js

Each page shows at once the run of its model, which the module computed in Node.js while the page was made; `first_runs` beside the
module keeps these runs until the module or the model changes. SHORTER says which runs are too long for a page: they were chosen by --measure. The module of a page
reads the model language only: files of robots are translated by the command, that of KEMPE or of a build.
"""
import base64
import hashlib
import html
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys

import gallery

ROOT = pathlib.Path(__file__).resolve().parents[1]
PARTS = ROOT / "docs/live_pages"
SCENE = "phrases plots solids shapes scene_canvas scene_flexible stage_views animation force_arrows".split()  # of report pages
MOST_SLIDERS = 8
MOST_BYTES = 200_000  # of the files of a model
LONG = "the whole run takes longer than a page should"

SHORTER = {"wheelset": 5, "flexible_car": 0.5, "tram": 2}  # example: end of its run on the page, s

PAGE = """<!doctype html>
<!-- SPDX-License-Identifier: BSD-3-Clause -->
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}, live</title>
<link rel="stylesheet" href="live_page.css">
</head>
<body>
<header><h1>{title}</h1><p>Move the sliders, or edit the model: it is simulated again, in this page. {links}</p></header>
<main>
<section id="answer" data-state="begins"><p id="line" role="status">The picture shows the mechanism; it moves where JavaScript and WebAssembly run.</p><ul id="more"></ul><p id="took"></p></section>
<section id="stage" aria-label="Mechanism">
<div class="view">{still}<div id="moving" hidden><canvas id="view" tabindex="0" role="img" aria-label="the moving mechanism; arrow keys turn it, the space bar plays and pauses"></canvas></div></div>
<div class="times"><button id="play" type="button">Play</button><input id="time" type="range" min="0" max="1000" step="any" value="0" aria-label="time"><output id="clock"></output></div>
<div id="views"></div>
<div id="forces"></div>
<div id="names"></div>
<p id="stage-note" hidden></p>
</section>
<section id="sliders" aria-label="Parameters"></section>
<section id="plots" aria-label="Plots"><div id="curves"></div><button id="add" type="button">Add a plot</button></section>
<section id="model" aria-label="Model">
<div class="bar"><h2>Model</h2><select id="file" aria-label="file of the model"></select><button id="reset" type="button" disabled>Reset</button></div>
<div id="editor"><div id="lines" aria-hidden="true"></div><textarea id="text" spellcheck="false" autocapitalize="off" autocomplete="off" wrap="off" aria-label="text of the model; Control and Enter run it at once" aria-describedby="line">{text}</textarea><div id="over" aria-hidden="true"><div id="marks"></div></div></div>
</section>
</main>
<footer>Computed by Kempe as WebAssembly; nothing leaves this page.</footer>
<script type="application/json" id="data">{data}</script>
<script type="application/json" id="first-run">{run}</script>
<script src="live_scene.js"></script>
<script src="live_page.js"></script>
</body>
</html>
"""


# -- models ----------------------------------------------------------------------------------------------------

def model_of(name):
    """The model of an example: the file with the name of the folder, or the first model on its page."""
    own = ROOT / f"examples/{name}/{name}.yaml"
    if own.exists():
        return own
    return ROOT / re.search(r"([\w/]+\.yaml)", gallery.command((ROOT / f"examples/{name}/README.md").read_text())).group(1)


def parts_of(path, found=None):
    """The files of a model, itself first, as {path: bytes}: the ones that it names and that are there."""
    found = {} if found is None else found
    if path in found:
        return found
    found[path] = path.read_bytes()
    if path.suffix == ".yaml":
        for word in re.findall(r"[\w./-]+\.(?:yaml|urdf|csv|npz|whl|stl|obj|tir|txt|mat|json)\b", re.sub(r"#.*", "", found[path].decode())):
            part = (path.parent / word).resolve()
            if part.is_file() and part.is_relative_to(ROOT):
                parts_of(part, found)
    return found


def command():
    """The command of KEMPE, or of a build; None: there is none."""
    places = [os.environ.get("KEMPE"), *(ROOT / f"build/{build}/kempe" for build in ("release", "dev"))]
    return next((str(place) for place in places if place and pathlib.Path(place).is_file()), None)


def example_files(name):
    """[(name in the page, bytes)] of an example, with paths from the folder that all of them are in. Robots in URDF are translated."""
    parts = parts_of(model_of(name))
    for robot in [path for path in parts if path.suffix == ".urdf"]:
        own = robot.with_name(f"{robot.stem}_urdf.yaml")
        parts = {path: content.replace(robot.name.encode(), own.name.encode()) for path, content in parts.items() if path != robot}
        parts[own] = subprocess.run([command(), "show", robot, "--as", "yaml", "-q"], capture_output=True, check=True).stdout
    return [(path.relative_to(ROOT / "examples").as_posix(), content) for path, content in parts.items()]


def tutorial_files():
    """{page: (title, files)} of the tutorial: the model that `kempe new` writes, and those of the page that include it."""
    lines = re.search(r'^static const char[^=]*=\s*((?:\s*".*"\s*)+);', (ROOT / "src/cli/new.c").read_text(), re.M).group(1)
    start = "".join(json.loads(f'"{line}"') for line in re.findall(r'"((?:[^"\\]|\\.)*)"', lines))
    found = {"tutorial_four_bar": ("The four-bar of the tutorial", [("four_bar.yaml", start.encode())])}
    for name, block in re.findall(r"`(\w+)\.yaml`:\n\n```yaml\n(.*?)```", (ROOT / "docs/tutorial.md").read_text(), re.S):
        found[f"tutorial_{name}"] = (f"The tutorial's {name}.yaml", [(f"{name}.yaml", block.encode()), ("four_bar.yaml", start.encode())])
    return found


# -- sliders ---------------------------------------------------------------------------------------------------

SECTION = re.compile(r"^parameters:.*?(?=\n[A-Za-z]|\Z)", re.M | re.S)
NUMBER = re.compile(r"(?:^|[{,\s])([A-Za-z]\w*):[ \t]*(-?[0-9.]+(?:[eE][-+]?[0-9]+)?)[ \t]*([^,}#\n]*)", re.M)
UNIT = re.compile(r"(%|[A-Za-z][A-Za-z0-9^/* ]*)?$")


def sliders(text):
    """Sliders of the parameters that are numbers, in the unit of the text: from a half to three halves, or a turn for an angle of 0."""
    section = SECTION.search(text)
    made = []
    for name, words, rest in NUMBER.findall(re.sub(r"#.*", "", section.group()) if section else ""):
        unit, value = rest.strip().strip('"'), float(words)
        if not UNIT.match(unit) or name in (slider["name"] for slider in made):
            continue
        turn = {"deg": 180, "rad": 3.14}.get(unit)
        low, high = sorted((0.5 * value, 1.5 * value)) if value else (-turn if turn else -1, turn or 1)
        step = 10.0 ** (math.floor(math.log10(high - low)) - 2)
        made.append({"name": name, "unit": unit, "from": low, "to": high, "step": step})
    return made[:MOST_SLIDERS]


# -- pages -----------------------------------------------------------------------------------------------------

def in_script(words):
    """JSON as the text of a script: nothing in it ends the script."""
    return words.replace("<", "\\u003c")


def data_of(files, end):
    def entry(name, content):
        if re.search(r"\.(npz|mat)$", name):
            return {"name": name, "bytes": base64.b64encode(content).decode()}
        return {"name": name, "text": content.decode()}
    live = {"files": [entry(*file) for file in files], "sliders": sliders(files[0][1].decode()), "end": end, "reason": LONG}
    return in_script(json.dumps({"command": "simulate", "separate": False, "live": live}, ensure_ascii=False))


def page_of(title, files, still, links, end=None, run="null"):
    """The page of a model; `run`: what first_runs.mjs has written of its run."""
    picture = f'<img id="still" src="{html.escape(still[0])}" alt="{html.escape(still[1])}">' if still else '<div id="still"></div>'
    return PAGE.format(title=html.escape(title), links=links, still=picture, text=html.escape(files[0][1].decode()), data=data_of(files, end), run=in_script(run))


def example_page(name, to_docs, run):
    readme = (ROOT / f"examples/{name}/README.md").read_text()
    title, = re.match(r"# ([^\n]*)", readme).groups()
    words, picture = re.search(r"!\[(.*?)\]\((.*?)\)", readme).groups()
    links = f'<a href="../examples/{name}/README.html">About the example</a>' if to_docs else ""
    still = f"pictures/{name}{pathlib.Path(picture).suffix}"
    return page_of(re.sub(r"[*`$]", "", title), example_files(name), (still, words), links, SHORTER.get(name), run), still, ROOT / f"examples/{name}/{picture}"


def colours():
    """[(light, dark)] of the curves and bodies, as strings of JavaScript."""
    return re.findall(r'KMP_PLOT_COLOUR\(("#\w+"), ("#\w+")\)', (ROOT / "src/output/plot_colours.def").read_text())


def scene():
    """The scripts of report pages that draw a mechanism; lines for flexible bodies are for pictures that have them."""
    pairs = ", ".join(f"[{light}, {dark}]" for light, dark in colours())
    texts = [(ROOT / f"src/report/web/{name}.js").read_text().replace("/*COLOURS*/", pairs).replace("/*FLEXIBLE*/ ", "if (isFlexible) ") for name in SCENE]
    return "// SPDX-License-Identifier: BSD-3-Clause\n// The picture of report pages, made from src/report/web by docs/live_examples.py.\nlet isFlexible = false;\n" + "\n".join(texts)


def without_comments(script):
    """A script without the comments that have lines of their own, but for its first lines, which say what it is."""
    head, body = re.match(r"((?://[^\n]*\n)*)(.*)", script, re.S).groups()
    return head + re.sub(r"^ *(?://[^\n]*|/\*(?:[^*]|\*(?!/))*\*/) *\n", "", body, flags=re.M)


def examples():
    return [name for _, names in gallery.GROUPS for name in names.split()]


def reason_for_none(name):
    if not command() and any(path.suffix == ".urdf" for path in parts_of(model_of(name))):
        return "a robot in a URDF file is translated by the command: build it, or name it by KEMPE"
    size = sum(len(content) for _, content in example_files(name))
    return f"its files have {size // 1000} kB" if size > MOST_BYTES else None


def live_examples():
    return [name for name in examples() if not reason_for_none(name)]


def run_job(module, options, files, kept=lambda name: None):
    """Runs of {name: files} in one process of Node.js, which prints a line for each."""
    job = {"module": str((module / "kempe.mjs").resolve()), "plots": str(PARTS / "plot_choices.js"), "colours": len(colours()), "options": options, "runs": [
        {"name": name, "end": SHORTER.get(name), "to": kept(name),
         "files": {file: base64.b64encode(content).decode() for file, content in own}} for name, own in files.items()]}
    subprocess.run(["node", PARTS / "first_runs.mjs"], input=json.dumps(job), text=True, check=True)


def first_runs(module, files):
    """{name: JSON} of what the pages show at once, each computed once for a module and a model; "null" where the run has failed."""
    maker = hashlib.sha256(b"".join(path.read_bytes() for path in (module / "kempe_module.wasm", PARTS / "first_runs.mjs", PARTS / "plot_choices.js")))
    kept = {}
    for name, own in files.items():
        key = maker.copy()
        key.update(repr((own, SHORTER.get(name))).encode())
        kept[name] = module / f"first_runs/{name}-{key.hexdigest()[:16]}.json"
    (module / "first_runs").mkdir(exist_ok=True)
    missing = {name: own for name, own in files.items() if not kept[name].exists()}
    for name in missing:
        for old in (module / "first_runs").glob(f"{name}-*.json"):
            old.unlink()
    if missing:
        run_job(module, {}, missing, lambda name: str(kept[name].resolve()))
    return {name: path.read_text() if path.exists() else "null" for name, path in kept.items()}


def write(module, out, to_docs=False, names=None):
    """Makes the named pages, or all pages, with the module and the scripts beside them. Returns their names."""
    (out / "pictures").mkdir(parents=True, exist_ok=True)
    shutil.copyfile(PARTS / "live_page.css", out / "live_page.css")
    (out / "live_page.js").write_text(without_comments("".join((PARTS / file).read_text() for file in ("plot_choices.js", "live_page.js"))))
    shutil.copyfile(module / "kempe_page.js", out / "kempe_page.js")
    (out / "live_scene.js").write_text(without_comments(scene()))
    tutorial = {name: made for name, made in tutorial_files().items() if names is None or name in names}
    chosen = [name for name in live_examples() if names is None or name in names]
    runs = first_runs(module, {**{name: example_files(name) for name in chosen}, **{name: files for name, (_, files) in tutorial.items()}})
    for name in chosen:
        text, still, picture = example_page(name, to_docs, runs[name])
        (out / f"{name}.html").write_text(text)
        shutil.copyfile(picture, out / still)
    shutil.copyfile(ROOT / "docs/four_bar.svg", out / "pictures/tutorial.svg")
    for name, (title, files) in tutorial.items():
        links = '<a href="../docs/tutorial.html">Tutorial</a>' if to_docs else ""
        (out / f"{name}.html").write_text(page_of(title, files, ("pictures/tutorial.svg", "the linkage in eight positions"), links, run=runs[name]))
    return [*chosen, *tutorial]


# -- the command -----------------------------------------------------------------------------------------------

def show_list():
    for name in examples():
        reason = reason_for_none(name)
        print(f"{name:24} {f'none: {reason}' if reason else f'live, the first {SHORTER[name]} s' if name in SHORTER else 'live'}")
    print(f"{len(live_examples())} of {len(examples())} examples are live")


def measure(module, names):
    """Of each example in one process of Node.js: the processor time of a page's first run, and its status or its error."""
    run_job(module, {"noConvergenceCheck": True}, {name: example_files(name) for name in names})


def main(arguments):
    if arguments[:1] == ["--list"]:
        show_list()
    elif arguments[:1] == ["--measure"]:
        measure(pathlib.Path(arguments[1]), arguments[2:] or examples())
    elif len(arguments) == 2:
        module, out = map(pathlib.Path, arguments)
        if not (module / "kempe_page.js").exists():
            print(f"{module}/kempe_page.js is not there: packaging/build_wasm makes it")
            return 77
        print(f"{out}: {len(write(module, out))} live pages")
    else:
        print(__doc__)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
