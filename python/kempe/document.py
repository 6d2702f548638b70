# SPDX-License-Identifier: BSD-3-Clause
"""Models as dicts: their entries, which read back, and what they have."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from typing import Any

from ._native import lib
from .context import Context
from .errors import ArgumentError
from .options import utf8

_NUMBER = re.compile(r"-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?")


class Document(dict[str, Any]):
    """The entries of a model, as a dict with the keys of the model language. `Model.from_dict` reads it, also after changes. `folder` is
    where the files are that it names."""

    def __init__(self, entries: Mapping[str, Any], folder: str = "") -> None:
        super().__init__(entries)
        self.folder = folder


def document_of(name: str, text: str, label: str, values: Mapping[str, Any]) -> Document:
    """The entries of a text in the model language, with other values of parameters and inputs. `name`: of a model without one."""
    context = Context()
    entries = _plain(json.loads(context.text(lib.python_document, context.pointer, utf8(text), utf8(label))))
    made = Document({"name": name, **entries}, os.path.dirname(os.path.abspath(label)))
    for each, value in values.items():
        _set(made, each, value)
    return made


def _plain(value: Any) -> Any:
    """Texts of numbers as numbers."""
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list):
        return [_plain(each) for each in value]
    if isinstance(value, str) and _NUMBER.fullmatch(value):
        return int(value) if value.lstrip("-").isdigit() else float(value)
    return value


def _set(document: Document, name: str, value: Any) -> None:
    if name in (document.get("inputs") or {}):
        entry = document["inputs"][name] or {}
        kept = {"unit": entry["unit"]} if "unit" in entry else {}
        given = {key: each.tolist() if hasattr(each, "tolist") else each for key, each in value.items()} if isinstance(value, dict) else {"default": value}
        document["inputs"][name] = {**kept, **given}
    elif name in (document.get("parameters") or {}):
        document["parameters"][name] = value
    else:
        raise ArgumentError(f"the value of '{name}' cannot be in the document: it belongs to a file that the model includes")


def bodies_of(model: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    keys = ("parent", "at", "joint", "mass", "com", "inertia", "points")
    return {body["name"]: {key: body[key] for key in keys if key in body} for body in model["bodies"]}


def points_of(model: Mapping[str, Any]) -> dict[str, list[float]]:
    places = {"ground": model["ground"], **bodies_of(model)}
    return {f"{body}.{name}": at for body, each in places.items() for name, at in each["points"].items()}


def joints_of(model: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    return {
        body["joint"]: {
            "body": body["name"],
            "parent": body["parent"],
            "at": body["at"],
            "coordinates": [motion["coordinate"] for motion in body["motions"]],
            "axes": [motion["axis"] for motion in body["motions"]],
        }
        for body in model["bodies"]
    }


def actuators_of(model: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Forces that depend on inputs."""
    found = {}
    for force in model["forces"]:
        words = set(re.findall(r"[^\W\d]\w*", json.dumps({key: each for key, each in force.items() if key != "name"})))
        inputs = [name for name in model.get("inputs", {}) if name in words]
        if inputs:
            found[force["name"]] = {**{key: each for key, each in force.items() if key != "name"}, "inputs": inputs}
    return found
