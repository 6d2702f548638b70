/* SPDX-License-Identifier: BSD-3-Clause */
/* An engine: the instances of one thread. Its pools stay from one chunk of a run to the next. */
#include "ensemble/lanes/ensemble_engine.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/tolerances.h"
#include "dynamics/motion.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/lane_state.h"
#include "ensemble/lanes/lane_steps.h"
#include "ensemble_start.h"
#include "integrators/decide/closing.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/run/runner_start.h"
#include "linalg/dense/dense.h"
#include "model/data/model_context.h"
#include "model/data/parameter.h"
#include "model/data/state.h"
#include "model/read/loads.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- tests at the end of a step ----------------------------------------------------------------------------- */

/* Tests of the lanes at the end of their steps, as in reduced.c, rank_margin.c and runner_change.c for one run.
 */

enum { MOST_COLUMNS = KMP_LANE_ROWS + KMP_LANE_FREEDOMS };

const double *kmp_lanes_pivots(const kmp_engine *e, const kmp_lane_group *pool, const double *end)
{
    return end + (size_t)pool->layout.multipliers * e->room.w;
}

/* Runs the last stage of a pool, and measures it. */
static void watch_lanes(kmp_engine *e, kmp_lane_group *pool, kmp_lane_watched *x)
{
    kmp_lane_state *room = &e->room;
    size_t w = room->w;
    x->multiplier = kmp_lanes_values(pool->lanes, KMP_REDUCED_PROGRAM_END);
    x->pivot = kmp_lanes_pivots(e, pool, x->multiplier);
    x->h = x->pivot + (size_t)pool->layout.pivots * w;
    x->jacobian = x->h + (size_t)e->m * w;
    x->b = x->jacobian + (size_t)(e->s->jacobian.count + (e->s->rheonomic ? e->m : 0)) * w;
    x->dv = x->b + (size_t)(e->r * e->p) * w;
    x->has_jacobian = false;
    kmp_lanes_run_in_place(pool->lanes, KMP_REDUCED_PROGRAM_END);
    kmp_lanes_gather(pool->lanes, KMP_REDUCED_PROGRAM_END, 0, (int)((x->jacobian - x->multiplier) / (ptrdiff_t)w));
    kmp_lanes_gather(pool->lanes, KMP_REDUCED_PROGRAM_END, (int)((x->b - x->multiplier) / (ptrdiff_t)w),
                     pool->program->outputs[KMP_REDUCED_PROGRAM_END + 1] -
                         pool->program->outputs[KMP_REDUCED_PROGRAM_END]);
    kmp_lanes_measure(w, e, pool, x);
    kmp_lanes_signs(w, pool->layout.pivots, pool->pivot_block, x->pivot, x->negative);
    memset(x->quiet, 0, sizeof x->quiet);
    if (e->r > 0 && e->m == e->r && kmp_charts_count(e->s) == 0)
        kmp_lanes_find_quiet(w, e, pool, x);
}

/* The last pivot of the scaled J under complete pivoting, over the largest so far. */
static double margin_of(kmp_engine *e, const kmp_lane_watched *x, size_t l)
{
    const kmp_lane_state *room = &e->room;
    const kmp_pattern *pattern = &e->s->jacobian;
    kmp_instance *y = &e->instances[room->who[l]];
    double *a = room->square, largest[MOST_COLUMNS], pivots[KMP_LANE_ROWS];
    int rows[KMP_LANE_ROWS], columns[MOST_COLUMNS];
    memset(a, 0, (size_t)(e->m * e->n) * sizeof *a);
    for (int k = 0; k < pattern->count; k++) {
        size_t row = (size_t)pattern->row[k], col = (size_t)pattern->col[k];
        a[row + col * (size_t)e->m] =
            x->jacobian[(size_t)k * room->w + l] * room->scale[col * room->w + l] / room->row_scale[row * room->w + l];
    }
    kmp_pivots_complete(e->m, e->n, a, largest, rows, columns, pivots);
    y->usual = fmax(y->usual, pivots[e->r - 1]);
    return pivots[e->r - 1] / y->usual;
}

/* An entry of the scaled J, 0 outside its pattern. */
static double entry_of(const kmp_engine *e, const kmp_lane_watched *x, size_t l, int row, int col)
{
    const kmp_pattern *pattern = &e->s->jacobian;
    const kmp_lane_state *room = &e->room;
    for (int k = 0; k < pattern->count; k++)
        if (pattern->row[k] == row && pattern->col[k] == col)
            return x->jacobian[(size_t)k * room->w + l] * room->scale[(size_t)col * room->w + l] /
                   room->row_scale[(size_t)row * room->w + l];
    return 0;
}

