#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/gallery.md from the pages of the examples: title, picture, first sentences and first command of each.

    python3 docs/gallery.py            writes the page
    python3 docs/gallery.py --check    fails when an example says something else
"""
import pathlib
import re
import sys

import generated

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/gallery.md"
HEAD = """# Gallery

This page is generated from the pages of the examples (`python3 docs/gallery.py`). The [table of examples](../examples/README.md)
lists the features of each model. [Notebooks](../examples/notebooks/README.md) use some of them from Python.
"""
GROUPS = (  # title, examples; an example in no group is an error
    ("Planar linkages", "four_bar crank_rocker slider_crank driven_slider_crank loose_pin loose_slider chebyshev peaucellier jansen_leg stephenson coupler_fit "
                        "double_four_bar n_four_bar andrews toggle_press flexible_pendulum unbalanced_shaft"),
    ("Spatial mechanisms", "bennett bricard slider_crank_spatial spatial_slider_crank flexible_slider_crank n_four_bar_spatial governor flexible_blade"),
    ("Robots", "parallel_robot stewart delta_robot excavator hydraulic_excavator cart_pole stick_slip jansen_walker robot_leg flexible_robot"),
    ("Drives", "crane scissor_lift gearbox geneva_drive ratchet_jack valve_train planetary_gearbox clutch_start"),
    ("Rolling on surfaces", "bowling_ball"),
    ("Cars", "quarter_car quarter_car_on_tyre ride car_axis double_wishbone suspension half_shaft limousine"),
    ("Wheels on rails", "cooperrider wheelset rolling_wheel restrained_wheelset manchester conicity manchester_vehicle curving bogie bogie_track tram flexible_car"),
)


def sentence(text):
    """The first sentence of a page that says more than its source, without links, which lead elsewhere from here."""
    paragraph = " ".join(text.split("\n\n")[0].split())
    balanced = lambda end: paragraph.count("(", 0, end) == paragraph.count(")", 0, end)
    ends = [m.end() for m in re.finditer(r"\.(?=\s+[A-Z`]|$)", paragraph) if balanced(m.start())]
    sentences = [paragraph[begin:end].strip() for begin, end in zip([0, *ends], ends)] or [paragraph.rstrip(":") + "."]
    first = next((s for s in sentences if not re.match(r"The model is (a )?(benchmark|case)", s)), sentences[0])
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", first)


def command(text):
    """The first command of a page, from the root of the repository."""
    for block in re.findall(r"(?:^    .*\n)+", text, re.M):
        folder = re.search(r"^    cd (\S+)", block, re.M)
        found = re.search(r"^    (kempe .*|build/release/\S+.*)", block, re.M)
        if found:
            path = f"{folder.group(1)}/" if folder else ""
            return re.sub(r"(?<= )([\w/]+\.yaml)", lambda m: path + m.group(1), found.group(1))
    raise ValueError("no command")


def entry(name):
    text = (ROOT / f"examples/{name}/README.md").read_text()
    title, rest = re.match(r"# ([^\n]*)\n\n(.*)", text, re.S).groups()
    words, picture = re.match(r"!\[(.*?)\]\((.*?)\)\n\n", rest).groups()
    body = re.sub(r"^!\[.*?\]\(.*?\)\n\n", "", rest)
    return (f"### {title}\n\n[![{words}](../examples/{name}/{picture})](../examples/{name}/README.md)\n\n{sentence(body)}\n"
            f"[Features](../examples/{name}/README.md): {features()[name]}.\n\n"
            f"    {command(text)}\n")


def features():
    """The subject of each example, by its folder, from the table of examples."""
    return dict(re.findall(r"^\| \[(\w+)\].*\| (.*) \|$", (ROOT / "examples/README.md").read_text(), re.M))


def page():
    parts = [HEAD]
    for title, names in GROUPS:
        parts += [f"## {title}\n", *(entry(name) for name in names.split())]
    return "\n".join(parts)


def main(arguments):
    there = {path.parent.name for path in ROOT.glob("examples/*/README.md") if any(path.parent.glob("*.yaml"))}
    listed = {name for _, names in GROUPS for name in names.split()}
    if there != listed:
        print("docs/gallery.py: GROUPS and the folders of examples differ:", *sorted(there ^ listed))
        return 1
    return generated.settle({PAGE: page()}, "python3 docs/gallery.py", arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
