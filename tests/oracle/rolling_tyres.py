# SPDX-License-Identifier: BSD-3-Clause
"""Wheels with tyres on roads for element_machines: a chain of slides, steering, camber and spin, a flat or a wavy road that may move; a brush, and
the Magic Formula of Pacejka, Tire and Vehicle Dynamics, 2012, 4.E1 to 4.E78, by a property file with random coefficients."""
import math
import pathlib

import numpy as np

from element_mechanics import Wrench
from jointed_bodies import NOTHING, cross, frame, number, turned
from machine_elements import Element, Place, speed_at

BOOK = pathlib.Path(__file__).resolve().parents[2] / "examples/quarter_car_on_tyre/passenger_car_tyre.tir"
MORE = {"PDX3": 0.5, "PEY5": 0.3, "PKY5": 0.2, "RBX3": 0.4, "RBY4": 0.3, "REX1": -0.2, "REX2": 0.1, "REY1": 0.2, "REY2": 0.1, "RHY2": 0.01,
        "QBZ4": 0.2, "QBZ6": 0.3, "QBZ10": 0.1, "QDZ3": 0.2, "QDZ7": 0.001, "QDZ10": 0.1, "QDZ11": 0.05, "QEZ3": 0.1,
        "QSX1": 0.01, "QSX2": 0.2, "QSX3": 0.03, "QSY2": 0.01, "QSY3": 0.002, "QSY4": 0.001, "PHY3": 0.02}
SCALES = ("LMUX", "LMUY", "LKX", "LKY", "LCX", "LCY", "LEX", "LEY", "LHX", "LHY", "LVX", "LVY", "LXAL", "LYKA", "LVYKA", "LTR", "LRES", "LS", "LMX",
          "LVMX", "LMY", "LGAX", "LGAY", "LGAZ", "LKYC", "LKZC", "LFZO", "LSGKP", "LSGAL")


class Coefficients:
    """A property file: its numbers, with zeros for parameters and ones for scales that it has not, and its text."""

    def __init__(self, rng):
        self.sixth = rng.random() < 0.5
        sections, self.value = [], {}
        for line in BOOK.read_text().splitlines():
            line = line.split("!")[0].split("$")[0].strip()
            if line.startswith("["):
                sections.append((line, []))
            elif "=" in line:
                key, text = (part.strip() for part in line.split("=", 1))
                try:
                    value = float(text)
                except ValueError:
                    sections[-1][1].append((key, text))
                    continue
                if key not in ("FITTYP", "USE_MODE", "VXLOW", "LONGVL", "UNLOADED_RADIUS", "FNOMIN") and not key.endswith(("MIN", "MAX")):
                    value *= rng.uniform(0.9, 1.1)
                if key == "FITTYP":
                    value = 61 if self.sixth else 6
                if key == "USE_MODE":
                    value = 4
                sections[-1][1].append((key, repr(int(value)) if key in ("FITTYP", "USE_MODE") else number(value)))
                self.value[key] = value
        more = [(key, x * rng.uniform(-1, 1)) for key, x in MORE.items() if key not in self.value and rng.random() < 0.5]
        if rng.random() < 0.4:
            more += [("DREFF", rng.uniform(0.2, 0.4)), ("BREFF", rng.uniform(4, 9)), ("FREFF", rng.uniform(0.05, 0.15))]
        scales = [(key, rng.uniform(0.8, 1.2)) for key in SCALES if rng.random() < 0.4]
        self.relaxes = rng.random() < 0.5
        if self.relaxes:
            more += [("PTX1", rng.uniform(1.5, 3)), ("PTX2", rng.uniform(0.2, 1)), ("PTX3", rng.uniform(-0.4, 0.4)), ("PTY1", rng.uniform(1.5, 3)), ("PTY2", rng.uniform(1.5, 2.5))]
        for key, x in more + scales:
            self.value[key] = x
        sections += [("[FURTHER]", [(k, number(x)) for k, x in more]), ("[SCALING_COEFFICIENTS]", [(k, number(x)) for k, x in scales])]
        self.text = "\n".join(f"{name}\n" + "\n".join(f"{key} = {text}" for key, text in lines) for name, lines in sections) + "\n"

    def __getattr__(self, name):
        return self.value.get(name, 1.0 if name in SCALES else 0.0)


def wave(c, b, e, x):
    return b * x - e * (b * x - math.atan(b * x)) if c is None else c * math.atan(b * x - e * (b * x - math.atan(b * x)))


