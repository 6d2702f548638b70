/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of a run: a value at its end or at a time, extremes with their times, means, times and numbers of changes
 * of a condition. They are taken from the dense output of each step, as polynomials over parts that are halved until
 * these are resolved: the polynomials lack less than the tolerance, and nothing is hidden between their points. The
 * run gives values of channels, which are expressions at a state. */
#pragma once

#include "model/language/expression.h"
#include <stddef.h>

typedef enum kmp_run_quantity_kind {
    KMP_TAKE_END,      /* the value at the end */
    KMP_TAKE_AT,       /* the value at a time */
    KMP_TAKE_MAX,      /* the largest value, and its time */
    KMP_TAKE_MIN,      /* the least value, and its time */
    KMP_TAKE_RANGE,    /* the largest value less the least one */
    KMP_TAKE_MEAN,     /* the mean over time */
    KMP_TAKE_RMS,      /* the root of the mean square */
    KMP_TAKE_INTEGRAL, /* the integral over time */
    KMP_TAKE_FIRST,    /* the first time at which a condition holds */
    KMP_TAKE_COUNT,    /* the number of times that a condition begins to hold */
    KMP_TAKE_DURATION, /* the time during which it holds */
    KMP_TAKE_KINDS
} kmp_run_quantity_kind;

typedef struct kmp_run_quantity {
    kmp_run_quantity_kind kind;
    int channel;   /* of a condition: it holds where the value is negative */
    bool or_equal; /* or zero */
    bool averages; /* a mean or an integral of accelerations or multipliers, which lacks the impulses of impacts */
    double time;   /* of KMP_TAKE_AT */
    bool spanned;  /* it is taken between begin and end, not over the whole run */
    double begin, end;
    int first_value; /* among the values of all quantities */
} kmp_run_quantity;

/* An argument of a function in the expression of a channel: the function may change where its argument does, between
 * points at which it is sampled. */
typedef struct kmp_run_argument {
    kmp_argument_kind kind;
    int of; /* the channel */
} kmp_run_argument;

typedef struct kmp_run_quantities {
    int count, channels, values;
    const kmp_run_quantity *of;
    const char *const *name; /* of each value */
    int arguments;           /* the last channels */
    const kmp_run_argument *argument;
    const int *shown;   /* of each channel: its number among the computed outputs of the model (kmp_eval_shown), or
                         * -1 - its number in the row q, qd, qdd, lambda */
    const char *remedy; /* for values that change too fast, as a request; NULL: a shorter span of the quantity */
    bool turns;         /* some channel is a wave of the angles of the mechanism */
    bool inside;        /* some quantity depends on states within steps */
    bool rates, late;   /* some channel depends on rates; on accelerations or multipliers */
    bool computed;      /* some channel is a computed output */
    bool loads;         /* some channel depends on multipliers */
} kmp_run_quantities;

/** Number of values of a kind: 2 for an extreme with its time, else 1. */
int kmp_run_quantity_width(kmp_run_quantity_kind kind);

/** True for a kind whose value depends on states within steps. */
bool kmp_run_quantity_inside(kmp_run_quantity_kind kind);

/** Size of the account of one run, of the values of a piece, and of the room that runs can share which are measured in
 * turn. */
size_t kmp_account_size(const kmp_run_quantities *quantities);
size_t kmp_account_piece(const kmp_run_quantities *quantities);
size_t kmp_account_room(const kmp_run_quantities *quantities);

/** Begins the bound of work again: its limit is then of the steps from here on. */
void kmp_account_renew(const kmp_run_quantities *quantities, double *account);

/** The values of a channel are rounded to no less than this from here on. */
void kmp_account_round(const kmp_run_quantities *quantities, double *account, int channel, double size);

/** Begins an account. */
void kmp_account_begin(const kmp_run_quantities *quantities, double *account);

/** Gives the values of all channels at a time within the present step. false: there is no state. */
typedef bool kmp_channels_fn(void *user, double t, double *values);

/** Writes the channels at the inner points of part `index` of 2^halvings equal parts of the present step, as in a piece
 * whose first and last point are left as they are. false: they must be taken one by one. */
typedef bool kmp_parts_fn(void *user, int halvings, int index, double *piece);

/** An accepted step: its times; about how far an angle turns; the error of a polynomial relative to the largest value
 * so far; the channels at kmp_piece_point 0, 1, .. of the whole step, point by point, if they are known (NULL: they are
 * not), in its parts (NULL: one by one), and at other times. */
typedef struct kmp_measured_step {
    double from, to, turn, rtol;
    const double *sampled;
    kmp_parts_fn *parts;
    kmp_channels_fn *channels;
    void *user;
} kmp_measured_step;

/** True if some steps can be passed over: no quantity needs all states, as means do. */
bool kmp_quantities_may_pass(const kmp_run_quantities *quantities);

/** Passes over a step that changes nothing in the account, by rough bounds (kmp_piece_rough_bounds) of `sampled`, of
 * which only points 0, 2, 4, 6 and 8 are read, and need not be exact. false: the step must be taken into account. */
bool kmp_account_pass(const kmp_run_quantities *quantities, double *account, const kmp_measured_step *step);

/** Takes a step into account. false: a state within the step was not available, or the bound of work of a run is
 * reached (kmp_account_excess). */
bool kmp_account_step(const kmp_run_quantities *quantities, double *account, double *room,
                      const kmp_measured_step *step);

/** Why the bound of work is reached, with the name of a quantity; false: it is not. */
bool kmp_account_excess(const kmp_run_quantities *quantities, const double *account, double t, kmp_text *why);

/** Writes the values at the end of a run: `end` has the channels there. */
void kmp_account_values(const kmp_run_quantities *quantities, const double *account, double t_start, double t_end,
                        const double *end, double *values);
