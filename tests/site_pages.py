#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The site of the pages works from files: no page, style or script of it refers to an absolute path or needs a server. In Chromium
the theme has no margins and one scroll bar, its script changes the colours, and the search finds a word. A small site with the
settings of the real one; with KEMPE_FULL=1 the real one as well.

    python3 tests/site_pages.py

Ends with 77 (skipped) where Chromium or a tool of docs/build_site is not installed.
"""
import os
import pathlib
import re
import sys
import tempfile
import types
import unittest

import browser
from browser import Screen

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs/site"))
import pages  # noqa: E402

INDEX = """# Sample

An equation $E = m c^2$, and a second page, [below](docs/below.md).

    kempe check four_bar.yaml

```{toctree}
:hidden:

docs/below
```
"""
BELOW = "# Below\n\n" + "".join(f"## Section {k}\n\nA linkage.\n\n" for k in range(60)) + "[Back](../index.md)\n"
REFERENCES = {  # in a page, a style, a script: what is refused
    ".html": r'''\b(?:src|href|srcset|action|data-url_root)\s*=\s*["'](?:/|file:)[^"']*|<script[^>]*\btype\s*=\s*["']?module''',
    ".css": r"""url\(\s*["']?(?:/|file:|https?:)[^)]*|@import[^;]*""",
    ".js": r"""^\s*(?:import\s|export\s)[^;\n]*""",
}


def absolute(site):
    """(file, text) of all references that a browser cannot follow from a file."""
    for path in sorted(site.rglob("*")):
        pattern = REFERENCES.get(path.suffix)
        for found in re.findall(pattern, path.read_text(), re.M) if pattern else ():
            yield path.relative_to(site).as_posix(), found


class Sites(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.site = pathlib.Path(cls.place.name) / "site"
        source = pathlib.Path(cls.place.name) / "source"
        (source / "docs").mkdir(parents=True)
        (source / "index.md").write_text(INDEX)
        (source / "docs/below.md").write_text(BELOW)
        assert pages.sphinx(source, cls.site) == 0

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    def drawn(self, name, screen=Screen()):
        _, said = browser.draw(self.site / name, screen)
        self.assertEqual(said, [])

    def test_paths_are_relative(self):
        self.assertEqual(list(absolute(self.site)), [])

    def test_references_are_found(self):
        """Each kind of reference is found where it is planted."""
        with tempfile.TemporaryDirectory() as place:
            for name, text in {"a.html": '<link href="/javascript/a.css">', "b.css": "@import url(/javascript/normalize.css);",
                               "c.js": 'import Gumshoe from "./a.js";\n', "d.css": "a { background: url(/icons/d.png); }"}.items():
                (pathlib.Path(place) / name).write_text(text)
            self.assertEqual([name for name, _ in absolute(pathlib.Path(place))], ["a.html", "b.css", "c.js", "d.css"])

    def test_layout(self):
        for name in ("index.html", "docs/below.html"):
            for screen in (Screen(), Screen(width=360, height=740)):
                self.drawn(name, screen)
                self.assertEqual(browser.run("return getComputedStyle(document.body).margin;")[0], "0px")
                self.assertEqual(browser.run("return document.documentElement.dataset.scrolls;")[0], "false")
        self.drawn("docs/below.html")
        bars, _ = browser.run("""
            const scrolls = (e) => /auto|scroll/.test(getComputedStyle(e).overflowY) && e.scrollHeight > e.clientHeight + 1;
            return [...document.querySelectorAll("body, body *")].filter((e) => scrolls(e) && e.clientWidth > 0.6 * innerWidth).map((e) => e.className);""")
        self.assertEqual(bars, [])

    def test_theme(self):
        """Its button goes through all colours, and the section that is read is marked."""
        self.drawn("docs/below.html")
        themes = [browser.run("return document.body.dataset.theme;")[0]]
        for _ in range(3):
            browser.run("[...document.querySelectorAll('.theme-toggle')].find((e) => e.offsetParent !== null).click();")
            themes.append(browser.run("return document.body.dataset.theme;")[0])
        self.assertEqual((themes[0], sorted(themes[1:])), ("auto", ["auto", "dark", "light"]))

    def test_search(self):
        address = (self.site / "search.html").as_uri() + "?q=linkage"
        _, said = browser.draw(types.SimpleNamespace(as_uri=lambda: address))
        found, _ = browser.run("return [...document.querySelectorAll('#search-results li a')].map((e) => e.getAttribute('href').split('?')[0]);")
        self.assertEqual((found, said), (["docs/below.html"], []))

    @unittest.skipUnless("KEMPE_FULL" in os.environ, "the whole site takes 40 s")
    def test_whole_site(self):
        whole = pathlib.Path(self.place.name) / "whole"
        self.assertEqual(pages.main([str(whole)]), 0)
        self.assertEqual(list(absolute(whole)), [])


if __name__ == "__main__":
    lacking = pages.missing() + ([] if browser.CHROMIUM else ["chromium"])
    if lacking:
        print(f"skipped: not installed: {', '.join(lacking)}")
        sys.exit(77)
    unittest.main()
