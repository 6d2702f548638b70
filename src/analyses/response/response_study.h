/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "analyses/derivatives/spectrum.h"
#include "analyses/linearize/channels.h"
#include "model/data/force.h"
#include <kempe/response.h>
#include <math.h>

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

void kmp_frequency_free(kmp_frequency *frequency);

/** True if pole k is on the imaginary axis and above zero: it is undamped. */
bool kmp_frequency_undamped(const kmp_frequency *frequency, int k);

/** Largest relative effect of rounding on a response. */
#define KMP_RESPONSE_HOLDS 1e-6

struct kempe_response {
    kmp_channels channels;
    kmp_frequency frequency;
    bool linear; /* the frequencies are even; otherwise their ratios */
};

static inline const char *kmp_response_input_unit(const kempe_response *r, int input)
{
    const kmp_transfer *t = &r->channels.transfer;
    int c = 0;
    while (t->load[c].input != input)
        c++;
    return r->channels.loads.unit[c];
}

static inline const char *kmp_response_input(const kempe_response *r, int input)
{
    return r->channels.inputs.input[input].name;
}

static inline const char *kmp_response_output(const kempe_response *r, int output)
{
    return r->channels.outputs.name[output];
}

/** Amplitude and phase (rad) of a pair at frequency k; NaN on an undamped pole. Pair: outputs of the first input, then
 * outputs of the second. */
typedef struct kmp_response_point {
    double amplitude, phase;
} kmp_response_point;

static inline kmp_response_point kmp_response_at(const kempe_response *r, int k, int pair)
{
    const kmp_frequency *f = &r->frequency;
    size_t e = (size_t)k * (size_t)(f->inputs * f->outputs) + (size_t)pair;
    double re = f->pole[k] ? NAN : f->re[e], im = f->pole[k] ? NAN : f->im[e];
    return (kmp_response_point){hypot(re, im), atan2(im, re)};
}

/** The factor of the amplitudes of a pair, from SI to the units in which its output and input are shown. */
double kmp_response_factor(const kempe_response *response, int input, int output);

/** Appends `before` and the unit of an output over the unit of an input, as they are shown; nothing if one of them is
 * unknown. */
void kmp_response_put_unit(kmp_text *text, const kempe_response *response, int input, int output, const char *before,
                           const char *over);
