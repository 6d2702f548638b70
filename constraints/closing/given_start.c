/* SPDX-License-Identifier: BSD-3-Clause */
/* A model with the start that a caller gives. The loops are closed here, on a system of only the closures: independent
 * coordinates that are given keep their values, and the others follow. The new model has the closed position as its
 * start, so that every computation assembles there. */
#include "base/context.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/partition/partition.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include <kempe/settings.h>
#include <math.h>

enum { PUSHES = 4, MOST_NAMED = 5 };
/* Given values that follow from other given ones may be off by this much: rad or characteristic lengths; of rates,
 * relative to the fastest. */
#define ROUNDED 1e-3

typedef struct work {
    kempe_model *model;   /* with the start that is made */
    kempe_system *system; /* of its closures */
    kempe_assembly *a;    /* the last attempt */
    kmp_arena arena;
    const double *given;  /* NaN: not given */
    double *q;            /* the guess, then the closed position */
    bool *fixed, *liked;  /* n: kept in the next attempt; as independent ones */
    bool *chosen, *usual; /* n: independent; without given values */
    bool *kept;           /* n: independent and not given: to start as in the model */
    int *u;
    int n, rank, pushes;
} work;

static bool is_given(const double *values, int k)
{
    return values && !isnan(values[k]);
}

/* -- where the others begin ---------------------------------------------------------------------------- */

/* The position in which the model itself starts, or its guess where that does not close. */
static kempe_status take_own_start(work *w, const kempe_model *model)
{
    kempe_system *system = NULL;
    kempe_assembly *a = NULL;
    KMP_TRY(kmp_system_of_closures(model, &system));
    kempe_status status = kmp_assemble_start(system, &a);
    const kmp_rounding *rounding = kmp_rounding_of(system);
    w->rank = rounding ? rounding->rank : 0;
    w->pushes = status == KEMPE_OK && a->closed ? 0 : PUSHES;
    for (int k = 0; status == KEMPE_OK && k < w->n; k++)
        w->q[k] = a->closed ? a->q[k] : model->start.q[k].value;
    kempe_assembly_free(a);
    kempe_system_free(system);
    return status;
}

/* -- closing ------------------------------------------------------------------------------------------- */

/* The independent coordinates at the last position of an evaluator, with as many liked ones as possible. -1: no memory.
 */
static int choose_liked(work *w, const kmp_evaluator *eval)
{
    const int count = kmp_partition_prefer(w->system, eval->jacobian, w->liked, w->u);
    for (int k = 0; k < w->n; k++)
        w->chosen[k] = false;
    for (int k = 0; k < count; k++)
        w->chosen[w->u[k]] = true;
    return count;
}

/* Adds coordinate k to the liked ones, if they are then still independent. False: no memory. */
static bool like(work *w, const kmp_evaluator *eval, int k)
{
    w->liked[k] = true;
    if (choose_liked(w, eval) < 0)
        return false;
    bool all = true;
    for (int i = 0; i < w->n; i++)
        all = all && (w->chosen[i] || !w->liked[i]);
    w->liked[k] = all;
    return true;
}

/* Likes deformations that hold, and the coordinates that are independent in runs of the model. False: no memory. */
static bool like_usual(work *w, const kmp_evaluator *eval)
{
    const kempe_model *model = w->model;
    kmp_partition part = {0};
    for (int k = 0; k < w->n; k++)
        w->liked[k] = model->start.undeformed && model->start.undeformed[k];
    for (int k = 0; k < model->run.independent_count; k++)
        w->liked[model->run.independent[k]] = true;
    if (model->run.independent_count > 0)
        return true;
    const kempe_status status = kmp_partition_init(&part, w->system, eval->jacobian, NULL, 0);
    for (int k = 0; status == KEMPE_OK && k < part.p; k++)
        w->liked[part.u[k]] = true;
    kmp_partition_free(&part);
    kmp_context_clear(model->context);
    return status != KEMPE_E_MEMORY;
}

/* First the given ones, then the usual ones. False: no memory. */
static bool choose_among(work *w, const kmp_evaluator *eval)
{
    if (!like_usual(w, eval))
        return false;
    const int count = choose_liked(w, eval);
    int kept = 0;
    for (int k = 0; k < w->n; k++) {
        w->usual[k] = w->chosen[k];
        w->liked[k] = w->chosen[k] && is_given(w->given, k);
        kept += w->liked[k];
    }
    for (int turn = 0; count >= 0 && turn < 2; turn++)
        for (int k = 0; k < w->n && kept < count; k++) {
            const bool offered = !w->liked[k] && (turn == 0 ? is_given(w->given, k) : w->usual[k]);
            if (offered && !like(w, eval, k))
                return false;
            kept += offered && w->liked[k];
        }
    return count >= 0 && choose_liked(w, eval) >= 0;
}

