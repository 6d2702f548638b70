# SPDX-License-Identifier: BSD-3-Clause
"""Options and exceptions where help() and completion look for them."""

import ast
import builtins
import inspect
import pickle
import pydoc
import re
import textwrap

import kempe
import kempe.exudyn
import kempe.gymnasium
import kempe.optimal
import pytest
from kempe._help import BASES
from kempe.context import Owned
from kempe.options import _plan

OWNERS = {"Model": kempe.Model, "System": kempe.System, "Ensemble": kempe.Ensemble}
STUDIES = [
    (function, re.search(r"Unpack\[(\w+)\]", function.__annotations__["options"])[1])
    for owner in OWNERS.values()
    for function in vars(owner).values()
    if "Unpack" in str(getattr(function, "__annotations__", {}).get("options", ""))
] + [(kempe.reduce, "ReduceOptions")]


def test_all_studies_are_here():
    assert len(STUDIES) > 25 and {name for _, name in STUDIES} | {"FolderOptions"} == set(BASES)


@pytest.mark.parametrize("function, name", STUDIES, ids=lambda each: getattr(each, "__qualname__", each))
def test_signature_and_help(function, name):
    struct = "kempe_" + re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()
    listed = inspect.signature(function).parameters
    assert not any(each.kind is inspect.Parameter.VAR_KEYWORD for each in listed.values())
    accepted = {*_plan(struct).names, "progress"}
    assert accepted <= set(listed), accepted - set(listed)
    added = [each.name for each in listed.values() if each.kind is inspect.Parameter.KEYWORD_ONLY and each.name in accepted]
    text = inspect.getdoc(function)
    body, _, rest = text.partition("Options (None: not given):\n")
    options, _, raises = rest.partition("\n\n")
    assert body.strip() and re.findall(r"^    (\w+): ", options, re.M) == added
    assert re.findall(r"^Raises (\w+) if .", raises, re.M)[:2] == ["TypeError", "ArgumentError"]
    assert not re.search(r"NULL|(^|\s)--[a-z]|KEMPE_", text)
    assert text.splitlines()[-1] in pydoc.plain(pydoc.render_doc(function))


def test_of_a_bound_method(four_bar):
    names = list(inspect.signature(four_bar.fit).parameters)
    assert names[:2] == ["data", "parameters"] and names[-1] == "progress" and "rtol" in names
    assert list(inspect.signature(four_bar.simulate).parameters)[:4] == ["q", "qd", "at", "t_end"]
    bound = inspect.signature(four_bar.system().simulate).bind(t_end=1, rtol=1e-6)
    assert bound.arguments == {"t_end": 1, "rtol": 1e-6}
    with pytest.raises(TypeError):
        inspect.signature(four_bar.fit).bind(rtoll=1)


def test_signatures_are_values():
    listed = inspect.signature(kempe.Model.fit)
    assert pickle.loads(pickle.dumps(listed)).parameters == listed.parameters
    assert str(listed).startswith("(self, *, data: 'Data | None' = None, ") and str(listed).endswith(" -> 'Fit'")
    assert listed.replace(parameters=[]).return_annotation == "Fit" and listed == inspect.signature(kempe.Model.fit)


# Exceptions in docstrings.


def members(owner, prefix):
    """(name, function) of the public functions and methods of a class or module, and of calls and items of its objects."""
    for name, member in vars(owner).items():
        function = getattr(member, "__func__", member)
        if inspect.isfunction(function) and (name[0] != "_" or name in ("__call__", "__getitem__")):
            yield f"{prefix}.{name}", function


def public():
    """(name, class or function) of all that is public."""
    owners = {name: getattr(kempe, name) for name in kempe.__all__}
    owners |= {f"gymnasium.{name}": getattr(kempe.gymnasium, name) for name in kempe.gymnasium.__all__}
    owners |= {"optimal.ilqr": kempe.optimal.ilqr, "optimal.collocate": kempe.optimal.collocate, "read_exudyn": kempe.exudyn.read_exudyn}
    found = {}
    for name, owner in owners.items():
        if inspect.ismodule(owner):
            found |= {each: function for each, function in members(owner, name) if function.__module__ == owner.__name__}
        else:
            found[name] = owner
            for base in owner.__mro__ if inspect.isclass(owner) else ():
                if base.__module__.startswith("kempe"):
                    found |= dict(members(base, base.__name__))
    return found


PUBLIC = public()

# Functions that raise nothing, beyond an argument of another type, each with the reason.
SILENT = {
    "Columns.to_dict": "It copies references.",
    "Contacts.zone_count": "A wheel that does not exist has no zones.",
    "Equilibrium.is_stable": "An equilibrium that does not exist is undecided.",
    "Equilibrium.loads_not_unique": "An equilibrium that does not exist has no loads.",
    "Equilibrium.stability": "An equilibrium that does not exist has no word.",
    "FrozenTable": "It keeps its arguments.",
    "LimitCycles.count": "A branch that does not exist has no cycles.",
    "Model.parsed": "It prints what is there.",
    "Result.tables_and_matrices": "It lists attributes.",
    "Result.text": "It prints what is there.",
    "Result.to_dict": "It prints what is there.",
    "elements": "They are a part of the library.",
    "Stepper.keep_inputs": "It sets a flag.",
    "VectorEnvironment.close_extras": "It waits for threads.",
    "about": "It reads what is installed with the package.",
    "gymnasium.Values": "It keeps its arguments.",
}


def makes_nothing(owner):
    """Classes whose constructor only keeps its arguments, or is not for users, who have objects from methods."""
    if not inspect.isclass(owner):
        return False
    return issubclass(owner, (tuple, dict, BaseException)) or (issubclass(owner, Owned) and owner.__init__ is Owned.__init__)


@pytest.mark.parametrize("name", PUBLIC)
def test_exceptions_are_named(name):
    said = re.findall(r"\bRaises (?:the exceptions of|\w+)", PUBLIC[name].__doc__ or "")
    assert bool(said) != (name in SILENT or makes_nothing(PUBLIC[name])), said


def test_the_silent_are_public():
    assert set(SILENT) <= set(PUBLIC)


@pytest.mark.parametrize("name", PUBLIC)
def test_what_the_source_raises_is_named(name):
    owner = vars(PUBLIC[name]).get("__init__") if inspect.isclass(PUBLIC[name]) else PUBLIC[name]
    if not inspect.isfunction(owner) or makes_nothing(PUBLIC[name]):
        return
    tree = ast.parse(textwrap.dedent(inspect.getsource(owner)))
    raised = {each.exc.func.id for each in ast.walk(tree) if isinstance(each, ast.Raise) and isinstance(each.exc, ast.Call) and isinstance(each.exc.func, ast.Name)}
    words = set(re.findall(r"\w+", PUBLIC[name].__doc__))
    assert {each for each in raised if each[0].isupper()} <= words


@pytest.mark.parametrize("name", PUBLIC)
def test_exceptions_exist_and_have_one_form(name):
    text = re.sub(r"^ *>>> .*?(?=\n\n|\Z)", "", PUBLIC[name].__doc__ or "", flags=re.M | re.S)  # without examples
    assert not re.search(r"(?:Error|Interrupted): |\b(?:is|are) an? \w*Error\b|\b(?:Error|Interrupted) (?:names|has)\b", text)
    for word in re.findall(r"\b[A-Z]\w*(?:Error|Exception)\b|\bInterrupted\b", text):
        assert hasattr(kempe, word) or hasattr(builtins, word), word
