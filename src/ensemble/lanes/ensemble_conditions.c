/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of instances in lanes. Their values at both ends of a step are evaluated in all lanes together, and bounds
 * between them decide most steps. The search of a run decides the others one by one, and locates the event. */
#include "ensemble/lanes/ensemble_conditions.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/lane_state.h"
#include "integrators/decide/restart.h"
#include "integrators/run/events.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/sampler.h"
#include "model/data/state.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- states within a step ----------------------------------------------------------------------------------- */

/* States within the present step of a lane: the states of its interpolant, on closed loops. */

bool kmp_within_init(kmp_engine *e)
{
    kmp_arena *a = &e->run_arena;
    kmp_lane_within *in = &e->within;
    *in = (kmp_lane_within){.lane = 0};
    for (int k = 0; k < KMP_LANE_VECTORS; k++)
        in->vector[k] = KMP_ARENA_NEW(a, double, kmp_lane_most(e));
    return KMP_ARENA_MAKE(a, KMP_ROOM(double, kmp_lane_most(e), &in->y, &in->udd));
}

void kmp_within_begin(kmp_engine *e, kmp_lane_group *pool, size_t l)
{
    kmp_lane_within *in = &e->within;
    in->pool = pool;
    in->lane = l;
    in->current = in->ready = false;
}

/* Prepares the interpolant. */
static void prepare(kmp_engine *e)
{
    const kmp_lane_state *room = &e->room;
    kmp_lane_within *in = &e->within;
    const size_t l = in->lane, w = room->w;
    if (!in->ready) {
        kmp_rk_cubics(e->size, w, room->step[l], room->y + l, room->y_new + l, room->k[1] + l, room->k[13] + l,
                      in->vector);
        kmp_dop853_dense_all(e->size, l, w, room->step[l], room->k, in->vector);
    }
    in->ready = true;
}

void kmp_engine_hold_inputs(kmp_engine *e, const kmp_present_inputs *inputs)
{
    kmp_present_inputs *own = &e->eval->inputs;
    if (inputs)
        kmp_present_inputs_copy(own, inputs);
    else
        kmp_present_inputs_forget(own);
    own->held = inputs != NULL;
}

/* Makes the instance of that lane the current one with the inputs of its step, if it is not; then takes these back. */
static void stand_within(kmp_engine *e)
{
    kmp_lane_within *in = &e->within;
    const kmp_instance *x = &e->instances[e->room.who[in->lane]];
    if (in->current)
        return;
    kmp_instance_current(e, x);
    for (int r = 0; e->eval->nu && r < e->m; r++)
        e->eval->nu[r] = e->room.nu[(size_t)r * e->room.w + in->lane];
    kmp_engine_hold_inputs(e, &x->inputs);
    in->current = true;
}

void kmp_within_end(kmp_engine *e)
{
    if (e->within.current)
        kmp_engine_hold_inputs(e, NULL);
    e->within.current = false;
}

bool kmp_instance_complete(kmp_engine *e, kmp_lane_group *pool, const double *qd, double *qdd, double *lambda)
{
    double *udd = e->within.udd;
    kmp_eval_mass(e->eval);
    kmp_eval_bias(e->eval, qd);
    if (kmp_reduction_accelerate(&pool->red, udd))
        return false;
    kmp_reduction_accelerations(&pool->red, udd, qdd);
    if (lambda)
        kmp_reduction_multipliers(&pool->red, qdd, lambda);
    return true;
}

bool kmp_within_state(kmp_engine *e, double t, bool rates, double *q, double *qd, double *qdd, double *lambda)
{
    kmp_lane_within *in = &e->within;
    const kmp_lane_state *room = &e->room;
    stand_within(e);
    prepare(e);
    kmp_rk_interpolate(e->size, KMP_LANE_VECTORS, in->vector, (t - room->t[in->lane]) / room->step[in->lane], in->y);
    return kmp_instance_state(e, in->pool, t, in->y, q, qd, true) &&
           (!rates || kmp_instance_complete(e, in->pool, qd, qdd, lambda));
}

