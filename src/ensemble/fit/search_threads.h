/* SPDX-License-Identifier: BSD-3-Clause */
/* Searches that threads share: each thread has a separate searcher, and takes the next search that has not begun. A
 * search depends only on its start, so that results have the same bits with any number of threads. */
#pragma once

#include "base/context.h"

typedef struct kmp_searcher_kind {
    size_t size; /* of a searcher, whose bytes are zero before `begin` */
    /* The searcher of the caller has the caller's context, another one a context below it. */
    kempe_status (*begin)(void *searcher, void *job, kempe_context *context, bool caller);
    /* A status other than KEMPE_OK ends all searches. */
    kempe_status (*search)(void *searcher, int number);
    void (*end)(void *searcher); /* also after a failed `begin` */
} kmp_searcher_kind;

/** Runs searches 0 .. count - 1 by at most `threads` threads. A status other than KEMPE_OK comes from a searcher, with
 * its message. *helped_s: processor time of the other threads. */
kempe_status kmp_share_searches(kempe_context *context, const kmp_searcher_kind *kind, void *job, int threads,
                                int count, double *helped_s);
