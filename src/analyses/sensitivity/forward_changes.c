/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes within a formulation of a motion with sensitivities (forward.h): conditions, next values of states, and
 * angles of spherical joints, which leave the rows and the degrees of freedom as they are. */
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_delays.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

struct kmp_forward_changes {
    double *mode, *chart; /* behind the change, while the evaluator is at the last step */
    double *next;         /* conditions: behind the one that changes next */
    double *value;        /* conditions: their values at the change */
    bool *cause;          /* conditions: the motion itself changes it */
    double *udd, *kept;   /* unknown coordinates: accelerations before the change; room */
};

bool kmp_forward_changes_make(kmp_forward_formulation *f)
{
    const int conditions = f->system->events.count;
    kmp_forward_changes *x = f->changes = KMP_ARENA_NEW(&f->arena, kmp_forward_changes, 1);
    return x && KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, conditions, &x->mode, &x->next, &x->value),
                               KMP_ROOM(double, KMP_CHART_SIZE * f->system->chart_count, &x->chart),
                               KMP_ROOM(bool, conditions, &x->cause), KMP_ROOM(double, f->n, &x->udd, &x->kept));
}

/* -- before and behind a change ------------------------------------------------------------------------- */

static void set_modes(const kmp_forward_formulation *f, const double *mode)
{
    if (memcmp(kmp_forward_eval(f)->conditions.mode, mode, kmp_forward_mode_bytes(f)) != 0)
        kmp_eval_set_modes(kmp_forward_eval(f), mode);
}

/* Only the conditions, or only the charts, of the last step. */
static void take_modes_back(kmp_forward_formulation *f)
{
    memcpy(f->changes->mode, kmp_forward_eval(f)->conditions.mode, kmp_forward_mode_bytes(f));
    set_modes(f, f->mode);
}

static void take_charts_back(kmp_forward_formulation *f)
{
    memcpy(f->changes->chart, kmp_forward_eval(f)->chart, kmp_forward_chart_bytes(f));
    kmp_eval_set_charts(kmp_forward_eval(f), f->place.chart);
}

void kmp_forward_step_back(kmp_forward_formulation *f)
{
    take_charts_back(f);
    take_modes_back(f);
}

void kmp_forward_step_forth(kmp_forward_formulation *f)
{
    set_modes(f, f->changes->mode);
    kmp_eval_set_charts(kmp_forward_eval(f), f->changes->chart);
}

/* -- conditions ----------------------------------------------------------------------------------------- */

int kmp_forward_halt(kmp_forward_formulation *f, const char *format, ...)
{
    KMP_TEXT_ARGUMENTS(&f->formulation.reason, format);
    if (f->options->alone)
        kmp_text_put(&f->formulation.reason,
                     "; the adjoint method needs derivatives with respect to each part of the state, too: the forward "
                     "method may have those with respect to parameters");
    return KMP_HALT;
}

double kmp_forward_integrand_here(kmp_forward_formulation *f)
{
    return f->integrals ? kmp_target_value(f->options->integrand, f->v) : 0;
}

/* Adds the jump: the values before less those after, times dt_e/dp. */
static void jump(kmp_forward_formulation *f, double integrand_before, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int half = kmp_forward_blocks(f);
    double integrand = integrand_before - kmp_forward_integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->changes->udd[i] -= l->qdd[kmp_forward_unknowns(f)[i]];
    for (int k = 0; k < f->count; k++) {
        for (int i = 0; i < f->width; i++)
            y[half + (k + 1) * f->width + i] += f->changes->udd[i] * f->times.swing[k];
        if (f->integrals)
            y[2 * half + 1 + k] += integrand * f->times.swing[k];
    }
}

int kmp_forward_halt_at_input(kmp_forward_formulation *f, int k, double t)
{
    return kmp_forward_halt(f,
                            "an input jumps at t = %.9g together with the condition %s, whose time depends on "
                            "parameters: the motion has no derivative with respect to them there",
                            t, f->system->event_text[k]);
}

