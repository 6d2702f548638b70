/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "analyses/linearize/channels.h"
#include "analyses/response/frequency.h"
#include <kempe/response.h>
#include <math.h>

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
 * those of the second. */
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

/** The unit in which an output is shown, and the factor of its amplitudes from SI. */
static inline kmp_shown kmp_response_shown(const kempe_response *r, int output)
{
    return kmp_shown_as(r->channels.system->context, r->channels.outputs.unit[output]);
}

/** Appends `before` and `of`, the unit of an output, over that of an input; nothing where one of them is unknown. */
void kmp_response_put_unit(kmp_text *text, const kempe_response *response, int input, const char *of,
                           const char *before, const char *over);
