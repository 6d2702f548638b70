/* SPDX-License-Identifier: BSD-3-Clause */
/* Maps of a motion without sensitivities, for the adjoint method: how the state after an event, or after a change of
 * unknowns, changes with the state before it and with parameters. For these moments the motion has columns of
 * sensitivities by each parameter, each u and ud, and each distance at which friction is held. The formulation passes
 * the event with them as it does with sensitivities (forward.c): the columns behind it are the map. Several events at
 * one time have one map, because the time of an event may depend on the event before. A change of unknowns
 * without an event needs no columns: the state determines it. */
#include "analyses/sensitivity/forward_map.h"
#include "analyses/sensitivity/forward_changes.h"
#include "base/context.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>
#include <string.h>

struct kmp_forward_mapping {
    kmp_forward_map map;      /* the one that has begun, or the last one */
    int *row;                 /* of the map */
    double *q, *mode, *chart; /* of the map */
    double *held;             /* columns x held rows */
    double *unknowns;         /* of the formulation, with the columns of the map */
    double *size;  /* columns: of the quantity by which one that does not belong to a parameter differentiates */
    bool begun;    /* no step has ended since */
    bool reported; /* since the last step */
    bool follows;  /* an event with states came just before it */
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
    const int n = f->n;
    int held = 0;
    for (int i = 0; friction && i < friction->count; i++)
        held += may_be_held(&friction->element[i]);
    kmp_forward_mapping *x = f->mapping = KMP_ARENA_NEW(&f->arena, kmp_forward_mapping, 1);
    if (!x || !KMP_ARENA_MAKE(&f->arena, KMP_ROOM(int, held, &x->row), KMP_ROOM(double, n, &x->q),
                              KMP_ROOM(double, f->system->events.count, &x->mode),
                              KMP_ROOM(double, KMP_CHART_SIZE * f->system->chart_count, &x->chart),
                              KMP_ROOM(double, held * f->most, &x->held), KMP_ROOM(double, f->most, &x->size),
                              KMP_ROOM(double, (2 * n + 1) * (1 + f->most), &x->unknowns)))
        return false;
    x->map = (kmp_forward_map){.row = x->row, .q = x->q, .mode = x->mode, .chart = x->chart};
    for (int i = 0; friction && i < friction->count; i++)
        if (may_be_held(&friction->element[i]))
            x->row[x->map.held++] = friction->element[i].row;
    return true;
}

/* The state at (t, y) in the conditions and charts of the last step. */
static int take_before(kmp_forward_formulation *f, double t, const double *y)
{
    kmp_forward_mapping *x = f->mapping;
    kmp_forward_step_back(f);
    const int said = kmp_forward_stand_at(f, t, y, false);
    memcpy(x->q, f->v->linear.q, (size_t)f->n * sizeof *x->q);
    memcpy(x->mode, f->mode, kmp_forward_mode_bytes(f));
    memcpy(x->chart, f->place.chart, kmp_forward_chart_bytes(f));
    kmp_forward_step_forth(f);
    return said;
}

/* Columns by all that the state before depends on: each of u, ud and the held distances by itself. */
static void put_units(kmp_forward_formulation *f)
{
    const kempe_system *s = f->system;
    kmp_forward_mapping *x = f->mapping;
    const int p = f->p, columns = x->map.columns, half = p * (1 + columns), first = f->v->count;
    memset(x->unknowns, 0, (size_t)(2 * half + f->integrals) * sizeof *x->unknowns);
    memset(f->held, 0, (size_t)(columns * f->m) * sizeof *f->held);
    for (int i = 0; i < p; i++) {
        const int of_u = first + i, of_ud = first + p + i;
        x->unknowns[(1 + of_u) * p + i] = 1;
        x->unknowns[half + (1 + of_ud) * p + i] = 1;
        x->size[of_u] = s->scale[f->v->linear.part.u[i]];
        x->size[of_ud] = s->scale[f->v->linear.part.u[i]] * f->start.rate_scale;
    }
    for (int j = 0; j < x->map.held; j++) {
        f->held[(first + 2 * p + j) * f->m + x->map.row[j]] = 1;
        x->size[first + 2 * p + j] = s->row_scale[x->map.row[j]];
    }
    f->v->held = x->map.held > 0 ? f->held : NULL;
}

static int begin(kmp_forward_formulation *f, double t, const double *y)
{
    const int most = f->v->count + 2 * f->n + f->mapping->map.held;
    /* Times of events before, by other columns, no longer count. */
    const bool follows = kmp_event_times_forget(&f->times, t);
    f->event.last_t = NAN;
    if (f->most < most && !(kmp_forward_make_columns(f, most) && make_room(f))) {
        (void)kmp_fail_memory(f->system->context);
        return KMP_HALT;
    }
    if (take_before(f, t, y) != KMP_GO)
        return KMP_HALT;
    kmp_forward_mapping *x = f->mapping;
    x->follows = follows;
    x->map.t = t;
    x->map.p = f->p;
    x->map.columns = f->v->count + 2 * f->p + x->map.held;
    x->map.requirement = NULL;
    kmp_forward_set_columns(f, x->map.columns);
    put_units(f);
    x->reported = false;
    x->begun = true;
    f->place.t = NAN; /* the place has no columns */
    return KMP_GO;
}

