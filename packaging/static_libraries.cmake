# SPDX-License-Identifier: BSD-3-Clause
# KEMPE_STATIC_LIBS: static libraries of what Kempe needs, for the unit (units.cmake) and for the command, which begins
# sooner where it loads fewer libraries. KEMPE_STATIC_MISSING: those that are not there.
set(KEMPE_STATIC_LIBS "")
set(KEMPE_STATIC_MISSING "")
get_filename_component(sundials_folder ${LIB_sundials_ida} DIRECTORY) # others may be of another version than the headers
set(sundials_core "")
if(LIB_sundials_core)
    set(sundials_core sundials_core)
endif()
set(expat "")
if(KEMPE_EXCHANGE)
    set(expat expat)
endif()
foreach(name klu btf amd colamd suitesparseconfig yaml ${expat} sundials_ida sundials_kinsol sundials_cvode sundials_arkode
        sundials_nvecserial sundials_sunmatrixsparse sundials_sunmatrixdense sundials_sunmatrixband
        sundials_sunlinsoldense sundials_sunlinsolband sundials_sunnonlinsolfixedpoint sundials_sunnonlinsolnewton ${sundials_core} lapack blas)
    if(name MATCHES "^sundials_")
        find_library(STATIC_${name} lib${name}.a PATHS ${sundials_folder} NO_DEFAULT_PATH)
    else()
        find_library(STATIC_${name} lib${name}.a)
    endif()
    mark_as_advanced(STATIC_${name})
    if(STATIC_${name})
        list(APPEND KEMPE_STATIC_LIBS ${STATIC_${name}})
    else()
        string(APPEND KEMPE_STATIC_MISSING " lib${name}.a")
    endif()
endforeach()
