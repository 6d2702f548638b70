/* SPDX-License-Identifier: BSD-3-Clause */
/* Maps of a motion without sensitivities, for the adjoint method: how the state after an event, or after a change of
 * unknowns, changes with the state before it and with parameters. For these moments the motion has columns of
 * sensitivities by each parameter, each u and ud, and each distance at which friction is held. The formulation passes
 * the event with them as it does with sensitivities (forward.c): the columns behind it are the map. Several events at
 * one time have one map, because the time of an event may depend on the event before. A change of unknowns
 * without an event needs no columns: the state determines it. */
#include "analyses/sensitivity/forward_map.h"
#include "base/context.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>
#include <string.h>

struct kmp_forward_before {
    int *row;                 /* of the map */
    double *q, *mode, *chart; /* of the map */
    double *now, *chart_now;  /* conditions and charts behind the event */
    double *held;             /* columns x held rows */
    bool reported;            /* since the last step */
};

void kmp_forward_set_columns(kmp_forward_formulation *f, int count)
{
    f->count = f->v->columns = count;
    f->integrals = f->options->integrand ? 1 + count : 0;
    f->v->linear.plain = count == 0;
}

/* Friction, and not a contact. */
static bool may_be_held(const kmp_friction_element *e)
{
    return !e->contact;
}

static const kmp_friction_run *friction_of(const kmp_forward_formulation *f)
{
    return f->start.passed ? f->start.passed->friction : NULL;
}

/* Room for maps with at most f->most columns. */
static bool make_room(kmp_forward_formulation *f)
{
    const kmp_friction_run *friction = friction_of(f);
    const int n = f->n, conditions = f->system->events.count, charts = KMP_CHART_SIZE * f->system->chart_count;
    int held = 0;
    for (int i = 0; friction && i < friction->count; i++)
        held += may_be_held(&friction->element[i]);
    struct kmp_forward_before *x = f->before_event = KMP_ARENA_NEW(&f->arena, struct kmp_forward_before, 1);
    if (!x || !KMP_ARENA_MAKE(&f->arena, KMP_ROOM(int, held, &x->row), KMP_ROOM(double, n, &x->q),
                              KMP_ROOM(double, conditions, &x->mode, &x->now),
                              KMP_ROOM(double, charts, &x->chart, &x->chart_now),
                              KMP_ROOM(double, held * f->most, &x->held), KMP_ROOM(double, f->most, &f->column_size)))
        return false;
    f->map = (kmp_forward_map){.row = x->row, .q = x->q, .mode = x->mode, .chart = x->chart};
    for (int i = 0; friction && i < friction->count; i++)
        if (may_be_held(&friction->element[i]))
            x->row[f->map.held++] = friction->element[i].row;
    return true;
}

/* The state at (t, y) in the conditions and charts of the last step. */
static int take_before(kmp_forward_formulation *f, double t, const double *y)
{
    struct kmp_forward_before *x = f->before_event;
    kmp_evaluator *eval = kmp_forward_eval(f);
    const kmp_linear *l = &f->v->linear;
    const size_t modes = (size_t)f->system->events.count * sizeof(double);
    const size_t charts = (size_t)(KMP_CHART_SIZE * f->system->chart_count) * sizeof(double);
    memcpy(x->now, eval->mode, modes);
    memcpy(x->chart_now, eval->chart, charts);
    kmp_eval_set_modes(eval, f->mode);
    kmp_eval_set_charts(eval, f->chart);
    const int said = kmp_forward_stand_at(f, t, y, false);
    memcpy(x->q, l->q, (size_t)f->n * sizeof *x->q);
    memcpy(x->mode, f->mode, modes);
    memcpy(x->chart, f->chart, charts);
    kmp_eval_set_modes(eval, x->now);
    kmp_eval_set_charts(eval, x->chart_now);
    return said;
}

/* Columns by all that the state before depends on: each of u, ud and the held distances by itself. */
static void put_units(kmp_forward_formulation *f)
{
    const kempe_system *s = f->system;
    const int p = f->p, columns = f->map.columns, half = p * (1 + columns), first = f->v->count;
    memset(f->wide, 0, (size_t)(2 * half + f->integrals) * sizeof *f->wide);
    memset(f->held, 0, (size_t)(columns * f->m) * sizeof *f->held);
    for (int i = 0; i < p; i++) {
        const int of_u = first + i, of_ud = first + p + i;
        f->wide[(1 + of_u) * p + i] = 1;
        f->wide[half + (1 + of_ud) * p + i] = 1;
        f->column_size[of_u] = s->scale[f->v->linear.part.u[i]];
        f->column_size[of_ud] = s->scale[f->v->linear.part.u[i]] * f->start.rate_scale;
    }
    for (int j = 0; j < f->map.held; j++) {
        f->held[(first + 2 * p + j) * f->m + f->map.row[j]] = 1;
        f->column_size[first + 2 * p + j] = s->row_scale[f->map.row[j]];
    }
    f->v->held = f->map.held > 0 ? f->held : NULL;
}

