/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Modes: how a mechanism swings, grows or dies away near a state, and how that changes with a parameter.
 *
 *     kempe_modes *modes;
 *     kempe_modes_options ask = {.sweep = "speed=20:140:61"};
 *     kempe_modes_new(system, &ask, &modes);
 *     for (int k = 0; k < kempe_modes_count(modes); k++)
 *         show(kempe_modes_frequency(modes, k), kempe_modes_damping(modes, k));
 *
 * Near the state the independent coordinates u obey Mr udd + Gr ud + Kr u = 0, to first order; u = x e^(s t) with an
 * eigenvalue s = re + i im for each of twice as many modes as there are degrees of freedom, and q = N x e^(s t).
 */
#ifndef KEMPE_MODES_H
#define KEMPE_MODES_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** All may be zero. */
typedef struct kempe_modes_options {
    const char *at; /* the state: equilibrium (default), from the assembled start; start: that itself, moving or not */
    const char *rates;       /* "NAME=V,..": rates that the equilibrium keeps; one may be "NAME=A:B:N" and varies */
    const char *independent; /* independent coordinates, comma-separated; eigenvalues do not depend on them */
    const char
        *sweep; /* "NAME=A:B" or "NAME=A:B:N" (default: 61 values): a parameter, q.NAME or qd.NAME of the start */
    const char *orders; /* "1,2": lines of these in pictures, frequency = order * value / (2 pi) */
} kempe_modes_options;

typedef struct kempe_modes kempe_modes;

/** At the state with the model's own values; and, where something varies, at each of its values. KEMPE_E_ARGUMENT: a
 *  word, name or range. KEMPE_E_FAILED: there is no such state, and why. KEMPE_STOPPED: the parameter came only so far,
 *  and why; `*modes` is then given, too. */
KEMPE_API kempe_status kempe_modes_new(const kempe_system *system, const kempe_modes_options *ask, kempe_modes **modes);
KEMPE_API void kempe_modes_free(kempe_modes *modes);

/** Eigenvalues, 1/s: those that are exactly zero first, then by modulus, each upper one before its conjugate. */
KEMPE_API int kempe_modes_count(const kempe_modes *modes);
KEMPE_API int kempe_modes_zero_count(const kempe_modes *modes);
KEMPE_API double kempe_modes_re(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_im(const kempe_modes *modes, int k);

/** |im| / (2 pi), Hz; -re / |s|, 1 and more for what does not swing; NaN of a zero or where there is no k-th. */
KEMPE_API double kempe_modes_frequency(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_damping(const kempe_modes *modes, int k);

/** The shape of eigenvalue k in all coordinates (n values each), real and imaginary parts: q moves as
 *  Re((re + i im) e^(s t)). The largest, in parts of the size of its coordinate (1 rad, or the mechanism's length), is
 *  that size. Owned by the modes. */
KEMPE_API const double *kempe_modes_shape_re(const kempe_modes *modes, int k);
KEMPE_API const double *kempe_modes_shape_im(const kempe_modes *modes, int k);

/** q and qd of the state (n values), owned by the modes. */
KEMPE_API const double *kempe_modes_q(const kempe_modes *modes);
KEMPE_API const double *kempe_modes_qd(const kempe_modes *modes);

/** Whether a mode grows, beyond what rounding makes: 1, else 0. */
KEMPE_API int kempe_modes_unstable(const kempe_modes *modes);

/** What varied: how many values were reached, the k-th, and eigenvalue `branch` (of kempe_modes_count) there, followed
 *  from the first value on. NaN where there is none. */
KEMPE_API int kempe_modes_value_count(const kempe_modes *modes);
KEMPE_API double kempe_modes_value(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_locus_re(const kempe_modes *modes, int k, int branch);
KEMPE_API double kempe_modes_locus_im(const kempe_modes *modes, int k, int branch);

/** Values at which a mode begins to grow or ceases to, and the frequency there (Hz; 0: it does not swing). */
KEMPE_API int kempe_modes_critical_count(const kempe_modes *modes);
KEMPE_API double kempe_modes_critical_value(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_critical_frequency(const kempe_modes *modes, int k);

KEMPE_API kempe_status kempe_modes_print(const kempe_modes *modes, kempe_format format, char **text);

/** The modes as CSV, a row an eigenvalue with its shape; where something varied a row a value: NAME, re.1, im.1, ... */
KEMPE_API kempe_status kempe_modes_write_csv(const kempe_modes *modes, const char *path);

/** A picture of what varied: the eigenvalues in the plane, and frequencies over the value (Campbell). KEMPE_E_ARGUMENT:
 *  nothing varied. */
KEMPE_API kempe_status kempe_modes_write_svg(const kempe_modes *modes, const char *path);

/** One page of HTML that needs nothing beside itself: the modes, and the mechanism moving along each. KEMPE_E_IO as
 *  kempe_report_check. */
KEMPE_API kempe_status kempe_modes_write_report(kempe_modes *modes, const char *path);

#ifdef __cplusplus
}
#endif
#endif
