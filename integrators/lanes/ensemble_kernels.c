/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/clones.h"
#include "base/simd4.h"
#include "constraints/tolerances.h"
#include "integrators/lanes/ensemble_inside.h"
#include "integrators/steppers/rk.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* Numbers of the step-size control, one per lane. */
typedef struct kmp_lanes_control {
    const double *h, *error, *error_old;
    double shrink, grow;
    double *next;
} kmp_lanes_control;

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

KMP_FUSED_TWINS(combine_4, (size_t size, const kmp_lanes_sum *s), (size, s), combine_lanes(4, size, s))
KMP_FUSED_TWINS(combine_8, (size_t size, const kmp_lanes_sum *s), (size, s), combine_lanes(8, size, s))
KMP_FUSED_TWINS(combine_16, (size_t size, const kmp_lanes_sum *s), (size, s), combine_lanes(16, size, s))
KMP_FUSED_TWINS(combine_any, (size_t w, size_t size, const kmp_lanes_sum *s), (w, size, s),
                combine_terms(w, size, s->terms, s))

void kmp_lanes_combine(size_t width, size_t size, const kmp_lanes_sum *sum)
{
    if (width == 16)
        combine_16(size, sum);
    else if (width == 8)
        combine_8(size, sum);
    else if (width == 4)
        combine_4(size, sum);
    else
        combine_any(width, size, sum);
}

KMP_FUSED_TWINS(solution_4, (size_t size, const kmp_dop853_step *step), (size, step),
                kmp_dop853_solution(4, true, size, step))
KMP_FUSED_TWINS(solution_8, (size_t size, const kmp_dop853_step *step), (size, step),
                kmp_dop853_solution(8, true, size, step))
KMP_FUSED_TWINS(solution_16, (size_t size, const kmp_dop853_step *step), (size, step),
                kmp_dop853_solution(16, true, size, step))
KMP_FUSED_TWINS(solution_any, (size_t w, size_t size, const kmp_dop853_step *step), (w, size, step),
                kmp_dop853_solution(w, true, size, step))

void kmp_lanes_solution(size_t width, size_t size, const kmp_dop853_step *step)
{
    if (width == 16)
        solution_16(size, step);
    else if (width == 8)
        solution_8(size, step);
    else if (width == 4)
        solution_4(size, step);
    else
        solution_any(width, size, step);
}

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

KMP_CLONES static void interpolant_8(size_t size, const kmp_dop853_step *step, bool dense, double *const *vector)
{
    interpolant(8, size, step, dense, vector);
}

KMP_CLONES static void interpolant_16(size_t size, const kmp_dop853_step *step, bool dense, double *const *vector)
{
    interpolant(16, size, step, dense, vector);
}

void kmp_lanes_interpolant(size_t width, size_t size, const kmp_dop853_step *step, bool dense, double *const *vector)
{
    if (width == 8)
        interpolant_8(size, step, dense, vector);
    else if (width == 16)
        interpolant_16(size, step, dense, vector);
    else
        interpolant(width, size, step, dense, vector);
}

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

/* Base-2 logarithm of a positive normal number, to some 1e-14: by the series of artanh after a division by the power of
 * two that leaves a number between sqrt(1/2) and sqrt(2). */
KMP_INLINE double log2_of(double x)
{
    const uint64_t half = 0x3fe6a09e667f3bcdu; /* sqrt(1/2) */
    const double round = 6755399441055744.0;   /* 1.5 2^52: an integer in the low bits */
    uint64_t above = bits_of(x) - half, power = above >> 52;
    double m = of_bits((above & 0xfffffffffffffu) + half), f = (m - 1) / (m + 1), z = f * f;
    double exponent = of_bits(bits_of(round) + power) - round;
    exponent = exponent > 2048 ? exponent - 4096 : exponent; /* negative ones, in 12 bits */
    double sum = 1.0 / 17;
    sum = fma(z, sum, 1.0 / 15);
    sum = fma(z, sum, 1.0 / 13);
    sum = fma(z, sum, 1.0 / 11);
    sum = fma(z, sum, 1.0 / 9);
    sum = fma(z, sum, 1.0 / 7);
    sum = fma(z, sum, 1.0 / 5);
    sum = fma(z, sum, 1.0 / 3);
    return fma(2.8853900817779268, fma(f, z * sum, f), exponent);
}

