/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters from measured motions: the fit, its statistics, its text and tables. */
#pragma once

#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "ensemble/fit/bounded.h"
#include "ensemble/fit/measured.h"
#include "ensemble/fit/nonlinear_squares.h"
#include <kempe/fit.h>

typedef enum kmp_fit_state {
    KMP_FIT_INSIDE,
    KMP_FIT_LOWER, /* at its lower bound */
    KMP_FIT_UPPER,
    KMP_FIT_OPEN /* the data does not determine it */
} kmp_fit_state;

/* A data file, and the run that it is compared with. */
typedef struct kmp_fit_run {
    const char *file;
    kempe_model *own;      /* with the values only of this run; NULL: the fit's */
    const char *names;     /* of its parameters, separated by commas */
    kmp_slope_runs *runs;  /* their equations; the rows belong to the estimates at the end */
    long most_steps;       /* bound on the steps of a trial; 0: none is known yet */
    kmp_measured measured; /* data column c is column[c] of the rows, and among[c] of the fit's columns */
    int *column, *among;
    int count, *parameter; /* of this run; each among the parameters of the fit */
    double *motion;        /* rows x columns: of the estimates, as fitted */
} kmp_fit_run;

/** One search. */
typedef struct kmp_fit_search {
    bool begun;
    double *value, *best, size; /* its start; the best values, and the sum of squares there (infinite: none ran) */
    long *most_steps;           /* of each data file */
    int evaluations, iterations, refused;
    kmp_squares_outcome outcome;
    char *refusal; /* reason of the last refused trial; NULL: none */
} kmp_fit_search;

struct kempe_fit {
    kempe_context *context;
    const kempe_model *model;
    kmp_arena arena;  /* of all arrays */
    kmp_fit_run *run; /* one for each data file */
    int run_count;
    int columns; /* of all data files, by name */
    char **column_name;
    const char **column_unit;
    kmp_box_bounds bounded;
    int count; /* parameters */
    char **name;
    double *lower, *upper, *start, *value, *error, *low, *high;
    kmp_fit_state *state;
    double *deviation, *rms;  /* by column */
    double *own_scatter;      /* of the data about its mean */
    bool *exact;              /* residuals are errors of the runs */
    int *number;              /* of measurements in each */
    double *freedom;          /* degrees of freedom: the number less the part of the parameters that it determines */
    bool given;               /* deviations are */
    int residuals, freedoms;  /* known measurements; less the rank */
    double *residual, *slope; /* weighted; residuals x count, column-major */
    double *room;             /* count: values of one run */
    double *best, size;       /* the best values so far, and the sum of squares there, with these weights */
    double *correlation;      /* count x count; NaN */
    double scatter;           /* root of the weighted sum of squares by the degrees of freedom */
    double confidence;        /* of the intervals */
    double *factor;           /* count: half the width of the interval over the standard error */
    double condition;         /* of the scaled Jacobian */
    int rank, free;           /* parameters that are not at bounds */
    double coarser;           /* the largest change of a fitted value at another tolerance, in deviations; NaN */
    int starts, searches, threads;
    double helped_s, helped_build_s;                    /* processor time of other threads: runs, equations */
    kempe_run_options run_options;                      /* of one thread; its texts are there while the fit is made */
    kmp_fit_search *search;                             /* while they run */
    int most, evaluations, iterations, refused, rounds; /* of the weights */
    bool unsettled;                                     /* the weights still changed in the last round */
    kmp_squares_outcome outcome;
    kempe_status status;
    char *refusal; /* reason of the last refused trial; NULL: none */
    char *reason, *warnings;
};

/** The rows of a data file at the last values. */
static inline const kempe_sensitivity *kmp_fit_rows(const kempe_fit *fit, int run)
{
    return kmp_slope_runs_rows(fit->run[run].runs);
}

/** A measurement, NaN: unknown; the next known one after a place, false: there is none. */
typedef struct kmp_fit_cell {
    int run, row, column;
} kmp_fit_cell;

#define KMP_FIT_BEGIN ((kmp_fit_cell){0, 0, -1})
bool kmp_fit_next(const kempe_fit *fit, kmp_fit_cell *at);
