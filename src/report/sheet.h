/* SPDX-License-Identifier: BSD-3-Clause */
/* A single page without external files. three.js and Chart.js are taken from where the system has them. */
#pragma once

#include "report/page.h"

/** Writes whole or not at all, and frees the data. KEMPE_E_IO with a sentence that names the package of a missing
 * library. */
kempe_status kmp_sheet_write(kempe_context *context, const kmp_sheet *sheet, const char *path);
