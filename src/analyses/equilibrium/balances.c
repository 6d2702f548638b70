/* SPDX-License-Identifier: BSD-3-Clause */
/* Searches equilibria from the assembled start and, for a global search, from random starts whose loops are closed.
 * Equal states are merged. */
#include "analyses/equilibrium/balances.h"
#include "analyses/derivatives/delayed_spectrum.h"
#include "analyses/derivatives/sampled_motion.h"
#include "analyses/derivatives/spectrum.h"
#include "analyses/derivatives/switching_state.h"
#include "analyses/equilibrium/balance_friction.h"
#include "analyses/equilibrium/equilibrium_study.h"
#include "analyses/equilibrium/exchange.h"
#include "analyses/equilibrium/friction_at_rest.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/equilibrium/running_state.h"
#include "analyses/parts/doubted_state.h"
#include "analyses/parts/study_print.h"
#include "backend/machine.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/assembly_modes.h"
#include "constraints/closing/mode_watch.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/data/variant.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/reactions.h"
#include "output/samples.h"
#include "studies/simulate/flexible_doubts.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { STARTS = 100, STARTS_OF_LARGE = 25, LARGE = 40 };
#define TWO_PI 6.283185307179586
#define FAR    1.0 /* a translation is sampled within this number of characteristic lengths */

/* -- stability --------------------------------------------------------------------------------------- */

#define ROUNDING 1e-10 /* of a real part, relative to the largest modulus */

const char *kmp_stability_text(kmp_stability_word word)
{
    static const char *const words[] = {[KMP_STABLE] = "stable",
                                        [KMP_NEUTRAL] = "neutral",
                                        [KMP_UNSTABLE] = "unstable",
                                        [KMP_NOT_HELD] = "not held",
                                        [KMP_UNDECIDED] = "undecided"};
    return words[word];
}

/* The index of the 1 that only this eigenvector of a zero has. */
static int own_place(const kmp_spectrum *s, int vector)
{
    int best = 0;
    for (int i = 0; i < s->p; i++) {
        bool own = s->x_re[i + vector * s->p] == 1;
        for (int j = 0; own && j < s->still; j++)
            own = j == vector || s->x_re[i + j * s->p] == 0;
        if (own)
            return i;
        if (fabs(s->x_re[i + vector * s->p]) > fabs(s->x_re[best + vector * s->p]))
            best = i;
    }
    return best;
}

