/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/equilibrium/friction_at_rest.h"
#include "base/arena.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/friction/friction_problem.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include "model/data/force.h"
#include <math.h>
#include <string.h>

void kmp_friction_state_look(kmp_friction_state *state, double t, const double *q, const double *qd)
{
    kmp_friction_state_evaluate(state, t, q, qd);
    kmp_friction_state_take_places(state);
    kmp_friction_state_release(state->site->eval);
}

void kmp_friction_state_measure(kmp_friction_state *state, double t, const double *q, double *place)
{
    kmp_runner *run = state->site;
    kmp_friction_run *f = run->sticking.friction;
    memset(run->room.state + run->s->n, 0, (size_t)run->s->n * sizeof *q);
    const double *now = kmp_eval_changes(run->eval, t, q, run->room.state + run->s->n);
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
    kmp_friction_element *e = &run->sticking.friction->element[i];
    bool adds;
    KMP_TRY((kempe_status)kmp_friction_adds_row(run->sticking.friction, e, t, run->room.state, &adds));
    x->view[i].word = adds ? KMP_FRICTION_WORD_STICKS : KMP_FRICTION_WORD_SHARES;
    if (adds) {
        kmp_friction_set_held(run->sticking.friction, e, place);
        return KEMPE_OK;
    }
    kmp_friction_set_given(run->sticking.friction, e, 0, 0);
    return (kempe_status)kmp_friction_choose(run->sticking.friction, t, run->room.state);
}

kempe_status kmp_friction_state_press(kmp_friction_state *state, double t, const double *q,
                                      const kmp_normal_load *pressed)
{
    kmp_runner *run = state->site;
    memcpy(run->room.state, q, (size_t)run->s->n * sizeof *q);
    kmp_friction_state_open(run->eval);
    kmp_friction_forget_rows(run);
    KMP_TRY((kempe_status)kmp_friction_choose(run->sticking.friction, t, run->room.state));
    for (int i = 0; i < state->count; i++)
        if (state->view[i].contact)
            state->view[i].word = KMP_FRICTION_WORD_SLIPS;
    for (int how = KMP_PRESSED; how <= KMP_PRESSED_IF_IMPLIED; how++)
        for (int i = 0; i < state->count; i++) {
            kmp_friction_element *e = &run->sticking.friction->element[i];
            if (!state->view[i].contact || (int)pressed[i] != how)
                continue;
            /* By its row, or by the rows of others. */
            KMP_TRY(hold(state, i, t, 0));
            if (state->view[i].word == KMP_FRICTION_WORD_SHARES) {
                kmp_friction_put(run->sticking.friction, e, KMP_ROLE_SENSE, KMP_FRICTION_CARRIES);
            } else if (how == KMP_PRESSED_IF_IMPLIED) {
                kmp_friction_set_slip(run->sticking.friction, e, 0, 0);
                state->view[i].word = KMP_FRICTION_WORD_SLIPS;
                KMP_TRY((kempe_status)kmp_friction_choose(run->sticking.friction, t, run->room.state));
            }
        }
    return KEMPE_OK;
}

kempe_status kmp_friction_state_lock(kmp_friction_state *state, double t, const double *q, const bool *which,
                                     const double *place)
{
    kmp_runner *run = state->site;
    kmp_friction_run *f = run->sticking.friction;
    kmp_friction_state_evaluate(state, t, q, NULL);
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, run->room.state, -1, NULL, 0));
    for (int i = 0; i < state->count; i++) {
        kmp_friction_element *e = &f->element[i];
        double at = kmp_friction_at(f, e, KMP_ROLE_PLACE);
        const bool level = fmax(kmp_friction_bound(f, e, 1), kmp_friction_bound(f, e, -1)) > 0;
        const double rate = kmp_friction_at(f, e, KMP_ROLE_RATE); /* of what its surfaces do as time passes */
        bool wanted = !state->view[i].off && rate == 0 && (which ? which[i] : level || run->sticking.loaded);
        if (e->contact)
            continue;
        kmp_friction_set_slip(run->sticking.friction, e, (rate > 0) - (rate < 0), 0);
        state->view[i].word = KMP_FRICTION_WORD_SLIPS;
        if (wanted)
            KMP_TRY(hold(state, i, t, place ? place[i] : at));
    }
    return KEMPE_OK;
}

kempe_status kmp_friction_state_load(kmp_friction_state *state, double t, const double *q)
{
    kmp_runner *run = state->site;
    kmp_friction_run *f = run->sticking.friction;
    kmp_friction_state_evaluate(state, t, q, NULL);
    kmp_partition_free(&run->part);
    KMP_TRY((kempe_status)kmp_friction_load(run->sticking.friction, t, run->room.state, run->room.state + run->s->n,
                                            &state->part));
    for (int i = 0; i < state->count; i++) {
        kmp_friction_element *e = &f->element[i];
        const bool moves = !e->contact && kmp_friction_at(f, e, KMP_ROLE_RATE) != 0;
        state->view[i].force = e->contact || moves ? kmp_friction_at(f, e, KMP_ROLE_GIVEN) : f->f[i];
        state->view[i].largest = f->upper[i];
        state->view[i].needs = hypot(f->f[i], e->twin < 0 ? 0 : f->f[e->twin]);
        if (!e->contact)
            state->view[i].word = moves        ? KMP_FRICTION_WORD_SLIPS
                                  : e->implied ? KMP_FRICTION_WORD_OPEN
                                               : KMP_FRICTION_WORD_STICKS;
    }
    return KEMPE_OK;
}
