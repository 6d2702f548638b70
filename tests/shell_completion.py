#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Completion of command lines, by `kempe complete` and through bash, zsh and fish where they are installed:

    python3 tests/shell_completion.py PATH/TO/kempe

- commands, options, model files of all formats and values are offered,
- the words that an option offers are those that the command itself lists when it refuses another one, or that its help has.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
KEMPE = "kempe"  # set by main
MODELS = ["a.yaml", "b.urdf", "c.xml", "d.mjcf", "e.sdf", "f.mbs"]
FOUR_BAR = ROOT / "examples/four_bar/four_bar.yaml"
LISTED = [  # commands that refuse a word, and list the ones that they know
    ("simulate", FOUR_BAR, "--formulation"), ("simulate", FOUR_BAR, "--change-points"), ("simulate", FOUR_BAR, "--linear"),
    ("simulate", FOUR_BAR, "--backend"), ("simulate", FOUR_BAR, "--algorithm"), ("compare", FOUR_BAR, "--formulations"),
    ("compare", FOUR_BAR, "--integrators"), ("compare", FOUR_BAR, "--linear"), ("simulate", FOUR_BAR, "--angle-unit"),
    ("simulate", FOUR_BAR, "--base"), ("show", FOUR_BAR, "--as"), ("generate", FOUR_BAR, "--lang"), ("sensitivity", FOUR_BAR, "--of"),
    ("sensitivity", FOUR_BAR, "--integrator"), ("sensitivity", FOUR_BAR, "--method"), ("ensemble", FOUR_BAR, "--sample", "rho=1:2", "--design")]


def complete(*words):
    done = subprocess.run([KEMPE, "complete", *words], capture_output=True, text=True, check=True)
    return sorted(done.stdout.split("\n")[:-1])


def by_bash(*words):
    script = (f"source {ROOT}/packaging/kempe.bash; COMP_WORDS=(\"$@\") COMP_CWORD=$(($# - 1)); _kempe; "
              "printf '%s\\n' \"${COMPREPLY[@]}\"")
    done = subprocess.run(["bash", "-c", script, "bash", "kempe", *words], capture_output=True, text=True, check=True, env=path())
    return sorted(done.stdout.split("\n")[:-1])


def by_fish(*words):
    line = " ".join(["kempe", *words])
    done = subprocess.run(["fish", "--no-config", "-c", f"source {ROOT}/packaging/kempe.fish; complete -C '{line}'"],
                          capture_output=True, text=True, check=True, env=path())
    return sorted(line.split("\t")[0] for line in done.stdout.split("\n")[:-1])


def by_zsh(*words):
    """The file as a function, with zsh's own word for offering candidates in place of its editor's."""
    script = ("compadd() { while [[ $1 == -* ]]; do [[ $1 == -S ]] && shift; shift; done; print -rl -- ${(P)1} }; "
              f"complete_kempe() {{ local -a words=(kempe \"$@\"); local CURRENT=$#words; source {ROOT}/packaging/_kempe }}; "
              "complete_kempe \"$@\" || true")
    done = subprocess.run(["zsh", "-f", "-c", script, "zsh", *words], capture_output=True, text=True, check=True, env=path())
    return sorted(done.stdout.split("\n")[:-1])


def path():
    return os.environ | {"PATH": f"{pathlib.Path(KEMPE).parent}:{os.environ['PATH']}"}


