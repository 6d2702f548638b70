#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/python_reference.md from the docstrings of the Python package.

    python3 docs/python_pages.py            writes the page
    python3 docs/python_pages.py --check    fails when it differs from the docstrings
"""
import ast
import inspect
import re
import sys

import api
import generated

PAGE = generated.ROOT / "docs/python_reference.md"
PACKAGE = generated.ROOT / "python/kempe"
HEAD = """# Python reference

<!-- written by docs/python_pages.py -->

Classes, functions and methods of the package `kempe`. The [manual](python.md) introduces them. `n` is the number of coordinates, `m`
the number of closure rows; units are SI. Keywords `**options` are members of the struct that is named, of the [C API](api/README.md).
"""


def modules():
    """(name, class or function) of all public names, and all classes by name."""
    public, found = [], {}
    for path in sorted(PACKAGE.glob("*.py")):
        tree = ast.parse(path.read_text())
        for node in tree.body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                found[node.name] = node
            if path.name == "__init__.py" and isinstance(node, ast.Assign) and node.targets[0].id == "__all__":
                public = ast.literal_eval(node.value)
    return public, found


def structs():
    """The page of each struct of options."""
    headers = {name: (generated.ROOT / f"include/kempe/{name}.h").read_text() for name in api.HEADERS}
    return {struct: name for name, text in headers.items() for struct in re.findall(r"^typedef struct (\w+_options) \{", text, re.M)}


def arguments(function, skip):
    """Names of arguments with their defaults."""
    given = function.args
    for each in [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]:
        if each:
            each.annotation = None
    given.args = given.args[skip:]
    return ast.unparse(given)


def prose(node, indent=""):
    """A docstring; lines of an example become a block of code."""
    text = inspect.cleandoc(ast.get_docstring(node) or "")
    parts = [f"```python\n{part}\n```" if part.startswith(">>>") else part for part in text.split("\n\n")]
    return "\n".join(indent + line if line else "" for line in "\n\n".join(parts).split("\n"))


def keywords(function, pages):
    """A sentence about the struct of the keywords."""
    kwarg = function.args.kwarg
    name = re.search(r"Unpack\[(\w+)\]", ast.unparse(kwarg.annotation)) if kwarg and kwarg.annotation else None
    if not name:
        return ""
    struct = "kempe" + re.sub("([A-Z])", lambda letter: "_" + letter[1].lower(), name[1])
    return f" (`{struct}`: [{pages[struct]}](api/{pages[struct]}.md))"


def member_lines(node, pages):
    """A list of the public methods and attributes of a class."""
    for each in node.body:
        if isinstance(each, ast.AnnAssign) and isinstance(each.value, ast.Call) and each.value.func.id in ("TableOf", "MatrixOf"):
            yield f"- `{each.target.id}`, {'table' if each.value.func.id == 'TableOf' else 'matrix'}: {each.value.args[0].value}"
        if not isinstance(each, ast.FunctionDef) or each.name.startswith("_"):
            continue
        decorators = {ast.unparse(decorator) for decorator in each.decorator_list}
        more = keywords(each, pages)
        name = each.name if "property" in decorators else f"{each.name}({arguments(each, 'staticmethod' not in decorators)})"
        yield f"- `{name}`{more}: {prose(each, '  ').lstrip()}"


def class_lines(name, node, found, pages):
    init = next((each for each in node.body if isinstance(each, ast.FunctionDef) and each.name == "__init__"), None)
    bases = [base for base in (ast.unparse(base) for base in node.bases) if base in found and found[base].name not in ("Owned", "Fixed")]
    yield f"## {name}\n"
    if init and not any(ast.unparse(base).endswith(("Error", "Exception", "KeyboardInterrupt")) for base in node.bases):
        yield f"`kempe.{name}({arguments(init, 1)})`\n"
    yield prose(node) + "\n"
    if bases:
        yield f"With what {' and '.join(f'[{base}](#{base.lower()})' for base in bases)} {'has' if len(bases) == 1 else 'have'}.\n"
    members = list(member_lines(node, pages))
    yield "\n".join(members) + "\n" if members else ""


def page():
    public, found = modules()
    pages = structs()
    used = {ast.unparse(base) for name in public if isinstance(found.get(name), ast.ClassDef) for base in found[name].bases}
    names = sorted({*public, *(name for name in used if name in found and name not in ("Owned", "Fixed"))} - {"contact"})
    lines = [HEAD]
    for name in names:
        node = found[name]
        if isinstance(node, ast.ClassDef):
            lines += class_lines(name, node, found, pages)
        else:
            lines += [f"## {name}\n", f"`kempe.{name}({arguments(node, 0)})`\n", prose(node) + "\n"]
    lines.append("## contact\n")
    for node in ast.parse((PACKAGE / "contact.py").read_text()).body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            lines.append(f"- `kempe.contact.{node.name}({arguments(node, 0)})`: {prose(node, '  ').lstrip()}")
    return "\n".join(line for line in lines if line) + "\n"


def main(words):
    return generated.settle({PAGE: page()}, "docs/python_pages.py", words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
