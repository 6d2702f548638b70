/* SPDX-License-Identifier: BSD-3-Clause */
/* The formulation of a motion with sensitivities (forward.h): its creation, its rows and its run. Unknowns are in
 * forward_ode.c, changes between steps in forward_change.c. */
#include "base/memory.h"
#include "model/tables/run_settings.h"
#include "studies/sensitivity/forward_inside.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

/* -- values of a scalar ------------------------------------------------------------------------------ */

static double weighted(int count, const double *w, const double *x)
{
    double sum = 0;
    for (int i = 0; w && i < count; i++)
        sum += w[i] != 0 ? w[i] * x[i] : 0; /* values without weight may be NaN */
    return sum;
}

double kmp_target_of_row(const kmp_forward_target *target, const kmp_varied *varied, const kmp_varied_row *row)
{
    const kmp_forward_target *w = target;
    int n = varied->n;
    return weighted(n, w->q, row->q) + weighted(n, w->qd, row->qd) + weighted(n, w->qdd, row->qdd) +
           weighted(varied->m, w->lambda, row->lambda) + weighted(varied->slopes->shown, w->shown, row->shown);
}

double kmp_target_value(const kmp_forward_target *target, kmp_varied *varied)
{
    const kmp_linear *l = &varied->linear;
    kmp_instant at = kmp_linear_instant(&varied->linear);
    const double *shown = target->shown ? kmp_slopes_values(&varied->slopes->outputs, &at) : NULL;
    const kmp_varied_row here = {.q = l->q, .qd = l->qd, .qdd = l->qdd, .lambda = l->lambda, .shown = shown};
    return kmp_target_of_row(target, varied, &here);
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void position(kmp_formulation *formulation, double t, const double *y, double *q)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    if (f->zone)
        memcpy(q, y, (size_t)f->n * sizeof *q);
    else if (kmp_varied_position(f->v, t, y, q) != KMP_GO)
        memcpy(q, f->v->q, (size_t)f->n * sizeof *q);
}

static int row(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const kmp_linear *l = &f->v->linear;
    *work = 0;
    int said = qd || f->zone ? kmp_forward_stand_at(f, t, y, qdd != NULL) : kmp_varied_position(f->v, t, y, q);
    if (said != KMP_GO) {
        if (formulation->reason.length == 0)
            kmp_text_printf(&formulation->reason, "the closures could not be solved at the output time t = %.9g", t);
        return KMP_HALT;
    }
    if (!qd && !f->zone)
        return KMP_GO;
    memcpy(q, l->q, (size_t)f->n * sizeof *q);
    if (qd)
        memcpy(qd, l->qd, (size_t)f->n * sizeof *qd);
    if (!qdd)
        return KMP_GO;
    memcpy(qdd, l->qdd, (size_t)f->n * sizeof *qdd);
    memcpy(lambda, l->lambda, (size_t)f->m * sizeof *lambda);
    f->row_y = y;
    return KMP_GO;
}

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    kmp_forward_formulation *f = user;
    kmp_varied *v = f->v;
    const kmp_chart_motion own = {f->new_chart, q, qd, qdd};
    (void)work;
    if (!f->options->watch.row)
        return 0;
    const kmp_instant at = kmp_linear_instant(&v->linear);
    const double *shown = kmp_slopes_values(&v->slopes->outputs, &at);
    kmp_charts_reset(f->system, f->new_chart);
    for (int k = 0; k < f->count; k++) {
        /* The derivatives of the last whole row by parameter k: outputs in the current charts, and the user's
         * coordinates. */
        const kmp_linear *l = &v->linear;
        const kmp_chart_motion inner = {l->eval->chart, l->q, l->qd, l->qdd};
        double *dq = f->dq + k * f->n, *dqd = f->dqd + k * f->n, *dqdd = f->dqdd + k * f->n;
        double *dlambda = f->dlambda + k * f->m;
        kmp_forward_follow(f, f->row_y, k, dq, dqd, dqdd, dlambda);
        if (v->slopes->shown > 0)
            kmp_slopes_along(v->slopes, &v->slopes->outputs, &(kmp_direction){NULL, dq, dqd, dqdd, dlambda, NULL}, k,
                             f->dshown + k * v->slopes->shown);
        for (int c = 0; c < f->system->chart_count; c++)
            if (!kmp_chart_is_own(inner.chart, c))
                kmp_chart_carry(f->system, c, &inner, &own, dq, dqd, dqdd);
    }
    const kmp_varied_row row_of = {t, q, qd, qdd, lambda, shown, f->dq, f->dqd, f->dqdd, f->dlambda, f->dshown};
    return f->options->watch.row(f->options->watch.user, &row_of);
}

