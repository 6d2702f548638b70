#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The coach on cones by NumPy, from its own linear equations: loads, vertical modes, eigenvalues, critical speeds over the slope.

    python3 reference_manchester_vehicle.py > reference.csv
    python3 reference_manchester_vehicle.py eigenvalues > eigenvalues.csv
    python3 reference_manchester_vehicle.py vertical                load, vertical modes, loads over a dip
    python3 reference_manchester_vehicle.py contacts FILE           critical speed with contacts of `kempe contact`, one row about y = 0

Seven bodies with six small displacements and rotations each, in the axes of the track. A spring under load turns its force with the
body that it stands on. A wheelset on conical wheels and round rails: its roll follows from its displacement, and its height does not
change. Contacts follow from the geometry of a straight line on a circle to first order: places, normals, rolling radii. Creep forces
are Kalker's linear ones with spin; they depend on the normal forces and on the rolling radii. Hertz's ellipses and Kalker's
coefficients: ../contact_tables.py.
"""
import csv
import math
import pathlib
import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from contact_tables import coefficients, ellipse  # noqa: E402

G = 9.81
CAR, FRAME, AXLE = (32000, (56800, 1.97e6, 1.97e6)), (2615, (1722, 1476, 3067)), (1813, (1120, 112, 1120))
CENTRES, WHEELBASE, HEIGHT = 19.0, 2.56, 0.8275            # HEIGHT: of the secondary springs
CAR_HIGH, FRAME_HIGH, COUPLERS, R0 = 1.8, 0.6, 1.05, 0.46  # centres of mass, couplers, radius of the wheels
PRIMARY_K, PRIMARY_C, PRIMARY_SIDE = (31.391e6, 3.884e6, 1.22e6), (15e3, 2e3, 4e3), 1.0                # of an axle box
SECONDARY_K, SECONDARY_C, SECONDARY_SIDE = (160e3, 160e3, 430e3), (25e3, 32e3, 20e3), 1.0              # of a side of a bogie
BENDING, ANTI_ROLL, DRIVE = 10.5e3, 940e3, 20e3
B, RAIL, SHEAR, POISSON = 0.75, 0.08, 82e9, 0.28           # half the distance of the contacts, radius of the rails
COLUMNS = ("front_lead_y", "y", "angle", "radius", "normal", "spin", "force.y", "moment", "a", "b")  # of a table of contacts
BODIES = 7                                                 # car body, front and rear frame, four wheelsets from the front


def cross(r):
    """The matrix of r x."""
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


class Coach:
    """Mass, damping and stiffness of its bodies without wheels; displacements and rotations of each body one after another."""

    def __init__(self, centres=CENTRES, wheelbase=WHEELBASE, height=HEIGHT, rod=SECONDARY_C[0], drive=DRIVE, viscous=1):
        n = 6 * BODIES
        self.drive = drive
        self.M, self.C, self.K = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
        self.centre = [np.array([0, 0, CAR_HIGH])]
        self.centre += [np.array([way * centres / 2, 0, FRAME_HIGH]) for way in (1, -1)]
        self.centre += [np.array([way * centres / 2 + end * wheelbase / 2, 0, R0]) for way in (1, -1) for end in (1, -1)]
        for k, (mass, inertia) in enumerate((CAR, FRAME, FRAME, AXLE, AXLE, AXLE, AXLE)):
            self.M[6 * k:6 * k + 6, 6 * k:6 * k + 6] = np.diag([mass] * 3 + list(inertia))
        carried = CAR[0] / 2, (CAR[0] / 2 + FRAME[0]) / 2
        for k in (1, 2):
            kx, ky, kz = (2 * s for s in SECONDARY_K)
            cx, cy, cz = (2 * viscous * c for c in (rod, *SECONDARY_C[1:]))
            side = SECONDARY_SIDE**2
            self.spring(0, k, self.centre[k] * (1, 1, 0) + (0, 0, height), -carried[0] * G, (kx, ky, kz), (cx, cy, cz),
                        (kz * side + 2 * BENDING + ANTI_ROLL, 2 * BENDING, kx * side), (cz * side, 0, cx * side))
        for k in (3, 4, 5, 6):
            kx, ky, kz = (2 * s for s in PRIMARY_K)
            cx, cy, cz = (2 * viscous * c for c in PRIMARY_C)
            side = PRIMARY_SIDE**2
            self.spring(1 if k < 5 else 2, k, self.centre[k], -carried[1] * G, (kx, ky, kz), (cx, cy, cz),
                        (kz * side, 0, kx * side), (cz * side, 0, cx * side))
        along = np.array([1, 0, 0, 0, COUPLERS - CAR_HIGH, 0])
        self.C[:6, :6] += drive * np.outer(along, along)

    def spring(self, a, b, place, load, k, c, turn_k, turn_c):
        """Between the bodies a and b: stiffness and damping along and about the axes of a, at a place on b, where `load` acts on b."""
        ra, rb = place - self.centre[a], place - self.centre[b]
        ia, ib = slice(6 * a, 6 * a + 6), slice(6 * b, 6 * b + 6)
        point_a, point_b = np.hstack([np.eye(3), -cross(ra)]), np.hstack([np.eye(3), -cross(rb)])
        turn = np.hstack([np.zeros((3, 3)), np.eye(3)])
        for matrix, along, about in ((self.K, k, turn_k), (self.C, c, turn_c)):
            for i, pi in ((ia, -point_a), (ib, point_b)):
                for j, pj in ((ia, -point_a), (ib, point_b)):
                    matrix[i, j] += pi.T @ np.diag(along) @ pj
            for i, si in ((ia, -1), (ib, 1)):
                for j, sj in ((ia, -1), (ib, 1)):
                    matrix[i, j] += si * sj * turn.T @ np.diag(about) @ turn
        p = np.array([0, 0, load])
        # the force on b turns with a: theta_a x p at rb on b, its opposite at ra on a
        turned = -cross(p) @ turn
        self.K[ib, ia] -= point_b.T @ turned
        self.K[ia, ia] += point_a.T @ turned
        # the place moves: (theta_b x rb) x p on b, -(u_b + theta_b x rb - u_a) x p on a
        arm = cross(p)                                     # -d x p = p x d = cross(p) d
        self.K[ib, ib] += turn.T @ arm @ (-cross(rb)) @ turn
        self.K[ia, ib] -= turn.T @ arm @ point_b
        self.K[ia, ia] += turn.T @ arm @ np.hstack([np.eye(3), np.zeros((3, 3))])


class Contact:
    """Two wheels of an axle on their rails, centred, and what changes with a displacement y of the axle to the left, to first order.

    For y = 1 the left wheel rolls on a radius that is larger by `radius` and touches `inwards` nearer to the axle's middle at an angle
    that is larger by `angle`; the axle rolls by `roll`. `spin_y` is the change of the force of spin across, for what is not a change of
    load."""

    def equilibrium(self, load):
        """Normal force, angle and forces of spin where the wheel carries its load: creep by spin carries a part of it."""
        self.s, self.c = math.sin(self.delta), math.cos(self.delta)
        self.force0, self.moment0 = self.f23 * self.s / self.r, self.f33 * self.s / self.r
        self.out0 = self.force0 * self.c - self.normal * self.s
        assert abs(self.normal * self.c + self.force0 * self.s - load) < 1e-3 * load
        self.load, self.roll = load, self.s / self.c / (self.b - self.r * self.s / self.c)


class Cones(Contact):
    """Conical wheels on round rails, by Hertz and Kalker."""

    def __init__(self, cone, load):
        self.delta, self.b, self.r = math.atan(cone), B, R0
        s, c = math.sin(self.delta), math.cos(self.delta)
        self.normal = load / c
        for _ in range(50):
            self.normal = (load - self.coefficients(self.normal, R0, c)[2] * s * s / R0) / c
        self.f11, self.f22, self.f23, self.f33 = self.coefficients(self.normal, R0, c)
        self.equilibrium(load)
        h = 1e-20
        by_load, by_radius = self.coefficients(self.normal + h * 1j, R0, c), self.coefficients(self.normal, R0 + h * 1j, c)
        self.by_load = [x.imag / h / x.real for x in by_load[2:]]
        # a straight line on a circle: the normal turns with the axle
        self.radius, self.inwards, self.angle = self.roll * (B + RAIL * s), 1 + RAIL * c * self.roll, self.roll
        turned = c * (self.angle - self.roll) / R0
        self.spin_y = self.f23 * turned + self.force0 * self.radius * by_radius[2].imag / h / by_radius[2].real
        self.moment_y = self.f33 * turned + self.moment0 * self.radius * by_radius[3].imag / h / by_radius[3].real

    @staticmethod
    def coefficients(normal, radius, c):
        a, b, _ = ellipse(c / radius + 0 * normal, 1 / RAIL + 0 * normal, normal + 0 * radius, SHEAR / (1 - POISSON))
        c11, c22, c23, c33 = coefficients(a, b, POISSON)
        area = a * b
        return SHEAR * area * c11, SHEAR * area * c22, SHEAR * area**1.5 * c23, SHEAR * area**2 * c33


class Table(Contact):
    """Contacts of `kempe contact`: a row of the left wheel at y = 0, and one of each sign of a small y."""

    def __init__(self, rows, load):
        low, row, high = ({key: float(x) for key, x in r.items() if key in COLUMNS} for r in rows)
        slope = lambda key: (high[key] - low[key]) / (high["front_lead_y"] - low["front_lead_y"])
        self.delta, self.b, self.r, self.normal = row["angle"], row["y"], row["radius"], row["normal"]
        area = row["a"] * row["b"]
        c11, c22 = coefficients(row["a"], row["b"], POISSON)[:2]
        self.f11, self.f22 = SHEAR * area * c11, SHEAR * area * c22
        self.f23, self.f33 = -row["force.y"] / row["spin"], -row["moment"] / row["spin"]
        self.equilibrium(load)
        self.by_load = 1 / self.normal, 4 / (3 * self.normal)
        self.radius, self.inwards, self.angle = slope("radius"), 1 - slope("y"), slope("angle")
        self.spin_y = slope("force.y") - self.force0 * slope("normal") / self.normal
        self.moment_y = slope("moment") - self.moment0 * slope("normal") * self.by_load[1]


def running(coach, contact, speed):
    """M, C, K of the coach on its wheels, in coordinates that the contacts leave free."""
    M, C, K = coach.M.copy(), coach.C.copy(), coach.K.copy()
    t, n = contact, 6 * BODIES
    s, c, b, r = t.s, t.c, t.b, t.r
    v = speed - 8 * t.moment0 * s / r / coach.drive         # spin about inclined normals takes force from the drive
    omega = v / r
    rows, columns = np.zeros((8, n)), np.zeros((n, 8))
    for k in range(4):
        x, y, z, roll, spin, yaw = range(6 * (3 + k), 6 * (3 + k) + 6)
        # gyroscopic moments of the rotating wheelset
        C[roll, yaw] -= AXLE[1][1] * omega
        C[yaw, roll] += AXLE[1][1] * omega
        # forwards: both wheels slip alike by x' - r w, and oppositely by omega radius y + b yaw'
        for i, arm_i in ((x, 1), (spin, -r)):
            for j, arm_j in ((x, 1), (spin, -r)):
                C[i, j] += 2 * t.f11 / v * arm_i * arm_j
        K[yaw, y] += 2 * b * t.f11 * t.radius / r
        C[yaw, yaw] += 2 * b * b * t.f11 / v
        # changes of the force across, tau, and of the moment about the normal, mu, as rows over displacements and rates
        tau_k, tau_c, mu_k, mu_c = (np.zeros(n) for _ in range(4))
        turn = (c - s * b / r) / v                         # the spin creepage of yaw', which also changes the wheel's own speed
        slip = {y: 1 / (c * v), roll: r / (c * v)}
        for j, part in slip.items():
            tau_c[j], mu_c[j] = -t.f22 * part, t.f23 * part
        tau_k[yaw], mu_k[yaw] = t.f22 / c, -t.f23 / c
        tau_c[yaw], mu_c[yaw] = -t.f23 * turn, -t.f33 * turn
        tau_k[y], mu_k[y] = t.spin_y, t.moment_y
        tau_n, mu_n = t.force0 * t.by_load[0], t.moment0 * t.by_load[1]  # by the change nu of the left normal force, -nu of the right one
        nu, lift, arm = 2 * k, 2 * k + 1, b * s + r * c
        # across: -2 load angle y - 2 nu s + 2 tau c
        K[y, y] += 2 * t.load * t.angle
        K[y] -= 2 * c * tau_k
        C[y] -= 2 * c * tau_c
        columns[y, nu] = -2 * s + 2 * c * tau_n
        # roll: forces of the place moved inwards and up, and of turned normals
        K[roll, y] += 2 * t.load * (t.inwards + r * t.angle) - 2 * t.out0 * (b * t.angle + t.radius)
        K[roll, roll] += 2 * t.out0 * b
        K[roll] -= 2 * arm * tau_k
        C[roll] -= 2 * arm * tau_c
        columns[roll, nu] = 2 * b * c - 2 * r * s + 2 * arm * tau_n
        # yaw: the places of contact move forwards and backwards
        K[yaw, yaw] += 2 * (b - r * s / c) * t.out0
        K[yaw, y] += 2 * t.moment0 * s * t.angle
        K[yaw] -= 2 * c * mu_k
        C[yaw] -= 2 * c * mu_c
        columns[yaw, nu] = 2 * c * mu_n
        columns[z, lift] = 1
        rows[nu, roll], rows[nu, y] = 1, -t.roll
        rows[lift, z] = 1
    right, left = null_space(rows), null_space(columns.T)
    return [left.T @ matrix @ right for matrix in (M, C, K)]


def eigenvalues(coach, contact, speed):
    M, C, K = running(coach, contact, speed)
    n, inverse = len(M), np.linalg.inv(M)
    return np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]]))


def critical(coach, contact, low=20.0, high=200.0):
    """The lowest speed at which a mode begins to grow, and its frequency in rad/s."""
    fastest = lambda v: max((s for s in eigenvalues(coach, contact, v) if s.imag > 1), key=lambda s: s.real)
    speeds = np.arange(low, high, 2.5)
    above = next(v for v in speeds if fastest(v).real > 0)
    speed = brentq(lambda v: fastest(v).real, above - 2.5, above, xtol=1e-10)
    return speed, fastest(speed).imag


def variants():
    """(cone, height, rod) of the table of critical speeds: all slopes with the data of the model, three with others."""
    yield from ((k / 20, HEIGHT, SECONDARY_C[0]) for k in range(1, 9))
    yield from ((k / 10, height, rod) for height, rod in ((0.525, SECONDARY_C[0]), (HEIGHT, 0.0)) for k in (1, 2, 3))


def wheel_load():
    return (CAR[0] + 2 * FRAME[0] + 4 * AXLE[0]) * G / 8


def read_contact(path):
    """The contacts of the first axle from a table of `kempe contact` over `front_lead_y`."""
    with open(path, newline="") as file:
        table = [row for row in csv.DictReader(line for line in file if line[0] != "#") if row["wheel"] == "L1" and float(row["normal"]) > 0]
    nearest = sorted(table, key=lambda row: abs(float(row["front_lead_y"])))[:3]
    return Table(sorted(nearest, key=lambda row: float(row["front_lead_y"])), wheel_load())


# -- vertical motion --------------------------------------------------------------------------------------------------------------


def vertical():
    """Frequencies, Hz, of the vertical motion alone, without dampers: bounce and pitch of the car body, of the frames in phase and against
    each other, pitch of a frame. Springs are vertical, wheels stay where they are."""
    k1, k2, a, mass = 4 * PRIMARY_K[2], 2 * SECONDARY_K[2], CENTRES / 2, 2 * FRAME[0]
    pair = lambda m, arm: np.sqrt(eigh([[2 * k2 * arm**2, -2 * k2 * arm], [-2 * k2 * arm, 2 * (k1 + k2)]], np.diag([m, mass]),
                                       eigvals_only=True)) / (2 * math.pi)
    (bounce, frames), (pitch, against) = pair(CAR[0], 1.0), pair(CAR[1][1], a)
    return {"bounce": bounce, "pitch": pitch, "frames": frames, "frames against each other": against,
            "pitch of a frame": math.sqrt(k1 * (WHEELBASE / 2) ** 2 / FRAME[1][1]) / (2 * math.pi)}


def over_dip(depth, speed=45.0):
    """Smallest load over the static one of the wheels of each axle, where both rails dip as in manchester_vehicle_faults.yaml."""
    points = [-60, 0, 20, 30, *(40 + 0.375 * k for k in range(-10, 19)), 50, 60, 80, 150]
    rail = CubicSpline(points, [-depth * (1 - math.cos(2 * math.pi * (x - 40) / 3)) / 2 if 40 < x < 43 else 0.0 for x in points])
    return over(rail, np.arange(0, 2.0, 5e-4), speed).min(axis=0)


def over_recorded(times, begin=12.0, speed=45.0):
    """Loads over the static one of each axle on the level of recorded_track.csv, which begins at this place."""
    with (pathlib.Path(__file__).parent / "recorded_track.csv").open() as file:
        record = list(csv.DictReader(line for line in file if not line.startswith("#")))
    way, level = (np.array([float(row[name]) for row in record]) for name in ("s", "level"))
    rail = CubicSpline(np.concatenate([[-80, -40, -20], way, way[-1] + [20, 40, 80]]) + begin, np.pad(level / 1000, 3))
    return over(rail, times, speed)


def over(rail, times, speed):
    """Loads over the static one of the wheels of each axle at `times`, mean of left and right, by linear springs and dampers: wheels follow
    a level over the way, and roll without slip."""
    coach, axles = Coach(), range(3, 7)
    M, C, K = coach.M.copy(), coach.C, coach.K
    free = [6 * k + j for k in range(3) for j in (0, 2, 4)] + [6 * k for k in axles]
    led = [6 * k + 2 for k in axles]
    for k in axles:
        M[6 * k, 6 * k] += AXLE[1][1] / R0**2              # of its rotation
    m, c, k = (matrix[np.ix_(free, free)] for matrix in (M, C, K))
    c_led, k_led = C[np.ix_(free, led)], K[np.ix_(free, led)]
    places = np.array([coach.centre[k][0] for k in axles])
    lead = lambda t: [rail(places + speed * t, n) * speed**n for n in range(3)]

    def rates(t, u):
        w, wd, _ = lead(t)
        return np.concatenate([u[13:], np.linalg.solve(m, -c @ u[13:] - k @ u[:13] - c_led @ wd - k_led @ w)])

    found = solve_ivp(rates, (0, times[-1]), np.zeros(26), rtol=1e-8, atol=1e-10, max_step=2e-3, t_eval=times).y
    change = np.empty((len(times), 4))
    for i, t in enumerate(times):
        w, wd, wdd = lead(t)
        u, ud = found[:13, i], found[13:, i]
        change[i] = (AXLE[0] * wdd + C[np.ix_(led, free)] @ ud + K[np.ix_(led, free)] @ u + C[np.ix_(led, led)] @ wd
                     + K[np.ix_(led, led)] @ w) / 2
    return 1 + change / wheel_load()


if __name__ == "__main__":
    if sys.argv[1:] == ["eigenvalues"]:
        print("# Eigenvalues of the coach on cones of slope 0.1 at 40 m/s, 1/s, by reference_manchester_vehicle.py: zeros are left out.")
        print("re,im")
        for s in sorted((s for s in eigenvalues(Coach(), Cones(0.1, wheel_load()), 40.0) if s.imag > -1e-9 and abs(s) > 1e-3), key=abs):
            print(f"{s.real:.8g},{max(s.imag, 0.0):.8g}")
    elif sys.argv[1:] == ["vertical"]:
        print(f"static wheel load {wheel_load():.2f} N")
        for name, frequency in vertical().items():
            print(f"{name} {frequency:.6f} Hz")
        print("smallest loads over a dip of 3 mm:", *(f"{x:.4f}" for x in over_dip(3e-3)))
    elif sys.argv[1:2] == ["contacts"]:
        contact = read_contact(sys.argv[2])
        print("critical speed %.6g m/s, %.6g rad/s" % critical(Coach(), contact))
        print(f"conicity {contact.radius:.4f}, angle {contact.angle:.4g} rad/m, angle in the middle {contact.delta:.5f} rad")
    else:
        print("# Critical speeds of the coach on cones, m/s, and frequencies there, rad/s, by reference_manchester_vehicle.py; height of the")
        print("# secondary springs, m, and damping along of one side, N s/m.")
        print("cone,height,rod,speed,rate")
        for cone, height, rod in variants():
            speed, rate = critical(Coach(height=height, rod=rod), Cones(cone, wheel_load()))
            print(f"{cone:g},{height:g},{rod:g},{speed:.9g},{rate:.9g}")
