#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The JSON Schema: it is what schema/generate_schema.py makes, its keys are those of the reader, and where a YAML module is at
hand every example and test model fits it.

    python3 tests/schema.py
"""
import json
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "schema"))
import generate_schema  # noqa: E402

SCHEMA = json.loads((ROOT / "schema/kempe.schema.json").read_text())
TYPES = {"object": dict, "array": list, "string": str, "number": (int, float), "null": type(None)}


def has_type(value, name):
    return isinstance(value, TYPES[name]) and not (name == "number" and isinstance(value, bool))


def faults(schema, value, path="model"):
    """The faults, as sentences: the words of JSON Schema that the schema uses, and no others."""
    if "$ref" in schema:
        return faults(SCHEMA["definitions"][schema["$ref"].split("/")[-1]], value, path)
    types = schema.get("type", list(TYPES))
    found = []
    if not any(has_type(value, t) for t in ([types] if isinstance(types, str) else types)):
        return [f"{path}: {value!r} is no {types}"]
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{path}: {value!r} is none of {schema['enum']}")
    if "pattern" in schema and isinstance(value, str) and not re.search(schema["pattern"], value):
        found.append(f"{path}: {value!r} does not match {schema['pattern']}")
    for word, good in (("anyOf", lambda n: n > 0), ("oneOf", lambda n: n == 1)):
        if word in schema and not good(sum(not faults(s, value, path) for s in schema[word])):
            found.append(f"{path}: {word} of its alternatives does not fit {value!r}")
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            found.append(f"{path}: {len(value)} items")
        for k, item in enumerate(value):
            found += faults(schema.get("items", {}), item, f"{path}[{k}]")
    if isinstance(value, dict):
        if len(value) < schema.get("minProperties", 0):
            found.append(f"{path}: has no member")
        found += [f"{path}: lacks {key}" for key in schema.get("required", []) if key not in value]
        properties, more = schema.get("properties", {}), schema.get("additionalProperties", {})
        for key, item in value.items():
            found += faults(schema.get("propertyNames", {}), key, f"{path} key")
            if key not in properties and more is False:
                found.append(f"{path}: unknown key {key}")
            else:
                found += faults(properties.get(key, more or {}), item, f"{path}.{key}")
    return found


class Schema(unittest.TestCase):
    def test_is_generated(self):
        self.assertEqual(SCHEMA, json.loads(json.dumps(generate_schema.schema())), "python3 schema/generate_schema.py again")

    def test_the_reader_includes_every_table(self):
        """The tables of keys, from which the schema is made, are the arrays of the reader."""
        sources = "".join(path.read_text() for path in (ROOT / "src").rglob("*.c"))
        included = re.findall(r'#include "(?:model|rail|road)/keys/(\w+)\.def"\n +\{0\}\};', sources)
        self.assertEqual(sorted(included), sorted(path.stem for path in generate_schema.key_tables()))

    def test_mistakes_are_found(self):
        good = {"kempe": 1, "bodies": {"a": {"joint": {"revolute": "z", "at": "ground"}}}}
        self.assertEqual(faults(SCHEMA, good), [])
        for part in ({"bodies": {}}, {"mass": 1}, {"bodies": {"a": {"joint": {"at": "ground"}}}},
                     {"forces": {"f": {"joint": "a", "stops": {"upper": 1}}}}, {"gravity": [1, 2]},
                     {"loops": {"C": {"rod": ["a.P", "b.Q"]}}}, {"joints": {"C": {"screw": ["a.P", "b.Q"]}}},
                     {"joints": {"C": {"weld": ["a.P", "b.Q"], "cut": "maybe"}}}, {"bodies": {"2a": good["bodies"]["a"]}}):
            self.assertNotEqual(faults(SCHEMA, {**good, **part}), [], part)

    def test_models(self):
        try:
            import yaml
        except ImportError:
            self.skipTest("no YAML module")
        models = [*ROOT.glob("elements/*.yaml"), *ROOT.glob("examples/*/*.yaml"), *ROOT.glob("tests/models/*.yaml")]
        self.assertGreater(len(models), 5)
        for path in models:
            model = yaml.load(path.read_text(), getattr(yaml, "CBaseLoader", yaml.BaseLoader))
            if "closed_loop" in model:  # a foreign format in YAML
                continue
            with self.subTest(path.name):
                self.assertEqual(faults(SCHEMA, model), [])


if __name__ == "__main__":
    unittest.main()
