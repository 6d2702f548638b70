/* SPDX-License-Identifier: BSD-3-Clause */
/* The past of delayed signals: polynomials between the ends of steps, in the order of time. A run records them
 * (integrators/run/delays.h), inputs of the model read them. */
#pragma once

#include <kempe/kempe.h>
#include <stdbool.h>

/** The degree of a polynomial, and the highest order of a derivative whose jumps are kept: beyond it a step of any
 * integrator is smooth. */
enum { KMP_PAST_DEGREE = 8, KMP_PAST_SMOOTH = 9 };

/** One polynomial, by its coefficients over Chebyshev's polynomials on [from, to]. */
typedef struct kmp_past_piece {
    double from, to, c[KMP_PAST_DEGREE + 1];
    int jump; /* order of the first derivative that jumps at `from`; KMP_PAST_SMOOTH or more: none does */
} kmp_past_piece;

typedef struct kmp_past_signal {
    double delay;
    kmp_past_piece *piece;
    int count;
    double dropped;  /* number of pieces before the first one, which are forgotten */
    int jump;        /* of the next piece */
    double rounding; /* error of a polynomial that is nothing but rounding of the signal, as it was found */
} kmp_past_signal;

typedef struct kmp_past {
    int count;
    kmp_past_signal *signal;
    double known; /* the end of the past */
} kmp_past;

/** A copy with its own pieces; NULL: no memory. */
kmp_past *kmp_past_copy(const kmp_past *past);
kmp_past *kmp_past_new(int count);
void kmp_past_free(kmp_past *past);

/** Adds the polynomial with given values at kmp_past_node of all nodes to a signal; false: no memory. */
bool kmp_past_add(kmp_past_signal *signal, double from, double to, const double *values);

/** The source of records of the past: polynomials are halved while their last coefficients exceed a tolerance and are
 * more than rounding. `room`: kmp_past_room numbers. */
typedef struct kmp_past_source {
    kmp_past *past;
    int first, last; /* the signals that are recorded */
    double *room;
    void *user;
    kempe_status (*sample)(void *user, double t, const double **values); /* of all signals, until the next call */
    double (*tolerance)(void *user, int signal, double size);            /* of values of that size */
} kmp_past_source;

/** The numbers that recording this number of signals needs. */
int kmp_past_room(int signals);

/** Adds polynomials over [from, to]. KEMPE_E_MEMORY without a message; errors of `sample`. KEMPE_STOPPED: signal *fast
 * changes too fast to be recorded. */
kempe_status kmp_past_record(const kmp_past_source *source, double from, double to, int *fast);

/** Forgets what is after t, at which the past then ends; no memory is taken. */
void kmp_past_cut(kmp_past *past, double t);

/** Forgets the pieces before number `first`. */
void kmp_past_drop(kmp_past_signal *signal, double first);

/** The number of the last piece that follows `number` without a jump. */
double kmp_past_last(const kmp_past_signal *signal, double number);

/** The piece of a number. */
static inline const kmp_past_piece *kmp_past_piece_of(const kmp_past_signal *signal, double number)
{
    return &signal->piece[(int)(number - signal->dropped)];
}

/** True if the signal has this piece. */
static inline bool kmp_past_has(const kmp_past_signal *signal, double number)
{
    return number >= signal->dropped && number < signal->dropped + signal->count;
}

/** u and three derivatives by time at t - delay, by the pieces from number `first` to `last`. */
void kmp_past_values(const kmp_past_signal *signal, double first, double last, double t, double values[4]);
