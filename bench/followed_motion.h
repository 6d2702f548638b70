/* SPDX-License-Identifier: BSD-3-Clause */
/* States of a model's motion, at which timed programs evaluate it, and the least time of a call. */
#ifndef KEMPE_BENCH_FOLLOWED_MOTION_H
#define KEMPE_BENCH_FOLLOWED_MOTION_H

#include "bench.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include <math.h>
#include <string.h>

enum { STATES = 16, SAMPLES = 7 };

typedef struct motion {
    int n, count;
    double t[STATES], *q, *qd; /* STATES x n */
} motion;

static inline int motion_keep(void *user, double t, const double *q, const double *qd, const double *qdd,
                              const double *lambda, double work)
{
    motion *m = user;
    size_t n = (size_t)m->n;
    (void)qdd, (void)lambda, (void)work;
    m->t[m->count] = t;
    memcpy(m->q + (size_t)m->count * n, q, n * sizeof *q);
    memcpy(m->qd + (size_t)m->count * n, qd, n * sizeof *qd);
    m->count++;
    return 0;
}

static inline void bench_fail(const bench *b, const char *name)
{
    fprintf(stderr, "%s: %s\n", name, kempe_context_message(b->context));
    exit(1);
}

static inline motion motion_follow(const bench *b, const char *name)
{
    motion m = {.n = b->system->n};
    double times[STATES];
    kmp_run_report report = {0};
    kmp_run_spec spec = {.formulation = "projected", .rtol = 1e-8, .time_count = STATES, .times = times};
    m.q = calloc(2 * STATES * (size_t)m.n, sizeof *m.q);
    m.qd = m.q + STATES * m.n;
    if (kmp_run_resolve(b->system, &spec) != KEMPE_OK)
        bench_fail(b, name);
    spec.t_end = fmin(spec.t_end, 0.2);
    for (int k = 0; k < STATES; k++)
        times[k] = spec.t_end * k / STATES;
    if (kmp_run(b->system, &spec, NULL, motion_keep, &m, &report) != KEMPE_OK)
        bench_fail(b, name);
    return m;
}

/* Returns ns of a call of `once` with the number of the call: the least of samples of some milliseconds. */
static inline double least_time(void (*once)(void *self, int k), void *self)
{
    double best = INFINITY;
    int times = STATES;
    for (int sample = 0; sample < SAMPLES;) {
        double from = bench_now(), took;
        for (int k = 0; k < times; k++)
            once(self, k);
        took = bench_now() - from;
        if (took < 2e-3) {
            times *= 2;
            continue;
        }
        best = fmin(best, 1e9 * took / times);
        sample++;
    }
    return best;
}

#endif
