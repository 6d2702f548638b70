/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/tables/rows.h"

bool kmp_rows_fit(double every, double t_end, kmp_text *complaint)
{
    double rows = t_end / every;
    if (rows <= KMP_MOST_ROWS)
        return true;
    kmp_text_printf(
        complaint,
        "output_step = %g s gives %.3g rows up to t_end = %g s, but at most %d are stored; use a larger step", every,
        rows, t_end, KMP_MOST_ROWS);
    return false;
}
