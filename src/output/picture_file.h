/* SPDX-License-Identifier: BSD-3-Clause */
/* Pictures as files: .svg as it is drawn, .png by librsvg. */
#pragma once

#include "base/context.h"

/** Writes a picture and frees it in any case: .png, or SVG for every other ending. KEMPE_E_FAILED: a .png where there
 * is no librsvg. Errors of kmp_file_write. */
kempe_status kmp_picture_write(kempe_context *context, const char *path, kmp_text *svg);

/** Appends the picture as a PNG. False: there is no librsvg, or it refused; `png` is as it was. */
bool kmp_picture_png(const kmp_text *svg, kmp_text *png);