def magic(p, mode, by_tangent, load, kappa, tangent, gamma, mu, radius, forwards, speed):
    """(Fx, Fy, Mx, My, Mz) of a tyre that is measured on this side."""
    alpha = math.atan(tangent)
    along, across, both = mode in (1, 3, 4), mode in (2, 3, 4), mode == 4
    sixth = p.sixth
    nominal = p.FNOMIN * p.LFZO
    f = (load - nominal) / nominal
    pure, slip = (tangent if by_tangent else alpha), (tangent if sixth else alpha)
    camber = lambda scale: math.sin(gamma) if sixth else scale * gamma  # noqa: E731
    mux, muy = p.LMUX * mu, p.LMUY * mu
    sign = np.sign
    g = camber(p.LGAX)
    # pure longitudinal
    kx = kappa + (p.PHX1 + p.PHX2 * f) * p.LHX
    dx = (p.PDX1 + p.PDX2 * f) * (1 - p.PDX3 * g * g) * mux * load
    cx = p.PCX1 * p.LCX
    ex = (p.PEX1 + p.PEX2 * f + p.PEX3 * f * f) * (1 - p.PEX4 * sign(kx)) * p.LEX
    stiff_x = load * (p.PKX1 + p.PKX2 * f) * math.exp(p.PKX3 * f) * p.LKX
    pure_x = dx * math.sin(wave(cx, stiff_x / (cx * dx), ex, kx)) + load * (p.PVX1 + p.PVX2 * f) * p.LVX * mux

    def lateral(g):
        m = (p.PDY1 + p.PDY2 * f) * (1 - p.PDY3 * g * g) * muy
        c, d = p.PCY1 * p.LCY, m * load
        k = p.PKY1 * nominal * math.sin(p.PKY4 * math.atan(load / ((p.PKY2 + p.PKY5 * g * g) * nominal))) * (1 - p.PKY3 * abs(g)) * p.LKY
        leans = load * (p.PVY3 + p.PVY4 * f) * g * muy * (p.LKYC if sixth else 1)
        up = load * (p.PVY1 + p.PVY2 * f) * p.LVY * muy + leans
        shift = (p.PHY1 + p.PHY2 * f) * p.LHY
        shift += (load * (p.PKY6 + p.PKY7 * f) * p.LKYC * g - leans) / k if sixth else p.PHY3 * g
        x = pure + shift
        e = (p.PEY1 + p.PEY2 * f) * (1 + p.PEY5 * g * g - (p.PEY3 + p.PEY4 * g) * sign(x)) * p.LEY
        b = k / (c * d)
        return d * math.sin(wave(c, b, e, x)) + up, m, k, shift, up, b, c

    def weight(c, b, e, x, shift):
        return math.cos(wave(c, b, e, x + shift)) / math.cos(wave(c, b, e, shift))

    def weight_y(g):
        b = (p.RBY1 + p.RBY4 * g * g) * math.cos(math.atan(p.RBY2 * (slip - p.RBY3))) * p.LYKA
        return weight(p.RCY1, b, p.REY1 + p.REY2 * f, kappa, p.RHY1 + p.RHY2 * f)

    gy = camber(p.LGAY)
    pure_y, m, stiff_y, shift, up, by, cy = lateral(gy)
    fx, fy, ply = pure_x, pure_y, 0.0
    if both:
        b = (p.RBX1 + p.RBX3 * g * g) * math.cos(math.atan(p.RBX2 * kappa)) * p.LXAL
        fx = pure_x * weight(p.RCX1, b, p.REX1 + p.REX2 * f, slip, p.RHX1)
        ply = m * load * (p.RVY1 + p.RVY2 * f + p.RVY3 * gy) * math.cos(math.atan(p.RVY4 * slip)) * math.sin(p.RVY5 * math.atan(p.RVY6 * kappa)) * p.LVYKA
        fy = pure_y * weight_y(gy) + ply
    fx, fy = fx if along else 0.0, fy if across else 0.0
    # moments
    mx = my = mz = 0.0
    if across:
        gz = camber(p.LGAZ)
        at = slip + p.QHZ1 + p.QHZ2 * f + (p.QHZ3 + p.QHZ4 * f) * gz
        residual = slip + shift + up / stiff_y
        over = stiff_x / stiff_y * kappa if both else 0.0
        bt = (p.QBZ1 + p.QBZ2 * f + p.QBZ3 * f * f) * (1 + p.QBZ4 * gz + p.QBZ5 * abs(gz) + p.QBZ6 * gz * gz) * p.LKY / muy
        dt = load * radius / nominal * (p.QDZ1 + p.QDZ2 * f) * (1 + p.QDZ3 * (abs(gz) if sixth else gz) + p.QDZ4 * gz * gz) * p.LTR
        et = (p.QEZ1 + p.QEZ2 * f + p.QEZ3 * f * f) * (1 + (p.QEZ4 + p.QEZ5 * gz) * 2 / math.pi * math.atan(bt * p.QCZ1 * at))
        trail = dt * math.cos(wave(p.QCZ1, bt, et, math.hypot(at, over))) * math.cos(alpha)
        br = p.QBZ9 * p.LKY / muy + p.QBZ10 * by * cy
        dr = (p.QDZ6 + p.QDZ7 * f) * p.LRES + (p.QDZ8 + p.QDZ9 * f + (p.QDZ10 + p.QDZ11 * f) * abs(gz)) * gz * (p.LKZC if sixth else 1)
        mzr = load * radius * dr * muy * math.cos(alpha) * math.cos(math.atan(br * math.hypot(residual, over)))
        pressed = (weight_y(0.0) if both else 1.0) * lateral(0.0)[0] if sixth else fy - ply
        arm = radius * (p.SSZ1 + p.SSZ2 * fy / nominal + (p.SSZ3 + p.SSZ4 * f) * gz) * p.LS if both else 0.0
        mz = -trail * pressed + mzr + arm * fx
        mx = load * radius * (p.QSX1 * p.LVMX - p.QSX2 * g + p.QSX3 * fy / nominal) * p.LMX
    if along:
        v = speed / p.LONGVL
        my = -load * radius * (p.QSY1 + p.QSY2 * fx / nominal + p.QSY3 * v + p.QSY4 * v**4) * p.LMY * forwards / speed
    return fx, fy, mx, my, mz


