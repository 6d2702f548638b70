/* SPDX-License-Identifier: BSD-3-Clause */
/* The stages of Radau IIA by Newton's method, with two kinds of Jacobian.
 *
 * With one Jacobian, at the start of the step: transformed by the eigenvectors of the method, an iteration is one real
 * system and some complex ones of the size of the problem. Jacobian and factors serve several steps (Hairer, Wanner,
 * II, IV.8). If a stiff force turns its direction along a step it converges slowly, however smooth the solution is: its
 * error is the stiffness times the turn.
 *
 * With the Jacobians of all stages, at their predicted places: one system of all stages, which has no such error and
 * costs more. */
#include "integrators/steppers/radau.h"
#include "linalg/dense/dense.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { S = KMP_RADAU_MAX_STAGES };

/* -- Jacobians --------------------------------------------------------------------------------------- */

/* Computes the Jacobian by differences at y, if the formulation has none. */
static int differentiate(kmp_radau *s)
{
    for (int k = 0; k < s->n; k++) {
        double *column = s->jacobian[0] + k * s->n;
        memcpy(s->trial, s->y, (size_t)s->n * sizeof *s->y);
        volatile double moved = s->y[k] + sqrt(DBL_EPSILON * fmax(1e-5, fabs(s->y[k])));
        double by = moved - s->y[k];
        s->trial[k] = moved;
        int said = kmp_solver_call(&s->base, s->base.t, s->trial, column);
        if (said == KMP_RETRY) {
            by = -by;
            s->trial[k] = s->y[k] + by;
            said = kmp_solver_call(&s->base, s->base.t, s->trial, column);
        }
        if (said != KMP_GO)
            return said;
        for (int i = 0; i < s->n; i++)
            column[i] = (column[i] - s->dy[i]) / by;
    }
    return KMP_GO;
}

static int evaluate_jacobian(kmp_radau *s, double t, const double *y, double *j)
{
    s->base.work.matrices++;
    memset(j, 0, (size_t)s->n * (size_t)s->n * sizeof *j);
    return s->base.ode.jacobian(s->base.ode.self, t, y, j);
}

static int renew_jacobian(kmp_radau *s)
{
    int said;
    s->factored = false;
    if (s->base.ode.jacobian)
        said = evaluate_jacobian(s, s->base.t, s->y, s->jacobian[0]);
    else {
        s->base.work.matrices++;
        said = differentiate(s);
    }
    s->has_jacobian = s->fresh = said == KMP_GO;
    return said;
}

/* -- one Jacobian for all stages --------------------------------------------------------------------- */

/* Factors g - J22 - J21 / g; false: singular. */
static bool factor(const kmp_radau *s, kmp_radau_block *e, double re, double im)
{
    int n = s->n, p = s->p, inner = s->inner;
    double square = re * re + im * im, by_re = re / square, by_im = -im / square;
    e->g_re = re;
    e->g_im = im;
    for (int j = 0; j < inner; j++) {
        const double *own = s->jacobian[0] + (p + j) * n + p, *of = s->jacobian[0] + j * n + p;
        double *to = e->re + j * inner, *to_im = e->im ? e->im + j * inner : NULL;
        for (int i = 0; i < inner; i++)
            to[i] = -own[i] - (j < p ? by_re * of[i] : 0);
        for (int i = 0; to_im && i < inner; i++)
            to_im[i] = j < p ? -by_im * of[i] : 0;
        to[j] += re;
        if (to_im)
            to_im[j] += im;
    }
    return (e->im ? kmp_lu_complex_factor(inner, e->re, e->im, e->pivot) : kmp_lu_factor(inner, e->re, e->pivot)) == 0;
}

static bool factor_all(kmp_radau *s, double h)
{
    const kmp_radau_method *m = s->method;
    s->base.work.factorizations++;
    bool good = factor(s, &s->real, m->g / h, 0);
    for (int i = 0; good && i < m->pairs; i++)
        good = factor(s, &s->complex[i], m->a[i] / h, m->b[i] / h);
    s->factored = good;
    s->h_matrix = h;
    return good;
}