/* -- conditions --------------------------------------------------------------------------------------------- */

enum { PLACES = 3 }; /* of the present steps: both ends, and the middle */

/* A place of the present steps, by lanes. */
typedef struct step_place {
    double *rows;   /* 3 n + m: q, qd, qdd, lambda */
    double *change; /* of each condition */
    double *solved; /* solutions of implicit blocks in conditions */
} step_place;

struct kmp_lane_conditions {
    kmp_lanes *lanes; /* the program of conditions */
    double *mode;     /* of all lanes */
    step_place place[PLACES];
    size_t solved;                               /* solutions of implicit blocks */
    bool middle;                                 /* some conditions are decided with the middle of the step */
    double *wide[KMP_LANE_VECTORS];              /* size: the interpolants, for the middle */
    kmp_event_probe look[PLACES];                /* of one lane */
    kmp_event_tracker *watching[KMP_LANES_MOST]; /* of each lane, with the numbers of its instance */
    kmp_event_tracker *passing;                  /* of the current instance */
};

const char *kmp_conditions_no_lanes(const kempe_system *s)
{
    int late = 0;
    for (int k = 0; k < s->events.count; k++)
        late += s->events.condition[k].late;
    if (s->changes && s->changes->outputs[3] > s->changes->outputs[2] + late)
        return "conditions of solved equations that depend on multipliers or accelerations";
    return NULL;
}

bool kmp_has_late_conditions(const kempe_system *s)
{
    bool any = false;
    for (int k = 0; k < s->events.count; k++)
        any = any || s->events.condition[k].late;
    return any;
}

static kempe_status state_within(void *user, double t, kmp_state_depth depth, bool again, double *q, double *qd,
                                 double *qdd, double *lambda)
{
    (void)again;
    return kmp_within_state(user, t, depth >= KMP_STATE_WHOLE, q, qd, qdd, lambda) ? KEMPE_OK : KEMPE_E_FAILED;
}

bool kmp_conditions_init(kmp_engine *e)
{
    kmp_arena *a = &e->run_arena;
    size_t w = e->room.w, n = (size_t)e->n, count = (size_t)e->s->events.count;
    const kmp_event_setup plan = {.system = e->s,
                                  .eval = e->eval,
                                  .span = e->spec.t_end,
                                  .rtol = e->spec.rtol,
                                  .kinks = true,
                                  .closely = e->spec.closely,
                                  .state = state_within,
                                  .user = e};
    e->conditions = NULL;
    if (count == 0)
        return true;
    kmp_lane_conditions *c = KMP_ARENA_NEW(a, kmp_lane_conditions, 1);
    if (!c)
        return false;
    e->conditions = c;
    c->mode = kmp_arena_aligned(a, w * count);
    c->solved = (size_t)(e->s->changes->outputs[2] - e->s->changes->outputs[1]) - count;
    c->middle = e->room.late || c->solved > 0;
    for (int k = 0; c->middle && k < KMP_LANE_VECTORS; k++)
        c->wide[k] = kmp_arena_aligned(a, w * (size_t)kmp_lane_most(e));
    for (int i = 0; i < PLACES; i++) {
        c->place[i].rows = kmp_arena_aligned(a, w * (3 * n + (size_t)e->m));
        (void)KMP_ARENA_MAKE(
            a, KMP_ROOM(double, w *count, &c->place[i].change), KMP_ROOM(double, w * c->solved, &c->place[i].solved),
            KMP_ROOM(double, count, &c->look[i].change), KMP_ROOM(double, c->solved, &c->look[i].solved),
            KMP_ROOM(double, 3 * e->n + e->m, &c->look[i].state));
    }
    for (size_t l = 0; l < w && !a->failed; l++)
        c->watching[l] = kmp_event_tracker_new(&plan, a);
    c->passing = a->failed ? NULL : kmp_event_tracker_new(&plan, a);
    c->lanes = a->failed || !c->passing ? NULL : kmp_lanes_new(e->s->changes, (int)w, e->execution.plain);
    for (int l = 0; c->lanes && l < (int)w; l++)
        kmp_lanes_set_one(c->lanes, KMP_IN_CHART, l, e->eval->chart);
    e->beside[1] = c->lanes;
    return c->lanes;
}

