/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of instances, in lanes and in separate runs: the account of each instance gets the states of its steps, so
 * that it does not depend on other instances. A lane's states are those of its interpolant on closed loops. */
#include "integrators/formulations/formulation.h"
#include "integrators/lanes/ensemble_inside.h"
#include "integrators/run/runner.h"
#include "integrators/steppers/dop853.h"
#include <math.h>
#include <string.h>

enum { VECTORS = 8 }; /* of the interpolant */

typedef struct kmp_measuring {
    const kmp_run_quantities *q;
    double *room;            /* of one account at a time */
    double *row;             /* q, qd, qdd, lambda */
    double *y;               /* size: unknowns within a step */
    double *vector[VECTORS]; /* size: the interpolant of a lane's step */
    double *end;             /* of the channels */
    double *accounts;        /* of a chunk, one for each instance */
} kmp_measuring;

/* The source of states within a step: a lane's interpolant, or a run. */
typedef struct within {
    kmp_engine *e;
    kmp_pool *pool;
    double t, h;
    kmp_runner *run;
} within;

bool kmp_measuring_init(kmp_engine *e)
{
    const kmp_run_quantities *q = e->execution.quantities;
    kmp_arena *a = &e->run_arena;
    int size = e->size > 0 ? e->size : 0;
    e->measuring = NULL;
    if (!q || q->count == 0)
        return true;
    kmp_measuring *m = e->measuring = KMP_ARENA_NEW(a, kmp_measuring, 1);
    if (!m)
        return false;
    m->q = q;
    for (int k = 0; k < VECTORS; k++)
        m->vector[k] = KMP_ARENA_NEW(a, double, size);
    return KMP_ARENA_MAKE(a, KMP_ROOM(double, kmp_account_room(q), &m->room),
                          KMP_ROOM(double, 3 * e->n + e->m, &m->row), KMP_ROOM(double, size, &m->y),
                          KMP_ROOM(double, q->channels, &m->end));
}

bool kmp_measuring_chunk(kmp_engine *e)
{
    if (!e->measuring)
        return true;
    e->measuring->accounts = KMP_ARENA_NEW(&e->arena, double, (size_t)e->count *kmp_account_size(e->measuring->q));
    return e->measuring->accounts;
}

bool kmp_measures_steps(const kmp_engine *e)
{
    const kmp_run_quantities *q = e->execution.quantities;
    return q && q->inside;
}

static double *account_of(const kmp_engine *e, int i)
{
    return e->measuring->accounts + (size_t)i * kmp_account_size(e->measuring->q);
}

void kmp_instance_begin_account(kmp_engine *e, int i)
{
    if (e->measuring)
        kmp_account_begin(e->measuring->q, account_of(e, i));
}

/* The channels at a row. */
static void channels_at(kmp_engine *e, double t, const double *row, double *values)
{
    const kmp_run_quantities *q = e->measuring->q;
    int n = e->n;
    const double *shown = kmp_eval_shown(e->eval, t, row, row + n, row + 2 * n, row + 3 * n);
    for (int c = 0; c < q->channels; c++)
        values[c] = shown[q->shown[c]];
}

/* Accelerations and multipliers of a state of a pool, after kmp_instance_state. */
static bool complete(kmp_engine *e, kmp_pool *pool, double *row)
{
    int n = e->n;
    double *qdd = row + 2 * n, *udd = e->measuring->y;
    kmp_eval_mass(e->eval);
    kmp_eval_bias(e->eval, row + n);
    if (kmp_reduction_accelerate(&pool->red, udd))
        return false;
    kmp_reduction_accelerations(&pool->red, udd, qdd);
    kmp_reduction_multipliers(&pool->red, qdd, row + 3 * n);
    return true;
}

static bool lane_channels(void *user, double t, double *values)
{
    const within *in = user;
    kmp_engine *e = in->e;
    kmp_measuring *m = e->measuring;
    kmp_rk_interpolate(e->size, VECTORS, m->vector, (t - in->t) / in->h, m->y);
    if (!kmp_instance_state(e, in->pool, t, m->y, m->row, m->row + e->n, true) ||
        (m->q->late && !complete(e, in->pool, m->row)))
        return false;
    channels_at(e, t, m->row, values);
    return true;
}

