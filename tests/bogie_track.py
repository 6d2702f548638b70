#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The bogie under half a car body on rails (examples/bogie_track) through the command: its loads against statics, its slow mode against
a closed form and for several choices of u, what a clearance of 6.5 mm and one of 2 mm make of it, and two formulations.

    python3 tests/bogie_track.py build/dev/kempe
"""
import cmath
import contextlib
import io
import json
import math
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import runs
from runs import ROOT, kempe, rows

HERE = ROOT / "examples/bogie_track"
RECORDED = ROOT / "bench/results/bogie_regimes.csv"
sys.path.insert(0, str(HERE))
import draw_regimes  # noqa: E402
import map_bogie_track as regimes  # noqa: E402
import reference_bogie_track as reference  # noqa: E402

SPINS = ("spin_FL", "spin_FR", "spin_RL", "spin_RR")
STEADY = ("--rates", ",".join(f"{name}={rate}" for name, rate in zip(SPINS, (-31.25, -31.25, -53.3333, -53.3333))),
          "--solve-for", ",".join(f"qd({name})" for name in SPINS))
MIDDLE = ("--set", "turn=0", "--set", "worn=0")


def simulated(t_end, *words):
    return runs.simulated(HERE / "bogie_track.yaml", "--t-end", t_end, *words)[1]


def steadied(folder, name, *words):
    """A copy of a model that starts where it moves steadily, and with forces of the wheels as outputs; and what that motion is."""
    for example in ("bogie", "bogie_track", "profiles"):
        shutil.copytree(ROOT / "examples" / example, pathlib.Path(folder) / example)
    model = pathlib.Path(folder) / "bogie_track" / name
    steady, text = kempe("equilibrium", model, *STEADY, *words), model.read_text()
    start = f"start:\n  q: {json.dumps(steady['q'])}\n  qd: {json.dumps(steady['qd'])}\n"
    own, run = text.find("start:"), text.index("\nrun:")
    model.write_text(text[:run if own < 0 else own] + "\n" + start + text[run:].replace("lambda(", "force("))
    return model, steady


def slow(*words):
    """The slowest of the modes that swing."""
    found = [complex(*mode["eigenvalue"]) for mode in kempe("modes", *words)["modes"]]
    return min((s for s in found if s.imag > 0), key=abs)


class Balance(unittest.TestCase):
    # (mass, x) of all that the wheels carry but the car body; x from the driven axle to the small wheels, which lead
    PARTS = ((900, 0.25), (360, 0), (420, 1.35), (140, 1.7), (300, 0.765), (30, 0.9), (15, 0.44), (16, 0.5), (8, 1.25))

    def test_loads(self):
        """Wheel loads are what statics gives: 3.3 t on the driven wheels, 2.3 t on the small ones. The car body hangs a little down in
        front, so that its centre, 0.93 m above its ends, is nearer to the ball, by 7 N; and the ball, 0.1 m above the cradle's tilt, moves by
        15 um. The remainder, 6e-6, is rolling: 1.3 N at the ball. The crank K3, 8 kg, stands on the left alone."""
        with tempfile.TemporaryDirectory() as folder:
            model, steady = steadied(folder, "bogie_on_rails.yaml")
            row = runs.simulated(model, "--t-end", 0.02)[1][0]
        load = {wheel: row[f"force.{wheel}.z"] for wheel in ("FL", "FR", "RL", "RR")}
        q, car = steady["q"], 5000 / 5.5
        self.assertGreater(abs(q["car_pitch"]), 5e-4)
        parts = self.PARTS + ((car * (3.85 + 0.93 * q["car_pitch"]), 0.765 - 0.10 * q["tilt"]),)
        total, small = 9.81 * sum(m for m, _ in parts), 9.81 * sum(m * x for m, x in parts) / 1.7
        self.assertLess(abs((load["FL"] + load["FR"]) / (total - small) - 1), 1e-5)
        self.assertLess(abs((load["RL"] + load["RR"]) / small - 1), 1e-5)
        self.assertLess(abs(load["FL"] + load["RL"] - load["FR"] - load["RR"] - 9.81 * 8 * 0.35 / 0.75), 1e-5 * total)
        self.assertLess(abs(q["y"]), 1e-5)

    def test_plain(self):
        """The plain command finds the same by itself, on rigid and on elastic wheels."""
        for model in ("bogie_on_rails.yaml", "bogie_track.yaml"):
            plain, told = kempe("equilibrium", HERE / model), kempe("equilibrium", HERE / model, *STEADY)
            for spin in SPINS:
                self.assertLess(abs(plain["free"][f"qd({spin})"] - told["qd"][spin]), 1e-9)
            self.assertLess(max(abs(plain["q"][name] - told["q"][name]) for name in plain["q"] if "spin" not in name), 1e-10)

    def test_elastic(self):
        """Elastic wheels stand lower by Hertz's approach and as the rigid ones in all else; 0.25 and 0.16 % more, as places nearby
        count, too: patches reach to where the rail's arc of 80 mm begins."""
        rigid = kempe("equilibrium", HERE / "bogie_on_rails.yaml", *STEADY)["q"]
        elastic = kempe("equilibrium", HERE / "bogie_track.yaml", *STEADY, *MIDDLE)["q"]
        driven, small = (reference.contact(*given)[2] for given in zip(reference.LOADS, reference.RADII))
        lower = rigid["z"] - elastic["z"]
        self.assertTrue(0 < lower / driven - 1 < 3e-3)
        self.assertTrue(0 < (lower - 1.7 * (elastic["pitch"] - rigid["pitch"])) / small - 1 < 3e-3)
        turned = (driven - small) / 1.7
        self.assertLess(abs(rigid["car_pitch"] - elastic["car_pitch"] + (driven - 0.765 * turned) / 5.5), 2e-7)
        self.assertLess(max(abs(rigid[name] - elastic[name]) for name in ("y", "psi", "yaw", "stroke")), 1e-6)

    def test_starts_on_its_rails(self):
        """All wheels stand on their rails at the start and stay there, whatever the clearance, the worn wheel and the turn."""
        for words in ((), ("sigma=2 mm",), ("worn=0",), ("turn=0.5e-3",)):
            with self.subTest(words=words):
                way = simulated(0.2, "--output-step", 0.001, *(each for word in words for each in ("--set", word)))
                for name, load in (("FL", 16400), ("FR", 16400), ("RL", 11500), ("RR", 11500)):
                    self.assertTrue(all(0.5 * load < row[f"force.{name}.z"] < 1.5 * load for row in way), name)


