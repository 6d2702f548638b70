/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives at one state: the equilibrium or the start, and its sensitivities to the parameters. */
#pragma once

#include "derivatives/state_sensitivity.h"
#include "derivatives/varied.h"
#include "studies/equilibrium/operating.h"
#include "studies/sensitivity/sensitivity_study.h"
#include <kempe/sensitivity.h>

typedef struct kmp_sensitivity_state {
    kempe_sensitivity *s;
    const char *backend;
    kmp_operating *at; /* NULL: the start */
    kmp_slopes *slopes;
    kmp_varied varied; /* its linear equations are at the state, their matrices made */
    kmp_state_sensitivity sensitivity_of_state;
    kmp_arena arena;           /* of the arrays */
    double *q, *qd, *dq, *dqd; /* of the start: n, n, n x count */
    double *shown, *by;        /* values, and count derivatives per parameter */
} kmp_sensitivity_state;

/** Finds the requested state. KEMPE_E_ARGUMENT: there is no such word. KEMPE_E_FAILED, with the reason: there is no
 * such state, or it has no derivative. */
kempe_status kmp_sensitivity_state_init(kmp_sensitivity_state *x, kempe_sensitivity *s, bool with_outputs);
void kmp_sensitivity_state_free(kmp_sensitivity_state *x);
