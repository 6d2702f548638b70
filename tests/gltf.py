#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Files of `kempe simulate --animation`, read by the rules of glTF 2.0: chunks, ranges of views and accessors, bounds, unit
quaternions, ascending times. Poses are compared with positions that the command computes, shapes with their volumes in closed form.
The library trimesh reads a file too, where it is installed.

    python3 tests/gltf.py build/dev/kempe [unittest arguments]
"""
import base64
import csv
import importlib.util
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
FORMAT = {5125: "I", 5126: "f"}
SINGLE = 1e-6  # rounding of single precision, of lengths about 1 m, with room for products

SHAPES = """kempe: 1
name: shapes
gravity: [0, 0, -9.81]
ground: {points: {O: [0, 0, 0]}}
bodies:
"""
VOLUMES = {  # text of a shape, its volume, the part of it that faces lack
    "box": ("{box: [0.1, 0.2, 0.3], at: [0.1, 0, 0.2], axes: {z: [0, 1, 1]}}", 0.006, 1e-6),
    "sphere": ("{sphere: 0.2, at: [0, 1, 0]}", 4 / 3 * math.pi * 0.008, 0.025),
    "ellipsoid": ("{ellipsoid: [0.1, 0.2, 0.3]}", 4 / 3 * math.pi * 0.006, 0.025),
    "cylinder": ("{cylinder: 0.5, radius: 0.1, axis: [1, 2, 3]}", math.pi * 0.005, 0.01),
    "capsule": ("{capsule: 0.5, radius: 0.1, axis: y}", math.pi * (0.005 + 4 / 3 * 0.001), 0.025),
}


def turned(q, v):
    """v by the rotation of a quaternion x, y, z, w."""
    x, y, z, w = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]]


class Scene:
    """A file, checked as it is read."""

    def __init__(self, test, path):
        data = pathlib.Path(path).read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        test.assertEqual((magic, version, length), (b"glTF", 2, len(data)))
        size, kind = struct.unpack_from("<I4s", data, 12)
        test.assertEqual((kind, size % 4), (b"JSON", 0))
        self.document = json.loads(data[20:20 + size])
        bytes_, kind = struct.unpack_from("<I4s", data, 20 + size)
        test.assertEqual((kind, 28 + size + bytes_), (b"BIN\0", len(data)))
        self.binary = data[28 + size:]
        test.assertEqual(self.document["asset"]["version"], "2.0")
        test.assertLessEqual(self.document["buffers"][0]["byteLength"], len(self.binary))
        self.values = [self.read(test, accessor) for accessor in self.document["accessors"]]
        self.nodes = {node["name"]: k for k, node in enumerate(self.document["nodes"])}
        children = [k for node in self.document["nodes"] for k in node.get("children", [])]
        test.assertEqual(sorted(children), list(range(1, len(self.document["nodes"]))))
        for node in self.document["nodes"]:
            test.assertAlmostEqual(math.hypot(*node.get("rotation", [0, 0, 0, 1])), 1, delta=SINGLE)
        self.moves = self.channels(test)

    def read(self, test, accessor):
        view, width, letter = self.document["bufferViews"][accessor["bufferView"]], WIDTH[accessor["type"]], FORMAT[accessor["componentType"]]
        test.assertEqual((view["byteOffset"] % 4, view["byteLength"]), (0, 4 * width * accessor["count"]))
        test.assertLessEqual(view["byteOffset"] + view["byteLength"], self.document["buffers"][0]["byteLength"])
        numbers = struct.unpack_from(f"<{width * accessor['count']}{letter}", self.binary, view["byteOffset"])
        rows = [numbers[k:k + width] for k in range(0, len(numbers), width)]
        for side, choose in (("min", min), ("max", max)):
            if side in accessor:
                test.assertEqual([struct.unpack("f", struct.pack("f", x))[0] for x in accessor[side]], [choose(column) for column in zip(*rows)])
        return rows

    def channels(self, test):
        """(node, path): the values at all times."""
        found = {}
        for motion in self.document.get("animations", []):
            for channel in motion["channels"]:
                sampler, target = motion["samplers"][channel["sampler"]], channel["target"]
                self.times = [t for t, in self.values[sampler["input"]]]
                test.assertTrue(all(a < b for a, b in zip(self.times, self.times[1:])))
                rows = found[target["node"], target["path"]] = self.values[sampler["output"]]
                test.assertEqual((len(rows), sampler["interpolation"]), (len(self.times), "LINEAR"))
                if target["path"] == "rotation":
                    for one, next_ in zip(rows, rows[1:]):
                        test.assertAlmostEqual(math.hypot(*next_), 1, delta=SINGLE)
                        test.assertGreater(sum(a * b for a, b in zip(one, next_)), 0)  # the shorter way
        return found

    def at(self, name, frame, point):
        """A point of a body, in the axes of the ground."""
        k = self.nodes[name]
        node = self.document["nodes"][k]
        q = self.moves[k, "rotation"][frame] if (k, "rotation") in self.moves else node["rotation"]
        p = self.moves[k, "translation"][frame] if (k, "translation") in self.moves else node["translation"]
        return [a + b for a, b in zip(p, turned(q, point))]

    def parts(self, name):
        """(points, corners, material) of each part of a body's mesh."""
        mesh = self.document["meshes"][self.document["nodes"][self.nodes[name]]["mesh"]]
        for part in mesh["primitives"]:
            corners = [k for k, in self.values[part["indices"]]]
            yield self.values[part["attributes"]["POSITION"]], [corners[k:k + 3] for k in range(0, len(corners), 3)], self.document["materials"][part["material"]]


