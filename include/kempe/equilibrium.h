/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Static and steady-state equilibria of a mechanism, and their stability.
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

/** Options. Texts are comma-separated lists; NULL and 0: none. */
typedef struct kempe_equilibrium_options {
    const char *rates;     /* "shaft=60 rpm": coordinates with constant rates; all others are at rest */
    const char *hold;      /* "slider=0.6": coordinates fixed at these values */
    const char *target;    /* "position(b.P).z=0.3": prescribed values of outputs; written as `outputs` of a model, each
                            * with one component */
    const char *solve_for; /* "k,qd(shaft)": parameters, and rates of coordinates, that are solved for instead */
    int newton;            /* 1: Newton's method from the start, stable or not; 0: descent, which finds stable
                            * equilibria */
    int global;            /* 1: search for further equilibria from random starts */
    int seed;              /* seed of the random starts; 0: 1 */
} kempe_equilibrium_options;

typedef struct kempe_equilibrium kempe_equilibrium;

/** Finds an equilibrium from the assembled start. `ask` NULL: a static equilibrium. The system must outlive it.
 * KEMPE_E_ARGUMENT: a name or number in the options is wrong. KEMPE_E_FAILED: the model does not assemble, or no
 * equilibrium is found; the message has the reason. KEMPE_STOPPED: interrupted before one was found. */
KEMPE_API kempe_status kempe_equilibrium_new(const kempe_system *system, const kempe_equilibrium_options *ask,
                                             kempe_equilibrium **equilibrium);
KEMPE_API void kempe_equilibrium_free(kempe_equilibrium *equilibrium);

/** The number of equilibria. The first is the one found from the start, if there is one. */
KEMPE_API int kempe_equilibrium_count(const kempe_equilibrium *equilibrium);

/** State of the k-th equilibrium: q and qd (n values), lambda (row_count of the system), owned by the equilibrium. */
KEMPE_API const double *kempe_equilibrium_q(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const double *kempe_equilibrium_qd(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const double *kempe_equilibrium_lambda(const kempe_equilibrium *equilibrium, int k);

/** Stability of the k-th equilibrium. 1: no small motion about it grows; 0: one does; -1: undecided. In words:
 * "stable"; "neutral", some motions neither grow nor decay; "unstable"; "undecided". */
KEMPE_API int kempe_equilibrium_stable(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const char *kempe_equilibrium_stability(const kempe_equilibrium *equilibrium, int k);

/** Relative residual of the equations; the number of iterations, and the residual of each. */
KEMPE_API double kempe_equilibrium_residual(const kempe_equilibrium *equilibrium, int k);
KEMPE_API int kempe_equilibrium_iterations(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const double *kempe_equilibrium_history(const kempe_equilibrium *equilibrium, int k);

/** The solved-for unknowns: their number, the name of the i-th, its value at the k-th equilibrium. */
KEMPE_API int kempe_equilibrium_solved_count(const kempe_equilibrium *equilibrium);
KEMPE_API const char *kempe_equilibrium_solved_name(const kempe_equilibrium *equilibrium, int i);
KEMPE_API double kempe_equilibrium_solved(const kempe_equilibrium *equilibrium, int k, int i);

KEMPE_API kempe_status kempe_equilibrium_print(const kempe_equilibrium *equilibrium, kempe_format format, char **text);

#ifdef __cplusplus
}
#endif
#endif
