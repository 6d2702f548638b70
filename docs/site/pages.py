#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Builds the site: copies the pages and what they link, makes a page of each section of docs/README.md, and runs Sphinx.

    python3 docs/site/pages.py build/site             the site
    python3 docs/site/pages.py build/site --check     nothing, in half the time: links and equations are checked alike

Live pages are part of it where KEMPE_MODULE (build/wasm/javascript) has what packaging/build_wasm makes; without it the pages have
their pictures alone. The workbench is part of it where KEMPE_WORKBENCH_MODULE (build/wasm/workbench) has its module.

Exit code 77: a tool is not installed (docs/build_site installs them). Links that lead nowhere are errors.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import notebook_pages

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "docs"))

import live_examples  # noqa: E402
import site_workbench  # noqa: E402

MODULE = pathlib.Path(os.environ.get("KEMPE_MODULE", ROOT / "build/wasm/javascript"))
BENCH_MODULE = pathlib.Path(os.environ.get("KEMPE_WORKBENCH_MODULE", ROOT / "build/wasm/workbench"))
SITE = ROOT / "docs/site"
LINK = re.compile(r"(\]\()([^)#:\s]+)((?:#[^)\s]*)?\))")
KATEX = pathlib.Path("/usr/share/javascript/katex")
SPHINX = "/usr/bin/sphinx-build"  # Debian's, which has Debian's Furo and MyST


def missing():
    """The packages that the build needs and does not find."""
    test = ["/usr/bin/python3", "-c", "import sphinx, myst_parser, furo"]
    ready = os.path.exists(SPHINX) and subprocess.run(test, capture_output=True).returncode == 0
    return [name for name, there in (("sphinx, myst_parser, furo", ready), ("node", shutil.which("node")), ("katex", KATEX.exists()))
            if not there]


def pages():
    return [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md")), *sorted(ROOT.glob("examples/*/*.md")),
            *sorted(ROOT.glob("examples/*/*.ipynb")), ROOT / "examples/README.md", ROOT / "bench/README.md",
            ROOT / "bench/results/million.md", ROOT / "third_party/README.md",
            ROOT / "CHANGELOG.md", ROOT / "SECURITY.md"]


def groups():
    """(page, text) of each section of docs/README.md: its list, below which the navigation has the pages."""
    for title, body in re.findall(r"^## (.*)\n\n((?:- .*\n)+)", (ROOT / "docs/README.md").read_text(), re.M):
        entries = [(name, os.path.normpath(f"docs/{page}")) for name, page in re.findall(r"^- \[(.*?)\]\((.*?)\)", body, re.M)]
        yield f"docs/{title.lower().replace(' ', '_')}_pages.md", f"# {title}\n\n{body}{tree(entries)}"


def tree(entries):
    """A hidden toctree, from which Sphinx makes the navigation."""
    names = [(title, pathlib.Path(page).with_suffix("")) for title, page in entries]
    lines = [f"{title} </{page}>" if title else f"/{page}" for title, page in names]
    return "\n".join(["", "```{toctree}", ":hidden:", "", *lines, "```", ""])


def front(readme):
    """The front page: an introduction of the site's own in place of that of the README."""
    start = re.search(r"^## (.*)", readme, re.M)
    slug = re.sub(r"[^\w -]", "", start.group(1)).strip().lower().replace(" ", "-")
    return (SITE / "front.txt").read_text().replace('href="#start"', f'href="#{slug}"') + "\n" + readme[start.start():]


def children(page):
    """Pages below a page: of the decisions, the headers, the examples and the notebooks."""
    folder = page.parent
    if page.name != "README.md" or folder in (ROOT, ROOT / "docs"):
        return []
    below = re.findall(r"\]\(([\w/]+\.(?:md|ipynb))\)", page.read_text())
    return [("", (folder / name).relative_to(ROOT).as_posix()) for name in dict.fromkeys(below) if (folder / name).exists()]


def with_live_pages(page, text):
    """Links to live pages, below the pictures of examples, in the gallery and in the tutorial."""
    def link(name, words):
        return f'\n<p class="live"><a href="{os.path.relpath(ROOT / f"live/{name}.html", page.parent)}">{words}</a></p>\n'
    live = live_examples.live_examples()
    if page.name == "README.md" and page.parent.parent == ROOT / "examples" and page.parent.name in live:
        return re.sub(r"(^!\[.*\n)", lambda m: m.group() + link(page.parent.name, "Live page: move it, change it"), text, count=1, flags=re.M)
    if page == ROOT / "docs/gallery.md":
        return re.sub(r"^\[Features\]\(\.\./examples/(\w+)/README\.md\): .*\n", lambda m: m.group() + (link(m.group(1), "Live page") if m.group(1) in live else ""), text, flags=re.M)
    if page == ROOT / "docs/tutorial.md":
        text = re.sub(r"(^!\[.*\n)", lambda m: m.group() + link("tutorial_four_bar", "Live page: this linkage with its model"), text, count=1, flags=re.M)
        return re.sub(r"`(\w+)\.yaml`:\n\n```yaml\n.*?```\n", lambda m: m.group() + link(f"tutorial_{m.group(1)}", "Live page of this model"), text, flags=re.S)
    return text