static kempe_status judge_samples(const kmp_linear *l, kmp_stability *out)
{
    kmp_sampled_spectrum s;
    kempe_status status = kmp_sampled_spectrum_init(&s, l);
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(l->system->context);
    if (status == KEMPE_OK) {
        double largest = 0, re, im;
        bool neutral = false;
        for (int k = 0; k < s.count; k++) {
            kmp_sampled_rate(&s, k, &re, &im);
            largest = fmax(largest, hypot(re, im));
        }
        for (int k = 0; k < s.count; k++) {
            kmp_sampled_rate(&s, k, &re, &im);
            out->growing += re > KMP_SAMPLED_STILL * largest;
            neutral = neutral || fabs(re) <= KMP_SAMPLED_STILL * largest;
            if (!(re <= out->re)) {
                out->re = re;
                out->im = im;
            }
        }
        out->word = out->growing > 0 ? KMP_UNSTABLE : neutral ? KMP_NEUTRAL : KMP_STABLE;
    }
    kmp_sampled_spectrum_free(&s);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

kempe_status kmp_stability_judge(const kmp_linear *linear, kmp_stability *stability)
{
    kmp_spectrum s;
    *stability = (kmp_stability){.word = KMP_UNDECIDED, .re = NAN, .im = NAN, .along = stability->along};
    if (linear->p == 0) {
        stability->word = KMP_STABLE;
        return KEMPE_OK;
    }
    if (linear->system->model->delay_count > 0) {
        /* A model with delays has roots without end, of which few are on the right: these are counted. */
        int zeros;
        if (kmp_model_has_samples(linear->system->model) || kmp_samples_in(linear->system->model))
            return KEMPE_OK;
        kempe_status status = kmp_delayed_growing(linear, &stability->growing, &zeros);
        if (status == KEMPE_OK)
            stability->word = stability->growing > 0 ? KMP_UNSTABLE : zeros > 0 ? KMP_NEUTRAL : KMP_STABLE;
        else
            stability->growing = 0;
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    }
    if (kmp_samples_in(linear->system->model))
        return judge_samples(linear, stability);
    kempe_status status = kmp_linear_spectrum(linear, &s);
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(linear->system->context);
    if (status != KEMPE_OK)
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    double largest = 0;
    for (int k = s.zeros; k < s.count; k++)
        largest = fmax(largest, hypot(s.re[k], s.im[k]));
    for (int k = s.zeros; k < s.count; k++) {
        stability->growing += s.re[k] > ROUNDING * largest;
        if (!(s.re[k] <= stability->re)) {
            stability->re = s.re[k];
            stability->im = s.im[k];
        }
    }
    stability->still = s.still;
    for (int k = 0; k < s.still; k++)
        stability->along[k] = linear->part.u[own_place(&s, k)];
    stability->secular = s.secular;
    if (s.secular) { /* rounding may have split it */
        stability->growing -=
            stability->growing > 0 && stability->re <= KMP_SPECTRUM_EQUAL * largest ? stability->growing : 0;
        stability->re = 0;
        stability->im = s.secular_at < s.zeros ? 0 : s.im[s.secular_at];
    }
    stability->word = stability->growing > 0 || stability->secular ? KMP_UNSTABLE
                      : s.zeros > 0                                ? KMP_NEUTRAL
                                                                   : KMP_STABLE;
    kmp_spectrum_free(&s);
    return KEMPE_OK;
}

/* -- storage ----------------------------------------------------------------------------------------- */

static double *copy(kempe_equilibrium *e, int count, const double *from)
{
    double *to = KMP_ARENA_NEW(&e->arena, double, count);
    for (int k = 0; to && from && k < count; k++)
        to[k] = from[k];
    return to;
}

/* The parameters of an exchange are inputs of the loads. */
kempe_status kmp_balance_add_loads(kempe_equilibrium *e, const kmp_linear *linear, const double *lambda, kmp_balance *b)
{
    const kempe_system *s = linear->eval->system;
    const double *zero = KMP_ARENA_NEW(&e->arena, double, s->n);
    KMP_TRY(kmp_made(s->context, zero));
    if (!e->has_loads)
        KMP_TRY(kmp_all_loads_init(&e->loads, s));
    e->has_loads = true;
    kmp_formulas_renew(&e->loads.formulas, s->parameters);
    const kmp_instant at = {
        .t = linear->t, .q = b->q, .qd = b->qd, .qdd = zero, .lambda = lambda, .inputs = &linear->eval->inputs};
    const int count = kmp_all_loads_count(&e->loads, s->model);
    b->not_unique = "";
    b->reaction = KMP_ARENA_NEW(&e->arena, double, count);
    KMP_TRY(kmp_made(s->context, b->reaction));
    if (count > 0)
        memcpy(b->reaction, kmp_all_loads_at(&e->loads, &at), (size_t)count * sizeof *b->reaction);
    return KEMPE_OK;
}

kempe_status kmp_balance_add_outputs(kempe_equilibrium *e, const kmp_linear *linear, kmp_balance *b)
{
    const kempe_system *s = linear->eval->system;
    const int width = kmp_outputs_width(s->model);
    if (width == 0)
        return KEMPE_OK;
    if (s->parameters)
        kmp_eval_renew_parameters(linear->eval);
    b->shown = KMP_ARENA_NEW(&e->arena, double, width);
    KMP_TRY(kmp_made(s->context, b->shown));
    memcpy(b->shown, kmp_eval_shown(linear->eval, linear->t, linear->q, linear->qd, linear->qdd, b->lambda),
           (size_t)width * sizeof *b->shown);
    return KEMPE_OK;
}

/* The loads of a balance of least norm, also among its outputs. */
static kempe_status share_loads(kempe_equilibrium *e, kmp_evaluator *eval, const double *zero, kmp_balance *b)
{
    const kempe_model *model = e->system->model;
    const int count = KMP_LOAD_VALUES * (model->closure_count + e->loads.joints);
    const double *before = copy(e, count, b->reaction);
    KMP_TRY(kmp_made(e->system->context, before));
    KMP_TRY(kmp_least_norm_loads(eval, 0, b->q, e->loads.joints, e->loads.joint, b->reaction));
    const kmp_instant at = kmp_instant_of(eval, 0, b->q, b->qd, zero, b->lambda);
    const double *bearings = e->loads.bearing_count > 0 ? kmp_all_loads_bearings(&e->loads, &at, b->reaction) : NULL;
    if (b->shown && !kmp_loads_in_outputs(&e->loads, model, before, b->reaction, bearings, b->shown))
        return kmp_fail(e->system->context, KEMPE_E_FAILED,
                        "loads of least norm are not known for the forces of this model; omit --loads");
    return KEMPE_OK;
}

/* Names conditions that end runs and tables that each equilibrium leaves, and loads that redundant constraints share,
 * and shares them as requested.
 */
static kempe_status look_again(kempe_equilibrium *e)
{
    const kempe_model *model = e->system->model;
    const bool needed = model->closure_count > 0 || model->table_count > 0 || e->system->events.count > 0;
    kmp_evaluator *eval = needed ? kmp_eval_new(e->system, "tape") : NULL;
    kempe_status status = eval || !needed ? KEMPE_OK : KEMPE_E_MEMORY;
    const double *zero = KMP_ARENA_NEW(&e->arena, double, e->system->n);
    for (int k = 0; eval && status == KEMPE_OK && k < e->count; k++) {
        kmp_balance *b = &e->balance[k];
        const double t[2] = {0};
        const double *const q[2] = {b->q, b->q};
        const char *text = NULL;
        kmp_shared_loads found = {0};
        if (zero)
            kmp_eval_doubt_state(eval, 0, b->q, b->qd, zero, b->lambda, true, true,
                                 kmp_eval_shown(eval, 0, b->q, b->qd, zero, b->lambda));
        if (e->least_norm)
            status = zero ? share_loads(e, eval, zero, b) : kmp_fail_memory(e->system->context);
        if (status == KEMPE_OK)
            status =
                kmp_shared_loads_between(eval, t, q, e->loads.joints, e->loads.joint, b->reaction, &e->arena, &found);
        if (status == KEMPE_OK)
            status = kmp_report_shared_loads(e->system, &found, e->least_norm, &e->arena, &text);
        b->not_unique = text;
        b->shared = found;
    }
    kmp_eval_free(eval);
    return status;
}

/* -- rigid contacts ---------------------------------------------------------------------------------- */

const char *kmp_contact_text(kmp_contact_word word)
{
    static const char *const words[] = {[KMP_CONTACT_OPEN] = "open",
                                        [KMP_CONTACT_PRESSES] = "presses",
                                        [KMP_CONTACT_TOUCHES] = "touches",
                                        [KMP_CONTACT_SHARES] = "shares"};
    return words[word];
}

/* Tells what small motions, or other forces, depend on. */
static void name_contacts(const kempe_equilibrium *e, const kmp_balance *b, kmp_contact_word word, const char *what)
{
    kmp_text names = {0};
    int count = 0;
    for (int i = 0; i < b->contact_count; i++)
        if (b->contact[i].word == word)
            kmp_text_printf(&names, "%s'%s'", count++ ? ", " : "", b->contact[i].element->name);
    if (names.s)
        kmp_log(e->system->context, KEMPE_LOG_WARNING, "contact%s %s: %s", count == 1 ? "" : "s", names.s, what);
    kmp_text_free(&names);
}

/* Adds the rigid contacts at the last state of `linear`, without their forces. */
static kempe_status look_at_contacts(kempe_equilibrium *equilibrium, kmp_linear *linear, kmp_balance *balance)
{
    const kmp_friction_state *f = equilibrium->friction;
    kempe_context *context = equilibrium->system->context;
    if (!kmp_model_has_contacts(equilibrium->system->model))
        return KEMPE_OK;
    double *place = KMP_ARENA_NEW(&equilibrium->arena, double, f->count);
    balance->contact = KMP_ARENA_NEW(&equilibrium->arena, kmp_balance_contact, f->count);
    KMP_TRY(kmp_made(context, place && balance->contact));
    kmp_friction_state_measure(equilibrium->friction, linear->t, linear->q, place);
    for (int i = 0; i < f->count; i++) {
        kmp_held_contact how = kmp_friction_state_closed(f, i);
        if (f->view[i].contact)
            balance->contact[balance->contact_count++] = (kmp_balance_contact){.element = f->view[i].element,
                                                                               .size = f->view[i].size,
                                                                               .gap = place[i],
                                                                               .closed = how != KMP_HELD_NOT,
                                                                               .shares = how == KMP_HELD_BY_OTHERS};
    }
    return KEMPE_OK;
}

/* Adds their forces, which are multipliers of the balance. Warns of contacts whose force is zero, or not unique. */
static void add_contacts(kempe_equilibrium *equilibrium, kmp_balance *balance)
{
    const kempe_system *s = equilibrium->system;
    for (int i = 0; i < balance->contact_count; i++) {
        int row = 0; /* of its closure */
        while (row + 1 < s->m && s->rows[row].closure != balance->contact[i].element->closure)
            row++;
        balance->contact[i].force = balance->lambda[row];
    }
    double most = 0;
    for (int i = 0; i < balance->contact_count; i++)
        most = fmax(most, fabs(balance->contact[i].force) * balance->contact[i].size);
    double least = KMP_CONTACT_NONE * fmax(most, balance->work);
    for (int i = 0; i < balance->contact_count; i++) {
        kmp_balance_contact *c = &balance->contact[i];
        bool touches = c->closed ? fabs(c->force) * c->size <= least : c->gap <= KMP_TOUCH_NEAR * c->size;
        c->word = c->shares   ? KMP_CONTACT_SHARES
                  : touches   ? KMP_CONTACT_TOUCHES
                  : c->closed ? KMP_CONTACT_PRESSES
                              : KMP_CONTACT_OPEN;
    }
    if (equilibrium->count > 0)
        return;
    name_contacts(equilibrium, balance, KMP_CONTACT_TOUCHES,
                  "surfaces touch here without a force; small motions open or close them");
    name_contacts(equilibrium, balance, KMP_CONTACT_SHARES,
                  "contact forces are not unique, because the contacts are redundant; one solution is shown");
}

/* -- a balance ---------------------------------------------------------------------------------------- */

/* Stability on the sides of conditions that change at a state. */
typedef struct sides {
    kmp_stability of;   /* of the side that says most */
    int *along;         /* room for another one */
    bool any, left;     /* sides were visited; a motion leaves on one of them */
    bool grows, open;   /* motions of the last side grow; the sides do not decide */
    const char *change; /* a condition that differs */
} sides;

/* A motion that leaves decides. Otherwise sides have to agree, and growth counts only where forces are in balance. */
static kempe_status judge_side(void *user, const kmp_linear *linear, const kmp_side *side)
{
    sides *x = user;
    kmp_stability own = {.along = x->along};
    if (x->left)
        return KEMPE_OK;
    KMP_TRY(kmp_stability_judge(linear, &own));
    if (side->leaves && !side->balanced)
        own = (kmp_stability){.word = KMP_UNSTABLE, .re = NAN, .im = NAN, .along = x->along, .change = side->condition};
    const bool grows = own.word == KMP_UNSTABLE;
    x->left = side->leaves;
    x->open = x->open || (x->any && grows != x->grows) || (grows && !side->balanced);
    x->grows = grows;
    x->change = side->condition;
    if (x->left || !x->any || own.word > x->of.word) {
        x->along = x->of.along;
        x->of = own;
    }
    x->any = true;
    return KEMPE_OK;
}

/* Stability is judged next to a state whose own equations belong to none of its sides, and on all sides that differ. */
static kempe_status judge(kempe_equilibrium *e, kmp_linear *linear, kmp_stability *stability)
{
    const int n = linear->n;
    const double *q = copy(e, n, linear->q), *qd = copy(e, n, linear->qd);
    sides x = {.of.along = KMP_ARENA_NEW(&e->arena, int, linear->p), .along = KMP_ARENA_NEW(&e->arena, int, linear->p)};
    KMP_TRY(kmp_made(e->system->context, !e->arena.failed));
    KMP_TRY(kmp_linear_settle_switches(linear, true, false));
    KMP_TRY(kmp_stability_judge(linear, stability));
    KMP_TRY(kmp_linear_each_side(linear, judge_side, &x));
    if (x.any && x.open && !x.left) {
        *stability =
            (kmp_stability){.word = KMP_UNDECIDED, .re = NAN, .im = NAN, .along = stability->along, .change = x.change};
        kmp_doubt(e->system->context,
                  "the stability is not known, because motions grow on some sides of a condition that changes at this "
                  "state: %s",
                  x.change);
    } else if (x.any) {
        *stability = x.of;
    }
    return memcmp(q, linear->q, (size_t)n * sizeof *q) == 0 ? KEMPE_OK
                                                            : kmp_linear_at_rates(linear, linear->t, q, qd, false);
}

/* Forces, coordinates without effect and stability. */
static kempe_status examine(kempe_equilibrium *e, kmp_linear *linear, kmp_balance *b)
{
    KMP_TRY(e->start ? KEMPE_OK : kmp_balance_add_loads(e, linear, b->lambda, b));
    b->stability.along = KMP_ARENA_NEW(&e->arena, int, linear->p);
    b->idle = KMP_ARENA_NEW(&e->arena, int, linear->p);
    b->idle_count = b->idle ? kmp_equilibrium_idle(linear, b->idle) : -1;
    KMP_TRY(kmp_made(e->system->context, b->idle_count >= 0 && !e->arena.failed));
    KMP_TRY(kmp_averaged_judge(e->averaged, linear));
    return judge(e, linear, &b->stability);
}

/* The multipliers of l's state, with the force of friction. */
static double *copy_lambda(kempe_equilibrium *e, kmp_linear *linear)
{
    const kempe_system *s = e->system;
    double *lambda = copy(e, s->m, linear->lambda), *change = KMP_ARENA_NEW(&e->arena, double, s->events.count);
    if (lambda && change && kmp_model_friction_count(s->model) > 0)
        kmp_eval_show_friction(linear->eval, linear->t, linear->q, linear->qd, linear->qdd, lambda, change);
    return lambda;
}

/* The state in its charts, for a motion that begins there. */
static kempe_status keep_inner(kempe_equilibrium *e, const kmp_linear *linear)
{
    const kempe_system *s = e->system;
    e->inner_q = copy(e, s->n, linear->q);
    e->inner_qd = copy(e, s->n, linear->qd);
    e->chart = copy(e, KMP_CHART_SIZE * s->chart_count, linear->eval->chart);
    return kmp_made(s->context, !e->arena.failed);
}

/* Stores l's state, in its charts, if it is a new one. `near` (n): angles are stored within half a turn of these. */
static kempe_status keep(kempe_equilibrium *e, kmp_linear *linear, const kmp_search *search, const double *near)
{
    const kempe_system *s = e->system;
    int n = s->n;
    double *q = KMP_ARENA_NEW(&e->arena, double, n), *qd = KMP_ARENA_NEW(&e->arena, double, n);
    KMP_TRY(kmp_made(s->context, q && qd));
    /* The state in the user's coordinates. */
    memcpy(q, linear->q, (size_t)n * sizeof *q);
    memcpy(qd, linear->qd, (size_t)n * sizeof *qd);
    if (s->chart_count > 0)
        kmp_charts_show(s, linear->eval->chart, near, q, qd);
    for (int k = 0; k < e->count; k++)
        if (kmp_state_same(s, KMP_SAME_STATE, e->balance[k].idle_count, e->balance[k].idle, e->balance[k].q, q)) {
            e->balance[k].hits++;
            return KEMPE_OK;
        }
    if (e->count == KMP_MOST_BALANCES) {
        e->many = true;
        return KEMPE_OK;
    }
    kmp_balance *b = &e->balance[e->count];
    *b = (kmp_balance){.q = q, .qd = qd, .residual = search->residual, .hits = 1};
    for (int k = 0; e->count > 0 && k < n; k++)
        if (s->model->motions[k].rotation && kmp_chart_of(s, k) < 0)
            q[k] = near[k] + remainder(q[k] - near[k], TWO_PI);
    b->lambda = copy_lambda(e, linear);
    (void)kmp_descent_measure(linear, linear->unit, &b->work);
    b->potential = kmp_eval_potential(linear->eval, linear->t, linear->q);
    b->freed = copy(e, e->freed_count, e->exchange ? e->exchange->value : NULL);
    for (int i = 0, f = 0; !e->exchange && b->freed && i < e->rate_count; i++)
        if (e->rates[i].how == KMP_RATE_FREED)
            b->freed[f++] = e->rates[i].rate;
    b->iterations = search->iterations;
    b->exchanges = search->exchanges;
    b->residuals = copy(e, b->iterations, search->residuals);
    b->steps = copy(e, b->iterations, search->steps);
    KMP_TRY(kmp_made(s->context, !e->arena.failed));
    if (e->start && s->chart_count > 0)
        KMP_TRY(keep_inner(e, linear));
    KMP_TRY(e->start ? kmp_balance_name_resting(e, linear) : KEMPE_OK);
    KMP_TRY(e->state_alone ? KEMPE_OK : examine(e, linear, b));
    KMP_TRY(look_at_contacts(e, linear, b));
    KMP_TRY(e->state_alone || e->start ? KEMPE_OK : kmp_balance_add_outputs(e, linear, b));
    KMP_TRY(e->state_alone || e->start ? KEMPE_OK : kmp_balance_add_friction(e, linear, b));
    add_contacts(e, b);
    e->count++;
    return KEMPE_OK;
}

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status read_options(kempe_equilibrium *e, const kempe_equilibrium_options *options)
{
    e->newton = options->newton;
    e->all = options->global;
    e->stick = options->stick;
    KMP_TRY(kmp_steady_read(e->requested->model, options->rates, &e->arena, &e->rate_count, &e->rates));
    if (e->stick && e->all)
        return kmp_fail(e->requested->context, KEMPE_E_ARGUMENT,
                        "--global cannot be combined with --stick: friction sticks where the start has it");
    KMP_TRY(kmp_load_share_read(e->requested->context, options->loads, &e->least_norm));
    if (!(options->hold || options->target || options->solve_for))
        return KEMPE_OK;
    if (e->least_norm)
        return kmp_fail(e->requested->context, KEMPE_E_ARGUMENT,
                        "--loads cannot be combined with --hold, --target and --solve-for: set what they find with "
                        "--set, and omit them");
    KMP_TRY(kmp_exchange_new(e->requested, options->hold, options->target, options->solve_for, e->rates, e->rate_count,
                             &e->exchange));
    e->system = e->exchange->system;
    if (!e->all)
        return KEMPE_OK;
    return kmp_fail(e->requested->context, KEMPE_E_ARGUMENT,
                    "--global cannot be combined with --hold, --target and --solve-for: omit them, or omit --global");
}

/* Names and units of values that are solved for in addition to the state. */
static kempe_status name_freed(kempe_equilibrium *e)
{
    int most = e->exchange ? e->exchange->free_count : e->rate_count;
    e->freed_name = KMP_ARENA_NEW(&e->arena, const char *, most);
    e->freed_unit = KMP_ARENA_NEW(&e->arena, const char *, most);
    KMP_TRY(kmp_made(e->system->context, !e->arena.failed));
    if (e->exchange) {
        const kmp_exchange *x = e->exchange;
        e->freed_count = x->free_count;
        e->freed_name = x->name;
        for (int k = 0; k < x->free_count; k++) {
            int rate = k < x->parameter_count ? -1 : e->rates[x->rate[k - x->parameter_count]].coordinate;
            e->freed_unit[k] = rate < 0 ? kmp_quantity_unit_of(e->requested, x->name[k])
                                        : kmp_quantity_unit(e->system, KMP_QUANTITY_QD, rate);
        }
        return kmp_made(e->system->context, !e->arena.failed);
    }
    for (int k = 0; k < e->rate_count; k++) {
        if (e->rates[k].how != KMP_RATE_FREED)
            continue;
        e->freed_unit[e->freed_count] = kmp_quantity_unit(e->system, KMP_QUANTITY_QD, e->rates[k].coordinate);
        e->freed_name[e->freed_count++] =
            kmp_arena_printf(&e->arena, "qd(%s)", e->system->model->motions[e->rates[k].coordinate].name);
    }
    return e->arena.failed ? kmp_fail_memory(e->system->context) : KEMPE_OK;
}

/* -- finding ----------------------------------------------------------------------------------------- */

static kempe_status search_from(kempe_equilibrium *e, kmp_linear *linear, const kempe_assembly *start, double *q,
                                kmp_search *search)
{
    memcpy(q, start->inner_q ? start->inner_q : start->q, (size_t)e->system->n * sizeof *q);
    if (start->chart)
        kmp_eval_set_charts(linear->eval, start->chart);
    if (e->friction && e->stick) {
        /* Closes the contacts that touch at the start, where their friction has its place. */
        kmp_contact_set *contacts;
        kempe_status status = kmp_contact_set_begin(linear, 0, q, false, &e->arena, &contacts);
        kmp_contact_set_end(contacts);
        KMP_TRY(status);
        KMP_TRY(kmp_friction_state_lock(e->friction, 0, q, NULL, NULL));
    }
    KMP_TRY(kmp_equilibrium_or_steady(linear, 0, q, start->inner_q ? start->inner_qd : start->qd, search));
    e->rate_count = search->rate_count;
    return KEMPE_OK;
}

/* Searches an inverse equilibrium: from the start, so that the mechanism keeps its assembly mode; where that fails,
 * from the equilibrium without exchange, if there is one. The reason of a failure is taken from the search from the
 * start.
 */
static kempe_status find_exchanged(kempe_equilibrium *e, kmp_linear *linear, const kempe_assembly *start, double *q,
                                   kmp_search *search)
{
    kempe_context *context = e->system->context;
    kmp_exchange_begin(e->exchange, linear, e->rates);
    kempe_status status = search_from(e, linear, start, q, search);
    if (status != KEMPE_E_FAILED)
        return status;
    char *why = kmp_strdup(kempe_context_message(context));
    KMP_TRY(kmp_made(context, why));
    kmp_context_clear(context);
    kmp_exchange_begin(e->exchange, linear, e->rates);
    kmp_search plain = {.rates = e->rates, .rate_count = e->rate_count, .quiet = true};
    status = search_from(e, linear, start, q, &plain);
    if (status == KEMPE_OK)
        status = kmp_equilibrium_find(linear, 0, q, search);
    if (status == KEMPE_E_FAILED) {
        kmp_context_clear(context);
        status = kmp_fail(context, status, "%s", why);
    }
    kmp_free(why);
    return status;
}

/* Warns where the mechanism with its held coordinates is assembled otherwise than at the start. */
static kempe_status compare_modes(kempe_equilibrium *e, const kempe_assembly *start)
{
    bool *held = KMP_ARENA_NEW(&e->arena, bool, e->system->n);
    KMP_TRY(kmp_made(e->system->context, held));
    for (int k = 0; k < e->exchange->target_count; k++)
        if (e->exchange->target[k].coordinate >= 0)
            held[e->exchange->target[k].coordinate] = true;
    kmp_mode_watch *watch = kmp_mode_watch_new(e->system, held, 0, start->q, NULL);
    (void)(watch && kmp_mode_watch_next(watch, 0, start->q));
    const kmp_loop_block *changed = watch ? kmp_mode_watch_next(watch, 0, e->balance[0].q) : NULL;
    if (changed)
        kmp_log(e->system->context, KEMPE_LOG_WARNING,
                "the equilibrium is in another assembly mode than the start: '%s' lies on the other side of a singular "
                "position; give a start nearer to the equilibrium that you want",
                e->system->model->motions[changed->columns[0]].name);
    kmp_mode_watch_free(watch);
    return KEMPE_OK;
}

static kempe_status find_first(kempe_equilibrium *e, kmp_linear *linear, const kempe_assembly *start)
{
    kmp_search search = {.rates = e->rates,
                         .rate_count = e->rate_count,
                         .newton = e->newton,
                         .exchange = e->exchange,
                         .warned = e->state_alone};
    double *q = KMP_ARENA_NEW(&e->arena, double, e->system->n);
    KMP_TRY(kmp_made(e->system->context, q));
    KMP_TRY(e->exchange ? find_exchanged(e, linear, start, q, &search) : search_from(e, linear, start, q, &search));
    KMP_TRY(name_freed(e));
    KMP_TRY(keep(e, linear, &search, start->q));
    KMP_TRY(e->exchange ? compare_modes(e, start) : KEMPE_OK);
    KMP_TRY(search.rate_count > 0 ? kmp_operating_check(linear, &search) : KEMPE_OK);
    e->from_start = true;
    return KEMPE_OK;
}

/* -- from random starts ------------------------------------------------------------------------------- */

/* Searches from the closed state of a random start. Every second search uses only Newton's method, which also finds
 * unstable equilibria.
 */
static kempe_status try_start(kempe_equilibrium *e, kmp_linear *l, const kempe_assembly *a, double *q,
                              const double *near)
{
    kmp_search search = {.rates = e->rates, .rate_count = e->rate_count, .newton = e->starts % 2 == 0, .quiet = true};
    kmp_charts_reset(e->system, l->eval->chart);
    if (a->chart)
        memcpy(l->eval->chart, a->chart, (size_t)(KMP_CHART_SIZE * e->system->chart_count) * sizeof(double));
    kmp_eval_set_charts(l->eval, l->eval->chart);
    memcpy(q, a->inner_q ? a->inner_q : a->q, (size_t)e->system->n * sizeof *q);
    kmp_friction_state_open(l->eval);
    kempe_status status = kmp_equilibrium_find(l, 0, q, &search);
    if (status == KEMPE_OK) {
        int from = 0;
        e->found++;
        if (kmp_eval_next_end(l->eval, KMP_ENDS_OF_MODEL, 0, l->q, l->qd, l->qdd, l->lambda, &from) < 0)
            return keep(e, l, &search, near);
        e->ended++;
        return KEMPE_OK;
    }
    if (status != KEMPE_E_FAILED && status != KEMPE_STOPPED)
        return status;
    kmp_context_clear(e->system->context); /* warnings of equilibria found earlier are kept elsewhere */
    return KEMPE_OK;
}

/* Searches from random starts; coordinates that nothing depends on, and coordinates that move steadily, have their
 * start values. */
static kempe_status sample(kempe_equilibrium *e, kmp_linear *linear, const kempe_assembly *start, int seed)
{
    int n = e->system->n, starts = n > LARGE ? STARTS_OF_LARGE : STARTS;
    double *guess = KMP_ARENA_NEW(&e->arena, double, n);
    bool *still = KMP_ARENA_NEW(&e->arena, bool, n);
    KMP_TRY(kmp_made(e->system->context, guess && still));
    /* Coordinates that nothing depends on, at the current equilibrium, and coordinates that move steadily. */
    for (int k = 0; e->count > 0 && k < e->balance[0].idle_count; k++)
        still[e->balance[0].idle[k]] = true;
    for (int k = 0; k < e->rate_count; k++)
        still[e->rates[k].coordinate] = true;
    kmp_random_starts random = {e->system, start->q, still, FAR, guess, (unsigned)seed, 0, 0};
    while (e->starts < starts && !e->many && !kmp_interrupted(e->system->context)) {
        kempe_assembly *a = NULL;
        kempe_status status = kmp_random_starts_next(&random, &a);
        e->starts = random.starts;
        e->closed = random.closed;
        kmp_progress(e->system->context, KMP_PROGRESS_STUDY, e->starts, starts, "starts");
        if (a)
            status = try_start(e, linear, a, guess, start->q);
        kempe_assembly_free(a);
        if (status != KEMPE_OK)
            return status;
    }
    /* In the order of the states; one from the start stays first. */
    int first = e->from_start ? 1 : 0;
    for (int i = first + 1; i < e->count; i++) {
        kmp_balance moved = e->balance[i];
        int k = i;
        for (; k > first && kmp_state_before(e->system, KMP_SAME_STATE, moved.q, e->balance[k - 1].q); k--)
            e->balance[k] = e->balance[k - 1];
        e->balance[k] = moved;
    }
    return KEMPE_OK;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static kempe_status find(kempe_equilibrium *e, const kempe_equilibrium_options *options)
{
    kempe_assembly *own = NULL;
    const kempe_assembly *start = e->start;
    kmp_linear linear = {0};
    bool none;
    kempe_status status = KEMPE_OK;
    if (!start || start->system != e->system) {
        status = kmp_assembly_as_given(e->system, &own);
        start = own;
    }
    if (status == KEMPE_OK)
        status = kmp_linear_init(&linear, e->system, kmp_backend_default());
    if (status == KEMPE_OK)
        status = kmp_friction_state_new(linear.eval, &e->friction, &none);
    if (status == KEMPE_OK)
        status = find_first(e, &linear, start);
    if (e->all && (status == KEMPE_OK || (status == KEMPE_E_FAILED && linear.eval))) {
        char *why = kmp_strdup(kempe_context_message(e->system->context));
        status = why ? sample(e, &linear, start, options->seed > 0 ? options->seed : 1)
                     : kmp_fail_memory(e->system->context);
        if (status == KEMPE_OK && e->count == 0)
            status = kmp_fail(e->system->context, KEMPE_E_FAILED, "%s; and none is found from %d random starts", why,
                              e->starts);
        kmp_free(why);
    }
    kmp_friction_state_free(e->friction);
    kmp_linear_free(&linear);
    kempe_assembly_free(own);
    return status;
}

static const double *state_of(const void *equilibrium, int k)
{
    return ((const kempe_equilibrium *)equilibrium)->balance[k].q;
}

static kempe_status search(kempe_equilibrium *e, const kempe_system *system, const kempe_equilibrium_options *options)
{
    const kempe_status status = kmp_averaged_new(system, &e->averaged);
    e->given = system;
    e->requested = e->system = kmp_averaged_system(e->averaged, system);
    KMP_TRY(status);
    KMP_TRY(read_options(e, options));
    return find(e, options);
}

static kempe_status make(const kempe_system *system, const kempe_equilibrium_options *options, bool state_alone,
                         kempe_equilibrium **equilibrium)
{
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_equilibrium, e);
    e->state_alone = state_alone;
    kempe_status status = search(e, system, options);
    if (status == KEMPE_OK && !state_alone)
        status = look_again(e);
    if (!state_alone)
        kmp_doubt_deflections(system, e->count, state_of, e);
    e->warnings = kmp_context_warnings(system->context);
    e->status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_OR_FREE(status, equilibrium, e, kempe_equilibrium_free);
}

kempe_status kempe_equilibrium_new(const kempe_system *system, const kempe_equilibrium_options *options,
                                   kempe_equilibrium **equilibrium)
{
    KMP_WANTED_BOTH(system, equilibrium);
    KMP_OPTIONS(system->context, kempe_equilibrium_options, options);
    return make(system, options, false, equilibrium);
}

kempe_status kmp_equilibrium_states_new(const kempe_system *system, bool newton, kempe_equilibrium **equilibrium)
{
    const kempe_equilibrium_options options = {.size = sizeof options, .newton = newton};
    return make(system, &options, true, equilibrium);
}

kempe_status kmp_equilibrium_from(const kempe_system *system, const char *rates, const kempe_assembly *start,
                                  kempe_equilibrium **equilibrium)
{
    const kempe_equilibrium_options options = {.size = sizeof options, .rates = rates};
    KMP_MAKE(system->context, kempe_equilibrium, e);
    e->start = start;
    const kempe_status status = search(e, system, &options);
    return KMP_GIVE_OR_FREE(status, equilibrium, e, kempe_equilibrium_free);
}

KMP_FREES(kempe_equilibrium, equilibrium, kmp_exchange_free(equilibrium->exchange),
          kmp_averaged_free(equilibrium->averaged), kmp_free(equilibrium->warnings),
          kmp_all_loads_free(&equilibrium->loads), kmp_arena_free(&equilibrium->arena))

/* -- results ----------------------------------------------------------------------------------------- */

KMP_GETTER_AT(const char *kempe_equilibrium_loads_not_unique(const kempe_equilibrium *equilibrium, int k), equilibrium,
              k, equilibrium->count, equilibrium->balance[k].not_unique, "")
KMP_GETTER(int kempe_equilibrium_count(const kempe_equilibrium *equilibrium), equilibrium, equilibrium->count, 0)

int kempe_equilibrium_is_stable(const kempe_equilibrium *equilibrium, int k)
{
    KMP_GIVEN(equilibrium && k >= 0 && k < equilibrium->count, -1);
    kmp_stability_word word = equilibrium->balance[k].stability.word;
    return word == KMP_UNDECIDED ? -1 : word < KMP_UNSTABLE;
}

KMP_GETTER_AT(const char *kempe_equilibrium_stability(const kempe_equilibrium *equilibrium, int k), equilibrium, k,
              equilibrium->count, kmp_stability_text(equilibrium->balance[k].stability.word), "")