/* 2^y for |y| < 1000, to some 1e-15: by the exponential series beyond the nearest integer. */
KMP_INLINE double exp2_of(double y)
{
    const double round = 6755399441055744.0;
    double t = y + round, x = (y - (t - round)) * 0.6931471805599453, sum = 1.0 / 6227020800;
    sum = fma(x, sum, 1.0 / 479001600);
    sum = fma(x, sum, 1.0 / 39916800);
    sum = fma(x, sum, 1.0 / 3628800);
    sum = fma(x, sum, 1.0 / 362880);
    sum = fma(x, sum, 1.0 / 40320);
    sum = fma(x, sum, 1.0 / 5040);
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
    for (size_t l = 0; l < w; l++) {
        double error = c->error[l] > 1e-300 ? c->error[l] : 1e-300;
        double before = KMP_RK_BETA * log2_of(c->error_old[l]);
        error = error < 1e300 ? error : 1e300;
        factor[l] = exp2_of(exponent * log2_of(error) - (c->error[l] <= 1 ? before : 0)) * (1 / KMP_RK_SAFETY);
    }
    for (size_t l = 0; l < w; l++) {
        double longest = c->error[l] <= 1 ? 1.0 / c->grow : 0;
        double shortest = c->error[l] <= 1 || !(c->error[l] <= DBL_MAX) ? c->shrink : KMP_RK_SHORTEST;
        double most = factor[l] < shortest ? factor[l] : shortest;
        next[l] = c->h[l] / (most > longest ? most : longest);
    }
    for (size_t l = 0; l < w; l++)
        c->next[l] = next[l];
}

KMP_FUSED_TWINS(next_steps_4, (double exponent, const kmp_lanes_control *c), (exponent, c), next_steps(4, exponent, c))
KMP_FUSED_TWINS(next_steps_8, (double exponent, const kmp_lanes_control *c), (exponent, c), next_steps(8, exponent, c))
KMP_FUSED_TWINS(next_steps_16, (double exponent, const kmp_lanes_control *c), (exponent, c),
                next_steps(16, exponent, c))
KMP_FUSED_TWINS(next_steps_any, (size_t w, double exponent, const kmp_lanes_control *c), (w, exponent, c),
                next_steps(w, exponent, c))

void kmp_lanes_next_steps(size_t width, const kmp_rk_method *method, const double *h, const double *error,
                          const double *error_old, double *next)
{
    const kmp_lanes_control control = {h, error, error_old, method->numbers.shrink, method->numbers.grow, next};
    if (width == 16)
        next_steps_16(method->numbers.exponent, &control);
    else if (width == 8)
        next_steps_8(method->numbers.exponent, &control);
    else if (width == 4)
        next_steps_4(method->numbers.exponent, &control);
    else
        next_steps_any(width, method->numbers.exponent, &control);
}

/* -- the right-hand side ----------------------------------------------------------------------------- */

KMP_INLINE void copy_times(size_t w, const double *restrict from, double factor, double *restrict to)
{
    for (size_t l = 0; l < w; l++)
        to[l] = from[l] * factor;
}

/* 0 times a number that is not finite is NaN, and stays so in a sum. */
KMP_INLINE void look_for_bad(size_t w, const double *restrict rate, const double *restrict pivot, double factor,
                             double *restrict bad)
{
    for (size_t l = 0; l < w; l++) {
        double good = pivot[l] * factor > 0 ? 0 : 1;
        bad[l] += good + 0 * rate[l];
    }
}

KMP_INLINE void publish(size_t w, const kmp_lanes_slopes *s)
{
    size_t p = s->p, slopes = p + s->r;
    const kmp_lanes_output *end = s->end;
    for (size_t i = 0; i < p; i++)
        copy_times(w, s->y + (p + i) * w, 1, s->k + i * w);
    for (size_t i = 0; i < slopes; i++)
        copy_times(w, end[i].value, end[i].factor, s->k + (p + i) * w);
    if (s->power)
        copy_times(w, end[slopes + p].value, end[slopes + p].factor, s->k + (p + slopes) * w);
    for (size_t i = 0; i < p; i++)
        look_for_bad(w, end[i].value, end[slopes + i].value, end[slopes + i].factor, s->bad);
}

