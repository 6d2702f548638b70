/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes between steps: other independent coordinates, conditions that change, spherical joints that are centred. The
 * eval is the runner's: at a new start its conditions and charts show the changes since the last one. */
#include "studies/sensitivity/forward_inside.h"
#include <math.h>
#include <string.h>

/* An event whose condition changes no faster than this part of its usual rate is touched, not passed. */
#define GRAZING 1e-9

/* -- the place --------------------------------------------------------------------------------------- */

int kmp_forward_spread(kmp_forward_formulation *f, double t, const double *y)
{
    kmp_varied *v = f->v;
    if (kmp_forward_stand_at(f, t, y, true) != KMP_GO)
        return KMP_HALT;
    f->t = t;
    memcpy(f->q, v->linear.q, (size_t)f->n * sizeof *f->q);
    memcpy(f->qd, v->linear.qd, (size_t)f->n * sizeof *f->qd);
    memcpy(f->chart, v->linear.eval->chart, kmp_forward_chart_bytes(f));
    for (int k = 0; k < f->count; k++)
        kmp_forward_follow(f, y, k, f->dq + k * f->n, f->dqd + k * f->n, NULL, NULL);
    return KMP_GO;
}

void kmp_forward_enter_charts(kmp_forward_formulation *f, const double *q, const double *qd)
{
    const kmp_chart_motion from = {f->chart, f->q, f->qd, NULL}, to = {kmp_forward_eval(f)->chart, q, qd, NULL};
    for (int c = 0; c < f->system->chart_count; c++)
        for (int k = 0; k < f->count && memcmp(from.chart + KMP_CHART_SIZE * c, to.chart + KMP_CHART_SIZE * c,
                                               KMP_CHART_SIZE * sizeof(double)) != 0;
             k++)
            kmp_chart_carry(f->system, c, &from, &to, f->dq + k * f->n, f->dqd + k * f->n, NULL);
    memcpy(f->chart, to.chart, kmp_forward_chart_bytes(f));
    memcpy(f->q, q, (size_t)f->n * sizeof *q);
    memcpy(f->qd, qd, (size_t)f->n * sizeof *qd);
}

bool kmp_forward_charts_differ(const kmp_forward_formulation *f, const double *chart)
{
    return memcmp(chart, kmp_forward_eval(f)->chart, kmp_forward_chart_bytes(f)) != 0;
}

/* -- marks ------------------------------------------------------------------------------------------- */

void kmp_forward_keep_old(kmp_forward_formulation *f)
{
    const int *u = f->v->linear.part.u;
    for (int i = 0; i < f->p; i++) {
        f->old_u[i] = u[i];
        f->old_y[i] = f->q[u[i]];
        f->old_y[f->p + i] = f->qd[u[i]];
    }
    memcpy(f->old_q, f->q, (size_t)f->n * sizeof *f->q);
    memcpy(f->old_chart, f->chart, kmp_forward_chart_bytes(f));
}

static int report(kmp_forward_formulation *f, double t, int condition, kmp_varied_reset reset)
{
    kmp_varied_mark mark = {t, condition, f->old_u, f->old_q, f->old_y, f->mode, f->old_chart, {0}, reset};
    if (kmp_forward_charts_differ(f, f->old_chart))
        mark.next = (kmp_chart_motion){f->chart, f->q, f->qd, NULL};
    int said = f->options->watch.mark ? f->options->watch.mark(f->options->watch.user, &mark) : 0;
    if (said)
        (void)kmp_fail_memory(f->system->context);
    return said ? KMP_HALT : KMP_GO;
}

int kmp_forward_report_mark(kmp_forward_formulation *f, double t, int condition)
{
    return report(f, t, condition, (kmp_varied_reset){0});
}

/* The place is that after next values that states have taken at `times` passes. */
static int report_reset(kmp_forward_formulation *f, double t, int times)
{
    for (int i = 0; i < f->p; i++) {
        f->next_y[i] = f->q[f->old_u[i]];
        f->next_y[f->p + i] = f->qd[f->old_u[i]];
    }
    return report(f, t, -1, (kmp_varied_reset){times, f->taken, f->next_y, f->reset_cause});
}

/* -- other coordinates ------------------------------------------------------------------------------- */

