/* SPDX-License-Identifier: BSD-3-Clause */
/* The characteristic equation of a model with delays, and the number of its roots to the right of a line: the argument
 * of its determinant along that line (principle of the argument), in steps that two halves confirm, up to where its
 * leading term alone counts. */
#include "analyses/derivatives/delayed_motion.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "model/data/model.h"
#include <math.h>

enum { MOST_STEPS = 200000, MOST_DOUBLINGS = 200 };

static const double half_turn = 3.14159265358979323846264338328;

double kmp_delay_of(const kmp_linear *linear, int k)
{
    const kmp_state *state = kmp_state_of(linear->system->model, linear->part.u[k]);
    return state ? state->delay.value : 0;
}

static bool is_state(const kmp_linear *l, int k)
{
    return kmp_state_of(l->system->model, l->part.u[k]);
}

kempe_status kmp_delayed_equation_init(kmp_delayed_equation *e, const kmp_linear *linear)
{
    *e = (kmp_delayed_equation){.linear = linear, .count = kmp_linear_moving(linear, NULL)};
    const ptrdiff_t count = e->count;
    const bool made = KMP_ARENA_MAKE(&e->arena, KMP_ROOM(double complex, count *count, &e->matrix),
                                     KMP_ROOM(int, count, &e->pivot), KMP_ROOM(int, count, &e->place));
    KMP_TRY(kmp_made(linear->system->context, made && e->place));
    kmp_linear_moving(linear, e->place);
    for (int k = 0; k < e->count; k++) {
        const double delay = kmp_delay_of(linear, e->place[k]);
        e->order += delay > 0 ? 0 : is_state(linear, e->place[k]) ? 1 : 2;
        e->longest += delay;
    }
    return KEMPE_OK;
}

KMP_CLEARS(kmp_delayed_equation, equation, kmp_arena_free(&equation->arena))

kmp_delayed_entry kmp_delayed_entry_at(const kmp_delayed_equation *equation, double complex s, int row, int column)
{
    const kmp_linear *l = equation->linear;
    const int i = equation->place[row], j = equation->place[column], at = i + j * l->p;
    const double m = l->mass[at], g = l->damping[at], k = l->stiffness[at], late = kmp_delay_of(l, i);
    const double complex past = late > 0 ? cexp(-s * late) : 1;
    if (late > 0 && row == column) {
        const double complex now = (g - m / late) * past;
        return (kmp_delayed_entry){m / late + now, -late * now, fabs(m / late) + cabs(now)};
    }
    const bool first = is_state(l, j);
    const double complex value = first ? g + s * m : k + s * g + s * s * m, slope = first ? m : g + 2 * s * m;
    const double size = cabs(s), terms = first ? fabs(g) + size * fabs(m) : fabs(k) + size * (fabs(g) + size * fabs(m));
    if (late > 0)
        return (kmp_delayed_entry){value * past, (slope - late * value) * past, terms * cabs(past)};
    return (kmp_delayed_entry){value, slope, terms};
}

/* The part of an entry that leads in s, over its power. */
static double leading(const kmp_delayed_equation *c, int row, int column)
{
    const kmp_linear *l = c->linear;
    const int i = c->place[row], j = c->place[column];
    const double m = l->mass[i + j * l->p], delay = kmp_delay_of(l, j);
    if (kmp_delay_of(l, i) > 0 || delay > 0)
        return row == column ? m / delay : 0;
    return m;
}

/* The logarithm of the determinant: of its modulus, and the argument up to turns; of its leading part in s where
 * `leads`. */
static double complex log_determinant(const kmp_delayed_equation *c, double complex s, bool leads)
{
    const int p = c->count;
    double complex sum = 0;
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            c->matrix[i + k * p] = leads ? leading(c, i, k) : kmp_delayed_entry_at(c, s, i, k).value;
    if (kmp_lu_complex_factor(p, c->matrix, c->pivot) != 0)
        return -INFINITY;
    for (int k = 0; k < p; k++) { /* pivots are kept as reciprocals */
        sum -= clog(c->matrix[k + k * p]);
        sum += c->pivot[k] != k ? I * half_turn : 0;
    }
    return sum;
}

