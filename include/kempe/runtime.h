/* SPDX-License-Identifier: BSD-3-Clause */
/* Runtime of the code that Kempe generates. It is self-contained: C99 or C++11, no library but libm.
 *
 * Functions given by points. Sine and cosine together, within 1 ulp, the same bits from the scalar and the lane form
 * on every machine with IEEE doubles rounded to nearest. Compile with -ffp-contract=off and without -ffast-math:
 * contraction into fused operations would change the bits.
 *
 * |x| = n pi/2 + (r + y). The parts of pi/2 have 37, 37 and 53 bits, and n times the first two is exact for
 * n < 2^16. From Cody, Waite, Software Manual for the Elementary Functions, 1980. The remainder is kept as head r
 * and tail y (Knuth's error-free sum). Minimax polynomials on |r| <= pi/4 follow, with relative error 2^-57 and
 * absolute error 2^-59:
 *
 *     sin(r + y) = r + y (1 - r^2/2) + r^3 S(r^2)
 *     cos(r + y) = 1 - r^2/2 - r y + r^4 C(r^2)
 *
 * The lane form has one branch, at its end. The scalar form reduces x with its sign, which gives r and y theirs,
 * and skips the reduction where n is 0. Beyond the limit, and for infinities and NaN, libm answers in both forms. */
#ifndef KEMPE_RUNTIME_H
#define KEMPE_RUNTIME_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(__GNUC__)
#define KEMPE_RUNTIME_INLINE   static inline __attribute__((always_inline))
#define KEMPE_RUNTIME_UNUSED   __attribute__((unused))
#define KEMPE_RUNTIME_RESTRICT __restrict__
#else
#define KEMPE_RUNTIME_INLINE static inline
#define KEMPE_RUNTIME_UNUSED
#define KEMPE_RUNTIME_RESTRICT
#endif

/* n is below 2^16 up to this limit. */
#define KEMPE_SINCOS_LIMIT 1e5
/* The largest double below pi/4: up to it n is 0. */
#define KEMPE_SINCOS_SMALL 0.78539816339744828

KEMPE_RUNTIME_INLINE uint64_t kempe_bits_(double x)
{
    uint64_t b;
    memcpy(&b, &x, sizeof b);
    return b;
}

KEMPE_RUNTIME_INLINE double kempe_unbits_(uint64_t b)
{
    double x;
    memcpy(&x, &b, sizeof x);
    return x;
}

/* r + y = x - n pi/2 for |x| <= limit; returns n in the low bits, in two's complement. */
KEMPE_RUNTIME_INLINE uint64_t kempe_reduce_(double x, double *r, double *y)
{
    const double round = 6755399441055744.0; /* 1.5 2^52: adding it leaves an integer in the low bits */
    double t = x * 0.6366197723675814 + round, n = t - round;
    double a = x - n * 1.5707963267923333, w = n * 2.5633441515839558e-12; /* both products exact */
    double b = a - w, v = a - b;
    double tail = ((a - (b + v)) + (v - w)) - n * 1.0562999066987428e-23;
    *r = b + tail;
    *y = (b - *r) + tail;
    return kempe_bits_(t);
}

KEMPE_RUNTIME_INLINE double kempe_sine_(double r, double y, double z)
{
    double p = (0.008333333333322403 + z * (-0.00019841269829798703 + z * 2.7557313688616807e-06)) +
               z * (z * z) * (-2.505075757784455e-08 + z * 1.589676339107077e-10);
    double cube = z * r;
    return r - ((z * (0.5 * y - cube * p) - y) - cube * -0.16666666666666632);
}

KEMPE_RUNTIME_INLINE double kempe_cosine_(double r, double y, double z)
{
    double zz = z * z, half = 0.5 * z, head = 1.0 - half;
    double p = z * (0.0416666666666666 + z * (-0.001388888888887411 + z * 2.4801587289472582e-05)) +
               zz * zz * (-2.755731434942884e-07 + z * (2.0875722862049195e-09 + z * -1.1359625713513941e-11));
    return head + (((1.0 - head) - half) + (z * p - r * y));
}

/* Puts the sine and cosine of r + y into the quadrant q of x: odd ones exchange the two. */
KEMPE_RUNTIME_INLINE void kempe_place_(double x, uint64_t q, double sine, double cosine, double *s, double *c)
{
    uint64_t sign = kempe_bits_(x) & ((uint64_t)1 << 63), a = kempe_bits_(sine), b = kempe_bits_(cosine);
    uint64_t swap = (a ^ b) & (0 - (q & 1));
    *s = kempe_unbits_((a ^ swap) ^ ((q & 2) << 62) ^ sign);
    *c = kempe_unbits_((b ^ swap) ^ (((q + 1) & 2) << 62));
}

