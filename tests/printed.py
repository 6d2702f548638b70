#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The model as `kempe show --model --json` prints it has all its bodies, joints, points and closures: written as a model of
its own, a tree with its cuts as loops, it is printed the same.

    python3 tests/printed.py KEMPE
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
MODELS = [*sorted(ROOT.glob("examples/*/*.yaml")), *sorted(ROOT.glob("tests/models/*.yaml"))]
LEFT_OUT = {"closed_arm.yaml": ["--leave-out", "colour"]}  # a key that no reader knows
POINTS = ("ball", "revolute", "universal", "cylindrical", "prismatic", "weld", "planar", "point_on_line", "point_on_plane")


def kempe(*words):
    done = subprocess.run([KEMPE, *map(str, words)], capture_output=True, text=True, timeout=100)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return done.stdout


def points(owner):
    axes = owner.get("point_axes", {})
    return {name: {"at": at, "axes": axes[name]} if name in axes else at for name, at in owner["points"].items()}


def joint(body):
    """The joint of a body; the chain of one that is reversed is printed as it is gone through."""
    made = {"at": f"{body['parent']}.{body['at']}" if body["at"] else body["parent"], "name": body["joint"]}
    made.update({key: body[key] for key in ("to", "frame", "armature") if key in body})
    motions = body["motions"]
    if body.get("reversed"):
        made["reversed"] = "yes"
        motions = sorted(({**m, "axis": [0 - x for x in m["axis"]]} for m in motions), key=lambda m: m["coordinate"])
    if "pitch" in body:
        made.update(screw=motions[0]["axis"], pitch=body["pitch"])
    elif motions:
        made["motions"] = [{m["kind"]: m["axis"]} for m in motions]
    else:
        made["weld"] = "yes"
    names = [m["coordinate"] for m in motions]
    usual = [made["name"]] if len(names) == 1 else [f"{made['name']}.{k + 1}" for k in range(len(names))]
    if names != usual and not body.get("reversed"):
        made["coordinates"] = names
    return made


def closure(printed):
    kind = printed["kind"]
    if kind in POINTS or kind == "point_on_curve":
        made = {kind: printed["points"]}
        if kind in ("prismatic", "point_on_line", "point_on_plane"):
            made["axis"] = printed["axes"][0]
        elif "axes" in printed:
            made["axes"] = printed["axes"]
        made.update({key: printed[key] for key in ("table", "y", "z", "curve", "power") if key in printed})
        return made
    if kind == "rod":
        return {"rod": printed["points"], "length": printed["length"]}
    return None


def rewritten(printed):
    """None where closures are not between points, or a body is flexible."""
    loops = {c["name"]: closure(c) for c in printed["closures"] if c["kind"] not in ("screw", "drive", "lock")}
    if any("flexible" in b for b in printed["bodies"]) or None in loops.values() or any(c["kind"] in ("drive", "lock") for c in printed["closures"]):
        return None
    bodies = {b["name"]: {"joint": joint(b), "mass": b["mass"], "com": b["com"], "inertia": {key: x for key, x in b["inertia"].items() if x},
                          "points": points(b)} for b in printed["bodies"]}
    start = {key: printed["start"][key] for key in ("q", "qd", "hold", "goals")}
    made = {"kempe": 1, "name": printed["name"], "gravity": printed["gravity"], "tables": printed["tables"],
            "inputs": printed.get("inputs"),
            "parameters": printed["parameters"], "ground": {"points": points(printed["ground"])}, "bodies": bodies,
            "loops": loops, "start": start}
    made.update({key: printed[key] for key in ("profiles", "tracks") if key in printed})
    return {key: value for key, value in made.items() if value}


def differences(a, b, path=""):
    """The places where two printed things differ by more than the rounding of a direction brought to length one."""
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        return [d for key in a for d in differences(a[key], b[key], f"{path}.{key}")]
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        return [d for k in range(len(a)) for d in differences(a[k], b[k], f"{path}[{k}]")]
    number = all(isinstance(x, (int, float)) for x in (a, b))
    return [] if a == b or (number and abs(a - b) <= 1e-15) else [f"{path}: {a}, not {b}"]


class Printed(unittest.TestCase):
    def test_models(self):
        count = 0
        with tempfile.TemporaryDirectory() as folder:
            for path in MODELS:
                printed = json.loads(kempe("show", path, *LEFT_OUT.get(path.name, []), "--model", "--json", "-"))
                made = rewritten(printed)
                if made is None or len(printed["bodies"]) > 40:
                    continue
                copy = pathlib.Path(folder) / "copy.yaml"
                copy.write_text(json.dumps(made))
                again = json.loads(kempe("show", copy, "--model", "--json", "-"))
                for key in ("bodies", "ground", "coordinates", "closures", "start", "profiles", "tracks"):
                    with self.subTest(f"{path.relative_to(ROOT)}: {key}"):
                        self.assertEqual(differences(again.get(key), printed.get(key)), [])
                self.assertEqual(again["cuts"], [])
                count += 1
        self.assertGreaterEqual(count, 20)


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
