/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on the manifold of closed positions (Edelman, Arias, Smith, SIAM J. Matrix Anal. Appl. 20 (1998) 303;
 * Nocedal, Wright, Numerical Optimization, 2nd ed., 2006, sec. 18.2 and 12.4): with N an orthonormal basis of the null
 * space of the scaled J over the free coordinates, r the weighted distances, G = dr/dq and J' lambda = G' r by least
 * squares, the Hessian of |r|^2 / 2 along the manifold is
 *
 *     N' (G' G + sum r_i d2 r_i - sum lambda_j d2 h_j) N.
 *
 * The second derivatives come from the programs: of h it is jdqd, a quadratic form in qd; a bilinear form follows from
 * its values for the sum and the difference of two rates. A step goes along the eigenvectors of that matrix, by
 * |eigenvalue|, so that it also leaves saddles, each component at most a bound; then the loops are closed again by
 * least changes. A step is accepted if the sum falls as predicted, closing moved little in comparison, and the tangent
 * has turned little: so the branch is kept.
 */
#include "constraints/closing/goals.h"
#include "base/arena.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/random_walk.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/tolerances.h"
#include "dynamics/goal_equations.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/lapack.h"
#include "model/data/start.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 300 };
#define LONGEST       0.3   /* largest component of a step: rad, or characteristic lengths */
#define SHORTEST      1e-10 /* steps that fail down to this length end the search */
#define NEGLIGIBLE    1e-11 /* a shorter Newton step is not made */
#define NOISE         1e-14 /* rounding of a gradient, over the gradient of all directions */
#define LEVEL         1e-12 /* relative gradient below which the search is at rest */
#define REST          1e-7  /* relative gradient at rest if rounding ends the steps */
#define MOST_CLOSING  0.3   /* largest motion by closing, over the step */
#define LEAST_ALIGNED 0.9   /* least part of a step along the new tangents */
#define NEAR          1e-3  /* shorter steps are also judged by the gradient, which rounding affects less */
#define FLAT          1e-13 /* smaller eigenvalues over the largest count as this */
#define SADDLE        1e-8  /* eigenvalues below minus this are saddles to be left, even with zero gradient */

/* A closed position and its derivatives. */
typedef struct place {
    double *q;         /* n */
    double *r;         /* count */
    double *slope;     /* count x n, row by row: G, scaled */
    double *tangent;   /* n x d, orthonormal */
    double *gradient;  /* n: G' r */
    double *projected; /* d */
    double half;       /* |r|^2 / 2 */
    double level;      /* |projected| over the gradient of all directions */
    int d;
} place;

typedef struct search {
    const kempe_system *s;
    const bool *hold;
    kmp_goals_verdict *verdict;
    kmp_walk *walk;
    kmp_arena arena;
    kmp_machine *points; /* NULL: no goal concerns a point */
    place here, there;
    int n, m, count;
    double *factor; /* count: sqrt(weight) / scale */
    double *multiplier, *transposed;
    double *hessian, *eigen, *y; /* d x d, d, d */
    double *step, *rate;         /* n */
} search;

static double norm(int n, const double *x)
{
    return sqrt(kmp_dot(n, x, x));
}

/* -- distances --------------------------------------------------------------------------------------- */

/* r and G at p->q. */
static void evaluate_goals(search *w, place *p)
{
    const kmp_start *start = kmp_model_start(w->s->model);
    int n = w->n, places = kmp_goals_place_count(w->s->model), point = 0, at = 0;
    const double *of = NULL;
    if (w->points) {
        kmp_machine_set(w->points, KMP_IN_Q, p->q);
        of = kmp_machine_run(w->points, KMP_STAGE_PLACE);
    }
    memset(p->slope, 0, (size_t)(w->count * n) * sizeof *p->slope);
    for (int k = 0; k < start->goal_count; k++) {
        const kmp_goal *goal = &start->goals[k];
        for (int i = 0; i < goal->width; i++, at++) {
            double *slope = p->slope + at * n, x = 0;
            if (goal->motion >= 0) {
                x = p->q[goal->motion];
                slope[goal->motion] = w->factor[at] * w->s->scale[goal->motion];
            } else if (of) {
                x = of[point];
                for (int c = 0; c < n; c++)
                    slope[c] = w->factor[at] * w->s->scale[c] * of[places + point * n + c];
                point++;
            }
            p->r[at] = w->factor[at] * (x - goal->value[i].value);
            w->verdict->value[at] = x;
        }
    }
    p->half = 0.5 * kmp_dot(w->count, p->r, p->r);
}

