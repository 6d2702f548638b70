/* SPDX-License-Identifier: BSD-3-Clause */
/* The times at which a run delivers rows. */
#pragma once

#include "model/data/run_settings.h"
#include "output/reference.h"

typedef struct kmp_times {
    int count;
    double *t;
} kmp_times;

/** The time between rows up to t_end: `requested`, or if 0 the model's, or a two hundredth of t_end. If it makes too
 * many rows: KEMPE_E_ARGUMENT for `requested`, KEMPE_E_INPUT with the place of the model's. */
kempe_status kmp_times_spacing(const kempe_system *system, double requested, double t_end, double *every);

/** 0, every, 2 every ... t_end and the reference's times (NULL: none), ascending, none twice. A grid time within
 * rounding of t_end or of a reference time is dropped. every > 0; at most KMP_MOST_ROWS grid times. False: no memory.
 */
bool kmp_times_init(kmp_times *times, double every, double t_end, const kmp_reference *reference);
void kmp_times_free(kmp_times *times);
