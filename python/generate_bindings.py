#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the low level of the Python package from the public headers, so that it needs no upkeep:

    python3 python/generate_bindings.py MODULE.c OPTIONS.py HELP.py

MODULE.c is the extension module `kempe._native` (cffi in API mode, for the limited API of Python): all public functions and
types, the helpers of helpers.h, and a guarded form of each long computation. OPTIONS.py has a TypedDict for each struct of
options, for type checkers. HELP.py has their texts, for help().
"""

import keyword
import pathlib
import pprint
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[1]
HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "docs"))
import api  # noqa: E402  reads headers for the pages of docs/api

STANDALONE = {"runtime"}  # for generated C code, which runs without the library
# Computations that a user may want to end: they run with a handler for SIGINT.
GUARDED = re.compile(
    r"kempe_(?!model_new|values_new|outputs_new|workspace_new)\w+_(new|new_with|run|run_range|run_rows|run_folder|history|step|advance|read|read_set|read_text|read_text_set)$|kempe_simulate$|kempe_flow_at$|kempe_\w+_(write_report|write_report_against|set_state|set_parameters)$|kempe_folder_(check|write|write_history)$"
)
CALLBACKS = """
extern "Python" int python_force(void *user, double t, const double *q, const double *qd, double *effort);
extern "Python+C" void python_log(void *user, kempe_level level, const char *line);
extern "Python" void python_progress(void *user, const kempe_progress *progress);
"""


def headers():
    """kempe.h first, since the others include it; then in an order in which each include is met."""
    folder, done = ROOT / "include/kempe", []

    def visit(name):
        if name in done or name in STANDALONE:
            return
        for needed in re.findall(r"#include <kempe/(\w+)\.h>", (folder / f"{name}.h").read_text()):
            visit(needed)
        done.append(name)

    for path in sorted(folder.glob("*.h")):
        visit(path.stem)
    return {name: (folder / f"{name}.h").read_text() for name in done}


def declarations(text):
    """The declarations of a header for cffi: no comments, preprocessor lines, export macros or bodies."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r"^\s*#(?:[^\n\\]|\\\n|\\.)*\n", "", text, flags=re.M)
    text = re.sub(r'extern "C" \{|\bKEMPE_(?:API|BEGIN|END)\b', "", text)
    text = re.sub(r"^static inline ([^{};]*)\n\{.*?^\}", r"\1;", text, flags=re.M | re.S)
    return re.sub(r"\n\s*\n+", "\n", text).strip() + "\n"


def functions(text):
    """(result, name, parameters) of the functions that a header declares."""
    for result, name, words in re.findall(r"^([\w *]+?[ *])(kempe_\w+|python_\w+)\(([^;]*?)\);", text, re.M):
        parameters = " ".join(words.split()).split(", ")
        yield result.strip(), name, [] if parameters == ["void"] else parameters


def guarded(text):
    """(declaration, body) of the guarded form of each long computation."""
    for result, name, parameters in functions(text):
        if result == "kempe_status" and GUARDED.match(name):
            names = ", ".join(re.search(r"(\w+)(?:\[\d*\])?$", parameter).group(1) for parameter in parameters)
            head = f"kempe_status guarded_{name}(kempe_context *guarded_context, {', '.join(parameters)})"
            yield (
                head,
                (
                    f"static {head}\n{{\n    python_guard guard;\n    python_guard_begin(&guard, guarded_context);\n"
                    f"    return python_guard_end(&guard, {name}({names}));\n}}\n"
                ),
            )


def write_module(path, texts):
    import cffi

    ffi = cffi.FFI()
    own = declarations((HERE / "helpers.h").read_text())
    forms = [form for text in texts for form in guarded(text)]
    ffi.cdef("\n".join(texts) + own + CALLBACKS + "".join(f"{head};\n" for head, _ in forms))
    includes = "".join(f"#include <kempe/{name}.h>\n" for name in headers())
    source = f'{includes}#include "helpers.h"\n\n' + "\n".join(body for _, body in forms)
    ffi.set_source("kempe._native", source, py_limited_api=True)
    ffi.emit_c_code(str(path))


TYPES = {"const char *": "Text", "double": "float", "int": "int", "long": "int", "const char *const *": "Sequence[str]"}


# Tables: files, or columns in memory (columns.py).
TABLES = {"const char *": "Data", "const char *const *": "Sequence[Data]"}


def is_table(words):
    return re.match(r"(CSV\b|Further data files)|.*, a CSV file", words)


def option_structs():
    """(name, members) of the structs of options."""
    for text in headers().values():
        for declaration in re.findall(
            r"^typedef struct kempe_\w+_options \{.*?^\} kempe_\w+_options;", text, re.M | re.S
        ):
            yield api.name_of(declaration), api.members(declaration)


def class_name(struct):
    return "".join(word.capitalize() for word in struct.removeprefix("kempe_").split("_"))


def in_python(words):
    """The words of a member, which is not given if it is NULL or 0, as the words of a keyword, which is then None."""
    words = re.sub(r"(?<=[;,(] )0: |^0: ", "None: ", re.sub(r"\bNULL\b", "None", words))
    return re.sub(r"^1: ", "True: ", words)


