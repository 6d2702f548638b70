#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# clang-tidy (settings: .clang-tidy) over the library, the command and the examples but for reference_*.c, whose numbers clang
# does not have, platform_windows.c and src/browser, whose headers are absent: tests/tidy.sh BUILD_FOLDER. With `tests/tidy.sh BUILD_FOLDER FILE...`
# it reads these of them, and says which it does not read. With `tests/tidy.sh BUILD_FOLDER changed` (./check)
# it reads the sources that differ from the branch main, those that include a header that does and has functions or macros, and of another
# such header, where none of these sees it, one source that does, by the compiler's record of BUILD_FOLDER; on main itself, those of the last 25 commits; all where there is no history. Of each function the analyzer follows so many steps, which lead to 92 of 100 blocks (debug.Stats);
# twice as many lead to 94 in half as much time again, by 16 files. With `tests/tidy.sh BUILD_FOLDER deep` (./check full) it follows as many as it does by itself, in some
# twelve times the time. clang-query looks for calls whose result depends on the order in which the compiler evaluates arguments.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/dev}
mode=${2:-}
named=()
case $mode in
"" | changed | deep) ;;
*) named=("${@:2}") ;;
esac
how=(--extra-arg=-Xclang --extra-arg=-analyzer-config --extra-arg=-Xclang --extra-arg=max-nodes=5000)
if [ "$mode" = deep ]; then
    how=()
fi
all() {
    find src constraints integrators examples -name '*.c' ! -name "reference_*.c" ! -name platform_windows.c ! -path 'src/browser/*' | sort
}

# Of the names on the standard input those that are named, or that changed.
chosen() {
    local base="" differ="" code="" names=""
    if [ ${#named[@]} -gt 0 ]; then
        grep -Fx -f <(printf '%s\n' "${named[@]#./}") || true
        return
    fi
    if [ "$mode" = changed ]; then
        base=$(git merge-base HEAD origin/main 2>/dev/null || git merge-base HEAD main 2>/dev/null || true)
        if [ -n "$base" ] && [ "$base" = "$(git rev-parse HEAD)" ]; then
            base=$(git rev-parse --verify --quiet HEAD~25 || true)
        fi
    fi
    if [ -z "$base" ]; then
        cat
        return
    fi
    differ=$(git diff --name-only "$base" && git ls-files --others --exclude-standard)
    names=$(cat)
    # Headers with functions and macros, which are read where they are called.
    code=$(grep -E '[.](h|def)$' <<<"$differ" | xargs -r grep -lsE '^\{|^#define \w+\(' |
        sed -E 's/.*\///; s/[.]/[.]/; s/.*/^#include ["<](.*\/)?&[">]/' || true)
    if [ -n "$code" ]; then
        differ+=$'\n'$(xargs grep -lE -- "$code" <<<"$names" || true)
    fi
    ninja -C "$build" -t deps | DIFFER=$differ awk -v root="$PWD/" '
        BEGIN { for (k = split(ENVIRON["DIFFER"], names, "\n"); k > 0; k--) differs[names[k]] = 1 }
        NR == FNR { wanted[$0] = 1; if ($0 in differs) chosen[$0] = 1; next }
        /: #deps / { source = ""; next }
        NF > 0 {
            name = index($1, root) == 1 ? substr($1, length(root) + 1) : $1
            sub(/^([.][.]\/)+/, "", name)
            if (source == "") { source = name; if (source in wanted) compiled[++count] = source }
            else if (name in differs) sees[source] = sees[source] " " name
        }
        END {
            for (pass = 1; pass <= 2; pass++) # headers that the sources which changed see, then the others
                for (k = 1; k <= count; k++) {
                    source = compiled[k]
                    more = 0
                    for (n = split(sees[source], names, " "); n > 0; n--) more += !(names[n] in seen)
                    if (source in chosen || (pass == 2 && more)) {
                        chosen[source] = 1
                        for (n = split(sees[source], names, " "); n > 0; n--) seen[names[n]] = 1
                    }
                }
            for (source in chosen) print source
        }' <(printf '%s\n' "$names") - | sort
}
chosen_sources=$(all | chosen)

# The sources to read, NUL between them.
sources() {
    [ -z "$chosen_sources" ] || tr '\n' '\0' <<<"$chosen_sources"
}

for name in "${named[@]#./}"; do
    all | grep -Fx -- "$name" >/dev/null || printf 'not read: %s\n' "$name" >&2
done

# Of the names on the standard input, NUL between them, those but of examples that may make a graph: all that were not compiled without
# its header.
makes_graphs() {
    local without
    without=$(ninja -C "$build" -t deps 2>/dev/null | awk '
        /: #deps / { if (object && !sees) print object; object = $1; sees = 0 }
        /src\/symbolic\/graph[.]h$/ { sees = 1 }
        END { if (object && !sees) print object }' | sed -nE 's/^CMakeFiles\/kempe_[a-z]*[.]dir\/(.*)[.]o:$/\1/p' | sort -u)
    grep -z -Fxv -f <(printf '%s\n' "${without:-none}") | sed -z '/^examples\//d' || true
}

if command -v clang-query >/dev/null; then
    found=$(sources | makes_graphs | xargs -0 -r -n 60 -P "$(nproc)" clang-query -p "$build" -f tests/argument_order.query)
    if grep 'binds here' <<<"$found"; then
        exit 1
    fi
    [ -z "$found" ] || grep -q '^0 matches' <<<"$found" # the query was understood
fi
sources | xargs -0 -r -n 4 -P "$(nproc)" clang-tidy -p "$build" --quiet "${how[@]}"
