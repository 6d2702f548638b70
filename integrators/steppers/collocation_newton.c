/* SPDX-License-Identifier: BSD-3-Clause */
/* Simplified Newton's method for the stages, with one Jacobian f_q, f_v for all of them:
 *
 *     (I - h A (x) f_v - (h A)^2 (x) f_q) change = f(stages) - g
 *
 * is, in the eigenvectors of A, one system of the size of g for each eigenvalue (Hairer, Wanner, Solving Ordinary
 * Differential Equations II, 2nd ed., IV.8). The eigenvalues, four at most, are the lanes of the factors. */
#include "integrators/steppers/collocation_newton.h"
#include "base/clones.h"
#include "base/context.h"
#include "base/simd4.h"
#include "constraints/tolerances.h"
#include "integrators/steppers/collocation.h"
#include "integrators/steppers/collocation_step.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* Anderson's mixing of the corrections of Newton's method (J. ACM 12 (1965) 547; Walker and Ni, SIAM J. Numer. Anal. 49
 * (2011) 1715). One Jacobian for all stages is wrong by a few forces: a contact that begins between two stages, a
 * damper that turns along the step. The difference has a low rank, which the last corrections span. The next place is
 * the place of their combination with the least weighted square; on a linear system these are the places of GMRES. */

/* Corrections are combined from this quotient of two on. */
static const double SLOWLY = 0.1;
/* The part of a difference that must be left next to the others: less is rounding. */
static const double INDEPENDENT = 1e-6;

static size_t size_of(const kmp_collocation *s)
{
    return (size_t)s->inner * (size_t)s->w;
}

/* Sums over k of (weight[k] x[k])(weight[k] y[k]) in each lane, V registers of a type. */
#define PRODUCTS(lanes, type, number)                                                                                  \
    static KMP_CLONES void products_##lanes(int count, const double *weight, const double *x, const double *y,         \
                                            double *sums)                                                              \
    {                                                                                                                  \
        enum { V = number, LAST = V - 1 };                                                                             \
        const type *a = (const type *)x, *b = (const type *)y;                                                         \
        type sum = {0}, more = {0};                                                                                    \
        for (int k = 0; k < count; k++) {                                                                              \
            sum += (weight[k] * a[k * V]) * (weight[k] * b[k * V]);                                                    \
            if (V == 2)                                                                                                \
                more += (weight[k] * a[k * V + LAST]) * (weight[k] * b[k * V + LAST]);                                 \
        }                                                                                                              \
        ((type *)sums)[0] = sum;                                                                                       \
        if (V == 2)                                                                                                    \
            ((type *)sums)[LAST] = more;                                                                               \
    }

PRODUCTS(four, kmp_four, 1)
PRODUCTS(two_fours, kmp_four, 2)
PRODUCTS(eight, kmp_eight, 1)

static double product(const kmp_collocation *s, const double *x, const double *y)
{
    double sums[8], sum = 0;
    (s->w == 4         ? products_four
     : kmp_has_eight() ? products_eight
                       : products_two_fours)(s->inner, s->weight, x, y, sums);
    for (int l = 0; l < s->s; l++)
        sum += sums[l];
    return sum;
}

double kmp_collocation_square(const kmp_collocation *s, const double *x)
{
    return product(s, x, x);
}

/* from -= factor of. */
static KMP_CLONES void subtract(size_t count, double factor, const double *restrict of, double *restrict from)
{
    for (size_t k = 0; k < count; k++)
        from[k] -= factor * of[k];
}

static KMP_CLONES void scale(size_t count, double factor, double *x)
{
    for (size_t k = 0; k < count; k++)
        x[k] *= factor;
}

/* The place of a correction, and its differences from the last one and its place. */
static KMP_CLONES void differ(size_t count, const double *restrict g, const double *restrict change,
                              const double *restrict last, const double *restrict place, double *restrict by,
                              double *restrict to)
{
    for (size_t k = 0; k < count; k++) {
        by[k] = change[k] - last[k];
        to[k] = g[k] + change[k] - place[k];
    }
}

