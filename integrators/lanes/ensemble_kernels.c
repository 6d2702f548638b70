/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/clones.h"
#include "base/simd4.h"
#include "constraints/tolerances.h"
#include "integrators/lanes/ensemble_inside.h"
#include "integrators/steppers/rk.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* A loop over lanes that is not unrolled before it is compiled for registers: one with a choice then would not be. */
#if defined(__GNUC__) && !defined(__clang__)
#define EACH_LANE(l, w) _Pragma("GCC unroll 1") for (size_t l = 0; l < (w); l++)
#else
#define EACH_LANE(l, w) for (size_t l = 0; l < (w); l++)
#endif

/* -- sums of slopes ---------------------------------------------------------------------------------- */

/* The sums of all lanes are made before any is stored, which might be one that is read. */
KMP_INLINE void combine_terms(size_t w, size_t size, int terms, const kmp_lanes_sum *s)
{
    const double *slope[KMP_RK_MAX_STAGES] = {s->k[0]};
    for (int j = 1; j < terms; j++) /* kept in registers */
        slope[j] = s->k[j];
    for (size_t c = 0, i = 0; c < size; c++, i += w) {
        double sum[KMP_LANES_MOST], *also = s->place[c] ? s->place[c] : s->out + i;
        for (size_t l = 0; l < w; l++) {
            double x = s->a[0] * slope[0][i + l];
            for (int j = 1; j < terms; j++)
                x = fma(s->a[j], slope[j][i + l], x);
            sum[l] = fma(s->h[l], x, s->y[i + l]);
        }
        for (size_t l = 0; l < w; l++)
            s->out[i + l] = sum[l];
        for (size_t l = 0; l < w; l++)
            also[l] = sum[l];
    }
}

/* Loops over the constant numbers of terms of DOP853 are unrolled. */
KMP_INLINE void combine_lanes(size_t w, size_t size, const kmp_lanes_sum *s)
{
    switch (s->terms) {
    case 1:
        combine_terms(w, size, 1, s);
        break;
    case 2:
        combine_terms(w, size, 2, s);
        break;
    case 3:
        combine_terms(w, size, 3, s);
        break;
    case 4:
        combine_terms(w, size, 4, s);
        break;
    case 5:
        combine_terms(w, size, 5, s);
        break;
    case 6:
        combine_terms(w, size, 6, s);
        break;
    case 7:
        combine_terms(w, size, 7, s);
        break;
    case 8:
        combine_terms(w, size, 8, s);
        break;
    case 9:
        combine_terms(w, size, 9, s);
        break;
    default:
        combine_terms(w, size, s->terms, s);
        break;
    }
}

KMP_LANES_KERNEL(kmp_lanes_combine, combine_lanes, (size_t width, size_t size, const kmp_lanes_sum *sum),
                 (width, size, sum), size, sum)

KMP_INLINE void find_solution(size_t w, size_t size, const kmp_dop853_step *step)
{
    kmp_dop853_solution(w, true, size, step);
}

KMP_LANES_KERNEL(kmp_lanes_solution, find_solution, (size_t width, size_t size, const kmp_dop853_step *step),
                 (width, size, step), size, step)

/* -- within a step ----------------------------------------------------------------------------------- */

KMP_INLINE void interpolant(size_t w, size_t size, const kmp_dop853_step *s, bool dense, double *const *vector)
{
    for (size_t i = 0; i < size * w; i += w)
        for (size_t l = 0; l < w; l++) {
            double cubic[4];
            kmp_rk_cubic(s->h[l], s->y[i + l], s->y_new[i + l], s->k[1][i + l], s->k[13][i + l], cubic);
            for (int j = 0; j < 4; j++)
                vector[j][i + l] = cubic[j];
        }
    for (int j = 0; j < 4 && dense; j++)
        for (size_t i = 0; i < size * w; i += w)
            for (size_t l = 0; l < w; l++)
                vector[4 + j][i + l] = kmp_dop853_dense(s->h[l], s->k, i + l, j);
}

KMP_LANES_KERNEL(kmp_lanes_interpolant, interpolant,
                 (size_t width, size_t size, const kmp_dop853_step *step, bool dense, double *const *vector),
                 (width, size, step, dense, vector), size, step, dense, vector)

KMP_CLONES static void interpolate(size_t count, int vectors, double *const *vector, double x, double *y)
{
    kmp_rk_interpolate((int)count, vectors, vector, x, y);
}

void kmp_lanes_interpolate(size_t width, size_t size, int vectors, double *const *vector, double x, double *y)
{
    interpolate(width * size, vectors, vector, x, y);
}

/* -- step sizes -------------------------------------------------------------------------------------- */

