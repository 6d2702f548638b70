#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Model files in editors: a client of the protocol opens examples, types errors into them, completes, asks, renames and lays out.
Models with other names and another layout are read and simulated again. If `lsprotocol` is installed, it reads all answers by the
types of the protocol.

    python3 tests/editors.py build/dev/kempe
"""
import contextlib
import json
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
import editor_client  # noqa: E402
import runs  # noqa: E402
from editor_client import Client, Refused, edited, position_of, uri_of  # noqa: E402

ROOT = runs.ROOT
FOUR_BAR = ROOT / "examples/four_bar/four_bar.yaml"
TRAM = ROOT / "examples/tram/tram.yaml"
PENDULUM = """kempe: 1
gravity: [0, -9.81, 0]
parameters: {l: 500 mm, rho: 2 kg/m}
tables: {lift: {x: [0, 1, 2, 3], y: [0, 1, 0, 1]}}
ground: {points: {mast: [0.5, 0.3, 0]}}
bodies:
  arm:
    joint: {name: A, revolute: z, at: ground}
    mass: rho*l
    com: [l/2, 0, 0]
    inertia: {zz: 0.06}
    points: {tip: [l, 0, 0], middle: [l/2, 0, 0]}
  bob:
    joint: {name: B, revolute: z, at: arm.tip}
    mass: 1
    inertia: {zz: 0.01}
forces:
  motor: {joint: A, torque: "2 - 0.1*qd(A)"}
  pull: {line: [arm.tip, ground.mast], force: 20 N}