/* The largest coefficient of a dropped row in the kept ones, J_dropped = T J_kept
 * (constraints/partition/rank_margin.h); infinite: these are dependent. */
static double dependence_of(const kmp_engine *e, const kmp_lane_group *pool, const kmp_lane_watched *x, size_t l)
{
    const kmp_partition *part = &pool->part;
    double *a = e->room.square, t[KMP_LANE_ROWS], most = 0;
    int pivot[KMP_LANE_ROWS], r = part->r;
    for (int i = 0; i < r; i++)
        for (int j = 0; j < r; j++) /* transposed */
            a[j + i * r] = entry_of(e, x, l, part->rows[i], part->v[j]);
    if (kmp_lu_factor(r, a, pivot))
        return INFINITY;
    for (int d = 0; d < part->m - r; d++) {
        for (int j = 0; j < r; j++)
            t[j] = entry_of(e, x, l, part->redundant[d], part->v[j]);
        kmp_lu_solve(r, a, pivot, 1, t);
        for (int j = 0; j < r; j++)
            most = fabs(t[j]) <= DBL_MAX ? fmax(most, fabs(t[j])) : INFINITY;
    }
    return most;
}

/* True if the formulation accepts a step (accept of reduced.c): the closures corrected, the choice of u and the margin
 * good. */
static bool lane_consents(kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x, size_t l)
{
    kmp_lane_state *room = &e->room;
    size_t w = room->w;
    x->margin[l] = INFINITY;
    x->rows[l] = 0;
    if (e->r == 0 || x->quiet[l])
        return true;
    if (!(x->residual[l] < KMP_CLOSED)) {
        kmp_last_correction *last = &e->instances[room->who[l]].corrected;
        if (!kmp_correction_is_small(x->correction[l], pool->part.m > pool->part.r, room->t[l], last))
            return false;
        for (int i = 0; i < e->r; i++)
            room->y_new[(size_t)(2 * e->p + i) * w + l] += x->dv[(size_t)i * w + l];
    }
    for (size_t k = l; k < KMP_SIGN_WORDS * w; k += w)
        if (x->negative[k] != room->negative[k])
            return false;
    /* As in looks_well of constraints/partition/rank_margin.c: the least pivot of Jv has not fallen far. */
    const double least = x->least[l], before = room->pivot[l];
    room->pivot[l] = least > before ? least : before;
    const bool well = before > 0 && least > KMP_MARGIN_CALLS * room->pivot[l];
    if (!well && !x->has_jacobian) {
        kmp_lanes_gather(pool->lanes, KMP_REDUCED_PROGRAM_END, (int)((x->jacobian - x->multiplier) / (ptrdiff_t)w),
                         (int)((x->b - x->multiplier) / (ptrdiff_t)w));
        x->has_jacobian = true;
    }
    x->margin[l] = well ? INFINITY : margin_of(e, x, l);
    x->rows[l] = well || e->m == e->r ? 0 : dependence_of(e, pool, x, l);
    return x->margin[l] >= KMP_MARGIN_DEEP && kmp_dropped_judge(x->rows[l]) != KMP_KEPT_LOST;
}

/* True if a run would step across a change point here (watch_margin of runner_change.c). */
static bool instance_nears_change(kmp_instance *x, double t, double h, double margin)
{
    if (isinf(margin)) { /* far from any change point */
        x->seen_margin = margin;
        x->seen_t = -1;
        return false;
    }
    double since = t - x->seen_t;
    double fall = since > 0 && x->seen_t >= 0 ? (x->seen_margin - margin) / since : 0;
    x->seen_margin = margin;
    x->seen_t = isnan(margin) ? -1 : t;
    return margin < fall * KMP_GROWING * h || margin < KMP_NEAR_SINGULAR_IN;
}

/* -- steps in lanes ----------------------------------------------------------------------------------------- */

/* DOP853 on the lanes of a pool: an attempt of a step in every lane, then for each lane the decisions of rk.c and
 * reduced.c. Lanes of instances that have finished, or that another pool continues, are filled again. */

/* -- one attempt ------------------------------------------------------------------------------------- */