static int take_step(void *user, kmp_runner *runner, double from, double to)
{
    kmp_forward_formulation *f = user;
    if (!kmp_forward_delays_record(f, runner, to))
        return 1;
    const double *y = f->integrals ? kmp_runner_unknowns(runner, to) : NULL;
    if (f->integrals && !y)
        return 1;
    if (y)
        memcpy(f->tail, y + 2 * kmp_forward_blocks(f), (size_t)f->integrals * sizeof *y);
    return f->options->watch.step && to > from ? f->options->watch.step(f->options->watch.user, runner, from, to) : 0;
}

/* -- the formulation ---------------------------------------------------------------------------------------- */

/* v uses another evaluator from now on. */
static void go_by(kmp_forward_formulation *f, kmp_evaluator *eval)
{
    kmp_linear_lend(&f->v->linear, eval);
    kmp_linear_renew_parameters(&f->v->linear);
    kmp_slopes_renew_parameters(f->v->slopes);
}

/* Restores its own evaluator with the runner's charts and conditions. */
static void release(kmp_formulation *formulation)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const kmp_evaluator *eval = kmp_forward_eval(f);
    kmp_arena_free(&formulation->arena);
    if (eval == f->own)
        return;
    kmp_eval_set_charts(f->own, eval->chart);
    for (int k = 0; k < f->system->events.count; k++)
        kmp_eval_set_mode(f->own, k, eval->mode[k] != 0);
    go_by(f, f->own);
}

static int keep(kmp_formulation *formulation, double t, const double *y)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    memcpy(f->tail, y + 2 * kmp_forward_blocks(f), (size_t)f->integrals * sizeof *y);
    if (!(f->t >= t) && kmp_forward_spread(f, t, y) != KMP_GO) /* charts have changed, and the place with them */
        return KMP_HALT;
    kmp_forward_keep_old(f);
    return KMP_GO;
}

/* Checks a start that is neither the first one nor the place of the last formulation: rates have changed between them.
 */
static kempe_status check_place(kmp_forward_formulation *f, const kmp_formulation_start *start)
{
    int k = kmp_forward_first_other(f, start->eval->mode);
    if (k >= 0)
        return kmp_fail(
            f->system->context, KEMPE_E_FAILED,
            "closures switch where %s changes at t = %.9g: derivatives across jumps of the rates are not available",
            f->system->event_text[k], start->t);
    if (start->part->p != f->p || start->t > f->t || start->t < f->t)
        return kmp_fail(
            f->system->context, KEMPE_E_FAILED,
            "derivatives with respect to parameters end at t = %.9g, where the degrees of freedom are %d, not %d",
            start->t, start->part->p, f->p);
    return KEMPE_OK;
}

/* Delayed signals may not jump where the equations are made anew. */
static kempe_status check_delays(kmp_forward_formulation *f, const kmp_formulation_start *start)
{
    const double *swing;
    if (!f->delays)
        return KEMPE_OK;
    if (kmp_forward_delays_jump(f, start->t, &swing) != KMP_GO || swing)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "a delayed signal jumps at t = %.9g where the equations are made anew: derivatives end there",
                        start->t);
    memset(f->swing, 0, (size_t)f->swing_size * sizeof *f->swing);
    kmp_forward_delays_pass(f, start->t, start->qd);
    return KEMPE_OK;
}