static KMP_CLONES void add(size_t count, const double *restrict x, const double *restrict y, double *restrict sum)
{
    for (size_t k = 0; k < count; k++)
        sum[k] = x[k] + y[k];
}

/* Adds the differences from the sweep before, made orthogonal to the others; where there is no room, all are forgotten
 * first. */
static void add_difference(kmp_collocation *s)
{
    kmp_mixing *m = &s->mixing;
    m->count = m->count < KMP_COLLOCATION_MIXED ? m->count : 0;
    double *by = m->by[m->count], *to = m->to[m->count];
    differ(size_of(s), s->g, s->change, m->change, m->place, by, to);
    double whole = kmp_collocation_square(s, by);
    for (int j = 0; j < m->count; j++) {
        double part = product(s, m->by[j], by);
        subtract(size_of(s), part, m->by[j], by);
        subtract(size_of(s), part, m->to[j], to);
    }
    double left = m->count > 0 ? kmp_collocation_square(s, by) : whole;
    if (!(left > INDEPENDENT * INDEPENDENT * whole && left <= DBL_MAX))
        return;
    scale(size_of(s), 1 / sqrt(left), by);
    scale(size_of(s), 1 / sqrt(left), to);
    m->count++;
}

double kmp_collocation_mix(kmp_collocation *s, bool first)
{
    kmp_mixing *m = &s->mixing;
    double size = kmp_collocation_square(s, s->change);
    if (!first)
        add_difference(s);
    memcpy(m->change, s->change, size_of(s) * sizeof *s->change);
    add(size_of(s), s->g, s->change, m->place);
    m->on = m->on || (!first && size > SLOWLY * SLOWLY * m->size);
    m->size = size;
    if (!m->on)
        return size;
    memcpy(m->open, s->change, size_of(s) * sizeof *s->change);
    for (int j = 0; j < m->count; j++) {
        double part = product(s, m->by[j], m->open);
        subtract(size_of(s), part, m->by[j], m->open);
        subtract(size_of(s), part, m->to[j], s->change);
    }
    return fmax(size, kmp_collocation_square(s, s->change));
}

enum { E = KMP_COLLOCATION_EIGENVALUES };

/* Size of the differences that make the Jacobian, over the size of the unknown: near the root of rounding. */
static const double DIFFERENCE = 1e-7;

/* -- the Jacobian -------------------------------------------------------------------------------------- */

/* The exact Jacobian at (t, y), without positions and quadratures. */
static int collocation_take_exact(kmp_collocation *s, double t, const double *y, double *jacobian)
{
    s->base.cycles += kmp_collocation_jacobian_cost(s);
    size_t n = (size_t)s->n;
    double *j = s->newton.whole;
    memset(j, 0,
           n * (size_t)(s->p + s->inner) * sizeof *j); /* nothing depends on quadratures: their columns stay zero */
    int said = s->base.ode.jacobian(s->base.ode.self, t, y, j);
    for (int c = 0; c < s->p + s->inner; c++)
        memcpy(jacobian + c * s->inner, j + (size_t)c * n + s->p, (size_t)s->inner * sizeof *j);
    return said;
}

/* Changes unknown k, *x, for a difference; returns by how much. Nothing depends on an unknown whose error is not
 * controlled, but a change by its tolerance would overflow. */
static double collocation_displace(const kmp_collocation *s, int k, double *x)
{
    const double atol = s->base.tolerance.atol[k], before = *x;
    const double size = fabs(before) + (atol < KMP_UNCONTROLLED ? atol / s->base.tolerance.rtol : 1);
    volatile double moved = before + DIFFERENCE * size;
    *x = moved;
    return moved - before;
}

/* A matrix of this number of unknowns may take a part of a second: an interrupt does not wait for its end. */
enum { LONG = 300 };

static bool is_interrupted(int unknowns, kempe_context *context)
{
    return unknowns >= LONG && kmp_interrupted(context);
}

