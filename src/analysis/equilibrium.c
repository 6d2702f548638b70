/* SPDX-License-Identifier: BSD-3-Clause */
/* From afar: Newton's direction with the symmetric part of Kr made positive, its eigenvalues taken by their size (as by
 * Dauphin et al., NIPS 27 (2014) 2933), so that s'R < 0: of a conservative mechanism the way down its potential, of any
 * other that of a heavily damped motion. A step is bounded, and as long as the work s'R along it has fallen to half at
 * its end or still goes down (Matthies and Strang, IJNME 14 (1979) 1613): no potential has to be known. Where R = 0 and
 * Kr still falls in some direction the state is pushed aside along it. Near: KINSOL on the coordinates that R depends
 * on with the exact Kr; then Newton's steps to round-off. */
#include "analysis/equilibrium.h"
#include "base/memory.h"
#include "constraints/charts.h"
#include "constraints/kinsol.h"
#include "linalg/dense.h"
#include "linalg/dot.h"
#include "linalg/symmetric.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_HALVINGS = 14, MOST_PUSHES = 12, MOST_POLISH = 6, GO = 0, RETRY = 1 };

#define BALANCED      1e-10 /* residual of an equilibrium */
#define NEAR          1e-3  /* from which KINSOL goes on */
#define SLACK         1e-4  /* in parts of the largest work: what rounds among others is not asked for */
#define FLAT          1e-11 /* an eigenvalue of the scaled Kr below is zero */
#define FIRST_BOUND   0.3   /* rad, or characteristic lengths */
#define GROWTH        2.0   /* scaled |Bvu| beyond which u is chosen anew */
#define PUSH          0.05
#define FARTHEST      1e4 /* what moves as far never stops */
#define SHORTEST      1e-13
#define RUNAWAY_TURNS 20.0 /* rad: what went as far without an end runs away */

typedef struct way {
    kmp_linear *l;
    kmp_search *search;
    double t;
    int n;
    double *q;                /* n: the state at hand */
    double *begin;            /* n */
    double *rates;            /* p: ud */
    double *work;             /* p: what acts and changes along each u, as work */
    double most;              /* the largest of them */
    double residual, told;    /* scaled; as last noted */
    double *size;             /* p: of a step's unknowns, coordinate units */
    double *matrix, *vectors; /* p x p */
    double *values, *right;   /* p */
    double *step, *force;     /* p: of u, and R there */
    double *move, *trial;     /* n */
    int *pivot, *active;      /* p */
    int active_count;
    double least; /* least eigenvalue of the scaled Kr */
    bool flat;
    double bound;
    kempe_status status; /* of what is no mere failure to converge */
} way;

static bool make_room(way *w)
{
    size_t n = (size_t)w->n;
    double **rooms[] = {&w->q,     &w->begin, &w->rates, &w->work, &w->size, &w->values,
                        &w->right, &w->step,  &w->force, &w->move, &w->trial};
    bool ok = true;
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++) {
        *rooms[k] = KMP_NEW(double, n);
        ok = ok && *rooms[k];
    }
    w->matrix = KMP_NEW(double, n *n);
    w->vectors = KMP_NEW(double, n *n);
    w->pivot = KMP_NEW(int, n);
    w->active = KMP_NEW(int, n);
    return ok && w->matrix && w->vectors && w->pivot && w->active;
}

static void free_room(way *w)
{
    double *rooms[] = {w->q,    w->begin, w->rates, w->work,  w->size,   w->values, w->right,
                       w->step, w->force, w->move,  w->trial, w->matrix, w->vectors};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        kmp_free(rooms[k]);
    kmp_free(w->pivot);
    kmp_free(w->active);
}

/* -- the measure of R -------------------------------------------------------------------------------- */

static double scale_of(const kmp_linear *l, int k)
{
    return l->system->scale[l->part.u[k]];
}

