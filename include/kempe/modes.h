/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Modes: oscillation, growth or decay of a mechanism near a state, and their change with a parameter. Limit cycles,
 * which begin where a mode begins to grow.
 *
 *     kempe_modes *modes;
 *     kempe_modes_options ask = {.sweep = "speed=20:140:61"};
 *     kempe_modes_new(system, &ask, &modes);
 *     kempe_table *rows;
 *     kempe_modes_table(modes, "rows", &rows);
 *     kempe_table_write(rows, "locus.csv");
 *
 * Near the state the independent coordinates u obey Mr udd + Gr ud + Kr u = 0, to first order. The solutions are
 * u = x e^(s t) and q = N x e^(s t) with an eigenvalue s = re + i im for each mode. There are twice as many modes as
 * degrees of freedom.
 */
#ifndef KEMPE_MODES_H
#define KEMPE_MODES_H

#include <kempe/table.h>

KEMPE_BEGIN

/** Options; all may be zero. */
typedef struct kempe_modes_options {
    size_t size;    /* sizeof this struct, or 0: that of version 0.1 */
    const char *at; /* the state: equilibrium (default), found from the assembled start; start: the start itself, moving
                     * or not */
    const char *rates;       /* "NAME=V,..": rates at the equilibrium; one may be "NAME=A:B:N" and varies */
    const char *independent; /* independent coordinates, comma-separated; eigenvalues do not depend on them */
    const char
        *sweep; /* "NAME=A:B" or "NAME=A:B:N" (default: 61 values): a parameter, q.NAME or qd.NAME of the start */
    const char *orders; /* "1,2": order lines in pictures, frequency = order * value / (2 pi) */
    double highest;     /* Hz: pictures have eigenvalues of at most 2 pi times this modulus; 0: all */
} kempe_modes_options;

typedef struct kempe_modes kempe_modes;

/** Computes the modes at the state with the model's own values, and at each value of a swept parameter.
 * KEMPE_E_ARGUMENT: a word, name or range is wrong. KEMPE_E_FAILED: the state does not exist; the message has the
 * reason. KEMPE_STOPPED: the sweep ends early, with a reason; `*modes` is then given, too. */
KEMPE_API kempe_status kempe_modes_new(const kempe_system *system, const kempe_modes_options *options,
                                       kempe_modes **modes);
KEMPE_API void kempe_modes_free(kempe_modes *modes);

/** The number of eigenvalues that are exactly zero. */
KEMPE_API int kempe_modes_zero_count(const kempe_modes *modes);

/** 1 if a mode grows by more than rounding explains, else 0. */
KEMPE_API int kempe_modes_is_unstable(const kempe_modes *modes);

KEMPE_API kempe_status kempe_modes_print(const kempe_modes *modes, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "modes", a row per eigenvalue, the exact zeros first, then by modulus, each with positive im before its conjugate:
 * index; re and im, 1/s; frequency |im| / (2 pi), Hz; damping ratio -re / |s|; decay, s; re.NAME and im.NAME. The
 * With sampled states re and im are ln(z)/T, and z.re, z.im are z from one common sample to the next. The
 * damping ratio is 1 and more without oscillation, and decay is the time to 1/e. The shape re.NAME, im.NAME has all
 * coordinates, q moving as Re((re + i im) e^(s t)). Its
 * largest component, relative to the size of its coordinate (1 rad, or the mechanism's length), equals that size.
 * "rows": of a sweep a row per value, NAME, re.1, im.1, .., each eigenvalue tracked from the first value on; otherwise
 * the modes. A sweep also has load.NAME for each coordinate whose rate a load holds, N or N m.
 * "critical", values of a sweep at which a mode becomes unstable or stable: value; re, im and frequency there (0: no
 * oscillation); branch, its number in the rows; grows, "above" or "below".
 * "state", one row: q.NAME and qd.NAME. */
KEMPE_API kempe_status kempe_modes_table(const kempe_modes *modes, const char *name, kempe_table **table);

/** Draws the sweep: the eigenvalues in the complex plane, and frequencies over the value (Campbell diagram).
 * KEMPE_E_ARGUMENT: nothing was swept. */
KEMPE_API kempe_status kempe_modes_write_picture(const kempe_modes *modes, const char *path);

/** Writes a self-contained HTML page: the modes, and an animation of each. KEMPE_E_IO as kempe_report_check. */
KEMPE_API kempe_status kempe_modes_write_report(kempe_modes *modes, const char *path);

/* -- limit cycles ------------------------------------------------------------------------------------ */

/* Limit cycles: isolated periodic motions of a mechanism, their stability, and their change with a parameter
 * (bifurcation diagram), such as the hunting of a railway vehicle over its speed.
 *
 *     kempe_limit_cycles *cycles;
 *     kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "V=60:75:16"};
 *     kempe_limit_cycles_new(system, &ask, &cycles);
 *
 * A cycle is a start x and a period T with y(T; x, p) = x. Newton's method finds both with exact derivatives of the
 * motion, and the branch of cycles is followed by its length, so that folds are passed. Eigenvalues of dy/dx (Floquet's
 * multipliers) decide stability. See R. Seydel, Practical Bifurcation and Stability Analysis, 2010. */

/** Options; zeros and NULL mean defaults. */
typedef struct kempe_limit_cycles_options {
    size_t size;                  /* sizeof this struct */
    const char *sweep;            /* "NAME=A:B" or "NAME=A:B:N" (default: 31 values): a parameter; required */
    const char *outputs;          /* "q(y1),position(b.P).y": those whose extremes are found; NULL: all coordinates */
    int most;                     /* cycles of a branch; 0: 1000 */
    const kempe_run_options *run; /* rtol (default 1e-10), integrator, back end */
    double settle; /* s: not Newton's method, but simulations of this length at each value, from A to B and back, each
                    * from the end of the last one: cycles that attract, of any model. 0: Newton's method */
} kempe_limit_cycles_options;

typedef struct kempe_limit_cycles kempe_limit_cycles;

/** Finds the equilibria at the values of the sweep, their Hopf points, and the branches of cycles from these.
 * KEMPE_E_ARGUMENT: a word, name or range is wrong. A rate that no force decides is held at that of the start, by
 * a load. KEMPE_E_FAILED: no equilibrium is found, the track of a vehicle is no straight one, or the model has friction
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

/** Writes a self-contained HTML page: the diagram, and the printed result. KEMPE_E_IO as kempe_report_check. */
KEMPE_API kempe_status kempe_limit_cycles_write_report(kempe_limit_cycles *cycles, const char *path);

KEMPE_END
#endif
