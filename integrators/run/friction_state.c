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
        run->friction = kmp_friction_new(run, none);
        const int count = run->friction ? run->friction->count : 0;
        made = run->friction &&
               KMP_ARENA_MAKE(&run->arena, KMP_ROOM(double, s->n, &run->qdd), KMP_ROOM(double, s->m, &run->lambda),
                              KMP_ROOM(double, 3 * s->n + s->m, &run->moved, &run->state),
                              KMP_ROOM(kmp_friction_view, count, &x->view));
    }
    if (!made || *none) {
        kmp_friction_state_free(x);
        return *none ? KEMPE_OK : kmp_fail_memory(s->context);
    }
    run->loaded_friction = kmp_friction_is_loaded(s->model);
    x->lambda = run->lambda;
    x->count = run->friction->count;
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &run->friction->element[i];
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
    if (eval->holds_friction)
        let_go(eval, false);
    eval->holds_friction = false;
}

void kmp_friction_state_open(kmp_evaluator *eval)
{
    let_go(eval, true);
}

kmp_held_contact kmp_friction_state_closed(const kmp_friction_state *state, int i)
{
    const kmp_runner *run = state->site;
    const double *mode = run->eval->mode + run->friction->element[i].slot;
    if (!state->view[i].contact)
        return KMP_HELD_NOT;
    if (mode[KMP_ROLE_HELD - KMP_ROLE_SENSE] != 0)
        return KMP_HELD_BY_ROW;
    return *mode == KMP_FRICTION_CARRIES ? KMP_HELD_BY_OTHERS : KMP_HELD_NOT;
}

/* The state of the site, with all conditions as they are there. Contacts stay as they are. */
static void evaluate_state(kmp_friction_state *x, double t, const double *q, const double *qd)
{
    kmp_runner *run = x->site;
    int n = run->s->n;
    memcpy(run->state, q, (size_t)n * sizeof *q);
    memset(run->state + n, 0, (size_t)n * sizeof *q);
    if (qd)
        memcpy(run->state + n, qd, (size_t)n * sizeof *qd);
    kmp_friction_state_release(run->eval);
    /* Takes the contacts that are closed in the evaluator. */
    kmp_friction_run *f = run->friction;
    f->pins = true;
    for (int i = 0; i < x->count; i++)
        f->element[i].pinned = kmp_friction_state_closed(x, i) != KMP_HELD_NOT;
    for (int i = 0; i < x->count; i++)
        x->view[i].off = f->element[i].base >= 0 && !f->element[f->element[i].base].pinned;
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
            fmax(kmp_friction_level_at(f, e, KMP_ROLE_STATIC), fmax(kmp_friction_level_at(f, e, KMP_ROLE_LEVEL), 0));
        x->view[i].word = word_of(e);
        x->view[i].off = e->base >= 0 && f->element[e->base].stance == KMP_FRICTION_SLIPS;
        if (e->contact || e->stance == KMP_FRICTION_SLIPS || e->stance == KMP_FRICTION_SMOOTH || x->view[i].largest > 0)
            continue;
        kmp_friction_set_slip(run->friction, e, 0, 0);
        x->view[i].word = KMP_FRICTION_WORD_SLIPS;
    }
}

/* Places and rates at the state. */
static void take_places(kmp_friction_state *x)
{
    const kmp_friction_run *f = x->site->friction;
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
    evaluate_state(state, t, q, qd);
    run->friction->pins = false;
    take_places(state);
    KMP_TRY(check_contacts(state, t, run->state + run->s->n));
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, run->state, -1, NULL, 0));
    run->friction->past.repeats = run->friction->past.changes = 0;
    for (int i = 0; i < state->count; i++)
        run->friction->element[i].smooth = false;
    KMP_TRY(kmp_friction_settle(run, t, run->state, run->state + run->s->n));
    take_views(state, t);
    /* Contacts that neither press nor open. */
    const kmp_friction_run *f = run->friction;
    for (int i = 0; i < state->count; i++)
        state->view[i].limit = false;
    for (int k = 0; k < f->rest; k++) {
        const kmp_friction_element *e = &f->element[f->which[k]];
        double pushed = f->f[k] * f->d[k + k * f->rest], none = fmax(e->still, kmp_friction_rounding(f, k));
        state->view[f->which[k]].limit = e->contact && e->stance == KMP_FRICTION_HELD && pushed <= none;
    }
    return KEMPE_OK;
}

void kmp_friction_state_look(kmp_friction_state *state, double t, const double *q, const double *qd)
{
    evaluate_state(state, t, q, qd);
    take_places(state);
    kmp_friction_state_release(state->site->eval);
}

void kmp_friction_state_measure(kmp_friction_state *state, double t, const double *q, double *place)
{
    kmp_runner *run = state->site;
    kmp_friction_run *f = run->friction;
    memset(run->state + run->s->n, 0, (size_t)run->s->n * sizeof *q);
    const double *now = kmp_eval_changes(run->eval, t, q, run->state + run->s->n);
    memcpy(f->change, now, (size_t)run->s->events.count * sizeof *now);
    for (int i = 0; i < state->count; i++)
        place[i] = kmp_friction_at(f, &f->element[i], KMP_ROLE_PLACE);
}

