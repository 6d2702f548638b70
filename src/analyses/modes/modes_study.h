/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of the modes study: at a state, and over a parameter. */
#pragma once

#include "analyses/derivatives/averaged.h"
#include "analyses/modes/locus.h"
#include "base/context.h"
#include "model/data/force.h"
#include <kempe/modes.h>
#include <math.h>
#include <stdbool.h>

enum { KMP_MOST_ORDERS = 16 };

struct kempe_modes {
    kmp_averaged *averaged; /* of a model with sampled states; NULL: it has none */
    const kempe_system *system;
    kmp_arena arena; /* of reason, state and name */
    kempe_status status;
    char *reason;                 /* of KEMPE_STOPPED; NULL: none */
    char *warnings;               /* of the computation, one per line */
    kmp_operating_family *family; /* at the state */
    kmp_modes modes;
    double *q, *qd; /* of the state */
    char *name;     /* of the varied parameter; NULL: none */
    kmp_locus locus;
    double order[KMP_MOST_ORDERS];
    int order_count;
    double highest; /* modulus of drawn eigenvalues, rad/s; INFINITY: all */
    double cpu_s;
};

/** True for the eigenvalues that are listed: of a pair the one above, of zeros the ones that stay. */
static inline bool kmp_modes_is_listed(const kempe_modes *modes, int c)
{
    const kmp_spectrum *s = &modes->modes.spectrum;
    return c < s->still || (c >= s->zeros && s->im[c] >= 0);
}

/** Frequency, Hz, damping ratio and time constant, s (to decay to 1/e; negative: to grow so) of an eigenvalue; NaN
 * where that means nothing. */
static inline double kmp_mode_frequency(double re, double im)
{
    return re == 0 && im == 0 ? NAN : fabs(im) / (2 * acos(-1));
}

static inline double kmp_mode_damping(double re, double im)
{
    return re == 0 && im == 0 ? NAN : re == 0 ? 0 : -re / hypot(re, im);
}

static inline double kmp_mode_time(double re)
{
    return re == 0 ? NAN : -1 / re;
}
