#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The direction of includes between folders, checked. Fails with file:line for every forbidden edge, and with the files
that tie them where folders include each other in a circle.

    python3 tests/includes.py               checks the tree this script stands in
    python3 tests/includes.py --self-test   proves that planted mistakes are found

A layer may include itself and what LAYERS lists for it; quoted names are resolved from the file's own folder,
then from the root, then from src/. Solver headers (SOLVERS) belong to the layers in MAY_SOLVE alone. Only src/platform asks the
preprocessor for a system (SYSTEMS); others may ask for a processor, as __x86_64__ or __wasm__. At most so many sources as CROWDS says
include a header, directly or over others: each change of it compiles them all.
"""
import collections
import pathlib
import re
import sys
import tempfile

# layer: the layers it may see, besides itself and the public header
LAYERS = {
    "base": "",
    "linalg": "base tolerances",
    "symbolic": "base linalg",
    "model": "base linalg symbolic tolerances",
    "roles": "",
    "fmi": "",
    "kinematics": "base linalg symbolic model roles tolerances",
    "kinds": "base linalg symbolic model roles kinematics",
    "dynamics": "base linalg symbolic model roles kinematics kinds",
    "backend": "base linalg symbolic model roles kinematics kinds dynamics",
    "tolerances": "",
    "decide": "base linalg tolerances roles",
    "constraints": "base linalg symbolic model roles kinematics kinds dynamics backend decide tolerances",
    "integrators": "base linalg symbolic model roles kinematics kinds dynamics backend decide tolerances constraints",
    "cli": "",
    "examples": "",
    "api": "check",
    "check": "",
}
CORE = "base linalg symbolic model roles kinematics kinds dynamics backend decide tolerances constraints integrators output"
LAYERS["output"] = CORE
LAYERS["studies/assembly"] = CORE
LAYERS["studies/simulate"] = f"{CORE} studies/assembly"
LAYERS["studies/compare"] = f"{CORE} studies/assembly studies/simulate"
LAYERS["studies/show"] = CORE
LAYERS["pipeline"] = f"{CORE} studies/assembly studies/simulate studies/compare studies/show"
# The wings: what they see of each other; the core sees none of them.
WINGS = {"analyses": "", "rail": "analyses", "road": "", "exchange": "", "ensemble": "analyses", "picture": "analyses", "report": "analyses rail ensemble picture", "language_server": "", "workbench": "language_server"}
ANALYSES = {  # an analysis: the others that it uses, beside "dense" and "parts"
    "dense": "",
    "parts": "",
    "derivatives": "",
    "equilibrium": "derivatives",
    "kinematics": "derivatives",
    "inverse": "derivatives",
    "linearize": "derivatives equilibrium",
    "response": "derivatives linearize",
    "modes": "derivatives equilibrium",
    "sensitivity": "derivatives equilibrium modes",
    "limit_cycles": "derivatives equilibrium modes sensitivity",
    "comfort": "",
}
WHOLE_CORE = f"{LAYERS['pipeline']} pipeline"
for name, others in ANALYSES.items():
    shared = [] if name in ("dense", "parts") else ["dense", "parts"]
    LAYERS[f"analyses/{name}"] = " ".join([WHOLE_CORE, *(f"analyses/{other}" for other in [*shared, *others.split()])])
for wing, others in WINGS.items():
    seen = [f"analyses/{name}" for name in ANALYSES] if "analyses" in (wing, *others.split()) else []
    LAYERS[wing] = " ".join([WHOLE_CORE, others, *seen])
LAYERS["exchange"] += " fmi"
LAYERS["platform"] = ""
for name, seen in LAYERS.items():
    if name == "cli" or "base" in seen.split() or name == "base":
        LAYERS[name] = f"{seen} platform".strip()
FOLDERS = [  # first match wins
    ("third_party/fmi/", "fmi"),
    ("src/pipeline.", "pipeline"),
    ("src/browser/", "cli"),
    ("src/dynamics/kinematics/friction_roles.h", "roles"),
    ("src/dynamics/kinematics/", "kinematics"),
    ("constraints/kinds/", "kinds"),
    ("constraints/tolerances.h", "tolerances"),
    ("constraints/", "constraints"),
    ("integrators/decide/", "decide"),
    ("integrators/", "integrators"),
    ("examples/", "examples"),
    ("tests/api/", "api"),
    ("tests/testing.h", "check"),
    ("tests/sanitized.h", "check"),
    ("tests/counted_memory.h", "check"),
    ("tests/loaded.h", "check"),
    ("tests/four_bar_text.h", "check"),
    ("tests/elimination.h", "check"),
    *((f"src/{name}/", name) for name in sorted(LAYERS, reverse=True)),
]
PUBLIC_ONLY = {"cli", "examples", "api"}  # see <kempe/...> and the C library
TABLES = {"src/model/data/run_options.def"}  # rows alone: all may see them
MAY_SOLVE = {"linalg", "constraints", "integrators", "ensemble"}
SOLVERS = re.compile(r"^(suitesparse/)?(umfpack|klu|btf|amd|colamd|SuiteSparse_config|cminpack|nlopt)\.h$"
                     r"|^(sundials|ida|idas|kinsol|cvode|cvodes|arkode|nvector|sunmatrix|sunlinsol|sunnonlinsol)/")
SOURCE = {".c", ".h", ".def"}
# header: the most sources that include it, and what is included in its place
CROWDS = {"src/model/data/model.h": (250, "accessors are in the headers of the nouns: body.h, closure.h, force.h, start.h, model_context.h ..")}
SYSTEMS = re.compile(r"^\s*#\s*(?:if|ifdef|ifndef|elif)\b.*\b(_WIN\d\d|_MSC_VER|__MINGW\w*|__CYGWIN__|__APPLE__|__MACH__|__linux(?:__)?|__unix(?:__)?"
                     r"|__ANDROID__|__\w*BSD__|__EMSCRIPTEN__|__GLIBC\w*)\b")
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"([^"]+)"|<([^>]+)>)')


def layer_of(path):
    return next((layer for prefix, layer in FOLDERS if path.startswith(prefix)), None)


def resolve(root, path, name):
    """The included file relative to the root, None when it is not in the tree."""
    for folder in (path.parent, root, root / "src", root / "tests", root / "third_party/fmi"):
        found = (folder / name).resolve()
        if found.is_file() and found.is_relative_to(root):
            return found.relative_to(root).as_posix()
    return None


def judge_quoted(root, path, layer, name):
    target = resolve(root, path, name)
    if target in TABLES:
        return None
    if target is None:
        if SOLVERS.match(name) or name.startswith("kempe/"):
            return f'write <{name}>: quotes are for our own files'
        return f'"{name}" is not in the tree'
    seen = layer_of(target)
    if seen is None:
        return f'"{name}" belongs to no layer'
    if seen != layer and seen not in LAYERS[layer].split():
        return f'{layer} must not see {seen} ("{name}")'
    return None


def judge_angled(root, layer, name):
    if SOLVERS.match(name) and layer not in MAY_SOLVE and not (layer == "examples" and name == "nlopt.h"):
        return f"solver header <{name}> in {layer}"
    if layer != {"yaml.h": "model", "expat.h": "exchange", "microhttpd.h": "workbench"}.get(name, layer):
        return f"<{name}> belongs to one layer alone, not to {layer}"
    if not name.startswith("kempe/") and any((root / top / name).is_file() for top in ("", "src")):
        return f'write "{name}": angle brackets hide an include of our own'
    return None


def check_file(root, path):
    layer = layer_of(path.relative_to(root).as_posix())
    if layer is None:
        return [f"{path.relative_to(root)}:1: this folder belongs to no layer: see tests/includes.py"]
    problems = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        quoted, angled = match.groups()
        problem = judge_quoted(root, path, layer, quoted) if quoted else judge_angled(root, layer, angled)
        if problem:
            problems.append(f"{path.relative_to(root)}:{number}: {problem}")
    return problems


def sources(root):
    for top in ("src", "constraints", "integrators", "examples", "tests/api"):
        yield from sorted(p for p in (root / top).rglob("*") if p.suffix in SOURCE)


def systems(root):
    """One sentence for each directive outside src/platform that asks for a system."""
    return [f"{path.relative_to(root)}:{number}: asks for {match.group(1)}: src/platform has the differences of systems"
            for top in ("include", "src", "constraints", "integrators") for path in sorted((root / top).rglob("*"))
            if path.suffix in SOURCE and "platform" not in path.relative_to(root).parts[:2]
            for number, line in enumerate(path.read_text().splitlines(), 1) if (match := SYSTEMS.match(line))]


def folder_edges(root, files):
    """{folder: {folder that it includes: the first include that says so}}, of the library alone."""
    edges = {}
    for path in files:
        name = path.relative_to(root).as_posix()
        if not name.startswith(("src/", "constraints/", "integrators/")):
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = INCLUDE.match(line)
            target = resolve(root, path, match.group(1)) if match and match.group(1) else None
            here, there = name.rpartition("/")[0], (target or name).rpartition("/")[0]
            if here != there:
                edges.setdefault(here, {}).setdefault(there, f"{name}:{number}")
    return edges


def circles(edges):
    """One sentence for each folder that includes, over others, a folder that includes it."""
    found = []
    for start in sorted(edges):
        before, row = {start: None}, [start]
        for folder in row:
            for other in sorted(edges.get(folder, {})):
                if other == start:
                    way = [folder]
                    while before[way[-1]]:
                        way.append(before[way[-1]])
                    way = way[::-1] + [start]
                    if start == min(way):
                        steps = "; ".join(f"{b} at {edges[a][b]}" for a, b in zip(way, way[1:]))
                        found.append(f"{edges[start][way[1]]}: a circle of folders: {start} includes {steps}")
                    row.clear()
                    break
                if other not in before:
                    before[other] = folder
                    row.append(other)
            else:
                continue
            break
    return found


def crowded(root, bounds):
    """One sentence for each header that more sources include, directly or over other files, than `bounds` allows."""
    includers = collections.defaultdict(set)
    for top in ("include", "src", "constraints", "integrators", "bench", "python", "examples", "tests"):
        for path in (root / top).rglob("*"):
            if path.suffix in SOURCE:
                for match in filter(None, map(INCLUDE.match, path.read_text().splitlines())):
                    target = resolve(root, path, match.group(1)) if match.group(1) else None
                    includers[target].add(path.relative_to(root).as_posix())
    found = []
    for header, (most, instead) in bounds.items():
        reached, row = {header}, [header]
        for name in row:
            row += sorted(includers[name] - reached)
            reached |= includers[name]
        count = sum(name.endswith(".c") for name in reached)
        if count > most:
            found.append(f"{header}:1: {count} sources include it, directly or over others, and at most {most} may: {instead}")
    return found


def check(root):
    root = root.resolve()
    files = list(sources(root))
    problems = [problem for path in files for problem in check_file(root, path)]
    return len(files), problems + circles(folder_edges(root, files)) + systems(root) + crowded(root, CROWDS)


PLANTED = [  # file, its include, whether it is allowed
    ("src/symbolic/graph.c", '"base/arena.h"', True),
    ("src/symbolic/graph.c", '"model/data/model.h"', False),
    ("src/symbolic/graph.c", '"dynamics/kinematics/link_tree.h"', False),
    ("src/base/arena.c", '"symbolic/graph.h"', False),
    ("constraints/kinds/ball.c", '"dynamics/kinematics/link_tree.h"', True),
    ("constraints/kinds/ball.c", '"dynamics/system.h"', False),
    ("src/dynamics/system.c", '"kinematics/link_tree.h"', True),
    ("src/dynamics/system.c", '<ida/ida.h>', False),
    ("src/dynamics/outputs.c", '"rail/wheel/patch.h"', False),
    ("src/studies/simulate/trajectory.c", '"rail/wheel/patch.h"', False),
    ("src/rail/wheel/patch.c", '"dynamics/system.h"', True),
    ("src/rail/wheel/patch.c", '"report/page.h"', False),
    ("src/backend/tape.c", '<umfpack.h>', False),
    ("integrators/sundials/ida.c", '<ida/ida.h>', True),
    ("integrators/decide/closing.h", '"model/data/model.h"', False),
    ("constraints/closing/close.c", '"integrators/run/run.h"', False),
    ("src/model/read/reader.c", '<yaml.h>', True),
    ("src/analyses/modes/modes_study.c", '<yaml.h>', False),
    ("src/exchange/formats/xml.c", '<expat.h>', True),
    ("src/analyses/modes/modes_study.c", '<expat.h>', False),
    ("src/analyses/modes/modes_study.c", '"integrators/run/run.h"', True),
    ("src/analyses/modes/modes_study.c", '"output/json.h"', True),
    ("src/analyses/modes/modes_study.c", '"pipeline.h"', True),
    ("src/studies/compare/compare_study.c", '"pipeline.h"', False),
    ("src/analyses/modes/modes_study.c", '"analyses/limit_cycles/limit_cycles_study.h"', False),
    ("src/output/print.c", '"studies/compare/compare_study.h"', False),
    ("src/cli/commands.c", '<kempe/modes.h>', True),
    ("src/cli/commands.c", '"output/json.h"', False),
    ("src/cli/main.c", '"command.h"', True),
    ("src/cli/main.c", '<kempe/kempe.h>', True),
    ("src/cli/main.c", '"base/arena.h"', False),
    ("src/cli/main.c", '<base/arena.h>', False),
    ("examples/andrews/example_andrews.c", '"model/data/model.h"', False),
    ("tests/api/test_api.c", '"testing.h"', True),
    ("tests/api/test_api.c", '"base/arena.h"', False),
]
PLANTED_HEADERS = ("src/base/arena.h src/symbolic/graph.h src/model/data/model.h src/dynamics/kinematics/link_tree.h "
                   "src/dynamics/system.h integrators/run/run.h src/output/json.h src/studies/compare/compare_study.h "
                   "src/rail/wheel/patch.h src/report/page.h src/pipeline.h src/analyses/limit_cycles/limit_cycles_study.h "
                   "src/cli/command.h tests/testing.h").split()


def self_test():
    wrong = 0
    for name, include, allowed in PLANTED:
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for header in PLANTED_HEADERS:
                (root / header).parent.mkdir(parents=True, exist_ok=True)
                (root / header).touch()
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(f"/* planted */\n#include {include}\n")
            problems = check(root)[1]
        if allowed != (problems == []) or not all(p.startswith(f"{name}:2: ") for p in problems):
            wrong += 1
            print(f"self-test: {name} including {include} should be {'allowed' if allowed else 'found'}: {problems}")
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder).resolve()
        for name, text in (("src/model/data/a.h", '#include "model/read/b.h"'), ("src/model/read/b.h", '#include "model/files/c.h"'),
                           ("src/model/files/c.h", '#include "model/data/a.h"')):
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text + "\n")
        if len(check(root)[1]) != 1:
            wrong += 1
            print(f"self-test: a circle of three folders should be found once: {check(root)[1]}")
    for name, directive, allowed in (("src/base/a.c", "#ifdef _WIN32", False), ("include/kempe/a.h", "#if defined(__APPLE__)", False),
                                     ("constraints/a.c", "  # elif X && __linux__", False), ("src/platform/a.c", "#ifdef _WIN32", True),
                                     ("src/base/a.c", "#if defined(__x86_64__)", True), ("src/base/a.c", "/* #ifdef _WIN32 */", True)):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True)
            path.write_text(directive + "\n")
            if allowed != (systems(pathlib.Path(folder)) == []):
                wrong += 1
                print(f"self-test: {directive} in {name} should be {'allowed' if allowed else 'found'}")
    for most, found in ((2, 0), (1, 1)):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder).resolve()
            for name, text in (("src/model/data/a.h", ""), ("src/model/data/b.h", '#include "model/data/a.h"'), ("tests/unit/c.c", '#include "model/data/b.h"'),
                               ("bench/d.c", '#include "model/data/a.h"'), ("src/model/e.c", "")):
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text + "\n")
            sentences = crowded(root, {"src/model/data/a.h": (most, "")})
        if len(sentences) != found:
            wrong += 1
            print(f"self-test: two sources include a header, {most} may: {sentences}")
    print(f"self-test: {len(PLANTED) - wrong} of {len(PLANTED)} planted includes judged rightly")
    return wrong


def main(arguments):
    if arguments == ["--self-test"]:
        return 1 if self_test() else 0
    count, problems = check(pathlib.Path(__file__).resolve().parent.parent)
    print("\n".join(problems) if problems else f"{count} files, every include points the right way")
    return 1 if problems or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
