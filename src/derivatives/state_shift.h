/* SPDX-License-Identifier: BSD-3-Clause */
/* How the state of a kmp_linear moves with parameters: along with the closures, and with what is kept of it. */
#ifndef KMP_DERIVATIVES_STATE_SHIFT_H
#define KMP_DERIVATIVES_STATE_SHIFT_H

#include "base/arena.h"
#include "derivatives/linearized.h"
#include "derivatives/parameter_slopes.h"

/** What stays. */
typedef enum kmp_keeping {
    KMP_KEEP_RATES,      /* u and ud; udd follows from R = 0 */
    KMP_KEEP_EQUILIBRIUM /* ud and udd; u follows from R = 0 */
} kmp_keeping;

typedef struct kmp_shift {
    const kempe_system *system;
    kmp_arena arena;                /* of all arrays */
    int n, m, count;                /* parameters */
    const char *const *names;       /* theirs; not owned */
    double *q, *qd, *qdd, *lambda;  /* n, n, n and m a parameter */
    double *residual;               /* what R becomes, by u: zero; p a parameter, room for n */
    double *part;                   /* 3 m + n: the change that one parameter makes of the equations */
    double *u, *ud;                 /* p of one parameter */
    double *matrix, *side, *pivots; /* of the equations for u or udd */
    int *r, *c;
} kmp_shift;

/** Makes room. KEMPE_E_MEMORY. */
kempe_status kmp_shift_init(kmp_shift *shift, const kempe_system *system, int count, const char *const *names);
void kmp_shift_free(kmp_shift *shift);

/** At the state of `linear`; takes the slopes there, and makes Mr, Gr and Kr. `q`, `qd` (n a parameter; NULL: they
 * stay) say how the coordinates and rates that are kept move all the same, as those of a start do. Coordinates that
 * nothing depends on stay where they are. KEMPE_E_FAILED: R = 0 leaves more than those open, and along what. */
kempe_status kmp_shift_at(kmp_shift *shift, kmp_linear *linear, kmp_slopes *slopes, kmp_keeping keeping,
                          const double *q, const double *qd);

#endif
