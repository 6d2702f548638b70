#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the JSON Schema of the model language (draft 7, for editors) from the tables that the reader uses:

    python3 schema/generate_schema.py > schema/kempe.schema.json
"""
import json
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[1]
NAME = "^[^\\x00-\\x40\\x5b-\\x5e\\x60\\x7b-\\x7f][^\\x00-\\x2f\\x3a-\\x40\\x5b-\\x5e\\x60\\x7b-\\x7f]*$"


def arguments(text):
    """The arguments of a macro whose opening parenthesis is the last character before the text: strings without their quotes,
    adjacent ones joined."""
    found, depth = [""], 0
    for token in re.findall(r'"(?:[^"\\]|\\.)*"|[(),]|[^"(),]+', text):
        if token in "()":
            depth += 1 if token == "(" else -1
        if depth < 0:
            return [argument.strip() for argument in found]
        if token == "," and depth == 0:
            found.append("")
        elif token[0] == '"':
            found[-1] = found[-1].lstrip() + token[1:-1].replace('\\"', '"')
        else:
            found[-1] += token.strip("\n") if found[-1] else token.strip()
    raise ValueError(text[:60])


def rows(table, macro):
    """The arguments of every row `macro(..)` of a .def table."""
    text = re.sub(r"/\*.*?\*/|^#.*?$", "", next((ROOT / "src").rglob(table)).read_text(), flags=re.S | re.M)
    return [arguments(text[match.end():]) for match in re.finditer(rf"^ *{macro}\(", text, re.M)]


def key_tables():
    """The tables of keys, those of wheels on rails too."""
    return [path for folder in ("model", "rail", "road") for path in sorted((ROOT / "src" / folder / "keys").glob("*_keys.def"))]


class Key:
    """A row of a table of keys."""

    def __init__(self, key, value, unit, absent, meaning):
        self.key, self.value, self.unit, self.absent, self.meaning = key, value, unit, absent, meaning


RUN_UNITS = {"TIME": "s", "ANGLE": "rad"}


def run_keys():
    """The options of a run that are keys of a model file."""
    for name, kind, key, *_, absent, words, more in rows("run_options.def", "KMP_RUN_OPTION"):
        if key != "NO":
            value = "names" if key == "NAMES" else "word" if kind == "TEXT" else "number"
            yield Key(name, value, RUN_UNITS.get(kind, ""), absent, words + more)


def keys(table):
    """The rows of keys/TABLE_keys.def."""
    return [*(run_keys() if table == "run" else ()), *(Key(*row) for row in rows(f"{table}_keys.def", "KMP_KEY"))]


def fields(kind):
    """The numbers of a kind of force: (key, three or one, exponents of effort, coordinate and s, required, meaning)."""
    return [(key, size == "3", [float(power) for power in powers], required == "true", meaning)
            for of, _, key, size, *powers, required, _, meaning in rows("force_kinds.def", "KMP_FIELD") if of == kind]


def described(schema, meaning):
    return {**schema, "description": meaning.replace("`", "")}


def told(row):
    """The meaning of a key with its value, its unit and what holds without it."""
    absent = {"required": "; required", "": ""}.get(row.absent, f"; when absent: {row.absent}")
    return f"{row.meaning} ({', '.join(part for part in (row.value, row.unit) if part)}{absent})"


def of_words(row):
    """The schema of a word without a list of its own: the words that its meaning has, as examples."""
    words = re.findall("`([\\w:.]+)`", row.meaning)
    return {"type": ["string", "number"], "examples": words} if words else WORD


def value_of(table, row):
    """The schema of a value: of a word the kind of name that it is, where it refers to a part of the model."""
    kind = REFERENCES.get((table, row.key))
    if kind:
        return name_of(kind)
    return of_words(row) if row.value == "word" else VALUES[row.value]


def keyed(table, more=(), **own):
    """A mapping with the keys of a table: their schemas are those of their values, or `own`."""
    properties = {row.key: described(own.get(row.key) or value_of(table, row), told(row)) for row in keys(table)}
    return closed({**dict(more), **properties}, [row.key for row in keys(table) if row.absent == "required"])


def ref(name):
    return {"$ref": f"#/definitions/{name}"}


def named(value, kind=None):
    """A mapping of names: new ones, or those of a kind."""
    return {"type": ["object", "null"], "propertyNames": name_of(kind) if kind else {"pattern": NAME}, "additionalProperties": value}


NAMES = {  # kinds of names, by which editors complete them
    "point": "a point, BODY.POINT or a body", "body": "a body, or ground", "coordinate": "a coordinate: a joint with one motion, or JOINT.k",
    "joint": "a joint", "hinge": "a joint, a loop or a drive", "wheel_of_gear": "a joint, a body or BODY.POINT", "own_point": "a point of the body",
    "table": "a table", "outline": "an outline", "profile": "a profile", "rail": "a rail, TRACK.left or TRACK.right", "road": "a road",
    "state": "a state", "interface": "an interface of the body", "output": "an output, as position(BODY.POINT)", "goal": "a coordinate, or an output", "file": "a file in the folder of the model",
    "included_file": "a model file, or kempe:NAME.yaml", "included_value": "a parameter or an input of the included file",
    "included_joint": "a joint of the included file", "included_port": "a port of the included file", "bound": "a name of the kind of the port"}
REFERENCES = {  # keys whose words are names or files: (table, key): kind
    ("bearing", "joint"): "hinge", ("cam_place", "outline"): "outline", ("closure", "table"): "table", ("outline", "polar"): "table",
    ("joint", "to"): "own_point", ("point", "interface"): "interface", ("irregularity", "alignment"): "table", ("irregularity", "level"): "table",
    ("irregularity", "cross"): "table", ("irregularity", "gauge"): "table", ("track", "rail"): "profile", ("wheel", "profile"): "profile",
    ("tyre", "on"): "road", ("contact", "outline"): "outline", ("contact", "guide"): "joint", ("surface", "profile"): "table", ("surface", "outline"): "outline",
    ("include", "file"): "included_file", ("flexible", "file"): "file", ("input", "csv"): "file", ("shape", "mesh"): "file", ("table", "csv"): "file",
    ("profile", "csv"): "file", ("profile", "file"): "file", ("tyre", "file"): "file"}


def name_of(kind):
    return ref(f"{kind}_name")


def closed(properties, required=()):
    schema = {"type": "object", "additionalProperties": False, "properties": properties}
    if required:
        schema["required"] = sorted(required)
    return schema


WORD, NUMBER = ref("word"), ref("number")
NUMBER_OR_THREE = {"anyOf": [NUMBER, ref("vector")]}
NUMBERS = {"type": "array", "items": NUMBER, "minItems": 1}
COLUMN = {"anyOf": [WORD, {"type": "array", "items": NUMBER}]}
WORDS = {"type": "array", "items": WORD}
PAIR = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}
VALUES = {  # the words of the tables of keys
    "word": WORD, "number": NUMBER, "expression": NUMBER, "point": name_of("point"), "body": name_of("body"), "coordinate": name_of("coordinate"), "rail": name_of("rail"),
    "[x, y, z]": ref("vector"), "axis": ref("axis"), "[a, b]": ref("two_axes"), "axes": ref("axes"), "`yes`": ref("yes"),
    "`1`": {"enum": [1, "1"]}, "yes or free": {"enum": ["yes", "free", True]}, "yes or no": {"enum": ["yes", "no", True, False]}, "x, y or z": {"enum": ["x", "y", "z"]}, "x, y, z, -x, -y or -z": {"enum": ["x", "y", "z", "-x", "-y", "-z"]}, "two points": ref("two_points"), "two wheels": dict(WORDS, items=name_of("wheel_of_gear"), minItems=2, maxItems=2), "path of a rope": {"type": "array", "items": {"anyOf": [name_of("point"), ref("rope_place")]}, "minItems": 2}, "[x, y]": PAIR, "corners": {"type": "array", "items": PAIR, "minItems": 2}, "path of an outline": {"type": "array", "items": {"anyOf": [PAIR, ref("outline_arc")]}, "minItems": 2}, "parts of a lift": {"type": "array", "items": ref("cam_part"), "minItems": 1}, "follower": ref("cam_follower"), "cam": ref("cam_place"), "two points or more": dict(WORDS, items=name_of("point"), minItems=2), "names": WORDS,
    "parameters": named(NUMBER), "ports declared": named({"enum": [name for name, *_ in rows("port_kinds.def", "KMP_PORT_KIND")]}), "ports bound": named({"anyOf": [name_of("bound"), dict(WORDS, items=name_of("bound"))]}, "included_port"), "set": named({"anyOf": [NUMBER, ref("input")]}, "included_value"), "joints": named({"type": "object"}, "included_joint"), "periodic": NUMBER, "outside": {"enum": ["linear", "hold", "error"]}, "points": named(ref("point")), "values": {"type": ["object", "null"], "additionalProperties": {"anyOf": [NUMBER, {"type": "null"}]}},
    "number or three": NUMBER_OR_THREE, "expression or three": NUMBER_OR_THREE, "numbers or a column": COLUMN, "rows of numbers": {"type": "array", "items": NUMBERS, "minItems": 2},
    "numbers": NUMBERS, "6 x 6 numbers": {"type": "array", "items": {"type": "array", "items": NUMBER, "minItems": 6, "maxItems": 6}, "minItems": 6, "maxItems": 6}, "expressions": {"anyOf": [NUMBER, dict(NUMBERS, maxItems=6)]}, "[shortest, longest]": PAIR, "[low, high]": PAIR,
    "one or two expressions": {"anyOf": [NUMBER, dict(NUMBERS, maxItems=2)]},
    "zones": {"type": "array", "items": PAIR, "minItems": 1}, "condition or list": {"anyOf": [NUMBER, NUMBERS]}, "joint": ref("joint"),
    "place": ref("place"), "places": {"type": "array", "items": ref("place"), "minItems": 2},
    "surface": ref("surface"), "two places or a number": {"anyOf": [NUMBER, {"type": "array", "items": ref("place"), "minItems": 2, "maxItems": 2}]},
    "shape or list": {"anyOf": [ref("shape"), {"type": "array", "items": ref("shape"), "minItems": 1}]},
    "`1` or `2`": {"enum": [1, 2, "1", "2"]}, "two points or a joint": {"anyOf": [ref("two_points"), name_of("joint")]},
    "number or two": {"anyOf": [NUMBER, {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}]},
    "flexible": ref("flexible"), "beam": ref("beam"), "section": ref("section"), "taper": {"anyOf": [ref("section"), ref("taper")]}, "stations of a taper": dict(NUMBERS, minItems=2),
    "sections of a taper": {"type": "array", "items": ref("section"), "minItems": 2}, "section numbers": ref("section_numbers"), "beam shapes": ref("beam_shapes"),
    "interfaces": {"type": "object", "minProperties": 1, "additionalProperties": {"anyOf": [WORD, {"type": "array", "items": NUMBER, "minItems": 1}]}}, "scale of a file": ref("file_units"),
    "nodes of a file": {"anyOf": [WORD, {"type": "object", "minProperties": 1, "additionalProperties": ref("vector")}]},
    "damping": ref("damping"), "two numbers": PAIR, "frame": {"enum": ["clamped", "chord", "mean"]}, "stiffening": {"enum": ["none", "first", "full"]},
    "inertia": ref("inertia"), "coordinates": {"type": "array", "items": {"type": ["string", "number", "null"]}},
}


REACTION = "with `mu`: the loop, or joint of the tree, whose reaction presses; if absent, the reaction of `joint`"


def force_element(kind):
    """The mapping of a kind of force that has one of its own."""
    properties, wanted = {}, []
    for key, three, _, required, meaning in fields(kind):
        for name in ("torque", "force") if key == "effort" else (key,):
            sided = kind == "FRICTION" and key in ("effort", "static", "mu", "mu_static")
            properties[name] = described(NUMBER_OR_THREE if three else VALUES["number or two"] if sided else NUMBER, meaning)
        if required and key != "effort":
            wanted.append(key)
    if kind == "FRICTION":
        properties["reaction"] = described(name_of("hinge"), REACTION)
    return closed(properties, wanted)


def force():
    own = {word: force_element(kind) for kind, _, place, word, _ in rows("force_kinds.def", "KMP_FORCE")
           if place == "joint" and word != "effort"}
    own["spring"] = {"anyOf": [ref("two_points"), own["spring"]]}
    return keyed("force", **own)


def contact_keys():
    laws = {"enum": list(dict.fromkeys(row[0] for row in rows("compliant_laws.def", "KMP_COMPLIANT_LAW")))}
    film = keyed("film", law={"enum": [row[0] for row in rows("film_laws.def", "KMP_FILM_LAW")]})
    corner = {"enum": ["front_upper", "front_lower", "rear_upper", "rear_lower"]}
    return keyed("contact", law=laws, film=film, corner=corner, socket=ref("two_points"), friction={"anyOf": [NUMBER, keyed("contact_friction")]})


def contact():
    ways = ("joint", "gap", "point", "sphere", "cylinder", "outline", "flat", "journal", "socket", "guide")
    return dict(contact_keys(), oneOf=[{"required": [key]} for key in ways],
                anyOf=[{"required": [key]} for key in ("restitution", "law", "force")])


def surface():
    schema = keyed("surface")
    return dict(schema, oneOf=[{"required": [key]} for key in ("plane", "sphere", "cylinder", "profile", "outline")])


def gear():
    return keyed("gear", hand={"enum": ["right", "left"]})


def rope():
    return dict(keyed("rope"), oneOf=[{"required": ["along"]}, {"required": ["around"]}])


def outline():
    return dict(keyed("outline"), oneOf=[{"required": [word]} for _, word, *_ in rows("outline_shapes.def", "KMP_OUTLINE")])


def rope_place():
    place = keyed("rope_place", turn={"enum": ["left", "right"]})
    place.pop("required", None)  # of a sphere there is no turn
    return dict(place, oneOf=[{"required": ["round", "turn"]}, {"required": ["drum", "turn"]}, {"required": ["sphere", "radius"]}])


def joint_numbers():
    return {row[1]: described(NUMBER, row[-1]) for row in rows("closure_numbers.def", "KMP_COUPLING_NUMBER")}


def joint():
    chains = dict(rows("joints.def", "KMP_JOINT"))
    pair = {"anyOf": [ref("axis"), ref("two_axes")]}
    kinds = {name: pair if "b" in chain else ref("axis") if chain else ref("yes") for name, chain in chains.items()}
    motion = {"anyOf": [{"type": "string", "pattern": "^-?[RT][123]$"}, closed({"R": ref("axis")}, ["R"]),
                        closed({"T": ref("axis")}, ["T"])]}
    motions = {"type": "array", "minItems": 1, "items": motion}
    return dict(keyed("joint", {**kinds, **joint_numbers()}, motions=motions, contact=contact_keys()), oneOf=[{"required": [key]} for key in [*chains, "motions"]])


def edge():
    """A joint between two bodies."""
    chains = dict(rows("joints.def", "KMP_JOINT"))
    chains.pop("free")
    kinds = {name: ref("two_points") for name in chains}
    kinds.update((row[0], ref("two_points")) for row in rows("cuts.def", "KMP_ALWAYS_CUT"))
    wants = {name: [chain.split("=")[1]] for name, chain in chains.items() if "=" in chain}
    return dict(keyed("edge", {**kinds, **joint_numbers()}, contact=contact_keys()), oneOf=[{"required": [name, *wants.get(name, [])]} for name in kinds])


def loop():
    kinds = {name: needs for name, needs, *_ in rows("closure_kinds.def", "KMP_CLOSURE")}
    terms = {"type": "object", "propertyNames": name_of("coordinate"), "additionalProperties": NUMBER, "minProperties": 2}
    own = {"TERMS": terms, "EXPRESSION": NUMBER, "FOLLOWER": name_of("point")}
    numbers = {row[0]: row for row in rows("closure_numbers.def", "KMP_CLOSURE_NUMBER")}
    wants = {name: [numbers[name][1]] if name in numbers else ["axes"] if needs == "TWO_AXES" else ["on"] if needs == "FOLLOWER" else []
             for name, needs in kinds.items()}
    more = {name: own.get(needs, ref("two_points")) for name, needs in kinds.items()}
    more.update({row[1]: described(NUMBER, row[-1]) for row in numbers.values()})
    return dict(keyed("closure", more, contact=contact_keys()), oneOf=[{"required": [name, *wants[name]]} for name in kinds])


def drive():
    schema = keyed("drive")
    return dict(schema, oneOf=[{"required": [key]} for key in schema["properties"] if key != "joint"])


def piece():
    """Of the course of a track."""
    schema = keyed("piece")
    kinds = [name for name in schema["properties"] if name not in ("radius", "cant")]
    return dict(schema, oneOf=[{"required": [kind] + (["radius"] if kind in ("left", "right") else [])} for kind in kinds])


def irregularities():
    return keyed("irregularity", spectrum={"enum": [row[0] for row in rows("spectra.def", "KMP_SPECTRUM")]})


def track():
    return keyed("track", irregularities=ref("irregularities"), course={"type": "array", "items": ref("piece")})


def words(source, array):
    """The strings of a list of words in a source."""
    text = next((ROOT / "src").rglob(source)).read_text()
    return {"enum": re.findall(r'"(\w+)"', re.search(rf"{array}\[[^]]*\] = \{{(.*?)\}};", text, re.S).group(1))}


def wheel():
    return keyed("wheel", contact=words("wheel_words.c", "kmp_contact_form_words"),
                 creep=words("wheel_words.c", "kmp_creep_law_words"))


def run():
    coordinates, outputs = dict(WORDS, items=name_of("coordinate")), dict(WORDS, items=name_of("output"))
    lists = {row.key: coordinates if row.key == "independent" else outputs for row in keys("run") if row.value == "names"}
    return keyed("run", **lists, algorithm={"enum": [word for _, word in rows("dynamics.def", "KMP_DYNAMICS")]},
                 change_points={"enum": [word for _, word in rows("change_points.def", "KMP_CHANGE_POINTS")]},
                 reaction_peaks={"enum": [word for _, word in rows("reaction_peaks.def", "KMP_REACTION_PEAKS")]})


def start():
    values = {key: dict(VALUES["values"], propertyNames=name_of(kind)) for key, kind in (("q", "coordinate"), ("qd", "coordinate"), ("states", "state"))}
    goals = {"type": ["object", "null"], "propertyNames": name_of("goal"), "additionalProperties": {"anyOf": [*NUMBER_OR_THREE["anyOf"], keyed("goal"), {"type": "null"}]}}
    return keyed("start", goals=goals, hold=dict(WORDS, items=name_of("coordinate")), **values)


WHEN = {"when": described(NUMBER, "the entry is absent where this is 0: a parameter, or an expression of parameters")}
OPTIONAL = ("body", "edge", "loop", "gear", "rope", "drive", "force", "contact", "bearing", "wheel")  # entries that may have it


def definitions():
    """All of them, with `when` in entries of sections."""
    return {name: dict(each, properties={**each["properties"], **WHEN}) if name in OPTIONAL else each for name, each in plain_definitions().items()}


def optional_expression():
    """An expression, or one that may be absent."""
    return {"anyOf": [NUMBER, closed({"value": NUMBER, **WHEN}, ["value", "when"])]}


def plain_definitions():
    return {
        **{f"{kind}_name": {"type": ["string", "number"], "description": meaning} for kind, meaning in NAMES.items()},
        "number": {"description": "a number, or an expression of numbers with units and parameters",
                   "type": ["number", "string"]},
        "word": {"type": ["string", "number"]},
        "vector": {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
        "axis": {"anyOf": [{"type": "string", "pattern": "^-?[xyz]$"}, ref("vector")]},
        "two_axes": {"type": "array", "items": ref("axis"), "minItems": 2, "maxItems": 2},
        "axes": dict(closed({key: ref("axis") for key in "xyz"}), minProperties=1),
        "point": {"anyOf": [ref("vector"), dict(keyed("point"), oneOf=[{"required": [word]} for word in ("at", "station", "interface", "node")])]},
        "place": {"anyOf": [name_of("own_point"), ref("vector")]},
        "shape": dict(keyed("shape"), oneOf=[{"required": [word]} for _, word, _ in rows("shape_kinds.def", "KMP_SHAPE")]),
        "yes": {"enum": ["yes", True]},
        "two_points": {"type": "array", "items": name_of("point"), "minItems": 2, "maxItems": 2},
        "joint": joint(),
        "edge": edge(),
        "inertia": keyed("inertia"),
        "body": keyed("body"),
        "flexible": keyed("flexible"),
        "beam": keyed("beam"),
        "section": dict(keyed("section"), minProperties=1, maxProperties=1), "taper": keyed("taper"),
        "section_numbers": keyed("section_number"),
        "beam_shapes": dict(keyed("beam_shape"), minProperties=1),
        "file_units": keyed("file_unit"),
        "damping": dict(keyed("damping"), minProperties=1, maxProperties=1),
        "loop": loop(),
        "gear": gear(),
        "outline": outline(), "outline_arc": keyed("outline_arc"),
        "rope": rope(),
        "rope_place": rope_place(),
        "drive": drive(),
        "force": force(),
        "contact": contact(),
        "surface": surface(),
        "bearing": keyed("bearing"),
        "input": keyed("input", method=words("signal.c", "words")),
        "state": keyed("state"),
        "cam_part": keyed("cam_part"),
        "cam_follower": keyed("cam_follower"),
        "cam_place": keyed("cam_place"),
        "table": keyed("table", method={"enum": ["spline", "linear", "monotone"]}),
        "profile": keyed("profile"),
        "piece": piece(),
        "irregularities": irregularities(),
        "track": track(),
        "wheel": wheel(),
        "sensor": optional_expression(),
        "algebraic": {"anyOf": [*optional_expression()["anyOf"], keyed("algebraic", of=dict(named(NUMBER), minProperties=1, maxProperties=6))]},
        "road": keyed("road"),
        "tyre": keyed("tyre", model={"enum": ["brush"]}, side={"enum": ["left", "right"]}, slip_angle={"enum": ["angle", "tangent"]}),
        "include": keyed("include"),
        "start": start(),
        "run": run(),
    }


def sections():
    """Schemas of the sections of a model."""
    entries = {"inputs": "input", "states": "state", "tables": "table", "profiles": "profile", "tracks": "track", "algebraic": "algebraic", "wheels": "wheel", "roads": "road", "tyres": "tyre", "joints": "edge",
               "loops": "loop", "gears": "gear", "ropes": "rope", "outlines": "outline", "drives": "drive", "forces": "force", "contacts": "contact", "bearings": "bearing", "parameters": "number", "sensors": "sensor"}
    return {**{section: named(ref(entry)) for section, entry in entries.items()}, "start": ref("start"), "run": ref("run"),
            "ground": keyed("ground"), "bodies": dict(named(ref("body")), minProperties=1),
            "include": {"type": "array", "items": ref("include")}}


def schema():
    model = keyed("model", **sections())
    return {"$schema": "http://json-schema.org/draft-07/schema#", "title": "Kempe model",
            **closed(model["properties"], ["kempe"]), "anyOf": [{"required": [section]} for section in ("bodies", "include", "ports")],
            "definitions": definitions()}


if __name__ == "__main__":
    print(json.dumps(schema(), indent=2))
