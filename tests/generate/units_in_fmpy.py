# SPDX-License-Identifier: BSD-3-Clause
"""Functional mock-up units of models in FMPy, an importer: descriptions, simulations, states, derivatives, misuse.

    python3 tests/generate/units_in_fmpy.py build/dev/kempe

The exit code is 77 where FMPy is absent: pip install fmpy (another Python than the first one: KEMPE_FMPY_PYTHON)."""

import cmath
import csv
import ctypes
import ctypes.util
import functools
import math
import multiprocessing
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import xml.etree.ElementTree as ElementTree

from quick_cc import quick_compiler

ROOT = pathlib.Path(__file__).resolve().parents[2]

try:
    import fmpy
    import lark
    from fmpy.fmi2 import FMU2Model, FMU2Slave
    from fmpy.fmi3 import FMU3Model, FMU3Slave
    from fmpy.validation import validate_fmu
except ImportError:
    other = os.environ.get("KEMPE_FMPY_PYTHON")
    if other and os.path.abspath(other) != os.path.abspath(sys.executable):
        os.execv(other, [other, *sys.argv])
    print("skipped: FMPy is not installed (pip install fmpy, or KEMPE_FMPY_PYTHON)")
    sys.exit(77)

# Model and end of the simulation: exchanges of states, events, inputs, spatial loops, drives, samples, friction that sticks,
# impacts, rows between rates, an outline.
MODELS = {"four_bar": 0.5, "slider_crank": 1.0, "delta_robot": 0.5, "loose_slider": 0.01, "cart_pole": 1.0,
          "driven_slider_crank": 1.0, "hydraulic_excavator": 0.3, "stick_slip": 1.0, "toggle_press": 0.5,
          "bowling_ball": 1.5, "contact_polygon": 1.4}
# On the library: end, and the largest difference from kempe simulate: friction that sticks, sampled control, contact.
ON_LIBRARY = {"four_bar": (0.5, 1e-7), "stick_slip": (2.0, 1e-7), "hydraulic_excavator": (0.5, 1e-7),
              "toggle_press": (0.44, 1e-7), "cart_pole": (1.0, 1e-7), "loose_pin": (0.05, 1e-6), "driven_slider_crank": (0.5, 1e-7)}
# Ends of the motions whose states are saved on the way, with changes on both sides.
SAVED = {("four_bar", "cs"): (3.0, "solver.exchanges"), ("delta_robot", "me"): (3.0, "solver.exchanges"),
         ("four_bar", "library"): (3.0,),  # there the run continues without independent coordinates
         ("loose_slider", "cs"): (0.01, "solver.events"), ("loose_slider", "me"): (0.01, "solver.events"),
         ("stick_slip", "cs"): (1.0, "solver.events"), ("stick_slip", "me"): (1.0, "solver.events"),
         ("toggle_press", "cs"): (0.44, "solver.events"), ("toggle_press", "me"): (0.44, "solver.events")}
FULL = "KEMPE_FULL" in os.environ  # otherwise the units named here alone are compiled as users have them
OPTIMISED, BUILT_BY_FMPY = ("stick_slip", 2), ("four_bar", 3)
HAS_RSVG = ctypes.util.find_library("rsvg-2") is not None
PROCESSES = multiprocessing.get_context("forkserver")  # each from one that has FMPy and has seen no unit
PROCESSES.set_forkserver_preload(["__main__"])
failures = []
NEW_PARSER = lark.Lark


def place_of(model):
    if isinstance(model, pathlib.Path):
        return model
    example = ROOT / f"examples/{model}/{model}.yaml"
    return example if example.exists() else ROOT / f"tests/models/{model}.yaml"


@functools.lru_cache(None)
def name_parser(grammar, **options):
    """FMPy makes a parser of names for each unit, which takes a second for those of a model: here it takes each name once."""
    parser = NEW_PARSER(grammar, **options)
    parser.parse = functools.lru_cache(None)(parser.parse)  # an error is no value, and comes again
    return parser


lark.Lark = name_parser


def check(true, *words):
    if not true:
        failures.append(" ".join(str(word) for word in words))
        print("FAIL", failures[-1], flush=True)


