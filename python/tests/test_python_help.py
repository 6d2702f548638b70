# SPDX-License-Identifier: BSD-3-Clause
"""Options and exceptions where help() and completion look for them."""

import inspect
import pickle
import pydoc
import re

import kempe
import pytest
from kempe._help import BASES
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
    options, _, raises = rest.partition("\n\nRaises:\n")
    assert body.strip() and re.findall(r"^    (\w+): ", options, re.M) == added
    assert re.findall(r"^    (\w+): .", raises, re.M)[0] == "TypeError" and "ArgumentError: " in raises
    assert not re.search(r"NULL|(^|\s)--[a-z]|KEMPE_", text)
    assert text.splitlines()[-1] in pydoc.plain(pydoc.render_doc(function))


def test_of_a_bound_method(four_bar):
    names = list(inspect.signature(four_bar.fit).parameters)
    assert names[:2] == ["data", "parameters"] and names[-1] == "progress" and "rtol" in names
    assert list(inspect.signature(four_bar.simulate).parameters)[:3] == ["q", "qd", "t_end"]
    bound = inspect.signature(four_bar.system().simulate).bind(t_end=1, rtol=1e-6)
    assert bound.arguments == {"t_end": 1, "rtol": 1e-6}
    with pytest.raises(TypeError):
        inspect.signature(four_bar.fit).bind(rtoll=1)


def test_signatures_are_values():
    listed = inspect.signature(kempe.Model.fit)
    assert pickle.loads(pickle.dumps(listed)).parameters == listed.parameters
    assert str(listed).startswith("(self, *, data: 'Data | None' = None, ") and str(listed).endswith(" -> 'Fit'")
    assert listed.replace(parameters=[]).return_annotation == "Fit" and listed == inspect.signature(kempe.Model.fit)
