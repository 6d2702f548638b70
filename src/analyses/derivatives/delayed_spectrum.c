/* SPDX-License-Identifier: BSD-3-Clause */
/* Rightmost roots: eigenvalues of the discretised delays as starts, Newton's method on P(s) x = 0 by inverse iteration
 * (Ruhe 1973), a residual for each root, and a count by the argument that shows if one is missing. The points of a
 * delay are doubled until none is. */
#include "analyses/derivatives/delayed_spectrum.h"
#include "analyses/dense/complex_lu.h"
#include "analyses/dense/eigenvalues.h"
#include "analyses/derivatives/sampled_motion.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense_parts.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include <float.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* The characteristic equation P(s) x = 0 of the unknowns that move: coordinates and values of states. The row of a
 * delay is multiplied by e^(-s T). */
typedef struct delayed_equation {
    const kmp_linear *linear;
    kmp_arena arena;         /* of all arrays */
    int count;               /* of unknowns */
    int *place;              /* count: each among u */
    int order;               /* of the determinant in s */
    double longest;          /* the sum of the delays */
    double _Complex *matrix; /* count x count: work */
    int *pivot;
} delayed_equation;

/* An entry of P(s), its derivative by s, and the sum of the moduli of its terms. */
typedef struct delayed_entry {
    double complex value, slope;
    double size;
} delayed_entry;

/* -- the characteristic equation, and the roots to the right of a line -------------------------------------- */

enum { MOST_TURNS = 200000, MOST_DOUBLINGS = 200 };

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

/* The order of the determinant, and the delays, of the unknowns at their places. */
static void sum_delays(delayed_equation *e)
{
    e->order = 0;
    e->longest = 0;
    for (int k = 0; k < e->count; k++) {
        const double delay = kmp_delay_of(e->linear, e->place[k]);
        e->order += delay > 0 ? 0 : is_state(e->linear, e->place[k]) ? 1 : 2;
        e->longest += delay;
    }
}

/* With the linear equations at a state. KEMPE_E_MEMORY. */
static kempe_status delayed_equation_init(delayed_equation *e, const kmp_linear *linear)
{
    *e = (delayed_equation){.linear = linear, .count = kmp_linear_moving(linear, NULL)};
    const ptrdiff_t count = e->count;
    const bool made = KMP_ARENA_MAKE(&e->arena, KMP_ROOM(double complex, count *count, &e->matrix),
                                     KMP_ROOM(int, count, &e->pivot), KMP_ROOM(int, count, &e->place));
    KMP_TRY(kmp_made(linear->system->context, made && e->place));
    kmp_linear_moving(linear, e->place);
    sum_delays(e);
    return KEMPE_OK;
}

static delayed_entry delayed_entry_at(const delayed_equation *equation, double complex s, int row, int column)
{
    const kmp_linear *l = equation->linear;
    const int i = equation->place[row], j = equation->place[column], at = i + j * l->p;
    const double m = l->mass[at], g = l->damping[at], k = l->stiffness[at], late = kmp_delay_of(l, i);
    const double complex past = late > 0 ? cexp(-s * late) : 1;
    if (late > 0 && row == column) {
        const double complex now = (g - m / late) * past;
        return (delayed_entry){m / late + now, -late * now, fabs(m / late) + cabs(now)};
    }
    const bool first = is_state(l, j);
    const double complex value = first ? g + s * m : k + s * g + s * s * m, slope = first ? m : g + 2 * s * m;
    const double size = cabs(s), terms = first ? fabs(g) + size * fabs(m) : fabs(k) + size * (fabs(g) + size * fabs(m));
    if (late > 0)
        return (delayed_entry){value * past, (slope - late * value) * past, terms * cabs(past)};
    return (delayed_entry){value, slope, terms};
}

