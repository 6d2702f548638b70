/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Where a mechanism stays at rest, or moves on steadily, and whether it stays there.
 *
 *     kempe_equilibrium *e;
 *     kempe_equilibrium_options ask = {.rates = "shaft=2*pi"};
 *     if (kempe_equilibrium_new(system, &ask, &e) == KEMPE_OK)
 *         show(kempe_equilibrium_q(e, 0), kempe_equilibrium_stable(e, 0));
 */
#ifndef KEMPE_EQUILIBRIUM_H
#define KEMPE_EQUILIBRIUM_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** What to look for. Texts are lists with commas between; NULL and 0: nothing of it. */
typedef struct kempe_equilibrium_options {
    const char *rates;     /* "shaft=60 rpm": coordinates that move on at constant rates; all others stand still */
    const char *hold;      /* "slider=0.6": coordinates that stay where they are told */
    const char *target;    /* "position(b.P).z=0.3": outputs that shall have values; as `outputs` of a model, each with
                               one component */
    const char *solve_for; /* "k,qd(shaft)": parameters, and rates of coordinates, that are unknown instead */
    int newton;            /* Newton's method from the start, stable or not; otherwise the way goes down */
    int global;            /* look for others too, from random starts */
    int seed;              /* which these are; 0: 1 */
} kempe_equilibrium_options;

typedef struct kempe_equilibrium kempe_equilibrium;

/** Looks from the assembled start. `ask` NULL: a static equilibrium. KEMPE_E_ARGUMENT: a name, or a number, of what is
 *  asked. KEMPE_E_FAILED: it does not assemble, or no equilibrium is found, and why. KEMPE_STOPPED: interrupted before
 *  one was found. The system must outlive it. */
KEMPE_API kempe_status kempe_equilibrium_new(const kempe_system *system, const kempe_equilibrium_options *ask,
                                             kempe_equilibrium **equilibrium);
KEMPE_API void kempe_equilibrium_free(kempe_equilibrium *equilibrium);

/** How many; the first is the one that the start leads to, if it leads to one. */
KEMPE_API int kempe_equilibrium_count(const kempe_equilibrium *equilibrium);

/** Of the k-th: q and qd (n values), lambda (row_count of the system), owned by the equilibrium. */
KEMPE_API const double *kempe_equilibrium_q(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const double *kempe_equilibrium_qd(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const double *kempe_equilibrium_lambda(const kempe_equilibrium *equilibrium, int k);

/** 1: no small motion about the k-th grows, 0: one does, -1: that cannot be said. In words: "stable"; "neutral",
 *  where some motions stay where they are put; "unstable"; "undecided". */
KEMPE_API int kempe_equilibrium_stable(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const char *kempe_equilibrium_stability(const kempe_equilibrium *equilibrium, int k);

/** What is left of the equations, relative; the same of every iteration on the way there. */
KEMPE_API double kempe_equilibrium_residual(const kempe_equilibrium *equilibrium, int k);
KEMPE_API int kempe_equilibrium_iterations(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const double *kempe_equilibrium_history(const kempe_equilibrium *equilibrium, int k);

/** What is freed: how many, the name of the i-th, its value at the k-th equilibrium. */
KEMPE_API int kempe_equilibrium_freed_count(const kempe_equilibrium *equilibrium);
KEMPE_API const char *kempe_equilibrium_freed_name(const kempe_equilibrium *equilibrium, int i);
KEMPE_API double kempe_equilibrium_freed(const kempe_equilibrium *equilibrium, int k, int i);

KEMPE_API kempe_status kempe_equilibrium_print(const kempe_equilibrium *equilibrium, kempe_format format, char **text);

#ifdef __cplusplus
}
#endif
#endif
