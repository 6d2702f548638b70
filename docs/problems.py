#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/problems.md: problems with reference digits that Kempe did not make, and the error of a run against them.

    python3 docs/problems.py build/release/kempe            runs all and writes the page
    python3 docs/problems.py build/release/kempe --check    fails when an error differs from the page by more than tenfold
"""
import importlib.machinery
import importlib.util
import json
import pathlib
import re
import subprocess
import sys

import generated

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/problems.md"
SLACK, ROUNDING = 10, 1e-14  # between machines; differences below are rounding
TEST_SET = "Test Set for IVP Solvers"
IFTOMM = "IFToMM benchmark"

# title, introduction, rows: problem, source of the digits, model, reference, tolerance
PARTS = (
    ("Published digits", "The digits are taken from the named publication. Their errors may be larger than Kempe's:\n"
     "the digits of Andrews' mechanism and of the windows are recomputed in the next table.", (
         ("Andrews' squeezing mechanism", f"{TEST_SET}, PSIDE at 1e-14", "andrews/andrews", "andrews/published", "1e-12"),
         ("Car axis", f"{TEST_SET}, R package deTestSet", "car_axis/car_axis", "car_axis/published", "1e-12"),
         ("Wheelset", f"{TEST_SET}, DASSL, 58510 steps", "wheelset/wheelset", "wheelset/reference", "1e-8"),
         ("Windows of four-bars, N = 40", f"{IFTOMM} A02, solution file of six digits", "n_four_bar/n_four_bar_40", "n_four_bar/published_40",
          "1e-12"))),
    ("Published problems, recomputed digits", "The data are published. The digits come from separate programs in extended precision, of which two runs agree on all\n"
     "digits. The windows of N = 40 pass 20 singular positions, each of which amplifies rounding: at tolerances from 7e-13 to 1.3e-12\n"
     "their error is between 5e-12 and 2e-7.", (
         ("Andrews' squeezing mechanism", "113-bit arithmetic, two formulations", "andrews/andrews", "andrews/reference", "1e-12"),
         ("Car axis", "30 digits, the published equations", "car_axis/car_axis", "car_axis/reference", "1e-12"),
         ("Windows of four-bars, N = 1", f"{IFTOMM} A02, 113-bit arithmetic", "n_four_bar/n_four_bar_1", "n_four_bar/reference_1", "1e-12"),
         ("Windows of four-bars, N = 2", f"{IFTOMM} A02, 113-bit arithmetic", "n_four_bar/n_four_bar", "n_four_bar/reference", "1e-12"),
         ("The same with spatial hinges", f"{IFTOMM} A02, 113-bit arithmetic", "n_four_bar_spatial/n_four_bar_spatial",
          "n_four_bar_spatial/reference", "1e-12"),
         ("Windows of four-bars, N = 40", f"{IFTOMM} A02, 113-bit arithmetic", "n_four_bar/n_four_bar_40", "n_four_bar/reference_40", "1e-12"),
         ("Bricard's six-bar", f"{IFTOMM} A04, 113-bit arithmetic and closed form", "bricard/bricard", "bricard/reference", "1e-12"),
         ("Stiff flyball governor", f"{IFTOMM} A05, 113-bit arithmetic", "governor/governor", "governor/reference", "1e-12"),
         ("Spatial slider-crank", "IFToMM library, 113-bit arithmetic", "spatial_slider_crank/spatial_slider_crank",
          "spatial_slider_crank/reference", "1e-12"),
         ("Double wishbone", "data of Project Chrono, 113-bit arithmetic", "double_wishbone/double_wishbone", "double_wishbone/reference",
          "1e-12"))),
    ("Closed forms", "The digits follow from formulas.", (
        ("Bennett's four-bar", "product of half-angle tangents", "bennett/bennett", "bennett/reference", "1e-12"),
        ("Peaucellier's linkage", "inversion in a circle", "peaucellier/peaucellier", "peaucellier/reference", "1e-12"),
        ("Chebyshev's lambda linkage", "intersection of circles, published positions", "chebyshev/chebyshev", "chebyshev/reference", "1e-12"),
        ("Jansen's leg", "intersection of circles, published positions", "jansen_leg/jansen_leg", "jansen_leg/reference", "1e-12"),
        ("Crank-rocker", "intersection of circles, 40 digits", "crank_rocker/crank_rocker", "crank_rocker/reference", "1e-12"),
        ("Driven slider-crank", "closed form, 50 digits", "driven_slider_crank/driven_slider_crank", "driven_slider_crank/reference", "1e-12"),
        ("Clutch start of a drive line", "polynomials between events, 30 digits", "clutch_start/clutch_start", "clutch_start/reference", "1e-12"),
        ("Half shaft of a steered wheel", "geometry and a quadrature, 30 digits", "half_shaft/half_shaft", "half_shaft/reference", "1e-12"),
        ("Scissor lift that a winch raises", "energy and moment of momentum of the whole lift", "scissor_lift/scissor_lift", "scissor_lift/reference", "1e-12"),
        ("Ratchet jack", "circles of the pawls", "ratchet_jack/ratchet_jack", "ratchet_jack/reference", "1e-10"),
        ("Quarter car", "sum of four modes, 40 digits", "quarter_car/quarter_car", "quarter_car/reference", "1e-12"),
        ("Grashof four-bar", "integral over the crank angle, 40 digits", "four_bar/four_bar", "four_bar/reference", "1e-12"),
        ("The same with spatial hinges", "integral over the crank angle, 40 digits", "four_bar/four_bar_spatial", "four_bar/reference", "1e-12"),
        ("The same, masses 1e-6 : 1 : 1e6", "integral over the crank angle, 40 digits", "four_bar/four_bar_ill", "four_bar/reference_ill",
         "1e-12"),
        ("Stephenson's six-bar", "integral over the crank angle, 40 digits", "stephenson/stephenson", "stephenson/reference", "1e-12"),
        ("Toggle press that strikes an anvil", "quadrature between impacts, 30 digits", "toggle_press/toggle_press", "toggle_press/reference",
         "1e-12"))),
    ("Independent programs", "The models are Kempe's own. Each program has a separate formulation, and its two step sizes or tolerances agree.", (
        ("Slider-crank through dead centres", "113-bit arithmetic", "slider_crank/slider_crank", "slider_crank/reference", "1e-12"),
        ("The same with spatial hinges", "113-bit arithmetic", "slider_crank_spatial/slider_crank_spatial", "slider_crank_spatial/reference",
         "1e-12"),
        ("Planar parallel robot", "30 digits, as a five-bar", "parallel_robot/parallel_robot", "parallel_robot/reference", "1e-12"),
        ("Leg of a robot, from URDF+", "30 digits, as two double pendulums", "robot_leg/robot_leg", "robot_leg/reference", "1e-12"),
        ("Five-bar robot with flexible links", "virtual work at points of Gauss, SciPy at 1e-13", "flexible_robot/flexible_robot",
         "flexible_robot/reference", "1e-12"),
        ("Blade from a mesh, driven at its corner", "Lagrange's equations with the mass between nodes, SciPy at 1e-12", "flexible_blade/flexible_blade",
         "flexible_blade/reference", "1e-11"),
        ("Slider-crank in space with a flexible rod", "virtual work at points of Gauss, SciPy at 1e-11",
         "flexible_slider_crank/flexible_slider_crank", "flexible_slider_crank/reference", "1e-12"),
        ("Flexible pendulum", "virtual work at points of Gauss, SciPy at 1e-12", "flexible_pendulum/flexible_pendulum",
         "flexible_pendulum/reference", "1e-12"),
        ("Crane that lifts a swinging load", "equation of the hook, SciPy at 3e-14", "crane/crane", "crane/reference", "1e-12"),
        ("Quarter car on a tyre over a bump", "Newton's equations with the Magic Formula, SciPy at 3e-14", "quarter_car_on_tyre/quarter_car_on_tyre",
         "quarter_car_on_tyre/reference", "1e-12"),
        ("Geneva drive", "closed form", "geneva_drive/geneva_drive", "geneva_drive/reference", "1e-12"),
        ("Planetary gearbox with elastic teeth", "equations in three angles, SciPy at 3e-14", "planetary_gearbox/planetary_gearbox",
         "planetary_gearbox/reference", "1e-12"),
        ("Cam and valve that lifts off", "closed forms, 30 digits", "valve_train/valve_train", "valve_train/reference", "1e-12"),
        ("Gough-Stewart platform", "113-bit arithmetic", "stewart/stewart", "stewart/reference", "1e-12"),
        ("Suspension", "absolute coordinates, long doubles", "suspension/suspension", "suspension/reference", "1e-12"),
        ("Excavator with hydraulics and a digital controller", "113-bit arithmetic", "hydraulic_excavator/hydraulic_excavator",
         "hydraulic_excavator/reference", "1e-12"),
        ("Machine that walks on four of Jansen's legs", "legs of known motion, SciPy at 1e-13", "jansen_walker/jansen_walker", "jansen_walker/reference", "1e-12"))),
)
# Of bench/machines: title, source of the digits, tables.
EVENTS = (
    ("Block on a belt, limit cycle", "closed form, 40 digits", "friction_belt"),
    ("Block on a belt, friction falls with the rate", "113-bit arithmetic", "friction_falling"),
    ("Mass on a spring comes to rest", "closed form, 40 digits", "friction_spring"),
    ("Block on an incline under a varying force", "closed form, 40 digits", "friction_incline"),
    ("Pendulum with a Coulomb pivot", "energy and quadrature, 40 digits", "friction_pendulum"),
    ("Two stacked blocks", "closed form, 40 digits", "friction_stack"),
    ("Slider-crank, friction by the guide's load", "113-bit arithmetic", "friction_guide"),
    ("The same, driven", "113-bit arithmetic", "friction_driven"),
    ("Slider-crank, two frictions on one freedom", "113-bit arithmetic", "friction_pair"),
    ("Four-bar, friction by a pin's reaction", "113-bit arithmetic", "friction_pin"),
    ("Painlevé's rod", "closed form, 40 digits", "friction_rod"),
    ("Bouncing ball", "closed form, 40 digits", "contact_bounce"),
    ("Sphere that slips, then rolls", "closed form, 40 digits", "contact_rolling"),
    ("Puck on an incline, across the slope", "quadrature, 30 digits", "contact_incline"),
    ("Stool on three feet that spins", "closed form, 40 digits", "contact_spin"),
    ("Oblique impact, and a load that turns", "closed form, 40 digits", "contact_oblique"),
    ("Cylinder that rolls in a hollow", "elliptic functions, 40 digits", "contact_hollow"),
    ("Point on a rough arc", "closed form and quadrature, 30 digits", "contact_arc"),
    ("Point that leaves a rough crest", "closed form and quadrature, 30 digits", "contact_crest"),
    ("Ball that slips with spin, then rolls", "closed form, 40 digits", "contact_bowling"),
    ("Ball that rolls inside an upright cylinder", "closed form, 40 digits", "contact_wall"),
    ("Ball that rolls on a turntable", "closed form, 40 digits", "contact_turntable"),
    ("Ball that rolls, slips and leaves a ball", "closed form and quadrature, 30 digits", "contact_dome"),
    ("Ball that rolls through the top of a bowl", "elliptic functions, 40 digits", "contact_loop"),
    ("Disc that rolls in a circle", "closed form, 40 digits", "contact_coin"),
    ("Bead that slides in a parabola", "quadrature, 25 digits", "contact_valley"),
    ("Slider-crank that meets a stop", "energy and quadrature, 25 digits", "contact_slider_crank"),
    ("Restitution of Hunt and Crossley, Lankarani and Nikravesh, Flores", "closed form, 40 digits", "compliant_restitution"),
    ("Depth and duration of a contact", "energy and quadrature, 30 digits", "compliant_depth"),
    ("Ball on a compliant floor", "113-bit arithmetic", "compliant_drop"),
    ("Hertz's and Johnson's stiffness", "closed form, 40 digits", "compliant_stiffness"),
    ("Slider-crank with a loose pin", "113-bit arithmetic", "compliant_pin"),
    ("The same with friction", "113-bit arithmetic", "compliant_pin_friction"),
    ("String that unwinds from a drum", "closed form, 40 digits", "element_unwound_string"),
    ("Elastic rope that catches a fall", "closed form, 40 digits", "element_bungee"),
    ("Two masses over a rough post", "closed form, 40 digits", "element_capstan"),
    ("Block and tackle with heavy sheaves", "closed form, 40 digits", "element_tackle"),
    ("Timing belt with preload", "closed form, 40 digits", "element_timing_belt"),
    ("Load on a winch", "closed form, 40 digits", "element_winch"),
    ("Pendulum that winds round a peg", "energy and quadrature, 40 digits", "element_pendulum_on_a_peg"),
    ("Differential with bevel gears", "closed form, 40 digits", "element_bevel_differential"),
    ("Worm with friction", "closed form, 40 digits", "element_worm"),
    ("Pair of gears with losses", "closed form, 40 digits", "element_lossy_pair"),
    ("Elastic teeth with backlash", "closed form, 40 digits", "element_elastic_backlash"),
    ("Clutch that closes within 0.1 s", "closed form, 40 digits", "element_clutch"),
    ("Loads of all joints of a slider-crank", "closed form, 40 digits", "element_slider_crank_loads"),
    ("Duffing's oscillator", "elliptic functions, 40 digits", "duffing"),
    ("Mass with a quadratic damper", "Lambert's function, 40 digits", "quadratic_damper"),
    ("Mass with a tabulated damper", "closed form between the knots, 30 digits", "tabulated_damper"),
    ("Orifice that empties a volume", "closed form, 40 digits", "orifice"),
    ("Hydraulic servo", "113-bit arithmetic", "servo_cylinder"),
    ("Direct-current motor", "exponential of a matrix, 40 digits", "electric_motor"),
    ("Mass under a PID controller", "exponential of a matrix, 40 digits", "pid_mass"),
    ("Rotor under a sampled controller", "difference equation, 40 digits", "sampled_rotor"),
    ("Slider-crank under a controller with a delay", "method of steps, 113-bit arithmetic", "delayed_crank"),
    ("Cart under a sampled controller", "exponential of a matrix, 40 digits", "sampled_cart"),
)
EVENTS_HEAD = """## Friction, contact, laws and samples

