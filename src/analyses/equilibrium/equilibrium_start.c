/* SPDX-License-Identifier: BSD-3-Clause */
/* The search begins at the closed start. Its result has the rates and states of the equilibrium; the rates of the start
 * that it has not are named, and so is what moves away from it. */
#include "analyses/equilibrium/equilibrium_start.h"
#include "analyses/equilibrium/balances.h"
#include "analyses/parts/study_print.h"
#include "base/context.h"
#include "base/text.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "model/data/start.h"
#include <math.h>
#include <string.h>

enum { MOST_NAMED = 5 };
#define SAME_RATE 1e-2 /* relative to the larger one: given rates of a steady motion are guesses */
#define MOVED     1e-6 /* rad, or characteristic lengths */

static bool is_same(double a, double b)
{
    return fabs(a - b) <= SAME_RATE * fmax(fabs(a), fabs(b));
}

/* The rates that the model gives and the equilibrium has not. */
static void put_dropped(kmp_text *text, const kempe_model *model, const kmp_balance *b)
{
    int count = 0;
    kmp_text names = {0};
    for (int k = 0; k < kmp_model_coordinates(model); k++) {
        const double given = model->start.qd_given[k] ? model->start.qd[k].value : 0;
        const kmp_shown as = kmp_shown_as(model->context, model->motions[k].rotation ? "rad/s" : "m/s");
        if (given == 0 || is_same(given, b->qd[k]))
            continue;
        if (count++ < MOST_NAMED)
            kmp_text_printf(&names, "%s'%s' %.6g %s", count > 1 ? ", " : "", model->motions[k].name, as.factor * given,
                            as.unit);
    }
    if (count > 0)
        kmp_text_printf(text, "rates of the given start that do not count, since the equilibrium has others: %s%s\n",
                        names.s ? names.s : "", count > MOST_NAMED ? ", .." : "");
    kmp_text_free_part(text, &names);
}

/* The coordinate that is farthest from the given start. */
static void put_move(kmp_text *text, const kempe_assembly *a, const kmp_balance *b)
{
    const kempe_system *s = a->system;
    int most = -1;
    double far = MOVED;
    for (int k = 0; k < kmp_model_coordinates(s->model); k++) {
        bool idle = false;
        for (int i = 0; i < b->idle_count; i++)
            idle = idle || b->idle[i] == k;
        const double move = idle ? 0 : fabs(b->q[k] - a->q[k]) / s->scale[k];
        most = move > far ? k : most;
        far = fmax(far, move);
    }
    if (most < 0)
        return;
    const kmp_shown as = kmp_shown_as(s->context, s->model->motions[most].rotation ? "rad" : "m");
    kmp_text_printf(text, "the farthest from the given start: '%s', by %.4g %s\n", s->model->motions[most].name,
                    as.factor * (b->q[most] - a->q[most]), as.unit);
}

/* Friction that has no force there, and sticks. */
static void put_friction(kmp_text *text, const kempe_equilibrium *e)
{
    if (e->resting)
        kmp_text_printf(text, "friction that has no force there, and sticks: %s\n", e->resting);
}

static void put_remarks(kmp_text *text, const kempe_equilibrium *e, const kempe_assembly *a)
{
    const kmp_balance *b = &e->balance[0];
    put_move(text, a, b);
    put_dropped(text, a->system->model, b);
    put_friction(text, e);
    if (kmp_model_has_time(e->system->model))
        kmp_text_put(text, "functions of time and inputs have their values at t = 0: it is an equilibrium as long as "
                           "these do not change\n");
}

static bool moves(const kempe_system *s, const kmp_balance *b)
{
    bool any = false;
    for (int k = 0; k < kmp_model_coordinates(s->model); k++)
        any = any || b->qd[k] != 0;
    return any;
}