static double wrapped(double angle)
{
    return remainder(angle, 2 * half_turn);
}

/* The least power of two from `w` on beyond which the determinant is near its leading term on the line of `bound`, and
 * the argument that is left from there to infinity; 0: none. */
static double far_end(const kmp_delayed_equation *c, double bound, double w, double *rest)
{
    double complex lead = log_determinant(c, 0, true);
    double found = 0;
    int near = 0;
    for (int k = 0; isfinite(creal(lead)) && near < 3 && k < MOST_DOUBLINGS; k++, w *= 2) {
        const double complex s = bound + I * w;
        double complex part = log_determinant(c, s, false) - lead - c->order * clog(s);
        double complex off = cexp(creal(part) + I * wrapped(cimag(part))) - 1;
        near = cabs(off) < 0.3 ? near + 1 : 0;
        found = w;
        *rest = -wrapped(cimag(part)) + c->order * (0.5 * half_turn - carg(s));
    }
    return near == 3 ? found : 0;
}

/* The argument by which the determinant turns between two points of the line of `bound`, in steps that two halves
 * confirm; NaN: not found. */
static double turn(const kmp_delayed_equation *c, double bound, double from, double to)
{
    double sum = 0, w = from, step = from > 0 ? 0.1 * from : 0.1 / c->longest;
    double now = cimag(log_determinant(c, bound + I * w, false));
    for (int k = 0; k < MOST_STEPS && w < to; k++) {
        step = fmin(fmin(step, to - w), 0.5 / c->longest);
        double complex middle = log_determinant(c, bound + I * (w + 0.5 * step), false);
        double complex end = log_determinant(c, bound + I * (w + step), false);
        double first = wrapped(cimag(middle) - now), second = wrapped(cimag(end) - cimag(middle));
        bool good = fabs(first) < 0.3 && fabs(second) < 0.3 && isfinite(creal(middle)) && isfinite(creal(end));
        if (!good && step < 1e-9 * fmax(w, 1 / c->longest))
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

static kempe_status take_whole(double roots, int *count)
{
    *count = isfinite(roots) ? (int)lround(roots) : -1;
    return fabs(roots - *count) < 0.01 && *count >= 0 ? KEMPE_OK : KEMPE_E_FAILED;
}

kempe_status kmp_delayed_right_of(const kmp_delayed_equation *equation, double bound, int *count)
{
    double rest = 0, end = far_end(equation, bound, 1 / equation->longest, &rest);
    if (!(end > 0))
        return KEMPE_E_FAILED;
    return take_whole(0.5 * equation->order - (turn(equation, bound, 0, end) + rest) / half_turn, count);
}

static kempe_status count_roots(const kmp_delayed_equation *c, int *growing, int *zeros)
{
    double rest = 0, end = far_end(c, 0, 1 / c->longest, &rest), low = KMP_DELAYED_STILL * end;
    if (!(end > 0))
        return KEMPE_E_FAILED;
    double at_low = creal(log_determinant(c, I * low, false)),
           at_double = creal(log_determinant(c, 2 * I * low, false));
    KMP_TRY(take_whole((at_double - at_low) / log(2), zeros));
    return take_whole(0.5 * (c->order - *zeros) - (turn(c, 0, low, end) + rest) / half_turn, growing);
}

kempe_status kmp_delayed_growing(const kmp_linear *linear, int *growing, int *zeros)
{
    kmp_delayed_equation c;
    kempe_status status = kmp_delayed_equation_init(&c, linear);
    if (status == KEMPE_OK)
        status = count_roots(&c, growing, zeros);
    kmp_delayed_equation_free(&c);
    return status;
}
