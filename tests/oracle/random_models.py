# SPDX-License-Identifier: BSD-3-Clause
"""Random models of everything that docs/model describes but wheels. A model is made as nested dicts of texts, placed
by the oracle's own mechanics, closed there by points that are put where they must be, given rates that fit, and written as YAML.
`FEATURES` must all occur."""
import numpy as np

import yaml_texts
from random_choices import written
from random_laws import Laws
from random_loops import Loops
from random_states import States
from random_trees import Trees

FEATURES = """revolute prismatic cylindrical screw universal spherical planar free weld motions chart frame to reversed
coordinates axes-of-points one-axis-alone oblique-axis graph graph-cut graph-chosen graph-turned include include-twice
include-offset include-set parameters units table-spline table-linear table-csv unknown-expression unknown-equations
massless loop-ball loop-rod loop-rod-of-time loop-revolute loop-universal loop-cylindrical loop-prismatic loop-weld
loop-planar loop-point_on_line loop-point_on_plane curve-table curve-y curve-y-and-z curve-surface curve-two-surfaces
coupler coupler-equals constraint constraint-of-time linkage drive-angle drive-displacement drive-locked redundant torque
force joint-spring stops friction spring bushing line rope cylinder torsion measure point-force body-torque condition-q condition-qd condition-t
condition-lambda force-of-lambda sensor ancestor-moves ancestor-body formulation-reduced formulation-dae formulation-projected integrators
dynamics tape held rough-guess joint-load state-rate state-transfer state-controller state-sampled state-event""".split()


