/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef KMP_STUDIES_RESPONSE_RESPONSE_H
#define KMP_STUDIES_RESPONSE_RESPONSE_H

#include "studies/linearize/channels.h"
#include "studies/response/frequency.h"
#include <kempe/response.h>

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

/** Appends `before` and the unit of an output over that of an input; nothing where one of them is unknown. */
void kmp_response_put_unit(kmp_text *text, const kempe_response *response, int input, int output, const char *before,
                           const char *over);

#endif
