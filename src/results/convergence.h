/* SPDX-License-Identifier: BSD-3-Clause */
/* Whether the digits of a run can be trusted: the same run at another tolerance, and at a third one when that leaves
 * doubt. An integrator keeps the error of each step below the tolerance; what the motion makes of it later, and whether
 * both pass a change point on the same branch, only another run tells. */
#ifndef KMP_RESULTS_CONVERGENCE_H
#define KMP_RESULTS_CONVERGENCE_H

#include "integrators/run.h"
#include "results/json.h"
#include "results/samples.h"

typedef struct kmp_convergence {
    bool known;        /* false: there was no other run */
    double rtol;       /* of the other run, the last one when there were two */
    double difference; /* largest |q - q'| / max(|q|, size of the coordinate) over the rows */
    int coordinate;    /* whose it is, and when */
    double t;
    double until;   /* last row before the difference leaves `limit` */
    double limit;   /* that a run in good order keeps */
    double stopped; /* where the other run ended, NaN when it came to the end */
} kmp_convergence;

/** Runs `spec` from `start` (NULL: assembles) once or twice more, quietly, and compares with the rows of `table`, whose
 * last are those of spec->times. KEMPE_OK or KEMPE_E_MEMORY. */
kempe_status kmp_convergence_of(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                                const kmp_samples *table, kmp_convergence *convergence);

/** One warning when it has not converged. */
void kmp_convergence_warn(const kempe_system *system, const kmp_convergence *convergence);

void kmp_convergence_show(kmp_text *text, const kempe_system *system, const kmp_convergence *convergence);
void kmp_convergence_json(kmp_json *json, const kempe_system *system, const kmp_convergence *convergence);

#endif
