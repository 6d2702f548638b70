# SPDX-License-Identifier: BSD-3-Clause
# For Windows on x86-64 by the cross-compiler of mingw-w64 with POSIX threads. KEMPE_WINDOWS: the folder in which packaging/build_windows
# has installed the libraries.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES KEMPE_WINDOWS)
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_Fortran_COMPILER x86_64-w64-mingw32-gfortran-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_FIND_ROOT_PATH ${KEMPE_WINDOWS} /usr/x86_64-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_CROSSCOMPILING_EMULATOR wine)
# The compiler aligns vectors of 32 bytes on a stack of which Windows promises 16 (GCC bug 54412): the assembler writes moves that need
# no alignment. printf is that of C99. Libraries are static.
set(CMAKE_C_FLAGS_INIT "-Wa,-muse-unaligned-vector-move -D__USE_MINGW_ANSI_STDIO=1 -Wno-float-conversion -DYAML_DECLARE_STATIC -DXML_STATIC")
