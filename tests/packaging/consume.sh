#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs consumer.c and consumer.cpp against Kempe in one of the ways that docs/library.md names.
#
#     SOURCE=. BUILD=build tests/packaging/consume.sh find_package | pkg_config | add_subdirectory | shared | private
#
# add_subdirectory is only configured, with all defaults; `shared` builds Kempe as a part of a project, a shared library with
# its command, and installs that; OPTIONS are words of its configuration. With WORK, a folder that is there, the results stay: the command is $WORK/prefix/bin/kempe.
#
# Exit code 77: a tool that this way needs is not there.
set -eu
way=$1
work=${WORK:-$(mktemp -d)}
test -n "${WORK:-}" || trap 'rm -rf "$work"' EXIT
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

# A prefix of one's own with copies of the libraries and of the headers of SUNDIALS that the build uses.
make_private()
{
    mkdir -p "$work/own/lib" "$work/own/include"
    sed -n 's/^LIB_[a-z_]*:FILEPATH=//p' "$BUILD/CMakeCache.txt" | while read -r file; do
        case $file in *NOTFOUND) continue ;; esac
        cp -L "$file" "$work/own/lib/"
        real=$work/own/lib/$(basename "$file")
        name=$(objdump -p "$real" 2>/dev/null | sed -n 's/^ *SONAME *//p')
        test -z "$name" || test "$name" = "$(basename "$file")" || mv "$real" "$work/own/lib/$name"
        test -e "$real" || ln -s "$name" "$real"
    done
    headers=$(sed -n 's/^SUNDIALS_INCLUDE:PATH=//p' "$BUILD/CMakeCache.txt")
    for folder in "$headers"/sun* "$headers"/nvector "$headers"/ida "$headers"/kinsol "$headers"/cvode "$headers"/arkode; do
        cp -rL "$folder" "$work/own/include/"
    done
}

# The programs load SUNDIALS from there.
takes_private()
{
    ldd "$1" | grep 'libsundials_ida' | grep -q "$work/own/lib" || { echo "$1 takes others:"; ldd "$1"; exit 1; }
}

# Files that are installed with the command.
check_extras()
{
    page=$work/prefix/share/man/man1/kempe.1
    for command in check assemble simulate compare show; do
        grep -q "^.SH kempe $command" "$page"
    done
    grep -q '"title": "Kempe model"' "$work/prefix/share/kempe/kempe.schema.json"
    pages=$work/prefix/share/doc/kempe
    test -z "$(find "$work/prefix" -type d -empty)" || { echo "empty folders:"; find "$work/prefix" -type d -empty; exit 1; }
    "$work/prefix/bin/kempe" --help | grep -q "Pages and examples are in $(realpath "$pages")"
    { "$work/prefix/bin/kempe" --help; cat "$page"; } | grep -oE '(docs|examples)/[a-zA-Z0-9_/]+[.](md|yaml|csv)' | sort -u | while read -r file; do
        test -e "$pages/$file" || { echo "the help names $file, which is not installed"; exit 1; }
    done
    (cd "$pages" && "$work/prefix/bin/kempe" check examples/andrews/andrews.yaml >/dev/null)
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

# Programs of one minor version run with all its patches.
check_soname()
{
    version=$(sed -n 's/^project(kempe VERSION \([0-9]*[.][0-9]*\).*/\1/p' "$SOURCE/CMakeLists.txt")
    objdump -p "$1" | grep -q "SONAME *libkempe[.]so[.]$version$" || { echo "$1 is not libkempe.so.$version"; exit 1; }
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
    quietly cmake -G Ninja -S "$here" -B "$work/consumer" -DKEMPE_SOURCE="$SOURCE"
    cmake --build "$work/consumer" --target help >"$work/targets"
    grep -q 'libkempe.a' "$work/targets"
    if grep -E 'kempe_command|kempe_man|example_|test_' "$work/targets" || test -e "$work/consumer/kempe/tests"; then
        echo "as a part of another project Kempe should be the library alone"
        exit 1
    fi
    ;;
shared)
    need objdump
    make_private
    # shellcheck disable=SC2086
    by_cmake -DKEMPE_SOURCE="$SOURCE" -DBUILD_SHARED_LIBS=ON -DKEMPE_COMMAND=ON -DKEMPE_INSTALL=ON -DKEMPE_WERROR=ON \
        -DCMAKE_C_FLAGS_DEBUG= ${OPTIONS:-} \
        -DCMAKE_PREFIX_PATH="$work/own"
    quietly cmake --install "$work/consumer/kempe" --prefix "$work/first"
    rm -r "$work/consumer"
    mv "$work/first" "$work/prefix"
    "$work/prefix/bin/kempe" --version
    takes_private "$(find "$work/prefix" -name libkempe.so)"
    check_symbols "$(find "$work/prefix" -name 'libkempe.so')"
    check_soname "$(find "$work/prefix" -name 'libkempe.so')"
    by_cmake -DCMAKE_PREFIX_PATH="$work/prefix"
    by_pkg_config
    ;;
private)
    need objdump
    make_private
    install_from "$BUILD"
    # the same library, described for libraries in a folder where nobody looks; a project that looks nowhere else
    quietly cmake -G Ninja -S "$SOURCE" -B "$work/build" -DKEMPE_TESTS=OFF -DCMAKE_PREFIX_PATH="$work/own"
    cp "$work/build/KempeConfig.cmake" "$(dirname "$(find "$work/prefix" -name KempeConfig.cmake)")"
    cp "$work/build/kempe.pc" "$(dirname "$(find "$work/prefix" -name kempe.pc)")"
    by_cmake -DCMAKE_PREFIX_PATH="$work/prefix"
    takes_private "$work/consumer/consumer_c"
    by_pkg_config
    takes_private "$work/c"
    # moved beside Kempe they are found there
    cp -P "$work/own/lib"/* "$(dirname "$(find "$work/prefix" -name libkempe.a)")"
    rm -r "$work/own" "$work/consumer"
    by_cmake -DCMAKE_PREFIX_PATH="$work/prefix"
    ldd "$work/consumer/consumer_c" | grep 'libsundials_ida' | grep -q "$work/prefix"
    ;;
*)
    echo "unknown way: $way"
    exit 1
    ;;
esac