/* -- a position -------------------------------------------------------------------------------------- */

/* Tangents of the walk, without the held coordinates, made orthonormal (Gram and Schmidt, twice). */
static void find_tangents(search *w, place *p)
{
    int n = w->n, all = n - kmp_walk_tangents(w->walk, n);
    p->d = 0;
    for (int k = 0; k < all; k++) {
        double *x = p->tangent + p->d * n;
        memcpy(x, w->walk->basis + k * n, (size_t)n * sizeof *x);
        for (int c = 0; c < n; c++)
            x[c] = w->hold[c] ? 0 : x[c];
        for (int pass = 0; pass < 2; pass++) {
            for (int b = 0; b < p->d; b++) {
                double part = kmp_dot(n, x, p->tangent + b * n);
                for (int c = 0; c < n; c++)
                    x[c] -= part * p->tangent[b * n + c];
            }
            double size = norm(n, x);
            if (!(size > KMP_RANK)) /* it belonged to a held coordinate */
                break;
            for (int c = 0; c < n; c++)
                x[c] /= size;
            p->d += pass;
        }
    }
}

/* Evaluates p at p->q, where the walk is closed. */
static void evaluate_place(search *w, place *p)
{
    int n = w->n;
    double whole = norm(w->count * n, p->slope), most = 0;
    find_tangents(w, p);
    for (int c = 0; c < n; c++) {
        p->gradient[c] = 0;
        for (int i = 0; i < w->count; i++)
            p->gradient[c] += p->slope[i * n + c] * p->r[i];
    }
    for (int a = 0; a < p->d; a++)
        p->projected[a] = kmp_dot(n, p->tangent + a * n, p->gradient);
    for (int i = 0; i < w->count; i++)
        most = fmax(most, norm(n, p->slope + i * n));
    whole *= fmax(norm(w->count, p->r), most);
    p->level = whole > 0 ? norm(p->d, p->projected) / whole : 0;
}

/* -- the Hessian ------------------------------------------------------------------------------------- */

/* Multipliers: J' lambda = G' r over the coordinates that are not held. false: no memory. */
static bool find_multipliers(search *w, const place *p)
{
    int n = w->n, m = w->m;
    for (int r = 0; r < m; r++)
        for (int c = 0; c < n; c++)
            w->transposed[c + r * n] = w->walk->jacobian[r + c * m];
    for (int c = 0; c < n; c++)
        w->step[c] = w->hold[c] ? 0 : p->gradient[c];
    return kmp_least_squares(n, m, w->transposed, w->step, kmp_rounding_zero(w->s, KMP_RANK), w->multiplier) >= 0;
}

/* sum r_i d2 r_i - sum lambda_j d2 h_j along `sign` times w->rate, including the rates and times of moving closures. */
static double second_derivative_once(search *w, const place *p, double sign)
{
    double sum = 0;
    for (int c = 0; c < w->n; c++)
        w->step[c] = sign * w->rate[c] * w->s->scale[c];
    kmp_eval_bias(w->walk->eval, w->step);
    for (int j = 0; j < w->m; j++)
        sum -= w->multiplier[j] * w->walk->eval->jdqd[j] / w->s->row_scale[j];
    if (!w->points)
        return sum;
    kmp_machine_set(w->points, KMP_IN_QD, w->step);
    const double *second = kmp_machine_run(w->points, KMP_STAGE_BEND);
    const kmp_start *start = kmp_model_start(w->s->model);
    for (int k = 0, at = 0; k < start->goal_count; at += start->goals[k++].width)
        for (int i = 0; start->goals[k].point >= 0 && i < 3; i++)
            sum += p->r[at + i] * w->factor[at + i] * *second++;
    return sum;
}

static double second_derivative(search *w, const place *p)
{
    double there = second_derivative_once(w, p, 1);
    return w->s->rheonomic ? 0.5 * (there + second_derivative_once(w, p, -1)) - second_derivative_once(w, p, 0) : there;
}

