# SPDX-License-Identifier: BSD-3-Clause
"""README's four-bar linkage with the package that a wheel has installed; bare_machine runs it."""
import kempe
about = kempe.about()
print({name: about[name] for name in ("kempe", "python", "numpy", "sundials", "klu", "backend", "linear_solvers")})
model = kempe.Model("four_bar.yaml", crank="310 mm")
print(model.system().check().dof, model.simulate(t_end=5).verdict["convergence"]["result"])
print(model.simulate(t_end=1, formulation="dae", integrator="ida", rtol=1e-6).status, model.system().modes().is_unstable)
