# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash disable=SC2034
# Sourced by ./start and ./check: need PACKAGE... installs the Debian packages that are missing, and only those.

BUILD_PACKAGES="gcc libc6-dev cmake ninja-build libsundials-dev libsuitesparse-dev libyaml-dev libexpat1-dev liblapack-dev libblas-dev libcminpack-dev libnlopt-dev libmicrohttpd-dev"
PYTHON_PACKAGES="python3-dev python3-cffi python3-numpy python3-pytest"
NOTEBOOK_PACKAGES="python3-nbclient python3-nbformat python3-ipykernel python3-matplotlib python3-scipy python3-tqdm python3-pandas python3-xarray"
UNIT_PACKAGES="python3-venv libxml2-utils"
UNIT_PYPI="fmpy==0.3.32"
OPTIMISER_PYPI="jax==0.10.2 casadi==3.8.2 gymnasium==1.4.0"
RECIPE_PYPI="conan==2.34.0 py-rattler-build==0.73.0 jsonschema==4.26.0"
WINDOWS_PACKAGES="gcc-mingw-w64-x86-64-posix gfortran-mingw-w64-x86-64-posix binutils-mingw-w64-x86-64 wine wine64"
SITE_PACKAGES="python3 python3-sphinx python3-myst-parser furo libjs-katex nodejs"

say() {
    printf '%s\n' "$*"
}

# quietly LOG COMMAND...: the output goes to LOG, which is shown when the command fails.
quietly() {
    local log=$1
    shift
    if ! "$@" >"$log" 2>&1; then
        say "failed: $*"
        tail -n 100 "$log"
        return 1
    fi
}

apt_get() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null; then
            say "not root and no sudo here: install these packages first: $missing"
            return 1
        fi
        as_root=(sudo)
    fi
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y "$@"
}

need() {
    local missing="" package
    if ! command -v dpkg-query >/dev/null; then
        say "no Debian here: make sure that you have what these packages hold: $*"
        return 0
    fi
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing="$missing $package"
    done
    [ -n "$missing" ] || return 0
    say "installing$missing"
    mkdir -p build
    quietly build/packages.log apt_get update
    # shellcheck disable=SC2086 # a list of words
    quietly build/packages.log apt_get install --no-install-recommends $missing
}

# compile_imports FOLDER PACKAGE==VERSION...: of those that are imported by the name of the package.
compile_imports() {
    local folder=$1 package
    shift
    for package in "$@"; do
        env -u PYTHONDONTWRITEBYTECODE "$folder/bin/python3" -c "import ${package%%==*}" 2>/dev/null || true
    done
}

# need_pypi FOLDER PACKAGE...: a virtual environment with packages of the Python Package Index, made where it lacks one. What an import
# of them reads is compiled then and there, and not their thousand other files, which take half of an installation.
need_pypi() {
    local folder=$1
    shift
    [ "$(cat "$folder/has" 2>/dev/null)" != "$*" ] || return 0
    say "installing $* into $folder"
    quietly "$folder.log" python3 -m venv --clear "$folder" &&
        quietly "$folder.log" "$folder/bin/pip" install -q --disable-pip-version-check --no-compile "$@" &&
        compile_imports "$folder" "$@" && printf '%s' "$*" >"$folder/has"
}
