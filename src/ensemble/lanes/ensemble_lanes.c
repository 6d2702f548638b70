/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853 on the lanes of a pool: an attempt of a step in every lane, then for each lane the decisions of rk.c and
 * reduced.c. Lanes of instances that have finished, or that another pool continues, are filled again. */
#include "ensemble/lanes/ensemble_lanes.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_apart.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/ensemble_watch.h"
#include "ensemble/lanes/ensemble_within.h"
#include "ensemble/lanes/lane_events.h"
#include "ensemble/lanes/lane_group.h"
#include "ensemble/lanes/lane_state.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/steppers/rk.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <math.h>
#include <string.h>

/* -- one attempt ------------------------------------------------------------------------------------- */

/* Chooses the steps to try; an instance with too small a step is left to a separate run. */
static void choose_tries(kmp_engine *e)
{
    kmp_lane_state *room = &e->room;
    double longest = e->spec.max_step > 0 ? e->spec.max_step : INFINITY;
    int64_t none;
    kmp_lanes_choose_tries(room->w, room, longest, &none);
    memset(room->bad, 0, room->w * sizeof *room->bad);
    for (size_t l = 0; none && l < room->w; l++)
        if (room->step[l] == 0 && room->who[l] >= 0)
            kmp_lane_evict(e, l, "a step size that becomes too small");
}

/* -- control ----------------------------------------------------------------------------------------- */

static void refuse(kmp_engine *e, size_t l, kmp_attempt what)
{
    kmp_lane_state *room = &e->room;
    kmp_ensemble_result *result = &e->results[room->who[l]];
    const bool by_error = what == KMP_ATTEMPT_BAD_ERROR;
    result->rejected += by_error;
    result->refused += !by_error;
    room->h[l] = by_error ? room->next[l] : kmp_step_retry(what, room->step[l]);
    room->rejected[l] = true;
    if (++room->tries[l] >= KMP_STEP_ATTEMPTS)
        kmp_lane_evict(e, l, "a step size that becomes too small");
}

/* True if value or rate of an input jumps at t that a closure depends on. */
static bool moves_closure(const kempe_model *model, const kmp_present_inputs *inputs, double t)
{
    for (int k = 0; k < inputs->count; k++)
        if (kmp_same_time(inputs->piece[k].from, t) && inputs->piece[k].jump < 2 && kmp_model_moved_by(model, k))
            return true;
    return false;
}

/* Goes on beyond a sample at which the step has ended: restarts where a value jumps (runner_change.c), at the site if
 * there is one (*meets). Returns the reason why it cannot. */
static const char *pass_sample(kmp_engine *e, size_t l, bool *meets)
{
    kmp_lane_state *room = &e->room;
    kmp_instance *x = &e->instances[room->who[l]];
    bool sampled = x->next_sample < INFINITY && kmp_sample_is_due(x->next_sample, room->t[l]);
    int input, jump = KMP_SIGNAL_SMOOTH;
    *meets = sampled;
    if (!sampled && room->t[l] < room->until[l]) {
        x->pace = 0;
        return NULL;
    }
    if (room->t[l] >= room->until[l])
        jump = kmp_present_inputs_enter(&x->inputs, room->t[l], &input);
    kmp_room_find_limit(e, l);
    if (jump < 2 && moves_closure(e->s->model, &x->inputs, room->t[l])) /* a separate run names it */
        return "an input of a closure that jumps";
    if (jump > 0 && !sampled)
        return NULL;
    room->h[l] = x->pace = fmax(room->h[l], x->pace);
    if ((*meets = e->site != NULL))
        return NULL;
    room->error_old[l] = KMP_RK_ERROR_FLOOR;
    x->has_slope = false;
    x->signs.known = false;
    room->anew = true;
    return NULL;
}