def volume(points, triangles):
    """Of a closed surface whose triangles face outwards (Gauss)."""
    def six(a, b, c):
        return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    return sum(six(*(points[k] for k in t)) for t in triangles) / 6


class Animations(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.place.name)

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    def kempe(self, code, *words):
        done = subprocess.run([KEMPE, *map(str, words)], capture_output=True, text=True, timeout=300, cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def scene(self, model, *words):
        self.kempe(0, "simulate", model, "--quiet", "--animation", "scene.glb", *words)
        return Scene(self, self.folder / "scene.glb")

    def check_points(self, model, points, *words):
        """Points of bodies are where the table of the run has them."""
        scene = self.scene(model, "-o", "table.csv", *words)
        with open(self.folder / "table.csv") as file:
            rows = list(csv.DictReader(line for line in file if line[0] != "#"))
        self.assertEqual(len(rows), len(scene.times))
        for f in range(0, len(rows), max(len(rows) // 20, 1)):
            self.assertAlmostEqual(float(rows[f]["t"]), scene.times[f], delta=SINGLE)
            for name, point in points.items():
                expected = [float(rows[f][f"position.{name}.{axis}"]) for axis in "xyz"]
                for got, want in zip(scene.at(name.split(".")[0], f, point), expected):
                    self.assertAlmostEqual(got, want, delta=SINGLE)
        return scene

    def test_four_bar(self):
        self.kempe(0, "new", "four_bar")
        text = (self.folder / "four_bar.yaml").read_text()
        self.assertIn(" position(coupler.C),", text)
        (self.folder / "linkage.yaml").write_text(text.replace(" position(coupler.C),", " position(coupler.C), position(rocker.C),"))
        scene = self.check_points("linkage.yaml", {"coupler.C": [0.8, 0, 0], "rocker.C": [0.7, 0, 0]})
        self.assertEqual(scene.document["nodes"][0]["rotation"], [0, 0, 0, 1])  # gravity acts against y
        self.assertEqual(set(scene.nodes), {scene.document["nodes"][0]["name"], "ground", "crank", "coupler", "rocker"})
        for name in ("crank", "coupler", "rocker"):
            for points, triangles, _ in scene.parts(name):
                self.assertGreater(volume(points, triangles), 0)

    def test_data_of_the_picture(self):
        """Poses of --animation FILE.json put points of bodies where the table has them, also with a flexible body, which glTF refuses."""
        points = {"coupler.C": None, "crank.B": [0, 0.3, 0]}
        text = (ROOT / "examples/four_bar/four_bar.yaml").read_text()
        self.assertIn("run: {", text)
        (self.folder / "linkage.yaml").write_text(text.replace("run: {", f"run: {{outputs: [{', '.join(f'position({name})' for name in points)}], "))
        self.kempe(0, "simulate", "linkage.yaml", "--quiet", "--animation", "motion.json", "-o", "table.csv")
        picture = json.loads((self.folder / "motion.json").read_text())["picture"]
        frames, moving = picture["frames"], len(picture["bodies"]) - 1
        with open(self.folder / "table.csv") as file:
            rows = list(csv.DictReader(line for line in file if line[0] != "#"))
        self.assertEqual((len(rows), float(rows[-1]["t"])), (frames["count"], frames["t_end"]))
        place, turn = (struct.unpack(f"<{n * moving * frames['count']}h", base64.b64decode(frames[key])) for key, n in (("position", 3), ("rotation", 4)))
        names = [body["name"] for body in picture["bodies"]]
        for name, point in points.items():
            b = names.index(name.split(".")[0]) - 1
            point = point or next(mark[:3] for mark in picture["bodies"][b + 1]["points"] if mark[4] == "C")
            for f in range(0, len(rows), 25):
                p = [middle + frames["unit"] * x for middle, x in zip(frames["middle"], place[3 * (f * moving + b):])]
                q = [x / 32767 for x in turn[4 * (f * moving + b):4 * (f * moving + b) + 4]]
                for axis, got in zip("xyz", (x + y for x, y in zip(p, turned(q, point)))):
                    self.assertAlmostEqual(got, float(rows[f][f"position.{name}.{axis}"]), delta=2e-4)  # 16 bits of 1.2 m and of a turn
        self.kempe(0, "simulate", ROOT / "examples/flexible_pendulum/flexible_pendulum.yaml", "--t-end", "0.01", "--quiet", "--animation", "motion.json")
        self.assertIn("flexible", json.loads((self.folder / "motion.json").read_text())["picture"])

    def test_up(self):
        """Against gravity is y of the scene: of z it becomes y."""
        scene = self.scene(ROOT / "examples/stewart/stewart.yaml", "--t-end", "0.1")
        root = scene.document["nodes"][0]["rotation"]
        for got, want in zip(turned(root, [0, 0, 1]), [0, 1, 0]):
            self.assertAlmostEqual(got, want, delta=SINGLE)

    def test_springs(self):
        """A spring is a cylinder of length 1 that is moved, turned and stretched between its points."""
        text = ("kempe: 1\nname: weight\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0], P: [0.3, 0.4, 0]}}\nbodies:\n"
                "  weight: {joint: {name: s, prismatic: x, at: ground.O}, mass: 1, points: {C: [0, 0, 0]}}\n"
                "forces: {pull: {spring: [ground.P, weight.C], stiffness: 100, free_length: 0.3}}\nrun: {t_end: 0.5, outputs: [position(weight.C)]}\n")
        (self.folder / "weight.yaml").write_text(text)
        scene = self.check_points("weight.yaml", {"weight.C": [0, 0, 0]})
        spring = scene.nodes["pull"]
        node = scene.document["nodes"][spring]
        for f in range(0, len(scene.times), 10):
            ends = [[0.3, 0.4, 0], scene.at("weight", f, [0, 0, 0])]
            length = scene.moves[spring, "scale"][f][1]
            q, p = scene.moves[spring, "rotation"][f], (scene.moves.get((spring, "translation")) or [node["translation"]] * (f + 1))[f]
            other = [a + b for a, b in zip(p, turned(q, [0, length, 0]))]
            for got, want in zip(sorted([list(p), other]), sorted(ends)):
                for x, y in zip(got, want):
                    self.assertAlmostEqual(x, y, delta=2 * SINGLE)

    def test_shapes(self):
        for name, (shape, expected, lacks) in VOLUMES.items():
            with self.subTest(name):
                body = (f"  b: {{joint: {{name: A, revolute: z, at: ground.O}}, mass: 1, inertia: {{zz: 1}}, "
                        f"shape: [{shape[:-1]}, colour: '#ff8000', opacity: 0.5}}]}}\n")
                (self.folder / "shapes.yaml").write_text(SHAPES + body + "start: {qd: {A: 1}}\nrun: {t_end: 0.1}\n")
                (points, triangles, material), = self.scene("shapes.yaml").parts("b")
                self.assertTrue(0 <= 1 - volume(points, triangles) / expected <= lacks or abs(volume(points, triangles) / expected - 1) < 1e-6)
                red, green, blue, opacity = material["pbrMetallicRoughness"]["baseColorFactor"]
                self.assertEqual((red, round(green, 3), blue, opacity), (1, 0.216, 0, 0.5))  # 0x80 of sRGB in linear light
                self.assertEqual(material["alphaMode"], "BLEND")

    def test_same_bytes(self):
        model = ROOT / "examples/four_bar/four_bar.yaml"
        self.scene(model, "--t-end", "0.5")
        first = (self.folder / "scene.glb").read_bytes()
        self.scene(model, "--t-end", "0.5")
        self.assertEqual((self.folder / "scene.glb").read_bytes(), first)

    def test_refusals(self):
        model = ROOT / "examples/flexible_pendulum/flexible_pendulum.yaml"
        self.assertIn("is flexible", self.kempe(3, "simulate", model, "--t-end", "0.01", "--animation", "x.glb"))
        self.assertIn(".glb", self.kempe(3, "simulate", ROOT / "examples/four_bar/four_bar.yaml", "--animation", "x.gltf"))
        self.assertIn("cannot write", self.kempe(1, "simulate", ROOT / "examples/four_bar/four_bar.yaml", "--t-end", "0.1", "--animation", "nowhere/x.glb"))

    @unittest.skipUnless(importlib.util.find_spec("trimesh"), "trimesh is not installed")
    def test_trimesh(self):
        import trimesh
        self.scene(ROOT / "examples/stewart/stewart.yaml", "--t-end", "0.1")
        scene = trimesh.load(self.folder / "scene.glb")
        self.assertTrue(all(mesh.is_watertight for mesh in scene.geometry.values()))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
