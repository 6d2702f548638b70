/* SPDX-License-Identifier: BSD-3-Clause */
/* The balance of a motion by the forces of its actuators, over all rows: the degrees of freedom that they reach, the
 * least transmission, what they cannot provide. Rows where the loops are singular, with additional degrees of
 * freedom, are counted and not judged. */
#pragma once

#include "analyses/inverse/inverse_dynamics.h"

typedef struct kmp_inverse_balance {
    int freedoms, rank;      /* p and the least rank of its equations */
    int singular;            /* rows that are not judged */
    double singular_t;       /* the first of them */
    double hold, hold_t;     /* the least singular value that counts, and when */
    double size;             /* of the reduced equations' terms, the largest of all rows, N m */
    double unmet, unmet_t;   /* forces that the actuators cannot provide, the largest of all rows, in N m */
    int *left_u, left_count; /* then: by independent coordinate */
    double *left;
    double residual, residual_t;
    bool *redundant; /* m: rows of closures that were dropped at some time */
} kmp_inverse_balance;

/** False: no memory. */
bool kmp_inverse_balance_make(kmp_inverse_balance *balance, kmp_arena *arena, const kempe_system *system);

/** Adds a row, at t[row], after all rows before it. The first rows may turn out to be singular. */
void kmp_inverse_balance_add(kmp_inverse_balance *balance, const kmp_inverse *inverse, int row, const double *t);

/** The unbalanced part of the motion, relative to the required generalized forces. */
double kmp_inverse_balance_unmet(const kmp_inverse_balance *balance);

/** KEMPE_E_FAILED, with the coordinate: the actuators cannot produce the motion. */
kempe_status kmp_inverse_balance_judge(const kmp_inverse_balance *balance, const kempe_system *system);
