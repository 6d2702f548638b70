/* SPDX-License-Identifier: BSD-3-Clause */
/* The state that a mechanism is looked at from: where its linear equations are taken, its modes, its sensitivities. */
#ifndef KMP_STUDIES_EQUILIBRIUM_OPERATING_H
#define KMP_STUDIES_EQUILIBRIUM_OPERATING_H

#include "base/arena.h"
#include "studies/equilibrium/equilibrium.h"

typedef struct kmp_operating {
    const kempe_system *system;
    kmp_arena arena;            /* of all arrays */
    double t, *q, *qd;          /* n: in the user's coordinates */
    double *inner_q, *inner_qd; /* the same in these charts */
    double *chart;              /* NULL: no joint is spherical */
    bool equilibrium;
    double residual; /* of an equilibrium, relative */
} kmp_operating;

/** The state that a word names: "start", the assembled start with its rates; "equilibrium" (NULL stands for it), the
 *  equilibrium that the assembled start leads to, all rates zero; "equilibrium shaft=60 rpm", the steady motion with
 *  these. `linear`: of that system, and with it an equilibrium is sought; NULL: one is made where it is needed.
 *  KEMPE_E_ARGUMENT: there is no such word. KEMPE_E_FAILED: it does not assemble, or there is no equilibrium, and why.
 */
kempe_status kmp_operating_new(const kempe_system *system, const char *word, kmp_linear *linear,
                               kmp_operating **operating);
void kmp_operating_free(kmp_operating *operating);

/** The state becomes the equilibrium that it leads to, or without rates the steady motion (kmp_equilibrium_or_steady),
 *  and `linear` is taken there. Where the nearest is sought, the loops are closed first with the parameters that hold
 *  now. On failure (as of kmp_equilibrium_find and kmp_operating_check) the state stays. */
kempe_status kmp_operating_settle(kmp_operating *operating, kmp_linear *linear, kmp_search *search);

/** Takes `linear` there: its charts, independent coordinates (`wish`: those that the caller wants), rates, and the
 *  accelerations that the equations give (zero at an equilibrium). Errors as kmp_linear_choose; KEMPE_E_FAILED
 * with a sentence also where the state cannot be had, or what acts there is not finite. */
kempe_status kmp_operating_take(const kmp_operating *operating, kmp_linear *linear, const int *wish, int wish_count);

/** Whether what goes on steadily, and is not fixed by an exchange, leaves the forces as they are at a state that was
 *  found. KEMPE_E_FAILED: it does not. */
kempe_status kmp_operating_check(kmp_linear *linear, const kmp_search *search);

#endif
