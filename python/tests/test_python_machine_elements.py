# SPDX-License-Identifier: BSD-3-Clause
"""The library of machine elements from Python, and models that include them as dicts."""
import kempe
import pytest

MACHINE = {
    "kempe": 1,
    "include": [{"file": "kempe:gas_spring.yaml", "prefix": "g_", "ports": {"P": "ground.P", "Q": "a.Q"}}],
    "ground": {"points": {"P": [0, 0, 0]}},
    "bodies": {"a": {"joint": {"prismatic": "x", "at": "ground"}, "mass": 1, "points": {"Q": [0, 0, 0]}}},
    "drives": {"hold": {"joint": "a", "displacement": 0.35}},
    "run": {"t_end": 0.01, "outputs": ["force(g_force)"]},
}


def test_elements_have_texts():
    assert "kempe:gas_spring.yaml" in kempe.elements()
    for name in kempe.elements():
        text = kempe.element_text(name)
        assert text.startswith("kempe: 1\n# ") and "\nports: {" in text and "\nname: " in text
    with pytest.raises(kempe.FileError, match="no element of this name; did you mean 'kempe:gas_spring.yaml'"):
        kempe.element_text("kempe:gas_sprin.yaml")


def test_models_of_elements_are_documents():
    model = kempe.Model.from_dict(MACHINE, g_F1="200 N")
    run = model.simulate()
    assert run["force(g_force)"][-1] == pytest.approx(-513.9382133706 / 2, rel=1e-12)
    document = model.to_dict()
    assert document["include"][0]["set"] == {"F1": "200 N"}
    again = kempe.Model.from_dict(document).simulate()
    assert (again["force(g_force)"] == run["force(g_force)"]).all()
