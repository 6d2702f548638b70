/* SPDX-License-Identifier: BSD-3-Clause */
/* How much work a run may take: a number of steps that is asked for, or else as much as its progress makes sensible. */
#ifndef KMP_INTEGRATORS_RUN_WORK_BOUND_H
#define KMP_INTEGRATORS_RUN_WORK_BOUND_H

#include "base/text.h"
#include <stdbool.h>

typedef struct kmp_work_bound {
    long most;       /* steps tried, those rejected and refused among them; 0: as progress says; -1: no bound */
    long seen;       /* steps tried when progress was looked at last */
    double seen_t;   /* and where the run stood */
    bool has_looked; /* at least once */
} kmp_work_bound;

/** After a step: `tried` so far, the run stands at t and shall reach t_end. True when it is to end, with the sentence
 * in `why` (NULL: nobody wants it). A default bound looks at the steps in long windows; it ends a run whose last window
 * would have to be repeated hundreds of times. */
bool kmp_work_bound_passed(kmp_work_bound *bound, long tried, double t, double t_end, kmp_text *why);

#endif