def base_classes(rows):
    return [class_name(kind.removeprefix("const ").rstrip(" *")) for _, kind, _ in rows if "_options" in kind] or ["Reporting"]


def options_of(rows):
    """(keyword, type, words) of the members of a struct."""
    names = {name for name, _, _ in rows}
    for name, kind, words in rows:
        for each in name.split(", "):
            is_count = each.endswith("_count") and each[:-6] + "s" in names
            if each != "size" and kind in TYPES and not is_count:
                each += "_" if keyword.iskeyword(each) else ""
                yield each, TABLES[kind] if is_table(words) else TYPES[kind], in_python(words)


def option_class(struct, rows):
    lines = [
        f"class {class_name(struct)}({', '.join(base_classes(rows))}, total=False):",
        f'    """Options of `{struct}`. Each may be left out.',
        "",
    ]
    fields = []
    for name, kind, words in options_of(rows):
        fields.append(f"    {name}: {kind}")
        lines += textwrap.wrap(f"{name}: {words}", 110, initial_indent="    ", subsequent_indent="        ")
    return "\n".join([*lines, '    """', "", *fields]) + "\n"


# Exceptions by the status of the library (errors.py), in the order of a list.
EXCEPTIONS = {"ARGUMENT": "ArgumentError", "INPUT": "InputError", "IO": "FileError", "FAILED": "FailedError"}
USUAL = {
    "TypeError": "there is no such keyword, or a value has another type.",
    "ArgumentError": "a name or value does not exist.",
    "FailedError": "the computation is impossible as requested; `partial` is the result up to there, or None.",
}


def raised(comment):
    """Sentences about exceptions, by causes that a header has as clauses: "KEMPE_E_INPUT: the data are wrong."."""
    found = dict(USUAL)
    text = " ".join(comment.split())
    for statuses, cause in re.findall(r"(KEMPE_E_\w+(?:(?:,| and) KEMPE_E_\w+)*): (.*?)(?=[.;] KEMPE_|\. [A-Z*`]|\.?$)", text):
        for status in re.findall(r"KEMPE_E_(\w+)", statuses):
            if status in EXCEPTIONS:
                found[EXCEPTIONS[status]] = f"{cause.rstrip('.')}."
    return [f"Raises {name} if {found[name]}" for name in ["TypeError", *EXCEPTIONS.values()] if name in found]


def failures():
    """(class of options, exceptions of the first function that takes them)."""
    done = set()
    for header, text in headers().items():
        for item in api.items(text)[1]:
            for declaration in item.declarations:
                structs = re.findall(r"const (kempe_\w+_options) \*", declaration) if "(" in declaration else []
                for struct in structs:
                    if struct not in done:
                        done.add(struct)
                        yield class_name(struct), raised(api.text_of(item.comment or ""))


PROGRESS = "True for a bar, or a function that is called with a `Progress`; its exception ends the computation."


def write_options(path):
    """Python's classes of options, a struct that another one points to first."""
    parts = [
        '"""Names and types of options. Generated from the public headers."""\n\nfrom __future__ import annotations\n\n'
        "from collections.abc import Mapping, Sequence\nfrom os import PathLike\nfrom typing import Any, TypedDict, Union\n\n"
        "from .columns import Frame, Motion\nfrom .progress import ProgressTo\n\n"
        'Data = Union[str, "PathLike[str]", Mapping[str, Any], Frame, Motion]\n'
        'Text = Union[str, float, "PathLike[str]", Sequence[Union[str, float]], Mapping[str, object]]\n',
        f'class Reporting(TypedDict, total=False):\n    """progress: {PROGRESS}"""\n\n    progress: ProgressTo\n',
    ]
    parts += [option_class(*struct) for struct in option_structs()]
    pathlib.Path(path).write_text("\n\n".join(parts))


def wrapped(text):
    return "\n".join(textwrap.wrap(text, 116, subsequent_indent="    "))


def write_help(path):
    """The same options as texts, and what their studies raise, for signatures and docstrings."""
    structs = {class_name(name): rows for name, rows in option_structs()}
    options = {"Reporting": {"progress": ("ProgressTo", wrapped(f"progress: {PROGRESS}"))}}
    for name, rows in structs.items():
        options[name] = {each: (kind, wrapped(f"{each}: {words}")) for each, kind, words in options_of(rows)}
    bases = {name: [*base_classes(rows), *(["Reporting"] if base_classes(rows) != ["Reporting"] else [])] for name, rows in structs.items()}
    raises = {name: "\n".join(map(wrapped, lines)) for name, lines in failures()}
    head = '"""Options of studies: their types and texts, and exceptions. Generated from the public headers."""\n\n'
    tables = [
        ("OPTIONS: dict[str, dict[str, tuple[str, str]]]", options, "By class of options: each own option."),
        ("BASES: dict[str, list[str]]", bases, "Classes whose options a class has, too."),
        ("RAISES: dict[str, str]", raises, "Sentences about exceptions."),
    ]
    texts = [f"# {words}\n{name} = {pprint.pformat(table, width=140, sort_dicts=False)}\n" for name, table, words in tables]
    pathlib.Path(path).write_text(head + "\n".join(texts))


def main(arguments):
    module, options, texts = arguments
    write_module(module, [declarations(text) for text in headers().values()])
    write_options(options)
    write_help(texts)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
