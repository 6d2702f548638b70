#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Wheels on rails through the command, against formulas and equations that share nothing with it: Klingel's wave, wheels
that turn by themselves, a wheelset that hunts; and what must end a run by name, never without a number.

    python3 tests/rolling.py build/dev/kempe
"""
import bisect
import math
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import runs
from runs import FULL, ROOT, kempe, rows, settings

ROLLING, SPRINGS, ONE = ROOT / "examples/rolling_wheel", ROOT / "examples/restrained_wheelset", ROOT / "tests/models/one_wheel.yaml"


def waves(model, **values):
    """Eigenvalues above the real axis."""
    modes = kempe("modes", model, "--at", "start", *settings(**values))["modes"]
    return [complex(*mode["eigenvalue"]) for mode in modes if mode["eigenvalue"][1] > 0]


class Klingel(unittest.TestCase):
    def test_wave(self):
        """Slow rolling hardly slips: the wavelength is that without any slip, and the formula's is off by the slope's share."""
        off = []
        for row in rows(ROLLING / "reference.csv"):
            if row["rail"] != 0.08:
                continue
            with self.subTest(cone=row["cone"]):
                wave, = waves(ROLLING / "rolling_wheel.yaml", cone=row["cone"], V=0.2)
                length = 2 * math.pi * 0.2 / wave.imag
                self.assertLess(abs(length / row["wavelength"] - 1), 2e-5)
                self.assertLess(abs(wave.real), 2e-3 * wave.imag)
                off.append(row["klingel"] / length - 1)
        self.assertEqual(len(off), 5)
        for steep, flat in zip(off, off[1:]):
            self.assertTrue(1.85 < steep / flat < 2.15, off)

    def test_followed(self):
        """A run goes on as the wave of reference.csv, within what creep at 2 m/s takes off."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "run.csv"
            kempe("simulate", ROLLING / "rolling_wheel.yaml", "--no-convergence-check", "-o", path)
            found = rows(path)
        zeros = [a["q.x"] + (b["q.x"] - a["q.x"]) * a["q.y"] / (a["q.y"] - b["q.y"]) for a, b in zip(found, found[1:]) if a["q.y"] * b["q.y"] < 0]
        wanted, = [row["wavelength"] for row in rows(ROLLING / "reference.csv") if row["cone"] == 0.025 and row["rail"] == 0.08]
        self.assertGreaterEqual(len(zeros), 3)
        for a, b in zip(zeros, zeros[1:]):
            self.assertLess(abs(2 * (b - a) / wanted - 1), 1e-3)


