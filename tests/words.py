#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The words that people read: the field's terms, and none of those that were retired.

    python3 tests/words.py PATH/TO/kempe    pages, help and messages without retired words, sentences of at most 30 words,
                                            comments and docstrings in C, JavaScript and Python without a sentence that
                                            begins with What, Where, How, Which or Whether, docs/commands.md as the help,
                                            messages in the words of SENTENCES, of at most 30 words, pages and comments of the
                                            library and of the Python package without the phrases of PLAIN, pages
                                            without sentences that have no verb
    python3 tests/words.py --self-test      proves that planted words are found
    python3 tests/words.py --count          words a sentence and long sentences of each page

Text in backquotes and indented blocks is the program's own and is left out, but for the help, which is read whole.
"""
import ast
import io
import json
import pathlib
import re
import subprocess
import sys
import tokenize

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs"))
import command_page  # noqa: E402

RETIRED = {  # pattern: the word instead
    r"\broads?\b(?! vehicle)": "formulation",
    r"\bshaky\b": "infinitesimally mobile",
    r"\b(is|are|was|were) told\b": "is reported",
    r"\bby turns\b": "alternately",
    r"\bhangs? (on|by)\b": "is attached to, depends on",
    r"\bclock on the wall\b": "wall-clock time",
    r"\bno numbers?\b": "not a number, NaN",
    r"\bfrom afar\b": "from a distant guess",
    r"\bfreedoms\b": "degrees of freedom",
    r"\bcomplain(s|ed)? of\b": "reports",
    r"\bholds? (it|them|all of them) against\b": "compares with",
    r"\bled (over|through|along)\b": "swept, crossed",
    r"\bwho (moves|pulls)\b": "participation, acting forces",
    r"\bstumbles?\b": "fails",
    r"\b(tells?|told)\b": "reports, says",
    r"\b(asks?|asked)\b": "requests",
    r"\bon (the|its|their) way\b": "during the run, towards",
    r"\b(bends?|bent)\b": "curvature, kink",
    r"\bhouses?\b": "folder, owner",
    r"\bruns? out\b": "ends",
}
SENTENCES_NO = r"(?<![Tt]here )\b(is|are|was|were) no\b(?! (longer|more)\b)"
SENTENCES = {  # pattern in messages: the words instead
    SENTENCES_NO: "is not a",
    r"\b(that|those) of\b": "the noun again",
    r"\banew\b": "again",
    r"\bbeside\b": "near, with, in the same folder",
    r"\balone\b": "only",
    r"\blanes?\b": "instances at a time",
    r"(?<!model )\bexchanges?\b": "change of independent coordinates",
    r"\bpivots?\b": "a measure of independence",
    r"\bmargins?\b": "distance, limit",
    r"\bclosure rows?\b|\b(redundant|independent|dropped) rows?\b": "constraint equation, redundant constraint",
    r"\b(lose|loses) (a |their )?(row|rank)\b": "change point, dependent constraints",
    r"\bvanish(es)? identically\b": "hold in every position",
    r"\bcounted (operations|time|work)\b": "expected time",
    r"\b(det )?Jv\b|\bBvu\b": "Jacobian of the dependent coordinates, |dv/du|",
    r"\b(permit|impose|decide|judge)(s|d|ed)?\b": "allow, follow from, evaluate",
}
# Messages that may have such a word, and why. A message of more than 30 words is allowed by its first words.
ALLOWED = {
    "kempe simulate examples/": "examples of a command",
    "kempe reduce blade_mesh": "examples of a command",
    "'kempe help COMMAND'": "several lines of the help",
    "examples: kempe new": "several lines of the help",
    "sets of equations: M_C": "a list of names",
    "nodes that move as a rigid body": "the forms of a value",
    "steps rejected refused rhs": "heads of columns",
    "judged passed yield": "heads of columns",
    "least relative pivot of the reduced mass": "a matrix that is factored: the word of the field",
    "user group solref": "attributes of MJCF",
    "a lane is an entry": "an assertion of the build",
    "pivots of scaled J": "a line of --all",
    "after %d exchange": "a line of --all",
    "condition number of Jv": "a line of --all",
    "an approximation, pressures 5 to 20": "table of the command, still to be shortened",
}
PLAIN = {  # pattern in pages and comments: the words instead
    r"\b(that|those) of\b": "the noun again",
    r"\bthose (that|which|whose|who|with|without|by|in|on|at|from|to|for|where|between)\b": "the noun again",
    r"(?:^|(?<=[.?!] ))(Those|Of (these|those))\b(?= (of|that|\w+ed)\b|,)": "the noun again",
    r"(?:^|(?<=[.?!] ))There\b(?! (is|are|was|were)\b)": "the place by its name",
    SENTENCES_NO: "is not a",
    r"\b[Aa]new\b": "again",
    r"\b[Bb]eside\b": "near, next to, compared with, in addition to",
    r"(?<!stand-)\b[Aa]lone\b": "only, separately",
    r"\bof (its|their|his|our|one's) own\b": "its own, separate, further",
    r"\b[Ww]here (one|ones)\b": "if the (noun)",
    r"\b[Ss]o many\b": "this number of",
    r"\bas such\b": "the property by its name",
    r"\b(says?|said) so\b": "reports this, with a warning",
    r"\bstands?\b(?!-)": "is, is written, means, occurs",
    r"\b[Nn]obody\b|\b[Ww]hoever\b": "no user, no other program",
    r"\bshall\b": "is to, must",
    r"\ball the same\b": "nevertheless",
    r"\bfor want of\b": "because .. is missing",
    r"\b(go|goes|going|went) on\b(?! (a|an|the|four)\b)": "continue",
}
PUBLIC = {  # also in pages, messages, the comments of public headers and of the Python package
    r"\b[Tt]he ones? (of|that|which|in|with|for|from)\b": "the noun again",
    r"(?:^|(?<=[.?!] )|(?<=\| ))What\b(?! is the use)": "the noun that is meant",
    r"\bvanish(es)? identically\b": "hold in every position",
    r"(?:^|(?<=[.?!] ))So (is|are|does|do|has|have)\b": "the same is true of",
}
ANY_PLAIN = re.compile("|".join(PLAIN))
ANY_PUBLIC = re.compile("|".join(PUBLIC))
LISTS = re.compile(r"docs/(api/|commands|python_reference)")  # pages of members, options, methods, each with a noun
# Sentences that may have such a phrase, by the words around it, and why.
PLAIN_ALLOWED = {
    "A pole stands upright": "a pole",
    "on a test stand": "a machine that tests bogies",
    "`alone`: the one": "the name of an argument",
    "*anew: the last": "the name of an argument",
    "`anew`: the whole": "the name of an argument",
}
# The verbs of the pages' sentences, as far as a sentence has none of the first line: a sentence without any is a fragment.
VERBS = set("""
    is are was were be been has have had do does did can cannot could may might must should will would
    act add advance agree allow amplify answer appear apply arrive assemble attain attract become began begin belong bound break
    bring call carry change check choose chose climb close collect combine come compare compute concerned connect consist
    constrain contain continue converge correspond cost count couple cover creep cross decide decrease define deflect deform
    depend derive derived describe determine differ disable disagree disappear display draw drive drop end equal evaluate
    examine exceed excite execute exist exit explain export extend factorise fail failed fall find fit follow form found gain
    gained gave give go grow guide happen hold ignore implement include integrate interpolate jump keep know lack land last lead
    lean leave lie lies limit linearise list locate look lose lubricate make map matter measure meet mount move multiply name
    need neglect nest occur omit open optimise oscillate override own pass passed pay perform predict prefer prescribe prevent
    print pull read rebuilt recompute record reduce refer refuse regain regularise reject remain remove repeat replace report
    request require resist resonate rest restart restrain resume return roll rotate run satisfy save say scale see select serve
    set share shift show sleep slide slip solve span spend start stay steer stick stop store straighten strike subtract support
    suppose sweep swing switch take test took touch treat turn unload use vanish vary wait work write
