# SPDX-License-Identifier: BSD-3-Clause
"""Equations written for JAX and CasADi: the values and derivatives of the equations in Python and of the library.

    python3 tests/generate/jax_and_casadi.py build/dev/kempe

The exit code is 77 where JAX or CasADi is absent: pip install jax casadi (another Python than the first one:
KEMPE_OPTIMISER_PYTHON)."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
if "KEMPE_FULL" not in os.environ:  # JAX compiles in a quarter of the time without optimisation and without emitters of fusions
    os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=0 --xla_llvm_disable_expensive_passes=true --xla_cpu_use_fusion_emitters=false")

try:
    import casadi
    import jax
    import jax.numpy as jnp
    import numpy as np
except ImportError:
    other = os.environ.get("KEMPE_OPTIMISER_PYTHON")
    if other and os.path.abspath(other) != os.path.abspath(sys.executable):
        os.environ["KEMPE_FIRST_PYTHON"] = sys.executable  # which has what Kempe's package needs
        os.execv(other, [other, *sys.argv])
    print("skipped: JAX or CasADi is not installed (pip install jax casadi, or KEMPE_OPTIMISER_PYTHON)")
    sys.exit(77)

from written import FUNCTIONS, KEMPE, Written, command, listed, start_of  # noqa: E402

jax.config.update("jax_enable_x64", True)
EQUAL, DERIVATIVES = 1e-12, 1e-9

def array(x):
    return x.full() if isinstance(x, casadi.DM) else np.asarray(x)


def symbolic(function, arguments, kind=casadi.SX):
    symbols = [kind.sym(f"x{k}", int(np.size(x))) for k, x in enumerate(arguments)]
    return symbols, listed(function(*symbols))


def evaluated(function, arguments):
    symbols, results = symbolic(function, arguments)
    return listed(casadi.Function("f", symbols, results)(*arguments))


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.holder = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.holder.name)
        cls.addClassCleanup(cls.holder.cleanup)
        cls.made = {}

    def model(self, name, *options):
        key = (name, *options)
        if key not in self.made:
            path = ROOT / name
            if name == "functions":
                path = self.folder / "functions.yaml"
                path.write_text(FUNCTIONS)
            self.made[key] = Written(self.folder / str(len(self.made)), path, ("jax", "casadi"), *options)
        return self.made[key]

    def near(self, got, expected, tolerance=EQUAL):
        got, expected = array(got), np.asarray(expected)
        self.assertEqual(got.size, expected.size)
        if expected.size:
            self.assertTrue(np.all(np.isfinite(expected)))
            wrong = np.max(np.abs(got.reshape(expected.shape) - expected))
            self.assertLessEqual(wrong, tolerance*max(1e-3, np.max(np.abs(expected))))

    def compare(self, written, seed=1, **given):
        rng = np.random.default_rng(seed)
        for routine in written.routines:
            function = getattr(written.jax, routine)
            arguments = written.arguments(function, rng, **given)
            expected = written.reference(routine, arguments)
            results = listed(jax.jit(function)(*arguments)), evaluated(getattr(written.casadi, routine), arguments)
            for got in results:
                self.assertEqual(len(got), len(expected))
                for mine, its in zip(got, expected, strict=True):
                    with self.subTest(routine=routine, package=type(mine)):
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

    def test_modes(self):
        """Friction and contacts, in the modes that the caller gives."""
        written = self.model("tests/models/contact_oblique.yaml", "--sets", "M_C,h_J,jdqd,contact,impact")
        entries = written.python.mode_entries*written.python.elements
        for seed in range(2):
            modes = np.random.default_rng(seed).integers(0, 2, entries).astype(float)
            self.compare(written, seed, modes=modes)

    def test_numbers_themselves(self):
        """CasADi's DM, and lists, without a function of CasADi."""
        written = self.model("examples/four_bar/four_bar.yaml")
        q, qd = [0.4, 0.5, 0.6], [1.0, 2.0, 3.0]
        for got in written.casadi.M_C(0.0, q, qd), written.casadi.M_C(0.0, casadi.DM(q), np.array(qd)), written.jax.M_C(0, q, qd):
            for mine, its in zip(got, written.reference("M_C", [0.0, q, qd]), strict=True):
                self.near(mine, its)


