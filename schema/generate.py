#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the JSON Schema of the model language (draft 7, for editors) from the tables that the reader uses:

    python3 schema/generate.py > schema/kempe.schema.json
"""
import json
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[1]
NAME = "^[^\\x00-\\x40\\x5b-\\x5e\\x60\\x7b-\\x7f][^\\x00-\\x2f\\x3a-\\x40\\x5b-\\x5e\\x60\\x7b-\\x7f]*$"


def rows(table, macro):
    """The arguments of every row `macro(..)` of a .def table."""
    text = re.sub(r"/\*.*?\*/|^#.*?$", "", next((ROOT / "src/model").rglob(table)).read_text(), flags=re.S | re.M)
    return [[a.strip().strip('"') for a in m.group(1).split(",")] for m in re.finditer(rf"{macro}\((.*)\)", text)]


def keys(source, array):
    """The strings of a list of keys in a source of the reader; a table that it includes gives its rows' names."""
    text = next((ROOT / "src/model").rglob(source)).read_text()
    body = re.search(rf"{array}\[\] = \{{(.*?)\}};", text, re.S).group(1)
    macros = re.findall(r"#define (\w+)\((.*?)\) #(\w+)", body)
    tables = re.findall(r'#include "model/(?:\w+/)*(\w+\.def)"', body)
    names = [row[columns.split(", ").index(column)] for (macro, columns, column), name in zip(macros, tables)
             for row in rows(name, macro)]
    return names + re.findall(r'"(\w+)"', re.sub(r"#.*", "", body))


def ref(name):
    return {"$ref": f"#/definitions/{name}"}


def named(value):
    return {"type": ["object", "null"], "propertyNames": {"pattern": NAME}, "additionalProperties": value}


def closed(properties, required=()):
    schema = {"type": "object", "additionalProperties": False, "properties": properties}
    if required:
        schema["required"] = sorted(required)
    return schema


def force_elements():
    """The mapping of each kind of force that has one of its own, and the keys of those that have not."""
    word = {kind: word for kind, _, _, word, _ in rows("force_kinds.def", "KMP_FORCE")}
    own, top = {}, {}
    for kind, _, key, size, *_, required, _ in rows("force_kinds.def", "KMP_FIELD"):
        names = ["torque", "force"] if key == "effort" else [key]
        if word[kind] == "NULL":
            for name in names:
                top[name] = max(int(size), top.get(name, 1))
            continue
        properties, wanted = own.setdefault(word[kind], ({}, []))
        properties.update({n: ref("number") for n in names})
        if required == "true" and key != "effort":
            wanted.append(key)
    return {w: closed(p, r) for w, (p, r) in own.items()}, top


def force():
    own, top = force_elements()
    effort = {"anyOf": [ref("number"), ref("vector")]}
    properties = {"joint": ref("word"), "at": ref("word"), "on": ref("word"), "torque": effort, "force": effort}
    properties.update({key: ref("number") if top[key] == 1 else effort for key in sorted(top)}, **own)
    properties["spring"] = {"anyOf": [ref("two_points"), own["spring"]]}
    properties["bushing"] = ref("two_points")
    return closed(properties)


def joint_numbers():
    return {row[1]: ref("number") for row in rows("closure_numbers.def", "KMP_COUPLING_NUMBER")}


def joint():
    chains = dict(rows("joints.def", "KMP_JOINT"))
    pair = {"anyOf": [ref("axis"), ref("two_axes")]}
    properties = {name: pair if "b" in chain else ref("axis") if chain else ref("yes") for name, chain in chains.items()}
    motion = {"anyOf": [{"type": "string", "pattern": "^-?[RT][123]$"}, closed({"R": ref("axis")}, ["R"]),
                        closed({"T": ref("axis")}, ["T"])]}
    properties.update(motions={"type": "array", "minItems": 1, "items": motion}, name=ref("word"), at=ref("word"),
                      coordinates={"type": "array", "items": {"type": ["string", "number", "null"]}},
                      to=ref("word"), frame=ref("axes"), **joint_numbers(), reversed=ref("yes"))
    return dict(closed(properties, ["at"]), oneOf=[{"required": [key]} for key in [*chains, "motions"]])


