# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash disable=SC2154
# Sourced by the scripts that build for other systems: static libraries of what Kempe needs, from Debian's sources of release 12. Before
# it, packages.sh. The script that sources it sets:
#
#     folder       that of the build: sources in folder/sources, libraries with their headers in folder/libraries
#     jobs         at once
#     compiler     of C; archive: what makes static libraries
#     toolchain    options of CMake for that system
#
# UMFPACK and CHOLMOD (GPL) and Luksan's part of NLopt (LGPL) are left out.

installed=$folder/libraries

# The archives of the sources, from Debian's lists of its release 12 in a folder of their own. With a copy of that folder nothing is
# taken from the network.
obtain() {
    mkdir -p "$folder/sources/lists/partial"
    cd "$folder/sources"
    printf 'deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian bookworm main\n' >list
    local options=(-o "Dir::Etc::SourceList=$PWD/list" -o Dir::Etc::SourceParts=/dev/null -o "Dir::State::Lists=$PWD/lists"
        -o APT::Sandbox::User=root)
    apt-get "${options[@]}" update
    apt-get "${options[@]}" source --download-only --tar-only "$@"
    for name in "$@"; do
        mkdir -p "$name"
        tar -xf "$name"_*.orig.tar.* -C "$name" --strip-components=1
    done
}

# library NAME [OPTION OF CMAKE ..]: a library that CMake builds, installed. source: its folder where it has another name.
library() {
    local name=$1
    shift
    [ ! -e "$installed/has_$name" ] || return 0
    say "  $name"
    quietly "$folder/$name.log" cmake -G Ninja -S "$folder/sources/${source:-$name}" -B "$folder/$name" -DCMAKE_BUILD_TYPE=Release \
        "${toolchain[@]}" -DCMAKE_POSITION_INDEPENDENT_CODE=ON \
        -DCMAKE_INSTALL_PREFIX="$installed" -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=OFF -DBUILD_TESTING=OFF "$@"
    quietly "$folder/$name.log" cmake --build "$folder/$name" --parallel "$jobs"
    quietly "$folder/$name.log" cmake --install "$folder/$name"
    touch "$installed/has_$name"
}

# KLU with what it needs, whose makefiles are for the host. Each source has two variants, with indices of 32 and 64 bits.
klu() {
    [ ! -e "$installed/has_klu" ] || return 0
    say "  klu"
    local from=$folder/sources/suitesparse part to=$folder/suitesparse
    mkdir -p "$to" "$installed/lib" "$installed/include"
    cp "$from"/SuiteSparse_config/*.h "$from"/{AMD,COLAMD,BTF,KLU}/Include/*.h "$installed/include"
    for part in AMD COLAMD BTF KLU; do
        rm -f "$to"/*.o "$installed/lib/lib${part,,}.a"
        # shellcheck disable=SC2016 # expanded by the shell of each job
        printf '%s\n' "$from/$part"/Source/*.c | xargs -P "$jobs" -I FILE bash -euc '
            name=$(basename FILE .c)
            "$0" -O3 -fPIC -w -DDLONG -I"$2" -I"$3" -c FILE -o "$1/l_$name.o"
            "$0" -O3 -fPIC -w -DDINT -I"$2" -I"$3" -c FILE -o "$1/$name.o"' "$compiler" "$to" "$installed/include" "$from/$part/Include"
        "$archive" crs "$installed/lib/lib${part,,}.a" "$to"/*.o
    done
    "$compiler" -O3 -fPIC -DNTIMER -I"$installed/include" -c "$from/SuiteSparse_config/SuiteSparse_config.c" -o "$to/config.o"
    "$archive" crs "$installed/lib/libsuitesparseconfig.a" "$to/config.o"
    touch "$installed/has_klu"
}

libraries() {
    local names="sundials suitesparse libyaml expat lapack cminpack nlopt"
    mkdir -p "$installed"
    if [ ! -e "$folder/sources/obtained" ]; then
        say "obtaining sources of $names"
        # shellcheck disable=SC2086 # a list of words
        quietly "$folder/sources.log" bash -c "$(declare -f obtain); folder='$folder'; set -e; obtain $names"
        touch "$folder/sources/obtained"
    fi
    say "building libraries"
    klu
    library sundials -DBUILD_STATIC_LIBS=ON -DBUILD_CVODES=OFF -DBUILD_IDAS=OFF -DSUNDIALS_INDEX_SIZE=64 \
        -DEXAMPLES_ENABLE_C=OFF -DEXAMPLES_INSTALL=OFF
    library libyaml -DCMAKE_C_FLAGS=-DYAML_DECLARE_STATIC
    source=expat/expat library expat -DEXPAT_BUILD_TOOLS=OFF -DEXPAT_BUILD_EXAMPLES=OFF -DEXPAT_BUILD_TESTS=OFF -DEXPAT_SHARED_LIBS=OFF
    library cminpack -DUSE_BLAS=OFF -DBUILD_EXAMPLES=OFF -DSHARED_LIBS=OFF
    library nlopt -DNLOPT_PYTHON=OFF -DNLOPT_OCTAVE=OFF -DNLOPT_MATLAB=OFF -DNLOPT_GUILE=OFF -DNLOPT_SWIG=OFF -DNLOPT_TESTS=OFF \
        -DNLOPT_LUKSAN=OFF -DNLOPT_CXX=OFF
    cp "$folder/cminpack/libcminpack_s.a" "$installed/lib/libcminpack.a"
    library lapack -DBUILD_SINGLE=OFF -DBUILD_COMPLEX=OFF -DBUILD_COMPLEX16=OFF -DCBLAS=OFF -DLAPACKE=OFF -DTEST_FORTRAN_COMPILER=OFF
}
