/* SPDX-License-Identifier: BSD-3-Clause */
/* One clone of the lane loop for each width of vectors, with the same bits from each. */
#include "backend/sincos.h"
#include "base/clones.h"
#include <kempe/runtime.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

typedef double eight __attribute__((vector_size(64)));

/* The arguments are combined in registers: a wide load of values that were just stored one by one would have to wait.
 */
KMP_CLONES static void slots_of_8(const uint32_t *angle, const double *v, double *out)
{
    eight all = {v[angle[0]], v[angle[1]], v[angle[2]], v[angle[3]],
                 v[angle[4]], v[angle[5]], v[angle[6]], v[angle[7]]};
    double x[8];
    memcpy(x, &all, sizeof x);
    kempe_sincos8_core_(x, out, out + 8);
}

void kmp_sincos_slots(uint32_t n, const uint32_t *angle, const double *v, double *out)
{
    uint32_t i = 0;
    for (; i + 2 < n; i += 8, out += 16)
        slots_of_8(angle + i, v, out);
    for (; i < n; i++, out++)
        kempe_sincos(v[angle[i]], &out[0], &out[8]);
}

/* -- lanes ----------------------------------------------------------------------------------------------- */

/* Sines and cosines of lanes: with the bits of kempe_sincos, by fused multiply-adds, with half the operations, or by
 * rotation from angles nearby, with fewer still.
 *
 * x = n pi/2 + r with pi/2 in three doubles. The difference of x and n times the first is exact: it is a multiple
 * of the last place of one of them, and below 1. (Muller et al., Handbook of Floating-Point Arithmetic, 2018, 10.2.) r
 * has the rounding of its last digit, and no tail. The polynomials are those of <kempe/runtime.h>, in the order of
 * Estrin. The fused results are within 1.5 ulp. All are the same for any width and on any machine. */

enum { WIDEST = 16 };

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

static KMP_INTO_CLONES uint64_t reduce_either(bool fused, double x, double *r, double *y)
{
    *y = 0;
    return fused ? reduce(x, r) : kempe_reduce_(fabs(x), r, y);
}

/* Each part for all lanes before the next part: the chains of two registers overlap. Numbers |x| beyond the limit and
 * NaN make beyond[l] negative. */
static KMP_INTO_CLONES void angle(size_t w, bool fused, const double *restrict x, double *restrict s,
                                  double *restrict c, int64_t *restrict beyond)
{
    const int64_t limit = 0x40f86a0000000000; /* KEMPE_SINCOS_LIMIT */
    double r[WIDEST], y[WIDEST], z[WIDEST], zz[WIDEST], a[WIDEST], b[WIDEST];
    uint64_t quadrant[WIDEST];
    for (size_t l = 0; l < w; l++)
        beyond[l] |= limit - (int64_t)kempe_bits_(fabs(x[l]));
    for (size_t l = 0; l < w; l++)
        quadrant[l] = reduce_either(fused, x[l], &r[l], &y[l]);
    for (size_t l = 0; l < w; l++)
        z[l] = r[l] * r[l];
    for (size_t l = 0; l < w && fused; l++)
        zz[l] = z[l] * z[l];
    for (size_t l = 0; l < w; l++)
        a[l] = fused ? sine(r[l], z[l], zz[l]) : kempe_sine_(r[l], y[l], z[l]);
    for (size_t l = 0; l < w; l++)
        b[l] = fused ? cosine(z[l], zz[l]) : kempe_cosine_(r[l], y[l], z[l]);
    for (size_t l = 0; l < w && fused; l++)
        place(quadrant[l], a[l], b[l], &s[l], &c[l]);
    for (size_t l = 0; l < w && !fused; l++)
        kempe_place_(x[l], quadrant[l], a[l], b[l], &s[l], &c[l]);
}

/* The angles of a call: their lanes, and their slots. */
typedef struct call {
    size_t w;
    int n;
    double *v;
    const uint32_t *x, *s, *c;
} call;

/* The limit is tested once for all angles: their computations then overlap. */
static KMP_INTO_CLONES bool angles(size_t w, bool fused, const call *all)
{
    int64_t beyond[WIDEST] = {0}, any = 0;
    for (int k = 0; k < all->n; k++)
        angle(w, fused, all->v + w * all->x[k], all->v + w * all->s[k], all->v + w * all->c[k], beyond);
    for (size_t l = 0; l < w; l++)
        any |= beyond[l];
    return any >= 0;
}

#define OF_ANY_WIDTH(name, target, fused)                                                                              \
    target static bool name(const call *all)                                                                           \
    {                                                                                                                  \
        return all->w == 16  ? angles(16, fused, all)                                                                  \
               : all->w == 8 ? angles(8, fused, all)                                                                   \
               : all->w == 4 ? angles(4, fused, all)                                                                   \
                             : angles(all->w, fused, all);                                                             \
    }

OF_ANY_WIDTH(with_eights, KMP_REDUCED_PROGRAM_EIGHTS, false)
OF_ANY_WIDTH(with_fours, KMP_REDUCED_PROGRAM_FOURS, false)
OF_ANY_WIDTH(without, , false)
OF_ANY_WIDTH(fused_with_eights, KMP_REDUCED_PROGRAM_EIGHTS, true)
OF_ANY_WIDTH(fused_with_fours, KMP_REDUCED_PROGRAM_FOURS, true)
OF_ANY_WIDTH(fused_without, , true)

static bool run(bool fused, const call *all)
{
    if (fused)
        return (kmp_has_eight() ? fused_with_eights : kmp_has_four() ? fused_with_fours : fused_without)(all);
    return (kmp_has_eight() ? with_eights : kmp_has_four() ? with_fours : without)(all);
}

void kmp_sincos_lanes(bool fused, int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    size_t w = (size_t)width;
    bool within = run(fused, &(call){w, n, v, x, s, c});
    for (int k = 0; k < n && !within; k++)
        for (size_t l = 0; l < w; l++) {
            double at = v[w * x[k] + l];
            if (!(fabs(at) <= KEMPE_SINCOS_LIMIT)) {
                v[w * s[k] + l] = sin(at);
                v[w * c[k] + l] = cos(at);
            }
        }
}

/* -- by rotation ------------------------------------------------------------------------------------- */

/* The largest sum of the squares of all differences of a lane. */
static const double NEAR = KMP_SINCOS_NEAR * KMP_SINCOS_NEAR;

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
        kmp_sincos_lanes(true, 1, (int)w, v, &(uint32_t){0}, &(uint32_t){1}, &(uint32_t){2});
        for (size_t l = 0; l < w; l++)
            if (!(away[l] <= NEAR)) {
                all->v[w * all->s[k] + l] = v[w + l];
                all->v[w * all->c[k] + l] = v[2 * w + l];
            }
    }
}

void kmp_sincos_near(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
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

void kmp_sincos_keep(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                     const int64_t *lanes, double *base)
{
    KMP_TWIN(keep)((size_t)width, &(call){(size_t)width, n, v, x, s, c}, lanes, base);
}
