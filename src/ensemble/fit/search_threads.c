/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/fit/search_threads.h"
#include "base/memory.h"
#include "base/thread_pool.h"
#include <pthread.h>
#include <stdatomic.h>

typedef struct thread_search {
    bool begun;
    kempe_context *context;
    void *searcher;
    kempe_status status;
} thread_search;

typedef struct shared_searches {
    const kmp_searcher_kind *kind;
    void *job;
    kempe_context *context;
    int count;
    pthread_t caller;
    atomic_int next, others; /* search; thread other than the caller */
    atomic_bool ended;       /* a thread has a status */
    thread_search of[KMP_TEAM_MOST + 1];
} shared_searches;

/* The searcher of this thread. There are as many pieces of work as threads, and a piece takes at most one new searcher:
 * so there is room for all. */
static thread_search *take_searcher(shared_searches *r)
{
    bool caller = pthread_equal(pthread_self(), r->caller);
    thread_search *t = &r->of[caller ? 0 : atomic_fetch_add(&r->others, 1)];
    if (!t->begun) {
        t->begun = true;
        t->context = caller ? r->context : kmp_context_new_below(r->context);
        t->searcher = kmp_calloc(1, r->kind->size);
        t->status =
            t->context && t->searcher ? r->kind->begin(t->searcher, r->job, t->context, caller) : KEMPE_E_MEMORY;
    }
    return t;
}

static void search_shared(void *self, int piece)
{
    shared_searches *r = self;
    thread_search *t = NULL;
    int k;
    (void)piece;
    while (!atomic_load(&r->ended) && (k = atomic_fetch_add(&r->next, 1)) < r->count) {
        t = t ? t : take_searcher(r);
        if (t->status == KEMPE_OK)
            t->status = r->kind->search(t->searcher, k);
        if (t->status != KEMPE_OK)
            atomic_store(&r->ended, true);
    }
}

static kempe_status status_of(const shared_searches *r)
{
    for (int k = 0; k <= KMP_TEAM_MOST; k++) {
        const thread_search *t = &r->of[k];
        if (t->status == KEMPE_E_MEMORY)
            return kmp_fail_memory(r->context);
        if (t->status != KEMPE_OK)
            return t->context == r->context ? t->status
                                            : kmp_fail(r->context, t->status, "%s", kempe_context_message(t->context));
    }
    return KEMPE_OK;
}

kempe_status kmp_share_searches(kempe_context *context, const kmp_searcher_kind *kind, void *job, int threads,
                                int count, double *helped_s)
{
    shared_searches r = {
        .kind = kind, .job = job, .context = context, .count = count, .caller = pthread_self(), .others = 1};
    kmp_team *team = kmp_team_new(threads < count ? threads : count);
    KMP_TRY(kmp_made(context, team));
    kmp_team_run(team, kmp_team_threads(team), search_shared, &r);
    kempe_status status = status_of(&r);
    for (thread_search *t = r.of; t <= r.of + KMP_TEAM_MOST; t++) {
        if (t->searcher)
            kind->end(t->searcher);
        kmp_free(t->searcher);
        if (t->context != context)
            kempe_context_free(t->context);
    }
    *helped_s += kmp_team_cpu(team);
    kmp_team_free(team);
    return status;
}