static kempe_status choose(work *w, const double *q)
{
    kmp_evaluator *eval = kmp_eval_new_of_closures(w->system);
    if (!eval)
        return KEMPE_E_MEMORY;
    kmp_eval_closure(eval, 0, q);
    const bool chosen = choose_among(w, eval);
    kmp_eval_free(eval);
    return kmp_made(w->model->context, chosen);
}

static kempe_status attempt(work *w, int pushes)
{
    const kmp_guess guess = {w->q, w->fixed, pushes, false, w->rank};
    kempe_assembly_free(w->a);
    w->a = NULL;
    return kmp_assemble_from(w->system, &guess, &w->a);
}

/* Given coordinates that are independent keep their values. The other independent ones, and coordinates that the model
 * holds, keep theirs, too, if the loops then close; deformations give way last. */
static kempe_status close_loops(work *w)
{
    const kmp_start *start = &w->model->start;
    const bool *const held[] = {start->hold, start->undeformed};
    KMP_TRY(choose(w, w->q));
    for (int k = 0; k < w->n; k++) {
        w->kept[k] = w->chosen[k] && !is_given(w->given, k);
        w->q[k] = is_given(w->given, k) ? w->given[k] : w->q[k];
    }
    for (int turn = 0; turn < 2; turn++) {
        for (int k = 0; k < w->n; k++)
            w->fixed[k] =
                is_given(w->given, k) ? w->chosen[k] || w->rank > 0 : w->chosen[k] || (held[turn] && held[turn][k]);
        KMP_TRY(attempt(w, 0));
        if (w->a->closed)
            return KEMPE_OK;
    }
    for (int k = 0; k < w->n; k++)
        w->fixed[k] = w->fixed[k] && is_given(w->given, k);
    KMP_TRY(attempt(w, w->pushes));
    if (w->a->closed)
        return KEMPE_OK;
    /* Others may be independent here than at the model's own start. */
    for (int k = 0; k < w->n; k++)
        w->fixed[k] = false;
    KMP_TRY(attempt(w, w->pushes));
    if (!w->a->closed)
        return KEMPE_OK;
    KMP_TRY(choose(w, w->a->q));
    for (int k = 0; k < w->n; k++)
        w->fixed[k] = w->chosen[k] && is_given(w->given, k);
    return attempt(w, w->pushes);
}

/* -- refusals ------------------------------------------------------------------------------------------ */

/* "'crank', 'slide'": the given coordinates that keep their values. */
static void put_fixed(kmp_text *text, const work *w)
{
    int count = 0;
    for (int k = 0; k < w->n; k++)
        if (w->fixed[k] && is_given(w->given, k) && count++ <= MOST_NAMED)
            kmp_text_printf(text, "%s'%s'%s", count > 1 ? ", " : "", w->model->motions[k].name,
                            count > MOST_NAMED ? ", .." : "");
}

static bool keeps_given(const work *w)
{
    bool any = false;
    for (int k = 0; k < w->n; k++)
        any = any || (w->fixed[k] && is_given(w->given, k));
    return any;
}

static const char *unit_of(const work *w, int k, bool rate)
{
    const bool rotation = w->model->motions[k].rotation;
    return rate ? (rotation ? "rad/s" : "m/s") : rotation ? "rad" : "m";
}

/* The gap at the position that was given. */
static kempe_status put_gap(kmp_text *text, work *w)
{
    for (int k = 0; k < w->n; k++)
        w->liked[k] = true;
    const kmp_guess guess = {w->q, w->liked, 0, false, w->rank};
    kempe_assembly *a = NULL;
    KMP_TRY(kmp_assemble_from(w->system, &guess, &a));
    if (a->culprit_count > 0) {
        kmp_assembly_put_open(text, a, a->culprits[0]);
    } else {
        kmp_text_put(text, "none of them by more than rounding");
    }
    kempe_assembly_free(a);
    return KEMPE_OK;
}

static kempe_status refuse_open(work *w)
{
    kmp_text why = {0};
    kmp_text_put(&why, "the loops cannot be closed at this q");
    if (w->a->culprit_count > 0) {
        kmp_text_put(&why, ": what stays open is ");
        kmp_assembly_put_open(&why, w->a, w->a->culprits[0]);
    }
    if (keeps_given(w)) {
        kmp_text_put(&why, ", with ");
        put_fixed(&why, w);
        kmp_text_put(&why, " as given");
    }
    kmp_text_put(&why, "; give a position that the mechanism can reach");
    return kmp_fail_text(w->model->context, KEMPE_E_FAILED, &why);
}

/* Given values that contradict each other, or that no closed position near them has: coordinate k would have to move.
 */