static int begin(kmp_forward_formulation *f, double t, const double *y)
{
    const int most = f->v->count + 2 * f->n + f->map.held;
    if (f->most < most && !(kmp_forward_make_columns(f, most) && make_room(f))) {
        (void)kmp_fail_memory(f->system->context);
        return KMP_HALT;
    }
    if (take_before(f, t, y) != KMP_GO)
        return KMP_HALT;
    /* Times of events before, by other columns, no longer count. */
    f->follows = false;
    for (int k = 0; k < f->system->events.count; k++) {
        f->follows = f->follows || kmp_same_time(f->swung_t[k], t);
        f->swung_t[k] = NAN;
    }
    f->last_t = NAN;
    f->map.t = t;
    f->map.p = f->p;
    f->map.columns = f->v->count + 2 * f->p + f->map.held;
    f->map.requirement = NULL;
    kmp_forward_set_columns(f, f->map.columns);
    put_units(f);
    f->before_event->reported = false;
    f->mapped = true;
    f->t = NAN; /* the place has no columns */
    return KMP_GO;
}

double *kmp_forward_map_begin(kmp_forward_formulation *f, double t, const double *y)
{
    const int w = f->p, half = w;
    if (!f->mapped && begin(f, t, y) != KMP_GO)
        return NULL;
    kmp_forward_set_columns(f, f->map.columns);
    memcpy(f->wide, y, (size_t)w * sizeof *y);
    memcpy(f->wide + kmp_forward_blocks(f), y + half, (size_t)w * sizeof *y);
    if (f->integrals)
        f->wide[2 * kmp_forward_blocks(f)] = y[2 * half];
    return f->wide;
}

int kmp_forward_map_end(kmp_forward_formulation *f, double *y)
{
    const int w = f->p, wide = kmp_forward_blocks(f);
    const kmp_sensitivity_equations_watch *watch = &f->options->watch;
    struct kmp_forward_before *x = f->before_event;
    /* Held distances behind the event. */
    const kmp_friction_run *friction = friction_of(f);
    const int held = f->map.held;
    for (int i = 0, j = 0; friction && i < friction->count; i++) {
        const kmp_friction_element *e = &friction->element[i];
        if (!may_be_held(e))
            continue;
        for (int k = 0; k < f->map.columns; k++)
            f->before_event->held[k * held + j] = e->stance == KMP_FRICTION_HELD ? f->held[k * f->m + e->row] : 0;
        j++;
    }
    f->map.part = &f->v->linear.part;
    f->map.p_after = w;
    f->map.u_after = f->wide + w;
    f->map.ud_after = f->wide + wide + w;
    f->map.held_after = x->held;
    f->map.integral_after = f->integrals ? f->wide + 2 * wide + 1 : NULL;
    const int said = watch->map ? watch->map(watch->user, &f->map, x->reported) : 0;
    x->reported = true;
    memcpy(y, f->wide, (size_t)w * sizeof *y);
    memcpy(y + w, f->wide + wide, (size_t)w * sizeof *y);
    if (f->integrals)
        y[2 * w] = f->wide[2 * wide];
    kmp_forward_set_columns(f, 0);
    if (said)
        (void)kmp_fail_memory(f->system->context);
    return said ? KMP_HALT : KMP_GO;
}

/* After an event, and with friction that may be held, an exchange is a part of a map with columns. */
bool kmp_forward_map_exchanges(const kmp_forward_formulation *f)
{
    return f->options->alone && f->before_event && !f->mapped && f->map.held == 0;
}

bool kmp_forward_map_begin_exchange(kmp_forward_formulation *f, double t, const double *y)
{
    if (take_before(f, t, y) != KMP_GO)
        return false;
    const kmp_forward_map before = f->map;
    f->map = (kmp_forward_map){
        .t = t, .p = f->p, .row = before.row, .q = before.q, .mode = before.mode, .chart = before.chart};
    return true;
}

int kmp_forward_map_end_exchange(kmp_forward_formulation *f)
{
    const kmp_sensitivity_equations_watch *watch = &f->options->watch;
    f->map.part = &f->v->linear.part;
    f->map.p_after = f->p;
    if (!watch->map || watch->map(watch->user, &f->map, false) == 0)
        return KMP_GO;
    (void)kmp_fail_memory(f->system->context);
    return KMP_HALT;
}

bool kmp_forward_map_begin_start(kmp_forward_formulation *f)
{
    if (!make_room(f))
        return false;
    f->map.t = f->start.t;
    f->map.p = 0;
    f->map.columns = f->v->count;
    kmp_forward_set_columns(f, f->v->count);
    f->mapped = true;
    return true;
}
