# SPDX-License-Identifier: BSD-3-Clause
# For WebAssembly by Debian's emscripten. KEMPE_WASM: the folder in which packaging/build_wasm has installed the libraries.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES KEMPE_WASM)
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
list(APPEND CMAKE_FIND_ROOT_PATH ${KEMPE_WASM})
set(CMAKE_C_FLAGS_RELEASE_INIT "-O2 -DNDEBUG") # it is loaded over networks: -O3 is larger, and no faster
