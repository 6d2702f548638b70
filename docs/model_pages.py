#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the tables of docs/model from the rows that drive the reader and the schema, and docs/model/index.md.

    python3 docs/model_pages.py            writes the tables and the index
    python3 docs/model_pages.py --check    fails when a page differs, or a row has no page

A table stands between `<!-- WHAT: NAME -->` and `<!-- /table -->`; WHAT is one of TABLES.
"""
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).resolve().parent
PAGES = DOCS / "model"
sys.path.insert(0, str(DOCS.parent / "schema"))
import generate_schema  # noqa: E402
import generated  # noqa: E402

MARK = re.compile(r"<!-- (\w+): ([\w ]+) -->\n(.*?)<!-- /table -->", re.S)
HEAD = """# Index of keys

The index has every key, kind, function, unit and output of the model language, with its section. The page is generated (`docs/generate_pages`).
"""
OWNERS = {"model": "model", "rope_place": "sheave or drum of a rope", "outline_arc": "arc of an outline", "cam_part": "part of the law of a cam", "cam_follower": "follower of a law", "cam_place": "cam under a follower", "edge": "joint between two bodies", "piece": "piece of a course", "irregularity": "irregularities",
          "algebraic": "implicit variables", "inertia": "inertia", "contact_friction": "friction of a contact", "film": "film of a journal",
          "flexible": "flexible body", "section": "cross-section", "taper": "taper with stations", "section_number": "cross-section by numbers", "beam_shape": "shapes of a beam", "damping": "damping of a flexible body", "file_unit": "units of a file of modes"}
FORCES = {"JOINT": "force", "LINE": "force along a line", "CYLINDER": "cylinder", "TORSION": "torsion", "SPRING": "spring", "BUSHING": "bushing", "JOINT_SPRING": "spring in a joint", "STOPS": "joint limits",
          "FRICTION": "friction", "ALONG": "force along an expression", "POINT": "force at a point", "BODY": "torque on a body"}
LAWS = {"ALONG": "by `distance` or `angle`, and `rate`; positive where it increases them", "LINE": "tension along the line, by `distance` and `rate`", "TORSION": "torque against a growing angle, by `angle` and `rate`"}
NEEDS = {"NOTHING": "", "AXIS": "`axis`", "SAME_AXIS": "`axis` or `axes`", "TWO_AXES": "`axes`", "SHAFTS": "`axis` or `axes`, `plunging`",
         "FOLLOWER": "`roller`, `knife` or `flat`; `on`", "CURVE": "`table`, `y`, `z`, `curve`, `power`", "TERMS": "`equals`", "EXPRESSION": "`power`"}
ARGUMENTS = {"CUT": "(JOINT)", "LOOP": "(LOOP)", "JOINT": "(JOINT)", "POINT": "(BODY.POINT)", "FORCE": "(FORCE)", "NOTHING": "",
             "SENSOR": "(SENSOR)", "WHEEL": "(WHEEL)", "TYRE": "(TYRE)", "BEARING": "(BEARINGS)", "ROPE": "(ROPE)", "SHEAVE": "(ROPE.k)", "OUTLINED": "(CONTACT)", "MAYBE_STATE": "(STATE)"}


# -- pages ---------------------------------------------------------------------------------------------

def anchor(title):
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def texts():
    return {page.name: page.read_text() for page in sorted(PAGES.glob("*.md")) if page.name != "index.md"}


def sections(text):
    """(title, body) of every section; the text before the first one has the title of the page."""
    parts = re.split(r"^##? (.*)\n", re.sub(r"^```.*?^```\n", "", text, flags=re.M | re.S), flags=re.M)
    return zip(parts[1::2], parts[2::2])


def places():
    """{heading: (page, title)} of all sections."""
    return {title: (page, title) for page, text in texts().items() for title, _ in sections(text)}


def heading(kind, joint=False):
    return kind.replace("_", " ").capitalize() + (" joint" if joint else "")


def link(words, title, found):
    if title not in found:
        raise KeyError(f"docs/model has no section '{title}'")
    page, title = found[title]
    return f"[{words}]({page}#{anchor(title)})"


# -- tables --------------------------------------------------------------------------------------------

def table(head, lines):
    return "\n".join([f"| {' | '.join(head)} |", "|" + "---|" * len(head), *(f"| {' | '.join(line)} |" for line in lines)]) + "\n"


SHOWN = {"frame": "word", "stiffening": "word", "coordinates": "list of names", "motions": "list", **dict.fromkeys(("values", "parameters", "set", "ports declared", "ports bound", "joints", "points", "joint", "inertia", "flexible", "beam", "beam shapes", "section", "taper", "section numbers", "damping", "interfaces", "scale of a file"), "mapping"), "nodes of a file": "mapping or word", "stations of a taper": "list of numbers", "sections of a taper": "list of mappings", "shape or list": "mapping or list"}


def value(word, unit):
    return f"{SHOWN.get(word, word)}, {unit}" if unit else SHOWN.get(word, word)


def key_lines(rows, pages=()):
    """Lines of the table; a key in `pages` links its page."""
    return [(f"[`{row.key}`]({pages[row.key]})" if row.key in pages else f"`{row.key}`", value(row.value, row.unit), row.absent, row.meaning) for row in rows]


def number_lines(macro):
    """Keys of numbers that belong to one kind of joint or closure."""
    return [(f"`{row[1]}`", f"number, {row[2]}", f"required with `{row[0]}`", row[-1].split(": ", 1)[1]) for row in generate_schema.rows("closure_numbers.def", macro)]


SECTIONS = {"include": "include.md", "parameters": "parameters.md", "inputs": "inputs.md", "states": "states.md", "tables": "tables.md", "profiles": "tracks.md#profiles",
            "tracks": "tracks.md", "algebraic": "algebraic.md", "closure_tolerance": "../diagnosis.md#rounded-drawings", "ground": "bodies.md#ground",
            "bodies": "bodies.md", "wheels": "wheels.md", "roads": "tyres.md", "tyres": "tyres.md", "joints": "graphs.md", "loops": "closures.md", "gears": "gears.md", "ropes": "ropes.md", "outlines": "outlines.md", "drives": "drives.md",
            "forces": "forces.md", "contacts": "contacts.md", "bearings": "bearings.md", "sensors": "outputs.md#sensors", "start": "start.md", "run": "run.md"}
KEY_HEAD = ("key", "value", "when absent", "meaning")


def keys(name):
    more = {"joint": "KMP_COUPLING_NUMBER", "edge": "KMP_COUPLING_NUMBER", "closure": "KMP_CLOSURE_NUMBER"}.get(name)
    return table(KEY_HEAD, key_lines(generate_schema.keys(name), SECTIONS if name == "model" else ()) + (number_lines(more) if more else []))


def product(powers):
    """[("N", 1), ("m", -1)] as N/m."""
    up = [name for name, power in powers if power > 0]
    down = [name for name, power in powers if power < 0]
    return " ".join(up or ["1"]) + ("/" + "/".join(down) if down else "")


def unit_of(kind, powers):
    """The unit of a number of a force: of a rotation and of a translation, where either may be."""
    effort, coordinate, time = powers
    units = [product([(word, power) for word, power in zip(words, (effort, coordinate, time)) if power])
             for words in (("N m", "rad", "s"), ("N", "m", "s"))]
    units = [re.sub(r"^(\S+(?: m)?)/(\w+)$", r"\1/\2", unit) for unit in units]
    return " or ".join(units) if kind in ("JOINT_SPRING", "STOPS", "FRICTION") else units[1]


def place_lines(kind, place, word):
    """The keys for the place of action and for the kind of a force."""
    rows = {row.key: row for row in generate_schema.keys("force")}
    value_of = {"spring": "mapping" if place == "joint" else "two points"}
    meaning = {"spring": "numbers of the spring, below" if place == "joint" else "its two points `[BODY.POINT, BODY.POINT]`"}
    for key in ("torque", "force"):  # "on a rotation, or three components .."
        value_of[key] = "three expressions" if kind in ("POINT", "BODY") else "expression"
        meaning[key] = LAWS.get(kind) or rows[key].meaning.split(", or ")[kind in ("POINT", "BODY")]
    meaning["pressure"] = rows["pressure"].meaning.split(": ", 1)[1]
    for key in [place, *{"NULL": (), "effort": ("torque", "force")}.get(word, (word,))]:
        absent = "one of the two" if word == "effort" and key != place else "required"
        yield f"`{key}`", value(value_of.get(key, rows[key].value), rows[key].unit), absent, meaning.get(key, rows[key].meaning)


def more_lines(kind):
    """Further keys of a kind, whose meanings begin with its name."""
    return [(f"`{row.key}`", value(row.value, row.unit), row.absent, row.meaning.split(": ", 1)[1]) for row in generate_schema.keys("force")
            if row.key in {"TORSION": ("axis",), "CYLINDER": ("rod_pressure",), "BUSHING": ("matrix", "damping_matrix", "nonsymmetric")}.get(kind, ())]


def number_line(kind, word, field):
    """A number of a force."""
    key, three, powers, required, meaning = field
    units = {row.key: row.unit for row in generate_schema.keys("force") if row.unit and word == "NULL"}
    shown = "`torque` or `force`" if key == "effort" else f"`{key}`"
    optional = {"STOPS": ("lower", "upper"), "FRICTION": ("speed", "regularise", "static", "effort", "mu", "mu_static", "radius", "flank")}.get(kind, ())
    absent = "required" if required else "none" if key in optional else "0"
    return shown, value("number or three" if three else "number", units.get(key) or unit_of(kind, powers)), absent, meaning


def force(kind):
    """The place of action, the word of the kind, its numbers."""
    place, word = next((row[2], row[3]) for row in generate_schema.rows("force_kinds.def", "KMP_FORCE") if row[0] == kind)
    named = [("`reaction`", "loop or joint", "none", generate_schema.REACTION)] if kind == "FRICTION" else []
    return table(KEY_HEAD, [*place_lines(kind, place, word), *more_lines(kind), *(number_line(kind, word, field) for field in generate_schema.fields(kind)), *named])


def motions(chain):
    """The elementary motions of a row of joints.def in words."""
    steps = re.findall(r"([RT])([abc])", chain)
    axes = {kind: [axis for what, axis in steps if what == kind] for kind in "TR"}
    along = " and ".join(", ".join(axes["T"]).rsplit(", ", 1))
    parts = {"T": f"translation along {along}", "R": "rotation about " + ", then ".join(axes["R"])}
    order = "TR" if chain.startswith("T") else "RT"
    return ", then ".join(parts[kind] for kind in order if axes[kind]) or "none"


def joint_kinds(_):
    found, cuts = places(), {row[0]: row for row in generate_schema.rows("cuts.def", "KMP_CUT")}
    lines = []
    for name, chain in generate_schema.rows("joints.def", "KMP_JOINT"):
        count = len(re.findall("[RT][abc]", chain))
        names = ["none", "`J`", "`J.1`, `J.2`"][count] if count < 3 else f"`J.1` to `J.{count}`"
        cut = f"`{cuts[name][1]}`, {cuts[name][2]}" if name in cuts else "stays in the tree"
        lines.append((link(f"`{name}`", heading(name, True), found), motions(chain) + (", coupled" if "=" in chain else ""), names, cut))
    return table(("kind", "motions", "coordinates of a joint J", "closure when cut, its rows"), lines)


def part_rows():
    """{part: rows} of the parts of closures, constraints/kinds."""
    found = {}
    for path in (DOCS.parent / "constraints/kinds").glob("*.c"):
        found.update((name, int(count)) for name, count in
                     re.findall(r"(?:const kmp_part kmp_part_|PRODUCTS\()(\w+)(?: = \{|, \d, )(\d+)", path.read_text()))
    return found


def closure_kinds(_):
    count = part_rows()
    numbers, found = {row[0]: f"`{row[1]}`" for row in generate_schema.rows("closure_numbers.def", "KMP_CLOSURE_NUMBER")}, places()
    lines = []
    for name, needs, force, moment, *_ in generate_schema.rows("closure_kinds.def", "KMP_CLOSURE"):
        rows = "1 or 2" if needs == "CURVE" else str(count.get(force, 0) + count.get(moment, 0))
        first = {"TERMS": "coordinates with factors", "EXPRESSION": "expression", "FOLLOWER": "point"}.get(needs, "two points")
        lines.append((link(f"`{name}`", heading(name), found), first, NEEDS.get(needs) if needs != "NUMBER" else numbers[name], rows))
    return table(("kind", "value", "further keys", "rows"), lines)


UNITS_OF_COORDINATES = {"q": "rad or m", "qd": "rad/s or m/s", "qdd": "rad/s^2 or m/s^2"}


def outputs(_):
    lines = []
    for _, word, argument, _, unit, meaning in generate_schema.rows("output_kinds.def", "KMP_OUTPUT"):
        of = argument[6:].replace("COORDINATE", "JOINT").removesuffix("_ABOUT")
        shown = f"`{word}`, `{word}({of})`" if argument.startswith("MAYBE") else f"`{word}{ARGUMENTS[argument]}`"
        if argument.endswith("_ABOUT"):
            shown += f", `{word}({of} about BODY.POINT)`, `{word}(about BODY.POINT)`"
        lines.append((shown, unit or UNITS_OF_COORDINATES.get(word, "by its object"), meaning))
    return table(("output", "unit", "meaning"), lines)


def measures():
    """The words of points and axes in expressions."""
    lines = []
    for _, word, argument, least, most, components, _, unit, meaning in generate_schema.rows("measures.def", "KMP_MEASURE"):
        places = {"AXIS": ("a.P.x", "b.Q.x", "a.P.z"), "POINT": ("a.P", "b.Q"), "CONTACT": ("floor",), "LOOP": ("loop",), "JOINT": ("joint",), "BEARING": ("main",), "GEAR": ("mesh",), "ROPE": ("hoist",), "SHEAVE": ("hoist.2",)}[argument]
        after = {"1": "", "3": ".x", "7": ".1.x", "9": ".x.y"}[components]
        lines.append((", ".join(f"`{word}({', '.join(places[:count])}){after}`" for count in range(int(least), int(most) + 1)), unit or "none", meaning))
    return table(("measure", "unit", "meaning"), lines)


def laws():
    """Laws of compliant contact; their formulas in the words of expressions."""
    return table(("law", "normal force", "source"),
                 [(f"`{word}`", f"`{formula}`", source) for word, _, formula, _, source in generate_schema.rows("compliant_laws.def", "KMP_COMPLIANT_LAW")])


def films():
    """Laws of the film of a journal."""
    return table(("law", "scale", "source"),
                 [(f"`{word}`", f"`{scale}`", source) for word, scale, source in generate_schema.rows("film_laws.def", "KMP_FILM_LAW")])


def rows_of(name):
    return {"outputs": outputs, "measures": lambda _: measures(), "laws": lambda _: laws(), "films": lambda _: films()}[name](name)


def kinds(name):
    return {"joints": joint_kinds, "closures": closure_kinds}[name](name)


TABLES = {"keys": keys, "force": force, "kinds": kinds, "rows": rows_of}


# -- index ---------------------------------------------------------------------------------------------

def owner(what, name):
    return f"key of {FORCES[name] if what == 'force' else OWNERS.get(name, name)}"


def title_at(target):
    """The heading at an address, relative to docs/model."""
    page, _, at = target.partition("#")
    titles = re.findall(r"^##? (.*)$", (PAGES / page).read_text(), re.M)
    return next(title for title in titles if not at or anchor(title) == at)


def written_by_hand(body):
    """(word, role) of the tables of functions, units and values of wheels."""
    for block in re.finditer(r"(?:^\|.*\n)+", body, re.M):
        rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in block.group().rstrip("\n").split("\n")]
        role, column = {"dimension": ("unit", 1), "function": ("function", 0), "contact value": ("value of `contact(WHEEL)`", 0),
                        "guidance value": ("value of `guidance(WHEEL)`", 0),
                        "pose value": ("value of `pose(WHEEL)`", 0)}.get(rows[0][0], ("", 0))
        for row in rows[2:] if role else ():
            for word in re.findall(r"`(\w+)", row[column]):
                yield word, role


def entries():
    """{(word, role): link}"""
    found, where = {}, places()
    for page, text in texts().items():
        for title, body in sections(text):
            place = f"[{title}]({page}#{anchor(title)})"
            for what, name, made in MARK.findall(body):
                words = [word for line in made.split("\n")[2:] for word in re.findall(r"`(\w+)", line.split("|")[1] if "|" in line else "")]
                if what == "rows" and name in ("laws", "films"):
                    role = "law of contact" if name == "laws" else "law of a film"
                    found.update({(line.split("`")[1], role): place for line in made.split("\n")[2:] if line})
                elif what == "rows":
                    found.update({(word, "output" if name == "outputs" else "measure"): place for word in words})
                elif what != "kinds":
                    for word in words:
                        link_of = f"[{title_at(SECTIONS[word])}]({SECTIONS[word]})" if name == "model" and word in SECTIONS else place
                        found.setdefault((word, owner(what, name)), link_of)
            for word, role in written_by_hand(MARK.sub("", body)):
                found[word, role] = place
    for name, _ in generate_schema.rows("joints.def", "KMP_JOINT"):
        found[name, "kind of joint"] = link(heading(name, True), heading(name, True), where)
    for name, *_ in generate_schema.rows("closure_kinds.def", "KMP_CLOSURE"):
        found[name, "kind of closure"] = link(heading(name), heading(name), where)
    found["angle", "output"] = next(place for (word, role), place in found.items() if role == "output")
    return found


def index():
    found = entries()
    lines = [HEAD]
    for letter in sorted({word[0].upper() for word, _ in found}):
        lines.append(f"## {letter}\n\n| word | role | section |\n|---|---|---|")
        rows = sorted((item for item in found if item[0][0].upper() == letter), key=lambda item: (item[0].lower(), item[0], item[1]))
        lines += [f"| `{word}` | {role} | {found[word, role]} |" for word, role in rows]
        lines.append("")
    return "\n".join(lines)


def made():
    """{page: text} with the tables of the rows as they are now."""
    write = lambda match: f"<!-- {match.group(1)}: {match.group(2)} -->\n{TABLES[match.group(1)](match.group(2))}<!-- /table -->"
    return {page: MARK.sub(write, text) for page, text in texts().items()}


def without_page():
    """Tables of rows that no page shows."""
    shown = {(what, name) for text in texts().values() for what, name, _ in MARK.findall(text)}
    wanted = {("keys", path.stem[:-5]) for path in generate_schema.key_tables()} - {("keys", "ground")}
    wanted |= {("force", row[0]) for row in generate_schema.rows("force_kinds.def", "KMP_FORCE") if row[2] not in ("wheel", "tyre", "contact", "state")}
    return sorted(wanted - shown)


def main(arguments):
    wrong = [f"docs/model: no page has the table '{what}: {name}'" for what, name in without_page()]
    print(*wrong, sep="\n", end="\n" if wrong else "")
    files = {PAGES / page: text for page, text in {**made(), "index.md": index()}.items()}
    return generated.settle(files, "python3 docs/model_pages.py", arguments) or (1 if wrong else 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