void kmp_radau_filter(const kmp_radau *s, double *x)
{
    int n = s->n, p = s->p, end = p + s->inner;
    double g = s->real.g_re;
    for (int j = 0; j < p; j++) {
        const double *column = s->jacobian[0] + j * n;
        x[j] /= g;
        for (int i = p; i < end; i++)
            x[i] += column[i] * x[j];
    }
    kmp_lu_solve(s->inner, s->real.re, s->real.pivot, 1, x + p);
    for (int j = 0; j < p; j++)
        x[j] += x[p + j] / g;
    for (int i = end; i < n; i++) {
        for (int j = 0; j < end; j++)
            x[i] += s->jacobian[0][i + j * n] * x[j];
        x[i] /= g;
    }
}

/* Solves with the factors for a complex g. */
static void solve_complex(const kmp_radau *s, const kmp_radau_block *e, double *re, double *im)
{
    int n = s->n, p = s->p, end = p + s->inner;
    double square = e->g_re * e->g_re + e->g_im * e->g_im, by_re = e->g_re / square, by_im = -e->g_im / square;
    for (int j = 0; j < p; j++) {
        const double *column = s->jacobian[0] + j * n;
        double x = re[j] * by_re - im[j] * by_im, y = re[j] * by_im + im[j] * by_re;
        re[j] = x;
        im[j] = y;
        for (int i = p; i < end; i++) {
            re[i] += column[i] * x;
            im[i] += column[i] * y;
        }
    }
    kmp_lu_complex_solve(s->inner, e->re, e->im, e->pivot, re + p, im + p);
    for (int j = 0; j < p; j++) {
        double x = re[p + j], y = im[p + j];
        re[j] += x * by_re - y * by_im;
        im[j] += x * by_im + y * by_re;
    }
    for (int i = end; i < n; i++) {
        for (int j = 0; j < end; j++) {
            re[i] += s->jacobian[0][i + j * n] * re[j];
            im[i] += s->jacobian[0][i + j * n] * im[j];
        }
        double x = re[i], y = im[i];
        re[i] = x * by_re - y * by_im;
        im[i] = x * by_im + y * by_re;
    }
}

/* out = matrix in, by stages. */
static void transform(const kmp_radau *s, const double *matrix, double *const *in, double *const *out)
{
    for (int i = 0; i < s->s; i++) {
        double *restrict to = out[i];
        const double *row = matrix + i * S;
        for (int k = 0; k < s->n; k++)
            to[k] = row[0] * in[0][k];
        for (int j = 1; j < s->s; j++) {
            const double *from = in[j];
            for (int k = 0; k < s->n; k++)
                to[k] += row[j] * from[k];
        }
    }
}

/* Turns the right-hand sides in f into transformed corrections of the stages. */
static void correct_apart(kmp_radau *s)
{
    const kmp_radau_method *m = s->method;
    double *const *change = s->change;
    transform(s, m->inverse[0], s->f, change);
    for (int k = 0; k < s->n; k++)
        change[0][k] -= s->real.g_re * s->u[0][k];
    kmp_radau_filter(s, change[0]);
    for (int pair = 0; pair < m->pairs; pair++) {
        const kmp_radau_block *e = &s->complex[pair];
        double *re = change[1 + 2 * pair], *im = change[2 + 2 * pair];
        const double *u = s->u[1 + 2 * pair], *v = s->u[2 + 2 * pair];
        for (int k = 0; k < s->n; k++) {
            re[k] -= e->g_re * u[k] + e->g_im * v[k];
            im[k] = e->g_re * v[k] - e->g_im * u[k] - im[k];
        }
        solve_complex(s, e, re, im);
        for (int k = 0; k < s->n; k++)
            im[k] = -im[k];
    }
    for (int i = 0; i < s->s; i++)
        for (int k = 0; k < s->n; k++)
            s->u[i][k] += change[i][k];
    transform(s, m->t[0], change, s->f);
}

/* -- Jacobians of all stages ------------------------------------------------------------------------- */

