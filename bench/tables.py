# SPDX-License-Identifier: BSD-3-Clause
"""The parts that the commands `standard` and `peers` share: the machine in words, tables in Markdown, tables at equal error."""
import datetime
import math
import os
import pathlib
import re
import subprocess
import tempfile

LEVELS = [10.0**-k for k in range(3, 12)]


def first_line(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[0].strip()
    except (OSError, subprocess.CalledProcessError, IndexError):
        return "not known"


def processor():
    found = re.search(r"^model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text(), re.M)
    return found.group(1) if found else "not known"


def sundials():
    """Version by its headers."""
    for folder in ("/usr/include", "/usr/local/include"):
        path = pathlib.Path(folder, "sundials/sundials_config.h")
        if path.exists():
            found = re.search(r'#define SUNDIALS_VERSION "(.*)"', path.read_text())
            if found:
                return found.group(1)
    return "not known"


def today():
    return datetime.date.today().isoformat()


def head(title, command, more=()):
    lines = [f"# {title}", "", f"    {command}", "", "| | |", "|---|---|", f"| date | {today()} |", f"| processor | {processor()} |",
             f"| compiler | {first_line('cc', '--version')} |", f"| SUNDIALS | {sundials()} |"]
    return lines + [f"| {k} | {v} |" for k, v in more] + [""]


def markdown(columns, rows):
    """The first column to the left, the others to the right."""
    lines = ["| " + " | ".join(columns) + " |", "|---" + "|--:" * (len(columns) - 1) + "|"]
    return lines + ["| " + " | ".join(str(x) for x in row) + " |" for row in rows] + [""]


def growth(title, columns, make, numbers, measure, longest):
    """Prints measurements of models that grow. columns: (name, factor, grows) of each number of measure(path), None: it fails; those
    that grow have the exponent since the line before behind them. make(n): the text of a model. Ends after a first number above
    `longest`."""
    print(f"\n{title}\n")
    names = [part for name, _, grows in columns for part in ([name, ""] if grows else [name])]
    print("| N | " + " | ".join(names) + " |\n" + "|---" * (1 + len(names)) + "|")
    last = None
    for n in numbers:
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "model.yaml")
            pathlib.Path(path).write_text(make(n), encoding="utf-8")
            now = measure(path)
        row = []
        for k, (_, factor, grows) in enumerate(columns):
            row.append(f"{now[k] * factor:.3g}" if now and not isinstance(now[k], int) else str(now[k]) if now else "-")
            if grows:
                row.append(f"{math.log(now[k] / last[1][k]) / math.log(n / last[0]):.2f}" if now and last else "")
        print(f"| {n} | " + " | ".join(row) + " |", flush=True)
        if not now or now[0] > longest:
            break
        last = (n, now)


def digits(x):
    """Three digits that count."""
    if x is None or math.isnan(x):
        return ""
    if x == 0:
        return "0"
    return f"{x:.{max(0, 2 - math.floor(math.log10(abs(x))))}f}"


def reach(runs, level):
    """The cheapest of one way's runs (error, cpu), loosest tolerance first, that reaches a level and is no lucky one:
    the runs at tighter tolerances hold it, too. None: none does."""
    best = None
    for k, (error, cpu) in enumerate(runs):
        if error is not None and all(e is None or e <= level for e, _ in runs[k:]) and (best is None or cpu < best[1]):
            best = (error, cpu, k)
    return best


def equal_error(ways, unit=1e3, ratio_to=None, floor=0.0):
    """ways: name -> runs, as in reach(). Rows of times at equal error, in ms unless `unit` says otherwise; the cheapest of a
    column is bold. ratio_to: a name; behind each time how many times that of this way it is. Columns below ten times
    the `floor` of the reference stay blank."""
    columns, rows = [f"{x:.0e}" for x in LEVELS], []
    best = {x: min((r[1] for r in (reach(runs, x) for runs in ways.values()) if r), default=None) for x in LEVELS}
    for name, runs in ways.items():
        row = [name]
        for level in LEVELS:
            found = reach(runs, level)
            if level < 10 * floor:
                row.append("")
                continue
            if not found:
                row.append("-")
                continue
            text = digits(unit * found[1])
            base = reach(ways[ratio_to], level) if ratio_to and name != ratio_to else None
            if base:
                text += f" ({digits(found[1] / base[1])}x)"
            row.append(f"**{text}**" if found[1] == best[level] else text)
        rows.append(row)
    return columns, rows
