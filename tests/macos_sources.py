#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""All sources of the library, of the command and of the test programs, read by clang for macOS 11 on arm64 and on x86-64: every name is
declared there, with the warnings of the debug build as errors. Nothing is linked or run.

    python3 tests/macos_sources.py build/dev [--processor arm64] [NAME ..]     NAME: only sources whose path contains it

The headers of macOS' C library are those that the package ziglang has; packaging/linux_libraries installs it in build/zig. Headers of
SUNDIALS and others are those of this machine. The exit code is 77, which skips a test, where clang or the headers are missing.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROCESSORS = ["arm64", "x86_64"]
LIBRARIES = ["sundials", "ida", "idas", "kinsol", "cvode", "cvodes", "arkode", "nvector", "sunmatrix", "sunlinsol", "sunnonlinsol", "sunmemory",
             "suitesparse", "cminpack-1", "yaml.h", "expat.h", "expat_external.h", "expat_config.h", "nlopt.h", "microhttpd.h"]
# Programs and sources of other systems, which builds for macOS are without.
LEFT_OUT = ("_windows.c", "rounded_once.c", "counted_memory", "test_real_time.c", "test_fused_sum.c", "fmu_library/", "third_party/", "python/", "bench/",
            "examples/", "tests/generate/", "build/")


def found_headers(name):
    """The path of a header, or of a folder of headers, on this machine; None: it is missing."""
    for folder in ("/usr/include", "/usr/include/x86_64-linux-gnu", "/usr/include/aarch64-linux-gnu"):
        if os.path.exists(f"{folder}/{name}"):
            return f"{folder}/{name}"
    return None


def words_of(entry, processor, headers, libraries):
    """The command that reads a source for macOS."""
    given, kept = iter(shlex.split(entry["command"])[1:]), []
    for word in given:
        if word in ("-isystem", "-o", "-c"):
            path = next(given)
            kept += ["-isystem", re.sub("^/usr/include", str(libraries), path)] if word == "-isystem" else []
        elif word.startswith(("-D", "-I", "-W", "-std", "-f")) and not word.startswith(("-Wl", "-Wno-")):
            kept.append(word)
    if entry["file"].endswith("platform_posix.c"):
        kept.append("-D_GNU_SOURCE")
    kept.append("-DSuiteSparse_long=int64_t")  # as SuiteSparse 7 has it, which Homebrew installs
    if processor == "x86_64":
        kept.append("-D_Float16=float")  # clang 14 has no such type there, and the header of mathematics declares functions of it
    # The header of the kinds of systems asks clang 14 what it does not know. Old declarations are deprecated in favour of the system's own.
    kept += ["-D__TARGETCONDITIONALS__", "-DTARGET_OS_MAC=1", "-DTARGET_OS_OSX=1", "-DTARGET_OS_IPHONE=0", "-DTARGET_OS_SIMULATOR=0"]
    return ["clang", f"--target={processor}-apple-macos11", "-fsyntax-only", *kept, "-Wno-unknown-warning-option", "-Wno-deprecated-declarations",
            "-nostdlibinc", "-isystem", str(headers), "-isystem", str(libraries), entry["file"]]


def main(words):
    build = pathlib.Path(words[0])
    chosen, processors = [word for word in words[1:] if not word.startswith("--")], PROCESSORS
    if "--processor" in words:
        processors = [words[words.index("--processor") + 1]]
        chosen.remove(processors[0])
    headers = next((ROOT / "build/zig").glob("lib/python3*/site-packages/ziglang/lib/libc/include/any-darwin-any"), None)
    if not headers or not shutil.which("clang"):
        print("skipped: clang is missing" if headers else "skipped: build/zig has no headers of macOS: packaging/linux_libraries installs them")
        return 77
    entries = {entry["file"]: entry for entry in json.loads((build / "compile_commands.json").read_text())}
    sources = [entry for path, entry in sorted(entries.items()) if not any(name in os.path.relpath(path, ROOT) for name in LEFT_OUT)
               and (not chosen or any(name in path for name in chosen))]
    wrong = 0
    with tempfile.TemporaryDirectory() as top:
        libraries = pathlib.Path(top)
        for name in LIBRARIES:
            if found_headers(name):
                (libraries / name).symlink_to(found_headers(name))
        for processor in processors:
            failed = []
            with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("PARALLEL", "2"))) as pool:
                run = lambda entry, processor=processor: subprocess.run(words_of(entry, processor, headers, libraries), cwd=build,  # noqa: E731
                                                                        capture_output=True, text=True, check=False)
                for entry, done in zip(sources, pool.map(run, sources)):
                    if done.returncode != 0:
                        failed.append(os.path.relpath(entry["file"], ROOT))
                        print(done.stderr[:600], flush=True)
            wrong += len(failed)
            print(f"{processor}: {len(sources) - len(failed)} of {len(sources)} sources are read without an error{': not ' if failed else ''}"
                  f"{' '.join(failed)}", flush=True)
    return 1 if wrong or not sources else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