/* Chooses the steps to try; an instance with too small a step is left to a separate run. */
static void choose_tries(kmp_engine *e)
{
    kmp_lane_state *room = &e->room;
    int64_t none;
    kmp_lanes_choose_tries(room->w, room, &none);
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

/* True for a motion that grows without end, as in a run (check_growth of run.c), which then reports it by name. Before
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
    const bool arrives = !(room->t[l] < x->end), through = arrives && !e->steps, rests = arrives && e->steps;
    bool meets = false;
    long tried = result->steps + result->rejected + result->refused;
    bool slow = kmp_work_bound_passed(&x->bound, tried, room->t[l], x->end, NULL) ||
                grows_without_end(e, pool, x, l, (double)tried);
    bool reorders = !through && pool->layout.multipliers > 0 &&
                    !kmp_writer_order_is_good(pool->layout.multipliers, pool->row, seen->multiplier + l,
                                              room->row_scale + l, room->w);
    if (seen->quiet[l] && !collapsed && !slow && !reorders) {
        x->pace = 0;
        x->seen_margin = INFINITY;
        x->seen_t = -1;
        room->spare[l] = x->hopeless > 0 || e->conditions || kmp_measures_steps(e) || pool->layout.multipliers > 0
                             ? 0
                             : spare_steps(x, tried);
        return KEMPE_OK;
    }
    const char *jump = arrives ? NULL : pass_sample(e, l, &meets);
    if (rests) /* the step has been cut, as at a sample */
        room->h[l] = x->pace = fmax(room->h[l], x->pace);
    const char *why = through     ? NULL
                      : jump      ? jump
                      : collapsed ? "a step size that becomes too small"
                      : slow      ? "too much work"
                      : kmp_dropped_open(e->r, pool->part.rows, e->m - e->r, pool->part.redundant, (ptrdiff_t)room->w,
                                         seen->h + l, room->row_scale + l, e->spec.atol + e->spec.rtol, 0) >= 0
                          ? "redundant constraint equations that stay open"
                      : is_uncentred(e, pool, l) ? KMP_LANE_SINGULAR_ANGLES
                      : e->r > 0 && instance_nears_change(x, room->t[l], h, seen->margin[l])
                          ? "a change point during the run"
                          : NULL;
    bool changes = !through && !why && e->m > e->r && kmp_dropped_judge(seen->rows[l]) != KMP_KEPT_WELL;
    bool exchanges = !through && !why && !changes && e->r > 0 && seen->growth[l] > x->limit;
    const bool goes_on = !through && !why && !changes && !exchanges && !reorders && !meets;
    if (goes_on && !rests)
        return KEMPE_OK;
    int swapped = exchanges && !e->conditions && !e->site && !room->nu ? largest_growth(e, pool, seen, l) : -1;
    kmp_room_store(e, l);
    kmp_room_empty(room, l);
    if (through)
        return kmp_instance_finish(e, pool, i);
    if (rests)
        kmp_lane_steps_show(e, pool, i);
    if (goes_on) {
        kmp_lane_group_put(e, pool, i);
        return KEMPE_OK;
    }
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

/* Passes the event of a lane: the instance continues from there with other conditions and the same step size. */
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
                                               x->end, NULL);
    kempe_status status = KEMPE_OK;
    if (known && e->steps)
        kmp_lane_steps_show_state(e, i);
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

/* Decides on the attempts of lanes that do not continue by themselves, and takes the accepted ones. */
static kempe_status end_attempts(kmp_engine *e, kmp_lane_group *pool, kmp_lane_watched *seen, kmp_lane_attempts *ends)
{
    kmp_lane_state *room = &e->room;
    kmp_attempt what[KMP_LANES_MOST] = {KMP_ATTEMPT_NONE};
    kempe_status status = KEMPE_OK;
    /* Decides on the attempts of the lanes that do not continue by themselves. */
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
            what[l] = room->bad[l] != 0                 ? KMP_ATTEMPT_BAD_STAGE
                      : lane_consents(e, pool, seen, l) ? KMP_ATTEMPT_TAKEN
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
    kmp_fused_sines_take(&pool->sines, KMP_SINES_RENEW, all);
    kmp_room_evaluate(e, pool, room->y_new, room->k[13]);
    kmp_fused_sines_take(&pool->sines, KMP_SINES_ALONE, NULL);
    if (room->nu)
        memcpy(room->nu_end, room->nu_now, room->w * (size_t)e->m * sizeof *room->nu);
    watch_lanes(e, pool, &seen);
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
    size_t size = pool->sines.size;
    if (size > x->base_size) {
        x->base = KMP_ARENA_NEW(&e->arena, double, size);
        x->base_size = x->base ? size : 0;
    }
    if (x->base)
        kmp_fused_sines_get(&pool->sines, (int)l, x->base);
    return x->base || size == 0;
}