/* The part of an entry that leads in s, over its power. */
static double leading(const delayed_equation *c, int row, int column)
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
static double complex log_determinant(const delayed_equation *c, double complex s, bool leads)
{
    const int p = c->count;
    double complex sum = 0;
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            c->matrix[i + k * p] = leads ? leading(c, i, k) : delayed_entry_at(c, s, i, k).value;
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
static double far_end(const delayed_equation *c, double bound, double w, double *rest)
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
static double turn(const delayed_equation *c, double bound, double from, double to)
{
    double sum = 0, w = from, step = from > 0 ? 0.1 * from : 0.1 / c->longest;
    double now = cimag(log_determinant(c, bound + I * w, false));
    for (int k = 0; k < MOST_TURNS && w < to; k++) {
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

/* The number of roots with a real part above `bound`, which is not the real part of a root, by the principle of the
 * argument: the argument of the determinant over s = bound + i w from w = 0 to infinity turns by half a turn less for
 * each of them. KEMPE_E_FAILED without a message: a root is too close to that line. */
static kempe_status delayed_right_of(const delayed_equation *equation, double bound, int *count)
{
    double rest = 0, end = far_end(equation, bound, 1 / equation->longest, &rest);
    if (!(end > 0))
        return KEMPE_E_FAILED;
    return take_whole(0.5 * equation->order - (turn(equation, bound, 0, end) + rest) / half_turn, count);
}

/* Equations that share no unknown: the determinant is the product of theirs. */
typedef struct delayed_groups {
    int count;
    delayed_equation *of;
    double *end, *rest; /* of far_end */
} delayed_groups;

static kempe_status find_groups(const delayed_equation *whole, kmp_arena *arena, delayed_groups *x)
{
    const kmp_linear *l = whole->linear;
    const double *const from[] = {l->mass, l->damping, l->stiffness};
    const double *matrix[3] = {NULL};
    kmp_dense_groups groups;
    const int n = whole->count;
    for (int k = 0; k < 3; k++) {
        double *to = KMP_ARENA_NEW(arena, double, (ptrdiff_t)n *n);
        if (to)
            kmp_linear_squeeze(l->p, n, whole->place, n, whole->place, from[k], to);
        matrix[k] = to;
    }
    KMP_TRY(kmp_made(l->system->context, !arena->failed && kmp_dense_groups_init(&groups, arena, n, 3, matrix)));
    x->count = groups.count;
    KMP_TRY(kmp_made(l->system->context, KMP_ARENA_MAKE(arena, KMP_ROOM(delayed_equation, x->count, &x->of),
                                                        KMP_ROOM(double, x->count, &x->end, &x->rest))));
    for (int g = 0; g < x->count; g++) {
        delayed_equation *own = &x->of[g];
        *own = *whole;
        own->count = groups.start[g + 1] - groups.start[g];
        own->place = groups.order + groups.start[g];
        for (int k = 0; k < own->count; k++)
            own->place[k] = whole->place[own->place[k]];
        sum_delays(own);
        if (own->longest == 0)
            own->longest = whole->longest; /* no delay limits the steps */
    }
    return KEMPE_OK;
}

/* `low`: of the values that count as zero, the largest. */
static kempe_status count_roots(const delayed_equation *c, double end, double low, double rest, int *growing,
                                int *zeros)
{
    double at_low = creal(log_determinant(c, I * low, false)),
           at_double = creal(log_determinant(c, 2 * I * low, false));
    KMP_TRY(take_whole((at_double - at_low) / log(2), zeros));
    return take_whole(0.5 * (c->order - *zeros) - (turn(c, 0, low, end) + rest) / half_turn, growing);
}

kempe_status kmp_delayed_growing(const kmp_linear *linear, int *growing, int *zeros)
{
    delayed_equation c;
    delayed_groups x = {0};
    kmp_arena arena = {0};
    double low = 0;
    kempe_status status = delayed_equation_init(&c, linear);
    if (status == KEMPE_OK)
        status = find_groups(&c, &arena, &x);
    *growing = *zeros = 0;
    for (int g = 0; status == KEMPE_OK && g < x.count; g++) {
        x.end[g] = far_end(&x.of[g], 0, 1 / c.longest, &x.rest[g]);
        low = fmax(low, KMP_DELAYED_STILL * x.end[g]);
        status = x.end[g] > 0 ? KEMPE_OK : KEMPE_E_FAILED;
    }
    for (int g = 0; status == KEMPE_OK && g < x.count; g++) {
        int more = 0, still = 0;
        status = count_roots(&x.of[g], x.end[g], low, x.rest[g], &more, &still);
        *growing += more;
        *zeros += still;
    }
    kmp_arena_free(&arena);
    kmp_arena_free(&c.arena);
    return status;
}

/* Points of a delay: the first number of them, doubled until the roots are complete, within a size of the system. MORE
 * roots than the system has states without delays are listed. Lines between neighbours are tried, LINES of them. */
enum { FIRST_POINTS = 32, LEVELS = 2, MOST_SIZE = 600, MORE = 10, LINES = 3, MOST_STEPS = 40 };

typedef struct root {
    double complex s, *x; /* x: of the equation's unknowns */
    int k;
} root;

typedef struct search {
    delayed_equation equation;
    const kmp_linear *linear;
    kmp_arena arena;
    int width, *place; /* the first-order form of the averaged system, x' = a x */
    double *a;
    int delays, plain; /* entries of x that are delays, or not */
    int *at;           /* width: the place of each entry in the discretised system */
    int points, size;
    double *generator, *re, *im, *v_re, *v_im, *left;
    double *row; /* equation.count: sizes of rows */
    int zeros, count, room;
    root *root; /* the roots on and above the real axis */
} search;

static double delay_of(const search *m, int entry)
{
    return m->place[entry] < m->linear->p ? 0 : kmp_delay_of(m->linear, m->place[entry] - m->linear->p);
}

/* -- discretisation ---------------------------------------------------------------------------------- */

/* The derivative matrix of Chebyshev points x_j = cos(j pi/n), j = 0..n (Trefethen 2000, chapter 6). */
static double derivative(int n, int j, int i)
{
    const double turn = acos(-1) / n;
    if (i == j) { /* minus the sum of the others of its row: exact for constants */
        double sum = 0;
        for (int k = 0; k <= n; k++)
            sum -= k == j ? 0 : derivative(n, j, k);
        return sum;
    }
    const double c = (j == 0 || j == n ? 2 : 1) / (i == 0 || i == n ? 2.0 : 1.0);
    const double apart = 2 * sin(0.5 * turn * (i + j)) * sin(0.5 * turn * (i - j));
    return c * ((i + j) % 2 ? -1 : 1) / apart;
}

static void put(search *m, int row, int column, double x)
{
    m->generator[row + (ptrdiff_t)column * m->size] += x;
}

/* The signal before the delay of entry i has T (a x)_i + x_i, where a has (u - y)/T. */
static void put_delay(search *m, int i, const double *differences)
{
    const int n = m->points, first = m->at[i] - n + 1;
    const double T = delay_of(m, i);
    for (int j = 1; j <= n; j++) {
        const double *row = differences + (ptrdiff_t)j * (n + 1);
        for (int k = 1; k <= n; k++)
            put(m, first + j - 1, first + k - 1, 2 / T * row[k]);
        for (int k = 0; k < m->width; k++)
            put(m, first + j - 1, m->at[k], 2 / T * row[0] * (T * m->a[i + (ptrdiff_t)k * m->width] + (k == i)));
    }
}

static kempe_status discretise(search *m, int points)
{
    const ptrdiff_t most = m->plain + (ptrdiff_t)m->delays * points, n = points;
    double *differences;
    m->points = points;
    KMP_TRY(kmp_made(
        m->linear->system->context,
        KMP_ARENA_MAKE(&m->arena, KMP_ROOM(double, most *most, &m->generator, &m->v_re, &m->v_im, &m->left),
                       KMP_ROOM(double, most, &m->re, &m->im), KMP_ROOM(double, (n + 1) * (n + 1), &differences)) &&
            m->generator && differences));
    int next = 0, signal = 0;
    for (int i = 0; i < m->width; i++)
        m->at[i] = delay_of(m, i) > 0 ? m->plain + ++signal * m->points - 1 : next++;
    m->size = m->plain + m->delays * m->points;
    for (int j = 0; j <= points; j++)
        for (int k = 0; k <= points; k++)
            differences[j * (n + 1) + k] = derivative(points, j, k);
    for (int i = 0; i < m->width; i++)
        if (delay_of(m, i) > 0)
            put_delay(m, i, differences);
        else
            for (int k = 0; k < m->width; k++)
                put(m, m->at[i], m->at[k], m->a[i + (ptrdiff_t)k * m->width]);
    if (kmp_eigen_general(m->size, m->generator, m->re, m->im, m->v_re, m->v_im, m->left, m->left) == 0)
        return KEMPE_OK;
    return kmp_fail(m->linear->system->context, KEMPE_E_FAILED, "the iteration for the eigenvalues does not converge");
}

/* -- Newton's method --------------------------------------------------------------------------------- */

/* P(s) in factors, rows of the size one. */
static bool factor(search *m, double complex s)
{
    delayed_equation *e = &m->equation;
    for (int i = 0; i < e->count; i++) {
        m->row[i] = 0;
        for (int k = 0; k < e->count; k++) {
            const delayed_entry x = delayed_entry_at(e, s, i, k);
            e->matrix[i + k * e->count] = x.value;
            m->row[i] = fmax(m->row[i], x.size);
        }
        for (int k = 0; k < e->count && m->row[i] > 0; k++)
            e->matrix[i + k * e->count] /= m->row[i];
    }
    return kmp_lu_complex_factor(e->count, e->matrix, e->pivot) == 0;
}

/* P(s)^-1 of P'(s) x, or of ones where x is NULL. */
static void solve(search *m, double complex s, const double complex *x, double complex *out)
{
    delayed_equation *e = &m->equation;
    for (int i = 0; i < e->count; i++) {
        double complex sum = x ? 0 : 1;
        for (int k = 0; x && k < e->count; k++)
            sum += delayed_entry_at(e, s, i, k).slope * x[k];
        out[i] = sum / (x && m->row[i] > 0 ? m->row[i] : 1);
    }
    kmp_lu_complex_solve(e->count, e->matrix, e->pivot, out);
}

/* Relative to the terms of each row. */
static double residual_of(const search *m, const root *r)
{
    const delayed_equation *e = &m->equation;
    double worst = 0;
    for (int i = 0; i < e->count; i++) {
        double complex sum = 0;
        double terms = 0;
        for (int k = 0; k < e->count; k++) {
            const delayed_entry x = delayed_entry_at(e, r->s, i, k);
            sum += x.value * r->x[k];
            terms += x.size * cabs(r->x[k]);
        }
        worst = terms > 0 ? fmax(worst, cabs(sum) / terms) : worst;
    }
    return worst;
}

static double size_of(const search *m, double complex s)
{
    return fmax(cabs(s), 1 / m->equation.longest);
}

/* Inverse iteration with the largest entry of x kept at one (Ruhe 1973). */
static bool refine(search *m, root *r, double complex *next)
{
    const int n = m->equation.count;
    const double small = 4 * DBL_EPSILON;
    bool near = false;
    for (int step = 0; step < MOST_STEPS; step++) {
        int most = 0;
        for (int k = 1; k < n; k++)
            most = cabs(r->x[k]) > cabs(r->x[most]) ? k : most;
        if (!(cabs(r->x[most]) > 0) || !isfinite(cabs(r->s)))
            return false;
        if (!factor(m, r->s)) { /* exactly a root: its vector follows from a place near it */
            r->s += small * size_of(m, r->s);
            continue;
        }
        solve(m, r->s, r->x, next);
        const double complex change = r->x[most] / next[most];
        for (int k = 0; k < n; k++)
            r->x[k] = next[k] / next[most];
        if (near && !(cabs(change) < small * size_of(m, r->s)))
            return residual_of(m, r) <= KMP_DELAYED_ROOT;
        if (!isfinite(cabs(change)))
            return false;
        r->s -= change;
        near = cabs(change) <= 1e-10 * size_of(m, r->s);
        if (cabs(change) <= small * size_of(m, r->s))
            return residual_of(m, r) <= KMP_DELAYED_ROOT;
    }
    return false;
}

/* -- roots ------------------------------------------------------------------------------------------- */

/* A real root has a real vector. One that an upper eigenvalue, which has a conjugate, has led to is double: the other
 * part of its vector belongs to the second one. */
static void split(search *m, root *r, bool twice)
{
    const int n = m->equation.count;
    double re = 0, im = 0;
    for (int k = 0; k < n; k++) {
        re = fmax(re, fabs(creal(r->x[k])));
        im = fmax(im, fabs(cimag(r->x[k])));
    }
    r->s = creal(r->s);
    root *other = &m->root[m->count];
    for (int k = 0; twice && k < n; k++)
        other->x[k] = im > KMP_DELAYED_NEAR * re ? cimag(r->x[k]) : creal(r->x[k]);
    for (int k = 0; k < n; k++)
        r->x[k] = re > 0 ? creal(r->x[k]) : cimag(r->x[k]);
    if (twice) {
        other->s = r->s;
        other->k = m->count++;
    }
}

/* Refines the root behind the last one, from s. It stays where it is a root within `reach` of s. */
static void take(search *m, double complex s, double reach, double complex *next)
{
    root *r = &m->root[m->count];
    r->s = s;
    r->k = m->count;
    if (!refine(m, r, next) || cabs(r->s - s) > reach * size_of(m, s))
        return;
    const bool real = fabs(cimag(r->s)) <= 16 * DBL_EPSILON * size_of(m, r->s);
    if (!real && cimag(r->s) < 0)
        return;
    m->count++;
    if (real)
        split(m, r, cimag(s) > 0);
}

/* The eigenvector c of the discretised system: coordinates, values of states, and ends of delays. */
static void take_vector(search *m, int c)
{
    root *r = &m->root[m->count];
    for (int k = 0; k < m->equation.count; k++)
        r->x[k] = 0;
    for (int i = 0; i < m->width; i++) {
        const int place = m->place[i] % m->linear->p;
        const bool value = m->place[i] >= m->linear->p;
        if (value && !kmp_state_of(m->linear->system->model, m->linear->part.u[place]))
            continue;
        for (int k = 0; k < m->equation.count; k++)
            if (m->equation.place[k] == place)
                r->x[k] = m->v_re[m->at[i] + (ptrdiff_t)c * m->size] + I * m->v_im[m->at[i] + (ptrdiff_t)c * m->size];
    }
}

static int by_modulus(const void *a, const void *b)
{
    const root *x = a, *y = b;
    const double first = cabs(x->s), second = cabs(y->s);
    return first != second ? (first < second ? -1 : 1) : x->k - y->k;
}

static int from_the_right(const void *a, const void *b)
{
    const root *x = a, *y = b;
    return creal(x->s) != creal(y->s) ? (creal(x->s) > creal(y->s) ? -1 : 1) : by_modulus(a, b);
}

/* All eigenvalues but the zeros, which are those nearest to the origin. */
static bool take_eigenvalues(search *m, double complex *next)
{
    root *order = KMP_ARENA_NEW(&m->arena, root, m->size);
    for (int c = 0; order && c < m->size; c++)
        order[c] = (root){.s = m->re[c] + I * m->im[c], .k = c};
    if (!order)
        return false;
    qsort(order, (size_t)m->size, sizeof *order, by_modulus);
    for (int c = m->zeros; c < m->size; c++)
        if (cimag(order[c].s) >= 0) {
            take_vector(m, order[c].k);
            take(m, order[c].s, KMP_DELAYED_NEAR, next);
        }
    return true;
}

/* Fast roots, of which the polynomials see little, are near the roots without the delayed signals. */
static bool take_undelayed(search *m, double complex *next)
{
    const ptrdiff_t n = m->plain;
    double *a, *re, *im, *vectors;
    if (!KMP_ARENA_MAKE(&m->arena, KMP_ROOM(double, n *n, &a, &vectors), KMP_ROOM(double, n, &re, &im)))
        return false;
    for (int i = 0; i < m->width; i++)
        for (int k = 0; k < m->width; k++)
            if (m->at[i] < n && m->at[k] < n)
                a[m->at[i] + m->at[k] * n] = m->a[i + (ptrdiff_t)k * m->width];
    if (kmp_eigen_general((int)n, a, re, im, vectors, vectors, vectors, vectors) != 0)
        return true;
    for (int c = 0; c < n; c++) {
        const double complex s = re[c] + I * im[c];
        const int before = m->count;
        if (im[c] < 0 || cabs(s) * m->equation.longest < 1 || !factor(m, s))
            continue;
        solve(m, s, NULL, m->root[before].x);
        take(m, s, 0.3, next);
        const double complex found = m->root[before].s;
        const bool taken = m->count > before;
        bool known = false;
        m->count = before;
        for (int k = 0; k < m->count; k++)
            known = known || cabs(m->root[k].s - found) <= KMP_DELAYED_NEAR * size_of(m, found);
        m->count += taken && !known;
    }
    return true;
}

static int multiplicity(const root *r)
{
    return cimag(r->s) > 0 ? 2 : 1;
}

/* Finds a line to the right of which the known roots are all; returns the number of those (above the axis). */
static int find_line(search *m, double *bound)
{
    int kept = 0, roots = m->zeros, tried = 0;
    while (kept < m->count && roots + multiplicity(&m->root[kept]) <= m->zeros + m->plain + MORE)
        roots += multiplicity(&m->root[kept++]);
    const int most = kept;
    for (; kept > 0 && tried < LINES; roots -= multiplicity(&m->root[--kept])) {
        /* The line between the first `kept` roots from the right and the next one; NAN: they are too close. */
        const double last = creal(m->root[kept - 1].s), unit = fabs(last) + 1 / m->equation.longest;
        const double next = kept < m->count ? creal(m->root[kept].s) : last - 0.2 * unit;
        const double line = last - next > 1e-3 * unit ? 0.5 * (last + next) : NAN;
        int right;
        if (!isfinite(line) || (m->zeros > 0 && line >= 0))
            continue;
        tried++;
        if (delayed_right_of(&m->equation, line, &right) == KEMPE_OK && right == roots) {
            *bound = line;
            return kept;
        }
    }
    *bound = NAN;
    return most;
}

static kempe_status find(search *m, bool brief, int *kept, double *bound)
{
    kempe_context *context = m->linear->system->context;
    for (int level = 0, points = FIRST_POINTS; level < LEVELS; level++, points *= 2) {
        if (level > 0 && m->plain + m->delays * points > MOST_SIZE)
            return KEMPE_OK;
        KMP_TRY(discretise(m, points));
        /* Rooms of the roots, each with its vector. */
        m->count = 0;
        m->root = KMP_ARENA_NEW(&m->arena, root, 2 * m->size + m->plain + 2);
        double complex *x =
            KMP_ARENA_NEW(&m->arena, double complex, (ptrdiff_t)(2 * m->size + m->plain + 3) * m->equation.count);
        for (int k = 0; x && m->root && k < 2 * m->size + m->plain + 2; k++)
            m->root[k].x = x + (ptrdiff_t)(k + 1) * m->equation.count;
        KMP_TRY(kmp_made(context, !m->arena.failed));
        double complex *next = m->root[0].x - m->equation.count;
        KMP_TRY(kmp_made(context, take_eigenvalues(m, next) && take_undelayed(m, next)));
        qsort(m->root, (size_t)m->count, sizeof *m->root, from_the_right);
        *kept = m->count;
        if (brief)
            return KEMPE_OK;
        *kept = find_line(m, bound);
        int roots = m->zeros;
        for (int k = 0; k < *kept; k++)
            roots += multiplicity(&m->root[k]);
        if (isfinite(*bound) && roots >= m->plain)
            return KEMPE_OK;
    }
    return KEMPE_OK;
}

/* -- result ------------------------------------------------------------------------------------------ */

static void put_root(const search *m, kmp_delayed_spectrum *out, const root *r)
{
    for (int half = 0; half < multiplicity(r); half++) {
        const int c = out->count++;
        out->re[c] = creal(r->s);
        out->im[c] = half ? -cimag(r->s) : cimag(r->s);
        for (int k = 0; k < m->equation.count; k++) {
            const ptrdiff_t at = m->equation.place[k] + (ptrdiff_t)c * out->p;
            out->x_re[at] = creal(r->x[k]);
            out->x_im[at] = half ? -cimag(r->x[k]) : cimag(r->x[k]);
        }
    }
}

/* A basis of the null space of P(0), its rows of the size one. */
static kempe_status put_zeros(search *m, kmp_delayed_spectrum *out)
{
    const delayed_equation *e = &m->equation;
    const int n = e->count;
    double *a = NULL, *pivots = NULL, *x = NULL;
    int *row = NULL, *column = NULL;
    if (n < 1)
        return KEMPE_OK; /* nothing moves */
    KMP_TRY(kmp_made(m->linear->system->context,
                     KMP_ARENA_MAKE(&m->arena, KMP_ROOM(double, n, &pivots, &x), KMP_ROOM(double, n *n, &a),
                                    KMP_ROOM(int, n, &row, &column))));
    for (int i = 0; i < n; i++) {
        double size = 0;
        for (int k = 0; k < n; k++) {
            const delayed_entry entry = delayed_entry_at(e, 0, i, k);
            a[i + k * n] = creal(entry.value);
            size = fmax(size, entry.size);
        }
        for (int k = 0; k < n && size > 0; k++)
            a[i + k * n] /= size;
    }
    kmp_lu_complete(n, n, a, NULL, row, column, pivots);
    int rank = n - 1; /* there is a zero */
    while (rank > n - m->zeros && rank > 0 && pivots[rank - 1] <= KMP_DELAYED_ROOT * pivots[0])
        rank--;
    out->still = n - rank;
    for (int c = 0; c < out->still; c++) {
        kmp_lu_null_vector(n, n, a, column, rank, rank + c, x);
        for (int k = 0; k < n; k++)
            out->x_re[e->place[k] + (ptrdiff_t)c * out->p] = x[k];
    }
    return KEMPE_OK;
}

static kempe_status give(search *m, int kept, kmp_delayed_spectrum *out)
{
    const ptrdiff_t most = m->zeros + 2 * (ptrdiff_t)m->count;
    KMP_TRY(
        kmp_made(m->linear->system->context, KMP_ARENA_MAKE(&out->arena, KMP_ROOM(double, most, &out->re, &out->im),
                                                            KMP_ROOM(double, most * out->p, &out->x_re, &out->x_im))));
    out->zeros = out->count = m->zeros;
    if (m->zeros > 0)
        KMP_TRY(put_zeros(m, out));
    qsort(m->root, (size_t)kept, sizeof *m->root, by_modulus);
    for (int k = 0; k < m->count; k++) {
        out->shown = k == kept ? out->count : out->shown;
        put_root(m, out, &m->root[k]);
    }
    out->shown = kept == m->count ? out->count : out->shown;
    return KEMPE_OK;
}

static kempe_status begin(search *m, const kmp_linear *linear)
{
    const ptrdiff_t n = 2 * (ptrdiff_t)linear->p, count = linear->p;
    KMP_TRY(delayed_equation_init(&m->equation, linear));
    KMP_TRY(kmp_made(linear->system->context,
                     KMP_ARENA_MAKE(&m->arena, KMP_ROOM(int, n, &m->place, &m->at), KMP_ROOM(double, n *n, &m->a),
                                    KMP_ROOM(double, count, &m->row)) &&
                         m->place && m->at));
    m->width = kmp_linear_entries(linear, m->place);
    for (int i = 0; i < m->width; i++)
        *(delay_of(m, i) > 0 ? &m->delays : &m->plain) += 1;
    const int failed = kmp_linear_first_order(linear, m->width, m->place, m->a);
    KMP_TRY(kmp_made(linear->system->context, failed != -1));
    return failed == 0 ? KEMPE_OK : kmp_sampled_complain(linear->system->context, failed);
}

/* Signals that pass on the output of a delay at once pass through these in some order, so that roots far away decay. If
 * they depend on themselves so, the system is a neutral one, whose roots gather near vertical lines. */
static kempe_status check_order(search *m)
{
    bool *done = KMP_ARENA_NEW(&m->arena, bool, m->width);
    KMP_TRY(kmp_made(m->linear->system->context, done));
    int left = m->delays, found = 1, last = 0;
    while (found > 0) {
        found = 0;
        for (int i = 0; i < m->width; i++) {
            const double T = delay_of(m, i);
            bool waits = done[i] || !(T > 0);
            for (int k = 0; k < m->width && !waits; k++)
                waits = delay_of(m, k) > 0 && !done[k] &&
                        fabs(T * m->a[i + (ptrdiff_t)k * m->width] + (k == i)) > 16 * DBL_EPSILON;
            if (!waits) {
                done[i] = true;
                found++;
                left--;
            } else if (T > 0 && !done[i])
                last = i;
        }
    }
    if (left == 0)
        return KEMPE_OK;
    return kmp_fail(m->linear->system->context, KEMPE_E_FAILED,
                    "the delayed signal '%s' depends on itself at once: eigenvalues of such neutral equations are not "
                    "supported; give it a lag in between, a state with a rate",
                    kmp_model_motion(m->linear->system->model, m->linear->part.u[m->place[last] - m->linear->p])->name);
}

kempe_status kmp_delayed_spectrum_init(kmp_delayed_spectrum *spectrum, const kmp_linear *linear, int zeros, bool brief)
{
    search m = {.linear = linear, .zeros = zeros};
    int kept = 0;
    *spectrum = (kmp_delayed_spectrum){.p = linear->p, .bound = NAN};
    kempe_status status = begin(&m, linear);
    if (status == KEMPE_OK)
        status = check_order(&m);
    if (status == KEMPE_OK)
        status = find(&m, brief, &kept, &spectrum->bound);
    if (status == KEMPE_OK)
        status = give(&m, kept, spectrum);
    kmp_arena_free(&m.equation.arena);
    kmp_arena_free(&m.arena);
    return status;
}

KMP_CLEARS(kmp_delayed_spectrum, spectrum, kmp_arena_free(&spectrum->arena))
