/* SPDX-License-Identifier: BSD-3-Clause */
/* The sizes of the loads of all joints are channels of an account of quantities, which finds the times of their largest
 * values. The vectors belong to the states at these times. */
#include "studies/simulate/reaction_watch.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "model/data/model.h"
#include "output/print.h"
#include "output/quantities/run_quantities.h"
#include "output/quantities/smooth_piece.h"
#include <math.h>
#include <string.h>

struct kmp_reaction_watch {
    const kempe_system *system;
    kmp_reactions found;
    kmp_all_loads loads;
    kmp_evaluator *eval; /* of the constraints; NULL: there are none */
    kmp_present_inputs inputs;
    kmp_run_quantities q;
    kmp_run_quantity *of; /* a largest size each */
    bool *turns;          /* by channels: a moment */
    double *account, *room, *sampled, *row, *load;
    double *value, *time; /* of q: value and time in turn; the times before a step */
    kmp_runner *runner;   /* of the step under way */
    double rtol;
    kmp_arena arena;
};

/* -- the channels ---------------------------------------------------------------------------------------- */

/* The loads at a time within the step, in watch->load. */
static bool loads_at(kmp_reaction_watch *w, double t)
{
    const int n = w->system->n;
    if (kmp_runner_look(w->runner, t, w->row) != KEMPE_OK)
        return false;
    const kmp_instant at = {.t = t,
                            .q = w->row,
                            .qd = w->row + n,
                            .qdd = w->row + 2 * n,
                            .lambda = w->row + 3 * n,
                            .inputs = &w->inputs};
    memcpy(w->load, kmp_all_loads_at(&w->loads, &at), (size_t)w->found.loads * sizeof *w->load);
    return kmp_reactions_share(&w->found, w->eval, &w->loads, &at, w->load) == KEMPE_OK;
}

/* In the order of list(). */
static bool channels_at(void *user, double t, double *values)
{
    kmp_reaction_watch *w = user;
    if (!loads_at(w, t))
        return false;
    for (const kmp_reaction *of = w->found.of; of < w->found.of + w->found.count; of++)
        for (int k = 0; of->place >= 0 && k < 2; k++)
            if (of->has[k])
                *values++ = kmp_reaction_size(of, k, w->load);
    return true;
}

static const char *list_name(kmp_reaction_watch *w, const kmp_reaction *of, int k)
{
    return kmp_arena_printf(&w->arena, "%s of %s", k ? "moment" : "force", of->name);
}

/* A largest value of each force and moment that is known. */
static bool list(kmp_reaction_watch *w)
{
    const kmp_reactions *r = &w->found;
    const char **name = KMP_ARENA_NEW(&w->arena, const char *, 4 * r->count + 1);
    w->of = KMP_ARENA_NEW(&w->arena, kmp_run_quantity, 2 * r->count + 1);
    w->turns = KMP_ARENA_NEW(&w->arena, bool, 2 * r->count + 1);
    for (int i = 0; !w->arena.failed && i < r->count; i++)
        for (int k = 0; r->of[i].place >= 0 && k < 2; k++)
            if (r->of[i].has[k]) {
                w->of[w->q.count] =
                    (kmp_run_quantity){.kind = KMP_TAKE_MAX, .channel = w->q.count, .first_value = w->q.values};
                name[w->q.values] = name[w->q.values + 1] = list_name(w, &r->of[i], k);
                w->turns[w->q.count++] = k == 1;
                w->q.values += kmp_run_quantity_width(KMP_TAKE_MAX);
            }
    w->q.channels = w->q.count;
    w->q.of = w->of;
    w->q.name = name;
    w->q.inside = w->q.rates = w->q.late = true;
    w->q.remedy = "leave out reaction_peaks";
    return !w->arena.failed;
}

/* -- a watch ----------------------------------------------------------------------------------------------- */

static kempe_status init(kmp_reaction_watch *w, bool least_norm)
{
    const kempe_system *s = w->system;
    KMP_TRY(kmp_all_loads_init(&w->loads, s));
    KMP_TRY(kmp_reactions_init(&w->found, s, &w->loads, true));
    if (s->model->closure_count > 0) {
        w->eval = kmp_eval_new_of_closures(s);
        KMP_TRY(w->eval ? KEMPE_OK : KEMPE_E_MEMORY);
    }
    w->found.least_norm = least_norm && w->eval;
    KMP_TRY(kmp_made(s->context, list(w) && kmp_present_inputs_init(&w->inputs, &w->arena, s->model)));
    KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, kmp_account_size(&w->q), &w->account),
                   KMP_ROOM(double, kmp_account_room(&w->q), &w->room),
                   KMP_ROOM(double, kmp_account_piece(&w->q), &w->sampled),
                   KMP_ROOM(double, 3 * s->n + s->m, &w->row), KMP_ROOM(double, w->found.loads + 1, &w->load),
                   KMP_ROOM(double, w->q.values + 1, &w->value, &w->time));
    KMP_TRY(kmp_made(s->context, !w->arena.failed));
    kmp_account_begin(&w->q, w->account);
    for (int k = 0; k < w->q.count; k++)
        w->time[k] = NAN;
    return KEMPE_OK;
}

