# SPDX-License-Identifier: BSD-3-Clause
"""Ways to have Kempe compute a motion of random_pairs.py, each beside what event_motion.py gives for it."""
import csv
import ctypes
import io
import json
import pathlib
import re
import subprocess
import sys
import warnings
import zipfile

import numpy as np

import pair_quantities
import simulated_models
from event_motion import Border, Motion
from random_pairs import ROWS, Foreign, Pair

STEP = 4e-3  # s: of the reference, whose error is then below 1e-8
ALLOWED = 1e-6  # of the size of a value
NUDGE = 1e-7  # of the start: how far it moves values shows how far errors grow
MOST_GROWTH = 1e3
METHODS = [("reduced", "dop853"), ("reduced", "dopri5"), ("reduced", "radau5"), ("reduced", "radau9"), ("reduced", "bdf"),
           ("reduced", "adams"), ("projected", "dop853"), ("dae", "radau"), (None, None)]
MULTISTEP = 20  # times what is allowed: errors of adams and bdf add up over their restarts
CHANGE = 3e-5  # of a parameter, for differences of the reference
ALLOWED_SLOPE = 3e-4


class Reference:
    """The motion and one from a start near to it: values by the names of Kempe's columns at each time, and what they may differ by."""

    def __init__(self, seed, number, broken=None, kind=Pair):
        self.make = lambda shift=None: kind(seed, number, broken, shift)
        pair = self.make()
        r = np.random.default_rng([seed, number, 7])
        self.rows = [pair.end * k / ROWS for k in range(ROWS + 1)]
        self.awkward = sorted(float(t) for t in r.uniform(0.05, 0.95, 2) * pair.end)
        self.left = None  # whether the motion leaves a table; None: hardly
        self.base, self.other = self.motion(pair), self.motion(self.make(), NUDGE)
        self.values, self.allowed, self.growth = {}, {}, 1.0
        if hasattr(pair, "left"):
            k, low, high = pair.left
            beyond = max(max(low - x[k], x[k] - high) for s in self.base.trace for x in (s[1], s[5]))
            self.left = None if abs(beyond) < 1e-3 else beyond > 0
            if self.left is None:
                raise Border("the end of a table is hardly passed")
        both = [self.named(pair, motion) for motion in (self.base, self.other)]
        for name, right in both[0].items():
            growth = np.abs(both[1][name] - right).max() / NUDGE
            if name.startswith("q"):
                if not growth < MOST_GROWTH and not name.startswith("qdd"):
                    raise Border("errors grow")
                self.growth = max(self.growth, growth) if not name.startswith("qdd") else self.growth
            self.values[name] = right
            self.allowed[name] = ALLOWED * np.maximum(growth, self.largest(pair, name, right))
        for name, right in self.values.items():
            largest = self.largest(pair, name, right)
            self.allowed[name] = np.maximum(self.allowed[name], ALLOWED * self.growth * largest)

    def largest(self, pair, name, right):
        """The largest value so far at each time, also between rows, as Kempe's own check has it; 1 if it is less. Reactions grow between
        rows as accelerations do."""
        word, _, joint = name.partition(".")
        rows = np.maximum(1, np.maximum.accumulate(np.abs(right)))
        if word == "t" or word == "state":
            return rows
        if joint in pair.names:
            return np.maximum(1, self.between_rows(pair.names.index(joint), ("q", "qd", "qdd").index(word) + 1))
        return rows * max(float(np.max(self.between_rows(k, 3) / np.maximum.accumulate(np.maximum(1, np.abs(self.values[f"qdd.{n}"])))))
                          for k, n in enumerate(pair.names))

    def between_rows(self, k, part):
        sizes = np.maximum.accumulate([max(abs(s[part][k]), abs(s[part + 4][k])) for s in self.base.trace])
        times = [s[4] for s in self.base.trace]
        return np.array([max(1.0, sizes[max(0, int(np.searchsorted(times, t + 1e-9)) - 1)]) for t in self.values["t"]])

    def motion(self, pair, nudge=0.0):
        motion = Motion(pair.machine, [x + nudge for x in pair.x], pair.v, STEP)
        return motion.run(pair.end, {*self.rows, *self.awkward})

    @staticmethod
    def named(pair, motion):
        times = sorted(motion.rows)
        rows = [motion.rows[t] for t in times]
        out = {"t": np.array(times)}
        for k, name in enumerate(pair.names):
            for word, part in (("q", 0), ("qd", 1), ("qdd", 2)):
                out[f"{word}.{name}"] = np.array([row[part][k] for row in rows])
        for k, name in enumerate(pair.state_names):
            out[f"state.{name}"] = np.array([row[3][k] for row in rows])
        for word in motion.m.reactions:
            name = word[:-1].replace("(", ".")
            for k in range(len(rows[0][4][word])):
                last = "." + ("xyz"[k] if word.startswith("reaction") else str(k + 1)) if word[0] in "rl" else ""
                out[f"{name}{last}"] = np.array([row[4][word][k] for row in rows])
        return out

    def at(self, names, times):
        """Values and what they may differ by, at some of the times."""
        where = [int(np.argmin(np.abs(self.values["t"] - t))) for t in times]
        return np.array([self.values[n][where] for n in names]), np.array([self.allowed[n][where] for n in names])


