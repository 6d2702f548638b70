/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853 on the lanes of a pool: an attempt of a step in every lane, then for each lane the decisions of rk.c and
 * reduced.c. Lanes of instances that have finished, or that another pool continues, are filled again. */
#include "constraints/closing/charts.h"
#include "constraints/tolerances.h"
#include "integrators/formulations/formulation.h"
#include "integrators/lanes/ensemble_inside.h"
#include "integrators/steppers/rk.h"
#include <math.h>
#include <string.h>

enum { MOST_TRIES = 1000, MOST_NEWTON = 12 };

/* Result of an attempt in a lane. */
/* EVENT: taken up to an event within it. AGAIN: up to an event, with the step in the room. */
typedef enum outcome { EMPTY, TAKEN, EVENT, AGAIN, BAD_ERROR, BAD_STAGE, BAD_STEP } outcome;

/* -- room -------------------------------------------------------------------------------------------- */

bool kmp_lane_room_init(kmp_engine *e, int width)
{
    kmp_lane_room *room = &e->room;
    size_t w = (size_t)width, size = (size_t)kmp_lane_most(e), n = (size_t)e->n, m = (size_t)e->m;
    *room = (kmp_lane_room){.w = w};
    for (size_t l = 0; l < KMP_LANES_MOST; l++)
        room->who[l] = -1;
    kmp_arena *a = &e->run_arena;
    double **vectors[] = {&room->y, &room->y_new, &room->stage, &room->weight, &room->atol};
    for (size_t k = 0; k < sizeof vectors / sizeof *vectors; k++)
        *vectors[k] = kmp_arena_aligned(a, w * size);
    for (size_t k = 1; k <= (kmp_measures_steps(e) || e->s->events.count > 0 ? 16 : 13); k++)
        room->k[k] = kmp_arena_aligned(a, w * size);
    room->scale = kmp_arena_aligned(a, w * n);
    room->late = kmp_has_late_conditions(e->s);
    room->vdd = room->vdd_new = NULL;
    if (e->s->changes_by_rates) {
        room->vdd = kmp_arena_aligned(a, w * (n + m));
        room->vdd_new = kmp_arena_aligned(a, w * (n + m));
        room->vdd_middle = kmp_arena_aligned(a, w * (n + m));
    }
    room->nu = room->nu_now = room->nu_end = NULL;
    if (e->s->load_row_count > 0) {
        room->nu = kmp_arena_aligned(a, w * m);
        room->nu_now = kmp_arena_aligned(a, w * m);
        room->nu_end = kmp_arena_aligned(a, w * m);
    }
    room->row_scale = kmp_arena_aligned(a, w * m);
    room->per_scale = kmp_arena_aligned(a, w * n);
    room->per_row_scale = kmp_arena_aligned(a, w * m);
    room->square = KMP_ARENA_NEW(a, double, m *n);
    room->at = kmp_arena_aligned(a, w * (1 + KMP_TIME_NUMBERS * (size_t)e->s->model->input_count));
    return !a->failed;
}

/* -- evaluation -------------------------------------------------------------------------------------- */

/* The inputs of each lane at its time. */
static void put_inputs(kmp_engine *e)
{
    kmp_lane_room *room = &e->room;
    for (size_t l = 0; l < room->w && e->s->model->input_count > 0; l++) {
        const kmp_present_inputs *inputs = room->who[l] >= 0 ? &e->instances[room->who[l]].inputs : NULL;
        const double *now = inputs ? kmp_present_inputs_at(inputs, room->at[l]) : NULL;
        for (size_t k = 1; now && k < (size_t)kmp_present_inputs_size(inputs); k++)
            room->at[k * room->w + l] = now[k];
    }
}

/* Finds the time that the next steps of a lane do not go beyond: the end of the run, the next jump of an input, or the
 * next sample of a state. */
static void find_limit(kmp_engine *e, size_t l)
{
    const kmp_instance *x = &e->instances[e->room.who[l]];
    e->room.until[l] = kmp_present_inputs_until(&x->inputs);
    e->room.limit[l] = kmp_first_limit(x->next_sample, e->room.until[l], e->spec.t_end);
}

/* True if the multipliers of a lane satisfy the equations up to rounding (settle of load_multipliers.c). *energy: the
 * largest residual times the scale of its row, and before that of the pass before. */
static bool is_settled(const kmp_engine *e, const kmp_pool *pool, const double *out, size_t l, double *energy)
{
    const kmp_lane_room *room = &e->room;
    size_t w = room->w, n = (size_t)e->n;
    double size = 0, most = 0, before = *energy;
    for (size_t i = 0; i < n; i++)
        size = fmax(size, fabs(out[i * w + l]) * room->scale[i * w + l]);
    for (size_t j = 0; j < (size_t)pool->layout.loads; j++) {
        size_t row = (size_t)pool->load_row[j] * w + l;
        double residual = out[(n + j) * w + l], nu = room->nu_now[row];
        size = fmax(size, fmax(fabs(nu), fabs(nu + residual)) * room->row_scale[row]);
        most = fabs(residual) <= DBL_MAX ? fmax(most, fabs(residual) * room->row_scale[row]) : INFINITY;
    }
    *energy = most;
    return most <= KMP_LOAD_ROUNDING * size || (most <= KMP_LOAD_ROUNDED * size && !(most < 0.5 * before));
}

