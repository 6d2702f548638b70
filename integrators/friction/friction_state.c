/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/friction/friction_state.h"
#include "base/memory.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>
#include <string.h>

static kempe_status make_site(kmp_friction_state *x, kmp_evaluator *eval, bool *none)
{
    const kempe_system *s = eval->system;
    kmp_runner *run = x->site;
    run->s = s;
    run->eval = eval;
    run->spec.t_end = 1;
    run->friction = kmp_friction_new(run, none);
    if (*none)
        return KEMPE_OK;
    bool made = KMP_ARENA_MAKE(&run->arena, KMP_ROOM(double, s->n, &run->qdd), KMP_ROOM(double, s->m, &run->lambda),
                               KMP_ROOM(double, 3 * s->n + s->m, &run->moved, &run->state),
                               KMP_ROOM(kmp_friction_view, run->friction ? run->friction->count : 0, &x->view));
    KMP_TRY(kmp_made(s->context, run->friction && made));
    run->loaded_friction = kmp_friction_is_loaded(s->model);
    x->lambda = run->lambda;
    x->count = run->friction->count;
    for (int i = 0; i < x->count; i++)
        x->view[i].element = s->events.condition[run->friction->element[i].slot].of;
    return KEMPE_OK;
}

kempe_status kmp_friction_state_new(kmp_evaluator *eval, kmp_friction_state **state, bool *none)
{
    KMP_MAKE(eval->system->context, kmp_friction_state, x);
    x->site = KMP_NEW(kmp_runner, 1);
    *none = false;
    kempe_status status = kmp_made(eval->system->context, x->site);
    if (status == KEMPE_OK)
        status = make_site(x, eval, none);
    if (status == KEMPE_OK && !*none) {
        *state = x;
        return KEMPE_OK;
    }
    kmp_friction_state_free(x);
    return status;
}

void kmp_friction_state_free(kmp_friction_state *state)
{
    if (!state)
        return;
    if (state->site) {
        kmp_partition_free(&state->site->part);
        kmp_arena_free(&state->site->arena);
    }
    kmp_free(state->site);
    kmp_free(state);
}

void kmp_friction_state_release(kmp_evaluator *eval)
{
    const kmp_events *events = &eval->system->events;
    for (int k = 0; eval->holds_friction && k < events->count; k++)
        if (events->condition[k].role != KMP_ROLE_NONE)
            kmp_eval_set_kink(eval, k, 0);
    eval->holds_friction = false;
}

/* The state of the site, with all conditions as they are there. */
static void visit(kmp_friction_state *x, double t, const double *q, const double *qd)
{
    kmp_runner *run = x->site;
    int n = run->s->n;
    memcpy(run->state, q, (size_t)n * sizeof *q);
    memset(run->state + n, 0, (size_t)n * sizeof *q);
    if (qd)
        memcpy(run->state + n, qd, (size_t)n * sizeof *qd);
    kmp_friction_state_release(run->eval);
    kmp_eval_freeze(run->eval, t, run->state, run->state + n);
    run->eval->frozen = false;
    run->eval->holds_friction = true;
    kmp_eval_all_changes(run->eval, t, run->state, run->state + n, run->qdd, run->lambda, run->friction->change);
}

static kmp_friction_word word_of(const kmp_friction_element *e)
{
    switch (e->stance) {
    case KMP_FRICTION_SLIPS:
    case KMP_FRICTION_SMOOTH:
        return KMP_FRICTION_WORD_SLIPS;
    case KMP_FRICTION_HELD:
        return KMP_FRICTION_WORD_STICKS;
    case KMP_FRICTION_CARRIED:
        return KMP_FRICTION_WORD_SHARES;
    default:
        return KMP_FRICTION_WORD_OPEN;
    }
}

