#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs consumer.c and consumer.cpp against Kempe in one of the ways that the README names.
#
#     SOURCE=. BUILD=build tests/packaging/consume.sh find_package | pkg_config | add_subdirectory | shared
#
# Exit code 77: a tool that this way needs is not there.
set -eu
way=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
here=$SOURCE/tests/packaging
CC=${CC:-cc}
CXX=${CXX:-c++}
export CC CXX
need() { command -v "$1" >/dev/null || { echo "$1 is not there"; exit 77; }; }
quietly() { "$@" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }; }
need "$CXX"

install_from() { quietly cmake --install "$1" --prefix "$work/prefix"; }

by_cmake() # extra arguments of the configuration
{
    quietly cmake -G Ninja -S "$here" -B "$work/consumer" -DCMAKE_BUILD_TYPE=Debug "$@"
    quietly cmake --build "$work/consumer" -j 4
    "$work/consumer/consumer_c"
    "$work/consumer/consumer_cpp"
}

# What comes with the command.
check_extras()
{
    page=$work/prefix/share/man/man1/kempe.1
    for command in check assemble simulate compare show; do
        grep -q "^.SH kempe $command" "$page"
    done
    grep -q '"title": "Kempe model"' "$work/prefix/share/kempe/kempe.schema.json"
    completion=$work/prefix/share/bash-completion/completions/kempe
    test -f "$completion"
    ! command -v bash >/dev/null || PATH=$work/prefix/bin:$PATH bash -c "
        source '$completion'
        COMP_WORDS=(kempe sim) COMP_CWORD=1
        _kempe
        test \"\$COMPREPLY\" = simulate"
}

by_pkg_config()
{
    need pkg-config
    PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name kempe.pc)")
    export PKG_CONFIG_PATH
    libraries=$(dirname "$PKG_CONFIG_PATH")
    # shellcheck disable=SC2046
    "$CC" -o "$work/c" "$here/consumer.c" $(pkg-config --cflags --libs kempe) -lm
    # shellcheck disable=SC2046
    "$CXX" -std=c++11 -o "$work/cpp" "$here/consumer.cpp" $(pkg-config --cflags --libs kempe)
    LD_LIBRARY_PATH=$libraries "$work/c"
    LD_LIBRARY_PATH=$libraries "$work/cpp"
}

# A shared library shows what begins with kempe_ and nothing else.
check_symbols()
{
    need nm
    nm -D --defined-only "$1" | awk '{ print $3 }' | sed 's/@.*//' >"$work/symbols"
    grep -q '^kempe_simulate$' "$work/symbols"
    if grep -v '^kempe_' "$work/symbols"; then
        echo "these symbols should be hidden"
        exit 1
    fi
    echo "$(wc -l <"$work/symbols") symbols, all kempe_*"
}

case $way in
find_package)
    install_from "$BUILD"
    "$work/prefix/bin/kempe" --version
    check_extras
    by_cmake -DCMAKE_PREFIX_PATH="$work/prefix"
    ;;
pkg_config)
    install_from "$BUILD"
    by_pkg_config
    ;;
add_subdirectory)
    by_cmake -DKEMPE_SOURCE="$SOURCE" -DCMAKE_C_FLAGS=-O0
    test ! -e "$work/consumer/kempe/tests"
    ;;
shared)
    quietly cmake -G Ninja -S "$SOURCE" -B "$work/build" -DBUILD_SHARED_LIBS=ON -DKEMPE_TESTS=OFF -DCMAKE_BUILD_TYPE=Debug
    quietly cmake --build "$work/build" -j 4
    install_from "$work/build"
    check_symbols "$(find "$work/prefix" -name 'libkempe.so')"
    by_cmake -DCMAKE_PREFIX_PATH="$work/prefix"
    by_pkg_config
    ;;
*)
    echo "unknown way: $way"
    exit 1
    ;;
esac
