# SPDX-License-Identifier: BSD-3-Clause
"""Displays of models and results in notebooks: small tables and pictures. They take the notebook's own colours, and pictures
are images with a white ground, so that their styles stay inside and dark themes do not hide their lines."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from typing import Any

Cells = Iterable[Iterable[Any]]


def cell(value: Any) -> str:
    """A value as text, numbers by six digits."""
    return html.escape(f"{value:.6g}" if isinstance(value, float) else str(value))


def table(head: Iterable[str], rows: Cells, caption: str = "") -> str:
    """A table; `head` may have markup, cells are values."""
    heads = "".join(f"<th>{each}</th>" for each in head)
    lines = "".join("<tr>" + "".join(f"<td>{cell(each)}</td>" for each in row) + "</tr>" for row in rows)
    title = f"<caption>{html.escape(caption)}</caption>" if caption else ""
    return f"<table>{title}" + (f"<tr>{heads}</tr>" if heads else "") + f"{lines}</table>"


def table_html(columns: Any, most: int = 10, names: Iterable[str] | None = None) -> str:
    """The first rows of a table of results, with the units of its columns."""
    chosen = [name for name in (columns if names is None else names) if name in columns.units]
    head = [f"{html.escape(name)}<br><small>{html.escape(columns.units[name])}</small>" for name in chosen]
    shown = min(columns.row_count, most)
    more = f"<p>{columns.row_count - shown} more rows</p>" if shown < columns.row_count else ""
    return table(head, ([columns[name][k] for name in chosen] for k in range(shown)), columns.name) + more


def facts(values: Mapping[str, Any]) -> str:
    """Names and values, a line each; what is empty is left out."""
    lines = "".join(
        f'<tr><th style="text-align: left">{html.escape(name)}</th><td style="text-align: left">{cell(value)}</td></tr>'
        for name, value in values.items()
        if value not in ("", None)
    )
    return f"<table>{lines}</table>"


def details(title: str, text: str, opened: bool = False) -> str:
    """A text that is shown on request, or from the beginning."""
    return f"<details{' open' if opened else ''}><summary>{html.escape(title)}</summary><pre>{html.escape(text)}</pre></details>"


def picture(svg: str) -> str:
    """A picture as an image, whose styles do not reach the rest of the page."""
    from urllib.parse import quote

    return f'<img style="max-width: 100%" alt="picture" src="data:image/svg+xml,{quote(svg)}">'


def counted(count: int, noun: str) -> str:
    """ "1 row", "2 rows".

    >>> counted(1, "body"), counted(3, "body"), counted(2, "row")
    ('1 body', '3 bodies', '2 rows')
    """
    many = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{count} {noun if count == 1 else many}"


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names with commas, the first ones if there are many."""
    all_of_them = list(names)
    rest = len(all_of_them) - most
    return ", ".join(all_of_them[:most]) + (f", and {rest} more" if rest > 0 else "")


# -- models and results -----------------------------------------------------------------------------------


def _motion(body: Mapping[str, Any]) -> str:
    names = [motion["coordinate"] for motion in body["motions"]]
    return f"{body['joint']}: {listed(names, 3)}" if names else f"{body['joint']}: fixed"


def model_html(model: Mapping[str, Any], most: int = 12) -> str:
    """Bodies with their joints, closures, and what may be varied."""
    bodies = model["bodies"]
    rows = [(body["name"], body["parent"], _motion(body), float(body["mass"])) for body in bodies[:most]]
    more = f"<p>{len(bodies) - most} more bodies</p>" if len(bodies) > most else ""
    closures = [*model.get("closures", ()), *model.get("cuts", ())]
    described = {
        "coordinates": listed(model["coordinates"]),
        "states": listed(model.get("states", ())),
        "closures": listed(f"{each['name']} ({each.get('kind', 'cut')})" for each in closures),
        "forces": listed(each["name"] for each in model.get("forces", ())),
        "inputs": listed(model.get("inputs", ())),
        "parameters": listed(f"{name} = {cell(value)}" for name, value in model.get("parameters", {}).items()),
    }
    head = ("body", "on", "joint", "mass<br><small>kg</small>")
    return table(head, rows, model["name"]) + more + facts(described)


def check_html(check: Any) -> str:
    """Degrees of freedom, redundant rows, and the range of each coordinate."""
    found = check.to_dict()
    redundant = check.redundant
    described = {
        "verdict": found["verdict"],
        "degrees of freedom": check.dof,
        "independent": listed(check.independent),
        "redundant": listed(f"{name} ({counted(rows, 'row')})" for name, rows in redundant.items()) or "none",
    }
    names = [name for name in ("coordinate", "role", "low", "high", "turns") if name in check.coordinates.units]
    return facts(described) + table_html(check.coordinates, 12, names)


def _converged(found: Mapping[str, Any]) -> str:
    check = found.get("convergence")
    if not check:
        return "not checked"
    return f"{check['result']}: {check['difference']:.1e} from a run at rtol {check['rtol']:g}"


def trajectory_html(run: Any) -> str:
    """The end of the run, its accuracy, and the curves of its rows."""
    found = run.to_dict()
    energy = found["energy"].get("drift_rel")
    described = {
        "status": f"{run.status}{': ' if run.reason else ''}{run.reason}",
        "until": f"{run.t[-1]:g} s, {counted(len(run), 'row')}" if len(run) else "no row",
        "method": " ".join(found[name] for name in ("formulation", "form", "integrator")) + f", rtol {found['rtol']:g}",
        "convergence": _converged(found),
        "closure error": f"{found['residual']['h_max']:.1e}",
        "energy error": "" if energy is None else f"{energy:.1e}",
        "work": counted(found["work"]["steps"], "step") + f", {1e3 * found['cpu_s']:.3g} ms",
    }
    return facts(described)


def comparison_html(comparison: Any) -> str:
    """The recommended method, and the time of each method at equal error."""
    found = comparison.to_dict()
    advice = found.get("advice") or {}
    words = [str(advice[name]) for name in ("formulation", "form", "integrator") if name in advice]
    described = {
        "use": f"{' '.join(words)} at rtol {advice['rtol']:g} for an error of {advice['error']:g}" if words else "",
        "runs": str(len(found["runs"])),
        "reference": (found.get("reference") or {}).get("source", ""),
    }
    errors = [level for level in found["equal_error"] if level["methods"]]
    methods: dict[str, dict[float, str]] = {}
    for level in errors:
        for method in level["methods"]:
            name = " ".join(method[each] for each in ("formulation", "form", "integrator"))
            if method.get("cpu_s") is not None:
                methods.setdefault(name, {})[level["error"]] = f"{1e3 * method['cpu_s']:.3g}"
    rows = ([name, *(times.get(level["error"], "") for level in errors)] for name, times in methods.items())
    head = ["error of q at most", *(f"{level['error']:g}" for level in errors)]
    return facts(described) + table(head, rows, "processor time, ms")


def modes_html(modes: Any) -> str:
    """Frequency and damping of each mode, what moves in it, and stability."""
    found = modes.to_dict()
    rows = [
        (
            each["index"] + 1,
            each["frequency"],
            each["damping"],
            "" if each["decay"] is None else each["decay"],
            each["moves"],
        )
        for each in found["modes"]
    ]
    head = ("mode", "frequency<br><small>Hz</small>", "damping", "decay<br><small>s</small>", "moves")
    return table(head, rows[:12], found["model"]) + facts({"stability": found["reasons"]})