class SlowMode(unittest.TestCase):
    def test_elastic_over_speed(self):
        """The sweep follows one motion on elastic wheels from 0.5 m/s on: at 10 m/s it has the modes found there, and one mode begins to grow
        near the speed of rigid wheels, with the worn wheel and without."""
        rigid = kempe("modes", HERE / "bogie_on_rails.yaml", "--sweep", "speed=0.5:1:3")["locus"]["critical"]
        self.assertEqual(len(rigid), 1)
        for words in ((), ("--set", "worn=0")):
            with self.subTest(words=words):
                locus = kempe("modes", HERE / "bogie_track.yaml", "--sweep", "speed=0.5:20:40", *words)["locus"]
                plain = kempe("modes", HERE / "bogie_track.yaml", *words)["eigenvalues"]
                there = locus["eigenvalues"][locus["values"].index(10)]
                for found, wanted in zip(sorted(there), sorted(plain), strict=True):
                    self.assertLess(math.dist(found, wanted), 1e-6 * (1 + math.hypot(*wanted)))
                self.assertEqual([mode["grows"] for mode in locus["critical"]], ["above"])
                self.assertLess(abs(locus["critical"][0]["value"] / rigid[0]["value"] - 1), 0.2)

    def test_closed_form(self):
        """Frequency, and what of growth goes with the direction, are those of a stiff frame that two axles steer, with the yaw damper and
        without: within 0.23 % and 2.2 %, which is how axles roll on their cones, weight and spin, at 20 m/s masses."""
        table = [row for row in rows(HERE / "reference.csv") if row["motors"] > 0]
        self.assertEqual(len(table), 8)
        for row in table if runs.FULL else table[::3]:  # 5 and 20 m/s with the damper, 15 m/s without
            v, damper = row["speed"], row["yaw_damper"]
            there, back = (slow(HERE / "bogie_on_rails.yaml", "--at", "start", *runs.settings(speed=way, yaw_damper=damper)) for way in (v, -v))
            with self.subTest(speed=v, damper=damper):
                self.assertLess(abs((there.imag + back.imag) / 2 / row["im"] - 1), 3e-3)
                self.assertLess(abs((there.real - back.real) / 2 / row["re"] - 1), 0.025)
                self.assertTrue(there.real > 0 > back.real or v == 20)

    def test_braked(self):
        """Without motors the forces of brakes alone let the bogie oscillate, as in closed form: squares of frequencies within 1.5 %, and of
        growth the part that goes with the direction within 1.5e-3 1/s, which is how axles roll on their cones, weight and spin."""
        table = [row for row in rows(HERE / "reference.csv") if row["torque"] < 0]
        self.assertEqual(len(table), 6)
        for row in table if runs.FULL else table[::3]:
            v, torque = row["speed"], row["torque"]
            there, back = (slow(HERE / "bogie_on_rails.yaml", *runs.settings(speed=way * v, yaw_damper=row["yaw_damper"], motors=0,
                                                                             wheel_torque=-way * torque)) for way in (1, -1))
            with self.subTest(damper=row["yaw_damper"], torque=torque):
                self.assertLess(abs((there.imag**2 + back.imag**2) / 2 / row["im"]**2 - 1), 0.015)
                self.assertLess(abs((there.real - back.real) / 2 - row["re"]), 1.5e-3)
                self.assertTrue(row["yaw_damper"] < 20000 or back.real > 0.015)

    def test_choices(self):
        """Eigenvalues do not depend on the choice of u, at the steady motion itself."""
        cases = {"bogie_track.yaml": ("psi,car_pitch,car_roll,yaw,roll,pitch,K2,K3", "y,car_roll,psi,stroke,z,pitch,roll,warp",
                                      "x,y,car_pitch,car_roll,yaw,roll,K2,K3"),
                 "bogie_on_rails.yaml": ("y,yaw,stroke,car_roll", "psi,yaw,car_pitch,car_roll", "y,psi,K1,car_roll", "yaw,psi,tilt,car_roll")}
        for name, choices in cases.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                model, _ = steadied(folder, name, *MIDDLE)
                found = [kempe("modes", model, "--at", "start", *MIDDLE, "--independent", ",".join((choice, *SPINS))) for choice in choices]
                self.assertEqual(len({tuple(sorted(each["u"])) for each in found}), len(choices))
                for other in found[1:]:
                    self.assertEqual(len(other["eigenvalues"]), len(found[0]["eigenvalues"]))
                    for a, b in zip(found[0]["eigenvalues"], other["eigenvalues"]):
                        self.assertLess(abs(complex(*a) - complex(*b)), 1e-9 * max(1, abs(complex(*a))))