/* What acts along u_k, and what a unit of each coordinate changes there, as work. */
static double work_of(const kmp_linear *l, int k)
{
    double acting = 0, row = 0, column = 0, s = scale_of(l, k);
    for (int i = 0; i < l->n; i++)
        acting += fabs(l->red.x[i + k * l->n] * l->force[i]) * s;
    for (int j = 0; j < l->p; j++) {
        row += fabs(l->stiffness[k + j * l->p]) * s * scale_of(l, j);
        column += fabs(l->stiffness[j + k * l->p]) * s * scale_of(l, j);
    }
    return acting + fmax(row, column);
}

static double measure(const kmp_linear *l, double *work, double *most)
{
    double worst = 0;
    *most = 0;
    for (int k = 0; k < l->p; k++) {
        work[k] = work_of(l, k);
        *most = fmax(*most, work[k]);
    }
    for (int k = 0; k < l->p; k++) {
        work[k] += SLACK * *most;
        if (*most > 0)
            worst = fmax(worst, fabs(l->residual[k]) * scale_of(l, k) / work[k]);
    }
    return worst;
}

double kmp_equilibrium_residual(const kmp_linear *linear)
{
    double most = 0, worst = 0;
    for (int k = 0; k < linear->p; k++)
        most = fmax(most, work_of(linear, k));
    for (int k = 0; most > 0 && k < linear->p; k++)
        worst = fmax(worst, fabs(linear->residual[k]) * scale_of(linear, k) / (work_of(linear, k) + SLACK * most));
    return worst;
}

/* -- one state --------------------------------------------------------------------------------------- */

static kempe_status choose(way *w)
{
    int count = w->search->rate_count, *wish = w->pivot;
    for (int k = 0; k < count; k++)
        wish[k] = w->search->rates[k].coordinate;
    kempe_status status = kmp_linear_choose(w->l, w->t, w->q, wish, count);
    if (status != KEMPE_OK)
        return status;
    for (int k = 0; k < w->l->p; k++) {
        w->rates[k] = 0;
        for (int i = 0; i < count; i++)
            if (wish[i] == w->l->part.u[k])
                w->rates[k] = w->search->rates[i].rate;
    }
    return KEMPE_OK;
}

static bool at(way *w, const double *q)
{
    return kmp_linear_at(w->l, w->t, q, w->rates, NULL) == KEMPE_OK &&
           isfinite(kmp_dot(w->l->p, w->l->residual, w->l->residual));
}

/* Joints whose angles come near to their singular position begin in the middle of other charts. */
static bool center(way *w)
{
    const kempe_system *s = w->l->system;
    bool any = false;
    for (int c = 0; c < kmp_charts_count(s); c++)
        if (kmp_chart_regular(s, c, w->q) < KMP_CHART_LIMIT) {
            kmp_chart_center(s, c, w->l->plant->chart, w->q, NULL, NULL);
            any = true;
        }
    if (any)
        kmp_plant_set_charts(w->l->plant, w->l->plant->chart);
    return any;
}

/* The state at hand is l's: taken over, with its matrices; u anew where it has become bad. */
static bool arrive(way *w)
{
    kmp_linear *l = w->l;
    int v, u;
    memcpy(w->q, l->q, (size_t)w->n * sizeof *w->q);
    if (center(w) || kmp_reduction_growth(&l->red, &v, &u) > GROWTH) {
        w->status = choose(w);
        w->search->exchanges++;
        if (w->status != KEMPE_OK || !at(w, w->q))
            return false;
        memcpy(w->q, l->q, (size_t)w->n * sizeof *w->q);
    }
    kmp_linear_matrices(l);
    w->residual = measure(l, w->work, &w->most);
    memcpy(w->force, l->residual, (size_t)l->p * sizeof *w->force);
    return isfinite(w->residual);
}

static void note(way *w, double residual)
{
    kmp_search *s = w->search;
    if (s->iterations < KMP_MOST_ITERATIONS)
        s->history[s->iterations++] = (kmp_iteration){.residual = residual};
    w->told = residual;
}

static void note_step(way *w, double step)
{
    if (w->search->iterations > 0)
        w->search->history[w->search->iterations - 1].step = step;
}

/* -- directions -------------------------------------------------------------------------------------- */