/* Columns by differences: the first lane is at (t, y), each of the others has one unknown changed. */
static int differentiate(kmp_collocation *s, double t, const double *y)
{
    int w = s->w, columns = s->p + s->inner, said = KMP_GO;
    const double *f = s->f + s->all_p * w;
    double by[8];
    for (int l = 0; l < w; l++)
        s->lanes.at[l] = t;
    for (int c = 0; c < columns && said == KMP_GO; c += w - 1) {
        int count = columns - c < w - 1 ? columns - c : w - 1;
        for (int k = 0; k < columns; k++)
            for (int l = 0, at = kmp_collocation_unknown(s, k); l < w; l++)
                s->stage[at * w + l] = y[at];
        for (int l = 1; l <= count; l++) {
            int at = kmp_collocation_unknown(s, c + l - 1);
            by[l] = collocation_displace(s, at, &s->stage[at * w + l]);
        }
        said = is_interrupted(columns, s->base.context) ? KMP_HALT : kmp_collocation_evaluate(s, count + 1);
        for (int l = 1; l <= count && said == KMP_GO; l++)
            for (int k = 0; k < s->inner; k++)
                s->newton.jacobian[(c + l - 1) * s->inner + k] = (f[k * w + l] - f[k * w]) / by[l];
    }
    return said;
}

/* Copies the predicted stage i; returns its time. */
static double collocation_copy_stage(const kmp_collocation *s, int i, double *y)
{
    memcpy(y, s->y, (size_t)s->n * sizeof *y);
    for (int k = 0; k < s->p + s->inner; k++)
        y[kmp_collocation_unknown(s, k)] = s->stage[kmp_collocation_unknown(s, k) * s->w + i];
    return s->lanes.at[i];
}

/* At the predicted middle stage; after an attempt that failed, when predictions are not to be trusted, at the start.
 * The stages are evaluated before, for the first sweep: an exact Jacobian may follow from that. */
static int renew_jacobian(kmp_collocation *s)
{
    int said = KMP_GO;
    double t = collocation_copy_stage(s, s->s / 2, s->newton.place);
    if (s->rejected) {
        t = s->base.t;
        memcpy(s->newton.place, s->y, (size_t)s->n * sizeof *s->y);
    }
    s->base.work.matrices++;
    s->newton.factored = false;
    if (s->newton.whole && kmp_collocation_in_lanes(s)) {
        said = kmp_collocation_evaluate(s, s->s);
        s->evaluated = said == KMP_GO;
    }
    if (said == KMP_GO)
        said = s->newton.whole ? collocation_take_exact(s, t, s->newton.place, s->newton.jacobian)
                               : differentiate(s, t, s->newton.place);
    s->newton.has_jacobian = s->newton.fresh = said == KMP_GO;
    s->newton.age = 0;
    return said;
}

/* -- factors ------------------------------------------------------------------------------------------- */

#define RE(x) KMP_FOUR_AT((x))
#define IM(x) KMP_FOUR_AT((x) + E)

/* The row from k on, of n, with the largest least magnitude in column k. */
static KMP_INTO_CLONES int find_pivot(int n, int k, double *lu)
{
    double best = -1;
    int row = k;
    for (int i = k; i < n; i++) {
        double *x = lu + 2 * E * (i * n + k);
        kmp_four square = RE(x) * RE(x) + IM(x) * IM(x);
        double least = square[0];
        for (int e = 1; e < E; e++)
            least = square[e] < least ? square[e] : least;
        if (least > best) {
            best = least;
            row = i;
        }
    }
    return best > 0 && best <= DBL_MAX ? row : -1;
}

static KMP_INTO_CLONES void swap_rows(int n, int i, int k, double *lu)
{
    double *x = lu + 2 * E * i * n, *y = lu + 2 * E * k * n;
    for (int j = 0; j < 2 * E * n && i != k; j++) {
        double t = x[j];
        x[j] = y[j];
        y[j] = t;
    }
}