/* The state at t, moved by `aside` along the motion. */
static int come_aside(kmp_forward_formulation *f, double t, double aside, double *y)
{
    const int half = kmp_forward_blocks(f);
    memcpy(f->changes->kept, y, (size_t)f->width * sizeof *y);
    for (int i = 0; i < f->width; i++)
        y[i] += aside * y[half + i];
    const int said = kmp_forward_come_to(f, t, y);
    memcpy(y, f->changes->kept, (size_t)f->width * sizeof *y);
    return said;
}

/* Changes condition k, and the others according to `mode`. A jump of an input does so at a time that depends on no
 * parameter. */
static int pass(kmp_forward_formulation *f, int k, const double *mode, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    const bool given = kmp_forward_input_jumps(f, t);
    if (kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    if (given && kmp_forward_coincides(f, k, t, y))
        return kmp_forward_halt_at_input(f, k, t);
    memset(f->times.swing, 0, (size_t)f->count * sizeof *f->times.swing);
    if (!given && !kmp_forward_find_swing(f, k, y))
        return kmp_forward_halt(
            f,
            "the condition %s is touched at t = %.9g without crossing: the motion has no derivative with "
            "respect to parameters there",
            f->system->event_text[k], t);
    if (kmp_forward_halt_at_sample(f, t) != KMP_GO)
        return KMP_HALT;
    kmp_event_times_note(&f->times, l->eval->conditions.mode, mode, t, given ? -1 : k);
    kmp_forward_delays_note(f, t, f->times.swing);
    memcpy(f->mode, l->eval->conditions.mode, kmp_forward_mode_bytes(f));
    /* The time before and behind an event at which values are taken: at an end of a table that holds its value there, a
     * curvature jumps with the slope, and rounding places the event on either side. */
    const kmp_condition *c = &f->system->events.condition[k];
    const bool held = c->expr && c->expr->kind == KMP_EXPR_TABLE && c->expr->table->outside == KMP_OUTSIDE_HOLD;
    const double aside = held ? KMP_SLOPE_ASIDE / f->start.rate_scale : 0;
    if (aside > 0 && come_aside(f, t, -aside, y) != KMP_GO)
        return KMP_HALT;
    double integrand = kmp_forward_integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->changes->udd[i] = l->qdd[kmp_forward_unknowns(f)[i]];
    set_modes(f, mode);
    if (come_aside(f, t, aside, y) != KMP_GO)
        return kmp_forward_halt(f, "the motion cannot continue after the condition %s at t = %.9g",
                                f->system->event_text[k], t);
    jump(f, integrand, y);
    f->place.t = NAN; /* the place is the one before the change */
    return KMP_GO;
}

/* The condition that the motion itself has changed where rounding leaves all of them before their change: the one whose
 * change is nearest in time. Others change with it. */
static int find_nearest(kmp_forward_formulation *f, const double *y)
{
    int nearest = -1, first = -1;
    double least = INFINITY;
    for (int k = 0; k < f->system->events.count; k++) {
        if (!kmp_forward_mode_differs(f, k, f->changes->mode))
            continue;
        first = first < 0 ? k : first;
        if (kmp_forward_find_swing(f, k, y) && f->times.distance < least) {
            least = f->times.distance;
            nearest = k;
        }
    }
    return nearest < 0 ? first : nearest;
}

/* Conditions have changed since the last start: passes the ones that the motion itself has changed one after the other,
 * the last of them with all dependent ones. */
static int pass_conditions(kmp_forward_formulation *f, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int count = f->system->events.count, last = -1, said = KMP_GO;
    take_modes_back(f);
    memcpy(f->changes->next, f->mode, kmp_forward_mode_bytes(f));
    if (kmp_forward_stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    kmp_eval_all_changes(l->eval, t, l->q, l->qd, l->qdd, l->lambda, f->changes->value);
    for (int k = 0; k < count; k++) {
        bool changes = kmp_forward_mode_differs(f, k, f->changes->mode);
        f->changes->cause[k] = changes && (f->changes->value[k] < 0) != (f->mode[k] != 0);
        last = f->changes->cause[k] ? k : last;
    }
    if (last < 0) {
        if (kmp_forward_spread(f, t, y) != KMP_GO)
            return KMP_HALT;
        last = find_nearest(f, y);
    }
    f->changes->cause[last] = true;
    for (int k = 0; said == KMP_GO && k <= last; k++)
        if (f->changes->cause[k]) {
            f->changes->next[k] = f->changes->mode[k];
            said = pass(f, k, k == last ? f->changes->mode : f->changes->next, t, y);
        }
    return said;
}

/* -- next values of states ------------------------------------------------------------------------------ */

/* States have taken next values since the last start, or delayed signals jump (`jump`: dt/dp there, of a state with
 * rates qd), and conditions have changed with them. */
static int pass_resets(kmp_forward_formulation *f, double t, const double *jump, const double *qd, double *y)
{
    take_modes_back(f);
    if (kmp_forward_find_reset_swing(f, jump, t) != KMP_GO || kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    double integrand = kmp_forward_integrand_here(f);
    const kmp_linear *l = &f->v->linear;
    kmp_forward_add_terms(f, l->qd, l->qdd, 1, f->times.swing);
    kmp_forward_delays_pass(f, t, qd);
    kmp_forward_take_next_values(f, t);
    kmp_forward_delays_note(f, t, f->times.swing);
    kmp_forward_pack(f, y);
    set_modes(f, f->changes->mode);
    memcpy(f->mode, f->changes->mode, kmp_forward_mode_bytes(f));
    if (kmp_forward_stand_at(f, t, y, true) != KMP_GO)
        return KMP_HALT;
    /* Takes the rates of the last state times dt_e/dp from the unknowns. */
    int half = kmp_forward_blocks(f), w = f->width;
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < w && f->times.swing[k] != 0; i++) {
            y[(k + 1) * w + i] -= l->qd[kmp_forward_unknowns(f)[i]] * f->times.swing[k];
            y[half + (k + 1) * w + i] -= l->qdd[kmp_forward_unknowns(f)[i]] * f->times.swing[k];
        }
    for (int k = 0; f->integrals && k < f->count; k++)
        if (f->times.swing[k] != 0)
            y[2 * half + 1 + k] += (integrand - kmp_forward_integrand_here(f)) * f->times.swing[k];
    f->place.t = NAN; /* the place is the one before the change */
    return KMP_GO;
}

/* -- charts --------------------------------------------------------------------------------------------- */

/* Joints have been centred: converts the place from the charts before to (q, qd) in the current ones. */
static int pass_charts(kmp_forward_formulation *f, double t, const double *q, const double *qd, double *y)
{
    bool others;
    take_charts_back(f);
    if (kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    kmp_eval_set_charts(kmp_forward_eval(f), f->changes->chart);
    kmp_forward_enter_charts(f, q, qd);
    kmp_eval_closure(kmp_forward_eval(f), t, q);
    if (!f->start.fixed && !f->zone.now)
        return kmp_forward_choose_anew(f, y, &others);
    kmp_forward_pack(f, y);
    return KMP_GO;
}

int kmp_forward_pass_changes(kmp_forward_formulation *f, double t, const double *q, const double *qd,
                             const double *jump, double *y)
{
    if ((f->resets.count > 0 || jump) && pass_resets(f, t, jump, qd, y) != KMP_GO)
        return KMP_HALT;
    if (kmp_forward_first_other_mode(f, kmp_forward_eval(f)->conditions.mode) >= 0 &&
        pass_conditions(f, t, y) != KMP_GO)
        return KMP_HALT;
    return kmp_forward_charts_differ(f) ? pass_charts(f, t, q, qd, y) : KMP_GO;
}
