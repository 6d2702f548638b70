/* SPDX-License-Identifier: BSD-3-Clause */
/* The log of a run, its entries between steps: time, kind, reason, and a measure before and after. */
#pragma once

#include "base/context.h"

typedef struct kmp_log_entry {
    double t;
    const char *kind;     /* one word: start, exchange, centring, rows, "change point", event, restart, formulation,
                             dynamics, solutions */
    double before, after; /* of the quantity that the text names; NaN if nothing is measured */
    char *text;
} kmp_log_entry;

/** One contact of a force element: from its beginning, NaN: the run began in it, until its end, NaN: it has not ended.
 */
typedef struct kmp_contact_time {
    int force;
    double from, until, most; /* the largest measure of its depth where it has ended */
} kmp_contact_time;

/* The first entries are kept, all are counted. */
typedef struct kmp_run_log {
    kempe_context *context; /* NULL: entries are handed to no other log */
    kmp_log_entry *entries;
    int kept;
    long count;
    kmp_contact_time *contacts; /* the first ones */
    int contact_count;
    bool contacts_cut; /* there were more */
} kmp_run_log;

/** Adds an entry, and hands it to the log of the context. Without memory it is only counted. NULL: does nothing. */
void kmp_run_log_add(kmp_run_log *log, const char *kind, double t, double before, double after, const char *format, ...)
    __attribute__((format(printf, 6, 7)));

/** Notes that a force element begins a contact at t, or ends it with the largest measure `most` of its depth. NULL:
 * does nothing. */
void kmp_run_log_contact(kmp_run_log *log, int force, double t, bool begins, double most);
void kmp_run_log_free(kmp_run_log *log);

/** Moves the entries up to a time of some logs without a context, of parts of a run, into one in the order of their
 * times (NULL: only into the log of the context), and empties them. False: no memory. */
bool kmp_run_log_merge(kmp_run_log *log, kempe_context *context, kmp_run_log *parts, int count, double until);