/* row -= factor * of, complex, from column k + 1 on; factor = row[k] / pivot, whose inverse is of[k]. */
static KMP_INTO_CLONES void eliminate(int n, int k, const double *of, double *row)
{
    double *x = row + 2 * E * k;
    const double *p = of + 2 * E * k;
    kmp_four re = RE(x) * KMP_FOUR_CONST(p) - IM(x) * KMP_FOUR_CONST(p + E);
    kmp_four im = RE(x) * KMP_FOUR_CONST(p + E) + IM(x) * KMP_FOUR_CONST(p);
    RE(x) = re;
    IM(x) = im;
    for (int j = k + 1; j < n; j++) {
        const double *a = of + 2 * E * j;
        double *b = row + 2 * E * j;
        RE(b) -= re * KMP_FOUR_CONST(a) - im * KMP_FOUR_CONST(a + E);
        IM(b) -= re * KMP_FOUR_CONST(a + E) + im * KMP_FOUR_CONST(a);
    }
}

/* LU with partial pivoting, common to the lanes; the diagonal keeps inverses. false: singular, or interrupted. */
static KMP_CLONES bool factor_lanes(int n, double *lu, int *pivot, kempe_context *context)
{
    for (int k = 0; k < n; k++) {
        if (is_interrupted(n, context))
            return false;
        int row = pivot[k] = find_pivot(n, k, lu);
        if (row < 0)
            return false;
        swap_rows(n, row, k, lu);
        double *x = lu + 2 * E * (k * n + k);
        kmp_four square = RE(x) * RE(x) + IM(x) * IM(x);
        RE(x) = RE(x) / square;
        IM(x) = -IM(x) / square;
        for (int i = k + 1; i < n; i++)
            eliminate(n, k, lu + 2 * E * k * n, lu + 2 * E * i * n);
    }
    return true;
}

/* to -= sum over k from first to end of row[k] x[k], complex. */
static KMP_INTO_CLONES void subtract_products(int first, int end, const double *row, const double *x, double *to)
{
    kmp_four re = RE(to), im = IM(to);
    for (int k = first; k < end; k++) {
        const double *a = row + 2 * E * k, *b = x + 2 * E * k;
        re -= KMP_FOUR_CONST(a) * KMP_FOUR_CONST(b) - KMP_FOUR_CONST(a + E) * KMP_FOUR_CONST(b + E);
        im -= KMP_FOUR_CONST(a) * KMP_FOUR_CONST(b + E) + KMP_FOUR_CONST(a + E) * KMP_FOUR_CONST(b);
    }
    RE(to) = re;
    IM(to) = im;
}

static KMP_CLONES void solve_lanes(int n, const double *lu, const int *pivot, double *x)
{
    for (int k = 0; k < n; k++)
        for (int e = 0; e < 2 * E && pivot[k] != k; e++) {
            double t = x[2 * E * k + e];
            x[2 * E * k + e] = x[2 * E * pivot[k] + e];
            x[2 * E * pivot[k] + e] = t;
        }
    for (int i = 1; i < n; i++)
        subtract_products(0, i, lu + 2 * E * i * n, x, x + 2 * E * i);
    for (int i = n; i-- > 0;) {
        double *to = x + 2 * E * i;
        const double *d = lu + 2 * E * (i * n + i);
        subtract_products(i + 1, n, lu + 2 * E * i * n, x, to);
        kmp_four re = RE(to) * KMP_FOUR_CONST(d) - IM(to) * KMP_FOUR_CONST(d + E);
        IM(to) = RE(to) * KMP_FOUR_CONST(d + E) + IM(to) * KMP_FOUR_CONST(d);
        RE(to) = re;
    }
}

/* I - x f_v - x^2 f_q for h times the eigenvalues x, of n unknowns of which p have positions. */
static KMP_CLONES void fill_lanes(int n, int p, const kmp_collocation_table *t, double h, const double *jacobian,
                                  double *lu)
{
    kmp_four re = {0}, im = {0};
    for (int e = 0; e < E; e++) { /* lanes without an eigenvalue repeat the first one */
        int from = e < t->eigenvalues ? e : 0;
        re[e] = h * t->re[from];
        im[e] = h * t->im[from];
    }
    const kmp_four square = re * re - im * im, twice = 2 * re * im;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++, lu += 2 * E) {
            double v = jacobian[(p + j) * n + i], q = j < p ? jacobian[j * n + i] : 0;
            RE(lu) = (i == j) - re * v - square * q;
            IM(lu) = -im * v - twice * q;
        }
}

