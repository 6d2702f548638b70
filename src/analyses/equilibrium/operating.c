/* SPDX-License-Identifier: BSD-3-Clause */
/* The state at which a study linearises: the assembled start, or an equilibrium of the kind that its word names, with
 * friction and contacts in the modes in which a run would begin. Values that are not finite are named with the force.
 * */
#include "analyses/equilibrium/operating.h"
#include "analyses/equilibrium/exchange.h"
#include "analyses/equilibrium/running_state.h"
#include "analyses/parts/unsupported.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "integrators/run/friction_state.h"
#include "model/data/body.h"
#include "output/print.h"
#include "studies/simulate/flexible_doubts.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Takes the assembled start in its charts, none of them singular. */
static void begin(kmp_operating *o, const kempe_assembly *a)
{
    const kempe_system *s = o->system;
    size_t n = (size_t)s->n * sizeof(double);
    memcpy(o->q, a->q, n);
    memcpy(o->qd, a->qd, n);
    memcpy(o->inner_q, a->inner_q ? a->inner_q : a->q, n);
    memcpy(o->inner_qd, a->inner_q ? a->inner_qd : a->qd, n);
    if (!o->chart)
        return;
    kmp_charts_reset(s, o->chart);
    if (a->chart)
        memcpy(o->chart, a->chart, (size_t)(KMP_CHART_SIZE * s->chart_count) * sizeof *o->chart);
    for (int c = 0; c < kmp_charts_count(s); c++)
        if (kmp_chart_regular(s, c, o->inner_q) < KMP_AXES_CENTRED)
            kmp_chart_center(s, c, o->chart, o->inner_q, o->inner_qd, NULL);
}

kempe_status kmp_operating_check(kmp_linear *l, const kmp_search *search)
{
    kempe_status status = KEMPE_OK;
    int *idle = KMP_NEW(int, l->p), count = idle ? kmp_equilibrium_idle(l, idle) : -1;
    if (count < 0)
        status = kmp_fail_memory(l->system->context);
    for (int i = 0; status == KEMPE_OK && i < search->rate_count; i++) {
        bool goes_on = search->rates[i].rate == 0;
        for (int k = 0; k < count; k++)
            goes_on = goes_on || idle[k] == search->rates[i].coordinate;
        for (int k = 0; search->exchange && k < search->exchange->target_count; k++)
            goes_on = goes_on || search->exchange->target[k].coordinate == search->rates[i].coordinate;
        if (!goes_on)
            status = kmp_steady_complain(l->system->model, &search->rates[i]);
    }
    kmp_free(idle);
    return status;
}

/* A failure that has no sentence yet gets one. */
static kempe_status say_why(kempe_context *context, kempe_status status)
{
    if (status == KEMPE_E_FAILED && kempe_context_message(context)[0] == 0)
        return kmp_fail(context, status,
                        "the loops cannot be closed near the state, or a mass is not positive there: 'kempe check' "
                        "lists dependent constraints");
    return status;
}

static kempe_status find_equilibrium(const kmp_operating *o, kmp_linear *l, double *q, kmp_search *search)
{
    if (search->newton) {
        /* The loops closed with the current parameters and rates. */
        KMP_TRY(kmp_linear_choose(l, o->t, q, NULL, 0));
        KMP_TRY(kmp_linear_at(l, o->t, q, NULL, NULL));
        memcpy(q, l->q, (size_t)l->n * sizeof *q);
    }
    KMP_TRY(kmp_equilibrium_or_steady(l, o->t, q, o->inner_qd, search));
    return kmp_operating_check(l, search);
}

kempe_status kmp_operating_settle(kmp_operating *o, kmp_linear *l, kmp_search *search)
{
    size_t n = (size_t)l->n * sizeof(double);
    memcpy(o->trial, o->inner_q, n);
    kmp_friction_state_release(l->eval);
    if (o->chart)
        kmp_eval_set_charts(l->eval, o->chart);
    kempe_status status = find_equilibrium(o, l, o->trial, search);
    if (status != KEMPE_OK)
        return say_why(l->system->context, status);
    memcpy(o->inner_q, o->trial, n);
    memcpy(o->inner_qd, l->qd, n);
    memcpy(o->q, o->trial, n);
    memcpy(o->qd, l->qd, n);
    o->equilibrium = true;
    o->residual = search->residual;
    o->kept_count = 0;
    o->held = false;
    for (int i = 0; i < search->rate_count; i++)
        o->held = o->held || search->rates[i].how == KMP_RATE_HELD;
    for (int i = 0; i < search->rate_count; i++)
        if (search->rates[i].how == KMP_RATE_KEPT || search->rates[i].how == KMP_RATE_HELD)
            o->kept[o->kept_count++] = search->rates[i].coordinate;
    if (o->chart) {
        memcpy(o->chart, l->eval->chart, (size_t)(KMP_CHART_SIZE * l->system->chart_count) * sizeof *o->chart);
        kmp_charts_show(l->system, o->chart, o->inner_q, o->q, o->qd);
    }
    return KEMPE_OK;
}

