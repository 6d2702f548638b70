/* SPDX-License-Identifier: BSD-3-Clause */
/* The iteration matrix of the dae formulation at the start of a run, with a linear solver for it. */
#ifndef KEMPE_BENCH_ITERATION_MATRIX_H
#define KEMPE_BENCH_ITERATION_MATRIX_H

#include "bench.h"
#include "integrators/run/runner.h"
#include "integrators/sundials/linear.h"
#include "integrators/sundials/sundials_host.h"
#include <string.h>

enum { SAMPLES = 9 };

/* The formulation at its start, with room to evaluate and solve there. */
typedef struct place {
    kmp_runner *run;
    const kmp_dae *dae;
    SUNContext sun;
    SUNMatrix matrix;
    SUNLinearSolver solver;
    N_Vector b, x;
    double cj;
} place;

static inline void evaluate(place *p)
{
    (void)p->dae->residual(p->dae->self, 0, p->run->formulation->y, p->run->formulation->yp, kmp_sun_data(p->b));
}

static inline void differentiate(place *p)
{
    (void)p->dae->matrix(p->dae->self, 0, p->cj, p->run->formulation->y, p->run->formulation->yp,
                         SUNSparseMatrix_Data(p->matrix));
}

static inline void factor(place *p)
{
    (void)SUNLinSolSetup(p->solver, p->matrix);
}

static inline void solve(place *p)
{
    (void)SUNLinSolSolve(p->solver, p->matrix, p->x, p->b, 0);
}

/* Seconds of one, the median of samples long enough for the clock. */
static inline double time_of(place *p, void (*what)(place *p))
{
    double sample[SAMPLES], one = 1e-4;
    what(p);
    for (int k = 0; k < SAMPLES; k++) {
        int times = 1 + (int)(1e-3 / one);
        double from = bench_now();
        for (int i = 0; i < times; i++)
            what(p);
        one = sample[k] = (bench_now() - from) / times;
    }
    return bench_median(SAMPLES, sample);
}

static inline void open_place(place *p, kmp_runner *run, const char *name, double h)
{
    const kmp_dae *dae = &run->formulation->dae;
    *p = (place){.run = run, .dae = dae, .sun = kmp_sun_context(), .cj = 1 / h};
    p->matrix = SUNSparseMatrix(dae->n, dae->n, dae->nz, CSC_MAT, p->sun);
    p->b = kmp_vector_new(dae->n, p->sun);
    p->x = kmp_vector_new(dae->n, p->sun);
    kmp_sun_put_pattern(dae, p->matrix);
    p->solver = kmp_linear_new(name, p->matrix, p->sun);
}

static inline void close_place(place *p)
{
    N_VDestroy(p->b);
    N_VDestroy(p->x);
    SUNLinSolFree(p->solver);
    SUNMatDestroy(p->matrix);
    SUNContext_Free(&p->sun);
}

static inline int drop_row(void *user, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda, double work)
{
    (void)user, (void)t, (void)q, (void)qd, (void)qdd, (void)lambda, (void)work;
    return 0;
}

#endif