def edge():
    """A joint between two bodies."""
    chains = dict(rows("joints.def", "KMP_JOINT"))
    chains.pop("free")
    properties = {name: ref("two_points") for name in chains}
    properties.update(axis=ref("axis"), axes=ref("two_axes"), **joint_numbers(), cut={"enum": ["yes", "no", True, False]})
    wants = {name: [chain.split("=")[1]] for name, chain in chains.items() if "=" in chain}
    return dict(closed(properties), oneOf=[{"required": [name, *wants.get(name, [])]} for name in chains])


def loop():
    kinds = dict(rows("closure_kinds.def", "KMP_CLOSURE"))
    terms = {"type": "object", "additionalProperties": ref("number"), "minProperties": 2}
    own = {"TERMS": terms, "EXPRESSION": ref("number")}
    numbers = {row[0]: row[1] for row in rows("closure_numbers.def", "KMP_CLOSURE_NUMBER")}
    wants = {name: [numbers[name]] if name in numbers else ["axes"] if needs == "TWO_AXES" else []
             for name, needs in kinds.items()}
    curve = {"anyOf": [ref("number"), {"type": "array", "items": ref("number"), "minItems": 1, "maxItems": 2}]}
    properties = {name: own.get(needs, ref("two_points")) for name, needs in kinds.items()}
    properties.update({key: ref("number") for key in numbers.values()}, axis=ref("axis"), axes=ref("two_axes"), table=ref("word"),
                      y=ref("number"), z=ref("number"), curve=curve, equals=ref("number"), power=ref("number"))
    return dict(closed(properties), oneOf=[{"required": [name, *wants[name]]} for name in kinds])


def drive():
    properties = {key: ref({"joint": "word", "locked": "yes"}.get(key, "number"))
                  for key in keys("read_closures.c", "drive_keys")}
    return dict(closed(properties, ["joint"]), oneOf=[{"required": [k]} for k in properties if k != "joint"])


def table():
    either = {"anyOf": [ref("word"), {"type": "array", "items": ref("number")}]}
    return closed({"x": either, "y": either, "csv": ref("word"), "method": {"enum": ["spline", "linear"]}}, ["x", "y"])


def profile():
    either = {"anyOf": [ref("word"), {"type": "array", "items": ref("number")}]}
    return closed({"y": either, "z": either, "csv": ref("word"), "unit": ref("word")}, ["y", "z"])


def piece():
    """Of the course of a track."""
    names = keys("read_course.c", "piece_keys")
    kinds = [name for name in names if name not in ("radius", "cant")]
    return dict(closed({key: ref("number") for key in names}),
                oneOf=[{"required": [kind] + (["radius"] if kind in ("left", "right") else [])} for kind in kinds])


def irregularities():
    own = {key: ref("word") for key in ("alignment", "level", "cross", "gauge")}
    own.update(spectrum={"enum": [row[0] for row in rows("spectra.def", "KMP_SPECTRUM")]},
               wavelengths={"type": "array", "items": ref("number"), "minItems": 2, "maxItems": 2})
    return closed({key: own.get(key, ref("number")) for key in keys("read_irregularities.c", "irregularity_keys")})


def track():
    own = {"at": ref("word"), "rail": ref("word"), "irregularities": ref("irregularities"), "course": {"type": "array", "items": ref("piece")}}
    return closed({key: own.get(key, ref("number")) for key in keys("read_tracks.c", "track_keys")}, ["at", "rail", "gauge"])


def words(source, array):
    return {"enum": keys(source, array)}


def wheel():
    properties = {key: ref({"on": "word", "at": "word", "profile": "word"}.get(key, "number"))
                  for key in keys("read_wheels.c", "wheel_keys")}
    zone = {"type": "array", "items": ref("number"), "minItems": 2, "maxItems": 2}
    properties.update(contact=words("model_wheels.c", "kmp_contact_form_words"), creep=words("model_wheels.c", "kmp_creep_law_words"),
                      zones={"type": "array", "items": zone, "minItems": 1})
    return closed(properties, ["on", "at", "profile", "radius"])


