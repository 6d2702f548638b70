/* SPDX-License-Identifier: BSD-3-Clause */
/* Runs of a model at a tight tolerance by each formulation, for tests that compare them with the same digits. */
#ifndef KEMPE_TESTS_WAYS_H
#define KEMPE_TESTS_WAYS_H

#include "loaded.h"
#include "studies/simulate/trajectory.h"
#include <string.h>

typedef struct way {
    const char *formulation, *form, *integrator;
    double tolerance; /* of times and states at rtol 1e-11 */
    double atol;      /* 0: rtol */
} way;

static const way ways[] = {{"reduced", "integrated", "dop853", 1e-9, 0},
                           {"reduced", "integrated", "radau", 1e-9, 0},
                           {"reduced", "newton", "dop853", 1e-9, 0},
                           {"projected", NULL, "dop853", 1e-9, 0},
                           {"projected", NULL, "radau", 1e-9, 0},
                           {"dae", NULL, "ida", 1e-6, 0},
                           {"dae", NULL, "radau", 1e-6, 0},
                           {"reduced", "newton", "ida", 1e-6, 0},
                           {"reduced", "newton", "bdf", 1e-6, 0}};

enum { WAYS = sizeof ways / sizeof *ways };

/** A run that may end in any way: its end is for the test to judge. NULL: a failed check, and said. */
static inline kempe_trajectory *simulate_any(const loaded *l, const way *by, double t_end, kempe_status *status)
{
    kempe_trajectory *run = NULL;
    kempe_run_options options = {.formulation = by->formulation,
                                 .form = by->form,
                                 .integrator = by->integrator,
                                 .rtol = 1e-11,
                                 .atol = by->atol,
                                 .t_end = t_end,
                                 .no_convergence_check = 1};
    *status = l->system ? kempe_simulate(l->system, &options, &run) : KEMPE_E_INPUT;
    CHECK(run != NULL);
    if (!run)
        printf("%s: %s\n", by->formulation, kempe_context_message(l->context));
    return run;
}

/** A run that reaches its end. One that does not is a failed check, and said. */
static inline kempe_trajectory *simulate(const loaded *l, const way *by, double t_end)
{
    kempe_status status;
    kempe_trajectory *run = simulate_any(l, by, t_end, &status);
    if (status == KEMPE_UNTRUSTED)
        printf("%s %s %s\n", by->formulation, by->integrator ? by->integrator : "", run->warnings);
    CHECK(status == KEMPE_OK);
    if (run && kempe_trajectory_reason(run)[0])
        printf("%s %s: %s\n", by->formulation, by->integrator ? by->integrator : "", kempe_trajectory_reason(run));
    return run;
}

/** The n-th entry of a kind in the log, from 0; NULL: there are fewer. */
static inline const kmp_log_entry *entry(const kempe_trajectory *run, const char *kind, int n)
{
    for (int k = 0; k < run->log.kept; k++)
        if (strcmp(run->log.entries[k].kind, kind) == 0 && n-- == 0)
            return &run->log.entries[k];
    return NULL;
}

static inline const double *last_q(const kempe_trajectory *run)
{
    return kempe_trajectory_q(run, kempe_trajectory_row_count(run) - 1);
}

static inline const double *last_qd(const kempe_trajectory *run)
{
    return kempe_trajectory_qd(run, kempe_trajectory_row_count(run) - 1);
}

static inline const double *last_lambda(const kempe_trajectory *run)
{
    return kempe_trajectory_lambda(run, kempe_trajectory_row_count(run) - 1);
}

#endif
