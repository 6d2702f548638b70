/* SPDX-License-Identifier: BSD-3-Clause */
#include "derivatives/delayed_motion.h"
#include "base/context.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include <complex.h>
#include <math.h>

enum { MOST_STEPS = 200000, MOST_DOUBLINGS = 200 };

static const double two_pi = 6.283185307179586476925286766559;

double kmp_delay_of(const kmp_linear *linear, int k)
{
    const kmp_state *state = kmp_state_of(linear->system->model, linear->part.u[k]);
    return state ? state->delay.value : 0;
}

typedef struct characteristic {
    const kmp_linear *linear;
    double *re, *im; /* p x p */
    int *pivot;
    int order;      /* of the determinant in s */
    double longest; /* the sum of the delays */
} characteristic;

/* An entry at s = i w, the row of a delay times e^(-s T); of the leading part in s where `leads`, over its power. */
static double complex entry(const characteristic *c, double w, int row, int column, bool leads)
{
    const kmp_linear *l = c->linear;
    const int e = row + column * l->p;
    const double m = l->mass[e], g = l->damping[e], k = l->stiffness[e], T = kmp_delay_of(l, column);
    const double late = kmp_delay_of(l, row);
    const bool is_state = kmp_state_of(l->system->model, l->part.u[column]);
    if (leads)
        return late > 0 || T > 0 ? (row == column ? m / T : 0) : m;
    double complex x = is_state ? g + I * w * m : k - w * w * m + I * w * g;
    if (late > 0 && row == column)
        return m / T + (g - m / T) * cexp(-I * w * T);
    return late > 0 ? x * cexp(-I * w * late) : x;
}

/* The logarithm of the determinant: of its modulus, and the argument up to turns. */
static double complex log_determinant(const characteristic *c, double w, bool leads)
{
    const int p = c->linear->p;
    double complex sum = 0;
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++) {
            double complex x = entry(c, w, i, k, leads);
            c->re[i + k * p] = creal(x);
            c->im[i + k * p] = cimag(x);
        }
    if (kmp_lu_complex_factor(p, c->re, c->im, c->pivot) != 0)
        return -INFINITY;
    for (int k = 0; k < p; k++) { /* pivots are kept as reciprocals */
        sum -= clog(c->re[k + k * p] + I * c->im[k + k * p]);
        sum += c->pivot[k] != k ? I * two_pi / 2 : 0;
    }
    return sum;
}

static double wrapped(double angle)
{
    return remainder(angle, two_pi);
}

/* The least power of two from `w` on beyond which the determinant is near its leading term, and the argument by which
 * it differs there; 0: none. */
static double far_end(const characteristic *c, double w, double *rest)
{
    double complex lead = log_determinant(c, 0, true);
    double found = 0;
    int near = 0;
    for (int k = 0; isfinite(creal(lead)) && near < 3 && k < MOST_DOUBLINGS; k++, w *= 2) {
        double complex part = log_determinant(c, w, false) - lead - c->order * clog(I * w);
        double complex off = cexp(creal(part) + I * wrapped(cimag(part))) - 1;
        near = cabs(off) < 0.3 ? near + 1 : 0;
        found = w;
        *rest = -wrapped(cimag(part));
    }
    return near == 3 ? found : 0;
}

/* The argument by which the determinant turns between two frequencies, in steps that two halves confirm; NaN: not
 * found. */
static double turn(const characteristic *c, double from, double to)
{
    double sum = 0, w = from, step = 0.1 * from, now = cimag(log_determinant(c, w, false));
    for (int k = 0; k < MOST_STEPS && w < to; k++) {
        step = fmin(fmin(step, to - w), 0.5 / c->longest);
        double complex middle = log_determinant(c, w + 0.5 * step, false), end = log_determinant(c, w + step, false);
        double first = wrapped(cimag(middle) - now), second = wrapped(cimag(end) - cimag(middle));
        bool good = fabs(first) < 0.3 && fabs(second) < 0.3 && isfinite(creal(middle)) && isfinite(creal(end));
        if (!good && step < 1e-9 * w)
            return NAN;
        if (!good) {
            step *= 0.5;
            continue;
        }
        sum += first + second;
        now = cimag(end);
        w = to - w <= step ? to : w + step;
        step *= 1.5;
    }
    return w < to ? NAN : sum;
}

static kempe_status count_roots(const characteristic *c, int *growing, int *zeros)
{
    double rest = 0, end = far_end(c, 1 / c->longest, &rest), low = KMP_DELAYED_STILL * end;
    if (!(end > 0))
        return KEMPE_E_FAILED;
    double slope = (creal(log_determinant(c, 2 * low, false)) - creal(log_determinant(c, low, false))) / log(2);
    *zeros = (int)lround(slope);
    double roots = 0.5 * (c->order - *zeros) - (turn(c, low, end) + rest) / (0.5 * two_pi);
    *growing = (int)lround(roots);
    bool whole = fabs(slope - *zeros) < 0.01 && fabs(roots - *growing) < 0.01;
    return whole && *growing >= 0 && *zeros >= 0 ? KEMPE_OK : KEMPE_E_FAILED;
}

kempe_status kmp_delayed_growing(const kmp_linear *linear, int *growing, int *zeros)
{
    const int p = linear->p;
    kmp_arena arena = {0};
    characteristic c = {.linear = linear};
    bool made = KMP_ARENA_MAKE(&arena, KMP_ROOM(double, (ptrdiff_t)p *p, &c.re, &c.im), KMP_ROOM(int, p, &c.pivot));
    for (int k = 0; k < p; k++) {
        bool is_state = kmp_state_of(linear->system->model, linear->part.u[k]);
        c.order += kmp_delay_of(linear, k) > 0 ? 0 : is_state ? 1 : 2;
        c.longest += kmp_delay_of(linear, k);
    }
    kempe_status status = made ? count_roots(&c, growing, zeros) : kmp_fail_memory(linear->system->context);
    kmp_arena_free(&arena);
    return status;
}
