# SPDX-License-Identifier: BSD-3-Clause
"""Models and the command for all tests. The functions of the library that the tests reach are recorded: the last test
compares them with the public headers."""

import importlib.machinery
import importlib.util
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import textwrap

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
USED: set[str] = set()


class Recorder:
    """The library, with a record of the functions that were taken from it."""

    def __init__(self, lib):
        self._lib = lib

    def __getattr__(self, name):
        value = getattr(self._lib, name)
        USED.add(name.removeprefix("guarded_"))
        return value

    def __dir__(self):
        return dir(self._lib)


def loaded(name, path):
    """A module of an extension file."""
    spec = importlib.util.spec_from_loader(name, importlib.machinery.ExtensionFileLoader(name, path))
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


def record():
    """Loads the extension modules before the package does."""
    folders = importlib.util.find_spec("kempe").submodule_search_locations
    path = importlib.machinery.PathFinder.find_spec("kempe._native", folders).origin
    native = loaded("kempe._native", path)
    native.lib = Recorder(native.lib)
    sys.modules["kempe._calls"] = Recorder(loaded("kempe._calls", path))


signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's job in the background ignores it
record()
import kempe  # noqa: E402


@pytest.fixture
def four_bar():
    return kempe.Model(ROOT / "examples/four_bar/four_bar.yaml")


@pytest.fixture
def command():
    """Runs the command and gives its JSON; skipped where there is no command (a wheel by itself)."""
    path = os.environ.get("KEMPE_COMMAND")
    if not path:
        pytest.skip("KEMPE_COMMAND is not set")

    def run(*words):
        done = subprocess.run(
            [path, *map(str, words), "--json", "-"], capture_output=True, text=True, cwd=ROOT, check=True
        )
        return json.loads(done.stdout)

    return run


def page_program():
    """The blocks of docs/python.md, one after another."""
    page = (ROOT / "docs/python.md").read_text()
    blocks = re.findall(r"(?:^    .*\n|^\n(?=    ))+", page, re.M)
    assert len(blocks) > 5
    return "\n".join(textwrap.dedent(block) for block in blocks if not re.search("pip install|ProcessPool", block))


TIMES = re.compile(r"_s$|_ms$|cpu|wall|memory|bytes")


def untimed(value):
    """JSON without times, which differ from run to run."""
    if isinstance(value, dict):
        return {key: untimed(each) for key, each in value.items() if not TIMES.search(key)}
    return [untimed(each) for each in value] if isinstance(value, list) else value


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: "last_of_all" in item.keywords)


def pytest_configure(config):
    config.addinivalue_line("markers", "last_of_all: sees what the other tests have used")
