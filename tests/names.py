#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One name, one thing: files and types of the library have names of their own, and rooms stay small.

    python3 tests/names.py               checks the tree this script stands in
    python3 tests/names.py --self-test   proves that planted mistakes are found

- Two files of one stem are X.c, X.h, X.def or X_inside.h of one folder. A public header include/kempe/X.h may share its
  stem with the files of the folder that implements it.
- No type name `kmp_...` or `kempe_...` is defined twice.
- A folder has at most MOST_FILES files.
- A public function that returns a whole number is a count, `..._count`, or one of WHOLE.
"""
import collections
import pathlib
import re
import sys
import tempfile

ROOMS = ("include", "src", "constraints", "integrators")
MOST_FILES = 25
ENDINGS = {".c", ".h", ".def", ".js", ".html", ".css"}
WHOLE = re.compile(r"_count$|_is_\w+$|_dof$|_rank$|_find$")
RETURNS_WHOLE = re.compile(r"^KEMPE_API (?:int|long|size_t) (\w+)\(", re.M)
DEFINED = re.compile(r"^(?:typedef [^;{}]*?\b|\} )((?:kmp|kempe)_\w+);", re.M)


def files_of(root):
    return sorted(p for room in ROOMS for p in (root / room).rglob("*") if p.suffix in ENDINGS)


def check_files(root, files):
    stems, rooms = collections.defaultdict(set), collections.Counter()
    for path in files:
        folder = path.parent.relative_to(root).as_posix()
        rooms[folder] += 1
        if not folder.startswith("include"):
            stems[path.stem].add(folder)
    for stem, folders in stems.items():
        if len(folders) > 1:
            yield f"{stem}: in {' and '.join(sorted(folders))}"
    for folder, count in rooms.items():
        if count > MOST_FILES:
            yield f"{folder}: {count} files, at most {MOST_FILES}"


def check_types(root, files):
    places = collections.defaultdict(list)
    for path in files:
        if path.suffix in (".c", ".h"):
            for name in DEFINED.findall(path.read_text()):
                places[name].append(path.relative_to(root).as_posix())
    for name, where in places.items():
        if len(where) > 1:
            yield f"type {name}: in {' and '.join(where)}"


def check_counts(files):
    for path in files:
        for name in RETURNS_WHOLE.findall(path.read_text() if path.suffix == ".h" else ""):
            if not WHOLE.search(name):
                yield f"{name}: a count ends with _count"


def check(root):
    files = files_of(root)
    return len(files), [*check_files(root, files), *check_types(root, files), *check_counts(files)]


PLANTED = [
    ({"src/base/a.c": "", "src/model/a.h": ""}, True),
    ({"src/base/a.c": "", "src/base/a.h": "", "include/kempe/a.h": ""}, False),
    ({"src/base/a.h": "typedef struct kmp_a {\n    int n;\n} kmp_a;\n", "src/base/b.h": "typedef enum kmp_b {\n    A\n} kmp_a;\n"}, True),
    ({"src/base/a.h": "typedef int kmp_a_fn(int n);\ntypedef struct kmp_a kmp_a;\n", "src/base/b.h": "typedef double kmp_a;\n"}, True),
    ({"include/kempe/a.h": "KEMPE_API int kempe_a_rows(const kempe_a *a);\n"}, True),
    ({"include/kempe/a.h": "KEMPE_API int kempe_a_row_count(const kempe_a *a);\nKEMPE_API int kempe_a_is_ok(void);\n"}, False),
    ({f"src/base/f{k}.c": "" for k in range(MOST_FILES + 1)}, True),
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
    print(*problems, f"{count} files, {len(problems)} names or rooms to mend", sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