""".split())
OPTIONS = r"--(road|roads|once|every|fixed-u|u|dynamics|over|vary|drive|nearest|require|fix|free)\b"
HEADLESS = re.compile(r"^#+ (What|Whether|Of|Where|How)\b(?!-to\b).*", re.M)
FIRST = re.compile(r"\b(?:What|Where|How|Which|Whether)\b")
CLAUSE = re.compile(rf"(?:^|(?<=[.?!] )){FIRST.pattern} .{{0,50}}")
COMMENTED = ("include", "src", "constraints", "integrators", "bench", "examples", "python", "tests", "docs", "schema")
LONGEST = 30  # words a sentence
WIDEST = 100  # characters a line of the help
REAL_ROADS = re.compile(r"road profile|driven by a road|drive\(road\)|bumpy road|\bthe road\b(?=[^.]*(plate|passengers|wheel|car))|times the road|road's displacement|road of 1 m", re.I)


def prose(text):
    """The text that is a person's: without code, tables' rules and addresses of links."""
    text = re.sub(r"^(    |\t).*$", "", text, flags=re.M)
    text = re.sub(r"```.*?```", "", text, flags=re.S)
    text = re.sub(r"\$\$.*?\$\$", "X", text, flags=re.S)
    text = re.sub(r"`[^`\n]*`|\$[^$]+\$", "X", text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    return text


def lines(text):
    """The prose of a page, each paragraph, item and row of a table on one line."""
    return [" ".join(block.split()) for block in re.split(r"\n\s*\n|\n(?=\||#| *(?:-|\d+\.) )", prose(text))]


def pages():
    yield ROOT / "README.md"
    yield from sorted((ROOT / "docs").rglob("*.md"))
    yield from sorted((ROOT / "examples").rglob("README.md"))
    yield from sorted((ROOT / "examples").rglob("*.ipynb"))


def words_of(page):
    """The text of a page, or that of a notebook's cells."""
    if page.suffix != ".ipynb":
        return page.read_text()
    cells = json.loads(page.read_text())["cells"]
    return "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")


