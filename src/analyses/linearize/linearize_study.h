/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "analyses/linearize/channels.h"
#include <kempe/linearize.h>

struct kempe_linearization {
    kmp_channels channels;
    int count, *u; /* the independent coordinates but for constant states, of whose columns and rows */
    double *mass, *damping, *stiffness, *loads, *map, *map_rate; /* these are */
    double *a, *b, *c, *d;                                       /* of the channels' arena */
    int width;                                                   /* of x */
    kmp_names delays;                                            /* the last inputs and outputs */
    double *delay;                                               /* the time of each */
    const double *y;                                             /* the outputs at the state */
    double period; /* s: they lead from one common sample to the next; 0: of a model without samples */
    double *z;     /* width x 2: eigenvalues of that map, real and imaginary part; NULL without samples */
};

enum {
    KMP_MATRICES = 0
#define KMP_MATRIX(name, word, rows, columns, values, equation) +1
#include "analyses/linearize/matrices.def"
#include "model/data/force.h"
#undef KMP_MATRIX
};