/* Factors the matrices of a step h with s->newton.jacobian, if that has not been done. false: they are singular. */
static bool collocation_factor(kmp_collocation *s, double h)
{
    if (s->newton.factored && s->newton.h_matrix == h)
        return true;
    s->base.cycles += kmp_collocation_matrix_cost(s, KMP_ITERATION_NEWTON);
    s->base.work.factorizations++;
    fill_lanes(s->inner, s->p, s->table, h, s->newton.jacobian, s->newton.lu);
    s->newton.h_matrix = h;
    s->newton.factored = factor_lanes(s->inner, s->newton.lu, s->newton.pivot, s->base.context);
    return s->newton.factored;
}

kmp_collocation_outcome kmp_collocation_prepare_newton(kmp_collocation *s, double h)
{
    int said = s->newton.has_jacobian ? KMP_GO : renew_jacobian(s);
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_COLLOCATION_BAD_STAGE : KMP_COLLOCATION_HALTED;
    if (collocation_factor(s, h))
        return KMP_COLLOCATION_TAKEN;
    return is_interrupted(s->inner, s->base.context) ? KMP_COLLOCATION_HALTED : KMP_COLLOCATION_BAD_ITERATION;
}

/* -- corrections --------------------------------------------------------------------------------------- */

/* z[k] = sum over the stages of `into` r[k]; then back. */
static KMP_CLONES void transform(int n, int stages, int w, const double *into, const double *r, double *z)
{
    for (int k = 0; k < n; k++) {
        kmp_four re = {0}, im = {0};
        for (int j = 0; j < stages; j++) {
            re += r[k * w + j] * KMP_FOUR_CONST(into + 2 * E * j);
            im += r[k * w + j] * KMP_FOUR_CONST(into + 2 * E * j + E);
        }
        RE(z + 2 * E * k) = re;
        IM(z + 2 * E * k) = im;
    }
}

/* The stages are lanes; those beyond are zero. */
static KMP_CLONES void transform_back(int n, int w, const double *outof, const double *z, double *r)
{
    for (int k = 0; k < n; k++, z += 2 * E)
        for (int l = 0; l < w; l += KMP_FOUR) {
            const double *of = outof + l;
            kmp_four x = z[0] * KMP_FOUR_CONST(of) - z[E] * KMP_FOUR_CONST(of + w);
            for (int e = 1; e < E; e++)
                x += z[e] * KMP_FOUR_CONST(of + 2 * e * w) - z[E + e] * KMP_FOUR_CONST(of + (2 * e + 1) * w);
            KMP_FOUR_AT(r + k * w + l) = x;
        }
}

void kmp_collocation_correct_newton(kmp_collocation *s, double *change)
{
    transform(s->inner, s->s, s->w, s->newton.into, change, s->newton.z);
    solve_lanes(s->inner, s->newton.lu, s->newton.pivot, s->newton.z);
    transform_back(s->inner, s->w, s->newton.outof, s->newton.z, change);
}

/* With x = h filter: (I - x f_v - x^2 f_q) e_v <- e_v + x f_q e_q, e_q <- e_q + x e_v. */
static void filter(kmp_collocation *s, double *of_positions, double *error)
{
    int n = s->inner;
    double x = s->newton.h_matrix * s->table->filter;
    memset(s->newton.z, 0, (size_t)(2 * E * n) * sizeof *s->newton.z);
    for (int k = 0; k < n; k++) {
        double sum = error[k];
        for (int j = 0; j < s->p; j++)
            sum += x * s->newton.jacobian[j * n + k] * of_positions[j];
        for (int e = 0; e < E; e++)
            s->newton.z[2 * E * k + e] = sum;
    }
    solve_lanes(n, s->newton.lu, s->newton.pivot, s->newton.z);
    for (int k = 0; k < n; k++)
        error[k] = s->newton.z[2 * E * k];
    for (int k = 0; k < s->p; k++)
        of_positions[k] += x * error[k];
}

void kmp_collocation_filter(kmp_collocation *s, int columns)
{
    for (int c = 0; c <= columns; c++)
        filter(s, s->error + c * s->p, s->error + s->all_p + c * s->inner);
}

