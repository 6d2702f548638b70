/* SPDX-License-Identifier: BSD-3-Clause */
/* Frequencies of a flexible body, only by its constants. */
#pragma once

#include "model/data/flexible.h"
#include <stdbool.h>

enum { KMP_OWN_FREQUENCIES = 3 };

typedef struct kmp_flexible_spectrum {
    int count;                         /* of shown frequencies */
    double fixed[KMP_OWN_FREQUENCIES]; /* rad/s, ascending: with its joint fixed */
    double free[KMP_OWN_FREQUENCIES];  /* without any joint */
    double highest;                    /* rad/s: of the free body */
} kmp_flexible_spectrum;

/** The rate up to which a body may turn without terms of second order, rad/s: its first frequency, or the part of it
 * for which means suffice. INFINITY: it has these terms, or no frequency is known. */
double kmp_flexible_fastest(const kmp_flexible *flexible);

/** By nominal values. False: no memory. */
bool kmp_flexible_spectrum_find(const kmp_flexible *flexible, kmp_flexible_spectrum *spectrum);
