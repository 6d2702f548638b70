/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers, places in the header of a state, and results of an evaluation. A part of kempe_simulator.c. */
#ifndef SIMULATOR_NUMBERS_H
#define SIMULATOR_NUMBERS_H

#include "base/bracket.h"
#include "generate/runtime/kempe_simulator.h"
#include "integrators/steppers/explicit_methods.h"
#include "integrators/steppers/sample_times.h"
#include "linalg/dense/factors.h"

#include <stdio.h>
#include <string.h>

enum {
    MOST_CLOSINGS = 12,
    MOST_LOADS = 50,
    MOST_ATTEMPTS = 1000,
    MOST_PASSES = 20,
    MOST_PARTS = 256,
    MOST_FINER = 100,
    MOST_HALVINGS = 24
};

/* Scaled numbers; each means the same as in the library. */
#define CLOSED_ENOUGH        1e-11 /* largest h where rounding stops the corrections */
#define LONGEST_CORRECTION   0.5   /* of a coordinate, rad or characteristic lengths */
#define TRUSTED_CORRECTION   0.1   /* a longer one comes from a distant guess: it is approached in parts */
#define CORRECTION_LIMIT     1.0   /* of v at the end of a step, in error weights; with redundant rows REDUNDANT */
#define CORRECTION_REDUNDANT 3e-3
#define CORRECTION_ROUNDING  1e-13
#define GROWTH               1.5 /* of dependent coordinates over independent ones: above it both are exchanged */
#define GROWTH_OF_CALLERS    3.0 /* the same where each exchange restarts an integrator of the caller */
#define ROWS_OUT             2.0 /* share of a row in a redundant one above which rows are chosen anew */
#define DROPPED_WEIGHTS      1e3 /* tolerances by which a redundant row may open; or OVER times its opening at the start */
#define DROPPED_START        1e-4
#define DROPPED_OVER         30.0
#define UNCONTROLLED         1e300
#define LOADS_SETTLED        1e-14 /* relative change of multipliers at which C is at them; where rounding stops it */
#define LOADS_ROUNDED        1e-9
#define NO_MASS              1e-13 /* pivot of the reduced mass over its diagonal */
#define JUMP                 1e-9  /* of rates where modes change, over the fastest one */
#define KINK                 100.0 /* tolerances of its largest value beyond which a kink is fixed */
#define NEAR_BY              1.0   /* rad: angles that change by less are continuous */
#define ALONG_WITH           0.8   /* regularity below which joints get new angles together with a due one */
#define INSTANT              1e-11 /* of the time of the motion: events within it are at one time */

/* Places in the header of the state. */
enum {
    AT_T,
    AT_BEGIN, /* of the last step, from which its dense output counts */
    AT_END,   /* of the last step, or an event within it */
    AT_TAKEN, /* length of the step that was made; 0: none */
    AT_METHOD_TAKEN,
    AT_NEXT,
    AT_ERROR,
    AT_REJECTED,
    AT_HOPELESS,
    AT_DENSE,    /* vectors of the dense output are there */
    AT_COARSE,   /* they are too inexact: further steps take their place */
    AT_FRESH,    /* the derivative at the end is not there */
    AT_EVENT,    /* modes change at the end, by `flip` */
    AT_EXCHANGE, /* the choice is bad at the end */
    AT_ENDED,    /* 1 + the condition that ends the motion at the end; 0 */
    AT_SIGN,     /* of det Jv, block by block */
    AT_RATE,     /* of the motion at the start, 1/s */
    AT_LOOSE,    /* largest h of a redundant row at the start */
    AT_STARTED,
    AT_BAD, /* the choice is bad at the present state for an integrator of the caller */
    AT_METHOD,
    AT_RTOL,
    AT_ATOL,
    AT_FIXED,
    AT_LONGEST,
    AT_LAST,
    AT_MOST,
    AT_STEPS,
    AT_REFUSED,
    AT_EVALUATIONS,
    AT_CLOSINGS,
    AT_EXCHANGES,
    AT_EVENTS,
    AT_RANK,
    HEADER = 48
};

/* Results of an evaluation. */
typedef enum outcome { GOOD, OPEN, SINGULAR_LOOPS, SINGULAR_MASS, NOT_FINITE, UNSETTLED, MOVED_ANGLES, TOLD } outcome;

static const kmp_rk_numbers methods[] = {KMP_DOP853_NUMBERS, KMP_DOPRI5_NUMBERS};

#endif
