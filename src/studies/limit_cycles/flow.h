/* SPDX-License-Identifier: BSD-3-Clause */
/* The motion over a time and its derivatives by its start and by one parameter, by forward sensitivities. The state
 * consists of start values: positions and rates of independent coordinates, and states of the model. */
#pragma once

#include "studies/sensitivity/sensitivity_study.h"

enum { KMP_FLOW_PIECES = 200 }; /* of a period, for extremes */

/** A start value of a motion; a state of the model is the rate of its motion (model/model.h). */
typedef enum kmp_flow_kind { KMP_FLOW_POSITION, KMP_FLOW_RATE, KMP_FLOW_STATE } kmp_flow_kind;
typedef struct kmp_flow_entry {
    int motion;
    kmp_flow_kind kind;
} kmp_flow_entry;

/** "q", "qd", "state": with a point and the name, that of the start value among the parameters of a run. */
extern const char *const kmp_flow_kinds[];
const char *kmp_flow_name(const kempe_model *model, const kmp_flow_entry *entry);

typedef struct kmp_flow {
    kempe_context *context;
    const kempe_system *system;
    kmp_arena arena; /* of all arrays */
    kmp_slope_runs *runs;
    const kempe_sensitivity *rows; /* of the last run: a column for each output */
    double rtol;
    int size; /* of the state */
    kmp_flow_entry *entry;
    double *values; /* size + 1: of the parameters of the runs, the varied one last */
    double *sizes;  /* likewise */
    double *times;  /* KMP_FLOW_PIECES + 1 */
    int row;        /* to come next */
    int pieces;
    double *begin, *end;           /* size: the state at both ends of the last run */
    double *begin_rate, *end_rate; /* size: its change with time there */
    double *slope;                 /* size x (size + 1): of end - begin by the state at the start and the parameter */
    double *monodromy;             /* size x size: of the end by the state at the start */
    double *history;               /* size x (KMP_FLOW_PIECES + 1): the state at the times of the last run */
} kmp_flow;

/** A flow of a system whose parameter `name` varies, with `outputs` in its rows. KEMPE_E_ARGUMENT, KEMPE_E_FAILED as
 * kmp_slope_runs_new. `entry` (size) is copied. */
kempe_status kmp_flow_new(const kempe_system *system, const char *name, const char *outputs,
                          const kempe_run_options *run, int size, const kmp_flow_entry *entry, kmp_flow **flow);
void kmp_flow_free(kmp_flow *flow);

/** The largest of sizes of start values of a kind, over those of their motions. */
double kmp_flow_largest(const kmp_flow *flow, const double *sizes, kmp_flow_kind kind);

/** Sets absolute tolerances by the sizes of the state (size) and of the parameter. */
void kmp_flow_weigh(kmp_flow *flow, const double *sizes, double parameter);

/** Runs over a time from x (size) with a value of the parameter, in so many pieces, 1 to KMP_FLOW_PIECES.
 * KEMPE_E_FAILED with its reason, KEMPE_STOPPED. */
kempe_status kmp_flow_run(kmp_flow *flow, const double *x, double time, double value, int pieces);

/** The largest and the least value of a periodic quantity with `count` values at `stride`, a period without its end:
 * those of the polynomials of fourth degree through the extreme value and its neighbours. */
void kmp_flow_extremes(int count, const double *values, ptrdiff_t stride, double *high, double *low);
