#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Every public header compiles alone, as C and as C++, with all warnings as errors, by every compiler at hand; and all together in later
# standards, which no header asks for: a header that stands alone does so in each.
set -eu
warnings="-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
count=0
try() # language standard compiler sources
{
    # one process for all sources, of which -fsyntax-only reads each by itself
    # shellcheck disable=SC2086
    "$3" -std="$2" $warnings -I"$SOURCE/include" -fsyntax-only "$work"/$4."$1"
    count=$((count + 1))
}
headers=0
for header in "$SOURCE"/include/kempe/*.h; do
    headers=$((headers + 1))
    for language in c cpp; do
        printf '#include <kempe/%s>\n' "$(basename "$header")" | tee "$work/$headers.$language" >>"$work/all.$language"
    done
done
for pair in "gcc g++" "clang clang++"; do
    set -- $pair
    if command -v "$1" >/dev/null; then
        try c c11 "$1" '[0-9]*'
        try c c17 "$1" all
    fi
    if command -v "$2" >/dev/null; then
        try cpp c++11 "$2" '[0-9]*'
        try cpp c++17 "$2" all
    fi
done
if grep -nE '(__STDC_VERSION__|__cplusplus) *[<>=]' "$SOURCE"/include/kempe/*.h; then
    echo "a header differs between standards"
    exit 1
fi
echo "$headers headers, $count runs of compilers"
test "$count" -gt 0 && test "$headers" -gt 0