/* Chooses other independent coordinates at the place, in the evaluator's state: as many, again. */
static int choose_anew(kmp_forward_formulation *f, double *y)
{
    kmp_linear *l = &f->v->linear;
    kmp_partition part;
    kempe_status status = kmp_partition_of_rank(&part, f->system, l->eval->jacobian, l->part.r, NULL, 0);
    if (status != KEMPE_OK || kmp_varied_take(f->v, f->t, f->q, &part) != KEMPE_OK)
        return KMP_HALT;
    if (kmp_forward_take_up(f, f->t, y) != KMP_GO)
        return KMP_HALT;
    f->due = false; /* there is no better choice */
    return KMP_GO;
}

int kmp_forward_renew(kmp_formulation *formulation, double t, double *y, double *yp)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    (void)yp;
    if (!f->due)
        return KMP_GO;
    if (kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    kmp_forward_keep_old(f);
    if (choose_anew(f, y) != KMP_GO || kmp_forward_report_mark(f, t, -1) != KMP_GO)
        return KMP_HALT;
    formulation->exchanges += memcmp(f->old_u, f->v->linear.part.u, (size_t)f->p * sizeof *f->old_u) != 0;
    return KMP_CHANGED;
}

/* -- conditions -------------------------------------------------------------------------------------- */

static void set_modes(const kmp_forward_formulation *f, const double *mode)
{
    if (memcmp(kmp_forward_eval(f)->mode, mode, kmp_forward_mode_bytes(f)) != 0)
        kmp_eval_set_modes(kmp_forward_eval(f), mode);
}

/* dt_e/dp of condition k at the place, which is the last state. False: the condition is touched, not passed. */
static bool find_swing(kmp_forward_formulation *f, int k)
{
    kmp_varied *v = f->v;
    kmp_linear *l = &v->linear;
    double one = 1, *along = f->along, rate, faster;
    kmp_instant at = kmp_linear_instant(&v->linear);
    (void)kmp_slopes_values(&v->slopes->events, &at);
    kmp_slopes_along(v->slopes, &v->slopes->events, &(kmp_direction){&one, l->qd, l->qdd, NULL, NULL, NULL}, -1, along);
    rate = along[k];
    kmp_slopes_along(v->slopes, &v->slopes->events, &(kmp_direction){.qd = l->qdd}, -1, along);
    faster = fabs(along[k]) + fabs(rate - along[k]);
    for (int i = 0; i < f->count; i++) {
        kmp_slopes_along(v->slopes, &v->slopes->events,
                         &(kmp_direction){.q = f->dq + i * f->n, .qd = f->dqd + i * f->n}, i, along);
        f->swing[i] = -along[k] / rate;
    }
    if (f->options->alone) {
        /* The derivatives of t_e by q, qd and parameters. */
        double *q = f->swing, *qd = q + f->n;
        memset(f->along, 0, (size_t)f->system->events.count * sizeof *f->along);
        memset(f->swing, 0, (size_t)f->swing_size * sizeof *f->swing);
        f->along[k] = -1 / rate;
        kmp_slopes_gradient(v->slopes, &v->slopes->events, f->along,
                            &(kmp_direction){.q = q, .qd = qd, .parameters = qd + f->n});
    }
    return fabs(rate) > GRAZING * faster;
}

static double integrand_here(kmp_forward_formulation *f)
{
    return f->integrals ? kmp_target_value(f->options->integrand, f->v) : 0;
}

/* Adds the jump: the values before less those after, times dt_e/dp. */
static void jump(kmp_forward_formulation *f, double integrand_before, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int half = kmp_forward_blocks(f);
    double integrand = integrand_before - integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->before[i] -= l->qdd[kmp_forward_unknowns(f)[i]];
    for (int k = 0; k < f->count; k++) {
        for (int i = 0; i < f->width; i++)
            y[half + (k + 1) * f->width + i] += f->before[i] * f->swing[k];
        if (f->integrals)
            y[2 * half + 1 + k] += integrand * f->swing[k];
    }
}

static int fail_at(kmp_forward_formulation *f, const char *sentence, int k, double t)
{
    kmp_text_printf(&f->formulation.reason, sentence, f->system->event_text[k], t);
    return KMP_HALT;
}

