/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of instances in lanes. Their values at both ends of a step are evaluated in all lanes together, and bounds
 * between them decide most steps. The search of a run decides the others one by one, and locates the event. */
#include "integrators/lanes/ensemble_inside.h"
#include "integrators/run/events.h"
#include <string.h>

/* An end of the present steps, by lanes. */
typedef struct step_end {
    double *rows;   /* 3 n: q, qd, qdd */
    double *change; /* of each condition */
} step_end;

struct kmp_lane_conditions {
    kmp_lanes *lanes; /* the program of conditions */
    double *mode;     /* of all lanes */
    step_end end[2];
    kmp_look look[2];                       /* of one lane */
    kmp_crossing *watching[KMP_LANES_MOST]; /* of each lane, with the numbers of its instance */
    kmp_crossing *passing;                  /* of the current instance */
};

const char *kmp_conditions_no_lanes(const kempe_system *s)
{
    for (int k = 0; k < s->events.count; k++) {
        const kmp_condition *condition = &s->events.condition[k];
        if (condition->role != KMP_ROLE_NONE)
            return "friction that sticks, or rigid contacts";
        if (condition->late)
            return "conditions of accelerations or multipliers";
    }
    if (s->switches)
        return "closures that switch";
    if (s->changes && s->changes->outputs[2] > s->changes->outputs[1] + s->events.count)
        return "conditions of solved equations";
    return NULL;
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
    const kmp_crossing_plan plan = {.system = e->s,
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
    for (int i = 0; i < 2; i++) {
        c->end[i].rows = kmp_arena_aligned(a, w * 3 * n);
        (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, w *count, &c->end[i].change),
                             KMP_ROOM(double, count, &c->look[i].change),
                             KMP_ROOM(double, 3 * e->n + e->m, &c->look[i].state));
    }
    for (size_t l = 0; l < w && !a->failed; l++)
        c->watching[l] = kmp_crossing_new(&plan, a);
    c->passing = a->failed ? NULL : kmp_crossing_new(&plan, a);
    c->lanes = a->failed || !c->passing ? NULL : kmp_lanes_new(e->s->changes, (int)w, e->execution.plain);
    for (int l = 0; c->lanes && l < (int)w; l++)
        kmp_lanes_set_one(c->lanes, KMP_IN_CHART, l, e->eval->chart);
    return c->lanes;
}

void kmp_conditions_free(kmp_engine *e)
{
    if (e->conditions)
        kmp_lanes_free(e->conditions->lanes);
    e->conditions = NULL;
}

/* -- one instance ------------------------------------------------------------------------------------ */

void kmp_instance_keep_modes(const kmp_engine *e, kmp_instance *x)
{
    memcpy(x->mode, e->eval->mode, (size_t)e->s->events.count * sizeof *x->mode);
}

/* The crossing of an instance that is current. */
static kmp_crossing *take(kmp_engine *e, kmp_instance *x)
{
    kmp_crossing *c = e->conditions->passing;
    kmp_crossing_take(c, e->eval->mode, e->s->parameters, &e->eval->inputs, x->past);
    return c;
}

bool kmp_instance_begin_conditions(kmp_engine *e, kmp_instance *x, const double *q, const double *qd)
{
    if (!e->conditions)
        return true;
    kmp_crossing_begin_past(e->s, x->past);
    kmp_crossing *c = take(e, x);
    kmp_eval_freeze(e->eval, 0, q, qd);
    memcpy(c->change, kmp_eval_changes(e->eval, 0, q, qd), (size_t)e->s->events.count * sizeof *c->change);
    kmp_crossing_hold_free(c, c->change);
    kmp_instance_keep_modes(e, x);
    return kmp_crossing_first_end(c) < 0;
}

/* -- lanes ------------------------------------------------------------------------------------------- */

void kmp_lane_conditions_load(kmp_engine *e, kmp_pool *pool, size_t l)
{
    kmp_instance *x = &e->instances[e->room.who[l]];
    if (!e->conditions)
        return;
    kmp_lanes_set_one(e->conditions->lanes, KMP_IN_PARAMETER, (int)l, x->constants.numbers);
    kmp_crossing_take(e->conditions->watching[l], x->mode, x->constants.numbers, &x->inputs, x->past);
    kmp_lane_set_modes(e, pool, l);
}

void kmp_lane_set_modes(kmp_engine *e, kmp_pool *pool, size_t l)
{
    const double *mode = e->instances[e->room.who[l]].mode;
    kmp_lanes_set_one(e->conditions->lanes, KMP_IN_MODE, (int)l, mode);
    kmp_lanes_set_one(pool->lanes, KMP_IN_MODE, (int)l, mode);
    kmp_lane_measured_modes(e, pool, l, mode);
}

