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

/* Conditions of forces change at the ends of steps, where a state does not decide which side it is on: loads are taken
 * this part of the step, or of the time, within. */
#define WITHIN    1e-11
#define WITHIN_OF 2e-15

/* A channel: the size of a force or a moment, or a power of a force. */
typedef struct channel {
    bool turns;
    double power;
} channel;

struct kmp_reaction_watch {
    const kempe_system *system;
    kmp_reactions found;
    kmp_bearing_loads bearings;
    kmp_all_loads loads;
    kmp_evaluator *eval; /* of the constraints; NULL: there are none */
    kmp_present_inputs inputs;
    kmp_run_quantities q;
    kmp_run_quantity *of; /* of each channel one: a largest value, or the mean of a power */
    channel *channel;
    const char **name;
    double *account, *room, *sampled, *row, *load, *pair; /* load: of all joints; pair: of all bearings */
    double *value, *time;                                 /* of q; the times of largest values before a step */
    kmp_runner *runner;                                   /* of the step under way */
    double first, last;                                   /* times in it at which loads are taken */
    double rtol;
    kmp_arena arena;
};

/* -- the channels ---------------------------------------------------------------------------------------- */

/* The loads at a time within the step, in watch->load and watch->pair. */
static bool loads_at(kmp_reaction_watch *w, double within)
{
    const double t = fmin(fmax(within, w->first), w->last);
    const int n = w->system->n, pairs = w->system->model->bearing_count;
    if (kmp_runner_look(w->runner, t, w->row) != KEMPE_OK)
        return false;
    const kmp_instant at = {
        .t = t, .q = w->row, .qd = w->row + n, .qdd = w->row + 2 * n, .lambda = w->row + 3 * n, .inputs = &w->inputs};
    memcpy(w->load, kmp_all_loads_at(&w->loads, &at), (size_t)w->found.loads * sizeof *w->load);
    if (kmp_reactions_share(&w->found, w->eval, &w->loads, &at, w->load) != KEMPE_OK)
        return false;
    if (pairs > 0)
        memcpy(w->pair, kmp_all_loads_bearings(&w->loads, &at, w->load),
               (size_t)(KMP_BEARING_VALUES * pairs) * sizeof *w->pair);
    return true;
}

/* In the order of list_joints() and list_bearings(). */
static bool channels_at(void *user, double t, double *values)
{
    kmp_reaction_watch *w = user;
    const kempe_model *model = w->system->model;
    if (!loads_at(w, t))
        return false;
    for (const kmp_reaction *of = w->found.of; of < w->found.of + w->found.count; of++)
        for (int k = 0; of->place >= 0 && k < 2; k++)
            if (of->has[k])
                *values++ = kmp_reaction_size(of, k, w->load);
    for (int b = 0; b < model->bearing_count; b++) {
        const double *pair = w->pair + (ptrdiff_t)KMP_BEARING_VALUES * b;
        for (int k = 0; w->loads.bearing[b] >= 0 && k < 2; k++) {
            const double radial = kmp_bearing_radial(pair, k);
            *values++ = radial;
            *values++ = pow(radial, model->bearings[b].life[k]);
        }
        if (w->loads.bearing[b] >= 0 && model->bearings[b].thrust > 0)
            *values++ = fabs(pair[6]);
    }
    return true;
}

static void add_quantity(kmp_reaction_watch *w, kmp_run_quantity_kind kind, channel what, const char *name)
{
    const int k = w->q.count++, width = kmp_run_quantity_width(kind);
    w->of[k] = (kmp_run_quantity){.kind = kind, .channel = k, .first_value = w->q.values};
    w->channel[k] = what;
    for (int i = 0; i < width; i++)
        w->name[w->q.values++] = name;
}

static bool list(kmp_reaction_watch *w)
{
    const int most = 2 * w->found.count + 5 * w->system->model->bearing_count;
    if (!KMP_ARENA_MAKE(&w->arena, KMP_ROOM(kmp_run_quantity, most, &w->of), KMP_ROOM(channel, most, &w->channel),
                        KMP_ROOM(const char *, 2 * most, &w->name)))
        return false;
    /* A largest value of each force and moment that is known. */
    const kmp_reactions *r = &w->found;
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++)
        for (int k = 0; of->place >= 0 && k < 2; k++)
            if (of->has[k])
                add_quantity(w, KMP_TAKE_MAX, (channel){k == 1, 1},
                             kmp_arena_printf(&w->arena, "%s of %s", k ? "moment" : "force", of->name));
    const kempe_model *model = w->system->model;
    for (int b = 0; b < model->bearing_count; b++) {
        const kmp_bearing_pair *pair = &model->bearings[b];
        for (int k = 0; w->loads.bearing[b] >= 0 && k < 2; k++) {
            const char *name = kmp_arena_printf(&w->arena, "load of bearing %s %d", pair->name, 1 + k);
            add_quantity(w, KMP_TAKE_MAX, (channel){false, 1}, name);
            add_quantity(w, KMP_TAKE_MEAN, (channel){false, pair->life[k]}, name);
        }
        if (w->loads.bearing[b] >= 0 && pair->thrust > 0)
            add_quantity(w, KMP_TAKE_MAX, (channel){false, 1},
                         kmp_arena_printf(&w->arena, "axial load of bearings %s", pair->name));
    }
    w->q.channels = w->q.count;
    w->q.of = w->of;
    w->q.name = w->name;
    w->q.inside = w->q.rates = w->q.late = true;
    w->q.remedy = "leave out reaction_peaks and bearings";
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
    KMP_TRY(kmp_made(s->context, list(w) && kmp_present_inputs_init(&w->inputs, &w->arena, s->model) &&
                                     kmp_bearing_loads_init(&w->bearings, s, &w->arena)));
    KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, kmp_account_size(&w->q), &w->account),
                   KMP_ROOM(double, kmp_account_room(&w->q), &w->room),
                   KMP_ROOM(double, kmp_account_piece(&w->q), &w->sampled), KMP_ROOM(double, 3 * s->n + s->m, &w->row),
                   KMP_ROOM(double, w->found.loads + 1, &w->load),
                   KMP_ROOM(double, KMP_BEARING_VALUES * s->model->bearing_count + 1, &w->pair),
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