/* To the equilibrium with the rates of a list; `linear`: NULL, one is made. */
static kempe_status settle(kmp_operating *o, kmp_linear *linear, const char *list)
{
    kmp_linear own;
    kmp_search search = {0};
    KMP_TRY(kmp_steady_read(o->system->model, *list ? list : NULL, &o->arena, &search.rate_count, &search.rates));
    KMP_TRY(linear ? KEMPE_OK : kmp_linear_init(&own, o->system, kmp_backend_default()));
    kempe_status status = kmp_operating_settle(o, linear ? linear : &own, &search);
    if (!linear)
        kmp_linear_free(&own);
    return status;
}

/* The text after "equilibrium" and a space; NULL: it is another word. */
static const char *rates_of(const char *word)
{
    size_t length = strlen("equilibrium");
    if (!word)
        return "";
    if (strncmp(word, "equilibrium", length) != 0 || (word[length] && word[length] != ' '))
        return NULL;
    return word + length + (word[length] == ' ');
}

kempe_status kmp_operating_new(const kempe_system *system, const char *word, kmp_linear *linear,
                               kmp_operating **operating)
{
    bool start = word && strcmp(word, "start") == 0;
    KMP_TRY(kmp_refuse_samples(system->model, "small motions about a state", false));
    KMP_TRY(kmp_refuse_delays(system->model, "small motions about a state", KMP_INSTEAD_OF_DELAY));
    const char *list = rates_of(word);
    if (!start && !list)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT,
                        "unknown state '%s': 'start', 'equilibrium', or 'equilibrium NAME=RATE,..' (a steady motion)",
                        word);
    kempe_assembly *a = NULL;
    KMP_TRY(start ? kmp_assembly_at_start(system, &a) : kmp_assembly_as_given(system, &a));
    kmp_operating *o = KMP_NEW(kmp_operating, 1);
    kempe_status status = o ? KEMPE_OK : kmp_fail_memory(system->context);
    if (status == KEMPE_OK) {
        const int n = system->n;
        o->system = system;
        if (system->chart_count > 0)
            o->chart = KMP_ARENA_NEW(&o->arena, double, KMP_CHART_SIZE * system->chart_count);
        status = kmp_made(system->context,
                          KMP_ARENA_MAKE(&o->arena, KMP_ROOM(int, n, &o->kept),
                                         KMP_ROOM(double, n, &o->q, &o->qd, &o->inner_q, &o->inner_qd, &o->trial)));
    }
    if (status == KEMPE_OK) {
        begin(o, a);
        status = start ? KEMPE_OK : settle(o, linear, list);
        if (status == KEMPE_OK)
            kmp_doubt_deflection(system, o->q);
        if (status == KEMPE_OK)
            (void)kmp_doubt_shared_friction(system, 0, o->q);
    }
    kempe_assembly_free(a);
    return KMP_GIVE_OR_FREE(status, operating, o, kmp_operating_free);
}

KMP_FREES(kmp_operating, operating, kmp_arena_free(&operating->arena))

/* A coordinate along which a force, or its change with the state, is NaN or infinite; -1: none. */
static int find_no_number(const kmp_linear *l)
{
    const kmp_tangents *t = &l->tangents;
    for (int k = 0; k < l->n; k++)
        if (!isfinite(l->force[k]))
            return k;
    static const kmp_tangent_block blocks[] = {KMP_R_Q, KMP_R_QD};
    for (size_t b = 0; !l->plain && b < sizeof blocks / sizeof *blocks; b++)
        for (int e = t->start[blocks[b]]; e < t->start[blocks[b] + 1]; e++)
            if (!isfinite(l->d[t->entry[e].source]))
                return t->entry[e].row;
    return -1;
}

