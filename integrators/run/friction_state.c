/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes at a state without a run: the decisions of runs (integrators/decide) on one state, with a site that evaluates
 * conditions there. */
#include "integrators/run/friction_state.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/friction_modes.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/friction/friction_problem.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include "model/data/force.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

kempe_status kmp_friction_state_new(kmp_evaluator *eval, kmp_friction_state **state, bool *none)
{
    KMP_MAKE(eval->system->context, kmp_friction_state, x);
    x->site = KMP_NEW(kmp_runner, 1);
    *none = false;
    const kempe_system *s = eval->system;
    kmp_runner *run = x->site;
    bool made = run;
    if (made) {
        run->s = s;
        run->eval = eval;
        run->spec.t_end = 1;
        run->sticking.friction = kmp_friction_new(run, none);
        const int count = run->sticking.friction ? run->sticking.friction->count : 0;
        made = run->sticking.friction &&
               KMP_ARENA_MAKE(&run->arena, KMP_ROOM(double, s->n, &run->room.qdd),
                              KMP_ROOM(double, s->m, &run->room.lambda),
                              KMP_ROOM(double, 3 * s->n + s->m, &run->balance.row, &run->room.state),
                              KMP_ROOM(kmp_friction_view, count, &x->view));
    }
    if (!made || *none) {
        kmp_friction_state_free(x);
        return *none ? KEMPE_OK : kmp_fail_memory(s->context);
    }
    run->sticking.loaded = kmp_friction_is_loaded(s->model);
    x->lambda = run->room.lambda;
    x->count = run->sticking.friction->count;
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &run->sticking.friction->element[i];
        x->view[i] = (kmp_friction_view){
            .element = run->s->events.condition[e->slot].of, .contact = e->contact, .size = e->size};
    }
    *state = x;
    return KEMPE_OK;
}

void kmp_friction_state_free(kmp_friction_state *state)
{
    if (!state)
        return;
    if (state->site) {
        kmp_friction_release(state->site);
        kmp_partition_free(&state->site->part);
        kmp_arena_free(&state->site->arena);
    }
    kmp_free(state->site);
    kmp_free(state);
}

/* Sets all inputs of friction, or of contacts, to zero. */
static void let_go(kmp_evaluator *eval, bool contacts)
{
    const kmp_events *events = &eval->system->events;
    for (int k = 0; k < events->count; k++) {
        const kmp_force *of = events->condition[k].role != KMP_ROLE_NONE ? events->condition[k].of : NULL;
        if (of && (of->kind == KMP_FORCE_TOUCH) == contacts)
            kmp_eval_set_kink(eval, k, 0);
    }
}

void kmp_friction_state_release(kmp_evaluator *eval)
{
    if (eval->conditions.holds_friction)
        let_go(eval, false);
    eval->conditions.holds_friction = false;
}

void kmp_friction_state_open(kmp_evaluator *eval)
{
    let_go(eval, true);
}

void kmp_friction_state_take_contacts(kmp_friction_state *state, const kmp_friction_state *other, const int *from)
{
    for (int i = 0; i < state->count; i++) {
        const int slot = state->site->sticking.friction->element[i].slot;
        const int there = other->site->sticking.friction->element[from[i]].slot;
        for (int role = 0; state->view[i].contact && role < KMP_ROLES_OF_ALL; role++)
            kmp_eval_set_kink(state->site->eval, slot + role, other->site->eval->conditions.mode[there + role]);
    }
}

kmp_held_contact kmp_friction_state_closed(const kmp_friction_state *state, int i)
{
    const kmp_runner *run = state->site;
    const double *mode = run->eval->conditions.mode + run->sticking.friction->element[i].slot;
    if (!state->view[i].contact)
        return KMP_HELD_NOT;
    if (mode[KMP_ROLE_HELD - KMP_ROLE_SENSE] != 0)
        return KMP_HELD_BY_ROW;
    return *mode == KMP_FRICTION_CARRIES ? KMP_HELD_BY_OTHERS : KMP_HELD_NOT;
}

