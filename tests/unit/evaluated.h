/* SPDX-License-Identifier: BSD-3-Clause */
/* A run and the values of its outputs at each row. */
#ifndef KEMPE_TESTS_EVALUATED_H
#define KEMPE_TESTS_EVALUATED_H

#include "integrators/run/run.h"
#include "loaded.h"
#include "studies/simulate/trajectory.h"

typedef struct evaluated {
    kempe_trajectory *run;
    kmp_evaluator *eval;
    int rows; /* 0: it failed */
} evaluated;

/** A run that must end with the given status. One that does not is a failed check, and said. */
static inline evaluated evaluate(const loaded *l, const kempe_run_options *options, kempe_status end)
{
    evaluated e = {.eval = l->system ? kmp_eval_new(l->system, "tape") : NULL};
    CHECK(e.eval && kempe_simulate(l->system, options, &e.run) == end);
    if (!e.run)
        printf("%s\n", kempe_context_message(l->context));
    e.rows = e.run ? kempe_trajectory_row_count(e.run) : 0;
    return e;
}

static inline const double *shown_at(const evaluated *e, int row)
{
    return kmp_samples_shown(&e->run->table, e->eval, row);
}

static inline void release(evaluated *e)
{
    kempe_trajectory_free(e->run);
    kmp_eval_free(e->eval);
}

#endif
