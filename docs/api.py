#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/api: a page for each public header from its comments, and an index of all functions and types.

    python3 docs/api.py            writes the pages
    python3 docs/api.py --check    fails when a page differs from its header
"""
import pathlib
import re
import sys

import generated

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGES = ROOT / "docs/api"
# The order of use: the core, models, one mechanism, motion, linear analyses, parameters, wheels, programming.
ORDER = """kempe table build settings check workspace stepper compare kinematics equilibrium inverse linearize modes limit_cycles response
sensitivity gradient fit optimize ensemble rolling_contact vehicle comfort reduce output_handles extend generate runtime""".split()
HEADERS = sorted((path.stem for path in (ROOT / "include/kempe").glob("*.h")), key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))
TOKEN = re.compile(r"\s*(?:(/\*.*?\*/)|(#(?:[^\n\\]|\\\n|\\.)*)|(extern \"C\" \{|\}(?=\s*(?:#endif|\Z))))", re.S)


class Item:
    """A comment with the declarations that it describes."""

    def __init__(self, comment, section):
        self.comment, self.section, self.declarations = comment, section, []

    def names(self):
        return [name for declaration in self.declarations for name in [name_of(declaration)] if name]


def text_of(comment):
    """The lines of a comment without its stars; indented ones are code."""
    body = re.sub(r"^/\*+|\*+/$", "", comment)
    lines = [re.sub(r"^\s*\* ?", "", line) if k else line.lstrip() for k, line in enumerate(body.split("\n"))]
    return "\n".join(line.rstrip() for line in lines).strip("\n").rstrip()


def declaration_at(text, at):
    """The end of the declaration or inline function that begins there."""
    depth = 0
    for k in range(at, len(text)):
        depth += (text[k] == "{") - (text[k] == "}")
        if depth == 0 and (text[k] == ";" or (text[k] == "}" and not re.match(r"\}\s*\w+\s*;", text[k:]))):
            return k + 1
    raise ValueError(text[at:at + 80])


def name_of(declaration):
    plain = re.sub(r"/\*.*?\*/", "", declaration, flags=re.S)
    define = re.match(r"#define (\w+)", plain)
    if define:
        return define.group(1)
    if plain.startswith("typedef"):
        found = re.search(r"(\w+)\(", plain) if "{" not in plain and "(" in plain else re.search(r"(\w+)\s*;\s*$", plain)
        return found.group(1)
    return re.search(r"(\w+)\(", plain).group(1)


def is_public(declaration):
    return not name_of(declaration).endswith("_") and not re.match(r"KEMPE_RUNTIME_INLINE", declaration)


def items(text):
    """(introduction, items) of a header: sections, comments and what follows them."""
    text = re.sub(r"^KEMPE_(BEGIN|END)$", "", text[text.index("*/") + 2:], flags=re.M)
    introduction = re.match(r"\s*(/\*.*?\*/)", text, re.S)
    at, section, found, comment = introduction.end(), "", [], None
    while at < len(text.rstrip()):
        token = TOKEN.match(text, at)
        if token and token.group(1):
            title = re.match(r"/\* -- (.*?) -+ \*/", token.group(1))
            if title:
                section, comment = title.group(1), None
            else:
                comment = token.group(1) if token.group(1).startswith("/**") else None
            at = token.end()
        elif token:
            if re.match(r"#define KEMPE_VERSION", token.group(2) or ""):
                add(found, re.sub(r"\s+", " ", token.group(2)), None, section, text, at)
            at = token.end()
        else:
            at += len(re.match(r"\s*", text[at:]).group())
            end = declaration_at(text, at)
            if is_public(text[at:end]):
                add(found, text[at:end], comment, section, text, at)
            comment, at = None, end
    return text_of(introduction.group(1)), with_opaque_types(found)


def with_opaque_types(found):
    """`typedef struct kempe_model kempe_model;` is described with the functions after it."""
    kept = []
    for item in found:
        before = kept[-1] if kept else None
        if (before and re.match(r"typedef struct (\w+) \1;", before.declarations[-1]) and not is_type(item.declarations[0])
                and not before.comment and before.section == item.section):
            before.comment, before.declarations = item.comment, before.declarations + item.declarations
        else:
            kept.append(item)
    return kept


def add(found, declaration, comment, section, text, at):
    """Declarations that follow each other without a comment or an empty line share the comment of the first."""
    near = not re.search(r"\n\s*\n\s*$", text[:at]) and not re.search(r"\*/\s*$", text[:at])
    if comment or not found or found[-1].section != section or (is_type(declaration) or is_type(found[-1].declarations[0])):
        near = False
    if not near:
        found.append(Item(text_of(comment) if comment else "", section))
    found[-1].declarations.append(declaration)


def is_type(declaration):
    return declaration.startswith("typedef") and "{" in declaration


def tidy(declaration):
    """A declaration as users write it: without export macros and, of an inline function, without its body."""
    plain = re.sub(r"/\*.*?\*/", "", declaration, flags=re.S)
    plain = re.sub(r"^(KEMPE_API|KEMPE_RUNTIME_UNUSED) ", "", plain)
    if not plain.startswith("typedef") and not plain.startswith("#"):
        plain = re.sub(r"\s*\{.*\}$", ";", plain, flags=re.S)
    shift = len(declaration) - len(re.sub(r"^(KEMPE_API|KEMPE_RUNTIME_UNUSED) ", "", declaration))
    return re.sub(rf"\n {{{shift}}}", "\n", plain) if shift else plain


def members(declaration):
    """(name, type or value, description) of the members of a struct or an enum."""
    body = declaration[declaration.index("{") + 1:declaration.rindex("}")]
    end = "," if "enum" in declaration[:declaration.index("{")] else ";"
    rows, at = [], 0
    while body[at:].strip():
        match = re.compile(r"\s*(?:/\*(.*?)\*/)?\s*([^;,/]*(?:,[^;/]*)?)(;|,|(?=\s*/\*)|\s*\Z)[ \t]*(?:/\*(.*?)\*/)?" if end == ";" else
                           r"\s*(?:/\*(.*?)\*/)?\s*([^,/]*)(,|(?=\s*/\*)|\s*\Z)\s*(?:/\*(.*?)\*/)?", re.S).match(body, at)
        before, words, _, after = match.groups()
        if match.end() == at:
            raise ValueError(body[at:])
        at = match.end()
        words = " ".join(words.split())
        comment = " ".join(re.sub(r"\n\s*\* ?", " ", before or after or "").split())
        if not words:
            continue
        if end == ",":
            name, _, value = words.partition(" = ")
            rows.append((name, value, comment))
        else:
            kind, name = re.match(r"(.*?[ *])((?:\**\w+(?:\[\w*\])*(?:, )?)+)$", words).groups()
            stars = re.match(r"\**", name).group()
            rows.append((name[len(stars):], f"{kind.strip()} {stars}".strip(), comment))
    return rows


def title_of(page):
    """The title of a page of docs, in lower case unless it is a name."""
    title = (PAGES.parent / f"{page}.md").read_text().split("\n")[0].lstrip("# ")
    return title if re.search(r"[A-Z]", title[1:]) else title.lower()


def linked(text, where, page, own=()):
    """Names of functions and types become links to their descriptions, other C names become code."""
    def link(match):
        name = match.group()
        if name in where and name not in own:
            header, anchor = where[name]
            return f"[`{name}`]({'' if header == page else header + '.md'}#{anchor})"
        return f"`{name}`" if name.startswith(("kempe_", "KEMPE_")) else name
    parts = re.split(r"(`[^`]*`)", text)
    prose = r"docs/([\w/]+)\.md|(?<![\w/])(\w+)\.h\b(?=:)|\b(?:kempe|KEMPE)_\w+\b"
    page_of = lambda m: f"[{title_of(m.group(1))}](../{m.group(1)}.md)" if m.group(1) else (
        f"[{m.group(2)}.h]({m.group(2)}.md):"[:-1] if m.group(2) in HEADERS else link(m))
    return "".join(part if k % 2 else re.sub(prose, page_of, part.replace("<", "&lt;").replace("*", r"\*")) for k, part in enumerate(parts))


def paragraphs(text, where, page, own=()):
    """A comment as Markdown: code blocks stay, prose is linked."""
    out, code = [], False
    for line in text.split("\n"):
        code = line.startswith("    ") if line else code
        table = re.match(r"    (\w+\.h|context|model|system|simulate) ", line)
        out.append(line if code and not (table and page == "kempe") else line)
    blocks = re.split(r"\n\s*\n", "\n".join(out))
    return "\n\n".join(block if block.startswith("    ") else split_code(block, where, page, own) for block in blocks)


def split_code(block, where, page, own):
    """Prose with a code block right after it gets an empty line between the two."""
    lines = block.split("\n")
    prose = [line for line in lines if not line.startswith("    ")]
    code = [line for line in lines if line.startswith("    ")]
    named = [k for k, line in enumerate(prose) if re.match(r'"\w+"[:,]', line)]
    if len(named) > 1:  # a line for each table that a function gives
        prose = [("\n" if k == named[0] else "") + "- " + line if k in named else ("  " + line if k > named[0] else line)
                 for k, line in enumerate(prose)]
    text = linked("\n".join(line.rstrip() if len(named) > 1 else line.strip() for line in prose), where, page, own)
    return text + ("\n\n" + "\n".join(code) if code else "")


def table(item, where, page):
    rows = members(item.declarations[0])
    enum = re.match(r"typedef enum", item.declarations[0])
    cell = lambda text: linked(text, where, page, item.names()).replace("|", r"\|") if text else ""
    if enum:
        numbered = any(value for _, value, _ in rows)
        head = "| constant | value | meaning |\n|---|---|---|" if numbered else "| constant | meaning |\n|---|---|"
        lines = [f"| `{name}` | " + (f"{value} | " if numbered else "") + f"{cell(comment)} |" for name, value, comment in rows]
    else:
        head = "| member | type | meaning |\n|---|---|---|"
        lines = [f"| `{name}` | `{kind}` | {cell(comment)} |" for name, kind, comment in rows]
    return "\n".join([head, *lines])


def described(item, where, page):
    own = item.names()
    parts = [f"### {own[0]}"]
    if is_type(item.declarations[0]):
        kind = re.match(r"typedef (\w+)", item.declarations[0]).group(1)
        parts.append(f"    typedef {kind} {own[0]}")
    else:
        parts.append("\n".join(f"    {line}".rstrip() for declaration in item.declarations for line in tidy(declaration).split("\n")))
    if item.comment:
        parts.append(paragraphs(item.comment, where, page, own))
    if is_type(item.declarations[0]):
        parts.append(table(item, where, page))
    return "\n\n".join(parts)


def header_page(name, introduction, found, where):
    parts = [f"# kempe/{name}.h", f"From [include/kempe/{name}.h](../../include/kempe/{name}.h); all headers: [C API](README.md).",
             paragraphs(introduction, where, name)]
    section = None
    for item in found:
        if item.section != section or section is None:
            section = item.section
            parts.append(f"## {section[:1].upper()}{section[1:]}" if section else "## Declarations")
        parts.append(described(item, where, name))
    return "\n\n".join(parts) + "\n"


def first_sentence(text):
    paragraph = " ".join(re.split(r"\n\s*\n", text)[0].split())
    return re.split(r"(?<=\.)\s", paragraph)[0].rstrip(":.") + "."


def index(read, where):
    parts = ["# C API", "The pages of this folder are generated from the comments of the public headers (`python3 docs/api.py`). "
             "[Library](../library.md) has a first program and the installation.", "| header | content |\n|---|---|\n" + "\n".join(
                 f"| [{name}.h]({name}.md) | {first_sentence(read[name][0])} |" for name in HEADERS)]
    functions, types = {}, {}
    for name, (header, anchor) in where.items():
        declaration = next(d for item in read[header][1] for d in item.declarations if name_of(d) == name)
        if declaration.startswith("#") or name.startswith("KEMPE_"):
            continue
        (types if declaration.startswith("typedef") else functions)[name] = f"| [`{name}`]({header}.md#{anchor}) | {header}.h |"
    for title, rows in (("Functions", functions), ("Types", types)):
        parts.append(f"## {title}")
        parts.append("| name | header |\n|---|---|\n" + "\n".join(rows[name] for name in sorted(rows)))
    return "\n\n".join(parts) + "\n"


def pages():
    """The text of every page by its file name."""
    read = {name: items((ROOT / f"include/kempe/{name}.h").read_text()) for name in HEADERS}
    where = {}
    for header, (_, found) in read.items():
        anchors = []
        for item in found:
            anchor = item.names()[0].lower()
            anchors.append(anchor)
            repeated = f"-{anchors.count(anchor) - 1}" if anchors.count(anchor) > 1 else ""  # as repository hosts number them
            where.update({name: (header, anchor + repeated) for name in item.names()})
    made = {f"{name}.md": header_page(name, *read[name], where) for name in HEADERS}
    made["README.md"] = index(read, where)
    return made


def main(arguments):
    made = {PAGES / name: text for name, text in pages().items()}
    old = set(PAGES.glob("*.md")) - set(made)
    if old and arguments == ["--check"]:
        print("no header has the page", *sorted(path.name for path in old))
        return 1
    for page in old:
        page.unlink()
    return generated.settle(made, "python3 docs/api.py", arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
