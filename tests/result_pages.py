#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pages of results (`kempe simulate --report` and the like): made of examples, small, without anything from elsewhere,
drawn by Chromium without a complaint on a desktop, a telephone and in dark, and with the numbers of the table. Called
with the path of the command:

    python3 tests/result_pages.py build/dev/kempe [unittest arguments]

Ends with 77 (skipped) as tests/report_pages.py, whose browser and reader of pages these are.
"""
import array
import base64
import contextlib
import csv
import json
import math
import pathlib
import re
import struct
import sys
import time
import unittest
import xml.etree.ElementTree

import browser
import colour_vision
import report_pages
from browser import Screen
from report_pages import FLAT, ROOT, TELEPHONE, Page, check_by_itself, check_narrow, data_of, kempe, open_page, sampled

MARKS = {"complete": "\u2713", "complete, not checked": "\u25cb", "not trustworthy": "\u26a0\ufe0e", "stopped": "\u25a0", "failed": "\u2715"}
DESKTOP, DARK, DARK_TELEPHONE = Screen(), Screen(dark=True), Screen(width=360, height=740, dark=True)

#   name: model, options of the command, the screen
EXAMPLES = {
    "four_bar": ("examples/four_bar/four_bar.yaml", [], DESKTOP),
    "andrews": ("examples/andrews/andrews.yaml", [], TELEPHONE),
    "stewart": ("examples/stewart/stewart.yaml", [], DARK),
    "suspension": ("examples/suspension/suspension.yaml", [], DESKTOP),
    "rolling_wheel": ("examples/rolling_wheel/rolling_wheel.yaml", ["--t-end", "2"], TELEPHONE),
    "governor": ("examples/governor/governor.yaml", [], DARK),
    "quarter_car": ("examples/quarter_car/quarter_car.yaml", [], DESKTOP),
    "car_axis": ("examples/car_axis/car_axis.yaml", [], TELEPHONE),
    "n_four_bar": ("examples/n_four_bar/n_four_bar.yaml", ["--t-end", "1"], DARK),
    "driven_slider_crank": ("examples/driven_slider_crank/driven_slider_crank.yaml", ["--angle-unit", "deg"], DESKTOP),
}

# The rocker of the four-bar is driven beyond its dead centre.
LOCK = ((ROOT / "examples/four_bar/four_bar.yaml").read_text().replace("qd: {crank: 20}", "qd: {}")
        .replace("hold: [crank], ", "") + "drives: {motor: {joint: rocker, angle: t}}\n")


CYLINDER = """kempe: 1
ground: {points: {cylinder: [300 mm, -400 mm, 0]}}
bodies:
  boom: {joint: {revolute: z, at: ground}, mass: 80, com: [1, 0, 0], inertia: {zz: 30}, points: {lug: [700 mm, -50 mm, 0]}}
  barrel: {joint: {revolute: z, at: ground.cylinder}, mass: 10, com: [0.2, 0, 0], inertia: {zz: 0.2}}
  piston: {joint: {name: stroke, prismatic: x, at: barrel}, mass: 5, com: [-0.2, 0, 0], inertia: {zz: 0.1}, points: {head: [0, 0, 0]}}
  slider: {joint: {prismatic: y, at: ground.cylinder}, mass: 1}
loops: {eye: {revolute: [piston.head, boom.lug]}}
start: {q: {boom: 20 deg, barrel: 50 deg, stroke: 0.7}, hold: [boom], qd: {boom: 0.1, slider: 1}}
run: {t_end: 0.5}
"""


ROPE = """kempe: 1
ground: {points: {winch: [0, 0, 0]}}
bodies:
  boom: {joint: {name: B, revolute: z, at: ground.winch}, mass: 50, com: [1, 0, 0], inertia: {zz: 20}, points: {pulley: [2, 0, 0]}}
  hook: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 10, points: {eye: [0, 0, 0]}}
forces: {rope: {line: [ground.winch, boom.pulley, hook.eye], force: "max(2000*(distance - 3) + 200*rate, 0)"}}
start: {q: {B: 0.8, x: 1.5, y: 0.2}}
run: {t_end: 0.2}
"""


# An arm on a motor carries a second one, without a loop; a block is drawn at its root.
CHAIN = """kempe: 1
gravity: [0, 0, -9.81]
bodies:
  arm:
    joint: {name: motor, revolute: z, at: ground}
    flexible:
      beam: {length: 600 mm, young: 70 GPa, poisson: 0.3, density: 2700, section: {rectangle: [20 mm, 10 mm]}}
      shapes: {y: 2, z: 2, torsion: 1}
      damping: {ratio: 0.02}
    points: {end: {station: 600 mm}, side: {station: 300 mm, offset: [0, 60 mm, 0]}}
    shape: {box: [0.1, 0.1, 0.1]}
  forearm:
    joint: {name: elbow, revolute: y, at: arm.end}
    flexible: {beam: {length: 500 mm, young: 70 GPa, density: 2700, section: {circle: 12 mm}}, shapes: {y: 2, z: 2}, damping: {ratio: 0.02}}
    points: {tip: {station: 500 mm}}
drives: {m: {joint: motor, angle: sin(3*t)}}
run: {t_end: 0.5, outputs: [q, position(arm.end), position(arm.side), position(forearm.tip)]}
"""
# Three beams without loops: of a rectangle, of a tube with an axial shape, and without a section.
STRESSED = """kempe: 1
gravity: [800, 3, -9.81]
bodies:
  bar:
    joint: {name: A, weld: yes, at: ground}
    flexible:
      beam: {length: 0.8, young: 2 GPa, density: 1000, section: {rectangle: [w, 10 mm]}}
      shapes: {y: 2, z: 3}
    points: {a: {station: 0.2}, b: {station: 0.6}}
  pipe:
    joint: {name: B, weld: yes, at: ground}
    flexible:
      beam: {length: 0.8, young: 2 GPa, density: 1000, section: {tube: [20 mm, 16 mm]}}
      shapes: {y: 2, z: 2, axial: 1}
    points: {b: {station: 0.6}}
  bare: {joint: {name: C, weld: yes, at: ground}, flexible: {beam: {length: 0.5, EIy: 2, rhoA: 0.3}, shapes: {z: 2}}}
