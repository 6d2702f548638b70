# SPDX-License-Identifier: BSD-3-Clause
"""Random forces, sensors and unknowns, with expressions of time, coordinates, rates and multipliers."""
import numpy as np

from random_choices import Choices


class Laws(Choices):
    def law(self, coordinate, rate=True):
        """An expression of time, coordinates and rates; conditions among them."""
        terms = [self.term(coordinate, rate) for _ in range(self.random.integers(1, 4))]
        self.document["parameters"]["one"] = "1"  # fits any dimension
        return "one*(" + " + ".join(terms) + ")"

    def term(self, coordinate, rate):
        other = (self.coordinate() or coordinate)[0]
        name = coordinate[0]
        a, b, w = self.between(-2, 2), self.between(-0.8, 0.8), self.between(1, 8)
        kinds = ["constant", "swing", "spring", "table", "condition-q", "condition-t", "functions", "more", "signs", "kink"]
        kinds += ["damping", "condition-qd", "sign", "nested"] if rate else []
        if rate and self.states and self.chance(0.4):
            return f"({a})*{self.one_of(*self.states)}" + self.one_of("", f"*cos(q({other}))")
        kind = self.one_of(*kinds)
        if kind.startswith("condition"):
            self.features[kind] += 1
        if kind == "table":
            return f"{a}*{self.table()}(q({other}))"
        if kind in ("sign", "nested"):
            self.features["condition-qd"] += 1
        return {"constant": f"({a})", "swing": f"({a})*cos({w}*t)", "spring": f"({-abs(a)})*(q({name}) - ({b}))",
                "damping": f"({-abs(a)})*qd({name})*abs(q({other}))",
                "condition-q": f"if(q({other}) < {self.near(other)}, {a}, {b}*q({name}))",
                "condition-t": f"if(t {self.one_of('<', '>=')} {self.between(0.01, 0.07)}, {a}, sin(t))",
                "condition-qd": f"if(qd({other}) {self.one_of('>', '<=')} {b}, {a}*q({name}), {b})",
                "sign": f"({a})*sign(qd({other}) + {self.between(0.3, 1.5)})",
                "nested": f"if(q({name}) > {b}, if(qd({other}) < {b}, {a}, 0.5), -0.3*qd({name}))",
                "functions": f"({a})*tanh(q({other}))*exp(-t)/sqrt(1 + q({name})^2) + atan2({b}, 2 + sin(q({other})))",
                "more": f"({a})*(0.1*pow(2 + sin(q({name})), 1.5) + log(2 + q({name})^2) - asin(0.3*sin(q({other})))"
                        f" + acos(0.2*cos(t))"
                        f" + 0.1*sinh(sin(q({name})))*cosh(t) + tan(0.3*sin(q({other}))) + atan(t) + abs(q({name}) - 5))",
                "signs": f"(-2^2 + 2^3^2/256 - 2^-1 + {a}e-1/2/5*-3 - -1)*(q({name}) - 20 deg)",
                "kink": f"max({a}*q({name}), min(0.4, {b}*q({other})))"}[kind]

    def near(self, name):
        """A border that is likely to be passed within the run."""
        k = self.built.places[name]
        column = self.built.columns[k]
        rate = self.rates[column] if abs(self.rates[column]) > 1e-3 else 1.0
        return repr(round(self.q[column] + rate * self.between(0.01, 0.06), 5))

    def table(self):
        kind = self.one_of("spline", "linear", "csv")
        self.features["table-" + kind] += 1
        name, tables = "tab" + kind, self.document.setdefault("tables", {})
        if name not in tables:
            keys = self.spline()
            if kind == "csv":
                text = "time,other,value\n" + "".join(f"{x},0,{y}\n" for x, y in zip(keys["x"], keys["y"]))
                self.files[f"table{self.number}.csv"] = "# a table\n" + text
                (self.folder / f"table{self.number}.csv").write_text(self.files[f"table{self.number}.csv"])
                keys = {"csv": f"table{self.number}.csv", "x": "time", "y": "value"}
            tables[name] = {**keys, **({"method": "linear"} if kind == "linear" else {}), **({"outside": "linear"} if kind != "csv" else {})}
        return name

    def add_forces(self):
        makers = [self.put_effort, self.put_effort, self.put_joint_spring, self.put_stops, self.put_friction, self.put_spring,
                  self.put_bushing, self.put_line, self.put_cylinder, self.put_torsion, self.put_point_force, self.put_body_torque]
        for k in range(self.random.integers(1, 5)):
            self.one_of(*makers)(f"f{k}")

    def numbers(self, **ranges):
        return {key: repr(self.between(*span)) for key, span in ranges.items()}

    def triple(self, low, high):
        """One number for all three axes, or three."""
        return repr(self.between(low, high)) if self.chance(0.3) else [repr(self.between(low, high)) for _ in range(3)]

    def put_force(self, name, feature, keys):
        self.features[feature] += 1
        self.document.setdefault("forces", {})[name] = keys

    def on_coordinate(self):
        found = self.coordinate()
        return (found, "torque" if self.built.rotates[found[1]] else "force") if found else (None, None)

    def put_effort(self, name):
        found, word = self.on_coordinate()
        if found:
            text = self.law(found)
            owner = self.carrying()
            if owner and self.chance(0.6):
                self.features["force-of-lambda"] += 1
                text += f" - one*{self.between(0.02, 0.15)}*abs(lambda({owner}))*tanh(qd({found[0]}))"
            self.put_force(name, word, {"joint": found[0], word: text})

    def carrying(self):
        """A closure whose first multiplier is determined."""
        if self.features["redundant"] or self.linkage:
            return None
        names = [n for n, k in self.document.get("loops", {}).items() if "rod" in k or "ball" in k or "point_on_plane" in k]
        return self.one_of(*names) if names else None

    def put_joint_spring(self, name):
        found, _ = self.on_coordinate()
        if found:
            keys = self.numbers(stiffness=(1, 20), damping=(0, 1), rest=(-0.5, 0.5))
            self.put_force(name, "joint-spring", {"joint": found[0], "spring": keys})

    def put_stops(self, name):
        found, _ = self.on_coordinate()
        if found:
            at = self.value(found)
            keys = self.numbers(stiffness=(10, 100), damping=(0, 3), width=(0.01, 0.1))
            if self.chance(0.7):
                keys["lower"] = repr(round(at - self.between(0, 0.2), 4))
            if self.chance(0.7) or "lower" not in keys:
                keys["upper"] = repr(round(at + self.between(0, 0.2), 4))
            self.put_force(name, "stops", {"joint": found[0], "stops": keys})

    def put_friction(self, name):
        found, word = self.on_coordinate()
        if found:
            keys = self.numbers(**{word: (0.1, 2), "speed": (0.1, 0.5)})
            self.put_force(name, "friction", {"joint": found[0], "friction": keys})

    def two_points(self):
        names = [f"ground.{k}" for k in self.document["ground"]["points"]]
        names += [f"{b}.{k}" for b, keys in self.document["bodies"].items() for k in keys["points"]]
        first = self.one_of(*names)
        others = [n for n in names if n.split(".")[0] != first.split(".")[0]]
        return first, self.one_of(*others)

    def put_spring(self, name):
        ends = self.two_points()
        if np.linalg.norm(self.frame_of(ends[0])[0] - self.frame_of(ends[1])[0]) > 0.15:
            keys = self.numbers(stiffness=(1, 30), damping=(0, 2))
            keys["free_length"] = self.number_text(self.between(0, 1), "m")
            self.put_force(name, "spring", {"spring": list(ends), **keys})

    def apart(self):
        """Two points with a distance; None: they meet."""
        ends = self.two_points()
        return ends if np.linalg.norm(self.frame_of(ends[0])[0] - self.frame_of(ends[1])[0]) > 0.15 else None

    def measure(self):
        """A number by points and axes of any bodies, without a limit of an angle."""
        a, b = self.two_points()
        x, y = self.one_of("x", "y", "z"), self.one_of("x", "y", "z")
        third = "xyz"[("xyz".index(x) + 1) % 3]
        self.features["measure"] += 1
        return self.one_of(f"position({a}).{x}", f"position({a}, {b}).{x}", f"velocity({a}).{x}", f"velocity({a}, {b}).{x}",
                           f"angular_velocity({a}, {b}).{x}", f"axes({a}).{x}.{y}", f"axes({a}, {b}).{x}.{y}",
                           f"sin(angle({a}.{x}, {b}.{x}, {a}.{third}))", f"cos(angle({a}.{x}, {b}.{y}))",
                           f"rate(position({a}, {b}).{x})", f"distance({a}, {b})")

    def put_line(self, name):
        ends = self.apart()
        if ends and self.chance(0.4):
            more = self.two_points()[0]
            if min(np.linalg.norm(self.frame_of(more)[0] - self.frame_of(end)[0]) for end in ends) > 0.15:
                ends = (ends[0], more, ends[1])
                self.features["rope"] += 1
        if ends:
            self.document["parameters"]["one"] = "1"
            a, b, c = self.between(1, 20), self.between(0, 1), self.between(0, 2)
            text = self.one_of(f"{a}*(distance - {b})^3 + {c}*rate", f"max({a}*(distance - {b}), -1) + {c}*rate*abs(rate)", f"{a}",
                               f"{c}*{self.measure()} + {a}*distance")
            self.put_force(name, "line", {"line": list(ends), "force": f"one*({text})" if text != f"{a}" else text})

    def put_cylinder(self, name):
        ends = self.apart()
        if ends:
            self.document["parameters"]["one"] = "1"
            texts = [f"one*({self.between(-300, 900)} {sign} {self.between(10, 300)}*{word}{self.of_states(200)})"
                     for sign, word in (("-", "rate"), ("+", "distance"))]
            keys = {"cylinder": list(ends), "bore": "80 mm", "rod": self.number_text(self.between(0.01, 0.06), "m"), "pressure": texts[0]}
            if self.chance(0.6):
                keys["rod_pressure"] = texts[1]
            self.put_force(name, "cylinder", keys)

    def put_torsion(self, name):
        ends, axis = self.two_points(), self.one_of("x", "y", "z")
        self.document["parameters"]["one"] = "1"
        text = f"one*({self.between(0.5, 5)}*sin(angle) + {self.between(0, 1)}*{self.measure()}{self.of_states(1)})"
        self.put_force(name, "torsion", {"torsion": list(ends), "axis": axis, "torque": text})

    def put_bushing(self, name):
        ends = self.two_points()
        turn = self.frame_of(ends[0])[1].T @ self.frame_of(ends[1])[1]
        if np.trace(turn) > -0.7:
            keys = {"stiffness": self.triple(1, 20), "damping": self.triple(0, 1), "rotational_stiffness": self.triple(1, 10),
                    "rotational_damping": self.triple(0, 0.5), "preload": self.triple(-2, 2)}
            kept = {k: v for k, v in keys.items() if self.chance(0.8)}
            self.put_force(name, "bushing", {"bushing": list(ends), **kept})

    def of_states(self, size):
        """A term to be added, or none."""
        if not self.states:
            return ""
        return f" + {self.between(-size, size)}*{self.one_of(*self.states)}"

    def three_laws(self):
        found = self.coordinate()
        if self.chance(0.3) or not found:
            return self.vector(3.0)
        return [self.law(found) for _ in range(3)]

    def put_point_force(self, name):
        body = self.one_of(*self.document["bodies"])
        point = self.one_of(*self.document["bodies"][body]["points"])
        self.put_force(name, "point-force", {"at": f"{body}.{point}", "force": self.three_laws()})

    def put_body_torque(self, name):
        self.put_force(name, "body-torque", {"on": self.one_of(*self.document["bodies"]), "torque": self.three_laws()})

    def add_unknowns(self):
        found = self.coordinate()
        if found and self.chance(0.15):
            name = found[0]
            self.features["unknown-equations"] += 1
            self.features["unknown-expression"] += 1
            self.document["algebraic"] = {
                "group": {"of": {"aa": "0.1", "bb": "0"},
                          "zero": [f"aa - 0.3*sin(bb) - 0.2*q({name})", f"bb + 0.1*aa^2 - 0.3*cos(qd({name})) - 0.1*t"]},
                "named": f"one*(aa*bb + if(qd({name}) > {self.between(-0.5, 0.5)}, 1, -1)*0.2)"}
            self.document["parameters"]["one"] = "1"
            self.document["sensors"] = {"shown": "aa + 2*bb", "called": "named"}
            word = "torque" if self.built.rotates[found[1]] else "force"
            self.put_force("fu", word, {"joint": name, word: "named - 0.5*aa"})

    def add_sensors(self):
        sensors = self.document.setdefault("sensors", {})
        for k in range(self.random.integers(0, 3)):
            found = self.coordinate()
            if found:
                self.features["sensor"] += 1
                sensors[f"s{k}"] = self.law(found) + f" + 0.1*qd({found[0]}) + {self.measure()}"
        owners = list(self.document.get("loops", {})) + list(self.document.get("drives", {}))
        if owners and not self.linkage and self.chance(0.4):
            self.features["condition-lambda"] += 1
            sensors["load"] = f"if(lambda({self.one_of(*owners)}) > 0.1, 1, lambda({owners[0]}))"
        if not sensors:
            del self.document["sensors"]
