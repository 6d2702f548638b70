# SPDX-License-Identifier: BSD-3-Clause
# Settings of Sphinx for docs/site/pages.py. Equations become HTML while the site is built (KaTeX in node), so that pages
# need no script for them, and a mistake in an equation is an error of the build.
import gc
import json
import os
import pathlib
import re
import subprocess
import sys

from docutils import nodes
from sphinx.errors import SphinxError

gc.disable()  # trees of pages are large and few are dropped: to search them for cycles takes long and frees little
SITE = pathlib.Path(__file__).parent
sys.path.insert(0, str(SITE))
KATEX = pathlib.Path("/usr/share/javascript/katex")

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
html_static_path = ["style.css"]
html_css_files = ["katex/katex.min.css", "style.css"]
html_copy_source = False
html_use_index = False
html_show_sphinx = False
html_math_renderer = "katex"
html_theme_options = {"navigation_with_keys": True}
highlight_language = "text"
pygments_style = "friendly"

LANGUAGES = (  # of an indented block, by how it begins
    ("c", r"#include|#define|typedef|(static )?(inline )?(const )?(kempe_\w+|int|void|double) \**\w+|KMP_\w+\(|/\*"),
    ("yaml", r"kempe: 1|[\w.]+:( |\n)"),
    ("console", r"\$ "),
    ("bash", r"(kempe|python3|cmake|ctest|cd|docs/\w+|\./\w+|build/\w+/kempe|octave|make|cc|gcc) "),
)


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
            text = block.astext()
            block["language"] = next((name for name, start in LANGUAGES if re.match(start, text)), "text")
            block["force"] = True


def copy_katex(app, error):
    if error is None:
        import shutil
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
    return {"parallel_read_safe": True, "parallel_write_safe": True}
