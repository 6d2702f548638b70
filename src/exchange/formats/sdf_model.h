/* SPDX-License-Identifier: BSD-3-Clause */
/* Links of SDFormat with their masses and shapes, and the conversion of the file (docs/sdf.md). */
#pragma once

#include "exchange/formats/formats.h"

/** A conversion of formats.def. Errors are in import->status. */
void kmp_sdf_convert(kmp_import *import);
