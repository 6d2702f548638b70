/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of instances in lanes. Their values at both ends of a step are evaluated in all lanes together, and bounds
 * between them decide most steps. The search of a run decides the others one by one, and locates the event. */
#include "ensemble/lanes/ensemble_conditions.h"
#include "constraints/evaluation/evaluator.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_within.h"
#include "ensemble/lanes/lane_state.h"
#include "integrators/run/events.h"
#include "integrators/steppers/rk.h"
#include <string.h>

enum { PLACES = 3 }; /* of the present steps: both ends, and the middle */

/* A place of the present steps, by lanes. */
typedef struct step_place {
    double *rows;   /* 3 n + m: q, qd, qdd, lambda */
    double *change; /* of each condition */
} step_place;

struct kmp_lane_conditions {
    kmp_lanes *lanes; /* the program of conditions */
    double *mode;     /* of all lanes */
    step_place place[PLACES];
    double *wide[KMP_LANE_VECTORS];              /* size: the interpolants, if some are late */
    kmp_event_probe look[PLACES];                /* of one lane */
    kmp_event_tracker *watching[KMP_LANES_MOST]; /* of each lane, with the numbers of its instance */
    kmp_event_tracker *passing;                  /* of the current instance */
};

const char *kmp_conditions_no_lanes(const kempe_system *s)
{
    if (s->changes && s->changes->outputs[2] > s->changes->outputs[1] + s->events.count)
        return "conditions of solved equations";
    return NULL;
}

bool kmp_has_late_conditions(const kempe_system *s)
{
    bool any = false;
    for (int k = 0; k < s->events.count; k++)
        any = any || s->events.condition[k].late;
    return any;
}

static kempe_status state_within(void *user, double t, bool rates, bool again, double *q, double *qd, double *qdd,
                                 double *lambda)
{
    (void)again;
    return kmp_within_state(user, t, rates, q, qd, qdd, lambda) ? KEMPE_OK : KEMPE_E_FAILED;
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
    for (int k = 0; e->room.late && k < KMP_LANE_VECTORS; k++)
        c->wide[k] = kmp_arena_aligned(a, w * (size_t)kmp_lane_most(e));
    for (int i = 0; i < PLACES; i++) {
        c->place[i].rows = kmp_arena_aligned(a, w * (3 * n + (size_t)e->m));
        (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, w *count, &c->place[i].change),
                             KMP_ROOM(double, count, &c->look[i].change),
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

void kmp_instance_keep_modes(const kmp_engine *e, kmp_instance *x)
{
    memcpy(x->mode, e->eval->mode, (size_t)e->s->events.count * sizeof *x->mode);
}

kmp_event_tracker *kmp_instance_crossing(kmp_engine *e, kmp_instance *x)
{
    kmp_event_tracker *c = e->conditions ? e->conditions->passing : NULL;
    if (c)
        kmp_event_tracker_take(c, e->eval->mode, e->s->parameters, &e->eval->inputs, x->past);
    return c;
}

bool kmp_instance_begin_conditions(kmp_engine *e, kmp_instance *x, const double *q, const double *qd)
{
    kmp_event_tracker *c = kmp_instance_crossing(e, x);
    if (!c)
        return true;
    kmp_event_tracker_begin_past(e->s, x->past);
    if (x->stood) { /* with modes, and accelerations */
        kmp_eval_all_changes(e->eval, 0, q, qd, e->site->qdd, e->site->lambda, c->change);
    } else {
        kmp_eval_freeze(e->eval, 0, q, qd);
        memcpy(c->change, kmp_eval_changes(e->eval, 0, q, qd), (size_t)e->s->events.count * sizeof *c->change);
    }
    kmp_event_tracker_hold_free(c, NULL, c->change);
    kmp_instance_keep_modes(e, x);
    return kmp_event_tracker_first_end(c) < 0;
}

/* -- lanes ------------------------------------------------------------------------------------------- */

kmp_event_tracker *kmp_lane_watching(const kmp_engine *e, size_t l)
{
    return e->conditions ? e->conditions->watching[l] : NULL;
}

/* The values of late conditions, after those of the others. */
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
    memcpy(at->change, kmp_lanes_run(c->lanes, 1), w * (size_t)e->s->events.count * sizeof(double));
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
    kmp_within_stand(e);
    return kmp_instance_crossing(e, &e->instances[e->room.who[e->within.lane]]);
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
        return "a condition that is not decided within a step";
    *shorter = *found ? kmp_event_tracker_shortens(c, room->t[l], *t, room->t_new[l], KMP_REPEATED_CONTACTS) : 0;
    if (!*found && !x->again && kmp_event_tracker_hold_passed(c)) {
        *found = true;
        *shorter = room->t_new[l] - room->t[l];
    }
    kmp_instance_keep_modes(e, x);
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
        kmp_instance_keep_modes(e, x);
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
    kmp_room_find_accelerations(e, pool, kmp_lanes_run(pool->lanes, KMP_REDUCED_PROGRAM_END), room->k[2],
                                room->vdd_middle);
    evaluate(e, pool, 2, room->stage, room->k[2], room->vdd_middle);
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
    if (room->dense_bad[l] || !kmp_within_is_exact(e))
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
    const bool middle = room->late;
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