class Unit:
    """An unpacked unit, and instances of it."""

    rounds = False  # communication steps may change rounding

    def __init__(self, fmi, file, folder, validate=True):
        self.fmi, self.file = fmi, file
        self.folder = fmpy.extract(str(self.file), str(folder))
        self.about = fmpy.read_model_description(self.folder, validate=validate)
        self.reference = {v.name: v.valueReference for v in self.about.modelVariables}
        self.outputs = [v.name for v in self.about.modelVariables if v.name.startswith("q.")]
        self.said = []

    @classmethod
    def of_model(cls, kempe, folder, model, fmi, *options, build=False):
        file = folder / f"{model}{fmi}{len(options)}{''.join(options)}.fmu"
        path = place_of(model)
        if not options and (model, fmi) != OPTIMISED and not FULL:
            options = ("--compiler", quick_compiler(folder))
        subprocess.run([kempe, "fmu", path, "-o", file, "--fmi", str(fmi), "--quiet", *options], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if build:
            subprocess.run([sys.executable, "-m", "fmpy", "compile", "--configuration", "Release" if FULL else "Debug", file], check=True,
                           capture_output=True)
        return cls(fmi, file, folder / file.stem)

    def named(self, start):
        return [r for name, r in self.reference.items() if name.startswith(start)]

    def made(self, kind, guid=None, **options):
        """An instance before its initialisation."""
        classes = {(2, "me"): FMU2Model, (2, "cs"): FMU2Slave, (3, "me"): FMU3Model, (3, "cs"): FMU3Slave}
        about = self.about.modelExchange if kind == "me" else self.about.coSimulation
        instance = classes[self.fmi, kind](guid=guid or self.about.guid, unzipDirectory=self.folder,
                                           modelIdentifier=about.modelIdentifier, instanceName="one")
        if self.fmi == 3:
            instance.instantiate(logMessage=lambda e, status, category, text: self.said.append(text.decode()), **options)
        else:
            instance.instantiate(callbacks=self.callbacks())
        return instance

    def callbacks(self):
        from fmpy.fmi2 import (fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE, fmi2CallbackFunctions,
                               fmi2CallbackLoggerTYPE)
        from fmpy.fmi1 import calloc, free
        self.kept = fmi2CallbackFunctions()
        self.kept.logger = fmi2CallbackLoggerTYPE(lambda e, name, status, category, text: self.said.append(text.decode()))
        self.kept.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.kept.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        return self.kept

    def begin(self, instance, tolerance=None, stop=None):
        if self.fmi == 2:
            instance.setupExperiment(tolerance=tolerance, startTime=0.0, stopTime=stop)
            instance.enterInitializationMode()
        else:
            instance.enterInitializationMode(tolerance=tolerance, startTime=0.0, stopTime=stop)

    def started(self, kind, **options):
        instance = self.made(kind, **options)
        self.begin(instance)
        instance.exitInitializationMode()
        return instance

    def get(self, instance, references):
        return instance.getReal(references) if self.fmi == 2 else instance.getFloat64(references)

    def set(self, instance, references, values):
        (instance.setReal if self.fmi == 2 else instance.setFloat64)(references, values)

    def place(self, instance):
        return tuple(self.get(instance, self.named("q.") + self.named("qd.") + self.named("qdd.")))

    def count(self, instance, name):
        """A number of changes: solver.exchanges, solver.events."""
        return (instance.getInteger if self.fmi == 2 else instance.getInt32)([self.reference[name]])[0]

    def refused(self, what, word, call):
        """The call is an error or is discarded, with a sentence that has the word."""
        self.said.clear()
        try:
            call()
            check(False, self.file.name, what, "is not refused")
        except Exception:  # FMPy's own kinds of error
            pass
        check(any(word in text for text in self.said), self.file.name, what, self.said)


# -- the description and simulations ---------------------------------------------------------------------------------

def check_description(unit):
    problems = validate_fmu(str(unit.file))
    check(not problems, unit.file.name, problems)
    schema = pathlib.Path(fmpy.__file__).parent / f"schema/fmi{unit.fmi}"
    pairs = [("modelDescription.xml", f"fmi{unit.fmi}ModelDescription.xsd")]
    if unit.fmi == 3:
        pairs += [(f"sources/{p.name}", "fmi3BuildDescription.xsd")
                  for p in (pathlib.Path(unit.folder) / "sources").glob("*.xml")]
        pairs += [(f"terminalsAndIcons/{p.name}", "fmi3TerminalsAndIcons.xsd")
                  for p in (pathlib.Path(unit.folder) / "terminalsAndIcons").glob("*.xml")]
    for document, name in pairs:
        done = subprocess.run(["xmllint", "--noout", "--schema", schema / name, pathlib.Path(unit.folder) / document],
                              capture_output=True, text=True)
        check(done.returncode == 0, unit.file.name, document, done.stderr[:300])


def check_terminals(unit):
    """Members of terminals are variables, each of one terminal; coordinates have all their variables there."""
    folder = pathlib.Path(unit.folder) / "terminalsAndIcons"
    seen = []
    for terminal in ElementTree.parse(folder / "terminalsAndIcons.xml").iter("Terminal"):
        members = [(member.get("memberName"), member.get("variableName")) for member in terminal]
        check(len({name for name, _ in members}) == len(members) > 1, unit.file.name, terminal.get("name"), members)
        seen += [variable for _, variable in members]
    check(len(set(seen)) == len(seen) and set(seen) <= set(unit.reference), unit.file.name, "terminals", seen)
    check(set(seen) >= {name for name in unit.reference if name.startswith(("q.", "qd."))}, unit.file.name, "terminals lack coordinates")


def check_picture(unit, lengths=()):
    """The icon; distances of the joints, in their order, are as the given lengths of links."""
    folder = pathlib.Path(unit.folder)
    bitmaps = [folder / "model.png"] if unit.fmi == 2 else [folder / "terminalsAndIcons/icon.png"]
    check(not HAS_RSVG or bitmaps[0].read_bytes()[:8] == b"\x89PNG\r\n\x1a\n", unit.file.name, "has no bitmap")
    if unit.fmi == 2:
        return
    picture = ElementTree.parse(folder / "terminalsAndIcons/icon.svg")
    joints = [(float(c.get("cx")), float(c.get("cy"))) for c in picture.iter("{http://www.w3.org/2000/svg}circle")]
    check(all(0 < x < 256 and 0 < y < 256 for x, y in joints), unit.file.name, "joints outside of the picture", joints)
    if lengths:
        drawn = sorted({round(math.dist(a, b), 1) for a in joints for b in joints})
        scale = max(drawn) / diagonal(lengths)
        for length in lengths:
            check(any(abs(d - scale * length) < 0.6 for d in drawn), unit.file.name, "no link of", length, "in", drawn)


def diagonal(lengths):
    """The largest distance of two joints of the four-bar, whose crank is upright and whose ground link is level."""
    crank, coupler, rocker, base = lengths
    across = math.hypot(crank, base)  # from the crank's tip to the rocker's foot
    along = (coupler**2 - rocker**2 + across**2) / (2 * across)
    high = math.sqrt(coupler**2 - along**2)
    x, y = along / across * base + high / across * crank, crank - along / across * crank + high / across * base
    return max(lengths + (across, math.hypot(x, y)))


def check_exports(unit):
    binary = next(pathlib.Path(unit.folder).glob("binaries/*/*.so"))
    names = subprocess.run(["nm", "-D", "--defined-only", binary], capture_output=True, text=True).stdout.split()
    others = [name for name in names[2::3] if not name.startswith("fmi")]
    check(not others, unit.file.name, "exports", others)
    functions = [name for name in names if name.startswith(f"fmi{unit.fmi}")]
    check(len(functions) == {2: 44, 3: 75}[unit.fmi], unit.file.name, "exports", len(functions), "functions")


def reference(kempe, folder, model, end):
    rows = folder / "rows.csv"
    subprocess.run([kempe, "simulate", place_of(model), "--t-end", str(end), "--rtol", "1e-11",
                    "-o", rows, "--quiet"], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(rows) as lines:
        table = list(csv.reader(lines))
    return {name: float(x) for name, x in zip(table[0], table[-1])}


def check_motions(unit, expected, end, kinds=(("CoSimulation", 1e-7), ("ModelExchange", 1e-6))):
    for kind, allowed in kinds:
        rows = fmpy.simulate_fmu(unit.folder, fmi_type=kind, stop_time=end, output=unit.outputs, output_interval=end / 50,
                                 relative_tolerance=1e-11, model_description=unit.about)
        columns = [re.sub(r"\[(\d+)\]", r".\1", name).replace("'", "") for name in unit.outputs]
        known = [k for k, column in enumerate(columns) if column in expected]  # not the integrals of states
        check(known, unit.file.name, "has no coordinate of kempe simulate")
        error = max(abs(rows[-1][k + 1] - expected[columns[k]]) for k in known)
        check(error < allowed, unit.file.name, kind, "differs from kempe simulate by", error)


# -- communication steps, states, threads ----------------------------------------------------------------------------

def end_place(unit, times, **options):
    instance = unit.started("cs", **options)
    t = 0.0
    for later in times:
        instance.doStep(t, later - t)
        t = later
    place = unit.place(instance)
    instance.freeInstance()
    return place


def check_steps(unit, end):
    has_updates = unit.fmi == 3 and unit.about.coSimulation.providesIntermediateUpdate
    chance = random.Random(1)
    lists = [[end * k / 10 for k in range(1, 11)], [end * k / 1000 for k in range(1, 1001)],
             sorted(chance.uniform(0, end) for _ in range(37)) + [end]]
    places = {end_place(unit, times) for times in lists}
    if has_updates:
        calls = []
        places.add(end_place(unit, lists[0], intermediateUpdate=lambda *words: calls.append(words[1])))
        check(calls == sorted(calls) and len(calls) >= 10, unit.file.name, "intermediate updates", len(calls))
    if unit.rounds:
        error = max(abs(a - b) / (1 + abs(a)) for place in places for a, b in zip(place, min(places)))
        check(error < 1e-10, unit.file.name, "communication steps change the motion by", error)
    else:
        check(len(places) == 1, unit.file.name, "communication steps change bits", len(places))


STEPS, SUBSTEPS = 10, 30  # communication steps before a state is saved, and after it; steps of model exchange in each


def slopes(unit, instance, t, x):
    rates = (ctypes.c_double * len(x))()
    instance.setTime(t)
    instance.setContinuousStates((ctypes.c_double * len(x))(*x), len(x))
    (instance.getDerivatives if unit.fmi == 2 else instance.getContinuousStateDerivatives)(rates, len(x))
    return list(rates)


def march(unit, instance, begin, end, steps):
    """Model exchange by classical Runge-Kutta steps of one length, with event mode after each."""
    h, count = (end - begin) / steps, len(unit.named("x["))
    for k in range(steps):
        t, x = begin + k * h, (ctypes.c_double * count)()
        instance.getContinuousStates(x, count)
        x = list(x)
        a = slopes(unit, instance, t, x)
        b = slopes(unit, instance, t + h / 2, [v + h / 2 * s for v, s in zip(x, a)])
        c = slopes(unit, instance, t + h / 2, [v + h / 2 * s for v, s in zip(x, b)])
        d = slopes(unit, instance, t + h, [v + h * s for v, s in zip(x, c)])
        slopes(unit, instance, t + h, [v + h / 6 * (p + 2 * q + 2 * r + s) for v, p, q, r, s in zip(x, a, b, c, d)])
        instance.completedIntegratorStep()
        instance.enterEventMode()
        decide_events(unit, instance)


def decide_events(unit, instance):
    while (instance.newDiscreteStates if unit.fmi == 2 else instance.updateDiscreteStates)()[0]:
        pass
    instance.enterContinuousTimeMode()


def go(unit, instance, kind, first, end):
    """Ten communication steps from the step `first` of twenty on; the place afterwards."""
    for k in range(first, first + STEPS):
        if kind == "cs":
            instance.doStep(k * end / 20, end / 20)
        else:
            march(unit, instance, k * end / 20, (k + 1) * end / 20, SUBSTEPS)
    return unit.place(instance)


def restored(unit, kind, bytes_of_it):
    """Another instance at a state, and the state."""
    other = unit.made(kind)
    loaded = unpacked(unit, other, bytes_of_it)
    (other.setFMUState if unit.fmi == 3 else other.setFMUstate)(loaded)
    return other, loaded


def unpacked(unit, instance, bytes_of_it):
    return (instance.deserializeFMUState if unit.fmi == 3 else instance.deSerializeFMUstate)(bytes_of_it)


def continue_saved(fmi, kind, file, bytes_of_it, end):
    """The motion from a state of another process."""
    with tempfile.TemporaryDirectory() as folder:
        unit = Unit(fmi, file, folder, validate=False)
        return go(unit, restored(unit, kind, bytes_of_it)[0], kind, STEPS, end)


def check_wrong_bytes(unit, instance, bytes_of_it):
    """Bytes that are no state, or no longer one, are errors, wherever they differ."""
    wrong = [b"", bytes_of_it[:-1], bytes_of_it[: len(bytes_of_it) // 2], bytes_of_it + b"0", b"x" * len(bytes_of_it)]
    for at in (0, 30, 50, len(bytes_of_it) // 2, len(bytes_of_it) - 1):
        wrong.append(bytes_of_it[:at] + bytes([bytes_of_it[at] ^ 1]) + bytes_of_it[at + 1:])
    for damaged in wrong:
        unit.refused("a damaged state", "not a state", lambda: unpacked(unit, instance, damaged))


def check_saved(unit, kind, end, counted=None):
    """A saved state goes on with the same bits here, in another instance, and in another process; `counted` is a number of
    changes, of which some are before it and some after it."""
    instance = unit.started(kind)
    if kind == "me":
        decide_events(unit, instance)
    go(unit, instance, kind, 0, end)
    save = instance.getFMUState if unit.fmi == 3 else instance.getFMUstate
    restore = instance.setFMUState if unit.fmi == 3 else instance.setFMUstate
    state = save()
    pack = instance.serializeFMUState if unit.fmi == 3 else instance.serializeFMUstate
    bytes_of_it, before = pack(state), unit.place(instance)
    counts = [unit.count(instance, counted)] if counted else []

    first = go(unit, instance, kind, STEPS, end)
    if counted:
        counts.append(unit.count(instance, counted))
        check(0 < counts[0] < counts[1], unit.file.name, kind, counted, "before and after a saved state:", counts)
    restore(state)
    check(unit.place(instance) == before, unit.file.name, kind, "a restored state has other bits")
    check(go(unit, instance, kind, STEPS, end) == first, unit.file.name, kind, "the motion after a restored state has other bits")
    other, loaded = restored(unit, kind, bytes_of_it)
    check(go(unit, other, kind, STEPS, end) == first, unit.file.name, kind,
          "the motion of another instance after a restored state has other bits")
    with PROCESSES.Pool(1) as pool:
        far = pool.apply(continue_saved, (unit.fmi, kind, unit.file, bytes_of_it, end))
    check(far == first, unit.file.name, kind, "the motion in another process has other bits")
    check_wrong_bytes(unit, other, bytes_of_it)
    (instance.freeFMUState if unit.fmi == 3 else instance.freeFMUstate)(state)
    (other.freeFMUState if unit.fmi == 3 else other.freeFMUstate)(loaded)
    instance.freeInstance()
    other.freeInstance()


def check_threads(unit, end):
    places = [None] * 8

    def run(k):
        places[k] = end_place(unit, [end * i / 50 for i in range(1, 51)])

    threads = [threading.Thread(target=run, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    check(len(set(places)) == 1 and places[0], unit.file.name, "threads differ")


# -- derivatives -----------------------------------------------------------------------------------------------------

def evaluate(unit, instance, count, t, x, inputs, u, unknowns):
    numbers = (ctypes.c_double * count)(*x)
    instance.setTime(t)
    instance.setContinuousStates(numbers, count)
    if inputs:
        unit.set(instance, inputs, u)
    return unit.get(instance, unknowns)


def check_dependencies(unit, instance):
    """Directional derivatives are zero where a dependency is not listed, and each list has one that is not zero."""
    inputs = [v for v in unit.about.modelVariables if v.causality == "input"]
    states = [unit.reference[name] for name in unit.reference if name.startswith("x[")]
    knowns = states + [v.valueReference for v in inputs]
    listed = 0
    for unknown in unit.about.outputs + unit.about.derivatives + (unit.about.eventIndicators or []):
        if unknown.dependencies is None or unknown.variable.type not in ("Real", "Float64"):
            continue
        depends = [v.valueReference for v in unknown.dependencies]
        for known in knowns:
            slope = instance.getDirectionalDerivative([unknown.variable.valueReference], [known], [1.0])[0]
            check(slope == 0 or known in depends, unit.file.name, unknown.variable.name, "depends on", known, slope)
            listed += known not in depends
    check(listed, unit.file.name, "every variable depends on everything")


def check_slope(unit, what, exact, values_at):
    """A derivative is that of central differences: 1e-7, and their error decreases with the square of the step."""
    size, errors = 1 + max(abs(e) for e in exact), []
    for h in (1e-3, 5e-4, 1e-5):
        far = [values_at(s * h) for s in (1, -1)]
        errors.append(max(abs((a - b) / (2 * h) - e) for a, b, e in zip(*far, exact)) / size)
    check(errors[2] < 1e-7, unit.file.name, what, "derivatives differ from differences by", errors)
    check(errors[0] < 1e-9 or 3.3 < errors[0] / errors[1] < 4.7, unit.file.name, what, "slope of differences", errors)


def check_transpose(unit, what, instance, unknowns, knowns, way, exact):
    if unit.fmi == 3:
        seed = [random.Random(5).uniform(-1, 1) for _ in unknowns]
        back = instance.getAdjointDerivative(unknowns, knowns, seed, len(knowns))
        left, right = sum(a * b for a, b in zip(seed, exact)), sum(a * b for a, b in zip(back, way))
        check(abs(left - right) <= 1e-12 * (1 + abs(left)), unit.file.name, what, "adjoint", left, right)


def input_references(unit):
    return [v.valueReference for v in unit.about.modelVariables if v.causality == "input"]


def check_set_derivatives(unit, what, instance, knowns, unknowns):
    """Along knowns that may be set in the mode of the instance, each in proportion to its size."""
    if not knowns:
        return
    base, chance = unit.get(instance, knowns), random.Random(4)
    way = [chance.uniform(-0.5, 0.5) * (abs(value) or 1) for value in base]
    exact = instance.getDirectionalDerivative(unknowns, knowns, way)
    check_transpose(unit, what, instance, unknowns, knowns, way, exact)

    def values_at(h):
        unit.set(instance, knowns, [a + h * w for a, w in zip(base, way)])
        return unit.get(instance, unknowns)

    check_slope(unit, what, exact, values_at)
    unit.set(instance, knowns, base)


def check_derivatives_of_modes(unit):
    """Initialization Mode, where the start follows from parameters; Event Mode; Step Mode; after the end."""
    unknowns = [r for start in ("x[", "der(", "q.", "qd.", "qdd.", "lambda.") for r in unit.named(start)]
    tunable = input_references(unit) + parameters(unit, "tunable")
    for kind in ("me", "cs"):
        instance = unit.made(kind)
        unit.refused("a derivative before initialisation", "is not allowed",
                     lambda: instance.getDirectionalDerivative(unknowns[:1], tunable[:1] or [0], [1.0]))
        unit.begin(instance)
        check_set_derivatives(unit, f"{kind} in Initialization Mode", instance, tunable + parameters(unit, "fixed"), unknowns)
        instance.exitInitializationMode()
        if kind == "cs":
            instance.doStep(0.0, 0.01)
        check_set_derivatives(unit, "Event Mode" if kind == "me" else "Step Mode", instance, tunable, unknowns)
        knowns = unit.named("x[")
        before = instance.getDirectionalDerivative(unknowns, knowns, [1.0] * len(knowns))
        instance.terminate()
        after = instance.getDirectionalDerivative(unknowns, knowns, [1.0] * len(knowns))
        check(list(before) == list(after), unit.file.name, kind, "derivatives after the end differ")
        instance.freeInstance()


def check_derivatives(unit):
    instance = unit.made("me")
    unit.begin(instance)
    early = random.Random(3)
    knowns = unit.named("x[")
    seed = [early.uniform(-1, 1) for _ in knowns]
    before = instance.getDirectionalDerivative(unit.named("der("), knowns, seed)  # in Initialization Mode
    instance.exitInitializationMode()
    after = instance.getDirectionalDerivative(unit.named("der("), knowns, seed)
    error = max(abs(a - b) / (1 + abs(a)) for a, b in zip(before, after))
    check(error < 1e-12, unit.file.name, "derivatives in Initialization Mode differ by", error)
    check_dependencies(unit, instance)
    count = len(unit.named("x["))
    x = (ctypes.c_double * count)()
    instance.getContinuousStates(x, count)
    decide_events(unit, instance)
    states, inputs = unit.named("x["), input_references(unit)
    unknowns = unit.named("der(") + unit.named("q.") + unit.named("qd.") + unit.named("lambda.")
    time = [unit.reference["time"]]
    knowns, base, u = states + inputs + time, list(x), unit.get(instance, inputs) if inputs else []
    chance = random.Random(2)
    way = [chance.uniform(-1, 1) for _ in knowns]
    evaluate(unit, instance, count, 0.0, base, inputs, u, unknowns)
    exact = instance.getDirectionalDerivative(unknowns, knowns, way)
    check_transpose(unit, "Continuous-Time Mode", instance, unknowns, knowns, way, exact)
    check_slope(unit, "Continuous-Time Mode", exact, lambda h: evaluate(
        unit, instance, count, h * way[-1], [a + h * w for a, w in zip(base, way)], inputs,
        [a + h * w for a, w in zip(u, way[count:])], unknowns))
    instance.terminate()
    instance.freeInstance()
    check_derivatives_of_modes(unit)


# -- misuse ----------------------------------------------------------------------------------------------------------

def parameters(unit, variability):
    return [v.valueReference for v in unit.about.modelVariables
            if v.causality == "parameter" and v.variability == variability and not v.name.startswith("solver.")]


def check_misuse(unit, loops_break=True):
    unit.refused("a wrong token", "differs from modelDescription", lambda: check_made(unit))
    instance = unit.made("cs")
    unit.refused("a step before the start", "is not allowed", lambda: instance.doStep(0.0, 0.1))
    unit.refused("an unknown reference", "99999999", lambda: unit.get(instance, [99999999]))
    unit.refused("a value before the start", "no value yet", lambda: unit.get(instance, unit.named("qdd.")))
    unit.begin(instance, stop=1.0)
    instance.exitInitializationMode()
    fixed, tunable = parameters(unit, "fixed"), parameters(unit, "tunable")
    if fixed:
        unit.refused("a fixed parameter", "is fixed", lambda: unit.set(instance, fixed[:1], [1.0]))
    if tunable:
        unit.refused("a parameter that is no number", "not a finite", lambda: unit.set(instance, tunable[:1], [float("nan")]))
        unit.set(instance, tunable[:1], [1.25 * unit.get(instance, tunable[:1])[0]])
    unit.refused("an output that is set", "is computed", lambda: unit.set(instance, unit.named("qdd.")[:1], [0.0]))
    unit.refused("a step from elsewhere", "the unit is at", lambda: instance.doStep(0.5, 0.1))
    unit.refused("a step backwards", "not positive", lambda: instance.doStep(0.0, -0.1))
    unit.refused("a step beyond the end", "after the stop time", lambda: instance.doStep(0.0, 1.5))
    instance.doStep(0.0, 0.001)
    unit.refused("initialisation again", "is not allowed", lambda: unit.begin(instance))
    instance.reset()
    unit.begin(instance)
    instance.exitInitializationMode()
    instance.freeInstance()
    if fixed and loops_break:
        instance = unit.made("cs")
        unit.set(instance, fixed[:1], [100 * unit.get(instance, fixed[:1])[0]])
        unit.begin(instance)
        unit.refused("a loop that cannot close", "", instance.exitInitializationMode)
        check(any(len(text) > 30 for text in unit.said), unit.file.name, "no sentence on the loop", unit.said)
        instance.freeInstance()


def check_given_start(unit):
    """A four-bar starts where any of its coordinates and rates is given; values that do not fit are refused by name."""
    own = dict(zip(unit.named("q."), unit.get(unit.started("cs"), unit.named("q."))))
    diagonal = math.hypot(0.9, 0.3)  # the joint of coupler and rocker at the start, where all angles are zero
    along = (0.8**2 - 0.7**2 + diagonal**2) / (2 * diagonal)
    joint = 0.3j + (along + 1j * math.sqrt(0.8**2 - along**2)) * (0.9 - 0.3j) / diagonal
    rocker, crank, rate = unit.reference["q.rocker"], unit.reference["q.crank"], unit.reference["qd.rocker"]
    for given in ({rocker: own[rocker] + 0.05}, {crank: own[crank] + 0.4}, {rocker: own[rocker] + 0.05, rate: 2.0}, {rate: -3.0}):
        instance = unit.made("cs")
        unit.set(instance, list(given), list(given.values()))
        unit.begin(instance)
        instance.exitInitializationMode()
        found = unit.get(instance, list(given))
        check(all(abs(a - b) < 1e-12 for a, b in zip(found, given.values())), unit.file.name, "starts at", found, "not at", given)
        turns = [cmath.exp(1j * unit.get(instance, [unit.reference["q." + name]])[0]) for name in ("crank", "coupler", "rocker")]
        gap = turns[0] * (0.3j + turns[1] * (joint - 0.3j)) - 0.9 - turns[2] * (joint - 0.9)
        check(abs(gap) < 1e-9, unit.file.name, "starts with a loop that is open by", abs(gap))
        instance.freeInstance()
    instance = unit.made("cs")
    unit.set(instance, [crank, rocker], [own[crank] + 0.4, own[rocker] - 0.3])
    unit.begin(instance)
    unit.refused("a start that contradicts itself", "leave out coordinates", instance.exitInitializationMode)
    instance.freeInstance()


def check_dead_centre(unit, on_library):
    """A rod shorter than the crank: the loop opens where the sine of the crank angle is their ratio. The step is discarded, and
    a shorter one is made; a unit on the library ends the motion, as kempe simulate does."""
    instance = unit.made("cs")
    crank, speed = unit.get(instance, [unit.reference["r"], unit.reference["speed"]])
    unit.set(instance, [unit.reference["l"]], [0.6 * crank])
    unit.begin(instance)
    instance.exitInitializationMode()
    unit.said.clear()
    opens, ended = math.asin(0.6) / speed, False
    t, step = 0.0, opens / 10.5
    for _ in range(10):
        instance.doStep(t, step)
        t += step
    try:
        result = instance.doStep(t, step)
        ended = unit.fmi == 3 and result[1]
    except Exception:  # FMPy's own kinds of error; in version 2 also the end of the motion
        check(not on_library or unit.fmi == 2, unit.file.name, "the dead centre is no end")
        ended = unit.fmi == 2
    found = re.search(r"t = ([0-9.]+)", " ".join(unit.said))
    check(found and abs(float(found[1]) - opens) < 1e-6 * opens, unit.file.name, "a loop that opens at", opens, unit.said)
    if on_library:
        check(ended, unit.file.name, "does not end at the dead centre")
    else:
        instance.doStep(t, 0.4 * step)
    instance.freeInstance()


def check_far_states(unit):
    """States of model exchange at which the loops cannot be closed are discarded with a sentence; the rates of those before
    differ by rounding alone afterwards."""
    instance = unit.started("me")
    decide_events(unit, instance)
    count = len(unit.named("x["))
    x = (ctypes.c_double * count)()
    instance.getContinuousStates(x, count)
    near = slopes(unit, instance, 0.0, list(x))
    unit.refused("an open loop", "cannot be closed", lambda: slopes(unit, instance, 0.0, [x[0] + 3, *x[1:]]))
    error = max(abs(a - b) / (1 + abs(b)) for a, b in zip(slopes(unit, instance, 0.0, list(x)), near))
    check(error < 1e-12, unit.file.name, "rates after a state that was discarded differ by", error)
    instance.freeInstance()


def check_made(unit):
    instance = unit.made("cs", guid="another")
    if not instance.component:
        raise ValueError("no instance")


def check_input(unit):
    """NaN is refused; a value acts from its time on."""
    instance = unit.started("cs")
    inputs = [v.valueReference for v in unit.about.modelVariables if v.causality == "input"]
    unit.refused("an input that is no number", "not a finite", lambda: unit.set(instance, inputs[:1], [float("nan")]))
    instance.doStep(0.0, 0.1)
    before = unit.get(instance, unit.named("qdd."))
    unit.set(instance, inputs[:1], [1 + unit.get(instance, inputs[:1])[0]])
    check(unit.get(instance, unit.named("qdd.")) != before, unit.file.name, "an input has no effect")
    instance.doStep(0.1, 0.1)
    instance.freeInstance()


def check_event_mode(unit, end):
    """Events end communication steps early; the motion is the same to the tolerance."""
    instance = unit.started("cs", eventModeUsed=True, earlyReturnAllowed=True)
    instance.enterStepMode()
    t, events = 0.0, 0
    while t < end * (1 - 1e-12):
        event, over, early, t = instance.doStep(t, min(end / 10, end - t))
        if event:
            events += 1
            check(early, unit.file.name, "an event without an early return")
            instance.enterEventMode()
            instance.updateDiscreteStates()
            instance.enterStepMode()
    plain = end_place(unit, [end])
    q = len(unit.named("q."))
    error = max(abs(a - b) for a, b in zip(unit.place(instance)[:q], plain[:q]))
    counted = unit.count(instance, "solver.events")
    check(events > 5 and counted >= events, unit.file.name, "events", events, counted)
    check(error < 1e-6, unit.file.name, "event mode changes the motion by", error)
    instance.freeInstance()


# -- all -------------------------------------------------------------------------------------------------------------

def check_on_library(kempe, folder, model, end, allowed):
    """Units on the library, of models that units of sources lack."""
    expected = reference(kempe, folder, model, end)
    for fmi in (2, 3):
        unit = Unit.of_model(kempe, folder, model, fmi, "--binary")
        unit.rounds = model == "stick_slip"  # rows in between solve for friction from other beginnings
        check_description(unit)
        check_exports(unit)
        check_motions(unit, expected, end, [("CoSimulation", allowed)])
        check_steps(unit, end)
        check_saved(unit, "cs", *SAVED.get((model, "library"), SAVED.get((model, "cs"), (end,))))
        if model == "driven_slider_crank":
            check_dead_centre(unit, True)
        if model == "four_bar":
            check_misuse(unit)
            check_given_start(unit)
            check_threads(unit, end)
        if model == "cart_pole":
            check_input(unit)
    print(model, "on the library", flush=True)


def check_without_states(kempe, folder):
    """A unit with continuous delays saves no states: it says so, and its motion goes on."""
    for fmi in (2, 3):
        unit = Unit.of_model(kempe, folder, "delayed_slides", fmi, "--binary")
        check(not unit.about.coSimulation.canGetAndSetFMUstate, unit.file.name, "says that it has states")
        instance = unit.started("cs")
        instance.doStep(0, 0.1)
        unit.said.clear()
        try:
            instance.setFMUState(instance.getFMUState())
            check(False, unit.file.name, "gives a state without its past")
        except fmpy.fmi1.FMICallException:
            check(any("saves no states" in line for line in unit.said), unit.file.name, "does not say why", unit.said)
        instance.doStep(0.1, 0.2)
        instance.freeInstance()


LEAVES = """kempe: 1
tables: {f: {x: [0.1, 0.5, 9], y: [1, 2, 0], method: linear}}
bodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}}
forces: {f: {joint: X, force: f(t)}}
run: {t_end: 1}
"""
PUSHES = """kempe: 1
inputs: {level: {default: 0.1, unit: N}}
bodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}}
forces: {rub: {joint: X, friction: {force: level}}}
start: {qd: {X: 1}}
run: {t_end: 1}
"""


FEET = """kempe: 1
gravity: [0, -9.81, 0]
ground: {points: {O: [0, 0, 0]}}
bodies:
  b: {joint: {name: j, planar: z, at: ground}, mass: 3, inertia: {zz: 0.1}, points: {A: [-1, 0, 0], B: [0, 0, 0], C: [1, 0, 0]}}
contacts:
  A: {point: b.A, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.1}
  B: {point: b.B, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.5}
  C: {point: b.C, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.1}
start: {qd: {j.1: 3}}
run: {t_end: 1}
"""
DOUBTS = {"leaves": (LEAVES, "beyond"), "pushes": (PUSHES, "it would push"), "feet": (FEET, "redundant contacts")}


def check_doubts(kempe, folder, has_library):
    """A unit warns, once, that its motion leaves a table, that an input makes friction push, or that redundant contacts leave the motion open: a run is then
    not to be trusted."""
    for fmi in (2, 3):
        for options in ((), ("--binary",))[:1 + has_library]:
            for model, (text, word) in DOUBTS.items():
                (folder / f"{model}.yaml").write_text(text)
                file = folder / f"{model}{fmi}{len(options)}.fmu"
                subprocess.run([kempe, "fmu", folder / f"{model}.yaml", "-o", file, "--fmi", str(fmi), "--quiet", *options,
                                *(() if options or FULL else ("--compiler", quick_compiler(folder)))], check=True, stdout=subprocess.DEVNULL)
                unit = Unit(fmi, file, folder / file.stem)
                instance = unit.started("cs")
                for k in range(4):
                    if model == "pushes":
                        unit.set(instance, [unit.reference["level"]], [-0.3 if k == 2 else 0.1])
                    instance.doStep(0.1 * k, 0.1)
                    told = [line for line in unit.said if word in line]
                    check(len(told) == (model != "pushes" or k >= 2), file.name, "does not say once why it is not to be trusted", k, unit.said)
                instance.freeInstance()
                if options or model == "feet":
                    continue
                unit.said.clear()
                instance = unit.started("me")
                if model == "pushes":
                    unit.set(instance, [unit.reference["level"]], [-0.3])
                instance.enterContinuousTimeMode()
                for k in range(3):
                    instance.setTime(0.02 * k)
                    instance.completedIntegratorStep()
                told = [line for line in unit.said if word in line]
                check(len(told) == 1, file.name, "does not say once at steps of the importer why it is not to be trusted", unit.said)
                instance.freeInstance()


FLAT = """kempe: 1
gravity: [0, 0, -9.81]
bodies: {drop: {joint: {name: z, prismatic: z, at: ground}, mass: 2}}
algebraic: {depth: "max(0, -q(z))"}
forces: {floor: {joint: z, force: "if(depth > 0, max(0, 2e4*depth - 40*qd(z)), 0)"}}
start: {q: {z: 0.5}}
run: {t_end: 1, outputs: [q, qd]}
"""


def check_flat_conditions(kempe, folder):
    """A condition that is zero until it holds is an event for an importer that searches signs, and for one that does not."""
    (folder / "flat.yaml").write_text(FLAT)
    expected = reference(kempe, folder, folder / "flat.yaml", 1)
    for fmi in (2, 3):
        file = folder / f"flat{fmi}.fmu"
        subprocess.run([kempe, "fmu", folder / "flat.yaml", "-o", file, "--fmi", str(fmi), "--quiet",
                        *(() if FULL else ("--compiler", quick_compiler(folder)))], check=True, stdout=subprocess.DEVNULL)
        unit = Unit(fmi, file, folder / file.stem)
        check_motions(unit, expected, 1)
        instance = unit.started("me")
        instance.enterContinuousTimeMode()
        for z, wanted in ((0.4, False), (-0.01, True)):
            slopes(unit, instance, 0.1, [z, -1])
            done = instance.completedIntegratorStep()
            check(bool(done[0]) == wanted, file.name, "asks for an event at the end of a step", z, done)
        instance.freeInstance()


DAMPED = """kempe: 1
inputs: {u: {unit: m}, idle: {unit: N}}
bodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}
forces: {f: {joint: x, force: "idle - 4 N*s/m*rate(q(x) - u)"}}
run: {t_end: 1, outputs: [qdd]}
"""


def check_damped(kempe, folder, has_library):
    """An input whose rate a damper reads has that derivative, another one has none."""
    (folder / "damped.yaml").write_text(DAMPED)
    for options in ((), ("--binary",))[:1 + has_library]:
        file = folder / f"damped{len(options)}.fmu"
        subprocess.run([kempe, "fmu", folder / "damped.yaml", "-o", file, "--quiet", *options, *(() if options or FULL else ("--compiler", quick_compiler(folder)))],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        unit = Unit(3, file, folder / file.stem)
        check("u.d" in unit.reference and not {"u.dd", "idle.d"} & set(unit.reference), file.name, "has other derivatives of inputs", sorted(unit.reference))
        instance = unit.started("cs")
        unit.set(instance, [unit.reference["u.d"]], [0.5])
        instance.doStep(0, 1e-6)
        check(abs(unit.get(instance, [unit.reference["qdd.x"]])[0] - 1) < 1e-5, file.name, "does not read the rate of an input")
        instance.freeInstance()


MOVED = """kempe: 1
inputs: {u: {unit: rad}}
bodies:
  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {P: [1, 0, 0]}}
  b: {joint: {name: B, revolute: z, at: a.P}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}}
drives: {d: {joint: A, angle: u}}
run: {t_end: 1}
"""


def check_moved(kempe, folder, has_library):
    """Co-simulation by sources refuses an input that moves a joint: by a jump, or by its rate. Unchanged it is no obstacle; the library follows it."""
    (folder / "moved.yaml").write_text(MOVED)
    for fmi in (2, 3):
        for options in ((), ("--binary",))[:1 + has_library]:
            file = folder / f"moved{fmi}{len(options)}.fmu"
            subprocess.run([kempe, "fmu", folder / "moved.yaml", "-o", file, "--fmi", str(fmi), "--quiet", *options,
                            *(() if options or FULL else ("--compiler", quick_compiler(folder)))], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            unit = Unit(fmi, file, folder / file.stem)
            u, rates = [unit.reference["u"]], [unit.reference["u.d"], unit.reference["u.dd"]]
            instance = unit.started("cs")
            instance.doStep(0, 0.1)
            if options:
                unit.set(instance, rates, [0, 2])
                instance.doStep(0.1, 0.1)
                check(abs(unit.get(instance, [unit.reference["q.A"]])[0] - 0.01) < 1e-12, file.name, "does not follow an input that moves a joint")
            else:
                for references, values in ((u, [0.01]), (rates, [0, 2])):
                    unit.set(instance, references, values)
                    unit.refused("an input that moves a joint", "moves closure 'd'", lambda: instance.doStep(0.1, 0.1))
                instance.doStep(0.1, 0.1)
            instance.freeInstance()


def check_model(kempe, folder, model, end):
    expected = reference(kempe, folder, model, end)
    for fmi in (2, 3):
        unit = Unit.of_model(kempe, folder, model, fmi)
        check_description(unit)
        check_picture(unit, (0.3, 0.8, 0.7, 0.9) if model == "four_bar" else ())
        if fmi == 3:
            check_terminals(unit)
        check_exports(unit)
        check_motions(unit, expected, end)
        check_steps(unit, end)
        check_saved(unit, "cs", *SAVED.get((model, "cs"), (end,)))
        if unit.named("x["):
            check_saved(unit, "me", *SAVED.get((model, "me"), (end,)))
            check_derivatives(unit)
        if model == "driven_slider_crank":
            check_dead_centre(unit, False)
        if model == "delta_robot":
            check_far_states(unit)
        if model == "four_bar":
            check_misuse(unit)
            check_given_start(unit)
            check_threads(unit, end)
        if (model, fmi) == BUILT_BY_FMPY or (model == BUILT_BY_FMPY[0] and FULL):
            check_motions(Unit.of_model(kempe, folder, model, fmi, "--no-binary", build=True), expected, end)
        if model == "cart_pole":
            check_input(unit)
        if model == "loose_slider" and fmi == 3:
            check_event_mode(unit, end)
    print(model, flush=True)


def check_bytes(kempe, folder):
    """The same model gives the same bytes."""
    for fmi in (2, 3):
        files = [Unit.of_model(kempe, folder, "slider_crank", fmi, *["--no-binary", "--no-cache"][:count]).file for count in (1, 2)]
        check(files[0].read_bytes() == files[1].read_bytes(), "bytes of units differ", fmi)


def check_coupling(kempe, folder):
    """The master of two units."""
    options = () if FULL else ("--compiler", quick_compiler(folder))
    done = subprocess.run([sys.executable, ROOT / "examples/cart_pole/couple_cart_pole.py", kempe, *options], capture_output=True, text=True)
    check(done.returncode == 0, "couple_cart_pole.py", done.stdout, done.stderr[-300:])


def main():
    kempe = os.path.realpath(sys.argv[1])
    folder = pathlib.Path(tempfile.mkdtemp())
    try:
        for model in sys.argv[2:] or MODELS:
            if model in MODELS:
                check_model(kempe, folder, model, MODELS[model])
        has_library = (pathlib.Path(kempe).parent / "kempe_unit.so").exists()
        for model in (sys.argv[2:] or ON_LIBRARY) if has_library else ():
            if model == "four_bar":
                check_without_states(kempe, folder)
                check_doubts(kempe, folder, has_library)
                check_moved(kempe, folder, has_library)
                check_damped(kempe, folder, has_library)
                check_flat_conditions(kempe, folder)
            if model in ON_LIBRARY:
                check_on_library(kempe, folder, model, *ON_LIBRARY[model])
        check_bytes(kempe, folder)
        check_coupling(kempe, folder)
    finally:
        shutil.rmtree(folder)
    print(f"{len(failures)} failures")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