/* Newton's method for the stages with a Jacobian of each, in one system of all stages:
 *
 *     sum over the stages j of (delta_ij I - h A_ij f_v - (h A)^2_ij f_q) change_j = f(stage i) - g_i
 *
 * with f_q, f_v at stage i. If a stiff force turns its direction along a step, one Jacobian for all stages converges
 * slowly, however smooth the solution is: its error is the stiffness times the turn. This system has no such error and
 * costs more. A column of all Jacobians is one evaluation of all stages, which are the lanes of the rows.
 *
 * The matrix is inverted in place, by Gauss and Jordan: a solution is then a sum of columns, which vector registers do
 * several times as fast as two triangular solutions, each a chain of dependent operations. */

typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));
typedef int64_t eight_mask __attribute__((vector_size(64), aligned(8), may_alias));

/* Largest system of all stages; lanes of a vector. */
enum { MOST_COUPLED = 240, V = 8 };

/* Rows of the system: all lanes of all unknowns, up to a multiple of V. The rows of lanes without a stage are zero. */
static int row_count(const kmp_collocation *s)
{
    return (s->inner * s->w + V - 1) / V * V;
}

bool kmp_collocation_allocate_coupled(kmp_collocation *s)
{
    kmp_arena *a = &s->base.arena;
    int count = s->inner * s->s;
    size_t rows = (size_t)row_count(s);
    if (count > MOST_COUPLED)
        return true;
    s->coupled.all = kmp_arena_aligned(a, (size_t)(s->p + s->inner) * (size_t)s->inner * (size_t)s->w);
    s->coupled.system = kmp_arena_aligned(a, rows * (size_t)count);
    s->coupled.joint = kmp_arena_aligned(a, 2 * rows);
    s->coupled.open = kmp_arena_aligned(a, rows);
    s->coupled.at_prediction = kmp_arena_aligned(a, (size_t)s->n * (size_t)s->w);
    s->coupled.pivot = KMP_ARENA_NEW(a, int, count);
    return !a->failed;
}

/* -- Jacobians ----------------------------------------------------------------------------------------- */

/* Column c of the Jacobians of all stages, f_c; zero in lanes without a stage. */
static int differentiate_at_stages(kmp_collocation *s, int c)
{
    int w = s->w;
    int at = kmp_collocation_unknown(s, c);
    double before[V], by[V] = {0}, *x = s->stage + at * w, *column = s->coupled.all + c * s->inner * w;
    const double *f = s->f + s->all_p * w, *base = s->coupled.at_prediction + s->all_p * w;
    memcpy(before, x, (size_t)w * sizeof *x);
    for (int l = 0; l < w; l++)
        by[l] = collocation_displace(s, at, &x[l]);
    int said = kmp_collocation_evaluate(s, s->s);
    memcpy(x, before, (size_t)w * sizeof *x);
    for (int k = 0; k < s->inner; k++)
        for (int l = 0; l < w; l++)
            column[k * w + l] = l < s->s ? (f[k * w + l] - base[k * w + l]) / by[l] : 0;
    return said;
}

/* The evaluation at the predicted stages is also used for the first iteration. */
static int differentiate_all(kmp_collocation *s)
{
    size_t bytes = (size_t)(s->n * s->w) * sizeof *s->f;
    int said = kmp_collocation_evaluate(s, s->s);
    memcpy(s->coupled.at_prediction, s->f, bytes);
    for (int c = 0; c < s->p + s->inner && said == KMP_GO; c++)
        said = differentiate_at_stages(s, c);
    memcpy(s->f, s->coupled.at_prediction, bytes);
    s->evaluated = said == KMP_GO;
    return said;
}

/* -- the system of all stages -------------------------------------------------------------------------- */

/* column[k] = -once of_v[k] - twice of_q[k], for n unknowns of w lanes; of_q NULL: without. */
static KMP_CLONES void fill_column(int n, int w, const double *once, const double *of_v, const double *twice,
                                   const double *of_q, double *column)
{
    for (int l = 0; l < w; l += KMP_FOUR)
        for (int k = l; k < n * w; k += w)
            KMP_FOUR_AT(column + k) = KMP_FOUR_CONST(once + l) * -KMP_FOUR_CONST(of_v + k);
    for (int l = 0; of_q && l < w; l += KMP_FOUR)
        for (int k = l; k < n * w; k += w)
            KMP_FOUR_AT(column + k) -= KMP_FOUR_CONST(twice + l) * KMP_FOUR_CONST(of_q + k);
}