/* Block (i, j) is d / h - (i = j) J22 - h a J21 with J of stage i. */
static bool factor_together(kmp_radau *s, double h)
{
    int n = s->n, p = s->p, inner = s->inner, size = inner * s->s;
    s->base.work.factorizations++;
    for (int j = 0; j < s->s; j++)
        for (int l = 0; l < inner; l++) {
            double *column = s->coupled + (j * inner + l) * size;
            for (int i = 0; i < s->s; i++) {
                double *to = column + i * inner, ha = h * s->method->butcher[i][j];
                const double *own = s->jacobian[i] + (p + l) * n + p, *of = s->jacobian[i] + l * n + p;
                for (int k = 0; k < inner; k++)
                    to[k] = (i == j ? -own[k] : 0) - (l < p ? ha * of[k] : 0);
                to[l] += s->method->d[i][j] / h;
            }
        }
    return factor(s, &s->real, s->method->g / h, 0) && kmp_lu_factor(size, s->coupled, s->coupled_pivot) == 0;
}

/* Puts y of stage i of a step h into s->trial; returns its time. */
static double place_stage(kmp_radau *s, int i, double h)
{
    for (int k = 0; k < s->n; k++)
        s->trial[k] = s->y[k] + s->z[i][k];
    return s->base.t + s->method->c[i] * h;
}

/* Evaluates the Jacobian of each stage at its predicted place. */
static kmp_radau_outcome prepare_together(kmp_radau *s, double h)
{
    for (int i = 0; i < s->s; i++) {
        int said = evaluate_jacobian(s, place_stage(s, i, h), s->trial, s->jacobian[i]);
        if (said != KMP_GO)
            return said == KMP_RETRY ? KMP_RADAU_BAD_STAGE : KMP_RADAU_HALTED;
    }
    return factor_together(s, h) ? KMP_RADAU_TAKEN : KMP_RADAU_BAD_NEWTON;
}

/* Turns the right-hand sides in f into corrections of the stages. */
static void correct_together(kmp_radau *s, double h)
{
    int n = s->n, p = s->p, inner = s->inner, end = p + inner;
    double *const *r = s->change, *const *x = s->f;
    transform(s, s->method->d[0], s->z, r);
    for (int i = 0; i < s->s; i++)
        for (int k = 0; k < n; k++)
            r[i][k] = x[i][k] - r[i][k] / h;
    transform(s, s->method->butcher[0], r, x); /* of which only positions and quadratures are used */
    for (int i = 0; i < s->s; i++) {
        double *to = s->joint + i * inner;
        memcpy(to, r[i] + p, (size_t)inner * sizeof *to);
        for (int j = 0; j < p; j++)
            for (int k = 0; k < inner; k++)
                to[k] += s->jacobian[i][p + k + j * n] * h * x[i][j];
    }
    kmp_lu_solve(inner * s->s, s->coupled, s->coupled_pivot, 1, s->joint);
    for (int i = 0; i < s->s; i++)
        memcpy(r[i] + p, s->joint + i * inner, (size_t)inner * sizeof *s->joint);
    for (int i = 0; i < s->s; i++)
        for (int j = 0; j < s->s; j++)
            for (int k = 0; k < p; k++)
                x[i][k] = (j == 0 ? h * x[i][k] : x[i][k]) + h * s->method->butcher[i][j] * r[j][p + k];
    for (int i = 0; i < s->s; i++)
        memcpy(x[i] + p, r[i] + p, (size_t)inner * sizeof *s->joint);
    for (int k = end; k < n; k++) {
        double rest[S];
        for (int i = 0; i < s->s; i++) {
            rest[i] = r[i][k];
            for (int j = 0; j < end; j++)
                rest[i] += s->jacobian[i][k + j * n] * x[i][j];
        }
        for (int i = 0; i < s->s; i++) {
            x[i][k] = 0;
            for (int j = 0; j < s->s; j++)
                x[i][k] += h * s->method->butcher[i][j] * rest[j];
        }
    }
}

/* -- Newton ------------------------------------------------------------------------------------------ */

