/* SPDX-License-Identifier: BSD-3-Clause */
/* Simplified Newton's method for the stages, with one Jacobian f_q, f_v for all of them:
 *
 *     (I - h A (x) f_v - (h A)^2 (x) f_q) change = f(stages) - g
 *
 * is, in the eigenvectors of A, one system of the size of g for each eigenvalue (Hairer, Wanner, Solving Ordinary
 * Differential Equations II, 2nd ed., IV.8). The eigenvalues, four at most, are the lanes of the factors. */
#include "integrators/steppers/collocation_newton.h"
#include "base/clones.h"
#include "base/simd4.h"
#include "integrators/steppers/collocation.h"
#include "integrators/steppers/collocation_choice.h"
#include "integrators/steppers/collocation_step.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { E = KMP_COLLOCATION_EIGENVALUES };

/* Size of the differences that make the Jacobian, over that of the unknown: near the root of rounding. */
static const double DIFFERENCE = 1e-7;

/* -- the Jacobian -------------------------------------------------------------------------------------- */

int kmp_collocation_take_exact(kmp_collocation *s, double t, const double *y, double *jacobian)
{
    s->base.cycles += kmp_collocation_jacobian_cost(s);
    size_t n = (size_t)s->n;
    double *j = s->whole;
    memset(j, 0, n * n * sizeof *j);
    int said = s->base.ode.jacobian(s->base.ode.self, t, y, j);
    for (int c = 0; c < s->p + s->inner; c++)
        memcpy(jacobian + c * s->inner, j + (size_t)c * n + s->p, (size_t)s->inner * sizeof *j);
    return said;
}

double kmp_collocation_displace(const kmp_collocation *s, int k, double *x)
{
    double size = fabs(*x) + s->base.tolerance.atol[k] / s->base.tolerance.rtol, before = *x;
    volatile double moved = before + DIFFERENCE * size;
    *x = moved;
    return moved - before;
}

/* Columns by differences: the first lane is at (t, y), each of the others has one unknown changed. */
static int differentiate(kmp_collocation *s, double t, const double *y)
{
    int w = s->w, columns = s->p + s->inner, said = KMP_GO;
    const double *f = s->f + s->p * w;
    double by[8];
    for (int l = 0; l < w; l++)
        s->at[l] = t;
    for (int c = 0; c < columns && said == KMP_GO; c += w - 1) {
        int count = columns - c < w - 1 ? columns - c : w - 1;
        for (int k = 0; k < columns; k++)
            for (int l = 0; l < w; l++)
                s->stage[k * w + l] = y[k];
        for (int l = 1; l <= count; l++)
            by[l] = kmp_collocation_displace(s, c + l - 1, &s->stage[(c + l - 1) * w + l]);
        said = kmp_collocation_evaluate(s, count + 1);
        for (int l = 1; l <= count && said == KMP_GO; l++)
            for (int k = 0; k < s->inner; k++)
                s->jacobian[(c + l - 1) * s->inner + k] = (f[k * w + l] - f[k * w]) / by[l];
    }
    return said;
}

double kmp_collocation_copy_stage(const kmp_collocation *s, int i, double *y)
{
    for (int k = 0; k < s->n; k++)
        y[k] = k < s->p + s->inner ? s->stage[k * s->w + i] : s->y[k];
    return s->at[i];
}

/* At the predicted middle stage; after an attempt that failed, when predictions are not to be trusted, at the start. */
static int renew_jacobian(kmp_collocation *s)
{
    double t = kmp_collocation_copy_stage(s, s->s / 2, s->place);
    if (s->rejected) {
        t = s->base.t;
        memcpy(s->place, s->y, (size_t)s->n * sizeof *s->y);
    }
    s->base.work.matrices++;
    s->factored = false;
    int said = s->whole ? kmp_collocation_take_exact(s, t, s->place, s->jacobian) : differentiate(s, t, s->place);
    s->has_jacobian = s->fresh = said == KMP_GO;
    s->age = 0;
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

/* LU with partial pivoting, common to the lanes; the diagonal keeps inverses. false: singular. */
static KMP_CLONES bool factor_lanes(int n, double *lu, int *pivot)
{
    for (int k = 0; k < n; k++) {
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

bool kmp_collocation_factor(kmp_collocation *s, double h)
{
    if (s->factored && s->h_matrix == h)
        return true;
    s->base.cycles += kmp_collocation_matrix_cost(s, KMP_ITERATION_NEWTON);
    s->base.work.factorizations++;
    fill_lanes(s->inner, s->p, s->table, h, s->jacobian, s->lu);
    s->h_matrix = h;
    s->factored = factor_lanes(s->inner, s->lu, s->pivot);
    return s->factored;
}

kmp_collocation_outcome kmp_collocation_prepare_newton(kmp_collocation *s, double h)
{
    int said = s->has_jacobian ? KMP_GO : renew_jacobian(s);
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_COLLOCATION_BAD_STAGE : KMP_COLLOCATION_HALTED;
    return kmp_collocation_factor(s, h) ? KMP_COLLOCATION_TAKEN : KMP_COLLOCATION_BAD_ITERATION;
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

void kmp_collocation_correct_newton(kmp_collocation *s)
{
    transform(s->inner, s->s, s->w, s->into, s->change, s->z);
    solve_lanes(s->inner, s->lu, s->pivot, s->z);
    transform_back(s->inner, s->w, s->outof, s->z, s->change);
}

/* With x = h filter: (I - x f_v - x^2 f_q) e_v <- e_v + x f_q e_q, e_q <- e_q + x e_v. */
void kmp_collocation_filter(kmp_collocation *s)
{
    int n = s->inner;
    double x = s->h_matrix * s->table->filter, *error = s->error + s->p;
    memset(s->z, 0, (size_t)(2 * E * n) * sizeof *s->z);
    for (int k = 0; k < n; k++) {
        double sum = error[k];
        for (int j = 0; j < s->p; j++)
            sum += x * s->jacobian[j * n + k] * s->error[j];
        for (int e = 0; e < E; e++)
            s->z[2 * E * k + e] = sum;
    }
    solve_lanes(n, s->lu, s->pivot, s->z);
    for (int k = 0; k < n; k++)
        error[k] = s->z[2 * E * k];
    for (int k = 0; k < s->p; k++)
        s->error[k] += x * error[k];
}
