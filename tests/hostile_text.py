#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Text of a model in everything that Kempe writes: a name with all printable characters, and with words that end strings,
comments, scripts and sections, format characters and a trigraph. All files are compiled or parsed, and the name is in
them unchanged. Characters that no name may have are refused, and no message or file has them.

    python3 tests/hostile_text.py build/dev/kempe
"""
import csv
import html.parser
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile

from generate.quick_cc import quick_compiler

NAME = ("".join(map(chr, range(0x21, 0x7f))) + ' é ??/" ??/\' */ // /* %n%s%d $(name) ${x} `id` </script><b> <!-- --> ]]> &amp; '
        '\\n \\" "; int hostile; // {{x}} ../../x')
UNFIT = [*range(1, 0x20), 0x7f, 0x80, 0x9b, 0x9f, 0x2028, 0x2029, *range(0x202a, 0x202f), *range(0x2066, 0x206a), 0xfeff, 0xfffe, 0xffff]
MODEL = """kempe: 1
name: {name}
parameters: {{k: 20}}
inputs: {{push: {{unit: N*m}}}}
ground: {{points: {{O: [0, 0, 0]}}}}
bodies:
  m: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1, inertia: {{xx: 1, yy: 1, zz: 1}}, points: {{P: [0, 1, 0]}}}}
forces:
  s: {{joint: A, torque: "-k*q(A) + if(q(A) < 0, 0.1*push, 0)"}}
