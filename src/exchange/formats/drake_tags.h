/* SPDX-License-Identifier: BSD-3-Clause */
/* Elements that Drake adds to URDF and SDFormat: constraints and forces between points of two bodies. A value is the
 * text of an element (SDFormat), or its attribute `name` or `value` (URDF). */
#pragma once

#include "exchange/formats/foreign_parts.h"

/** The point BODY.NAME at a place in a frame of the file, which may be a body; NULL after a complaint at e. */
typedef const char *kmp_drake_point(void *reader, const kmp_element *e, const char *frame, const double at[3],
                                    const char *name);

/** Adds the constraints and forces of a model. Their names are the names of their kinds with a number, after a prefix.
 */
void kmp_drake_add(kmp_import *im, const kmp_element *model, const char *prefix, kmp_drake_point *point, void *reader);
