/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Modes: oscillation, growth or decay of a mechanism near a state, and their change with a parameter.
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

/** Options; all may be zero. */
typedef struct kempe_modes_options {
    const char *at; /* the state: equilibrium (default), found from the assembled start; start: the start itself, moving
                     * or not */
    const char *rates;       /* "NAME=V,..": rates at the equilibrium; one may be "NAME=A:B:N" and varies */
    const char *independent; /* independent coordinates, comma-separated; eigenvalues do not depend on them */
    const char
        *sweep; /* "NAME=A:B" or "NAME=A:B:N" (default: 61 values): a parameter, q.NAME or qd.NAME of the start */
    const char *orders; /* "1,2": order lines in pictures, frequency = order * value / (2 pi) */
} kempe_modes_options;

typedef struct kempe_modes kempe_modes;

/** Computes the modes at the state with the model's own values, and at each value of a swept parameter.
 * KEMPE_E_ARGUMENT: a word, name or range is wrong. KEMPE_E_FAILED: the state does not exist; the message has the
 * reason. KEMPE_STOPPED: the sweep ends early, with a reason; `*modes` is then given, too. */
KEMPE_API kempe_status kempe_modes_new(const kempe_system *system, const kempe_modes_options *ask, kempe_modes **modes);
KEMPE_API void kempe_modes_free(kempe_modes *modes);

/** Eigenvalues, 1/s: the exact zeros first, then by modulus, each with positive im before its conjugate. */
KEMPE_API int kempe_modes_count(const kempe_modes *modes);
KEMPE_API int kempe_modes_zero_count(const kempe_modes *modes);
KEMPE_API double kempe_modes_re(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_im(const kempe_modes *modes, int k);

/** Frequency |im| / (2 pi), Hz. Damping ratio -re / |s|, 1 and more for modes without oscillation; NaN of a zero
 * eigenvalue, or if there is no k-th. */
KEMPE_API double kempe_modes_frequency(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_damping(const kempe_modes *modes, int k);

/** The shape of eigenvalue k in all coordinates (n values each), real and imaginary parts: q moves as Re((re + i im)
 * e^(s t)). The largest component, relative to the size of its coordinate (1 rad, or the mechanism's length), equals
 * that size. Owned by the modes. */
KEMPE_API const double *kempe_modes_shape_re(const kempe_modes *modes, int k);
KEMPE_API const double *kempe_modes_shape_im(const kempe_modes *modes, int k);

/** q and qd of the state (n values), owned by the modes. */
KEMPE_API const double *kempe_modes_q(const kempe_modes *modes);
KEMPE_API const double *kempe_modes_qd(const kempe_modes *modes);

/** 1 if a mode grows by more than rounding explains, else 0. */
KEMPE_API int kempe_modes_unstable(const kempe_modes *modes);

/** The sweep: the number of values reached, the k-th value, and eigenvalue `branch` (of kempe_modes_count) at it,
 * tracked from the first value on. NaN for an index that does not exist. */
KEMPE_API int kempe_modes_value_count(const kempe_modes *modes);
KEMPE_API double kempe_modes_value(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_locus_re(const kempe_modes *modes, int k, int branch);
KEMPE_API double kempe_modes_locus_im(const kempe_modes *modes, int k, int branch);

/** Values at which a mode becomes unstable or stable, and the frequency there (Hz; 0: no oscillation). */
KEMPE_API int kempe_modes_critical_count(const kempe_modes *modes);
KEMPE_API double kempe_modes_critical_value(const kempe_modes *modes, int k);
KEMPE_API double kempe_modes_critical_frequency(const kempe_modes *modes, int k);

KEMPE_API kempe_status kempe_modes_print(const kempe_modes *modes, kempe_format format, char **text);

/** Writes the modes as CSV, a row per eigenvalue with its shape; of a sweep a row per value: NAME, re.1, im.1, ... */
KEMPE_API kempe_status kempe_modes_write_csv(const kempe_modes *modes, const char *path);

/** Draws the sweep: the eigenvalues in the complex plane, and frequencies over the value (Campbell diagram).
 * KEMPE_E_ARGUMENT: nothing was swept. */
KEMPE_API kempe_status kempe_modes_write_svg(const kempe_modes *modes, const char *path);

/** Writes a self-contained HTML page: the modes, and an animation of each. KEMPE_E_IO as kempe_report_check. */
KEMPE_API kempe_status kempe_modes_write_report(kempe_modes *modes, const char *path);

#ifdef __cplusplus
}
#endif
#endif