class Generator(Trees, Loops, Laws, States):
    def __init__(self, seed, number, integrator=None):
        super().__init__(np.random.default_rng([seed, number]), f"random {number}")
        self.integrator = integrator                      # of all runs; None: chosen for each
        self.number, self.files, self.q, self.states = number, {}, {}, []
        self.state_random = np.random.default_rng([seed, number, 1])

    def add_run(self):
        document = self.document
        outputs = ["q", "qd", "qdd", "lambda", "energy"]
        if not self.built.items_count:
            outputs.remove("lambda")
        cut = [name for name, keys in document.get("joints", {}).items() if keys.get("cut") == "yes"]
        for name in list(document.get("loops", {})) + cut:
            outputs.append(f"reaction({name})")
            if not {"coupler", "constraint"} & set(document.get("loops", {}).get(name, {})):
                outputs.append(f"moment({name})")
        outputs += [f"reaction({name})" for name in document.get("drives", {})]
        outputs += [f"{word}({name})" for name in self.loaded_joints() for word in ("reaction", "moment")]
        for body, keys in [("ground", document["ground"]), *document["bodies"].items()]:
            for point in list(keys["points"])[:2]:
                outputs += [f"{word}({body}.{point})" for word in ("position", "velocity", "acceleration")]
        outputs += ["state"] if self.states else []
        shown = [name for name, keys in document.get("forces", {}).items() if "at" not in keys and "on" not in keys]
        outputs += [f"force({name})" for name in shown]
        outputs += [f"sensor({name})" if self.chance(0.5) else name for name in document.get("sensors", {})]
        if "include" in document:
            at = document["include"][0]["at"].split(".")[0]
            outputs += [f"position({at}.s_G)", "force(s_inner)", "s_seen", "position(s_i1.P0)", "velocity(s_i0.P0)"]
        rtol = self.one_of("1e-8", "1e-9", "1e-10")
        document["run"] = {"t_end": "80 ms", "output_step": "0.01", "rtol": rtol, "atol": rtol, "outputs": outputs}
        self.choose_way(document["run"])
        self.leave_choice()

    def loaded_joints(self):
        """Joints of trees whose loads are known: no weld, no screw, no translations before and after a rotation."""
        names = [name for name, keys in self.document.get("joints", {}).items()
                 if keys.get("cut") != "yes" and not {"weld", "screw"} & set(keys)]
        for keys in self.document["bodies"].values():
            joint = keys.get("joint", {"weld": "yes"})
            turns = ["R" in motion for motion in joint.get("motions", [])]
            if not {"weld", "screw"} & set(joint) and sum(a != b for a, b in zip(turns, turns[1:])) < 2:
                names.append(joint["name"])
        self.features["joint-load"] += bool(names)
        return names

    def choose_way(self, run):
        formulation = self.one_of("reduced", "reduced", "dae", "projected")
        self.features["formulation-" + formulation] += 1
        if self.chance(0.6):
            run["formulation"] = formulation
            if formulation == "dae" and self.number % 4:  # it shares no step with the other formulations
                run["integrator"] = "ida"
        if formulation == "reduced" and self.chance(0.3):
            self.features["integrators"] += 1
            run["formulation"] = formulation
            run["integrator"] = self.one_of("radau9", "radau5", "radau", "dopri5", "bdf", "adams", "dop853")
        if self.integrator:
            run["formulation"], run["integrator"] = formulation, self.integrator
        if self.chance(0.3):
            self.features["dynamics"] += 1
            articulated = () if self.features["force-of-lambda"] else ("articulated",)
            run["algorithm"] = self.one_of("composite", "plain", "ner", "auto", *articulated)

    def add_start(self):
        start = {"q": {n: repr(self.q[n]) for n in self.built.columns if self.q[n] != 0.0},
                 "qd": {n: repr(self.rates[n]) for n in self.built.columns}}
        driven = {self.built.places[keys["joint"]] for keys in self.document.get("drives", {}).values()}
        found = self.coordinate()
        if found and self.document.get("loops") and found[1] not in driven and self.chance(0.3):
            self.features["held"] += 1
            start["hold"] = [found[0]]
        self.guess_roughly(start)
        self.document["start"] = {k: v for k, v in start.items() if v}

    def leave_choice(self):
        """Kempe itself chooses what it cuts of a graph: no joint says so, and no output asks for the load of a weld."""
        if not self.cuts or self.features["force-of-lambda"] or self.chance(0.5):
            return
        self.features["graph-chosen"] += 1
        for keys in self.document["joints"].values():
            keys.pop("cut")
        outputs = self.document["run"]["outputs"]
        gone = {f"{word}({name})" for word in ("reaction", "moment") for name in self.cuts
                if "weld" in self.document["joints"].get(name, {})}
        self.document["run"]["outputs"] = [word for word in outputs if word not in gone]

    def guess_roughly(self, start):
        """A start that is not closed, without rates."""
        loops = self.document.get("loops", {})
        locked = any("locked" in keys for keys in self.document.get("drives", {}).values())
        if not self.motion.items or locked or any("coupler" in k for k in loops.values()) or self.chance(0.85):
            return
        self.features["rough-guess"] += 1
        for name in start["q"]:
            if self.built.places[name] not in {self.built.places[n] for n in start.get("hold", [])}:
                start["q"][name] = repr(round(float(start["q"][name]) + self.between(-0.02, 0.02), 5))
        start["qd"] = {}

    def count_ancestors(self):
        for closure in self.built.closures:
            if closure.points:
                common = self.built.common(closure)
                if common >= 0:
                    self.features["ancestor-body"] += 1
                    turn = self.motion.turn[0, common]
                    self.features["ancestor-moves"] += bool(np.abs(turn - np.eye(3)).max() > 0.1)

    def make(self, folder):
        """Writes the model and what it includes; returns its path."""
        self.folder = folder
        while True:
            self.features.clear()
            self.files.clear()
            self.q.clear()
            self.cuts = set()
            for key in [k for k in self.document if k not in ("kempe", "name", "gravity")]:
                del self.document[key]
            self.document["parameters"] = {}
            self.linkage = self.chance(0.12)
            if self.linkage:
                self.make_linkage()
            else:
                self.make_tree()
            for name, text in self.files.items():
                (folder / name).write_text(text)
            yaml_texts.load.cache_clear()
            self.settle()
            if 1 <= len(self.built.columns) <= 14 and self.motion.solve().condition()[0] < 1e6:
                break
        if self.linkage:
            self.close_linkage()
        else:
            self.add_closures()
            self.add_redundant()
        self.set_rates()
        self.add_states()
        self.add_forces()
        self.add_unknowns()
        self.add_sensors()
        self.built.items_count = len(self.motion.items)
        self.count_ancestors()
        self.add_start()
        self.add_run()
        path = folder / f"model{self.number}.yaml"
        path.write_text(written(self.document))
        self.arguments = []
        if self.chance(0.1):
            self.features["tape"] += 1
            self.arguments = ["--backend", "tape"]
        return path