bool kmp_friction_state_agrees(kmp_friction_state *state, double t, const double *q, double *place)
{
    bool agrees = true;
    double most = 0;
    for (int i = 0; i < state->count; i++)
        most = fmax(most, state->view[i].contact ? fabs(state->view[i].force) : 0);
    kmp_friction_state_measure(state, t, q, place);
    for (int i = 0; i < state->count; i++) {
        const kmp_friction_view *view = &state->view[i];
        bool closed = kmp_friction_state_closed(state, i) != KMP_HELD_NOT;
        bool overlaps = !closed && place[i] < -KMP_TOUCH_NEAR * view->size;
        agrees = agrees && !(view->contact && (overlaps || view->force < -KMP_CONTACT_NONE * most));
    }
    return agrees;
}

/* Holds the row of an element if it is independent. */
static kempe_status hold(kmp_friction_state *x, int i, double t, double place)
{
    kmp_runner *run = x->site;
    kmp_friction_element *e = &run->friction->element[i];
    bool adds;
    KMP_TRY((kempe_status)kmp_friction_adds_row(run->friction, e, t, run->state, &adds));
    x->view[i].word = adds ? KMP_FRICTION_WORD_STICKS : KMP_FRICTION_WORD_SHARES;
    if (adds) {
        kmp_friction_set_held(run->friction, e, place);
        return KEMPE_OK;
    }
    kmp_friction_set_given(run->friction, e, 0, 0);
    return (kempe_status)kmp_friction_choose(run->friction, t, run->state);
}

kempe_status kmp_friction_state_press(kmp_friction_state *state, double t, const double *q,
                                      const kmp_normal_load *pressed)
{
    kmp_runner *run = state->site;
    memcpy(run->state, q, (size_t)run->s->n * sizeof *q);
    kmp_friction_state_open(run->eval);
    KMP_TRY((kempe_status)kmp_friction_choose(run->friction, t, run->state));
    for (int i = 0; i < state->count; i++)
        if (state->view[i].contact)
            state->view[i].word = KMP_FRICTION_WORD_SLIPS;
    for (int how = KMP_PRESSED; how <= KMP_PRESSED_IF_IMPLIED; how++)
        for (int i = 0; i < state->count; i++) {
            kmp_friction_element *e = &run->friction->element[i];
            if (!state->view[i].contact || (int)pressed[i] != how)
                continue;
            /* By its row, or by those of others. */
            KMP_TRY(hold(state, i, t, 0));
            if (state->view[i].word == KMP_FRICTION_WORD_SHARES) {
                kmp_friction_put(run->friction, e, KMP_ROLE_SENSE, KMP_FRICTION_CARRIES);
            } else if (how == KMP_PRESSED_IF_IMPLIED) {
                kmp_friction_set_slip(run->friction, e, 0, 0);
                state->view[i].word = KMP_FRICTION_WORD_SLIPS;
                KMP_TRY((kempe_status)kmp_friction_choose(run->friction, t, run->state));
            }
        }
    return KEMPE_OK;
}

kempe_status kmp_friction_state_lock(kmp_friction_state *state, double t, const double *q, const bool *which,
                                     const double *place)
{
    kmp_runner *run = state->site;
    kmp_friction_run *f = run->friction;
    evaluate_state(state, t, q, NULL);
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, run->state, -1, NULL, 0));
    for (int i = 0; i < state->count; i++) {
        kmp_friction_element *e = &f->element[i];
        double at = kmp_friction_at(f, e, KMP_ROLE_PLACE);
        bool level =
            fmax(kmp_friction_level_at(f, e, KMP_ROLE_LEVEL), kmp_friction_level_at(f, e, KMP_ROLE_STATIC)) > 0;
        bool wanted = !state->view[i].off && (which ? which[i] : level || run->loaded_friction);
        if (e->contact)
            continue;
        kmp_friction_set_slip(run->friction, e, 0, 0);
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
    evaluate_state(state, t, q, NULL);
    kmp_partition_free(&run->part);
    KMP_TRY((kempe_status)kmp_friction_load(run->friction, t, run->state, run->state + run->s->n, &state->part));
    for (int i = 0; i < state->count; i++) {
        kmp_friction_element *e = &f->element[i];
        state->view[i].force = e->contact ? kmp_friction_at(f, e, KMP_ROLE_GIVEN) : f->f[i];
        state->view[i].largest = f->upper[i];
        state->view[i].needs = hypot(f->f[i], e->twin < 0 ? 0 : f->f[e->twin]);
        if (!e->contact)
            state->view[i].word = e->implied ? KMP_FRICTION_WORD_OPEN : KMP_FRICTION_WORD_STICKS;
    }
    return KEMPE_OK;
}