/* The scaled Kr and the eigenvectors of its symmetric part. */
static bool decompose(way *w)
{
    const kmp_linear *l = w->l;
    int p = l->p;
    for (int k = 0; k < p; k++)
        w->size[k] = w->most > 0 ? scale_of(l, k) / sqrt(w->work[k]) : scale_of(l, k);
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            w->matrix[i + k * p] = l->stiffness[i + k * p] * w->size[i] * w->size[k];
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            w->vectors[i + k * p] = (w->matrix[i + k * p] + w->matrix[k + i * p]) / 2;
    if (p > 0 && kmp_symmetric_eigen(p, w->vectors, w->values) != 0) {
        w->status = kmp_fail_memory(l->system->context);
        return false;
    }
    w->least = p > 0 ? w->values[0] : 1;
    w->flat = false;
    for (int k = 0; k < p; k++)
        w->flat = w->flat || fabs(w->values[k]) <= FLAT;
    return true;
}

/* The step in w->step, coordinate units; along flat directions that nothing pulls it stands still. */
static bool direction(way *w)
{
    int p = w->l->p;
    for (int k = 0; k < p; k++)
        w->right[k] = w->force[k] * w->size[k];
    for (int k = 0; k < p; k++) {
        const double *v = w->vectors + k * p;
        double value = w->values[k], pull = fabs(kmp_dot(p, v, w->right)), wanted = value;
        if (value < -FLAT)
            wanted = -value;
        else if (value <= FLAT)
            wanted = pull > BALANCED ? FLAT : 1;
        for (int j = 0; wanted != value && j < p; j++)
            for (int i = 0; i < p; i++)
                w->matrix[i + j * p] += (wanted - value) * v[i] * v[j];
    }
    if (p > 0 && kmp_lu_factor(p, w->matrix, w->pivot))
        return false;
    for (int k = 0; k < p; k++)
        w->step[k] = -w->right[k];
    kmp_lu_solve(p, w->matrix, w->pivot, 1, w->step);
    for (int k = 0; k < p; k++)
        w->step[k] *= w->size[k];
    return true;
}

/* dq of the step, and how far it goes. */
static double spread(way *w)
{
    const kmp_linear *l = w->l;
    double far = 0;
    for (int i = 0; i < w->n; i++) {
        w->move[i] = 0;
        for (int k = 0; k < l->p; k++)
            w->move[i] += l->red.x[i + k * w->n] * w->step[k];
        double size = fabs(w->move[i]) / l->system->scale[i];
        far = size > far || !isfinite(size) ? size : far;
    }
    return far;
}

static void shorten(way *w, double factor)
{
    for (int i = 0; i < w->n; i++)
        w->move[i] *= factor;
    for (int k = 0; k < w->l->p; k++)
        w->step[k] *= factor;
}

static bool try_part(way *w, double part)
{
    for (int i = 0; i < w->n; i++)
        w->trial[i] = w->q[i] + part * w->move[i];
    return at(w, w->trial);
}

/* So far along the step that the work has fallen to half or goes on down. 0: nowhere. */
static double search_line(way *w)
{
    double first = kmp_dot(w->l->p, w->step, w->force), part = 1;
    for (int k = 0; k < MOST_HALVINGS; k++) {
        if (!try_part(w, part)) {
            part /= 2;
            continue;
        }
        double last = kmp_dot(w->l->p, w->step, w->l->residual);
        if (last <= 0.5 * fabs(first))
            return part;
        part *= fmax(0.1, fmin(0.8, first / (first - last)));
    }
    return 0;
}

/* -- near -------------------------------------------------------------------------------------------- */

static bool at_unknowns(way *w, const double *x)
{
    for (int i = 0; i < w->n; i++)
        w->trial[i] = w->q[i];
    for (int k = 0; k < w->active_count; k++)
        w->trial[w->l->part.u[w->active[k]]] = x[k];
    return at(w, w->trial);
}

static int newton_residual(void *self, const double *x, double *r)
{
    way *w = self;
    if (!at_unknowns(w, x))
        return RETRY;
    for (int k = 0; k < w->active_count; k++)
        r[k] = w->l->residual[w->active[k]];
    return GO;
}