/* The conditions that change here do so at times with these derivatives: that of condition `by`. */
static void note_swing(kmp_forward_formulation *f, const double *mode, int by, double t)
{
    for (int k = 0; k < f->system->events.count; k++)
        if ((mode[k] != 0) != (kmp_forward_eval(f)->mode[k] != 0)) { /* also of kinks, where nothing jumps */
            memcpy(f->swings + (ptrdiff_t)k * f->swing_size, f->swing, (size_t)f->swing_size * sizeof *f->swing);
            f->swung_t[k] = t;
            f->swung_by[k] = by;
        }
    kmp_forward_delays_note(f, t, f->swing);
}

/* Changes condition k, and the others according to `mode`. A jump of an input does so at a time that depends on no
 * parameter. */
static int pass(kmp_forward_formulation *f, int k, const double *mode, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    bool given = kmp_present_inputs_jump(&l->eval->inputs, t);
    if (kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    memset(f->swing, 0, (size_t)f->swing_size * sizeof *f->swing);
    if (!given && !find_swing(f, k))
        return fail_at(f,
                       "the condition %s is touched at t = %.9g without crossing: the motion has no derivative with "
                       "respect to parameters there",
                       k, t);
    kmp_forward_keep_old(f);
    note_swing(f, mode, given ? -1 : k, t);
    memcpy(f->mode, l->eval->mode, kmp_forward_mode_bytes(f));
    double integrand = integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->before[i] = l->qdd[kmp_forward_unknowns(f)[i]];
    set_modes(f, mode);
    if (kmp_forward_come_to(f, t, y) != KMP_GO)
        return fail_at(f, "the motion cannot continue after the condition %s at t = %.9g", k, t);
    jump(f, integrand, y);
    f->t = NAN; /* the place is the one before the change */
    return kmp_forward_report_mark(f, t, given ? -1 : k);
}

/* Conditions have changed since the last start: passes those that the motion itself has changed one after the other,
 * the last of them with all dependent ones. */
static int pass_conditions(kmp_forward_formulation *f, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int count = f->system->events.count, last = -1, said = KMP_GO;
    memcpy(f->new_mode, l->eval->mode, kmp_forward_mode_bytes(f));
    memcpy(f->next_mode, f->mode, kmp_forward_mode_bytes(f));
    set_modes(f, f->mode);
    if (kmp_forward_stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    kmp_eval_all_changes(l->eval, t, l->q, l->qd, l->qdd, l->lambda, f->changes);
    for (int k = 0; k < count; k++) {
        bool changes = kmp_forward_mode_differs(f, k, f->new_mode);
        f->cause[k] = changes && (f->changes[k] < 0) != (f->mode[k] != 0);
        last = f->cause[k] || (changes && last < 0) ? k : last;
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

/* Events of one time have derivatives that are equal up to rounding. */
#define SAME_SWING 1e-6

static bool has_passed(const kmp_forward_formulation *f, int condition, double t)
{
    return f->swung_t[condition] >= t && f->swung_t[condition] <= t;
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
    return condition < 0 ? NULL : f->swings + (ptrdiff_t)condition * f->swing_size;
}

/* True if the time of a condition that has passed depends on no parameter. */
static bool is_still(const kmp_forward_formulation *f, int condition)
{
    const double *swing = swing_of(f, condition);
    for (int i = 0; swing && i < f->swing_size; i++)
        if (swing[i] != 0)
            return false;
    return true;
}

bool kmp_forward_same_swing(int count, const double *a, const double *b)
{
    for (int i = 0; i < count; i++)
        if (fabs(a[i] - b[i]) > SAME_SWING * fmax(fabs(a[i]), fabs(b[i])))
            return false;
    return true;
}

/* NULL is zero. */
static bool are_different(const kmp_forward_formulation *f, const double *a, const double *b)
{
    for (int i = 0; !(a && b) && i < f->swing_size; i++)
        if ((a && a[i] != 0) || (b && b[i] != 0))
            return true;
    return a && b && !kmp_forward_same_swing(f->swing_size, a, b);
}

/* An event of the motion at t, with or without a state, whose time depends on parameters as `swing` does not. */
static bool any_other(const kmp_forward_formulation *f, const double *swing, double t)
{
    for (int k = 0; k < f->system->events.count; k++)
        if (has_passed(f, k, t) && !is_still(f, f->swung_by[k]) && are_different(f, swing, swing_of(f, f->swung_by[k])))
            return true;
    return false;
}

/* dt/dp of the change of state `sample` at t; NULL: zero. `jump`: of delayed signals that jump there, which change
 * conditions with them. */
static const double *swing_of_reset(const kmp_forward_formulation *f, int sample, const double *jump, double t)
{
    const int cause = cause_of(f, sample, t);
    return cause < 0 && f->cause_of[sample] >= 0 ? jump : swing_of(f, cause);
}

/* f->swing for the first time that is noted, which those after it follow from; `jump`: of delayed signals that jump,
 * NULL without any. */
static int find_reset_swing(kmp_forward_formulation *f, const double *jump, double t)
{
    const kempe_model *model = f->system->model;
    const double *common = jump;
    bool any = jump;
    f->reset_cause = -1;
    for (int k = 0; f->resets > 0 && k < f->samples; k++) {
        if (!f->taken[k])
            continue;
        const double *swing = swing_of_reset(f, k, jump, t);
        if ((any && are_different(f, common, swing)) || any_other(f, swing, t)) {
            kmp_text_printf(&f->formulation.reason,
                            "the state '%s' changes at t = %.9g together with an event whose time depends on "
                            "parameters: the motion has no derivative with respect to them there",
                            model->states[kmp_state_of_sample(model, k)].name, t);
            return KMP_HALT;
        }
        f->reset_cause = any ? f->reset_cause : cause_of(f, k, t);
        common = any ? common : swing;
        any = true;
    }
    if (jump && any_other(f, jump, t)) {
        kmp_text_printf(&f->formulation.reason,
                        "a delayed signal jumps at t = %.9g together with an event: the motion has no derivative with "
                        "respect to parameters there",
                        t);
        return KMP_HALT;
    }
    memset(f->swing, 0, (size_t)f->swing_size * sizeof *f->swing);
    if (common)
        memcpy(f->swing, common, (size_t)f->swing_size * sizeof *f->swing);
    return KMP_GO;
}

/* Maps the place, whose derivatives are those along the event, by the next values noted at one time. */
static void take_next(kmp_forward_formulation *f, const bool *taken, double t)
{
    kmp_varied *v = f->v;
    const kmp_linear *l = &v->linear;
    const kempe_model *model = f->system->model;
    const int first = kmp_model_coordinates(model);
    const kmp_instant at = kmp_instant_of(l->eval, t, f->q, f->qd, l->qdd, l->lambda);
    const double *value = kmp_slopes_values(&v->slopes->samples, &at);
    for (int i = 0; i < f->count; i++) {
        double *dqd = f->dqd + (ptrdiff_t)i * f->n;
        const kmp_direction along = {
            .t = &f->swing[i], .q = f->dq + (ptrdiff_t)i * f->n, .qd = f->dqd + (ptrdiff_t)i * f->n};
        kmp_slopes_along(v->slopes, &v->slopes->samples, &along, i, f->next);
        for (int k = 0; k < f->samples; k++)
            if (taken[k])
                dqd[first + kmp_state_of_sample(model, k)] = f->next[k];
    }
    for (int k = 0; k < f->samples; k++)
        if (taken[k])
            f->qd[first + kmp_state_of_sample(model, k)] = value[k];
}

static void take_all_next(kmp_forward_formulation *f, double t)
{
    for (int r = 0; r < f->resets; r++)
        take_next(f, f->taken + (ptrdiff_t)r * f->samples, t);
    f->resets = 0;
}

static int too_many(kmp_forward_formulation *f, double t)
{
    kmp_text_printf(&f->formulation.reason, "states change too often at t = %.9g: derivatives end there", t);
    return KMP_HALT;
}

int kmp_forward_reset_place(kmp_forward_formulation *f, double t)
{
    kmp_evaluator *eval = kmp_forward_eval(f);
    if (f->missed)
        return too_many(f, t);
    if (find_reset_swing(f, NULL, t) != KMP_GO)
        return KMP_HALT;
    if (!is_still(f, f->reset_cause)) {
        kmp_text_printf(&f->formulation.reason,
                        "a state changes at t = %.9g where the equations are made anew: derivatives end there", t);
        return KMP_HALT;
    }
    memcpy(f->new_chart, eval->chart, kmp_forward_chart_bytes(f));
    kmp_eval_set_charts(eval, f->chart);
    const int times = f->resets;
    take_all_next(f, t);
    if (report_reset(f, t, times) != KMP_GO)
        return KMP_HALT;
    memcpy(f->old_y, f->next_y, (size_t)(2 * f->p) * sizeof *f->old_y);
    kmp_eval_set_charts(eval, f->new_chart);
    return KMP_GO;
}

/* States have taken next values since the last start, or delayed signals jump (`jump`: dt/dp there, of a state with
 * rates qd), and conditions have changed with them. */
static int pass_resets(kmp_forward_formulation *f, double t, const double *jump, const double *qd, double *y)
{
    if (f->missed)
        return too_many(f, t);
    memcpy(f->new_mode, kmp_forward_eval(f)->mode, kmp_forward_mode_bytes(f));
    set_modes(f, f->mode);
    if (find_reset_swing(f, jump, t) != KMP_GO || kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    double integrand = integrand_here(f);
    const int times = f->resets;
    kmp_forward_keep_old(f);
    /* Adds the rates of the last state times dt_e/dp to the place. */
    const kmp_linear *l = &f->v->linear;
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->n && f->swing[k] != 0; i++) {
            f->dq[k * f->n + i] += l->qd[i] * f->swing[k];
            f->dqd[k * f->n + i] += l->qdd[i] * f->swing[k];
        }
    kmp_forward_delays_pass(f, t, qd);
    take_all_next(f, t);
    kmp_forward_delays_note(f, t, f->swing);
    kmp_forward_pack(f, y);
    if (report_reset(f, t, times) != KMP_GO)
        return KMP_HALT;
    set_modes(f, f->new_mode);
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
            y[2 * half + 1 + k] += (integrand - integrand_here(f)) * f->swing[k];
    f->t = NAN; /* the place is the one before the change */
    return KMP_GO;
}

/* -- charts ------------------------------------------------------------------------------------------ */

/* Joints have been centred: converts the place from the charts before to (q, qd) in the current ones. */
static int pass_charts(kmp_forward_formulation *f, double t, const double *q, const double *qd, double *y)
{
    memcpy(f->new_chart, kmp_forward_eval(f)->chart, kmp_forward_chart_bytes(f));
    kmp_eval_set_charts(kmp_forward_eval(f), f->chart);
    if (kmp_forward_spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    kmp_eval_set_charts(kmp_forward_eval(f), f->new_chart);
    kmp_forward_keep_old(f);
    kmp_forward_enter_charts(f, q, qd);
    if (kmp_forward_report_mark(f, t, -1) != KMP_GO)
        return KMP_HALT;
    kmp_forward_keep_old(f);
    kmp_eval_closure(kmp_forward_eval(f), t, q);
    if (!f->start.fixed && !f->zone)
        return choose_anew(f, y);
    kmp_forward_pack(f, y);
    return KMP_GO;
}

int kmp_forward_resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    int half = kmp_forward_blocks(f);
    const double *jump;
    (void)yp;
    if (kmp_forward_delays_jump(f, t, &jump) != KMP_GO)
        return KMP_HALT;
    if ((f->resets > 0 || jump) && pass_resets(f, t, jump, qd, y) != KMP_GO)
        return KMP_HALT;
    if (kmp_forward_first_other(f, kmp_forward_eval(f)->mode) >= 0 && pass_conditions(f, t, y) != KMP_GO)
        return KMP_HALT;
    if (kmp_forward_charts_differ(f, f->chart) && pass_charts(f, t, q, qd, y) != KMP_GO)
        return KMP_HALT;
    for (int i = 0; i < f->width; i++) {
        y[i] = q[kmp_forward_unknowns(f)[i]];
        y[half + i] = qd[kmp_forward_unknowns(f)[i]];
    }
    kmp_forward_delays_set(f, t, y);
    if (kmp_forward_stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    kmp_forward_settle(f);
    return KMP_GO;
}