start: {{q: {{A: 0.1}}}}
run: {{t_end: 0.2, output_step: 0.1, outputs: [q, position(m.P), energy]}}
"""
CONTROL = re.compile(f"[{''.join(chr(code) for code in UNFIT if chr(code) not in chr(9) + chr(10))}]")
failures = []
parsed = set()  # scripts; all pages have the same libraries


def check(good, *words):
    if not good:
        failures.append(words)
        print("FAIL", *words)


def is_plain(text):
    return not CONTROL.search(text)


def run(*words, status=(0,), **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, check=False, **more)
    out, err = done.stdout.decode("utf-8", "replace"), done.stderr.decode("utf-8", "replace")
    check(done.returncode in status, words[:3], done.returncode, err[:600])
    check(is_plain(out) and is_plain(err), words[:3], "writes control characters")
    return out, err


class Page(html.parser.HTMLParser):
    """The text of a page outside of scripts, its elements, and its scripts."""

    def __init__(self):
        super().__init__()
        self.text, self.scripts, self.tags = "", [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data):
        if self.tags and self.tags[-1] == "script" and self.lasttag == "script":
            self.scripts[-1] += data
        self.text += data


def page(path):
    parser = Page()
    text = path.read_text(encoding="utf-8")
    parser.feed(text)
    parser.close()
    check(NAME in parser.text or json.dumps(NAME)[1:-1] in text or NAME.split("</script>", maxsplit=1)[0] in parser.text, path.name, "lacks the name")
    check("hostile" not in parser.tags and "b" not in parser.tags, path.name, "has the elements of the name")
    check(text.count("<script") == text.lower().count("</script>") or "<b>" not in text, path.name, "has a script that ends early")
    check(is_plain(text), path.name, "has control characters")
    if shutil.which("node"):
        for k, script in enumerate(s for s in parser.scripts if not s.lstrip().startswith("{") and s not in parsed):
            parsed.add(script)
            file = path.with_suffix(f".{k}.js")
            file.write_text(script, encoding="utf-8")
            run("node", "--check", file)


def numbers_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    check(len(rows) > 1 and all(len(row) == len(rows[0]) for row in rows), path.name, "has rows of other lengths")
    for row in rows[1:]:
        for cell in row:
            float(cell or "nan")


def results(kempe, model, folder):
    measured = folder / "measured.csv"
    measured.write_text("t,q.A\n0,0.1\n0.1,0.09\n0.2,0.06\n")
    for command, more in (("check", []), ("assemble", []), ("assemble", ["--branches"]), ("kinematics", ["--sweep", "A=0:1:0.1"]), ("kinematics", ["--sweep", "A=0:1"]),
                          ("response", ["--inputs", "push", "--outputs", "q(A)"]), ("fit", [measured, "--parameter", "k:10:30"]),
                          ("optimize", ["--minimize", "max(q(A))", "--parameter", "k:10:30", "--starts", "1"]), ("cycles", ["--sweep", "k=10:30:3"]),
                          ("comfort", ["--t-end", "6"]), ("contact", ["--sweep", "A=0:1:3"]), ("compare", []), ("simulate", []), ("show", ["--model"]), ("show", ["--equations"]),
                          ("show", ["--program"]), ("equilibrium", []), ("linearize", []), ("modes", []), ("inverse", ["--actuators", "A"]),
                          ("sensitivity", ["--parameters", "k", "--outputs", "q(A)"]),
                          ("ensemble", ["--sample", "k=19:21", "--instances", "3", "--quantity", "x=q(A)"])):
        status = (0, 1, 2, 3, 5)
        run(kempe, command, model, *more, status=status)
        out, _ = run(kempe, command, model, *more, "--json", "-", status=status)
        check(not out or json.loads(out).get("model") in (NAME, None), command, "has another name in JSON")
    for ending in ("csv", "json", "npz", "mat", "parquet"):
        run(kempe, "simulate", model, "-o", folder / f"rows.{ending}", status=(0, 5))
    numbers_of(folder / "rows.csv")
    json.loads((folder / "rows.json").read_text(encoding="utf-8"))
    run(kempe, "simulate", model, "--plot", folder / "rows.svg", "--report", folder / "run.html", status=(0, 5))
    ElementTree.parse(folder / "rows.svg")
    page(folder / "run.html")
    run(kempe, "compare", model, "--report", folder / "compare.html", status=(0, 1, 5))
    page(folder / "compare.html")
    run(kempe, "modes", model, "--view", folder / "modes.html", status=(0, 1, 3, 5))
    run(kempe, "ensemble", model, "--sample", "k=19:21", "--instances", 3, "--quantity", "x=q(A)", "--out", folder / "parts.kempe",
        status=(0, 5))
    run(kempe, "gather", folder / "parts.kempe", "--report", folder / "many.html")
    json.loads((folder / "parts.kempe" / "manifest.json").read_text(encoding="utf-8"))
    page(folder / "many.html")


def code(kempe, model, folder):
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O0", "-ffp-contract=off"]
    main = ('#include "{0}_simulator.h"\n#include <stdio.h>\nint main(void)\n{{\n    fputs({0}_equations.name, stdout);\n'
            "    return 0;\n}}\n")
    for more in (["--simulator"], ["--keep-parameters"], []):
        into = folder / f"c{len(more and more[0])}"
        run(kempe, "generate", model, "--lang", "c", *more, "-o", into)
        sources = sorted(into.glob("*.c"))
        name = min((file.stem for file in sources if not file.stem.startswith("kempe")), key=len)
        check(re.fullmatch(r"\w+", name), name, "is no identifier")
        check("\\?\\?/" in "".join(f.read_text(encoding="utf-8") for f in sources) or "--simulator" not in more, "a trigraph is left")
        for standard in ("c99", "gnu99"):
            for source in sources:
                if standard == "c99" or not source.stem.startswith("kempe"):  # those have nothing of the model
                    run("cc", f"-std={standard}", *strict, f"-I{into}", "-c", source, "-o", source.with_suffix(f".{standard}.o"))
        if "--simulator" in more:
            (into / "main.c").write_text(main.format(name))
            run("cc", "-std=c99", *strict, f"-I{into}", *into.glob("*.c99.o"), into / "main.c", "-lm", "-o", folder / "told")
            check(run(folder / "told")[0] == NAME, "the simulator has another name")
    for language in ("python", "jax", "casadi", "torch"):
        run(kempe, "generate", model, "--lang", language, "-o", folder / "py")
    for file in (folder / "py").glob("*.py"):
        compile(file.read_text(encoding="utf-8"), str(file), "exec")
    run(kempe, "generate", model, "--lang", "octave", "-o", folder / "m")
    if shutil.which("octave"):
        run("octave", "--norc", "--eval", " ".join(f"x = fileread('{file}'); __parse_file__('{file}');" for file in (folder / "m").glob("*.m")))


def units(kempe, model, folder):
    compiler = quick_compiler(folder)
    for fmi in ("2", "3"):
        file = folder / f"unit{fmi}.fmu"
        run(kempe, "fmu", model, "--fmi", fmi, "-o", file, "--compiler", compiler)
        with zipfile.ZipFile(file) as archive:
            check(archive.testzip() is None, "the unit is damaged")
            for entry in archive.namelist():
                check(not entry.startswith("/") and ".." not in entry, entry, "leads out of the unit")
                if entry.endswith((".xml", ".svg")):
                    root = ElementTree.fromstring(archive.read(entry))
                    if entry == "modelDescription.xml":
                        check(root.get("modelName") == NAME, "the unit has another name")


def models(kempe, model, folder):
    for form in ("urdf+", "sdf", "mjcf"):
        out, _ = run(kempe, "show", model, "--as", form)
        root = ElementTree.fromstring(out)
        names = [e.get("name") or e.get("model") or "" for e in root.iter()]
        check(any("ABCDEFGHIJ" in name and "é" in name for name in names), form, "lacks the name")


def refused(kempe, folder):
    model = folder / "unfit.yaml"
    for code_point in UNFIT:
        for text in (MODEL.replace("{name}", f'"a\\U{code_point:08x}b"'), MODEL.replace("{name}", "x").replace(" m:", f' "m\\U{code_point:08x}":')):
            model.write_text(text.format(), encoding="utf-8")
            _, err = run(kempe, "check", model, status=(2,))
            check(f"U+{code_point:04X}" in err, f"U+{code_point:04X} is not refused", err)
    for bad in (b"\x1b[31m", b"\xc2\x9b31m", b"\xe2\x80\xae", b"\xff"):
        path = folder / (b"f" + bad + b".yaml").decode("utf-8", "surrogateescape")
        path.write_text(MODEL.replace("name: {name}\n", "").format())
        run(kempe, "simulate", path, status=(0, 5))
        run(kempe, "simulate", folder / (path.name + "x"), status=(2,))


def main():
    kempe = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        model = folder / "model.yaml"
        model.write_text(MODEL.format(name=json.dumps(NAME, ensure_ascii=False)), encoding="utf-8")
        for part in (results, code, units, models):
            part(kempe, model, folder)
        refused(kempe, folder)
    print(len(failures), "failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