static inline __attribute__((always_inline)) double of_bits(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static inline __attribute__((always_inline)) uint64_t bits_of(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Base-2 logarithm of a positive normal number, to some 1e-10: by the series of artanh after a division by the power of
 * two that leaves a number between sqrt(1/2) and sqrt(2). */
KMP_INLINE double log2_of(double x)
{
    const uint64_t half = 0x3fe6a09e667f3bcdu; /* sqrt(1/2) */
    const double round = 6755399441055744.0;   /* 1.5 2^52: an integer in the low bits */
    uint64_t above = bits_of(x) - half, power = above >> 52;
    double m = of_bits((above & 0xfffffffffffffu) + half), f = (m - 1) / (m + 1), z = f * f;
    double exponent = of_bits(bits_of(round) + power) - round;
    exponent = exponent > 2048 ? exponent - 4096 : exponent; /* negative ones, in 12 bits */
    double sum = fma(z, 1.0 / 11, 1.0 / 9);
    sum = fma(z, sum, 1.0 / 7);
    sum = fma(z, sum, 1.0 / 5);
    sum = fma(z, sum, 1.0 / 3);
    return fma(2.8853900817779268, fma(f, z * sum, f), exponent);
}

/* 2^y for |y| < 1000, to some 1e-10: by the exponential series beyond the nearest integer. */
KMP_INLINE double exp2_of(double y)
{
    const double round = 6755399441055744.0;
    double t = y + round, x = (y - (t - round)) * 0.6931471805599453;
    double sum = fma(x, 1.0 / 40320, 1.0 / 5040);
    sum = fma(x, sum, 1.0 / 720);
    sum = fma(x, sum, 1.0 / 120);
    sum = fma(x, sum, 1.0 / 24);
    sum = fma(x, sum, 1.0 / 6);
    sum = fma(x, sum, 0.5);
    sum = fma(x, fma(x, sum, 1.0), 1.0);
    return of_bits(bits_of(sum) + (bits_of(t) << 52));
}

/* kmp_rk_after_accepted and kmp_rk_after_rejected, but for rounding of their powers. */
KMP_INLINE void next_steps(size_t w, double exponent, const kmp_lanes_control *c)
{
    double factor[KMP_LANES_MOST], next[KMP_LANES_MOST];
    EACH_LANE(l, w)
    {
        double error = c->error[l] > 1e-300 ? c->error[l] : 1e-300;
        double before = KMP_RK_BETA * log2_of(c->error_old[l]);
        error = error < 1e300 ? error : 1e300;
        factor[l] = exp2_of(exponent * log2_of(error) - (c->error[l] <= 1 ? before : 0)) * (1 / KMP_RK_SAFETY);
    }
    EACH_LANE(l, w)
    {
        double longest = c->error[l] <= 1 ? 1.0 / c->grow : 0;
        double shortest = c->error[l] <= 1 || !(c->error[l] <= DBL_MAX) ? c->shrink : KMP_RK_SHORTEST;
        double most = factor[l] < shortest ? factor[l] : shortest;
        next[l] = c->h[l] / (most > longest ? most : longest);
    }
    EACH_LANE(l, w)
    c->next[l] = next[l];
}

KMP_LANES_KERNEL(kmp_lanes_next_steps, next_steps, (size_t width, double exponent, const kmp_lanes_control *control),
                 (width, exponent, control), exponent, control)

/* -- the right-hand side ----------------------------------------------------------------------------- */

KMP_INLINE void copy_times(size_t w, const double *restrict from, double factor, double *restrict to)
{
    EACH_LANE(l, w)
    to[l] = from[l] * factor;
}

/* 0 times a number that is not finite is NaN, and stays so in a sum. */
KMP_INLINE void publish(size_t w, const kmp_lanes_slopes *s)
{
    size_t p = s->p, slopes = p + s->r;
    const kmp_lanes_output *end = s->end;
    double bad[KMP_LANES_MOST];
    int64_t good[KMP_LANES_MOST];
    for (size_t i = 0; i < p; i++)
        copy_times(w, s->y + (p + i) * w, 1, s->k + i * w);
    for (size_t i = 0; i < slopes; i++)
        copy_times(w, end[i].value, end[i].factor, s->k + (p + i) * w);
    if (s->power)
        copy_times(w, end[slopes + p].value, end[slopes + p].factor, s->k + (p + slopes) * w);
    EACH_LANE(l, w)
    {
        bad[l] = s->bad[l];
        good[l] = 1;
    }
    for (size_t i = 0; i < p; i++) {
        const double *rate = end[i].value, *pivot = end[slopes + i].value;
        double factor = end[slopes + i].factor;
        EACH_LANE(l, w)
        bad[l] += 0 * rate[l];
        EACH_LANE(l, w)
        good[l] &= pivot[l] * factor > 0;
    }
    EACH_LANE(l, w)
    s->bad[l] = good[l] ? bad[l] : NAN;
}

KMP_LANES_KERNEL(kmp_lanes_publish, publish, (size_t width, const kmp_lanes_slopes *slopes), (width, slopes), slopes)

/* -- the end of a step ------------------------------------------------------------------------------- */

KMP_INLINE double larger_of(double a, double b)
{
    return b > a ? b : a;
}

/* NaN counts as infinite. */
KMP_INLINE double or_infinite(double x)
{
    return x <= DBL_MAX ? x : INFINITY;
}

KMP_INLINE void measure_closures(size_t w, const kmp_lanes_end *e)
{
    double residual[KMP_LANES_MOST] = {0}, correction[KMP_LANES_MOST] = {0}, growth[KMP_LANES_MOST] = {0};
    double least[KMP_LANES_MOST];
    for (size_t i = 0; i < (size_t)e->m * w; i += w)
        EACH_LANE(l, w)
    residual[l] = larger_of(residual[l], or_infinite(fabs(e->h[i + l]) * e->per_row_scale[i + l]));
    EACH_LANE(l, w)
    least[l] = INFINITY;
    for (size_t i = 0; i < (size_t)e->pivots * w; i += w)
        EACH_LANE(l, w)
        {
            double size = fabs(e->pivot[i + l]);
            least[l] = size < least[l] ? size : least[l];
        }
    for (int i = 0; i < e->r; i++) {
        const double *dv = e->dv + (size_t)i * w, *weight = e->weight + (size_t)i * w,
                     *scale = e->scale + (size_t)e->v[i] * w;
        EACH_LANE(l, w)
        {
            double size = fabs(dv[l]), rounded = KMP_CORRECTION_ROUNDING * scale[l], limit = weight[l];
            double part = or_infinite(size / limit), most = rounded < limit ? rounded : limit;
            correction[l] = larger_of(correction[l], size <= most ? 0 : part);
        }
    }
    for (int i = 0; i < e->r; i++)
        for (int c = 0; c < e->p; c++) {
            const double *b = e->b + (size_t)(c * e->r + i) * w, *u = e->scale + (size_t)e->u[c] * w,
                         *per_v = e->per_scale + (size_t)e->v[i] * w;
            EACH_LANE(l, w)
            growth[l] = larger_of(growth[l], or_infinite(fabs(b[l]) * u[l] * per_v[l]));
        }
    EACH_LANE(l, w)
    {
        e->residual[l] = residual[l];
        e->correction[l] = correction[l];
        e->growth[l] = growth[l];
        e->least[l] = least[l];
    }
}

KMP_LANES_KERNEL(kmp_lanes_measure, measure_closures, (size_t width, const kmp_lanes_end *end), (width, end), end)

KMP_INLINE void find_quiet(size_t w, const kmp_lanes_tests *e)
{
    uint64_t turned[KMP_LANES_MOST] = {0};
    double largest[KMP_LANES_MOST];
    int64_t quiet[KMP_LANES_MOST];
    for (int k = 0; k < e->sign_words; k++)
        EACH_LANE(l, w)
    turned[l] |= e->negative[(size_t)k * w + l] ^ e->before[(size_t)k * w + l];
    EACH_LANE(l, w)
    largest[l] = larger_of(e->pivot[l], e->least[l]);
    EACH_LANE(l, w)
    {
        int64_t closed = (e->residual[l] < KMP_CLOSED) | (e->correction[l] <= e->most);
        int64_t regular = (e->pivot[l] > 0) & (e->least[l] > KMP_MARGIN_CALLS * largest[l]) & (turned[l] == 0);
        int64_t good = (e->error[l] <= 1) & (e->bad[l] == 0);
        quiet[l] = closed & regular & good & (e->t_new[l] < e->limit[l]) & (e->growth[l] <= e->exchange[l]);
    }
    EACH_LANE(l, w)
    e->pivot[l] = quiet[l] ? largest[l] : e->pivot[l];
    EACH_LANE(l, w)
    e->quiet[l] = quiet[l];
    for (size_t i = 0; i < e->r; i++) {
        double *v = e->v + i * w;
        const double *dv = e->dv + i * w;
        EACH_LANE(l, w)
        v[l] = quiet[l] && !(e->residual[l] < KMP_CLOSED) ? v[l] + dv[l] : v[l];
    }
}

KMP_LANES_KERNEL(kmp_lanes_find_quiet, find_quiet, (size_t width, const kmp_lanes_tests *ends), (width, ends), ends)

/* All numbers are read before any is stored. */
KMP_INLINE void pass_on(size_t w, kmp_lanes_passing *e)
{
    int64_t on[KMP_LANES_MOST], stays[KMP_LANES_MOST], made[KMP_LANES_MOST], repeated[KMP_LANES_MOST];
    int64_t rejected[KMP_LANES_MOST], tries[KMP_LANES_MOST], all = 1, any = 0;
    double t[KMP_LANES_MOST], h[KMP_LANES_MOST], error[KMP_LANES_MOST];
    EACH_LANE(l, w)
    {
        int64_t spare = e->made[l] + e->repeated[l] < e->spare[l];
        int64_t lasts = e->step[l] >= KMP_STEP_COLLAPSED * DBL_EPSILON * fabs(e->t_new[l]);
        int64_t again = !(e->error[l] <= 1) & (e->failed[l] == 0) & (e->tries[l] < e->most_tries);
        stays[l] = again & spare;
        on[l] = (e->quiet[l] & lasts & spare) | stays[l];
    }
    EACH_LANE(l, w)
    {
        int64_t through = on[l] & ~stays[l];
        double shorter = e->next[l] < e->step[l] ? e->next[l] : e->step[l];
        t[l] = through ? e->t_new[l] : e->t[l];
        h[l] = through & e->rejected[l] ? shorter : on[l] ? e->next[l] : e->h[l];
        error[l] = through ? larger_of(e->error[l], KMP_RK_ERROR_FLOOR) : e->error_old[l];
        made[l] = e->made[l] + through;
        repeated[l] = e->repeated[l] + stays[l];
        tries[l] = through ? 0 : e->tries[l] + stays[l];
        rejected[l] = through ? 0 : e->rejected[l] | stays[l];
    }
    EACH_LANE(l, w)
    {
        e->t[l] = t[l];
        e->h[l] = h[l];
        e->error_old[l] = error[l];
    }
    EACH_LANE(l, w)
    {
        e->made[l] = made[l];
        e->repeated[l] = repeated[l];
        e->tries[l] = tries[l];
        e->rejected[l] = rejected[l];
        e->on[l] = on[l];
        e->stays[l] = stays[l];
    }
    EACH_LANE(l, w)
    {
        all &= on[l];
        any |= stays[l];
    }
    e->all = all;
    e->none_stays = !any;
}

KMP_LANES_KERNEL(kmp_lanes_pass_on, pass_on, (size_t width, kmp_lanes_passing *ends), (width, ends), ends)

KMP_INLINE void exchange(size_t w, size_t size, const int64_t *lanes, double *a, double *b)
{
    for (size_t i = 0; i < size * w; i += w) {
        double x[KMP_LANES_MOST], y[KMP_LANES_MOST];
        EACH_LANE(l, w)
        {
            x[l] = lanes[l] ? b[i + l] : a[i + l];
            y[l] = lanes[l] ? a[i + l] : b[i + l];
        }
        EACH_LANE(l, w)
        a[i + l] = x[l];
        EACH_LANE(l, w)
        b[i + l] = y[l];
    }
}

KMP_LANES_KERNEL(kmp_lanes_exchange, exchange, (size_t width, size_t size, const int64_t *lanes, double *a, double *b),
                 (width, size, lanes, a, b), size, lanes, a, b)

KMP_INLINE void choose_tries(size_t w, const kmp_lanes_tries *s)
{
    double step[KMP_LANES_MOST], t_new[KMP_LANES_MOST];
    EACH_LANE(l, w)
    step[l] = kmp_step_next(s->t[l], s->limit[l], s->h[l] < s->longest ? s->h[l] : s->longest, &t_new[l]);
    EACH_LANE(l, w)
    s->t_new[l] = t_new[l];
    int64_t none = 0;
    EACH_LANE(l, w)
    {
        none |= (s->who[l] >= 0) & (step[l] == 0);
        s->step[l] = s->who[l] < 0 ? 0 : step[l];
    }
    *s->none = none;
}

KMP_LANES_KERNEL(kmp_lanes_choose_tries, choose_tries, (size_t width, const kmp_lanes_tries *tries), (width, tries),
                 tries)

/* -- signs of pivots --------------------------------------------------------------------------------- */

KMP_INLINE void find_signs(size_t w, int pivots, const unsigned char *block, const double *pivot, uint64_t *negative)
{
    for (size_t l = 0; l < KMP_SIGN_WORDS * w; l++)
        negative[l] = 0;
    for (int k = 0; k < pivots; k++) {
        uint64_t bit = (uint64_t)1 << block[k] % 64, *word = negative + block[k] / 64 * w;
        EACH_LANE(l, w)
        word[l] ^= pivot[(size_t)k * w + l] < 0 ? bit : 0;
    }
}

KMP_LANES_KERNEL(kmp_lanes_signs, find_signs,
                 (size_t width, int pivots, const unsigned char *block, const double *pivot, uint64_t *negative),
                 (width, pivots, block, pivot, negative), pivots, block, pivot, negative)
