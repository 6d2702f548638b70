/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensitivity of the state of a kmp_linear to parameters: the closures remain satisfied, and a chosen quantity is kept.
 */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "base/arena.h"
#include "model/data/force.h"

/** The quantity that is kept. */
typedef enum kmp_fixed_quantity {
    KMP_KEEP_RATES,      /* u and ud; udd follows from R = 0 */
    KMP_KEEP_EQUILIBRIUM /* ud and udd; u follows from R = 0 */
} kmp_fixed_quantity;

typedef struct kmp_state_sensitivity {
    const kempe_system *system;
    kmp_arena arena;                /* of all arrays */
    int n, m, count;                /* parameters */
    const char *const *names;       /* theirs; not owned */
    double *q, *qd, *qdd, *lambda;  /* n, n, n and m a parameter */
    double *residual;               /* the derivative of R with respect to u: zero; p per parameter, room for n */
    double *part;                   /* 3 m + n: the change of the equations by one parameter */
    double *u, *ud;                 /* p of one parameter */
    double *matrix, *side, *pivots; /* of the equations for u or udd */
    int *r, *c;
    int rank; /* of these equations at the last state: coordinates u[c[rank]] and on, to p, stay constant */
} kmp_state_sensitivity;

/** Makes room. KEMPE_E_MEMORY. */
kempe_status kmp_state_sensitivity_init(kmp_state_sensitivity *sensitivity_of_state, const kempe_system *system,
                                        int count, const char *const *names);
void kmp_state_sensitivity_free(kmp_state_sensitivity *sensitivity_of_state);

/** Sensitivities at the state of `linear`; takes the parameter derivatives there, and makes Mr, Gr and Kr. `q`, `qd` (n
 * per parameter; NULL: zero) are the changes of the coordinates and rates that are kept, as of a start. Coordinates
 * that nothing depends on stay constant. KEMPE_E_FAILED: R = 0 leaves other directions undetermined, which the message
 * names. */
kempe_status kmp_state_sensitivity_at(kmp_state_sensitivity *sensitivity_of_state, kmp_linear *linear,
                                      kmp_slopes *slopes, kmp_fixed_quantity fixed, const double *q, const double *qd);
