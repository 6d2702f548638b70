/* SPDX-License-Identifier: BSD-3-Clause */
/* The gain of each simplification on a model: M, C, h, J and jdqd as one program, numbers kept as symbols. */
#pragma once

#include "dynamics/system.h"

enum { KMP_GAINS_MOST = 16, KMP_GAINS_KINDS = 6 };

typedef struct kmp_gain {
    const char *name;
    long operations; /* + - * / after it, with those before it; -1: not tried, the model is too large */
    long runtime;    /* operations that depend on more than parameters */
} kmp_gain;

typedef struct kmp_gains {
    kmp_gain steps[KMP_GAINS_MOST];
    int count;
    kmp_gain savings[KMP_GAINS_KINDS]; /* as a program after all passes without each, and with all */
    kmp_gain all;
    long made, needed; /* operations of the graph, of the program */
} kmp_gains;

kempe_status kmp_gains_find(const kempe_model *model, kmp_gains *gains);