def literals(text):
    """The strings of a source that have several words: messages, and words of tables."""
    code = re.sub(r"/\*.*?\*/|'(?:\\.|[^'\\])'", "", text, flags=re.S)
    return [words for words in re.findall(r'"((?:[^"\\\n]|\\.)*)"', code) if " " in words]


def messages(text):
    """The strings of a source that are sentences or parts of them, each whole: not code, JSON, heads of columns."""
    code = re.sub(r'/\*.*?\*/|\'(?:\\.|[^\'\\])\'|("(?:\\.|[^"\\\n])*")', lambda m: m.group(1) or " ", text, flags=re.S)
    code = re.sub(r'^\s*#include.*$', "", code, flags=re.M)
    for parts in re.findall(r'"(?:\\.|[^"\\\n])*"(?:\s*"(?:\\.|[^"\\\n])*")*', code):
        words = "".join(re.findall(r'"((?:\\.|[^"\\\n])*)"', parts)).replace("\\n", " ").replace('\\"', "'")
        if len(words.split()) > 2 and not re.fullmatch(r"(\w+ (%\w+|\[) ?)+", words) and not re.search(r"[{}<>]|\$\(|\[words\]|\w_\w+ \w+_\w|%g %g", words):
            yield " ".join(words.split())


def spoken(name, text):
    """Complaints of the messages of a source."""
    for message in messages(text):
        found = [f"'{m.group()}': {instead}" for pattern, instead in SENTENCES.items() if (m := re.search(pattern, message))]
        count = sum(word != "=" for word in message.split())
        if count > LONGEST:
            found.append(f"{count} words")
        if found and not any(message.startswith(begin) for begin in ALLOWED):
            yield f"{name}: {message}: {'; '.join(found)}"