class Independent(unittest.TestCase):
    """Wheels that turn by themselves, against independent.py."""

    def setUp(self):
        """The model with points of the rail's top half a millimetre apart, on the circle of the equations."""
        text, head = (ROLLING / "independent.yaml").read_text(), "{csv: ../profiles/circular.csv, y: y, z: z}"
        self.assertIn(head, text)
        y = [k / 2000 for k in range(-60, 61)]
        circle = [-x * x / (0.08 + math.sqrt(0.08**2 - x * x)) for x in y]
        self.folder = tempfile.TemporaryDirectory()
        self.model = pathlib.Path(self.folder.name) / "model.yaml"
        self.model.write_text(text.replace(head, f"{{y: {y}, z: {circle}}}"))

    def tearDown(self):
        self.folder.cleanup()

    def modes(self, row, *words):
        values = settings(aside=0, spin=row["spin"], ky=row["ky"], kpsi=row["kpsi"])
        return kempe("modes", self.model, "--at", "start", *values, *words)

    def test_eigenvalues(self):
        """Either part within 1e-4, of which the ways through the table of coefficients take a third; or rounding beside the quickest one."""
        cases = {}
        for row in rows(ROLLING / "independent.csv"):
            if row["re"]:
                cases.setdefault((row["V"], row["spin"], row["kpsi"]), []).append(row)
        self.assertEqual(len(cases), 17)
        for case, wanted in cases.items():
            found = [complex(*mode["eigenvalue"]) for mode in self.modes(wanted[0], *settings(V=case[0]))["modes"]]
            with self.subTest(V=case[0], spin=case[1], kpsi=case[2]):
                self.assertEqual(sum(s.imag > 0 for s in found), sum(row["im"] > 0 for row in wanted))
                for row in wanted:
                    s = complex(row["re"], row["im"])
                    here, least = min(found, key=lambda other: abs(s - other)), 1e-15 * max(abs(other) for other in found)
                    self.assertLess(abs(here.real - s.real), max(1e-4 * abs(s.real), least), s)
                    self.assertLessEqual(abs(here.imag - s.imag), max(1e-4 * s.imag, least), s)

    def test_critical_speeds(self):
        """The places where waves begin and cease to grow."""
        wanted = [row for row in rows(ROLLING / "independent.csv") if row["re"] == 0]
        self.assertEqual(len(wanted), 5)
        for row in wanted:
            with self.subTest(spin=row["spin"], V=row["V"]):
                about = f"V={0.9 * row['V']}:{1.1 * row['V']}:3"
                critical, = self.modes(row, "--sweep", about)["locus"]["critical"]
                self.assertEqual(critical["grows"], "below" if row["V"] < 10 else "above")
                self.assertLess(abs(critical["value"] / row["V"] - 1), 5e-5)
                self.assertLess(abs(critical["eigenvalue"][1] / row["im"] - 1), 5e-5)

    def test_light_wheels(self):
        """With next to no inertia nothing swings freely up to 80 m/s, and held by springs nothing grows up to 200 m/s."""
        for speed in (0.2, 2, 20, 80):
            with self.subTest(V=speed):
                self.assertEqual(waves(ROLLING / "independent.yaml", V=speed, spin=0.001, aside=0), [])
        held = settings(aside=0, spin=0.1, ky=25e3, kpsi=2e5)
        locus = kempe("modes", ROLLING / "independent.yaml", "--at", "start", *held, "--sweep", "V=5:200:40")["locus"]
        self.assertEqual((len(locus["eigenvalues"]), locus["critical"]), (40, []))
        for speed, found in zip(locus["values"], locus["eigenvalues"]):
            with self.subTest(V=speed):
                self.assertEqual(sum(s == [0, 0] for s in found), 4)  # x, both turns, the speed: exactly
                self.assertLess(max(re for re, im in found if (re, im) != (0, 0)), 0)

    def test_length_of_the_wave(self):
        """Heavy wheels: Klingel's wave, longer by the root of what the inertia of all is over that of the wheels' turning."""
        r0, b, cone, across, weight = 0.46, 0.75, 0.025, 600, 9810
        for spin in (10, 40, 100):
            with self.subTest(spin=spin):
                wave, = waves(ROLLING / "independent.yaml", V=20, spin=spin, aside=0)
                inertia = across + 2 * spin * (b / r0) ** 2
                steers = 2 * spin * (1 + (b / r0) ** 2) * cone * 20**2 / (r0 * b)
                self.assertLess(abs(wave.imag**2 * inertia / (steers - weight * b * cone) - 1), 3e-3)


class Backwards(unittest.TestCase):
    def test_mirrored(self):
        """A wheelset that rolls backwards goes where its image that rolls forwards goes, spin and its forces included."""
        with tempfile.TemporaryDirectory() as folder:
            ends = []
            for V in (20, -20):
                path = pathlib.Path(folder) / "run.csv"
                kempe("simulate", ROLLING / "rolling_wheel.yaml", "--no-convergence-check", "--t-end", 1, *settings(V=V), "-o", path)
                ends.append(rows(path)[-1])
        for name, there in ends[0].items():
            sign = -1 if name in ("q.x", "q.yaw", "q.spin") else 1
            self.assertLess(abs(sign * ends[1][name] - there), 1e-8 * max(abs(there), 1e-3), name)


class Hunting(unittest.TestCase):
    def test_critical_speeds(self):
        """Against rails.py. Apart are: curvatures across, 1e-4 larger here (Hertz's are never flatter than a hundredth of those
        along, smoothly), up to 4e-6; coefficients beside the circle by a spline, there by a parabola, 2e-6; the rails' points,
        1e-6. The value in the middle is the critical one: its growth is rounding, which is 7e-5 1/s with the stiffest patches,
        and on which side it stands is told by the value before it."""
        found = []
        for row in rows(SPRINGS / "rails.csv"):
            with self.subTest(cone=row["cone"], G=row["shear_modulus"], spin=row["spin"]):
                values = settings(cone=row["cone"], G=row["shear_modulus"], spin=row["spin"])
                about = f"V={0.9 * row['speed']}:{1.1 * row['speed']}:3"
                locus = kempe("modes", SPRINGS / "wheelset_on_rails.yaml", "--at", "start", *values, "--sweep", about)["locus"]
                critical, = locus["critical"]
                self.assertEqual(critical["grows"], "above")
                self.assertLess(abs(critical["value"] / row["speed"] - 1), 1e-5)
                self.assertLess(abs(critical["eigenvalue"][1] / row["rate"] - 1), 1e-5)
                found.append(critical["value"])
        self.assertEqual(len(found), 12)


