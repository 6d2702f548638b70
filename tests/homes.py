#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The home of each shared function: it is defined in the file whose header declares it.

    python3 tests/homes.py               checks the tree this script stands in
    python3 tests/homes.py --list        prints every function that is declared elsewhere
    python3 tests/homes.py --self-test   proves that planted mistakes are found

Shared are functions and tables kmp_... and kempe_... that a header of the library declares and a .c file defines. X.c and X.h of one
folder are a home, and so are X_posix.c and X_windows.c. Those declared in a header of INTERFACES are counted apart: these headers are handed out, and are ordered for their
readers. At most MOST percent of the others are declared elsewhere in the folder of their file. None is declared in another folder, but
for those of ACROSS. A function of a wing (tests/includes.py) is called by that wing and those that may see it alone, also where a public
header declares it: a build may be without the wing.

Definitions that a macro makes, KMP_NAME(...) on lines of its own, are those of its text with the arguments put in.
"""
import collections
import pathlib
import re
import sys
import tempfile

from includes import WINGS

LIBRARY = ("include", "src", "constraints", "integrators")
INTERFACES = ("include/kempe/", "src/exchange/simulator/kempe_simulator.h", "src/exchange/simulator/kempe_fmu.h")
MOST = 2.0  # percent
ACROSS = {  # function: the reason why another folder declares it
    "kmp_tree_unknown": "links evaluate names, whose equations are solved above them",
}
QUIET = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\\\n]|\\.|\\\n)*", re.M)
MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+([A-Z]\w*)\(([^)\n]*)\)((?:[^\\\n]|\\.|\\\n)*)", re.M)
USE = re.compile(r"^([A-Z][A-Z0-9_]*)\(", re.M)
NAME = r"k(?:mp|empe)_\w+"
FUNCTION = re.compile(rf"\b({NAME})\s*\(")
DATA = re.compile(rf"\b({NAME})\s*(?:\[[^\]]*\]\s*)*(?=[=,;]|$)")


def close(text, at):
    """The end of the parenthesis or brace that begins at `at`."""
    depth = 0
    for k in range(at, len(text)):
        depth += text[k] in "([{"
        depth -= text[k] in ")]}"
        if depth == 0:
            return k + 1
    return len(text)


def arguments(text):
    """The arguments between two parentheses, divided at commas of their own level."""
    found, depth, last = [], 0, 0
    for k, c in enumerate(text):
        depth += c in "([{"
        depth -= c in ")]}"
        if c == "," and depth == 0:
            found.append(text[last:k].strip())
            last = k + 1
    return [*found, text[last:].strip()]


def macros(text):
    return {found[1]: ([name.strip() for name in found[2].split(",")], found[3].replace("\\\n", " ")) for found in MACRO.finditer(text)}


def put_in(text, known):
    """The text with the macros that stand alone on their lines put in."""
    parts, last = [], 0
    for found in USE.finditer(text):
        end = close(text, found.end() - 1)
        if found.start() < last or not re.match(r";|[ \t]*(?:\n(?!\s*\{)|\Z)", text[end:]):
            continue
        names, body = known.get(found[1], ([], ""))
        for name, value in zip(names, arguments(text[found.end():end - 1])):
            if name != "...":
                body = re.sub(rf"\b{name}\b", lambda _, value=value: value, body)
        parts += [text[last:found.start()], re.sub(r"\s*##\s*", "", body), "" if body.rstrip().endswith(("}", ";")) else ";"]
        last = end + (text[end:end + 1] == ";")
    return "".join(parts) + text[last:]


def statements(text):
    """The statements outside of all braces: (statement, it ends with a body)."""
    last = k = 0
    while k < len(text):
        if text[k] == "{":
            end = close(text, k)
            head = text[last:k]
            if head.rstrip().endswith(")") and "=" not in head:
                yield head, True
                last = end
            else:
                text = text[:k] + " " * (end - k) + text[end:]
            k = end
        elif text[k] == ";":
            yield text[last:k], False
            last = k = k + 1
        elif text[k] == "(":
            k = close(text, k)
        else:
            k += 1


def names_of(text, known):
    """(declared names, defined names) of a source."""
    text = re.sub(r'\bextern\s+"C"\s*\{', " ", text)
    text = DIRECTIVE.sub("", QUIET.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text))
    declared, defined = [], []
    for statement, body in statements(put_in(text, known)):
        head = statement.strip(" \n\t}")
        first = re.match(r"\w*", head)[0]
        if first in ("typedef", "struct", "enum", "union") and re.match(r"(typedef|struct|enum|union)\b\s*\w*\s*$", head) or first == "typedef" \
                or re.search(r"\bstatic\b", re.split(r"[({=]", head)[0]):
            continue
        function = FUNCTION.search(head)
        if function and "=" not in head[:function.start()]:
            (defined if body else declared).append(function[1])
        elif first == "extern":
            declared += DATA.findall(head)
        elif not body:
            defined += DATA.findall(head)[:1]
    return declared, defined


def home(path):
    return re.sub("_(posix|windows)$", "", path.rpartition(".")[0])


def folder(path):
    return path.rpartition("/")[0]


def wing(path):
    """The wing of a source; "": the core. The command and the library of units are programs: they see what their builds have."""
    part = path.split("/")[1] if path.startswith("src/") else ""
    return part if part in WINGS else ""


def calls_of_wings(texts, declared, defined):
    """Calls of functions of a wing by sources that must do without it, also over public headers."""
    owner = {name: wing(sources[0]) for name, sources in defined.items() if name in declared and wing(sources[0])}
    for path, text in texts.items():
        if path.startswith(("include/", "src/cli/", "src/exchange/fmu_library/")):
            continue
        own = wing(path)
        seen = {own, *WINGS.get(own, "").split()}
        for name in sorted(set(re.findall(rf"\b({NAME})\b", QUIET.sub(" ", text))) & set(owner)):
            if owner[name] not in seen:
                yield f"{path}: {name} is of the wing {owner[name]}, which {own or 'the core'} does without"


def check(texts, across):
    """(counts, functions that are declared elsewhere as (name, header, source, across folders), problems)."""
    shared = {}
    for path, text in texts.items():
        if path.endswith(".h"):
            shared.update(macros(text))
    declared, defined = collections.defaultdict(list), collections.defaultdict(list)
    for path, text in texts.items():
        own, made = names_of(text, shared if path.endswith(".h") else {**shared, **macros(text)})
        for name in own if path.endswith(".h") else ():
            declared[name].append(path)
        for name in made if path.endswith(".c") else ():
            defined[name].append(path)
    counts, elsewhere, calls = collections.Counter(), [], list(calls_of_wings(texts, declared, defined))
    for name, sources in sorted(defined.items()):
        headers = declared.get(name, [])
        if not headers:
            continue
        if any(header.startswith(INTERFACES) for header in headers):
            counts["handed out"] += 1
            continue
        counts["shared"] += 1
        if not {home(source) for source in sources} & {home(header) for header in headers}:
            apart = not {folder(source) for source in sources} & {folder(header) for header in headers}
            elsewhere.append((name, headers[0], sources[0], apart))
    problems = [f"{header}: {name} is defined in another folder, {source}" for name, header, source, apart in elsewhere
                if apart and name not in across]
    problems += calls
    outside = {name for name, _, _, apart in elsewhere if apart}
    problems += [f"ACROSS: {name} is no longer declared in another folder" for name in sorted(set(across) - outside)]
    if len(elsewhere) * 100 > MOST * counts["shared"]:
        problems += [f"{header}: {name} is defined in {source}, not in {home(header)}.c" for name, header, source, apart in elsewhere if not apart]
    return counts, elsewhere, problems


def tree(root):
    return {path.relative_to(root).as_posix(): path.read_text() for top in LIBRARY for path in sorted((root / top).rglob("*.[ch]"))}


A, RIGHT = "int kmp_a(int n)\n{\n    return n;\n}\n", "/** A. */\nint kmp_a(int n);\n"
MANY = "".join(f"void kmp_f{k}(void);\n" for k in range(60)), "".join(f"void kmp_f{k}(void)\n{{\n}}\n" for k in range(60))
MADE = "#define KMP_FREES(type, ...) \\\n    void type##_free(type *it) \\\n    { \\\n        __VA_ARGS__; \\\n    }\n"
PLANTED = [  # files, whether a mistake is found
    ({"src/a/x.h": RIGHT, "src/a/x.c": A}, False),
    ({"src/a/y.h": RIGHT, "src/a/x.c": A}, True),
    ({"src/rail/x.h": RIGHT, "src/rail/x.c": A, "src/report/y.c": "int y(void)\n{\n    return kmp_a(1);\n}\n"}, False),
    ({"src/report/x.h": RIGHT, "src/report/x.c": A, "src/rail/y.c": "int y(void)\n{\n    return kmp_a(1);\n}\n"}, True),
    ({"include/kempe/x.h": RIGHT, "src/rail/x.c": A, "src/a/y.c": "int y(void)\n{\n    return kmp_a(1);\n}\n"}, True),
    ({"src/b/x.h": RIGHT, "src/a/x.c": A}, True),
    ({"src/a/x.h": RIGHT + MANY[0], "src/a/x.c": MANY[1], "src/a/y.c": A}, False),
    ({"src/b/x.h": RIGHT, "src/a/x.h": MANY[0], "src/a/x.c": MANY[1], "src/a/y.c": A}, True),
    ({"include/kempe/y.h": "int kempe_a(int n);\n", "src/a/x.c": A.replace("kmp_a", "kempe_a")}, False),
    ({"src/a/y.h": RIGHT, "src/a/x.c": "static " + A}, False),
    ({"src/a/y.h": RIGHT, "src/a/x.c": f"/* {A} */\nconst char *kmp_text = \"{{\";\n"}, False),
    ({"src/a/y.h": "static inline " + A, "src/a/x.c": "int b(void)\n{\n    return kmp_a(1);\n}\n"}, False),
    ({"src/a/y.h": "extern const char *const kmp_words[];\n", "src/a/x.c": 'const char *const kmp_words[] = {"a", "{"};\n'}, True),
    ({"src/a/y.h": "extern const int kmp_one, kmp_two[];\n", "src/a/x.c": "const int kmp_two[2] = {1, 2};\n"}, True),
    ({"src/a/x.h": "extern const int kmp_one;\n", "src/a/x.c": "const int kmp_one = 1;\n"}, False),
    ({"src/a/m.h": MADE, "src/a/y.h": "void kmp_x_free(kmp_x *x);\n", "src/a/x.c": "KMP_FREES(kmp_x, kmp_free(it->a))\n\n" + A}, True),
    ({"src/a/m.h": MADE, "src/a/x.h": "void kmp_x_free(kmp_x *x);\n", "src/a/x.c": "KMP_FREES(kmp_x, kmp_free(it->a))\n\n" + A}, False),
    ({"src/a/y.h": RIGHT, "src/a/x.c": "KMP_PAIR(one, two)\n\n" + A}, True),
    ({"src/a/y.h": "bool kmp_a(const char *format, ...)\n    __attribute__((format(printf, 1, 2)));\n", "src/a/x.c": A}, True),
    ({"src/a/x.h": RIGHT, "src/a/x.c": A, "src/a/y.c": A}, False),
    ({"src/a/x.h": "typedef int kmp_f(int n);\nstruct kmp_s {\n    int (*kmp_a)(int n);\n};\n", "src/a/y.c": A}, False),
    ({"src/a/y.h": "KMP_LOCAL double kmp_a(int n);\n", "src/a/x.c": "KMP_LOCAL double kmp_a(int n)\n{\n    return n;\n}\n"}, True),
]


def self_test():
    wrong = 0
    for planted, found in PLANTED:
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name)
            for path, text in planted.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text)
            problems = check(tree(root), {})[2]
        if bool(problems) != found:
            wrong += 1
            print(f"self-test: {planted} should be {'found' if found else 'allowed'}: {problems}")
    stale = check({"src/a/x.h": RIGHT, "src/a/x.c": A}, {"kmp_a": "no more"})[2]
    reason = check({"src/b/x.h": RIGHT, "src/a/x.h": MANY[0], "src/a/x.c": MANY[1], "src/a/y.c": A}, {"kmp_a": "a reason"})[2]
    wrong += (len(stale) != 1) + (reason != [])
    print(f"self-test: {len(PLANTED) + 2 - wrong} of {len(PLANTED) + 2} planted trees judged rightly")
    return wrong


def main(options):
    if options == ["--self-test"]:
        return 1 if self_test() else 0
    counts, elsewhere, problems = check(tree(pathlib.Path(__file__).resolve().parent.parent), ACROSS)
    if options == ["--list"]:
        problems = [f"{header}: {name} ({source})" for name, header, source, _ in elsewhere]
    part = 100 * len(elsewhere) / max(counts["shared"], 1)
    print(*problems, f"{counts['shared']} shared functions, {len(elsewhere)} ({part:.1f} %) declared elsewhere, "
          f"{sum(apart for *_, apart in elsewhere)} of them in another folder; {counts['handed out']} in headers that are handed out", sep="\n")
    return 1 if problems or not counts["shared"] else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