static kempe_status refuse_contradiction(work *w, int k)
{
    kmp_text why = {0};
    const bool some = keeps_given(w);
    const kmp_shown as = kmp_shown_as(w->model->context, unit_of(w, k, false));
    kmp_text_put(&why, "q does not close the loops, but leaves open ");
    KMP_TRY(put_gap(&why, w));
    kmp_text_put(&why, some ? "; with " : "; in the nearest closed position that was found");
    if (some) {
        put_fixed(&why, w);
        kmp_text_put(&why, " as given");
    }
    kmp_text_printf(&why, " '%s' is %.6g %s, not %.6g; %s", w->model->motions[k].name, as.factor * w->a->q[k], as.unit,
                    as.factor * w->given[k],
                    some ? "leave out coordinates that follow from others, or close q before"
                         : "give a position that the mechanism can reach");
    return kmp_fail_text(w->model->context, KEMPE_E_FAILED, &why);
}

static kempe_status check_position(work *w)
{
    int worst = -1;
    double most = ROUNDED;
    if (!w->a->closed)
        return refuse_open(w);
    for (int k = 0; k < w->n; k++) {
        const double off = is_given(w->given, k) ? fabs(w->a->q[k] - w->given[k]) / w->system->scale[k] : 0;
        worst = off > most ? k : worst;
        most = fmax(most, off);
    }
    return worst >= 0 ? refuse_contradiction(w, worst) : KEMPE_OK;
}

/* Warns of the coordinate that was to start as in the model, and moves most. */
static void warn_of_move(const work *w)
{
    int worst = -1;
    double most = ROUNDED;
    for (int k = 0; k < w->n; k++) {
        const double move = w->kept[k] ? fabs(w->a->q[k] - w->q[k]) / w->system->scale[k] : 0;
        worst = move > most ? k : worst;
        most = fmax(most, move);
    }
    if (worst < 0)
        return;
    const kmp_shown as = kmp_shown_as(w->model->context, unit_of(w, worst, false));
    kmp_log(
        w->model->context, KEMPE_LOG_WARNING,
        "start: the loops do not close at this q with '%s' as in the model: it moves by %.4g %s; give it a value, too",
        w->model->motions[worst].name, as.factor * (w->a->q[worst] - w->q[worst]), as.unit);
}

/* -- the start of the new model ------------------------------------------------------------------------ */

static bool has_clearance(const kempe_model *model)
{
    bool any = false;
    for (int k = 0; k < model->force_count; k++)
        any = any || model->forces[k].centred[0];
    return any;
}

static void set_position(work *w, bool *hold)
{
    kempe_model *model = w->model;
    kmp_start *start = &model->start;
    for (int k = 0; k < w->n; k++) {
        start->q[k] = (kmp_number){.value = w->a->q[k]};
        start->q_given[k] = true;
        if (is_given(w->given, k) && model->motions[k].elastic)
            start->statics = false; /* which would move it */
    }
    start->goal_count = 0; /* so would these */
    start->at = NULL;
    if (has_clearance(model)) {
        /* Joints with clearance are centred at the start by coordinates that nothing holds. */
        for (int k = 0; k < w->n; k++)
            hold[k] = w->model->start.hold[k] || (w->fixed[k] && is_given(w->given, k));
        w->model->start.hold = hold;
    }
    for (int k = 0; k < model->cut_coordinate_count; k++)
        model->cut_coordinates[k].q_given = false;
}

/* Makes the rates at the closed position; they are in w->a. */
static kempe_status make_rates(work *w)
{
    for (int k = 0; k < w->n; k++)
        w->fixed[k] = true;
    return attempt(w, 0);
}

static kempe_status refuse_rate(const work *w, int k, double given)
{
    const kmp_shown as = kmp_shown_as(w->model->context, unit_of(w, k, true));
    const double rate = fabs(w->a->qd[k]) > ROUNDED * ROUNDED * fabs(given) ? w->a->qd[k] : 0;
    return kmp_fail(w->model->context, KEMPE_E_FAILED,
                    "qd contradicts itself, the closures or the drives: the rate of '%s' would be %.6g %s, not %.6g; "
                    "leave out rates that follow from others",
                    w->model->motions[k].name, as.factor * rate, as.unit, as.factor * given);
}

