/* SPDX-License-Identifier: BSD-3-Clause */
/* Accepted steps of lanes between their ends: events within them, and the quantities that instances measure. */
#include "integrators/lanes/ensemble_room.h"
#include <math.h>

void kmp_lanes_evaluate_within(kmp_engine *e, kmp_pool *pool, double place)
{
    kmp_lane_room *room = &e->room;
    kmp_lanes_within(e, place, room->stage);
    kmp_room_set_times(room, place);
    kmp_room_evaluate(e, pool, room->stage, room->k[2]);
}

static void sample_end(kmp_engine *e, kmp_pool *pool, int point, const double *y, const double *slope)
{
    kmp_room_set_times(&e->room, point > 0);
    kmp_room_put_inputs(e);
    kmp_lanes_sample(e, pool, point, y, slope);
}

/* Samples every so many points of the step; at its ends the slopes are known. */
static void sample_every(kmp_engine *e, kmp_pool *pool, int every)
{
    kmp_lane_room *room = &e->room;
    int last = kmp_lanes_points(e, pool) - 1;
    if (last < 0)
        return;
    sample_end(e, pool, 0, room->y, room->k[1]);
    for (int point = every; point < last; point += every) {
        /* Samples the quantities at a point of the interpolants. */
        kmp_lanes_evaluate_within(e, pool, kmp_lanes_place(point));
        kmp_lanes_sample(e, pool, point, e->room.stage, e->room.k[2]);
    }
    sample_end(e, pool, last, room->y_new, room->k[13]);
}

/* Finds the accepted steps that must be measured, and passes over the others. Returns their number. */
static int find_measured(kmp_engine *e, kmp_pool *pool, const kmp_lane_outcome *what, bool *measured)
{
    kmp_lane_room *room = &e->room;
    bool may_pass = kmp_lanes_may_pass(e, pool);
    int count = 0;
    if (may_pass) {
        kmp_lanes_prepare(e, true);
        sample_every(e, pool, 2);
    }
    for (size_t l = 0; l < room->w; l++) {
        measured[l] = what[l] == KMP_LANE_EVENT ||
                      (what[l] == KMP_LANE_TAKEN && !(may_pass && room->bad[l] == 0 && kmp_lane_pass(e, pool, l)));
        count += measured[l];
        room->bad[l] = 0;
    }
    return count;
}

/* The conditions in the middle of the steps, for lanes that both ends do not decide. */
static void look_at_middle(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    kmp_lanes_middle(e, room->stage);
    kmp_room_set_times(room, 0.5);
    kmp_room_evaluate(e, pool, room->stage, room->k[2]);
    for (size_t l = 0; l < room->w; l++) {
        room->dense_bad[l] = room->dense_bad[l] || room->bad[l] != 0;
        room->bad[l] = 0;
    }
    kmp_room_find_accelerations(e, pool, kmp_lanes_run(pool->lanes, KMP_FUSED_END), room->k[2], room->vdd_middle);
    kmp_lanes_conditions(e, pool, 2, room->stage, room->k[2], room->vdd_middle);
}

/* Searches the step of a lane for an event. It is made again, with half its length, where the dense output is less
 * exact. */
static kmp_lane_outcome find_event(kmp_engine *e, kmp_pool *pool, size_t l)
{
    kmp_lane_room *room = &e->room;
    kmp_instance *x = &e->instances[room->who[l]];
    bool found = false;
    double shorter = 0;
    kmp_within_begin(e, pool, l);
    if (room->dense_bad[l] || !kmp_within_is_exact(e))
        return KMP_LANE_BAD_STEP;
    const char *why = kmp_lane_find_event(e, &room->event[l], &found, &shorter);
    kmp_within_end(e);
    if (why) {
        x->again = false;
        room->h[l] = room->step[l];
        kmp_room_expel(e, l, why);
        return KMP_LANE_EMPTY;
    }
    bool again = found && shorter > 0 && !x->again;
    x->again = again;
    if (found && !again)
        return KMP_LANE_EVENT;
    kmp_lane_set_modes(e, pool, l);
    room->h[l] = again ? shorter : room->h[l];
    return again ? KMP_LANE_AGAIN : KMP_LANE_TAKEN;
}

bool kmp_taken_watch(kmp_engine *e, kmp_pool *pool, const kmp_lane_watched *seen, kmp_lane_outcome *what,
                     bool *searched)
{
    kmp_lane_room *room = &e->room;
    double **k = room->k;
    bool dense = false;
    if (room->vdd)
        kmp_room_find_accelerations(e, pool, seen->multiplier, k[13], room->vdd_new);
    for (size_t l = 0; l < room->w; l++)
        room->at[l] = room->t_new[l];
    kmp_room_put_inputs(e);
    kmp_lanes_conditions(e, pool, 1, room->y_new, k[13], room->vdd_new);
    kmp_room_set_times(room, 0);
    kmp_room_put_inputs(e);
    kmp_lanes_conditions(e, pool, 0, room->y, k[1], room->vdd);
    for (size_t l = 0; l < room->w; l++) {
        searched[l] = what[l] == KMP_LANE_TAKEN && !kmp_lane_is_clear(e, l, false);
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
        if (!middle || room->dense_bad[l] || !kmp_lane_is_clear(e, l, true))
            what[l] = find_event(e, pool, l);
    }
    return true;
}

/* Takes a step into the account of its instance. A step without exact states between its ends is left to a separate run
 * from its beginning; an account that has some of its states is made anew by a run from the start. */
static kmp_lane_outcome measure_one(kmp_engine *e, kmp_pool *pool, size_t l, double end, bool bad,
                                    kmp_lane_outcome what)
{
    kmp_lane_room *room = &e->room;
    if (what == KMP_LANE_TAKEN && (bad || !kmp_lane_is_exact(e, l))) {
        e->instances[room->who[l]].again = false;
        room->h[l] = room->step[l];
        kmp_room_expel(e, l, KMP_LANE_NO_STATES);
        return KMP_LANE_EMPTY;
    }
    if (!bad && kmp_lane_measure(e, pool, l, end))
        return what;
    kmp_instance_leave(e, room->who[l], KMP_LANE_NO_STATES);
    kmp_room_empty(room, l);
    return KMP_LANE_EMPTY;
}

void kmp_taken_measure(kmp_engine *e, kmp_pool *pool, const bool *searched, kmp_lane_outcome *what)
{
    kmp_lane_room *room = &e->room;
    bool measured[KMP_LANES_MOST] = {false};
    if (find_measured(e, pool, what, measured) == 0)
        return;
    if (!searched)
        kmp_room_run_dense_stages(e, pool);
    kmp_lanes_prepare(e, false);
    sample_every(e, pool, 1);
    for (size_t l = 0; l < room->w; l++) {
        bool bad = room->bad[l] != 0 || room->dense_bad[l];
        room->bad[l] = 0;
        if (!measured[l])
            continue;
        e->results[room->who[l]].rhs += searched && searched[l] ? 0 : 3;
        double end = what[l] == KMP_LANE_EVENT ? room->event[l] : room->t_new[l];
        if (end > room->t[l])
            what[l] = measure_one(e, pool, l, end, bad, what[l]);
    }
}