def comments(text):
    """The comments of a source in C or JavaScript, each on one line."""
    code = re.sub(r'"(?:[^"\\\n]|\\.)*"', '""', text)
    for comment in re.findall(r"/\*.*?\*/|(?://[^\n]*\n?\s*)+", code, flags=re.S):
        yield " ".join(re.sub(r"^\s*(?:/\*+|//+|\*(?!/))|\*/", "", comment, flags=re.M).split())


def python_comments(text):
    """The comments and docstrings of a source in Python, each on one line."""
    below = None  # the row that goes on with the comment
    words = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type != tokenize.COMMENT:
            continue
        if token.start[0] != below or token.line[: token.start[1]].strip():
            yield " ".join(words)
            words = []
        words += token.string.lstrip("#: ").split()
        below = token.start[0] + 1
    yield " ".join(words)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            yield " ".join((ast.get_docstring(node) or "").split())


def clauses(name, text, said=comments):
    if not FIRST.search(text):
        return  # nor has a comment one of these words
    for comment in said(text):
        for match in CLAUSE.finditer(comment):
            yield f"{name}: '{match.group()}': a sentence of a comment names its subject"


def scripts(rooms):
    """Sources in Python, by their ending or their first line."""
    for room in rooms:
        for path in sorted((ROOT / room).rglob("*")):
            if path.suffix == ".py" or not path.suffix and path.is_file() and path.read_bytes()[:80].split(b"\n")[0].endswith(b"python3"):
                yield path


def sources(rooms=("src", "constraints", "integrators")):
    for room in rooms:
        yield from sorted(path for path in (ROOT / room).rglob("*") if path.suffix in (".c", ".h", ".def", ".js"))


def faults(name, text, whole=False):
    seen = REAL_ROADS.sub("", text if whole else prose(text))
    if name.startswith("src/road/") or re.search(r"\btyres?\b", text, re.I):  # tyres run on roads
        seen = re.sub(r"\broads?\b", "", seen)
    for pattern, instead in RETIRED.items():
        for match in re.finditer(pattern, seen):
            yield f"{name}: '{match.group()}': {instead}"
    for match in re.finditer(OPTIONS, text):
        yield f"{name}: '{match.group()}' is an option no more"
    for match in HEADLESS.finditer(seen):
        yield f"{name}: '{match.group()}': a heading is a noun"


def sentences(text):
    """The words of each sentence of the prose. A colon ends one, a semicolon does not."""
    for block in re.split(r"\n\s*\n|^\|.*$|^#.*$|^ *(?:-|\d+\.) ", prose(text), flags=re.M):
        for sentence in re.split(r"(?<=[.:?!])\)?\s+", " ".join(block.split())):
            words = sentence.split()
            if len(words) > 2:
                yield words


def long_sentences(name, text):
    for words in sentences(text):
        if len(words) > LONGEST:
            yield f"{name}: {len(words)} words: {' '.join(words)[:70]}.."


def phrases(name, texts, words=PLAIN, any_of=ANY_PLAIN):
    """The phrases of PLAIN, or of PUBLIC, in texts of one line each."""
    for text in texts:
        for pattern, instead in words.items() if any_of.search(text) else ():
            for match in re.finditer(pattern, text):
                around = text[max(0, match.start() - 40) : match.end() + 30]
                if not any(allowed in around for allowed in PLAIN_ALLOWED):
                    yield f"{name}: '{match.group()}' in '{around}': {instead}"


def stem(verb):
    """The verb's form of the list: matches -> match, carries -> carry, holds -> hold."""
    ending = next((e for e in ("sses", "xes", "ches", "shes", "zes", "oes", "ies") if verb.endswith(e)), None)
    return verb[:-3] + "y" if ending == "ies" else verb[:-2] if ending else verb[:-1] if verb.endswith("s") else verb


