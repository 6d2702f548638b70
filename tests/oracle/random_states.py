# SPDX-License-Identifier: BSD-3-Clause
"""Random states: pressures, lags, transfer functions, controllers, sampled states, and states of events."""
import numpy as np

from random_choices import Choices


class States(Choices):
    """`state_random`: the stream of what states are, so that models without any are the same with and without them."""

    def add_states(self):
        own, self.random, self.states = self.random, self.state_random, []
        if self.coordinate() and self.chance(0.4):
            for k in range(self.random.integers(1, 4)):
                self.one_of(self.put_rate, self.put_rate, self.put_transfer, self.put_controller, self.put_sampled,
                            self.put_event)(f"y{k + 1}", self.coordinate())
        self.random = own

    def put_state(self, name, feature, keys):
        self.features["state-" + feature] += 1
        self.document["parameters"]["one"] = "1"
        self.document.setdefault("states", {})[name] = keys
        self.states.append(name)

    def start(self):
        return {"start": repr(self.between(-1, 1))} if self.chance(0.7) else {}

    def put_rate(self, name, found):
        self.states.append(name)  # its rate may have it
        law, (a, b, c) = self.law(found), (self.between(0.5, 8), self.between(-1, 1), self.between(-2, 2))
        self.states.pop()
        text = self.one_of(f"one*({law}) - {a}*{name}", f"one*({a}*({b} - {name}) - {c}*{name}*qd({found[0]}))",
                           f"one*({a}*tanh({b} - {name}) + {law})", f"one*({c}*{self.measure()} - {a}*{name})", f"({b}*one - {name})/({a}*20 ms)")
        self.put_state(name, "rate", {**self.start(), "rate": text})

    def put_transfer(self, name, found):
        order, lag = self.random.integers(1, 4), self.between(0.03, 0.3)
        poles = np.round(np.poly([-1 / lag, -3.0 / lag, -2.0][:order]) * self.between(0.2, 2), 6)
        zeros = [self.between(-3, 3) for _ in range(self.random.integers(1, order + 1))]
        self.put_state(name, "transfer", {**self.start(), "transfer": f"one*({self.law(found)})", "numerator": [repr(x) for x in zeros],
                                          "denominator": [repr(float(x)) for x in poles]})

    def put_controller(self, name, found):
        keys = {**self.start(), "pid": f"one*({self.between(-0.5, 0.5)} - q({found[0]}))",
                **{word: repr(self.between(0.5, 10)) for word in ("proportional", "integral")}}
        if self.chance(0.6):
            keys["derivative"] = repr(self.between(0.05, 0.5))
            keys.update({"slope": f"-qd({found[0]})*one"} if self.chance(0.4) else {"filter": f"{self.between(5, 40)} ms"})
        if self.chance(0.5):
            keys["limits"] = [repr(-self.between(0.1, 1.5)), repr(self.between(0.1, 1.5))]
            if self.chance(0.5):
                keys["tracking"] = f"{self.between(0.05, 0.5)} s"
        self.put_state(name, "controller", keys)

    def put_sampled(self, name, found):
        a, b, c = (self.between(-1, 1) for _ in range(3))
        others = "".join(f" + {self.between(-1, 1)}*{other}" for other in self.states)
        text = f"one*({a}*{name} + {b}*q({found[0]}) + {c}*qd({found[0]}) + cos(20*t){others})"
        self.put_state(name, "sampled", {**self.start(), "sample": self.one_of("10 ms", "20 ms", "7 ms"), "next": text})

    def put_event(self, name, found):
        when = f"q({found[0]}) {self.one_of('>', '<')} {self.near(found[0])}"
        self.put_state(name, "event", {**self.start(), "when": when, "next": f"one*({self.between(-1, 1)} - {name} + 0.3*qd({found[0]}))"})