/* Solves for the multipliers that forces depend on, in each lane from those in the room. Lanes without a solution are
 * marked in `bad`. */
static void settle_loads(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    size_t w = room->w, loads = (size_t)pool->layout.loads;
    double energy[KMP_LANES_MOST];
    bool settled[KMP_LANES_MOST] = {false}, all = false;
    memcpy(room->nu_now, room->nu, w * (size_t)e->m * sizeof *room->nu);
    for (size_t l = 0; l < w; l++)
        energy[l] = INFINITY;
    (void)kmp_lanes_run(pool->lanes, KMP_FUSED_CLOSE);
    for (int pass = 0; !all && pass <= MOST_NEWTON; pass++) {
        kmp_lanes_set(pool->lanes, KMP_IN_LAMBDA, room->nu_now);
        const double *out = kmp_lanes_run(pool->lanes, KMP_FUSED_RATES);
        all = true;
        for (size_t l = 0; l < w; l++) {
            settled[l] = settled[l] || room->who[l] < 0 || is_settled(e, pool, out, l, &energy[l]);
            all = all && settled[l];
            for (size_t j = 0; j < loads && !settled[l] && pass < MOST_NEWTON; j++)
                room->nu_now[(size_t)pool->load_row[j] * w + l] += out[((size_t)e->n + loads + j) * w + l];
        }
    }
    for (size_t l = 0; l < w; l++)
        room->bad[l] += !settled[l];
}

/* k = f(at, y) in all lanes, whose unknowns the program has; failed evaluations are marked in `bad`. */
static void evaluate_placed(kmp_engine *e, kmp_pool *pool, const double *y, double *k)
{
    kmp_lane_room *room = &e->room;
    if (pool->timed) {
        put_inputs(e);
        kmp_lanes_set(pool->lanes, KMP_IN_TIME, room->at);
    }
    if (room->nu)
        settle_loads(e, pool);
    kmp_lanes_run_in_place(pool->lanes, pool->slopes);
    const kmp_lanes_slopes slopes = {(size_t)e->p, (size_t)e->r, e->s->dissipative, y, pool->output, k, room->bad};
    kmp_lanes_publish(room->w, &slopes);
}

/* The same where the program does not have them yet. */
static void evaluate(kmp_engine *e, kmp_pool *pool, const double *y, double *k)
{
    kmp_lanes_set(pool->lanes, KMP_IN_Q, y);
    evaluate_placed(e, pool, y, k);
}

static void set_times(kmp_lane_room *room, double c)
{
    for (size_t l = 0; l < room->w; l++)
        room->at[l] = room->t[l] + c * room->step[l];
}

/* -- in and out -------------------------------------------------------------------------------------- */

static void load(kmp_engine *e, kmp_pool *pool, size_t l, int i)
{
    kmp_lane_room *room = &e->room;
    const kmp_instance *x = &e->instances[i];
    size_t w = room->w;
    const double *scale = x->constants.numbers + e->parameters, *row_scale = scale + e->n;
    room->who[l] = i;
    room->t[l] = x->t;
    room->h[l] = x->h;
    room->error_old[l] = x->error_old;
    room->pivot[l] = x->pivot;
    room->exchange[l] = x->limit;
    room->rejected[l] = x->rejected;
    room->tries[l] = x->tries;
    for (size_t k = 0; k < KMP_SIGN_WORDS; k++)
        room->negative[k * w + l] = x->signs.negative[k];
    if (x->signs.known)
        kmp_lanes_put_base(pool->lanes, (int)l, x->base);
    find_limit(e, l);
    for (int k = 0; k < e->size; k++) {
        room->y[(size_t)k * w + l] = x->y[k];
        room->k[1][(size_t)k * w + l] = x->dy[k];
    }
    for (int k = 0; k < e->n; k++)
        room->scale[(size_t)k * w + l] = scale[k];
    for (int k = 0; k < e->n; k++)
        room->per_scale[(size_t)k * w + l] = 1 / scale[k];
    for (int k = 0; k < e->m; k++)
        room->row_scale[(size_t)k * w + l] = row_scale[k];
    for (int k = 0; k < e->m; k++)
        room->per_row_scale[(size_t)k * w + l] = 1 / row_scale[k];
    double *atol = room->atol + l;
    for (int k = 0; k < e->p; k++)
        kmp_formulation_tolerances(e->s, pool->part.u[k], e->spec.atol * scale[pool->part.u[k]], x->rate_scale,
                                   &atol[(size_t)k * w], &atol[(size_t)(e->p + k) * w]);
    for (int k = 0; k < e->r; k++)
        atol[(size_t)(2 * e->p + k) * w] = e->spec.atol * scale[pool->part.v[k]];
    if (e->s->dissipative)
        atol[(size_t)(2 * e->p + e->r) * w] = KMP_UNCONTROLLED;
    kmp_lanes_set_one(pool->lanes, KMP_IN_PARAMETER, (int)l, x->constants.numbers);
    for (int k = 0; room->vdd && k < e->n + e->m; k++)
        room->vdd[(size_t)k * w + l] = x->vdd[k];
    for (int k = 0; room->nu && k < e->m; k++)
        room->nu[(size_t)k * w + l] = x->nu[k];
    kmp_lane_constants(e, pool, l);
    kmp_lane_conditions_load(e, pool, l);
}