void kmp_conditions_constants(kmp_engine *e)
{
    if (e->conditions)
        (void)kmp_lanes_run(e->conditions->lanes, KMP_STAGE_PARAMETERS);
}

/* Accelerations of all lanes from the slopes and those of v. */
static void spread_accelerations(const kmp_engine *e, const kmp_pool *pool, const double *slope, const double *vdd,
                                 double *qdd)
{
    size_t w = e->room.w, p = (size_t)e->p;
    for (size_t k = 0; k < p; k++)
        memcpy(qdd + (size_t)pool->part.u[k] * w, slope + (p + k) * w, w * sizeof *qdd);
    for (size_t k = 0; k < (size_t)e->r; k++)
        memcpy(qdd + (size_t)pool->part.v[k] * w, vdd + k * w, w * sizeof *qdd);
}

void kmp_lanes_conditions(kmp_engine *e, const kmp_pool *pool, int end, const double *y, const double *slope,
                          const double *vdd)
{
    kmp_lane_conditions *c = e->conditions;
    size_t w = e->room.w, n = (size_t)e->n;
    kmp_lanes_spread(e, pool, y, slope, c->end[end].rows);
    if (e->s->changes_by_rates)
        spread_accelerations(e, pool, slope, vdd, c->end[end].rows + 2 * n * w);
    kmp_lanes_set(c->lanes, KMP_IN_TIME, e->room.at);
    kmp_lanes_set(c->lanes, KMP_IN_Q, c->end[end].rows);
    kmp_lanes_set(c->lanes, KMP_IN_QD, c->end[end].rows + n * w);
    memcpy(c->end[end].change, kmp_lanes_run(c->lanes, 1), w * (size_t)e->s->events.count * sizeof(double));
}

/* The values of a lane. */
static const kmp_look *look_of(const kmp_engine *e, int end, size_t l, double t)
{
    kmp_lane_conditions *c = e->conditions;
    kmp_look *look = &c->look[end];
    size_t w = e->room.w, rows = (e->s->changes_by_rates ? 3 : 2) * (size_t)e->n;
    look->t = t;
    for (size_t k = 0; k < (size_t)e->s->events.count; k++)
        look->change[k] = c->end[end].change[k * w + l];
    for (size_t k = 0; k < rows; k++)
        look->state[k] = c->end[end].rows[k * w + l];
    return look;
}

bool kmp_lane_is_clear(kmp_engine *e, size_t l)
{
    const kmp_lane_room *room = &e->room;
    const kmp_look *from = look_of(e, 0, l, room->t[l]), *to = look_of(e, 1, l, room->t_new[l]);
    return kmp_crossing_is_clear(e->conditions->watching[l], from, to);
}

/* Makes the lane's instance the one whose conditions the evaluator has. */
static kmp_crossing *stand(kmp_engine *e)
{
    kmp_within_stand(e);
    return take(e, &e->instances[e->room.who[e->within.lane]]);
}

const char *kmp_lane_find_event(kmp_engine *e, double *t, bool *found)
{
    const kmp_lane_room *room = &e->room;
    size_t l = e->within.lane;
    kmp_instance *x = &e->instances[room->who[l]];
    kmp_crossing *c = stand(e);
    if (kmp_crossing_find(c, room->t[l], room->t_new[l], t, found) != KEMPE_OK)
        return KMP_LANE_NO_STATES;
    kmp_instance_keep_modes(e, x);
    return !*found                                      ? NULL
           : c->end >= 0                                ? "a condition that ends the run"
           : *t >= kmp_present_inputs_until(&x->inputs) ? "a condition that changes at a sample of an input"
                                                        : NULL;
}

bool kmp_lane_pass_event(kmp_engine *e, double t)
{
    kmp_instance *x = &e->instances[e->room.who[e->within.lane]];
    const kmp_partition *part = &e->within.pool->part;
    kmp_crossing *c = stand(e);
    if (kmp_crossing_pass(c, t, false) != KEMPE_OK)
        return false;
    kmp_instance_keep_modes(e, x);
    x->t = t;
    memcpy(e->state, c->q, (size_t)e->n * sizeof *c->q);
    memcpy(e->state + e->n, c->qd, (size_t)e->n * sizeof *c->qd);
    if (e->s->dissipative)
        x->y[e->n + part->p] = e->within.y[e->n + part->p];
    return true;
}