/* The open row with the largest magnitude, the first of such rows; -1: none is usable. */
static KMP_INTO_CLONES int find_open_row(int rows, const double *column, const double *open)
{
    eight most = {0};
    eight_mask at = {0}, here = {0, 1, 2, 3, 4, 5, 6, 7};
    double best = 0;
    int row = -1;
    for (int i = 0; i < rows; i += V, here += V) {
        eight x = *(const eight *)(column + i) * *(const eight *)(open + i), size = (eight)((eight_mask)x & INT64_MAX);
        eight_mask more = size > most;
        most = (eight)((more & (eight_mask)size) | (~more & (eight_mask)most));
        at = (more & here) | (~more & at);
    }
    for (int l = 0; l < V; l++)
        if (most[l] > best || (row >= 0 && most[l] == best && at[l] < row)) {
            best = most[l];
            row = (int)at[l];
        }
    return best <= DBL_MAX ? row : -1;
}

/* A row of the elimination, the inverse of its pivot, and the column of that, zero in that row. */
typedef struct pivoted {
    int row;
    double inverse, *column;
} pivoted;

/* Takes the pivot of a column, which becomes a column of the inverse. false: none is usable. */
static KMP_INTO_CLONES bool take_pivot(int rows, double *own, double *open, pivoted *p)
{
    p->row = find_open_row(rows, own, open);
    if (p->row < 0)
        return false;
    p->inverse = 1 / own[p->row];
    open[p->row] = 0;
    memcpy(p->column, own, (size_t)rows * sizeof *own);
    p->column[p->row] = 0;
    for (int i = 0; i < rows; i += V)
        *(eight *)(own + i) = *(eight *)(p->column + i) * -p->inverse;
    own[p->row] = p->inverse;
    return true;
}

static KMP_INTO_CLONES void eliminate_one(int rows, const pivoted *p, double *other)
{
    double f = other[p->row] * p->inverse;
    for (int i = 0; i < rows; i += V)
        *(eight *)(other + i) -= f * *(const eight *)(p->column + i);
    other[p->row] = f;
}

/* One elimination after the other in one pass over the column, which halves the transfers from and to memory. */
static KMP_INTO_CLONES void eliminate_two(int rows, const pivoted *p, const pivoted *next, double *restrict other)
{
    const double *x = p->column, *y = next->column;
    double f = other[p->row] * p->inverse, g = (other[next->row] - f * x[next->row]) * next->inverse;
    for (int i = 0; i < rows; i += V)
        *(eight *)(other + i) = (*(eight *)(other + i) - f * *(const eight *)(x + i)) - g * *(const eight *)(y + i);
    other[p->row] = f - g * y[p->row];
    other[next->row] = g;
}

/* Eliminates columns k and k + 1, or only k if it is the last, from all others. */
static KMP_INTO_CLONES bool eliminate_pair(int rows, int count, int k, double *a, double *room, double *open,
                                           int *pivot)
{
    double *own = a + (ptrdiff_t)k * rows, *beside = own + rows;
    pivoted p = {.column = room}, next = {.column = room + rows};
    bool single = k + 1 == count;
    if (!take_pivot(rows, own, open, &p))
        return false;
    pivot[k] = p.row;
    if (!single) {
        eliminate_one(rows, &p, beside);
        if (!take_pivot(rows, beside, open, &next))
            return false;
        pivot[k + 1] = next.row;
        eliminate_one(rows, &next, own);
    }
    for (int j = 0; j < count; j++) {
        double *other = a + (ptrdiff_t)j * rows;
        if (j == k || j == k + 1)
            continue;
        if (single)
            eliminate_one(rows, &p, other);
        else
            eliminate_two(rows, &p, &next, other);
    }
    return true;
}