class HeldSpeed(unittest.TestCase):
    """The wheelset on rails has resistances and no drive: a load holds its speed."""

    def test_load(self):
        """The power of spin creep on two circular patches, C33 G (a b)^2 spin^2 V each, with spin sin(slope)/r0; Kalker 1990, table
        E.3: C33 = 1.19 at nu 1/4. The patches' loads and curvatures across are those of the model within a percent."""
        found = kempe("equilibrium", SPRINGS / "wheelset_on_rails.yaml")
        G, nu, r0, load, slope = 82e9, 0.25, 0.45, 75e3, math.atan(0.05)
        patch = (3 * load * r0 / (4 * G / (1 - nu))) ** (2 / 3)  # Hertz: a^2 of equal curvatures 1/r0
        known = 2 * 1.19 * G * patch**2 * (math.sin(slope) / r0) ** 2
        self.assertLess(abs(found["loads"]["x"] / known - 1), 0.01)
        locus = kempe("modes", SPRINGS / "wheelset_on_rails.yaml", "--sweep", "V=80:100:3")["locus"]
        for load in locus["loads"]["x"]:
            self.assertLess(abs(load / known - 1), 0.01)
        self.assertEqual(len(locus["loads"]["x"]), 3)
        self.assertLess(abs(found["qd"]["x"] - 80), 1e-12)

    def test_drive(self):
        """With this load as a force of the model the motion is steady without a held speed, at the same rates."""
        held = kempe("equilibrium", SPRINGS / "wheelset_on_rails.yaml")
        text = (SPRINGS / "wheelset_on_rails.yaml").read_text()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "driven.yaml"
            path.write_text(text.replace("forces:\n", f"forces:\n  drive: {{joint: x, force: {held['loads']['x']!r}}}\n"))
            driven = kempe("equilibrium", path)
        self.assertFalse(driven["loads"])
        for name in ("x", "spin"):
            self.assertLess(abs(driven["qd"][name] / held["qd"][name] - 1), 1e-6)

    def test_wheels_apart(self):
        """A wheelset that begins 0.14 mm above its rails: it presses, and rolls at the radius of its contacts, near 0.46 m."""
        found = kempe("equilibrium", ROOT / "examples/manchester/manchester_wheelset.yaml")
        q, qd = found["q"], found["qd"]
        self.assertLess(abs(qd["axle.2"] - 10), 1e-12)
        self.assertLess(abs(10 / qd["axle.6"] - 0.46), 2e-4)
        self.assertTrue(0 < 0.46 - q["axle.1"] < 0.3e-3)
        self.assertLess(max(abs(q[name]) for name in ("axle.3", "axle.4", "axle.5")), 1e-9)

    def test_critical_speed(self):
        """Without names of rates: rails.py has 103.5373 m/s at the rates of the start, which differ from rolling by 1e-7."""
        critical, = kempe("modes", SPRINGS / "wheelset_on_rails.yaml", "--sweep", "V=80:130:6")["locus"]["critical"]
        self.assertLess(abs(critical["value"] / 103.5373 - 1), 1e-5)
        self.assertEqual(critical["grows"], "above")


def kinked(angle, step):
    """A profile of two straight lines, a cone of 1:20 and a flange, by points so far apart, mm."""
    y = [step * k for k in range(-math.floor(46 / step), math.floor(46 / step) + 1)]
    z = [0.05 * x + min(x + 26, 0) * (math.tan(math.radians(angle)) - 0.05) for x in y]
    return "{" + ", ".join(f"{name}: [{', '.join(f'{x:.9g} mm' for x in list)}]" for name, list in (("y", y), ("z", z))) + "}"


def between(x, y, at):
    k = min(max(bisect.bisect(x, at), 1), len(x) - 1)
    return y[k - 1] + (y[k] - y[k - 1]) * (at - x[k - 1]) / (x[k] - x[k - 1])


def head(lean=math.atan(1 / 20), inside=1.435 / 2):
    """The head of UIC 60, leaning inwards, its inner side 14 mm below its top at half the gauge; without what overhangs."""
    turned = [(math.cos(lean) * p["y"] - math.sin(lean) * p["z"], math.sin(lean) * p["y"] + math.cos(lean) * p["z"])
              for p in rows(ROOT / "examples/profiles/uic60.csv")]
    top = max(z for _, z in turned)
    inner = next(a[0] + (b[0] - a[0]) * (top - 0.014 - a[1]) / (b[1] - a[1]) for a, b in zip(turned, turned[1:]) if b[1] > top - 0.014)
    seen = [p for k, p in enumerate(turned) if all(p[0] > q[0] for q in turned[:k])]
    return [y - inner + inside for y, _ in seen], [z - top for _, z in seen]


