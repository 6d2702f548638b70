/* SPDX-License-Identifier: BSD-3-Clause */
/* A mechanism near a state with named inputs and outputs: what state spaces and frequency responses begin with. */
#ifndef KMP_STUDIES_LINEARIZE_CHANNELS_H
#define KMP_STUDIES_LINEARIZE_CHANNELS_H

#include "model/variant.h"
#include "studies/equilibrium/operating.h"
#include "studies/linearize/transfer.h"

/** NULL: the default of each. */
typedef struct kmp_channels_ask {
    const char *at, *inputs, *outputs, *independent, *backend;
} kmp_channels_ask;

typedef struct kmp_names {
    int count;
    char **name, **unit;
} kmp_names;

typedef struct kmp_channels {
    const kempe_system *given, *system; /* the one that is asked, and the one that is looked at */
    kmp_variant *variant;               /* NULL: these are the same */
    kempe_system *own;
    kmp_operating *at;
    kmp_linear linear;
    kmp_slopes *slopes;
    kmp_asked_inputs inputs;
    kmp_transfer transfer;
    kmp_names states, loads, outputs; /* x, w, y; a load is an input or a time derivative of it */
    bool rests;                       /* nothing is accelerated, and what moves changes no force */
    bool goes_on;                     /* rests, but for rates that change no force */
    double residual;                  /* of the state held still, relative: how far it is from equilibrium */
    double build_s;                   /* CPU time of what was derived */
    char *warnings;                   /* of the computation, one a line */
} kmp_channels;

/** Derives, takes the state and evaluates. Outputs, when none are asked for: those of the model where there are inputs,
 *  none otherwise. KEMPE_E_ARGUMENT, KEMPE_E_FAILED with the reason. */
kempe_status kmp_channels_init(kmp_channels *channels, const kempe_system *system, const kmp_channels_ask *ask);
void kmp_channels_free(kmp_channels *channels);

#endif
