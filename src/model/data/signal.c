/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples as pieces: constant between samples, linear or cubic, each a polynomial in the time from its beginning. */
#include "model/data/signal.h"
#include "base/quantile.h"
#include "base/spline.h"
#include <math.h>
#include <string.h>

static const char *const words[] = {"hold", "linear", "cubic"};
const kmp_name_list kmp_signal_words = {words, sizeof words[0], sizeof words / sizeof *words};

bool kmp_signal_init(kmp_signal *signal, kmp_arena *arena, kmp_signal_method method, int count, const double *t,
                     const double *u)
{
    *signal = (kmp_signal){.method = method, .count = count};
    signal->t = KMP_ARENA_NEW(arena, double, count);
    signal->u = KMP_ARENA_NEW(arena, double, count);
    signal->piece = kmp_arena_alloc(arena, (size_t)count, sizeof *signal->piece);
    double *slope = KMP_ARENA_NEW(arena, double, 3 * count);
    if (arena->failed)
        return false;
    memcpy(signal->t, t, (size_t)count * sizeof *t);
    memcpy(signal->u, u, (size_t)count * sizeof *u);
    memset(signal->piece, 0, (size_t)count * sizeof *signal->piece);
    /* Polynomials from each sample on. */
    for (int k = 0; k < signal->count; k++)
        signal->piece[k][0] = signal->u[k];
    for (int k = 0; k < signal->count - 1 && signal->method != KMP_SIGNAL_HOLD; k++)
        signal->piece[k][1] = (signal->u[k + 1] - signal->u[k]) / (signal->t[k + 1] - signal->t[k]);
    if (signal->method == KMP_SIGNAL_CUBIC && signal->count > 2) {
        kmp_spline_slopes(signal->count, signal->t, signal->u, slope, slope + signal->count);
        for (int k = 0; k < signal->count - 1; k++)
            kmp_spline_piece(signal->t[k + 1] - signal->t[k], signal->u[k], signal->u[k + 1], slope[k], slope[k + 1],
                             signal->piece[k]);
    }
    return true;
}

/* The last sample at t or before, -1: none. */
static int sample_before(const kmp_signal *s, double t)
{
    return kmp_ordered_last(s->t, -1, s->count, t);
}

static bool is_constant(const double c[4])
{
    return c[1] == 0 && c[2] == 0 && c[3] == 0;
}

static kmp_signal_piece piece_from(const kmp_signal *signal, int k)
{
    kmp_signal_piece piece = {.from = signal->t[k < 0 ? 0 : k]};
    bool inside = k > 0 && k < signal->count - 1;
    /* The coefficients from sample k on; those before the first sample are its value. */
    double *c = piece.c;
    memset(c, 0, 4 * sizeof *c);
    if (k < 0)
        c[0] = signal->u[0];
    else
        memcpy(c, signal->piece[k], 4 * sizeof *c);
    /* The end of a constant piece is the first sample where another value or a slope begins. */
    while (is_constant(c) && k + 1 < signal->count && signal->piece[k + 1][0] == c[0] &&
           is_constant(signal->piece[k + 1]))
        k++;
    piece.until = k + 1 < signal->count ? signal->t[k + 1] : INFINITY;
    piece.jump = signal->method == KMP_SIGNAL_HOLD ? 0 : signal->method == KMP_SIGNAL_CUBIC && inside ? 3 : 1;
    return piece;
}

kmp_signal_piece kmp_signal_at(const kmp_signal *signal, double t)
{
    return piece_from(signal, sample_before(signal, t));
}

kmp_signal_piece kmp_signal_before(const kmp_signal *signal, double t)
{
    int k = sample_before(signal, t);
    return piece_from(signal, k >= 0 && signal->t[k] == t ? k - 1 : k);
}

void kmp_signal_values(const kmp_signal_piece *piece, double t, double values[3])
{
    const double *c = piece->c, s = t - piece->from;
    if (is_constant(c)) { /* also where t is not finite */
        values[0] = c[0];
        values[1] = values[2] = 0;
        return;
    }
    values[0] = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    values[1] = c[1] + s * (2 * c[2] + s * (3 * c[3]));
    values[2] = 2 * c[2] + s * (6 * c[3]);
}

double kmp_signal_value(const kmp_signal *signal, double t)
{
    double values[3];
    kmp_signal_piece piece = kmp_signal_at(signal, t);
    kmp_signal_values(&piece, t, values);
    return values[0];
}
