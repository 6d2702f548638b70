/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensitivities of trajectories: rows over time by forward sensitivities; the end, or integrals up to it, by either
 * method. */
#pragma once

#include "analyses/sensitivity/sensitivity_study.h"
#include "model/data/force.h"

/** `t`: times of the rows, ascending from 0 or later; they are copied. Of the options parameters, outputs and run
 * count. `differences`: of runs, for a model that rolls in space; the options' texts must stay
 * then as long as there are runs. Errors of kempe_sensitivity_new. */
kempe_status kmp_slope_runs_new(const kempe_model *model, const kempe_sensitivity_options *options, int count,
                                const double *t, bool differences, kmp_slope_runs **runs);
void kmp_slope_runs_free(kmp_slope_runs *runs);

/** Other times of the rows, no more than before; the last one is the end of the runs. */
void kmp_slope_runs_set_times(kmp_slope_runs *runs, int count, const double *t);

/** Calls `row` with each row of the runs, with all coordinates and their derivatives; NULL: no more. */
void kmp_slope_runs_watch(kmp_slope_runs *runs, int (*row)(void *user, const kmp_sensitivity_equations_row *row),
                          void *user);

/** The characteristic length from now on, also where it would be a start value that varies. */
void kmp_slope_runs_keep_length(kmp_slope_runs *runs, double length);

/** Another absolute tolerance of an angle, and other sizes of the parameters (count). */
void kmp_slope_runs_weigh(kmp_slope_runs *runs, double atol, const double *sizes);

/** Runs. KEMPE_E_FAILED: the model cannot have these values, or does not reach the last time; the message has the
 * reason. KEMPE_STOPPED: an interrupt. */
kempe_status kmp_slope_runs_at(kmp_slope_runs *runs, const double *values);

/** The same at a multiple of the tolerances. */
kempe_status kmp_slope_runs_coarser(kmp_slope_runs *runs, double factor, const double *values);

/** From now on runs fail beyond `times` the attempted steps of the last one, and `least`; without effect where the
 * options or the model have a bound (max_steps). */
void kmp_slope_runs_bound(kmp_slope_runs *runs, long times, long least);
/** The bound on attempted steps, 0 for none; another one. */
long kmp_slope_runs_most(const kmp_slope_runs *runs);
void kmp_slope_runs_set_most(kmp_slope_runs *runs, long most);

/** Columns, values and derivatives of the last run; names, sizes and given values of the parameters; sums of work. */
const kempe_sensitivity *kmp_slope_runs_rows(const kmp_slope_runs *runs);