def fragments(name, text):
    """Sentences of the paragraphs of a page without a verb: not those of lists and tables, with a colon, or of references."""
    seen = re.sub(r"^(#.*|\|.*|!\[.*)$", "\n", re.sub(r"<!--.*?-->", " ", prose(text), flags=re.S), flags=re.M)
    for block in re.split(r"\n\s*\n", seen):
        paragraph = " ".join(re.split(r"^ *(?:-|\d+\.) ", block, flags=re.M)[0].split())
        paragraph = re.sub(r"\*\*[^*]+\*\*( \([^)]*\))?[.:]?", "", paragraph)  # headings within the line
        for sentence in re.split(r"(?<=[.?!])[)*]*\s+(?=[A-Z*(])", paragraph):
            words = re.findall(r"[a-zé'-]+", sentence.lower())
            if re.match(r"[*(]*[A-Z]", sentence) and sentence.endswith(".") and len(words) > 2 and ":" not in sentence \
                    and not re.search(r"\b(18|19|20)\d\d\b|\b[A-Z]\.$|, KTH\)\.$", sentence) and not any(w in VERBS or stem(w) in VERBS for w in words):
                yield f"{name}: a sentence without a verb: {sentence}"


def count():
    for page in pages():
        lengths = [len(words) for words in sentences(words_of(page))]
        if lengths:
            print(f"{page.relative_to(ROOT).as_posix():44} {sum(lengths) / len(lengths):5.1f} words a sentence, "
                  f"{sum(n > LONGEST for n in lengths):3} of {len(lengths)} above {LONGEST}")
    return 0


