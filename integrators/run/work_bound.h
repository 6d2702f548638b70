/* SPDX-License-Identifier: BSD-3-Clause */
/* Bound on the work of a run: a given number of steps, or else one by its progress. */
#pragma once

#include "base/text.h"
#include <stdbool.h>

typedef struct kmp_work_bound {
    long most;       /* attempted steps, rejected and refused ones included; 0: by progress; -1: no bound */
    long seen;       /* attempted steps at the last look at progress */
    double seen_t;   /* time of the run then */
    bool has_looked; /* a look was taken */
} kmp_work_bound;

/** After a step: `tried` attempts so far, the run is at t and ends at t_end. True when it must stop, with the sentence
 * in `why` (NULL: not wanted). A default bound judges steps in long windows; it ends a run whose last window would have
 * to be repeated hundreds of times. */
bool kmp_work_bound_passed(kmp_work_bound *bound, long tried, double t, double t_end, kmp_text *why);

/** The number of further steps for which a bound that was asked at `tried` steps need not be asked. */
long kmp_work_bound_spare(const kmp_work_bound *bound, long tried);