start: {q: {A: 20 deg, B: 10 deg}}
run: {t_end: 0.5, outputs: [q, force(motor), position(arm.tip)]}
"""


def at(text, words, inside=None):
    """The position behind some words, or of a word in them."""
    begin = text.index(words)
    return position_of(text, begin + (words.index(inside) + 1 if inside else len(words)))


def shown(path):
    """The model as the command prints it; None where it cannot be read."""
    done = subprocess.run([runs.command, "show", str(path), "--model", "--json", "-", "--quiet"], capture_output=True, text=True)
    return done.stdout if done.returncode == 0 else None


def names_of(symbols, depth=0):
    for symbol in symbols:
        if depth > 0:
            yield symbol
        yield from names_of(symbol["children"], depth + 1)


class Tree:
    """A folder in which the examples and models are, as links."""

    def __init__(self):
        self.kept = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.kept.name)
        for top in ("examples", "tests/models"):
            (self.root / top).mkdir(parents=True)
            for path in sorted((ROOT / top).rglob("*")):
                there = self.root / path.relative_to(ROOT)
                if path.is_dir():
                    there.mkdir()
                else:
                    there.symlink_to(path)

    @contextlib.contextmanager
    def changed(self, texts):
        """With other texts of some files."""
        files = [self.root / path.relative_to(ROOT) for path in texts]
        for file, text in zip(files, texts.values()):
            file.unlink()
            file.write_text(text)
        yield self.root
        for file in files:
            file.unlink()
            file.symlink_to(ROOT / file.relative_to(self.root))


class Session(unittest.TestCase):
    def setUp(self):
        self.client = Client(runs.command)
        self.addCleanup(self.client.stop)

    def tearDown(self):
        self.assertEqual(self.client.end(), 0)

    def memory(self, text, name="model"):
        """A text that is in no file."""
        self.uri = f"untitled:{name}.yaml"
        return self.client.open(self.uri, text)

    def labels(self, text, words, inside=None):
        self.memory(text)
        return self.client.labels(self.uri, at(text, words, inside))

    def hover(self, text, words, inside=None):
        self.memory(text)
        found = self.client.at("hover", self.uri, at(text, words, inside))
        return found and found["contents"]["value"]


class Protocol(unittest.TestCase):
    def started(self, **more):
        client = Client(runs.command, **more)
        self.addCleanup(client.stop)
        return client

    def refused(self, code, call, *words, **more):
        with self.assertRaises(Refused) as caught:
            call(*words, **more)
        self.assertEqual(caught.exception.code, code)

    def test_errors(self):
        client = self.started(begin=False)
        self.refused(-32002, client.ask, "textDocument/hover")
        client.ask("initialize", capabilities={})
        self.refused(-32601, client.ask, "textDocument/foldingRange")
        self.refused(-32602, client.of, "documentSymbol", "untitled:nothing")
        self.refused(-32600, client.ask, "initialize")
        client.send_bytes(b"Content-Length: 7\r\n\r\n{\"id\":1")
        self.assertEqual(client.receive()["error"]["code"], -32700)
        client.send_bytes(b"Content-Length: 8\r\n\r\n{\"id\":1}")
        self.assertEqual(client.receive()["error"]["code"], -32600)
        client.tell("$/cancelRequest", id=3)
        client.ask("shutdown")
        self.refused(-32600, client.ask, "textDocument/hover")
        client.tell("exit")
        self.assertEqual(client.process.wait(10), 0)

    def test_exit_without_shutdown(self):
        client = self.started()
        client.tell("exit")
        self.assertEqual(client.process.wait(10), 1)

    def test_no_headers(self):
        done = subprocess.run([runs.command, "language-server"], input=b"kempe: 1\n\r\n\r\n", capture_output=True)
        self.assertEqual((done.returncode, done.stdout), (2, b""))
        self.assertIn(b"Content-Length", done.stderr)
        done = subprocess.run([runs.command, "language-server", str(FOUR_BAR)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 3)
        self.assertIn("takes no file", done.stderr)

    def test_pieces(self):
        """Messages may come in any pieces."""
        client = self.started()
        body = json.dumps({"jsonrpc": "2.0", "id": "word \u00fc\U0001f600", "method": "nothing"}).encode()
        for byte in b"Content-Type: x\r\ncontent-length: %d\r\n\r\n" % len(body) + body:
            client.send_bytes(bytes([byte]))
        answer = client.receive()
        self.assertEqual((answer["id"], answer["error"]["code"]), ("word \u00fc\U0001f600", -32601))

    def test_units_of_positions(self):
        """The error is behind a character of two units in UTF-16 and four in UTF-8."""
        line = 'name: "\U0001f600", masss: 1'
        text = "{kempe: 1, " + line + "}\n"
        for encoding, unit in (("utf-16", 2), ("utf-8", 4)):
            client = self.started(encodings=(encoding,))
            self.assertEqual(client.capabilities["positionEncoding"], encoding)
            start = next(d for d in client.open("untitled:a.yaml", text) if "masss" in d["message"])["range"]["start"]
            self.assertEqual(start, {"line": 0, "character": text.index("masss") - 1 + unit})

    def test_parts_of_a_text(self):
        """Changes of ranges give the same text as the whole."""
        client = self.started()
        client.open("untitled:a.yaml", PENDULUM)
        uri = "untitled:a.yaml"
        begin, end = (dict(zip(("line", "character"), at(PENDULUM, words))) for words in ("mass: ", "mass: rho*l"))
        change = [{"range": {"start": begin, "end": end}, "text": "length"}]
        client.tell("textDocument/didChange", textDocument={"uri": uri, "version": 2}, contentChanges=change)
        by_range = client.wait(uri)
        self.assertEqual(by_range, client.change(uri, PENDULUM.replace("mass: rho*l", "mass: length")))
        self.assertIn("length", by_range[0]["message"])


class Diagnostics(Session):
    def test_sentences_of_the_reader(self):
        """All errors of every malformed model, at their places, as the command says them."""
        for path in sorted((ROOT / "tests/malformed").glob("*.yaml"))[::1 if runs.FULL else 6]:
            text = path.read_bytes()
            with contextlib.suppress(UnicodeDecodeError):
                found = self.client.open(path, text.decode())
                said = subprocess.run([runs.command, "check", str(path)], capture_output=True, text=True)
                if said.returncode == 2 and re.search("^kempe: 1", text.decode(), re.M) and "ports:" not in text.decode():
                    self.compare(path, text.decode(), said.stderr, [d for d in found if d["severity"] == 1])
                self.client.close(path)

    def compare(self, path, text, said, found):
        places = re.findall(rf"^(?:kempe: )?{re.escape(str(path))}:(\d+):(\d+): (.*)$", said, re.M)
        self.assertEqual([d["message"] for d in found], [sentence for *_, sentence in places], path.name)
        lines = re.split(r"\r\n|\r|\n", text)
        for diagnostic, (line, column, _) in zip(found, places):
            before = lines[int(line) - 1][:int(column) - 1]
            self.assertEqual(diagnostic["range"]["start"], {"line": int(line) - 1, "character": len(before.encode("utf-16-le")) // 2}, path.name)

    def test_typing(self):
        self.assertEqual(self.memory(PENDULUM), [])
        wrong = PENDULUM.replace("at: arm.tip}", "at: arm.tipp}").replace("mass: 1\n", "mass: 1 s\n")
        found = self.client.change(self.uri, wrong)
        self.assertEqual([(d["range"]["start"]["line"], d["severity"]) for d in found], [(13, 1), (14, 1)])
        self.assertIn("did you mean 'tip'", found[0]["message"])
        self.assertEqual(found[0]["range"]["end"]["character"] - found[0]["range"]["start"]["character"], len("arm.tipp"))
        broken = self.client.change(self.uri, PENDULUM.replace("inertia: {zz: 0.06}", "inertia: {zz: 0.06"))
        self.assertEqual([d["message"][:5] for d in broken], ["YAML:"])
        self.assertEqual(self.client.change(self.uri, PENDULUM), [])
        self.assertEqual(self.client.close(self.uri), [])

    def test_warnings(self):
        found = self.memory(PENDULUM.replace("rho: 2 kg/m", "rho: 2 kg/m, spare: 3"))
        self.assertEqual([(d["severity"], d["message"]) for d in found], [(2, "parameter 'spare' is not used")])

    def test_other_files(self):
        self.assertEqual(self.memory("version: '3'\nservices: [a\n"), [])
        self.assertEqual(self.memory(""), [])
        with tempfile.TemporaryDirectory() as folder:
            part, whole = pathlib.Path(folder, "part one.yaml"), pathlib.Path(folder, "whole.yaml")
            text = "kempe: 1\nbodies:\n  link: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
            whole.write_text("kempe: 1\ninclude: [{file: part one.yaml, prefix: a_}]\n")
            part.write_text(text)
            self.assertEqual(self.client.open(whole), [])
            self.assertEqual(self.client.open(part), [])
            self.client.change(part, text.replace("mass: 1", "mass: 1 m"))  # in the editor alone
            found = self.client.diagnostics.get(uri_of(whole)) or self.client.wait(uri_of(whole))
            self.assertEqual(found[0]["range"]["start"], {"line": 1, "character": 17})
            self.assertEqual(found[0]["relatedInformation"][0]["location"]["uri"], uri_of(part))

    def test_part_with_ports(self):
        self.assertEqual([d["severity"] for d in self.client.open(ROOT / "elements/gas_spring.yaml")], [3])

    def test_time(self):
        """The tram, 120 coordinates with ten included files, is read within a tenth of a second."""
        text, times = TRAM.read_text(), []
        self.assertEqual(self.client.open(TRAM), [])
        for k in range(5):
            begin = time.perf_counter()
            self.client.change(TRAM, text + "#" * k)
            times.append(time.perf_counter() - begin)
        print(f"diagnostics of the tram: {1e3 * min(times):.0f} ms", file=sys.stderr)
        self.assertLess(min(times), 0.1 if "san" not in str(runs.command) and "clang" not in str(runs.command) else 3)


class Completion(Session):
    def test_keys(self):
        labels = self.labels(PENDULUM.replace("    mass: 1\n", "    m\n"), "    m\n    inertia", "m")
        self.assertIn("mass", labels)
        self.assertIn("com", labels)
        self.assertNotIn("inertia: ", labels)
        self.assertIn("bodies", self.labels("kempe: 1\nb", "\nb"))
        self.assertIn("kempe", self.labels("k", "k"))
        flow = self.labels(PENDULUM.replace("{zz: 0.06}", "{z"), "inertia: {z")
        self.assertEqual({"xx", "yy", "zz"} - set(flow), set())
        first = self.labels("kempe: 1\nbodies:\n  arm:\n    jo", "    jo")
        self.assertIn("joint", first)
        kinds = self.labels("kempe: 1\nbodies:\n  arm:\n    joint: {name: A, ", "A, ")
        self.assertIn("revolute", kinds)
        self.assertNotIn("name", kinds)

    def test_values(self):
        for text, words, value in ((PENDULUM.replace("{t_end: 0.5,", "{t_end: 0.5, algorithm: ,"), "algorithm: ", "composite"),
                                   (PENDULUM.replace("y: [0, 1, 0, 1]", "y: [0, 1, 0, 1], method: "), "method: ", "monotone"),
                                   (PENDULUM.replace("run: {", "run: {integrator: ,"), "integrator: ", "radau"),
                                   (PENDULUM + "loops:\n  l: {weld: [arm.tip, bob], clearance: 1 mm, contact: {law: ", "law: ", "hertz")):
            self.assertIn(value, self.labels(text, words), words)

    def test_names(self):
        self.assertIn("arm", self.labels(PENDULUM.replace("at: arm.tip}", "at: }"), "B, revolute: z, at: "))
        self.assertEqual(self.labels(PENDULUM.replace("at: arm.tip}", "at: arm.}"), "at: arm."), ["tip", "middle"])
        self.assertEqual(self.labels(PENDULUM.replace("ground.mast", "ground."), "arm.tip, ground."), ["mast"])
        coordinates = self.labels(PENDULUM.replace("{joint: A, torque", "{joint: , torque"), "motor: {joint: ")
        self.assertEqual({"A", "B"} - set(coordinates), set())
        self.assertNotIn("rho", coordinates)
        self.assertEqual(set(self.labels(PENDULUM.replace("{q: {A: 20", "{q: {: 20"), "{q: {")) & {"A", "B", "l"}, {"A", "B"})
        self.assertIn("pull", self.labels(PENDULUM.replace("force(motor)", "force("), "force("))

    def test_expressions(self):
        here = PENDULUM.replace("rho*l\n", "rho*\n")
        labels = self.labels(here, "mass: rho*")
        self.assertEqual({"l", "rho", "lift", "sqrt", "saturation", "pi"} - set(labels), set())
        self.assertNotIn("arm", labels)
        torque = PENDULUM.replace("qd(A)", "distance(arm.tip, ")
        self.assertIn("ground", self.labels(torque, "distance(arm.tip, "))
        self.assertEqual(self.labels(torque.replace("tip, ", ""), "distance(arm."), ["tip", "middle"])
        self.assertEqual(set(self.labels(PENDULUM.replace("qd(A)", "qd("), "0.1*qd(")) & {"A", "B", "sin"}, {"A", "B"})

    def test_units(self):
        labels = self.labels(PENDULUM.replace("500 mm", "500 "), "l: 500 ")
        self.assertEqual({"mm", "in", "kg"} - set(labels), set())
        self.assertNotIn("rho", labels)
        self.assertIn("mm", self.labels(PENDULUM.replace("20 N", "20 N/"), "20 N/"))

    def test_elements(self):
        include = PENDULUM + "include:\n  - {file: kempe:gas_spring.yaml, prefix: g_, %s}\n"
        self.assertIn("kempe:gas_spring.yaml", self.labels(PENDULUM + "include:\n  - file: k", "file: k"))
        self.assertEqual(self.labels(include % "ports: {", "ports: {"), ["P", "Q"])
        self.assertIn("arm", self.labels(include % "ports: {P: ", "ports: {P: "))
        given = self.labels(include % "set: {}, ports: {P: arm.tip, Q: ground.mast}", "set: {")
        text = (ROOT / "elements/gas_spring.yaml").read_text()
        self.assertTrue(given)
        self.assertEqual([name for name in given if not re.search(rf"\b{name}:", text)], [])

    def test_broken_document(self):
        """Names are those of the last document that could be read."""
        self.memory(PENDULUM)
        broken = PENDULUM.replace("ground: {points", "ground: {points: {{").replace("rho*l\n", "rho*\n")
        self.client.change(self.uri, broken)
        self.assertIn("rho", self.client.labels(self.uri, at(broken, "mass: rho*")))
        self.assertEqual(self.labels("kempe: 1\n# b", "# b"), [])


class Hover(Session):
    def test_words(self):
        self.assertIn("mass, not negative (number, kg; when absent: 0)", self.hover(PENDULUM, "mass: rho", "a"))
        self.assertIn("parameter `l` = 0.5 m, line 3", self.hover(PENDULUM, "rho*l", "*"))
        self.assertIn("point `arm.tip`", self.hover(PENDULUM, "at: arm.tip", ".t"))
        self.assertIn("joint `A`", self.hover(PENDULUM, "qd(A", "("))
        self.assertIn("**qd(COORDINATE)**", self.hover(PENDULUM, "qd(A", "q"))
        self.assertIn("ground axes", self.hover(PENDULUM, "position(arm", "o"))
        self.assertIn("min(high, max(low, x))", self.hover(PENDULUM.replace("2 - 0.1", "saturation(t, 0, 1) - 0.1"), "saturation", "t"))
        self.assertIn("gravity", self.hover(PENDULUM, "[0, -9.81", "9"))
        self.assertIsNone(self.hover(PENDULUM, PENDULUM))


class Names(Session):
    def test_definition(self):
        self.memory(PENDULUM)
        found = self.client.at("definition", self.uri, at(PENDULUM, "line: [arm.tip", ".t"))
        self.assertEqual(found["range"]["start"], dict(zip(("line", "character"), position_of(PENDULUM, PENDULUM.index("tip:")))))
        uses = self.client.at("references", self.uri, at(PENDULUM, "line: [arm.tip", ".t"), context={"includeDeclaration": True})
        self.assertEqual(len(uses), PENDULUM.count("tip"))
        uses = self.client.at("references", self.uri, at(PENDULUM, "qd(A", "("), context={"includeDeclaration": False})
        self.assertEqual(len(uses), 3)
        self.assertEqual(len(self.client.at("documentHighlight", self.uri, at(PENDULUM, "qd(A", "("))), 4)

    def test_refused(self):
        self.memory(PENDULUM)
        place = at(PENDULUM, "qd(A", "(")
        for name, words in (("2x", "is not a name"), ("a b", "is not a name"), ("B", "cannot be the name here")):
            with self.assertRaises(Refused) as caught:
                self.client.at("rename", self.uri, place, newName=name)
            self.assertIn(words, str(caught.exception))
        with self.assertRaises(Refused):
            self.client.at("prepareRename", self.uri, at(PENDULUM, "gravity", "r"))
        self.client.change(self.uri, PENDULUM + "x: [")
        with self.assertRaises(Refused):
            self.client.at("rename", self.uri, place, newName="C")

    def test_same_results(self):
        """A joint and a parameter have other names: the rows of a run are the same bytes."""
        with tempfile.TemporaryDirectory() as folder:
            path, rows = pathlib.Path(folder, "pendulum.yaml"), []
            path.write_text(PENDULUM)
            self.client.open(path)
            for old, new in ((None, None), ("qd(A", "Drehgelenk"), ("rho*l", "l\u00e4nge")):
                text = path.read_text()
                if old:
                    place = position_of(text, text.index(old) + len(old) - 1)
                    changes = self.client.at("rename", path, place, newName=new)["changes"]
                    path.write_text(edited(text, changes[uri_of(path)]))
                    self.client.change(path, path.read_text())
                table = pathlib.Path(folder, "rows.csv")
                subprocess.run([runs.command, "simulate", str(path), "-o", str(table), "--quiet"], capture_output=True, check=True)
                rows.append(table.read_text().split("\n", 1))
            self.assertEqual(rows[0][1], rows[1][1])
            self.assertEqual(rows[0][1], rows[2][1])
            self.assertIn("q.Drehgelenk", rows[1][0])
            self.assertNotIn("qd(A)", path.read_text())

    def test_included_files(self):
        """A name is renamed in its file and where another one includes it, with its prefix."""
        with tempfile.TemporaryDirectory() as folder:
            link, double = pathlib.Path(folder, "link.yaml"), pathlib.Path(folder, "double.yaml")
            link.write_text("kempe: 1\nparameters: {l: 0.5}\nbodies:\n  link:\n    joint: {revolute: z, at: ground}\n    mass: 1\n"
                            "    inertia: {zz: 0.1}\n    points: {end: [l, 0, 0]}\n")
            double.write_text("kempe: 1\ninclude:\n  - {file: link.yaml, prefix: upper_}\n"
                              "  - {file: link.yaml, prefix: lower_, at: upper_link.end, set: {l: 300 mm}}\n"
                              "start: {q: {lower_link: 30 deg}}\nrun: {t_end: 1}\n")
            text, before = double.read_text(), shown(double)
            self.assertEqual(self.client.open(double), [])
            prepared = self.client.at("prepareRename", double, at(text, "q: {lower_link", "r_l"))
            self.assertEqual(prepared["placeholder"], "link")
            for words, inside, new in (("set: {l", "{", "zq1"), ("upper_link.end", ".e", "zq2"), ("q: {lower_link", "r_l", "zq3")):
                changes = self.client.at("rename", double, at(text, words, inside), newName=new)["changes"]
                self.assertEqual(set(changes), {uri_of(link), uri_of(double)})
                for path in (link, double):
                    path.write_text(edited(path.read_text(), changes[uri_of(path)]))
                text = double.read_text()
                self.assertEqual(self.client.change(double, text), [])
            self.assertIn("at: upper_zq3.zq2, set: {zq1: 300 mm}}", text)
            self.assertEqual(shown(double).replace("zq1", "l").replace("zq2", "end").replace("zq3", "link"), before)

    def test_examples(self):
        """A name of an example, at random, has another name: the model is the same but for it."""
        chance, count, tree = random.Random(66), 0, Tree()
        self.addCleanup(tree.kept.cleanup)
        files = [path for top in ("examples", "tests/models") for path in sorted((ROOT / top).rglob("*.yaml"))]
        for path in files if runs.FULL else chance.sample(files, 20):
            before = shown(path)
            if before is None or "mesh" in before:
                continue
            self.client.open(path)
            names = list(names_of(self.client.of("documentSymbol", path)))
            for symbol in chance.sample(names, min(2, len(names))):
                start = symbol["selectionRange"]["start"]
                try:
                    changes = self.client.at("rename", path, (start["line"], start["character"]), newName="zq7")["changes"]
                except Refused as refused:
                    self.assertIn("no name of the model", str(refused), f"{path}: {symbol['name']}")  # as keys of `start`
                    continue
                files = {pathlib.Path(uri[len("file://"):]): edits for uri, edits in changes.items()}
                with tree.changed({file: edited(file.read_text(), edits) for file, edits in files.items()}) as folder:
                    after = shown(folder / path.relative_to(ROOT))
                    self.assertIsNotNone(after, f"{path}: {symbol['name']}")
                    self.assertEqual(after.replace("zq7", symbol["name"]).replace(str(folder), str(ROOT)), before,
                                     f"{path}: {symbol['name']}")
                count += 1
            self.client.close(path)
        self.assertGreater(count, 5)


class Layout(Session):
    def laid_out(self, text):
        self.memory(text)
        edits = self.client.of("formatting", self.uri, options={"tabSize": 2, "insertSpaces": True})
        return edited(text, edits)

    def test_words(self):
        self.assertEqual(self.laid_out(PENDULUM), PENDULUM)
        wide = re.sub(r"^( +)", lambda m: m.group(1) * 2, PENDULUM, flags=re.M).replace("bodies:", "bodies:   # a comment   ")
        self.assertEqual(self.laid_out(wide + "\n\n\n"), PENDULUM.replace("bodies:", "bodies:   # a comment"))
        self.assertEqual(self.laid_out("kempe: 1\n\n\n\nname: |\n  a\n\n\n   b\n"), "kempe: 1\n\n\n\nname: |\n  a\n\n\n   b\n")
        self.assertEqual(self.laid_out("kempe: [1"), "kempe: [1")

    def test_examples(self):
        """Deformed by indentation and blanks, and laid out: the same model, the same comments; laid out again, the same text."""
        files, tree = sorted((ROOT / "examples").rglob("*.yaml")), Tree()
        self.addCleanup(tree.kept.cleanup)
        for path in files[::1 if runs.FULL else 5]:
            text = path.read_text()
            deformed = re.sub(r"^( +)(?=\S)", lambda m: m.group(1) * 3, text, flags=re.M).replace("\n", "  \n")
            if any(d["message"].startswith("YAML:") for d in self.memory(deformed)):  # keys behind `- ` in several lines
                deformed = text.replace("\n", "  \n")
            out = self.laid_out(deformed)
            self.assertEqual(self.laid_out(out), out, path.name)
            self.assertEqual(re.findall(r"#.*?(?=\s*$)", out, re.M), re.findall(r"#.*?(?=\s*$)", text, re.M), path.name)
            with tree.changed({path: out}) as folder:
                self.assertEqual((shown(folder / path.relative_to(ROOT)) or "").replace(str(folder), str(ROOT)), shown(path) or "", path.name)


class Outline(Session):
    def test_symbols(self):
        self.memory(PENDULUM)
        symbols = {s["name"]: s for s in self.client.of("documentSymbol", self.uri)}
        self.assertEqual([s["name"] for s in symbols["bodies"]["children"]], ["arm", "bob"])
        self.assertEqual([s["name"] for s in symbols["bodies"]["children"][0]["children"]], ["tip", "middle"])
        self.assertEqual(symbols["bodies"]["range"]["end"]["line"], 15)


class Hostile(Session):
    def test_random_edits(self):
        """No text ends the server; each request has an answer."""
        chance = random.Random(3)
        for path in (FOUR_BAR, ROOT / "tests/models/wheels.yaml", ROOT / "examples/winch/winch.yaml", ROOT / "tests/models/tracks.yaml"):
            original = path.read_text() if path.exists() else PENDULUM
            self.client.open("untitled:x.yaml", original)
            for k in range(400 if runs.FULL else 60):
                text = original if k % 20 == 0 else text  # noqa: F821
                begin = chance.randrange(len(text) + 1)
                end = min(len(text), begin + chance.choice((0, 0, 1, 3, 40)))
                put = chance.choice(["", ":", " ", "\n", "{", "[", "]", "'", '"', "&a ", "*a ", "- ", "(", ".", "port.", "\t", "|", "\u2028", "\x85",
                                     "\U0001f600", "\\", "1e999", "#", "<<: *a", "q(", "kempe: 1\n", text[end:end + 30]])
                text = text[:begin] + put + text[end:]
                self.client.change("untitled:x.yaml", text)
                place = position_of(text, chance.randrange(len(text) + 1))
                for method, more in (("completion", {}), ("hover", {}), ("definition", {}), ("documentHighlight", {}),
                                     ("references", {"context": {}}), ("rename", {"newName": "n"})):
                    with contextlib.suppress(Refused):
                        self.client.at(method, "untitled:x.yaml", place, **more)
                for method in ("documentSymbol", "formatting"):
                    self.client.of(method, "untitled:x.yaml")

    def test_texts(self):
        for text in ("kempe: 1\nbodies: &a {b: *a}\n", "kempe: 1\n" + "a: &x [" * 5, "kempe: 1\n? [a, b]\n: c\n", "kempe: 1\n---\nkempe: 1\n",
                     "kempe: 1\nx: &a [*a, *a]\n", "\ufeffkempe: 1\n", "kempe: 1\nbodies: [1, 2]\ninclude: {a: b}\nstart: 3\n",
                     "kempe: 1\ninclude: [{file: x.yaml}, 3, {file: [a]}, {file: untitled:x.yaml}]\n", "kempe: 1\r\nbodies:\r\n  a: {}\r\n",
                     "kempe: 1\n" + "\n".join(" " * k + "a:" for k in range(300)), "kempe: 1\nbodies: " + "[" * 900):
            self.client.open("untitled:x.yaml", text)
            for line in range(3):
                for method in ("completion", "hover", "definition"):
                    self.client.at(method, "untitled:x.yaml", (line, 9))
            for method in ("documentSymbol", "formatting"):
                self.client.of(method, "untitled:x.yaml")

    def test_positions(self):
        self.memory(PENDULUM)
        for place in ((10**9, 0), (0, 10**9), (3, 5)):
            self.client.at("completion", self.uri, place)
        with self.assertRaises(Refused):
            self.client.at("hover", self.uri, (-1, 0))

    def test_a_server_alone(self):
        """Without an editor that speaks to it the server ends with its input."""
        done = subprocess.run([runs.command, "language-server"], stdin=subprocess.DEVNULL, capture_output=True, timeout=20)
        self.assertEqual(done.returncode, 1)


class Types(Session):
    """Answers as another implementation of the protocol reads them."""

    def test_answers(self):
        try:
            from lsprotocol import converters, types
        except ImportError:
            self.skipTest("lsprotocol is not installed")
        converter = converters.get_converter()
        found = self.memory(PENDULUM.replace("mass: 1\n", "mass: 1 s\n"))
        self.assertEqual(len([converter.structure(d, types.Diagnostic) for d in found]), 1)
        converter.structure(self.client.capabilities, types.ServerCapabilities)
        self.memory(PENDULUM)
        place = at(PENDULUM, "line: [arm.tip", ".t")
        for method, kind in (("hover", types.Hover), ("definition", types.Location), ("prepareRename", types.PrepareRenamePlaceholder)):
            converter.structure(self.client.at(method, self.uri, place), kind)
        converter.structure(self.client.at("rename", self.uri, place, newName="end"), types.WorkspaceEdit)
        for method, kind, more in (("completion", types.CompletionItem, {}), ("references", types.Location, {"context": {"includeDeclaration": True}}),
                                   ("documentHighlight", types.DocumentHighlight, {})):
            self.assertTrue([converter.structure(each, kind) for each in self.client.at(method, self.uri, place, **more)], method)
        self.assertTrue([converter.structure(each, types.DocumentSymbol) for each in self.client.of("documentSymbol", self.uri)])


if __name__ == "__main__":
    runs.main()