/* -- one instance ------------------------------------------------------------------------------------ */

/* Keeps the evaluator's conditions as conditions of the current instance. */
static void keep_modes(const kmp_engine *e, kmp_instance *x)
{
    memcpy(x->mode, e->eval->conditions.mode, (size_t)e->s->events.count * sizeof *x->mode);
}

/* The crossing for the current instance; NULL: there are no conditions. */
static kmp_event_tracker *crossing_of(kmp_engine *e, kmp_instance *x)
{
    kmp_event_tracker *c = e->conditions ? e->conditions->passing : NULL;
    if (c)
        kmp_event_tracker_take(c, e->eval->conditions.mode, e->s->parameters, &e->eval->inputs, x->past);
    return c;
}

bool kmp_instance_begin_conditions(kmp_engine *e, kmp_instance *x, const double *q, const double *qd)
{
    kmp_event_tracker *c = crossing_of(e, x);
    if (!c)
        return true;
    kmp_event_tracker_begin_past(e->s, x->past);
    if (x->stood) { /* with modes, and accelerations */
        kmp_eval_all_changes(e->eval, 0, q, qd, e->site->room.qdd, e->site->room.lambda, c->change);
    } else {
        kmp_eval_freeze(e->eval, 0, q, qd);
        memcpy(c->change, kmp_eval_changes(e->eval, 0, q, qd), (size_t)e->s->events.count * sizeof *c->change);
    }
    kmp_event_tracker_hold_free(c, NULL, c->change);
    kmp_event_tracker_mark_start(c, x->t);
    keep_modes(e, x);
    return kmp_event_tracker_first_end(c) < 0;
}

bool kmp_instance_renew_conditions(kmp_engine *e, kmp_lane_group *pool, int i)
{
    kmp_instance *x = &e->instances[i];
    bool changed;
    if (!e->conditions || !kmp_lanes_takes(e->conditions->lanes, KMP_IN_TIME))
        return true;
    if (!kmp_instance_unpack(e, pool, i, true))
        return false;
    kmp_engine_hold_inputs(e, &x->inputs);
    kmp_event_tracker *c = crossing_of(e, x);
    const bool known = kmp_event_tracker_change(c, x->t, e->state, e->state + e->n, false, &changed) == KEMPE_OK;
    keep_modes(e, x);
    kmp_engine_hold_inputs(e, NULL);
    return known && kmp_event_tracker_first_end(c) < 0;
}

/* -- lanes ------------------------------------------------------------------------------------------- */

kmp_event_tracker *kmp_lane_watching(const kmp_engine *e, size_t l)
{
    return e->conditions ? e->conditions->watching[l] : NULL;
}

/* The values of late conditions, after the values of the others. */
static void add_late(kmp_engine *e, step_place *at, const double *vdd)
{
    kmp_lane_conditions *c = e->conditions;
    size_t w = e->room.w, n = (size_t)e->n;
    memcpy(at->rows + 3 * n * w, vdd + n * w, (size_t)e->m * w * sizeof *vdd);
    kmp_lanes_set(c->lanes, KMP_IN_QDD, at->rows + 2 * n * w);
    kmp_lanes_set(c->lanes, KMP_IN_LAMBDA, at->rows + 3 * n * w);
    const double *late = kmp_lanes_run(c->lanes, 2);
    for (size_t k = 0; k < (size_t)e->s->events.count; k++)
        if (e->s->events.condition[k].late) {
            memcpy(at->change + k * w, late, w * sizeof *late);
            late += w;
        }
}