static int newton_matrix(void *self, const double *x, double *a)
{
    way *w = self;
    const kmp_linear *l = w->l;
    if (!at_unknowns(w, x))
        return RETRY;
    kmp_linear_matrices(w->l);
    double residual = measure(l, w->right, &w->most);
    if (residual != w->told) /* KINSOL begins where the way down ended */
        note(w, residual);
    for (int j = 0; j < w->active_count; j++)
        for (int i = 0; i < w->active_count; i++)
            a[i + j * w->active_count] = l->stiffness[w->active[i] + w->active[j] * l->p];
    return GO;
}

/* Coordinates that R depends on at all. */
static void find_active(way *w)
{
    const kmp_linear *l = w->l;
    w->active_count = 0;
    for (int k = 0; k < l->p; k++) {
        double most = 0;
        for (int i = 0; i < l->p; i++)
            most = fmax(most, fabs(l->stiffness[i + k * l->p]) * scale_of(l, i) * scale_of(l, k) / w->work[i]);
        if (most > FLAT)
            w->active[w->active_count++] = k;
    }
}

/* Where it fails q stays as it is. */
static kempe_status newton(way *w)
{
    const kmp_linear *l = w->l;
    int p = l->p, done = 0;
    double *x = KMP_NEW(double, 3 * p), *scale_x = x ? x + p : NULL, *scale_f = x ? x + 2 * p : NULL;
    if (!x)
        return kmp_fail_memory(l->system->context);
    find_active(w);
    for (int k = 0; k < w->active_count; k++) {
        int a = w->active[k];
        x[k] = w->q[l->part.u[a]];
        scale_x[k] = 1 / scale_of(l, a);
        scale_f[k] = scale_of(l, a) / w->work[a];
    }
    kempe_status status = w->active_count == 0
                              ? KEMPE_OK
                              : kmp_kinsol_solve(l->system->context, w->active_count, x, scale_x, scale_f,
                                                 newton_residual, newton_matrix, w, BALANCED, &done);
    if (status == KEMPE_OK && !at_unknowns(w, x))
        status = KEMPE_E_FAILED;
    if (status != KEMPE_OK)
        (void)at(w, w->q);
    if (!arrive(w) && status == KEMPE_OK)
        status = w->status != KEMPE_OK ? w->status : KEMPE_E_FAILED;
    kmp_free(x);
    return status;
}

/* Newton's steps as they are, while the residual falls. */
static void polish(way *w)
{
    double far = 0;
    for (int k = 0; k < MOST_POLISH && w->residual > 0; k++) {
        double before = w->residual, *q = w->begin; /* not wanted any more */
        memcpy(q, w->q, (size_t)w->n * sizeof *q);
        if (!decompose(w) || !direction(w))
            return;
        far = spread(w);
        if (try_part(w, 1) && arrive(w) && w->residual < 0.5 * before) {
            note_step(w, far);
            note(w, w->residual);
            continue;
        }
        if (at(w, q))
            (void)arrive(w);
        return;
    }
}

/* -- from afar --------------------------------------------------------------------------------------- */

/* The coordinate that went farthest, and how far. */
static int farthest(const way *w, double *far)
{
    int best = 0;
    *far = 0;
    for (int k = 0; k < w->l->p; k++) {
        int c = w->l->part.u[k];
        double size = fabs(w->q[c] - w->begin[c]) / w->l->system->scale[c];
        if (size > *far) {
            *far = size;
            best = k;
        }
    }
    return best;
}

static kempe_status complain_runaway(const way *w, int k, double far)
{
    const kmp_linear *l = w->l;
    const kmp_motion *motion = &l->system->model->motions[l->part.u[k]];
    return kmp_fail(l->system->context, KEMPE_E_FAILED,
                    "nothing holds '%s': it has gone %.3g %s, and is still pulled with %.6g %s", motion->name,
                    far * l->system->scale[l->part.u[k]], motion->rotation ? "rad" : "m", -l->residual[k],
                    motion->rotation ? "N m" : "N");
}

static kempe_status complain_stuck(const way *w, const char *why)
{
    return kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                    "no equilibrium is found: after %d iterations a residual of %.2e is left (wanted %.0e): %s; start "
                    "from another position",
                    w->search->iterations, w->residual, BALANCED, why);
}