class Unit:
    """A functional mock-up unit of version 3.0 in co-simulation."""

    def __init__(self, file, folder):
        with zipfile.ZipFile(file) as archive:
            archive.extractall(folder)
        text = (folder / "modelDescription.xml").read_text()
        self.numbers = {n: int(k) for n, k in re.findall(r'<Float64 name="([^"]+)" valueReference="(\d+)"', text)}
        self.library = ctypes.CDLL(str(next(folder.glob("binaries/*/*.so"))))
        self.library.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
        log = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
        self.said, self.state = [], ctypes.c_void_p()
        self.log = log(lambda where, status, kind, message: self.said.append(message.decode(errors="replace")))
        token = re.search(r'instantiationToken="([^"]+)"', text)[1]
        self.unit = ctypes.c_void_p(self.library.fmi3InstantiateCoSimulation(
            b"unit", token.encode(), str(folder / "resources").encode() + b"/", False, True, False, False, None, 0, None, self.log, None))
        self.call("EnterInitializationMode", True, ctypes.c_double(1e-9), ctypes.c_double(0), False, ctypes.c_double(0))
        self.call("ExitInitializationMode")

    def call(self, name, *words):
        if getattr(self.library, "fmi3" + name)(self.unit, *words) > 1:
            raise RuntimeError((self.said or ["no reason"])[-1])

    def advance(self, t, end):
        words = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
        self.call("DoStep", ctypes.c_double(t), ctypes.c_double(end - t), False, *words, ctypes.byref(ctypes.c_double()))

    def get(self, names):
        out = (ctypes.c_double * len(names))()
        self.call("GetFloat64", (ctypes.c_uint32 * len(names))(*(self.numbers[n] for n in names)), ctypes.c_size_t(len(names)), out,
                  ctypes.c_size_t(len(names)))
        return np.array(out)

    def end(self):
        self.library.fmi3FreeInstance.restype = None
        self.library.fmi3FreeInstance(self.unit)


