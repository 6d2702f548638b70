# SPDX-License-Identifier: BSD-3-Clause
"""Notebooks as pages of the site: their texts, code and stored outputs as Markdown, with the figures as files beside them."""
import base64
import json


def fenced(kind, text):
    return f"```{kind}\n{text.rstrip()}\n```\n"


def shown(output, figure):
    """An output as Markdown: what is printed, a table, or a figure, which `figure` stores and names."""
    data = output.get("data", {})
    if output["output_type"] == "stream":
        return fenced("text", "".join(output["text"]))
    if "image/png" in data:
        return f"![figure]({figure(base64.b64decode(data['image/png']))})\n"
    if "text/html" in data:
        return fenced("{raw} html", "".join(data["text/html"]))
    return fenced("text", "".join(data.get("text/plain", "")))


def markdown(path, folder):
    """The page of a notebook. Its figures become files NAME_1.png, .. in `folder`."""
    figures = []

    def figure(image):
        figures.append(f"{path.stem}_{len(figures) + 1}.png")
        folder.mkdir(parents=True, exist_ok=True)
        (folder / figures[-1]).write_bytes(image)
        return figures[-1]

    parts = []
    for cell in json.loads(path.read_text())["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source + "\n")
        else:
            parts += [fenced("python", source), *(shown(output, figure) for output in cell["outputs"])]
    return "\n".join(parts)