const kmp_bearing_loads *kmp_reaction_watch_bearings(const kmp_reaction_watch *w)
{
    return &w->bearings;
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

/* The size that a channel has for the largest load of the mechanism, times the size of a part of that load's. */
static double size_of(const kmp_reaction_watch *w, int c, double largest, double part)
{
    const channel *of = &w->channel[c];
    const double size = largest * (of->turns ? w->system->length : 1);
    return of->power == 1 ? part * size : part * of->power * pow(size, of->power);
}

/* The time of the largest value of a quantity; NaN: of a mean, or unknown. */
static double time_of(const kmp_reaction_watch *w, int k)
{
    return w->of[k].kind == KMP_TAKE_MAX ? w->value[w->of[k].first_value + 1] : NAN;
}

static bool meet_at(kmp_reaction_watch *w, double t)
{
    if (!loads_at(w, t))
        return false;
    kmp_reactions_meet(&w->found, t, w->load);
    kmp_bearing_loads_meet(&w->bearings, t, w->pair);
    return true;
}

/* Takes the vectors at the times of the largest values that the step has. The start is the first of equal ones. */
static bool meet(kmp_reaction_watch *w, double to)
{
    if (!w->found.whole && !meet_at(w, w->found.from))
        return false;
    kmp_account_values(&w->q, w->account, w->found.from, to, NULL, w->value);
    for (int k = 0; k < w->q.count; k++) {
        const double t = time_of(w, k);
        bool known = t == w->time[k] || !isfinite(t);
        for (int i = 0; i < k && !known; i++)
            known = time_of(w, i) == t;
        if (!known && !meet_at(w, t))
            return false;
    }
    for (int k = 0; k < w->q.count; k++)
        w->time[k] = time_of(w, k);
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
    /* Loads are rounded as a part of the largest one of the mechanism. */
    double largest = 0;
    for (int k = 0; k < KMP_PIECE_POINTS; k += 2)
        for (int c = 0; c < w->q.channels; c++)
            if (w->channel[c].power == 1)
                largest = fmax(largest, w->sampled[k * w->q.channels + c] / size_of(w, c, 1, 1));
    for (int c = 0; c < w->q.channels && isfinite(largest); c++)
        kmp_account_round(&w->q, w->account, c, size_of(w, c, largest, KMP_PRINT_NOISE));
    if (w->found.whole && kmp_quantities_may_pass(&w->q) && kmp_account_pass(&w->q, w->account, &step))
        return true;
    if (!sample(w, &step, 1) || !kmp_account_step(&w->q, w->account, w->room, &step) || !meet(w, to))
        return false;
    /* The equivalent loads until now. */
    const kempe_model *model = w->system->model;
    int k = 0;
    for (int b = 0; b < 2 * model->bearing_count; b++) {
        if (w->loads.bearing[b / 2] < 0)
            continue;
        while (w->of[k].kind != KMP_TAKE_MEAN)
            k++;
        w->bearings.of[b].equivalent = pow(w->value[w->of[k++].first_value], 1 / model->bearings[b / 2].life[b % 2]);
    }
    return true;
}

bool kmp_reaction_watch_step(kmp_reaction_watch *w, kmp_runner *run, double from, double to)
{
    kmp_text why = {0};
    if (w->q.count == 0 || !(to > from))
        return true;
    const double side = fmax(WITHIN * (to - from), WITHIN_OF * fmax(fabs(from), fabs(to)));
    if (!(to - from > 4 * side))
        return true;
    w->runner = run;
    w->first = from > run->spec.t_start ? from + side : from;
    w->last = to < run->spec.t_end ? to - side : to;
    w->found.from = w->found.whole ? w->found.from : from;
    kmp_present_inputs_copy(&w->inputs, kmp_runner_inputs(run));
    w->inputs.held = true;
    const bool good = take(w, from, to);
    w->found.whole = w->bearings.whole = true;
    w->found.until = w->bearings.until = to;
    w->bearings.from = w->found.from;
    if (!good && !run->reason && kmp_account_excess(&w->q, w->account, to, &why))
        run->reason = kmp_text_take(&why);
    kmp_present_inputs_forget(&w->inputs);
    w->inputs.held = false;
    return good;
}
