# SPDX-License-Identifier: BSD-3-Clause
# What `cmake --install` puts where: library, headers, command with its manual page and completion, the schema of model
# files, pages and examples, CMake package, pkg-config file.
include(CMakePackageConfigHelpers)

set(KEMPE_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/Kempe)
install(TARGETS kempe EXPORT KempeTargets)
set(absent "")
foreach(header ${KEMPE_ABSENT_HEADERS})
    list(APPEND absent PATTERN ${header}.h EXCLUDE)
endforeach()
install(DIRECTORY include/kempe DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h" ${absent})
install(EXPORT KempeTargets NAMESPACE Kempe:: DESTINATION ${KEMPE_CMAKE_DIR})
if(KEMPE_COMMAND)
    install(TARGETS kempe_command)
    add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/kempe.1
        COMMAND ${PROJECT_SOURCE_DIR}/packaging/man.sh $<TARGET_FILE:kempe_command> > ${PROJECT_BINARY_DIR}/kempe.1
        DEPENDS kempe_command ${PROJECT_SOURCE_DIR}/packaging/man.sh VERBATIM)
    add_custom_target(kempe_man ALL DEPENDS ${PROJECT_BINARY_DIR}/kempe.1)
    install(FILES ${PROJECT_BINARY_DIR}/kempe.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
    install(FILES packaging/kempe.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME kempe)
    install(FILES packaging/_kempe DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
    install(FILES packaging/kempe.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
    install(FILES schema/kempe.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/kempe)
    install(DIRECTORY elements DESTINATION ${CMAKE_INSTALL_DATADIR}/kempe FILES_MATCHING PATTERN "*.yaml") # to be read and copied

    # Pages and examples keep their places relative to each other; the site joins them where it was built (target site).
    install(FILES README.md LICENSE DESTINATION ${KEMPE_DOCDIR})
    install(DIRECTORY third_party DESTINATION ${KEMPE_DOCDIR} FILES_MATCHING PATTERN "README.md" PATTERN "LICENSE.txt")
    # Folders without such files are excluded: they would be installed empty.
    install(DIRECTORY docs DESTINATION ${KEMPE_DOCDIR} FILES_MATCHING REGEX "\\.(md|svg|png)$" PATTERN site EXCLUDE PATTERN live_pages EXCLUDE)
    install(FILES bench/README.md DESTINATION ${KEMPE_DOCDIR}/bench)
    install(DIRECTORY bench/results DESTINATION ${KEMPE_DOCDIR}/bench FILES_MATCHING REGEX "\\.(txt|md|csv)$")
    install(DIRECTORY examples DESTINATION ${KEMPE_DOCDIR} PATTERN CMakeLists.txt EXCLUDE PATTERN __pycache__ EXCLUDE)
    add_custom_target(site COMMAND ${PROJECT_SOURCE_DIR}/docs/build_site ${PROJECT_BINARY_DIR}/site USES_TERMINAL VERBATIM)
    install(DIRECTORY ${PROJECT_BINARY_DIR}/site/ DESTINATION ${KEMPE_DOCDIR}/html OPTIONAL PATTERN .buildinfo EXCLUDE)
endif()

configure_package_config_file(packaging/KempeConfig.cmake.in ${PROJECT_BINARY_DIR}/KempeConfig.cmake
    INSTALL_DESTINATION ${KEMPE_CMAKE_DIR} PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/KempeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/KempeConfig.cmake ${PROJECT_BINARY_DIR}/KempeConfigVersion.cmake
    DESTINATION ${KEMPE_CMAKE_DIR})

# What is linked with libraries in folders of their own finds them there when it runs; the command finds a shared Kempe
# wherever the two have been moved together.
set_target_properties(kempe PROPERTIES INSTALL_RPATH_USE_LINK_PATH ON)
if(KEMPE_COMMAND)
    file(RELATIVE_PATH KEMPE_TO_LIB /prefix/${CMAKE_INSTALL_BINDIR} /prefix/${CMAKE_INSTALL_LIBDIR})
    set_target_properties(kempe_command PROPERTIES INSTALL_RPATH_USE_LINK_PATH ON)
    if(BUILD_SHARED_LIBS AND APPLE)
        set_target_properties(kempe_command PROPERTIES INSTALL_RPATH "@loader_path/${KEMPE_TO_LIB}")
    elseif(BUILD_SHARED_LIBS)
        set_target_properties(kempe_command PROPERTIES INSTALL_RPATH "$ORIGIN/${KEMPE_TO_LIB}")
    endif()
endif()

# A static library brings the libraries that it needs, with the folders where the linker would not look; a shared one
# knows them itself.
if(NOT BUILD_SHARED_LIBS)
    foreach(file ${KEMPE_LIBS})
        get_filename_component(folder "${file}" DIRECTORY)
        list(APPEND KEMPE_FOLDERS "${folder}")
    endforeach()
    list(REMOVE_DUPLICATES KEMPE_FOLDERS)
    foreach(folder ${KEMPE_FOLDERS})
        if(NOT folder IN_LIST CMAKE_C_IMPLICIT_LINK_DIRECTORIES)
            string(APPEND KEMPE_PC_LIBS " -L${folder} -Wl,-rpath,${folder}")
        endif()
    endforeach()
    foreach(name ${KEMPE_LIB_NAMES} m pthread ${CMAKE_DL_LIBS})
        string(APPEND KEMPE_PC_LIBS " -l${name}")
    endforeach()
endif()
file(RELATIVE_PATH KEMPE_PC_UP /prefix/${CMAKE_INSTALL_LIBDIR} /prefix)
configure_file(packaging/kempe.pc.in ${PROJECT_BINARY_DIR}/kempe.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/kempe.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