/* Takes the steps of a lane that needed no decision into the account of its instance; the next one needs one. */
static void count_made(kmp_engine *e, size_t l)
{
    kmp_lane_room *room = &e->room;
    kmp_ensemble_result *result = &e->results[room->who[l]];
    result->steps += (long)room->made[l];
    result->rejected += (long)room->repeated[l];
    result->rhs += 12 * (long)room->made[l] + 11 * (long)room->repeated[l];
    room->made[l] = room->repeated[l] = room->spare[l] = 0;
}

/* Copies the state of a lane to its instance. */
static void store(kmp_engine *e, size_t l)
{
    kmp_lane_room *room = &e->room;
    kmp_instance *x = &e->instances[room->who[l]];
    count_made(e, l);
    x->t = room->t[l];
    x->h = room->h[l];
    x->error_old = room->error_old[l];
    x->pivot = room->pivot[l];
    x->rejected = room->rejected[l];
    for (size_t k = 0; k < KMP_SIGN_WORDS; k++)
        x->signs.negative[k] = room->negative[k * room->w + l];
    x->tries = (int)room->tries[l];
    for (int k = 0; k < e->size; k++) {
        x->y[k] = room->y[(size_t)k * room->w + l];
        x->dy[k] = room->k[1][(size_t)k * room->w + l];
    }
    for (int k = 0; room->vdd && k < e->n + e->m; k++)
        x->vdd[k] = room->vdd[(size_t)k * room->w + l];
    for (int k = 0; room->nu && k < e->m; k++)
        x->nu[k] = room->nu[(size_t)k * room->w + l];
}

static void empty(kmp_lane_room *room, size_t l)
{
    room->who[l] = -1;
    room->step[l] = 0;
    room->error_old[l] = 1;
    room->made[l] = room->repeated[l] = room->spare[l] = 0;
    room->gaps = true;
}

/* Leaves the instance of a lane to a separate run, from its last accepted step on. */
static void expel(kmp_engine *e, size_t l, const char *why)
{
    kmp_lane_room *room = &e->room;
    store(e, l);
    e->results[room->who[l]].why = why;
    room->out[room->out_count++] = room->who[l];
    empty(room, l);
}

/* Runs the parts of instances that have been expelled. */
static kempe_status run_expelled(kmp_engine *e, kmp_pool *pool)
{
    kempe_status status = KEMPE_OK;
    for (int k = 0; k < e->room.out_count && status == KEMPE_OK; k++) {
        int i = e->room.out[k];
        const kmp_instance *x = &e->instances[i];
        double margin = x->seen_t >= 0 ? fmin(1, x->seen_margin) : 1;
        status = kmp_instance_apart(e, pool, i, margin, e->results[i].why);
    }
    e->room.out_count = 0;
    return status;
}

/* -- first steps ------------------------------------------------------------------------------------- */

/* sum of ((a - b) / w)^2 of a lane; b NULL: 0 */
static double weighted_square(const kmp_engine *e, size_t l, const double *a, const double *b)
{
    const kmp_lane_room *room = &e->room;
    double sum = 0;
    for (size_t k = l; k < (size_t)e->size * room->w; k += room->w) {
        double weight = room->atol[k] + e->spec.rtol * fabs(room->y[k]), x = (b ? a[k] - b[k] : a[k]) / weight;
        sum += x * x;
    }
    return sum;
}

/* Hairer's hinit, as in rk.c; an instance whose evaluation fails is left to a separate run. */
static void choose_steps(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    double slope[KMP_LANES_MOST] = {0};
    for (size_t l = 0; l < room->w; l++) {
        const kmp_instance *x = room->who[l] >= 0 ? &e->instances[room->who[l]] : NULL;
        room->step[l] = room->bad[l] = 0;
        if (!x || x->has_step)
            continue;
        slope[l] = weighted_square(e, l, room->k[1], NULL);
        double size = weighted_square(e, l, room->y, NULL);
        double h = slope[l] <= 1e-10 || size <= 1e-10 ? 1e-6 : 0.01 * sqrt(size / slope[l]);
        room->step[l] = fmin(h, room->limit[l] - room->t[l]);
    }
    for (size_t k = 0; k < (size_t)e->size * room->w; k++)
        room->stage[k] = room->y[k] + room->step[k % room->w] * room->k[1][k];
    set_times(room, 1);
    evaluate(e, pool, room->stage, room->k[2]);
    for (size_t l = 0; l < room->w; l++) {
        kmp_instance *x = room->who[l] >= 0 ? &e->instances[room->who[l]] : NULL;
        if (!x || x->has_step)
            continue;
        x->has_step = true;
        e->results[room->who[l]].rhs++;
        double h = room->step[l], curvature = sqrt(weighted_square(e, l, room->k[2], room->k[1])) / h;
        double most = fmax(curvature, sqrt(slope[l]));
        double h1 = most <= 1e-15 ? fmax(1e-6, 1e-3 * h) : pow(0.01 / most, 1.0 / kmp_dop853.numbers.order);
        room->h[l] = fmin(fmin(100 * h, h1), room->limit[l] - room->t[l]);
        if (room->bad[l] != 0)
            expel(e, l, "a right-hand side that cannot be evaluated");
    }
}

