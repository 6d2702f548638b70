#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every reason of the sources for which a result is not trustworthy (kmp_doubt), provoked by a model. Text, object, page, exit code and Python say the same.

    python3 tests/distrusts.py build/dev/kempe
"""
import json
import math
import os
import pathlib
import pty
import re
import subprocess
import sys
import tempfile
import unittest

import flexible_formats

ROOT = pathlib.Path(__file__).resolve().parents[1]
KEMPE = "kempe"  # set by main
BAR, STICK, CONICITY, RAILS = (f"examples/{name}.yaml" for name in ("four_bar/four_bar", "stick_slip/stick_slip", "conicity/conicity", "restrained_wheelset/wheelset_on_rails"))
BEAM = ("kempe: 1\ngravity: [0, {g}, 0]\nbodies:\n  rod:\n    joint: {joint}\n    flexible: {{beam: {{length: 2, rhoA: 3, EIz: {EI}}}, shapes: {{y: 2}}, {more}}}\n"
        "    points: {{tip: {{station: 2}}}}\n{rest}run: {{t_end: 0.5}}\n")
SWING = "kempe: 1\ngravity: [0, -9.81, 0]\nbodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}}}\nrun: {t_end: 1}\n"
SLIDE = "kempe: 1\nparameters: {F: 0}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}}\n"
COLUMN = ("kempe: 1\nbodies:\n  base: {joint: {name: s, prismatic: y, at: ground}, mass: 1}\n  rod:\n    joint: {weld: yes, at: base}\n"
          "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 4}}\n    points: {tip: {station: 1}}\n"
          "forces: {end: {at: rod.tip, force: [P, 0]}}\nstart: S\nrun: {t_end: 0.01}\n")
MODELS = {
    "feet": "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {m: 3}\nground: {points: {O: [0, 0, 0]}}\n"
            "bodies: {b: {joint: {name: j, planar: z, at: ground}, mass: m, inertia: {zz: 0.1}, points: {A: [-1, 0, 0], B: [0, 0, 0], C: [1, 0, 0]}}}\n"
            "contacts:\n" + "".join(f"  {name}: {{point: b.{name}, on: {{plane: ground.O, normal: y}}, restitution: 0, friction: {mu}}}\n"
                                  for name, mu in (("A", 0.1), ("B", 0.5), ("C", 0.1))) + "start: {qd: {j.1: 3}}\nrun: {t_end: 0.2, outputs: [q]}\n",
    "law": "kempe: 1\ntables: {law: {x: [0, 1, 2, 3], y: [0, 1, 4, 4.1]}}\nparameters: {m: 2}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: m}}\n"
           "forces: {f: {joint: x, force: 'law(t)'}}\nrun: {t_end: 6, outputs: [q, qd]}\n",
    "ended": "kempe: 1\ngravity: [0, 0, -10]\nparameters: {m: 1.1}\ntables: {spring: {x: [-0.1, 0.1], y: [10, -10], method: linear, outside: error}}\n"
             "bodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: m}}\nforces: {f: {joint: z, force: 'spring(q(z)) - qd(z)'}}\nstart: {q: {z: -0.12}}\n",
    "level": "kempe: 1\nparameters: {m: 1}\nbodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: m}}\n"
             "forces: {f: {joint: X, friction: {force: 0.5*cos(4*t)}}}\nstart: {qd: {X: 1}}\nrun: {t_end: 1, outputs: [q]}\n",
    "flat": """kempe: 1
gravity: [0, 0, -9.81]
ground: {points: {O: [0, 0, 0]}}
bodies:
  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.1, 0, 0]}}
  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.01}, points: {C: [0.3, 0, 0]}}
  slider: {mass: 5, inertia: {zz: 0.1}, points: {C: [0, 0, 0]}}
joints: {C: {revolute: [rod.C, slider.C], cut: no}, S: {prismatic: [ground.O, slider.C], axis: x, cut: yes}}
forces: {rub: {sliding: position(slider.C).x, friction: {mu: 0.3, reaction: S, speed: 1 mm/s}}}
start: {q: {A: 60 deg, B: -80 deg}, hold: [A]}
run: {t_end: 0.05, outputs: [q]}
""",
    "hinges": """kempe: 1
