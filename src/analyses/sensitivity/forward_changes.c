/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes within a formulation of a motion with sensitivities (forward.h): conditions, next values of states, and
 * angles of spherical joints, which leave the rows and the degrees of freedom as they are. */
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_delays.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

/* -- conditions ----------------------------------------------------------------------------------------- */

void kmp_forward_set_modes(const kmp_forward_formulation *f, const double *mode)
{
    if (memcmp(kmp_forward_eval(f)->mode, mode, kmp_forward_mode_bytes(f)) != 0)
        kmp_eval_set_modes(kmp_forward_eval(f), mode);
}

/* The derivative of condition k along a direction, with parameter i (negative: none). */
static double along(kmp_forward_formulation *f, int k, const kmp_direction *direction, int i)
{
    kmp_slopes_along(f->v->slopes, &f->v->slopes->events, direction, i, f->along);
    return f->along[k];
}

/* An event whose condition changes no faster than this part of its usual rate is touched, not passed. */
#define GRAZING 1e-9

bool kmp_forward_find_swing(kmp_forward_formulation *f, int k, const double *y)
{
    kmp_sensitivity_equations *v = f->v;
    kmp_linear *l = &v->linear;
    const bool late = kmp_slopes_event_is_late(v->slopes, k);
    const int n = f->n;
    double one = 1;
    kmp_instant at = kmp_linear_instant(&v->linear);
    const double value = kmp_slopes_values(&v->slopes->events, &at)[k];
    if (late)
        kmp_sensitivity_equations_rates(v, f->jerk, f->lambda_rate);
    const double by_place = along(f, k, &(kmp_direction){.t = &one, .q = l->qd}, -1);
    const double by_rates = along(f, k, &(kmp_direction){.qd = l->qdd}, -1);
    const double by_loads = late ? along(f, k, &(kmp_direction){.qdd = f->jerk, .lambda = f->lambda_rate}, -1) : 0;
    const double rate = by_place + by_rates + by_loads;
    f->distance = fabs(value / rate);
    for (int i = 0; i < f->count; i++) {
        kmp_direction direction = {.q = f->dq + i * n, .qd = f->dqd + i * n};
        if (late) {
            direction.qdd = f->dqdd;
            direction.lambda = f->dlambda;
            kmp_forward_follow(f, y, i, NULL, NULL, f->dqdd, f->dlambda);
        }
        f->swing[i] = -along(f, k, &direction, i) / rate;
    }
    return fabs(rate) > GRAZING * (fabs(by_place) + fabs(by_rates) + fabs(by_loads));
}

int kmp_forward_halt(kmp_forward_formulation *f, const char *format, ...)
{
    KMP_TEXT_ARGUMENTS(&f->formulation.reason, format);
    if (f->options->alone)
        kmp_text_put(&f->formulation.reason,
                     "; the adjoint method needs derivatives with respect to each part of the state, too: the forward "
                     "method may have those with respect to parameters");
    return KMP_HALT;
}

int kmp_forward_halt_at_event(kmp_forward_formulation *f, int sample, double t)
{
    const kempe_model *model = f->system->model;
    return kmp_forward_halt(
        f,
        "the state '%s' changes at t = %.9g together with an event whose time depends on parameters: the motion "
        "has no derivative with respect to them there",
        kmp_model_state(model, kmp_state_of_sample(model, sample))->name, t);
}

bool kmp_forward_same_swing(int count, const double *a, const double *b)
{
    for (int i = 0; i < count; i++)
        if (fabs(a[i] - b[i]) > KMP_SLOPE_SAME_TIME * fmax(fabs(a[i]), fabs(b[i])))
            return false;
    return true;
}

bool kmp_forward_are_different(const kmp_forward_formulation *f, const double *a, const double *b)
{
    for (int i = 0; !(a && b) && i < f->count; i++)
        if ((a && a[i] != 0) || (b && b[i] != 0))
            return true;
    return a && b && !kmp_forward_same_swing(f->count, a, b);
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
        f->before[i] -= l->qdd[kmp_forward_unknowns(f)[i]];
    for (int k = 0; k < f->count; k++) {
        for (int i = 0; i < f->width; i++)
            y[half + (k + 1) * f->width + i] += f->before[i] * f->swing[k];
        if (f->integrals)
            y[2 * half + 1 + k] += integrand * f->swing[k];
    }
}