KMP_CLONES static void publish_8(const kmp_lanes_slopes *slopes)
{
    publish(8, slopes);
}

KMP_CLONES static void publish_16(const kmp_lanes_slopes *slopes)
{
    publish(16, slopes);
}

void kmp_lanes_publish(size_t width, const kmp_lanes_slopes *slopes)
{
    if (width == 8)
        publish_8(slopes);
    else if (width == 16)
        publish_16(slopes);
    else
        publish(width, slopes);
}

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
    for (size_t l = 0; l < w; l++)
        e->residual[l] = e->correction[l] = e->growth[l] = 0;
    for (size_t i = 0; i < (size_t)e->m * w; i += w)
        for (size_t l = 0; l < w; l++)
            e->residual[l] = larger_of(e->residual[l], or_infinite(fabs(e->h[i + l]) * e->per_row_scale[i + l]));
    for (size_t l = 0; l < w; l++)
        e->least[l] = INFINITY;
    for (size_t i = 0; i < (size_t)e->pivots * w; i += w)
        for (size_t l = 0; l < w; l++)
            e->least[l] = fabs(e->pivot[i + l]) < e->least[l] ? fabs(e->pivot[i + l]) : e->least[l];
    for (int i = 0; i < e->r; i++) {
        const double *dv = e->dv + (size_t)i * w, *weight = e->weight + (size_t)i * w,
                     *scale = e->scale + (size_t)e->v[i] * w;
        for (size_t l = 0; l < w; l++) {
            double size = fabs(dv[l]), rounded = KMP_CORRECTION_ROUNDING * scale[l],
                   part = or_infinite(size / weight[l]);
            e->correction[l] = larger_of(e->correction[l], size <= rounded && size <= weight[l] ? 0 : part);
        }
    }
    for (int i = 0; i < e->r; i++)
        for (int c = 0; c < e->p; c++) {
            const double *b = e->b + (size_t)(c * e->r + i) * w, *u = e->scale + (size_t)e->u[c] * w,
                         *per_v = e->per_scale + (size_t)e->v[i] * w;
            for (size_t l = 0; l < w; l++)
                e->growth[l] = larger_of(e->growth[l], or_infinite(fabs(b[l]) * u[l] * per_v[l]));
        }
}

KMP_CLONES static void measure_8(const kmp_lanes_end *end)
{
    measure_closures(8, end);
}

KMP_CLONES static void measure_16(const kmp_lanes_end *end)
{
    measure_closures(16, end);
}

void kmp_lanes_measure(size_t width, const kmp_lanes_end *end)
{
    if (width == 8)
        measure_8(end);
    else if (width == 16)
        measure_16(end);
    else
        measure_closures(width, end);
}

KMP_INLINE void find_quiet(size_t w, const kmp_lanes_tests *e)
{
    uint64_t turned[KMP_LANES_MOST] = {0};
    double largest[KMP_LANES_MOST];
    int64_t quiet[KMP_LANES_MOST];
    for (int k = 0; k < e->sign_words; k++)
        for (size_t l = 0; l < w; l++)
            turned[l] |= e->negative[(size_t)k * w + l] ^ e->before[(size_t)k * w + l];
    for (size_t l = 0; l < w; l++)
        largest[l] = larger_of(e->pivot[l], e->least[l]);
    for (size_t l = 0; l < w; l++) {
        int64_t closed = (e->residual[l] < KMP_CLOSED) | (e->correction[l] <= e->most);
        int64_t regular = (e->pivot[l] > 0) & (e->least[l] > KMP_MARGIN_CALLS * largest[l]) & (turned[l] == 0);
        int64_t good = (e->error[l] <= 1) & (e->bad[l] == 0);
        quiet[l] = closed & regular & good & (e->t_new[l] < e->limit[l]) & (e->growth[l] <= e->exchange[l]);
    }
    for (size_t l = 0; l < w; l++)
        e->pivot[l] = quiet[l] ? largest[l] : e->pivot[l];
    for (size_t l = 0; l < w; l++)
        e->quiet[l] = quiet[l];
    for (size_t i = 0; i < e->r; i++) {
        double *v = e->v + i * w;
        const double *dv = e->dv + i * w;
        for (size_t l = 0; l < w; l++)
            v[l] = quiet[l] && !(e->residual[l] < KMP_CLOSED) ? v[l] + dv[l] : v[l];
    }
}

