/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of the timed studies: a model made ready, the processor's clock, medians. */
#ifndef KEMPE_BENCH_H
#define KEMPE_BENCH_H

#include "dynamics/system.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct bench {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} bench;

/* The studies, with the arguments behind the name of the program; 0: done. */
#define BENCH_STUDY(name, about) int bench_##name(int argc, char **argv);
#include "bench.def"
#undef BENCH_STUDY

static inline bench bench_load(const char *path)
{
    bench b = {kempe_context_new(), NULL, NULL};
    if (kempe_model_read(b.context, path, &b.model) || kempe_system_new(b.model, &b.system)) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        exit(1);
    }
    return b;
}

static inline void bench_free(bench *b)
{
    kempe_system_free(b->system);
    kempe_model_free(b->model);
    kempe_context_free(b->context);
}

static inline double bench_now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static inline int bench_order(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static inline double bench_median(int count, double *x)
{
    qsort(x, (size_t)count, sizeof *x, bench_order);
    return x[count / 2];
}

#endif
