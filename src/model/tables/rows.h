/* SPDX-License-Identifier: BSD-3-Clause */
/* The largest number of rows of a run, requested by its file or by the caller. */
#ifndef KMP_MODEL_TABLES_ROWS_H
#define KMP_MODEL_TABLES_ROWS_H

#include "base/text.h"

enum { KMP_MOST_ROWS = 1000000 };

/** True if the number of rows at intervals of `every` seconds up to t_end is allowed. Otherwise `complaint` has the
 * message (it stays empty when there is no memory). */
bool kmp_rows_fit(double every, double t_end, kmp_text *complaint);

#endif
