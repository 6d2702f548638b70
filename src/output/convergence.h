/* SPDX-License-Identifier: BSD-3-Clause */
/* Convergence check of integrated results: repeat runs at another tolerance, and at a third one in cases of doubt. An
 * integrator keeps the error of each step below the tolerance. Only a repeat run shows how the motion amplifies it
 * later, and if both pass a change point on the same branch. Used for runs, sensitivities and ensembles. */
#pragma once

#include "base/json.h"
#include "integrators/run/run.h"
#include "output/samples.h"
#include <kempe/check.h>

typedef struct kmp_convergence {
    bool known;        /* false: there was no other run */
    double rtol;       /* of the repeat run, the last one when there were two */
    double difference; /* largest |x - x'| / max(|x|, size of x) over the rows */
    int index;         /* the number whose it is, or whose `seen` is; and when */
    double t;
    const double *visible; /* of each number, a difference |x - x'| that is seen in the results; NULL: unknown */
    double seen;           /* largest |x - x'| over that: beyond 1 a run is not accepted */
    double apart;          /* this |x - x'| */
    double until;          /* last row before the difference leaves `limit` */
    double limit;          /* the largest difference of an accepted run */
    double reported;       /* a smaller difference that still gives a warning; 0: none does */
    int form;              /* the first angle, + 1, of a spherical joint whose angles are another form of the */
    double form_t;         /* same rotation from here on; 0: none */
    double stopped;        /* time at which the repeat run ended, NaN when it was complete */
    int parts;             /* of the run that were repeated; 0: the whole of it */
    double checked;        /* s: all parts together */
    double total;          /* the errors of all steps together, by the errors of the parts */
} kmp_convergence;

/** A computation that can be repeated, in one or several cases, each of which converges or does not. */
typedef struct kmp_repeat {
    kempe_context *context;
    double rtol, t_start; /* of the first run */
    double promised; /* an error of more tolerances is reported, although an accepted run may have it; 0: none is */
    bool uneven;     /* errors fall unevenly with the tolerance: a coarser run does not show their size */
    const double *visible; /* of each case, `numbers` each, as in kmp_convergence; NULL: a relative difference of
                              KMP_VISIBLE is seen, unless errors are reported */
    int numbers;
    void *user;
    /** Runs cases which[0 .. count-1] at another rtol, atol in proportion. It passes each row to kmp_convergence_row
     * and sets `stopped` where a case was not complete. KEMPE_OK; KEMPE_STOPPED: interrupted by the user;
     * KEMPE_E_MEMORY. */
    kempe_status (*run)(void *user, double rtol, int count, const int *which, kmp_convergence *found);
} kmp_repeat;

/** The part of a coordinate's range, or of the energy exchanged, that is seen in a plot. */
#define KMP_VISIBLE 1e-3

/** A motion of no more than this many absolute tolerances is a rest: its range and energy are due to rounding. */
#define KMP_AT_REST 10.0

/** A difference of coordinate or state k that is seen in the results of a run in which it has a range. `lengths`: the
 * model has a size (kmp_system_length_scale); otherwise a translation is judged only by its range. */
double kmp_visible_difference(const kempe_system *system, const kmp_run_spec *spec, bool lengths, int k, double range);

/** Runs all cases again, quietly, and doubtful cases once more. KEMPE_OK or KEMPE_E_MEMORY. */
kempe_status kmp_convergence_of(const kmp_repeat *repeat, int cases, kmp_convergence *convergence);

/** Compares a row of the repeat run with the row of the first; size[k] > 0 is the size of number k where it is small.
 */
void kmp_convergence_row(kmp_convergence *found, double t, int count, const double *first, const double *other,
                         const double *size);

/** kmp_convergence_row for the coordinates of a system, from the coordinates of both runs, and for its states, from the
 * rates. States of contacts are judged by the motion. */
void kmp_convergence_state(kmp_convergence *found, double t, const kempe_system *system, const double *q,
                           const double *qd, const double *other_q, const double *other_qd);

/** Steps of a run between its rows. */
typedef struct kmp_step_counts {
    int rows, row; /* row: the row of the last step's end, or the next one */
    const double *time;
    long *steps;  /* rows: from each to the next */
    bool changes; /* conditions or modes have changed, or contact was lost during the run */
} kmp_step_counts;

/** Counts a step, in their order. */
void kmp_step_counts_add(kmp_step_counts *counts, double from, double to);

/** kmp_convergence_of for a run: `spec` from `start` (NULL: assembles), compared in q and states with the rows of
 * `table`, whose last are the rows of spec->times. A state that changes at events may differ in single rows. `ended`:
 * the run ended where the model requests it, at the last row of all. `counts`: of the run, whose parts are repeated if
 * they may be; NULL: the whole run is. */
kempe_status kmp_convergence_of_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                                    const kmp_samples *table, bool ended, const kmp_step_counts *counts,
                                    kmp_convergence *convergence);

bool kmp_convergence_holds(const kmp_convergence *convergence);

/** "converged", "not converged", "the other run did not come to its end"; "": there was none. */
const char *kmp_convergence_word(const kmp_convergence *convergence);

/** A warning when its error exceeds the promised one, a doubt when it has not converged. `name`: of the number at
 * `index`, with its unit where `visible` was known, else NULL; `advice`: the remedy, or "". */
void kmp_convergence_warn(kempe_context *context, const kmp_convergence *convergence, const char *name,
                          const char *unit, const char *advice);

/** The remedy for a run that is not accurate enough, as words: a smaller rtol, unless errors of rounding count, which
 * do not fall with rtol. */
const char *kmp_accuracy_remedy(double rtol);

/** The difference to the second run with its unit, "0.36 rad"; relative without a unit. */
void kmp_convergence_put_apart(kmp_text *text, const kempe_context *context, const kmp_convergence *convergence,
                               const char *unit);

/** The estimated error in one value: that difference, or, of a run that was repeated in parts, the sum of the errors of
 * all steps. */
void kmp_convergence_put_error(kmp_text *text, const kempe_context *context, const kmp_convergence *convergence,
                               const char *unit);

/** The estimated error as a sentence without its full stop; nothing without a second run. */
void kmp_convergence_put(kmp_text *text, const kempe_context *context, const kmp_convergence *convergence,
                         const char *name, const char *unit);
void kmp_convergence_json(kmp_json *json, const kmp_convergence *convergence, const char *name);
