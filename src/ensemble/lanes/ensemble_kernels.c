/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/lanes/ensemble_kernels.h"
#include "base/clones.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "integrators/decide/closing.h"
#include "integrators/steppers/dop853.h"
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
#define TERMS(count)                                                                                                   \
    case count:                                                                                                        \
        combine_terms(w, size, count, s);                                                                              \
        break

KMP_INLINE void combine_lanes(size_t w, size_t size, const kmp_lanes_sum *s)
{
    switch (s->terms) {
        TERMS(1);
        TERMS(2);
        TERMS(3);
        TERMS(4);
        TERMS(5);
        TERMS(6);
        TERMS(7);
        TERMS(8);
        TERMS(9);
    default:
        combine_terms(w, size, s->terms, s);
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

/* kmp_step_after of the error, but for rounding of its powers. */
KMP_INLINE void next_steps(size_t w, kmp_lane_state *room)
{
    const kmp_rk_numbers *method = &kmp_dop853.numbers;
    double factor[KMP_LANES_MOST], next[KMP_LANES_MOST];
    EACH_LANE(l, w)
    {
        double error = room->error[l] > 1e-300 ? room->error[l] : 1e-300;
        double before = KMP_RK_BETA * log2_of(room->error_old[l]);
        error = error < 1e300 ? error : 1e300;
        factor[l] = exp2_of(method->exponent * log2_of(error) - (kmp_step_passes(room->error[l], false) ? before : 0)) *
                    (1 / KMP_RK_SAFETY);
    }
    EACH_LANE(l, w)
    next[l] = room->step[l] / kmp_step_ratio(method, kmp_step_passes(room->error[l], false), room->error[l], factor[l]);
    EACH_LANE(l, w)
    room->next[l] = next[l];
}

KMP_LANES_KERNEL(kmp_lanes_next_steps, next_steps, (size_t width, kmp_lane_state *room), (width, room), room)

/* -- the right-hand side ----------------------------------------------------------------------------- */

KMP_INLINE void copy_times(size_t w, const double *restrict from, double factor, double *restrict to)
{
    EACH_LANE(l, w)
    to[l] = from[l] * factor;
}

/* 0 times a number that is not finite is NaN, and stays so in a sum. */
KMP_INLINE void publish(size_t w, kmp_engine *e, const kmp_lane_group *pool, const double *y, double *k)
{
    const size_t p = (size_t)e->p, slopes = p + (size_t)e->r;
    const kmp_lanes_output *end = pool->output;
    double bad[KMP_LANES_MOST];
    int64_t good[KMP_LANES_MOST];
    for (size_t i = 0; i < p; i++)
        copy_times(w, y + (p + i) * w, 1, k + i * w);
    for (size_t i = 0; i < slopes; i++)
        copy_times(w, end[i].value, end[i].factor, k + (p + i) * w);
    if (e->s->dissipative)
        copy_times(w, end[slopes + p].value, end[slopes + p].factor, k + (p + slopes) * w);
    EACH_LANE(l, w)
    {
        bad[l] = e->room.bad[l];
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
    e->room.bad[l] = good[l] ? bad[l] : NAN;
}

KMP_LANES_KERNEL(kmp_lanes_publish, publish,
                 (size_t width, kmp_engine *e, const kmp_lane_group *pool, const double *y, double *k),
                 (width, e, pool, y, k), e, pool, y, k)

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

KMP_INLINE void measure_closures(size_t w, const kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x)
{
    const kmp_lane_state *room = &e->room;
    const double *weights = room->weight + (size_t)(2 * e->p) * w; /* of v */
    double residual[KMP_LANES_MOST] = {0}, correction[KMP_LANES_MOST] = {0}, growth[KMP_LANES_MOST] = {0};
    double least[KMP_LANES_MOST];
    for (size_t i = 0; i < (size_t)e->m * w; i += w)
        EACH_LANE(l, w)
    residual[l] = larger_of(residual[l], or_infinite(fabs(x->h[i + l]) * room->per_row_scale[i + l]));
    EACH_LANE(l, w)
    least[l] = INFINITY;
    for (size_t i = 0; i < (size_t)pool->layout.pivots * w; i += w)
        EACH_LANE(l, w)
        {
            double size = fabs(x->pivot[i + l]);
            least[l] = size < least[l] ? size : least[l];
        }
    for (int i = 0; i < e->r; i++) {
        const double *dv = x->dv + (size_t)i * w, *weight = weights + (size_t)i * w,
                     *scale = room->scale + (size_t)pool->part.v[i] * w;
        EACH_LANE(l, w)
        {
            double size = kmp_correction_size(dv[l], weight[l], scale[l]);
            correction[l] = larger_of(correction[l], size);
        }
    }
    for (int i = 0; i < e->r; i++)
        for (int c = 0; c < e->p; c++) {
            const double *b = x->b + (size_t)(c * e->r + i) * w, *u = room->scale + (size_t)pool->part.u[c] * w,
                         *per_v = room->per_scale + (size_t)pool->part.v[i] * w;
            EACH_LANE(l, w)
            growth[l] = larger_of(growth[l], or_infinite(fabs(b[l]) * u[l] * per_v[l]));
        }
    EACH_LANE(l, w)
    {
        x->residual[l] = residual[l];
        x->correction[l] = correction[l];
        x->growth[l] = growth[l];
        x->least[l] = least[l];
    }
}

KMP_LANES_KERNEL(kmp_lanes_measure, measure_closures,
                 (size_t width, const kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x),
                 (width, e, pool, x), e, pool, x)

KMP_INLINE void find_quiet(size_t w, kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x)
{
    kmp_lane_state *room = &e->room;
    uint64_t turned[KMP_LANES_MOST] = {0};
    double largest[KMP_LANES_MOST];
    int64_t quiet[KMP_LANES_MOST];
    for (int k = 0; k < (pool->layout.pivots + 63) / 64; k++)
        EACH_LANE(l, w)
    turned[l] |= x->negative[(size_t)k * w + l] ^ room->negative[(size_t)k * w + l];
    EACH_LANE(l, w)
    largest[l] = larger_of(room->pivot[l], x->least[l]);
    EACH_LANE(l, w)
    {
        int64_t closed = (x->residual[l] < KMP_CLOSED) | (x->correction[l] <= KMP_CORRECTION_LIMIT);
        int64_t regular = (room->pivot[l] > 0) & (x->least[l] > KMP_MARGIN_CALLS * largest[l]) & (turned[l] == 0);
        int64_t good = kmp_step_passes(room->error[l], false) & (room->bad[l] == 0);
        quiet[l] = closed & regular & good & (room->t_new[l] < room->limit[l]) & (x->growth[l] <= room->exchange[l]);
    }
    EACH_LANE(l, w)
    room->pivot[l] = quiet[l] ? largest[l] : room->pivot[l];
    EACH_LANE(l, w)
    x->quiet[l] = quiet[l];
    for (size_t i = 0; i < (size_t)e->r; i++) {
        double *v = room->y_new + ((size_t)(2 * e->p) + i) * w;
        const double *dv = x->dv + i * w;
        EACH_LANE(l, w)
        v[l] = quiet[l] && !(x->residual[l] < KMP_CLOSED) ? v[l] + dv[l] : v[l];
    }
}

KMP_LANES_KERNEL(kmp_lanes_find_quiet, find_quiet,
                 (size_t width, kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x), (width, e, pool, x), e,
                 pool, x)

/* All numbers are read before any is stored. */
KMP_INLINE void pass_on(size_t w, kmp_lane_state *room, const int64_t *quiet, kmp_lane_attempts *e)
{
    int64_t on[KMP_LANES_MOST], stays[KMP_LANES_MOST], made[KMP_LANES_MOST], repeated[KMP_LANES_MOST];
    int64_t rejected[KMP_LANES_MOST], tries[KMP_LANES_MOST], all = 1, any = 0;
    double t[KMP_LANES_MOST], h[KMP_LANES_MOST], error[KMP_LANES_MOST];
    EACH_LANE(l, w)
    {
        int64_t spare = room->made[l] + room->repeated[l] < room->spare[l];
        int64_t lasts = !kmp_step_is_hopeless(room->step[l], room->t_new[l]);
        int64_t again =
            !kmp_step_passes(room->error[l], false) & (e->failed[l] == 0) & (room->tries[l] < KMP_STEP_ATTEMPTS - 1);
        stays[l] = again & spare;
        on[l] = (quiet[l] & lasts & spare) | stays[l];
    }
    EACH_LANE(l, w)
    {
        int64_t through = on[l] & ~stays[l];
        double next = kmp_step_after_failures(room->next[l], room->step[l], through & room->rejected[l]);
        t[l] = through ? room->t_new[l] : room->t[l];
        h[l] = on[l] ? next : room->h[l];
        error[l] = through ? kmp_step_known_error(room->error[l]) : room->error_old[l];
        made[l] = room->made[l] + through;
        repeated[l] = room->repeated[l] + stays[l];
        tries[l] = through ? 0 : room->tries[l] + stays[l];
        rejected[l] = through ? 0 : room->rejected[l] | stays[l];
    }
    EACH_LANE(l, w)
    {
        room->t[l] = t[l];
        room->h[l] = h[l];
        room->error_old[l] = error[l];
    }
    EACH_LANE(l, w)
    {
        room->made[l] = made[l];
        room->repeated[l] = repeated[l];
        room->tries[l] = tries[l];
        room->rejected[l] = rejected[l];
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

KMP_LANES_KERNEL(kmp_lanes_pass_on, pass_on,
                 (size_t width, kmp_lane_state *room, const int64_t *quiet, kmp_lane_attempts *ends),
                 (width, room, quiet, ends), room, quiet, ends)

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

KMP_INLINE void choose_tries(size_t w, kmp_lane_state *room, int64_t *none)
{
    double step[KMP_LANES_MOST], t_new[KMP_LANES_MOST];
    EACH_LANE(l, w)
    step[l] = kmp_step_next(room->t[l], room->limit[l], room->h[l] < room->longest[l] ? room->h[l] : room->longest[l],
                            &t_new[l]);
    EACH_LANE(l, w)
    room->t_new[l] = t_new[l];
    *none = 0;
    EACH_LANE(l, w)
    {
        *none |= (room->who[l] >= 0) & (step[l] == 0);
        room->step[l] = room->who[l] < 0 ? 0 : step[l];
    }
}

KMP_LANES_KERNEL(kmp_lanes_choose_tries, choose_tries, (size_t width, kmp_lane_state *room, int64_t *none),
                 (width, room, none), room, none)

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