void kmp_forward_note_swings(kmp_forward_formulation *f, const double *mode, double t, int k)
{
    for (int i = 0; i < f->system->events.count; i++)
        if ((mode[i] != 0) != (kmp_forward_eval(f)->mode[i] != 0)) { /* also of kinks, where nothing jumps */
            memcpy(f->swings + (ptrdiff_t)i * f->most, f->swing, (size_t)f->count * sizeof *f->swing);
            f->swung_t[i] = t;
            f->swung_by[i] = k;
        }
}

bool kmp_forward_input_jumps(const kmp_forward_formulation *f, double t)
{
    const kmp_present_inputs *inputs = &kmp_forward_eval(f)->inputs;
    bool jumps = false;
    for (int i = 0; i < inputs->count; i++)
        jumps = jumps || (kmp_same_time(inputs->piece[i].from, t) && inputs->piece[i].jump == 0);
    return jumps;
}

bool kmp_forward_coincides(kmp_forward_formulation *f, int k, double t, const double *y)
{
    return kmp_forward_find_swing(f, k, y) && f->distance * f->start.rate_scale <= KMP_SLOPE_JUMPED &&
           f->swung_t[k] != t && kmp_forward_are_different(f, f->swing, NULL);
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
    memcpy(f->kept, y, (size_t)f->width * sizeof *y);
    for (int i = 0; i < f->width; i++)
        y[i] += aside * y[half + i];
    const int said = kmp_forward_come_to(f, t, y);
    memcpy(y, f->kept, (size_t)f->width * sizeof *y);
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
    memset(f->swing, 0, (size_t)f->count * sizeof *f->swing);
    if (!given && !kmp_forward_find_swing(f, k, y))
        return kmp_forward_halt(
            f,
            "the condition %s is touched at t = %.9g without crossing: the motion has no derivative with "
            "respect to parameters there",
            f->system->event_text[k], t);
    if (kmp_same_time(f->sampled_t, t) && kmp_forward_are_different(f, f->swing, NULL))
        return kmp_forward_halt_at_event(f, f->sampled, t);
    kmp_forward_note_swings(f, mode, t, given ? -1 : k);
    kmp_forward_delays_note(f, t, f->swing);
    memcpy(f->mode, l->eval->mode, kmp_forward_mode_bytes(f));
    /* The time before and behind an event at which values are taken: at an end of a table that holds its value there, a
     * curvature jumps with the slope, and rounding places the event on either side. */
    const kmp_condition *c = &f->system->events.condition[k];
    const bool held = c->expr && c->expr->kind == KMP_EXPR_TABLE && c->expr->table->outside == KMP_OUTSIDE_HOLD;
    const double aside = held ? KMP_SLOPE_ASIDE / f->start.rate_scale : 0;
    if (aside > 0 && come_aside(f, t, -aside, y) != KMP_GO)
        return KMP_HALT;
    double integrand = kmp_forward_integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->before[i] = l->qdd[kmp_forward_unknowns(f)[i]];
    kmp_forward_set_modes(f, mode);
    if (come_aside(f, t, aside, y) != KMP_GO)
        return kmp_forward_halt(f, "the motion cannot continue after the condition %s at t = %.9g",
                                f->system->event_text[k], t);
    jump(f, integrand, y);
    f->t = NAN; /* the place is the one before the change */
    return KMP_GO;
}

/* The condition that the motion itself has changed where rounding leaves all of them before their change: the one whose
 * change is nearest in time. Others change with it. */
