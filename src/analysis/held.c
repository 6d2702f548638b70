/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on what is not held, each step no longer than leads down: as long as the work s'R along it has fallen
 * to half at its end or still goes down (Matthies and Strang, IJNME 14 (1979) 1613). Where the matrix is singular, as
 * of a wheel above its rail, or leads up, it is made that of a heavily damped motion. */
#include "analysis/held.h"
#include "analysis/way.h"
#include "base/memory.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 300, MOST_HALVINGS = 40, MOST_DAMPINGS = 60, MOST_POLISH = 4 };

#define FIRST_BOUND 1e-3  /* rad, or characteristic lengths */
#define LEAST_DAMP  1e-12 /* in parts of the matrix' largest entry */
#define LEAST_STEP  1e-13
#define BALANCED    KMP_WAY_BALANCED

typedef struct finder {
    kmp_way way;
    kmp_held *held;
    int count;    /* unknowns */
    int *place;   /* of each in u */
    int *rate;    /* of each: which hold's, -1: a position */
    double *size; /* of each: that makes its row work */
    double *matrix, *factored, *right, *step, *trial_rate, *rate_here;
    int *pivot;
    double residual, bound;
} finder;

static bool init(finder *f, kmp_linear *l, kmp_search *search, double t, kmp_held *held)
{
    size_t n = (size_t)l->n, holds = (size_t)held->count;
    *f = (finder){.held = held, .bound = FIRST_BOUND};
    f->way = (kmp_way){.l = l, .search = search, .t = t, .n = l->n, .told = NAN};
    bool ok = kmp_way_init(&f->way);
    double **rooms[] = {&f->size, &f->right, &f->step};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        ok = (*rooms[k] = KMP_NEW(double, n)) && ok;
    f->matrix = KMP_NEW(double, n *n);
    f->factored = KMP_NEW(double, n *n);
    f->trial_rate = KMP_NEW(double, holds);
    f->rate_here = KMP_NEW(double, holds);
    f->place = KMP_NEW(int, n);
    f->rate = KMP_NEW(int, n);
    f->pivot = KMP_NEW(int, n);
    return ok && f->matrix && f->factored && f->trial_rate && f->rate_here && f->place && f->rate && f->pivot;
}

static void release(finder *f)
{
    double *rooms[] = {f->size, f->right, f->step, f->matrix, f->factored, f->trial_rate, f->rate_here};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        kmp_free(rooms[k]);
    kmp_free(f->place);
    kmp_free(f->rate);
    kmp_free(f->pivot);
    kmp_way_free(&f->way);
}

/* -- the unknowns at the state at hand ---------------------------------------------------------------- */

static int hold_of(const kmp_held *held, int coordinate)
{
    for (int k = 0; k < held->count; k++)
        if (held->hold[k].coordinate == coordinate)
            return k;
    return -1;
}

/* A rate changes by parts of itself, or of one size a second. */
static double unknown_size(const finder *f, int i)
{
    double scale = kmp_way_scale(f->way.l, f->place[i]);
    return f->rate[i] < 0 ? scale : fmax(scale, fabs(f->held->rates[f->rate[i]].rate));
}

static double entry(const finder *f, int row, int column)
{
    const kmp_linear *l = f->way.l;
    const double *from = f->rate[column] < 0 ? l->stiffness : l->damping;
    return from[f->place[row] + f->place[column] * l->p];
}

/* What R_k is measured by: what acts there, and what one size of any unknown changes. */
static double work_of(const finder *f, int i)
{
    const kmp_linear *l = f->way.l;
    double scale = kmp_way_scale(l, f->place[i]), work = f->way.work[f->place[i]];
    for (int k = 0; k < f->count; k++)
        work = fmax(work, fabs(entry(f, i, k)) * scale * unknown_size(f, k));
    return work;
}

static void take_unknowns(finder *f)
{
    const kmp_linear *l = f->way.l;
    f->count = 0;
    for (int k = 0; k < l->p; k++) {
        int hold = hold_of(f->held, l->part.u[k]);
        if (hold >= 0 && !f->held->hold[hold].freed)
            continue;
        f->place[f->count] = k;
        f->rate[f->count++] = hold;
    }
    f->residual = 0;
    for (int i = 0; i < f->count; i++) {
        double scale = kmp_way_scale(l, f->place[i]), work = work_of(f, i);
        f->size[i] = work > 0 ? scale / work : 0;
        f->residual = fmax(f->residual, fabs(l->residual[f->place[i]]) * f->size[i]);
    }
}

