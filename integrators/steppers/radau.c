/* SPDX-License-Identifier: BSD-3-Clause */
/* Radau IIA of 3 and 5 stages (orders 5 and 9) for stiff systems: a filtered error of the order of the stages, which
 * predicts the next step. Stages start on the last step's polynomial, which also gives dense output (Hairer, Wanner,
 * Solving Ordinary Differential Equations II, 2nd ed., IV.8; with more stages, J. Comput. Appl. Math. 111 (1999) 93).
 *
 * A one-step method: the formulation corrects y between steps. */
#include "integrators/steppers/radau.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { MAX_REJECT = 1000 };

/* Safety, least and largest quotient of two steps. Hairer's bound is eight: the leading coefficients of two such steps
 * would give a poor estimate. */
static const double SAFETY = 0.9, SHRINK = 0.2, GROW = 4;
/* Contraction of Newton's method below which the Jacobian is kept. */
static const double KEEP_JACOBIAN = 1e-3;
/* Largest quotient of the next step with which the step size and its factors are kept. */
static const double KEEP_STEP = 1.2;
static const double ERROR_FLOOR = 1e-10, OLD_ERROR_FLOOR = 1e-2;
/* Largest system of all stages together. */
enum { MOST_COUPLED = 240 };
/* The system of all stages is used if the error permits steps longer than those with one Jacobian by WORTH, and more if
 * the system is larger than CHEAP; initially for this many steps. */
static const double WORTH = 1.4, CHEAP = 60;
enum { PATIENCE = 20, MOST_PATIENCE = 5000 };

/* -- creation ---------------------------------------------------------------------------------------- */

static void allocate(kmp_radau *s)
{
    int n = s->n, inner = s->inner, square = inner * inner, all = inner * s->s;
    bool coupled = s->base.ode.jacobian && all <= MOST_COUPLED;
    kmp_arena *a = &s->base.arena;
    (void)KMP_ARENA_GROUPS(
        a, {n, {&s->y, &s->y_old, &s->dy, &s->trial, &s->scale, &s->w, &s->error, &s->factor, &s->lead, &s->lead_old}});
    for (int i = 0; i < s->s; i++) {
        (void)KMP_ARENA_GROUPS(a, {n, {&s->z[i], &s->z_old[i], &s->u[i], &s->f[i], &s->change[i]}});
        if (i == 0 || coupled)
            s->jacobian[i] = KMP_ARENA_NEW(a, double, n *n);
    }
    s->real = (kmp_radau_block){.re = KMP_ARENA_NEW(a, double, square), .pivot = KMP_ARENA_NEW(a, int, inner)};
    for (int i = 0; i < s->method->pairs; i++)
        s->complex[i] = (kmp_radau_block){.re = KMP_ARENA_NEW(a, double, square),
                                          .im = KMP_ARENA_NEW(a, double, square),
                                          .pivot = KMP_ARENA_NEW(a, int, inner)};
    if (coupled) {
        s->coupled = KMP_ARENA_NEW(a, double, all *all);
        s->joint = KMP_ARENA_NEW(a, double, all);
        s->coupled_pivot = KMP_ARENA_NEW(a, int, all);
    }
}

/* Sets the limits of error and Newton's method. The estimate is of order s, the method of order 2 s - 1: the tolerance
 * is met with weights of a part rtol^((s + 1) / (2 s)) of the values (Hairer's choice). Newton's method continues to
 * the tolerance itself. */
static void choose_limits(kmp_radau *s)
{
    double part = (s->s + 1) / (2.0 * s->s);
    double rtol = 0.1 * pow(s->base.tolerance.rtol, part);
    s->widen = rtol / s->base.tolerance.rtol;
    s->limit = fmax(10 * DBL_EPSILON / rtol, fmin(0.03, pow(rtol, 1 / part - 1)));
    s->most_iterations = 7 + (s->s - 3) * 5 / 2;
}

