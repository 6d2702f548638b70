# SPDX-License-Identifier: BSD-3-Clause
# The port of vcpkg. packaging/release fills in the address and the SHA-512 of the source archive. The workbench is left out: it loads
# a shared libmicrohttpd when it starts, and triplets of vcpkg build static libraries by default.
vcpkg_download_distfile(archive
    URLS "@URL@"
    FILENAME "kempe-@VERSION@.tar.gz"
    SHA512 @SHA512@)
vcpkg_extract_source_archive(source ARCHIVE "${archive}")
vcpkg_check_features(OUT_FEATURE_OPTIONS features FEATURES
    optimize KEMPE_NLOPT
    tools KEMPE_COMMAND)
string(COMPARE EQUAL "${VCPKG_LIBRARY_LINKAGE}" "dynamic" shared)
vcpkg_cmake_configure(SOURCE_PATH "${source}" OPTIONS ${features}
    -DBUILD_SHARED_LIBS=${shared} -DKEMPE_TESTS=OFF -DKEMPE_UNITS=OFF -DKEMPE_INSTALL=ON -DKEMPE_UMFPACK=OFF -DKEMPE_CMINPACK=OFF
    -DKEMPE_WORKBENCH=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME Kempe CONFIG_PATH lib/cmake/Kempe)
vcpkg_fixup_pkgconfig()
if("tools" IN_LIST FEATURES)
    vcpkg_copy_tools(TOOL_NAMES kempe AUTO_CLEAN)
endif()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${source}/LICENSE" "${source}/third_party/fmi/LICENSE.txt"
    "${source}/third_party/three/LICENSE.txt" "${source}/third_party/chart/LICENSE.txt"
    "${source}/third_party/codemirror/LICENSE.txt")