/* Sine and cosine in the lane form: without a branch. */
KEMPE_RUNTIME_INLINE void kempe_sincos_core_(double x, double *s, double *c)
{
    double r, y;
    uint64_t q = kempe_reduce_(kempe_unbits_(kempe_bits_(x) & ~((uint64_t)1 << 63)), &r, &y);
    kempe_place_(x, q, kempe_sine_(r, y, r * r), kempe_cosine_(r, y, r * r), s, c);
}

KEMPE_RUNTIME_INLINE void kempe_sincos8_core_(const double *KEMPE_RUNTIME_RESTRICT x, double *KEMPE_RUNTIME_RESTRICT s,
                                              double *KEMPE_RUNTIME_RESTRICT c)
{
    int beyond = 0;
    for (int i = 0; i < 8; i++)
        kempe_sincos_core_(x[i], &s[i], &c[i]);
    for (int i = 0; i < 8; i++)
        beyond |= !(fabs(x[i]) <= KEMPE_SINCOS_LIMIT);
    for (int i = 0; beyond && i < 8; i++)
        if (!(fabs(x[i]) <= KEMPE_SINCOS_LIMIT)) {
            s[i] = sin(x[i]);
            c[i] = cos(x[i]);
        }
}

/* -- functions given by points -------------------------------------------------------------------------- */

KEMPE_RUNTIME_UNUSED static inline double kempe_piece_(const double c[4], int derivative, double s)
{
    switch (derivative) {
    case 0:
        return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    case 1:
        return c[1] + s * (2 * c[2] + s * (3 * c[3]));
    case 2:
        return 2 * c[2] + s * (6 * c[3]);
    case 3:
        return 6 * c[3];
    default:
        return 0;
    }
}

/* The last knot, except the end knot, that is not to the right of `at`. By halves without a branch, which no processor
 * would predict. */
KEMPE_RUNTIME_UNUSED static inline int kempe_find_piece_(int count, const double *x, double at)
{
    int low = 0;
    for (int pieces = count - 1, half; pieces > 1; pieces -= half) {
        half = pieces / 2;
        low += x[low + half] <= at ? half : 0;
    }
    return low;
}

/** Value (derivative 0) or derivative of a function through the points (x, y), increasing, with four coefficients for
 * each piece, in powers of the distance to its left point. Extrapolated linearly beyond the ends. NaN for NaN. */
KEMPE_RUNTIME_UNUSED static inline double kempe_interpolate(int count, const double *x, const double *y,
                                                            const double (*piece)[4], int derivative, double at)
{
    int last = count - 2, k;
    double slope;
    if (isnan(at))
        return at;
    if (at < x[0]) {
        slope = piece[0][1];
        return derivative == 0 ? y[0] + slope * (at - x[0]) : derivative == 1 ? slope : 0;
    }
    if (at > x[last + 1]) {
        slope = kempe_piece_(piece[last], 1, x[last + 1] - x[last]);
        return derivative == 0 ? y[last + 1] + slope * (at - x[last + 1]) : derivative == 1 ? slope : 0;
    }
    k = kempe_find_piece_(count, x, at);
    return kempe_piece_(piece[k], derivative, at - x[k]);
}

/* -- sine and cosine ------------------------------------------------------------------------------------ */

/** *s = sin x, *c = cos x. */
KEMPE_RUNTIME_UNUSED static inline void kempe_sincos(double x, double *s, double *c)
{
    if (fabs(x) <= KEMPE_SINCOS_SMALL) {
        *s = kempe_sine_(x, 0.0, x * x);
        *c = kempe_cosine_(x, 0.0, x * x);
    } else if (fabs(x) <= KEMPE_SINCOS_LIMIT) {
        double r, y;
        uint64_t n = kempe_reduce_(x, &r, &y);
        double sine = kempe_sine_(r, y, r * r), cosine = kempe_cosine_(r, y, r * r);
        double a = n & 1 ? cosine : sine, b = n & 1 ? sine : cosine; /* odd quadrants exchange the two */
        *s = n & 2 ? -a : a;
        *c = (n + 1) & 2 ? -b : b;
    } else {
        *s = sin(x);
        *c = cos(x);
    }
}

/** s[i] = sin x[i], c[i] = cos x[i], the bits of kempe_sincos; the three arrays do not overlap. */
KEMPE_RUNTIME_UNUSED static inline void kempe_sincos8(const double x[8], double s[8], double c[8])
{
    kempe_sincos8_core_(x, s, c);
}

#endif