class Tyre(Element):
    def __init__(self, machine, name, wheel, road, normal, along, height, made):
        self.machine, self.name, self.wheel, self.road = machine, name, wheel, road
        self.normal, self.along, self.height, self.made = normal, along, height, made
        self.begin = (0.0, 0.0) if made["transient"] else ()
        self.outputs = [f"force({name})"]

    def geometry(self, c, e, o, n, a):
        """Axes of the contact, deflection and arm; of complex vectors, too."""
        up = (c - o) @ n
        if self.height:
            size, k, shift = self.height
            x = (c - o) @ a
            slope = size * k * np.cos(k * x + shift)
            over = 1 / np.sqrt(1 + slope * slope)
            up = over * (up - size * np.sin(k * x + shift))
            n = over * (n - slope * a)
        ahead = cross(e, n)
        upright = np.sqrt(ahead @ ahead)
        ahead = ahead / upright
        r = up / upright
        return ahead, cross(n, ahead), n, self.made["radius"] - r, -r * cross(ahead, e), e @ n

    def look(self):
        made = self.made
        c, axes, w = self.wheel.now()
        o, of_road, wr = self.road.now()
        e, n, a = axes[:, 1], of_road[:, self.normal], of_road[:, self.along]
        self.x, self.y, self.n, rho, arm, lean = self.geometry(c, e, o, n, a)
        body, base = self.wheel.body, self.road.body
        h = 1e-30j
        moved = self.geometry(c + h * speed_at(self.machine, body, c), e + h * cross(w, e), o + h * speed_at(self.machine, base, o),
                              n + h * cross(wr, n), a + h * cross(wr, a))[3]
        self.load = made["stiffness"] * rho + made["damping"] * moved.imag / 1e-30
        self.at = c + arm
        if made["effective"]:
            nominal, d, b, f = made["effective"]
            rho0 = nominal / made["stiffness"]
            effective = made["radius"] - rho0 * (d * math.atan(b * rho / rho0) + f * rho / rho0)
        else:
            effective = made["radius"] - rho / 3
        v, turn = speed_at(self.machine, body, c) - speed_at(self.machine, base, c), w - wr
        self.forwards = v @ self.x
        self.speed = math.hypot(self.forwards, made["low"])
        self.slips = turn @ e * effective - self.forwards, (v + cross(turn, arm)) @ self.y
        self.rho, self.gamma = rho, math.asin(lean)
        self.kappa, self.tangent = self.state if made["transient"] else (s / self.speed for s in self.slips)

    def forces(self):
        """Along the axes of the contact, with moments about its point."""
        made = self.made
        self.look()
        if self.rho <= 0 or self.load <= 0:
            return [0.0] * 6
        if "coefficients" in made:
            side = -1 if made["mirrored"] else 1
            fx, fy, mx, my, mz = magic(made["coefficients"], made["mode"], made["by_tangent"], self.load, self.kappa, side * self.tangent, side * self.gamma,
                                       made["friction"], made["radius"], self.forwards, self.speed) if made["mode"] else (0.0,) * 5
            return [fx, side * fy, self.load, side * mx, my, side * mz]
        most, a = made["friction"] * self.load, made["half"]
        size = math.hypot(self.kappa, self.tangent)
        u = 2 * made["tread"] * a * a / (3 * most) * size / abs(1 + self.kappa)
        f, trail = (most * (3 * u - 3 * u * u + u**3), a * (1 - u) ** 3 / (3 - 3 * u + u * u)) if u < 1 else (most, 0.0)
        fx, fy = (f * self.kappa / size, -f * self.tangent / size) if size else (0.0, 0.0)
        return [fx, fy, self.load, 0.0, -made["resistance"] * self.load * made["radius"] * self.forwards / self.speed, -trail * fy]

    def wrenches(self):
        f = self.forces()
        axes = self.x, self.y, self.n
        force, moment = (sum(x * axis for x, axis in zip(part, axes)) for part in (f[:3], f[3:]))
        return [Wrench(self.wheel.body, self.at, force, moment), Wrench(self.road.body, self.at, -force, -moment)]

    def rates(self):
        if not self.begin:
            return []
        self.look()
        lengths, p = list(self.made["lengths"]), self.made.get("coefficients")
        if lengths[0] is None:
            nominal = p.FNOMIN * p.LFZO
            f = (self.load - nominal) / nominal
            camber = math.sin(self.gamma) if p.sixth else p.LGAY * self.gamma
            radius = self.made["radius"]
            lengths[0] = self.load * radius / p.FNOMIN * (p.PTX1 + p.PTX2 * f) * math.exp(-p.PTX3 * f) * p.LSGKP
            lengths[1] = p.PTY1 * math.sin(2 * math.atan(self.load / (p.PTY2 * nominal))) * (1 - p.PKY3 * abs(camber)) * radius * p.LFZO * p.LSGAL
            lengths = [max(x, 0.02 * radius) for x in lengths]
        return [(s - self.speed * x) / length for s, x, length in zip(self.slips, self.state, lengths)]

    def watched(self):
        def pressed(forces):
            self.look()
            return min(self.load, 1e5 * self.rho)
        return [(0, pressed, ("border", self, 0))]

    def shown(self, forces):
        return self.forces()

    def columns(self, row):
        return [float(row[f"force.{self.name}.{c}"]) for c in ("x", "y", "z", "mx", "my", "mz")]