static void *create(const kmp_solver_kind *kind, const kmp_solver_setup *setup)
{
    kmp_radau *s = kmp_solver_new(kind, setup, sizeof *s);
    if (!s)
        return NULL;
    s->n = s->base.ode.n;
    s->method = kind->method;
    s->s = s->method->stages;
    s->p = s->base.ode.positions;
    s->inner = s->n - s->p - s->base.ode.quadratures;
    choose_limits(s);
    allocate(s);
    return kmp_solver_made(s);
}

/* -- start ------------------------------------------------------------------------------------------- */

static void weigh(kmp_radau *s)
{
    for (int i = 0; i < s->n; i++)
        s->scale[i] = s->widen * (s->base.tolerance.atol[i] + s->base.tolerance.rtol * fabs(s->y[i]));
}

static double norm(const kmp_radau *s, const double *a)
{
    double sum = 0;
    for (int i = 0; i < s->n; i++) {
        double e = a[i] / s->scale[i];
        sum += e * e;
    }
    return sqrt(sum / s->n);
}

static kempe_status start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    kmp_radau *s = solver;
    (void)yp;
    kmp_solver_begin(&s->base, t, t_end, h0);
    s->first = true;
    s->rejected = s->has_step = s->has_jacobian = s->fresh = s->factored = s->collapsed = false;
    s->together = s->newton_limits = false;
    s->patience = PATIENCE;
    memcpy(s->y, y, (size_t)s->n * sizeof *y);
    int said = kmp_solver_call(&s->base, t, s->y, s->dy);
    if (said == KMP_GO && h0 == 0 && t_end > t) {
        weigh(s);
        said = kmp_solver_first_step(&s->base, s->s + 1, s->y, s->dy, s->scale, s->trial, s->f[0]);
    }
    return said == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}

/* -- one attempt ------------------------------------------------------------------------------------- */

/* Computes (g/h - J)^-1 (f - p'(0) / h) into `error`; returns its size. */
static double defect(kmp_radau *s, double h, const double *f)
{
    const double *slope = s->method->slope;
    for (int k = 0; k < s->n; k++) {
        double sum = 0;
        for (int j = 0; j < s->s; j++)
            sum += slope[j] * s->z[j][k];
        s->error[k] = f[k] - sum / h;
    }
    kmp_radau_filter(s, s->error);
    return norm(s, s->error);
}

/* Difference from a polynomial of one degree more, by the leading coefficients of two steps. The filter removes the
 * stiff part of the estimate, which dense output contains like the rest. */
static double misfit(kmp_radau *s, double h)
{
    const double *weight = s->method->node_weight + 1;
    double ratio = h / s->taken, power = pow(ratio, s->s);
    double by = s->method->gap / ((s->s + 1) * (s->method->centre + (1 - s->method->centre) / ratio)), sum = 0;
    memset(s->lead, 0, (size_t)s->n * sizeof *s->lead);
    for (int j = 0; j < s->s; j++)
        for (int k = 0; k < s->n; k++)
            s->lead[k] += weight[j] * s->z[j][k];
    if (!s->has_step)
        return 0;
    for (int k = 0; k < s->n; k++) {
        double e = by * (s->lead[k] - power * s->lead_old[k]) / s->scale[k];
        sum += e * e;
    }
    return sqrt(sum / s->n);
}

/* The error estimate (IV.8.19, 20), with a second filter if the first leaves the stiff part of a start or of a rejected
 * step. */
static kmp_radau_outcome estimate(kmp_radau *s, double h, double *error)
{
    *error = defect(s, h, s->dy);
    if (*error >= 1 && (s->first || s->rejected)) {
        for (int k = 0; k < s->n; k++)
            s->trial[k] = s->y[k] + s->error[k];
        int said = kmp_solver_call(&s->base, s->base.t, s->trial, s->f[0]);
        if (said == KMP_HALT)
            return KMP_RADAU_HALTED;
        if (said == KMP_GO)
            *error = defect(s, h, s->f[0]);
    }
    double gap = misfit(s, h);
    *error = isfinite(*error + gap) ? fmax(fmax(*error, gap), ERROR_FLOOR) : INFINITY;
    return *error < 1 ? KMP_RADAU_TAKEN : KMP_RADAU_BAD_ERROR;
}