static kempe_status begin(kmp_forward_formulation *f, const kmp_formulation_start *start)
{
    kmp_partition part;
    KMP_TRY(f->begun ? check_place(f, start) : KEMPE_OK);
    bool first = !f->begun;
    f->begun = true;
    f->p = start->part->p;
    f->redundant = start->part->m - start->part->r;
    KMP_TRY(kmp_made(f->system->context, kmp_forward_make_unknowns(f) && kmp_partition_copy(&part, start->part)));
    go_by(f, start->eval);
    f->v->linear.held = true;
    f->v->linear.plain = f->count == 0;
    KMP_TRY(kmp_varied_take(f->v, start->t, start->q, &part));
    if (first)
        memcpy(f->mode, start->eval->mode, kmp_forward_mode_bytes(f));
    if (f->resets > 0 && kmp_forward_reset_place(f, start->t) != KMP_GO)
        return kmp_fail(f->system->context, KEMPE_E_FAILED, "%s",
                        f->formulation.reason.s ? f->formulation.reason.s : "derivatives end where a state changes");
    KMP_TRY(first ? KEMPE_OK : check_delays(f, start));
    kmp_forward_enter_charts(f, start->q, start->qd);
    KMP_TRY(first ? kmp_forward_delays_begin(f, start->t) : KEMPE_OK);
    memcpy(f->formulation.y + 2 * kmp_forward_blocks(f), f->tail, (size_t)f->integrals * sizeof *f->tail);
    if (kmp_forward_take_up(f, start->t, f->formulation.y) != KMP_GO)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "the start cannot be evaluated: its closures are singular, or a coordinate moves no mass");
    bool marked = !first || kmp_forward_charts_differ(f, f->old_chart);
    return !marked || kmp_forward_report_mark(f, start->t, -1) == KMP_GO ? KEMPE_OK : KEMPE_E_MEMORY;
}

static const kmp_formulation_kind varied_zone;

static kmp_formulation *create(const kmp_formulation_kind *kind, const kmp_formulation_start *start)
{
    kmp_forward_formulation *f = start->user;
    f->zone = kind == &varied_zone;
    f->start = *start;
    f->formulation.exchanges = 0;
    kmp_text_free(&f->formulation.reason);
    if (begin(f, start) == KEMPE_OK)
        return &f->formulation;
    release(&f->formulation);
    return NULL;
}

static const kmp_formulation_kind varied_zone = {
    .formulation = "varied", .form = "zone", .corrected = true, .create = create};
static const kmp_formulation_kind varied_formulation = {
    .formulation = "varied", .form = "newton", .corrected = true, .near_singular = &varied_zone, .create = create};

/* Derivatives follow when the formulation resumes or begins. */
static void note_reset(void *user, int count, const bool *taken, const int *condition)
{
    kmp_forward_formulation *f = user;
    f->missed = f->missed || f->resets == kmp_forward_most_resets(f);
    if (f->missed)
        return;
    for (int k = 0; k < count; k++) {
        f->taken[f->resets * f->samples + k] = taken[k];
        f->cause_of[f->resets * f->samples + k] = condition[k];
    }
    f->resets++;
}

static int states_with_next(const kempe_model *model)
{
    int count = 0;
    for (int k = 0; k < model->state_count; k++)
        count += model->states[k].next != NULL;
    return count;
}

int kmp_state_of_sample(const kempe_model *model, int sample)
{
    for (int k = 0;; k++)
        if (model->states[k].next && sample-- == 0)
            return k;
}

/* -- the run ----------------------------------------------------------------------------------------- */

static bool make_room(kmp_forward_formulation *f)
{
    kmp_arena *a = &f->arena;
    int n = f->n, count = f->v->count, conditions = f->system->events.count;
    KMP_ARENA_MAKE(a, KMP_ROOM(double, n, &f->q, &f->qd, &f->su, &f->sud, &f->ud, &f->before, &f->old_q),
                   KMP_ROOM(double, n *count, &f->dq, &f->dqd, &f->dqdd), KMP_ROOM(double, f->m *count, &f->dlambda),
                   KMP_ROOM(double, f->v->slopes->shown *count, &f->dshown), KMP_ROOM(double, f->swing_size, &f->swing),
                   KMP_ROOM(double, conditions, &f->mode, &f->new_mode, &f->next_mode, &f->changes, &f->along),
                   KMP_ROOM(double, KMP_CHART_SIZE * f->system->chart_count, &f->chart, &f->new_chart, &f->old_chart),
                   KMP_ROOM(double, 2 * n, &f->old_y), KMP_ROOM(double, 2 * n * n, &f->matrix),
                   KMP_ROOM(double, f->integrals, &f->tail),
                   KMP_ROOM(int, n, &f->signs, &f->signs_now, &f->old_u, &f->every),
                   KMP_ROOM(bool, conditions, &f->cause), KMP_ROOM(double, conditions * f->swing_size, &f->swings),
                   KMP_ROOM(double, conditions, &f->swung_t), KMP_ROOM(int, conditions, &f->swung_by),
                   KMP_ROOM(double, f->samples, &f->next), KMP_ROOM(double, 2 * n, &f->next_y),
                   KMP_ROOM(bool, kmp_forward_most_resets(f) * f->samples, &f->taken),
                   KMP_ROOM(int, kmp_forward_most_resets(f) * f->samples, &f->cause_of));
    for (int k = 0; !a->failed && k < conditions; k++)
        f->swung_t[k] = NAN;
    for (int i = 0; !a->failed && i < f->n; i++)
        f->every[i] = i;
    return !a->failed && kmp_forward_delays_make(f);
}