static void take_views(kmp_friction_state *x, double t)
{
    kmp_runner *run = x->site;
    kmp_friction_run *f = run->friction;
    kmp_eval_all_changes(run->eval, t, run->state, run->state + run->s->n, run->qdd, run->lambda, f->change);
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &f->element[i];
        x->view[i].force = kmp_friction_at(f, e, KMP_ROLE_GIVEN);
        x->view[i].largest =
            fmax(kmp_friction_at(f, e, KMP_ROLE_STATIC), fmax(kmp_friction_at(f, e, KMP_ROLE_LEVEL), 0));
        x->view[i].word = word_of(e);
        if (e->stance == KMP_FRICTION_SLIPS || e->stance == KMP_FRICTION_SMOOTH || x->view[i].largest > 0)
            continue;
        kmp_friction_set_slip(run, e, 0, 0);
        x->view[i].word = KMP_FRICTION_WORD_SLIPS;
    }
}

kempe_status kmp_friction_state_decide(kmp_friction_state *state, double t, const double *q, const double *qd)
{
    kmp_runner *run = state->site;
    visit(state, t, q, qd);
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, run->state, -1, NULL, 0));
    run->friction->repeats = run->friction->changes = 0;
    for (int i = 0; i < state->count; i++)
        run->friction->element[i].smooth = false;
    KMP_TRY(kmp_friction_settle(run, t, run->state, run->state + run->s->n));
    take_views(state, t);
    return KEMPE_OK;
}

void kmp_friction_state_look(kmp_friction_state *state, double t, const double *q, const double *qd)
{
    const kmp_friction_run *f = state->site->friction;
    visit(state, t, q, qd);
    for (int i = 0; i < state->count; i++) {
        state->view[i].place = kmp_friction_at(f, &f->element[i], KMP_ROLE_PLACE);
        state->view[i].rate = kmp_friction_at(f, &f->element[i], KMP_ROLE_RATE);
    }
    kmp_friction_state_release(state->site->eval);
}

/* Holds the row of an element if it is independent. */
static kempe_status hold(kmp_friction_state *x, int i, double t, double place)
{
    kmp_runner *run = x->site;
    kmp_friction_element *e = &run->friction->element[i];
    bool adds;
    KMP_TRY(kmp_friction_adds_row(run, e, t, run->state, &adds));
    x->view[i].word = adds ? KMP_FRICTION_WORD_STICKS : KMP_FRICTION_WORD_SHARES;
    if (adds) {
        kmp_friction_set_held(run, e, place);
        return KEMPE_OK;
    }
    kmp_friction_set_given(run, e, 0, 0);
    return kmp_friction_choose(run, t, run->state);
}

kempe_status kmp_friction_state_lock(kmp_friction_state *state, double t, const double *q, const bool *which,
                                     const double *place)
{
    kmp_runner *run = state->site;
    kmp_friction_run *f = run->friction;
    visit(state, t, q, NULL);
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, run->state, -1, NULL, 0));
    for (int i = 0; i < state->count; i++) {
        kmp_friction_element *e = &f->element[i];
        double at = kmp_friction_at(f, e, KMP_ROLE_PLACE);
        bool level = fmax(kmp_friction_at(f, e, KMP_ROLE_LEVEL), kmp_friction_at(f, e, KMP_ROLE_STATIC)) > 0;
        bool wanted = which ? which[i] : level || run->loaded_friction;
        kmp_friction_set_slip(run, e, 0, 0);
        state->view[i].word = KMP_FRICTION_WORD_SLIPS;
        if (wanted)
            KMP_TRY(hold(state, i, t, place ? place[i] : at));
    }
    return KEMPE_OK;
}

kempe_status kmp_friction_state_load(kmp_friction_state *state, double t, const double *q)
{
    kmp_runner *run = state->site;
    kmp_friction_run *f = run->friction;
    visit(state, t, q, NULL);
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_friction_load(run, t, run->state, run->state + run->s->n, &state->part));
    for (int i = 0; i < state->count; i++) {
        kmp_friction_element *e = &f->element[i];
        state->view[i].force = f->f[i];
        state->view[i].largest = f->upper[i];
        state->view[i].word = e->implied ? KMP_FRICTION_WORD_OPEN : KMP_FRICTION_WORD_STICKS;
    }
    return KEMPE_OK;
}
