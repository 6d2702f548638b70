#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Builds for other Linux systems, which python/make_wheel leaves in build/PLATFORM: command and Python extension ask for no more of the C
library than the platform has, contain no part of NLopt under the LGPL, and run commands as the build of this machine does.

    python3 tests/linux_builds.py build/dev/kempe           every command of tests/windows_commands.py
    python3 tests/linux_builds.py build/dev/kempe --some    the sample that the test runs

Commands of another processor run under QEMU, where it is installed. The exit code is 77, which skips a test, where no such build is there.
"""
import concurrent.futures
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys

from windows_commands import MORE, ROOT, SOME, compare

ALLOWED = {  # libraries that wheels may take from the system (PEP 600, PEP 656)
    "manylinux": r"lib(c|m|dl|pthread|rt)\.so\.\d|ld-linux-[\w-]+\.so\.\d", "musllinux": r"libc\.so|libc\.musl-\w+\.so\.1"}


def output(*words):
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def mistakes(name, folder, program):
    """Sentences on what a file asks for that the platform of that name does not have."""
    kind = name.partition("_")[0]
    wrong = [f"needs {library}" for library in re.findall(r"NEEDED.*\[(.*)\]", output("readelf", "-d", program))
             if not re.fullmatch(ALLOWED[kind], library)]
    asked = {tuple(map(int, version.split("."))) for version in re.findall(r"GLIBC_(\d+\.\d+)", output("readelf", "-V", program))}
    most = tuple(map(int, re.findall(r"\d+", name)[:2])) if kind == "manylinux" else (0, 0)
    wrong += [f"needs glibc {version[0]}.{version[1]}" for version in sorted(asked) if version > most]
    if kind == "manylinux" and not asked and "kempe" == program.name:
        wrong.append("names no version of glibc")
    if "luksan" in output("nm", "-A", folder / "libraries/lib/libnlopt.a"):
        wrong.append("contains Luksan's part of NLopt")
    return wrong


def starter(folder):
    """Words before the command of a build, or None where it cannot run here."""
    if folder.name.endswith(platform.machine()):
        return []
    emulator = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
    if not emulator or not folder.name.endswith("aarch64"):
        return None
    system = ROOT / "build/bare_bookworm_aarch64"  # python/bare_machine makes it; a static command needs none
    if folder.name.startswith("manylinux") and not system.exists():
        return None
    return [emulator, "-L", str(system)] if folder.name.startswith("manylinux") else [emulator]


def main(words):
    here = os.path.abspath(words[0])
    builds = sorted(path.parent for path in (ROOT / "build").glob("*linux_*/kempe") if path.is_file())
    if not builds:
        print("skipped: no build/PLATFORM/kempe is there: python/make_wheel makes it")
        return 77
    lines = SOME.splitlines() + ([] if "--some" in words else MORE.splitlines())
    wrong = 0
    for folder in builds:
        programs = [folder / "kempe", *folder.glob("source/build/python-*/python/kempe/_native.abi3.so")]
        for program in programs:
            found = mistakes(folder.name, folder, program)
            wrong += len(found)
            print(f"{folder.name}: {program.name}: {'; '.join(found) or 'asks for what the platform has'}", flush=True)
        start = starter(folder)
        if start is None:
            print(f"{folder.name}: commands not run: no QEMU, or no system of that processor (python/bare_machine makes it)")
            continue
        with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("PARALLEL", "1"))) as pool:
            rows = list(pool.map(lambda line: compare(line, [here], [*start, str(folder / "kempe")]), lines))
        for line, (agrees, row) in zip(lines, rows):
            wrong += not agrees
            if "--some" not in words or not agrees:
                print(f"{'agrees' if agrees else 'DIFFERS':8}{line.replace('OUT/', ''):100.100}  {row}", flush=True)
        print(f"{folder.name}: {sum(agrees for agrees, _ in rows)} of {len(lines)} lines of commands agree, "
              f"{sum(row.endswith('equal') for _, row in rows)} of them with equal texts and files", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
