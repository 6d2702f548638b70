/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of a trajectory by differences of whole runs, of models whose motion has no exact ones here: friction
 * that sticks. The motion is continuous in the parameters, with derivatives between the changes of modes. */
#pragma once

#include "integrators/run/run.h"
#include "studies/sensitivity/sensitivity_study.h"

/** Options of the runs; the outputs of the columns; independent coordinates at the start (NULL: chosen); times. */
typedef struct kmp_differing {
    const kmp_run_spec *spec;
    const char *words, *independent;
    int count;
    const double *t;
} kmp_differing;

/** Makes the rows of `s`, values and derivatives, and s->slope_error: the largest change of a derivative at twice the
 * step, over the largest derivative of its column. *report: work of the run at `values`. KEMPE_E_FAILED, KEMPE_STOPPED:
 * as kmp_slope_runs_at. */
kempe_status kmp_run_differences(kempe_sensitivity *s, const kmp_differing *options, const double *values,
                                 kmp_run_report *report);
