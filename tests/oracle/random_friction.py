# SPDX-License-Identifier: BSD-3-Clause
"""Random plane linkages with closed loops, one to four elements of dry friction that sticks, and stops that strike. A
linkage is drawn in a random position, and its pivots on the ground are put where they close the loops."""
import numpy as np

SHAPES = ("slider-crank", "four-bar", "five-bar", "six-bar")
KINDS = ("constant", "static", "falling", "joint", "loop")


class Linkage:
    """`document`: the model; `rotates`: the names of its coordinates, and whether each is a rotation."""

    shapes, stream = SHAPES, ()

    def __init__(self, seed, number, stops=True, sides=False):
        self.random = np.random.default_rng([seed, number, *self.stream])
        self.document = {"kempe": 1, "name": f"friction_{seed}_{number}", "ground": {"points": {}}, "bodies": {},
                         "loops": {}, "forces": {}, "start": {"q": {}, "hold": [], "qd": {}}}
        self.rotates, self.kinds, self.sided = {}, [], 0
        self.shape = self.shapes[self.random.integers(len(self.shapes))]
        self.document["gravity"] = [self.text(x) for x in self.draw_gravity()]
        self.make()
        self.load_joints()
        for k in range(self.random.integers(1, 5)):
            self.add_friction(f"rub{k}")
        forces = [f"force(rub{k})" for k in range(len(self.kinds))]
        if stops:
            self.random = np.random.default_rng([seed, number, *self.stream, 1])
            forces += [f"{word}({name})" for name in self.add_stops() for word in ("force", "gap")]
        if sides:
            self.random = np.random.default_rng([seed, number, *self.stream, 2])
            self.take_sides()
        self.document["run"] = {"t_end": 10, "outputs": ["q", "qd", "qdd", "lambda", *forces]}

    def make(self):
        getattr(self, "make_" + self.shape.replace("-", "_"))()

    def draw_gravity(self):
        angle = self.random.uniform(-np.pi, np.pi)
        g = 0.0 if self.chance(0.1) else 9.81
        return g * np.sin(angle), -g * np.cos(angle), 0.0

    def chance(self, p):
        return self.random.random() < p

    def number(self, low, high):
        return float(self.random.uniform(low, high))

    @staticmethod
    def text(x):
        return repr(float(x))

    # -- bodies

    def add_bar(self, name, joint, at, angle, relative, length):
        """A bar along its x axis that turns at a point; its angle in the ground's axes and that of its joint."""
        mass = self.number(0.3, 2)
        self.document["bodies"][name] = {
            "joint": {"name": joint, "revolute": "z", "at": at}, "mass": self.text(mass),
            "com": [self.text(length * self.number(0.2, 0.8)), self.text(length * self.number(-0.2, 0.2)), "0"],
            "inertia": {"zz": self.text(mass * length**2 / 12)}, "points": {"E": [self.text(length), "0", "0"]}}
        self.rotates[joint] = True
        self.document["start"]["q"][joint] = self.text(relative)

    def add_ground(self, name, place):
        self.document["ground"]["points"][name] = [self.text(place[0]), self.text(place[1]), "0"]
        return f"ground.{name}"

    @staticmethod
    def end(place, angle, length):
        return place + length * np.array([np.cos(angle), np.sin(angle)])

    def chain(self, first, place, count):
        """Bars one after the other from a place on the ground; the place and the angle of the last one's end."""
        at, before = self.add_ground(first, place), 0.0
        for k in range(count):
            angle, length = self.number(-np.pi, np.pi), self.number(0.15, 0.8)
            self.add_bar(f"{first}{k}", f"j{first}{k}", at, angle, angle - before, length)
            place, before, at = self.end(place, angle, length), angle, f"{first}{k}.E"
        return place, at

    def close_by_bar(self, name, place, at):
        """A bar from the ground to a place, and the loop there."""
        angle, length = self.number(-np.pi, np.pi), self.number(0.3, 0.9)
        pivot = self.add_ground(name, self.end(place, angle, -length))
        self.add_bar(f"{name}0", f"j{name}0", pivot, angle, angle, length)
        self.document["loops"][f"C{name}"] = {"ball": [at, f"{name}0.E"]}

    def make_four_bar(self):
        self.close_by_bar("b", *self.chain("a", np.zeros(2), 2))
        self.begin(["ja0"])

    def make_five_bar(self):
        self.close_by_bar("b", *self.chain("a", np.zeros(2), 3))
        self.begin(["ja0", "ja1"])

    def make_six_bar(self):
        self.make_four_bar()
        start = self.document["start"]["q"]
        angle = float(start["ja0"]) + float(start["ja1"])
        bar = self.document["bodies"]["a1"]["points"]
        bar["M"] = [self.text(0.5 * float(bar["E"][0])), self.text(self.number(-0.3, 0.3)), "0"]
        middle, turn = np.array([float(x) for x in bar["M"][:2]]), np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        first = float(self.document["bodies"]["a0"]["points"]["E"][0])
        place = self.end(np.zeros(2), float(start["ja0"]), first) + turn @ middle
        own, length = self.number(-np.pi, np.pi), self.number(0.3, 0.8)
        self.add_bar("c0", "jc0", "a1.M", own, own - angle, length)
        self.close_by_bar("d", self.end(place, own, length), "c0.E")

    def make_slider_crank(self):
        place, at = self.chain("a", np.zeros(2), 2)
        way = self.number(-np.pi, np.pi)
        axis = np.array([np.cos(way), np.sin(way)])
        x = self.number(-0.5, 0.5)
        rail = self.add_ground("S", place - x * axis)
        self.document["bodies"]["slider"] = {
            "joint": {"name": "s", "prismatic": [self.text(axis[0]), self.text(axis[1]), "0"], "at": rail},
            "mass": self.text(self.number(0.3, 2)), "points": {"P": ["0", "0", "0"]}}
        self.rotates["s"] = False
        self.document["start"]["q"]["s"] = self.text(x)
        self.document["loops"]["Cs"] = {"ball": [at, "slider.P"]}
        self.begin(["ja0"])

    def begin(self, held):
        self.document["start"]["hold"] = held
        for name in held:
            if self.chance(0.85):
                self.document["start"]["qd"][name] = self.text(self.number(-5, 5))

    # -- stops

    def add_stops(self):
        """The names of none to three stops, each a limit of a coordinate on one side."""
        sides = [(joint, side) for joint in self.rotates for side in ("lower", "upper")]
        contacts = {}
        for k in self.random.permutation(len(sides))[:self.random.integers(0, 4)]:
            joint, side = sides[k]
            way = self.number(0.1, 1.0) * (1.0 if self.rotates[joint] else 0.3)
            at = float(self.document["start"]["q"][joint]) + (way if side == "upper" else -way)
            contacts[f"stop{len(contacts)}"] = {"joint": joint, side: self.text(at),
                                                "restitution": self.text(self.random.choice([0.0, 0.3, 0.5, 0.8]))}
        if contacts:
            self.document["contacts"] = contacts
        return list(contacts)

    # -- forces

    def load_joints(self):
        for name, rotates in self.rotates.items():
            if self.chance(0.3):
                rest = float(self.document["start"]["q"][name]) + self.number(-0.5, 0.5)
                keys = {"stiffness": self.text(self.number(1, 20)), "rest": self.text(rest)}
                if self.chance(0.3):
                    keys["damping"] = self.text(self.number(0.01, 0.1))
                self.document["forces"][f"k_{name}"] = {"joint": name, "spring": keys}

    def take_sides(self):
        """A level for each direction, of half of the elements; of some only one has a limit."""
        for name, force in self.document["forces"].items():
            keys = force.get("friction")
            if not keys or self.chance(0.5):
                continue
            word = next(word for word in ("mu", "torque", "force") if word in keys)
            factor = self.number(0.2, 2)
            both = [f"{self.text(factor)}*({keys[word]})", keys[word]]
            for static in ("static", "mu_static"):
                if static in keys:
                    keys[static] = [self.text(factor * float(keys[static])), keys[static]]
            if self.chance(0.15) and "mu" not in keys:
                both[0] = "unlimited"
                if "static" in keys:
                    keys["static"] = keys["static"][1]
            keys[word] = both if self.chance(0.5) else both[::-1]
            for static in ("static", "mu_static"):
                if isinstance(keys.get(static), list) and keys[word] != both:
                    keys[static] = keys[static][::-1]
            self.sided += 1

    def kind_of(self, joint):
        return KINDS[self.random.integers(len(KINDS))]

    def add_friction(self, name):
        joint = list(self.rotates)[self.random.integers(len(self.rotates))]
        kind = self.kind_of(joint)
        self.kinds.append(kind)
        effort = "torque" if self.rotates[joint] else "force"
        level = self.number(0.02, 1.5) * (1 if self.rotates[joint] else 3)
        keys = {effort: self.text(level)}
        if kind == "static":
            keys["static"] = self.text(level * self.number(1.05, 2))
        elif kind == "falling":
            keys[effort] = f"{self.text(level)}*(1 + 0.5/(1 + 3*abs(qd({joint}))))"
        elif kind in ("joint", "loop"):
            keys = {"mu": self.text(self.number(0.05, 0.4))}
            if self.rotates[joint]:
                keys["radius"] = self.text(self.number(0.005, 0.05))
            if kind == "loop":
                loops = list(self.document["loops"])
                keys["reaction"] = loops[self.random.integers(len(loops))]
            if self.chance(0.5):
                keys["mu_static"] = self.text(float(keys["mu"]) * self.number(1.05, 1.5))
        self.document["forces"][name] = {"joint": joint, "friction": keys}
