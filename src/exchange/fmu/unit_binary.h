/* SPDX-License-Identifier: BSD-3-Clause */
/* Platforms of units, and binaries that a C compiler makes for them. */
#pragma once

#include "exchange/code/emitted.h"
#include "exchange/fmu/unit_files.h"

enum { KMP_UNIT_PLATFORMS = 5 };

typedef struct kmp_unit_platform {
    const char *name, *second;      /* its folder in units of version 3 and 2 */
    const char *ending;             /* of its shared libraries */
    const char *compiler, *package; /* that makes them elsewhere, and what has it; NULL: none is known */
    bool is_windows;
} kmp_unit_platform;

/** True for the platform of this process. */
bool kmp_unit_is_own(const kmp_unit_platform *platform);

/** The folder in `binaries`. */
const char *kmp_unit_folder(const kmp_unit_platform *platform, int fmi);

/** The platforms that were asked for, or this one, in their order; `list` has room for all. KEMPE_E_ARGUMENT: one is
 * unknown, named twice or has no compiler. */
kempe_status kmp_unit_platforms_read(kempe_context *context, const kempe_fmu_options *o, const kmp_unit_platform **list,
                                     int *count);

/** The library of units for a platform, next to this platform's: kempe_unit-PLATFORM with its ending. NULL: no memory.
 */
const char *kmp_unit_library_of(kmp_arena *arena, const char *own_file, const kmp_unit_platform *platform);

/** Compiles the files with `compiler`, NULL: the default of the platform, in a folder that is removed afterwards; the
 * bytes of the shared library are appended. KEMPE_E_FAILED: it does not run, or it fails. */
kempe_status kmp_unit_compile(kempe_context *context, const kmp_code_files *files, const kmp_unit_plan *plan,
                              const kmp_unit_platform *platform, const char *compiler, kmp_text *bytes);
