# SPDX-License-Identifier: BSD-3-Clause
"""Equations written for PyTorch: the values of the equations in Python and of the library, derivatives and batches by torch.func.

    python3 tests/generate/torch_functions.py build/dev/kempe

The exit code is 77 where PyTorch is absent: pip install torch numpy (another Python than the first one: KEMPE_TORCH_PYTHON)."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import warnings

try:
    import numpy as np
    import torch
    from torch.func import grad, jacfwd, jacrev, vmap
except ImportError:
    other = os.environ.get("KEMPE_TORCH_PYTHON")
    if other and os.path.abspath(other) != os.path.abspath(sys.executable):
        os.execv(other, [other, *sys.argv])
    print("skipped: PyTorch is not installed (pip install torch numpy, or KEMPE_TORCH_PYTHON)")
    sys.exit(77)

from written import FUNCTIONS, ROOT, Written, command, listed, start_of  # noqa: E402

EQUAL, DERIVATIVES = 1e-12, 1e-9
MODELS = (("examples/four_bar/four_bar.yaml", ()), ("examples/andrews/andrews.yaml", ("--keep-parameters",)),
          ("examples/stewart/stewart.yaml", ("--sets", "M_C,h_J,jdqd")), ("examples/quarter_car/quarter_car.yaml", ("--keep-parameters",)),
          ("examples/cart_pole/cart_pole.yaml", ("--sets", "M_C+jdqd+h_J")))


def tensor(x):
    return torch.as_tensor(np.asarray(x, dtype=float))


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(holder.cleanup)
        cls.folder, cls.made = pathlib.Path(holder.name), {}

    def model(self, name, *options):
        key = (name, *options)
        if key not in self.made:
            path = ROOT / name
            if name == "functions":
                path = self.folder / "functions.yaml"
                path.write_text(FUNCTIONS)
            self.made[key] = Written(self.folder / str(len(self.made)), path, ("torch",), *options)
        return self.made[key]

    def near(self, got, expected, tolerance=EQUAL):
        got, expected = np.asarray(got), np.asarray(expected)
        self.assertEqual(got.shape, expected.shape)
        if expected.size:
            self.assertTrue(np.all(np.isfinite(expected)))
            self.assertLessEqual(np.max(np.abs(got - expected)), tolerance*max(1e-3, np.max(np.abs(expected))))

    def compare(self, written, seed=1, **given):
        """Values of all functions, of one state and of three in a batch."""
        rng = np.random.default_rng(seed)
        for routine in written.routines:
            function = getattr(written.torch, routine)
            arguments = written.arguments(function, rng, **given)
            expected = written.reference(routine, arguments)
            plain = listed(function(*arguments))
            batch = listed(vmap(function)(*(torch.stack([tensor(x)]*3) for x in arguments)))
            for got in plain, [each[1] for each in batch]:
                self.assertEqual(len(got), len(expected))
                for mine, its in zip(got, expected, strict=True):
                    with self.subTest(routine=routine):
                        self.assertEqual(mine.dtype, torch.float64)
                        self.near(mine, its)


class Values(Case):
    def test_examples(self):
        """All sets at random states."""
        self.compare(self.model("examples/four_bar/four_bar.yaml", "--sets", "M_C,invdyn,h_J,h_t,jdqd,qdd,tangents,R"))
        self.compare(self.model("examples/andrews/andrews.yaml", "--keep-parameters"))
        self.compare(self.model("examples/stewart/stewart.yaml", "--sets", "M_C,h_J,jdqd"))
        self.compare(self.model("examples/quarter_car/quarter_car.yaml", "--sets", "M_C,invdyn,tangents", "--keep-parameters"))
        self.compare(self.model("examples/cart_pole/cart_pole.yaml", "--sets", "M_C,invdyn", "--body-inputs"),
                     force=np.arange(6.0), torque=np.arange(6.0) - 3)
        self.compare(self.model("tests/models/contact_slider_crank.yaml", "--sets", "M_C+h_J+jdqd,contact,impact,outputs"),
                     modes=[0.0, 1.0, 0.0, 0.3])

    def test_functions(self):
        """On both sides of all choices, and beyond the ends of tables."""
        written = self.model("functions", "--sets", "M_C,invdyn,tangents")
        for seed in range(3):
            self.compare(written, seed)
        for q in [-1.5, 0.25], [0.7, 2.5], [0.1, -1.0], [0.5, 2.0]:
            self.compare(written, q=np.array(q), qd=np.array([0.4, -q[1]]))


class Derivatives(Case):
    def test_of_q_and_qd(self):
        """Of the inverse dynamics, forwards and backwards: the derivatives that Kempe writes."""
        for name, options in (("examples/four_bar/four_bar.yaml", ()), ("examples/andrews/andrews.yaml", ("--keep-parameters",)),
                              ("functions", ())):
            with self.subTest(name=name):
                written = self.model(name, "--sets", "invdyn,tangents,h_J", *options)
                arguments = [tensor(x) for x in written.arguments(written.torch.invdyn, np.random.default_rng(3))]
                mass, by_q, by_qd = written.reference("tangents", [x.numpy() for x in arguments])
                for way in jacfwd, jacrev:
                    for mine, its in zip(way(written.torch.invdyn, (1, 2, 3))(*arguments), (by_q, by_qd, mass), strict=True):
                        self.near(mine, its, DERIVATIVES)

    def test_of_parameters(self):
        """Of the accelerations, against differences."""
        written = self.model("examples/andrews/andrews.yaml", "--keep-parameters")
        p, (q, qd) = tensor(written.python.parameter_values), map(tensor, start_of(written)[:2])
        got = jacrev(lambda p: written.torch.forward(0.0, q, qd, p)[0])(p)
        for k in range(0, len(p), 5):
            step = 1e-6*abs(p[k])*(torch.arange(len(p)) == k)
            there, back = (written.torch.forward(0.0, q, qd, p + sign*step)[0] for sign in (1, -1))
            self.near((there - back)/(2e-6*abs(p[k])), got[:, k], 1e-5)


class Motion(Case):
    def test_accelerations(self):
        """Those of the library where its run is, in all and in independent coordinates; many at once, and their gradients."""
        for name, options in MODELS:
            with self.subTest(name=name):
                written = self.model(name, *options)
                inputs = [tensor([1.5, 0.0, 0.0])] if "cart_pole" in name else []
                q, qd, qdd, multipliers, t = start_of(written, *(["--input", "u=1.5"] if inputs else []))
                arguments, model = [t, tensor(q), tensor(qd), *inputs], written.torch
                got = model.forward(*arguments)
                self.near(got[0], qdd)
                self.near(got[1], multipliers)
                self.near(model.forward_reduced(*arguments), qdd[model.independent])
                batch = vmap(lambda q, qd, t=t, inputs=inputs, model=model: model.forward(t, q, qd, *inputs)[0])
                rates = torch.stack([k*arguments[2] for k in range(4)])
                found = batch(torch.stack([arguments[1]]*4), rates)
                slopes = vmap(jacrev(lambda qd, q=arguments[1], t=t, inputs=inputs, model=model: model.forward(t, q, qd, *inputs)[0]))(rates)
                work = vmap(grad(lambda qd, q=arguments[1], t=t, inputs=inputs, model=model: model.forward(t, q, qd, *inputs)[0] @ qd.detach()))(rates)
                for k in range(4):
                    self.near(found[k], model.forward(t, arguments[1], rates[k], *inputs)[0])
                    self.near(work[k], rates[k] @ slopes[k], DERIVATIVES)

    def test_closing(self):
        """The closures are met, and the independent coordinates keep their values."""
        for name, options in MODELS[:2]:
            with self.subTest(name=name):
                written = self.model(name, *options)
                q, *_ = start_of(written)
                given = q + 1e-2*np.sin(np.arange(written.n))*np.max(np.abs(q))
                got = written.torch.close(0.0, given).numpy()
                self.assertTrue(np.array_equal(got[written.torch.independent], given[written.torch.independent]))
                self.assertLess(np.max(np.abs(written.reference("h_J", [0.0, got])[0])), 1e-12)


class Pages(Case):
    def test_page(self):
        """The program of docs/generate.md runs."""
        page = (ROOT / "docs/generate.md").read_text()
        blocks = ["\n".join(line[4:] for line in block.strip("\n").split("\n"))
                  for block in re.findall(r"(?:^    .*\n|^\n(?=    ))+", page, re.M)]
        command(0, "generate", ROOT / "examples/four_bar/four_bar.yaml", "--lang", "torch", "--keep-parameters", "-o", self.folder)
        (block,) = (block for block in blocks if block.startswith("import torch"))
        done = subprocess.run([sys.executable, "-c", block], cwd=self.folder, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout, "torch.Size([100, 1, 3])\n")

    def test_refusals(self):
        self.assertIn("torch has no vectorised form",
                      command(3, "generate", ROOT / "examples/four_bar/four_bar.yaml", "--vectorised", "--lang", "torch", "-o", self.folder).stderr)


if __name__ == "__main__":
    warnings.simplefilter("ignore", FutureWarning)  # of PyTorch itself
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
