/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays in NumPy's format 1.0 (numpy.lib.format), row by row, in a zip archive. Words are fixed-width text of
 * 32-bit characters; characters beyond ASCII become '?'. */
#pragma once

#include "output/named_arrays.h"

/** The arrays in NumPy's format. */
kempe_status kmp_npz_write(kempe_context *context, const kmp_arrays *arrays, const char *path);
