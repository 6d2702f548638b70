/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays in MATLAB's level 5 format, as MATLAB, Octave, SciPy and matio read it (MAT-File Format, The MathWorks,
 * chapter 1): elements of a type, a number of bytes, and the data filled up to eight bytes. Words are a cell array
 * of texts. */
#pragma once

#include "output/named_arrays.h"

/** The arrays in MATLAB's format. */
kempe_status kmp_mat_write(kempe_context *context, const kmp_arrays *arrays, const char *path);
