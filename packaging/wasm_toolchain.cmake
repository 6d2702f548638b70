# SPDX-License-Identifier: BSD-3-Clause
# For WebAssembly by Debian's emscripten. KEMPE_WASM: the folder in which packaging/build_wasm has installed the libraries.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES KEMPE_WASM)
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
list(APPEND CMAKE_FIND_ROOT_PATH ${KEMPE_WASM})
# It is loaded over networks: -O3, which CMake would add to initial options, is larger, and no faster.
set(CMAKE_C_FLAGS_RELEASE "-O2 -DNDEBUG" CACHE STRING "options of the compiler")
