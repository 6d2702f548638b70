/* SPDX-License-Identifier: BSD-3-Clause */
/* Lists of coordinates as users write them: "A,slide.2". */
#ifndef KMP_RESULTS_COORDINATES_H
#define KMP_RESULTS_COORDINATES_H

#include "dynamics/system.h"

/** The coordinate called by the first `length` characters of `name`. KEMPE_E_ARGUMENT: there is none, said with the
 * nearest name; `what` (an option's name) begins the sentence. */
kempe_status kmp_coordinate_find(const kempe_system *system, const char *what, const char *name, int length,
                                 int *coordinate);

/** Those of a list with commas between, none twice, into room for n; `text` may be NULL: none. */
kempe_status kmp_coordinates_read(const kempe_system *system, const char *what, const char *text, int *list,
                                  int *count);

#endif