gravity: [0, 0, -10]
ground: {points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}
bodies: {b: {mass: 7, com: [0.1, 0, -0.3], inertia: {xx: 0.2, yy: 0.6, zz: 0.5}, points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}}
joints: {hL: {revolute: [ground.L, b.L], axis: x}, hR: {revolute: [ground.R, b.R], axis: x}}
start: {q: {hL: 1}}
forces: {f: {joint: hL, friction: {mu: 0.3, radius: 0.02}}}
run: {t_end: 0.1, outputs: [q]}
""",
    # The axis of the crank is off by 1 mm in 1 m: one equation of the loop is nearly redundant in most positions, and open by more in some.
    "tilted": """kempe: 1
closure_tolerance: 0.5 mm
ground: {points: {A: [0, 0, 0], D: [1, 0, 0]}}
bodies:
  crank: {joint: {revolute: [0, 0.001, 1], at: ground.A}, mass: 1, inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, points: {B: [0.3, 0, 0]}}
  coupler: {joint: {revolute: z, at: crank.B}, mass: 1, com: [0.4, 0, 0], inertia: {xx: 0.01, yy: 0.05, zz: 0.05}, points: {C: [0.8, 0, 0]}}
  rocker: {joint: {revolute: z, at: ground.D}, mass: 1, com: [0.25, 0, 0], inertia: {xx: 0.01, yy: 0.02, zz: 0.02}, points: {C: [0.5, 0, 0]}}
