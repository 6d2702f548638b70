#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the workbench as one page that works without a server (docs/workbench.md), from the parts of `kempe workbench`.

    python3 docs/site_workbench.py build/wasm/workbench build/wasm/workbench/workbench.html [MODEL.yaml]

The first folder has kempe_page.js with the wings that the page needs: WORKBENCH=ON packaging/build_wasm makes both. MODEL is what the page
begins with, examples/four_bar/four_bar.yaml by default.

Exit code 77: the module is not there.
"""
import base64
import hashlib
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
WEB = ROOT / "src/workbench/web"
FOLDERS = [WEB, ROOT / "src/report/web", *(ROOT / f"third_party/{name}" for name in "three chart codemirror".split())]
FIRST = ROOT / "examples/four_bar/four_bar.yaml"
SCRIPT, STYLE = r'<script src="([\w.-]+)"></script>', r'<link rel="stylesheet" href="([\w.-]+)">'
POLICY = r'(<meta http-equiv="Content-Security-Policy" content=")[^"]*(">)'


def part(name):
    """The text of a part of the page by its name, as the server of the workbench has it."""
    return next(folder / name for folder in FOLDERS if (folder / name).exists()).read_text()


def inside_script(text):
    """A script as part of a page: nothing in its strings ends it or begins a comment of HTML."""
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def data(key, value):
    return f'<script type="application/json" id="{key}">{json.dumps(value, ensure_ascii=False).replace("<", chr(92) + "u003c")}</script>'


def policy(scripts):
    """The policy of the page: its own scripts and the module in workers, and no connections at all."""
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'" for text in scripts)
    return ("default-src 'none'; connect-src 'none'; worker-src blob:; style-src 'unsafe-inline'; img-src data: blob:; media-src blob:; "
            f"script-src 'wasm-unsafe-eval' blob: {hashes}")


def page(module, model=FIRST):
    """The page with the module of a folder."""
    scripts = []

    def script(match):
        if match.group(1) == "engine_server.js":
            text = (module / "kempe_page.js").read_text() + (ROOT / "src/browser/engine_wasm.js").read_text()
        else:
            text = part(match.group(1))
        scripts.append("\n" + inside_script(text))
        return f"<script>{scripts[-1]}</script>"

    given = data("first-model", {"name": model.name, "text": model.read_text()})
    html = part("workbench_layout.html")
    html = re.sub(STYLE, lambda match: f"<style>\n{part(match.group(1))}</style>", html)
    html = re.sub(r'(?=<script type="application/json" id="data">)', lambda _: given + "\n", html, count=1)
    html = re.sub(SCRIPT, script, html)
    return re.sub(POLICY, lambda match: match.group(1) + policy(scripts) + match.group(2), html, count=1)


def main(arguments):
    if len(arguments) not in (2, 3):
        print(__doc__)
        return 2
    module, out = map(pathlib.Path, arguments[:2])
    if not (module / "kempe_page.js").exists():
        print(f"{module}/kempe_page.js is not there: WORKBENCH=ON packaging/build_wasm makes it")
        return 77
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(page(module, *map(pathlib.Path, arguments[2:])))
    print(f"{out}: {out.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
