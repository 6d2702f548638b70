#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# clang-tidy (settings: .clang-tidy) over the library, the command and the examples: tests/tidy.sh BUILD_FOLDER
set -euo pipefail
cd "$(dirname "$0")/.."
find src constraints integrators examples -name '*.c' -print0 |
    xargs -0 -n 4 -P "$(nproc)" clang-tidy -p "${1:-build/dev}" --quiet
