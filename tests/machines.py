#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The comparison of bench/machines/run: planted mistakes in a log and in digits are found."""
import copy
import importlib.machinery
import importlib.util
import pathlib
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("machines_run", str(ROOT / "bench/machines/run"))
machines = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
loader.exec_module(machines)

ROWS = [{"t": "0", "event": "friction 'rub' slips backward"}, {"t": "2", "event": "friction 'rub' sticks", "q.x": "0.5"},
        {"t": "3", "q.x": "-0.25"}]


class Planted:
    """A run that agrees with ROWS."""
    reason = ""

    def __init__(self):
        self.log = [{"t": 0, "kind": "friction", "text": "'rub' slips backward"}, {"t": 1.5, "kind": "event", "text": "something else"},
                    {"t": 2, "kind": "friction", "text": "'rub' sticks"}]
        self.rows = {0.0: {"t": "0", "q.x": "1"}, 2.0: {"t": "2", "q.x": "0.5"}, 3.0: {"t": "3", "q.x": "-0.25"}}


def judge(run, rows=ROWS):
    return machines.case_errors(run, rows, {"friction"}, machines.sizes([run]))


class Comparison(unittest.TestCase):
    def test_same(self):
        self.assertEqual(judge(Planted()), (0, 0))

    def test_late_event(self):
        run = Planted()
        run.log[2]["t"] += 1e-6
        self.assertAlmostEqual(judge(run)[0], 5e-7, delta=1e-12)

    def test_wrong_digit(self):
        run = Planted()
        run.rows[3.0]["q.x"] = "-0.2501"
        self.assertAlmostEqual(judge(run)[1], 1e-4, delta=1e-12)

    def test_wrong_events(self):
        for plant in (lambda log: log.pop(2), lambda log: log.append(copy.copy(log[2])), lambda log: log[2].update(text="'rub' sticks_not"),
                      lambda log: log.reverse()):
            run = Planted()
            plant(run.log)
            self.assertIsInstance(judge(run), str)

    def test_early_end(self):
        run = Planted()
        run.reason = "the step size became too small"
        self.assertIsInstance(judge(run), str)

    def test_refused(self):
        rows = [{"t": "0", "event": "refused 'rub' can neither slip nor stick"}]
        run = Planted()
        self.assertIsInstance(judge(run, rows), str)
        run.reason = "'rub' can neither slip nor stick at t = 0"
        self.assertEqual(judge(run, rows), (None, None))

    def test_missing_column(self):
        run = Planted()
        del run.rows[3.0]
        self.assertIsInstance(judge(run), str)


class Tables(unittest.TestCase):
    def test_models(self):
        """Each table has its model, a case and a time."""
        for problem in machines.problems([]):
            self.assertTrue(problem.model.is_file(), problem.name)
            self.assertTrue(all(float(row["t"]) >= 0 for case in problem.cases.values() for row in case), problem.name)

    def test_regularised(self):
        """Every friction of a model has a speed, or is a law without friction."""
        for name in machines.REGULARISED:
            problem, = machines.problems([name])
            text = machines.regularised(problem.model.read_text(), 1e-6)
            self.assertEqual(text.count("friction: {"), text.count("speed: 1e-06"), name)
            self.assertNotIn("static:", text.replace("{static: 3}", ""), name)


if __name__ == "__main__":
    unittest.main()
