# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes of users. Each is answered by an exception, or by a warning where there is a result, that names the object, the number
or the name, and says what to do; none is silent, and none is answered in words of the command."""

import copy
import math
import pathlib
import pickle
import re
import warnings

import kempe
import kempe.contact
import numpy as np
import pytest
from kempe.optimal import collocate, ilqr

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
FOUR, CART, LEG = (EXAMPLES / place for place in ("four_bar/four_bar.yaml", "cart_pole/cart_pole.yaml", "../tests/models/geared_leg.urdf"))
NAN, INF = math.nan, math.inf
OPEN = [0.3, 0.5, 0.9]  # coordinates of the four-bar that leave its loop open
ZERO = [0.0, 0.0, 0.0]
ROWS = np.zeros((4, 3))
TIMES = [0, 0.1, 0.2]
MASS = {"crank_mass": (0.1, 5)}

# Words of the command and of C: options with dashes, exit codes, statuses, commands, the forms of its options.
COMMAND = re.compile(
    r"(?<!\w)--\w|\bexit (?:code|status)|\brc\b|\bstatus -?\d|\bkempe [a-z]+ |\bNULL\b|KEMPE_|kempe_\w|NAME[:=][A-Z]|\blambda_[qQp]\b"
)
# Words of Python about numbers and texts, without the name of the argument.
NAMELESS = re.compile(r"^(?:could not convert|must be real|float\(\) argument|an integer is required|expected str|'\w+' object has no attribute '_)")


def four(**values):
    return kempe.Model(FOUR, **values)


def cart(**values):
    return kempe.Model(CART, **values)


def system():
    return four().system()


def work():
    return system().workspace()


def at_closed(method, *more, **keywords):
    """A method of a workspace at a closed state."""
    workspace = work()
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold="crank")
    return getattr(workspace, method)(0, q, qd, *more, **keywords)


def run(**options):
    return four().simulate(t_end=0.2, **options)


def stepper(model=None, t=0.0):
    made = (model or four()).system().stepper(t_end=1)
    made.advance(t)
    return made


def outputs(words="position(coupler.C)"):
    return system().outputs(words)


def bars(values=(0.3, 0.31), **options):
    return four().ensemble({"crank": list(values)}, **options)


def fit(data=None, parameters=None, **options):
    angles = {"t": TIMES, "q(rocker)": ZERO} if data is None else data
    return four().fit(data=angles, parameters=MASS if parameters is None else parameters, **options)


def gradient():
    text = FOUR.read_text().replace("run: {", "run: {outputs: [position(coupler.C)], ")
    return kempe.Model.from_text(text).gradient(driven="crank", parameters=["crank", "base"])


def planned(workspace=None, q=(0.3, 0, 0), h=0.01, forces=((0.0,),), actuators="crank", target=(0, 0), **options):
    return ilqr(workspace or work(), q, ZERO, h, forces, actuators, target, **options)


def collocated(workspace=None, t_end=0.3, actuators="crank", end=None, **options):
    return collocate(workspace or work(), [0.3, 0, 0], ZERO, t_end, actuators, {"q(crank)": 0.4} if end is None else end, **options)


def after_a_failure():
    """A stepper whose force function has failed, and is called again."""
    failing = four().system(force=lambda t, q, qd: 0.0 if t < 0.1 else 1 / 0).stepper(t_end=1)
    with pytest.raises(ZeroDivisionError):
        failing.advance(0.5)
    failing.advance(0.6)


def forced(force):
    return four().system(force=force).simulate(t_end=0.1)


def bar(**members):
    return kempe.Builder("a").body("x", **{"mass": 1, "inertia": (1, 1, 1, 0, 0, 0), **members})


def put(target, place, value):
    target[place] = value


# A mistake: the class of the exception, words of its message, the call.
A, WRONG, F = kempe.ArgumentError, kempe.InputError, kempe.FailedError
MISTAKES = {
    # models and their values
    "a path that does not exist": (kempe.FileError, ["four_bar.yml", "No such file"], lambda p: kempe.Model("four_bar.yml")),
    "a folder as a model": (kempe.FileError, ["examples", "directory"], lambda p: kempe.Model(EXAMPLES)),
    "no path": (TypeError, ["a path is needed, not NoneType"], lambda p: kempe.Model(None)),
    "a dict as a path": (TypeError, ["Model.from_dict"], lambda p: kempe.Model({"kempe": 1})),
    "a text as a path": (kempe.FileError, ["Model.from_text"], lambda p: kempe.Model("kempe: 1\nbodies: {a: {mass: 1}}\n")),
    "a path as a text": (WRONG, ["begins with 'kempe: 1'"], lambda p: kempe.Model.from_text("four_bar.yaml")),
    "bytes as a text": (TypeError, ["a text is needed, not bytes"], lambda p: kempe.Model.from_text(b"kempe: 1")),
    "a list as a model": (WRONG, ["a model is a mapping"], lambda p: kempe.Model.from_dict([1, 2])),
    "a wrong key of a model": (WRONG, ["unknown key 'body'", "bodies"], lambda p: kempe.Model.from_dict({"kempe": 1, "body": {}})),
    "NaN in a dict": (ValueError, ["bodies.a.mass is nan", "finite"], lambda p: kempe.Model.from_dict({"kempe": 1, "bodies": {"a": {"mass": NAN}}})),
    "a parameter that does not exist": (WRONG, ["no parameter 'krank'", "'crank'"], lambda p: four(krank=0.3)),
    "a parameter that is NaN": (A, ["'crank' is nan", "finite"], lambda p: four(crank=NAN)),
    "a parameter that is None": (TypeError, ["'crank'", "not None"], lambda p: four(crank=None)),
    "a complex parameter": (TypeError, ["'crank'", "1j"], lambda p: four(crank=1j)),
    "several values of a parameter": (TypeError, ["crank", "not 2 values"], lambda p: four(crank=[0.3, 0.31])),
    "a parameter twice": (A, ["'crank' is given twice"], lambda p: kempe.Model(FOUR, {"crank": 0.3}, crank=0.4)),
    "a list of parameters": (TypeError, ["a mapping of names to values"], lambda p: kempe.Model(FOUR, ["crank=0.3"])),
    "a unit of another kind": (WRONG, ["expected m, got kg"], lambda p: four(crank="310 kg")),
    "a unit that does not exist": (WRONG, ["'furlongs'", "units are"], lambda p: four(crank="310 furlongs")),
    "a negative mass": (WRONG, ["mass of body 'crank' is negative"], lambda p: four(crank_mass=-1)),
    "lengths that do not close": (WRONG, ["'across'", "finite number"], lambda p: four(crank=30)),
    "a parameter set as an attribute": (AttributeError, ["'crank' cannot be set", "Model(.., crank=..)"], lambda p: setattr(four(), "crank", 0.31)),
    "a study of a system called of a model": (AttributeError, ["model.system().workspace"], lambda p: four().workspace()),
    "a stepper of a model": (AttributeError, ["model.system().stepper"], lambda p: four().stepper()),
    "a base that does not exist": (A, ["'floating'", "fixed and free"], lambda p: kempe.Model(LEG, robot_base="floating")),
    "mechanics that are not read": (WRONG, ["'spindle'", 'leave_out="spindle"'], lambda p: kempe.Model.from_text(LEG.read_text().replace("</joint>", "<spindle/></joint>", 1))),
    "a format that does not exist": (A, ["'obj'", "urdf+"], lambda p: four().export("obj")),
    "samples without a method": (A, ["u:", "method", "linear"], lambda p: cart(u={"t": [0, 1], "value": [1, 2]})),
    "a method that does not exist": (A, ["'spline'", "cubic"], lambda p: cart(u={"t": [0, 1], "value": [1, 2], "method": "spline"})),
    "samples whose times decrease": (ValueError, ["u:", "increase"], lambda p: cart(u={"t": [0, 1, 0.5], "value": [1, 2, 3], "method": "hold"})),
    "samples of other lengths": (ValueError, ["'t' 2, 'value' 3"], lambda p: cart(u={"t": [0, 1], "value": [1, 2, 3], "method": "hold"})),
    "a sample that is NaN": (ValueError, ["u:", "row 1 is nan"], lambda p: cart(u={"t": [0, 1], "value": [1, NAN], "method": "hold"})),
    "a function as an input": (TypeError, ["u:", "not a function"], lambda p: cart(u=lambda t: t)),
    "an input that does not exist": (A, ["no input 'v'", "u"], lambda p: cart().input_value("v", 0)),
    "an input at a time that is NaN": (A, ["t is nan"], lambda p: cart().input_value("u", NAN)),
    "a listener that cannot be called": (TypeError, ["on_progress takes a function"], lambda p: four().on_progress("x")),
    # systems and forces in Python
    "an algorithm that does not exist": (A, ["'fast'", "articulated"], lambda p: four().system("fast")),
    "a force as the first argument": (TypeError, ["force=.."], lambda p: four().system(lambda t, q, qd: q)),
    "a force that returns None": (ValueError, ["force gives 3 values, not None"], lambda p: forced(lambda t, q, qd: None)),
    "a force of another length": (ValueError, ["force gives 3 values", "(2,)"], lambda p: forced(lambda t, q, qd: [1, 2])),
    "a force that is NaN": (F, ["force gives no finite numbers at t = 0"], lambda p: forced(lambda t, q, qd: NAN * q)),
    "a component of a force that is NaN": (F, ["gives 'coupler' no finite force"], lambda p: forced(lambda t, q, qd: np.array([0, NAN, 0]))),
    "a complex force": (TypeError, ["force", "complex"], lambda p: forced(lambda t, q, qd: 1j * q)),
    "a force of texts": (TypeError, ["force", "numbers"], lambda p: forced(lambda t, q, qd: ["a", "b", "c"])),
    "a force that writes into q": (ValueError, ["read-only"], lambda p: forced(lambda t, q, qd: np.multiply(q, 2, out=q))),
    "a force with other arguments": (TypeError, ["positional arguments"], lambda p: forced(lambda q, qd: q)),
    "a view that does not exist": (A, ["'everything'", "equations"], lambda p: system().text("everything")),
    # starts and runs
    "a start of another length": (ValueError, ["q has 3 values", "crank, coupler, rocker", "(2,)"], lambda p: run(q=[0, 0])),
    "a start by a wrong name": (A, ["no coordinate 'krank'", "crank"], lambda p: run(q={"krank": 1})),
    "a start that is NaN": (ValueError, ["q of 'crank' is nan"], lambda p: run(q={"crank": NAN})),
    "a start with a unit": (TypeError, ["q of 'crank' is a number in rad", "'60 deg'"], lambda p: run(q={"crank": "60 deg"})),
    "a start that is a text": (TypeError, ["array or a mapping", "'crank=1'"], lambda p: run(q="crank=1")),
    "a start that is a set": (TypeError, ["q is a number"], lambda p: run(q={0.1, 0.2})),
    "a start of pairs": (TypeError, ["q is an array of numbers"], lambda p: run(q=[("crank", 1)])),
    "a start that is a matrix": (ValueError, ["(3, 3)", "crank, coupler, rocker"], lambda p: run(q=np.zeros((3, 3)))),
    "a start that does not close": (F, ["'C' by 0.795 m", "leave out coordinates"], lambda p: run(q=OPEN)),
    "rates that contradict": (F, ["qd contradicts", "leave out rates"], lambda p: run(q={"crank": 0.3}, qd=[1, 1, 1])),
    "an end before the start": (A, ["t_end = -1", "positive"], lambda p: four().simulate(t_end=-1)),
    "an end with a unit": (ValueError, ["t_end", "a number in SI is needed, not '500 ms'"], lambda p: four().simulate(t_end="500 ms")),
    "an end at the start": (A, ["t_end", "positive number, not 0"], lambda p: four().simulate(t_end=0)),
    "an end that is NaN": (A, ["t_end = nan"], lambda p: four().simulate(t_end=NAN)),
    "an end with a unit": (ValueError, ["t_end", "'5 s'"], lambda p: four().simulate(t_end="5 s")),
    "a range of times": (TypeError, ["t_end: a number is needed, not (0, 5)"], lambda p: four().simulate(t_end=(0, 5))),
    "an end as the first argument": (ValueError, ["q has 3 values"], lambda p: four().simulate(5)),
    "times of rows": (TypeError, ["no keyword 't_eval'", "t_end"], lambda p: run(t_eval=[0, 1])),
    "outputs of a run as a keyword": (TypeError, ["no keyword 'outputs'"], lambda p: run(outputs="q")),
    "a negative tolerance": (A, ["rtol = -0.001", "positive"], lambda p: run(rtol=-1e-3)),
    "a large tolerance": (A, ["rtol = 10", "1e-15 .. 0.1"], lambda p: run(rtol=10)),
    "a tolerance in words": (ValueError, ["rtol", "'high'"], lambda p: run(rtol="high")),
    "a negative output step": (A, ["output_step = -0.1", "positive"], lambda p: run(output_step=-0.1)),
    "an integrator of another package": (A, ["'rk45'", "dop853", "bdf"], lambda p: run(integrator="rk45")),
    "a formulation that does not exist": (A, ["'lagrange'", "projected"], lambda p: run(formulation="lagrange")),
    "an independent coordinate that does not exist": (A, ["'krank'", "'crank'"], lambda p: run(independent="krank")),
    "too many independent coordinates": (F, ["1 degree of freedom", "coupler"], lambda p: run(independent="crank,rocker")),
    "a part of a thread": (ValueError, ["threads: a whole number", "1.5"], lambda p: run(threads=1.5)),
    "progress in words": (TypeError, ["progress is True or a function"], lambda p: run(progress="bar")),
    "a reference with a wrong column": (WRONG, ["'q.krank'", "'q.crank'"], lambda p: run(reference={"t": [0, 0.2], "q(krank)": [0, 0]})),
    "a reference of texts": (TypeError, ["reference", "'q.crank' has texts"], lambda p: run(reference={"t": [0, 0.2], "q.crank": ["a", "b"]})),
    # results
    "an output of a wrong point": (A, ["no point 'Z'", "'coupler'"], lambda p: run()["position(coupler.Z)"]),
    "an output that does not exist": (A, ["'speed(crank)'", "qd(JOINT)"], lambda p: run()["speed(crank)"]),
    "an output of a body": (A, ["BODY.POINT", "'coupler'"], lambda p: run()["position(coupler)"]),
    "a number as an output": (TypeError, ["a name is needed, not int"], lambda p: run()[0]),
    "two outputs at once": (TypeError, ["a name is needed, not tuple"], lambda p: run()["q(crank)", "q(rocker)"]),
    "no output": (A, ["no output is named"], lambda p: run().outputs("")),
    "an empty list of outputs": (A, ["no output is named"], lambda p: run().outputs([])),
    "a column that does not exist": (KeyError, ["'crank'", "q.crank"], lambda p: run().rows["crank"]),
    "writing into a result": (ValueError, ["read-only"], lambda p: put(run().q, (0, 0), 1.0)),
    "writing into a column": (ValueError, ["read-only"], lambda p: put(run().rows["q.crank"], 0, 1.0)),
    "writing into a table": (TypeError, ["item assignment"], lambda p: put(run().rows, "q.crank", 1.0)),
    "another array in a result": (AttributeError, ["never changes", "'q'"], lambda p: setattr(run(), "q", ROWS)),
    "a time of a run without its polynomials": (A, ["keep_dense"], lambda p: run().at(0.1)),
    "a time after the run": (A, ["t = 7 s", "0 to 0.2 s"], lambda p: run(keep_dense=True).at(7)),
    "a time before the run": (A, ["t = -1 s", "0 to 0.2 s"], lambda p: run(keep_dense=True).at(-1)),
    "a time as text": (TypeError, ["t is an array of numbers", "'0.1'"], lambda p: run(keep_dense=True).at("0.1")),
    "a table in another format": (A, ["a.xyz", ".csv"], lambda p: run().rows.write(p / "a.xyz")),
    "a table in a missing folder": (kempe.FileError, [str(pathlib.Path("none/a.csv")), "No such file"], lambda p: run().rows.write(p / "none/a.csv")),
    "a picture in another format": (A, ["a.pdf", ".svg or .png"], lambda p: run().rows.write_picture(p / "a.pdf")),
    "a picture against no table": (TypeError, ["against", "Table", "dict"], lambda p: run().rows.write_picture(p / "a.svg", against={})),
    "a picture of a wrong column": (A, ["'q.krank'", "q.crank"], lambda p: run().rows.write_picture(p / "a.svg", "t", "q.krank")),
    "no path of a table": (TypeError, ["a path is needed"], lambda p: run().rows.write(None)),
    "a result made by hand": (TypeError, ["Trajectory is made by"], lambda p: kempe.Trajectory()),
    # steppers
    "a stepper backwards": (A, ["t = 0.2 s", "0.5 s"], lambda p: stepper(t=0.5).advance(0.2)),
    "a stepper beyond its end": (A, ["t = 2 s", "t_end = 1 s"], lambda p: stepper().advance(2)),
    "a stepper to NaN": (A, ["t = nan"], lambda p: stepper().advance(NAN)),
    "a stepper to a text": (TypeError, ["t is a number", "'0.1 s'"], lambda p: stepper().advance("0.1 s")),
    "a step at the end": (A, ["ends at t_end = 1 s"], lambda p: stepper(t=1).step()),
    "a stepper after an error": (ZeroDivisionError, ["division"], lambda p: after_a_failure()),
    "an input of a stepper that does not exist": (A, ["no input 'v'", "u"], lambda p: stepper(cart()).set_input("v", 1)),
    "an input of a model without inputs": (A, ["no input 'torque'", "none"], lambda p: stepper().set_input("torque", 1)),
    "an input that is NaN": (A, ["input 'u'", "finite"], lambda p: stepper(cart()).set_input("u", NAN)),
    "an input with a unit": (TypeError, ["input 'u' is a number in SI", "'3 N'"], lambda p: stepper(cart()).set_input("u", "3 N")),
    "an input that is None": (TypeError, ["input 'u'", "None"], lambda p: stepper(cart()).set_input("u", None)),
    "an input that is an array": (TypeError, ["input 'u'", "[1.0, 2.0]"], lambda p: stepper(cart()).set_input("u", [1.0, 2.0])),
    "an input as an attribute": (AttributeError, ["'u'", "set_input"], lambda p: setattr(stepper(cart()), "u", 3.0)),
    "a state as an attribute": (AttributeError, ["'q'", "set_state"], lambda p: setattr(stepper(), "q", ZERO)),
    "a state of another length": (ValueError, ["q has 3 values", "(2,)"], lambda p: stepper().set_state([0, 0])),
    "a state that is NaN": (A, ["q of 'crank' is nan"], lambda p: stepper().set_state([NAN, 0, 0])),
    "a wrong parameter of a stepper": (A, ["'krank'", "'crank'"], lambda p: stepper().set_parameters(krank=0.3)),
    "a parameter of a stepper with a unit": (TypeError, ["crank: a number in SI"], lambda p: stepper().set_parameters(crank="310 mm")),
    "a parameter of a stepper that is NaN": (A, ["'crank' is nan"], lambda p: stepper().set_parameters(crank=NAN)),
    "no parameter of a stepper": (A, ["0 parameters"], lambda p: stepper().set_parameters()),
    "a saved state of another model": (A, ["another system"], lambda p: stepper().restore(stepper(cart()).save())),
    "a saved state that is None": (TypeError, ["SavedState", "save()", "NoneType"], lambda p: stepper().restore(None)),
    "a stop in the past": (A, ["0.2 s", "0.5 s"], lambda p: stepper(t=0.5).set_stop(0.2)),
    "a stepper in a pickle": (TypeError, ["Stepper cannot be pickled"], lambda p: pickle.dumps(stepper())),
    # workspaces
    "coordinates of another length": (ValueError, ["q has 3 values", "(2,)"], lambda p: work().evaluate(0, [0, 0])),
    "the time after the coordinates": (TypeError, ["t is a number", "[0.0, 0.0, 0.0]"], lambda p: work().evaluate(ZERO, 0.0)),
    "coordinates as text": (TypeError, ["q is an array of numbers", "'crank'"], lambda p: work().evaluate(0, "crank")),
    "coordinates by names": (TypeError, ["q is an array", "mapping"], lambda p: work().evaluate(0, {"crank": 1})),
    "complex coordinates": (TypeError, ["q has complex numbers"], lambda p: work().evaluate(0, np.array([1j, 0, 0]))),
    "coordinates with None": (TypeError, ["q is an array of numbers", "None"], lambda p: work().evaluate(0, [None, 0, 0])),
    "coordinates that are NaN": (F, ["not finite", "t = 0 s"], lambda p: work().evaluate(0, [NAN, 0, 0])),
    "a time that is NaN": (A, ["time t is nan"], lambda p: work().evaluate(NAN, ZERO)),
    "a mass matrix before an evaluation": (A, ["evaluate(t, q, qd) first"], lambda p: work().M),
    "a kinetic energy before an evaluation": (A, ["evaluate(t, q, qd) first"], lambda p: work().kinetic),
    "writing into a view": (ValueError, ["read-only"], lambda p: put(work().evaluate(0, ZERO, views=True).M, (0, 0), 1)),
    "a copy of a workspace": (TypeError, ["Workspace cannot be pickled or copied"], lambda p: copy.copy(work())),
    "dynamics without rates": (A, ["qd is missing"], lambda p: work().forward_dynamics(0, ZERO, None)),
    "dynamics with other forces": (ValueError, ["Q has 3 values"], lambda p: work().forward_dynamics(0, ZERO, ZERO, [1, 2])),
    "dynamics with forces that are NaN": (F, ["not finite"], lambda p: work().forward_dynamics(0, ZERO, ZERO, [NAN, 0, 0])),
    "many states in a call for one": (ValueError, ["q has 3 values", "(4, 3)"], lambda p: work().forward_dynamics(0, ROWS, ROWS)),
    "one array for two results": (A, ["out is a pair"], lambda p: work().forward_dynamics(0, ZERO, ZERO, out=np.zeros(3))),
    "lists for results": (ValueError, ["qdd must be a writable array"], lambda p: work().forward_dynamics(0, ZERO, ZERO, out=([0] * 3, [0] * 2))),
    "accelerations that are NaN": (A, ["'crank' is nan"], lambda p: work().inverse_dynamics(0, ZERO, ZERO, [NAN, 0, 0])),
    "an actuator that does not exist": (A, ["'krank'", "'crank'"], lambda p: at_closed("inverse_dynamics", ZERO, actuators="krank")),
    "no actuator": (A, ["actuators is empty", "name the coordinates"], lambda p: at_closed("inverse_dynamics", ZERO, actuators=[])),
    "an actuator twice": (A, ["'crank' is given twice"], lambda p: at_closed("inverse_dynamics", ZERO, actuators="crank,crank")),
    "weights of other actuators": (ValueError, ["weights has 1 values"], lambda p: at_closed("inverse_dynamics", ZERO, actuators="crank", weights=[1, 2])),
    "a negative weight": (A, ["'rocker'", "positive"], lambda p: at_closed("inverse_dynamics", ZERO, actuators="crank,rocker", weights=[1, -1])),
    "weights without actuators": (A, ["weights need actuators"], lambda p: at_closed("inverse_dynamics", ZERO, weights=[1])),
    "computed torque with an open loop": (F, ["'C.2' is open", "close the state"], lambda p: work().inverse_dynamics(0, OPEN, ZERO, ZERO, actuators="crank")),
    "a held coordinate that does not exist": (A, ["'krank'", "crank"], lambda p: work().close(0, ZERO, hold="krank")),
    "a held coordinate by its number": (A, ["no coordinate '0'", "crank"], lambda p: work().close(0, ZERO, hold=[0])),
    "all coordinates held": (F, ["'C.2' stays open"], lambda p: work().close(0, OPEN, hold="crank,coupler,rocker")),
    "closing from NaN": (A, ["q of 'crank' is nan"], lambda p: work().close(0, [NAN, 0, 0])),
    "closing from infinity": (A, ["q of 'coupler' is inf"], lambda p: work().close(0, [0, INF, 0])),
    "a treatment of friction that does not exist": (A, ["'sticks'", "slip, stick or none"], lambda p: system().workspace("sticks")),
    "an input of a workspace that is NaN": (A, ["input 'u' is nan"], lambda p: cart().system().workspace().set_input("u", NAN)),
    "an input of a workspace with a unit": (TypeError, ["input 'u'", "'1 N'"], lambda p: cart().system().workspace().set_input("u", "1 N")),
    # derivatives
    "closed derivatives at an open loop": (F, ["'C.2' is open", "close the state"], lambda p: work().closed_derivatives(0, OPEN, ZERO)),
    "derivatives by a wrong name": (A, ["'krank'", "'crank'"], lambda p: at_closed("closed_derivatives", by="krank")),
    "derivatives by a name twice": (A, ["'crank' is given twice"], lambda p: at_closed("closed_derivatives", by="crank,crank")),
    "derivatives of a wrong output": (A, ["no point 'Z'"], lambda p: at_closed("closed_derivatives", outputs="position(coupler.Z)")),
    "derivatives that are NaN": (F, ["not finite"], lambda p: work().forward_derivatives(0, [NAN, 0, 0], ZERO)),
    "derivatives into something else": (A, ["an earlier result", "ClosedDerivatives"], lambda p: at_closed("closed_derivatives", out=(1, 2))),
    "states in columns": (ValueError, ["q has rows of 3 values", "(3, 10)"], lambda p: work().forward_derivatives(0, np.zeros((3, 10)), np.zeros((3, 10)))),
    "rates of fewer states": (ValueError, ["qd has rows", "(3, 3)"], lambda p: work().forward_derivatives(0, ROWS, ROWS[:3])),
    "times of other states": (ValueError, ["t is a number or 4 of them", "(2,)"], lambda p: work().forward_states([0, 1], ROWS, ROWS)),
    "a state of many that is open": (F, ["state 1:", "close the state"], lambda p: work().closed_derivatives(0, [ZERO, OPEN], [ZERO, ZERO])),
    "a state of many that is NaN": (F, ["state 2:", "not finite"], lambda p: work().forward_states(0, [ZERO, ZERO, [NAN, 0, 0]], ROWS[:3])),
    "an acceleration of many that is NaN": (A, ["state 0:", "'crank'"], lambda p: work().inverse_states(0, ROWS, ROWS, NAN * ROWS)),
    "a time of many that is NaN": (A, ["state 1: t"], lambda p: work().forward_states([0, NAN, 0, 0], ROWS, ROWS)),
    "one state in a call for many": (ValueError, ["q has rows of 3 values", "(3,)"], lambda p: work().forward_states(0, ZERO, ZERO)),
    "threads in words": (TypeError, ["threads is a whole number", "'all'"], lambda p: work().forward_states(0, ROWS, ROWS, threads="all")),
    "a negative number of threads": (A, ["threads", "0 for all processors", "-1"], lambda p: work().forward_states(0, ROWS, ROWS, threads=-1)),
    "no direction": (A, ["no direction is given", "dq"], lambda p: at_closed("forward_jvp")),
    "a direction of another length": (ValueError, ["dq has 3 values"], lambda p: at_closed("forward_jvp", dq=[1])),
    "two kinds of directions": (A, ["u and ud"], lambda p: at_closed("forward_jvp", dq=[1, 0, 0], du=[1])),
    "a direction of names without names": (ValueError, ["dp has 0 values"], lambda p: at_closed("forward_jvp", dp=[1])),
    "no weight": (A, ["no weight is given", "lam"], lambda p: at_closed("forward_vjp")),
    "weights of outputs without outputs": (ValueError, ["y has 0 values"], lambda p: at_closed("forward_vjp", y=[1])),
    "a list in place of a pair of directions": (A, ["first is a tuple"], lambda p: at_closed("forward_second", first=[1, 0, 0], second=[0, 1, 0])),
    "equations of motions of an open loop": (F, ["'C.2' is open", "close the state"], lambda p: work().closed_equations(0, OPEN, ZERO)),
    # steps
    "a step of no length": (A, ["not zero", "0 s"], lambda p: at_closed("step", 0.0)),
    "a step that is NaN": (A, ["nan s"], lambda p: at_closed("step", NAN)),
    "a step with a unit": (TypeError, ["h is a number", "'1 ms'"], lambda p: at_closed("step", "1 ms")),
    "no step": (A, ["at least one"], lambda p: at_closed("step", 1e-3, steps=0)),
    "a part of a step": (TypeError, ["steps is a whole number", "2.5"], lambda p: at_closed("step", 1e-3, steps=2.5)),
    "steps from an open loop": (F, ["'C.1' is open", "close the state"], lambda p: work().step(0, [0.3, 2.5, -2], ZERO, 1e-3)),
    "a step that is too long": (F, ["loops cannot be closed"], lambda p: work().step(0, ZERO, [20, -22.5, 7.5], 5.0)),
    "a state of a wrong length for an integrator": (ValueError, ["state has 6 values"], lambda p: work().rates(0, ZERO)),
    # outputs
    "an output object of a wrong point": (A, ["no point 'Z'"], lambda p: outputs("position(coupler.Z)")),
    "an output object of nothing": (A, ["no output is named"], lambda p: outputs("")),
    "outputs at NaN": (A, ["q of 'crank' is nan"], lambda p: outputs().at(0, [NAN, 0, 0])),
    "an acceleration without accelerations": (A, ["depends on qdd", "forward_dynamics"], lambda p: outputs("acceleration(coupler.C)").at(0, ZERO)),
    "a reaction without multipliers": (A, ["depends on lam", "forward_dynamics"], lambda p: outputs("reaction(C)").at(0, ZERO)),
    "a row that does not exist": (A, ["no row 99", "21"], lambda p: (lambda s: s.outputs("q").at_row(s.simulate(t_end=0.2), 99))(system())),
    "a row of another model": (A, ["another system"], lambda p: outputs().at_row(cart().simulate(t_end=0.1), 0)),
    "a time of another model": (A, ["another system"], lambda p: outputs().at_time(cart().simulate(t_end=0.1, keep_dense=True), 0.05)),
    "a row of an array": (TypeError, ["Trajectory", "simulate()", "ndarray"], lambda p: outputs().at_row(ROWS, 0)),
    "a stepper of another model": (A, ["another system"], lambda p: outputs().at_stepper(stepper(cart()))),
    "a Jacobian of a reaction": (A, ["'reaction.C.x' has no Jacobian"], lambda p: outputs("reaction(C)").jacobian(0, ZERO)),
    "a closed Jacobian at an open loop": (F, ["open by", "close the state"], lambda p: outputs().closed_jacobian(0, OPEN)),
    "independent coordinates of outputs that do not exist": (A, ["'krank'", "'crank'"], lambda p: outputs().choose("krank")),
    # studies
    "a sweep of a wrong name": (A, ["'krank'", "'crank'"], lambda p: system().kinematics(sweep={"krank": (0, 1, 5)})),
    "a sweep of an array": (TypeError, ["sweep", "(from, to, count)", "5 values"], lambda p: system().kinematics(sweep={"crank": np.arange(5.0)})),
    "a sweep with a negative count": (A, ['{"NAME": (A, B, N)}', "2 to 1000000"], lambda p: system().kinematics(sweep={"crank": (0, 1, -5)})),
    "a sweep without a range": (A, ['{"NAME": (A, B)}'], lambda p: system().kinematics(sweep=["crank"])),
    "no sweep": (A, ["swept coordinate is missing", 'sweep={"NAME": (A, B)}'], lambda p: system().kinematics()),
    "an actuator of inverse dynamics that does not exist": (A, ["'krank'", "'crank'"], lambda p: system().inverse(actuators="krank")),
    "a motion with a wrong column": (WRONG, ["motion", "'q.krank'", "'q.crank'"], lambda p: system().inverse(actuators="crank", motion={"t": TIMES, "q(krank)": ZERO})),
    "a motion without times": (WRONG, ["motion", "column t"], lambda p: system().inverse(actuators="crank", motion={"q(crank)": ZERO})),
    "a motion of other lengths": (ValueError, ["motion", "'t' 3, 'q.crank' 2"], lambda p: system().inverse(actuators="crank", motion={"t": TIMES, "q(crank)": [0, 1]})),
    "a motion that is an array": (TypeError, ["motion", "without names"], lambda p: system().inverse(actuators="crank", motion=ROWS)),
    "a wrong input of a state space": (A, ["no parameter 'torque'"], lambda p: system().linearize(inputs="torque")),
    "a wrong output of a state space": (A, ["'krank'", "'crank'"], lambda p: system().linearize(outputs="q(krank)")),
    "a state of a state space as a keyword": (TypeError, ["start_at(q=..)"], lambda p: system().linearize(q=ZERO)),
    "a sample time of a state space": (TypeError, ["no keyword 'sample_time'", "inputs"], lambda p: system().linearize(sample_time=1e-3)),
    "a response without inputs": (A, ["needs inputs", "effort(JOINT)"], lambda p: system().response()),
    "a negative tolerance of a comparison": (A, ["'-1'", "between 0 and 1"], lambda p: system().compare(rtols=[-1], t_end=0.1)),
    "limit cycles without a range": (A, ['sweep={"NAME": (A, B, N)}'], lambda p: system().limit_cycles()),
    "a contact table without wheels": (A, ["no wheels"], lambda p: system().contact()),
    "sensitivities by a wrong name": (A, ["'krank'", "'crank'"], lambda p: four().sensitivity(parameters="krank", outputs="q", t_end=0.1)),
    "sensitivities of a wrong output": (A, ["'speed'", "qd(JOINT)"], lambda p: four().sensitivity(parameters="crank", outputs="speed", t_end=0.1)),
    "a gradient by a wrong name": (A, ["'krank'", "'crank'"], lambda p: four().gradient(driven="crank", parameters="krank")),
    "a gradient before its evaluation": (A, ["at(driven) first"], lambda p: gradient().values),
    "a gradient at two angles": (ValueError, ["driven has 1 values"], lambda p: gradient().at([1, 2])),
    "a gradient at NaN": (A, ["driven coordinate 1"], lambda p: gradient().at(NAN)),
    "fewer values of a gradient": (ValueError, ["values has 2 values"], lambda p: gradient().set([0.3])),
    # fits and optimisation
    "a fit without data": (A, ["data is missing"], lambda p: four().fit(parameters="crank_mass")),
    "a fit without parameters": (A, ["no parameter to find"], lambda p: four().fit(data={"t": TIMES, "q(rocker)": ZERO})),
    "a fit of a missing column": (A, ["'q.crank'", "'data'"], lambda p: fit(columns="q.crank")),
    "a fit of an unknown column": (WRONG, ["'angle' is not an output", "q.JOINT"], lambda p: fit({"t": TIMES, "angle": ZERO})),
    "a fit without times": (WRONG, ["column t is missing"], lambda p: fit({"time": TIMES, "q(rocker)": ZERO})),
    "a fit of times alone": (WRONG, ["no column of an output"], lambda p: fit({"t": TIMES})),
    "a fit whose times decrease": (ValueError, ["must increase", "row 2", "0.1 s after 0.2 s"], lambda p: fit({"t": [0, 0.2, 0.1], "q(rocker)": ZERO})),
    "a fit from negative times on": (WRONG, ["row 0", "begin at 0"], lambda p: fit({"t": [-1, 0.1, 0.2], "q(rocker)": ZERO})),
    "a fit of other lengths": (ValueError, ["'t' 3, 'q.rocker' 2"], lambda p: fit({"t": TIMES, "q(rocker)": [0, 0]})),
    "a fit of a column of NaN": (WRONG, ["'q.rocker' is empty"], lambda p: fit({"t": TIMES, "q(rocker)": [NAN] * 3})),
    "a fit in a wrong unit": (WRONG, ["unit", "rad is expected"], lambda p: fit({"t": TIMES, "q(rocker) [kg]": ZERO})),
    "bounds in the wrong order": (A, ["'crank_mass'", "5 is not below 0.1"], lambda p: fit(parameters={"crank_mass": (5, 0.1)})),
    "one bound": (A, ["'crank_mass'", '{"NAME": (LOW, HIGH)}', "None"], lambda p: fit(parameters={"crank_mass": 2})),
    "a start outside the bounds": (A, ["start 1", "2 and 5", "Model(.., NAME=..)"], lambda p: fit(parameters={"crank_mass": (2, 5)})),
    "a fit of a wrong parameter": (A, ["'krank'", "'crank'"], lambda p: fit(parameters={"krank": (0.1, 5)})),
    "an optimum of nothing": (A, ["quantity to minimise"], lambda p: four().optimize(parameters={"base": (0.85, 0.95)}, t_end=0.1)),
    "an optimum without bounds": (A, ["'base' needs two bounds", '{"NAME": (LOW, HIGH)}'], lambda p: four().optimize(minimize="max(qd(rocker))", parameters="base", t_end=0.1)),
    # generated code
    "a language that does not exist": (A, ["'rust'", "python"], lambda p: four().generate(language="rust")),
    "a set of equations that does not exist": (A, ["'MC'", "M_C"], lambda p: four().count(sets="MC")),
    "a kind of unit that does not exist": (A, ["'cosim'", "cs"], lambda p: four().fmu(kind="cosim")),
    "a platform that does not exist": (A, ["'win64'", "x86_64-windows"], lambda p: four().fmu(platforms="win64")),
    "a platform twice": (A, ["'x86_64-linux'", "twice"], lambda p: four().fmu(platforms="x86_64-linux,x86_64-linux")),
    "no platform": (A, ["missing"], lambda p: four().fmu(platforms="")),
    "two platforms of one name": (A, ["'x86_64-darwin'", "FMI 2.0"],
                                  lambda p: four().fmu(platforms="x86_64-darwin,aarch64-darwin", compiler="cc", fmi=2)),
    "a platform without a compiler": (A, ["aarch64-darwin", "macOS"], lambda p: four().fmu(platforms="aarch64-darwin")),
    "one compiler for two platforms": (A, ["'cc'", "2 are named"],
                                       lambda p: four().fmu(platforms="x86_64-linux,x86_64-windows", compiler="cc")),
    "platforms of a unit without binaries": (A, ["no platform"], lambda p: four().fmu(platforms="x86_64-linux", no_binary=True)),
    "a version of the FMI that does not exist": (A, ["4", "2 and 3"], lambda p: four().fmu(fmi=4)),
    # ensembles
    "no instance": (A, ["no instance to run", "crank"], lambda p: bars([]).run(t_end=0.1)),
    "no instance for a folder": (A, ["no instance to run", "crank"], lambda p: bars([]).run_folder(p / "a", t_end=0.1)),
    "no column": (ValueError, ["columns of one length", "none"], lambda p: four().ensemble({})),
    "a column that is no parameter": (A, ["'krank'", "'crank'"], lambda p: four().ensemble({"krank": [1, 2]})),
    "a start of no coordinate": (A, ["'krank'", "'crank'"], lambda p: four().ensemble({"q.krank": [1, 2]})),
    "columns of other lengths": (ValueError, ["one length", "[2, 3]"], lambda p: four().ensemble({"crank": [0.3, 0.31], "base": [0.9] * 3})),
    "an array without names": (TypeError, ["values", "without names"], lambda p: four().ensemble(ROWS)),
    "a column with units": (TypeError, ["'crank'", "'290 mm'"], lambda p: four().ensemble({"crank": ["290 mm", "310 mm"]})),
    "a column of None": (TypeError, ["'crank'", "None"], lambda p: four().values({"crank": [None, 0.3]})),
    "a quantity that does not exist": (WRONG, ["unknown function 'biggest'"], lambda p: bars(quantities="biggest(q(rocker))")),
    "a quantity of no coordinate": (WRONG, ["'krank'", "'crank'"], lambda p: bars(quantities="max(q(krank))")),
    "an empty mapping of quantities": (A, ["quantities is empty"], lambda p: bars(quantities={})),
    "lanes that are not possible": (A, ["-7", "1 to 16"], lambda p: bars().run(t_end=0.1, lanes=-7)),
    "instances beyond the last one": (A, ["no 5 instances from 1", "2"], lambda p: bars().run_range(1, 5, t_end=0.1)),
    "one row in a call for rows": (ValueError, ["rows of 1 values", "crank", "(2,)"], lambda p: bars().run_rows([0.3, 0.31], t_end=0.1)),
    "rows of another width": (ValueError, ["rows of 1 values", "(1, 2)"], lambda p: bars().run_rows([[0.3, 0.31]], t_end=0.1)),
    "a history counted from zero": (A, ["1 to 2"], lambda p: bars().history("0", t_end=0.1)),
    "a history as a number": (TypeError, ["a text is needed, not int"], lambda p: bars().history(1, t_end=0.1)),
    "a share that does not exist": (A, ["'3/2'", "I/N"], lambda p: bars().run_folder(p / "b", t_end=0.1, shard="3/2")),
    "an executor that is a number": (TypeError, ["submit", "int"], lambda p: bars().run_folder(p / "b", t_end=0.1, executor=4)),
    "a folder without results": (WRONG, ["no results are here"], lambda p: kempe.Folder.open(p)),
    "a confidence in per cent": (A, ["95", "between 0 and 1"], lambda p: bars().run(t_end=0.1).statistics(95)),
    "values of another model": (A, ["no parameter 'l'"], lambda p: four().ensemble(cart().values({"l": [0.4]}))),
    "a row of values that does not exist": (IndexError, ["there are 1 rows"], lambda p: four().values({"crank": [0.3]})[3]),
    "a negative number of samples": (A, ["at least one"], lambda p: four().sample({"crank": (0.2, 0.3)}, -1)),
    "a design that does not exist": (A, ["'hypercube'", "latin"], lambda p: four().sample({"crank": (0.2, 0.3)}, 10, design="hypercube")),
    "a function of one text": (TypeError, ["a sequence of names"], lambda p: four().function("crank", t_end=0.1)),
    "a function with a wrong option": (TypeError, ["no keyword 'tend'", "t_end"], lambda p: four().function(["crank"], tend=0.1)),
    "a function of a text": (TypeError, ["X is an array of numbers", "'0.3'"], lambda p: four().function(["crank"], t_end=0.1)("0.3")),
    "a function of rows that are too wide": (ValueError, ["rows of 1 values"], lambda p: four().function(["crank"], t_end=0.1)([[1, 2]])),
    # optimal motions
    "a plan of a model": (TypeError, ["model.system().workspace()", "not Model"], lambda p: planned(four())),
    "a plan from other coordinates": (ValueError, ["q has 3 values"], lambda p: planned(q=[0.3, 0])),
    "a plan whose step is NaN": (A, ["positive length", "nan"], lambda p: planned(h=NAN)),
    "a plan with a part of a substep": (TypeError, ["substeps is a whole number", "1.5"], lambda p: planned(substeps=1.5)),
    "forces of a plan in a row": (A, ["a row of 1 numbers", "(1, 5)"], lambda p: planned(forces=[[0.0] * 5])),
    "forces of a plan as text": (TypeError, ["forces is an array of numbers"], lambda p: planned(forces="zero")),
    "an actuator by its number": (A, ["actuators names the coordinates"], lambda p: planned(actuators=0)),
    "collocation of a system": (TypeError, ["model.system().workspace()", "not System"], lambda p: collocated(system())),
    "an end that is a list": (TypeError, ["end is a mapping", "list"], lambda p: collocated(end=[0.4])),
    "an end time with a unit": (TypeError, ["t_end is an array of numbers", "'0.3 s'"], lambda p: collocated(t_end="0.3 s")),
    "intervals in parts": (TypeError, ["intervals is a whole number"], lambda p: collocated(intervals=2.5)),
    # models built in code
    "a body twice": (A, ["'x' exists already"], lambda p: bar().body("x", mass=1)),
    "a member that does not exist": (TypeError, ["'maas'", "mass"], lambda p: bar(maas=1)),
    "a centre of mass of two numbers": (ValueError, ["com: 3 values are needed, not 2"], lambda p: bar(com=(0, 1))),
    "a centre of mass of one number": (TypeError, ["com: 3 values are needed, not 1.0"], lambda p: bar(com=1.0)),
    "a kind of joint that does not exist": (WRONG, ["'hinge'", "revolute"], lambda p: bar(joint="j", kind="hinge").finish()),
    "a body on no body": (WRONG, ["unknown body 'y'"], lambda p: bar(at="y.P").finish()),
    "no body": (WRONG, ["'bodies'"], lambda p: kempe.Builder("a").finish()),
    "gravity that is NaN": (WRONG, ["gravity", "finite number"], lambda p: bar().gravity(NAN, 0, 0).finish()),
    "an expression that ends": (WRONG, ["parameter 'L'", "the expression ends"], lambda p: bar().parameter("L", "2*").finish()),
    "a body after the end": (A, ["is finished"], lambda p: (lambda b: b.finish() and b.body("y", mass=1))(bar())),
    "a name that is a number": (TypeError, ["a text is needed, not int"], lambda p: kempe.Builder(3)),
    # rolling contact, meshes
    "a contact without curvatures": (A, ["not given", "along", "poisson"], lambda p: kempe.contact.hertz(1e3)),
    "a wrong keyword of a contact": (TypeError, ["'allong'", "along"], lambda p: kempe.contact.hertz(1e3, allong=1)),
    "a law of creep that does not exist": (A, ["'kalker'", "fastsim"], lambda p: kempe.contact.creep("kalker", a=1e-3, b=1e-3)),
    "places in the wrong order": (A, ["y must ascend"], lambda p: kempe.contact.conicity([1, 0], [0, 1], 0.1)),
    "places of another length": (ValueError, ["difference has 2 values"], lambda p: kempe.contact.conicity([0, 1], [0], 0.1)),
    "a mesh without its mass": (A, ['mass="M.mtx"', 'nodes="FILE"'], lambda p: kempe.reduce(EXAMPLES.parent / "tests/models/brick.mtx")),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake(name, tmp_path):
    kind, words, call = MISTAKES[name]
    with pytest.raises(kind) as caught:
        call(tmp_path)
    message = str(caught.value)
    assert type(caught.value) is kind or issubclass(type(caught.value), kempe.Error) or kind is KeyError, type(caught.value)
    assert not [word for word in words if word not in message], message
    assert not COMMAND.search(message) and not NAMELESS.search(message), message


# A mistake with a result: words of the warning, the call.
WARNINGS = {
    "a start in degrees": (["'crank' is 60 rad", "numpy.radians"], lambda: run(q={"crank": 60})),
    "a sweep in degrees": (["'crank'", "360", "'360 deg'"], lambda: system().kinematics(sweep={"crank": (0, 360, 9)})),
    "an instance that is NaN": (["1 of 2 instances"], lambda: bars([0.3, NAN]).run(t_end=0.1)),
    "an instance that cannot close": (["1 of 2 instances"], lambda: bars([0.3, 30]).run(t_end=0.1)),
    "a row of a function that is NaN": (["1 of 1 instances"], lambda: four().function(["crank"], t_end=0.1)([[NAN]])),
    "a tolerance that is too large": (["energy error"], lambda: four().simulate(rtol=1e-2, t_end=50)),
}


@pytest.mark.parametrize("name", WARNINGS)
def test_mistake_with_a_result(name):
    words, call = WARNINGS[name]
    with pytest.warns(kempe.KempeWarning) as caught:
        call()
    told = "\n".join(str(each.message) for each in caught)
    assert not [word for word in words if word not in told], told
    assert not COMMAND.search(told), told
    assert any(each.filename == __file__ for each in caught)


def test_angles_of_several_turns_are_no_degrees():
    """The last state of a run of several turns is a start without a warning."""
    first = four().simulate(t_end=1)
    assert abs(first.q[-1, 0]) > 6.5
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        four().simulate(q=first.q[-1], qd=first.qd[-1], t_end=0.1)


def test_open_bounds_are_none():
    """A side that is None is open."""
    fitted = fit(parameters={"crank_mass": (0.1, None)})
    assert fitted.values["crank_mass"] >= 0.1


# -- options of runs that a study does not take --------------------------------------------------------------

RUNS = ("SIMULATION", "COMFORT", "STEPPER", "ENSEMBLE", "HISTORY")
GROUPS = {"OF_RUNS": RUNS, "OF_ALL": (*RUNS, "SENSITIVITY", "FLOW", "FIT", "OPTIMUM", "CYCLES")}
OPTIONS = {
    name: {study for group in groups.split(" | ") for study in GROUPS.get(group, (group.removeprefix("OF_"),))}
    for name, groups in re.findall(
        r"^KMP_RUN_OPTION\((\w+), \w+, \w+, \w+, \w+, ([\w| ]+),$", (ROOT / "src/model/data/run_options.def").read_text(), re.M
    )
}
GIVEN = {
    "t_end": 0.05, "output_step": 0.01, "max_step": 0.01, "max_steps": 1000, "fixed_step": 0.01, "rtol": 1e-6, "atol": 1e-6, "threads": 2,
    "formulation": "dae", "form": "newton", "integrator": "radau", "change_points": "ignore", "independent": "crank", "linear": "klu",
    "backend": "tape", "reference": "/absent/reference.csv", "loads": "least-norm", "reaction_peaks": "motion", "checkpoint": "/absent/run", "resume": "/absent/run",
}  # fmt: skip


def study_calls(tmp_path):
    model = kempe.Model(ROOT / "examples/four_bar/four_bar.yaml")
    ensemble, rows = model.ensemble({"crank": [0.29, 0.30]}), {"t": [0, 0.01, 0.02], "q(rocker)": [0.1, 0.11, 0.12]}
    car = kempe.Model(ROOT / "examples/quarter_car/quarter_car.yaml").system()
    slopes = {"parameters": "crank", "outputs": "q(rocker)"}
    return {
        "COMFORT": lambda options: car.comfort(vertical="qdd(body)", **options),
        "STEPPER": lambda options: model.system().stepper(**options),
        "ENSEMBLE": lambda options: ensemble.run(**options),
        "HISTORY": lambda options: ensemble.history("1", **options),
        "SENSITIVITY": lambda options: model.sensitivity(**slopes, **options),
        "STATE": lambda options: model.sensitivity(parameters="crank", of="reactions", **options),
        "FLOW": lambda options: model.flow(0.01, variables="crank", outputs="q(rocker)", **options),
        "FIT": lambda options: model.fit(data=rows, parameters={"crank_mass": (0.1, 5)}, starts=1, most=1, **options),
        "OPTIMUM": lambda options: model.optimize(minimize="max(qd(rocker))", parameters={"base": (0.89, 0.91)}, most=1, starts=1, **options),
        "CYCLES": lambda options: model.system().limit_cycles(sweep="base=0.9:0.91:2", **options),
    }


@pytest.mark.filterwarnings("ignore::kempe.KempeWarning")
def test_options_that_a_study_does_not_take(tmp_path):
    """The table says which options a study takes, and each of the others is refused by its name."""
    assert len(OPTIONS) == 25 and set(GIVEN) < set(OPTIONS)
    for study, call in study_calls(tmp_path).items():
        for option, studies in OPTIONS.items():
            if study in studies:
                continue
            own = study in ("SENSITIVITY", "STATE") and option in ("checkpoint", "resume")  # which has another reason
            of_flow = study == "FLOW" and option in ("t_end", "output_step")
            words = "no checkpoints" if own else f"give no {option}" if of_flow else f"not take the option '{option}': leave it out"
            with pytest.raises(kempe.ArgumentError, match=words):
                call({option: GIVEN.get(option, True)})


def test_options_that_a_study_takes(tmp_path):
    """None of them is refused as an option: a value may be."""
    calls = study_calls(tmp_path)
    for study in ("STEPPER", "ENSEMBLE", "HISTORY", "SENSITIVITY", "FLOW"):
        for option, value in GIVEN.items():
            if study not in OPTIONS[option]:
                continue
            try:
                calls[study]({"t_end": 0.05, option: value} if study != "FLOW" else {option: value})
            except kempe.Error as error:
                assert "not take the option" not in str(error), (study, option)


def test_steps_of_constant_length_in_ensembles():
    """Lanes choose their steps: instances with steps of constant length are separate runs."""
    ensemble = kempe.Model(ROOT / "examples/four_bar/four_bar.yaml").ensemble({"crank": [0.29, 0.30]})
    assert ensemble.run(t_end=0.1, fixed_step=0.001, no_convergence_check=True).instances["steps"].tolist() == [100, 100]


# -- one sentence for one mistake ----------------------------------------------------------------------------

ALONE = {
    "a stop in the past": lambda m: m.system().stepper(t_end=1).set_stop(-1),
    "friction of a workspace": lambda m: m.system().workspace("glue"),
    "a row of a trajectory": lambda m: m.system().outputs("q").at_row(m.system().simulate(t_end=0.01), 1000),
    "outputs of another system": lambda m: m.system().outputs("q").at_stepper(kempe.Model(CART).system().stepper(t_end=1)),
    "an open loop": lambda m: m.system().outputs("q").closed_jacobian(0, OPEN),
    "two held coordinates": lambda m: m.sensitivity(parameters="base", outputs="q(rocker)", t_end=0.1),
    "a flow of these": lambda m: m.flow(0.1, variables="base", outputs="q(rocker)")(),
}


@pytest.mark.parametrize("call", ALONE.values(), ids=ALONE)
def test_a_mistake_has_one_sentence(call):
    """Also after another mistake, and the same again."""
    model, said = kempe.Model.from_text(FOUR.read_text().replace("hold: [crank]", "hold: [crank, rocker]")), []
    for _ in range(2):
        with pytest.raises(kempe.Error) as error:
            call(model)
        said.append(str(error.value))
        with pytest.raises(kempe.Error):
            model.system().stepper(t_end=1).advance(2)
    assert said[0] == said[1] and "\n" not in said[0]
    assert said[0].count("has no derivative") < 2 and "possible choice" not in said[0]
