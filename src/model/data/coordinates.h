/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinates as users write them: "A", and lists, "A,slide.2". */
#pragma once

#include "model/data/model.h"

/** The coordinate with the name in the first `length` characters of `name`, without spaces around it. KEMPE_E_ARGUMENT:
 * there is none; the message has the nearest name; `what` (an option's name) begins it. */
kempe_status kmp_coordinate_find(const kempe_model *model, const char *what, const char *name, size_t length,
                                 int *coordinate);

/** The coordinates of a list separated by commas, none twice, into room for all; `text` may be NULL: none. Errors as
 * kmp_coordinate_find. */
kempe_status kmp_coordinates_read(const kempe_model *model, const char *what, const char *text, int *list, int *count);