class Derivatives(Case):
    def test_of_q_and_qd(self):
        """Of the inverse dynamics: the derivatives that Kempe writes."""
        for name, options in (("examples/four_bar/four_bar.yaml", ()), ("examples/andrews/andrews.yaml", ("--keep-parameters",)),
                              ("functions", ())):
            with self.subTest(name=name):
                written = self.model(name, "--sets", "invdyn,tangents,h_J", *options)
                arguments = written.arguments(written.jax.invdyn, np.random.default_rng(3))
                mass, by_q, by_qd = written.reference("tangents", arguments)
                expected = by_q, by_qd, mass
                results = jax.jit(jax.jacfwd(written.jax.invdyn, (1, 2, 3)))(*arguments)
                reverse = jax.jit(jax.jacrev(written.jax.invdyn, (1, 2, 3)))(*arguments)
                symbols, (efforts,) = symbolic(written.casadi.invdyn, arguments)
                traced = casadi.Function("f", symbols, [casadi.jacobian(efforts, x) for x in symbols[1:4]])(*arguments)
                for got in results, reverse, traced:
                    for mine, its in zip(got, expected, strict=True):
                        self.near(mine, its, DERIVATIVES)

    def test_of_closures(self):
        written = self.model("examples/andrews/andrews.yaml", "--keep-parameters", "--sets", "invdyn,tangents,h_J")
        arguments = written.arguments(written.jax.h_J, np.random.default_rng(4))
        _, expected = written.reference("h_J", arguments)
        self.near(jax.jit(jax.jacfwd(lambda q: written.jax.h_J(0.3, q)[0]))(arguments[1]), expected, DERIVATIVES)
        symbols, (h, _) = symbolic(written.casadi.h_J, arguments)
        self.near(casadi.Function("f", symbols, [casadi.jacobian(h, symbols[1])])(*arguments), expected, DERIVATIVES)

    def test_of_parameters(self):
        """One package against the other, and both against differences."""
        written = self.model("examples/andrews/andrews.yaml", "--keep-parameters")
        p = np.array(written.python.parameter_values)
        t, q, qd = 0.0, *start_of(written)[:2]
        got = jax.jit(jax.jacfwd(lambda p: written.jax.forward(t, q, qd, p)[0]))(p)
        symbols = casadi.SX.sym("p", len(p))
        qdd, _ = written.casadi.forward(t, q, qd, symbols)
        traced = casadi.Function("f", [symbols], [casadi.jacobian(qdd, symbols)])(p)
        self.near(traced, got, DERIVATIVES)
        forward = jax.jit(lambda p: written.jax.forward(t, q, qd, p)[0])
        for k in range(0, len(p), 5):
            step = 1e-6*abs(p[k])*(np.arange(len(p)) == k)
            self.near((forward(p + step) - forward(p - step))/(2e-6*abs(p[k])), got[:, k], 1e-5)