/* Accelerations of v from the slopes and the values of the last stage there: Bvu udd and the part that does not depend
 * on udd. Then, after n numbers, the multipliers where conditions need them; dropped rows have none. */
static void find_accelerations(const kmp_engine *e, const kmp_pool *pool, const double *end, const double *slope,
                               double *vdd)
{
    size_t w = e->room.w, p = (size_t)e->p, r = (size_t)e->r;
    size_t closures = (size_t)kmp_written_closure_count(e->s);
    const double *b = end + (size_t)(pool->layout.multipliers + pool->layout.pivots) * w + closures * w;
    const double *a0 = b + (p * r + r) * w, *udd = slope + p * w;
    memcpy(vdd, a0, r * w * sizeof *vdd);
    for (size_t c = 0; c < p; c++)
        for (size_t k = 0; k < r * w; k++)
            vdd[k] += b[c * r * w + k] * udd[c * w + k % w];
    if (!e->room.late)
        return;
    double *lambda = vdd + (size_t)e->n * w;
    memset(lambda, 0, (size_t)e->m * w * sizeof *lambda);
    for (size_t i = 0; i < r; i++)
        memcpy(lambda + (size_t)pool->part.rows[i] * w, a0 + (r + i) * w, w * sizeof *lambda);
}

/* Computes slopes, signs and first steps of new lanes. */
static void begin_lanes(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    bool choose = false;
    for (size_t l = 0; l < room->w; l++)
        room->step[l] = room->bad[l] = 0;
    (void)kmp_lanes_run(pool->lanes, KMP_STAGE_PARAMETERS);
    kmp_lanes_constants(e, pool);
    kmp_conditions_constants(e);
    set_times(room, 0);
    int64_t renewed[KMP_LANES_MOST];
    for (size_t l = 0; l < room->w; l++)
        renewed[l] = room->who[l] >= 0 && !e->instances[room->who[l]].signs.known;
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_RENEW, renewed);
    evaluate(e, pool, room->y, room->k[2]);
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_ALONE, NULL);
    const double *end = kmp_lanes_run(pool->lanes, KMP_FUSED_END), *pivot = kmp_lanes_pivots(e, pool, end);
    uint64_t negative[KMP_SIGN_WORDS * KMP_LANES_MOST];
    kmp_lanes_signs(room->w, pool->layout.pivots, pool->pivot_block, pivot, negative);
    if (room->vdd)
        find_accelerations(e, pool, end, room->k[2], room->vdd_new);
    for (size_t l = 0; l < room->w; l++) {
        kmp_instance *x = room->who[l] >= 0 ? &e->instances[room->who[l]] : NULL;
        if (!x || x->signs.known)
            continue;
        if (room->bad[l] != 0) {
            expel(e, l, "a right-hand side that cannot be evaluated");
            continue;
        }
        x->signs.known = true;
        for (size_t k = l; k < KMP_SIGN_WORDS * room->w; k += room->w)
            room->negative[k] = negative[k];
        room->pivot[l] = 0;
        for (size_t k = l; room->vdd && k < ((size_t)e->n + (size_t)e->m) * room->w; k += room->w)
            room->vdd[k] = room->vdd_new[k];
        for (size_t k = l; room->nu && k < (size_t)e->m * room->w; k += room->w)
            room->nu[k] = room->nu_now[k];
        if (x->has_slope)
            continue;
        for (size_t k = l; k < (size_t)e->size * room->w; k += room->w)
            room->k[1][k] = room->k[2][k];
        x->has_slope = true;
        e->results[room->who[l]].rhs++;
        choose = choose || !x->has_step;
    }
    if (choose)
        choose_steps(e, pool);
}

/* -- one attempt ------------------------------------------------------------------------------------- */

#define TERMS(a) ((int)(sizeof(a) / sizeof *(a)))

#define STAGE(number, a, ...)                                                                                          \
    do {                                                                                                               \
        const kmp_lanes_sum sum = {room->y,     room->step, TERMS(a), a, (const double *const[]){__VA_ARGS__},         \
                                   room->stage, pool->place};                                                          \
        kmp_lanes_combine(room->w, (size_t)e->size, &sum);                                                             \
        if (pool->timed)                                                                                               \
            set_times(room, kmp_dop853_c[number]);                                                                     \
        evaluate_placed(e, pool, room->stage, k[number]);                                                              \
    } while (0)

static void run_stages(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    double **k = room->k;
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_NEAR, NULL);
    KMP_DOP853_STAGES(STAGE, k);
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_ALONE, NULL);
}

/* Chooses the steps to try; an instance with too small a step is left to a separate run. */
static void choose_tries(kmp_engine *e)
{
    kmp_lane_room *room = &e->room;
    double longest = e->spec.max_step > 0 ? e->spec.max_step : INFINITY;
    int64_t none;
    const kmp_lanes_tries tries = {room->who, longest, room->t, room->limit, room->h, room->step, room->t_new, &none};
    kmp_lanes_choose_tries(room->w, &tries);
    memset(room->bad, 0, room->w * sizeof *room->bad);
    for (size_t l = 0; none && l < room->w; l++)
        if (room->step[l] == 0 && room->who[l] >= 0)
            expel(e, l, "a step size that becomes too small");
}