class Clearance(unittest.TestCase):
    def test_leans(self):
        """2 mm: the bogie leans on the left rail and stays there."""
        late = [row for row in simulated(12, "--set", "sigma=2 mm") if row["t"] > 4]
        self.assertTrue(all(1.9e-3 < row["q.y"] < 2e-3 for row in late))
        self.assertLess(max(row["q.psi"] for row in late) - min(row["q.psi"] for row in late), 2e-5)

    def test_rebounds(self):
        """6.5 mm: it comes to the left rail every five seconds and swings back beyond the middle, in between as the slow mode does that
        begins with the flange on its rail, about the place where both driven wheels have one radius."""
        way = [(row["t"], row["q.y"]) for row in simulated(16)]
        rail, near, centre = max(y for _, y in way), 6.2e-3, 0.25e-3 / (2 * 0.05)
        self.assertTrue(6.3e-3 < rail < 6.4e-3)
        s = slow(HERE / "bogie_on_rails.yaml", "--at", "start")
        at = lambda t: centre + (rail - centre) * (cmath.exp(s * t) * (1 + 1j * s.real / s.imag)).real  # it begins at rest
        swing = [(k * 2e-3, at(k * 2e-3)) for k in range(round(2 * math.pi / s.imag / 2e-3))]
        free = [t for t, y in swing if y < near]
        hits = [t for t, y in way if y > near]
        gaps = [(a, b) for a, b in zip(hits, hits[1:]) if b - a > 2]
        self.assertEqual(len(gaps), 2)
        for a, b in gaps:
            self.assertLess(abs((b - a) / (free[-1] - free[0]) - 1), 0.03)  # found 2 % longer, and 0.07 mm farther
            self.assertLess(abs(min(y for t, y in way if a < t < b) - min(y for _, y in swing)), 0.1e-3)
            self.assertLess(min(y for _, y in swing), -1.3e-3)

    def test_from_rail_to_rail(self):
        """Wheels that are alike: from one rail to the other."""
        late = [row["q.y"] for row in simulated(26, "--set", "worn=0") if row["t"] > 16]
        self.assertTrue(6.1e-3 < max(late) < 6.5e-3 and -6.5e-3 < min(late) < -6.1e-3)

    def test_driven_wheels_in_front(self):
        """The other way round the same bogie calms down."""
        way = [row for row in simulated(40, "--set", "worn=0", "--set", "speed=-10")]
        self.assertLess(max(abs(row["q.y"]) for row in way if row["t"] > 30), 0.7 * max(abs(row["q.y"]) for row in way if row["t"] < 10))

