# SPDX-License-Identifier: BSD-3-Clause
# On Windows: the command in a file that needs no other, and the library as kempe.dll, which exports the functions of the public headers alone, with its
# import library libkempe.dll.a. Expressions of models are read by recursion: the stack is that of Linux.
if(TARGET kempe_command)
    target_link_options(kempe_command PRIVATE -static -Wl,--stack,8388608)
    target_link_libraries(kempe_command PRIVATE shell32)
endif()
# What a file needs that contains the library whole.
set(KEMPE_WINDOWS_LIBS -static -Wl,--start-group ${KEMPE_STATIC_LIBS} -Wl,--end-group ${KEMPE_SHARED_LIBS} m pthread shell32)

file(GLOB headers CONFIGURE_DEPENDS include/kempe/*.h)
list(FILTER headers EXCLUDE REGEX "/runtime[.]h$") # emitted code brings it
set(exports "")
foreach(header ${headers})
    get_filename_component(name ${header} NAME_WE)
    if(NOT name IN_LIST KEMPE_ABSENT_HEADERS)
        file(STRINGS ${header} lines REGEX "^KEMPE_API ")
        foreach(line ${lines})
            string(REGEX REPLACE "^[^(]*[ *](kempe_[a-z0-9_]+)[(].*" "\\1" function "${line}")
            string(APPEND exports "    ${function}\n")
        endforeach()
    endif()
endforeach()
file(CONFIGURE OUTPUT kempe.def CONTENT "LIBRARY kempe.dll\nEXPORTS\n@exports@" @ONLY)
add_library(kempe_dll SHARED $<TARGET_OBJECTS:kempe_objects> src/exchange/fmu_library/fortran_parts.c ${PROJECT_BINARY_DIR}/kempe.def)
set_target_properties(kempe_dll PROPERTIES LINKER_LANGUAGE C PREFIX "" OUTPUT_NAME kempe IMPORT_PREFIX lib)
target_include_directories(kempe_dll PRIVATE include src)
target_link_libraries(kempe_dll PRIVATE ${KEMPE_WINDOWS_LIBS})

# What sees the inside is one DLL with all functions, beside the test programs, whose stack is that of Linux too.
add_library(kempe_inside SHARED EXCLUDE_FROM_ALL $<TARGET_OBJECTS:kempe_objects> src/exchange/fmu_library/fortran_parts.c)
set_target_properties(kempe_inside PROPERTIES LINKER_LANGUAGE C PREFIX "" RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
target_include_directories(kempe_inside PUBLIC include)
target_link_options(kempe_inside PRIVATE -Wl,--export-all-symbols INTERFACE -Wl,--stack,8388608)
target_link_libraries(kempe_inside PRIVATE ${KEMPE_WINDOWS_LIBS})