/* -- control ----------------------------------------------------------------------------------------- */

static void refuse(kmp_engine *e, size_t l, outcome what)
{
    kmp_lane_room *room = &e->room;
    kmp_ensemble_result *result = &e->results[room->who[l]];
    double h = room->step[l];
    if (what == BAD_ERROR)
        result->rejected++;
    else
        result->refused++;
    room->h[l] = what == BAD_ERROR ? room->next[l] : what == BAD_STAGE ? h / 4 : h / 2;
    room->rejected[l] = true;
    if (++room->tries[l] >= MOST_TRIES)
        expel(e, l, "a step size that becomes too small");
}

/* True if value or rate of an input jumps at t that a closure depends on. */
static bool moves_closure(const kempe_model *model, const kmp_present_inputs *inputs, double t)
{
    for (int k = 0; k < inputs->count; k++)
        if (inputs->piece[k].from == t && inputs->piece[k].jump < 2 && kmp_model_moved_by(model, k))
            return true;
    return false;
}

/* Goes on beyond a sample at which the step has ended: restarts where a value jumps (runner_inputs.c), at the site if
 * there is one (*meets). Returns the reason why it cannot. */
static const char *pass_sample(kmp_engine *e, size_t l, bool *meets)
{
    kmp_lane_room *room = &e->room;
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
    find_limit(e, l);
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
static bool is_uncentred(kmp_engine *e, const kmp_pool *pool, size_t l)
{
    const kmp_lane_room *room = &e->room;
    if (e->spec.own_angles || kmp_charts_count(e->s) == 0)
        return false;
    for (int k = 0; k < e->p; k++)
        e->state[pool->part.u[k]] = room->y[(size_t)k * room->w + l];
    for (int k = 0; k < e->r; k++)
        e->state[pool->part.v[k]] = room->y[(size_t)(2 * e->p + k) * room->w + l];
    for (int c = 0; c < kmp_charts_count(e->s); c++)
        if (kmp_chart_regular(e->s, c, e->state) < KMP_AXES_CENTRED)
            return true;
    return false;
}

void kmp_lanes_evaluate_within(kmp_engine *e, kmp_pool *pool, double place)
{
    kmp_lane_room *room = &e->room;
    kmp_lanes_within(e, place, room->stage);
    set_times(room, place);
    evaluate(e, pool, room->stage, room->k[2]);
}

/* Samples the quantities at a point of the interpolants. */
static void sample(kmp_engine *e, kmp_pool *pool, int point)
{
    kmp_lanes_evaluate_within(e, pool, kmp_lanes_place(point));
    kmp_lanes_sample(e, pool, point, e->room.stage, e->room.k[2]);
}

static void sample_end(kmp_engine *e, kmp_pool *pool, int point, const double *y, const double *slope)
{
    set_times(&e->room, point > 0);
    put_inputs(e);
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
    for (int point = every; point < last; point += every)
        sample(e, pool, point);
    sample_end(e, pool, last, room->y_new, room->k[13]);
}

/* Finds the accepted steps that must be measured, and passes over the others. Returns their number. */
static int find_measured(kmp_engine *e, kmp_pool *pool, const outcome *what, bool *measured)
{
    kmp_lane_room *room = &e->room;
    bool may_pass = kmp_lanes_may_pass(e, pool);
    int count = 0;
    if (may_pass) {
        kmp_lanes_prepare(e, true);
        sample_every(e, pool, 2);
    }
    for (size_t l = 0; l < room->w; l++) {
        measured[l] =
            what[l] == EVENT || (what[l] == TAKEN && !(may_pass && room->bad[l] == 0 && kmp_lane_pass(e, pool, l)));
        count += measured[l];
        room->bad[l] = 0;
    }
    return count;
}

/* The stages of the dense output. */
static void run_dense_stages(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    double **k = room->k;
    KMP_DOP853_DENSE_STAGES(STAGE, k);
    for (size_t l = 0; l < room->w; l++) {
        room->dense_bad[l] = room->bad[l] != 0;
        room->bad[l] = 0;
    }
}

/* The conditions in the middle of the steps, for lanes that both ends do not decide. */
static void look_at_middle(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    kmp_lanes_middle(e, room->stage);
    set_times(room, 0.5);
    evaluate(e, pool, room->stage, room->k[2]);
    for (size_t l = 0; l < room->w; l++) {
        room->dense_bad[l] = room->dense_bad[l] || room->bad[l] != 0;
        room->bad[l] = 0;
    }
    find_accelerations(e, pool, kmp_lanes_run(pool->lanes, KMP_FUSED_END), room->k[2], room->vdd_middle);
    kmp_lanes_conditions(e, pool, 2, room->stage, room->k[2], room->vdd_middle);
}

/* Searches the step of a lane for an event. It is made again, with half its length, where the dense output is less
 * exact. */
static outcome find_event(kmp_engine *e, kmp_pool *pool, size_t l)
{
    kmp_lane_room *room = &e->room;
    kmp_instance *x = &e->instances[room->who[l]];
    bool found = false;
    double shorter = 0;
    kmp_within_begin(e, pool, l);
    if (room->dense_bad[l] || !kmp_within_is_exact(e))
        return BAD_STEP;
    const char *why = kmp_lane_find_event(e, &room->event[l], &found, &shorter);
    kmp_within_end(e);
    if (why) {
        x->again = false;
        room->h[l] = room->step[l];
        expel(e, l, why);
        return EMPTY;
    }
    bool again = found && shorter > 0 && !x->again;
    x->again = again;
    if (found && !again)
        return EVENT;
    kmp_lane_set_modes(e, pool, l);
    room->h[l] = again ? shorter : room->h[l];
    return again ? AGAIN : TAKEN;
}

/* Finds the steps within which conditions change; `searched`: lanes whose stages of the dense output are counted.
 * Returns true if these stages are known. */
static bool watch_conditions(kmp_engine *e, kmp_pool *pool, const kmp_lane_watched *seen, outcome *what, bool *searched)
{
    kmp_lane_room *room = &e->room;
    double **k = room->k;
    bool dense = false;
    if (room->vdd)
        find_accelerations(e, pool, seen->multiplier, k[13], room->vdd_new);
    for (size_t l = 0; l < room->w; l++)
        room->at[l] = room->t_new[l];
    put_inputs(e);
    kmp_lanes_conditions(e, pool, 1, room->y_new, k[13], room->vdd_new);
    set_times(room, 0);
    put_inputs(e);
    kmp_lanes_conditions(e, pool, 0, room->y, k[1], room->vdd);
    for (size_t l = 0; l < room->w; l++) {
        searched[l] = what[l] == TAKEN && !kmp_lane_is_clear(e, l, false);
        dense = dense || searched[l];
    }
    if (!dense)
        return false;
    run_dense_stages(e, pool);
    bool middle = kmp_lanes_have_middle(e);
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
static outcome measure_one(kmp_engine *e, kmp_pool *pool, size_t l, double end, bool bad, outcome what)
{
    kmp_lane_room *room = &e->room;
    if (what == TAKEN && (bad || !kmp_lane_is_exact(e, l))) {
        e->instances[room->who[l]].again = false;
        room->h[l] = room->step[l];
        expel(e, l, KMP_LANE_NO_STATES);
        return EMPTY;
    }
    if (!bad && kmp_lane_measure(e, pool, l, end))
        return what;
    kmp_instance_leave(e, room->who[l], KMP_LANE_NO_STATES);
    empty(room, l);
    return EMPTY;
}

/* Takes the accepted steps into the accounts of their instances; `searched`: lanes whose stages of the dense output are
 * counted, NULL: these are not known. */
static void measure(kmp_engine *e, kmp_pool *pool, const bool *searched, outcome *what)
{
    kmp_lane_room *room = &e->room;
    bool measured[KMP_LANES_MOST];
    if (find_measured(e, pool, what, measured) == 0)
        return;
    if (!searched)
        run_dense_stages(e, pool);
    kmp_lanes_prepare(e, false);
    sample_every(e, pool, 1);
    for (size_t l = 0; l < room->w; l++) {
        bool bad = room->bad[l] != 0 || room->dense_bad[l];
        room->bad[l] = 0;
        if (!measured[l])
            continue;
        e->results[room->who[l]].rhs += searched && searched[l] ? 0 : 3;
        double end = what[l] == EVENT ? room->event[l] : room->t_new[l];
        if (end > room->t[l])
            what[l] = measure_one(e, pool, l, end, bad, what[l]);
    }
}

/* True if nothing but the tests of kmp_lanes_find_quiet concerns an instance at the end of a step. */
static bool passes_quiet_steps(const kmp_engine *e, const kmp_pool *pool)
{
    return !e->conditions && !kmp_measures_steps(e) && pool->layout.multipliers == 0;
}

/* The dependent coordinate with the largest scaled |Bvu|, for one degree of freedom; otherwise -1. */
static int largest_growth(const kmp_engine *e, const kmp_pool *pool, const kmp_lane_watched *seen, size_t l)
{
    const kmp_lane_room *room = &e->room;
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

/* Continues a lane, finishes its instance, or leaves it to another pool or a separate run. */
static kempe_status take(kmp_engine *e, kmp_pool *pool, const kmp_lane_watched *seen, size_t l)
{
    kmp_lane_room *room = &e->room;
    int i = room->who[l];
    kmp_instance *x = &e->instances[i];
    double h = room->step[l], error = room->error[l];
    bool collapsed = kmp_step_collapsed(&x->hopeless, h, room->t_new[l]);
    kmp_ensemble_result *result = &e->results[i];
    result->steps++;
    room->h[l] = room->rejected[l] && h < room->next[l] ? h : room->next[l];
    room->error_old[l] = error > KMP_RK_ERROR_FLOOR ? error : KMP_RK_ERROR_FLOOR;
    x->again = false;
    room->rejected[l] = room->tries[l] = 0;
    room->t[l] = room->t_new[l];
    bool through = !(room->t[l] < e->spec.t_end), meets = false;
    long tried = result->steps + result->rejected + result->refused;
    bool slow = kmp_work_bound_passed(&x->bound, tried, room->t[l], e->spec.t_end, NULL);
    bool reorders = !through && pool->layout.multipliers > 0 && kmp_lane_order_is_bad(e, pool, seen, l);
    if (seen->quiet[l] && !collapsed && !slow && !reorders) {
        x->pace = 0;
        x->seen_margin = INFINITY;
        x->seen_t = -1;
        room->spare[l] = x->hopeless > 0 || !passes_quiet_steps(e, pool) ? 0 : kmp_work_bound_spare(&x->bound, tried);
        return KEMPE_OK;
    }
    const char *jump = through ? NULL : pass_sample(e, l, &meets);
    const char *why =
        through                                                    ? NULL
        : jump                                                     ? jump
        : collapsed                                                ? "a step size that becomes too small"
        : slow                                                     ? "too much work"
        : e->m > e->r && !kmp_lane_dropped_close(e, pool, seen, l) ? "redundant closure rows that do not close"
        : is_uncentred(e, pool, l)                                 ? KMP_LANE_SINGULAR_ANGLES
        : e->r > 0 && kmp_instance_nears_change(x, room->t[l], h, seen->margin[l]) ? "a change point during the run"
                                                                                   : NULL;
    bool changes = !through && !why && e->m > e->r && seen->rows[l] > KMP_ROWS_OUT;
    bool exchanges = !through && !why && !changes && e->r > 0 && seen->growth[l] > x->limit;
    if (!through && !why && !changes && !exchanges && !reorders && !meets)
        return KEMPE_OK;
    int swapped = exchanges && !e->conditions && !e->site && !room->nu ? largest_growth(e, pool, seen, l) : -1;
    store(e, l);
    empty(room, l);
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
static kempe_status pass_event(kmp_engine *e, kmp_pool *pool, size_t l)
{
    kmp_lane_room *room = &e->room;
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
    bool known = e->site ? kmp_lane_look_at_event(e, room->event[l]) : kmp_lane_pass_event(e, room->event[l]);
    bool slow = known && kmp_work_bound_passed(&x->bound, result->steps + result->rejected + result->refused, x->t,
                                               e->spec.t_end, NULL);
    kempe_status status = KEMPE_OK;
    if (!known || slow)
        kmp_instance_leave(e, i, known ? "too much work" : "conditions that change back and forth");
    else if (e->site)
        status = kmp_instance_pass(e, pool, i, true, x->t - room->t[l]);
    kmp_within_end(e);
    empty(room, l);
    kmp_context_clear(e->context);
    return known && !slow && !e->site ? kmp_instance_resume(e, pool, i) : status;
}

/* Exchanges two arrays of the room, but for the lanes that stay; NULL: none does. */
static void exchange_taken(const kmp_lane_room *room, size_t size, const int64_t *stays, double **a, double **b)
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
    kmp_lane_room *room = &e->room;
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
    kmp_lane_room *room = &e->room;
    const kmp_dop853_step solution = {room->y,      room->step,  room->atol,   room->k,
                                      e->spec.rtol, room->y_new, room->weight, room->error};
    const kmp_lanes_control control = {
        room->step, room->error, room->error_old, kmp_dop853.numbers.shrink, kmp_dop853.numbers.grow, room->next};
    kmp_lanes_solution(room->w, (size_t)e->size, &solution);
    kmp_lanes_next_steps(room->w, kmp_dop853.numbers.exponent, &control);
    memcpy(failed, room->bad, room->w * sizeof *failed);
    for (size_t l = 0; l < room->w; l++)
        room->error[l] = failed[l] != 0 ? INFINITY : room->error[l];
    memset(room->bad, 0, room->w * sizeof *room->bad);
}

/* Decides on the attempts of the lanes that do not go on by themselves. */
static void decide(kmp_engine *e, kmp_pool *pool, kmp_lane_watched *seen, const kmp_lanes_passing *ends, outcome *what)
{
    kmp_lane_room *room = &e->room;
    for (size_t l = 0; l < room->w; l++) {
        what[l] = room->who[l] < 0 ? EMPTY : ends->failed[l] != 0 ? BAD_STAGE : room->error[l] <= 1 ? TAKEN : BAD_ERROR;
        if (what[l] == EMPTY || ends->on[l])
            continue;
        count_made(e, l);
        e->results[room->who[l]].rhs += 11 + (what[l] == TAKEN);
        if (what[l] == TAKEN && !seen->quiet[l])
            what[l] = room->bad[l] != 0 ? BAD_STAGE : kmp_lane_consents(e, pool, seen, l) ? TAKEN : BAD_STEP;
    }
}

/* Decides on the attempts of lanes that do not go on by themselves, and takes those that are accepted. */
static kempe_status end_attempts(kmp_engine *e, kmp_pool *pool, kmp_lane_watched *seen, const kmp_lanes_passing *ends)
{
    kmp_lane_room *room = &e->room;
    outcome what[KMP_LANES_MOST] = {EMPTY};
    kempe_status status = KEMPE_OK;
    decide(e, pool, seen, ends, what);
    memset(room->bad, 0, room->w * sizeof *room->bad);
    bool searched[KMP_LANES_MOST] = {false};
    bool dense = e->conditions && watch_conditions(e, pool, seen, what, searched);
    if (kmp_measures_steps(e))
        measure(e, pool, dense ? searched : NULL, what);
    bool none_stays = true;
    for (size_t l = 0; l < room->w; l++) {
        ends->stays[l] = what[l] != TAKEN;
        none_stays = none_stays && !ends->stays[l];
    }
    pass_on(e, none_stays ? NULL : ends->stays);
    for (size_t l = 0; l < room->w && status == KEMPE_OK; l++) {
        if (ends->on[l])
            continue;
        if (what[l] == TAKEN)
            status = take(e, pool, seen, l);
        else if (what[l] == EVENT)
            status = pass_event(e, pool, l);
        else if (what[l] != EMPTY && what[l] != AGAIN)
            refuse(e, l, what[l]);
    }
    return status;
}

/* Makes one attempt in all lanes. */
static kempe_status step(kmp_engine *e, kmp_pool *pool)
{
    kmp_lane_room *room = &e->room;
    double failed[KMP_LANES_MOST];
    int64_t on[KMP_LANES_MOST], stays[KMP_LANES_MOST], all[KMP_LANES_MOST];
    kmp_lane_watched seen;
    choose_tries(e);
    for (size_t l = 0; l < room->w; l++) {
        all[l] = true;
        e->work.lane_steps += room->who[l] >= 0;
    }
    e->work.sweeps++;
    run_stages(e, pool);
    solve(e, failed);
    memcpy(room->at, room->t_new, room->w * sizeof *room->at);
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_RENEW, all);
    evaluate(e, pool, room->y_new, room->k[13]);
    kmp_lanes_take_sines(pool->lanes, KMP_SINES_ALONE, NULL);
    if (room->nu)
        memcpy(room->nu_end, room->nu_now, room->w * (size_t)e->m * sizeof *room->nu);
    kmp_lanes_watch(e, pool, &seen);
    kmp_lanes_passing ends = {.quiet = seen.quiet,
                              .spare = room->spare,
                              .most_tries = MOST_TRIES - 1,
                              .failed = failed,
                              .step = room->step,
                              .t_new = room->t_new,
                              .next = room->next,
                              .error = room->error,
                              .t = room->t,
                              .h = room->h,
                              .error_old = room->error_old,
                              .made = room->made,
                              .repeated = room->repeated,
                              .rejected = room->rejected,
                              .tries = room->tries,
                              .on = on,
                              .stays = stays};
    kmp_lanes_pass_on(room->w, &ends);
    if (!ends.all)
        return end_attempts(e, pool, &seen, &ends);
    pass_on(e, ends.none_stays ? NULL : stays);
    return KEMPE_OK;
}

/* -- a pool ------------------------------------------------------------------------------------------ */

/* Fills empty lanes; *fresh: some lane is new, or its slope is. Returns the number of active lanes. */
static size_t refill(kmp_engine *e, kmp_pool *pool, bool *fresh)
{
    kmp_lane_room *room = &e->room;
    size_t active = 0;
    *fresh = room->anew;
    room->anew = false;
    if (!room->gaps)
        return room->w;
    room->gaps = false;
    for (size_t l = 0; l < room->w; l++) {
        int i = room->who[l] < 0 ? kmp_pool_take(e, pool) : -1;
        if (i >= 0) {
            load(e, pool, l, i);
            *fresh = true;
        }
        active += room->who[l] >= 0;
        room->gaps = room->gaps || room->who[l] < 0;
    }
    return active;
}

/* True if another pool fills all lanes, and this one fewer than half of them. */
static bool makes_room(const kmp_engine *e, const kmp_pool *pool, size_t active)
{
    for (int k = 0; 2 * active < e->room.w && pool->waiting == 0 && k < e->pool_count; k++)
        if (e->pools[k] != pool && e->pools[k]->waiting >= (int)e->room.w)
            return true;
    return false;
}

/* Keeps the base of a lane's sines. false: no memory. */
static bool keep_base(kmp_engine *e, const kmp_pool *pool, size_t l)
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

static bool park(kmp_engine *e, kmp_pool *pool)
{
    bool kept = true;
    for (size_t l = 0; l < e->room.w; l++)
        if (e->room.who[l] >= 0) {
            kept = keep_base(e, pool, l) && kept;
            store(e, l);
            kmp_pool_put(e, pool, e->room.who[l]);
            empty(&e->room, l);
        }
    return kept;
}

kempe_status kmp_pool_run(kmp_engine *e, kmp_pool *pool)
{
    kempe_status status = KEMPE_OK;
    bool fresh;
    e->running = pool;
    e->p = pool->part.p;
    e->r = pool->part.r;
    e->size = e->n + e->p + e->s->dissipative;
    for (size_t l = 0; l < e->room.w; l++)
        empty(&e->room, l);
    while (status == KEMPE_OK && !kmp_interrupted(e->context)) {
        size_t active = refill(e, pool, &fresh);
        if (active == 0 || makes_room(e, pool, active))
            break;
        if (fresh)
            begin_lanes(e, pool);
        status = step(e, pool);
        if (status == KEMPE_OK)
            status = run_expelled(e, pool);
    }
    bool kept = park(e, pool);
    e->running = NULL;
    return kept ? status : kmp_fail_memory(e->context);
}
