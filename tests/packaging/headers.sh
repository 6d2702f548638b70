#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Every public header compiles alone, as C and as C++, with all warnings as errors, by every compiler at hand.
set -eu
warnings="-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
count=0
try() # language standard compiler
{
    # one process for all headers: -fsyntax-only reads each source by itself
    # shellcheck disable=SC2086
    "$3" -std="$2" $warnings -I"$SOURCE/include" -fsyntax-only "$work"/*."$1"
    count=$((count + headers))
}
headers=0
for header in "$SOURCE"/include/kempe/*.h; do
    headers=$((headers + 1))
    for language in c cpp; do
        printf '#include <kempe/%s>\n' "$(basename "$header")" >"$work/$headers.$language"
    done
done
for pair in "gcc g++" "clang clang++"; do
    set -- $pair
    command -v "$1" >/dev/null && for standard in c11 c17; do try c "$standard" "$1"; done
    command -v "$2" >/dev/null && for standard in c++11 c++17; do try cpp "$standard" "$2"; done
done
echo "$count compilations of headers"
test "$count" -gt 0