/* True if a joint's angles are due to be centred. */
static bool is_uncentred(kmp_engine *e, const kmp_lane_group *pool, size_t l)
{
    const kmp_lane_state *room = &e->room;
    if (e->spec.own_angles || kmp_charts_count(e->s) == 0)
        return false;
    for (int k = 0; k < e->p; k++)
        e->state[pool->part.u[k]] = room->y[(size_t)k * room->w + l];
    for (int k = 0; k < e->r; k++)
        e->state[pool->part.v[k]] = room->y[(size_t)(2 * e->p + k) * room->w + l];
    return !kmp_instance_has_angles(e, e->state, KMP_AXES_CENTRED);
}

/* The dependent coordinate with the largest scaled |Bvu|, for one degree of freedom; otherwise -1. */
static int largest_growth(const kmp_engine *e, const kmp_lane_group *pool, const kmp_lane_watched *seen, size_t l)
{
    const kmp_lane_state *room = &e->room;
    int largest = -1;
    double most = 0;
    for (int k = 0; k < e->r && e->p == 1; k++) {
        double growth = fabs(seen->b[(size_t)k * room->w + l]) * room->per_scale[(size_t)pool->part.v[k] * room->w + l];
        if (growth > most) {
            most = growth;
            largest = k;
        }
    }
    return largest;
}

/* True for a motion that grows without end, as in a run (check_growth of run.c), which then says so by name. Before
 * half of the steps that such a motion needs, its size is not looked at. */
static bool grows_without_end(const kmp_engine *e, const kmp_lane_group *pool, kmp_instance *x, size_t l, double tried)
{
    const kmp_lane_state *room = &e->room;
    const int w = (int)room->w;
    if (x->bound.most != 0 || tried < fmax(x->growth.next, 0.5 * KMP_GROWTH_STEPS))
        return false;
    const double size = kmp_growth_size(e->size, w, room->y + l, room->atol + l, e->spec.atol);
    return kmp_growth_is_endless(&x->growth, tried, room->t[l], size) &&
           kmp_growth_explodes(e->p, pool->part.u, kmp_model_coordinates(e->s->model), w, room->y + e->p * w + l,
                               room->scale + l, x->rate_scale) >= 0;
}

/* The number of further attempts before a bound of work or the growth must be looked at. */
static long spare_steps(const kmp_instance *x, long tried)
{
    const long spare = kmp_work_bound_spare(&x->bound, tried);
    const long look = (long)fmax(x->growth.next, 0.5 * KMP_GROWTH_STEPS) - tried - 1;
    return x->bound.most == 0 && look < spare ? look : spare;
}

