# SPDX-License-Identifier: BSD-3-Clause
"""A model as Kempe reads it (`kempe show FILE --model --json -`), for others: the plain text that the programs here read,
MuJoCo's XML, and Kempe's own language again.

The text has one thing a line:

    gravity X Y Z
    body NAME PARENT PX PY PZ MASS CX CY CZ XX YY ZZ XY XZ YZ K, then K times R|T X Y Z
    closure BODY X Y Z BODY X Y Z                 points that coincide
    rod BODY X Y Z BODY X Y Z LENGTH              points at a constant distance
    spring BODY X Y Z BODY X Y Z STIFFNESS DAMPING FREE_LENGTH
    effort COORDINATE VALUE
    held COORDINATE STIFFNESS DAMPING REST        a spring in a joint
    coupled COORDINATE COORDINATE STIFFNESS DAMPING        a spring between two joints' coordinates
    start Q1 .. QN QD1 .. QDN

PARENT is the number of a body, -1 the ground; P where the first motion begins, in the parent's axes; C the centre of mass,
from the body's origin, the inertia about it. Motions follow each other about and along the axes that the last one has
reached.
"""
import json
import subprocess

KEYS = ("xx", "yy", "zz", "xy", "xz", "yz")


def show(kempe, path, *options):
    done = subprocess.run([kempe, "show", path, "--model", *options, "--json", "-"], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def possible(inertia):
    """Inertias that peers refuse are made possible: of a plane model, which has zz alone, all three are the same, which counts nowhere;
    of some published wheels the largest is cut to the sum of the other two."""
    if inertia["xx"] == inertia["yy"] == 0:
        return {**inertia, "xx": inertia["zz"], "yy": inertia["zz"]}
    moments = sorted(KEYS[:3], key=lambda k: inertia[k])
    least = inertia[moments[0]] + inertia[moments[1]]
    return {**inertia, moments[2]: min(inertia[moments[2]], least)}


def depth_first(bodies):
    """The bodies, each followed by all that it carries: MuJoCo and Drake number coordinates so, whatever the order of a file."""
    children = {}
    for b in bodies:
        children.setdefault(b["parent"], []).append(b)

    found, waiting = [], children.get("ground", [])[::-1]
    while waiting:
        found.append(waiting.pop())
        waiting += children.get(found[-1]["name"], [])[::-1]
    return found


def linear(effort, parameters, coordinates):
    """Coefficients of q and of qd in an effort without a constant, by evaluation."""
    def value(rate, name):
        q, qd = (lambda x: float(not rate and x == name)), (lambda x: float(rate and x == name))
        names = {**parameters, **{x: x for x in coordinates}, "q": q, "qd": qd}
        return eval(effort, {"__builtins__": {}}, names)
    return [{x: value(rate, x) for x in coordinates if value(rate, x)} for rate in (False, True)]


class Tree:
    """gravity; bodies: name, parent, at, mass, com, inertia (by KEYS), motions (kind, axis); closures, springs, efforts, held by
    numbers of bodies; q, qd at the start. Bodies and coordinates are depth first."""

    def __init__(self, shown, loops=True):
        self.name, self.gravity = shown["name"], shown["gravity"]
        ordered = depth_first(shown["bodies"])
        place = {"ground": -1} | {b["name"]: k for k, b in enumerate(ordered)}
        points = {"ground": shown["ground"]["points"]} | {b["name"]: b["points"] for b in shown["bodies"]}
        find = lambda text: (place[text.split(".")[0]], points[text.split(".")[0]][text.split(".")[1]] if "." in text else [0, 0, 0])
        self.bodies = []
        for b in ordered:
            if any(key in b for key in ("to", "frame", "reversed", "pitch")):
                raise SystemExit(f"body {b['name']}: axes of its own are not written for others")
            self.bodies.append({"name": b["name"], "parent": place[b["parent"]], "at": points[b["parent"]][b["at"]] if b["at"] else [0, 0, 0],
                                "mass": b["mass"], "com": b["com"], "inertia": possible(b["inertia"]),
                                "motions": [(m["kind"], m["axis"]) for m in b["motions"]]})
        self.coordinates = [m["coordinate"] for b in ordered for m in b["motions"]]
        self.own = [self.coordinates.index(x) for x in shown["coordinates"]] # where Kempe's coordinates are
        self.n = len(self.coordinates)
        self.closures = [(*find(c["points"][0]), *find(c["points"][1])) for c in shown["closures"] if c["kind"] == "ball"] if loops else []
        self.rods = [(*find(c["points"][0]), *find(c["points"][1]), c["length"]) for c in shown["closures"] if c["kind"] == "rod"] if loops else []
        self.springs, self.efforts, self.held, self.coupled = [], [], [], []
        for f in shown["forces"] if loops else ():
            if f["kind"] == "spring" and "coordinate" in f:
                self.held.append((self.coordinates.index(f["coordinate"]), f["stiffness"], f["damping"], f["rest"]))
            elif f["kind"] == "spring":
                self.springs.append((*find(f["points"][0]), *find(f["points"][1]), f["stiffness"], f["damping"], f["free_length"]))
            elif f["kind"] in ("torque", "force") and "q(" in f["effort"]:
                self.couple(f, shown["parameters"])
            elif f["kind"] in ("torque", "force"):
                self.efforts.append((self.coordinates.index(f["coordinate"]), float(f["effort"])))
            else:
                raise SystemExit(f"force {f['name']}: a {f['kind']} is not written for others")
        self.q, self.qd = [0.0] * self.n, [0.0] * self.n

    def couple(self, force, parameters):
        """One of two efforts of a spring between two coordinates; both together are one entry."""
        own = force["coordinate"]
        stiffness, damping = linear(force["effort"], parameters, self.coordinates)
        other, = (x for x in stiffness if x != own)
        if not stiffness[own] == -stiffness[other] or damping and not damping[own] == -damping[other]:
            raise SystemExit(f"force {force['name']}: no spring between two coordinates")
        a, b = self.coordinates.index(own), self.coordinates.index(other)
        if a < b:
            self.coupled.append((a, b, stiffness[other], damping.get(other, 0.0)))

    def start(self, assembled):
        """Takes the closed start of `kempe assemble --json`."""
        self.q, self.qd = ([assembled[key][x] for x in self.coordinates] for key in ("q", "qd"))

    def text(self):
        put = lambda *x: " ".join(repr(float(v)) for v in x)
        lines = ["gravity " + put(*self.gravity)]
        for k, b in enumerate(self.bodies):
            motions = " ".join(f"{kind} {put(*axis)}" for kind, axis in b["motions"])
            lines.append(f"body b{k} {b['parent']} {put(*b['at'], b['mass'], *b['com'], *(b['inertia'][x] for x in KEYS))} "
                         f"{len(b['motions'])} {motions}")
        lines += [f"closure {a} {put(*p)} {b} {put(*q)}" for a, p, b, q in self.closures]
        lines += [f"rod {a} {put(*p)} {b} {put(*q)} {put(length)}" for a, p, b, q, length in self.rods]
        lines += [f"coupled {a} {b} {put(k, d)}" for a, b, k, d in self.coupled]
        lines += [f"spring {a} {put(*p)} {b} {put(*q)} {put(k, c, l)}" for a, p, b, q, k, c, l in self.springs]
        lines += [f"effort {k} {put(x)}" for k, x in self.efforts]
        lines += [f"held {c} {put(*numbers)}" for c, *numbers in self.held]
        lines.append("start " + put(*self.q, *self.qd))
        return "\n".join(lines) + "\n"

    def yaml(self):
        """The tree alone, as a model of Kempe."""
        bodies, points = {}, {}
        for k, b in enumerate(self.bodies):
            points.setdefault(b["parent"], {})[f"A{k}"] = b["at"]
        for k, b in enumerate(self.bodies):
            at = "ground" if b["parent"] < 0 else f"b{b['parent']}"
            bodies[f"b{k}"] = {"joint": {"at": f"{at}.A{k}", "name": f"j{k}", "motions": [{kind: axis} for kind, axis in b["motions"]]},
                               "mass": b["mass"], "com": b["com"], "inertia": {x: v for x, v in b["inertia"].items() if v} or {"xx": 0},
                               "points": points.get(k, {"O": [0, 0, 0]})}
        return json.dumps({"kempe": 1, "name": "tree", "gravity": self.gravity, "ground": {"points": points[-1]}, "bodies": bodies})

    def is_plane(self):
        """True if every joint turns about z."""
        return all(kind == "R" and not any(axis[:2]) for b in self.bodies for kind, axis in b["motions"])

    def is_free(self, k):
        """True if the joint of a body to the ground is three translations along x, y, z, then three rotations."""
        b = self.bodies[k]
        axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        return (b["parent"] < 0 and [m[0] for m in b["motions"]] == list("TTTRRR") and [m[1] for m in b["motions"][:3]] == axes
                and [m[1] for m in b["motions"][3:]] == axes)

    def mjcf(self, free=False, options=""):
        """MuJoCo's XML: the motions of a body are its joints; free: the first body's six are one free joint. Closures are
        `connect`; a spring is a tendon between sites, a rod another of constant length."""
        put = lambda x: " ".join(repr(float(v)) for v in x)
        children, sites = {}, {}
        for k, b in enumerate(self.bodies):
            children.setdefault(b["parent"], []).append(k)
        for kind, pairs in (("s", self.springs), ("r", self.rods)):
            for k, (a, p, b, q, *_) in enumerate(pairs):
                sites.setdefault(a, []).append((f"{kind}{k}a", p))
                sites.setdefault(b, []).append((f"{kind}{k}b", q))
        number = iter(range(self.n))

        def site(k):
            return [f'<site name="{name}" pos="{put(p)}"/>' for name, p in sites.get(k, [])]

        def body(k):
            b = self.bodies[k]
            lines = [f'<body name="b{k}" pos="{put(b["at"])}">']
            inertia = b["inertia"]
            lines.append(f'<inertial pos="{put(b["com"])}" mass="{b["mass"]!r}" fullinertia="{put(inertia[x] for x in KEYS)}"/>')
            if free and self.is_free(k):
                lines.append("<freejoint/>")
                for _ in range(6):
                    next(number)
            else:
                for kind, axis in b["motions"]:
                    c = next(number)
                    spring = "".join(f' stiffness="{k!r}" damping="{d!r}" springref="{rest!r}"' for own, k, d, rest in self.held if own == c)
                    lines.append(f'<joint name="c{c}" type="{"hinge" if kind == "R" else "slide"}" axis="{put(axis)}"{spring}/>')
            for child in children.get(k, []):
                lines += body(child)
            return [*lines, *site(k), "</body>"]

        lines = [f'<mujoco><compiler angle="radian" autolimits="false" inertiafromgeom="false" boundmass="0" boundinertia="0"/>'
                 f'<option gravity="{put(self.gravity)}" {options}/>', "<worldbody>", *site(-1)]
        for k in children.get(-1, []):
            lines += body(k)
        lines.append("</worldbody>")
        if self.springs or self.rods or self.coupled:
            lines.append("<tendon>")
            for k in range(len(self.rods)):
                lines.append(f'<spatial name="r{k}"><site site="r{k}a"/><site site="r{k}b"/></spatial>')
            for a, b, stiffness, damping in self.coupled:
                lines.append(f'<fixed stiffness="{stiffness!r}" damping="{damping!r}" springlength="0"><joint joint="c{a}" coef="1"/>'
                             f'<joint joint="c{b}" coef="-1"/></fixed>')
            for k, (*_, stiffness, damping, length) in enumerate(self.springs):
                lines.append(f'<spatial stiffness="{stiffness!r}" damping="{damping!r}" springlength="{length!r}">'
                             f'<site site="s{k}a"/><site site="s{k}b"/></spatial>')
            lines.append("</tendon>")
        return "\n".join([*lines, "</mujoco>"])
