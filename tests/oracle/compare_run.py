# SPDX-License-Identifier: BSD-3-Clause
"""A run of Kempe beside mechanics of the oracle: every row of its table is a state, at which all that it says is worked out
again. A complaint is one sentence; an empty list is agreement."""
import numpy as np

import closure_residuals
from convention import broken
from jets import cross
from mechanics import Motion
from collocated_motion import Integration

ROUNDING = 2.0**-52
# Kempe's rows are solved for to rounding, at states that fit the closures to about 1e-12: what is worked out from them
# may differ by that, times what accelerations make of it. All models have lengths, masses and times around 1.
USUAL = 1e-9
# A larger difference is compared with the condition of the oracle's own linear system: a solution of n unknowns by
# elimination is off by some n roundings times the condition, and so are both.
CONDITIONED = 1e3
# Closures at rows: the run's tolerances are 1e-8 and below, and dae rows fit them to a tolerance.
CLOSED = 3e-8
# If a state is off the closures by h, rows that say the same in other words, and all that follows from them, differ by
# some h: curvatures and rates of all models are around 1.
OPEN = 30
# Ends of runs, in rtol of the run: motions that do not amplify errors keep them within 10 to 1000 times the tolerance
# (docs/theory.md, section 8). The oracle's own error is below 1e-8.
TRAJECTORY, OWN_ERROR = 1e3, 1e-8


class Table:
    """The columns of a CSV of `kempe simulate`."""

    def __init__(self, text):
        lines = [line for line in text.splitlines() if line and not line.startswith("#")]
        self.names = lines[0].split(",")
        self.rows = np.array([[float(x) if x else np.nan for x in line.split(",")] for line in lines[1:]])
        self.at = {name: k for k, name in enumerate(self.names)}

    def __contains__(self, name):
        return name in self.at

    def column(self, name):
        return self.rows[:, self.at[name]]

    def columns(self, start, ends):
        return np.stack([self.column(f"{start}.{end}") for end in ends], -1)

    def multipliers(self):
        found = {}
        for name in self.names:
            if name.startswith("lambda."):
                found.setdefault(name[7:].rpartition(".")[0], []).append(self.column(name))
        return {name: np.stack(columns, -1) for name, columns in found.items()}


def across(v, directions):
    """v (T, 3) without its part in the span of directions (T, 3, k)."""
    return v - (directions @ (np.linalg.pinv(directions) @ v[..., None]))[..., 0]