loops: {C: {ball: [coupler.C, rocker.C]}}
start: {q: {coupler: 45 deg, rocker: 90 deg}, qd: {crank: 5}, hold: [crank]}
run: {t_end: 2}
""",
    "soft": BEAM.format(g=-9.81, joint="{weld: yes, at: ground}", EI=30, more="stiffening: first", rest=""),
    "sided": SLIDE + "forces: {f: {joint: x, force: 'F - if(q(x) < 0, 100, 400)*q(x)'}}\n",
    "halves": SLIDE + "forces: {f: {joint: x, force: 'F - 100*q(x) - if(qd(x) < 0, 2, -1)*qd(x)'}}\n",
    "fast": BEAM.format(g=0, joint="{name: A, revolute: z, at: ground}", EI=100, more="stiffening: none", rest="start: {qd: {A: 60}}\n"),
    "bent": COLUMN.replace("P", "-1, 6").replace("S", "{elastic: static}"),
    # It deflects by 0.16 of its length in the middle of the run, and by 0.013 of it at the end.
    "returns": "kempe: 1\nparameters: {EI: 300}\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
               "    flexible: {beam: {length: 2, rhoA: 3, EIz: EI}, shapes: {y: 1}, stiffening: none, damping: {ratio: 0.3}}\n    points: {tip: {station: 2}}\n"
               "forces: {f: {at: rod.tip, force: [0, '40*sin(pi*t)^2', 0]}}\nrun: {t_end: 1, outputs: [q]}\n",
    "straight": COLUMN.replace("P", "-30, 0").replace("S", "{q: {rod.y1: 0}}"),
    "buckled": COLUMN.replace("P", "-30, 0").replace("S", "{elastic: static}"),
    "swing": SWING,
    "moved": SWING.replace("run:", "loops: {turn: {constraint: 'q(A) - t'}}\nrun:"),
    "shake": SLIDE + "drives: {d: {joint: x, displacement: '1e-3*sin(2*pi*190*t)'}}\nrun: {t_end: 8}\n",
    "strikes": SLIDE + "forces: {s: {joint: x, force: '-9*q(x)'}}\ncontacts: {stop: {joint: x, lower: -0.1, restitution: 0.5}}\nstart: {q: {x: 0.2}}\nrun: {t_end: 6}\n",
    "spring": SLIDE + "forces: {s: {joint: x, force: '-(2*pi)^2*q(x)'}}\n",
    # The terms of the force cancel but for twelve digits, so that no bounds of it are known over an interval.
    "cancels": SLIDE + "forces: {f: {joint: x, force: '1e10*exp(t) - 1e10*exp(t - 1e-12)'}}\nrun: {t_end: 1}\n",
    "pulses": SLIDE + "forces: {f: {joint: x, force: 'exp(-(sin(6000*t)/1e-2)^2)'}}\nrun: {t_end: 1}\n",
    "snaps": SLIDE + "forces: {f: {joint: x, force: 'F - 10*(q(x) - q(x)^3) - 0.1*qd(x)'}}\n",
    # A damper whose force grows so fast with the speed that each cycle is smaller than the first one that is looked for.
    "damped": SLIDE + "forces: {f: {joint: x, force: 'F*qd(x) - 100*q(x) - 1e14*qd(x)^3'}}\n",
    "twins": "kempe: 1\nparameters: {F: 0.1}\nbodies:\n  a: {joint: {name: a, prismatic: x, at: ground}, mass: 1}\n  b: {joint: {name: b, prismatic: x, at: ground}, mass: 1}\n"
             "forces: {a: {joint: a, force: F}, b: {joint: b, force: F}}\nrun: {t_end: 1}\n",
    "rolls": (ROOT / RAILS).read_text().replace("force: -load}", "force: '-load*(1 + 0.3*sin(2*pi*370*t))'}"),
}
MOTION = "t,q.A\n" + "".join(f"{k / 8:.17g},{math.sin(9 * k / 8):.17g}\n" for k in range(9))
WAVES = "t,q.rocker\n" + "".join(f"{k / 50},{0.3 * math.sin(25 * k / 50):.17g}\n" for k in range(51))
# Two columns that contradict each other, with noise: the weight of one grows slowly at the cost of the other.
AGAINST = "t,q.a,q.b\n" + "".join(f"{t:.17g},{1.05 * t * t / 2 + noise:.17g},{-t * t / 2 + noise:.17g}\n" for t, noise in ((k / 30, 0.13 * (-1)**k) for k in range(31)))
FILES = {"motion.csv": MOTION, "waves.csv": WAVES, "against.csv": AGAINST, "bars.csv": "crank\n0.3\n50\n"}
# The words of the reason in the sources; the command that provokes it; the same in Python, of `m`, the model, or `s`, its system; a command before it.
PROVOKED = [
    ("the energy error is", f"simulate {BAR} --rtol 1e-3 --t-end 60", "m.simulate(rtol=1e-3, t_end=60)"),
    ("do not trust the motion beyond t =", f"simulate {BAR} --rtol 1e-3 --t-end 60", ""),
    ("the loops open by", f"simulate {BAR} --formulation dae --integrator ida --rtol 1e-2 --t-end 1", "m.simulate(formulation='dae', integrator='ida', rtol=1e-2, t_end=1)"),
    ("the accuracy of this run could not be checked", "simulate swing.yaml --rtol 1e-4 --t-end 5 --max-steps 30", "m.simulate(rtol=1e-4, t_end=5, max_steps=30)"),
    ("omitted as redundant, is open by", "simulate tilted.yaml", "m.simulate()"),
    ("were not searched to the end for short pulses", "simulate cancels.yaml", "m.simulate()"),
    ("change in more intervals of about", "simulate pulses.yaml", "m.simulate()"),
    ("KMP_TABLE_LEFT", "simulate law.yaml", "m.simulate()"),
    ("KMP_RUN_WOULD_END", "equilibrium ended.yaml", "s.equilibrium()"),
    ("KMP_RUN_WOULD_END", "modes ended.yaml --sweep m=0.5:1.5:3", "s.modes(sweep='m=0.5:1.5:3')"),
    ("KMP_RUN_WOULD_END", "check ended.yaml", "s.check()"),
    ("KMP_RUN_WOULD_END", "assemble ended.yaml", "s.assemble()"),
    ("lacks the load of '%s' across the plane", "simulate flat.yaml", "m.simulate()"),
    ("depends on a load that redundant constraints share", "simulate hinges.yaml", "m.simulate()"),
    ("friction makes the motion depend on the %s of redundant", "simulate feet.yaml", "m.simulate()"),
    ("friction makes the motion depend on the %s of redundant", "sensitivity feet.yaml --parameters m --outputs 'q(j.1)'", "m.sensitivity(parameters='m', outputs='q(j.1)')"),
    ("redundant contacts in instances", "ensemble feet.yaml --sample m=1:2 --instances 3", "m.ensemble(m.sample('m=1:2', 3)).run()"),
    ("redundant contacts in instances", "optimize feet.yaml --minimize 'max(q(j.1))' --parameter m:2:4", "m.optimize(minimize='max(q(j.1))', parameters='m:2:4')"),
    ("deflects by %.3g m at t =", "simulate soft.yaml", "m.simulate()"),
    ("deflects by %.3g m at t =", "simulate returns.yaml --output-step 1", "m.simulate(output_step=1)"),
    ("deflects by %.3g m at t =", "sensitivity returns.yaml --parameters EI --t-end 0.7", "m.sensitivity(parameters='EI', t_end=0.7)"),
    ("deflects by %.3g m at t =", "sensitivity returns.yaml --parameters EI --method adjoint --outputs 'q(rod.y1)'", "m.sensitivity(parameters='EI', method='adjoint', outputs='q(rod.y1)')"),
    ("deflects by %.3g m at t =", "fit returns.yaml returns.csv --parameter EI:200:400", "", "simulate returns.yaml -o returns.csv"),
    ("KMP_TURNS_FASTER", "simulate fast.yaml", "m.simulate()"),
    ("KMP_TURNS_FASTER", "sensitivity fast.yaml --parameters qd.A --outputs 'q(A)'", "m.sensitivity(parameters='qd.A', outputs='q(A)')"),
    ("KMP_TURNS_FASTER", "modes fast.yaml", "s.modes()"),
    ("KMP_TURNS_FASTER", "modes fast.yaml --sweep qd.A=10:60:3", "s.modes(sweep='qd.A=10:60:3')"),
    ("KMP_TURNS_FASTER", "linearize fast.yaml", "s.linearize()"),
    ("KMP_TURNS_FASTER", "equilibrium fast.yaml --rates A=60", "s.equilibrium(rates='A=60')"),
    ("of a condition that changes at this state", "modes sided.yaml", "s.modes()"),
    ("of a condition that changes at this state", "linearize sided.yaml", "s.linearize()"),
    ("of a condition that changes at this state", "response sided.yaml --inputs 'effort(x)' --frequencies 0.1:1:3", "s.response(inputs='effort(x)', frequencies='0.1:1:3')"),
    ("of a condition that changes at this state", "sensitivity sided.yaml --of equilibrium --parameters F --outputs 'q(x)'", ""),
    ("the stability is not known, because motions grow on some sides", "equilibrium halves.yaml", "s.equilibrium()"),
    ("in instances %s: %s", "ensemble fast.yaml --sample qd.A=59:60 --instances 3", "m.ensemble(m.sample('qd.A=59:60', 3)).run()"),
    ("in instances %s: %s", "optimize fast.yaml --minimize 'q(A)' --parameter qd.A:50:60", "m.optimize(minimize='q(A)', parameters='qd.A:50:60')"),
    ("KMP_TURNS_AVERAGED", "simulate arm.yaml", "m.simulate()"),
    ("straight because no load deflects it", "simulate straight.yaml", "m.simulate()"),
    ("start: the deformations are in balance", "simulate buckled.yaml", "m.simulate()"),
    ("later ones are not refined: evaluate a shorter time", "simulate rolls.yaml --t-end 8.1 --no-convergence-check", "m.simulate(t_end=8.1, no_convergence_check=True, judge_safety=True)"),
    ("deformations are in balance with their loads, but not in a stable one", "kinematics buckled.yaml --sweep s=0:0.1:3 --elastic static", "s.kinematics(sweep='s=0:0.1:3', elastic='static')"),
    ("shapes with terms of second order are", "kinematics bent.yaml --sweep s=0:0.1:3 --elastic static", "s.kinematics(sweep='s=0:0.1:3', elastic='static')"),
    ("shapes with terms of second order are", "equilibrium soft.yaml", "s.equilibrium()"),
    ("shapes with terms of second order are", "modes soft.yaml", "s.modes()"),
    ("shapes with terms of second order are", "linearize soft.yaml", "s.linearize()"),
    ("do not trust the response at", "response spring.yaml --inputs 'effort(x)' --frequencies 0.99999999999:1.5:4 --linear", "s.response(inputs='effort(x)', frequencies='0.99999999999:1.5:4', linear=True)"),
    ("equilibria are known only from", "cycles snaps.yaml --sweep F=0:10", "s.limit_cycles(sweep='F=0:10')"),
    ("no limit cycle is found near the Hopf point", "cycles damped.yaml --sweep F=-1:1", "s.limit_cycles(sweep='F=-1:1')"),
    ("this state is not an equilibrium, because friction cannot hold it", f"equilibrium {STICK} --stick", "s.equilibrium(stick=True)"),
    ("instances use table", "ensemble law.yaml --sample m=1:2 --instances 3", "m.ensemble(m.sample('m=1:2', 3)).run()"),
    ("instances use table", "ensemble law.yaml --sample m=1:2 --instances 3 --out law.kempe", ""),
    ("instances that did not reach their end", "gather law.kempe", ""),
    ("were not searched to the end for short pulses", "ensemble cancels.yaml --sample F=1:2 --instances 2", ""),
    ("instances that did not reach their end", f"ensemble {BAR} --values bars.csv --t-end 0.1", "m.ensemble(m.values('bars.csv')).run(t_end=0.1)"),
    ("instances that did not reach their end", "gather bars.kempe", "", f"ensemble {BAR} --values bars.csv --t-end 0.1 --out bars.kempe"),
    ("no values within the bounds satisfy all limits", f"optimize {BAR} --minimize 'max(qd(rocker))' --parameter base:0.85:0.95 --limit 'max(q(rocker)) > 2' --t-end 1",
     "m.optimize(minimize='max(qd(rocker))', parameters='base:0.85:0.95', limits='max(q(rocker)) > 2', t_end=1)"),
    ("KMP_LEVEL_PUSHES", "simulate level.yaml", "m.simulate()"),
    ("KMP_LEVEL_PUSHES", "simulate level.yaml --output-step 0.75", "m.simulate(output_step=0.75)"),
    ("KMP_LEVEL_PUSHES", "sensitivity level.yaml --parameters m --t-end 0.6", "m.sensitivity(parameters='m', t_end=0.6)"),
    ("KMP_LEVEL_PUSHES", "sensitivity level.yaml --parameters m --method adjoint --outputs 'q(X)'", "m.sensitivity(parameters='m', method='adjoint', outputs='q(X)')"),
    ("KMP_LEVEL_PUSHES", "fit level.yaml level.csv --parameter m:0.5:2", "", "simulate level.yaml -o level.csv"),
    ("has a negative level in instances", "ensemble level.yaml --sample m=1:2 --instances 3", "m.ensemble(m.sample('m=1:2', 3)).run()"),
    ("has a negative level in instances", "optimize level.yaml --minimize 'max(q(X))' --parameter m:0.5:2", "m.optimize(minimize='max(q(X))', parameters='m:0.5:2')"),
    ("instances use table", "optimize law.yaml --minimize 'max(q(x))' --parameter m:1:3", "m.optimize(minimize='max(q(x))', parameters='m:1:3')"),
    ("the best search has not converged after", f"optimize {BAR} --minimize 'max(qd(rocker))' --parameter base:0.85:0.95,crank:0.2:0.31 --t-end 1 --most 2",
     "m.optimize(minimize='max(qd(rocker))', parameters='base:0.85:0.95,crank:0.2:0.31', t_end=1, most=2)"),
    ("the fitted motion does not follow the data", f"fit {BAR} waves.csv --parameter crank_mass:0.5:2", "m.fit(data='waves.csv', parameters='crank_mass:0.5:2')"),
    ("the search has not converged after", f"fit {BAR} waves.csv --parameter crank_mass:0.5:2,coupler_mass:0.5:2 --most 1", "m.fit(data='waves.csv', parameters='crank_mass:0.5:2,coupler_mass:0.5:2', most=1)"),
    ("the deviations of the columns still change", "fit twins.yaml against.csv --parameter F:-5:5", "m.fit(data='against.csv', parameters='F:-5:5')"),
    ("do not trust these actuator forces", "inverse swing.yaml --motion motion.csv --actuators A", "s.inverse(motion='motion.csv', actuators='A')"),
    ("depends on time: it prescribes the motion and carries its loads", "inverse moved.yaml --actuators A", "s.inverse(actuators='A')"),
    ("comfort: an impact changes the velocity", "comfort strikes.yaml --vertical 'acceleration(m.P).x'", "s.comfort(vertical='acceleration(m.P).x')"),
    ("comfort: with every other sample", "comfort shake.yaml --vertical 'acceleration(m.P).x' --rate 400", "s.comfort(vertical='acceleration(m.P).x', rate=400)"),
    ("is not resolved by values", f"contact {CONICITY} --sweep 'shift=-9 mm:9 mm:3' --conicity '3 mm:6 mm:2'", "s.contact(sweep='shift=-9 mm:9 mm:3', conicity='3 mm:6 mm:2')"),
    ("is not resolved by %d places", f"contact {CONICITY} --sweep 'shift=-7 mm:7 mm:15' --conicity '3 mm:6 mm:2'", "s.contact(sweep='shift=-7 mm:7 mm:15', conicity='3 mm:6 mm:2')"),
]
SAID = {"KMP_TURNS_FASTER": "faster than its first frequency", "KMP_TURNS_AVERAGED": "so that rates up to", "in instances %s: %s": "its stiffness is lost at such speeds", "KMP_TABLE_LEFT": "it goes straight on there", "KMP_LEVEL_PUSHES": "which must not be negative: it would push", "KMP_RUN_WOULD_END": "a run would end at this state", "gather law.kempe": "3 instances are not trustworthy", "instances that did not reach their end": "1 failed"}  # in texts
DISTRUSTS = r"\b(?:do not trust|not trustworthy|(?:not|cannot) be trusted|not to be trusted|(?:may|might|can) be wrong|results? (?:is|are) wrong|not reliable|unreliable)"
STATUS_WORDS = ["src/cli/main.c", "src/cli/options.c", "src/output/print.c"]  # help and names of the status
PASSED_ON = 4  # calls that pass on a sentence that is made elsewhere


def doubts():
    """The sentences of kmp_doubt in the sources, each with its parts joined."""
    for path in sorted(path for folder in ("src", "constraints", "integrators") for path in (ROOT / folder).rglob("*.c")):
        text = path.read_text()
        for call in re.finditer(r"\bkmp_doubt\(\s*[^,;]+,\s*((?:\w+,|(?:\"(?:[^\"\\]|\\.)*\"\s*)+))", text):
            yield call[1].rstrip(",") if call[1][0] != '"' else "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', call[1]))


class Distrusts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.environment = {**os.environ, "KEMPE_CACHE": folder.name, "PYTHONPATH": str(pathlib.Path(KEMPE).parent / "python")}
        (cls.folder / "examples").symlink_to(ROOT / "examples")
        (cls.folder / "arm.yaml").write_text(flexible_formats.ARM.replace("FLEXIBLE", "file: arm.SID_FEM" + flexible_formats.SCALE))
        (cls.folder / "arm.SID_FEM").write_text(flexible_formats.sid(flexible_formats.cloud(), change=lambda zero, first: first.pop("Oe")))
        for name, text in {**{name + ".yaml": text for name, text in MODELS.items()}, **FILES}.items():
            (cls.folder / name).write_text(text)

    def run_kempe(self, words):
        return subprocess.run(f"{KEMPE} {words}", shell=True, capture_output=True, text=True, cwd=self.folder, timeout=100, env=self.environment)

    def test_every_reason(self):
        """Each sentence of the sources is in a row."""
        said = list(doubts())
        self.assertGreater(len(said), 30)
        rows = [row[0] for row in PROVOKED]
        self.assertEqual([s for s in said if not s.startswith("%") and not any(row in s for row in rows)], [])
        self.assertEqual([row for row in rows if not any(row in s for s in said)], [])
        self.assertEqual(sum(s.startswith("%") for s in said), PASSED_ON)

    def test_each_sentence_is_a_doubt(self):
        """A sentence of the sources that distrusts a result is said by kmp_doubt, or by a function of doubts; those that are not are the words of the status."""
        found = {}
        for path in sorted(path for folder in ("src", "constraints", "integrators") for path in (ROOT / folder).rglob("*.[ch]")):
            text = re.sub(r"/\*.*?\*/", lambda comment: "\n" * comment[0].count("\n"), path.read_text(), flags=re.S)
            joined = re.sub(r'"\s*\n\s*"', "", text)
            for sentence in re.finditer(rf'"[^"\n]*(?:{DISTRUSTS})', joined):
                call = joined[joined.rfind(";", 0, sentence.start()):sentence.start()]
                function = re.findall(r"^\w[^;\n]*\b(\w+)\([^;]*$", joined[:sentence.start()], re.M)
                if not ("kmp_doubt(" in call or (function and re.search("doubt|distrust", function[-1]))):
                    found.setdefault(str(path.relative_to(ROOT)), []).append(sentence[0])
        self.assertEqual(sorted(found), STATUS_WORDS, found)

    def test_all_agree(self):
        helped = {command: self.run_kempe(f"help {command}").stdout for command in {row[1].split()[0] for row in PROVOKED}}
        for words, command, _, *before in PROVOKED:
            with self.subTest(words):
                for other in before:
                    self.run_kempe(other)
                part = SAID.get(command) or SAID.get(words) or max(re.split(r"%\.?\d*\w|'%s'", words), key=len).strip()
                page = self.folder / "page.html" if "--report" in helped[command.split()[0]] and "--out " not in command else None
                done = self.run_kempe(command + " --json found.json" + (" --report page.html" if page else ""))
                self.assertEqual(done.returncode, 5, done.stdout[:300] + done.stderr)
                lines = done.stdout.split("\n")
                self.assertRegex(lines[0], r": not trustworthy\b")
                self.assertIn(part, " ".join(" ".join(lines[1:12]).split()))
                found = json.loads((self.folder / "found.json").read_text())
                self.assertEqual(found["status"], "not trustworthy")
                self.assertTrue(command.startswith("gather") or any(words in SAID or part in warning for warning in found["warnings"]), found.get("warnings"))
                if page:
                    shown = page.read_text()
                    self.assertTrue('"not trustworthy"' in shown and part in shown)
                    page.unlink()

    def test_terminal(self):
        """A screen that shows both streams has each sentence once, and the advice."""
        for command, *sentences in ((f"simulate {BAR} --rtol 1e-3 --t-end 60", "the energy error is", "do not trust the motion beyond t =", "use a smaller rtol"), (f"simulate {BAR} --max-steps 40", "the limit of 40 steps"), ("simulate examples/n_four_bar/n_four_bar_40.yaml --rtol 1e-12", "errors of rounding count here")):
            parent, child = pty.openpty()
            with subprocess.Popen([KEMPE, *command.split()], stdout=child, stderr=child, cwd=self.folder) as process:
                os.close(child)
                screen = b""
                try:
                    while part := os.read(parent, 4096):
                        screen += part
                except OSError:  # the other end is closed
                    pass
                process.wait()
            os.close(parent)
            self.assertEqual([screen.count(sentence.encode()) for sentence in sentences], [1] * len(sentences), screen.decode())

    def test_python(self):
        """The results have the word, and are not trusted."""
        calls = [(command.split()[1], call) for _, command, call, *_ in PROVOKED if call]
        program = f"import kempe, warnings\nwarnings.simplefilter('ignore')\nfor path, call in {calls!r}:\n    m = kempe.Model(path)\n    s = m.system()\n    print(path, eval(call).trusted)\n"
        done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, cwd=self.folder, env=self.environment)
        self.assertEqual(done.stdout.splitlines(), [f"{path} False" for path, _ in calls], done.stderr)


if __name__ == "__main__":
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
