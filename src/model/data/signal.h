/* SPDX-License-Identifier: BSD-3-Clause */
/* Signals: samples of an input over time, and the polynomials in t between them. The values before the first sample
 * and after the last one equal these samples. */
#pragma once

#include "base/arena.h"
#include "model/language/nearest.h"

/** Between two samples: the value of the first one; a straight line; a cubic of the spline through all samples. */
typedef enum kmp_signal_method { KMP_SIGNAL_HOLD, KMP_SIGNAL_LINEAR, KMP_SIGNAL_CUBIC } kmp_signal_method;
extern const kmp_name_list kmp_signal_words;

typedef struct kmp_signal {
    kmp_signal_method method;
    int count; /* samples, at least 1 */
    double *t, *u;
    double (*piece)[4]; /* count: from t[k] on, in powers of t - t[k]; the last one is constant */
} kmp_signal;

/** Order of the first derivative that may jump where a piece begins: 0 is the value. */
enum { KMP_SIGNAL_SMOOTH = 4 };

/** One polynomial: u = sum c[i] (t - from)^i until the next sample. */
typedef struct kmp_signal_piece {
    double from, until; /* until: INFINITY for the last one */
    double c[4];
    int jump; /* order of the derivative that jumps at `from` */
} kmp_signal_piece;

/** Copies the samples, with t ascending, into an arena. False: no memory. */
bool kmp_signal_init(kmp_signal *signal, kmp_arena *arena, kmp_signal_method method, int count, const double *t,
                     const double *u);

/** The piece that contains t; at a sample the one that begins there. Equal constants are one piece. */
kmp_signal_piece kmp_signal_at(const kmp_signal *signal, double t);

/** The piece that contains t or ends there. */
kmp_signal_piece kmp_signal_before(const kmp_signal *signal, double t);

/** Value and two derivatives by time of a piece at t, also outside of it. */
void kmp_signal_values(const kmp_signal_piece *piece, double t, double values[3]);

/** The value at t. */
double kmp_signal_value(const kmp_signal *signal, double t);
