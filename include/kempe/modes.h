/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Modes: oscillation, growth or decay of a mechanism near a state, and their change with a parameter. Limit cycles,
 * which begin where a mode begins to grow, are in limit_cycles.h.
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
    size_t size;    /* sizeof this struct; 0: its size in version 0.1 */
    const char *at; /* the state: equilibrium (default), found from the assembled start; start: the start itself, moving
                     * or not */
    const char *rates;       /* "NAME=V,..": rates at the equilibrium; one may be "NAME=A:B:N" and varies */
    const char *independent; /* independent coordinates, comma-separated; eigenvalues do not depend on them */
    const char
        *sweep; /* "NAME=A:B" or "NAME=A:B:N" (default: 61 values): a parameter, q.NAME or qd.NAME of the start */
    const char *orders; /* "1,2": order lines in pictures, frequency = order * value / (2 pi) */
    double highest;     /* Hz: pictures have eigenvalues of at most 2 pi times this modulus; 0: all */
    int slide;          /* 1: dry friction that sticks at the state has no force, and slides; 0: it keeps its places */
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

/** Writes a self-contained HTML page: the modes, and an animation of each. KEMPE_E_IO: the path cannot be
 * written. */
KEMPE_API kempe_status kempe_modes_write_report(const kempe_modes *modes, const char *path);

KEMPE_END
#endif
