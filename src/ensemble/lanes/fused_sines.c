/* SPDX-License-Identifier: BSD-3-Clause */
/* x = n pi/2 + r with pi/2 in three doubles. The difference of x and n times the first is exact: it is a multiple
 * of the last place of one of them, and below 1. (Muller et al., Handbook of Floating-Point Arithmetic, 2018, 10.2.) r
 * has the rounding of its last digit, and no tail. The polynomials are taken from <kempe/runtime.h>, in the order of
 * Estrin. The results are within 1.5 ulp. All are the same for any width and on any machine. */
#include "ensemble/lanes/fused_sines.h"
#include "backend/sincos.h"
#include "base/clones.h"
#include <kempe/runtime.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

enum { WIDEST = KMP_LANES_MOST };

/* Adding it leaves an integer in the low bits: 1.5 2^52. */
static const double WHOLE = 6755399441055744.0;

/* r = x - n pi/2; n is in the low bits of the result. */
static KMP_INTO_CLONES uint64_t reduce(double x, double *r)
{
    double t = fma(x, 0.6366197723675814, WHOLE), n = t - WHOLE;
    *r = fma(-n, -1.4973849048591698e-33, fma(-n, 6.123233995736766e-17, fma(-n, 1.5707963267948966, x)));
    return kempe_bits_(t);
}

static KMP_INTO_CLONES double sine(double r, double z, double zz)
{
    double first = fma(z, 0.008333333333322403, -0.16666666666666632);
    double second = fma(z, 2.7557313688616807e-06, -0.00019841269829798703);
    double third = fma(z, 1.589676339107077e-10, -2.505075757784455e-08);
    return fma(z * r, fma(zz, fma(zz, third, second), first), r);
}

static KMP_INTO_CLONES double cosine(double z, double zz)
{
    double first = fma(z, -0.001388888888887411, 0.0416666666666666);
    double second = fma(z, -2.755731434942884e-07, 2.4801587289472582e-05);
    double third = fma(z, -1.1359625713513941e-11, 2.0875722862049195e-09);
    return fma(z, fma(z, fma(zz, fma(zz, third, second), first), -0.5), 1.0);
}

/* Puts the sine and cosine of r into the quadrant q: odd ones exchange the two. */
static KMP_INTO_CLONES void place(uint64_t q, double sine, double cosine, double *s, double *c)
{
    uint64_t a = kempe_bits_(sine), b = kempe_bits_(cosine), swap = (a ^ b) & (0 - (q & 1));
    *s = kempe_unbits_((a ^ swap) ^ ((q & 2) << 62));
    *c = kempe_unbits_((b ^ swap) ^ (((q + 1) & 2) << 62));
}

/* Each part for all lanes before the next part: the chains of two registers overlap. Numbers |x| beyond the limit and
 * NaN make beyond[l] negative. */
static KMP_INTO_CLONES void angle(size_t w, const double *restrict x, double *restrict s, double *restrict c,
                                  int64_t *restrict beyond)
{
    double r[WIDEST], z[WIDEST], zz[WIDEST], a[WIDEST], b[WIDEST];
    uint64_t quadrant[WIDEST];
    for (size_t l = 0; l < w; l++)
        beyond[l] |= KMP_SINCOS_LIMIT_BITS - (int64_t)kempe_bits_(fabs(x[l]));
    for (size_t l = 0; l < w; l++)
        quadrant[l] = reduce(x[l], &r[l]);
    for (size_t l = 0; l < w; l++)
        z[l] = r[l] * r[l];
    for (size_t l = 0; l < w; l++)
        zz[l] = z[l] * z[l];
    for (size_t l = 0; l < w; l++)
        a[l] = sine(r[l], z[l], zz[l]);
    for (size_t l = 0; l < w; l++)
        b[l] = cosine(z[l], zz[l]);
    for (size_t l = 0; l < w; l++)
        place(quadrant[l], a[l], b[l], &s[l], &c[l]);
}

/* The angles of a call: their lanes, and their slots. */
typedef struct call {
    size_t w;
    int n;
    double *v;
    const uint32_t *x, *s, *c;
} call;

/* The limit is tested once for all angles: their computations then overlap. *any is negative if an argument is beyond
 * it. */
static KMP_INTO_CLONES void angles(size_t w, const call *all, int64_t *any)
{
    int64_t beyond[WIDEST] = {0};
    for (int k = 0; k < all->n; k++)
        angle(w, all->v + w * all->x[k], all->v + w * all->s[k], all->v + w * all->c[k], beyond);
    for (size_t l = 0; l < w; l++)
        *any |= beyond[l];
}

KMP_LANES_TWINS(fused, angles, (size_t width, const call *all, int64_t *any), all, any)

void kmp_fused_sincos(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    int64_t any = 0;
    KMP_TWIN(fused)((size_t)width, &(call){(size_t)width, n, v, x, s, c}, &any);
    if (any < 0)
        kmp_sincos_beyond(n, width, v, x, s, c);
}

/* -- by rotation ------------------------------------------------------------------------------------- */

/* The largest sum of the squares of all differences of a lane. */
static const double NEAR = KMP_FUSED_NEAR * KMP_FUSED_NEAR;

/* sin(x0 + d) = sin x0 + (sin x0 (cos d - 1) + cos x0 sin d). The polynomials in d^2 of (sin d / d - 1) / d^2 and
 * (cos d - 1) / d^2 interpolate at Chebyshev's points of |d| < 3/8; the errors of sin d and cos d are below 2^-54. */