class Motion(Case):
    MODELS = (("examples/four_bar/four_bar.yaml", ()), ("examples/andrews/andrews.yaml", ("--keep-parameters",)),
              ("examples/stewart/stewart.yaml", ("--sets", "M_C,h_J,jdqd")), ("examples/quarter_car/quarter_car.yaml", ("--keep-parameters",)),
              ("examples/cart_pole/cart_pole.yaml", ("--sets", "M_C+jdqd+h_J")))

    def test_accelerations(self):
        """Those of the library where its run is, in all and in independent coordinates."""
        for name, options in self.MODELS:
            with self.subTest(name=name):
                written = self.model(name, *options)
                inputs = [[1.5, 0.0, 0.0]] if "cart_pole" in name else []
                q, qd, qdd, multipliers, t = start_of(written, *(["--input", "u=1.5"] if inputs else []))
                arguments = [t, q, qd, *inputs]
                independent = written.jax.independent
                self.assertEqual(written.casadi.independent, independent)
                self.assertEqual(sorted(independent + written.jax.dependent), list(range(written.n)))
                in_jax = jax.jit(lambda *x, own=written.jax: (own.forward(*x), own.forward_reduced(*x)))  # their common part is compiled once
                together, reduced = in_jax(*arguments)
                for got in together, evaluated(written.casadi.forward, arguments):
                    self.near(got[0], qdd)
                    self.near(got[1], multipliers)
                self.near(reduced, qdd[independent])
                self.near(evaluated(written.casadi.forward_reduced, arguments)[0], qdd[independent])

    def test_derivatives(self):
        """Of the reduced accelerations, one package against the other."""
        written = self.model("examples/andrews/andrews.yaml", "--keep-parameters")
        q, qd, *_ = start_of(written)
        got = jax.jit(jax.jacrev(lambda q, qd: written.jax.forward_reduced(0.0, q, qd), (0, 1)))(q, qd)
        symbols, (udd,) = symbolic(written.casadi.forward_reduced, [0.0, q, qd])
        traced = casadi.Function("f", symbols, [casadi.jacobian(udd, x) for x in symbols[1:]])(0.0, q, qd)
        for mine, its in zip(traced, got, strict=True):
            self.near(mine, its, DERIVATIVES)

    def test_modes(self):
        """The row of an element that slips or is open is left out, and its multiplier is zero."""
        for name, closed in ("tests/models/contact_slider_crank.yaml", (0, 1)), ("examples/stick_slip/stick_slip.yaml", (0, 1)):
            for held in closed:
                with self.subTest(name=name, held=held):
                    written = self.model(name)
                    self.assertFalse(hasattr(written.jax, "forward_reduced") or hasattr(written.casadi, "close"))
                    arguments = written.arguments(written.jax.forward, np.random.default_rng(5), modes=[1.0 - held, held, 0.0, 0.3])
                    M, C, J, jdqd = written.parts(arguments)
                    rows = np.any(J != 0, axis=1)
                    self.assertEqual(np.count_nonzero(rows), written.m - 1 + held)
                    J, zeros = J[rows], np.zeros((np.count_nonzero(rows),)*2)
                    found = np.linalg.solve(np.block([[M, -J.T], [J, zeros]]), -np.concatenate([C, jdqd[rows]]))
                    multipliers = np.zeros(written.m)
                    multipliers[rows] = found[written.n:]
                    for got in jax.jit(written.jax.forward)(*arguments), evaluated(written.casadi.forward, arguments):
                        self.near(got[0], found[:written.n])
                        self.near(got[1], multipliers)

    def test_redundant_rows(self):
        """Rows that depend on others at the start have no multiplier, and the accelerations are those of the library."""
        written = self.model("examples/bricard/bricard.yaml")
        self.assertLess(len(written.jax.independent_rows), written.m)
        q, qd, qdd, _, t = start_of(written)
        for got in jax.jit(written.jax.forward)(t, q, qd), evaluated(written.casadi.forward, [t, q, qd]):
            self.near(got[0], qdd)
            left_out = np.setdiff1d(np.arange(written.m), written.jax.independent_rows)
            self.assertTrue(np.all(array(got[1]).ravel()[left_out] == 0))

    def test_closing(self):
        """Newton's method moves the dependent coordinates alone, in numbers and in symbols."""
        for name, options in self.MODELS[:2]:
            with self.subTest(name=name):
                written = self.model(name, *options)
                q, *_ = start_of(written)
                given = q + 1e-2*np.sin(np.arange(written.n))*np.max(np.abs(q))
                for got in jax.jit(written.jax.close)(0.0, given), evaluated(written.casadi.close, [0.0, given])[0]:
                    got = array(got).ravel()
                    self.assertTrue(np.array_equal(got[written.jax.independent], given[written.jax.independent]))
                    self.assertLess(np.max(np.abs(written.reference("h_J", [0.0, got])[0])), 1e-12)

    def test_other_coordinates(self):
        """Independent coordinates of the user's choice."""
        written = self.model("examples/four_bar/four_bar.yaml")
        q, qd, qdd, _, t = start_of(written)
        for module in written.jax, written.casadi:
            own = module.independent, module.dependent
            for u in range(3):
                module.independent, module.dependent = [u], [k for k in range(3) if k != u]
                in_jax = jax.jit(lambda *x, module=module: module.forward_reduced(*x))
                got = evaluated(module.forward_reduced, [t, q, qd])[0] if module is written.casadi else in_jax(t, q, qd)
                self.near(got, qdd[[u]])
            module.independent, module.dependent = own