double *kmp_forward_map_begin(kmp_forward_formulation *f, double t, const double *y)
{
    if (!f->mapping->begun && begin(f, t, y) != KMP_GO)
        return NULL;
    kmp_forward_map_go_on(f);
    const int w = f->p, half = kmp_forward_blocks(f);
    double *all = f->mapping->unknowns;
    memcpy(all, y, (size_t)w * sizeof *y);
    memcpy(all + half, y + w, (size_t)w * sizeof *y);
    if (f->integrals)
        all[2 * half] = y[2 * w];
    return all;
}

void kmp_forward_map_go_on(kmp_forward_formulation *f)
{
    kmp_forward_set_columns(f, f->mapping->map.columns);
}

double *kmp_forward_map_unknowns(kmp_forward_formulation *f)
{
    double *all = f->mapping->unknowns;
    kmp_forward_map_go_on(f);
    kmp_forward_pack(f, all);
    memcpy(all + 2 * kmp_forward_blocks(f), f->place.tail, (size_t)f->integrals * sizeof *all);
    return all;
}

/* Reports the map, with what is behind it. */
static int report(kmp_forward_formulation *f, bool again)
{
    const kmp_sensitivity_equations_watch *watch = &f->options->watch;
    kmp_forward_map *map = &f->mapping->map;
    map->part = &f->v->linear.part;
    map->p_after = f->p;
    if (!watch->map || watch->map(watch->user, map, again) == 0)
        return KMP_GO;
    (void)kmp_fail_memory(f->system->context);
    return KMP_HALT;
}

int kmp_forward_map_end(kmp_forward_formulation *f, double *y)
{
    const int w = f->p, wide = kmp_forward_blocks(f);
    kmp_forward_mapping *x = f->mapping;
    /* Held distances behind the event. */
    const kmp_friction_run *friction = friction_of(f);
    const int held = x->map.held;
    for (int i = 0, j = 0; friction && i < friction->count; i++) {
        const kmp_friction_element *e = &friction->element[i];
        if (!may_be_held(e))
            continue;
        for (int k = 0; k < x->map.columns; k++)
            x->held[k * held + j] = e->stance == KMP_FRICTION_HELD ? f->held[k * f->m + e->row] : 0;
        j++;
    }
    x->map.u_after = x->unknowns + w;
    x->map.ud_after = x->unknowns + wide + w;
    x->map.held_after = x->held;
    x->map.integral_after = f->integrals ? x->unknowns + 2 * wide + 1 : NULL;
    const int said = report(f, x->reported);
    x->reported = true;
    memcpy(y, x->unknowns, (size_t)w * sizeof *y);
    memcpy(y + w, x->unknowns + wide, (size_t)w * sizeof *y);
    if (f->integrals)
        y[2 * w] = x->unknowns[2 * wide];
    kmp_forward_set_columns(f, 0);
    return said;
}

void kmp_forward_map_end_step(kmp_forward_formulation *f)
{
    if (f->mapping)
        f->mapping->begun = false;
}

bool kmp_forward_map_follows_event(const kmp_forward_formulation *f)
{
    return f->mapping && f->mapping->follows;
}

double kmp_forward_map_column_size(const kmp_forward_formulation *f, int column)
{
    return f->mapping->size[column];
}

kmp_forward_requirement *kmp_forward_map_require(kmp_forward_formulation *f, int terms, double **off, double **term)
{
    kmp_forward_map *map = &f->mapping->map;
    kmp_forward_requirement *requirement = KMP_ARENA_NEW(&f->arena, kmp_forward_requirement, 1);
    if (!requirement ||
        !KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, f->count, off), KMP_ROOM(double, terms * f->count, term)))
        return NULL;
    *requirement = (kmp_forward_requirement){.off = *off, .term = *term, .terms = terms, .before = map->requirement};
    map->requirement = requirement;
    return requirement;
}

/* After an event, and with friction that may be held, an exchange is a part of a map with columns. */
bool kmp_forward_map_exchanges(const kmp_forward_formulation *f)
{
    const kmp_forward_mapping *x = f->mapping;
    return x && !x->begun && x->map.held == 0;
}

bool kmp_forward_map_begin_exchange(kmp_forward_formulation *f, double t, const double *y)
{
    kmp_forward_mapping *x = f->mapping;
    if (take_before(f, t, y) != KMP_GO)
        return false;
    x->map = (kmp_forward_map){.t = t, .p = f->p, .row = x->row, .q = x->q, .mode = x->mode, .chart = x->chart};
    return true;
}

int kmp_forward_map_end_exchange(kmp_forward_formulation *f)
{
    return report(f, false);
}

bool kmp_forward_map_begin_start(kmp_forward_formulation *f)
{
    if (!make_room(f))
        return false;
    f->mapping->map.t = f->start.t;
    f->mapping->map.p = 0;
    f->mapping->map.columns = f->v->count;
    kmp_forward_map_go_on(f);
    f->mapping->begun = true;
    return true;
}