void kmp_radau_extrapolate(const kmp_radau *s, double x, double *z)
{
    double weight[S], factor = kmp_radau_weight(s->method, x);
    kmp_radau_weights(s->method, x, weight);
    weight[s->s - 1] -= 1;
    for (int k = 0; k < s->n; k++)
        z[k] = factor * s->factor[k];
    for (int j = 0; j < s->s; j++)
        for (int k = 0; k < s->n; k++)
            z[k] += weight[j] * s->z_old[j][k];
}

static kmp_radau_outcome begin(kmp_radau *s, double h)
{
    for (int i = 0; i < s->s; i++) {
        if (s->has_step)
            kmp_radau_extrapolate(s, 1 + s->method->c[i] * h / s->taken, s->z[i]);
        else
            memset(s->z[i], 0, (size_t)s->n * sizeof(double));
    }
    if (s->together)
        return prepare_together(s, h);
    if (!s->has_jacobian && renew_jacobian(s) != KMP_GO)
        return KMP_RADAU_HALTED;
    if ((!s->factored || s->h_matrix != h) && !factor_all(s, h))
        return KMP_RADAU_BAD_NEWTON;
    transform(s, s->method->inverse[0], s->z, s->u);
    return KMP_RADAU_TAKEN;
}

/* Evaluates f at all stages. */
static kmp_radau_outcome evaluate(kmp_radau *s, double h)
{
    for (int i = 0; i < s->s; i++) {
        int said = kmp_solver_call(&s->base, place_stage(s, i, h), s->trial, s->f[i]);
        if (said != KMP_GO)
            return said == KMP_RETRY ? KMP_RADAU_BAD_STAGE : KMP_RADAU_HALTED;
    }
    return KMP_RADAU_TAKEN;
}

/* Makes one iteration; returns the size of its correction. */
static double iterate(kmp_radau *s, double h)
{
    double sum = 0;
    if (s->together)
        correct_together(s, h);
    else
        correct_apart(s);
    for (int i = 0; i < s->s; i++)
        for (int k = 0; k < s->n; k++) {
            double e = s->f[i][k] / s->scale[k];
            s->z[i][k] += s->f[i][k];
            sum += e * e;
        }
    s->base.work.newton++;
    return sqrt(sum / (s->n * s->s));
}

/* True if Newton's method converges after iteration k, by the ratio of the last two corrections. */
static bool is_hopeful(kmp_radau *s, int k, double size, double *shorter)
{
    if (!(s->contraction < 0.99))
        return false;
    s->ready = s->contraction / (1 - s->contraction);
    int more = s->most_iterations - 1 - k;
    double last = s->ready * size * pow(s->contraction, more) / s->limit;
    if (last < 1)
        return true;
    *shorter = 0.8 * pow(fmax(1e-4, fmin(20, last)), -1.0 / (4 + more));
    return false;
}

kmp_radau_outcome kmp_radau_find_stages(kmp_radau *s, double h, double *shorter)
{
    double before = 0, before_rate = 0;
    *shorter = 0.5;
    s->ready = 1; /* the last step's value is a poor bound for one that may be four times as long */
    s->contraction = 0;
    kmp_radau_outcome what = begin(s, h);
    for (int k = 1; what == KMP_RADAU_TAKEN && k <= s->most_iterations; k++) {
        what = evaluate(s, h);
        if (what != KMP_RADAU_TAKEN)
            return what;
        double size = iterate(s, h);
        if (!(size <= DBL_MAX))
            return KMP_RADAU_BAD_NEWTON;
        if (k > 1 && k < s->most_iterations) {
            double rate = size / before;
            s->contraction = k == 2 ? rate : sqrt(rate * before_rate);
            before_rate = rate;
            if (!is_hopeful(s, k, size, shorter))
                return KMP_RADAU_BAD_NEWTON;
        }
        before = fmax(size, DBL_EPSILON);
        if (s->ready * size <= s->limit)
            return KMP_RADAU_TAKEN;
    }
    return what == KMP_RADAU_TAKEN ? KMP_RADAU_BAD_NEWTON : what;
}