static KMP_INTO_CLONES void turn(size_t w, const double *restrict x, const double *restrict base, double *restrict s,
                                 double *restrict c, double *restrict away)
{
    for (size_t l = 0; l < w; l++) {
        double d = x[l] - base[l], s0 = base[w + l], c0 = base[2 * w + l], z = d * d;
        double p = fma(z, -2.499571220213754e-08, 2.7557249854310547e-06);
        double q = fma(z, -2.7484016455684523e-07, 2.480149714091543e-05);
        p = fma(z, fma(z, fma(z, p, -0.00019841269806435577), 0.008333333333327211), -0.16666666666666666);
        q = z * fma(z, fma(z, fma(z, q, -0.0013888888843615426), 0.04166666666658709), -0.4999999999999998);
        p = fma(d * z, p, d);
        s[l] = fma(c0, p, fma(s0, q, s0));
        c[l] = fma(-s0, p, fma(c0, q, c0));
        away[l] += z;
    }
}

static KMP_INTO_CLONES void turn_all(size_t w, const call *all, const double *base, double *away, int64_t *far)
{
    double sum[WIDEST] = {0};
    int64_t any = 0;
    for (int k = 0; k < all->n; k++)
        turn(w, all->v + w * all->x[k], base + 3 * w * (size_t)k, all->v + w * all->s[k], all->v + w * all->c[k], sum);
    for (size_t l = 0; l < w; l++)
        away[l] = sum[l];
    for (size_t l = 0; l < w; l++)
        any |= !(sum[l] <= NEAR);
    *far = any;
}

KMP_LANES_TWINS(turn, turn_all, (size_t width, const call *all, const double *base, double *away, int64_t *far), all,
                base, away, far)

/* Lanes that are far from the base. */
static void put_far(const call *all, const double *away)
{
    size_t w = all->w;
    for (size_t k = 0; k < (size_t)all->n; k++) {
        double v[3 * WIDEST];
        memcpy(v, all->v + w * all->x[k], w * sizeof *v);
        kmp_fused_sincos(1, (int)w, v, &(uint32_t){0}, &(uint32_t){1}, &(uint32_t){2});
        for (size_t l = 0; l < w; l++)
            if (!(away[l] <= NEAR)) {
                all->v[w * all->s[k] + l] = v[w + l];
                all->v[w * all->c[k] + l] = v[2 * w + l];
            }
    }
}

void kmp_fused_near(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                    const double *base)
{
    const call all = {(size_t)width, n, v, x, s, c};
    double away[WIDEST];
    int64_t far;
    KMP_TWIN(turn)(all.w, &all, base, away, &far);
    if (far)
        put_far(&all, away);
}

static KMP_INTO_CLONES void keep(size_t w, const call *all, const int64_t *lanes, double *base)
{
    for (int k = 0; k < all->n; k++) {
        const double *from[] = {all->v + w * all->x[k], all->v + w * all->s[k], all->v + w * all->c[k]};
        for (int j = 0; j < 3; j++, base += w) {
            double kept[WIDEST];
            for (size_t l = 0; l < w; l++) {
                double now = from[j][l], before = base[l];
                kept[l] = lanes[l] ? now : before;
            }
            for (size_t l = 0; l < w; l++)
                base[l] = kept[l];
        }
    }
}

KMP_LANES_TWINS(keep, keep, (size_t width, const call *all, const int64_t *lanes, double *base), all, lanes, base)

void kmp_fused_keep(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                    const int64_t *lanes, double *base)
{
    KMP_TWIN(keep)((size_t)width, &(call){(size_t)width, n, v, x, s, c}, lanes, base);
}

/* -- in lanes ---------------------------------------------------------------------------------------- */

static void find(void *user, int first, int n, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    const kmp_fused_sines *sines = user;
    double *base = sines->base + 3 * (ptrdiff_t)first * sines->width;
    if (sines->way == KMP_SINES_NEAR) {
        kmp_fused_near(n, sines->width, v, x, s, c, base);
        return;
    }
    kmp_fused_sincos(n, sines->width, v, x, s, c);
    if (sines->way == KMP_SINES_RENEW)
        kmp_fused_keep(n, sines->width, v, x, s, c, sines->renewed, base);
}

bool kmp_fused_sines_init(kmp_fused_sines *sines, kmp_lanes *lanes, int width)
{
    const size_t size = 3 * (size_t)kmp_lanes_angles(lanes);
    *sines = (kmp_fused_sines){.width = width, .size = size};
    sines->base = kmp_arena_aligned(&sines->arena, size * (size_t)width);
    kmp_lanes_set_sincos(lanes, find, sines);
    return !sines->arena.failed;
}

void kmp_fused_sines_take(kmp_fused_sines *sines, kmp_sines_way way, const int64_t *renewed)
{
    sines->way = way;
    sines->renewed = renewed;
}

void kmp_fused_sines_get(const kmp_fused_sines *sines, int lane, double *base)
{
    for (size_t k = 0; k < sines->size; k++)
        base[k] = sines->base[k * (size_t)sines->width + (size_t)lane];
}

void kmp_fused_sines_put(kmp_fused_sines *sines, int lane, const double *base)
{
    for (size_t k = 0; k < sines->size; k++)
        sines->base[k * (size_t)sines->width + (size_t)lane] = base[k];
}