def outline(attack, radius=0.46):
    """The lowest point of the wheel of one_wheel.yaml at each place, seen along the track: s on its profile, y outwards, z. On the circle at s
    the point whose normal, radial + z'(s) times the axle, has no part along the track."""
    profile, out = rows(ROOT / "examples/profiles/cone20.csv"), []
    for a, b in zip(profile, profile[1:]):
        slope = (b["z"] - a["z"]) / (b["y"] - a["y"])
        sine, pieces = slope * attack, max(1, round((b["y"] - a["y"]) / 5e-5))
        for k in range(pieces if abs(sine) < 1 else 0):
            s = a["y"] + (b["y"] - a["y"]) * k / pieces
            r = radius - a["z"] - slope * (s - a["y"])
            out.append((s, (s + r * sine * attack) / math.hypot(1, attack), radius - r * math.sqrt(1 - sine * sine)))
    return out


def two_points(attack, middle=0.75):
    """The wheel's shift to the side at which tread and flange are as near to the rail as each other."""
    (y, z), wheel, low, high = head(), outline(attack), 0.004, 0.008
    while high - low > 1e-7:
        aside = 0.5 * (low + high)
        gaps = ((up - between(y, z, middle + aside + out), s) for s, out, up in wheel if y[0] < middle + aside + out < y[-1])
        low, high = (low, aside) if min(gaps)[1] < -0.02 else (aside, high)
    return low


