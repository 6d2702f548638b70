# SPDX-License-Identifier: BSD-3-Clause
# For a Linux of another C library or processor, by the compiler that packaging/linux_libraries has put into the folder KEMPE_LINUX beside the
# libraries. KEMPE_PROCESSOR: x86_64 or aarch64. Fortran is compiled by Debian's compiler; its objects name no function of a C library.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES KEMPE_LINUX KEMPE_PROCESSOR)
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR ${KEMPE_PROCESSOR})
set(CMAKE_C_COMPILER ${KEMPE_LINUX}/tools/cc)
set(CMAKE_AR ${KEMPE_LINUX}/tools/ar)
set(CMAKE_RANLIB ${KEMPE_LINUX}/tools/ranlib)
set(CMAKE_Fortran_COMPILER ${KEMPE_PROCESSOR}-linux-gnu-gfortran)
set(CMAKE_FIND_ROOT_PATH ${KEMPE_LINUX}/libraries)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-s -Wl,--gc-sections")
if(KEMPE_PROCESSOR STREQUAL "x86_64") # __builtin_cpu_supports knows the processor by this part of GCC's library; Zig's finds nothing
    set(CMAKE_C_STANDARD_LIBRARIES_INIT "${KEMPE_LINUX}/tools/cpuinfo.o")
endif()