static int find_nearest(kmp_forward_formulation *f, const double *y)
{
    int nearest = -1, first = -1;
    double least = INFINITY;
    for (int k = 0; k < f->system->events.count; k++) {
        if (!kmp_forward_mode_differs(f, k, f->new_mode))
            continue;
        first = first < 0 ? k : first;
        if (kmp_forward_find_swing(f, k, y) && f->distance < least) {
            least = f->distance;
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
    memcpy(f->new_mode, l->eval->mode, kmp_forward_mode_bytes(f));
    memcpy(f->next_mode, f->mode, kmp_forward_mode_bytes(f));
    kmp_forward_set_modes(f, f->mode);
    if (kmp_forward_stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    kmp_eval_all_changes(l->eval, t, l->q, l->qd, l->qdd, l->lambda, f->changes);
    for (int k = 0; k < count; k++) {
        bool changes = kmp_forward_mode_differs(f, k, f->new_mode);
        f->cause[k] = changes && (f->changes[k] < 0) != (f->mode[k] != 0);
        last = f->cause[k] ? k : last;
    }
    if (last < 0) {
        if (kmp_forward_spread(f, t, y) != KMP_GO)
            return KMP_HALT;
        last = find_nearest(f, y);
    }
    f->cause[last] = true;
    for (int k = 0; said == KMP_GO && k <= last; k++)
        if (f->cause[k]) {
            f->next_mode[k] = f->new_mode[k];
            said = pass(f, k, k == last ? f->new_mode : f->next_mode, t, y);
        }
    return said;
}

/* -- next values of states ------------------------------------------------------------------------------ */

static bool has_passed(const kmp_forward_formulation *f, int condition, double t)
{
    return kmp_same_time(f->swung_t[condition], t);
}

/* The condition at whose time state `sample` changes; -1: a time that depends on no parameter. A change that has not
 * passed as an event is one that an input or a sample has made. */
static int cause_of(const kmp_forward_formulation *f, int sample, double t)
{
    int k = f->cause_of[sample];
    return k >= 0 && has_passed(f, k, t) ? f->swung_by[k] : -1;
}

/* dt_e/dp of a condition that has passed; NULL: zero. */
static const double *swing_of(const kmp_forward_formulation *f, int condition)
{
    return condition < 0 ? NULL : f->swings + (ptrdiff_t)condition * f->most;
}

/* True if the time of a condition that has passed depends on no parameter. */
static bool is_still(const kmp_forward_formulation *f, int condition)
{
    const double *swing = swing_of(f, condition);
    for (int i = 0; swing && i < f->count; i++)
        if (swing[i] != 0)
            return false;
    return true;
}

/* An event of the motion at t, with or without a state, whose time depends on parameters as `swing` does not. */
static bool any_other(const kmp_forward_formulation *f, const double *swing, double t)
{
    for (int k = 0; k < f->system->events.count; k++)
        if (has_passed(f, k, t) && !is_still(f, f->swung_by[k]) &&
            kmp_forward_are_different(f, swing, swing_of(f, f->swung_by[k])))
            return true;
    return false;
}

int kmp_forward_find_reset_swing(kmp_forward_formulation *f, const double *jump, double t)
{
    const double *common = jump;
    bool any = jump;
    f->reset_cause = -1;
    if (f->follows && f->options->alone)
        return kmp_forward_halt(f,
                                "a state changes at t = %.9g s within rounding of an event before: the adjoint method "
                                "does not support this, the forward method does",
                                t);
    if (f->missed)
        return kmp_forward_halt(f, "states change too often at t = %.9g: derivatives end there", t);
    for (int k = 0; f->resets > 0 && k < f->samples; k++) {
        if (!f->taken[k])
            continue;
        /* dt/dp of the change, zero where it is NULL. Delayed signals that jump change conditions with them. */
        const int cause = cause_of(f, k, t);
        const double *swing = cause < 0 && f->cause_of[k] >= 0 ? jump : swing_of(f, cause);
        if ((any && kmp_forward_are_different(f, common, swing)) || any_other(f, swing, t))
            return kmp_forward_halt_at_event(f, k, t);
        f->reset_cause = any ? f->reset_cause : cause;
        common = any ? common : swing;
        any = true;
    }
    if (jump && any_other(f, jump, t))
        return kmp_forward_halt(
            f,
            "a delayed signal jumps at t = %.9g together with an event: the motion has no derivative with "
            "respect to parameters there",
            t);
    if (f->resets > 0 && !common) {
        f->sampled_t = t;
        for (int k = 0; k < f->samples; k++)
            f->sampled = f->taken[k] ? k : f->sampled;
    }
    memset(f->swing, 0, (size_t)f->count * sizeof *f->swing);
    if (common)
        memcpy(f->swing, common, (size_t)f->count * sizeof *f->swing);
    return KMP_GO;
}

void kmp_forward_take_next_values(kmp_forward_formulation *f, double t)
{
    kmp_sensitivity_equations *v = f->v;
    const kmp_linear *l = &v->linear;
    const kempe_model *model = f->system->model;
    const int first = kmp_model_coordinates(model);
    for (int r = 0; r < f->resets; r++) {
        const bool *taken = f->taken + (ptrdiff_t)r * f->samples;
        const kmp_instant at = kmp_instant_of(l->eval, t, f->q, f->qd, l->qdd, l->lambda);
        const double *value = kmp_slopes_values(&v->slopes->samples, &at);
        for (int i = 0; i < f->count; i++) {
            double *dqd = f->dqd + (ptrdiff_t)i * f->n;
            const kmp_direction along = {.t = &f->swing[i], .q = f->dq + (ptrdiff_t)i * f->n, .qd = dqd};
            kmp_slopes_along(v->slopes, &v->slopes->samples, &along, i, f->next);
            for (int k = 0; k < f->samples; k++)
                if (taken[k])
                    dqd[first + kmp_state_of_sample(model, k)] = f->next[k];
        }
        for (int k = 0; k < f->samples; k++)
            if (taken[k])
                f->qd[first + kmp_state_of_sample(model, k)] = value[k];
    }
    f->resets = 0;
}

/* States have taken next values since the last start, or delayed signals jump (`jump`: dt/dp there, of a state with
 * rates qd), and conditions have changed with them. */
static int pass_resets(kmp_forward_formulation *f, double t, const double *jump, const double *qd, double *y)
{
    memcpy(f->new_mode, kmp_forward_eval(f)->mode, kmp_forward_mode_bytes(f));
    kmp_forward_set_modes(f, f->mode);
    if (kmp_forward_find_reset_swing(f, jump, t) != KMP_GO || kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    double integrand = kmp_forward_integrand_here(f);
    /* Adds the rates of the last state times dt_e/dp to the place. */
    const kmp_linear *l = &f->v->linear;
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->n && f->swing[k] != 0; i++) {
            f->dq[k * f->n + i] += l->qd[i] * f->swing[k];
            f->dqd[k * f->n + i] += l->qdd[i] * f->swing[k];
        }
    kmp_forward_delays_pass(f, t, qd);
    kmp_forward_take_next_values(f, t);
    kmp_forward_delays_note(f, t, f->swing);
    kmp_forward_pack(f, y);
    kmp_forward_set_modes(f, f->new_mode);
    memcpy(f->mode, f->new_mode, kmp_forward_mode_bytes(f));
    if (kmp_forward_stand_at(f, t, y, true) != KMP_GO)
        return KMP_HALT;
    /* Takes the rates of the last state times dt_e/dp from the unknowns. */
    int half = kmp_forward_blocks(f), w = f->width;
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < w && f->swing[k] != 0; i++) {
            y[(k + 1) * w + i] -= l->qd[kmp_forward_unknowns(f)[i]] * f->swing[k];
            y[half + (k + 1) * w + i] -= l->qdd[kmp_forward_unknowns(f)[i]] * f->swing[k];
        }
    for (int k = 0; f->integrals && k < f->count; k++)
        if (f->swing[k] != 0)
            y[2 * half + 1 + k] += (integrand - kmp_forward_integrand_here(f)) * f->swing[k];
    f->t = NAN; /* the place is the one before the change */
    return KMP_GO;
}

/* -- charts --------------------------------------------------------------------------------------------- */

/* Joints have been centred: converts the place from the charts before to (q, qd) in the current ones. */
static int pass_charts(kmp_forward_formulation *f, double t, const double *q, const double *qd, double *y)
{
    memcpy(f->new_chart, kmp_forward_eval(f)->chart, kmp_forward_chart_bytes(f));
    kmp_eval_set_charts(kmp_forward_eval(f), f->chart);
    if (kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    kmp_eval_set_charts(kmp_forward_eval(f), f->new_chart);
    kmp_forward_enter_charts(f, q, qd);
    kmp_eval_closure(kmp_forward_eval(f), t, q);
    if (!f->start.fixed && !f->zone)
        return kmp_forward_choose_anew(f, y);
    kmp_forward_pack(f, y);
    return KMP_GO;
}

int kmp_forward_pass_changes(kmp_forward_formulation *f, double t, const double *q, const double *qd,
                             const double *jump, double *y)
{
    if ((f->resets > 0 || jump) && pass_resets(f, t, jump, qd, y) != KMP_GO)
        return KMP_HALT;
    if (kmp_forward_first_other_mode(f, kmp_forward_eval(f)->mode) >= 0 && pass_conditions(f, t, y) != KMP_GO)
        return KMP_HALT;
    return kmp_forward_charts_differ(f, f->chart) ? pass_charts(f, t, q, qd, y) : KMP_GO;
}
