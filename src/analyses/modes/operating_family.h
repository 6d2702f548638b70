/* SPDX-License-Identifier: BSD-3-Clause */
/* A family of states for modes while a parameter varies: the equations are derived once, and an equilibrium is searched
 * from the last one. */
#pragma once

#include "analyses/derivatives/averaged.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/modes/eigenmodes.h"
#include "model/data/variant.h"

/** The options; nothing is owned. */
typedef struct kmp_operating_family_options {
    const char *name; /* a parameter, or `q.NAME`, `qd.NAME` of the start, that varies; NULL: none does */
    const char *word; /* the state (kmp_operating_new) */
    const int *wish;  /* coordinates requested as independent */
    int wish_count;
    bool spare;              /* with delays: eigenvalues beyond the shown ones are kept */
    const kmp_steady *rates; /* constant rates of an equilibrium */
    int rate_count;
    const kmp_steady *varies;     /* the one that varies; NULL: none */
    bool told;                    /* warnings of a steady motion were given before */
    const kmp_averaged *averaged; /* whose system it is; NULL: the system is no averaged one */
} kmp_operating_family_options;

typedef struct kmp_operating_family {
    const kempe_system *base;
    kmp_operating_family_options options;
    kmp_variant *variant; /* NULL: nothing varies */
    kempe_system *own;    /* of the variant */
    kmp_linear linear;    /* at the last state */
    kmp_operating *state; /* the last one */
    kmp_arena arena;      /* of rates */
    kmp_steady *rates;    /* the current ones, also of a steady motion that was found; room for n */
    int rate_count;
    double *begun; /* rates of the start at the last value (n), where an equilibrium is searched from it */
    bool brief;    /* set by the caller: with delays the next modes need no bound */
} kmp_operating_family;

/** KEMPE_E_ARGUMENT: the quantity cannot be varied. */
kempe_status kmp_operating_family_new(const kempe_system *system, const kmp_operating_family_options *options,
                                      kmp_operating_family **family);
void kmp_operating_family_free(kmp_operating_family *family);

/** Goes to the state at a value of the parameter, and computes its modes. Errors as kmp_operating_new, and
 * KEMPE_E_FAILED where the model rejects the value. */
kempe_status kmp_operating_family_go(kmp_operating_family *family, double value, kmp_modes *modes);

/** q (n, in the charts of linear.eval) of the last state displaced along eigenvalue c of its modes, by `amplitude`
 * times Re(shape e^{i angle}), and closed again. 0; 1 where the loops do not close. */
int kmp_operating_family_move(kmp_operating_family *family, const kmp_modes *modes, int c, double amplitude,
                              double angle, double *q);