class Ends(unittest.TestCase):
    """One wheel turned against its rail, pressed outwards by a force that grows."""

    TWO_POINTS = (r"wheel 'L': contact in zone 2 changes back and forth at t = [\d.]+ s: "
                  "a rigid contact has one contact point, but two points of the wheel would have to touch")

    def run_of(self, form="elastic", status=None, words=(), profile=None, **values):
        """The result of the run, and its rows, all of them numbers."""
        with tempfile.TemporaryDirectory() as folder:
            path, model = pathlib.Path(folder) / "run.csv", pathlib.Path(folder) / "model.yaml"
            given = "{csv: ../../examples/profiles/cone20.csv, y: y, z: z}"
            self.assertIn(f"wheel: {given}", ONE.read_text())
            text = ONE.read_text().replace(given, profile or given).replace("../../examples", str(ROOT / "examples"))
            self.assertIn("contact: elastic", text)
            model.write_text(text.replace("contact: elastic", f"contact: {form}"))
            found = kempe("simulate", model, "--no-convergence-check", *words, *settings(**values), "-o", path, status=status)
            table = rows(path)
        self.assertTrue(all(math.isfinite(x) for row in table for x in row.values()))
        return found, table

    def test_flange_climbs(self):
        """Above Nadal's limit (tan 70 deg - mu) / (1 + mu tan 70 deg) the flange climbs, the nearer to it the more the wheel
        is turned; turned the other way it does not climb."""
        flange = math.tan(math.radians(70))
        nadal, ratios = (flange - 0.3) / (1 + 0.3 * flange), []
        for attack in (0.02, 0.1):
            found, table = self.run_of(attack=attack)
            self.assertIn("wheel 'L' left its rail at t = ", found["reason"])
            climbs = next(row["t"] for row in table if row["q.y"] > 0.0075)
            ratios.append(60 * climbs / 50)
        self.assertTrue(nadal < ratios[1] < ratios[0] < 1.5 * nadal and ratios[1] < 1.08 * nadal, ratios)
        found, table = self.run_of(attack=-0.02)
        self.assertEqual((found["reason"] or "", table[-1]["t"]), ("", 3))
        self.assertLess(table[-1]["q.y"], 0.0075)

    def test_falls_between_the_rails(self):
        ends = []
        for form in ("elastic", "rigid"):
            found, table = self.run_of(form=form, push=-60000, attack=0)
            self.assertIn("wheel 'L' left its rail at t = ", found["reason"])
            ends.append(table[-1]["t"])
        self.assertLess(abs(ends[0] - ends[1]), 0.01)

    def test_misplaced(self):
        """A wheel that is not on its rail at the start is reported so, elastic or rigid, and not that its forces are not found."""
        for form in ("elastic", "rigid"):
            for value, why in ((10, "is not aligned with its rail"), (-10, "is not aligned with its rail")):
                found, table = self.run_of(form=form, push=0, attack=value)
                self.assertIn(f"wheel 'L' {why} at t = 0 s", found["reason"])
            found, table = self.run_of(form=form, push=0, attack=0, beside=0.2)
            self.assertIn("wheel 'L' left its rail at t = 0 s", found["reason"])

    def test_far_away(self):
        """A run that begins beside the rails ends there, and says so."""
        for form in ("elastic", "rigid"):
            text = (ROLLING / "rolling_wheel.yaml").read_text().replace("../profiles", str(ROOT / "examples/profiles"))
            with tempfile.TemporaryDirectory() as folder:
                model = pathlib.Path(folder) / "model.yaml"
                for old, new in (("rigid", form), ("y: 3 mm", "y: 0.1 m"), ("hold: [y, yaw], ", ""), (", lambda(L), lambda(R)", "")):
                    text = text.replace(old, new)
                model.write_text(text)
                found = kempe("simulate", model, status=None)
            self.assertIn("wheel 'L' left its rail at t = 0 s", found["reason"])

    def test_dips(self):
        """A rail that goes down at once: an elastic wheel flies and lands, a rigid one says that it would have to be pulled."""
        found, table = self.run_of(push=0, attack=0, depth=0.001, width=0.2)
        self.assertEqual(min(row["force.L.z"] for row in table if row["t"] > 0.3), 0)
        self.assertGreater(max(row["force.L.z"] for row in table if 1 < row["t"] < 2), 5e4)
        found, table = self.run_of(form="rigid", push=0, attack=0, depth=0.03, width=1, V=20)
        self.assertRegex(found["reason"], r"wheel 'L' is unloaded at t = 0\.1\d+ s")

    def test_two_points_at_once(self):
        """A rigid wheel that is kept against its flange says so at once, whichever way it is turned: where profiles drawn
        by straight lines touch at two points. It goes back and forth there by 1 um."""
        for attack in (0.02, 0, -0.02):
            with self.subTest(attack=attack):
                found, table = self.run_of(form="rigid", status=1, words=("--output-step", 2e-4), attack=attack)
                self.assertRegex(found["reason"], self.TWO_POINTS)
                self.assertLess(found["work"]["events"], 100)
                self.assertLess(abs(table[-1]["q.y"] - two_points(attack)), 2e-6)

    def test_formulations(self):
        """The same ends, at the same time, on all formulations."""
        cases = (("rigid", dict(attack=0.02), self.TWO_POINTS), ("rigid", dict(push=-60000, attack=0), "left its rail"),
                 ("rigid", dict(push=0, attack=0, depth=0.03, width=1, V=20), "is unloaded"),
                 ("elastic", dict(attack=0.02), "left its rail"), ("elastic", dict(push=-60000, attack=0), "left its rail"))
        for form, values, says in cases:
            with self.subTest(form=form, values=values):
                ends = []
                for words in (("--formulation", "dae", "--integrator", "ida"), ("--formulation", "projected"), ("--formulation", "reduced", "--integrator", "bdf")):
                    found, table = self.run_of(form=form, words=words, **values)
                    self.assertRegex(found["reason"], says)
                    ends.append(table[-1]["t"])
                self.assertLess(max(ends) - min(ends), 1e-3)

    def test_kinked(self):
        """Two straight lines: the spline rounds their kink over the distance of the points, so that what it changes goes with
        that distance or quicker; one so sharp that the spline swings out is refused."""
        for step in (23, 2):
            found, table = self.run_of(form="rigid", status=1, profile=kinked(60, step), attack=0.02)
            self.assertRegex(found["reason"], self.TWO_POINTS)
        climbs = []
        for step in (8, 4, 2, 1, 0.5):
            ends = []
            for formulation in ("reduced", "dae") if FULL or step in (8, 0.5) else ("reduced",):
                found, table = self.run_of(words=("--formulation", formulation), profile=kinked(60, step), attack=0.02)
                self.assertIn("left its rail", found["reason"])
                ends.append(table[-1]["t"])
            self.assertLess(abs(ends[0] - ends[-1]), 1e-3)
            climbs.append(ends[0])
        off = [abs(end - climbs[-1]) for end in climbs[:-1]]
        for k in range(1, len(off)):
            self.assertTrue(off[k] < off[k - 1] and off[k] < off[0] / 2**k, climbs)
        with self.assertRaisesRegex(AssertionError, r": 2\n.*:8:103: profile 'wheel': the spline overshoots between y = -0.026 m"):
            self.run_of(profile=kinked(85, 2))


if __name__ == "__main__":
    runs.main()
