/* SPDX-License-Identifier: BSD-3-Clause */
/* The shared library of this platform, by a C compiler in a folder that is removed afterwards. */
#pragma once

#include "exchange/fmu/unit_parts.h"

/** The name of the binary in the archive, "" on a platform without one. */
const char *kmp_unit_binary_folder(int fmi);
/** Compiles the files with `compiler`; the bytes of the shared library are appended. */
kempe_status kmp_unit_compile(kempe_context *context, const kmp_code_files *files, const kmp_unit_plan *plan,
                              const char *compiler, kmp_text *bytes);
