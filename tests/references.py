#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The comparison of examples/references/run: a planted mistake is found, a digit beyond doubles is none."""
import importlib.machinery
import importlib.util
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("references_run", str(ROOT / "examples/references/run"))
run = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
loader.exec_module(run)

TABLE = "# of nobody\nt,q.a,q.b\n0.5,1.2345678901234567,\n1,-250.25,1e-31\n"


def compare(made, committed=TABLE):
    with tempfile.TemporaryDirectory() as folder:
        old, new = pathlib.Path(folder, "old"), pathlib.Path(folder, "new")
        old.write_text(committed)
        new.write_text(made)
        return run.compare(old, new)


class Comparison(unittest.TestCase):
    def test_same(self):
        self.assertEqual(compare(TABLE), (17, []))

    def test_more_columns_and_rows(self):
        """A table that says more is compared where the committed one has digits."""
        self.assertEqual(compare("t,q.b,q.a,q.c\n0.50,3,1.23456789012345670,4\n0.7,0,0,0\n1,0,-250.250000,7\n")[1], [])

    def test_beyond_doubles(self):
        digits, said = compare(TABLE.replace("4567,", "4573,"))
        self.assertEqual(said, [])
        self.assertLess(digits, 16)

    def test_wrong_digit(self):
        for made in (TABLE.replace("890123", "890124"), TABLE.replace("-250.25", "-250.28"), TABLE.replace("-250.25", "nan"),
                     TABLE.replace("1e-31", "1e-3")):
            self.assertEqual(len(compare(made)[1]), 1, made)

    def test_claim(self):
        """Of a head that says how far two runs agree."""
        said = TABLE.replace("of nobody", "by reference.py; two step sizes agree to 2e-9, q.b to\n# more")
        self.assertEqual(compare(said.replace("890123", "891123"), said)[1], [])
        self.assertEqual(len(compare(said.replace("890123", "990123"), said)[1]), 1)

    def test_missing(self):
        self.assertEqual(compare(TABLE.replace("q.b", "q.x"))[1], ["no column q.b"])
        self.assertEqual(compare(TABLE.replace("\n1,", "\n2,"))[1], ["no row t = 1"])


class Programs(unittest.TestCase):
    def test_every_table_has_one(self):
        found = list(run.jobs())
        self.assertEqual(list(run.sources(found)), [])
        self.assertEqual(run.QUICK - {job.program.parent.name for job in found}, set())

    def test_table_without_program(self):
        found = [job for job in run.jobs() if job.name != "stewart/reference.csv"]
        self.assertEqual(list(run.sources(found)), ["stewart/reference.csv: no program says that it writes it"])


if __name__ == "__main__":
    unittest.main()