/* Continues a lane, finishes its instance, or leaves it to another pool or a separate run. */
static kempe_status take(kmp_engine *e, kmp_lane_group *pool, const kmp_lane_watched *seen, size_t l)
{
    kmp_lane_state *room = &e->room;
    int i = room->who[l];
    kmp_instance *x = &e->instances[i];
    double h = room->step[l];
    bool collapsed = kmp_step_collapsed(&x->hopeless, h, room->t_new[l]);
    kmp_ensemble_result *result = &e->results[i];
    result->steps++;
    room->h[l] = kmp_step_after_failures(room->next[l], h, room->rejected[l]);
    room->error_old[l] = kmp_step_known_error(room->error[l]);
    x->again = false;
    room->rejected[l] = room->tries[l] = 0;
    room->t[l] = room->t_new[l];
    bool through = !(room->t[l] < e->spec.t_end), meets = false;
    long tried = result->steps + result->rejected + result->refused;
    bool slow = kmp_work_bound_passed(&x->bound, tried, room->t[l], e->spec.t_end, NULL) ||
                grows_without_end(e, pool, x, l, (double)tried);
    bool reorders = !through && pool->layout.multipliers > 0 && kmp_lane_order_is_bad(e, pool, seen, l);
    if (seen->quiet[l] && !collapsed && !slow && !reorders) {
        x->pace = 0;
        x->seen_margin = INFINITY;
        x->seen_t = -1;
        room->spare[l] = x->hopeless > 0 || e->conditions || kmp_measures_steps(e) || pool->layout.multipliers > 0
                             ? 0
                             : spare_steps(x, tried);
        return KEMPE_OK;
    }
    const char *jump = through ? NULL : pass_sample(e, l, &meets);
    const char *why = through     ? NULL
                      : jump      ? jump
                      : collapsed ? "a step size that becomes too small"
                      : slow      ? "too much work"
                      : kmp_dropped_open(e->r, pool->part.rows, e->m - e->r, pool->part.redundant, (ptrdiff_t)room->w,
                                         seen->h + l, room->row_scale + l, e->spec.atol + e->spec.rtol, 0) >= 0
                          ? "redundant closure rows that do not close"
                      : is_uncentred(e, pool, l) ? KMP_LANE_SINGULAR_ANGLES
                      : e->r > 0 && kmp_instance_nears_change(x, room->t[l], h, seen->margin[l])
                          ? "a change point during the run"
                          : NULL;
    bool changes = !through && !why && e->m > e->r && kmp_dropped_judge(seen->rows[l]) != KMP_KEPT_WELL;
    bool exchanges = !through && !why && !changes && e->r > 0 && seen->growth[l] > x->limit;
    if (!through && !why && !changes && !exchanges && !reorders && !meets)
        return KEMPE_OK;
    int swapped = exchanges && !e->conditions && !e->site && !room->nu ? largest_growth(e, pool, seen, l) : -1;
    kmp_room_store(e, l);
    kmp_room_empty(room, l);
    if (through)
        return kmp_instance_finish(e, pool, i);
    if (why && !slow)
        return kmp_instance_apart(e, pool, i, e->r > 0 ? fmin(1, seen->margin[l]) : 1, why);
    if (why) {
        kmp_instance_leave(e, i, why);
        return KEMPE_OK;
    }
    return meets          ? kmp_instance_meet(e, pool, i)
           : changes      ? kmp_instance_change_rows(e, pool, i)
           : swapped >= 0 ? kmp_instance_swap(e, pool, i, swapped)
           : exchanges    ? kmp_instance_exchange(e, pool, i)
                          : kmp_instance_reorder(e, pool, i);
}

/* Passes the event of a lane: the instance goes on from there with other conditions and the same step size. */
static kempe_status pass_event(kmp_engine *e, kmp_lane_group *pool, size_t l)
{
    kmp_lane_state *room = &e->room;
    int i = room->who[l];
    kmp_instance *x = &e->instances[i];
    kmp_ensemble_result *result = &e->results[i];
    result->steps++;
    x->tries = 0;
    x->has_step = true;
    x->h = room->step[l];
    x->error_old = room->error_old[l];
    x->pace = 0;
    kmp_within_begin(e, pool, l);
    bool known = kmp_lane_visit_event(e, room->event[l], !e->site);
    bool slow = known && kmp_work_bound_passed(&x->bound, result->steps + result->rejected + result->refused, x->t,
                                               e->spec.t_end, NULL);
    kempe_status status = KEMPE_OK;
    if (!known || slow)
        kmp_instance_leave(e, i, known ? "too much work" : "conditions that change back and forth");
    else if (e->site)
        status = kmp_instance_pass(e, pool, i, true, x->t - room->t[l]);
    kmp_within_end(e);
    kmp_room_empty(room, l);
    kmp_context_clear(e->context);
    return known && !slow && !e->site ? kmp_instance_resume(e, pool, i) : status;
}

/* Exchanges two arrays of the room, but for the lanes that stay; NULL: none does. */
static void exchange_taken(const kmp_lane_state *room, size_t size, const int64_t *stays, double **a, double **b)
{
    double *from = *b, *to = *a;
    *a = from;
    *b = to;
    if (stays)
        kmp_lanes_exchange(room->w, size, stays, to, from);
}

/* The ends of the steps that are taken become the beginnings of the next ones. */
static void pass_on(kmp_engine *e, const int64_t *stays)
{
    kmp_lane_state *room = &e->room;
    exchange_taken(room, (size_t)e->size, stays, &room->y, &room->y_new);
    exchange_taken(room, (size_t)e->size, stays, &room->k[1], &room->k[13]);
    if (room->vdd)
        exchange_taken(room, (size_t)e->n + (size_t)e->m, stays, &room->vdd, &room->vdd_new);
    if (room->nu)
        exchange_taken(room, (size_t)e->m, stays, &room->nu, &room->nu_end);
}