def road_and_tyre(machine):
    """Bodies, road and tyre of a machine in any direction of space."""
    rng = machine.rng
    axes = frame(rng.normal(size=3), rng.normal(size=3))  # forwards, left, up
    machine.gravity = -axes @ np.array([*rng.uniform(-1, 1, 2), rng.uniform(5, 15)])
    base = rng.uniform(-1, 1, 3)
    along = axes @ turned(np.array([0.0, 0, 1]), rng.uniform(-0.3, 0.3))
    made = {"radius": 0.313, "friction": rng.uniform(0.5, 1.1), "low": rng.uniform(0.3, 2), "transient": rng.random() < 0.4}
    brush = rng.random() < 0.4
    made["stiffness"], made["damping"] = rng.uniform(1.2e5, 2.5e5), rng.uniform(50, 400) if rng.random() < 0.6 else 0.0
    road = None
    if rng.random() < 0.3:  # a road that moves
        road = machine.add(None, base, along, slides=rng.random() < 0.5)
        road.mass, road.inertia = 200.0, 100 * road.inertia
        machine.features.add("moving road")
    # the wheel's centre over the road
    height = (rng.uniform(0.002, 0.01), rng.uniform(5, 15), rng.uniform(-3, 3)) if rng.random() < 0.4 else None
    centre = base + along[:, :2] @ rng.uniform(-0.3, 0.3, 2)
    level = height[0] * math.sin(height[1] * ((centre - base) @ along[:, 0]) + height[2]) if height else 0.0
    centre = centre + along[:, 2] * (level + made["radius"] - rng.uniform(0.012, 0.03))
    chain = []
    for way in (0, 1, 2):
        if rng.random() < 0.85 or way == 0:
            parent = chain[-1] if chain else None
            machine.move()
            x, turn, _, _ = machine.pose(parent)
            chain.append(machine.add(parent, turn.T @ ((centre if not chain else x) - x), turn.T @ frame(axes[:, way], axes[:, way - 1]), slides=True))
    for way in (2, 0, 1):
        if rng.random() < 0.7 or way == 1:
            machine.move()
            x, turn, _, _ = machine.pose(chain[-1])
            now = axes if way != 1 else axes @ turned(np.array([1.0, 0, 0]), rng.uniform(-0.06, 0.06))
            body = machine.add(chain[-1], NOTHING, turn.T @ frame(now[:, way], now[:, way - 1]))
            body.q = 0.0 if way == 1 else rng.uniform(-0.08, 0.08)
            chain.append(body)
    for body in chain:
        body.mass, body.inertia = 15 * body.mass, 120 * body.inertia
        body.com, body.torque = 0.3 * body.com, 5 * body.torque
    wheel = chain[-1]
    wheel.q = rng.uniform(-2, 2)
    machine.move()
    # y of the point's axes is the axle, z of the body
    place = Place(machine, wheel, centre, wheel.R @ np.column_stack([[0.0, 1, 0], [0.0, 0, 1], [1.0, 0, 0]]))
    normal = int(rng.integers(3))
    if normal == 2:
        columns, letters = along, ("z", "x", 0)
    elif normal == 1:
        columns, letters = along[:, [0, 2, 1]] * [1, 1, -1], ("y", "x", 0)
    else:
        columns, letters = along[:, [2, 0, 1]], ("x", "y", 1)
    of_road = Place(machine, road, base, columns)
    friction = rng.uniform(0.7, 1.2) if rng.random() < 0.5 else 1.0
    words = [f"{'at' if height else 'flat'}: {of_road.word}"]
    if letters[0] != "z" or rng.random() < 0.5:
        words.append(f"normal: {letters[0]}")
    if height:
        words.append(f'height: "{number(height[0])}*sin({number(height[1])}*x + ({number(height[2])}))"')
        machine.features.add("road with a height")
        if rng.random() < 0.5:
            words.append(f"along: {letters[1]}")
    if friction != 1:
        words.append(f"friction: {number(friction)}")
    machine.kinds["roads"].append(f"road: {{{', '.join(words)}}}")
    keys = [f"low_speed: {number(made['low'])}", f"friction: {number(made['friction'])}", f"vertical_stiffness: {number(made['stiffness'])}",
            f"vertical_damping: {number(made['damping'])}", f"transient: {'yes' if made['transient'] else 'no'}"]
    made["effective"], made["lengths"] = None, rng.uniform(0.1, 0.5, 2)
    if brush:
        made |= {"tread": rng.uniform(6e6, 15e6), "half": rng.uniform(0.04, 0.07), "resistance": rng.uniform(0, 0.02)}
        keys += ["model: brush", "radius: 0.313", f"tread_stiffness: {number(made['tread'])}", f"half_length: {number(made['half'])}", f"rolling_resistance: {number(made['resistance'])}"]
        machine.features.add("tyre brush")
    else:
        p = made["coefficients"] = Coefficients(rng)
        made |= {"mode": int(rng.choice([0, 1, 2, 3, 4, 4, 4])), "mirrored": rng.random() < 0.5, "by_tangent": p.sixth}
        keys += ["file: tyre.tir", f"side: {'right' if made['mirrored'] else 'left'}", f"mode: {made['mode']}"]
        if rng.random() < 0.3:
            made["by_tangent"] = not made["by_tangent"]
            keys.append(f"slip_angle: {'tangent' if made['by_tangent'] else 'angle'}")
        if p.relaxes and made["transient"]:
            made["lengths"] = None, None
        if p.DREFF or p.FREFF:
            made["effective"] = p.FNOMIN, p.DREFF, p.BREFF, p.FREFF
        machine.files["tyre.tir"] = p.text
        machine.features.add(f"tyre {'MF 6.1' if p.sixth else 'PAC2002'} of mode {made['mode']}")
    if made["transient"]:
        machine.features.add("tyre transient")
        if made["lengths"][0] is not None:
            keys.append(f"longitudinal_relaxation: {number(made['lengths'][0])}, lateral_relaxation: {number(made['lengths'][1])}")
    machine.strikes = True  # short steps: rows are read from the dense output
    machine.kinds["tyres"].append(f"T: {{on: road, at: {place.word}, {', '.join(keys)}}}")
    if machine.fault == "tyre":
        made["stiffness"] *= 1.001
    if machine.fault == "slip":
        made["half"] = made.get("half", 0.0) * 1.01
    made["friction"] *= friction
    machine.elements.append(Tyre(machine, "T", place, of_road, normal, letters[2], height, made))
    # it rolls with some slip
    speed = rng.uniform(5, 20) * rng.choice([1, 1, 1, -1])
    rates = {id(b): rng.uniform(-0.3, 0.3) for b in machine.bodies}
    rates[id(chain[0])], rates[id(wheel)] = speed, speed / (made["radius"] - 0.006) * rng.uniform(0.95, 1.05)
    machine.given = np.array([rates[id(b)] for b in machine.bodies])
