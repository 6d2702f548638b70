/* SPDX-License-Identifier: BSD-3-Clause */
/* Next values of states (forward_resets.h): the time at which they are taken, by one condition or by samples, and their
 * map y+ = r(t, q, qd) of the derivatives along that time. */
#include "analyses/sensitivity/forward_resets.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/sensitivity/forward_map.h"
#include "linalg/dense/dot.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

bool kmp_forward_resets_make(kmp_forward_resets *resets, kmp_arena *arena, const kempe_model *model)
{
    for (int k = 0; k < kmp_model_state_count(model); k++)
        resets->states += kmp_model_state(model, k)->next != NULL;
    /* A run takes next values once more than it has states at a time, and twice at its start. */
    resets->most = resets->states + 4;
    resets->sampled_t = NAN;
    return KMP_ARENA_MAKE(arena, KMP_ROOM(double, resets->states, &resets->next),
                          KMP_ROOM(bool, resets->most * resets->states, &resets->taken),
                          KMP_ROOM(int, resets->most * resets->states, &resets->condition));
}

void kmp_forward_resets_note(kmp_forward_resets *resets, const bool *taken, const int *condition)
{
    const size_t states = (size_t)resets->states, at = (size_t)resets->count * states;
    resets->missed = resets->missed || resets->count == resets->most;
    if (resets->missed)
        return;
    memcpy(resets->taken + at, taken, states * sizeof *taken);
    memcpy(resets->condition + at, condition, states * sizeof *condition);
    resets->count++;
}

/* The place among all states of the one with a next value of number `sample`. */
static int state_of(const kempe_model *model, int sample)
{
    for (int k = 0;; k++)
        if (kmp_model_state(model, k)->next && sample-- == 0)
            return k;
}

int kmp_forward_halt_at_event(kmp_forward_formulation *f, int sample, double t)
{
    const kempe_model *model = f->system->model;
    return kmp_forward_halt(
        f,
        "the state '%s' changes at t = %.9g together with an event whose time depends on parameters: the motion "
        "has no derivative with respect to them there",
        kmp_model_state(model, state_of(model, sample))->name, t);
}

int kmp_forward_halt_at_sample(kmp_forward_formulation *f, double t)
{
    return kmp_same_time(f->resets.sampled_t, t) && kmp_swings_differ(f->count, f->times.swing, NULL)
               ? kmp_forward_halt_at_event(f, f->resets.sampled, t)
               : KMP_GO;
}

int kmp_forward_find_reset_swing(kmp_forward_formulation *f, const double *jump, double t)
{
    kmp_forward_resets *resets = &f->resets;
    const double *common = jump;
    bool any = jump;
    resets->cause = -1;
    if (kmp_forward_map_follows_event(f))
        return kmp_forward_halt(f,
                                "a state changes at t = %.9g s within rounding of an event before: the adjoint method "
                                "does not support this, the forward method does",
                                t);
    if (resets->missed)
        return kmp_forward_halt(f, "states change too often at t = %.9g: derivatives end there", t);
    for (int k = 0; resets->count > 0 && k < resets->states; k++) {
        if (!resets->taken[k])
            continue;
        /* dt/dp of the change, zero where it is NULL. Delayed signals that jump change conditions with them. A change
         * of a condition that has not passed as an event is one that an input or a sample has made. */
        const int at = resets->condition[k];
        const int cause = at >= 0 && kmp_event_times_has(&f->times, at, t) ? f->times.cause[at] : -1;
        const double *swing = cause < 0 && at >= 0 ? jump : kmp_event_times_of(&f->times, cause);
        if ((any && kmp_swings_differ(f->count, common, swing)) ||
            kmp_event_times_any_other(&f->times, f->count, swing, t))
            return kmp_forward_halt_at_event(f, k, t);
        resets->cause = any ? resets->cause : cause;
        common = any ? common : swing;
        any = true;
    }
    if (jump && kmp_event_times_any_other(&f->times, f->count, jump, t))
        return kmp_forward_halt(
            f,
            "a delayed signal jumps at t = %.9g together with an event: the motion has no derivative with "
            "respect to parameters there",
            t);
    if (resets->count > 0 && !common) {
        resets->sampled_t = t;
        for (int k = 0; k < resets->states; k++)
            resets->sampled = resets->taken[k] ? k : resets->sampled;
    }
    kmp_copy_or_zero(f->count, common, f->times.swing);
    return KMP_GO;
}

void kmp_forward_take_next_values(kmp_forward_formulation *f, double t)
{
    kmp_sensitivity_equations *v = f->v;
    const kmp_linear *l = &v->linear;
    const kempe_model *model = f->system->model;
    kmp_forward_resets *resets = &f->resets;
    kmp_forward_place *place = &f->place;
    const int first = kmp_model_coordinates(model);
    for (int r = 0; r < resets->count; r++) {
        const bool *taken = resets->taken + (ptrdiff_t)r * resets->states;
        const kmp_instant at = kmp_instant_of(l->eval, t, place->q, place->qd, l->qdd, l->lambda);
        const double *value = kmp_slopes_values(&v->slopes->samples, &at);
        for (int i = 0; i < f->count; i++) {
            double *dqd = place->dqd + (ptrdiff_t)i * f->n;
            const kmp_direction along = {.t = &f->times.swing[i], .q = place->dq + (ptrdiff_t)i * f->n, .qd = dqd};
            kmp_slopes_along(v->slopes, &v->slopes->samples, &along, i, resets->next);
            for (int k = 0; k < resets->states; k++)
                if (taken[k])
                    dqd[first + state_of(model, k)] = resets->next[k];
        }
        for (int k = 0; k < resets->states; k++)
            if (taken[k])
                place->qd[first + state_of(model, k)] = value[k];
    }
    resets->count = 0;
}
