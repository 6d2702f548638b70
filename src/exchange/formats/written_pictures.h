/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes and points of bodies, for the writers of foreign formats. */
#pragma once

#include "exchange/formats/written_tree.h"

/** True for a shape of a link that the format has: `known` ends with a negative kind. It counts as written. */
bool kmp_export_shape(kmp_export *w, int shape, int link, const int *known, kmp_writer_shape *out);

/** A text between quotes or tags of XML. */
void kmp_export_text(kmp_text *text, const char *s);

/** The name of a point that no joint and no closure ends at, BODY_POINT, which no link, joint, loop and other point
 * has; NULL: it has one of these ends, or no name. */
const char *kmp_export_point_name(kmp_export *w, int point);