static bool arrive(finder *f)
{
    if (!kmp_way_arrive(&f->way))
        return false;
    for (int k = 0; k < f->held->count; k++)
        f->rate_here[k] = f->held->rates[k].rate;
    take_unknowns(f);
    f->held->iterations++;
    return isfinite(f->residual);
}

/* -- a step --------------------------------------------------------------------------------------------- */

/* Rows in parts of their work, unknowns in theirs. */
static void make_matrix(finder *f, double *largest)
{
    *largest = 0;
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->count; i++) {
            double a = entry(f, i, k) * f->size[i] * unknown_size(f, k);
            f->matrix[i + k * f->count] = a;
            *largest = fmax(*largest, fabs(a));
        }
    for (int i = 0; i < f->count; i++)
        f->right[i] = -f->way.force[f->place[i]] * f->size[i];
}

/* Newton's direction, damped so far that it leads down; how far it goes, infinite where there is none. */
static double find_direction(finder *f)
{
    double largest, damp = 0;
    size_t size = (size_t)f->count * sizeof(double);
    make_matrix(f, &largest);
    for (int k = 0; k < MOST_DAMPINGS; k++) {
        memcpy(f->factored, f->matrix, size * (size_t)f->count);
        memcpy(f->step, f->right, size);
        for (int i = 0; i < f->count; i++)
            f->factored[i + i * f->count] += damp;
        if (kmp_lu_factor(f->count, f->factored, f->pivot) == 0) {
            double down = 0, far = 0;
            kmp_lu_solve(f->count, f->factored, f->pivot, 1, f->step);
            for (int i = 0; i < f->count; i++) {
                down += f->step[i] * f->right[i];
                far = fmax(far, fabs(f->step[i]));
            }
            if (isfinite(far) && (down > 0 || f->residual <= BALANCED))
                return far;
        }
        damp = damp > 0 ? 4 * damp : LEAST_DAMP * fmax(largest, 1);
    }
    return INFINITY;
}

static void spread(finder *f, double part)
{
    memset(f->way.step, 0, (size_t)f->way.l->p * sizeof *f->way.step);
    for (int k = 0; k < f->held->count; k++)
        f->trial_rate[k] = f->rate_here[k];
    for (int i = 0; i < f->count; i++) {
        double step = part * f->step[i] * unknown_size(f, i);
        if (f->rate[i] < 0)
            f->way.step[f->place[i]] = step;
        else
            f->trial_rate[f->rate[i]] += step;
    }
    (void)kmp_way_spread(&f->way);
}

static void set_rates(finder *f, const double *rates)
{
    for (int k = 0; k < f->held->count; k++)
        f->held->rates[k].rate = rates[k];
    kmp_way_take_rates(&f->way);
}

/* s'R of the trial. */
static double work_along(const finder *f)
{
    double work = 0;
    for (int i = 0; i < f->count; i++)
        work -= f->step[i] * f->way.l->residual[f->place[i]] * f->size[i];
    return work;
}

/* The part of the step that is gone; 0: nowhere, and the state is as it was. The matrix at the way's begin serves: the
 * unknowns and their sizes are those of it. */
static double search_line(finder *f, double part)
{
    double first = 0;
    for (int i = 0; i < f->count; i++)
        first += f->step[i] * f->right[i];
    for (int k = 0; k < MOST_HALVINGS; k++) {
        spread(f, part);
        set_rates(f, f->trial_rate);
        bool there = kmp_way_try(&f->way, 1);
        set_rates(f, f->rate_here);
        double last = there ? work_along(f) : NAN;
        if (last >= -0.5 * fabs(first))
            return part;
        part *= there ? fmax(0.1, fmin(0.8, first / (first - last))) : 0.5;
    }
    return 0;
}

