/* SPDX-License-Identifier: BSD-3-Clause */
/* Notes of a run between its steps: time, kind, reason, and a measure before and after. */
#ifndef KMP_INTEGRATORS_RUN_JOURNAL_H
#define KMP_INTEGRATORS_RUN_JOURNAL_H

#include "base/context.h"

typedef struct kmp_note {
    double t;
    const char *kind; /* one word: exchange, centring, rows, "change point", event, restart, formulation, dynamics */
    double before, after; /* of the quantity that the text names; NaN if nothing is measured */
    char *text;
} kmp_note;

/* The first notes are kept, all are counted. */
typedef struct kmp_journal {
    kempe_context *context;
    kmp_note *notes;
    int kept, capacity;
    long count;
} kmp_journal;

/** Records a note and logs it. Without memory it is only counted. NULL: does nothing. */
void kmp_journal_note(kmp_journal *journal, const char *kind, double t, double before, double after, const char *format,
                      ...) __attribute__((format(printf, 6, 7)));
void kmp_journal_free(kmp_journal *journal);

#endif