def with_workbench(page, text):
    """The workbench as a page of the site, linked below the first paragraph of its page."""
    if page != ROOT / "docs/workbench.md":
        return text
    link = '<p class="live"><a href="../live/workbench.html">Workbench in this browser, without a server</a></p>'
    return re.sub(r"(\A# .*\n\n(?:.+\n)+)", lambda m: f"{m.group()}\n{link}\n", text, count=1)


def linked_files(page, text):
    prose = re.sub(r"`[^`]*`", "", re.sub(r"^    .*$", "", text, flags=re.M))
    return [path for path in ((page.parent / target).resolve() for _, target, _ in LINK.findall(prose)) if path.exists()]


def staged(page, text):
    """A page as Sphinx reads it: the README is index.md, folders are not links, and the name of a page becomes its title."""
    def target(match):
        path = (page.parent / match.group(2)).resolve()
        if path == ROOT / "README.md":
            return match.group(1) + os.path.relpath(ROOT / "index.md", page.parent) + match.group(3)
        if path.suffix == ".ipynb":
            return match.group(1) + match.group(2).removesuffix(".ipynb") + ".md" + match.group(3)
        return match.group(1) + match.group(2) + match.group(3)
    text = re.sub(r"\[([^\]]*)\]\(([^)#:\s]+)\)", lambda m: m.group(1) if (page.parent / m.group(2)).is_dir() else m.group(), text)
    text = re.sub(r"\[[\w/]+\.md\]\(([\w./]+\.md)\)", r"[](\1)", text)
    return LINK.sub(target, text)


def stage(folder):
    for page in pages():
        place = folder / page.relative_to(ROOT).parent
        text = notebook_pages.markdown(page, place) if page.suffix == ".ipynb" else page.read_text()
        if page == ROOT / "README.md":
            text = front(text)
        if (MODULE / "kempe_page.js").exists():
            text = with_live_pages(page, text)
        if (BENCH_MODULE / "kempe_page.js").exists():
            text = with_workbench(page, text)
        for path in linked_files(page, text):
            if path.is_file() and path.suffix not in (".md", ".ipynb"):
                copy = folder / path.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, copy)
        text = staged(page, text)
        text += tree(children(page)) if children(page) else ""
        name = page.relative_to(ROOT).with_suffix(".md")
        if page == ROOT / "README.md":
            name = pathlib.Path("index.md")
            text += tree([("", group) for group, _ in groups()])
        elif page == ROOT / "docs/README.md":
            text = "---\norphan: true\n---\n\n" + text
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    for name, text in groups():
        (folder / name).write_text(staged(ROOT / name, text))


def sphinx(folder, out, check=False):
    """The pages of a folder as a site; its exit code."""
    build = ["-b", "dummy", "-t", "check", "-j", "1"] if check else ["-b", "html", "-j", "2"]
    command = [SPHINX, "-q", "-W", "--keep-going", *build, "-c", SITE, "-d", f"{folder}/.cache", folder, out]
    return subprocess.run(command, env={**os.environ, "KATEX": str(KATEX)}).returncode


def main(arguments):
    if missing():
        print("not installed:", ", ".join(missing()))
        return 77
    out = pathlib.Path(arguments[0]).resolve()
    check = "--check" in arguments and "KEMPE_FULL" not in os.environ
    with tempfile.TemporaryDirectory() as folder:
        stage(pathlib.Path(folder))
        status = sphinx(folder, f"{folder}/.checked" if check else out, check)
    if status == 0 and not check and (MODULE / "kempe_page.js").exists():
        print(f"{len(live_examples.write(MODULE, out / 'live', to_docs=True))} live pages")
    if status == 0 and not check and (BENCH_MODULE / "kempe_page.js").exists():
        (out / "live").mkdir(exist_ok=True)
        (out / "live/workbench.html").write_text(site_workbench.page(BENCH_MODULE))
        print("the workbench")
    if status == 0 and not check:
        print(f"{out}/index.html")
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