/* Runs a pool until it is empty, or until another has more to do. */
static kempe_status lane_group_run(kmp_engine *e, kmp_lane_group *pool)
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
    /* Instances that continue later leave their lanes. */
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

/* -- constants --------------------------------------------------------------------------------------- */

void kmp_constants_keep(const kempe_system *s, kmp_system_constants *constants)
{
    int parameters = kmp_model_parameter_count(s->model);
    memcpy(constants->numbers, s->parameters, (size_t)parameters * sizeof(double));
    memcpy(constants->numbers + parameters, s->scale, (size_t)s->n * sizeof(double));
    memcpy(constants->numbers + parameters + s->n, s->row_scale, (size_t)s->m * sizeof(double));
    constants->length = s->length;
    constants->reach = s->reach;
}

void kmp_constants_take(kempe_system *s, const kmp_system_constants *constants)
{
    int parameters = kmp_model_parameter_count(s->model);
    memcpy(s->parameters, constants->numbers, (size_t)parameters * sizeof(double));
    memcpy(s->scale, constants->numbers + parameters, (size_t)s->n * sizeof(double));
    memcpy(s->row_scale, constants->numbers + parameters + s->n, (size_t)s->m * sizeof(double));
    s->length = constants->length;
    s->reach = constants->reach;
}

/* -- making one -------------------------------------------------------------------------------------- */

static kempe_status make(kmp_engine *e, const kempe_model *model, const char *const *names, bool apart)
{
    e->context = apart ? kmp_context_new_below(kmp_model_context(model)) : kmp_model_context(model);
    e->own_context = apart;
    if (!e->context)
        return KEMPE_E_MEMORY;
    KMP_TRY(kmp_variant_new_in(e->context, model, e->columns, names, &e->variant));
    KMP_TRY(kmp_system_of_variant(e->variant, &e->s));
    e->n = e->s->n;
    e->m = e->s->m;
    e->parameters = kmp_model_parameter_count(kmp_variant_model(e->variant));
    e->own.numbers = KMP_NEW(double, e->parameters + e->n + e->m);
    KMP_TRY(kmp_made(e->context, e->own.numbers));
    kmp_constants_keep(e->s, &e->own);
    return KEMPE_OK;
}

kempe_status kmp_engine_new(const kempe_model *model, int count, const char *const *names, bool apart,
                            kmp_engine **engine)
{
    KMP_MAKE(kmp_model_context(model), kmp_engine, e);
    e->columns = count;
    kempe_status status = make(e, model, names, apart);
    return KMP_GIVE_OR_FREE(status, engine, e, kmp_engine_free);
}

void kmp_engine_free(kmp_engine *e)
{
    if (!e)
        return;
    kempe_system_free(e->s);
    kmp_variant_free(e->variant);
    kmp_free(e->own.numbers);
    if (e->own_context)
        kempe_context_free(e->context);
    kmp_free(e);
}

/* -- a run ------------------------------------------------------------------------------------------- */

static bool make_lanes(kmp_engine *e, int width)
{
    kmp_partition *part = &e->swapped;
    *part = (kmp_partition){.n = e->n, .m = e->m};
    if (!KMP_ARENA_MAKE(&e->run_arena, KMP_ROOM(int, 2 * (e->n + e->m), &part->u),
                        KMP_ROOM(double, e->n + e->m, &part->pivots)))
        return false;
    part->v = part->u + e->n; /* in one block, as in any partition */
    part->rows = part->v + e->n;
    part->redundant = part->rows + e->m;
    return kmp_lane_state_init(e, width) && kmp_within_init(e) && kmp_conditions_init(e);
}

kempe_status kmp_engine_begin(kmp_engine *e, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                              kmp_ensemble_done *all)
{
    int width = execution->width;
    KMP_TRY(kmp_motion_need_bodies(e->s));
    e->spec = *spec;
    e->execution = *execution;
    e->all = all;
    e->work = (kmp_ensemble_work){.width = width};
    e->pulses.open = NULL;
    e->eval = kmp_eval_new(e->s, "tape");
    e->state = KMP_ARENA_NEW(&e->run_arena, double, 4 * e->n);
    bool lanes = !kmp_engine_no_lanes(e), ok = e->eval && e->state && (!lanes || make_lanes(e, width));
    KMP_TRY(kmp_made(e->context, ok && kmp_measuring_init(e)));
    return lanes ? kmp_site_init(e) : KEMPE_OK;
}