/* Evaluates the conditions at one end of the steps of all lanes, 0 or 1, or in their middle, 2, whose times are in the
 * room. */
static void evaluate(kmp_engine *e, const kmp_lane_group *pool, int place, const double *y, const double *slope,
                     const double *vdd)
{
    kmp_lane_conditions *c = e->conditions;
    step_place *at = &c->place[place];
    size_t w = e->room.w, n = (size_t)e->n;
    kmp_lanes_spread(e, pool, y, slope, at->rows);
    double *qdd = at->rows + 2 * n * w;
    for (size_t k = 0, p = (size_t)e->p; vdd && k < p; k++)
        memcpy(qdd + (size_t)pool->part.u[k] * w, slope + (p + k) * w, w * sizeof *qdd);
    for (size_t k = 0; vdd && k < (size_t)e->r; k++)
        memcpy(qdd + (size_t)pool->part.v[k] * w, vdd + k * w, w * sizeof *qdd);
    kmp_lanes_set(c->lanes, KMP_IN_TIME, e->room.at);
    kmp_lanes_set(c->lanes, KMP_IN_Q, at->rows);
    kmp_lanes_set(c->lanes, KMP_IN_QD, at->rows + n * w);
    const double *values = kmp_lanes_run(c->lanes, 1);
    const size_t count = w * (size_t)e->s->events.count;
    memcpy(at->change, values, count * sizeof *values);
    if (c->solved > 0)
        memcpy(at->solved, values + count, w * c->solved * sizeof *values);
    if (vdd && e->room.late)
        add_late(e, at, vdd);
}

/* The values of a lane. */
static const kmp_event_probe *look_of(const kmp_engine *e, int place, size_t l, double t)
{
    kmp_lane_conditions *c = e->conditions;
    kmp_event_probe *look = &c->look[place];
    size_t w = e->room.w, n = (size_t)e->n,
           rows = e->room.late ? 3 * n + (size_t)e->m : (e->s->changes_by_rates ? 3 : 2) * n;
    look->t = t;
    for (size_t k = 0; k < (size_t)e->s->events.count; k++)
        look->change[k] = c->place[place].change[k * w + l];
    for (size_t k = 0; k < c->solved; k++)
        look->solved[k] = c->place[place].solved[k * w + l];
    for (size_t k = 0; k < rows; k++)
        look->state[k] = c->place[place].rows[k * w + l];
    return look;
}

/* True if the ends of a lane's step, and its `middle`, decide that no condition changes within it. */
static bool is_clear(kmp_engine *e, size_t l, bool middle)
{
    const kmp_lane_state *room = &e->room;
    const kmp_event_probe *from = look_of(e, 0, l, room->t[l]), *to = look_of(e, 1, l, room->t_new[l]);
    const kmp_event_probe *between = middle ? look_of(e, 2, l, room->t[l] + 0.5 * room->step[l]) : NULL;
    return kmp_event_tracker_is_clear(e->conditions->watching[l], from, between, to);
}

/* Makes the lane's instance the one whose conditions the evaluator has. */
static kmp_event_tracker *stand(kmp_engine *e)
{
    stand_within(e);
    return crossing_of(e, &e->instances[e->room.who[e->within.lane]]);
}

/* Searches the step of the lane of kmp_within_begin: *found, at *t; *shorter: the step is made again with this length,
 * 0: it is not. Returns the reason why lanes do not pass the event, or cannot search; NULL: they can. */
