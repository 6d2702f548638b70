# SPDX-License-Identifier: BSD-3-Clause
# kempe_unit.so, on Windows kempe_unit.dll: the library as a functional mock-up unit, which `kempe fmu --binary` copies into
# archives. It contains all libraries that it needs but those of C, without UMFPACK (GPL), and exports the functions of the FMI alone.
if(KEMPE_STATIC_MISSING)
    message(STATUS "static libraries are not there: kempe fmu --binary will refuse (${KEMPE_STATIC_MISSING} )")
    return()
endif()

file(GLOB unit_sources CONFIGURE_DEPENDS src/exchange/fmu_library/*.c)
set(runtime ${PROJECT_SOURCE_DIR}/src/exchange/simulator)
add_library(kempe_unit MODULE ${unit_sources} ${PROJECT_BINARY_DIR}/simulator/kempe_fmu.c ${runtime}/kempe_fmi2.c
    ${runtime}/kempe_fmi3.c integrators/sundials/linear.c)
set_target_properties(kempe_unit PROPERTIES PREFIX "" OUTPUT_NAME kempe_unit C_VISIBILITY_PRESET hidden)
target_compile_options(kempe_unit PRIVATE -UKEMPE_UMFPACK)
target_include_directories(kempe_unit PRIVATE include . src ${runtime})
target_include_directories(kempe_unit SYSTEM PRIVATE third_party/fmi ${SUITESPARSE_INCLUDE} ${SUNDIALS_INCLUDE})
set(static kempe_inside)
if(WIN32)
    set(static kempe)
endif()
add_dependencies(kempe_unit ${static})
target_link_libraries(kempe_unit PRIVATE $<TARGET_FILE:${static}> -Wl,--start-group ${KEMPE_STATIC_LIBS} -Wl,--end-group m pthread)
if(WIN32) # the headers of the FMI say what is exported
    target_link_libraries(kempe_unit PRIVATE shell32)
    target_link_options(kempe_unit PRIVATE -static -Wl,--no-insert-timestamp -s)
else()
    file(CONFIGURE OUTPUT kempe_unit.map CONTENT "{ global: fmi2*; fmi3*; local: *; };\n")
    target_link_libraries(kempe_unit PRIVATE -Wl,--version-script=${PROJECT_BINARY_DIR}/kempe_unit.map -Wl,--gc-sections -Wl,--no-undefined -s)
endif()
set_property(TARGET kempe_unit PROPERTY LINK_DEPENDS $<TARGET_FILE:${static}>)
if(KEMPE_INSTALL)
    install(TARGETS kempe_unit LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/kempe)
endif()