class Completion(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder.name)
        for name in [*MODELS, "g.csv", "h.html", "word.txt"]:
            pathlib.Path(name).touch()
        pathlib.Path("folder").mkdir()

    def test_commands_and_options(self):
        self.assertEqual(complete("sim"), ["simulate"])
        self.assertEqual(complete("help", "sim"), ["simulate"])
        self.assertIn("--version", complete("--"))
        self.assertEqual(complete("simulate", "--formul"), ["--formulation"])
        shown = set(re.findall(r"^ +(?:-.,)? *(--[a-z-]+)", subprocess.run(
            [KEMPE, "simulate", "--help"], capture_output=True, text=True, check=True).stdout, re.M))
        self.assertEqual(set(complete("simulate", "--")), shown)

    def test_files(self):
        self.assertEqual(complete("check", ""), [*MODELS, "folder/"])
        self.assertEqual(complete("view", ""), sorted([*MODELS, "h.html", "folder/"]))
        self.assertEqual(complete("gather", ""), ["folder/"])
        self.assertEqual(complete("fit", "a.yaml", "g"), ["g.csv"])
        self.assertEqual(complete("simulate", "a.yaml", "-o", "run"), ["run.csv", "run.json", "run.mat", "run.npz", "run.parquet"])
        self.assertEqual(complete("simulate", "a.yaml", "--reference", ""), ["folder/", "g.csv"])
        self.assertEqual(complete("simulate", "--report=h"), ["--report=h.htm", "--report=h.html", "--report=h.html"])

    def test_values(self):
        self.assertEqual(complete("simulate", "--formulation", ""), ["dae", "projected", "reduced"])
        self.assertEqual(complete("simulate", "--formulation=p"), ["--formulation=projected"])
        self.assertEqual(complete("compare", "--formulations", "dae,re"), ["dae,reduced"])
        self.assertEqual(complete("generate", "--form", ""), ["compact", "legible"])
        self.assertEqual(complete("simulate", "--set", ""), [])
        self.assertEqual(complete("modes", "--units", ""), ["mm", "si", "us"])
        self.assertEqual(complete("modes", "--units=m"), ["--units=mm"])
        self.assertEqual(complete("modes", "--units", "a.y"), ["a.yaml"], "the system may be left out")
        self.assertEqual(complete("modes", "--units", "--rep"), ["--report"])
        self.assertEqual(complete("reduce", "--units", ""), [], "units of a mesh")

    def test_words_are_those_of_the_command(self):
        for *words, option in LISTED:
            said = subprocess.run([KEMPE, *words, option, "XXX"], capture_output=True, text=True).stderr
            listed = re.search(r"(?:available:|there are|languages are) (.*)", said)
            with self.subTest(f"{words[0]} {option}"):
                self.assertTrue(listed, said)
                known = re.sub(r" of robots.*", "", listed.group(1)).replace(" and ", ", ").split(", ")
                self.assertEqual(complete(words[0], option, ""), sorted(known))

    def test_words_are_in_the_help(self):
        for command in complete(""):
            if command.startswith("-") or command == "help":
                continue
            shown = subprocess.run([KEMPE, command, "--help"], capture_output=True, text=True, check=True).stdout
            texts = re.split(r"^ +(?:-.,)? *(--[a-z-]+)", shown, flags=re.M)
            for option, text in zip(texts[1::2], texts[2::2]):
                if "=" in text.split("\n")[0].split("  ")[0] or "FILE" in text.split("\n")[0] or "DIR" in text or option == "--form":
                    continue
                for word in complete(command, option, ""):
                    if not os.path.exists(word.rstrip("/")) and option not in ("--forms", "--formulations", "--integrators"):
                        with self.subTest(f"{command} {option}"):
                            self.assertIn(word, re.split(r"[\s,;:()]+", text))

    def check_shell(self, by):
        for words in (["sim"], ["check", ""], ["simulate", "--formulation", "p"], ["simulate", "--form"], ["compare", "a.yaml", "--formulations", "dae,"],
                      ["simulate", "a.yaml", "-o", "run"], ["view", "fol"]):
            with self.subTest(" ".join(words)):
                self.assertEqual(by(*words), complete(*words))

    def test_bash(self):
        self.check_shell(by_bash)
        self.assertEqual(by_bash("simulate", "--formulation", "=", "p"), ["projected"])

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh(self):
        self.check_shell(by_zsh)

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish(self):
        self.check_shell(by_fish)


if __name__ == "__main__":
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
