/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Limit cycles: isolated periodic motions of a mechanism, their stability, and their change with a parameter
 * (bifurcation diagram), such as the hunting of a railway vehicle over its speed.
 *
 *     kempe_limit_cycles *cycles;
 *     kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "V=60:75:16"};
 *     kempe_limit_cycles_new(system, &ask, &cycles);
 *
 * A cycle is a start x and a period T with y(T; x, p) = x. Newton's method finds both with exact derivatives of the
 * motion, and the branch of cycles is followed by its length, so that folds are passed. Eigenvalues of dy/dx (Floquet's
 * multipliers) determine stability. See R. Seydel, Practical Bifurcation and Stability Analysis, 2010.
 */
#ifndef KEMPE_LIMIT_CYCLES_H
#define KEMPE_LIMIT_CYCLES_H

#include <kempe/table.h>

KEMPE_BEGIN

/** Options; zeros and NULL mean defaults. */
typedef struct kempe_limit_cycles_options {
    size_t size;                  /* sizeof this struct */
    const char *sweep;            /* "NAME=A:B" or "NAME=A:B:N" (default: 31 values): a parameter; required */
    const char *outputs;          /* "q(y1),position(b.P).y": outputs whose extremes are found; NULL: all coordinates */
    int most;                     /* cycles of a branch; 0: 1000 */
    const kempe_run_options *run; /* rtol (default 1e-10), integrator, back end */
    double settle; /* s: not Newton's method, but simulations of this length at each value, from A to B and back, each
                    * from the end of the last one: cycles that attract, of any model. 0: Newton's method */
} kempe_limit_cycles_options;

typedef struct kempe_limit_cycles kempe_limit_cycles;

/** Finds the equilibria at the values of the sweep, their Hopf points, and the branches of cycles from these.
 * KEMPE_E_ARGUMENT: a word, name or range is wrong. A rate that no force fixes is held at its start value, by
 * a load. KEMPE_E_FAILED: no equilibrium is found, the track of a vehicle is not straight, or the model has friction
 * that sticks, rigid contacts, samples or delays; the message has the reason.
 * KEMPE_STOPPED: interrupted; `*cycles` is then given, too. */
KEMPE_API kempe_status kempe_limit_cycles_new(const kempe_system *system, const kempe_limit_cycles_options *options,
                                              kempe_limit_cycles **cycles);
KEMPE_API void kempe_limit_cycles_free(kempe_limit_cycles *cycles);

/** The number of branches, and of cycles on branch k. */
KEMPE_API int kempe_limit_cycles_branch_count(const kempe_limit_cycles *cycles);
KEMPE_API int kempe_limit_cycles_count(const kempe_limit_cycles *cycles, int branch);

KEMPE_API kempe_status kempe_limit_cycles_print(const kempe_limit_cycles *cycles, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "rows", a row for each cycle in the order of its branch: branch, from 1; the parameter; period, s; point (Hopf, fold,
 * doubling, torus, branching, with `settle` rest; empty: none of these); stability (stable, unstable, undecided; of a
 * Hopf point empty). Then multiplier, the largest absolute value, and along, the distance from 1 of the multiplier of
 * the motion along the cycle, which is left out there. residual is |y(T) - x| over the size of the motion. load.NAME is
 * the mean over the period of the load that holds the rate of a coordinate, N or N m (unknown: NaN). Each output
 * has OUTPUT.amplitude, half its range, OUTPUT.max and OUTPUT.min, unknown where it advances from period to period.
 * "multipliers", a row for each multiplier of each cycle: cycle, its row from 1; re; im.
 * "states", a row for each cycle: the parameter; period; q.NAME, qd.NAME, state.NAME of one state of the cycle.
 * "equilibria", a row for each value of the sweep: the parameter; growth, the largest real part of an eigenvalue, 1/s.
 * "critical", the Hopf points: the parameter; frequency, Hz; branch, 0: no branch was followed from it. */
KEMPE_API kempe_status kempe_limit_cycles_table(const kempe_limit_cycles *cycles, const char *name,
                                                kempe_table **table);

/** Draws the amplitude of each output over the parameter, stable parts solid, the others dashed, with equilibria, Hopf
 * points and folds (.svg, .png). */
KEMPE_API kempe_status kempe_limit_cycles_write_picture(const kempe_limit_cycles *cycles, const char *path);

/** Writes a self-contained HTML page: the diagram, and the printed result. KEMPE_E_IO: the path
 * cannot be written. */
KEMPE_API kempe_status kempe_limit_cycles_write_report(const kempe_limit_cycles *cycles, const char *path);

KEMPE_END
#endif