Each row is a model and a table of events and states. The log of the run must have these events, all and in order, and no others of
their kinds. States without a solution must be refused by name. The error of an event is relative to its time, any other error to the
largest size of the quantity in the runs. Each run is by the reduced formulation with dop853, at rtol 1e-11; `bench/machines/run` has
all formulations ([recorded](../bench/results/machines.txt)).

| problem | digits | error of events | error of states | model | table |
|---|---|--:|--:|---|---|"""
HEAD = """# Published problems

The tables list the problems with digits that Kempe did not make. Each row is one command with its model, reference and rtol, for
example the first one:

    kempe simulate examples/andrews/andrews.yaml --reference examples/andrews/published.csv --rtol 1e-12 --no-convergence-check

It prints the largest errors over all instants of the reference. Errors of q and qd are relative to max(1, |value|), errors of lambda
to the largest load.

This page is generated (`python3 docs/problems.py build/release/kempe`), and a test repeats all runs. `-`: the reference has no
such digits. The error of a long or sensitive motion is larger than the tolerance by the amplification of the motion.
"""
ELSEWHERE = """## Further comparisons

| problem | quantity | result | command |
|---|---|---|---|
| Simple pendulum, IFToMM benchmark A01, 2000 s | position, exact by elliptic functions | {a01} | `build/release/bench/bench hard` ([recorded](../bench/results/hard.txt)) |
| The same on a massless rod as closure | position | {rod} | `build/release/bench/bench hard` |
| Manchester contact benchmark, case A-2.2 | places, normal forces and creep forces against CONTACT | [table](../examples/manchester/README.md) | `python3 examples/manchester/tabulate_manchester.py table.csv` |
| Equivalent conicity, EN 15302, cases E1 to E9 | conicity from 1 to 7 mm, within the limits of the standard that include errors of a grid, and within its tolerance without them at 548 of 549 amplitudes | [table](../bench/results/conicity.txt) | `examples/conicity/tabulate_conicity.py build/release/kempe` |
| Cooperrider's bogie | critical speed (published: 68.66 m/s), 20 limit cycles | 68.644 m/s; [table](../examples/cooperrider/README.md) | `python3 examples/cooperrider/cycles_cooperrider.py` |
| Pendulum of 9 degrees of freedom, Fisette and Samin 1996: 18 vector steps | vector steps of M and C | {pendulum} | `build/release/bench/bench paper` ([recorded](../bench/results/paper.txt)) |
| Bogie of the same kind: 23 vector steps | vector steps of M and C | {bogie} | `build/release/bench/bench paper` |
| Models of ROBOTRAN's library | operations of M and C | [table](counts.md) | `build/release/bench/bench robotran` ([recorded](../bench/results/robotran.txt)) |
| Random models | all results against a second implementation | [validation](validation.md) | `tests/oracle/run` ([recorded](../bench/results/oracle.txt)) |
"""


def errors(kempe, model, reference, rtol):
    """Errors of q, qd and lambda, None where the reference has no digits."""
    done = subprocess.run([kempe, "simulate", f"examples/{model}.yaml", "--reference", f"examples/{reference}.csv", "--rtol", rtol,
                           "--no-convergence-check", "--json", "-"], cwd=ROOT, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)["error"]
    return [found[key] for key in ("q", "qd", "lambda")]


def recorded():
    """Figures of the bench results, as they are there."""
    text = lambda name: (ROOT / f"bench/results/{name}.txt").read_text()
    found = lambda name, pattern: re.search(pattern, text(name), re.M).group(1)
    return {"a01": found("hard", r"^A01, 2000 s +reduced/integrated +\S+ +ok +(\S+)"),
            "rod": found("hard", r"^A01 on a rod, 2000 s +reduced/integrated +\S+ +ok +(\S+)"),
            "pendulum": found("paper", r"^  chain of 9 bodies, offset z, centre xyz +\d+ +\d+ +\d+ +\d+ +(\d+) \|"),
            "bogie": found("paper", r"^  examples/bogie, .*? +\d+ +\d+ +\d+ +\d+ +(\d+) \|")}


def machines():
    """The module of bench/machines/run."""
    path = ROOT / "bench/machines/run"
    loader = importlib.machinery.SourceFileLoader("machines_run", str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    sys.dont_write_bytecode = True
    loader.exec_module(module)
    return module


def events(kempe):
    run, lines = machines(), [EVENTS_HEAD]
    for title, source, name in EVENTS:
        problem, = run.problems([name])
        found = run.errors(kempe, problem, run.METHODS[0], 1e-11)
        if isinstance(found, str):
            sys.exit(f"{name}: {found}")
        cells = ["-" if e is None else f"{e:.0e}" for e in found]
        model = problem.model.relative_to(ROOT).as_posix()
        lines.append(f"| {title} | {source} | {' | '.join(cells)} | [`{problem.model.stem}`](../{model}) | [`{name}.csv`](../bench/machines/{name}.csv) |")
    return "\n".join(lines) + "\n"


def page(kempe):
    parts = [HEAD]
    for title, introduction, rows in PARTS:
        lines = [f"## {title}\n", introduction + "\n", "| problem | digits | error q | error qd | error lambda | rtol | model, reference |",
                 "|---|---|--:|--:|--:|--:|---|"]
        for problem, source, model, reference, rtol in rows:
            cells = ["-" if e is None else f"{e:.0e}" for e in errors(kempe, model, reference, rtol)]
            folder, name = reference.split("/")
            lines.append(f"| [{problem}](../examples/{model.split('/')[0]}/README.md) | {source} | {' | '.join(cells)} | {rtol} | "
                         f"`{model}`, [`{name}`](../examples/{folder}/{name}.csv) |")
        parts.append("\n".join(lines) + "\n")
    return "\n".join([*parts, events(kempe), ELSEWHERE.format(**recorded())])


def agree(kept, made):
    number = re.compile(r"(?<=\| )\d(?:\.\d+)?e[+-]\d\d(?= \|)")
    if number.sub("#", kept) != number.sub("#", made):
        return False
    pairs = zip(map(float, number.findall(kept)), map(float, number.findall(made)))
    return all(max(a, b) <= max(ROUNDING, SLACK * min(a, b)) for a, b in pairs)


def main(arguments):
    files = {PAGE: page(str(pathlib.Path(arguments[0]).resolve()))}
    return generated.settle(files, "python3 docs/problems.py build/release/kempe", arguments, agree)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