def definitions():
    words = {"type": "array", "items": ref("word")}
    numbers = {"type": "array", "items": ref("number"), "minItems": 1}
    vector = {"type": "array", "items": ref("number"), "minItems": 3, "maxItems": 3}
    body = {"joint": ref("joint"), "mass": ref("number"), "com": ref("vector"), "points": named(ref("point")),
            "inertia": closed({key: ref("yes" if key == "as_given" else "number")
                               for key in keys("read_mass.c", "inertia_keys")})}
    axes = closed({key: ref("axis") for key in "xyz"})
    point = closed({"at": ref("vector"), "axes": ref("axes")}, ["at"])
    include = {"file": ref("word"), "prefix": ref("word"), "at": ref("word"), "offset": ref("vector"),
               "set": named(ref("number"))}
    values = {"type": ["object", "null"], "additionalProperties": ref("number")}
    either = {"anyOf": [ref("number"), ref("vector")]}
    goal = closed({key: either for key in keys("read_goals.c", "goal_keys")}, ["value"])
    goals = {"type": ["object", "null"], "additionalProperties": {"anyOf": [*either["anyOf"], goal]}}
    run = {key: ref("number") for key in keys("read_run.c", "run_keys")}
    run.update({key: ref("word") for key in ("formulation", "form", "integrator")},
               algorithm={"enum": [word for _, word in rows("dynamics.def", "KMP_DYNAMICS")]},
               change_points={"enum": [word for _, word in rows("change_points.def", "KMP_CHANGE_POINTS")]}, independent=words, outputs=words,
               until={"anyOf": [ref("word"), words]})
    return {
        "number": {"description": "a number, or an expression of numbers with units and parameters",
                   "type": ["number", "string"]},
        "word": {"type": ["string", "number"]},
        "vector": vector,
        "axis": {"anyOf": [{"type": "string", "pattern": "^-?[xyz]$"}, ref("vector")]},
        "two_axes": {"type": "array", "items": ref("axis"), "minItems": 2, "maxItems": 2},
        "axes": dict(axes, minProperties=1),
        "point": {"anyOf": [ref("vector"), point]},
        "yes": {"enum": ["yes", True]},
        "two_points": {"type": "array", "items": ref("word"), "minItems": 2, "maxItems": 2},
        "joint": joint(),
        "edge": edge(),
        "body": closed(body),
        "loop": loop(),
        "drive": drive(),
        "force": force(),
        "table": table(),
        "profile": profile(),
        "piece": piece(),
        "irregularities": irregularities(),
        "track": track(),
        "wheel": wheel(),
        "algebraic": {"anyOf": [ref("number"), closed({"of": dict(named(ref("number")), minProperties=1, maxProperties=6),
                                                      "zero": {"anyOf": [ref("number"), dict(numbers, maxItems=6)]}}, ["of", "zero"])]},
        "include": closed(include, ["file"]),
        "start": closed({"q": values, "qd": values, "hold": words, "goals": goals}),
        "run": closed(run),
    }


def schema():
    parts = {"kempe": {"enum": [1, "1"]}, "name": ref("word"), "gravity": ref("vector"),
             "closure_tolerance": ref("number"),
             "include": {"type": "array", "items": ref("include")}, "parameters": named(ref("number")),
             "tables": named(ref("table")), "profiles": named(ref("profile")), "tracks": named(ref("track")),
             "algebraic": named(ref("algebraic")),
             "ground": closed({"points": named(ref("point"))}),
             "bodies": dict(named(ref("body")), minProperties=1), "wheels": named(ref("wheel")),
             "joints": named(ref("edge")),
             "loops": named(ref("loop")),
             "drives": named(ref("drive")), "forces": named(ref("force")), "sensors": named(ref("number")),
             "start": ref("start"), "run": ref("run")}
    return {"$schema": "http://json-schema.org/draft-07/schema#", "title": "Kempe model",
            **closed(parts, ["kempe"]), "anyOf": [{"required": ["bodies"]}, {"required": ["include"]}],
            "definitions": definitions()}


if __name__ == "__main__":
    print(json.dumps(schema(), indent=2))
