# SPDX-License-Identifier: BSD-3-Clause
"""Random boxes over a floor."""
import numpy as np


class Struck:
    """One to three boxes over a floor, alone or on each other's corners by pins, that strike it with friction."""

    def __init__(self, seed, number, _=True):
        r = np.random.default_rng([seed, number, 7])
        bodies, contacts, start, rates, at = {}, {}, {}, {}, "ground"
        for k in range(int(r.integers(1, 4))):
            w, h, m = (float(x) for x in (r.uniform(0.1, 0.3), r.uniform(0.1, 0.3), r.uniform(0.5, 3)))
            corner = {"A": [repr(-w), repr(-h), "0"], "B": [repr(w), repr(-h), "0"], "C": [repr(w), repr(h), "0"], "D": [repr(-w), repr(h), "0"]}
            joint = {"name": f"j{k}", "planar": "z", "at": "ground"} if k == 0 or r.random() < 0.4 else {"name": f"j{k}", "revolute": "z", "at": at}
            bodies[f"b{k}"] = {"joint": joint, "mass": repr(m), "inertia": {"zz": repr(m * (w * w + h * h) / 3)}, "points": corner}
            for c in "ABCD":
                if r.random() < 0.7:
                    contacts[f"c{k}{c}"] = {"point": f"b{k}.{c}", "on": {"plane": "ground.O", "normal": "y"},
                                            "restitution": repr(float(r.choice([0.0, 0.2, 0.6]))), "friction": repr(float(r.uniform(0.1, 0.8)))}
            at = f"b{k}.C"
            if "planar" in joint:
                start |= {f"j{k}.1": repr(2.0 * k), f"j{k}.2": repr(float(r.uniform(1.2, 1.6))), f"j{k}.3": repr(float(r.uniform(-1, 1)))}
                rates |= {f"j{k}.1": repr(float(r.uniform(-2, 2))), f"j{k}.3": repr(float(r.uniform(-3, 3)))}
            else:
                start[f"j{k}"] = repr(float(r.uniform(-1, 1)))
        self.document = {"kempe": 1, "gravity": ["0", "-9.81", "0"], "ground": {"points": {"O": ["0", "0", "0"]}}, "bodies": bodies,
                         "contacts": contacts, "start": {"q": start, "qd": rates}, "run": {"outputs": ["q"]}}