kempe_status kmp_reaction_watch_new(const kempe_system *system, double rtol, bool least_norm,
                                    kmp_reaction_watch **watch)
{
    KMP_MAKE(system->context, kmp_reaction_watch, w);
    w->system = system;
    w->rtol = rtol;
    kempe_status status = init(w, least_norm);
    return KMP_GIVE_OR_FREE(status, watch, w, kmp_reaction_watch_free);
}

KMP_FREES(kmp_reaction_watch, watch, kmp_reactions_free(&watch->found), kmp_all_loads_free(&watch->loads),
          kmp_eval_free(watch->eval), kmp_arena_free(&watch->arena))

const kmp_reactions *kmp_reaction_watch_found(const kmp_reaction_watch *w)
{
    return &w->found;
}

/* -- steps --------------------------------------------------------------------------------------------- */

/* Samples the points of the step from `first` on, every second one. */
static bool sample(kmp_reaction_watch *w, const kmp_measured_step *step, int first)
{
    for (int k = first; k < KMP_PIECE_POINTS; k += 2) {
        const double x = kmp_piece_point(k);
        const double t = x <= -1  ? step->from
                         : x >= 1 ? step->to
                                  : step->from + 0.5 * (1 + x) * (step->to - step->from);
        if (!channels_at(w, t, w->sampled + (ptrdiff_t)k * w->q.channels))
            return false;
    }
    return true;
}

/* Loads are rounded as a part of the largest one of the mechanism. */
static void note_rounding(kmp_reaction_watch *w)
{
    const double length = w->system->length;
    double largest = 0;
    for (int k = 0; k < KMP_PIECE_POINTS; k += 2)
        for (int c = 0; c < w->q.channels; c++)
            largest = fmax(largest, w->sampled[k * w->q.channels + c] / (w->turns[c] ? length : 1));
    for (int c = 0; c < w->q.channels && isfinite(largest); c++)
        kmp_account_round(&w->q, w->account, c, KMP_PRINT_NOISE * largest * (w->turns[c] ? length : 1));
}

/* Takes the vectors at the times of the largest values that the step has. */
static bool meet(kmp_reaction_watch *w, double to)
{
    kmp_account_values(&w->q, w->account, w->found.from, to, NULL, w->value);
    for (int k = 0; k < w->q.count; k++) {
        const double t = w->value[w->of[k].first_value + 1];
        bool known = t == w->time[k] || !isfinite(t);
        for (int i = 0; i < k && !known; i++)
            known = w->value[w->of[i].first_value + 1] == t;
        if (known)
            continue;
        if (!loads_at(w, t))
            return false;
        kmp_reactions_meet(&w->found, t, w->load);
    }
    for (int k = 0; k < w->q.count; k++)
        w->time[k] = w->value[w->of[k].first_value + 1];
    return true;
}

/* A step that changes no largest value is known from every second point. */
static bool take(kmp_reaction_watch *w, double from, double to)
{
    kmp_measured_step step = {
        .from = from, .to = to, .rtol = w->rtol, .sampled = w->sampled, .channels = channels_at, .user = w};
    kmp_account_renew(&w->q, w->account);
    if (!sample(w, &step, 0))
        return false;
    note_rounding(w);
    if (w->found.whole && kmp_quantities_may_pass(&w->q) && kmp_account_pass(&w->q, w->account, &step))
        return true;
    return sample(w, &step, 1) && kmp_account_step(&w->q, w->account, w->room, &step) && meet(w, to);
}

bool kmp_reaction_watch_step(kmp_reaction_watch *w, kmp_runner *run, double from, double to)
{
    kmp_text why = {0};
    if (w->q.count == 0 || !(to > from))
        return true;
    w->runner = run;
    w->found.from = w->found.whole ? w->found.from : from;
    kmp_present_inputs_copy(&w->inputs, kmp_runner_inputs(run));
    w->inputs.held = true;
    const bool good = take(w, from, to);
    w->found.whole = true;
    w->found.until = to;
    if (!good && !run->reason && kmp_account_excess(&w->q, w->account, to, &why))
        run->reason = kmp_text_take(&why);
    kmp_present_inputs_forget(&w->inputs);
    w->inputs.held = false;
    return good;
}