static bool find_hessian(search *w, const place *p)
{
    int n = w->n, d = p->d;
    if (!find_multipliers(w, p))
        return false;
    kmp_eval_mass(w->walk->eval);
    for (int a = 0; a < d; a++)
        for (int b = 0; b <= a; b++) {
            const double *x = p->tangent + a * n, *y = p->tangent + b * n;
            double sum = 0, part[2] = {0, 0};
            for (int i = 0; i < w->count; i++)
                sum += kmp_dot(n, p->slope + i * n, x) * kmp_dot(n, p->slope + i * n, y);
            for (int k = 0; k < (a == b ? 1 : 2); k++) {
                for (int c = 0; c < n; c++)
                    w->rate[c] = a == b ? x[c] : k == 0 ? x[c] + y[c] : x[c] - y[c];
                part[k] = second_derivative(w, p);
            }
            w->hessian[a + b * d] = sum + (a == b ? part[0] : 0.25 * (part[0] - part[1]));
        }
    for (int k = 0; k < d * d; k++)
        if (!isfinite(w->hessian[k]))
            w->hessian[k] = k % (d + 1) == 0;
    return kmp_symmetric_eigen(d, w->hessian, w->eigen) == 0;
}

/* -- steps ------------------------------------------------------------------------------------------- */

/* Chooses y along the eigenvectors, each component at most `bound`; returns the predicted decrease of the sum. */
static double choose_step(search *w, const place *p, double bound)
{
    int n = w->n, d = p->d;
    double top = fmax(fabs(w->eigen[0]), fabs(w->eigen[d - 1])), fall = 0;
    double whole = p->level > 0 ? norm(d, p->projected) / p->level : 0;
    memset(w->step, 0, (size_t)n * sizeof *w->step);
    for (int i = 0; i < d; i++) {
        const double *v = w->hessian + i * d;
        double c = kmp_dot(d, v, p->projected), value = w->eigen[i];
        double y = fabs(c) <= NOISE * whole ? 0 : -c / fmax(fabs(value), FLAT * top);
        if (value < -SADDLE * top && fabs(y) < NEAR)
            y = c > 0 ? -bound : bound;
        y = fmax(-bound, fmin(bound, y));
        fall -= c * y + 0.5 * value * y * y;
        w->y[i] = y;
        for (int a = 0; a < d; a++)
            for (int k = 0; k < n; k++)
                w->step[k] += y * v[a] * p->tangent[k + a * n];
    }
    return fall;
}

/* Makes w->there: closed after the step. false: not on the same branch. */
static bool make_step(search *w)
{
    int n = w->n;
    double size = norm(n, w->step), closing = 0, aligned = 0;
    for (int k = 0; k < n; k++)
        w->there.q[k] = w->here.q[k] + w->step[k] * w->s->scale[k];
    if (!kmp_walk_close(w->walk, w->there.q))
        return false;
    for (int k = 0; k < n; k++)
        closing = hypot(closing, (w->there.q[k] - w->here.q[k]) / w->s->scale[k] - w->step[k]);
    if (!(closing <= MOST_CLOSING * size + NEGLIGIBLE))
        return false;
    evaluate_goals(w, &w->there);
    evaluate_place(w, &w->there);
    for (int a = 0; a < w->there.d; a++)
        aligned = hypot(aligned, kmp_dot(n, w->step, w->there.tangent + a * n));
    return aligned >= LEAST_ALIGNED * size;
}

/* Takes a step that decreases the sum. false: none is left. */
static bool step_down(search *w, double *bound)
{
    for (;; *bound *= 0.4) {
        double fall = choose_step(w, &w->here, *bound), size = norm(w->here.d, w->y);
        if (!(size > SHORTEST) || *bound < SHORTEST)
            return false;
        bool made = make_step(w), falls = made && w->here.half - w->there.half > 0.1 * fall;
        if (falls ||
            (made && size < NEAR && norm(w->there.d, w->there.projected) < 0.5 * norm(w->here.d, w->here.projected))) {
            place t = w->here;
            w->here = w->there;
            w->there = t;
            *bound = fmin(2 * *bound, LONGEST);
            return true;
        }
        *bound = fmin(*bound, size);
    }
}

/* True if there is no direction of descent and no saddle. */
static bool is_minimum(search *w)
{
    double top = fmax(fabs(w->eigen[0]), fabs(w->eigen[w->here.d - 1]));
    if (w->eigen[0] < -SADDLE * top)
        return false;
    (void)choose_step(w, &w->here, INFINITY);
    return w->here.level <= LEVEL || norm(w->here.d, w->y) <= NEGLIGIBLE;
}