static kempe_status describe(kempe_assembly *a, const kempe_equilibrium *e)
{
    const kmp_balance *b = &e->balance[0];
    kmp_start_balance *to = KMP_ARENA_NEW(&a->arena, kmp_start_balance, 1);
    kmp_text title = {0}, remarks = {0}, steady = {0};
    bool kept, held;
    KMP_TRY(kmp_made(a->system->context, to));
    const int cyclic = kmp_balance_put_cyclic(&steady, e, b, &kept, &held);
    kmp_text_printf(&title, "at the %s that its start leads to, %s", cyclic > 0 ? "steady motion" : "equilibrium",
                    kmp_stability_text(b->stability.word));
    kmp_balance_put_growth(&title, &b->stability);
    if (cyclic > 0)
        kmp_text_printf(&remarks, "steady: %s\n", steady.s ? steady.s : "");
    if (held)
        kmp_text_put(&remarks, "the load that keeps the speed is not in the model: the motion slows down\n");
    put_remarks(&remarks, e, a);
    *to = (kmp_start_balance){.stability = kmp_stability_text(b->stability.word),
                              .title = kmp_text_keep(&title, &a->arena),
                              .remarks = remarks.length > 0 ? kmp_text_keep(&remarks, &a->arena) : "",
                              .growing = b->stability.growing,
                              .moves = moves(a->system, b),
                              .idle_count = b->idle_count,
                              .idle = kmp_arena_copy(&a->arena, b->idle, b->idle_count, sizeof *b->idle),
                              .rate = b->stability.re,
                              .residual = b->residual};
    a->balance = to;
    const bool made = cyclic >= 0 && to->title && to->remarks && !remarks.failed;
    kmp_text_free(&steady);
    return kmp_made(a->system->context, made);
}

/* A delayed signal that has a given past is not constant. */
static kempe_status refuse_pasts(const kempe_system *s)
{
    for (int k = 0; k < s->model->state_count; k++)
        if (s->model->states[k].before)
            return kmp_fail(s->context, KEMPE_E_FAILED,
                            "start: 'at: equilibrium' contradicts the 'before' of '%s': at an equilibrium its signal "
                            "has always been the same; leave one of them out",
                            s->model->states[k].name);
    return KEMPE_OK;
}

/* The state of the first balance into the assembly, in its charts where the user's own angles are near their singular
 * position. States have no position. */
static void take(kempe_assembly *a, const kempe_equilibrium *e)
{
    const kempe_system *s = a->system;
    const kmp_balance *b = &e->balance[0];
    const size_t charts = (size_t)(KMP_CHART_SIZE * s->chart_count) * sizeof(double);
    bool own = true;
    for (int k = 0; k < s->n; k++) {
        const double q = k < kmp_model_coordinates(s->model) ? b->q[k] : a->q[k];
        a->moved[k] += q - a->q[k];
        a->q[k] = q;
        a->qd[k] = b->qd[k];
    }
    for (int c = 0; c < kmp_charts_count(s); c++)
        own = own && kmp_chart_regular(s, c, a->q) >= KMP_AXES_CENTRED;
    a->inner_q = a->inner_qd = a->chart = NULL;
    if (own)
        return;
    a->inner_q = kmp_arena_copy(&a->arena, e->inner_q, s->n, sizeof *a->inner_q);
    a->inner_qd = kmp_arena_copy(&a->arena, e->inner_qd, s->n, sizeof *a->inner_qd);
    a->chart = kmp_arena_copy(&a->arena, e->chart, (int)(charts / sizeof(double)), sizeof *a->chart);
}

kempe_status kmp_start_to_equilibrium(const kempe_system *s, kempe_assembly *a)
{
    static const char head[] = "equilibrium";
    const char *rates = kmp_model_start(s->model)->at + sizeof head - 1;
    kempe_equilibrium *e = NULL;
    KMP_TRY(refuse_pasts(s));
    KMP_TRY(kmp_equilibrium_from(s, *rates ? rates + 1 : NULL, a, &e));
    kempe_status status = describe(a, e);
    take(a, e);
    if (status == KEMPE_OK)
        status = kmp_made(s->context, !a->arena.failed);
    if (status == KEMPE_OK && a->balance->growing > 0)
        kmp_log(s->context, KEMPE_LOG_WARNING,
                "start: the equilibrium is unstable: a motion leaves it after a time that depends on rounding, unless "
                "something else disturbs it before");
    kempe_equilibrium_free(e);
    return status;
}