/* Given rates count before the rates of the model, which give way where they contradict. */
static kempe_status set_rates(work *w, const double *qd)
{
    kmp_start *start = &w->model->start;
    double size = 0;
    for (int k = 0; k < w->n; k++)
        if (is_given(qd, k)) {
            start->qd[k] = (kmp_number){.value = qd[k]};
            start->qd_given[k] = true;
            size = fmax(size, fabs(qd[k]) / w->system->scale[k]);
        }
    for (int k = 0; k < w->model->cut_coordinate_count; k++)
        w->model->cut_coordinates[k].qd_given = false;
    /* Signals of delays are constant before the start where their states are given. */
    const int first = kmp_model_coordinates(w->model);
    for (int k = 0; k < w->model->state_count; k++) {
        kmp_state *state = &w->model->states[k];
        if (!is_given(qd, first + k))
            continue;
        if (state->before)
            kmp_log(w->model->context, KEMPE_LOG_WARNING,
                    "start: the signal of '%s' before the start is constant at its given value, in place of 'before'",
                    state->name);
        state->start = (kmp_number){.value = qd[first + k]};
        state->began = state->delayed;
        state->before = NULL;
    }
    KMP_TRY(make_rates(w));
    if (w->a->rates_changed) {
        for (int k = 0; k < kmp_model_coordinates(w->model); k++)
            if (!is_given(qd, k)) {
                start->qd[k] = (kmp_number){.value = 0};
                start->qd_given[k] = false;
            }
        KMP_TRY(make_rates(w));
    }
    for (int k = 0; w->a->rates_changed && k < w->n; k++) {
        if (!is_given(qd, k))
            continue;
        if (!(fabs(w->a->qd[k] - qd[k]) / w->system->scale[k] <= ROUNDED * size))
            return refuse_rate(w, k, qd[k]);
        start->qd[k].value = w->a->qd[k];
    }
    return KEMPE_OK;
}

/* -- all together -------------------------------------------------------------------------------------- */

static kempe_status check_numbers(const kempe_model *model, const char *what, const double *values)
{
    for (int k = 0; values && k < model->motion_count; k++)
        if (isinf(values[k]))
            return kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s of '%s' is infinite", what, model->motions[k].name);
    return KEMPE_OK;
}

static kempe_status start_at(work *w, const kempe_model *model, const double *q, const double *qd)
{
    bool any = false;
    KMP_TRY(kmp_made(model->context,
                     KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, w->n, &w->q), KMP_ROOM(int, w->n, &w->u),
                                    KMP_ROOM(bool, w->n, &w->fixed, &w->liked, &w->chosen, &w->usual, &w->kept))));
    for (int k = 0; k < w->n; k++)
        any = any || is_given(q, k);
    KMP_TRY(take_own_start(w, model));
    /* Closures may keep a start value, as drives that are locked: theirs is the given one. */
    for (int k = 0; k < w->n; k++)
        w->model->start.q[k] = any ? (kmp_number){.value = is_given(q, k) ? q[k] : w->q[k]} : model->start.q[k];
    KMP_TRY(kmp_system_of_closures(w->model, &w->system));
    if (any) {
        KMP_TRY(close_loops(w));
        KMP_TRY(check_position(w));
        warn_of_move(w);
        bool *hold = KMP_ARENA_NEW(&w->model->arena, bool, w->n);
        KMP_TRY(kmp_made(model->context, hold));
        set_position(w, hold);
    } else {
        KMP_TRY(kmp_assemble_start(w->system, &w->a));
    }
    for (int k = 0; k < w->n; k++)
        w->q[k] = w->a->q[k];
    return qd && w->a->closed ? set_rates(w, qd) : KEMPE_OK;
}

kempe_status kempe_model_start_at(const kempe_model *model, const double *q, const double *qd, kempe_model **started)
{
    KMP_WANTED_BOTH(model, started);
    kmp_context_clear(model->context);
    KMP_TRY(check_numbers(model, "q", q));
    KMP_TRY(check_numbers(model, "qd", qd));
    work w = {.n = model->motion_count, .given = q};
    KMP_TRY(kmp_variant_instance(model, 0, NULL, NULL, &w.model));
    kempe_status status = start_at(&w, model, q, qd);
    kempe_assembly_free(w.a);
    kempe_system_free(w.system);
    kmp_arena_free(&w.arena);
    return KMP_GIVE_OR_FREE(status, started, w.model, kempe_model_free);
}

kempe_status kempe_model_start_in(const kempe_model *model, const char *state, kempe_model **started)
{
    const char *at = NULL;
    kmp_text complaint = {0};
    KMP_WANTED_BOTH(model, started);
    KMP_WANTED(model->context, state, "state");
    kmp_context_clear(model->context);
    if (!kmp_start_read_at(state, &at, &complaint))
        return kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &complaint);
    kempe_model *m = NULL;
    KMP_TRY(kmp_variant_instance(model, 0, NULL, NULL, &m));
    m->start.at = at ? kmp_arena_strdup(&m->arena, at) : NULL;
    const kempe_status status = kmp_made(model->context, m->start.at || !at);
    return KMP_GIVE_OR_FREE(status, started, m, kempe_model_free);
}