void kmp_friction_state_evaluate(kmp_friction_state *x, double t, const double *q, const double *qd)
{
    kmp_runner *run = x->site;
    int n = run->s->n;
    memcpy(run->room.state, q, (size_t)n * sizeof *q);
    memset(run->room.state + n, 0, (size_t)n * sizeof *q);
    if (qd)
        memcpy(run->room.state + n, qd, (size_t)n * sizeof *qd);
    kmp_friction_state_release(run->eval);
    kmp_friction_forget_rows(run);
    /* Takes the contacts that are closed in the evaluator. */
    kmp_friction_run *f = run->sticking.friction;
    f->pins = true;
    for (int i = 0; i < x->count; i++)
        f->element[i].pinned = kmp_friction_state_closed(x, i) != KMP_HELD_NOT;
    for (int i = 0; i < x->count; i++)
        x->view[i].off = f->element[i].base >= 0 && !f->element[f->element[i].base].pinned;
    kmp_eval_freeze(run->eval, t, run->room.state, run->room.state + n);
    kmp_eval_unfreeze(run->eval);
    run->eval->conditions.holds_friction = true;
    kmp_eval_all_changes(run->eval, t, run->room.state, run->room.state + n, run->room.qdd, run->room.lambda,
                         run->sticking.friction->change);
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
    kmp_friction_run *f = run->sticking.friction;
    kmp_eval_all_changes(run->eval, t, run->room.state, run->room.state + run->s->n, run->room.qdd, run->room.lambda,
                         f->change);
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &f->element[i];
        x->view[i].force = kmp_friction_at(f, e, KMP_ROLE_GIVEN);
        x->view[i].largest = kmp_friction_bound(f, e, x->view[i].force > 0 ? -1 : 1);
        x->view[i].word = word_of(e);
        x->view[i].off = e->base >= 0 && f->element[e->base].stance == KMP_FRICTION_SLIPS;
        if (e->contact || e->stance == KMP_FRICTION_SLIPS || e->stance == KMP_FRICTION_SMOOTH || x->view[i].largest > 0)
            continue;
        kmp_friction_set_slip(run->sticking.friction, e, 0, 0);
        x->view[i].word = KMP_FRICTION_WORD_SLIPS;
    }
}

void kmp_friction_state_slide(kmp_friction_state *x)
{
    kmp_friction_run *f = x->site->sticking.friction;
    for (int i = 0; i < x->count; i++)
        if (!x->view[i].contact && x->view[i].word != KMP_FRICTION_WORD_SLIPS) {
            kmp_friction_set_slip(f, &f->element[i], 0, 0);
            x->view[i].word = KMP_FRICTION_WORD_SLIPS;
        }
}

void kmp_friction_state_take_places(kmp_friction_state *x)
{
    const kmp_friction_run *f = x->site->sticking.friction;
    for (int i = 0; i < x->count; i++) {
        x->view[i].place = kmp_friction_at(f, &f->element[i], KMP_ROLE_PLACE);
        x->view[i].rate = kmp_friction_at(f, &f->element[i], KMP_ROLE_RATE);
    }
}

/* Surfaces that overlap, or strike: the state lies before an impact. */
static kempe_status check_contacts(const kmp_friction_state *x, double t, const double *qd)
{
    kempe_context *context = x->site->s->context;
    double rate = kmp_friction_pace(x->site, qd);
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_view *view = &x->view[i];
        const char *unit = view->element->touch.turns ? "rad" : "m";
        if (view->contact && view->place < -KMP_TOUCH_NEAR * view->size)
            return kmp_fail(context, KEMPE_E_FAILED,
                            "contact '%s' overlaps by %.6g %s at t = %.9g: take a state with its surfaces apart",
                            view->element->name, -view->place, unit, t);
        bool near = view->contact && view->place <= KMP_TOUCH_NEAR * view->size;
        if (near && view->rate < -KMP_FRICTION_STILL * view->size * rate)
            return kmp_fail(
                context, KEMPE_E_FAILED,
                "contact '%s' strikes with %.6g %s/s at t = %.9g, so that the rates jump: take a state before "
                "or after this impact",
                view->element->name, -view->rate, unit, t);
    }
    return KEMPE_OK;
}

kempe_status kmp_friction_state_decide(kmp_friction_state *state, double t, const double *q, const double *qd)
{
    kmp_runner *run = state->site;
    kmp_friction_state_open(run->eval);
    kmp_friction_state_evaluate(state, t, q, qd);
    run->sticking.friction->pins = false;
    kmp_friction_state_take_places(state);
    KMP_TRY(check_contacts(state, t, run->room.state + run->s->n));
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, run->room.state, -1, NULL, 0));
    run->sticking.friction->past.repeats = run->sticking.friction->past.changes = 0;
    for (int i = 0; i < state->count; i++)
        run->sticking.friction->element[i].smooth = false;
    KMP_TRY(kmp_friction_settle(run, t, run->room.state, run->room.state + run->s->n));
    take_views(state, t);
    /* Contacts that neither press nor open. */
    const kmp_friction_run *f = run->sticking.friction;
    for (int i = 0; i < state->count; i++)
        state->view[i].limit = false;
    for (int k = 0; k < f->rest; k++) {
        const kmp_friction_element *e = &f->element[f->which[k]];
        double pushed = f->f[k] * f->d[k + k * f->rest], none = fmax(e->still, kmp_friction_rounding(f, k));
        state->view[f->which[k]].limit = e->contact && e->stance == KMP_FRICTION_HELD && pushed <= none;
    }
    return KEMPE_OK;
}
