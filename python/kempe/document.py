# SPDX-License-Identifier: BSD-3-Clause
"""Models as dicts: their entries, which read back, and their parts."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ._native import lib
from .context import Context
from .machine_elements import element_text
from .errors import ArgumentError, InputError
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
    made = Document({"name": name, **_entries(text, label)}, os.path.dirname(os.path.abspath(label)))
    for each, value in values.items():
        _set(made, each, value)
    return made


def _entries(text: str, label: str) -> dict[str, Any]:
    context = Context()
    found: dict[str, Any] = _plain(json.loads(context.text(lib.python_document, context.pointer, utf8(text), utf8(label))))
    return found


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
    """Another value of a parameter or input, in the entry of the file that is included where it belongs to one."""
    value = _listed(value)
    if name in (document.get("inputs") or {}):
        entry = document["inputs"][name] or {}
        kept = {key: entry[key] for key in ("unit", "default") if key in entry}
        given = _samples(value)
        document["inputs"][name] = {**kept, **(given if isinstance(given, dict) else {"default": given})}
    elif name in (document.get("parameters") or {}):
        document["parameters"][name] = value
    else:
        entry, own = _include_of(document, document.folder, name)
        entry["set"] = {**(entry.get("set") or {}), own: _samples(value)}


def _listed(value: Any) -> Any:
    """A value without arrays."""
    if isinstance(value, dict):
        return {key: _listed(each) for key, each in value.items()}
    return value.tolist() if hasattr(value, "tolist") else value


def _samples(value: Any) -> Any:
    """Samples of an input that are a text, FILE:COLUMN:METHOD, as a mapping."""
    parts = value.rsplit(":", 2) if isinstance(value, str) else []
    return dict(zip(("csv", "value", "method"), (os.path.abspath(parts[0]), *parts[1:])), t="t") if len(parts) == 3 else value


def _include_of(entries: Mapping[str, Any], folder: str, name: str) -> tuple[dict[str, Any], str]:
    """The entry of the included file that has a parameter or input, or includes one that has it; and its name there."""
    for entry in entries.get("include") or ():
        own = name.removeprefix(str(entry.get("prefix") or ""))
        if own != name or not entry.get("prefix"):
            file = str(entry["file"])
            path = file if file.startswith("kempe:") else os.path.join(folder, file)
            if _has(path, own):
                return entry, own
    raise ArgumentError(f"the value of '{name}' cannot be in the document: neither the model nor a file that it includes has it")


def _has(path: str, name: str) -> bool:
    """A model file has a parameter or input, or includes one that has it."""
    if path.startswith("kempe:"):
        text = element_text(path)
    else:
        with open(path, encoding="utf-8") as file:
            text = file.read()
    try:
        entries = _entries(text, path)
        if any(name in (entries.get(section) or {}) for section in ("parameters", "inputs")):
            return True
        _include_of(entries, os.path.dirname(path), name)
    except (ArgumentError, InputError):  # it has not, or is in another format
        return False
    return True


def set_robots(document: Document, base: str | None, limits: bool, left_out: Sequence[str]) -> None:
    """Settings of a reading, in the entries of robots in other formats that the document includes."""
    for entry in document.get("include") or ():
        if str(entry["file"]).endswith((".yaml", ".yml")):
            continue
        if base is not None:
            entry.setdefault("base", base)
        if limits:
            entry.setdefault("joint_limits", "yes")
        if left_out:
            entry["leave_out"] = [*left_out, *(name for name in entry.get("leave_out") or () if name not in left_out)]


def set_start(document: Document, before: Mapping[str, Any], now: Mapping[str, Any], q: bool, qd: bool, states: Iterable[str]) -> None:
    """The start of a model in place of the one before: all of its q, or all of its rates, and values of states."""
    start = document["start"] = dict(document.get("start") or {})
    if q:
        start["q"], start["hold"] = now["q"], now["hold"]
        start["goals"] = dict.fromkeys(before["goals"])  # None: not a goal, also of an included file
        if start.get("elastic") == "static" and not now["statics"]:
            start["elastic"] = "held"
    if now["at"] != before["at"]:
        start["at"] = now["at"]
    if qd:
        start["qd"] = {**dict.fromkeys(before["qd"]), **now["qd"]}
    given = {name: now["states"][name] for name in states}
    if given:
        start["states"] = {**(start.get("states") or {}), **given}


def set_values(document: Document, row: Mapping[str, Any]) -> None:
    """The values of an instance, the first columns of its row of results, in place of the document's."""
    for name, value in row.items():
        if name == "status":  # the first column of results
            return
        name = name.removeprefix("value.")  # for columns of starts, where the column of the end has the same name
        kind, _, coordinate = name.partition(".")
        section = {"q": "q", "qd": "qd", "state": "states"}.get(kind, "")
        if section and coordinate:
            start = document["start"] = dict(document.get("start") or {})
            start[section] = {**(start.get(section) or {}), coordinate: float(value)}
        else:
            _set(document, name, float(value))


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
