# SPDX-License-Identifier: BSD-3-Clause
"""The tables of this folder as the programs beside it write them.

A row has the parameters that are set (`set`), a time, an event or nothing, and the state there or nothing. An event is the kind
and the beginning of the text of an entry in a run's log; `refused` is a run that must fail, with the beginning of its reason.
"""
from mpmath import mp


class Table:
    def __init__(self, model, *columns, how="closed form, 40 digits", atol=None):
        self.set, self.columns = "", columns
        print(f"# {how}\n# model: tests/models/{model}.yaml" if model else f"# {how}")
        if atol:
            print(f"# atol: {atol}")
        print(",".join(("set", "t", "event", *columns)))

    def row(self, t, event, values):
        values = [*values, *[None] * (len(self.columns) - len(values))]
        texts = ["" if x is None else mp.nstr(mp.mpf(x), 19, min_fixed=-5, max_fixed=19) for x in (t, *values)]
        print(",".join((self.set, texts[0], event, *texts[1:])))

    def event(self, t, event, *state):
        self.row(t, event, state)

    def state(self, t, *state):
        self.row(t, "", state)

    def end(self, t):
        """A run up to t, whose state is not known."""
        self.row(t, "", ())

    def refused(self, reason, t=0):
        self.row(t, f"refused {reason}", ())
