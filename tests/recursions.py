#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/decisions/recursion.md against the sources: every function of the library that calls itself, alone or through others, is on
the page with what bounds its depth, and every function of the page still does so.

    python3 tests/recursions.py              compares page and sources
    python3 tests/recursions.py --list       prints the groups of functions that call each other, by file
    python3 tests/recursions.py --self-test  proves that a missing row and a stale row are found

Calls are read from the text: a name before a parenthesis inside the body of a function. A static function is looked for in its own file
first. A call through a pointer or a member is not seen.
"""
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIBRARY = ("src", "constraints", "integrators")
PAGE = "docs/decisions/recursion.md"
TEXT = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|^[ \t]*#(?:[^\n]*\\\n)*[^\n]*', re.S | re.M)
BEGIN = re.compile(r"^(?!typedef|struct|enum|union|else|\})([A-Za-z_][^;{}()=]*?)\b(\w+)\(((?:[^;{}()]|\([^;{}()]*\))*)\)\s*\n?\{$", re.M)
CALL = re.compile(r"(?<![.>\w])([a-z]\w*)\(")
NAMES = re.compile(r"`(\w+)`")


def functions(sources):
    """(file, name) -> the names that its body calls; which of them are of their file alone."""
    calls, apart = {}, set()
    for path, text in sources.items():
        text = TEXT.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
        for found in BEGIN.finditer(text):
            end = text.find("\n}", found.end())
            key = (path, found[2])
            calls[key] = set(CALL.findall(text[found.end():end])) | calls.get(key, set())
            if re.search(r"\bstatic\b", found[1]):
                apart.add(key)
    return calls, apart


def edges(calls, apart):
    """The calls as pairs of functions that are defined here."""
    shared = {name: (path, name) for path, name in calls if (path, name) not in apart}
    return {key: {(key[0], name) if (key[0], name) in calls else shared[name] for name in called
                  if (key[0], name) in calls or name in shared} for key, called in calls.items()}


def groups(graph):
    """The sets of functions that reach themselves (Tarjan 1972, SIAM J. Comput. 1, 146-160), with a stack of its own."""
    index, low, on, stack, found = {}, {}, set(), [], []
    for root in sorted(graph):
        if root in index:
            continue
        work = [(root, iter(sorted(graph[root])))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on.add(root)
        while work:
            node, rest = work[-1]
            for other in rest:
                if other not in index:
                    index[other] = low[other] = len(index)
                    stack.append(other)
                    on.add(other)
                    work.append((other, iter(sorted(graph[other]))))
                    break
                if other in on:
                    low[node] = min(low[node], index[other])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    group = set()
                    while node not in group:
                        group.add(stack.pop())
                    on -= group
                    if len(group) > 1 or node in graph[node]:
                        found.append(sorted(group))
    return sorted(found)


def compare(calls, apart, page):
    """Sentences about differences, and the number of functions that call themselves."""
    recursive = {key for group in groups(edges(calls, apart)) for key in group}
    told = set()
    for line in page.splitlines():
        if line.startswith("| `"):
            told |= set(NAMES.findall(line.split("|")[1]))
    names = {name for _, name in recursive}
    wrong = [f"{path}: {name} calls itself, alone or through others, and is not in {PAGE}: say there what bounds its depth"
             for path, name in sorted(recursive) if name not in told]
    wrong += [f"{PAGE}: {name} does not call itself" for name in sorted(told - names)]
    return wrong, len(recursive)


def self_test(sources, page):
    """A planted recursion, alone and through another function, and a row of a function that is gone."""
    calls, apart = functions(sources)

    def found(text, page=page):
        own, own_apart = functions({"src/planted.c": text})
        return len(compare({**calls, **own}, apart | own_apart, page)[0])
    before = found("")
    planted = ("static int planted(int n)\n{\n    return n ? planted(n - 1) : 0;\n}\n",
               "static int first(int n)\n{\n    return second(n);\n}\nstatic int second(int n)\n{\n    return first(n);\n}\n",
               "static int planted(int n)\n{\n    return 1; /* planted(n) */\n}\n")
    more = [found(text) - before for text in planted] + [found("", page + "\n| `planted_row` | nothing | 0 |\n") - before]
    print(f"planted: {more[0]} of 1, {more[1]} of 2, in a comment {more[2]} of 0, a stale row {more[3]} of 1")
    return 0 if more == [1, 2, 0, 1] else 1


def main():
    sources = {str(path.relative_to(ROOT)): path.read_text() for folder in LIBRARY
               for path in sorted((ROOT / folder).rglob("*.[ch]"))}
    if "--list" in sys.argv:
        for group in groups(edges(*functions(sources))):
            files = collections.defaultdict(list)
            for path, name in group:
                files[path].append(name)
            print("; ".join(f"{path}: {', '.join(names)}" for path, names in files.items()))
        return 0
    page = (ROOT / PAGE).read_text()
    if "--self-test" in sys.argv:
        return self_test(sources, page)
    wrong, count = compare(*functions(sources), page)
    print("\n".join(wrong) if wrong else f"{count} functions call themselves, each with what bounds its depth")
    return 1 if wrong or not count else 0


if __name__ == "__main__":
    sys.exit(main())