parameters: {w: 20 mm}
run: {t_end: 0.2, outputs: [q, section_by_shapes(bar.a), section_by_shapes(bar.b), section_by_shapes(pipe.b)]}
"""


def numbers(text):
    values = array.array("f")
    values.frombytes(base64.b64decode(text))
    if sys.byteorder == "big":
        values.byteswap()
    return values


def untimed(page):
    """All but processor times."""
    return re.sub(rb"[0-9.e+-]+ ms", b"ms", page)


def column(data, name):
    return next(c for c in data["series"]["columns"] if c["name"] == name)


class Case(report_pages.Folder):
    def make(self, command, model, *options, code=0, name="page"):
        page = self.folder / f"{name}.html"
        page.unlink(missing_ok=True)
        done = kempe(command, ROOT / model, *options, "--report", page)
        self.assertEqual(done.returncode, code, done.stderr)
        check_by_itself(self, page)
        return page

    def open(self, page, screen=DESKTOP):
        drawn, said = open_page(page, screen)
        self.assertEqual(said, [])
        self.assertEqual(drawn.tags[0][1].get("data-ready"), "yes")
        check_narrow(self, drawn, screen)
        return drawn, data_of(page)

    def run_script(self, script):
        """The value of a script in the page that was opened last."""
        value, said = browser.run(script)
        self.assertEqual(said, [])
        return value

    def page_now(self):
        """The page that was opened last, as scripts have left it."""
        return Page(browser.document())

    def figures(self, data):
        """By hand: a figure for each unit, one for angles that turn more than twice, none for constants alone."""
        found = {}
        for name in data["series"]["first"]:
            own = column(data, name)
            low, _, high, *_ = own["summary"]
            turns = name.startswith("q.") and high - low > {"rad": 4 * math.pi, "deg": 720}.get(own["unit"], math.inf)
            found.setdefault((own["unit"], turns), []).append((low, high))
        drawn = []
        for key, ranges in found.items():
            most = max(abs(x) for ends in ranges for x in ends)
            flat = [high - low <= max(1e-6 * max(abs(low), abs(high)), 1e-12 * most) for low, high in ranges]
            drawn += [] if all(flat) and not data["series"]["scattered"] else [key]
        return drawn

    def check_drawn(self, drawn, data):
        self.assertEqual(drawn.words("answer"), f"{MARKS[data['status']]}{data['answer']}")
        self.assertTrue(data["answer"].lower().startswith(f"{data['status']}: "))
        self.assertGreater(int(drawn.by_id["view"]["data-ink"]), 100)
        figures = [key for key in drawn.by_id if key.startswith("plot-")]
        fewest = min(sum(not math.isnan(y) for y in numbers(column(data, name)["values"])) for name in data["series"]["first"])
        self.assertGreater(fewest, 20)
        self.assertEqual(len(figures), len(self.figures(data)))
        for key in figures:
            self.assertGreater(int(drawn.by_id[key]["data-ink"]), 100, key)
            self.assertGreaterEqual(int(drawn.by_id[key]["data-points"]), min(101, fewest), key)
        for name in data["series"]["first"][:3]:
            self.assertIn(name, drawn.words("peaks"))
        for name in data["series"]["first"]:
            self.assertIn(name, drawn.words("extremes"))


class Colours(Case):
    """Of the style and of the scripts, as files."""

    WEB = ROOT / "src/report/web"

    def test_the_difference_is_the_published_one(self):
        for one, two, wanted in (((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425), ((50, 2.5, 0), (73, 25, -18), 27.1492),
                                 ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644), ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
                                 ((22.7233, 20.0904, -46.6940), (23.0331, 14.9730, -42.5619), 2.0373)):
            self.assertAlmostEqual(colour_vision.difference(one, two), wanted, places=4)

    def themes(self):
        """Variables of the style: light, dark."""
        light, dark = re.findall(r":root \{(.*?)\}", (self.WEB / "shared_look.css").read_text(), re.S)[:2]
        return [dict(re.findall(r"--(\w+): (#\w{6})", text)) for text in (light, dark)]

    def test_contrast_of_words(self):
        for theme in self.themes():
            for ground in ("card", "page", "tile"):
                for word in ("ink", "soft", "accent", "good", "unchecked", "bad", "warn"):
                    self.assertGreaterEqual(colour_vision.contrast(theme[word], theme[ground]), 4.5, (word, ground, theme))
        site = dict(re.findall(r'"([\w-]+)": "(#\w{6})"', (ROOT / "docs/site/conf.py").read_text()))
        for word in ("foreground-primary", "foreground-secondary", "foreground-muted", "brand-primary", "brand-content", "problematic"):
            for ground in ("background-primary", "background-secondary", "background-hover", "highlighted-background"):
                self.assertGreaterEqual(colour_vision.contrast(site[word], site[ground]), 4.5, (word, ground))

    def pairs(self):
        return re.findall(r'KMP_PLOT_COLOUR\("(#\w{6})", "(#\w{6})"\)', (ROOT / "src/output/plot_colours.def").read_text())

    def test_one_table(self):
        """Pages, plots and the pictures of the gallery and of the first page have the colours of one table, in its order."""
        plot, light = self.folder / "colours.svg", [pair[0] for pair in self.pairs()]
        self.open(self.make("simulate", "examples/four_bar/four_bar.yaml", "--t-end", "0.1", "--plot", plot, "--y", "q"))
        self.assertEqual(self.run_script("return COLOURS;"), [list(pair) for pair in self.pairs()])
        self.assertEqual(re.findall(r'class="curve" stroke="(.*?)"', plot.read_text())[:3], light[:3])
        for name, bodies in (("four_bar", 3), ("andrews", 7), ("jansen_leg", 7)):
            drawn = re.findall(r'stroke="(#\w{6})" stroke-width="6"', (ROOT / f"examples/{name}/{name}.svg").read_text())
            self.assertEqual(list(dict.fromkeys(drawn)), light[:bodies], name)
        self.assertLessEqual(set(light[:4]), set(re.findall(r"#\w{6}", (ROOT / "docs/walk.svg").read_text())))

    def test_bodies_and_curves_are_told_apart(self):
        """Twelve colours, each with a contrast of 4.5 to the card, each pair with a difference of 10 for each kind of eyes: about 1 is the
        least that a trained eye sees."""
        pairs = self.pairs()
        self.assertEqual(len(pairs), 12)
        for theme, colours in zip(self.themes(), zip(*pairs)):
            for k, colour in enumerate(colours):
                self.assertGreaterEqual(colour_vision.contrast(colour, theme["card"]), 4.5, colour)
                for eyes in colour_vision.EYES:
                    for other in colours[:k]:
                        apart = colour_vision.difference(colour_vision.lab(colour, eyes), colour_vision.lab(other, eyes))
                        self.assertGreaterEqual(apart, 10, (colour, other, eyes))

    def test_one_colour_for_a_body_and_its_curves(self):
        self.open(self.make("simulate", "examples/four_bar/four_bar.yaml"))
        told = self.run_script("""
            const legend = [...document.querySelectorAll("#names .swatch")].map((mark) => mark.style.backgroundColor), own = element("i");
            for (const name of ["q.crank", "qd.coupler", "qdd.rocker"]) own.append(swatchOf(looks.get(name).colour));
            return [legend, [...own.children].map((mark) => mark.style.backgroundColor), looks.get("lambda.C.1").colour];""")
        self.assertEqual(told[0], told[1])
        self.assertEqual(len(set(told[0])), 3)
        self.assertNotIn(told[2], [curve for curve in told[1]])

    def test_many_bodies(self):
        """More bodies than colours: the others have light lines across them, or crossed ones, in the legend and on either canvas; curves of
        one colour have other dashes. The legend has groups by the names of bodies: each is hidden whole, or alone is shown."""
        page = self.make("simulate", "examples/jansen_walker/jansen_walker.yaml", "--t-end", "0.1")
        for screen in (DESKTOP, FLAT):
            self.open(page, screen)
            told = self.run_script("""
                const marks = [...document.querySelectorAll("#names .swatch")].map((mark) => mark.style.backgroundColor + mark.className);
                const shown = () => [...document.querySelectorAll("#names .swatch")].map((mark) => mark.parentElement).filter((name) => name.getAttribute("aria-pressed") === "true").length;
                const groups = [...document.querySelectorAll("#names summary")].map((words) => words.textContent), all = () => document.querySelector("#names details button"), counts = [shown()];
                for (const shiftKey of [false, false, true, true]) {
                    all().dispatchEvent(new MouseEvent("click", { shiftKey, bubbles: true }));
                    counts.push(shown());
                }
                chooseLooks([{ members: columns.filter(({ name }) => name.startsWith("q.")) }]);
                return [marks, [...looks.values()].map(({ colour, dashes }) => colour + dashes), groups, counts];""")
            self.assertEqual((len(told[0]), len(set(told[0]))), (29, 29))
            self.assertEqual(["hatched" in told[0][k] for k in (11, 12, 23)], [False, True, True])
            self.assertIn("crossed", told[0][24])
            self.assertEqual(len(set(told[1])), len(told[1]))
            self.assertEqual(told[2], [f"{word} (7)" for word in ("rear1", "front1", "rear2", "front2")])
            self.assertEqual(told[3], [29, 22, 29, 7, 29])


class FlexibleBodies(Case):
    ROBOT = "examples/flexible_robot/flexible_robot.yaml"

    def chain(self):
        model = self.folder / "chain.yaml"
        model.write_text(CHAIN)
        return self.make("simulate", model)

    def places(self, data, name):
        """Of all frames: the place that is marked with a name, m, and the unit that they are rounded to."""
        picture, frames = data["picture"], data["picture"]["frames"]
        body = next(b for b, body in enumerate(picture["bodies"]) if "of" in body and any(p[4] == name for p in body["points"]))
        raw, moving = base64.b64decode(frames["position"]), len(picture["bodies"]) - 1
        values = struct.unpack(f"<{len(raw) // 2}h", raw)
        own = [values[3 * (f * moving + body - 1):][:3] for f in range(frames["count"])]
        return [[m + frames["unit"] * x for m, x in zip(frames["middle"], p)] for p in own], frames["unit"], body

    def check_points(self, data, **points):
        """Frames have the points of outputs, here by the names of their marks, where the outputs have them."""
        for name, point in points.items():
            own, unit, body = self.places(data, name)
            self.assertEqual(data["picture"]["bodies"][data["picture"]["bodies"][body]["of"]]["name"], point.split(".")[0])
            for k, axis in enumerate("xyz"):
                wanted = numbers(column(data, f"position.{point}.{axis}")["values"])
                self.assertEqual((len(wanted) - 1) % (len(own) - 1), 0)
                rows = wanted[::(len(wanted) - 1) // (len(own) - 1)]
                self.assertLess(max(abs(p[k] - x) for p, x in zip(own, rows)), 0.51 * unit + 1e-6)

    def check_pieces(self, data, body, count):
        """A chain of pieces in the order of places, which move apart from each other by next to nothing."""
        bodies = [b["name"] for b in data["picture"]["bodies"]]
        pieces = [line["body"] for line in data["picture"]["lines"] if line.get("of") == bodies.index(body)]
        self.assertEqual(len(pieces), count)
        for one, two in zip(pieces, pieces[1:16]):
            self.assertEqual(one[1], two[0])

    def test_chain(self):
        page = self.chain()
        _, data = self.open(page)
        with self.subTest("frames are outputs"):
            self.check_points(data, elbow="arm.end", side="arm.side", tip="forearm.tip")
            self.check_pieces(data, "arm", 17)  # and one to the point beside it
            self.check_pieces(data, "forearm", 16)
            self.assertEqual((data["picture"]["flexible"]["held"], data["picture"]["flexible"]["stiff"]), ([], ["arm"]))
        with self.subTest("bodies ride on deformations"):
            self.check_riders()

    def test_robot(self):
        page = self.make("simulate", self.ROBOT)
        for screen in (DESKTOP, TELEPHONE, FLAT):
            drawn, data = self.open(page, screen)
            self.check_drawn(drawn, data)
            flexible = data["picture"]["flexible"]
            self.assertEqual((flexible["factor"], flexible["held"]), (20, ["link_l", "link_r"]))
            self.assertEqual(drawn.words("deformed"), "deformation \u00d7 20")
            self.assertIn("by the strain of the shapes, without N/A, because no beam has axial shapes.", drawn.words("stage-note"))
            self.assertIn("of link_l and link_r only the deformation between them is multiplied", drawn.words("stage-note"))
            self.assertEqual(drawn.words("names"), "crank_llink_lcrank_rlink_rtool")
            self.assertEqual(int(drawn.by_id["view"]["data-planar"] == "true"), 1)
            if screen == DESKTOP:
                with self.subTest("slider"):
                    self.check_slider()
                with self.subTest("loops stay closed"):
                    self.check_loops()

    POSES = "const { picture } = data, motion = makeMotion(picture), own = picture.flexible.parents.length;"

    def check_riders(self):
        """However large the deformation is drawn, an arm begins where the one before it ends, and deflects from there."""
        script = self.POSES + """
            const { place } = picture.flexible.riders[0];
            return [1, 10].map((factor) => {
                const far = [], gap = [];
                picture.flexible.factor = factor;
                for (let k = 0; k <= 20; k++) {
                    const poses = motion(k / 40);
                    gap.push(norm(sub(poses[2].p, poses[own + place].p)));
                    far.push(turned([...scaled(-1, poses[1].q), poses[1].q[3]], sub(poses[own + place].p, poses[1].p)));
                }
                return { gap, far };
            });"""
        ones, tens = self.run_script(script)
        self.assertLess(max(tens["gap"]), 1e-4)
        least = max(abs(p[2]) for p in ones["far"])
        self.assertGreater(least, 1e-3)
        for one, ten in zip(ones["far"], tens["far"]):
            for k in range(3):
                self.assertAlmostEqual(ten[k] - 0.6 * (k == 0), 10 * (one[k] - 0.6 * (k == 0)), delta=1e-3)

    def check_loops(self):
        """However large the deformation is drawn, joints of a loop are where they are."""
        script = self.POSES + """
            picture.flexible.factor = 100;
            const tool = picture.bodies.findIndex(({ name }) => name === "tool"), line = picture.lines.filter(({ of }) => of);
            const pin = picture.bodies.findIndex(({ of, points }) => of && points.some((p) => p[4] === "pin")), gap = [], bent = [];
            for (let k = 0; k <= 20; k++) {
                const poses = motion(k / 50);
                gap.push(...[pin, line[15].body[1], line[31].body[1]].map((end) => norm(sub(poses[tool].p, poses[end].p))));
                bent.push(norm(sub(poses[line[7].body[1]].p, scaled(0.5, add(poses[line[0].body[0]].p, poses[line[15].body[1]].p)))));
            }
            return { gap, bent };"""
        told = self.run_script(script)
        self.assertLess(max(told["gap"]), 1e-4)
        self.assertGreater(max(told["bent"]), 0.03)

    def check_slider(self):
        script = """
            const slider = byId("deformation");
            const moved = [0, 1000].map((value) => {
                slider.value = String(value);
                for (const kind of ["input", "change"]) slider.dispatchEvent(new Event(kind));
                return byId("deformed").textContent;
            });
            document.querySelectorAll("#names button")[1].click();
            return moved;"""
        moved = self.run_script(script)
        drawn = self.page_now()
        self.assertEqual(moved, ["deformation \u00d7 1", "deformation \u00d7 100"])
        self.assertIn("title", [a for tag, a in drawn.tags if tag == "button" and a.get("title", "").startswith("Show link_l;")][0])

    def stresses(self, data, name):
        """Of a body's curve, for all frames, Pa."""
        picture, stress = data["picture"], data["picture"]["flexible"]["stress"]
        own = len(picture["flexible"]["parents"])
        count, body = len(picture["bodies"]) - own, [b["name"] for b in picture["bodies"]].index(name)
        first = next(k for k in range(count) if picture["bodies"][own + k]["of"] == body)
        raw = base64.b64decode(stress["numbers"])
        values = struct.unpack(f"<{len(raw) // 2}h", raw)
        return [[stress["most"] * x / 32767 for x in values[count * f + first:][:17]] for f in range(picture["frames"]["count"])]

    def test_stress(self):
        """Stresses of frames are those by the moments of outputs and the axial strain, at the corner of a rectangle and on the circle."""
        model = self.folder / "stressed.yaml"
        model.write_text(STRESSED)
        page = self.make("simulate", model)
        self.open(page, FLAT)
        on = "const box = byId('by-stress'); box.checked = true; box.dispatchEvent(new Event('change')); return byId('largest-stress').textContent;"
        told = [self.run_script(on)]
        drawn, data = self.open(page)
        told.append(self.run_script(on))
        frames, bar, pipe = data["picture"]["frames"]["count"], self.stresses(data, "bar"), self.stresses(data, "pipe")
        most = data["picture"]["flexible"]["stress"]["most"]

        stride = -(-(data["series"]["rows"] - 1) // (frames - 1))

        def outputs(*names):
            """By the frames of whose rows they are listed."""
            for f in range(frames - 1):
                own = [column(data, name) for name in names]
                if all(stride * f % c["every"] == 0 for c in own):
                    yield f, *(numbers(c["values"])[stride * f // c["every"]] for c in own)

        for place, k in (("a", 4), ("b", 12)):
            for f, my, mz in outputs(f"section_by_shapes.bar.{place}.My", f"section_by_shapes.bar.{place}.Mz"):
                self.assertAlmostEqual(bar[f][k], 6 / (0.02 * 0.01) * (abs(mz) / 0.02 + abs(my) / 0.01), delta=1e-3 * most)
        turns = math.pi / 32 * (0.02**4 - 0.016**4) / 0.02
        normal = []
        for f, my, mz, end in outputs("section_by_shapes.pipe.b.My", "section_by_shapes.pipe.b.Mz", "q.pipe.x1"):
            normal.append(2e9 * abs(end) / 0.8)
            self.assertAlmostEqual(pipe[f][12], math.hypot(my, mz) / turns + normal[-1], delta=1e-3 * most)
        self.assertGreater(len(normal), 20)
        self.assertGreater(max(normal), 3e-3 * most) # N is seen
        self.assertIn("No colours by stress for bare: the edges of the section are not known.", drawn.words("stage-note"))
        self.assertIn("by the strain of the shapes, with |N|/A for pipe, by axial shapes.", drawn.words("stage-note"))
        self.assertEqual(told, [f"{most / 1e6:.3g} MPa"] * 2)
        _, data = self.open(self.make("modes", model))
        self.assertGreater(max(map(max, self.stresses(data, "bar"))), 0)

    def test_modes_and_equilibria(self):
        drawn, data = self.open(self.make("modes", self.ROBOT))
        self.assertRegex(drawn.words("deformed"), "^deformation \u00d7 [0-9]+$")
        shift = data["picture"]["flexible"]["shift"]
        self.assertGreater(shift["unit"] * 32767 * data["picture"]["flexible"]["factor"], 0.005)
        model = self.folder / "sag.yaml"
        still = CHAIN.replace("revolute: z, at: ground}", "weld: yes, at: ground}")
        model.write_text(still.replace("drives: {m: {joint: motor, angle: sin(3*t)}}", ""))
        drawn, _ = self.open(self.make("equilibrium", model))
        self.assertRegex(drawn.words("deformed"), "^deformation \u00d7 [0-9]+$")

    def test_pages_without_any(self):
        text = self.make("simulate", "examples/four_bar/four_bar.yaml", "--t-end", "0.1").read_text()
        ours = text[text.rindex("<script>"):]
        for word in ("FLEXIBLE", "deform", "Places", "flexible", "stressScale"):
            self.assertNotIn(word, ours)
        self.assertNotIn("FLEXIBLE", self.make("simulate", self.ROBOT).read_text())


class Simulations(Case):
    def test_examples(self):
        for name, (model, options, screen) in sampled(EXAMPLES, 4).items():
            with self.subTest(name):
                drawn, data = self.open(self.make("simulate", model, *options, name=name), screen)
                self.check_drawn(drawn, data)
                self.assertEqual((data["status"].split(",")[0], data["stopped_at"]), ("complete", []))
                self.assertGreater(int(drawn.by_id["view"]["data-frames"]), 300)
                for plot in ["over-energy", "over-step"] + (["over-h", "over-hdot"] if data["m"] else []):
                    self.assertGreater(int(drawn.by_id[plot]["data-points"]), 5, plot)
                self.assertEqual(data["files"][0]["text"], (ROOT / model).read_text())
                self.assertIn("joint reactions", drawn.words("text"))
                if name == "four_bar":
                    self.check_names(["crank", "coupler", "rocker"], "rocker: ")
                    self.check_choice(data)

    def test_two_commands_to_the_torque_of_a_motor(self):
        """As the tutorial: a first model, and its page."""
        kempe("new", self.folder / "first")
        drawn, data = self.open(self.make("simulate", self.folder / "first.yaml"))
        self.check_drawn(drawn, data)
        self.assertIn("force.motor", data["series"]["first"])
        self.assertIn("force.motor, N m", drawn.words("extremes"))
        self.assertGreater(max(numbers(column(data, "force.motor")["values"])), 1)

    def test_requested_by_name(self):
        """Of many requested outputs the ones with a name are drawn first, and the page counts the others."""
        text = (ROOT / "examples/andrews/andrews.yaml").read_text()
        text = text.replace("run: {", "run: {outputs: [q, qd, qdd, lambda, position(K3.E), force(spring)], ")
        (self.folder / "named.yaml").write_text(text)
        drawn, data = self.open(self.make("simulate", self.folder / "named.yaml", "--t-end", "0.01"))
        first = data["series"]["first"]
        self.assertEqual(first[:4], ["position.K3.E.x", "position.K3.E.y", "position.K3.E.z", "force.spring"])
        self.assertIn("q.beta", first)
        self.assertEqual(data["series"]["requested"] - len(first), int(re.search(r"(\d+) others that the model requests", drawn.words("peaks"))[1]))

    def test_ten_outputs_of_ten_seconds(self):
        """One file below 3 MB, with every row of the table: 10 s at 100 rows a second."""
        model = "examples/four_bar/four_bar.yaml"
        page = self.make("simulate", model, "--t-end", "10", "--output-step", "0.01")
        data = data_of(page)
        self.assertGreaterEqual(len(data["series"]["columns"]), 11)
        self.assertEqual((data["series"]["rows"], data["series"]["stride"]), (1001, 1))
        self.assertLess(page.stat().st_size, 3_000_000)

    def test_numbers_are_those_of_the_table(self):
        model, table = "examples/andrews/andrews.yaml", self.folder / "andrews.csv"
        page = self.make("simulate", model, "-o", table)
        data = data_of(page)
        with table.open() as file:
            rows = list(csv.reader(file))
        step, times = 10, numbers(column(data, "t")["values"])
        self.assertEqual(len(times), 10 * (len(rows) - 2) + 1)
        for c, name in enumerate(rows[0]):
            own, values = column(data, name), [float(row[c]) for row in rows[1:]]
            if own["every"] > 1:
                continue
            size = max(map(abs, values))
            for k, value in enumerate(values):
                self.assertAlmostEqual(numbers(own["values"])[step * k], value, delta=1e-6 * size, msg=name)
            low, low_at, high, high_at, _, rms = own["summary"]
            self.assertLessEqual(low, min(values) + 1e-6 * size)
            self.assertGreaterEqual(high, max(values) - 1e-6 * size)
            self.assertTrue(0 <= low_at <= 0.03 and 0 <= high_at <= 0.03)
            self.assertLessEqual(rms, size * 1.5)

    def test_what_cannot_be_trusted(self):
        """The word is in the headline, in red, and each number is marked by whether it keeps its limit."""
        page = self.make("simulate", "examples/four_bar/four_bar.yaml", "--set", "crank=0.2", "--t-end", "60", "--rtol", "1e-3", code=5)
        drawn, data = self.open(page)
        self.check_drawn(drawn, data)
        self.assertTrue(drawn.words("answer").startswith("\u26a0\ufe0eNot trustworthy: "))
        facts = {fact["name"].split(",")[0]: fact for fact in data["facts"]}
        self.assertEqual([(name, fact["beyond"]) for name, fact in facts.items()], [("estimated error", True), ("energy error", True), ("loop gap", False)])
        self.assertEqual([facts[name]["value"].split()[1] for name in facts], ["rad", "%", "m"])
        self.assertEqual(facts["energy error"]["limit"], "0.1 %")
        self.assertGreater(float(facts["estimated error"]["value"].split()[0]), float(facts["estimated error"]["limit"].split()[0]))
        self.assertIn("do not trust", drawn.words("because").lower())
        colours = self.run_script("return ['answer', 'facts'].map((id) => getComputedStyle(byId(id)).color).concat([...document.querySelectorAll('i.beyond')].map((mark) => getComputedStyle(mark).color));")
        self.assertEqual([colours[0], *colours[2:]], ["rgb(180, 35, 24)"] * 3)
        page = self.make("simulate", "examples/four_bar/four_bar.yaml", "--t-end", "0.1", "--no-convergence-check")
        drawn, data = self.open(page)
        self.assertEqual((drawn.words("answer"), data["facts"][0]["value"]), ("\u25cbComplete, not checked: 0 to 0.1 s", "not checked"))

    def test_constants_and_turns(self):
        """The crank turns often and has an axis of its own; what is constant is named; rates are behind."""
        model = self.folder / "constant.yaml"
        text = (ROOT / "examples/four_bar/four_bar.yaml").read_text()
        model.write_text(re.sub(r"outputs: \[.*?\]", "outputs: [qd, q, position(coupler.C)]", text) if "outputs:" in text
                         else text.replace("run: {", "run: {outputs: [qd, q, position(coupler.C)], "))
        drawn, data = self.open(self.make("simulate", model))
        self.check_drawn(drawn, data)
        self.assertEqual(drawn.words("constants"), "Constant: position.coupler.C.z = 0 m")
        figures = [drawn.by_id[f"plot-{k}"]["aria-label"] for k in range(4)]
        self.assertEqual(figures, ["q.crank q.coupler rad", "q.rocker rad", "position.coupler.C.x position.coupler.C.y m", "qd.crank qd.coupler qd.rocker rad/s"])

    def test_largest_forces(self):
        """The largest size of the three components of a reaction, over all rows of the table."""
        table = self.folder / "forces.csv"
        text = (ROOT / "examples/four_bar/four_bar.yaml").read_text()
        model = self.folder / "forces.yaml"
        model.write_text(text.replace("run: {", "run: {outputs: [reaction(C)], "))
        drawn, data = self.open(self.make("simulate", model, "-o", table))
        with table.open() as file:
            rows = [[float(x) for x in row] for row in list(csv.reader(file))[1:]]
        given = data["reactions"]
        force = {row[0]: dict(zip(given["columns"], row)) for row in given["rows"]}["C"]
        most, at = max((math.hypot(*row[1:4]), row[0]) for row in rows)
        self.assertAlmostEqual(force["force"] / most, 1, delta=1e-6)
        self.assertEqual(force["force.t"], at)
        self.assertIn("C", drawn.words("joint-forces"))
        for joint in ("crank", "coupler", "rocker", "C"):
            self.assertIn(joint, drawn.words("reactions"))

    def arrows(self, t):
        """At a time: the ends of each joint's arrow in pixels, its dashes, and the pixels of a newton; and the axes of the ground."""
        told = self.run_script(f"""
            stage.seek({t});
            const ends = (path) => path.getAttribute("d").match(/-?[0-9.e-]+/g).slice(0, 4).map(Number), scale = document.querySelector(".gauge .force-scale");
            const axes = [...document.querySelectorAll(".gauge > *")].slice(0, 6).filter((part) => part.tagName !== "text").slice(0, 3);
            return {{
                joints: Object.fromEntries([...document.querySelectorAll(".gauge path.force")].map((path) => [path.dataset.joint, {{ ends: ends(path), dashed: path.getAttribute("stroke-dasharray") !== "" }}])),
                scale: scale && [scale.dataset.words, ends(scale)],
                axes: axes.map((part) => (part.tagName === "path" ? ends(part) : [0, 0, 0, 0])),
            }};""")
        if told["scale"]:
            words, (x, _, end, _) = told["scale"]
            value, unit = words.split()
            told["pixels"] = (end - x) / (float(value) * {"N": 1, "kN": 1000}[unit])
        told["axes"] = [((x2 - x1) / 20, (y2 - y1) / 20) for x1, y1, x2, y2 in told["axes"]]
        return told

    def check_arrow(self, told, joint, force):
        """From the point of the joint: the components of the force along the axes as they are seen."""
        x1, y1, x2, y2 = told["joints"][joint]["ends"]
        wanted = [told["pixels"] * sum(f * axis[k] for f, axis in zip(force, told["axes"])) for k in (0, 1)]
        self.assertAlmostEqual(x2 - x1, wanted[0], delta=0.05)
        self.assertAlmostEqual(y2 - y1, wanted[1], delta=0.05)

    def test_force_arrows(self):
        """When a force is the largest in the table of reactions, its arrow has these components, in a plane and in space."""
        cases = (("simulate", "examples/four_bar/four_bar.yaml", []), ("simulate", "examples/bricard/bricard.yaml", ["--t-end", "2"]),
                 ("inverse", "examples/driven_slider_crank/driven_slider_crank.yaml", []))
        for command, model, options in cases:
            with self.subTest(command, model=model):
                _, data = self.open(self.make(command, model, *options))
                rows = [dict(zip(data["reactions"]["columns"], row)) for row in data["reactions"]["rows"]]
                rows = [row for row in rows if row["force"] and row["kind"] != "drive"]
                self.assertGreater(len(rows), 2)
                for row in rows:
                    told = self.arrows(row["force.t"])
                    self.check_arrow(told, row["joint"], [row[f"force.{axis}"] for axis in "xyz"])
                    self.assertEqual(told["joints"][row["joint"]]["dashed"], row["unique"] == 0)
        self.assertTrue(any(row["unique"] == 0 for row in self.reactions("examples/bricard/bricard.yaml")))

    def reactions(self, model):
        data = data_of(self.make("simulate", model, "--t-end", "0.1"))["reactions"]
        return [dict(zip(data["columns"], row)) for row in data["rows"]]

    def axes_of_view(self, name):
        """The lines of the axes z and y, as x and y of the picture, where the mechanism is seen from a direction."""
        marks = self.run_script(f"""
            const choice = document.querySelector("#views select");
            choice.value = "{name}";
            choice.dispatchEvent(new Event("change"));
            const label = (name) => [...document.querySelectorAll(".gauge text")].find((text) => text.textContent === name);
            return ["y", "z"].map((name) => {{
                const line = label(name) && label(name).previousSibling.getAttribute("d");
                return line ? line.match(/-?[0-9.]+/g).slice(0, 4).map(Number) : null;
            }});""")
        return [None if mark is None else (mark[2] - mark[0], mark[3] - mark[1]) for mark in marks]

    def test_directions_of_view(self):
        """From above z points at the reader, from the front and the side upwards; the picture becomes larger."""
        self.open(self.make("simulate", "examples/stewart/stewart.yaml"))
        self.assertIsNone(self.axes_of_view("Top")[1])
        for name in ("Front", "Side"):
            _, (x, y) = self.axes_of_view(name)
            self.assertAlmostEqual(x, 0, delta=1e-3)
            self.assertAlmostEqual(y, -20, delta=1e-3)
        script = """const size = () => byId("view").clientHeight * byId("view").clientWidth, before = size(), larger = [...document.querySelectorAll("#views button")].find((b) => b.textContent === "Larger");
            larger.click();
            return [before, size(), byId("stage").clientWidth / byId("stage").parentElement.clientWidth];"""
        before, after, part = self.run_script(script)
        self.assertGreater(after, 1.6 * before)
        self.assertGreater(part, 0.99)

    def test_an_earlier_run(self):
        """The curves of --against are dotted behind those of the run, with the numbers of its file, in the units of the page."""
        model, table = "examples/four_bar/four_bar.yaml", str(self.folder / "earlier.csv")
        kempe("simulate", ROOT / model, "--t-end", "0.5", "--set", "crank_mass=2", "-o", table)
        _, data = self.open(self.make("simulate", model, "--t-end", "1", "--against", table, "--angle-unit", "deg"))
        told = self.run_script("""const set = Object.values(plots).flatMap((plot) => plot.data.datasets).find((set) => set.borderDash && set.column && set.column.name.startsWith("q.rocker of"));
            return [set.column.name, set.data.map(({ x, y }) => [x, y])];""")
        with open(table) as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(told[0], f"q.rocker of {table}")
        self.assertEqual(len(told[1]), len(rows))
        for (t, q), row in zip(told[1], rows):
            self.assertAlmostEqual(t, float(row["t"]), delta=1e-6)
            self.assertAlmostEqual(q, math.degrees(float(row["q.rocker"])), delta=1e-4)

    def test_times_of_an_earlier_run(self):
        """The first lines of the page name the times that are in both runs, where some are not; two runs that do not meet are refused."""
        model, table = "examples/four_bar/four_bar.yaml", self.folder / "earlier.csv"
        kempe("simulate", ROOT / model, "--t-end", "0.5", "-o", table)
        done = kempe("simulate", ROOT / model, "--t-end", "1", "--against", table, "--report", self.folder / "p.html")
        told = f"'{table}' has times from 0 to 0.5 s, this run from 0 to 1 s: its dotted curves are drawn from 0 to 0.5 s"
        self.assertEqual((done.returncode, told in done.stderr), (0, True), done.stderr)
        self.open(self.folder / "p.html")
        said = self.run_script("return document.body.innerText.split('\\n').slice(0, 24).join(' ');")
        self.assertIn("its dotted curves are drawn from 0 to 0.5 s", said.replace("\u2009", " ").replace("\u00a0", " "))
        done = kempe("simulate", ROOT / model, "--t-end", "0.5", "--against", table, "--report", self.folder / "p.html")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        rows = table.read_text().splitlines()
        table.write_text("\n".join([rows[0], *("9" + row for row in rows[1:])]) + "\n")  # from 90 s on
        (self.folder / "q.html").unlink(missing_ok=True)
        done = kempe("simulate", ROOT / model, "--t-end", "1", "--against", table, "--report", self.folder / "q.html")
        self.assertEqual((done.returncode, (self.folder / "q.html").exists()), (2, False), done.stderr)
        self.assertIn("this run from 0 to 1 s: they do not meet, and nothing can be compared", done.stderr)
        table.write_text("\n".join([rows[0], rows[1].replace("0", "-1", 1), rows[-1].replace("0.5", "9", 1)]) + "\n")  # no row within the run
        self.open(self.make("simulate", model, "--t-end", "1", "--against", str(table)))
        drawn = self.run_script("return Object.values(plots).flatMap((plot) => plot.data.datasets).filter((set) => set.borderDash && set.column?.name.includes(' of ')).map((set) => set.data.length);")
        self.assertEqual(set(drawn), {2})

    def test_scale_in_the_units_of_the_page(self):
        self.open(self.make("simulate", "examples/four_bar/four_bar.yaml", "--units", "us"))
        words, pixels = self.run_script("""const line = [...document.querySelector(".gauge").querySelectorAll("path")].map((one) => /v6h([\\d.]+)v-6$/.exec(one.getAttribute("d"))).find(Boolean);
            return [document.querySelector(".gauge").dataset.scale, Number(line[1])];""")
        self.assertRegex(words, r"^[125]0* in$")
        self.open(self.make("simulate", "examples/four_bar/four_bar.yaml"))
        metric, wide = self.run_script("""const line = [...document.querySelector(".gauge").querySelectorAll("path")].map((one) => /v6h([\\d.]+)v-6$/.exec(one.getAttribute("d"))).find(Boolean);
            return [document.querySelector(".gauge").dataset.scale, Number(line[1])];""")
        metres = float(metric.split()[0]) * (1e-3 if metric.endswith("mm") else 1)
        self.assertAlmostEqual(float(words.split()[0]) * 0.0254 / pixels, metres / wide, delta=1e-3 * metres / wide)

    def test_video(self):
        """The button gives a file of the recording, which a second click ends."""
        self.open(self.make("simulate", "examples/four_bar/four_bar.yaml"))
        browser.running.call("Emulation.setVirtualTimePolicy", browser.running.tab, policy="advance")  # which stands still once a page is drawn
        self.run_script("""URL.createObjectURL = (blob) => {
                blob.arrayBuffer().then((bytes) => (window.recording = [blob.type, bytes.byteLength, ...new Uint8Array(bytes).slice(0, 4)]));
                return "#";
            };
            window.video = [...document.querySelectorAll("#views button")].find((b) => b.textContent === "Video");
            video.click();""")
        time.sleep(1)
        self.run_script("video.click();")
        given, deadline = None, time.monotonic() + 30
        while given is None and time.monotonic() < deadline:
            time.sleep(0.05)
            given = self.run_script("return window.recording || null;")
        self.assertTrue(given[0].startswith("video/webm"), given)
        self.assertGreater(given[1], 5000)
        self.assertEqual(given[2:], [0x1A, 0x45, 0xDF, 0xA3])  # the first element of a Matroska file, RFC 8794

    def test_places_and_switch_of_arrows(self):
        """Arrows begin at the joints: the distances of their points are those of the model. A box hides them."""
        self.open(self.make("simulate", "examples/four_bar/four_bar.yaml"))
        place = {name: arrow["ends"][:2] for name, arrow in self.arrows(1)["joints"].items()}
        self.assertAlmostEqual(math.dist(place["crank"], place["coupler"]) / math.dist(place["crank"], place["rocker"]), 0.3 / 0.9, delta=1e-3)
        self.assertAlmostEqual(math.dist(place["C"], place["coupler"]) / math.dist(place["crank"], place["rocker"]), 0.8 / 0.9, delta=1e-3)
        self.run_script("byId('by-force').click();")
        told = self.arrows(1)
        self.assertEqual((told["joints"], told["scale"]), ({}, None))

    def test_arrows_of_elements(self):
        """The arrow of a contact has the force of the page's curve; one of a tyre begins in its patch."""
        _, data = self.open(self.make("simulate", "examples/geneva_drive/geneva_drive.yaml"))
        t, force = (numbers(column(data, name)["values"]) for name in ("t", "force.pin"))
        k = min(range(len(t)), key=lambda k: abs(t[k] - 0.78))
        self.assertGreater(force[k], 1)
        told = self.arrows(t[k])
        (x1, y1, x2, y2) = told["joints"]["pin"]["ends"]
        self.assertAlmostEqual(math.hypot(x2 - x1, y2 - y1) / told["pixels"] / force[k], 1, delta=2e-3)
        self.open(self.make("simulate", "examples/quarter_car_on_tyre/quarter_car_on_tyre.yaml"))
        told = self.arrows(0.21)
        self.assertTrue({"T.Fz", "wheel"} <= set(told["joints"]))
        patch = self.run_script("return document.querySelector('.gauge .patch').getAttribute('d').match(/-?[0-9.e-]+/g).map(Number);")
        middle = [sum(patch[k::2]) / 4 for k in (0, 1)]
        self.assertLess(math.dist(middle, told["joints"]["T.Fz"]["ends"][:2]), 0.5)

    def test_drawn_elements(self):
        """A belt lies on its wheels, with the length of an open belt; a road with a height and the profile of a cam are those of the model."""
        model = self.folder / "belt.yaml"
        model.write_text("""kempe: 1
ground: {points: {A: [0, 0, 0], B: [0.4, 0, 0]}}
bodies:
  a: {joint: {revolute: z, at: ground.A}, mass: 1, inertia: {zz: 2e-4}, points: {C: [0, 0, 0]}}
  b: {joint: {revolute: z, at: ground.B}, mass: 1, inertia: {zz: 5e-3}, points: {C: [0, 0, 0]}}
ropes: {belt: {around: [{round: a.C, radius: 50 mm, turn: left, grip: yes}, {round: b.C, radius: 120 mm, turn: left, grip: yes}], axial_stiffness: 60 kN, preload: 300 N}}
forces: {motor: {joint: a, torque: 4}}
run: {t_end: 0.02}
""")
        self.open(self.make("simulate", model))
        length = self.run_script("""
            const m = makeMechanism(data.picture), poses = m.motion(0.01);
            return m.ropes.map((rope) => ropePoints(rope, poses, m.ropes)).flatMap((list) => list.slice(1).map((p, k) => norm(sub(p, list[k])))).reduce((a, b) => a + b);""")
        lean = math.asin(0.07 / 0.4)
        self.assertAlmostEqual(length / (0.8 * math.cos(lean) + math.pi * 0.17 + 2 * lean * 0.07), 1, delta=2e-3)
        _, data = self.open(self.make("simulate", "examples/quarter_car_on_tyre/quarter_car_on_tyre.yaml"))
        (road,) = [surface for surface in data["picture"]["surfaces"] if surface["kind"] == "strip"]
        for x, _, z in road["points"]:
            self.assertAlmostEqual(z, 0.015 * (1 - math.cos(2 * math.pi * (x - 2) / 1.2)) if 2 < x < 3.2 else 0, delta=1e-6)
        self.assertTrue(road["points"][0][0] < 0 and road["points"][-1][0] > 9)
        _, data = self.open(self.make("simulate", "examples/valve_train/valve_train.yaml"))
        lines = {surface["kind"]: surface for surface in data["picture"]["surfaces"]}
        roller, pitch = lines["cylinder"]["radius"], lines["pitch"]["points"]
        for p in lines["curve"]["points"]:
            self.assertAlmostEqual(min(math.dist(p, q) for q in pitch) / roller, 1, delta=0.02)
        parts = self.run_script("const m = makeMechanism({ ...data.picture }); m.thick = 1e-3; return partsOf(m, 1).map(({ kind }) => kind);")
        self.assertEqual([parts.count("profile"), parts.count("curve")], [1, 2])

    def test_many_arrows(self):
        """Of many joints arrows are drawn by choice; the page tells of those without."""
        drawn, data = self.open(self.make("simulate", "examples/tram/tram.yaml", "--t-end", "0.2"))
        arrows = data["picture"]["arrows"]
        self.assertEqual((len(arrows["rows"]), self.arrows(0.1)["joints"]), (40, {}))
        self.assertGreater(arrows["left_out"], 0)
        self.assertIn("Forces in joints (the 40 largest)", drawn.words("stage"))
        self.run_script("byId('by-force').click();")
        self.assertGreater(len(self.arrows(0.1)["joints"]), 20)

    def test_long_motions(self):
        """The page begins with the last of many periods, as the lengths between maxima of the table say; a strip moves the range, and a
        button shows it whole. Few periods are all shown."""
        model, told = "examples/four_bar/four_bar.yaml", "return [range, wholeRange(), byId('strip').dataset.window, byId('overview').hidden];"
        drawn, data = self.open(self.make("simulate", model, "--t-end", "40"))
        count = int(re.search(r"The last (\d+) periods are shown", drawn.words("curves-note"))[1])
        shown, whole, window, hidden = self.run_script(told)
        self.assertEqual((shown[1], whole, hidden), (40, [0, 40], False))
        t, q = (numbers(column(data, name)["values"]) for name in ("t", "q.rocker"))
        peaks = [t[k] for k in range(1, len(t) - 1) if t[k] > shown[0] and q[k - 1] < q[k] >= q[k + 1]]
        self.assertLess(abs(len(peaks) - count), 2)
        self.assertAlmostEqual((peaks[-1] - peaks[0]) / (len(peaks) - 1), (40 - shown[0]) / count, delta=0.02)
        moved, *_ = self.run_script("""
            const strip = byId("strip"), box = strip.getBoundingClientRect();
            strip.setPointerCapture = () => {};
            for (const [kind, part] of [["pointerdown", 0.25], ["pointerup", 0.5]]) strip.dispatchEvent(new PointerEvent(kind, { clientX: box.left + part * box.width }));
            """ + told)
        for found, wanted in zip(moved, (10, 20)):
            self.assertAlmostEqual(found, wanted, delta=0.05)
        all_of_it, _, _, hidden = self.run_script("byId('whole').click();" + told)
        self.assertEqual((all_of_it, hidden), ([0, 40], True))
        drawn, _ = self.open(self.make("simulate", model, "--t-end", "4"))
        self.assertNotIn("periods", drawn.words("curves-note"))

    def test_surfaces(self):
        """Surfaces of contacts, curves, ropes: planes are below all that moves, curves have their points."""
        cases = {"tests/models/contact_round.yaml": {"sphere", "cylinder", "curve"}, "tests/models/beads.yaml": {"path"}, "examples/bowling_ball/bowling_ball.yaml": {"plane"}}
        for model, kinds in cases.items():
            with self.subTest(model):
                _, data = self.open(self.make("simulate", model, "--t-end", "0.5"))
                self.assertLessEqual(kinds, {surface["kind"] for surface in data["picture"]["surfaces"]})
                told = self.run_script("""
                    const m = makeMechanism(data.picture);
                    return [m.surfaces.map(({ kind, points }) => [kind, points ? points.length : 0]), m.discs.length, ink(byId("view"))];""")
                for kind, count in told[0]:
                    self.assertIn(count, {"plane": [4], "sphere": [0], "curve": range(60, 121)}[kind])
                self.assertEqual(told[1] > 0, "cylinder" in kinds)
        rope = self.folder / "rope.yaml"
        rope.write_text(ROPE)
        _, data = self.open(self.make("simulate", rope))
        self.assertEqual([(line["rod"], line["name"]) for line in data["picture"]["lines"]], [(True, "rope")] * 2)

    def test_where_a_run_stops(self):
        model = self.folder / "lock.yaml"
        model.write_text(LOCK)
        drawn, data = self.open(self.make("simulate", model, code=1, name="lock"))
        self.check_drawn(drawn, data)
        self.assertEqual((data["status"], data["stopped_at"]), ("stopped", ["rocker"]))
        self.assertIn("limit position", drawn.words("because"))
        times, crank = (numbers(column(data, name)["values"]) for name in ("t", "qd.crank"))
        end = times[-1]
        self.assertGreater(len(times), 500, "a run that ends early has many rows, too")
        self.assertGreater(crank[-1], 1e4, "the rate at the lock")
        self.assertAlmostEqual(column(data, "qd.crank")["summary"][2] / crank[-2], 1, places=5)
        self.assertAlmostEqual(end, 0.7068008, places=5)
        self.assertAlmostEqual(data["picture"]["frames"]["t_end"], end, places=6)
        self.assertIn(f"Stopped: at t = {end:.3f}"[:-1], drawn.words("answer"))

    def test_what_never_moves(self):
        """A condition that changes back and forth at the start; loops that cannot be closed."""
        for model, mark in (("tests/models/friction_loop.yaml", "A"), ("tests/models/robotran.yaml", "glue")):
            with self.subTest(model):
                drawn, data = self.open(self.make("simulate", model, code=1))
                self.assertEqual(data["status"], "failed")
                self.assertIn(mark, data["stopped_at"])
                self.assertGreater(int(drawn.by_id["view"]["data-ink"]), 100)

    def check_choice(self, data):
        """Another output, a range and a place are taken over by curves, table and animation."""
        told = self.run_script("""
            byId("choice").open = true;
            listChoices();
            document.querySelector("[data-column='energy.kinetic']").click();
            zoom([1, 2]);
            stage.seek(1.5);
            const { min, max } = plots["plot-0"].scales.x;
            return [byId("clock").textContent, min, max, document.querySelector("#extremes [data-column='q.crank']").textContent];""")
        drawn = self.page_now()
        self.assertIn("energy.kinetic", drawn.words("extremes"))
        self.assertEqual(told[:3], ["1.500 s", 1, 2])
        crank = numbers(column(data, "q.crank")["values"])
        self.assertAlmostEqual(float(told[3]), crank[round(1.5 / 5 * (len(crank) - 1))], delta=1e-3)

    # In the page: how much is drawn, and what the pointer is told over places of the picture, `count` a side, until all patterns are found.
    POINTER = """
        stage.seek(0);
        const view = byId("view"), all = ink(view), box = view.getBoundingClientRect();
        const found = (wanted, count) => {
            const told = new Set();
            for (let k = 0; k < count * count && !wanted.every((pattern) => [...told].some((line) => line.match(pattern))); k++) {
                const clientX = box.left + (k % count) / count * box.width, clientY = box.top + Math.floor(k / count) / count * box.height;
                view.dispatchEvent(new PointerEvent("pointermove", { clientX, clientY }));
                told.add(document.querySelector(".label-at").textContent);
            }
            return [...told];
        };"""

    def check_names(self, bodies, joint):
        """A body is switched off and on, bodies and a joint tell their names to the pointer, and the scale is that of the picture."""
        over, off, on = self.run_script(self.POINTER + f"""
            const names = () => [...document.querySelectorAll("#names button")], over = found({[*(f"^{name}$" for name in bodies), joint]}, 60);
            const switched = () => {{ names()[1].click(); return [ink(view) / all, names()[1].getAttribute("aria-pressed")]; }};
            return [over, switched(), switched()];""")
        drawn = self.page_now()
        self.assertLess(off[0], 1)
        self.assertEqual((off[1], on), ("false", [1, "true"]))
        for name in bodies:
            self.assertIn(name, over)
        self.assertIn(joint, "|".join(over))
        gauge = next(a for tag, a in drawn.tags if a.get("class") == "gauge")
        self.assertRegex(gauge["data-scale"], r"^[125]0* (mm|m)$")

    def test_animation_begins_by_itself(self):
        """But not for readers who ask for less motion."""
        page = self.make("simulate", "examples/four_bar/four_bar.yaml")
        for screen in (Screen(plays=True), FLAT):
            with self.subTest(screen):
                drawn, _ = self.open(page, screen)
                self.assertEqual(drawn.words("play"), "\u275a\u275a" if screen.plays else "\u25b6")
                self.assertEqual(float(drawn.words("clock").split()[0]) > 0, screen.plays)
        self.check_names(["crank", "coupler", "rocker"], "rocker: ")

    def test_shapes(self):
        """Solids are drawn on either kind of canvas, also of the ground; they tell the name of their body, and go with it."""
        page = self.make("simulate", "tests/models/shapes.yaml", "--t-end", "0.2")
        for screen in (DESKTOP, FLAT, DARK_TELEPHONE):
            with self.subTest(screen):
                self.open(page, screen)
                over, solids, left = self.run_script(self.POINTER + """
                    const over = found(["^ground$", "^arm$", "^rod$"], 20), solids = data.picture.bodies.map((body) => body.solids.map((solid) => solid.kind).join()).join("|");
                    byId("names").children[0].click();
                    return [over, solids, ink(view) / all];""")
                self.assertEqual(solids, "cylinder,box|box,cylinder,cylinder,line|capsule,sphere,line,mesh")
                for name in ("ground", "arm", "rod"):
                    self.assertIn(name, over)
                self.assertLess(left, 0.95)

    def test_a_large_mesh(self):
        """204,160 triangles: the page stays small, says what it shows, and the mass is that of all."""
        rings, sides, model = 320, 320, self.folder / "ball.yaml"
        rings_of = [[struct.pack("<3f", math.sin(v) * math.cos(u), math.sin(v) * math.sin(u), -math.cos(v)) for u in (2 * math.pi * k / sides for k in [*range(sides), 0])]
                    for v in (math.pi * i / rings for i in range(1, rings))]
        rings_of = [[struct.pack("<3f", 0, 0, -1)] * (sides + 1), *rings_of, [struct.pack("<3f", 0, 0, 1)] * (sides + 1)]
        faces = []
        for i, (low, high) in enumerate(zip(rings_of, rings_of[1:])):
            faces += [low[k] + low[k + 1] + high[k + 1] for k in range(sides) if i > 0]
            faces += [low[k] + high[k + 1] + high[k] for k in range(sides) if i < rings - 1]
        (self.folder / "ball.stl").write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(bytes(12) + face + bytes(2) for face in faces))
        model.write_text("kempe: 1\ngravity: [0, 0, -9.81]\nbodies: {ball: {joint: {name: A, revolute: y, at: ground}, shape: {mesh: ball.stl, scale: 0.1, at: [0.2, 0, 0], density: 1000}}}\nrun: {t_end: 1}\n")
        page = self.make("simulate", model)
        drawn, data = self.open(page)
        [mesh] = data["picture"]["meshes"]
        self.assertEqual((len(faces), mesh["triangles"]), (204160, 204160))
        self.assertTrue(8000 < mesh["drawn"] <= 16000)
        self.assertIn(f"{mesh['drawn']} triangles for 204160", drawn.words("stage-note"))
        self.assertLess(page.stat().st_size, 2_000_000)
        [body] = json.loads(kempe("check", model, "--json", "-").stdout)["mass_by_shapes"]
        self.assertLess(abs(body["mass"] / (4 / 3 * math.pi) - 1), 3e-4)

    def test_cylinders(self):
        """A hydraulic cylinder has a barrel from its hinge and a rod into it; a slider on the ground keeps its guide."""
        model = self.folder / "cylinder.yaml"
        model.write_text(CYLINDER)
        _, data = self.open(self.make("simulate", model))
        told = self.run_script("""
            const m = makeMechanism(data.picture), [barrel] = m.barrels, rod = m.lines[m.lines.length - 1];
            return [m.barrels.length, m.guides.length, barrel.ends[0], rod.body, norm(sub(rod.at[0], barrel.ends[0])) < norm(sub(...barrel.ends))];""")
        self.assertEqual(told, [1, 1, [0, 0, 0], [2, 3], True])
        hinges = [point for body in data["picture"]["bodies"] for point in body["points"] if point[3] & 2]
        self.assertEqual([point[5:] for point in hinges], [[0, 0, 1]] * 2)

    def test_loose_pin(self):
        """The path of the journal in the circle of its clearance, and a histogram of depths, without being asked for."""
        page = self.make("simulate", "examples/loose_pin/loose_pin.yaml", name="loose_pin")
        result = json.loads(kempe("simulate", ROOT / "examples/loose_pin/loose_pin.yaml", "--json", "-").stdout)
        for screen in (DESKTOP, DARK_TELEPHONE):
            with self.subTest(screen):
                drawn, data = self.open(page, screen)
                [pin], [told] = data["contacts"], result["contacts"]
                svg = [a for tag, a in drawn.tags if tag == "svg"]
                self.assertIn(str(len(numbers(pin["x"]))), [a.get("data-points") for a in svg])
                self.assertIn(str(len(pin["depths"]["bars"])), [a.get("data-bars") for a in svg])
                away = [math.hypot(*place) for place in zip(numbers(pin["x"]), numbers(pin["y"]))]
                self.assertEqual((pin["clearance"], pin["name"], told["name"]), (0.5e-3, "pin", "pin"))
                self.assertGreater(len(away), 5000)
                self.assertLess(away[0], 1e-12)
                self.assertAlmostEqual(max(away), pin["clearance"] + told["depths"][-1], delta=2e-7)
                self.assertEqual(sum(pin["depths"]["bars"]), told["ended"])
                self.assertEqual([pin["depths"][key] for key in ("began", "ended")], [told["began"], told["ended"]])
                self.assertEqual(len(told["contacts"]), told["began"])
                self.assertEqual(max(depth for _, _, depth in told["contacts"] if depth is not None), told["depths"][-1])
                path = next(a["d"] for tag, a in drawn.tags if tag == "path" and a.get("class") == "touching")
                self.assertGreater(path.count("M"), 15)

    def test_wheels_on_rails(self):
        """Tables of running safety and comfort, and pictures whose points are those of the run."""
        text = (ROOT / "examples/curving/curving.yaml").read_text().replace("../", str(ROOT / "examples") + "/")
        text = text.replace("    course:", "    irregularities: {spectrum: low, seed: 3, to: 200}\n    course:")
        model = self.folder / "curving.yaml"
        model.write_text(text.replace("outputs: [q, qd,", "outputs: [acceleration(wagon.front), q, qd,"))
        page = self.make("simulate", model, "--t-end", "5", "--no-convergence-check", "--json", self.folder / "run.json")
        data, safety = data_of(page), json.loads((self.folder / "run.json").read_text())["running_safety"]
        vehicle = data["vehicle"]
        self.assertEqual(data["running_safety"], safety)
        self.assertEqual([len(vehicle[key]) for key in ("wheels", "axles")], [len(safety[key]) for key in ("wheels", "axles")])
        self.assertEqual([c["direction"] for c in vehicle["comfort"]["signals"]], ["longitudinal", "lateral", "vertical"])
        self.assertEqual(sorted(vehicle["tracks"][0]), ["alignment", "cant", "cross", "curvature", "from", "level", "name", "to"])
        self.assertAlmostEqual(max(vehicle["tracks"][0]["curvature"]), 1 / 300, delta=1e-6)
        self.assertLess(max(abs(x) for axle in vehicle["axles"] for x in axle["aside"]), 0.02)
        self.assertEqual(len(vehicle["t"]), len(vehicle["wheels"][0]["Q"]))

    def test_wheels_on_rails_in_other_units(self):
        """Names of units, and numbers in them, in tables and pictures of a running vehicle."""
        model, options = "examples/curving/curving.yaml", ["--t-end", "2", "--no-convergence-check"]
        shown = {}
        for system in ("si", "us"):
            self.open(self.make("simulate", model, *options, "--units", system))
            shown[system] = self.run_script("""return {
                units: [...document.querySelectorAll('#vehicle-wheels th, #vehicle-axles th')].map((cell) => cell.textContent).join('|'),
                load: Number([...document.querySelectorAll('#vehicle-wheels tr')].pop().cells[1].textContent),
                figures: vehicleFigures.map(({ id, unit, over, curves }) => [id, unit, over, Math.max(...curves[0].points.map(({ x }) => x)), Math.max(...curves[0].points.map(({ y }) => Math.abs(y)).filter(Number.isFinite))]),
                note: document.getElementById('vehicle-note').textContent };""")
        si, us = shown["si"], shown["us"]
        self.assertIn("Q0, kN", si["units"])
        self.assertIn("Q0, lbf|", us["units"])
        self.assertAlmostEqual(us["load"], si["load"] * 1e3 / 4.4482216, delta=2)
        self.assertIn(" in of way", us["note"])
        inch, force = 0.0254, 4.4482216152605
        factors = {("kN", "lbf"): 1e3 / force, ("mm", "in"): 1e-3 / inch, ("m", "in"): 1 / inch, ("1/km", "1/in"): 1e-3 * inch, ("J/m", "lbf"): 1 / force}
        for (name, unit, over, x, y), (same, other, along, u, v) in zip(si["figures"], us["figures"]):
            self.assertEqual(name, same)
            self.assertAlmostEqual(v, y * factors.get((unit, other), 1), delta=1e-6 * abs(v) + 1e-12, msg=name)
            self.assertAlmostEqual(u, x * factors.get((over, along), 1), delta=1e-6 * abs(u), msg=name)
        self.assertEqual({unit for _, unit, _, _, _ in us["figures"]} & {"kN", "mm", "m", "1/km"}, set())
        self.assertEqual({unit for _, unit, _, _, _ in si["figures"]} & {"lbf", "in"}, set())

    def test_same_bytes(self):
        first = self.make("simulate", "tests/models/pendulum.yaml").read_bytes()
        again = self.make("simulate", "tests/models/pendulum.yaml").read_bytes()
        self.assertTrue(untimed(first) == untimed(again))


#   command: model, options, columns drawn at first, frames, what the answer says
STUDIES = {
    "kinematics": ("examples/four_bar/four_bar.yaml", ["--sweep", "crank=0 deg:360 deg"], ["q.coupler", "q.rocker"], 361, "361 positions"),
    "inverse": ("examples/driven_slider_crank/driven_slider_crank.yaml", [], ["tau.crank", "power.crank"], 201, "201 instants"),
    "response": ("examples/suspension/suspension.yaml", ["--inputs", "force(chassis.R.z)", "--outputs", "position(chassis.R).z", "--frequencies", "0.2:20"],
                 ["position.chassis.R.z/force(chassis.R.z).amplitude", "position.chassis.R.z/force(chassis.R.z).phase"], 1, "2 resonances"),
    "cycles": ("tests/models/bautin.yaml", ["--sweep", "mu=-0.3:0.2:6", "--outputs", "state(x)"], ["state.x.amplitude"], 1, "on 1 branch"),
    "equilibrium": ("examples/four_bar/four_bar.yaml", ["--global"], [], 4, "4 equilibria, the first stable"),
    "ensemble": ("examples/four_bar/four_bar.yaml", ["--sample", "crank=0.28:0.32", "--instances", "150", "--t-end", "0.5"], ["q.crank", "q.coupler", "q.rocker"], 1, "150 of 150"),
    "assemble": ("examples/stewart/stewart.yaml", [], [], 1, "Assembled"),
}


class Studies(Case):
    def test_pages(self):
        for k, (command, (model, options, first, frames, answer)) in enumerate(STUDIES.items()):
            if command not in sampled(STUDIES, 2):
                continue
            with self.subTest(command):
                drawn, data = self.open(self.make(command, model, *options, name=command), [DESKTOP, TELEPHONE, DARK_TELEPHONE][k % 3])
                self.assertEqual(data["series"]["first"] if first else [], first)
                self.assertIn(answer, drawn.words("answer"))
                self.assertEqual(int(drawn.by_id["view"]["data-frames"]), frames)
                self.assertEqual(drawn.words("command"), f"kempe {command}")
                if first:
                    self.check_drawn(drawn, data)
                else:
                    self.assertIn(data["model"], drawn.words("text"))
                if command == "equilibrium":  # which are shown one by one
                    self.assertEqual(self.run_script("stage.seek(2); return byId('clock').textContent;"), "2 of 4")

    def test_friction_that_does_not_hold(self):
        """A state that needs more friction than there is."""
        drawn, data = self.open(self.make("equilibrium", "examples/stick_slip/stick_slip.yaml", "--stick", code=5))
        self.assertEqual(data["status"], "not trustworthy")
        self.assertIn("Not trustworthy: ", drawn.words("answer"))
        self.assertIn("needs 60 of at most 30 N", drawn.words("because"))

    def test_joined_cycles(self):
        """Lines of a diagram: one branch, dashed up to the fold and beyond it solid."""
        model, options, *_ = STUDIES["cycles"]
        data = data_of(self.make("cycles", model, *options))
        joins, amplitude = data["series"]["joins"], column(data, "state.x.amplitude")["values"]
        self.assertEqual((joins[0], len(joins)), (0, data["series"]["rows"]))
        self.assertEqual(sorted(set(joins[1:])), [1, 2])
        self.assertEqual(len(base64.b64decode(amplitude)), 4 * len(joins))

    def test_largest_torque(self):
        model, *_ = STUDIES["inverse"]
        data = data_of(self.make("inverse", model))
        torque, power = ([abs(x) for x in column(data, f"{word}.crank")["summary"][:4:2]] for word in ("tau", "power"))
        self.assertEqual([fact["name"] for fact in data["facts"]], ["largest force or torque, crank", "largest power, crank"])
        for fact, most in zip(data["facts"], (torque, power)):
            self.assertAlmostEqual(float(fact["value"].split()[0]) / max(most), 1, delta=1e-3)

    def test_a_peak_is_that_of_the_table(self):
        table = self.folder / "response.csv"
        model, options, first, *_ = STUDIES["response"]
        data = data_of(self.make("response", model, *options, "-o", table))
        with table.open() as file:
            rows = list(csv.reader(file))
        amplitude, frequency = max((float(row[1]), float(row[0])) for row in rows[1:])
        self.assertEqual(rows[0][1], first[0])
        _, _, high, high_at, *_ = column(data, first[0])["summary"]
        self.assertAlmostEqual(high / amplitude, 1, places=6)
        self.assertAlmostEqual(high_at / frequency, 1, places=6)

    def test_measurements_of_a_fit(self):
        """Data are points on the fitted motion, which goes on between them; residuals have figures of their own, with their printed
        RMS."""
        data, model = self.folder / "data.csv", "examples/slider_crank/slider_crank.yaml"
        kempe("simulate", ROOT / model, "--t-end", "1", "--output-step", "0.1", "-o", data)
        with data.open() as file:
            rows = list(csv.DictReader(file))
        lines = ["t,q.crank,q.slider,qd.crank"]
        for k, row in enumerate(rows):
            slider = "" if k == 4 else float(row["q.slider"]) - 0.003 * (-1) ** k
            lines.append(f"{row['t']},{float(row['q.crank']) + 0.01 * (-1) ** k},{slider},{row['qd.crank']}")
        data.write_text("\n".join(lines) + "\n")
        page, told = self.folder / "fit.html", self.folder / "fit.json"
        done = kempe("fit", ROOT / model, data, "--parameter", "slider_mass:0.1:10", "--report", page, "--json", told)
        self.assertEqual(done.returncode, 0, done.stderr)
        check_by_itself(self, page)
        drawn, shown = self.open(page)
        names = ["q.crank", "q.slider", "qd.crank"]
        self.assertEqual(shown["series"]["first"], [name + ending for name in names for ending in ("", ".measured", ".residual")])
        for name, found in json.loads(told.read_text())["columns"].items():
            curve, measured, residual = (column(shown, name + ending) for ending in ("", ".measured", ".residual"))
            self.assertEqual([curve.get("look"), measured["look"], residual["look"]], [None, "points", "residuals"])
            self.assertEqual([measured["of"], residual["of"]], [name, name])
            self.assertAlmostEqual(residual["summary"][5] / found["rms"], 1, delta=1e-6)
            for each in (measured, residual):
                self.assertEqual(sum(not math.isnan(y) for y in numbers(each["values"])), found["measurements"])
            self.assertGreater(sum(not math.isnan(y) for y in numbers(curve["values"])), 290)
        figures = [(caption, int(drawn.by_id[f"plot-{k}"]["data-lines"])) for k, caption in enumerate(
            ["q.crank q.crank.measured rad", "q.crank.residual rad", "q.slider q.slider.measured m", "q.slider.residual m",
             "qd.crank qd.crank.measured rad/s", "qd.crank.residual rad/s"])]
        self.assertEqual([(drawn.by_id[f"plot-{k}"]["aria-label"], lines) for k, (_, lines) in enumerate(figures)],
                         [(caption, 1 + (k % 2 == 0)) for k, (caption, _) in enumerate(figures)])
        self.assertEqual([int(drawn.by_id[f"plot-{k}"]["data-points"]) for k in (1, 3, 5)], [11, 10, 11])
        for k in range(6):
            self.assertGreater(int(drawn.by_id[f"plot-{k}"]["data-ink"]), 50)

    def test_quantities_of_an_ensemble(self):
        """Histograms end at the extreme values of the table; bars and the yield are those of the statistics."""
        table, model = self.folder / "instances.csv", STUDIES["ensemble"][0]
        options = ["--sample", "crank=0.28:0.32,base=0.88:0.92", "--design", "saltelli", "--instances", "200", "--t-end", "0.3", "--quantity",
                   "swing = range(q(rocker)), fast = max(qd(rocker))", "--limit", "fast < 8.3", "-o", table]
        drawn, data = self.open(self.make("ensemble", model, *options))
        with table.open() as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(data["series"]["first"], ["swing", "fast", "fast.time"])
        statistics = data["statistics"]
        self.assertEqual([q["name"] for q in statistics["quantities"]], ["swing", "fast", "fast.time"])
        for k, quantity in enumerate(statistics["quantities"][:2]):
            values = [float(row[quantity["name"]]) for row in rows]
            histogram, bars = (drawn.by_id[f"{word}-{k}"] for word in ("histogram", "contributions"))
            self.assertAlmostEqual(float(histogram["data-low"]) / min(values), 1, delta=2e-6)
            self.assertAlmostEqual(float(histogram["data-high"]) / max(values), 1, delta=2e-6)
            self.assertEqual(sum(map(int, histogram["data-bars"].split())), len(rows))
            total = {c["input"]: c["total"] for c in quantity["contributions"]}
            ordered = sorted(total, key=lambda name: -total[name])
            self.assertEqual(bars["data-bars"], ", ".join(f"{name} {total[name]:.2f}" for name in ordered))
        passed = [row["limits"] == "pass" for k, row in enumerate(rows) if k % 4 < 2]
        self.assertEqual((statistics["judged"], statistics["passed"]), (len(passed), sum(passed)))
        self.assertIn("within the limits", [fact["name"] for fact in data["facts"]])


class Plots(Case):
    """--plot and its neighbours; they need no browser."""

    def curve(self, *words):
        path = self.folder / "curve.svg"
        done = kempe(*words, "--plot", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        tree = xml.etree.ElementTree.parse(path)
        space = "{http://www.w3.org/2000/svg}"
        self.dots = list(tree.iter(space + "circle"))
        return [p for p in tree.iter(space + "path") if p.get("class") == "curve"], [t.text for t in tree.iter(space + "text")]

    def test_outputs_by_name(self):
        """A force and an acceleration that the model does not request."""
        model = ROOT / "examples/andrews/andrews.yaml"
        curves, words = self.curve("simulate", model, "--y", "q(beta), force(motor), acceleration(K3.D).y")
        self.assertEqual(len(curves), 6)
        for word in ("q.beta", "force.motor", "acceleration.K3.D.y", "rad", "N m", "m/s^2", "t, s"):
            self.assertIn(word, words)
        self.assertNotIn("acceleration.K3.D.x", words)

    def test_an_output_against_another(self):
        model = ROOT / "examples/four_bar/four_bar.yaml"
        curves, words = self.curve("kinematics", model, "--sweep", "crank=0 deg:360 deg", "--x", "q(crank)", "--y", "q(rocker)")
        self.assertEqual((len(curves), "q.crank, rad" in words, "q.rocker" in words), (2, True, True))

    def test_every_table(self):
        """Commands other than simulate: curves of what is in order, points of what is not, logarithmic axes."""
        car, four_bar = ROOT / "examples/quarter_car/quarter_car.yaml", ROOT / "examples/four_bar/four_bar.yaml"
        curves, words = self.curve("response", car, "--inputs", "effort(body)", "--outputs", "q", "--frequencies", "0.1:100:200", "--y", "q(body)")
        self.assertEqual(len(curves), 4)  # two, with their entries below
        self.assertEqual([word for word in ("0.1", "1", "10", "100", "frequency, Hz", "-90", "deg") if word not in words], [])
        rows = [float(x) for x in re.findall(r"[ML]([-.\d]+) ", curves[0].get("d"))]
        self.assertEqual(len(rows), 200)
        self.assertLess(max(rows[k + 1] - rows[k] for k in range(199)) / min(rows[k + 1] - rows[k] for k in range(199)), 1.01)
        curves, words = self.curve("modes", car, "--sweep", "damper=0:6000:31", "--y", "re")
        self.assertEqual((len(curves), "re.4" in words, "1/s" in words, "damper, N s/m" in words), (8, True, True, True))
        self.curve("modes", car, "--y", "frequency,re")
        self.assertEqual(len(self.dots), 2 * 5)  # re.body belongs to another column than re
        self.curve("ensemble", four_bar, "--sample", "crank=0.28:0.32", "--instances", "20", "--t-end", "0.1", "--y", "qd(rocker)")
        self.assertEqual(len(self.dots), 21)
        curves, words = self.curve("sensitivity", four_bar, "--parameters", "crank", "--t-end", "0.1", "--y", "q(rocker)/crank")
        self.assertEqual(len(curves), 2)
        self.curve("compare", four_bar, "--rtol", "1e-4,1e-6", "--formulations", "reduced", "--forms", "integrated", "--integrators", "dop853",
                   "--t-end", "0.1", "--y", "error_q")
        self.assertEqual(len(self.dots), 3)

    def test_a_bitmap(self):
        """The same picture, twice as large, where librsvg is installed; otherwise a message."""
        model, path = ROOT / "examples/four_bar/four_bar.yaml", self.folder / "curve.png"
        self.curve("simulate", model, "--y", "q(rocker)")
        size = re.search(r'viewBox="0 0 (\d+) (\d+)"', (self.folder / "curve.svg").read_text()).groups()
        done = kempe("simulate", model, "--y", "q(rocker)", "--plot", path, ASAN_OPTIONS="detect_leaks=0")  # fontconfig keeps its fonts
        if done.returncode:
            self.assertIn("librsvg2-2", done.stderr)
            self.assertFalse(path.exists())
            return
        data = path.read_bytes()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(tuple(int.from_bytes(data[at : at + 4], "big") for at in (16, 20)), tuple(2 * int(x) for x in size))
        self.assertGreater(len(data), 5000, "a white picture is smaller")

    def test_what_cannot_be_drawn(self):
        model, path = ROOT / "examples/four_bar/four_bar.yaml", self.folder / "none.svg"
        for words, message in ((["--plot", path, "--y", "q(Z)"], "unknown"), (["--plot", path, "--x", "q(crank)", "--y", "q(rocker"], "rocker"),
                               (["--y", "q(crank)"], "--plot"), (["--plot", self.folder / "none.bmp"], "ending")):
            done = kempe("simulate", model, *words)
            self.assertIn(message, done.stderr)
            self.assertNotEqual(done.returncode, 0)
        self.assertFalse(path.exists())

    def test_a_table_for_other_programs(self):
        """CSV as csv, NumPy and pandas read it without options, and JSON."""
        plain, text = self.folder / "plain.csv", self.folder / "rows.json"
        model = ROOT / "examples/four_bar/four_bar.yaml"
        self.assertEqual(kempe("simulate", model, "-o", plain).returncode, 0)
        self.assertEqual(kempe("simulate", model, "-o", text).returncode, 0)
        with plain.open() as file:
            rows = list(csv.reader(file))
        found = json.loads(text.read_text())
        self.assertEqual((rows[0], found["units"][:2]), (found["columns"], ["s", "rad"]))
        self.assertEqual([float(x) for x in rows[-1]], found["data"][-1])
        with contextlib.suppress(ImportError):
            import numpy
            read = numpy.genfromtxt(plain, delimiter=",", names=True, deletechars="")
            self.assertEqual((list(read.dtype.names), list(read[-1])), (found["columns"], found["data"][-1]))
        with contextlib.suppress(ImportError):
            import pandas
            read = pandas.read_csv(plain)
            self.assertEqual((list(read.columns), {str(kind) for kind in read.dtypes}), (found["columns"], {"float64"}))
            self.assertEqual(list(pandas.read_csv(plain, float_precision="round_trip").iloc[-1]), found["data"][-1])


class Views(Case):
    def view(self, *words, browser="true"):
        return kempe("view", *words, BROWSER=browser, TMPDIR=str(self.folder))

    def test_the_start_of_a_model(self):
        done = self.view(ROOT / "examples/stewart/stewart.yaml", browser="echo")
        self.assertEqual(done.returncode, 0, done.stderr)
        path, shown = done.stdout.split()
        self.assertEqual(path, shown)
        drawn, data = self.open(pathlib.Path(path))
        self.assertEqual((data["answer"], drawn.words("answer")), ("Complete: Assembled", "\u2713Complete: Assembled"))

    def test_a_page_of_a_path(self):
        page = self.folder / "start.html"
        done = self.view(ROOT / "examples/four_bar/four_bar.yaml", "--report", page, "--json", "-")
        self.assertEqual((done.returncode, json.loads(done.stdout)), (0, {"status": "complete", "file": str(page)}))
        self.assertEqual(self.view(page, browser="echo").stdout.split(), [str(page)] * 2)

    def test_what_cannot_be_shown(self):
        missing, open_loops = self.view(self.folder / "none.html"), self.view(ROOT / "tests/models/robotran.yaml")
        self.assertEqual((missing.returncode, open_loops.returncode), (2, 1))
        self.assertIn("cannot read", missing.stderr)
        self.assertTrue(pathlib.Path(open_loops.stdout.strip()).exists())
        self.assertIn("could not open", self.view(ROOT / "examples/four_bar/four_bar.yaml", browser="false").stderr)


if __name__ == "__main__":
    report_pages.main()