class Regimes(unittest.TestCase):
    def test_pairs(self):
        """2 mm and 6.5 mm give two regimes, and the recorded ones: with a worn wheel and coupled wheels, with brakes and neither of
        these, and no such pair without any of them."""
        recorded = regimes.table(RECORDED)
        for name, x, value, expected in (("wear", "0.25", 0.25e-3, ("leans left", "left rail")), ("torque", "-0.5", -500, ("leans left", "left rail")),
                                         ("plain", "10", 10, ("no rail", "no rail"))):
            _, _, ((varied, *_),), others, _ = regimes.MAPS[name]
            for clearance, regime in zip(regimes.PAIR, expected):
                with self.subTest(map=name, clearance=clearance), tempfile.TemporaryDirectory() as folder:
                    values = pathlib.Path(folder) / "values.csv"
                    values.write_text(f"{varied}\n{value}\n")
                    (row,), old = (regimes.instances(runs.command, ["--values", values], {**others, "sigma": f"{clearance:g} mm"}), recorded[name, x, "", f"{clearance:g}"])
                    self.assertEqual((regimes.regime(row), old["regime"]), (regime, regime))
                    if name == "plain":
                        continue
                    top, low = 1e3 * float(row["top"]), 1e3 * float(row["low"])
                    self.assertTrue(clearance - 0.2 < top < clearance)  # leaning, an axle stays there; rebounding, it leaves by millimetres
                    self.assertTrue(low > clearance - 0.15 if clearance == 2 else low < clearance - 5)

    def test_position_of_the_centre(self):
        """The bogie with coupled wheels leans where a worn wheel displaces the centre of its oscillation beyond the rail, in all cells."""
        found = [row for row in regimes.table(RECORDED).values() if row["map"] == "wear"]
        self.assertEqual(len(found), 99)
        for row in found:
            beyond = float(row["x"]) / (2 * 0.05) > float(row["clearance"]) - 0.06  # where flanges touch
            self.assertEqual(row["regime"] == "leans left", beyond, row)
            self.assertTrue(beyond or regimes.rebounds(row["regime"]))

    def test_picture(self):
        """The maps are drawn from the recorded table."""
        drawn = io.StringIO()
        with contextlib.redirect_stdout(drawn):
            draw_regimes.main(RECORDED)
        self.assertEqual(drawn.getvalue(), (HERE / "regimes.svg").read_text())


class Formulations(unittest.TestCase):
    def test_formulations(self):
        ways = [simulated(0.7, "--rtol", rtol, "--output-step", 0.05, *words)
                for rtol, words in ((1e-8, ()), (1e-8, ("--formulation", "dae", "--integrator", "ida")))]
        for name in ("q.psi", "q.y", "q.yaw", "q.car_roll"):  # to a hundred tolerances
            self.assertLess(max(abs(a[name] - b[name]) for a, b in zip(*ways)), 1e-6, name)


if __name__ == "__main__":
    runs.main()