static const char *search(kmp_engine *e, double *t, bool *found, double *shorter)
{
    const kmp_lane_state *room = &e->room;
    size_t l = e->within.lane;
    kmp_instance *x = &e->instances[room->who[l]];
    kmp_event_tracker *c = stand(e);
    if (kmp_event_tracker_find(c, room->t[l], room->t_new[l], t, found) != KEMPE_OK)
        return KMP_LANE_NO_STATES;
    if (c->search.pieces.undecided > 0)
        return "a condition that cannot be resolved within a step";
    *shorter = *found ? kmp_event_tracker_shortens(c, room->t[l], *t, room->t_new[l], KMP_REPEATED_CONTACTS) : 0;
    if (!*found && !x->again && kmp_event_tracker_hold_passed(c)) {
        *found = true;
        *shorter = room->t_new[l] - room->t[l];
    }
    keep_modes(e, x);
    return !*found || *shorter > 0                      ? NULL
           : c->end >= 0                                ? "a condition that ends the run"
           : *t >= kmp_present_inputs_until(&x->inputs) ? "a condition that changes at a sample of an input"
           : kmp_sample_is_due(x->next_sample, *t)      ? "a condition that changes at a sample of a state"
                                                        : NULL;
}

bool kmp_lane_visit_event(kmp_engine *e, double t, bool pass)
{
    kmp_instance *x = &e->instances[e->room.who[e->within.lane]];
    const kmp_partition *part = &e->within.pool->part;
    kmp_event_tracker *c = stand(e);
    if ((pass ? kmp_event_tracker_pass(c, t, false) : kmp_event_tracker_look(c, t)) != KEMPE_OK)
        return false;
    if (pass)
        keep_modes(e, x);
    x->t = t;
    memcpy(e->state, c->q, (size_t)e->n * sizeof *c->q);
    memcpy(e->state + e->n, c->qd, (size_t)e->n * sizeof *c->qd);
    if (e->s->dissipative)
        x->y[e->n + part->p] = e->within.y[e->n + part->p];
    return true;
}

/* The conditions in the middle of the steps, for lanes that both ends do not decide. */
static void look_at_middle(kmp_engine *e, kmp_lane_group *pool)
{
    kmp_lane_state *room = &e->room;
    const kmp_dop853_step step = {.y = room->y, .h = room->step, .k = room->k, .y_new = room->y_new};
    double *const *wide = e->conditions->wide;
    kmp_lanes_interpolant(room->w, (size_t)e->size, &step, true, wide);
    kmp_lanes_interpolate(room->w, (size_t)e->size, KMP_LANE_VECTORS, wide, 0.5, room->stage);
    kmp_room_set_times(room, 0.5);
    kmp_room_evaluate(e, pool, room->stage, room->k[2]);
    for (size_t l = 0; l < room->w; l++) {
        room->dense_bad[l] = room->dense_bad[l] || room->bad[l] != 0;
        room->bad[l] = 0;
    }
    if (room->vdd)
        kmp_room_find_accelerations(e, pool, kmp_lanes_run(pool->lanes, KMP_REDUCED_PROGRAM_END), room->k[2],
                                    room->vdd_middle);
    evaluate(e, pool, 2, room->stage, room->k[2], room->vdd ? room->vdd_middle : NULL);
}

/* Searches the step of a lane for an event. It is made again, with half its length, where the dense output is less
 * exact. */
static kmp_attempt find_event(kmp_engine *e, kmp_lane_group *pool, size_t l)
{
    kmp_lane_state *room = &e->room;
    kmp_instance *x = &e->instances[room->who[l]];
    bool found = false;
    double shorter = 0;
    kmp_within_begin(e, pool, l);
    if (room->dense_bad[l])
        return KMP_ATTEMPT_BAD_STEP;
    prepare(e);
    if (kmp_rk_is_coarse(e->size, KMP_LANE_VECTORS, e->within.vector[KMP_LANE_VECTORS - 1], 1,
                         room->weight + e->within.lane, room->w))
        return KMP_ATTEMPT_BAD_STEP;
    const char *why = search(e, &room->event[l], &found, &shorter);
    kmp_within_end(e);
    if (why) {
        x->again = false;
        room->h[l] = room->step[l];
        kmp_lane_evict(e, l, why);
        return KMP_ATTEMPT_NONE;
    }
    bool again = found && shorter > 0 && !x->again;
    x->again = again;
    if (found && !again)
        return KMP_ATTEMPT_EVENT;
    kmp_lane_set_modes(e, pool, l);
    room->h[l] = again ? shorter : room->h[l];
    return again ? KMP_ATTEMPT_AGAIN : KMP_ATTEMPT_TAKEN;
}

