# SPDX-License-Identifier: BSD-3-Clause
# Settings of Sphinx for docs/site/pages.py. Equations become HTML while the site is built (KaTeX in node), so that pages
# need no script for them, and a mistake in an equation is an error of the build.
import gc
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import yaml
from docutils import nodes
from sphinx.errors import SphinxError

gc.disable()  # trees of pages are large and few are dropped: to search them for cycles takes long and frees little
SITE = pathlib.Path(__file__).parent
sys.path.insert(0, str(SITE))
SCRIPTS = pathlib.Path("/usr/share/javascript")
KATEX = SCRIPTS / "katex"

project = "Kempe"
copyright = "the authors of Kempe, BSD-3-Clause"
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
myst_ref_domains = ["std"]  # links are to pages and headings; parsers of C and C++ would look for names in each of them
root_doc = "index"
html_theme = "furo"
html_title = "Kempe"
html_logo = html_favicon = "mark.svg"
html_static_path = ["style.css"]
html_css_files = ["katex/katex.min.css", "style.css"]
html_copy_source = False
html_use_index = False
html_show_sphinx = False
html_show_search_summary = False  # a browser fetches no page of a file
html_math_renderer = "katex"
# The theme as Debian has it knows no dark colours: these are those of result pages (src/report/web/report.css).
DARK = {"foreground-primary": "#e6eaec", "foreground-secondary": "#b3bdc3", "foreground-muted": "#9aa6ad", "foreground-border": "#6b767d",
        "background-primary": "#14181b", "background-secondary": "#1c2226", "background-hover": "#263037", "background-hover--transparent": "#26303700",
        "background-border": "#323b41", "background-item": "#4a555c", "brand-primary": "#7ab8f5", "brand-content": "#7ab8f5", "problematic": "#ff8d80",
        "highlighted-background": "#1d3550", "highlight-on-target": "#3d3a1c", "guilabel-background": "#1d355080", "guilabel-border": "#32587f80"}
html_theme_options = {"navigation_with_keys": True, "dark_css_variables": {f"color-{name}": colour for name, colour in DARK.items()}}
highlight_language = "text"
pygments_style = "friendly"

COMMAND = r"(kempe|python3|cmake|ctest|cd|docs/\w+|\./\w+|build/\w+/kempe|octave|make|cc|gcc|export) ?"
LANGUAGES = (  # of an indented block, by how it begins
    ("python", r"(import|from) [a-z]|\w+(, \w+)* = (kempe|model|system|run)\b"),
    ("c", r"#include|#define|typedef|(static )?(inline )?(const )?(kempe_\w+|int|void|double) \**\w+|KMP_\w+\(|/\*"),
    ("yaml", r"kempe: 1|[\w.]+:( |\n)"),
    ("console", r"\$ "),
    ("bash", COMMAND),
)


def language_of(text):
    """Outputs have none, also below their command."""
    name = next((name for name, start in LANGUAGES if re.match(start, text)), "text")
    if name == "bash" and not all(re.match(rf"{COMMAND}|[#\s\w]+=|\s|#|$", line) for line in text.splitlines()):
        return "text"
    if name == "yaml":
        try:
            return "yaml" if not text.startswith("usage:") and isinstance(yaml.safe_load(text), dict) else "text"
        except yaml.YAMLError:
            return "text"
    return name


class Katex:
    """One process of node that turns an equation a line into HTML."""

    process = None

    @classmethod
    def render(cls, source, display):
        if cls.process is None:
            cls.process = subprocess.Popen(["node", str(SITE / "katex_lines.js"), str(KATEX / "katex.js")], stdin=subprocess.PIPE,
                                           stdout=subprocess.PIPE, text=True)
        print(json.dumps({"source": source, "display": display}), file=cls.process.stdin, flush=True)
        answer = json.loads(cls.process.stdout.readline())
        if "error" in answer:
            raise SphinxError(f"equation: {source}\n{answer['error']}")
        return answer["html"]


def inline_equation(writer, node):
    writer.body.append(Katex.render(node.astext(), False))
    raise nodes.SkipNode


def block_equation(writer, node):
    writer.body.append(f'<div class="equation">{Katex.render(node.astext(), True)}</div>')
    raise nodes.SkipNode


def check_equations(document):
    for kind, display in ((nodes.math, False), (nodes.math_block, True)):
        for equation in document.findall(kind):
            Katex.render(equation.astext(), display)


def colour_blocks(app, document):
    """Indented blocks have no language: it is found by how they begin."""
    for block in document.findall(nodes.literal_block):
        if block.get("language", "default") in ("default", "text", "none"):
            block["language"] = language_of(block.astext())
            block["force"] = True


def make_whole(app, error):
    """The site works from a file: no file is looked for elsewhere, and no script is a module, which browsers load from servers only."""
    if error is None:
        static = pathlib.Path(app.outdir) / "_static"
        style, script = static / "styles/furo.css", static / "scripts/furo.js"
        style.write_text(re.sub(r"@import url\(/javascript/(.*?)\);", lambda match: (SCRIPTS / match.group(1)).read_text(), style.read_text()))
        if "url(/" in style.read_text():
            raise SphinxError("the style looks for files of a server")
        script.write_text((static / "scripts/gumshoe-patched.js").read_text() + re.sub("^import .*", "", script.read_text(), flags=re.M))


def copy_katex(app, error):
    if error is None:
        folder = pathlib.Path(app.outdir) / "_static/katex"
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "fonts").mkdir(parents=True)
        shutil.copyfile(KATEX / "katex.min.css", folder / "katex.min.css")
        for font in (KATEX / "fonts").glob("*.woff2"):
            shutil.copyfile(font, folder / "fonts" / font.name)


def setup(app):
    app.add_html_math_renderer("katex", (inline_equation, None), (block_equation, None))
    if app.tags.has("check"):
        app.config.smartquotes = False
        app.connect("doctree-resolved", lambda app, document, page: check_equations(document))
    else:
        app.connect("doctree-read", colour_blocks)
        app.connect("build-finished", copy_katex)
        app.connect("build-finished", make_whole)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