/* Asks the formulation to accept the step's end, which is left in y_old, its derivative in f[0]. */
static kmp_radau_outcome finish(kmp_radau *s, double t_new)
{
    const double *end = s->z[s->s - 1];
    for (int k = 0; k < s->n; k++) {
        s->y_old[k] = s->y[k] + end[k];
        s->w[k] = s->base.tolerance.atol[k] + s->base.tolerance.rtol * fmax(fabs(s->y[k]), fabs(s->y_old[k]));
    }
    int said = kmp_solver_call(&s->base, t_new, s->y_old, s->f[0]);
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_RADAU_BAD_STAGE : KMP_RADAU_HALTED;
    said = s->base.ode.accept ? s->base.ode.accept(s->base.ode.self, t_new, s->y_old, s->f[0], s->w) : KMP_GO;
    return said == KMP_GO ? KMP_RADAU_TAKEN : said == KMP_RETRY ? KMP_RADAU_BAD_STEP : KMP_RADAU_HALTED;
}

static kmp_radau_outcome attempt(kmp_radau *s, double h, double t_new, double *error, double *shorter)
{
    kmp_radau_outcome what = kmp_radau_find_stages(s, h, shorter);
    if (what == KMP_RADAU_TAKEN)
        what = estimate(s, h, error);
    return what == KMP_RADAU_TAKEN ? finish(s, t_new) : what;
}

/* -- control ----------------------------------------------------------------------------------------- */

/* The next step by the error; many Newton iterations make it smaller (IV.8). */
static double after_error(const kmp_radau *s, double h, double error, int iterations)
{
    double work = (2.0 * s->most_iterations + 1) / (2 * s->most_iterations + iterations);
    double quotient = SAFETY * work * pow(error, -1.0 / (s->s + 1));
    return h * fmax(SHRINK, fmin(GROW, quotient));
}

/* Gustafsson's prediction, ACM TOMS 20 (1994) 496. */
static double predict(const kmp_radau *s, double h, double error)
{
    double quotient = SAFETY * h / s->h_old * pow(s->error_old / (error * error), 1.0 / (s->s + 1));
    return h * fmax(SHRINK, fmin(GROW, quotient));
}

/* Uses the Jacobians of all stages for a while if Newton's method keeps steps far below the error's limit. */
static void choose_newton(kmp_radau *s, double h, double error)
{
    double size = (double)s->inner * s->s / CHEAP;
    if (s->together && --s->trust <= 0)
        s->together = s->has_jacobian = false;
    else if (!s->together && s->coupled && s->newton_limits &&
             after_error(s, h, error, 1) >= (WORTH + size * size) * h) {
        s->together = true;
        s->trust = s->patience;
        s->patience = s->patience < MOST_PATIENCE ? 2 * s->patience : MOST_PATIENCE;
    }
    s->newton_limits = false;
}

static void take(kmp_radau *s, double h, double t_new, double error, int iterations)
{
    double next = after_error(s, h, error, iterations), *end = s->z[s->s - 1];
    if (!s->first)
        next = fmin(next, predict(s, h, error));
    if (s->rejected)
        next = fmin(next, h);
    s->base.work.steps++;
    s->error_old = fmax(OLD_ERROR_FLOOR, error);
    s->h_old = h;
    /* the formulation's correction belongs to the polynomial's end */
    for (int k = 0; k < s->n; k++) {
        end[k] = s->y_old[k] - s->y[k];
        s->factor[k] = s->error[k] * s->method->g;
    }
    kmp_solver_swap(&s->y, &s->y_old);
    kmp_solver_swap(&s->dy, &s->f[0]);
    kmp_solver_swap(&s->lead, &s->lead_old);
    for (int i = 0; i < s->s; i++)
        kmp_solver_swap(&s->z[i], &s->z_old[i]);
    s->has_step = true;
    s->first = s->rejected = s->fresh = false;
    s->taken = h;
    s->base.t = t_new;
    s->has_jacobian = s->has_jacobian && !s->together && s->contraction <= KEEP_JACOBIAN;
    s->base.h = s->has_jacobian && next >= h && next <= KEEP_STEP * h ? h : next;
    choose_newton(s, h, error);
}