static bool step(finder *f)
{
    double far = find_direction(f);
    if (!(far < INFINITY))
        return false;
    double wanted = far > f->bound ? f->bound / far : 1, part = search_line(f, wanted);
    if (part * far < LEAST_STEP) {
        (void)kmp_way_at(&f->way, f->way.q);
        return false;
    }
    if (part == wanted && wanted < 1)
        f->bound *= 2;
    else if (part < wanted)
        f->bound = fmax(part * far, 1e-9);
    memcpy(f->rate_here, f->trial_rate, (size_t)f->held->count * sizeof *f->rate_here);
    set_rates(f, f->rate_here);
    return arrive(f);
}

/* -- all of it ------------------------------------------------------------------------------------------ */

/* What is farthest from balance. */
static kempe_status complain(const finder *f, const char *why)
{
    const kmp_linear *l = f->way.l;
    int worst = 0;
    for (int i = 1; i < f->count; i++)
        if (fabs(l->residual[f->place[i]]) * f->size[i] > fabs(l->residual[f->place[worst]]) * f->size[worst])
            worst = i;
    const kmp_motion *m = &l->system->model->motions[l->part.u[f->place[worst]]];
    return kmp_fail(
        l->system->context, KEMPE_E_FAILED,
        "no balance is found: after %d iterations %.3g %s are left along '%s' (%s): what is held may push it "
        "over; hold it too, or begin where what carries it is near",
        f->held->iterations, fabs(l->residual[f->place[worst]]), m->rotation ? "N m" : "N", m->name, why);
}

static kempe_status polish(finder *f)
{
    for (int k = 0; k < MOST_POLISH && f->residual > 0; k++) {
        double before = f->residual;
        memcpy(f->way.begin, f->way.q, (size_t)f->way.n * sizeof *f->way.q);
        memcpy(f->trial_rate, f->rate_here, (size_t)f->held->count * sizeof *f->trial_rate);
        double *kept = f->way.values; /* a copy of the rates: p of them at most */
        memcpy(kept, f->rate_here, (size_t)f->held->count * sizeof *kept);
        if (step(f) && f->residual < 0.5 * before)
            continue;
        set_rates(f, kept);
        memcpy(f->rate_here, kept, (size_t)f->held->count * sizeof *kept);
        return kmp_way_at(&f->way, f->way.begin) && arrive(f) ? KEMPE_OK : complain(f, "the state is lost");
    }
    return KEMPE_OK;
}

static kempe_status find(finder *f)
{
    kempe_status status = kmp_way_choose(&f->way);
    if (status != KEMPE_OK)
        return status;
    if (!kmp_way_at(&f->way, f->way.q) || !arrive(f))
        return f->way.status != KEMPE_OK ? f->way.status
                                         : kmp_fail(f->way.l->system->context, KEMPE_E_FAILED,
                                                    "the equations cannot be evaluated there: loops that do not close "
                                                    "with what is held, or numbers that are not finite");
    for (int k = 0; k < MOST_STEPS && f->residual > BALANCED; k++) {
        if (kmp_interrupted(f->way.l->system->context))
            return complain(f, "interrupted");
        if (!step(f))
            return f->way.status != KEMPE_OK ? f->way.status : complain(f, "no step leads further");
    }
    return f->residual <= BALANCED ? polish(f) : complain(f, "too many steps");
}

kempe_status kmp_held_find(kmp_linear *linear, double t, double *q, kmp_held *held)
{
    finder f;
    kmp_search search = {.rates = held->rates, .rate_count = held->count};
    held->iterations = 0;
    kempe_status status = init(&f, linear, &search, t, held) ? KEMPE_OK : kmp_fail_memory(linear->system->context);
    double *given = KMP_NEW(double, held->count);
    for (int k = 0; given && k < held->count; k++)
        given[k] = held->rates[k].rate;
    if (status == KEMPE_OK && !given)
        status = kmp_fail_memory(linear->system->context);
    if (status == KEMPE_OK) {
        memcpy(f.way.q, q, (size_t)linear->n * sizeof *q);
        status = find(&f);
        held->residual = f.residual;
    }
    if (status == KEMPE_OK)
        memcpy(q, f.way.q, (size_t)linear->n * sizeof *q);
    else
        for (int k = 0; given && k < held->count; k++)
            held->rates[k].rate = given[k];
    if (status == KEMPE_E_FAILED && kmp_interrupted(linear->system->context))
        status = KEMPE_STOPPED;
    kmp_free(given);
    release(&f);
    return status;
}