class Way:
    """One way to run a machine: comparisons as (what, values, right ones, allowed differences), or the sentence that refuses it."""

    NAMES = "run lanes outputs resumed quantities stepper unit unit-sources sensitivity equilibrium foreign simulator inverse beside".split()
    SHARES = dict(zip(NAMES, (1, 0.3, 0.4, 0.25, 0.35, 0.35, 0.06, 0.002, 0.12, 0.2, 0.1, 0.006, 0.25, 0.3)))  # of the machines
    DISTRUSTED = "run lanes outputs resumed quantities stepper unit sensitivity".split()  # ways that judge a motion which leaves a table

    def __init__(self, options, folder, pair, number, reference, seed=1):
        self.seed = seed
        self.options, self.folder, self.pair, self.number, self.reference = options, folder, pair, number, reference
        self.state = [f"{word}.{n}" for word in ("q", "qd") for n in pair.names]

    def kempe(self, *words):
        return subprocess.run([self.options.kempe, *map(str, words)], cwd=self.folder, capture_output=True, text=True, errors="replace",
                              check=False, timeout=300)

    @staticmethod
    def reason(done):
        return (done.stderr.strip() or f"exit code {done.returncode}").splitlines()[0]

    def table(self, name):
        lines = (self.folder / name).read_text().splitlines()
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        return {key: np.array([float(row[key] or "nan") if re.fullmatch(r"[-+.0-9einfa]*", row[key] or "") else np.nan for row in rows]) for key in rows[0]}

    def compared(self, what, table, names, times):
        right, allowed = self.reference.at(names, times)
        return what, np.array([table[n] for n in names]), right, allowed

    def ends(self, what, values):
        right, allowed = self.reference.at(self.state, [self.pair.end])
        return [(what, np.asarray(values), right[:, 0], allowed[:, 0])], ""

    def simulate(self, model, *more, table="end.csv"):
        done = self.kempe("simulate", model, "-o", table, *more)
        return (None, self.reason(done)) if done.returncode else (self.table(table), "")

    # -- motions that leave a table: no way may trust them

    def distrusts(self, name):
        self.distrust = name
        codes, why = getattr(self, f"distrust_{name}", self.distrust_study)()
        if codes is None:
            return None, why
        return [("trusted, exit code", np.array(codes), np.full(len(codes), 5), np.full(len(codes), 0.5))], ""

    def judged(self, *words, allowed=(0, 5)):
        """An exit code, or why there is none."""
        done = self.kempe(*words)
        return (done.returncode, "") if done.returncode in allowed else (None, self.reason(done))

    def distrust_study(self):
        (self.folder / "one.csv").write_text(f"q.{self.pair.names[0]}\n{self.pair.x[0]}\n")
        more = {"run": ("simulate", "pair.yaml"), "outputs": ("simulate", "more.yaml"),
                "lanes": ("ensemble", "pair.yaml", "--values", "one.csv"),
                "quantities": ("ensemble", "pair.yaml", "--values", "one.csv", "--quantity", f"a = max(q({self.pair.joint}))"),
                "sensitivity": ("sensitivity", "pair.yaml", "--parameters", "stiff", "--outputs", f"q({self.pair.joint})")}
        text = (self.folder / "pair.yaml").read_text()
        (self.folder / "more.yaml").write_text(text.replace("outputs: [q, qd]", "outputs: [q, qd, qdd, energy]"))
        code, why = self.judged(*more[self.distrust])
        return ([code], "") if code is not None else (None, why)

    def distrust_resumed(self):
        """The whole of it, whichever part leaves the table."""
        code, why = self.judged("simulate", "pair.yaml", "--t-end", repr(self.pair.end / 2), "--checkpoint", "half.kempe")
        if code is not None:
            code, why = self.judged("simulate", "pair.yaml", "--resume", "half.kempe")
        return ([code], "") if code is not None else (None, why)

    def distrust_stepper(self):
        import kempe
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                stepper = kempe.Model(str(self.folder / "pair.yaml")).system().stepper(t_end=self.pair.end)
                stepper.advance(self.pair.end)
        except kempe.Error as error:
            return None, str(error).splitlines()[0]
        return [5 if stepper.status == "not trustworthy" else 0], ""

    def distrust_unit(self):
        if "inputs" in self.pair.other:  # set by the importer
            return None, None
        done = self.kempe("fmu", "pair.yaml", "-o", "pair.fmu", "--kind", "cs", "--binary")
        if done.returncode:
            return None, self.reason(done)
        unit = Unit(self.folder / "pair.fmu", self.folder / "unit0")
        try:
            unit.advance(0.0, self.reference.awkward[0])
            unit.advance(self.reference.awkward[0], self.pair.end)
            return [5 if any("beyond its points" in line for line in unit.said) else 0], ""
        except RuntimeError as error:
            return None, str(error).splitlines()[0]
        finally:
            unit.end()

    # -- ways

    def run(self):
        formulation, integrator = METHODS[self.number % len(METHODS)]
        table, why = self.simulate("pair.yaml", *(["--formulation", formulation, "--integrator", integrator] if formulation else []))
        if table is None:
            return None, why
        what, got, right, allowed = self.compared("rows", table, self.state, self.reference.rows)
        return [(what, got, right, allowed * (MULTISTEP if integrator in ("bdf", "adams") else 1))], ""

    def lanes(self):
        """The first and the last one of three instances; another one between them has another motion."""
        name = self.pair.names[0]
        x = self.pair.x[0]
        (self.folder / "values.csv").write_text(f"q.{name}\n{x}\n{x - 0.04}\n{x}\n")
        done = self.kempe("ensemble", "pair.yaml", "--values", "values.csv", "-o", "ends.csv")
        if done.returncode not in (0, 1, 5):
            return None, self.reason(done)
        table = self.table("ends.csv")
        with open(self.folder / "ends.csv") as file:
            status = [row["status"] for row in csv.DictReader(file)]
        if status[0] != "complete" or status[2] != "complete":
            return None, f"{status[0]}: {self.reason(done)}"
        return [self.ends(f"instance {k + 1}", [table[n][k] for n in self.state])[0][0] for k in (0, 2)], ""

    def outputs(self):
        """Other outputs are asked for: the motion has the same bits, and they are right."""
        words = [f"state({n})" for n in self.pair.state_names] + list(self.pair.machine.reactions)
        text = (self.folder / "pair.yaml").read_text()
        (self.folder / "more.yaml").write_text(text.replace("outputs: [q, qd]", f"outputs: [{', '.join(['q, qd, qdd, energy', *words])}]"))
        few, why = self.simulate("pair.yaml", "--no-convergence-check", table="few.csv")
        many, other = self.simulate("more.yaml", "--no-convergence-check", table="many.csv")
        if few is None or many is None:
            return None, why or other
        names = [n for n in self.reference.values if n != "t" and n in many]
        absent = [n for n in self.reference.values if n not in many]
        assert not absent, absent
        same = np.array([few[n] for n in self.state])
        return [("bits", np.array([many[n] for n in self.state]), same, 0 * same)] + [
            self.compared(n, many, [n], self.reference.rows) for n in names], ""

    def resumed(self):
        half = self.pair.end * float(np.random.default_rng([self.number, 5]).choice([0.5, 0.37, 0.81]))
        first = self.kempe("simulate", "pair.yaml", "--t-end", repr(half), "--checkpoint", "half.kempe")
        if first.returncode:
            return None, self.reason(first)
        table, why = self.simulate("pair.yaml", "--resume", "half.kempe")
        return (None, why) if table is None else self.ends("end", [table[n][-1] for n in self.state])

    def quantities(self):
        """Extremes, times and integrals of an ensemble's instance."""
        words = pair_quantities.Quantities(self.pair, self.reference, self.number)
        (self.folder / "one.csv").write_text(f"q.{self.pair.names[0]}\n{self.pair.x[0]}\n")
        done = self.kempe("ensemble", "pair.yaml", "--values", "one.csv", "--quantity", ", ".join(f"w{k} = {w}" for k, w in enumerate(words.texts)),
                          "-o", "words.csv")
        if done.returncode:
            return None, self.reason(done)
        table = self.table("words.csv")
        return [(text, np.array([table[f"w{k}"][0]]), np.array([right]), np.array([allowed]))
                for k, (text, right, allowed) in enumerate(zip(words.texts, words.right, words.allowed))], ""

    def stepper(self):
        """A stepper in Python that goes on, is brought back, and goes on again."""
        import kempe
        formulation, integrator = METHODS[(self.number // 3) % len(METHODS)]
        try:
            stepper = kempe.Model(str(self.folder / "pair.yaml")).system().stepper(
                t_end=self.pair.end, **({"formulation": formulation, "integrator": integrator} if formulation else {}))
            first, second = self.reference.awkward
            stepper.advance(first)
            at_first = np.concatenate((stepper.q, stepper.qd))
            state = stepper.save()
            stepper.advance(second)
            stepper.restore(state)
            stepper.advance(self.pair.end)
        except kempe.Error as error:
            return None, str(error).splitlines()[0]
        names = [f"{word}.{c}" for word in ("q", "qd") for c in stepper.model.coordinates] if hasattr(stepper, "model") else None
        if names is None:
            names = [f"{word}.{c}" for word in ("q", "qd") for c in kempe.Model(str(self.folder / "pair.yaml")).coordinates]
        several = MULTISTEP if integrator in ("bdf", "adams") else 1
        out = []
        for what, values, t in (("awkward", at_first, first), ("end", np.concatenate((stepper.q, stepper.qd)), self.pair.end)):
            right, allowed = self.reference.at(self.state, [t])
            out.append((what, np.array([values[names.index(n)] for n in self.state]), right[:, 0], allowed[:, 0] * several))
        return out, ""

    def unit(self, *more):
        """A functional mock-up unit, of the library or of sources, with steps of other lengths, and back to a state."""
        if "inputs" in self.pair.other:  # set by the importer
            return None, None
        done = self.kempe("fmu", "pair.yaml", "-o", "pair.fmu", "--kind", "cs", *(more or ["--binary"]))
        if done.returncode:
            return None, self.reason(done)
        unit = Unit(self.folder / "pair.fmu", self.folder / f"unit{len(more)}")  # a loaded library must not be written over
        try:
            first, second = self.reference.awkward
            unit.advance(0.0, first)
            if "delay" not in self.pair.features:
                unit.call("GetFMUState", ctypes.byref(unit.state))
                unit.advance(first, second)
                unit.call("SetFMUState", unit.state)
            unit.advance(first, self.pair.end)
            return self.ends("end", unit.get(self.state))
        except RuntimeError as error:
            return None, str(error).splitlines()[0]
        finally:
            unit.end()

    def unit_sources(self):
        return self.unit("--fmi", "3")

    def sensitivity(self):
        """Derivatives of the end by a parameter, beside differences of the reference."""
        if {"friction", "friction-by-load", "stop", "puck", "journal", "compliant"} & set(self.pair.features) or self.pair.other.get("impacts"):
            return None, None  # refused: modes change with the parameter
        joint = self.pair.joint
        name = ("stiff", "load", "rate")[self.number % 3]
        names, allowed = [f"{word}.{joint}" for word in ("q", "qd")], self.reference.growth * ALLOWED_SLOPE
        slopes = []
        for change in (CHANGE, 2 * CHANGE):
            ends = []
            for sign in (1, -1):
                pair = self.reference.make({name: sign * change})
                motion = self.reference.motion(pair)
                ends.append(np.array([part[pair.k] for part in (motion.x, motion.v)]))
            slopes.append((ends[0] - ends[1]) / (2 * change))
        right = slopes[0]
        if np.abs(slopes[1] - right).max() > allowed / 3:
            return None, None  # no derivative, or one that changes fast
        done = self.kempe("sensitivity", "pair.yaml", "--parameters", {"rate": f"qd.{joint}"}.get(name, name), "--outputs",
                          f"q({joint}),qd({joint})", "-o", "slopes.csv", *(["--method", "adjoint"] if self.number % 5 == 0 else []))
        if done.returncode:
            return None, self.reason(done)
        table = self.table("slopes.csv")
        got = [table[next(key for key in table if key.startswith(f"{n}/"))][-1] for n in names]
        return [(f"slope by {name}", np.array(got), right, allowed * np.maximum(1, np.abs(right)))], ""

    def equilibrium(self):
        """The load that holds the machine at a place."""
        pair = self.reference.make()
        machine, x = pair.machine, np.array(pair.x) - 0.1
        if machine.n > 1 or {"counter", "relay"} & set(pair.features):
            return None, None
        machine.delays = [(k, time, x[k]) for k, time, _ in machine.delays]
        machine.track = [[] for _ in machine.delays]
        machine.sides = {}
        z = np.array([at_rest(x) for at_rest in pair.resting])
        right = -machine.force(0.0, list(x), [0.0], list(z))[0]
        done = self.kempe("equilibrium", "pair.yaml", "--hold", f"{pair.joint}={x[0]!r}", "--solve-for", "load", "--json", "held.json")
        if done.returncode:
            return None, self.reason(done)
        got = json.loads((self.folder / "held.json").read_text())["free"]["load"]
        return [("load", np.array([got]), np.array([right]), np.array([1e-8 * (1 + abs(right))]))], ""

    def foreign(self):
        """Another machine, written in the format of another program and read again; its start is given as values."""
        reference = Reference(self.seed, self.number, kind=Foreign)
        pair, name = reference.make(), ("mjcf", "sdf")[self.number % 2]
        (self.folder / "own.yaml").write_text(pair.text)
        done = self.kempe("show", "own.yaml", "--as", name)
        if done.returncode:
            return None, self.reason(done)
        (self.folder / f"other.{name}").write_text(done.stdout)
        columns = [f"{word}.{n}" for word in ("q", "qd") for n in pair.names]
        (self.folder / "start.csv").write_text(",".join(columns) + "\n" + ",".join(map(str, pair.x + pair.v)) + "\n")
        done = self.kempe("ensemble", f"other.{name}", "--values", "start.csv", "--t-end", pair.end, "--rtol", "1e-9", "-o", "foreign.csv")
        if done.returncode:
            return None, self.reason(done)
        table = self.table("foreign.csv")
        right, allowed = reference.at(columns, [pair.end])
        return [(f"end by {name}", np.array([table[n][0] for n in columns]), right[:, 0], allowed[:, 0])], ""

    def inverse(self):
        """The machine's own motion needs no force: at rows that an input's jump is at, too."""
        pair = self.pair
        if {"friction", "friction-by-load", "stop", "puck", "journal", "compliant", "touch", "rope", "tyre", "wheel"} & set(pair.features) or pair.other.get("impacts"):
            return None, None  # refused: contacts and friction at rest have no force of their own there
        step = pair.end / ROWS
        if "inputs" in pair.other:
            step = json.loads(re.search(r"t: (\[[^]]*\])", pair.other["inputs"])[1])[1]
        text = (self.folder / "pair.yaml").read_text()
        (self.folder / "rows.yaml").write_text(text.replace("outputs: [q, qd]", "outputs: [q, qd, qdd, state]" if pair.state_names or pair.machine.delays else "outputs: [q, qd, qdd]"))
        done = self.kempe("simulate", "rows.yaml", "--output-step", repr(step), "-o", "rows.csv", "--no-convergence-check")
        if done.returncode:
            return None, self.reason(done)
        driven = re.findall(r"d: \{joint: (\w+), displacement", text)
        done = self.kempe("inverse", "rows.yaml", "--motion", "rows.csv", "--actuators", ",".join([*pair.names, *driven]), "-o", "forces.csv",
                          "--no-convergence-check")
        if done.returncode:
            return None, self.reason(done)
        table, rows = self.table("forces.csv"), self.table("rows.csv")
        names = [f"tau.{n}" for n in pair.names]
        force = max(1.0, *(np.abs(rows[f"qdd.{n}"]).max() for n in pair.names))
        return [("force", np.array([table[n] for n in names]), np.zeros((len(names), len(table["t"]))), ALLOWED * force)], ""

    def beside(self):
        """The machine and another one that shares nothing with it, included in one model: rows, the end behind a checkpoint, an instance."""
        numbers = (self.number + k for k in range(1, 100))
        neighbour = next(pair for pair in (self.options.kind(self.seed, n) for n in numbers) if not hasattr(pair, "left"))
        text = (self.folder / "pair.yaml").read_text()
        (self.folder / "neighbour.yaml").write_text(neighbour.text)
        own = {key: re.search(rf"^{key}: .*$", text, re.MULTILINE) for key in ("gravity", "run")}
        (self.folder / "both.yaml").write_text(
            "kempe: 1\n" + (own["gravity"][0] + "\n" if own["gravity"] else "gravity: [0, 0, 0]\n") +
            "include: [{file: pair.yaml, prefix: a_}, {file: neighbour.yaml, prefix: b_}]\n" + own["run"][0] + "\n")
        formulation, integrator = METHODS[(self.number // 5) % len(METHODS)]
        by = ["--formulation", formulation, "--integrator", integrator] if formulation else []
        if self.number % 3 == 1:
            done = self.kempe("simulate", "both.yaml", *by, "--t-end", repr(self.reference.awkward[0]), "--checkpoint", "part.kempe")
            if done.returncode:
                return None, self.reason(done)
            by += ["--resume", "part.kempe"]
        if self.number % 3 == 2:
            (self.folder / "one.csv").write_text(f"q.a_{self.pair.names[0]}\n{self.pair.x[0]}\n")
            done = self.kempe("ensemble", "both.yaml", "--values", "one.csv", "-o", "end.csv")
            table, why = (None, self.reason(done)) if done.returncode else (self.table("end.csv"), "")
        else:
            table, why = self.simulate("both.yaml", *by)
        if table is None:
            return None, why
        table = {name.replace(".a_", "."): column for name, column in table.items()}
        if self.number % 3:
            return self.ends("end", [table[n][-1] for n in self.state])
        what, got, right, allowed = self.compared("rows", table, self.state, self.reference.rows)
        return [(what, got, right, allowed * (MULTISTEP if integrator in ("bdf", "adams") else 1))], ""

    def simulator(self):
        if "inputs" in self.pair.other:  # a simulator's inputs are set by its caller
            return None, None
        table, why, _ = simulated_models.table_of(self.options.kempe, self.folder / "pair.yaml", self.folder, self.pair.end, 1e-9, ROWS,
                                                  lambda words: subprocess.run(words, capture_output=True, text=True, check=False, timeout=100))
        if not table:
            return None, why
        last = list(csv.DictReader(line for line in io.StringIO(table) if not line.startswith("#")))[-1]
        return self.ends("end", [float(last[n]) for n in self.state])


def ways_of(seed, number, wanted, every=False):
    r = np.random.default_rng([seed, number, 3])
    drawn = r.random(len(Way.NAMES))
    return [name for name, u in zip(Way.NAMES, drawn) if name in wanted and (every or u < Way.SHARES[name])]


def has_python(folder):
    """True if the package is built there; from now on it is imported from there."""
    if not list(pathlib.Path(folder).glob("kempe/_native*.so")):
        return False
    sys.path.insert(0, str(folder))
    return True
