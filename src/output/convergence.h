/* SPDX-License-Identifier: BSD-3-Clause */
/* Whether the digits of what was integrated can be trusted: the same at another tolerance, and at a third one where
 * that leaves doubt. An integrator keeps the error of each step below the tolerance; what the motion makes of it later,
 * and whether both pass a change point on the same branch, only another run tells. Of runs, sensitivities and ensembles
 * alike. */
#ifndef KMP_OUTPUT_CONVERGENCE_H
#define KMP_OUTPUT_CONVERGENCE_H

#include "integrators/run/run.h"
#include "output/json.h"
#include "output/samples.h"

typedef struct kmp_convergence {
    bool known;        /* false: there was no other run */
    double rtol;       /* of the other run, the last one when there were two */
    double difference; /* largest |x - x'| / max(|x|, size of x) over the rows */
    int index;         /* the number whose it is, and when */
    double t;
    double until;   /* last row before the difference leaves `limit` */
    double limit;   /* that a run in good order keeps */
    double told;    /* a difference that is told in a warning all the same; 0: none is */
    double stopped; /* where the other run ended, NaN when it came to the end */
} kmp_convergence;

/** What can be run again, in one or several cases, each of which converges or does not. */
typedef struct kmp_repeat {
    kempe_context *context;
    double rtol, t_start; /* of the first time */
    double promised;      /* an error of more tolerances is told, though a run in good order may make it; 0: none is */
    bool uneven;          /* errors fall unevenly with the tolerance: no coarser run says how large they are */
    void *user;
    /** Runs cases which[0 .. count-1] at another rtol, atol in proportion, and tells each row by kmp_convergence_row
     * and, where it did not come to its end, `stopped`. KEMPE_OK; KEMPE_STOPPED: the user has had enough;
     * KEMPE_E_MEMORY. */
    kempe_status (*run)(void *user, double rtol, int count, const int *which, kmp_convergence *found);
} kmp_repeat;

/** Runs all cases again, quietly, and those in doubt once more. KEMPE_OK or KEMPE_E_MEMORY. */
kempe_status kmp_convergence_of(const kmp_repeat *repeat, int cases, kmp_convergence *convergence);

/** A row of the other run beside that of the first; size[k], positive: of number k where it is small. */
void kmp_convergence_row(kmp_convergence *found, double t, int count, const double *first, const double *other,
                         const double *size);

/** kmp_convergence_of for a run: `spec` from `start` (NULL: assembles), compared in q with the rows of `table`, whose
 * last are those of spec->times. */
kempe_status kmp_convergence_of_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                                    const kmp_samples *table, kmp_convergence *convergence);

bool kmp_convergence_holds(const kmp_convergence *convergence);

/** "converged", "not converged", "the other run did not come to its end"; "": there was none. */
const char *kmp_convergence_word(const kmp_convergence *convergence);

/** One warning when it has not converged, or when its error is more than what was promised. `name`: of the number at
 * `index`; `advice`: what to do. */
void kmp_convergence_warn(kempe_context *context, const kmp_convergence *convergence, const char *name,
                          const char *advice);

void kmp_convergence_show(kmp_text *text, const kmp_convergence *convergence, const char *what, const char *name);
void kmp_convergence_json(kmp_json *json, const kmp_convergence *convergence, const char *name);

#endif
