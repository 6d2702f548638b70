/* SPDX-License-Identifier: BSD-3-Clause */
/* States of a model along its motion. */
#ifndef KEMPE_TESTS_STATES_H
#define KEMPE_TESTS_STATES_H

#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include <math.h>
#include <string.h>

typedef struct states {
    int n, count;
    double t[32];
    double *q, *qd; /* count x n; q is to be freed */
} states;

static inline int keep_state(void *user, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda, double work)
{
    states *s = user;
    (void)qdd, (void)lambda, (void)work;
    s->t[s->count] = t;
    memcpy(s->q + s->count * s->n, q, (size_t)s->n * sizeof *q);
    memcpy(s->qd + s->count * s->n, qd, (size_t)s->n * sizeof *qd);
    s->count++;
    return 0;
}

/** `count` states of a run of its length, of one second at most. False: it failed, which is a failed check. */
static inline bool follow(const kempe_system *system, int count, states *at)
{
    kmp_run_report report = {0};
    double times[32];
    kmp_run_spec spec = {.formulation = "projected", .rtol = 1e-10, .time_count = count, .times = times};
    *at = (states){.n = system->n};
    at->q = KMP_NEW(double, 2 * count * at->n);
    at->qd = at->q + count * at->n;
    bool ok = kmp_run_resolve(system, &spec) == KEMPE_OK;
    spec.t_end = fmin(spec.t_end, 1);
    for (int k = 0; k < count; k++)
        times[k] = spec.t_end * k / count;
    ok = ok && kmp_run(system, &spec, NULL, keep_state, at, &report) == KEMPE_OK;
    CHECK(ok);
    if (!ok)
        printf("%s\n", report.reason ? report.reason : kempe_context_message(system->context));
    kmp_free(report.reason);
    return ok;
}

#endif