/* Computes the solutions of the steps in all lanes with their errors, infinite where a stage has failed, and the
 * next step sizes. */
static void solve(kmp_engine *e, double *failed)
{
    kmp_lane_state *room = &e->room;
    const kmp_dop853_step solution = {room->y,      room->step,  room->atol,   room->k,
                                      e->spec.rtol, room->y_new, room->weight, room->error};
    kmp_lanes_solution(room->w, (size_t)e->size, &solution);
    kmp_lanes_next_steps(room->w, room);
    memcpy(failed, room->bad, room->w * sizeof *failed);
    for (size_t l = 0; l < room->w; l++)
        room->error[l] = failed[l] != 0 ? INFINITY : room->error[l];
    memset(room->bad, 0, room->w * sizeof *room->bad);
}

/* Decides on the attempts of lanes that do not go on by themselves, and takes those that are accepted. */
static kempe_status end_attempts(kmp_engine *e, kmp_lane_group *pool, kmp_lane_watched *seen, kmp_lane_attempts *ends)
{
    kmp_lane_state *room = &e->room;
    kmp_attempt what[KMP_LANES_MOST] = {KMP_ATTEMPT_NONE};
    kempe_status status = KEMPE_OK;
    /* Decides on the attempts of the lanes that do not go on by themselves. */
    for (size_t l = 0; l < room->w; l++) {
        what[l] = room->who[l] < 0                         ? KMP_ATTEMPT_NONE
                  : ends->failed[l] != 0                   ? KMP_ATTEMPT_BAD_STAGE
                  : kmp_step_passes(room->error[l], false) ? KMP_ATTEMPT_TAKEN
                                                           : KMP_ATTEMPT_BAD_ERROR;
        if (what[l] == KMP_ATTEMPT_NONE || ends->on[l])
            continue;
        kmp_room_count_made(e, l);
        e->results[room->who[l]].rhs += 11 + (what[l] == KMP_ATTEMPT_TAKEN);
        if (what[l] == KMP_ATTEMPT_TAKEN && !seen->quiet[l])
            what[l] = room->bad[l] != 0                     ? KMP_ATTEMPT_BAD_STAGE
                      : kmp_lane_consents(e, pool, seen, l) ? KMP_ATTEMPT_TAKEN
                                                            : KMP_ATTEMPT_BAD_STEP;
    }
    memset(room->bad, 0, room->w * sizeof *room->bad);
    bool searched[KMP_LANES_MOST] = {false};
    bool dense = e->conditions && kmp_taken_watch(e, pool, seen, what, searched);
    if (kmp_measures_steps(e))
        kmp_taken_measure(e, pool, dense ? searched : NULL, what);
    bool none_stays = true;
    for (size_t l = 0; l < room->w; l++) {
        ends->stays[l] = what[l] != KMP_ATTEMPT_TAKEN;
        none_stays = none_stays && !ends->stays[l];
    }
    pass_on(e, none_stays ? NULL : ends->stays);
    for (size_t l = 0; l < room->w && status == KEMPE_OK; l++) {
        if (ends->on[l])
            continue;
        if (what[l] == KMP_ATTEMPT_TAKEN)
            status = take(e, pool, seen, l);
        else if (what[l] == KMP_ATTEMPT_EVENT)
            status = pass_event(e, pool, l);
        else if (what[l] != KMP_ATTEMPT_NONE && what[l] != KMP_ATTEMPT_AGAIN)
            refuse(e, l, what[l]);
    }
    return status;
}