void kmp_engine_end(kmp_engine *e)
{
    for (int k = 0; k < e->pool_count; k++)
        kmp_lane_group_free(e->pools[k]);
    kmp_free(e->pools);
    e->pools = NULL;
    e->pool_count = 0;
    for (int k = 0; k < 2; k++) {
        kmp_lanes_free(e->beside[k]);
        e->beside[k] = NULL;
    }
    kmp_runner_site_free(e->site);
    e->site = NULL;
    e->measuring = NULL;
    e->conditions = NULL;
    kmp_eval_free(e->eval);
    kmp_arena_free(&e->run_arena);
    e->eval = NULL;
    kmp_constants_take(e->s, &e->own);
}

void kmp_engine_count(kmp_engine *e)
{
    long done = atomic_fetch_add_explicit(&e->all->done, 1, memory_order_relaxed) + 1;
    if (e->all->total > 0)
        kmp_progress(e->context, KMP_PROGRESS_STUDY, (double)done, (double)e->all->total, "instances");
}

/* -- a chunk ----------------------------------------------------------------------------------------- */

static kmp_lane_group *fullest(const kmp_engine *e)
{
    kmp_lane_group *pool = NULL;
    for (int k = 0; k < e->pool_count; k++)
        if (e->pools[k]->waiting > (pool ? pool->waiting : 0))
            pool = e->pools[k];
    return pool;
}

kempe_status kmp_engine_run_pools(kmp_engine *e)
{
    kempe_status status = KEMPE_OK;
    kmp_lane_group *pool;
    while (status == KEMPE_OK && !kmp_interrupted(e->context) && (pool = fullest(e)))
        status = lane_group_run(e, pool);
    for (int k = 0; k < e->pool_count; k++)
        while (kmp_lane_group_take(e, e->pools[k]) >= 0)
            ; /* the instances that an interrupt has left */
    e->work.native = e->pool_count > 0 && kmp_lanes_native(e->pools[0]->lanes);
    return status;
}

static kempe_status run_lanes(kmp_engine *e)
{
    kempe_status status = KEMPE_OK;
    for (int i = 0; i < e->count && status == KEMPE_OK && !kmp_interrupted(e->context); i++)
        status = kmp_instance_start(e, i);
    return status == KEMPE_OK ? kmp_engine_run_pools(e) : status;
}

bool kmp_engine_make_instances(kmp_engine *e)
{
    kmp_arena *a = &e->arena;
    int size = kmp_lane_most(e), events = e->s->events.count;
    size_t memory = e->site ? kmp_runner_memory_size(e->s) : 0;
    e->instances = KMP_ARENA_NEW(a, kmp_instance, e->count);
    for (int i = 0; i < e->count && !a->failed; i++) {
        kmp_instance *x = &e->instances[i];
        (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, size, &x->y, &x->dy), KMP_ROOM(double, events, &x->mode),
                             KMP_ROOM(kmp_condition_past, events, &x->past),
                             KMP_ROOM(double, e->s->changes_by_rates ? e->n + e->m : 0, &x->vdd),
                             KMP_ROOM(double, e->s->load_row_count > 0 ? e->m : 0, &x->nu),
                             KMP_ROOM(double, e->parameters + e->n + e->m, &x->constants.numbers));
        (void)kmp_present_inputs_init(&x->inputs, a, e->s->model);
        x->inputs.held = true;
        x->memory = KMP_ARENA_NEW(a, double, (memory + sizeof(double) - 1) / sizeof(double) + 1);
        x->next_sample = INFINITY;
        x->longest = e->spec.max_step > 0 ? e->spec.max_step : INFINITY;
        x->end = e->spec.t_end;
    }
    return !a->failed;
}

kempe_status kmp_engine_run(kmp_engine *e, int count, const double *values, kmp_ensemble_result *results, double *q,
                            double *qd)
{
    const char *why = kmp_engine_no_lanes(e);
    e->count = count;
    e->values = values;
    e->results = results;
    e->q = q;
    e->qd = qd;
    kempe_status status = kmp_made(e->context, kmp_engine_make_instances(e) && kmp_measuring_chunk(e));
    for (int i = 0; status == KEMPE_OK && why && i < count; i++)
        kmp_instance_leave(e, i, why);
    if (status == KEMPE_OK && !why)
        status = run_lanes(e);
    /* An instance still marked as stopped, but not by its own conditions, was interrupted. */
    for (int i = 0; i < e->count && status == KEMPE_OK && !kmp_interrupted(e->context); i++)
        if (e->results[i].alone) {
            status = kmp_instance_alone(e, i);
            e->work.alone++;
            kmp_engine_count(e);
        }
    kmp_arena_free(&e->arena);
    return status;
}