/* Puts the start and its derivatives into the place. */
static kempe_status prepare(kmp_forward_formulation *f)
{
    kmp_varied *v = f->v;
    size_t slopes = (size_t)(f->n * v->count) * sizeof(double);
    KMP_TRY(kmp_made(f->system->context, make_room(f)));
    kmp_charts_reset(f->system, f->chart);
    kmp_eval_set_charts(f->own, f->chart);
    f->own->frozen = false; /* by the end of an earlier run */
    go_by(f, f->own);
    v->linear.plain = false;
    KMP_TRY(kmp_varied_start(v, f->q, f->qd, f->dq, f->dqd));
    if (f->options->start_q)
        memcpy(f->options->start_q, f->dq, slopes);
    if (f->options->start_qd)
        memcpy(f->options->start_qd, f->dqd, slopes);
    f->p = v->linear.p;
    if (v->linear.chosen)
        kmp_forward_keep_old(f);
    return KEMPE_OK;
}

/* True if the target uses coordinates of spherical joints themselves, which differ in each chart. */
static bool reads_angles(const kempe_system *s, const kmp_forward_target *target)
{
    const double *part[] = {target->q, target->qd, target->qdd};
    bool reads = false;
    for (int k = 0; k < 9 * s->chart_count; k++)
        reads = reads || (part[k % 3] && part[k % 3][s->chart_first[k / 9] + k / 3 % 3] != 0);
    return reads;
}

static kempe_status run(kmp_forward_formulation *f, kmp_forward_report *report)
{
    kmp_run_spec spec = *f->options->spec;
    kempe_status status = prepare(f);
    const kempe_assembly start = {.system = f->system, .q = f->q, .qd = f->qd, .closed = true};
    spec.kind = &varied_formulation;
    spec.user = f;
    spec.step = take_step;
    spec.slopes = true;
    spec.sample = f->samples > 0 ? note_reset : NULL;
    spec.own_angles = f->own_angles = f->options->integrand && reads_angles(f->system, f->options->integrand);
    if (f->options->alone)
        spec.change_points = kmp_change_points_word(KMP_CHANGE_POINTS_IGNORE);
    if (status == KEMPE_OK)
        status = kmp_run(f->system, &spec, &start, take_row, f, &report->run);
    report->integral = f->integrals && f->tail ? f->tail[0] : 0;
    report->redundant = f->redundant;
    if (report->run.reason || (status != KEMPE_E_FAILED && status != KEMPE_STOPPED))
        return status;
    report->run.reason = kmp_strdup(kempe_context_message(f->system->context));
    return report->run.reason ? status : kmp_fail_memory(f->system->context);
}

kempe_status kmp_forward_run(kmp_varied *varied, const kmp_forward *options, const double *sizes, double *integral,
                             kmp_forward_report *report)
{
    kmp_forward_formulation f = {.formulation = {.release = release,
                                                 .row = row,
                                                 .position = position,
                                                 .renew = kmp_forward_renew,
                                                 .resume = kmp_forward_resume,
                                                 .keep = keep,
                                                 .explain = kmp_forward_explain,
                                                 .n = varied->n},
                                 .v = varied,
                                 .own = varied->linear.eval,
                                 .options = options,
                                 .system = varied->system,
                                 .sizes = sizes,
                                 .n = varied->n,
                                 .m = varied->m,
                                 .count = options->alone ? 0 : varied->count,
                                 .samples = states_with_next(varied->system->model)};
    f.integrals = options->integrand ? 1 + f.count : 0;
    f.swing_size = options->alone ? 2 * f.n + varied->count : f.count;
    *report = (kmp_forward_report){0};
    kempe_status status = run(&f, report);
    for (int k = 0; integral && f.integrals && f.tail && k < f.count; k++)
        integral[k] = f.tail[1 + k];
    kmp_text_free(&f.formulation.reason);
    kmp_forward_delays_free(&f);
    kmp_arena_free(&f.arena);
    varied->linear.plain = false;
    return status;
}