class Comparison:
    """`same`: a comparison of another table with the same states, whose motion is this one's."""

    def __init__(self, mechanism, table, same=None):
        self.mechanism, self.table, self.complaints, self.worst = mechanism, table, [], 0.0
        names = mechanism.columns
        self.q, self.qd, self.qdd = (table.columns(word, names) for word in ("q", "qd", "qdd"))
        self.states = np.stack([table.column(f"state.{state.name}") for _, state in mechanism.states], -1) if mechanism.states \
            else np.zeros((len(self.q), 0))
        self.motion = same.motion if same else Motion(mechanism, table.column("t"), self.q, self.qd, table.multipliers(),
                                                      states=self.states).solve()
        self.cond = same.cond if same else None

    def run(self):
        self.look_at_conditions()
        self.compare_start()
        self.compare_samples()
        self.compare_closures()
        self.agree("qdd", self.qdd, self.motion.qdd)
        self.compare_multipliers()
        self.compare_reactions()
        self.compare_joint_loads()
        self.compare_points()
        self.compare_forces()
        self.compare_sensors()
        self.compare_energy()
        return self.complaints

    # -- how near is near enough

    def look_at_conditions(self):
        """Rows where a comparison stands within rounding of its border are either side's."""
        for scope, text in self.mechanism.sensors.values():
            self.motion.environment(scope).value(text)
        self.clear = self.motion.near > 1e-7

    def worst_condition(self):
        """The largest of all rows that are clear; of a long table that of each eighth, and of those around the worst."""
        rows = np.nonzero(self.clear)[0]
        if len(rows) > 100:
            worst = 8 * int(np.argmax(self.motion.condition(rows[::8])))
            rows = rows[max(worst - 7, 0):worst + 8]
        return np.max(self.motion.condition(rows), initial=1.0)

    def allowed(self):
        if self.cond is None:
            self.cond = self.worst_condition()
        gap = np.max(np.abs(np.concatenate([self.gaps(), self.motion.hdot], 1)[self.clear]), initial=0.0)
        return min(max(CONDITIONED * ROUNDING * self.cond, OPEN * min(gap, CLOSED)), 1e-3)

    def gaps(self, motion=None):
        motion = motion or self.motion
        h = motion.h.copy()
        for item in motion.items:
            if closure_residuals.floating(item):
                rows = motion.rows[item.name]
                h[:, rows] -= h[:1, rows]
        return h

    def agree(self, name, got, want, size=None, usual=USUAL, conditioned=True):
        got, want = np.asarray(got)[self.clear], np.asarray(want)[self.clear]
        if got.size == 0:
            return
        size = 1.0 + max(np.max(np.abs(want)), np.max(np.abs(size)) if size is not None and np.size(size) else 0.0)
        off = np.max(np.abs(got - want)) / size
        self.worst = max(self.worst, off) if np.isfinite(off) else self.worst
        if not off <= usual and not (conditioned and off <= self.allowed()):
            place = np.unravel_index(np.argmax(np.nan_to_num(np.abs(got - want), nan=np.inf)), got.shape)
            self.complaints.append(f"{name}: {got[place]:.12g} of Kempe, {want[place]:.12g} of the oracle at "
                                   f"{place}, {off:.2g} of {size:.3g}; condition {self.allowed():.1g}")

    # -- what is compared

    def compare_start(self):
        """Held coordinates keep their value, and so do all where the start fits the closures; likewise rates."""
        q, qd = self.given(self.mechanism.start), self.given(self.mechanism.rates)
        held = np.array([any(self.mechanism.places[name] == k for name in self.mechanism.held) for k in range(len(q))], bool)
        start = Motion(self.mechanism, self.motion.t[:1], q[None], qd[None], self.motion.multipliers, states=self.states[:1])
        closed = np.max(np.abs(self.gaps(start)), initial=0.0) < 1e-12
        self.keep("q", self.q, np.where(held | closed, q, self.q[0]))
        if closed and np.max(np.abs(start.hdot), initial=0.0) < 1e-12:
            self.keep("qd", self.qd, qd)

    def start_of_states(self):
        """At the first row, before the samples of the start are taken."""
        return np.array([[state.start for _, state in self.mechanism.states]])

    def compare_samples(self):
        """States at the start. A row at the time of a sample has the values before it, except at the start."""
        states, t = [state for _, state in self.mechanism.states], self.motion.t
        self.motion.state_rates(), self.motion.whens()
        if not states:
            return
        before = self.start_of_states()
        self.keep("states", self.states, self.sampled(0, before)[0])
        step = np.median(np.diff(t)) if len(t) > 1 else np.nan
        rows = [k for k in range(1, len(t) - 1) if abs(t[k + 1] - t[k] - step) < 1e-9]
        for row in rows if any(state.period for state in states) else ():
            due, after = self.due(t[row]), self.sampled(row, self.states[row:row + 1])[0]
            for i, state in enumerate(states):
                if state.period and abs(state.period / step - round(state.period / step)) < 1e-9:
                    got = self.states[row if broken("values before samples") else row + 1, i]
                    want = after[i] if due[i] else self.states[row, i]
                    self.agree(f"sampled state {state.name}", got * np.ones(len(t)), want * np.ones(len(t)), conditioned=False)

    def due(self, t):
        return [bool(state.period) and abs(t / state.period - round(t / state.period)) < 1e-9 for _, state in self.mechanism.states]

    def sampled(self, row, states):
        """States after the samples of a row."""
        at = slice(row, row + 1)
        alone = {name: values[at] for name, values in self.motion.multipliers.items()}
        motion = Motion(self.mechanism, self.motion.t[at], self.q[at], self.qd[at], alone, states=states)
        return motion.next_states(self.due(self.motion.t[row]))

    def keep(self, name, values, want):
        rows = len(values)
        self.agree(f"start of {name}", values[:1].repeat(rows, 0), want[None].repeat(rows, 0), usual=1e-8, conditioned=False)

    def given(self, texts):
        """The values of all coordinates at the start; 0 where none is given."""
        values = np.zeros(len(self.mechanism.columns))
        for name, value in texts.items():
            if name in self.mechanism.places:
                values[self.mechanism.places[name]] = value
        return values

    def compare_closures(self):
        """Kempe's states in maximal coordinates: gaps and their rates."""
        motion = self.motion
        gaps = self.gaps()
        for item in motion.items:
            rows = motion.rows[item.name]
            h = gaps[:, rows]
            self.agree(f"gap of {item.name}", h, 0 * h, usual=CLOSED, conditioned=False)
            self.agree(f"rate of the gap of {item.name}", motion.hdot[:, rows], 0 * h, self.qd, usual=CLOSED,
                       conditioned=False)

    def compare_trajectory(self):
        """The end of the run by the oracle's own integration from Kempe's first row."""
        own = Integration(self.mechanism, self.motion.t[0], self.q[0], self.qd[0], self.states[0])
        own.advance(self.motion.t[-1])
        rtol = float(self.mechanism.document["run"]["rtol"])
        for name, got, want, size in (("q", self.q, own.q, self.qd), ("qd", self.qd, own.qd, self.qd),
                                      ("states", self.states, own.y, self.states)):
            self.agree(f"{name} at the end of the run", got[-1:].repeat(len(got), 0), want[None].repeat(len(got), 0),
                       size, usual=TRAJECTORY * rtol + OWN_ERROR, conditioned=False)

    def axes_of_reactions(self, item):
        """Those of the ground, as columns in ground axes."""
        return self.motion.turn[:, self.mechanism.common(item) if broken("axes of reactions") else -1]

    def determined(self, shares):
        """The components of (T, k, m) shares of multipliers that are the same for all solutions."""
        free = self.motion.dropped
        if free.shape[2] == 0:
            return np.ones(shares.shape[:2], bool)
        size = np.linalg.norm(shares, axis=2) * np.max(np.linalg.norm(free, axis=1), axis=-1)[:, None] + 1e-30
        return np.linalg.norm(shares @ free, axis=2) < 1e-8 * size

    def shares(self, item):
        """Force and moment of a closure on its second body about its second point, in the documented axes, by each
        multiplier: (T, 6, m)."""
        motion, count = self.motion, self.motion.h.shape[1]
        ones = np.tile(np.eye(count), (motion.count, 1, 1))
        whole = motion.wrench(item, ones, 0 if broken("body of reactions") else 1)
        axes = np.swapaxes(self.axes_of_reactions(item), -1, -2)
        return np.concatenate([axes @ whole[:, :3], axes @ whole[:, 3:]], 1)

    def size_of_forces(self):
        return np.concatenate([self.motion.lambdas, self.motion.loads.wrenches, self.motion.loads.efforts], 1)

    def compare_reactions(self):
        effect = np.zeros((self.motion.count, self.motion.n))
        complete = True
        for item in self.motion.items:
            on_points = item.kind in closure_residuals.ROWS
            names = [f"reaction.{item.name}", f"moment.{item.name}"]
            if on_points and all(f"{name}.x" in self.table for name in names):
                got = np.concatenate([self.table.columns(name, "xyz") for name in names], 1)
                self.compare_reaction(item, got)
                effect += self.effect(item, got)
            elif not on_points and item.name in self.motion.multipliers:
                rows = self.motion.rows[item.name]
                effect += np.einsum("tmk,tm->tk", self.motion.by_coordinates[:, rows], self.motion.multipliers[item.name])
                if f"{names[0]}.x" in self.table:
                    got = self.table.columns(names[0], "xyz")
                    want = np.concatenate([self.motion.multipliers[item.name], 0 * got[:, :2]], 1)
                    self.agree(names[0], got, want)
            else:
                complete = False
        if complete:
            want = np.einsum("tmk,tm->tk", self.motion.jacobian, self.motion.lambdas)
            self.agree("efforts of all closures together", effect, want, self.size_of_forces())

    def compare_joint_loads(self):
        """Of joints of the tree: the components that all solutions have."""
        free = self.motion.free_joint_wrenches()
        size = np.concatenate([self.size_of_forces(), self.motion.joint_wrenches], 1)
        for joint in self.mechanism.joints:
            names = [f"reaction.{joint.name}", f"moment.{joint.name}"]
            if joint.name in self.motion.rows or f"{names[1]}.x" not in self.table:
                continue
            got = np.concatenate([self.table.columns(name, "xyz") for name in names], 1)
            known = np.ones(got.shape, bool)
            for k in range(free.shape[2]):
                known &= np.abs(self.joint_load(joint, free[:, :, k])) < 1e-8 * (1e-30 + np.max(np.abs(free[:, :, k]), 1)[:, None])
            want = self.joint_load(joint, self.motion.joint_wrenches)
            self.agree(f"load of joint {joint.name}", np.where(known, got, 0), np.where(known, want, 0), size)

    def joint_load(self, joint, wrenches):
        """Force and moment of a joint's constraint in the axes of the ground, on its second body: the whole wrench without
        its parts along the motions. Those of slides and of rotations act at the place that all its axes pass through."""
        motion, c, p = self.motion, joint.child, joint.parent
        whole = wrenches[:, 6 * c:6 * c + 6]
        moves = -motion.motions[:, 6 * c:6 * c + 6][:, :, joint.coordinates]
        turns = np.array([rotation for rotation, _ in joint.chain], bool)
        begin = motion.r[:, p] + motion.turn[:, p] @ joint.at.place if p >= 0 else np.tile(joint.at.place, (motion.count, 1))
        end = motion.r[:, c] + motion.turn[:, c] @ joint.to.place
        first = turns[-1 if joint.turned else 0]
        on_parent = joint.turned if broken("bodies of loads of joints") else joint.loads_parent
        middle, shown = begin if first else end, begin if on_parent else end
        force, moment = whole[:, :3], whole[:, 3:] - cross(middle - motion.r[:, c], whole[:, :3])
        if not broken("efforts in loads of joints"):
            force, moment = across(force, moves[:, :3, ~turns]), across(moment, moves[:, 3:, turns])
        moment = moment - cross(shown - middle, force)
        return (-1.0 if on_parent else 1.0) * np.concatenate([force, moment], 1)

    def compare_reaction(self, item, got):
        shares = self.shares(item)
        want = (shares @ self.motion.lambdas[..., None])[..., 0]
        known = self.determined(shares)
        self.agree(f"reaction and moment of {item.name}", np.where(known, got, 0), np.where(known, want, 0),
                   self.size_of_forces())

    def effect(self, item, wrench):
        """Efforts on the coordinates that the reported reaction and moment of a closure make."""
        motion, (first, second) = self.motion, item.points
        axes = self.axes_of_reactions(item)
        force, moment = (np.einsum("tij,tj->ti", axes, x) for x in (wrench[:, :3], wrench[:, 3:]))
        total, place = np.zeros((motion.count, 6 * motion.bodies)), motion.point(second.body, second.place)[0]
        for body, sign in ((second.body, 1.0), (first.body, -1.0)):
            if body >= 0:
                b = 6 * body
                total[:, b:b + 3] += sign * force
                total[:, b + 3:b + 6] += sign * (moment + cross(place - motion.r[:, body], force))
        return np.einsum("tkn,tk->tn", motion.columns, total)

    def compare_multipliers(self):
        """Those whose rows the documentation says, where all solutions have the same."""
        for item in self.motion.items:
            got = self.motion.multipliers.get(item.name)
            rows = self.motion.rows[item.name]
            if got is None or got.shape[1] != rows.stop - rows.start:
                continue
            if item.kind == "ball" and f"reaction.{item.name}.x" in self.table:
                force = self.table.columns(f"reaction.{item.name}", "xyz")
                own = np.swapaxes(self.motion.turn[:, self.mechanism.common(item)], -1, -2)
                self.agree(f"lambda of {item.name}", got, (own @ force[..., None])[..., 0])
            if item.kind == "rod":
                got = got * self.motion.lengths(item)[:, None]
            if self.documented(item):
                shares = np.tile(np.eye(self.motion.h.shape[1])[rows], (self.motion.count, 1, 1))
                known = self.determined(shares)
                self.agree(f"lambda of {item.name}", np.where(known, got, 0),
                           np.where(known, self.motion.lambdas[:, rows], 0), self.size_of_forces())

    @staticmethod
    def documented(item):
        """True if docs/model defines a closure's multipliers, beside those of balls."""
        return item.kind in ("rod", "point_on_plane", "point_on_curve", *closure_residuals.ON_COORDINATES)

    def points(self):
        yield from ((f"ground.{name}", -1, place) for name, (place, _) in self.mechanism.ground_points.items())
        for body in self.mechanism.bodies:
            yield from ((f"{body.name}.{name}", body.number, place) for name, (place, _) in body.points.items())

    def compare_points(self):
        axes = [2, 1, 0] if broken("axes of points") else [0, 1, 2]
        for name, body, place in self.points():
            values = None
            for k, word in enumerate(("position", "velocity", "acceleration")):
                if f"{word}.{name}.x" in self.table:
                    values = values or (*self.motion.point(body, place),
                                        self.motion.point_acceleration(body, place, self.motion.accelerations))
                    self.agree(f"{word} of {name}", self.table.columns(f"{word}.{name}", "xyz"), values[k][:, axes])

    def compare_forces(self):
        for name, values in self.motion.loads.outputs.items():
            if values.shape[1] == 6 and f"force.{name}.x" in self.table:
                self.agree(f"force {name}", self.table.columns(f"force.{name}", ("x", "y", "z", "mx", "my", "mz")), values)
            elif f"force.{name}" in self.table:
                self.agree(f"force {name}", self.table.column(f"force.{name}"), values[:, 0])

    def compare_sensors(self):
        for name, (scope, text) in self.mechanism.sensors.items():
            if f"sensor.{name}" in self.table:
                want = self.motion.environment(scope).value(text) + 0 * self.motion.t
                self.agree(f"sensor {name}", self.table.column(f"sensor.{name}"), want)

    def compare_energy(self):
        """The potential's zero is nobody's: its differences are compared."""
        if "energy.kinetic" not in self.table:
            return
        kinetic, potential, total = (self.table.column(f"energy.{w}") for w in ("kinetic", "potential", "total"))
        mine, height = self.motion.kinetic(), self.motion.loads.potential
        self.agree("kinetic energy", kinetic, mine)
        self.agree("potential energy", potential - potential[0], height - height[0], np.concatenate([height, potential]))
        self.agree("total energy", total, kinetic + potential)