def self_test():
    planted = ["solved along two roads\n", "## What it costs\n", "the mechanism is shaky\n", "run it with `--once`\n",
               "errors are told by line\n", "the road tells its house to bend\n"]
    clean = ["a quarter car on a bumpy road\n", "    kempe simulate x.yaml\n", "## Cost\n", "| `road` | a key |\n"]
    wrong = [text for text in planted if not list(faults("planted", text))]
    wrong += [text for text in clean if list(faults("clean", text))]
    lengths = ("word " * 30 + "end.\n", "word " * 15 + "end; " + "word " * 15 + "end.\n"), ("word " * 29 + "end.\n", "- " + "word " * 20 + "end: " + "word " * 20)
    wrong += [text for text in lengths[0] if not list(long_sentences("planted", text))] + [text for text in lengths[1] if list(long_sentences("clean", text))]
    print(*(f"self-test: judged wrongly: {text.strip()}" for text in wrong), sep="\n", end="\n" if wrong else "")
    source = 'kmp_fail(c, "it is told of \\"A\\" so"); /* "told so" */ f(\'"\', told, "a b");'
    wrong += [] if literals(source) == ['it is told of \\"A\\" so', "a b"] else [source]
    spoken_wrong = ['f("that is no force of " "it");', 'f("the load is that of\\n" "the rod");', 'f("begin the run anew");', f'f("{"word " * 31}");']
    spoken_clean = ['/* "that is no force of it" */ f("there is no force here");', 'f("rows { exchanges %d }");', 'f("it is no longer used");', f'f("{"word " * 30}");']
    wrong += [text for text in spoken_wrong if len(list(spoken("planted", text))) != 1] + [text for text in spoken_clean if list(spoken("clean", text))]
    begun = ["/** What it costs. */", "/* Costs.\n * Where they\n * rise. */", "x; // How it ends,\n// and when.", "/* Ends.\n\tWhether so. */"]
    named = ["/* The cost, where it\n * What. */ What();", 'f("/* What it costs */"); /* Costs: what they are. */', "// Cost\n"]
    wrong += [text for text in begun if len(list(clauses("planted", text))) != 1] + [text for text in named if list(clauses("clean", text))]
    begun_python = ['def f():\n    """Whether it ends."""\n', "# It ends.\n# Where it does.\n", "x = 1  # What is one\n", '"""A file.\n\nHow it is read.\n"""\n']
    named_python = ['x = "# What"\n', "# The place\n# Where it ends\n", 'def f():\n    """The end."""\n    return "What"\n']
    wrong += [text for text in begun_python if len(list(clauses("planted", text, python_comments))) != 1]
    wrong += [text for text in named_python if list(clauses("clean", text, python_comments))]
    phrased = ["forces are those of the wheel", "it ends. Those that stick", "Ends. There the rates jump", "is no number", "run anew", "beside it", "the work alone",
               "a file of its own", "where one is given", "needs so many", "used as such", "a warning says so", "it stands there", "nobody else", "it shall move",
               "so all the same", "ends for want of it", "the run goes on"]
    plain = ["There is no time", "a stand-alone program", "its own file", "it is no longer used", "says some", "A pole stands upright on it", "goes on the ground", "that offset"]
    wrong += [text for text in phrased if len(list(phrases("planted", [text]))) != 1] + [text for text in plain if list(phrases("clean", [text]))]
    verbless = ["A mass on a spring.\n", "It moves. The largest of all errors.\n"]
    verbal = ["A mass carries a spring.\n", "Example: a mass on a spring.\n", "- a mass on a spring.\n", "**A mass on a spring.** It moves.\n", "A mass\n", "Euler, Mechanica, 1736.\n"]
    wrong += [text for text in verbless if len(list(fragments("planted", text))) != 1] + [text for text in verbal if list(fragments("clean", text))]
    count = len(phrased) + len(plain) + len(verbless) + len(verbal) + len(spoken_wrong) + len(spoken_clean) + len(begun_python) + len(named_python) + 1 + len(planted) + len(clean) + sum(map(len, lengths)) + len(begun) + len(named)
    print(f"self-test: {count - len(wrong)} of {count} judged rightly")
    return 1 if wrong else 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    if arguments == ["--count"]:
        return count()
    kempe = str(pathlib.Path(arguments[0]).resolve())
    found = [f for page in pages() for f in faults(page.relative_to(ROOT).as_posix(), words_of(page))]
    for command in ["", *command_page.commands(kempe)]:
        text = command_page.help_of(kempe, *command.split())
        found += faults(f"kempe {command} --help", text, whole=True)
        found += [f"kempe {command} --help: {len(line)} characters: {line}" for line in text.split("\n") if len(line) > WIDEST]
    found += [f for path in sources() for words in literals(path.read_text())
              for f in faults(path.relative_to(ROOT).as_posix(), words, whole=True)]
    found += [f for path in sources() if path.suffix != ".js" for f in spoken(path.relative_to(ROOT).as_posix(), path.read_text())]
    found += [f for path in sources(COMMENTED) for f in clauses(path.relative_to(ROOT).as_posix(), path.read_text())]
    found += [f for path in scripts(COMMENTED) for f in clauses(path.relative_to(ROOT).as_posix(), path.read_text(), python_comments)]
    found += [f for page in pages() for f in phrases(page.relative_to(ROOT).as_posix(), lines(words_of(page)))]
    found += [f for path in sources(COMMENTED[:4] + ("python",)) if path.suffix != ".js"
              for f in phrases(path.relative_to(ROOT).as_posix(), comments(path.read_text()))]
    found += [f for path in scripts(("python",)) for f in phrases(path.relative_to(ROOT).as_posix(), python_comments(path.read_text()))]
    said = [(page, lines(words_of(page))) for page in pages()] + [(path, messages(path.read_text())) for path in sources() if path.suffix != ".js"]
    said += [(path, comments(path.read_text())) for path in sources(("include",))] + [(path, python_comments(path.read_text())) for path in scripts(("python",))]
    found += [f for path, texts in said for f in phrases(path.relative_to(ROOT).as_posix(), texts, PUBLIC, ANY_PUBLIC)]
    found += [f for page in pages() if not LISTS.search(page.as_posix()) for f in fragments(page.relative_to(ROOT).as_posix(), words_of(page))]
    long = [f for page in pages() for f in long_sentences(page.relative_to(ROOT).as_posix(), words_of(page))]
    print(*found, *long, f"{len(found)} retired words and clauses, {len(long)} sentences above {LONGEST} words", sep="\n")
    return 1 if command_page.main([kempe, "--check"]) or found or long else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
