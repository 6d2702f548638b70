/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinates as users write them: "A", and lists, "A,slide.2". */
#ifndef KMP_MODEL_TABLES_COORDINATES_H
#define KMP_MODEL_TABLES_COORDINATES_H

#include "model/model.h"

/** The coordinate called by the first `length` characters of `name`, spaces around it left out. KEMPE_E_ARGUMENT: there
 *  is none, said with the nearest name; `what` (an option's name) begins the sentence. */
kempe_status kmp_coordinate_find(const kempe_model *model, const char *what, const char *name, size_t length,
                                 int *coordinate);

/** Those of a list with commas between, none twice, into room for as many as there are; `text` may be NULL: none. */
kempe_status kmp_coordinates_read(const kempe_model *model, const char *what, const char *text, int *list, int *count);

#endif
