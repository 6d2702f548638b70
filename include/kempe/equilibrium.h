/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Static and steady-state equilibria of a mechanism, and their stability.
 *
 *     kempe_equilibrium *e;
 *     kempe_equilibrium_options ask = {.rates = "shaft=2*pi"};
 *     kempe_table *table;
 *     if (kempe_equilibrium_new(system, &ask, &e) == KEMPE_OK &&
 *         kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK)
 *         show(kempe_table_number(table, 0, kempe_table_find(table, "q.slider")), kempe_equilibrium_is_stable(e, 0));
 */
#ifndef KEMPE_EQUILIBRIUM_H
#define KEMPE_EQUILIBRIUM_H

#include <kempe/table.h>

KEMPE_BEGIN

/** Options. Texts are comma-separated lists; NULL and 0: none. */
typedef struct kempe_equilibrium_options {
    size_t size;           /* sizeof this struct; 0: its size in version 0.1 */
    const char *rates;     /* "shaft=60 rpm": coordinates with constant rates; all others are at rest. NULL:
                            * rates of a steady motion follow from the start */
    const char *hold;      /* "slider=0.6": coordinates fixed at these values */
    const char *target;    /* "position(b.P).z=0.3": prescribed values of outputs; written as `outputs` of a model, each
                            * with one component */
    const char *solve_for; /* "k,qd(shaft)": parameters, and rates of coordinates, that are solved for instead */
    int newton;            /* 1: Newton's method from the start, stable or not; 0: descent, which finds stable
                            * equilibria */
    int global;            /* 1: search for further equilibria from random starts */
    int seed;              /* seed of the random starts; 0: 1 */
    int stick;             /* 1: dry friction holds its surfaces at the start; 0: it has no force at rest */
    const char *loads;     /* of joints and loops that redundant constraints share: least-norm; NULL: one
                            * solution */
} kempe_equilibrium_options;

typedef struct kempe_equilibrium kempe_equilibrium;

/** Finds an equilibrium from the assembled start. `options` NULL: the steady motion of a start that gives rates to
 * coordinates on which nothing depends, otherwise a static equilibrium. The system must outlive it.
 * KEMPE_E_ARGUMENT: a name or number in the options is wrong. KEMPE_E_FAILED: the model does not assemble, or no
 * equilibrium is found; the message has the reason. KEMPE_STOPPED: interrupted before one was found. */
KEMPE_API kempe_status kempe_equilibrium_new(const kempe_system *system, const kempe_equilibrium_options *options,
                                             kempe_equilibrium **equilibrium);
KEMPE_API void kempe_equilibrium_free(kempe_equilibrium *equilibrium);

/** The number of equilibria. The first is the one found from the start, if there is one. */
KEMPE_API int kempe_equilibrium_count(const kempe_equilibrium *equilibrium);

/** Stability of the k-th equilibrium. 1: no small motion about it grows; 0: one does, or it is not held; -1: undecided.
 * In words: "stable"; "neutral", some motions neither grow nor decay; "unstable"; "not held", friction that sticks
 * needs more than its static level, so that it is not an equilibrium; "undecided". */
KEMPE_API int kempe_equilibrium_is_stable(const kempe_equilibrium *equilibrium, int k);
KEMPE_API const char *kempe_equilibrium_stability(const kempe_equilibrium *equilibrium, int k);

/** Components of the loads of joints and loops of the k-th equilibrium that redundant constraints share, and that are
 * not unique, by name, as "A: x, y, mz; B: x"; "": none. */
KEMPE_API const char *kempe_equilibrium_loads_not_unique(const kempe_equilibrium *equilibrium, int k);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "equilibria", a row each: stability, in words; residual, relative; potential; hits, the starts that ended there; the
 * solved-for unknowns, called as in the options; q.NAME, qd.NAME, lambda.CLOSURE.k. Then
 * load.NAME for each coordinate whose rate a load holds, N or N m.
 * "contacts", a row for each rigid contact of each equilibrium: its distance, its force, a word (presses; open;
 * touches, without a force; shares, closed by the rows of others).
 * "friction", dry friction that sticks, a row for each element of each equilibrium, with the option `stick`: its force,
 * the largest one, their ratio. "rest", the states of rest that friction holds, two rows for each element that sticks:
 * the coordinate, its value at the end, why the set ends there (slips, limit, holds), q.NAME.
 * "history", the searches: equilibrium and iteration, from 0; residual; step, its length in scaled coordinates.
 * "reactions", a row for each joint, closure and drive of each equilibrium: its number, from 0, then as in
 * kempe_trajectory_table. */
KEMPE_API kempe_status kempe_equilibrium_table(const kempe_equilibrium *equilibrium, const char *name,
                                               kempe_table **table);

KEMPE_API kempe_status kempe_equilibrium_print(const kempe_equilibrium *equilibrium, kempe_format format, char **text);

/** Writes a self-contained HTML page: the equilibria one after another, the printed result. KEMPE_E_IO: the path
 * cannot be written. */
KEMPE_API kempe_status kempe_equilibrium_write_report(const kempe_equilibrium *equilibrium, const char *path);

KEMPE_END
#endif