/* Repeats the step with a smaller size, or with another Jacobian. */
static void refuse(kmp_radau *s, kmp_radau_outcome what, double h, double error, double shorter, int iterations)
{
    bool stale = s->has_jacobian && !s->fresh && !s->together;
    if (what == KMP_RADAU_BAD_ERROR)
        s->base.work.rejected++;
    else
        s->base.work.refused++;
    if (what == KMP_RADAU_BAD_ERROR)
        s->base.h = s->first ? 0.1 * h : after_error(s, h, error, iterations);
    else if (what == KMP_RADAU_BAD_NEWTON)
        s->base.h = stale ? h : shorter * h;
    else
        s->base.h = what == KMP_RADAU_BAD_STAGE ? h / 4 : h / 2;
    s->newton_limits = s->newton_limits || (what == KMP_RADAU_BAD_NEWTON && !stale);
    if (what != KMP_RADAU_BAD_ERROR || s->contraction > KEEP_JACOBIAN)
        s->has_jacobian = s->has_jacobian && !stale;
    s->rejected = true;
}

static kempe_status step(void *solver)
{
    kmp_radau *s = solver;
    if (!(s->base.t < s->base.t_end))
        return KEMPE_OK;
    weigh(s);
    for (int tries = 0; tries < MAX_REJECT; tries++) {
        double t_new, error = 0, shorter = 0.5, h = kmp_solver_next_step(s->base.t, s->base.t_end, s->base.h, &t_new);
        if (!(h > 0) || s->collapsed)
            return KEMPE_E_FAILED;
        long newton = s->base.work.newton;
        kmp_radau_outcome what = attempt(s, h, t_new, &error, &shorter);
        int iterations = (int)(s->base.work.newton - newton);
        if (what == KMP_RADAU_HALTED)
            return KEMPE_E_FAILED;
        if (what == KMP_RADAU_TAKEN) {
            s->collapsed = kmp_solver_collapsed(&s->base.hopeless, h, t_new);
            s->base.t_old = s->base.t;
            take(s, h, t_new, error, iterations);
            return KEMPE_OK;
        }
        refuse(s, what, h, error, shorter, iterations);
    }
    return KEMPE_E_FAILED;
}

/* -- interface ---------------------------------------------------------------------------------------- */

static kempe_status dense(void *solver, double t, double *y, double *yp)
{
    kmp_radau *s = solver;
    (void)yp;
    memcpy(y, s->y, (size_t)s->n * sizeof *y);
    if (t == s->base.t || !(s->base.t > s->base.t_old))
        return KEMPE_OK;
    kmp_radau_extrapolate(s, (t - s->base.t_old) / s->taken, s->trial);
    for (int k = 0; k < s->n; k++)
        y[k] += s->trial[k];
    return KEMPE_OK;
}

#define RADAU(order, stages)                                                                                           \
    const kmp_solver_kind kmp_solver_radau##order = {.name = "radau" #order,                                           \
                                                     .corrects = true,                                                 \
                                                     .implicit = true,                                                 \
                                                     .method = &kmp_radau_##stages,                                    \
                                                     .create = create,                                                 \
                                                     .release = kmp_solver_free,                                       \
                                                     .start = start,                                                   \
                                                     .step = step,                                                     \
                                                     .dense = dense}

RADAU(5, 3);
RADAU(9, 5);
