/* SPDX-License-Identifier: BSD-3-Clause */
/* How many rows a run may be asked for, by its file or by who calls. */
#ifndef KMP_MODEL_TABLES_ROWS_H
#define KMP_MODEL_TABLES_ROWS_H

#include "base/text.h"

enum { KMP_MOST_ROWS = 1000000 };

/** Whether rows `every` so many seconds up to t_end are no more than that. When not, `complaint` says so (it stays
 * empty when there is no memory). */
bool kmp_rows_fit(double every, double t_end, kmp_text *complaint);

#endif