static KMP_INTO_CLONES bool invert_rows(int rows, int count, double *a, double *room, double *open, int *pivot)
{
    for (int i = 0; i < rows; i++)
        open[i] = 1;
    for (int k = 0; k < count; k += 2)
        if (!eliminate_pair(rows, count, k, a, room, open, pivot))
            return false;
    return true;
}

/* Inverts in place, rows x count: the row of unknown k is pivot[k], whose column is the column of b[pivot[k]]. No row
 * moves: `open` is 1 in rows that may be pivots. room: 2 rows values. Loops over the rows of four unknowns and fewer
 * are unrolled. false: singular. */
static KMP_CLONES bool invert(int rows, int count, double *a, double *room, double *open, int *pivot)
{
    return rows == V       ? invert_rows(V, count, a, room, open, pivot)
           : rows == 2 * V ? invert_rows(2 * V, count, a, room, open, pivot)
           : rows == 4 * V ? invert_rows(4 * V, count, a, room, open, pivot)
                           : invert_rows(rows, count, a, room, open, pivot);
}

/* x = sum of the columns times b. */
static KMP_CLONES void multiply(int rows, int count, const double *a, const int *pivot, const double *b, double *x)
{
    for (int i = 0; i < rows; i += V) {
        eight sum = {0};
        for (int j = 0; j < count; j++)
            sum += b[pivot[j]] * *(const eight *)(a + (ptrdiff_t)j * rows + i);
        *(eight *)(x + i) = sum;
    }
}

kmp_collocation_outcome kmp_collocation_prepare_coupled(kmp_collocation *s, double h)
{
    /* Matrices of all stages. */
    s->base.work.matrices += s->s;
    s->newton.factored = false;
    int said = s->newton.whole ? KMP_GO : differentiate_all(s);
    for (int i = 0; s->newton.whole && i < s->s && said == KMP_GO; i++) {
        double t = collocation_copy_stage(s, i, s->newton.place);
        said = collocation_take_exact(s, t, s->newton.place, s->newton.jacobian);
        for (int k = 0; k < (s->p + s->inner) * s->inner; k++)
            s->coupled.all[k * s->w + i] = s->newton.jacobian[k];
    }
    for (int k = 0; k < (s->p + s->inner) * s->inner; k++) /* for the filter of the estimate */
        s->newton.jacobian[k] = s->coupled.all[k * s->w];
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_COLLOCATION_BAD_STAGE : KMP_COLLOCATION_HALTED;
    bool ready = collocation_factor(s, h) && kmp_collocation_couple(s, s->coupled.all);
    return ready ? KMP_COLLOCATION_TAKEN : KMP_COLLOCATION_BAD_ITERATION;
}

bool kmp_collocation_couple(kmp_collocation *s, const double *of)
{
    /* Columns of unknowns c of stages j; rows of an unknown are its lanes. */
    int n = s->inner, w = s->w, rows = row_count(s), size = n * w;
    for (int c = 0; c < n; c++)
        for (int j = 0; j < s->s; j++) {
            double *column = s->coupled.system + (ptrdiff_t)(c * s->s + j) * rows;
            fill_column(n, w, s->lanes.once + j * w, of + (s->p + c) * size, s->lanes.twice + j * w,
                        c < s->p ? of + c * size : NULL, column);
            column[c * w + j] += 1;
            memset(column + size, 0, (size_t)(rows - size) * sizeof *column);
            for (int k = s->s; k < size; k += k % w == w - 1 ? 1 + s->s : 1)
                column[k] = 0;
        }
    s->base.cycles += kmp_collocation_matrix_cost(s, KMP_ITERATION_COUPLED);
    return invert(rows, n * s->s, s->coupled.system, s->coupled.joint, s->coupled.open, s->coupled.pivot);
}

void kmp_collocation_correct_coupled(kmp_collocation *s, double *change)
{
    int w = s->w, count = s->inner * s->s;
    multiply(row_count(s), count, s->coupled.system, s->coupled.pivot, change, s->coupled.joint);
    for (int k = 0; k < count; k++)
        change[k / s->s * w + k % s->s] = s->coupled.joint[s->coupled.pivot[k]];
}