/* Steps until the search ends. false: no memory. */
static bool descend(search *w)
{
    double bound = LONGEST;
    w->verdict->end = KMP_GOALS_SINGULAR;
    for (; w->verdict->steps < MOST_STEPS; w->verdict->steps++) {
        if (w->here.d > 0 && !find_hessian(w, &w->here))
            return false;
        if (w->here.d == 0 || is_minimum(w)) {
            w->verdict->end = KMP_GOALS_MINIMUM;
            return true;
        }
        if (step_down(w, &bound))
            continue;
        if (w->here.level <= REST)
            w->verdict->end = KMP_GOALS_MINIMUM;
        return true;
    }
    return true;
}

/* -- all together ------------------------------------------------------------------------------------ */

static void make_place(search *w, place *p)
{
    size_t n = (size_t)w->n, count = (size_t)w->count;
    KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, count, &p->r), KMP_ROOM(double, count *n, &p->slope),
                   KMP_ROOM(double, n *(n + 1), &p->tangent), KMP_ROOM(double, n, &p->q, &p->gradient, &p->projected));
}

static bool search_init(search *w, const kempe_system *s, const bool *hold, kmp_goals_verdict *verdict)
{
    *w = (search){.s = s, .hold = hold, .verdict = verdict, .n = s->n, .m = s->m, .count = verdict->count};
    w->factor = KMP_ARENA_NEW(&w->arena, double, w->count);
    make_place(w, &w->here);
    if (s->goals) {
        /* The points of a start are in the user's own charts, in which an assembly with goals stays. */
        double *chart = KMP_ARENA_NEW(&w->arena, double, KMP_CHART_SIZE * s->chart_count);
        w->points = kmp_machine_new(s->goals, kmp_backend_find("tape"));
        if (!w->points || !chart)
            return false;
        kmp_charts_reset(s, chart);
        kmp_machine_set(w->points, KMP_IN_CHART, chart);
        kmp_machine_set(w->points, KMP_IN_PARAMETER, s->parameters);
        (void)kmp_machine_run(w->points, 0);
    }
    if (w->arena.failed)
        return false;
    /* Weights of distances over their scales. */
    const kmp_start *start = kmp_model_start(w->s->model);
    for (int k = 0, at = 0; k < start->goal_count; k++) {
        const kmp_goal *goal = &start->goals[k];
        double scale = goal->motion >= 0 ? w->s->scale[goal->motion] : w->s->length;
        for (int i = 0; i < goal->width; i++)
            w->factor[at++] = sqrt(goal->weight[i].value) / scale;
    }
    return true;
}

/* Allocates the part of the search that a measurement does not need. */
static bool search_extend(search *w)
{
    size_t n = (size_t)w->n, m = (size_t)w->m;
    w->walk = kmp_walk_new(w->s);
    KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, m, &w->multiplier), KMP_ROOM(double, n *m, &w->transposed),
                   KMP_ROOM(double, n *n, &w->hessian), KMP_ROOM(double, n, &w->eigen, &w->y, &w->step, &w->rate));
    make_place(w, &w->there);
    if (w->walk)
        w->walk->hold = w->hold;
    return w->walk && !w->arena.failed;
}

static void search_free(search *w)
{
    kmp_machine_free(w->points);
    kmp_walk_free(w->walk);
    kmp_arena_free(&w->arena);
}

static void measure_goals(search *w, const double *q)
{
    memcpy(w->here.q, q, (size_t)w->n * sizeof *q);
    evaluate_goals(w, &w->here);
    w->verdict->distance = sqrt(2 * w->here.half);
}

bool kmp_goals_measure(const kempe_system *system, const double *q, kmp_goals_verdict *verdict)
{
    search w;
    bool ok = search_init(&w, system, NULL, verdict);
    if (ok)
        measure_goals(&w, q);
    search_free(&w);
    return ok;
}

bool kmp_goals_seek(const kempe_system *system, const bool *hold, double *q, kmp_goals_verdict *verdict)
{
    search w;
    bool ok = search_init(&w, system, hold, verdict) && search_extend(&w);
    if (ok) {
        measure_goals(&w, q);
        kmp_walk_evaluate(w.walk, q);
        evaluate_place(&w, &w.here);
        ok = descend(&w);
        memcpy(q, w.here.q, (size_t)w.n * sizeof *q);
        verdict->slope = w.here.level;
    }
    search_free(&w);
    return ok;
}