static bool run_channels(void *user, double t, double *values)
{
    const within *in = user;
    kmp_measuring *m = in->e->measuring;
    double work;
    if (kmp_runner_row(in->run, t, m->row, &work) != KEMPE_OK)
        return false;
    channels_at(in->e, t, m->row, values);
    return true;
}

/* Gives the evaluator the inputs of a step, and takes them back. */
static void hold_inputs(kmp_engine *e, const kmp_present_inputs *inputs)
{
    kmp_present_inputs *own = &e->eval->inputs;
    if (inputs && own->count > 0)
        kmp_present_inputs_copy(own, inputs);
    else if (own->count > 0)
        memset(own->replaced, 0, (size_t)own->count * sizeof *own->replaced);
    own->held = inputs != NULL;
}

/* Vectors of the interpolant of a lane. false: it is less exact than the step, where a run would integrate anew. */
static bool take_vectors(kmp_engine *e, size_t l)
{
    const kmp_lane_room *room = &e->room;
    double h = room->step[l], most = 0, *const *vector = e->measuring->vector;
    for (int i = 0; i < e->size; i++) {
        size_t at = (size_t)i * room->w + l;
        double cubic[4];
        kmp_rk_cubic(h, room->y[at], room->y_new[at], room->k[1][at], room->k[13][at], cubic);
        for (int j = 0; j < 4; j++) {
            vector[j][i] = cubic[j];
            vector[4 + j][i] = kmp_dop853_dense(h, room->k, at, j);
        }
        most = fmax(most, fabs(vector[VECTORS - 1][i]) / room->weight[at]);
    }
    return ldexp(most, 1 - VECTORS) <= KMP_RK_COARSE;
}

bool kmp_lane_measure(kmp_engine *e, kmp_pool *pool, size_t l)
{
    const kmp_lane_room *room = &e->room;
    kmp_measuring *m = e->measuring;
    int i = room->who[l];
    within in = {.e = e, .pool = pool, .t = room->t[l], .h = room->step[l]};
    if (!take_vectors(e, l))
        return false;
    kmp_instance_current(e, &e->instances[i]);
    hold_inputs(e, &e->instances[i].inputs);
    bool good =
        kmp_account_step(m->q, account_of(e, i), m->room, e->spec.rtol, room->t[l], room->t_new[l], lane_channels, &in);
    hold_inputs(e, NULL);
    return good;
}

bool kmp_run_measure(kmp_engine *e, int i, kmp_runner *run)
{
    kmp_measuring *m = e->measuring;
    within in = {.e = e, .run = run};
    if (!m || !m->q->inside)
        return true;
    hold_inputs(e, kmp_runner_inputs(run));
    bool good = kmp_account_step(m->q, account_of(e, i), m->room, e->spec.rtol, kmp_runner_t_old(run),
                                 kmp_runner_t(run), run_channels, &in);
    hold_inputs(e, NULL);
    return good;
}

void kmp_instance_measured(kmp_engine *e, kmp_pool *pool, int i, double t, const double *row)
{
    kmp_measuring *m = e->measuring;
    bool known = true;
    if (!m)
        return;
    e->eval->inputs.before = true;
    if (row)
        memcpy(m->row, row, (size_t)(3 * e->n + e->m) * sizeof *row);
    else
        memcpy(m->row, e->state, (size_t)(2 * e->n) * sizeof *row);
    if (!row && m->q->late)
        known = complete(e, pool, m->row);
    channels_at(e, t, m->row, m->end);
    e->eval->inputs.before = false;
    for (int c = 0; c < m->q->channels && !known; c++)
        m->end[c] = NAN;
    kmp_account_values(m->q, account_of(e, i), 0, t, m->end, e->taken + (size_t)i * (size_t)m->q->values);
}