class Packages(Case):
    def test_batches(self):
        """JAX: many states and many parameters at once, by vmap and jit, and their gradients."""
        written = self.model("examples/four_bar/four_bar.yaml", "--keep-parameters")
        model, rng = written.jax, np.random.default_rng(6)
        q, qd = rng.uniform(-1, 1, (20, 3)), rng.uniform(-1, 1, (20, 3))
        p = np.array(model.parameter_values)*rng.uniform(0.99, 1.01, (20, len(model.parameter_values)))
        batch = jax.jit(jax.vmap(model.forward, (None, 0, 0, 0)))(0.0, q, qd, p)
        work = jax.jit(jax.vmap(jax.grad(lambda q, qd, p: model.forward(0.0, q, qd, p)[0] @ qd)))(q, qd, p)
        slopes = jax.jit(jax.jacfwd(lambda q, qd, p: model.forward(0.0, q, qd, p)[0]))
        single = jax.jit(model.forward)
        for k in 0, 7, 19:
            for mine, its in zip(batch, single(0.0, q[k], qd[k], p[k]), strict=True):
                self.near(mine[k], its)
            self.near(work[k], qd[k] @ array(slopes(q[k], qd[k], p[k])), DERIVATIVES)

    def test_gradient_of_a_run(self):
        """JAX: the gradient of a run of 0.25 s, in which the crank turns by 5 rad, by all parameters, in 750 steps of the Runge-Kutta method, is the library's adjoint one."""
        written = self.model("examples/four_bar/four_bar.yaml", "--keep-parameters")
        model, T, N, rest = written.jax, 0.25, 750, jnp.array([1, 2])
        stages = jnp.array([[0, 1/6], [1/2, 1/3], [1/2, 1/3], [1, 1/6]])

        def end(p):
            _, J = model.h_J(0.0, jnp.zeros(3), p)  # all angles count from the start, whose rates follow from the crank's
            qd = jnp.concatenate([jnp.array([20.0]), jnp.linalg.solve(J[:, rest], -20.0*J[:, 0])])

            def rates(t, x):
                return jnp.concatenate([x[3:], model.forward(t, x[:3], x[3:], p)[0]])

            def step(x, k):
                def stage(slope, row):
                    part, weight = row
                    slope = rates((k + part)*T/N, x + slope*part*T/N)
                    return slope, weight*slope

                slopes = jax.lax.scan(stage, jnp.zeros(6), stages)[1]  # the equations are compiled once
                return x + jnp.sum(slopes, axis=0)*T/N, None

            return jax.lax.scan(step, jnp.concatenate([jnp.zeros(3), qd]), jnp.arange(N))[0][2]

        value, gradient = jax.jit(jax.value_and_grad(end))(jnp.array(model.parameter_values))
        said = json.loads(command(0, "sensitivity", written.path, "--method", "adjoint", "--outputs", "q(rocker)", "--t-end", str(T), "--rtol", "1e-12",
                                  "--json", "-").stdout)["end"]
        self.near(value, said["values"]["q.rocker"], 1e-6)
        slopes = said["derivatives"]["q.rocker"]
        self.assertGreater(len(slopes), 6)
        self.near([gradient[model.parameter_names.index(name)] for name in slopes], list(slopes.values()), 1e-6)

    def test_many_states(self):
        """JAX: vmap at the 4,096 states of a run, and the call of Kempe's package for many states."""
        written = self.model("examples/four_bar/four_bar.yaml")
        path = self.folder / "states.npz"
        words = (f"import kempe, numpy; m = kempe.Model({str(written.path)!r}); r = m.simulate(t_end=40.95, output_step=0.01, no_convergence_check=True); "
                 f"f = m.system().workspace().forward_states(r.t, r.q, r.qd); numpy.savez({str(path)!r}, t=r.t, q=r.q, qd=r.qd, qdd=f.qdd, lam=f.lam)")
        place = pathlib.Path(KEMPE).resolve().parent / "python"
        done = subprocess.run([os.environ.get("KEMPE_FIRST_PYTHON", sys.executable), "-c", words], env={**os.environ, "PYTHONPATH": str(place)},
                              capture_output=True, text=True, timeout=300)
        if "ModuleNotFoundError" in done.stderr:
            self.skipTest("Kempe's package, or a package that it needs, is not here")
        self.assertEqual(done.returncode, 0, done.stderr)
        states = np.load(path)
        self.assertEqual(states["q"].shape, (4096, 3))
        qdd, multipliers = jax.jit(jax.vmap(written.jax.forward))(states["t"], states["q"], states["qd"])
        self.near(qdd, states["qdd"])
        self.near(multipliers, states["lam"])

    def test_single_precision(self):
        """Functions refuse numbers of single precision, which JAX has unless it is told otherwise."""
        written = self.model("examples/four_bar/four_bar.yaml")
        jax.config.update("jax_enable_x64", False)
        try:
            with self.assertRaisesRegex(RuntimeError, "jax_enable_x64"):
                written.jax.M_C(0.0, np.zeros(3), np.zeros(3))
        finally:
            jax.config.update("jax_enable_x64", True)

    def test_matrix_symbols(self):
        """CasADi: the functions take MX too."""
        written = self.model("examples/four_bar/four_bar.yaml")
        q, qd, qdd, _, t = start_of(written)
        symbols, results = symbolic(written.casadi.forward, [t, q, qd], casadi.MX)
        self.near(casadi.Function("f", symbols, [results[0]])(t, q, qd), qdd)

    def test_optimum(self):
        """IPOPT: the crank angle at which the rocker of a four-bar turns back, where the coupler and crank are in line."""
        written = self.model("examples/four_bar/four_bar.yaml")
        q = casadi.SX.sym("q", 3)
        h, _ = written.casadi.h_J(0.0, q)
        start, *_ = start_of(written)
        solver = casadi.nlpsol("turn", "ipopt", {"x": q, "f": q[2], "g": h},
                               {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-12})
        found = solver(x0=start, lbg=0, ubg=0)
        self.assertTrue(solver.stats()["success"])
        q = array(found["x"]).ravel()
        h, J = written.reference("h_J", [0.0, q])
        self.assertLess(np.max(np.abs(h)), 1e-10)
        self.assertLess(abs(np.linalg.det(J[:, :2])), 1e-6)  # the rocker stands still while crank and coupler turn


    def test_page(self):
        """The programs of docs/generate.md run."""
        page = (ROOT / "docs/generate.md").read_text()
        blocks = ["\n".join(line[4:] for line in block.strip("\n").split("\n"))
                  for block in re.findall(r"(?:^    .*\n|^\n(?=    ))+", page, re.M)]
        model, said = ROOT / "examples/four_bar/four_bar.yaml", []
        command(0, "generate", model, "--lang", "jax", "--keep-parameters", "-o", self.folder)
        command(0, "generate", model, "--lang", "casadi", "-o", self.folder)
        for block in blocks:
            if block.startswith(("import jax", "import casadi")):
                done = subprocess.run([sys.executable, "-c", block], cwd=self.folder, capture_output=True, text=True, timeout=300)
                self.assertEqual(done.returncode, 0, done.stderr)
                said.append(done.stdout.splitlines()[-1])
        self.assertEqual(len(said), 2)
        self.assertRegex(said[0], r"^[\w.]+ -?\d+\.\d+")
        self.assertRegex(said[1], r"^\[.*\d.*\]$")


