/* SPDX-License-Identifier: BSD-3-Clause */
/* The steady-state response of outputs to harmonic inputs: with w e^(i omega t)
 *
 *     (-omega^2 Mr + i omega Gr + Kr) du = -(L0 + i omega L1 - omega^2 L2) w,
 *     dy = (Yu + i omega Yud - omega^2 Yudd) du + (Y0 + i omega Y1 - omega^2 Y2) w,
 *
 * with L1 and L2 the columns of an input's time derivatives: without inverse of Mr, and without first-order form. With
 * sampled states inputs are sampled and held, and
 *
 *     (z - phi) dx = gamma w,     dy = C dx + D w,     z = e^(i omega T),
 *
 * from one common sample to the next (analyses/derivatives/sampled_motion.h). A delayed signal is y = e^(-i omega T) u.
 */
#pragma once

#include "analyses/derivatives/spectrum.h"
#include "analyses/linearize/transfer.h"

/** A maximum of an amplitude between the ends of the range. */
typedef struct kmp_peak {
    int input, output;
    double frequency; /* Hz */
    double amplitude; /* infinite at an undamped pole */
    double phase;     /* rad, NaN there */
    double gain;      /* relative to the amplitude of the static response, NaN where that is zero or none */
} kmp_peak;

typedef struct kmp_frequency {
    kmp_arena arena;              /* of all arrays but peaks */
    const kmp_transfer *transfer; /* not owned, evaluated */
    int size;                     /* number of unknowns: p, or of x with sampled states */
    double period;                /* T; 0: no state is sampled */
    double *phi, *gamma, *c, *d;  /* with sampled states */
    int inputs, outputs, count;
    double *at;        /* count: Hz, ascending */
    double *re, *im;   /* count blocks of outputs x inputs, column-major; NaN at a pole */
    bool *pole;        /* count: on an undamped pole */
    double *still;     /* outputs x inputs: the amplitude at rest, NaN where Kr is singular */
    bool has_spectrum; /* the reduced mass is positive */
    kmp_spectrum poles;
    int growing; /* of a model with delays: roots that grow; -1: unknown, one is close to the axis */
    int peak_count;
    kmp_peak *peak;         /* by input, output, frequency */
    double rounding;        /* relative effect of rounding on a response: the last one evaluated */
    double worst, worst_at; /* the largest of all frequencies, and which, Hz */
    /* work */
    double *terms;                 /* sizes of the terms of a */
    double _Complex *a, *du, *off; /* off: sizes of the terms of du */
    double *scale, *h_re, *h_im;
    int *pivot;
} kmp_frequency;

/** Makes room for frequencies that the caller fills in. `sampled`: the transfer is that of an averaged system
 * (analyses/derivatives/averaged.h). KEMPE_E_MEMORY; KEMPE_E_FAILED with a sentence: there is no map between samples.
 */
kempe_status kmp_frequency_init(kmp_frequency *frequency, const kmp_transfer *transfer, bool sampled, int count);
void kmp_frequency_free(kmp_frequency *frequency);

/** Computes the responses at all frequencies, the poles, and the peaks: between the given frequencies, too, which are
 * searched near the poles. KEMPE_E_MEMORY; KEMPE_STOPPED when interrupted. */
kempe_status kmp_frequency_run(kmp_frequency *frequency);

/** True if pole k is on the imaginary axis and above zero: it is undamped. */
bool kmp_frequency_undamped(const kmp_frequency *frequency, int k);
