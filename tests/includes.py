#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The direction of includes between folders, checked. Fails with file:line for every forbidden edge.

    python3 tests/includes.py               checks the tree this script stands in
    python3 tests/includes.py --self-test   proves that planted mistakes are found

A layer may include itself and what LAYERS lists for it; quoted names are resolved from the file's own folder,
then from the root, then from src/. Solver headers (SOLVERS) belong to the layers in MAY_SOLVE alone.
"""
import pathlib
import re
import sys
import tempfile

# layer: the layers it may see, besides itself and the public header
LAYERS = {
    "base": "",
    "linalg": "base",
    "symbolic": "base linalg",
    "model": "base linalg symbolic",
    "kinematics": "base linalg symbolic model",
    "contact": "base",
    "wheel": "base linalg symbolic model kinematics contact",
    "kinds": "base linalg symbolic model kinematics wheel",
    "dynamics": "base linalg symbolic model kinematics wheel kinds",
    "backend": "base linalg symbolic model kinematics kinds dynamics",
    "constraints": "base linalg symbolic model kinematics kinds dynamics backend",
    "integrators": "base linalg symbolic model kinematics kinds dynamics backend constraints",
    "cli": "",
    "examples": "",
    "api": "check",
    "check": "",
}
CORE = "base linalg symbolic model kinematics kinds dynamics backend constraints integrators"
STUDIES = {  # a study: the others that it uses
    "assembly": "",
    "simulate": "equilibrium",
    "equilibrium": "",
    "kinematics": "simulate",
    "inverse": "",
    "linearize": "simulate equilibrium",
    "response": "linearize",
    "modes": "assembly equilibrium",
    "sensitivity": "simulate equilibrium modes",
    "limit_cycles": "simulate equilibrium modes sensitivity",
    "ensemble": "simulate",
    "fit": "simulate sensitivity ensemble",
    "optimize": "simulate sensitivity ensemble fit",
    "compare": "",
    "comfort": "simulate",
    "wheel_contact": "equilibrium",
}
LAYERS["output"] = CORE
LAYERS["derivatives"] = CORE
for study, others in STUDIES.items():
    LAYERS[f"studies/{study}"] = " ".join([CORE, "output derivatives contact", *(f"studies/{name}" for name in others.split())])
LAYERS["studies/wheel_contact"] += " wheel"
LAYERS["report"] = " ".join([CORE, "output", *(f"studies/{study}" for study in STUDIES)])
LAYERS["generate"] = f"{CORE} output"
LAYERS["unit"] = f"{CORE} output generate studies/simulate"
FOLDERS = [  # first match wins
    ("src/dynamics/kinematics/", "kinematics"),
    ("constraints/kinds/", "kinds"),
    ("constraints/", "constraints"),
    ("integrators/", "integrators"),
    ("examples/", "examples"),
    ("tests/api/", "api"),
    ("tests/testing.h", "check"),
    ("tests/counted_memory.h", "check"),
    ("tests/loaded.h", "check"),
    ("tests/four_bar_text.h", "check"),
    ("tests/elimination.h", "check"),
    *((f"src/{name}/", name) for name in sorted(LAYERS)),
]
PUBLIC_ONLY = {"cli", "examples", "api"}  # see <kempe/...> and the C library
MAY_SOLVE = {"linalg", "constraints", "integrators"}
SOLVERS = re.compile(r"^(suitesparse/)?(umfpack|klu|btf|amd|colamd|SuiteSparse_config|cminpack|nlopt)\.h$"
                     r"|^(sundials|ida|idas|kinsol|cvode|cvodes|arkode|nvector|sunmatrix|sunlinsol|sunnonlinsol)/")
SOURCE = {".c", ".h", ".def"}
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"([^"]+)"|<([^>]+)>)')


def layer_of(path):
    return next((layer for prefix, layer in FOLDERS if path.startswith(prefix)), None)


def resolve(root, path, name):
    """The included file relative to the root, None when it is not in the tree."""
    for folder in (path.parent, root, root / "src", root / "tests"):
        found = (folder / name).resolve()
        if found.is_file() and found.is_relative_to(root):
            return found.relative_to(root).as_posix()
    return None


def judge_quoted(root, path, layer, name):
    target = resolve(root, path, name)
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
    if name in ("yaml.h", "expat.h") and layer != "model":
        return f"<{name}> belongs to the model reader alone, not to {layer}"
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


def check(root):
    root = root.resolve()
    files = list(sources(root))
    return len(files), [problem for path in files for problem in check_file(root, path)]


PLANTED = [  # file, its include, whether it is allowed
    ("src/symbolic/graph.c", '"base/arena.h"', True),
    ("src/symbolic/graph.c", '"model/model.h"', False),
    ("src/symbolic/graph.c", '"dynamics/kinematics/link_tree.h"', False),
    ("src/base/arena.c", '"symbolic/graph.h"', False),
    ("constraints/kinds/ball.c", '"dynamics/kinematics/link_tree.h"', True),
    ("constraints/kinds/ball.c", '"dynamics/system.h"', False),
    ("src/dynamics/system.c", '"kinematics/link_tree.h"', True),
    ("src/dynamics/system.c", '<ida/ida.h>', False),
    ("src/backend/tape.c", '<umfpack.h>', False),
    ("integrators/sundials/ida.c", '<ida/ida.h>', True),
    ("constraints/closing/close.c", '"integrators/run/run.h"', False),
    ("src/model/read/reader.c", '<yaml.h>', True),
    ("src/analyses/modes/modes_study.c", '<yaml.h>', False),
    ("src/model/files/xml.c", '<expat.h>', True),
    ("src/analyses/modes/modes_study.c", '<expat.h>', False),
    ("src/analyses/modes/modes_study.c", '"integrators/run/run.h"', True),
    ("src/analyses/modes/modes_study.c", '"output/json.h"', True),
    ("src/analyses/modes/modes_study.c", '"studies/compare/compare_study.h"', False),
    ("src/output/print.c", '"studies/compare/compare_study.h"', False),
    ("src/cli/commands.c", '<kempe/modes.h>', True),
    ("src/cli/commands.c", '"output/json.h"', False),
    ("src/cli/main.c", '"command.h"', True),
    ("src/cli/main.c", '<kempe/kempe.h>', True),
    ("src/cli/main.c", '"base/arena.h"', False),
    ("src/cli/main.c", '<base/arena.h>', False),
    ("examples/andrews/example_andrews.c", '"model/model.h"', False),
    ("tests/api/test_api.c", '"testing.h"', True),
    ("tests/api/test_api.c", '"base/arena.h"', False),
]
PLANTED_HEADERS = ("src/base/arena.h src/symbolic/graph.h src/model/data/model.h src/dynamics/kinematics/link_tree.h "
                   "src/dynamics/system.h integrators/run/run.h src/output/json.h src/studies/compare/compare_study.h src/cli/command.h tests/testing.h").split()


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
