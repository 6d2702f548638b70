/* SPDX-License-Identifier: BSD-3-Clause */
/* States within the present step of a lane: those of its interpolant, on closed loops. */
#include "ensemble/lanes/ensemble_within.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_start.h"
#include "integrators/steppers/rk.h"
#include <math.h>
#include <string.h>

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

bool kmp_within_is_exact(kmp_engine *e)
{
    const kmp_lane_state *room = &e->room;
    const kmp_lane_within *in = &e->within;
    prepare(e);
    return !kmp_rk_is_coarse(e->size, KMP_LANE_VECTORS, in->vector[KMP_LANE_VECTORS - 1], 1, room->weight + in->lane,
                             room->w);
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

void kmp_within_stand(kmp_engine *e)
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
    kmp_within_stand(e);
    prepare(e);
    kmp_rk_interpolate(e->size, KMP_LANE_VECTORS, in->vector, (t - room->t[in->lane]) / room->step[in->lane], in->y);
    return kmp_instance_state(e, in->pool, t, in->y, q, qd, true) &&
           (!rates || kmp_instance_complete(e, in->pool, qd, qdd, lambda));
}
