#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One name, one thing: files and types have names of their own in the whole tree.

    python3 tests/names.py               checks the tree this script stands in
    python3 tests/names.py --self-test   proves that planted mistakes are found

- Two programs of one stem are files of one folder: X.c, X.h, X.def, X.py, ... Programs are sources in any language and
  commands without an ending. CONVENTIONS lists what each folder calls the same, with the reason.
- Two models of one stem are X.yaml and X.mbs, X.urdf, X.mjcf or X.sdf of one folder. A model is named for its mechanism; programs may be, too.
- No type name `kmp_...` or `kempe_...` is defined twice. Types of one file alone have bare names.
- A public function that returns a whole number is a count, `..._count`, or one of WHOLE.
- A source that a comment of the library names is a file of the tree, or one of MADE.
- No source in a language that `kempe generate` writes stands in the root, where a trial of it would leave one.
"""
import collections
import pathlib
import re
import subprocess
import sys
import tempfile

PROGRAMS = {"", ".c", ".h", ".def", ".cpp", ".hpp", ".py", ".sh", ".js", ".html", ".css"}
MODELS = {".yaml", ".mbs", ".urdf", ".mjcf", ".sdf"}
GENERATED = {".c", ".h", ".cpp", ".m", ".py"}
CONVENTIONS = {
    r"(?:.*/)?run": "the command of a folder that is a set of cases",
    r"(?:check|start)": "the commands of the repository, called from its root",
    r"python/kempe/\w+\.py": "modules of the Python package, which have the names of the headers",
}
CASES = {
    r"tests/malformed/": "a model a mistake, named for the key that is wrong",
    r"tests/fuzz/corpus/": "inputs, named for their digest or for the model that they come from",
    r"\.[\w-]+": "settings of a tool, whose names the tool fixes",
    r"(?:.*/)?LICENSE": "no program",
    r"third_party/": "files of other projects, which have their names",
}
LIBRARY = ("include/", "src/", "constraints/", "integrators/")
MADE = {"kempe_newton.h", "kempe_runtime.h", "wings.c", "crane_simulator.h", "s.c", "s_simulator.c"}  # by builds, and by users
WHOLE = re.compile(r"_count$|_is_\w+$|_dof$|_rank$|_find$")
RETURNS_WHOLE = re.compile(r"^KEMPE_API (?:int|long|size_t) (\w+)\(", re.M)
DEFINED = re.compile(r"^(?:typedef [^;{}()]*?\b|\} )((?:kmp|kempe)_\w+)(?:;|\()", re.M)


def tracked(root):
    """Files of a tree below git; all files of another one but those of builds."""
    if not (root / ".git").exists():
        files = (path.relative_to(root) for path in root.rglob("*") if path.is_file())
        return sorted(path.as_posix() for path in files if not path.parts[0].startswith("build"))
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=root, capture_output=True, text=True, check=True)
    return sorted(name for name in listed.stdout.splitlines() if (root / name).is_file())


def repeated(names, endings):
    """Stems in more than one folder, but for conventions and cases."""
    stems = collections.defaultdict(set)
    for name in names:
        path = pathlib.PurePosixPath(name)
        if path.suffix in endings and not any(re.match(case, name) for case in CASES) \
                and not any(re.fullmatch(convention, name) for convention in CONVENTIONS):
            stems[path.stem].add(path.parent.as_posix())
    for stem, folders in stems.items():
        if len(folders) > 1:
            yield f"{stem}: in {' and '.join(sorted(folders))}"


def check_types(texts):
    places = collections.defaultdict(list)
    for name, text in texts.items():
        for word in DEFINED.findall(text):
            places[word].append(name)
    for word, where in places.items():
        if len(where) > 1:
            yield f"type {word}: in {' and '.join(where)}"


def check_counts(texts):
    for text in texts.values():
        for name in RETURNS_WHOLE.findall(text):
            if not WHOLE.search(name):
                yield f"{name}: a count ends with _count"


def check_named(names, texts):
    """Sources that comments name, which renames leave behind."""
    known = MADE | {name.rpartition("/")[2] for name in names}
    for name, text in texts.items():
        if not name.startswith(LIBRARY):
            continue
        for comment in re.finditer(r"/\*.*?\*/", text, re.S):
            for word in re.findall(r"(?<![\w/<.])(?:\w+/)*[a-z]\w*\.(?:c|h|def)\b(?!\()", comment[0]):
                if word.rpartition("/")[2] not in known and f"<{word}>" not in text:
                    yield f"{name}:{text.count(chr(10), 0, comment.start()) + 1}: a comment names {word}, which is no file"


def check_root(names):
    for name in names:
        if "/" not in name and pathlib.PurePosixPath(name).suffix in GENERATED:
            yield f"{name}: a source in the root, as a trial of `kempe generate` leaves it; remove it, or give it a folder"


def check(root):
    names = tracked(root)
    texts = {name: (root / name).read_text() for name in names if name.endswith((".c", ".h", ".def"))}
    headers = {name: text for name, text in texts.items() if name.startswith("include/")}
    return len(names), [*repeated(names, PROGRAMS), *repeated(names, MODELS), *check_types(texts), *check_counts(headers), *check_named(names, texts),
                        *check_root(names)]


PLANTED = [
    ({"src/base/a.c": "", "src/model/a.h": ""}, True),
    ({"src/base/a.c": "", "src/base/a.h": "", "src/base/a.def": ""}, False),
    ({"src/base/a.c": "/* The inverse of b.c. */\n", "src/base/a.h": ""}, True),
    ({"src/base/a.c": "/* The contract is in base/a.h. */\n", "src/base/a.h": ""}, False),
    ({"src/base/a.c": "", "include/kempe/a.h": ""}, True),
    ({"src/base/a.c": "", "tests/a.py": ""}, True),
    ({"src/base/a.c": "", "bench/a": ""}, True),
    ({"bench/bench_a.c": "", "bench/a": "", "examples/a/a.yaml": "", "examples/a/README.md": ""}, False),
    ({"examples/a/b.yaml": "", "examples/c/b.yaml": ""}, True),
    ({"examples/a/reference.c": "", "examples/b/reference.py": ""}, True),
    ({"bench/peers/run": "", "tests/fuzz/run": ""}, False),
    ({"examples/a/make.py": "", "examples/b/make.py": ""}, True),
    ({"src/base/check.h": "", "check": "", "tests/malformed/b.yaml": "", "tests/models/b.yaml": ""}, False),
    ({"src/base/a.h": "typedef struct kmp_a {\n    int n;\n} kmp_a;\n", "src/base/b.h": "typedef enum kmp_b {\n    A\n} kmp_a;\n"}, True),
    ({"src/base/a.h": "typedef int kmp_a_fn(int n);\ntypedef struct kmp_a kmp_a;\n", "src/base/b.h": "typedef double kmp_a;\n"}, True),
    ({"src/base/a.h": "typedef void kmp_a(int n);\n", "src/base/b.h": "typedef struct kmp_a {\n    int n;\n} kmp_a;\n"}, True),
    ({"include/kempe/a.h": "KEMPE_API int kempe_a_rows(const kempe_a *a);\n"}, True),
    ({"include/kempe/a.h": "KEMPE_API int kempe_a_row_count(const kempe_a *a);\nKEMPE_API int kempe_a_is_ok(void);\n"}, False),
    ({"equations.c": "", "src/base/a.c": ""}, True),
    ({"start": "", "README.md": "", "src/base/a.c": ""}, False),
]


def self_test():
    wrong = 0
    for planted, found in PLANTED:
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in planted.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            if bool(check(root)[1]) != found:
                wrong += 1
                print(f"self-test: {list(planted)[:2]} should be {'found' if found else 'allowed'}")
    print(f"self-test: {len(PLANTED) - wrong} of {len(PLANTED)} planted trees judged rightly")
    return wrong


def main(arguments):
    if arguments == ["--self-test"]:
        return 1 if self_test() else 0
    count, problems = check(pathlib.Path(__file__).resolve().parents[1])
    print(*problems, f"{count} files, {len(problems)} names or folders to mend", sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
