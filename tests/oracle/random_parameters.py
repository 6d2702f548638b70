# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of a model that become parameters."""
import re

PLACES = (("bodies", "mass"), ("forces", "torque"), ("forces", "force"), ("forces", "mu"), ("forces", "stiffness"), ("contacts", "restitution"),
          ("contacts", "friction"), ("contacts", "lower"), ("contacts", "upper"), ("forces", "rest"), ("points", None))


def numbers_of(node, way=()):
    """The places of plain numbers, and their values."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        if isinstance(value, str) and re.fullmatch(r"-?\d+(\.\d*)?(e-?\d+)?", value):
            yield (*way, key), float(value)
        else:
            yield from numbers_of(value, (*way, key))


def give_parameters(document, random):
    """Draws up to three numbers of the model, which become parameters: their values."""
    places = [(way, value) for way, value in numbers_of(document)
              if value and any(way[0] == a and b in way or a in way and b is None for a, b in PLACES) and way[-1] != "restitution" or
              way[-1] == "restitution" and value > 0]
    # A rate that would open a loop, and a pin that only drawing closes, move the start: these are left as they are.
    chosen = random.permutation(len(places))[:3]
    document.setdefault("parameters", {})
    for k, index in enumerate(chosen):
        way, value = places[index]
        node = document
        for key in way[:-1]:
            node = node[key]
        node[way[-1]] = f"slope_p{k}"
        document["parameters"][f"slope_p{k}"] = repr(value)
    return {name: float(value) for name, value in document["parameters"].items() if name.startswith("slope_p")}
