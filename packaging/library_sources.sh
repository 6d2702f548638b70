# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash disable=SC2154
# Sourced by packaging/build_windows, build_wasm and linux_libraries: static libraries of what Kempe needs, from Debian's sources of release 12.
# UMFPACK and CHOLMOD (GPL) and Luksan's part of NLopt (LGPL) are left out. They set
#
#     folder      for all that is made; sources are in $folder/sources
#     installed   for the libraries
#     jobs        their number at once
#     compiler, archive   programs for C and for static libraries
#     fortran     the compiler for Fortran, where LAPACK is built by `fortran_lapack`
#     target      options of CMake that choose the compilers
#     compiled    options of the compiler for KLU
#     sundials    further options of CMake for SUNDIALS

# download NAME ..: the archives of sources, from Debian's lists of its release 12 in a folder of their own, unpacked.
download() {
    mkdir -p "$folder/sources/lists/partial"
    cd "$folder/sources" || exit
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

# obtain NAME ..: each once.
obtain() {
    local name wanted=()
    for name in "$@"; do
        [ -e "$folder/sources/has_$name" ] || wanted+=("$name")
    done
    [ ${#wanted[@]} -gt 0 ] || return 0
    say "obtaining sources of ${wanted[*]}"
    mkdir -p "$folder"
    quietly "$folder/sources.log" bash -c "$(declare -f download); folder='$folder'; set -e; download ${wanted[*]}"
    for name in "${wanted[@]}"; do
        touch "$folder/sources/has_$name"
    done
}

# library NAME [OPTION OF CMAKE ..]: a library that CMake builds, installed.
library() {
    local name=$1
    shift
    [ ! -e "$installed/has_$name" ] || return 0
    say "  $name"
    quietly "$folder/$name.log" cmake -G Ninja -S "$folder/sources/${source:-$name}" -B "$folder/$name" -DCMAKE_BUILD_TYPE=Release \
        "${target[@]}" -DCMAKE_INSTALL_PREFIX="$installed" -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=OFF -DBUILD_TESTING=OFF "$@"
    quietly "$folder/$name.log" cmake --build "$folder/$name" --parallel "$jobs"
    quietly "$folder/$name.log" cmake --install "$folder/$name"
    touch "$installed/has_$name"
}

# KLU with what it needs, whose makefiles are for the host. Each source has two variants, with indices of 32 and 64 bits.
klu() {
    [ ! -e "$installed/has_klu" ] || return 0
    say "  klu"
    local from=$folder/sources/suitesparse part variant to=$folder/suitesparse
    mkdir -p "$to" "$installed/lib" "$installed/include"
    cp "$from"/SuiteSparse_config/*.h "$from"/{AMD,COLAMD,BTF,KLU}/Include/*.h "$installed/include"
    # Wide indices have 64 bits, also where `long` has 32 and this is not Windows.
    [ "$compiler" != emcc ] || sed -i 's/^#define SuiteSparse_long long$/#define SuiteSparse_long long long/; s/LONG_MAX/LLONG_MAX/; s/"ld"/"lld"/' \
        "$installed/include/SuiteSparse_config.h"
    for part in AMD COLAMD BTF KLU; do
        rm -f "$to"/*.o "$installed/lib/lib${part,,}.a"
        for variant in LONG INT; do
            printf '%s\n' "$from/$part"/Source/*.c | sed 's/.*\/\(.*\)[.]c$/\1/' | xargs -P "$jobs" -I {} \
                "$compiler" "${compiled[@]}" "-DD$variant" -I"$installed/include" -I"$from/$part/Include" \
                -c "$from/$part/Source/{}.c" -o "$to/$variant{}.o"
        done
        "$archive" crs "$installed/lib/lib${part,,}.a" "$to"/*.o
    done
    "$compiler" "${compiled[@]}" -DNTIMER -I"$installed/include" -c "$from/SuiteSparse_config/SuiteSparse_config.c" -o "$to/config.o"
    "$archive" crs "$installed/lib/libsuitesparseconfig.a" "$to/config.o"
    touch "$installed/has_klu"
}

# LAPACK and BLAS: the routines that Kempe calls, and those that they call, which are a tenth of all. Without a processor's own BLAS.
fortran_lapack() {
    [ ! -e "$installed/has_lapack" ] || return 0
    say "  lapack"
    local from=$folder/sources/lapack to=$folder/lapack wanted="dgesvd zgeev dsygv dsygvd dsyev dsyevd dgelsy dgeevx" name file
    rm -rf "$to"
    mkdir -p "$to" "$installed/lib"
    : >"$folder/lapack.log"
    for name in la_constants.f90 la_xisnan.F90; do # modules, before those that use them
        "$fortran" "${KEMPE_OPTIMISED:--O2}" -w -fPIC -J "$to" -c "$from/SRC/$name" -o "$to/${name%.*}.o"
    done
    while [ -n "$wanted" ]; do
        for name in $wanted; do
            for file in "$from"/{SRC,BLAS/SRC,INSTALL}/"$name".{f,f90,F90}; do
                [ ! -e "$file" ] || printf '%s\n%s\n' "$file" "$to/$name.o"
            done
        done | xargs -P "$jobs" -n 2 sh -c '"$0" ${KEMPE_OPTIMISED:--O2} -w -fPIC -I "$1" -J "$1" -c "$2" -o "$3"' "$fortran" "$to" >>"$folder/lapack.log" 2>&1
        wanted=$(nm -u "$to"/*.o | sed -n 's/^ *U \([a-z0-9]*\)_$/\1/p' | sort -u | while read -r name; do
            [ -e "$to/$name.o" ] || printf '%s\n' "$from"/{SRC,BLAS/SRC,INSTALL}/"$name".{f,f90,F90}
        done | while read -r file; do
            [ ! -e "$file" ] || basename "${file%.*}"
        done)
    done
    rm -f "$installed/lib/liblapack.a" "$installed/lib/libblas.a"
    "$archive" crs "$installed/lib/liblapack.a" "$to"/*.o
    "$archive" crs "$installed/lib/libblas.a" # nothing: all is in liblapack.a
    touch "$installed/has_lapack"
}

# The same, translated to C, with the routines of f2c's library: for systems whose Fortran is not here. It needs f2c, and the sources of
# libf2c2.
translated_lapack() {
    [ ! -e "$installed/has_lapack" ] || return 0
    say "  lapack"
    local from=$folder/sources/lapack to=$folder/lapack entries="dgesvd zgeev dsygv dsygvd dsyev dsyevd dgelsy dgeevx"
    rm -rf "$to"
    mkdir -p "$to"
    cp "$folder/sources/libf2c2/f2c.h0" "$to/f2c.h"
    local wanted=$entries seen=" " name file
    while [ -n "$wanted" ]; do
        for name in $wanted; do
            case "$seen" in *" $name "*) continue ;; esac
            seen="$seen$name "
            # The routines in Fortran 90 are in src/browser/lapack_parts.c.
            case $name in dlamch | xerbla | disnan) continue ;; esac
            for file in "$from"/{SRC,BLAS/SRC,INSTALL}/"$name.f"; do
                [ -e "$file" ] || continue
                awk -f packaging/plain_fortran.awk "$file" >"$to/$name.f"
                (cd "$to" && quietly "$name.log" f2c -a -A "$name.f")
                break
            done
        done
        wanted=$(cat "$to"/*.c | grep -oE '\b[a-z][a-z0-9]+_\(' | tr -d '_(' | sort -u |
            while read -r name; do case "$seen" in *" $name "*) ;; *) printf '%s ' "$name" ;; esac done)
    done
    for name in $(grep -ohE '\b[a-z]+_[a-z0-9]+\(' "$to"/*.c | tr -d '(' | sort -u) cabs; do
        case $name in s_copy | s_cat) continue ;; esac # in src/browser/lapack_parts.c: f2c declares them otherwise
        file=$folder/sources/libf2c2/$name.c
        [ ! -e "$file" ] || cp "$file" "$to"
    done
    cp src/browser/lapack_parts.c "$to"
    local names=()
    for name in $entries; do names+=("-D${name}_=f2c_$name"); done
    printf '%s\n' "$to"/*.c | grep -v lapack_parts | xargs -P "$jobs" -I {} "$compiler" -O2 -w -ffp-contract=off "${names[@]}" -I"$to" -c {} -o {}.o
    "$compiler" -O2 -ffp-contract=off -c "$to/lapack_parts.c" -o "$to/lapack_parts.c.o"
    "$archive" crs "$installed/lib/liblapack.a" "$to"/*.o
    "$archive" crs "$installed/lib/libblas.a" # nothing: all is in liblapack.a
    touch "$installed/has_lapack"
}

# NLopt's sources without Luksan's part, whose methods refuse: this version of NLopt has no option for it. Kempe calls SLSQP and COBYLA.
without_luksan() {
    local to=$folder/nlopt_source
    rm -rf "$to"
    cp -r "$folder/sources/nlopt" "$to"
    rm "$to"/src/algs/luksan/*
    printf '#define luksan_%s(...) NLOPT_INVALID_ARGS\n' plis plip pnet >"$to/src/algs/luksan/luksan.h"
    sed -i '/src\/algs\/luksan\/plis[.]c/d' "$to/CMakeLists.txt"
}

# The libraries that all builds need, but for LAPACK.
libraries() {
    klu
    library sundials -DBUILD_STATIC_LIBS=ON -DBUILD_CVODES=OFF -DBUILD_IDAS=OFF -DSUNDIALS_INDEX_SIZE=64 -DEXAMPLES_ENABLE_C=OFF \
        -DEXAMPLES_INSTALL=OFF "${sundials[@]}"
    library libyaml -DCMAKE_C_FLAGS=-DYAML_DECLARE_STATIC
    source=expat/expat library expat -DEXPAT_BUILD_TOOLS=OFF -DEXPAT_BUILD_EXAMPLES=OFF -DEXPAT_BUILD_TESTS=OFF -DEXPAT_SHARED_LIBS=OFF
}

# The libraries of fits and optima.
search_libraries() {
    library cminpack -DUSE_BLAS=OFF -DBUILD_EXAMPLES=OFF -DSHARED_LIBS=OFF
    without_luksan
    source=../nlopt_source library nlopt -DNLOPT_PYTHON=OFF -DNLOPT_OCTAVE=OFF -DNLOPT_MATLAB=OFF -DNLOPT_GUILE=OFF -DNLOPT_SWIG=OFF -DNLOPT_TESTS=OFF \
        -DNLOPT_CXX=OFF
    cp "$folder/cminpack/libcminpack_s.a" "$installed/lib/libcminpack.a" # it is found by the name without the suffix
}
