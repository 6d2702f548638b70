/* SPDX-License-Identifier: BSD-3-Clause */
/* The simulator whose conditions kempe_events.c watches. A status is 0, or a number that ends the search. Generated
 * simulators have this file too. */
#pragma once

#include <stdbool.h>

/** The status of a search in which condition k has not been decided by as many evaluations as a step may have: this +
 * k.
 */
enum { KMP_WATCH_UNDECIDED = 2 };

typedef struct kmp_watch_site {
    void *self;
    int conditions;
    /** Bounds read these: of the last look, and the inputs that are constant during a step. */
    const double *q, *qd, *qdd, *lambda, *modes, *chart, *p, *u;
    double *last; /* values of the conditions at the end of a step without a change */
    /** Goes to a time within the step: values of the conditions, and of the unknowns of their implicit blocks. */
    int (*look)(void *self, double t, double *change, double *solved);
    /** False for a condition that is not an event. */
    bool (*may_change)(const void *self, int condition);
    /** True for a condition that is fixed where its value is negative. */
    bool (*holds)(const void *self, int condition);
    /** Ends a piece, with the values at both ends. *found: it has a change, at which the step now ends. */
    int (*end)(void *self, double from, const double *before, double to, const double *change, bool *found);
} kmp_watch_site;