bool kmp_taken_watch(kmp_engine *e, kmp_lane_group *pool, const kmp_lane_watched *seen, kmp_attempt *what,
                     bool *searched)
{
    kmp_lane_state *room = &e->room;
    double **k = room->k;
    bool dense = false;
    if (room->vdd)
        kmp_room_find_accelerations(e, pool, seen->multiplier, k[13], room->vdd_new);
    for (size_t l = 0; l < room->w; l++)
        room->at[l] = room->t_new[l];
    kmp_room_put_inputs(e);
    evaluate(e, pool, 1, room->y_new, k[13], room->vdd_new);
    kmp_room_set_times(room, 0);
    kmp_room_put_inputs(e);
    evaluate(e, pool, 0, room->y, k[1], room->vdd);
    for (size_t l = 0; l < room->w; l++) {
        searched[l] = what[l] == KMP_ATTEMPT_TAKEN && !is_clear(e, l, false);
        dense = dense || searched[l];
    }
    if (!dense)
        return false;
    kmp_room_run_dense_stages(e, pool);
    const bool middle = e->conditions->middle;
    if (middle)
        look_at_middle(e, pool);
    for (size_t l = 0; l < room->w; l++) {
        if (!searched[l])
            continue;
        e->results[room->who[l]].rhs += 3;
        if (!middle || room->dense_bad[l] || !is_clear(e, l, true))
            what[l] = find_event(e, pool, l);
    }
    return true;
}

/* -- events ------------------------------------------------------------------------------------------------- */

/* Impacts, changes of modes and of closures, and samples of states happen to an instance between two of its steps. It
 * is at the site of its engine, a run that makes no steps, where all this is decided as in any run. It continues
 * in lanes, with other conditions and perhaps other rows. */

kempe_status kmp_site_init(kmp_engine *e)
{
    const kempe_system *s = e->s;
    bool any = s->switches || s->load_row_count > 0 || kmp_model_has_samples(s->model) || kmp_has_late_conditions(s);
    for (int k = 0; k < s->events.count; k++)
        any = any || s->events.condition[k].role != KMP_ROLE_NONE;
    if (!any)
        return KEMPE_OK;
    KMP_TRY(kmp_runner_site_new(e->eval, &e->spec, &e->site));
    e->fresh = KMP_ARENA_NEW(&e->run_arena, char, kmp_runner_memory_size(e->s) + 1);
    KMP_TRY(kmp_made(e->context, e->fresh));
    kmp_runner_keep_memory(e->site, e->fresh);
    return KEMPE_OK;
}

/* Takes the state of an instance after its time at the site. */
static void depart(kmp_engine *e, kmp_instance *x)
{
    kmp_runner_keep_memory(e->site, x->memory);
    x->next_sample = kmp_runner_next_sample(e->site);
    if (e->conditions)
        keep_modes(e, x);
    if (e->eval->nu)
        memcpy(x->nu, e->eval->nu, (size_t)e->m * sizeof *x->nu);
    kmp_present_inputs_copy(&x->inputs, &e->eval->inputs);
    e->site->events.tracker = NULL;
}

kempe_status kmp_instance_restart(kmp_engine *e, kmp_instance *x, const kempe_assembly *a)
{
    kmp_runner *site = e->site;
    kmp_runner_take_memory(site, e->fresh, false);
    site->spec.inputs_start = &x->inputs;
    site->rate_scale = 0;
    kempe_status status = kmp_runner_begin_at(site, a);
    if (status == KEMPE_OK)
        depart(e, x);
    x->stood = status == KEMPE_OK;
    kmp_engine_hold_inputs(e, NULL);
    return status;
}