/* Aside along the direction in which Kr falls most. */
static bool push_aside(way *w)
{
    int p = w->l->p, largest = 0;
    for (int k = 0; k < p; k++) {
        w->step[k] = w->vectors[k] * w->size[k];
        if (fabs(w->vectors[k]) > fabs(w->vectors[largest]))
            largest = k;
    }
    double far = spread(w);
    shorten(w, (w->vectors[largest] < 0 ? -PUSH : PUSH) / far);
    for (double part = 1; part > 0.01; part /= 2)
        if (try_part(w, part))
            return arrive(w);
    return false;
}

static bool step_down(way *w)
{
    if (!direction(w))
        return false;
    double far = spread(w), wanted = far;
    if (!(far < HUGE_VAL))
        return false;
    if (far > w->bound) {
        shorten(w, w->bound / far);
        far = w->bound;
    }
    double part = search_line(w);
    if (part == 0) {
        (void)at(w, w->q);
        return false;
    }
    if (part == 1 && wanted > w->bound)
        w->bound *= 2;
    else if (part < 1)
        w->bound = fmax(0.5 * w->bound, part * far);
    note_step(w, part * far);
    return arrive(w);
}

/* Down until it is near a stable one. */
static kempe_status descend(way *w)
{
    int pushes = 0;
    double far;
    for (; w->search->iterations < KMP_MOST_ITERATIONS - 40;) {
        if (kmp_interrupted(w->l->system->context))
            return KEMPE_STOPPED;
        if (!decompose(w))
            return w->status;
        note(w, w->residual);
        bool stable = w->least >= -FLAT, balanced = w->residual <= BALANCED;
        if (balanced && (stable || w->search->iterations == 1))
            return KEMPE_OK;
        if (stable && w->residual <= NEAR && !w->flat)
            return KEMPE_OK;
        bool gone = balanced && pushes < MOST_PUSHES ? push_aside(w) : step_down(w);
        pushes += balanced;
        if (!gone)
            return w->status != KEMPE_OK ? w->status : complain_stuck(w, "no step leads further down");
        int k = farthest(w, &far);
        if (far > FARTHEST)
            return complain_runaway(w, k, far);
    }
    int k = farthest(w, &far);
    return far > RUNAWAY_TURNS ? complain_runaway(w, k, far) : complain_stuck(w, "too many iterations");
}

static kempe_status find(way *w)
{
    kempe_status status = KEMPE_OK;
    memcpy(w->begin, w->q, (size_t)w->n * sizeof *w->q);
    (void)center(w);
    status = choose(w);
    if (status != KEMPE_OK)
        return status;
    if (!at(w, w->q) || !arrive(w))
        return w->status != KEMPE_OK ? w->status
                                     : kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                                                "the equations cannot be evaluated at the start: loops that do not "
                                                "close, or numbers that are not finite");
    if (!w->search->nearest)
        status = descend(w);
    if (status == KEMPE_OK && (w->search->nearest || w->residual > BALANCED)) {
        status = newton(w);
        if (status == KEMPE_E_FAILED && !w->search->nearest && w->residual <= NEAR) {
            kmp_context_clear(w->l->system->context);
            status = KEMPE_OK;
        }
    }
    if (status != KEMPE_OK)
        return status;
    if (w->residual != w->told)
        note(w, w->residual);
    polish(w);
    return w->residual <= BALANCED ? KEMPE_OK : complain_stuck(w, "Newton's method does not get nearer");
}

kempe_status kmp_equilibrium_find(kmp_linear *linear, double t, double *q, kmp_search *search)
{
    way w = {.l = linear, .search = search, .t = t, .n = linear->n, .bound = FIRST_BOUND};
    search->iterations = search->exchanges = 0;
    kempe_status status = make_room(&w) ? KEMPE_OK : kmp_fail_memory(linear->system->context);
    if (status == KEMPE_OK) {
        memcpy(w.q, q, (size_t)w.n * sizeof *q);
        status = find(&w);
        search->residual = w.residual;
    }
    if (status == KEMPE_OK)
        memcpy(q, w.q, (size_t)w.n * sizeof *q);
    free_room(&w);
    return status;
}