# A loop that no position closes.
OPEN = """kempe: 1
name: open
ground: {points: {D: [9, 0, 0]}}
bodies:
  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0]}}
  b: {joint: {revolute: z, at: a.P}, mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0]}}
loops: {L: {ball: [b.P, ground.D]}}
"""


class Refusals(Case):
    def refuse(self, sentence, *words):
        for language in "jax", "casadi":
            self.assertIn(sentence.format(language), command(3, "generate", *words, "--lang", language, "-o", self.folder).stderr)

    def test_by_name(self):
        model = ROOT / "examples/four_bar/four_bar.yaml"
        self.refuse("{} has no vectorised form", model, "--vectorised")
        self.refuse("simulators are written in C", model, "--simulator")
        self.refuse("contacts of wheels 'L', 'R'; request sets", ROOT / "examples/rolling_wheel/rolling_wheel.yaml")

    def test_what_is_missing(self):
        """A comment names what a function of accelerations needs."""
        for options, sentence in ((("--sets", "M,h_J"), "The function forward is omitted, because it needs the array C of a function without qdd and lambda_."),
                                  (("--sets", "M_C,J,jdqd"), "The function close is omitted, because it needs the array h.")):
            written = self.model("examples/four_bar/four_bar.yaml", *options)
            for module in written.jax, written.casadi:
                self.assertIn(sentence, pathlib.Path(module.__file__).read_text())
                self.assertEqual(hasattr(module, "forward"), "jdqd" in written.routines)
        model = self.folder / "open.yaml"
        model.write_text(OPEN)
        for language in "jax", "casadi":
            told = command(0, "generate", model, "--lang", language, "-o", self.folder).stderr
            self.assertIn("functions of accelerations are not written, since the model's start cannot be closed: ", told)
            self.assertIn("loop 'L' cannot be closed", told)
            text = (self.folder / f"open_{language}.py").read_text()
            self.assertIn("The function forward is omitted, because it needs a start at which the closures are met.", text)
        driven = self.model("examples/driven_slider_crank/driven_slider_crank.yaml")
        self.assertIn("The function forward is omitted, because it needs the rows of drives and locks, which --drives adds.", pathlib.Path(driven.jax.__file__).read_text())
        driven = self.model("examples/driven_slider_crank/driven_slider_crank.yaml", "--drives")
        q, qd, qdd, multipliers, t = start_of(driven)
        got = jax.jit(driven.jax.forward)(t, q, qd)
        self.near(got[0], qdd)
        self.near(got[1], multipliers)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