/* The rows of the site become the rows of a pool. */
static kempe_status take_rows(kmp_engine *e, const kmp_lane_group *from, double t)
{
    kmp_runner *site = e->site;
    kmp_partition_free(&site->part);
    KMP_TRY(kmp_made(e->context, kmp_partition_copy(&site->part, &from->part)));
    if (!e->s->switches)
        return KEMPE_OK;
    kmp_rank_margin_free(&site->margin);
    return kmp_runner_compute_margin(site, t, site->room.state);
}

/* Goes on in lanes, or in a separate run, from the site. */
static kempe_status go_on(kmp_engine *e, const kmp_lane_group *from, int i, double work)
{
    kmp_instance *x = &e->instances[i];
    kmp_runner *site = e->site;
    kmp_partition part;
    double limit = x->limit;
    memcpy(e->state, site->room.state, 2 * (size_t)e->n * sizeof *e->state);
    if (kmp_friction_is_smooth(site->sticking.friction))
        return kmp_instance_start_apart(e, i, site->part.r, 0, e->state, e->state + e->n, work, KMP_LANE_SMOOTH);
    KMP_TRY(kmp_made(e->context, kmp_partition_copy(&part, e->s->switches ? &site->part : &from->part)));
    if (e->s->switches)
        x->usual = part.r > 0 ? part.pivots[part.r - 1] : 1;
    if (e->s->dissipative)
        x->y[e->n + part.p] = work;
    x->seen_t = x->corrected.t = -1;
    kmp_eval_closure(e->eval, x->t, e->state);
    KMP_TRY(kmp_instance_go_on(e, i, KEMPE_OK, &part, e->state, e->state + e->n));
    x->limit = e->s->switches ? x->limit : limit;
    return KEMPE_OK;
}

kempe_status kmp_instance_pass(kmp_engine *e, kmp_lane_group *from, int i, bool event, double since)
{
    kmp_instance *x = &e->instances[i];
    kmp_runner *site = e->site;
    double work, before = e->s->dissipative ? x->y[e->n + from->part.p] : 0;
    memcpy(site->room.state, e->state, 2 * (size_t)e->n * sizeof *site->room.state);
    site->events.tracker = crossing_of(e, x);
    site->rate_scale = x->rate_scale;
    kempe_status status = kmp_instance_take_values(e, i); /* impacts have the settings of the model */
    kmp_constants_take(e->s, &x->constants);
    kmp_runner_take_memory(site, x->memory, false);
    if (status == KEMPE_OK)
        status = take_rows(e, from, x->t);
    if (status == KEMPE_OK)
        status = kmp_runner_pass_here(site, x->t, event, &work);
    if (status == KEMPE_OK)
        depart(e, x);
    if (event && e->s->switches) { /* pass_switch of runner_change.c */
        x->h = kmp_restart_length(x->h, since, KMP_FRICTION_INSTANT * e->spec.t_end,
                                  kmp_impact_since(site->sticking.impacts));
        x->has_step = x->h > 0;
    }
    kmp_engine_hold_inputs(e, NULL);
    if (status == KEMPE_OK)
        return go_on(e, from, i, before + work);
    kmp_free(site->reason);
    site->reason = NULL;
    site->events.ended = false;
    if (status != KEMPE_E_FAILED && status != KEMPE_STOPPED)
        return status;
    kmp_context_clear(e->context);
    kmp_instance_leave(e, i, "an event that needs a run of its own"); /* a run from the start says why */
    return KEMPE_OK;
}

kempe_status kmp_instance_meet(kmp_engine *e, kmp_lane_group *from, int i)
{
    if (!kmp_instance_unpack(e, from, i, true))
        return KEMPE_OK;
    kmp_engine_hold_inputs(e, &e->instances[i].inputs);
    return kmp_instance_pass(e, from, i, false, 0);
}