/* Makes one attempt in all lanes. */
static kempe_status step(kmp_engine *e, kmp_lane_group *pool)
{
    kmp_lane_state *room = &e->room;
    int64_t all[KMP_LANES_MOST];
    kmp_lane_attempts ends;
    kmp_lane_watched seen;
    choose_tries(e);
    for (size_t l = 0; l < room->w; l++) {
        all[l] = true;
        e->work.lane_steps += room->who[l] >= 0;
    }
    e->work.sweeps++;
    kmp_room_run_stages(e, pool);
    solve(e, ends.failed);
    memcpy(room->at, room->t_new, room->w * sizeof *room->at);
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_RENEW, all);
    kmp_room_evaluate(e, pool, room->y_new, room->k[13]);
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_ALONE, NULL);
    if (room->nu)
        memcpy(room->nu_end, room->nu_now, room->w * (size_t)e->m * sizeof *room->nu);
    kmp_lanes_watch(e, pool, &seen);
    kmp_lanes_pass_on(room->w, room, seen.quiet, &ends);
    if (!ends.all)
        return end_attempts(e, pool, &seen, &ends);
    pass_on(e, ends.none_stays ? NULL : ends.stays);
    return KEMPE_OK;
}

/* -- a pool ------------------------------------------------------------------------------------------ */

/* Fills empty lanes; *fresh: some lane is new, or its slope is. Returns the number of active lanes. */
static size_t refill(kmp_engine *e, kmp_lane_group *pool, bool *fresh)
{
    kmp_lane_state *room = &e->room;
    size_t active = 0;
    *fresh = room->anew;
    room->anew = false;
    if (!room->gaps)
        return room->w;
    room->gaps = false;
    for (size_t l = 0; l < room->w; l++) {
        int i = room->who[l] < 0 ? kmp_lane_group_take(e, pool) : -1;
        if (i >= 0) {
            kmp_room_load(e, pool, l, i);
            *fresh = true;
        }
        active += room->who[l] >= 0;
        room->gaps = room->gaps || room->who[l] < 0;
    }
    return active;
}

/* True if another pool fills all lanes, and this one fewer than half of them. */
static bool makes_room(const kmp_engine *e, const kmp_lane_group *pool, size_t active)
{
    for (int k = 0; 2 * active < e->room.w && pool->waiting == 0 && k < e->pool_count; k++)
        if (e->pools[k] != pool && e->pools[k]->waiting >= (int)e->room.w)
            return true;
    return false;
}

/* Keeps the base of a lane's sines. false: no memory. */
static bool keep_base(kmp_engine *e, const kmp_lane_group *pool, size_t l)
{
    kmp_instance *x = &e->instances[e->room.who[l]];
    size_t size = kmp_lanes_base_size(pool->lanes);
    if (size > x->base_size) {
        x->base = KMP_ARENA_NEW(&e->arena, double, size);
        x->base_size = x->base ? size : 0;
    }
    if (x->base)
        kmp_lanes_get_base(pool->lanes, (int)l, x->base);
    return x->base || size == 0;
}

kempe_status kmp_lane_group_run(kmp_engine *e, kmp_lane_group *pool)
{
    kempe_status status = KEMPE_OK;
    bool fresh;
    e->running = pool;
    e->p = pool->part.p;
    e->r = pool->part.r;
    e->size = e->n + e->p + e->s->dissipative;
    for (size_t l = 0; l < e->room.w; l++)
        kmp_room_empty(&e->room, l);
    while (status == KEMPE_OK && !kmp_interrupted(e->context)) {
        size_t active = refill(e, pool, &fresh);
        if (active == 0 || makes_room(e, pool, active))
            break;
        if (fresh)
            kmp_room_begin(e, pool);
        status = step(e, pool);
        if (status == KEMPE_OK)
            status = kmp_room_run_expelled(e, pool);
    }
    /* Instances that go on later leave their lanes. */
    bool kept = true;
    for (size_t l = 0; l < e->room.w; l++)
        if (e->room.who[l] >= 0) {
            kept = keep_base(e, pool, l) && kept;
            kmp_room_store(e, l);
            kmp_lane_group_put(e, pool, e->room.who[l]);
            kmp_room_empty(&e->room, l);
        }
    e->running = NULL;
    return kept ? status : kmp_fail_memory(e->context);
}