/* Names contacts that press, once. A contact that may open or press is an error. */
static kempe_status report_contacts(const kmp_operating *o, const kmp_friction_state *friction)
{
    kempe_context *context = o->system->context;
    kmp_text names = {0};
    const kmp_friction_view *limit = NULL;
    int count = 0;
    for (int i = 0; i < friction->count; i++) {
        const kmp_friction_view *view = &friction->view[i];
        limit = view->limit ? view : limit;
        if (view->contact && view->word != KMP_FRICTION_WORD_SLIPS)
            kmp_text_printf(&names, "%s'%s'", count++ ? ", " : "", view->element->name);
    }
    if (names.s && !limit && !o->warned)
        kmp_log(context, KEMPE_LOG_WARNING,
                count == 1 ? "contact %s presses at the state: small motions leave it closed"
                           : "contacts %s press at the state: small motions leave them closed",
                names.s);
    kmp_text_free(&names);
    if (!limit)
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_FAILED,
                    "contact '%s' just touches: some small motions open it and others press it, so that no linear "
                    "model exists; use another state",
                    limit->element->name);
}

/* Friction that rolls, not at rest: positions are separate states then, which no dependent coordinates are. */
static kempe_status check_rolling(const kmp_operating *o, const kmp_friction_state *friction)
{
    const kempe_system *s = o->system;
    bool moves = false;
    for (int i = 0; i < s->n; i++)
        moves = moves || o->inner_qd[i] != 0;
    for (int i = 0; i < friction->count && moves; i++) {
        const kmp_friction_view *view = &friction->view[i];
        bool sticks = view->word == KMP_FRICTION_WORD_STICKS || view->word == KMP_FRICTION_WORD_SHARES;
        for (int r = 0; r < s->m && sticks; r++)
            if (s->rows[r].of_rates && s->rows[r].closure == view->element->closure)
                return kmp_fail(s->context, KEMPE_E_FAILED,
                                "'%s' is a nonholonomic constraint in motion, where small motions have more states "
                                "than independent coordinates: linearize about a state at rest",
                                view->element->name);
    }
    return KEMPE_OK;
}

/* Friction and contacts have the modes in which a run would begin at the state. */
static kempe_status take_friction(kmp_operating *o, kmp_linear *l)
{
    kmp_friction_state *friction;
    bool none;
    kmp_friction_state_release(l->eval);
    KMP_TRY(kmp_friction_state_new(l->eval, &friction, &none));
    if (none)
        return KEMPE_OK;
    kempe_status status = kmp_friction_state_decide(friction, o->t, o->inner_q, o->inner_qd);
    if (status == KEMPE_OK)
        status = check_rolling(o, friction);
    if (status == KEMPE_OK)
        status = report_contacts(o, friction);
    if (status == KEMPE_OK && o->slides)
        kmp_friction_state_slide(friction);
    if (status == KEMPE_OK) {
        /* Names friction that sticks, once. */
        kmp_text names = {0};
        for (int i = 0; i < friction->count && !o->warned; i++)
            if (!friction->view[i].contact && friction->view[i].word != KMP_FRICTION_WORD_SLIPS)
                kmp_text_printf(&names, "%s'%s'", names.s ? ", " : "", friction->view[i].element->name);
        if (names.s)
            kmp_log(o->system->context, KEMPE_LOG_WARNING,
                    "friction %s sticks at the state: its surfaces do not slide in small motions; --slide of modes, "
                    "linearize and response lets them slide without a force",
                    names.s);
        o->warned = true;
        kmp_text_free(&names);
    }
    kmp_friction_state_free(friction);
    return status;
}

kempe_status kmp_operating_take(kmp_operating *operating, kmp_linear *linear, const int *wish, int wish_count)
{
    if (operating->chart)
        kmp_eval_set_charts(linear->eval, operating->chart);
    KMP_TRY(take_friction(operating, linear));
    KMP_TRY(kmp_linear_choose(linear, operating->t, operating->inner_q, wish, wish_count));
    /* Explains a state that cannot be taken. */
    kempe_status status =
        kmp_linear_at_rates(linear, operating->t, operating->inner_q, operating->inner_qd, !operating->equilibrium);
    kempe_context *context = linear->system->context;
    int k = status == KEMPE_OK ? find_no_number(linear) : -1;
    if (k >= 0)
        return kmp_fail(context, KEMPE_E_FAILED,
                        "the forces along '%s' or their derivatives are not finite: a spring of zero length, a bushing "
                        "at half a turn, or an expression outside its domain; use another state",
                        kmp_model_motion(linear->system->model, k)->name);
    return say_why(context, status);
}
