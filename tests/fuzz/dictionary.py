#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The words of a format as a dictionary of libFuzzer, from the tables that its reader is made from:

    python3 tests/fuzz/dictionary.py model
"""
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
NUMBERS = ["0", "-1", "1e-3", "1e9", "1e155", "-1e160", "1e200", "1e250", "1e300", "-1e308", "1.7976931348623157e308", "1e-320", "1e999", "0.5", "3.14", "64", "2147483647", "4294967296"]


def rows(path, macro):
    """The first entry of every row of a table."""
    return re.findall(macro + r'\((\w+)', (ROOT / path).read_text())


def texts(path):
    """The string literals of a source that look like words."""
    return re.findall(r'"(\w+)"', (ROOT / path).read_text())


def schema_words(node):
    if isinstance(node, list):
        return [word for item in node for word in schema_words(item)]
    if not isinstance(node, dict):
        return []
    words = list(node.get("properties", {})) + [str(word) for word in node.get("enum", [])]
    return words + schema_words(list(node.values()))


def expression():
    functions = [name + "(" for name in rows("src/model/language/functions.def", "KMP_FUNCTION") +
                 rows("src/model/language/composites.def", "KMP_COMPOSITE")]
    units = [" " + name for name in rows("src/model/language/units.def", "KMP_UNIT")]
    measures = re.findall(r'KMP_MEASURE\(\w+, "(\w+)"', (ROOT / "src/model/language/measures.def").read_text())
    return functions + units + [word + "(" for word in measures + ["rate"]] + ["one.P", "two.Q.x", ").x", "q(A)", "qd(B)", "q(J.1)", "lambda(A)", "lambda(B.2)"] + [
        "t", "pi", "L1", "if(a < ", ">=", "<=", "^-", "^2", ")^("]


def model():
    words = [word + ": " for word in schema_words(json.loads((ROOT / "schema/kempe.schema.json").read_text()))]
    syntax = ["ground.O", "ground", "[0, 0, 0]", "{", "}", "- ", ": ", ", ", "&a ", "*a", "~", "!!str ", "|\n ", "\n#== ",
              "? ", "--- ", "... ", "<<: ", "\"\\u00e9\"", "%YAML 1.1\n"]
    return words + syntax + expression()


def xml(*sources):
    tags = sorted({word for pattern in sources for source in ROOT.glob(f"src/exchange/formats/{pattern}") for word in texts(source)})
    syntax = ["<![CDATA[", "]]>", "<!--", "-->", "&#65;", "&lt;", "<!DOCTYPE a [<!ENTITY b 'c'>]>", "<?xml version='1.0'?>",
              " a='b'", "encoding='utf-16'"]
    return [f"<{tag}>" for tag in tags] + [f"</{tag}>" for tag in tags] + tags + syntax


def columns():
    names = ["A", "B", "D"]
    return [f",{kind}.{name}" for kind in ("q", "qd", "qdd") for name in names] + [
        "t", ",lambda.C.1", ",lambda.C.2", ",position.", "# ", ",", "\n", "\r\n", "\ufeff", "nan", "inf"]


def values():
    return ["l", "m", "ax", "q.A", "qd.A", "q.", "qd.", ",", "# ", "\n", "\r\n", "\ufeff", "nan", "inf", "+1", "-1e-3"]


def measured():
    return ["t", "q.A", "qd.A", "position.a.P.x", " [deg]", " [mm]", "# units: s,deg", "parameter", "value", "l", "m", ",", "\n", "\r\n", "\ufeff", "nan"]


def parquet():
    return ["PAR1", "l", "m", "ax", "unit.l", "mm", "kempe.sum", "kempe.run", "\x15\x00", "\x15\x04", "\x19\x1c", "\x15\x02", "\x15\x0c", "\x26\x08", "\x15\x10"]


def folder():
    source = "\n".join((ROOT / f"src/ensemble/{name}.c").read_text() for name in ("manifest", "result_folder"))
    keys = sorted(set(re.findall(r"(\w+) %[sdgli]", source)) | set(re.findall(r'f->manifest, "(\w+)"', source)))
    return [f'  "{key}": ' for key in keys] + ["\n#== run.kempe/part-000000.parquet\n", "damaged", "true", "false", "null", "kempe.part", "status",
                                              "verdict", "\\u00", "1-2,4", "1:2"] + parquet()


def mesh():
    stl = ["solid a\n", "facet normal 0 0 1\n", "outer loop\n", "vertex 1 0 0\n", "endloop\n", "endfacet\n", "endsolid a\n"]
    return stl + ["v 0 0 1\n", "f 1 2 3\n", "f -1 -2 -3 -4\n", "f 1/1/1 2//2 3/3\n", "vn 0 0 1\n", "# "]


def modes():
    source = (ROOT / "src/exchange/bodies/sid_modes.c").read_text()
    words = re.findall(r'"(\w[\w ]*)"', source[source.index("names[PARTS"):source.index("/* -- numbers")])
    return words + [f"end {word}" for word in words] + ["new node = 1", "m0( 1, 1) = ", "m1( 1, 1, 1) = ", "$", "GRID,1,,0.,0.,0.\n", "DMIG,KAAX,0,6,2\n", "DMIG,MAAX,1,1,,1,1,",
                                                            "DMIG*   KAAX    ", "GRDSET", "BAAX", "K4AAX", "1.0+2", "1.D-3", "PK\x03\x04"]


def elements():
    keywords = ["*NODE", "*NSET, NSET=A", ", GENERATE", "*INCLUDE", "*STEP", "**"]
    return keywords + ["%%MatrixMarket matrix coordinate real ", "symmetric", "general", "\n#== job.dof\n", "1.5D-3", "1.5-103", "7.1\n", "7.4\n"] + texts("src/exchange/finite_elements/mesh_arrays.c")


FORMATS = {"elements": elements, "mesh": mesh, "modes": modes, "expression": expression, "model": model, "mbs": lambda: xml("mbs.c"), "urdf": lambda: xml("urdf*.c", "drake*.c"), "mjcf": lambda: xml("mjcf*.c"), "sdf": lambda: xml("sdf*.c", "drake*.c"), "reference": columns,
           "checkpoint": lambda: ["# kempe checkpoint 5, model ", "\n", ",", ",0", "\n0.2,", "~", "# past,0.2,1\n", "# doubt,a\n"], "program": list, "values": values,
           "measured": measured, "parquet": parquet, "folder": folder}


def quoted(word):
    plain = "".join(chr(b) if 32 <= b < 127 and chr(b) not in '"\\' else f"\\x{b:02x}" for b in word.encode())
    return f'"{plain}"'


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in FORMATS:
        sys.exit(f"usage: dictionary.py {'|'.join(FORMATS)}")
    for word in dict.fromkeys(FORMATS[sys.argv[1]]() + NUMBERS):
        print(quoted(word))