KMP_CLONES static void find_quiet_8(const kmp_lanes_tests *ends)
{
    find_quiet(8, ends);
}

KMP_CLONES static void find_quiet_16(const kmp_lanes_tests *ends)
{
    find_quiet(16, ends);
}

void kmp_lanes_find_quiet(size_t width, const kmp_lanes_tests *ends)
{
    if (width == 8)
        find_quiet_8(ends);
    else if (width == 16)
        find_quiet_16(ends);
    else
        find_quiet(width, ends);
}

KMP_INLINE void exchange(size_t w, size_t size, const int64_t *lanes, double *a, double *b)
{
    for (size_t i = 0; i < size * w; i += w) {
        double x[KMP_LANES_MOST], y[KMP_LANES_MOST];
        for (size_t l = 0; l < w; l++) {
            x[l] = lanes[l] ? b[i + l] : a[i + l];
            y[l] = lanes[l] ? a[i + l] : b[i + l];
        }
        for (size_t l = 0; l < w; l++)
            a[i + l] = x[l];
        for (size_t l = 0; l < w; l++)
            b[i + l] = y[l];
    }
}

KMP_CLONES static void exchange_8(size_t size, const int64_t *lanes, double *a, double *b)
{
    exchange(8, size, lanes, a, b);
}

KMP_CLONES static void exchange_16(size_t size, const int64_t *lanes, double *a, double *b)
{
    exchange(16, size, lanes, a, b);
}

void kmp_lanes_exchange(size_t width, size_t size, const int64_t *lanes, double *a, double *b)
{
    if (width == 8)
        exchange_8(size, lanes, a, b);
    else if (width == 16)
        exchange_16(size, lanes, a, b);
    else
        exchange(width, size, lanes, a, b);
}

KMP_INLINE void choose_tries(size_t w, const kmp_lanes_tries *s)
{
    double step[KMP_LANES_MOST], t_new[KMP_LANES_MOST];
    for (size_t l = 0; l < w; l++)
        step[l] = kmp_step_next(s->t[l], s->limit[l], s->h[l] < s->longest ? s->h[l] : s->longest, &t_new[l]);
    for (size_t l = 0; l < w; l++)
        s->t_new[l] = t_new[l];
    for (size_t l = 0; l < w; l++)
        s->step[l] = s->who[l] < 0 ? 0 : step[l];
}

KMP_CLONES static void choose_tries_8(const kmp_lanes_tries *tries)
{
    choose_tries(8, tries);
}

KMP_CLONES static void choose_tries_16(const kmp_lanes_tries *tries)
{
    choose_tries(16, tries);
}

void kmp_lanes_choose_tries(size_t width, const kmp_lanes_tries *tries)
{
    if (width == 8)
        choose_tries_8(tries);
    else if (width == 16)
        choose_tries_16(tries);
    else
        choose_tries(width, tries);
}

/* -- signs of pivots --------------------------------------------------------------------------------- */

KMP_INLINE void find_signs(size_t w, int pivots, const unsigned char *block, const double *pivot, uint64_t *negative)
{
    for (size_t l = 0; l < KMP_SIGN_WORDS * w; l++)
        negative[l] = 0;
    for (int k = 0; k < pivots; k++) {
        uint64_t bit = (uint64_t)1 << block[k] % 64, *word = negative + block[k] / 64 * w;
        for (size_t l = 0; l < w; l++)
            word[l] ^= pivot[(size_t)k * w + l] < 0 ? bit : 0;
    }
}

KMP_CLONES static void signs_8(int pivots, const unsigned char *block, const double *pivot, uint64_t *negative)
{
    find_signs(8, pivots, block, pivot, negative);
}

KMP_CLONES static void signs_16(int pivots, const unsigned char *block, const double *pivot, uint64_t *negative)
{
    find_signs(16, pivots, block, pivot, negative);
}

void kmp_lanes_signs(size_t width, int pivots, const unsigned char *block, const double *pivot, uint64_t *negative)
{
    if (width == 8)
        signs_8(pivots, block, pivot, negative);
    else if (width == 16)
        signs_16(pivots, block, pivot, negative);
    else
        find_signs(width, pivots, block, pivot, negative);
}
