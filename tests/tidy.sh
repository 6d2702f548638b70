#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# clang-tidy (settings: .clang-tidy) over the library, the command and the examples but for reference_*.c, whose numbers clang
# does not have, and platform_windows.c and src/browser, whose headers are absent: tests/tidy.sh BUILD_FOLDER. Of each function the analyzer follows so many steps, which lead to 92 of 100 blocks (debug.Stats);
# twice as many lead to 94 in half as much time again, by 16 files. With `tests/tidy.sh BUILD_FOLDER deep` (./check full) it follows as many as it does by itself, in some
# twelve times the time. clang-query looks for calls whose result depends on the order in which the compiler evaluates arguments.
set -euo pipefail
cd "$(dirname "$0")/.."
how=(--extra-arg=-Xclang --extra-arg=-analyzer-config --extra-arg=-Xclang --extra-arg=max-nodes=5000)
if [ "${2:-}" = deep ]; then
    how=()
fi
if command -v clang-query >/dev/null; then
    found=$(find src constraints integrators -name '*.c' ! -name platform_windows.c ! -path 'src/browser/*' -print0 |
        xargs -0 -n 60 -P "$(nproc)" clang-query -p "${1:-build/dev}" -f tests/argument_order.query)
    if grep 'binds here' <<<"$found"; then
        exit 1
    fi
    grep -q '^0 matches' <<<"$found" # the query was understood
fi
find src constraints integrators examples -name '*.c' ! -name "reference_*.c" ! -name platform_windows.c ! -path 'src/browser/*' -print0 |
    xargs -0 -n 4 -P "$(nproc)" clang-tidy -p "${1:-build/dev}" --quiet "${how[@]}"
